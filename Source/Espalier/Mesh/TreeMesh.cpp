#include <Espalier/Core/Hash.h>
#include <Espalier/Mesh/TreeMesh.h>
#include <Espalier/Species/Appearance.h>
#include <algorithm>
#include <span>

namespace espalier {
namespace {

template <class Vector>
void hashVectors(Hash64& hash, const std::vector<Vector>& all)
{
    hash.value(std::uint64_t{all.size()});
    for (const Vector& v : all)
    {
        for (int i = 0; i < Vector::length(); ++i)
            hash.value(v[i]);
    }
}

} // namespace

void TreeMesh::clear() noexcept
{
    positions.clear();
    normals.clear();
    tangents.clear();
    uvs.clear();
    indices.clear();
    parts.clear();
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
    return hash.result();
}

} // namespace espalier
