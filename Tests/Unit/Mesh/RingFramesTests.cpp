#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Core/Random.h>
#include <Espalier/Mesh/RingFrames.h>
#include <cmath>
#include <gtest/gtest.h>

namespace espalier {
namespace {

void expectNormal(const Vec3& side, const Vec3& tangent)
{
    EXPECT_NEAR(glm::length(side), 1, 1e-5);
    EXPECT_NEAR(glm::dot(side, tangent), 0, 1e-5);
}

TEST(RingFrames, UselessWishesStillGiveASide)
{
    for (const Vec3& tangent : {Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, -1)})
    {
        expectNormal(sideNormalTo(tangent, Vec3(0)), tangent);
        expectNormal(sideNormalTo(tangent, tangent), tangent);
        expectNormal(sideNormalTo(tangent, -2.f * tangent), tangent);
    }
}

TEST(RingFrames, ACoincidentPointOrAReversedTangentIsHarmless)
{
    const Vec3 side(1, 0, 0);
    const Vec3 up(0, 1, 0);
    for (const Vec3& next : {up, -up, Vec3(1, 0, 0), Vec3(0, 0, 1)})
    {
        for (const Vec3& step : {Vec3(0), up, -up, Vec3(1e-20f, 0, 0)})
            expectNormal(transportSide(side, Vec3(0), up, step, next), next);
    }
}

TEST(RingFrames, APlanarCurveDoesNotTwist)
{
    const Vec3 binormal(0, 0, 1);
    Vec3 side = glm::normalize(Vec3(1, 0, 1)); // 45 degrees off the plane; that angle must stay.
    Vec3 position(0);
    Vec3 tangent(0, 1, 0);
    for (int i = 1; i <= 60; ++i)
    {
        const math::SinCos turn = math::sinCos(0.7 * math::sin(0.2 * i));
        const Vec3 nextTangent(static_cast<float>(turn.sin), static_cast<float>(turn.cos), 0);
        const Vec3 next = position + 0.1f * glm::normalize(tangent + nextTangent);
        side = transportSide(side, position, tangent, next, nextTangent);
        position = next;
        tangent = nextTangent;
        EXPECT_NEAR(glm::dot(side, binormal), std::sqrt(0.5f), 1e-5f) << "step " << i;
    }
}

TEST(RingFrames, AHelixTurnsAgainstItsFrenetFrameByItsTorsion)
{
    // (a cos t, b t, a sin t): speed c = sqrt(a^2 + b^2), torsion b / c^2 in magnitude, so b / c per unit of t.
    const double a = 1.0;
    const double b = 0.5;
    const double c = std::sqrt(a * a + b * b);
    const auto at = [&](double t) {
        const math::SinCos s = math::sinCos(t);
        return Vec3(a * s.cos, b * t, a * s.sin);
    };
    const auto tangentAt = [&](double t) {
        const math::SinCos s = math::sinCos(t);
        return Vec3(-a * s.sin / c, b / c, a * s.cos / c);
    };
    const auto frenetNormalAt = [&](double t) {
        const math::SinCos s = math::sinCos(t);
        return Vec3(-s.cos, 0, -s.sin);
    };
    constexpr int kSteps = 200;
    constexpr double kEnd = 4.0;
    Vec3 side = frenetNormalAt(0);
    for (int i = 1; i <= kSteps; ++i)
    {
        const double t0 = kEnd * (i - 1) / kSteps;
        const double t1 = kEnd * i / kSteps;
        side = transportSide(side, at(t0), tangentAt(t0), at(t1), tangentAt(t1));
    }
    const double turned = math::acos(static_cast<double>(glm::dot(side, frenetNormalAt(kEnd))));
    EXPECT_NEAR(turned, kEnd * b / c, 2e-3);
}

TEST(RingFrames, AnyInputGivesAUnitNormal)
{
    const RandomKey key(Seed{3});
    for (std::uint32_t i = 0; i < 2000; ++i)
    {
        const auto vector = [&](std::uint32_t n) {
            const RandomKey k = key.child(i).child(n);
            const auto x = static_cast<float>(2 * k.uniform(Purpose::Sampling, 0) - 1);
            const auto y = static_cast<float>(2 * k.uniform(Purpose::Sampling, 1) - 1);
            const auto z = static_cast<float>(2 * k.uniform(Purpose::Sampling, 2) - 1);
            return Vec3(x, y, z);
        };
        const Vec3 tangent = glm::normalize(vector(0));
        const Vec3 next = glm::normalize(vector(1));
        const Vec3 side = sideNormalTo(tangent, vector(2));
        expectNormal(side, tangent);
        expectNormal(transportSide(side, Vec3(0), tangent, vector(3), next), next);
    }
}

} // namespace
} // namespace espalier
