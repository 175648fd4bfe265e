#include <Espalier/Mesh/RingFrames.h>
#include <cmath>

// Based on: W. Wang, B. Jüttler, D. Zheng, Y. Liu, "Computation of Rotation Minimizing Frames", ACM TOG, 2008 (double
// reflection). Departure: the result is made normal again at every step, so rounding does not add up.

namespace espalier {
namespace {

/// Squared length below which a vector has no usable direction.
constexpr float kNoStep = 1e-24f;

/// `v` mirrored in the plane normal to `axis`; `v` itself where there is no such plane.
Vec3 reflect(const Vec3& v, const Vec3& axis)
{
    const float square = glm::dot(axis, axis);
    return square > kNoStep ? v - (2.f * glm::dot(axis, v) / square) * axis : v;
}

} // namespace

Vec3 anySideNormalTo(const Vec3& tangent) noexcept
{
    const Vec3 aside = std::abs(tangent.x) < 0.6f ? Vec3(1, 0, 0) : Vec3(0, 0, 1);
    return glm::normalize(glm::cross(tangent, aside));
}

Vec3 transportSide(const Vec3& side, const Vec3& position, const Vec3& tangent, const Vec3& nextPosition,
                   const Vec3& nextTangent) noexcept
{
    const Vec3 step = nextPosition - position;
    if (glm::dot(step, step) <= kNoStep)
        return sideNormalTo(nextTangent, side);
    const Vec3 mirroredSide = reflect(side, step);
    const Vec3 mirroredTangent = reflect(tangent, step);
    return sideNormalTo(nextTangent, reflect(mirroredSide, nextTangent - mirroredTangent));
}

} // namespace espalier
