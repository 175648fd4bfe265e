#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Core/Random.h>
#include <Espalier/Mesh/SheetTriangulation.h>
#include <gtest/gtest.h>
#include <map>

namespace espalier {
namespace {

constexpr std::int64_t kHeight = kUnrolledTurn / 2;

std::int64_t wayRound(const UnrolledPoint& from, const UnrolledPoint& to)
{
    const std::int64_t x = to.x - from.x;
    return x > kUnrolledTurn / 2 ? x - kUnrolledTurn : x < -kUnrolledTurn / 2 ? x + kUnrolledTurn : x;
}

/// Twice the area of all triangles; each must run counter-clockwise, and each side be passed once each way or lie on a
/// ring or a hole.
std::int64_t coveredArea(const SheetTriangulation& sheet, std::size_t& border)
{
    std::int64_t area = 0;
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> sides;
    for (const SheetTriangle& triangle : sheet.triangles())
    {
        if (triangle.removed)
            continue;
        const auto& p = sheet.points();
        const auto& c = triangle.corners;
        const std::int64_t own =
            wayRound(p[c[0]], p[c[1]]) * (p[c[2]].y - p[c[0]].y) - (p[c[1]].y - p[c[0]].y) * wayRound(p[c[0]], p[c[2]]);
        EXPECT_GT(own, 0);
        area += own;
        for (std::size_t k = 0; k < 3; ++k)
            EXPECT_EQ(++sides[std::pair(c[k], c[(k + 1) % 3])], 1);
    }
    border = 0;
    for (const auto& [side, count] : sides)
        border += sides.count({side.second, side.first}) == 0 ? 1u : 0u;
    return area;
}

std::vector<std::uint32_t> insertCircle(SheetTriangulation& sheet, std::int64_t x, std::int64_t y, double radius,
                                        std::uint32_t count, std::int64_t& area)
{
    std::vector<std::uint32_t> loop;
    std::vector<UnrolledPoint> points;
    for (std::uint32_t j = 0; j < count; ++j)
    {
        const math::SinCos at = math::sinCosDegrees(360.0 * j / count + 7);
        const std::int64_t turned = x + static_cast<std::int64_t>(radius * at.cos) + kUnrolledTurn;
        points.push_back({turned % kUnrolledTurn, y + static_cast<std::int64_t>(radius * at.sin)});
        loop.push_back(sheet.insert(points.back()));
    }
    for (std::uint32_t j = 0; j < count; ++j)
    {
        const UnrolledPoint& a = points[j];
        const UnrolledPoint& b = points[(j + 1) % count];
        area += wayRound({x % kUnrolledTurn, y}, a) * (b.y - y) - (a.y - y) * wayRound({x % kUnrolledTurn, y}, b);
    }
    return loop;
}

TEST(SheetTriangulation, CoversTheBandWhateverIsInserted)
{
    SheetTriangulation sheet;
    for (std::uint64_t seed = 0; seed < 40; ++seed)
    {
        const RandomKey key(Seed{seed});
        const std::uint32_t sides = 3 + static_cast<std::uint32_t>(seed % 9);
        sheet.begin(sides, kHeight);
        for (std::uint32_t i = 0; i < 100; ++i)
        {
            const double x = key.uniform(Purpose::Sampling, 2 * i);
            const double y = key.uniform(Purpose::Sampling, 2 * i + 1);
            // Many on the columns, where sides run already.
            const auto column = static_cast<std::int64_t>(x * sides);
            const auto round = i % 3 == 0 ? kUnrolledTurn * column / sides
                                          : static_cast<std::int64_t>(x * static_cast<double>(kUnrolledTurn - 1));
            (void)sheet.insert({round, 1 + static_cast<std::int64_t>(y * static_cast<double>(kHeight - 2))});
        }
        std::size_t border = 0;
        EXPECT_EQ(coveredArea(sheet, border), 2 * kUnrolledTurn * kHeight) << seed;
        EXPECT_EQ(border, 2 * sides) << seed;
    }
}

TEST(SheetTriangulation, CutsHolesThatNearlyTouch)
{
    SheetTriangulation sheet;
    for (const std::uint32_t holes : {1u, 2u, 3u, 6u})
    {
        sheet.begin(5, kHeight);
        std::int64_t area = 0;
        std::vector<std::vector<std::uint32_t>> loops;
        const double radius = std::min(0.49 * static_cast<double>(kUnrolledTurn) / holes, 0.2 * kUnrolledTurn);
        for (std::uint32_t i = 0; i < holes; ++i)
            loops.push_back(insertCircle(sheet, kUnrolledTurn * i / holes + 11, kHeight / 2, radius, 24, area));
        for (const std::vector<std::uint32_t>& loop : loops)
        {
            ASSERT_TRUE(sheet.fixLoop(loop));
            ASSERT_TRUE(sheet.cutOut(loop));
        }
        sheet.settle();
        std::size_t border = 0;
        EXPECT_EQ(coveredArea(sheet, border), 2 * kUnrolledTurn * kHeight - area) << holes;
        EXPECT_EQ(border, 10 + 24 * holes);
    }
}

TEST(SheetTriangulation, RefusesLinesThatCross)
{
    SheetTriangulation sheet;
    sheet.begin(8, kHeight);
    std::int64_t area = 0;
    const auto first = insertCircle(sheet, kUnrolledTurn / 2, kHeight / 2, 90000, 12, area);
    const auto second = insertCircle(sheet, kUnrolledTurn / 2 + 100000, kHeight / 2, 90000, 12, area);
    EXPECT_TRUE(sheet.fixLoop(first));
    EXPECT_FALSE(sheet.fixLoop(second));
}

TEST(SheetTriangulation, RefusesAPointThatIsThere)
{
    SheetTriangulation sheet;
    sheet.begin(4, kHeight);
    EXPECT_EQ(sheet.insert({5, 5}), 8u);
    EXPECT_EQ(sheet.insert({5, 5}), SheetTriangulation::kNoPoint);
    EXPECT_EQ(sheet.insert({0, 0}), SheetTriangulation::kNoPoint);
    EXPECT_EQ(sheet.insert({5, 0}), SheetTriangulation::kNoPoint);
}

} // namespace
} // namespace espalier
