#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Core/Random.h>
#include <Espalier/Mesh/ConvexHull.h>
#include <Mesh/HullCheck.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <limits>
#include <map>
#include <string>

namespace espalier {

namespace {

constexpr std::uint32_t kAll = 0xffffffffu;

using Draw = std::function<float()>;

/// Points of one kind, from numbers in [0, 1).
struct Cloud
{
    const char* name;
    std::function<Vec3(const Draw&)> point;
};

const std::vector<Cloud> kClouds{
    {"cube",
     [](const Draw& draw) {
         const float x = draw();
         const float y = draw();
         return Vec3(x, y, draw());
     }},
    {"small grid",
     [](const Draw& draw) {
         const float x = std::floor(4 * draw());
         const float y = std::floor(4 * draw());
         return Vec3(x, y, std::floor(4 * draw()));
     }},
    {"sphere",
     [](const Draw& draw) {
         const Vec3 v(draw() - 0.5f, draw() - 0.5f, draw() - 0.5f);
         return v / std::max(glm::length(v), 1e-3f);
     }},
    {"needle",
     [](const Draw& draw) {
         const float x = 1e-4f * draw();
         const float y = 50 * draw();
         return Vec3(x, y, 1e-4f * draw());
     }},
    {"far away",
     [](const Draw& draw) {
         const float x = 9000 + draw();
         const float y = -5000 + draw();
         return Vec3(x, y, draw());
     }},
    {"cylinder",
     [](const Draw& draw) {
         const math::SinCos turn = math::sinCosDegrees(30.0 * std::floor(static_cast<double>(12 * draw())));
         return Vec3(static_cast<float>(turn.sin), std::floor(2 * draw()), static_cast<float>(turn.cos));
     }},
};

std::vector<Vec3> pointsOf(const Cloud& cloud, std::uint64_t seed, std::uint32_t count)
{
    const RandomKey key(Seed{seed});
    std::uint32_t counter = 0;
    const Draw draw = [&] { return static_cast<float>(key.uniform(Purpose::Sampling, counter++)); };
    std::vector<Vec3> points;
    for (std::uint32_t i = 0; i < count; ++i)
        points.push_back(cloud.point(draw));
    return points;
}

HullResult hullOf(const std::vector<Vec3>& points, std::uint32_t most, ConvexHull& hull)
{
    HullScratch scratch;
    return convexHull(points, most, scratch, hull);
}

/// Closed, every edge once in each direction; a sphere; all its vertices are in use.
void expectClosed(const ConvexHull& hull)
{
    std::map<std::array<std::uint32_t, 2>, int> edges;
    std::vector<bool> isUsed(hull.vertices.size());
    for (std::size_t t = 0; t < hull.indices.size(); t += 3)
        for (std::size_t k = 0; k < 3; ++k)
        {
            isUsed.at(hull.indices[t + k]) = true;
            ++edges[{hull.indices[t + k], hull.indices[t + (k + 1) % 3]}];
        }
    for (const auto& [edge, count] : edges)
    {
        EXPECT_EQ(count, 1);
        EXPECT_EQ(edges.count({edge[1], edge[0]}), 1u);
    }
    EXPECT_EQ(hull.vertices.size() + hull.indices.size() / 3, edges.size() / 2 + 2) << "Euler";
    EXPECT_TRUE(std::ranges::all_of(isUsed, [](bool used) { return used; }));
}

double volumeOf(const ConvexHull& hull)
{
    double volume = 0;
    const DVec3 origin(hull.vertices[0]);
    for (std::size_t t = 0; t < hull.indices.size(); t += 3)
    {
        const DVec3 a = DVec3(hull.vertices[hull.indices[t]]) - origin;
        const DVec3 b = DVec3(hull.vertices[hull.indices[t + 1]]) - origin;
        const DVec3 c = DVec3(hull.vertices[hull.indices[t + 2]]) - origin;
        volume += glm::dot(a, glm::cross(b, c)) / 6;
    }
    return volume;
}

} // namespace

TEST(ConvexHull, SaysWhyThereIsNone)
{
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const float huge = std::numeric_limits<float>::infinity();
    struct Case
    {
        std::vector<Vec3> points;
        HullResult result;
    };
    const std::vector<Case> cases{
        {{}, HullResult::NoPoints},
        {{Vec3(1, 2, 3)}, HullResult::OnePlace},
        {{Vec3(1, 2, 3), Vec3(1, 2, 3)}, HullResult::OnePlace},
        {{Vec3(0), Vec3(1)}, HullResult::Collinear},
        {{Vec3(0), Vec3(1), Vec3(0.5f), Vec3(-3)}, HullResult::Collinear},
        {{Vec3(0), Vec3(1, 0, 0), Vec3(0, 1, 0)}, HullResult::Coplanar},
        {{Vec3(0, 1, 0), Vec3(1, 0, 0), Vec3(0, 0, 1), Vec3(-1, 1, 1), Vec3(1, 1, -1)}, HullResult::Coplanar},
        {{Vec3(0), Vec3(1, 0, 0), Vec3(0, nan, 0), Vec3(0, 0, 1)}, HullResult::NotFinite},
        {{Vec3(0), Vec3(1, 0, 0), Vec3(0, huge, 0), Vec3(0, 0, 1)}, HullResult::NotFinite},
    };
    for (const Case& c : cases)
    {
        ConvexHull hull;
        hull.vertices.resize(1);
        EXPECT_EQ(hullOf(c.points, kAll, hull), c.result);
        EXPECT_EQ(hull, ConvexHull{});
        EXPECT_FALSE(reasonOf(c.result).empty());
    }
}

TEST(ConvexHull, IsATetrahedronOfFourPoints)
{
    ConvexHull hull;
    ASSERT_EQ(hullOf({Vec3(0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)}, kAll, hull), HullResult::Ok);
    EXPECT_EQ(hull.vertices.size(), 4u);
    expectClosed(hull);
    EXPECT_NEAR(volumeOf(hull), 1.0 / 6, 1e-6);
    EXPECT_EQ(hull.overreach, 0);
}

TEST(ConvexHull, IsTheHullWhateverThePoints)
{
    for (const Cloud& cloud : kClouds)
        for (std::uint64_t seed = 0; seed < 40; ++seed)
        {
            const std::vector<Vec3> points = pointsOf(cloud, seed, 5 + static_cast<std::uint32_t>(seed * seed) / 4);
            SCOPED_TRACE(std::string(cloud.name) + " " + std::to_string(seed));
            ConvexHull hull;
            const HullResult result = hullOf(points, kAll, hull);
            if (result == HullResult::Coplanar)
                continue; // a few points of a grid
            ASSERT_EQ(result, HullResult::Ok);
            expectClosed(hull);
            EXPECT_GT(volumeOf(hull), 0);
            EXPECT_LE(farthestOutside(hull, points), 3 * static_cast<double>(hull.tolerance));
            EXPECT_EQ(hull.overreach, 0);
            for (const Vec3& vertex : hull.vertices)
                EXPECT_NE(std::find(points.begin(), points.end(), vertex), points.end()) << "a point given";
        }
}

TEST(ConvexHull, FindsExactHullsOfGrids)
{
    std::vector<Vec3> points;
    for (int i = 0; i < 1000; ++i)
        points.emplace_back(i % 10, i / 10 % 10, i / 100);
    ConvexHull hull;
    ASSERT_EQ(hullOf(points, kAll, hull), HullResult::Ok);
    expectClosed(hull);
    EXPECT_EQ(hull.vertices.size(), 8u);
    EXPECT_NEAR(volumeOf(hull), 729, 1e-3);
}

TEST(ConvexHull, HoldsAllPointsWithFewVertices)
{
    for (const Cloud& cloud : kClouds)
    {
        const std::vector<Vec3> points = pointsOf(cloud, 99, 800);
        ConvexHull whole;
        ASSERT_EQ(hullOf(points, kAll, whole), HullResult::Ok);
        float before = std::numeric_limits<float>::infinity();
        for (const std::uint32_t most : {0u, 4u, 6u, 10u, 16u, 32u, 64u, 128u, 800u})
        {
            SCOPED_TRACE(std::string(cloud.name) + " " + std::to_string(most));
            ConvexHull hull;
            ASSERT_EQ(hullOf(points, most, hull), HullResult::Ok);
            expectClosed(hull);
            EXPECT_LE(hull.vertices.size(), std::max(most, 4u));
            EXPECT_LE(farthestOutside(hull, points), 3 * static_cast<double>(hull.tolerance));
            EXPECT_GE(volumeOf(hull), volumeOf(whole) * 0.999);
            EXPECT_LE(farthestOutside(whole, hull.vertices), static_cast<double>(hull.overreach + 3 * hull.tolerance));
            EXPECT_LE(hull.overreach, before);
            before = hull.overreach;
        }
        EXPECT_EQ(before, 0);
    }
}

TEST(ConvexHull, IsReproducible)
{
    HullScratch scratch;
    ConvexHull warm;
    for (const Cloud& cloud : kClouds)
    {
        const std::vector<Vec3> points = pointsOf(cloud, 5, 300);
        ASSERT_EQ(convexHull(points, 20, scratch, warm), HullResult::Ok);
        ConvexHull fresh;
        ASSERT_EQ(hullOf(points, 20, fresh), HullResult::Ok);
        EXPECT_EQ(warm, fresh);
    }
}

} // namespace espalier
