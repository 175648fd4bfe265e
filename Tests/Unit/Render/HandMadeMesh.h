#pragma once

#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Mesh/TreeMesh.h>

namespace espalier {

/// An open, upright tube on the ground, whose vertices are known in closed form: a trunk for tests of what shows
/// meshes.
struct HandMadeTube
{
    std::uint32_t sides = 8;
    std::uint32_t rings = 2;
    float height = 2.0f;
    float radius = 0.25f;
    Vec3 base{0};
};

inline TreeMesh handMade(const HandMadeTube& tube)
{
    TreeMesh mesh;
    for (std::uint32_t ring = 0; ring < tube.rings; ++ring)
        for (std::uint32_t side = 0; side <= tube.sides; ++side)
        {
            const auto [sin, cos] = math::sinCosDegrees(360.0 * side / tube.sides);
            const Vec3 outward(static_cast<float>(sin), 0, static_cast<float>(cos));
            const float up = static_cast<float>(ring) / static_cast<float>(tube.rings - 1);
            mesh.positions.push_back(tube.base + tube.radius * outward + Vec3(0, up * tube.height, 0));
            mesh.normals.push_back(outward);
            mesh.tangents.emplace_back(outward.z, 0, -outward.x, 1);
            mesh.uvs.emplace_back(static_cast<float>(side) / static_cast<float>(tube.sides), up * tube.height);
        }
    for (std::uint32_t ring = 0; ring + 1 < tube.rings; ++ring)
        for (std::uint32_t side = 0; side < tube.sides; ++side)
        {
            const std::uint32_t low = ring * (tube.sides + 1) + side;
            const std::uint32_t high = low + tube.sides + 1;
            mesh.indices.insert(mesh.indices.end(), {low, low + 1, high + 1, low, high + 1, high});
        }
    mesh.parts = {{MeshMaterial::Bark, 0, static_cast<std::uint32_t>(mesh.indices.size())}};
    return mesh;
}

} // namespace espalier
