#include <Espalier/Mesh/RingFrames.h>
#include <Espalier/Mesh/TubeCollar.h>
#include <algorithm>
#include <cmath>

namespace espalier {
namespace {

using simd::all;
using simd::dot;
using simd::Four;
using simd::three;

/// A place seen from the parent of a branch.
struct ParentView
{
    Four away{};        ///< Unit, from the parent's axis; 0 on it.
    float distance = 0; ///< From its axis, metres.
    float radius = 0;   ///< The parent's there, metres.

    [[nodiscard]] float height() const { return distance - radius; }
};

ParentView viewFromParent(const TubeCollar& collar, Four position)
{
    const Four before = three(collar.before);
    const Four after = three(collar.after);
    const Four arm = position - three(collar.joint);
    const bool isAfter = dot(arm, before + after) > 0;
    const Four axis = isAfter ? after : before;
    const float along = dot(arm, axis);
    const Four offset = arm - axis * all(along);
    const float distance = simd::length(offset);
    const float radius = collar.parentRadius + along * (isAfter ? collar.slopeAfter : collar.slopeBefore);
    return {.away = distance > 1e-5f * collar.parentRadius ? offset / all(distance) : Four{},
            .distance = distance,
            .radius = std::clamp(radius, 0.3f * collar.parentRadius, 3 * collar.parentRadius)};
}

} // namespace

float heightOverParent(const TubeCollar& collar, const Vec3& position) noexcept
{
    return viewFromParent(collar, three(position)).height();
}

CollarRing::CollarRing(const TubeCollar& of, const TubeRing& which) noexcept
    : collar(of), ring(which), height(heightOverParent(of, which.centre)),
      level(std::clamp(height / of.length, 0.f, 1.f))
{}

Four CollarRing::pointAt(Four outward, float footDepth) const noexcept
{
    const float rest = 1 - level;
    const float farthest = std::min(1.5f * ring.radius, 0.7f * ring.along);
    const float footing = -footDepth * ring.radius * rest * rest;

    const Four tangent = three(ring.tangent);
    const Four bare = three(ring.centre) + all(ring.radius) * outward;
    const ParentView view = viewFromParent(collar, bare);
    const float bareHeight = view.height();
    const float climb = std::max(dot(view.away, tangent), 0.1f);
    const float slide = std::clamp(rest * (height + footing - bareHeight) / climb, -farthest, farthest);
    const float wanted = bareHeight + slide * climb;

    const float facing = dot(view.away, outward);
    const float root = std::sqrt(level * (2 - level));
    const float width = collar.height * (1.05f - facing);
    const Four aside = simd::directionOr(outward - view.away * all(facing), outward);
    const Four spread = bare + all(slide) * tangent + all(width * (1 - root)) * aside;

    // Sliding over a round parent lifts off it; come back to the wanted height.
    const ParentView settled = viewFromParent(collar, spread);
    return spread + settled.away * all(rest * (settled.radius + wanted - settled.distance));
}

Four CollarRing::normalAt(Four position, Four own) const noexcept
{
    const float rest = (1 - level) * (1 - level);
    const Four parents = viewFromParent(collar, position).away;
    const float agreement = std::clamp(2 * dot(parents, own) - 0.3f, 0.f, 1.f);
    return simd::directionOr(simd::mix(own, parents, 0.9f * rest * rest * agreement), own);
}

} // namespace espalier
