#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Core/Random.h>
#include <Espalier/Mesh/Triangulation.h>
#include <cmath>
#include <gtest/gtest.h>

namespace espalier {
namespace {

using Corners = std::vector<DVec2>;

double shoelaceArea(const Corners& corners)
{
    double twice = 0;
    for (std::size_t i = 0; i < corners.size(); ++i)
    {
        const DVec2 a = corners[i];
        const DVec2 b = corners[(i + 1) % corners.size()];
        twice += a.x * b.y - a.y * b.x;
    }
    return twice / 2;
}

struct Filled
{
    std::vector<std::uint32_t> triangles;
    double area = 0; ///< Of all triangles, each counted as positive.
};

Filled filled(const Corners& corners, std::uint64_t work = std::uint64_t{1} << 40)
{
    TriangulationScratch scratch;
    Filled result;
    triangulate(corners, work, scratch, result.triangles);
    EXPECT_EQ(result.triangles.size() % 3, 0u);
    for (std::size_t i = 0; i + 2 < result.triangles.size(); i += 3)
    {
        const double area = shoelaceArea({corners.at(result.triangles[i]), corners.at(result.triangles[i + 1]),
                                          corners.at(result.triangles[i + 2])});
        EXPECT_GT(area, 0) << "triangle " << i / 3;
        result.area += area;
    }
    return result;
}

/// A star whose every second corner bends inwards to a random depth.
Corners randomStar(std::uint64_t seed, std::uint32_t corners)
{
    const RandomKey key(Seed{seed});
    Corners star;
    for (std::uint32_t i = 0; i < corners; ++i)
    {
        const math::SinCos at = math::sinCosDegrees(360.0 * i / corners);
        const double radius = 0.05 + key.uniform(Purpose::Sampling, i);
        star.emplace_back(radius * at.cos, radius * at.sin);
    }
    return star;
}

/// A strip of `turns` turns, one wide, that winds inwards.
Corners spiral(std::uint32_t turns)
{
    Corners outer;
    Corners inner;
    for (std::uint32_t i = 0; i <= 24 * turns; ++i)
    {
        const math::SinCos at = math::sinCosDegrees(15.0 * i);
        const double radius = 10 + 2.0 * i / 24;
        outer.emplace_back((radius + 1) * at.cos, (radius + 1) * at.sin);
        inner.emplace_back(radius * at.cos, radius * at.sin);
    }
    outer.insert(outer.end(), inner.rbegin(), inner.rend());
    return outer;
}

TEST(Triangulation, NothingWithoutArea)
{
    const Corners cases[] = {
        {},
        {{1, 1}},
        {{0, 0}, {1, 0}},
        {{2, 2}, {2, 2}, {2, 2}},
        {{0, 0}, {1, 1}, {2, 2}, {3, 3}},
        {{0, 0}, {1, 0}, {2, 0}, {1, 0}}, // out and back
    };
    for (const Corners& corners : cases)
        EXPECT_TRUE(filled(corners).triangles.empty()) << corners.size() << " corners";
}

TEST(Triangulation, FillsOutlinesExactly)
{
    struct Case
    {
        const char* name;
        Corners corners;
    };
    const Case cases[] = {
        {"triangle", {{0, 0}, {1, 0}, {0, 1}}},
        {"square", {{0, 0}, {1, 0}, {1, 1}, {0, 1}}},
        {"arrow", {{0, 0}, {2, 1}, {0, 2}, {0.5, 1}}},
        {"L", {{0, 0}, {3, 0}, {3, 1}, {1, 1}, {1, 3}, {0, 3}}},
        {"collinear corners", {{0, 0}, {1, 0}, {2, 0}, {2, 1}, {2, 2}, {1, 2}, {0, 2}, {0, 1}}},
        {"repeated corners", {{0, 0}, {2, 0}, {2, 0}, {1, 0.5}, {1, 0.5}, {2, 2}, {0, 2}, {0, 2}, {0, 0}}},
        {"spike outwards", {{0, 0}, {2, 0}, {2, 1}, {5, 1}, {2, 1}, {2, 2}, {0, 2}}},
        {"spike inwards", {{0, 0}, {2, 0}, {2, 1}, {1, 1}, {2, 1}, {2, 2}, {0, 2}}},
        {"touches itself in a corner", {{0, 0}, {1, 1}, {2, 0}, {2, 2}, {1, 1}, {0, 2}}},
        {"ring cut open", {{0, 0}, {3, 0}, {3, 3}, {0, 3}, {0, 0}, {1, 1}, {1, 2}, {2, 2}, {2, 1}, {1, 1}}},
        {"comb", {{0, 0}, {7, 0}, {7, 3}, {6, 1}, {5, 3}, {4, 1}, {3, 3}, {2, 1}, {1, 3}}},
        {"spiral", spiral(5)},
    };
    for (const Case& c : cases)
    {
        const double area = shoelaceArea(c.corners);
        ASSERT_GT(area, 0) << c.name;
        EXPECT_NEAR(filled(c.corners).area, area, 1e-9 * area) << c.name;
    }
    for (std::uint64_t seed = 0; seed < 200; ++seed)
    {
        const Corners star = randomStar(seed, 3 + static_cast<std::uint32_t>(seed) % 90);
        const double area = shoelaceArea(star);
        const Filled result = filled(star);
        EXPECT_NEAR(result.area, area, 1e-6 * area) << "seed " << seed;
        EXPECT_LE(result.triangles.size(), 3 * (star.size() - 2)) << "seed " << seed;
    }
}

TEST(Triangulation, CrossingEdgesStillGiveTriangles)
{
    const Corners bowTie{{0, 0}, {2, 2}, {2, 0}, {0, 1}};
    const Corners pentagram{{1, 0}, {-0.8, 0.6}, {0.3, -0.95}, {0.3, 0.95}, {-0.8, -0.6}};
    EXPECT_FALSE(filled(bowTie).triangles.empty());
    EXPECT_FALSE(filled(pentagram).triangles.empty());
}

TEST(Triangulation, SpendsNoMoreWorkThanItMay)
{
    const Corners vast = spiral(20000); // about a million corners
    std::uint64_t work = 1u << 20;
    TriangulationScratch scratch;
    std::vector<std::uint32_t> triangles;
    triangulate(vast, work, scratch, triangles);
    EXPECT_EQ(work, 0u);
    EXPECT_FALSE(triangles.empty());
    EXPECT_LE(triangles.size(), 3 * (vast.size() - 2));
}

} // namespace
} // namespace espalier
