#pragma once

#include <Espalier/Core/Simd.h>
#include <Espalier/Core/Vector.h>
#include <cmath>
#include <limits>

namespace espalier {

/// Carries `side`, unit and normal to `tangent`, along a curve from `position` to the next point without twisting it:
/// one step of a rotation-minimizing frame. The result is unit and normal to `nextTangent`, for any input.
[[nodiscard]] Vec3 transportSide(const Vec3& side, const Vec3& position, const Vec3& tangent, const Vec3& nextPosition,
                                 const Vec3& nextTangent) noexcept;

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

} // namespace espalier
