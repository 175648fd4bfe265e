#include <Espalier/Render/Camera.h>

#include <Espalier/Core/Random.h>
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <vector>

namespace espalier {

namespace {

constexpr FrameMargins kMargins{.side = 0.9, .top = 0.95, .bottom = 0.8};

/// How far towards each edge of what it may fill a subject reaches; 1 touches.
struct Reach
{
    double left = -1e9;
    double right = -1e9;
    double top = -1e9;
    double bottom = -1e9;
};

Reach reachOf(std::span<const Vec3> points, const Camera& camera)
{
    Reach reach;
    for (const Vec3 point : points)
    {
        const DVec3 p = DVec3(point) - camera.position;
        const double depth = glm::dot(p, camera.axes.forward);
        EXPECT_GT(depth, 0);
        const double x = glm::dot(p, camera.axes.right) / (depth * camera.slopeX);
        const double y = glm::dot(p, camera.axes.up) / (depth * camera.slopeY);
        reach.right = std::max(reach.right, x / kMargins.side);
        reach.left = std::max(reach.left, -x / kMargins.side);
        reach.top = std::max(reach.top, y / kMargins.top);
        reach.bottom = std::max(reach.bottom, -y / kMargins.bottom);
    }
    return reach;
}

} // namespace

TEST(Camera, AxesAreOrthonormalAndRightIsLevel)
{
    for (double azimuth = -4; azimuth < 4; azimuth += 0.37)
        for (double elevation = -1.5; elevation <= 1.5; elevation += 0.25)
        {
            const ViewAxes axes = viewAxes(azimuth, elevation);
            EXPECT_NEAR(glm::dot(axes.right, axes.up), 0, 1e-12);
            EXPECT_NEAR(glm::dot(axes.right, axes.forward), 0, 1e-12);
            EXPECT_NEAR(glm::length(axes.right), 1, 1e-12);
            EXPECT_NEAR(glm::length(axes.up), 1, 1e-12);
            EXPECT_EQ(axes.right.y, 0);
            EXPECT_GE(axes.up.y, 0);
            EXPECT_GT(glm::dot(glm::cross(axes.right, axes.up), -axes.forward), 0.999);
        }
}

TEST(Camera, AtAzimuthZeroStandsOnPlusZ)
{
    const ViewAxes axes = viewAxes(0, 0);
    EXPECT_EQ(axes.forward, DVec3(0, 0, -1));
    EXPECT_EQ(axes.right, DVec3(1, 0, 0));
    EXPECT_EQ(axes.up, DVec3(0, 1, 0));
}

TEST(Camera, SeesAllOfAnySubjectAndTouchesItsMargins)
{
    for (std::uint64_t seed = 0; seed < 300; ++seed)
    {
        RandomKey key(Seed{seed});
        std::uint32_t draws = 0;
        const auto draw = [&](double low, double high) { return key.uniform(Purpose::Sampling, low, high, draws++); };
        const double width = draw(0.5, 5);
        const double height = draw(0.5, 5);
        std::vector<Vec3> points;
        for (int i = 0; i < 40; ++i)
        {
            const double x = draw(-width, width);
            const double y = draw(0, height);
            const double z = draw(-width, width);
            points.emplace_back(x, y, z);
        }
        Camera camera;
        camera.slopeY = draw(0.05, 0.6);
        camera.slopeX = camera.slopeY * draw(0.5, 2);
        const double azimuth = draw(-3, 3);
        camera.axes = viewAxes(azimuth, draw(-1, 1));
        const DVec3 origin(0.3, -0.1, 0.2);
        const DVec3 stand = nearestStand(frameBounds(points, origin, camera, kMargins), camera, kMargins);
        camera.position =
            origin + stand.x * camera.axes.right + stand.y * camera.axes.up + stand.z * camera.axes.forward;

        const Reach reach = reachOf(points, camera);
        const double widest = std::max(reach.left, reach.right);
        const double tallest = std::max(reach.top, reach.bottom);
        EXPECT_LE(std::max(widest, tallest), 1 + 1e-6) << "seed " << seed;
        const bool touchesSides = std::min(reach.left, reach.right) > 1 - 1e-6;
        const bool touchesTopAndBottom = std::min(reach.top, reach.bottom) > 1 - 1e-6;
        EXPECT_TRUE(touchesSides || touchesTopAndBottom) << "seed " << seed;
    }
}

} // namespace espalier
