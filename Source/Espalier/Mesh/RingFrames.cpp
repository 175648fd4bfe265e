#include <Espalier/Mesh/RingFrames.h>
#include <cmath>

// Based on: W. Wang, B. Jüttler, D. Zheng, Y. Liu, "Computation of Rotation Minimizing Frames", ACM TOG, 2008 (double
// reflection). Departure: the result is made normal again at every step, so rounding does not add up.

namespace espalier {
namespace {

using simd::all;
using simd::dot;
using simd::Four;

/// Squared length below which a vector has no usable direction.
constexpr float kNoStep = 1e-24f;

/// `v` mirrored in the plane normal to `axis`, whose square is given; `v` itself where there is no such plane.
Four reflect(Four v, Four axis, float square)
{
    return square > kNoStep ? v - all(2.f * dot(axis, v) / square) * axis : v;
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
    const Four next = simd::three(nextTangent);
    const Four step = simd::three(nextPosition) - simd::three(position);
    const float square = dot(step, step);
    if (square <= kNoStep)
        return simd::vec3(sideNormalTo(next, simd::three(side)));
    const Four mirroredSide = reflect(simd::three(side), step, square);
    const Four second = next - reflect(simd::three(tangent), step, square);
    return simd::vec3(sideNormalTo(next, reflect(mirroredSide, second, dot(second, second))));
}

} // namespace espalier
