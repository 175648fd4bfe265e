#pragma once

#include <Espalier/Core/Vector.h>
#include <cmath>

namespace espalier {

/// Carries `side`, unit and normal to `tangent`, along a curve from `position` to the next point without twisting it:
/// one step of a rotation-minimizing frame. The result is unit and normal to `nextTangent`, for any input.
[[nodiscard]] Vec3 transportSide(const Vec3& side, const Vec3& position, const Vec3& tangent, const Vec3& nextPosition,
                                 const Vec3& nextTangent) noexcept;

/// A unit vector normal to `tangent`, whichever.
[[nodiscard]] Vec3 anySideNormalTo(const Vec3& tangent) noexcept;

/// The unit vector normal to `tangent` (unit) that is nearest to `wish`; any one if `wish` is of no help.
[[nodiscard]] inline Vec3 sideNormalTo(const Vec3& tangent, const Vec3& wish) noexcept
{
    const Vec3 side = wish - tangent * glm::dot(tangent, wish);
    const float square = glm::dot(side, side);
    return square > 1e-6f && std::isfinite(square) ? side / std::sqrt(square) : anySideNormalTo(tangent);
}

} // namespace espalier
