#include <Espalier/Mesh/AxisCurve.h>
#include <algorithm>
#include <cmath>

// Radii: F. N. Fritsch, J. Butland, "A Method for Constructing Local Monotone Piecewise Cubic Interpolants", SIAM J.
// Sci. Stat. Comput., 1984 (the harmonic mean of neighbouring secants).

namespace espalier {
namespace {

/// A segment is halved at most so often: 2^8 rings draw any bend that anybody asked for.
constexpr int kMaxHalvings = 8;

/// Beside a much shorter neighbour a tangent still has this share of its own segment, lest the bend become a corner.
constexpr float kLeastReach = 0.3f;

/// Below this sine of half the turn the two directions at a joint cancel: the axis folds back on itself.
constexpr float kHairpin = 1e-3f;

Vec3 anyNormalTo(const Vec3& direction)
{
    const Vec3 aside = std::abs(direction.x) < 0.6f ? Vec3(1, 0, 0) : Vec3(0, 0, 1);
    return glm::normalize(glm::cross(direction, aside));
}

Vec3 tangentBetween(const Vec3& before, const Vec3& after)
{
    const Vec3 sum = before + after;
    return glm::dot(sum, sum) > 4 * kHairpin * kHairpin ? glm::normalize(sum) : anyNormalTo(before);
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
    for (std::size_t k = 0; k < last; ++k)
    {
        const Vec3 chord = joints[k + 1].position - joints[k].position;
        joints[k].length = glm::length(chord);
        joints[k].direction = directionOr(chord, Vec3(0, 1, 0));
    }
    joints[last].direction = joints[last - 1].direction;

    joints[0].tangent = startTangent;
    joints[0].slope = (joints[1].radius - joints[0].radius) / joints[0].length;
    for (std::size_t k = 1; k < last; ++k)
    {
        joints[k].tangent = tangentBetween(joints[k - 1].direction, joints[k].direction);
        joints[k].slope = monotoneSlope(joints[k - 1], joints[k], joints[k + 1].radius);
    }
    // A free end is bent by nothing: the cubic's second derivative vanishes there.
    const AxisJoint& before = joints[last - 1];
    joints[last].tangent = directionOr(1.5f * before.direction - 0.5f * before.tangent, before.direction);
    joints[last].slope = (joints[last].radius - before.radius) / before.length;
}

struct Bezier
{
    Vec3 a, b, c, d;
};

/// The cubic over the segment from joint `k` to the next, with its end tangents turned towards the chord as `smoothing`
/// asks.
Bezier segmentCurve(const std::vector<AxisJoint>& joints, std::size_t k, float startReach, float smoothing)
{
    const AxisJoint& here = joints[k];
    const AxisJoint& next = joints[k + 1];
    const float reachBefore = k > 0 ? joints[k - 1].length : startReach;
    const float reachAfter = k + 2 < joints.size() ? next.length : here.length;
    const auto handle = [&](const Vec3& tangent, float reach) {
        // A unit tangent of full length is Catmull-Rom's on even joints; a turned one bulges less when shorter.
        const Vec3 blended = directionOr(glm::mix(here.direction, tangent, smoothing), here.direction);
        const float turned = std::max(glm::dot(blended, here.direction), 0.35f);
        const float length = std::clamp(2 * reach, kLeastReach * here.length, here.length);
        return blended * (turned * length / 3.f);
    };
    return {here.position, here.position + handle(here.tangent, reachBefore),
            next.position - handle(next.tangent, reachAfter), next.position};
}

/// Appends the points strictly inside `curve`, in order; radius, slope and along are left for later.
void halve(const Bezier& curve, const Vec3& startTangent, const Vec3& endTangent, float cosMaxTurn, int halvings,
           std::vector<CurvePoint>& points)
{
    const Vec3 middle = directionOr(curve.c - curve.b, curve.d - curve.a);
    const bool turns = glm::dot(startTangent, middle) < cosMaxTurn || glm::dot(middle, endTangent) < cosMaxTurn ||
                       glm::dot(startTangent, endTangent) < cosMaxTurn;
    if (!turns || halvings == 0)
        return;

    const Vec3 ab = 0.5f * (curve.a + curve.b);
    const Vec3 bc = 0.5f * (curve.b + curve.c);
    const Vec3 cd = 0.5f * (curve.c + curve.d);
    const Vec3 abc = 0.5f * (ab + bc);
    const Vec3 bcd = 0.5f * (bc + cd);
    const Vec3 split = 0.5f * (abc + bcd);
    const Vec3 splitTangent = directionOr(bcd - abc, startTangent);

    halve({curve.a, ab, abc, split}, startTangent, splitTangent, cosMaxTurn, halvings - 1, points);
    points.push_back({.position = split, .tangent = splitTangent});
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
        const std::size_t first = points.size();
        halve(curve, directionOr(curve.b - curve.a, here.direction), directionOr(curve.d - curve.c, here.direction),
              rounding.cosMaxTurn, kMaxHalvings, points);
        points.push_back({.position = next.position, .tangent = next.tangent});

        for (std::size_t i = first; i < points.size(); ++i)
        {
            points[i].along = points[i - 1].along + glm::length(points[i].position - points[i - 1].position);
            points[i].piece = here.piece;
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
    const Vec3 chord = b.position - a.position;
    const Vec3 m0 = a.tangent * length;
    const Vec3 m1 = b.tangent * length;
    const Vec3 bend = m0 + m1 - 2.f * chord;
    const Vec3 lean = 3.f * chord - 2.f * m0 - m1;
    point.along = along;
    point.position = a.position + t * (m0 + t * (lean + t * bend));
    point.tangent = directionOr(m0 + t * (2.f * lean + 3.f * t * bend), a.tangent);
    setRadius(point, along - a.along, length, a.radius, a.slope, b.radius, b.slope);
    return point;
}

} // namespace espalier
