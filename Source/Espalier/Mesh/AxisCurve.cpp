#include <Espalier/Mesh/AxisCurve.h>
#include <Espalier/Mesh/RingFrames.h>
#include <algorithm>
#include <cmath>

// The work here is short chains of vectors, a few hundred nanoseconds a tube, in which every branch and every trip
// through memory shows: so they are kept in registers, all three numbers of a vector in one.
// Radii: F. N. Fritsch, J. Butland, "A Method for Constructing Local Monotone Piecewise Cubic Interpolants", SIAM J.
// Sci. Stat. Comput., 1984 (the harmonic mean of neighbouring secants).

namespace espalier {
namespace {

using simd::all;
using simd::dot;
using simd::Four;
using simd::three;

/// A segment is halved at most so often: 2^8 rings draw any bend that anybody asked for.
constexpr int kMaxHalvings = 8;

/// Beside a much shorter neighbour a tangent still has this share of its own segment, lest the bend become a corner.
constexpr float kLeastReach = 0.3f;

/// Below this sine of half the turn the two directions at a joint cancel: the axis folds back on itself.
constexpr float kHairpin = 1e-3f;

Four tangentBetween(Four before, Four after)
{
    const Four sum = before + after;
    const float square = dot(sum, sum);
    return square > 4 * kHairpin * kHairpin ? sum * all(1 / std::sqrt(square))
                                            : three(anySideNormalTo(simd::vec3(before)));
}

float monotoneSlope(const AxisJoint& before, const AxisJoint& here, float nextRadius)
{
    const float secantBefore = (here.radius - before.radius) / before.length;
    const float secantAfter = (nextRadius - here.radius) / here.length;
    if (!((secantBefore > 0 && secantAfter > 0) || (secantBefore < 0 && secantAfter < 0)))
        return 0;
    const float weightBefore = 2 * here.length + before.length;
    const float weightAfter = here.length + 2 * before.length;
    return (weightBefore + weightAfter) / (weightBefore / secantBefore + weightAfter / secantAfter);
}

/// Fills in directions, lengths, tangents and slopes.
void fit(const Vec3& startTangent, std::vector<AxisJoint>& joints)
{
    const std::size_t last = joints.size() - 1;
    Four position = three(joints[0].position);
    Four direction{};
    for (std::size_t k = 0; k < last; ++k)
    {
        const Four next = three(joints[k + 1].position);
        const Four chord = next - position;
        const Four before = direction;
        direction = simd::directionOr(chord, Four{0, 1, 0, 0});
        joints[k].length = simd::length(chord);
        simd::storeThree(&joints[k].direction, direction);
        if (k > 0)
            simd::storeThree(&joints[k].tangent, tangentBetween(before, direction));
        position = next;
    }
    joints[last].direction = joints[last - 1].direction;

    joints[0].tangent = startTangent;
    joints[0].slope = (joints[1].radius - joints[0].radius) / joints[0].length;
    for (std::size_t k = 1; k < last; ++k)
        joints[k].slope = monotoneSlope(joints[k - 1], joints[k], joints[k + 1].radius);
    // A free end is bent by nothing: the cubic's second derivative vanishes there.
    const AxisJoint& before = joints[last - 1];
    const Four tangent = all(1.5f) * direction - all(0.5f) * three(before.tangent);
    simd::storeThree(&joints[last].tangent, simd::directionOr(tangent, direction));
    joints[last].slope = (joints[last].radius - before.radius) / before.length;
}

struct Bezier
{
    Four a, b, c, d;
};

/// The cubic over the segment from joint `k` to the next, with its end tangents turned towards the chord as `smoothing`
/// asks.
Bezier segmentCurve(const std::vector<AxisJoint>& joints, std::size_t k, float startReach, float smoothing)
{
    const AxisJoint& here = joints[k];
    const AxisJoint& next = joints[k + 1];
    const Four direction = three(here.direction);
    const float reachBefore = k > 0 ? joints[k - 1].length : startReach;
    const float reachAfter = k + 2 < joints.size() ? next.length : here.length;
    const auto handle = [&](const Vec3& tangent, float reach) {
        // A unit tangent of full length is Catmull-Rom's on even joints; a turned one bulges less when shorter.
        const Four blended = simd::directionOr(simd::mix(direction, three(tangent), smoothing), direction);
        const float turned = std::max(dot(blended, direction), 0.35f);
        const float length = std::clamp(2 * reach, kLeastReach * here.length, here.length);
        return blended * all(turned * length / 3.f);
    };
    const Four a = three(here.position);
    const Four d = three(next.position);
    return {a, a + handle(here.tangent, reachBefore), d - handle(next.tangent, reachAfter), d};
}

/// Appends the points strictly inside `curve`, in order; radius, slope and along are left for later.
void halve(const Bezier& curve, Four startTangent, Four endTangent, float cosMaxTurn, int halvings,
           std::vector<CurvePoint>& points)
{
    const Four middle = simd::directionOr(curve.c - curve.b, curve.d - curve.a);
    const bool turns = dot(startTangent, middle) < cosMaxTurn || dot(middle, endTangent) < cosMaxTurn ||
                       dot(startTangent, endTangent) < cosMaxTurn;
    if (!turns || halvings == 0)
        return;

    const Four half = all(0.5f);
    const Four ab = half * (curve.a + curve.b);
    const Four bc = half * (curve.b + curve.c);
    const Four cd = half * (curve.c + curve.d);
    const Four abc = half * (ab + bc);
    const Four bcd = half * (bc + cd);
    const Four split = half * (abc + bcd);
    const Four splitTangent = simd::directionOr(bcd - abc, startTangent);

    halve({curve.a, ab, abc, split}, startTangent, splitTangent, cosMaxTurn, halvings - 1, points);
    CurvePoint& point = points.emplace_back();
    simd::storeThree(&point.position, split);
    simd::storeThree(&point.tangent, splitTangent);
    halve({split, bcd, cd, curve.d}, splitTangent, endTangent, cosMaxTurn, halvings - 1, points);
}

/// Radius and slope at `along` in [0, length] of a cubic from `radius0` to `radius1`.
void setRadius(CurvePoint& point, float along, float length, float radius0, float slope0, float radius1, float slope1)
{
    const float t = along / length;
    const float rise = radius1 - radius0;
    const float m0 = slope0 * length;
    const float m1 = slope1 * length;
    const float bend = m0 + m1 - 2 * rise;
    const float lean = 3 * rise - 2 * m0 - m1;
    point.radius = std::max(radius0 + t * (m0 + t * (lean + t * bend)), 0.f);
    point.slope = (m0 + t * (2 * lean + 3 * t * bend)) / length;
}

} // namespace

bool areApart(const Vec3& a, const Vec3& b) noexcept
{
    constexpr float kSmallest = 1e-6f;      // metres
    constexpr float kSmallestShare = 1e-6f; // of a coordinate: eight roundings or more
    const float largest = std::max({std::abs(b.x), std::abs(b.y), std::abs(b.z)});
    const float least = std::max(kSmallest, kSmallestShare * largest);
    const Vec3 step = b - a;
    return glm::dot(step, step) > least * least;
}

void sampleAxis(const AxisStart& start, const AxisRounding& rounding, std::vector<AxisJoint>& joints,
                std::vector<CurvePoint>& points)
{
    fit(start.tangent, joints);
    points.clear();
    points.push_back({.position = joints[0].position,
                      .tangent = joints[0].tangent,
                      .radius = joints[0].radius,
                      .slope = joints[0].slope,
                      .piece = joints[0].piece});
    for (std::size_t k = 0; k + 1 < joints.size(); ++k)
    {
        const AxisJoint& here = joints[k];
        const AxisJoint& next = joints[k + 1];
        const Bezier curve = segmentCurve(joints, k, start.reach, rounding.smoothing);
        const Four direction = three(here.direction);
        const std::size_t first = points.size();
        halve(curve, simd::directionOr(curve.b - curve.a, direction), simd::directionOr(curve.d - curve.c, direction),
              rounding.cosMaxTurn, kMaxHalvings, points);
        CurvePoint& end = points.emplace_back();
        simd::storeThree(&end.position, curve.d);
        simd::storeThree(&end.tangent, three(next.tangent));

        Four before = curve.a;
        for (std::size_t i = first; i < points.size(); ++i)
        {
            const Four position = three(points[i].position);
            points[i].along = points[i - 1].along + simd::length(position - before);
            points[i].piece = here.piece;
            before = position;
        }
        const float startAlong = points[first - 1].along;
        const float length = points.back().along - startAlong;
        for (std::size_t i = first; i < points.size(); ++i)
            setRadius(points[i], points[i].along - startAlong, length, here.radius, here.slope, next.radius,
                      next.slope);
    }
}

CurvePoint pointBetween(const CurvePoint& a, const CurvePoint& b, float along) noexcept
{
    const float length = b.along - a.along;
    CurvePoint point = a;
    point.piece = b.piece;
    if (!(length > 0))
        return point;
    const float t = (along - a.along) / length;
    const Four from = three(a.position);
    const Four chord = three(b.position) - from;
    const Four startTangent = three(a.tangent);
    const Four m0 = startTangent * all(length);
    const Four m1 = three(b.tangent) * all(length);
    const Four bend = m0 + m1 - all(2.f) * chord;
    const Four lean = all(3.f) * chord - all(2.f) * m0 - m1;
    point.along = along;
    simd::storeThree(&point.position, from + all(t) * (m0 + all(t) * (lean + all(t) * bend)));
    const Four way = m0 + all(t) * (all(2.f) * lean + all(3.f * t) * bend);
    simd::storeThree(&point.tangent, simd::directionOr(way, startTangent));
    setRadius(point, along - a.along, length, a.radius, a.slope, b.radius, b.slope);
    return point;
}

} // namespace espalier
