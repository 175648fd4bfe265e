#pragma once

#include <Espalier/Mesh/TreeMesh.h>
#include <Espalier/Species/Appearance.h>
#include <cstddef>
#include <cstdint>
#include <limits>

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

/// "Has no images".
inline constexpr std::size_t kNoImages = std::numeric_limits<std::size_t>::max();

/// Which of the images that a bake is given show this part: [0] bark, [1 + k] leaves of kind k, and after those of all
/// kinds the pictures of the whole plant.
[[nodiscard]] inline std::size_t imagesOf(const MeshPart& part, const Appearance& appearance) noexcept
{
    switch (part.material)
    {
    case MeshMaterial::Bark:
        return 0;
    case MeshMaterial::Leaves:
        return 1 + std::size_t{part.colour};
    case MeshMaterial::Cards:
        return 1 + appearance.leaves.size();
    case MeshMaterial::Surface:
        break;
    }
    return kNoImages;
}

/// True if its alpha cuts it out.
[[nodiscard]] inline bool isCutOut(const MeshPart& part) noexcept
{
    return part.material == MeshMaterial::Leaves || part.material == MeshMaterial::Cards;
}

} // namespace espalier
