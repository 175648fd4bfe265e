#pragma once

#include <Espalier/Mesh/TreeMesh.h>
#include <algorithm>
#include <cstdint>
#include <map>
#include <ostream>
#include <tuple>
#include <vector>

// What tests ask of a mesh as a surface. Vertices with bit-equal positions are one, so that seams close.
namespace espalier::samples {

struct SurfaceCheck
{
    std::size_t triangles = 0;
    std::size_t openSides = 0;   ///< Passed more often one way than the other.
    std::size_t sharedSides = 0; ///< Passed more than once the same way.
    std::size_t flat = 0;        ///< Triangles with a corner twice, or without area.
    std::size_t pieces = 0;      ///< Connected ones.
    double volume = 0;           ///< Positive if triangles face outwards.

    [[nodiscard]] bool isManifold() const { return openSides == 0 && sharedSides == 0; }
};

inline void PrintTo(const SurfaceCheck& check, std::ostream* out)
{
    *out << check.triangles << " triangles, " << check.openSides << " open sides, " << check.sharedSides
         << " shared ones, " << check.flat << " flat triangles, " << check.pieces << " pieces";
}

inline SurfaceCheck checkSurface(const TreeMesh& mesh)
{
    std::map<std::tuple<float, float, float>, std::uint32_t> known;
    std::vector<std::uint32_t> ids;
    for (const Vec3& p : mesh.positions)
        ids.push_back(known.try_emplace({p.x, p.y, p.z}, static_cast<std::uint32_t>(known.size())).first->second);

    std::vector<std::uint32_t> roots(known.size());
    for (std::uint32_t i = 0; i < roots.size(); ++i)
        roots[i] = i;
    const auto rootOf = [&roots](std::uint32_t i) {
        while (roots[i] != i)
            i = roots[i] = roots[roots[i]];
        return i;
    };

    SurfaceCheck check{.triangles = mesh.indices.size() / 3};
    std::vector<bool> used(known.size(), false);
    std::vector<std::pair<std::uint32_t, std::uint32_t>> sides;
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3)
    {
        const DVec3 a(mesh.positions[mesh.indices[i]]);
        const DVec3 b(mesh.positions[mesh.indices[i + 1]]);
        const DVec3 c(mesh.positions[mesh.indices[i + 2]]);
        check.flat += glm::length(glm::cross(b - a, c - a)) > 0 ? 0u : 1u;
        check.volume += glm::dot(a, glm::cross(b, c)) / 6;
        for (std::size_t k = 0; k < 3; ++k)
        {
            const std::uint32_t from = ids[mesh.indices[i + k]];
            const std::uint32_t to = ids[mesh.indices[i + (k + 1) % 3]];
            if (from != to)
                sides.push_back({from, to});
            roots[rootOf(from)] = rootOf(to);
            used[from] = true;
        }
    }
    std::sort(sides.begin(), sides.end());
    const auto countOf = [&sides](std::pair<std::uint32_t, std::uint32_t> side) {
        const auto range = std::equal_range(sides.begin(), sides.end(), side);
        return range.second - range.first;
    };
    for (std::size_t i = 0; i < sides.size(); ++i)
    {
        if (i > 0 && sides[i] == sides[i - 1])
        {
            ++check.sharedSides;
            continue;
        }
        check.openSides += countOf(sides[i]) == countOf({sides[i].second, sides[i].first}) ? 0u : 1u;
    }
    for (std::uint32_t i = 0; i < roots.size(); ++i)
        check.pieces += used[i] && rootOf(i) == i ? 1u : 0u;
    return check;
}

} // namespace espalier::samples
