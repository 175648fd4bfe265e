#pragma once

#include <Espalier/Core/RawVector.h>
#include <Espalier/Core/Vector.h>
#include <cstdint>
#include <string_view>
#include <vector>

namespace espalier {

struct Appearance;

/// What a part of a tree mesh is made of.
enum class MeshMaterial : std::uint8_t
{
    Bark,    ///< Tubes, seen from outside only.
    Surface, ///< Leaves, petals, berries: what is flat has one layer of triangles and two sides to look at.
    Leaves,  ///< Foliage of the species, cut out by the alpha of its texture; two sides.
    Cards,   ///< Pictures of a whole plant (Impostor.h), cut out likewise; one side.
};

/// "No organ" among the sources of a mesh: wood.
inline constexpr std::uint32_t kNoOrgan = 0xffffffffu;

/// What a vertex belongs to.
struct VertexSource
{
    std::uint32_t segment = 0;      ///< Of the skeleton: the vertex moves with it; kNoSegment at the base.
    std::uint32_t organ = kNoOrgan; ///< Of the whole plant: the vertices of one leaf, fruit or petal share a number.

    /// Of a leaf of the foliage, PlacedLeaf::lot: from its place alone, as its number is not. 0 of all else.
    float lot = 0;

    friend bool operator==(const VertexSource&, const VertexSource&) = default;
};

/// Linear RGB that colours are multiplied by, 255 for 1.
struct Tint
{
    std::uint8_t red = 255;
    std::uint8_t green = 255;
    std::uint8_t blue = 255;
    std::uint8_t alpha = 255; ///< Always 255: alpha of vertex colours would cut leaves.

    friend bool operator==(const Tint&, const Tint&) = default;
};

/// The tint nearest to a linear colour, each component in [0, 1].
[[nodiscard]] Tint tintOf(const Vec3& colour) noexcept;

/// A run of indices drawn with one material in one colour.
struct MeshPart
{
    MeshMaterial material = MeshMaterial::Bark;
    std::uint32_t firstIndex = 0;
    std::uint32_t indexCount = 0;
    /// Entry of Appearance::palette, Bark of 0 has the bark's own colour; of Leaves: the kind, in Appearance::leaves.
    std::uint16_t colour = 0;

    friend bool operator==(const MeshPart&, const MeshPart&) = default;
};

/// Which of a mesh's optional arrays are filled.
struct MeshStreams
{
    bool tints = false;
    bool sources = false;

    friend bool operator==(const MeshStreams&, const MeshStreams&) = default;
};

struct MeshCounts;

/// The triangles of one tree at one level of detail. Vertex arrays have equal length, but for those that may be
/// empty. Plant space: metres, Y up.
/// Triangles are counter-clockwise seen from where their normals point: outside, and to one side of flat surfaces,
/// whose normals are to be turned towards whoever looks. A plain value; `clear` keeps the memory.
struct TreeMesh
{
    RawVector<Vec3> positions; ///< Metres.
    RawVector<Vec3> normals;   ///< Unit.
    RawVector<Vec4> tangents;  ///< xyz unit, along +u, normal to the normal; w = +1 or -1 so that bitangent = w *
                               ///< cross(n, t), along +v (glTF).
    /// Bark, in repeats of the texture: u round the axis, v along it, growing towards the tip. Surfaces: their whole in
    /// [0, 1], v from where they are attached to their tip.
    RawVector<Vec2> uvs;
    RawVector<Tint> tints;            ///< Empty where all are white.
    RawVector<VertexSource> sources;  ///< Empty unless asked for.
    RawVector<std::uint32_t> indices; ///< Three a triangle, each below positions.size().
    std::vector<MeshPart> parts;      ///< Cover all indices, in order.

    void clear() noexcept;
    /// Takes the memory that `counts` asks for, all at once: nothing that is in the mesh changes.
    void reserve(const MeshCounts& counts);
    /// All vertex arrays to this length, those of `streams` included: new tints are white, new sources name nothing,
    /// and all else is to be written.
    void resizeVertices(std::size_t count, MeshStreams streams);

    friend bool operator==(const TreeMesh&, const TreeMesh&) = default;
};

/// What a mesh takes.
struct MeshCounts
{
    std::uint64_t vertices = 0;
    std::uint64_t indices = 0;
    std::uint32_t parts = 0;
    MeshStreams streams{};

    /// Of the arrays of a TreeMesh with so many, without parts.
    [[nodiscard]] std::uint64_t bytes() const noexcept;

    friend bool operator==(const MeshCounts&, const MeshCounts&) = default;
};

/// More indices than any mesh has: who counts stops at none.
inline constexpr std::uint64_t kCountAll = 0xffffffffffffffffu;

/// What there is in `mesh`.
[[nodiscard]] MeshCounts countsOf(const TreeMesh& mesh) noexcept;

/// Why there is no mesh, or none of what one of its makers adds.
enum class MeshResult : std::uint8_t
{
    Ok,
    EmptySkeleton,   ///< Nothing to draw; the mesh is untouched.
    UnsoundSkeleton, ///< Not isSound, or a coordinate, radius or size beyond Limits::coordinate; the mesh is untouched.
    TooManyVertices, ///< Limits::vertices would be exceeded; the mesh is untouched.
};

/// What to tell people: "it would exceed the limit vertices". Empty for Ok.
[[nodiscard]] std::string_view reasonOf(MeshResult result) noexcept;

/// Linear RGB of a part.
[[nodiscard]] Vec3 colourOf(const MeshPart& part, const Appearance& appearance) noexcept;

/// A stable hash of every array, bit for bit.
[[nodiscard]] std::uint64_t hashOf(const TreeMesh& mesh) noexcept;

} // namespace espalier
