#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Core/Random.h>
#include <Espalier/Mesh/AxisCurve.h>
#include <Espalier/Mesh/RingFrames.h>
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>

namespace espalier {
namespace {

constexpr float kMaxTurn = 0.2f;

AxisRounding rounding(float smoothing = 1)
{
    return {.smoothing = smoothing, .cosMaxTurn = static_cast<float>(math::cos(static_cast<double>(kMaxTurn)))};
}

std::vector<CurvePoint> curveThrough(std::vector<AxisJoint> joints, float smoothing = 1)
{
    const Vec3 first = directionOr(joints[1].position - joints[0].position, Vec3(0));
    std::vector<CurvePoint> points;
    sampleAxis({.tangent = first, .reach = 1}, rounding(smoothing), joints, points);
    return points;
}

std::vector<AxisJoint> randomJoints(std::uint64_t seed)
{
    const RandomKey key(Seed{seed});
    std::vector<AxisJoint> joints(8);
    Vec3 position(0);
    float radius = 0.3f;
    for (std::uint32_t i = 0; i < joints.size(); ++i)
    {
        const auto draw = [&](std::uint32_t n) {
            return static_cast<float>(key.child(i).uniform(Purpose::Sampling, n));
        };
        joints[i] = {.position = position, .radius = radius};
        const float length = draw(0) < 0.3f ? 0.1f : 1.f; // Uneven on purpose.
        position += length * glm::normalize(Vec3(2 * draw(1) - 1, 0.3f + draw(2), 2 * draw(3) - 1));
        radius *= draw(4) < 0.5f ? 1.f : draw(5);
    }
    return joints;
}

TEST(AxisCurve, DirectionOfNothingIsTheOther)
{
    const Vec3 other(0, 0, 1);
    EXPECT_EQ(directionOr(Vec3(0), other), other);
    EXPECT_EQ(directionOr(Vec3(std::numeric_limits<float>::infinity(), 0, 0), other), other);
    EXPECT_NEAR(glm::length(directionOr(Vec3(1e-30f, 1e-30f, 0), other)), 1, 1e-6);
    EXPECT_NEAR(glm::length(directionOr(Vec3(1e30f, 1e30f, 0), other)), 1, 1e-6);
}

TEST(AxisCurve, AStraightAxisNeedsNoPointsBetweenItsJoints)
{
    const std::vector<CurvePoint> points = curveThrough(
        {{.position = {0, 0, 0}, .radius = 1}, {.position = {0, 1, 0}, .radius = 1}, {.position = {0, 3, 0}}});
    ASSERT_EQ(points.size(), 3u);
    EXPECT_FLOAT_EQ(points[2].along, 3);
    EXPECT_EQ(points[1].tangent, Vec3(0, 1, 0));
}

TEST(AxisCurve, AHairpinStaysFinite)
{
    const std::vector<CurvePoint> points =
        curveThrough({{.position = {0, 0, 0}}, {.position = {0, 1, 0}}, {.position = {0, 0, 0}}});
    for (const CurvePoint& point : points)
    {
        EXPECT_NEAR(glm::length(point.tangent), 1, 1e-5);
        EXPECT_LT(glm::length(point.position), 1.5f);
    }
}

TEST(AxisCurve, ItPassesThroughEveryJointAndTurnsNoMoreThanAllowed)
{
    for (std::uint64_t seed = 0; seed < 100; ++seed)
    {
        const std::vector<AxisJoint> joints = randomJoints(seed);
        const std::vector<CurvePoint> points = curveThrough(joints);
        std::size_t met = 0;
        for (std::size_t i = 0; i < points.size(); ++i)
        {
            met += met < joints.size() && points[i].position == joints[met].position ? 1 : 0;
            if (i > 0)
            {
                const double turn =
                    math::acos(std::min(1.0, double{glm::dot(points[i - 1].tangent, points[i].tangent)}));
                EXPECT_LE(turn, double{kMaxTurn} + 1e-3) << "seed " << seed << ", point " << i;
                EXPECT_GT(points[i].along, points[i - 1].along);
            }
        }
        EXPECT_EQ(met, joints.size()) << "seed " << seed;
    }
}

TEST(AxisCurve, ItStaysNearItsChordsHoweverUnevenTheyAre)
{
    for (std::uint64_t seed = 0; seed < 100; ++seed)
    {
        const std::vector<AxisJoint> joints = randomJoints(seed);
        std::size_t k = 0;
        for (const CurvePoint& point : curveThrough(joints))
        {
            if (k + 2 < joints.size() && point.position == joints[k + 1].position)
                ++k;
            const Vec3 chord = joints[k + 1].position - joints[k].position;
            const float length = glm::length(chord);
            const Vec3 arm = point.position - joints[k].position;
            const float aside = glm::length(arm - chord * (glm::dot(arm, chord) / (length * length)));
            EXPECT_LE(aside, 0.3f * length) << "seed " << seed;
        }
    }
}

TEST(AxisCurve, RadiiAreMonotoneBetweenJoints)
{
    for (std::uint64_t seed = 0; seed < 100; ++seed)
    {
        const std::vector<CurvePoint> points = curveThrough(randomJoints(seed));
        for (std::size_t i = 1; i < points.size(); ++i)
        {
            EXPECT_LE(points[i].radius, points[i - 1].radius + 1e-6f) << "seed " << seed << ", point " << i;
            EXPECT_LE(points[i].slope, 1e-4f);
            const CurvePoint middle =
                pointBetween(points[i - 1], points[i], 0.5f * (points[i - 1].along + points[i].along));
            EXPECT_LE(middle.radius, points[i - 1].radius + 1e-6f);
            EXPECT_GE(middle.radius, points[i].radius - 1e-6f);
        }
    }
}

TEST(AxisCurve, WithoutSmoothingItIsThePolyline)
{
    const std::vector<AxisJoint> joints = randomJoints(1);
    const std::vector<CurvePoint> points = curveThrough(joints, 0);
    ASSERT_EQ(points.size(), joints.size());
    for (std::size_t i = 0; i < points.size(); ++i)
        EXPECT_EQ(points[i].position, joints[i].position);
}

} // namespace
} // namespace espalier
