#pragma once

#include <Espalier/Mesh/TreeMesh.h>
#include <cstdint>

namespace espalier {

/// True if the parts cover all triangles, in order, each once.
[[nodiscard]] inline bool partsCoverAll(const TreeMesh& mesh) noexcept
{
    std::uint64_t covered = 0;
    for (const MeshPart& part : mesh.parts)
    {
        if (part.firstIndex != covered || part.indexCount % 3 != 0)
            return false;
        covered += part.indexCount;
    }
    return covered == mesh.indices.size();
}

} // namespace espalier
