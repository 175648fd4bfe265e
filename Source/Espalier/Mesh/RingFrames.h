#pragma once

#include <Espalier/Core/Vector.h>

namespace espalier {

/// Carries `side`, unit and normal to `tangent`, along a curve from `position` to the next point without twisting it:
/// one step of a rotation-minimizing frame. The result is unit and normal to `nextTangent`, for any input.
[[nodiscard]] Vec3 transportSide(const Vec3& side, const Vec3& position, const Vec3& tangent, const Vec3& nextPosition,
                                 const Vec3& nextTangent) noexcept;

/// The unit vector normal to `tangent` (unit) that is nearest to `wish`; any one if `wish` is of no help.
[[nodiscard]] Vec3 sideNormalTo(const Vec3& tangent, const Vec3& wish) noexcept;

} // namespace espalier
