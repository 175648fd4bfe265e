#pragma once

#include <Espalier/Mesh/ConvexHull.h>
#include <algorithm>
#include <vector>

namespace espalier {

/// Metres that the farthest point lies outside of a plane of the hull.
inline double farthestOutside(const ConvexHull& hull, const std::vector<Vec3>& points)
{
    double farthest = 0;
    for (std::size_t t = 0; t < hull.indices.size(); t += 3)
    {
        const DVec3 a(hull.vertices[hull.indices[t]]);
        const DVec3 b(hull.vertices[hull.indices[t + 1]]);
        const DVec3 c(hull.vertices[hull.indices[t + 2]]);
        const DVec3 normal = glm::cross(b - a, c - a);
        const double length = glm::length(normal);
        // A sliver's plane is no better known than its corners; what it does not hold its neighbours do.
        const double longest = std::max({glm::length(b - a), glm::length(c - b), glm::length(a - c)});
        if (!(length > 0.05 * longest * longest))
            continue;
        for (const Vec3& point : points)
            farthest = std::max(farthest, glm::dot(normal, DVec3(point) - a) / length);
    }
    return farthest;
}

} // namespace espalier
