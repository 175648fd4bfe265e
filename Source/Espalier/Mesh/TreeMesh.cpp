#include <Espalier/Core/Hash.h>
#include <Espalier/Mesh/TreeMesh.h>
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
    }
    return hash.result();
}

} // namespace espalier
