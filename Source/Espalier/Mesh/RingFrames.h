#pragma once

#include <Espalier/Core/Simd.h>
#include <Espalier/Core/Vector.h>
#include <cmath>
#include <limits>

// Based on: W. Wang, B. Jüttler, D. Zheng, Y. Liu, "Computation of Rotation Minimizing Frames", ACM TOG, 2008 (double
// reflection). Departure: the result is made normal again at every step, so rounding does not add up.

namespace espalier {

/// The unit vector along `v`, or `otherwise` where `v` has no direction.
[[nodiscard]] inline Vec3 directionOr(const Vec3& v, const Vec3& otherwise) noexcept
{
    return simd::vec3(simd::directionOr(simd::three(v), simd::three(otherwise)));
}

/// A unit vector normal to `tangent`, whichever.
[[nodiscard]] Vec3 anySideNormalTo(const Vec3& tangent) noexcept;

/// The unit vector normal to `tangent` (unit) that is nearest to `wish`; any one if `wish` is of no help.
[[nodiscard]] inline simd::Four sideNormalTo(simd::Four tangent, simd::Four wish) noexcept
{
    const simd::Four side = wish - tangent * simd::all(simd::dot(tangent, wish));
    const float square = simd::dot(side, side);
    if (square > 1e-6f && square <= std::numeric_limits<float>::max())
        return side / simd::all(std::sqrt(square));
    return simd::three(anySideNormalTo(simd::vec3(tangent)));
}
[[nodiscard]] inline Vec3 sideNormalTo(const Vec3& tangent, const Vec3& wish) noexcept
{
    return simd::vec3(sideNormalTo(simd::three(tangent), simd::three(wish)));
}

/// Carries `side`, unit and normal to `tangent`, along a curve from `position` to the next point without twisting it:
/// one step of a rotation-minimizing frame. The result is unit and normal to `nextTangent`, for any input.
[[nodiscard]] inline simd::Four transportSide(simd::Four side, simd::Four position, simd::Four tangent,
                                              simd::Four nextPosition, simd::Four nextTangent) noexcept
{
    constexpr float kNoStep = 1e-24f; // squared length below which a vector has no usable direction
    const simd::Four step = nextPosition - position;
    const float square = simd::dot(step, step);
    if (square <= kNoStep)
        return sideNormalTo(nextTangent, side);
    // Each is mirrored in the plane normal to an axis; or stays where there is no such plane.
    const auto reflected = [](simd::Four v, simd::Four axis, float axisSquare) {
        return axisSquare > kNoStep ? v - simd::all(2.f * simd::dot(axis, v) / axisSquare) * axis : v;
    };
    const simd::Four second = nextTangent - reflected(tangent, step, square);
    return sideNormalTo(nextTangent, reflected(reflected(side, step, square), second, simd::dot(second, second)));
}
[[nodiscard]] inline Vec3 transportSide(const Vec3& side, const Vec3& position, const Vec3& tangent,
                                        const Vec3& nextPosition, const Vec3& nextTangent) noexcept
{
    return simd::vec3(transportSide(simd::three(side), simd::three(position), simd::three(tangent),
                                    simd::three(nextPosition), simd::three(nextTangent)));
}

} // namespace espalier
