#include <Espalier/Core/Hash.h>
#include <Espalier/Mesh/TreeMesh.h>
#include <Espalier/Species/Appearance.h>
#include <algorithm>
#include <span>

namespace espalier {
namespace {

template <class Vector>
void hashVectors(Hash64& hash, const RawVector<Vector>& all)
{
    hash.value(std::uint64_t{all.size()});
    for (const Vector& v : all)
    {
        for (int i = 0; i < Vector::length(); ++i)
            hash.value(v[i]);
    }
}

} // namespace

Tint tintOf(const Vec3& colour) noexcept
{
    const auto byte = [](float c) { return static_cast<std::uint8_t>(std::clamp(c, 0.f, 1.f) * 255 + 0.5f); };
    return {byte(colour.x), byte(colour.y), byte(colour.z), 255};
}

void TreeMesh::clear() noexcept
{
    positions.clear();
    normals.clear();
    tangents.clear();
    uvs.clear();
    tints.clear();
    sources.clear();
    indices.clear();
    parts.clear();
}

void TreeMesh::reserve(const MeshCounts& counts)
{
    positions.reserve(counts.vertices);
    normals.reserve(counts.vertices);
    tangents.reserve(counts.vertices);
    uvs.reserve(counts.vertices);
    if (counts.streams.tints)
        tints.reserve(counts.vertices);
    if (counts.streams.sources)
        sources.reserve(counts.vertices);
    indices.reserve(counts.indices);
    parts.reserve(counts.parts);
}

void TreeMesh::resizeVertices(std::size_t count, MeshStreams streams)
{
    positions.resize(count);
    normals.resize(count);
    tangents.resize(count);
    uvs.resize(count);
    if (streams.tints || !tints.empty())
        tints.resize(count);
    if (streams.sources || !sources.empty())
        sources.resize(count);
}

std::uint64_t MeshCounts::bytes() const noexcept
{
    std::uint64_t vertex = 2 * sizeof(Vec3) + sizeof(Vec4) + sizeof(Vec2);
    vertex += streams.tints ? sizeof(Tint) : 0;
    vertex += streams.sources ? sizeof(VertexSource) : 0;
    return vertex * vertices + sizeof(std::uint32_t) * indices;
}

MeshCounts countsOf(const TreeMesh& mesh) noexcept
{
    return {.vertices = mesh.positions.size(),
            .indices = mesh.indices.size(),
            .parts = static_cast<std::uint32_t>(mesh.parts.size()),
            .streams = {.tints = !mesh.tints.empty(), .sources = !mesh.sources.empty()}};
}

std::string_view reasonOf(MeshResult result) noexcept
{
    switch (result)
    {
    case MeshResult::Ok:
        return {};
    case MeshResult::EmptySkeleton:
        return "there is nothing to draw";
    case MeshResult::UnsoundSkeleton:
        return "a number in it is not finite or too large";
    case MeshResult::TooManyVertices:
        return "it would exceed the limit vertices";
    }
    return {};
}

Vec3 colourOf(const MeshPart& part, const Appearance& appearance) noexcept
{
    if (part.material == MeshMaterial::Leaves && part.colour < appearance.leaves.size())
        return appearance.leaves[part.colour].colour;
    if (part.material == MeshMaterial::Cards)
        return Vec3(1);
    const bool isPlainBark = part.material == MeshMaterial::Bark && part.colour == 0;
    if (isPlainBark || appearance.palette.empty())
        return appearance.bark.colour;
    return appearance.palette[std::min<std::size_t>(part.colour, appearance.palette.size() - 1)];
}

std::uint64_t hashOf(const TreeMesh& mesh) noexcept
{
    Hash64 hash;
    hashVectors(hash, mesh.positions);
    hashVectors(hash, mesh.normals);
    hashVectors(hash, mesh.tangents);
    hashVectors(hash, mesh.uvs);
    hash.value(std::uint64_t{mesh.indices.size()});
    hash.values(std::span<const std::uint32_t>(mesh.indices));
    hash.value(std::uint64_t{mesh.parts.size()});
    for (const MeshPart& part : mesh.parts)
    {
        hash.value(part.material);
        hash.value(part.firstIndex);
        hash.value(part.indexCount);
        if (part.colour != 0) // so that meshes without colours keep the hash they always had
            hash.value(part.colour);
    }
    // Only where there are any, so that meshes without keep the hash they always had.
    for (const Tint tint : mesh.tints)
        hash.value(std::uint32_t{tint.red} | std::uint32_t{tint.green} << 8 | std::uint32_t{tint.blue} << 16 |
                   std::uint32_t{tint.alpha} << 24);
    for (const VertexSource& source : mesh.sources)
    {
        hash.value(source.segment);
        hash.value(source.organ);
        hash.value(source.lot);
    }
    return hash.result();
}

} // namespace espalier
