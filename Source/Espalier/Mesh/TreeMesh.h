#pragma once

#include <Espalier/Core/Vector.h>
#include <cstdint>
#include <vector>

namespace espalier {

/// What a part of a tree mesh is made of.
enum class MeshMaterial : std::uint8_t
{
    Bark,
};

/// A run of indices drawn with one material.
struct MeshPart
{
    MeshMaterial material = MeshMaterial::Bark;
    std::uint32_t firstIndex = 0;
    std::uint32_t indexCount = 0;

    friend bool operator==(const MeshPart&, const MeshPart&) = default;
};

/// The triangles of one tree at one level of detail. Vertex arrays have equal length. Plant space: metres, Y up.
/// Triangles are counter-clockwise seen from outside, and normals point outside. A plain value; `clear` keeps the
/// memory.
struct TreeMesh
{
    std::vector<Vec3> positions; ///< Metres.
    std::vector<Vec3> normals;   ///< Unit.
    std::vector<Vec4> tangents;  ///< xyz unit, along +u, normal to the normal; w = +1 or -1 so that bitangent = w *
                                 ///< cross(n, t), along +v (glTF).
    std::vector<Vec2> uvs; ///< Bark, in repeats of the texture: u round the axis, v along it, growing towards the tip.
    std::vector<std::uint32_t> indices; ///< Three a triangle, each below positions.size().
    std::vector<MeshPart> parts;        ///< Cover all indices, in order.

    void clear() noexcept;

    friend bool operator==(const TreeMesh&, const TreeMesh&) = default;
};

/// A stable hash of every array, bit for bit.
[[nodiscard]] std::uint64_t hashOf(const TreeMesh& mesh) noexcept;

} // namespace espalier
