#pragma once

#include <Espalier/Core/Vector.h>
#include <cstdint>
#include <string_view>
#include <vector>

namespace espalier {

struct Appearance;

/// What a part of a tree mesh is made of.
enum class MeshMaterial : std::uint8_t
{
    Bark,    ///< Closed tubes, seen from outside only.
    Surface, ///< Leaves, petals, berries: what is flat has one layer of triangles and two sides to look at.
};

/// A run of indices drawn with one material in one colour.
struct MeshPart
{
    MeshMaterial material = MeshMaterial::Bark;
    std::uint32_t firstIndex = 0;
    std::uint32_t indexCount = 0;
    std::uint16_t colour = 0; ///< Entry of Appearance::palette; Bark of 0 has the bark's own colour.

    friend bool operator==(const MeshPart&, const MeshPart&) = default;
};

/// The triangles of one tree at one level of detail. Vertex arrays have equal length. Plant space: metres, Y up.
/// Triangles are counter-clockwise seen from where their normals point: outside, and to one side of flat surfaces,
/// whose normals are to be turned towards whoever looks. A plain value; `clear` keeps the memory.
struct TreeMesh
{
    std::vector<Vec3> positions; ///< Metres.
    std::vector<Vec3> normals;   ///< Unit.
    std::vector<Vec4> tangents;  ///< xyz unit, along +u, normal to the normal; w = +1 or -1 so that bitangent = w *
                                 ///< cross(n, t), along +v (glTF).
    /// Bark, in repeats of the texture: u round the axis, v along it, growing towards the tip. Surfaces: their whole in
    /// [0, 1], v from where they are attached to their tip.
    std::vector<Vec2> uvs;
    std::vector<std::uint32_t> indices; ///< Three a triangle, each below positions.size().
    std::vector<MeshPart> parts;        ///< Cover all indices, in order.

    void clear() noexcept;

    friend bool operator==(const TreeMesh&, const TreeMesh&) = default;
};

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
