#pragma once

#include <Espalier/Core/Vector.h>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace espalier {

struct TreeMesh;
struct MeshCounts;

/// What of a vertex an attribute holds.
enum class VertexSemantic : std::uint8_t
{
    Position,
    Normal,
    Tangent, ///< w is the side of the bitangent.
    TextureCoordinate,
    Colour, ///< The tint, linear; white where the mesh has none.
};

/// How numbers of an attribute lie in memory; little-endian as the processor, components in order.
/// Normalized integers round to the nearest: snorm to [-1, 1] by 127 or 32,767, unorm to [0, 1] by 255 or 65,535.
enum class VertexFormat : std::uint8_t
{
    Float32x2,
    Float32x3,
    Float32x4,
    Float16x2, ///< IEEE 754 half, rounded to even: 11 bits of the number.
    Float16x4,
    Snorm16x4,
    Snorm8x4,
    Unorm8x4, ///< Directions as 0.5 + 0.5 * component.
    Unorm16x2,
    OctahedralSnorm16x2, ///< A direction on the octahedron: n = (x, y, 1 - |x| - |y|), folded where z < 0.
};

/// Bytes.
[[nodiscard]] std::size_t sizeOf(VertexFormat format) noexcept;

struct VertexAttributeFormat
{
    VertexSemantic semantic = VertexSemantic::Position;
    VertexFormat format = VertexFormat::Float32x3;
    std::uint32_t offset = 0; ///< Bytes from the start of the vertex. Need not be aligned.

    friend bool operator==(const VertexAttributeFormat&, const VertexAttributeFormat&) = default;
};

/// Where v = 0 lies in an image.
enum class TextureOrigin : std::uint8_t
{
    BottomLeft, ///< v as the mesh has it: OpenGL, Unity.
    TopLeft,    ///< 1 - v: glTF, Direct3D, Vulkan, Metal, Unreal.
};

/// How the vertices of an engine's buffer look. A buffer for each attribute is a layout for each.
///
/// These formats fit: positions Float32x3, Float32x4 and Float16x4 (w = 1), Snorm16x4 (w = 1); normals Float32x3,
/// Float32x4 (w = 0), Float16x4, Snorm16x4, Snorm8x4, Unorm8x4, OctahedralSnorm16x2; tangents those of four components;
/// texture coordinates Float32x2, Float16x2, and Unorm16x2 if they lie in [0, 1]; colours Float32x3, Float32x4,
/// Float16x4 and Unorm8x4.
struct VertexLayout
{
    std::uint32_t stride = 0; ///< Bytes from one vertex to the next.
    std::span<const VertexAttributeFormat> attributes;
    TextureOrigin textureOrigin = TextureOrigin::TopLeft;
    /// Positions are written as (p - positionCentre) / positionScale; fitPositions says what brings them into [-1, 1].
    Vec3 positionCentre{0};
    float positionScale = 1; ///< Metres. > 0
};

/// The centre of a mesh and its largest half extent in metres: for positions in normalized integers.
struct PositionFit
{
    Vec3 centre{0};
    float scale = 1;
};

[[nodiscard]] PositionFit fitPositions(const TreeMesh& mesh) noexcept;

/// Why nothing was written.
enum class VertexResult : std::uint8_t
{
    Ok,
    BadLayout,        ///< Attributes overlap, repeat, or reach beyond the stride; the scale is not positive.
    UnfitFormat,      ///< A format does not suit what it is to hold; see VertexLayout.
    InconsistentMesh, ///< Vertex arrays differ in length, or an index names no vertex.
    OutOfRange,       ///< A number does not fit its format, such as a bark's texture coordinate into unorm.
    BufferTooSmall,   ///< Less than bytesOf, or fewer indices than the mesh has.
    IndexTooWide,     ///< 16 bits do not hold the indices of so many vertices.
};

[[nodiscard]] std::string_view reasonOf(VertexResult result) noexcept;

/// Bytes that the mesh's vertices take in this layout.
[[nodiscard]] std::size_t bytesOf(const TreeMesh& mesh, const VertexLayout& layout) noexcept;

/// The same of a mesh that is not there yet (countTree, meshBound).
[[nodiscard]] std::size_t vertexBytesOf(const MeshCounts& counts, const VertexLayout& layout) noexcept;

/// Writes the vertices of `mesh` to the front of the caller's memory, which needs no alignment. Bytes of a vertex that
/// belong to no attribute stay as they are, and all of them unless the result is Ok. Equal input gives equal bytes.
[[nodiscard]] VertexResult writeVertices(const TreeMesh& mesh, const VertexLayout& layout,
                                         std::span<std::byte> out) noexcept;

enum class IndexWidth : std::uint8_t
{
    Bits16 = 2, ///< The value is the size in bytes.
    Bits32 = 4,
};

/// 16 bits hold the indices of so many vertices: 65,535 restarts primitives in most interfaces and is no index.
inline constexpr std::size_t kMostShortVertices = 65535;

[[nodiscard]] constexpr IndexWidth indexWidthFor(std::size_t vertices) noexcept
{
    return vertices <= kMostShortVertices ? IndexWidth::Bits16 : IndexWidth::Bits32;
}

/// Writes the mesh's indices to the front of `out`; all or nothing.
[[nodiscard]] VertexResult writeIndices(const TreeMesh& mesh, std::span<std::uint16_t> out) noexcept;
[[nodiscard]] VertexResult writeIndices(const TreeMesh& mesh, std::span<std::uint32_t> out) noexcept;

} // namespace espalier
