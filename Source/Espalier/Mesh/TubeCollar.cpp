#include <Espalier/Mesh/TubeCollar.h>
#include <algorithm>
#include <cmath>

namespace espalier {
namespace {

/// A place seen from the parent of a branch.
struct ParentView
{
    Vec3 away{0};       ///< Unit, from the parent's axis; 0 on it.
    float distance = 0; ///< From its axis, metres.
    float radius = 0;   ///< The parent's there, metres.
};

ParentView viewFromParent(const TubeCollar& collar, const Vec3& position)
{
    const Vec3 arm = position - collar.joint;
    const bool isAfter = glm::dot(arm, collar.before + collar.after) > 0;
    const Vec3& axis = isAfter ? collar.after : collar.before;
    const float along = glm::dot(arm, axis);
    const Vec3 offset = arm - axis * along;
    const float distance = glm::length(offset);
    const float radius = collar.parentRadius + along * (isAfter ? collar.slopeAfter : collar.slopeBefore);
    return {.away = distance > 1e-5f * collar.parentRadius ? offset / distance : Vec3(0),
            .distance = distance,
            .radius = std::clamp(radius, 0.3f * collar.parentRadius, 3 * collar.parentRadius)};
}

} // namespace

float heightOverParent(const TubeCollar& collar, const Vec3& position) noexcept
{
    const ParentView view = viewFromParent(collar, position);
    return view.distance - view.radius;
}

float collarLevel(const TubeCollar& collar, const TubeRing& ring) noexcept
{
    return std::clamp(heightOverParent(collar, ring.centre) / collar.length, 0.f, 1.f);
}

Vec3 collarPoint(const TubeCollar& collar, const TubeRing& ring, const Vec3& outward, float footDepth) noexcept
{
    const float centreHeight = heightOverParent(collar, ring.centre);
    const float level = std::clamp(centreHeight / collar.length, 0.f, 1.f);
    const float rest = 1 - level;
    const float farthest = std::min(1.5f * ring.radius, 0.7f * ring.along);
    const float footing = -footDepth * ring.radius * rest * rest;

    const Vec3 bare = ring.centre + ring.radius * outward;
    const ParentView view = viewFromParent(collar, bare);
    const float bareHeight = view.distance - view.radius;
    const float climb = std::max(glm::dot(view.away, ring.tangent), 0.1f);
    const float slide = std::clamp(rest * (centreHeight + footing - bareHeight) / climb, -farthest, farthest);
    const float wanted = bareHeight + slide * climb;

    const float facing = glm::dot(view.away, outward);
    const float root = std::sqrt(level * (2 - level));
    const float width = collar.height * (1.05f - facing);
    const Vec3 aside = directionOr(outward - view.away * facing, outward);
    const Vec3 spread = bare + slide * ring.tangent + (width * (1 - root)) * aside;

    // Sliding over a round parent lifts off it; come back to the wanted height.
    const ParentView settled = viewFromParent(collar, spread);
    return spread + settled.away * (rest * (settled.radius + wanted - settled.distance));
}

Vec3 collarNormal(const TubeCollar& collar, const TubeRing& ring, const Vec3& position, const Vec3& own) noexcept
{
    const float level = collarLevel(collar, ring);
    const float rest = (1 - level) * (1 - level);
    const Vec3 parents = viewFromParent(collar, position).away;
    const float agreement = std::clamp(2 * glm::dot(parents, own) - 0.3f, 0.f, 1.f);
    return directionOr(glm::mix(own, parents, 0.9f * rest * rest * agreement), own);
}

} // namespace espalier
