#include <Espalier/Texture/TileNoise.h>

#include <Espalier/Core/Random.h>
#include <gtest/gtest.h>

namespace espalier {
namespace {

Vec2 drawn(std::uint64_t index, double low, double high)
{
    const RandomKey key = RandomKey(Seed{3}).child(index);
    const double x = key.uniform(Purpose::Sampling, low, high, 0);
    const double y = key.uniform(Purpose::Sampling, low, high, 1);
    return {static_cast<float>(x), static_cast<float>(y)};
}

} // namespace

TEST(CellPlace, LiesInsideForAnyNumber)
{
    for (const float x : {0.f, 1.f, -1.f, 0.999999f, -1e-9f, 12.75f, -12.75f, 1e5f})
    {
        const CellPlace place = cellPlace(x, 7);
        EXPECT_LT(place.cell, 7u) << x;
        EXPECT_GE(place.inside, 0) << x;
        EXPECT_LT(place.inside, 1) << x;
    }
    EXPECT_EQ(cellPlace(-0.25f, 4).cell, 3u);
    EXPECT_EQ(cellPlace(2.5f, 4).cell, 2u);
}

TEST(TileNoise, RepeatsAfterOneAndHasMeanZero)
{
    const TileNoise noise(7, 5, 1);
    double sum = 0;
    float greatest = 0;
    constexpr int kDraws = 20000;
    for (int i = 0; i < kDraws; ++i)
    {
        const Vec2 at = drawn(static_cast<std::uint64_t>(i), 0.01, 0.99);
        const float value = noise.at(at);
        EXPECT_NEAR(noise.at(at + Vec2(1, 0)), value, 1e-4f);
        EXPECT_NEAR(noise.at(at - Vec2(0, 2)), value, 1e-4f);
        sum += static_cast<double>(value);
        greatest = std::max(greatest, std::abs(value));
    }
    EXPECT_NEAR(sum / kDraws, 0, 0.08);
    EXPECT_GT(greatest, 0.5f);
    EXPECT_LE(greatest, 1.01f);
}

TEST(TileNoise, OfATallTileRepeatsAfterItsHeight)
{
    const TileNoise noise(7, 5, 1, 4);
    const TileCells cells(5, 7, 1, 4, 4);
    float parts = 0;
    for (std::uint32_t i = 0; i < 50; ++i)
    {
        const Vec2 at(static_cast<float>(i) * 0.13f, static_cast<float>(i) * 0.07f);
        EXPECT_NEAR(noise.at(at), noise.at(at + Vec2(1, 4)), 1e-3f);
        parts += std::abs(noise.at(at) - noise.at(at + Vec2(0, 1)));
        const auto none = [](float, float, float) {};
        EXPECT_EQ(cells.visit(at, 0.01f, none).random, cells.visit(at + Vec2(2, -4), 0.01f, none).random);
    }
    EXPECT_GT(parts, 5);
}

TEST(TileNoise, IsContinuousOverTheBorder)
{
    const TileNoise noise(6, 9, 2);
    for (int i = 0; i < 100; ++i)
    {
        const float along = static_cast<float>(i) / 100;
        EXPECT_NEAR(noise.at({0, along}), noise.at({-1e-5f, along}), 1e-3f);
        EXPECT_NEAR(noise.at({along, 0}), noise.at({along, 1 - 1e-5f}), 1e-3f);
    }
}

TEST(NoiseRow, AgreesWithNoisePointByPoint)
{
    const TileFractal fractal(5, 3, 4, 9);
    for (const std::uint32_t count : {16u, 64u, 1024u}) // coarser than the lattice, too
        for (const float v : {0.f, 0.313f, 0.99f, 1.4f})
        {
            const NoiseRow row(fractal, v, count);
            for (std::uint32_t x = 0; x < count; ++x)
                EXPECT_NEAR(row[x], fractal.at({(static_cast<float>(x) + 0.5f) / static_cast<float>(count), v}), 1e-4f)
                    << x << " of " << count << " at " << v;
        }
}

TEST(TileCells, BordersLieHalfWayBetweenCells)
{
    // Without jitter they are the squares of the lattice.
    const TileCells cells(4, 8, 0, 1);
    int borders = 0;
    const TileCells::Cell cell =
        cells.visit({0.125f + 0.1f, 0.0625f}, 0.05f, [&](float distance, float steepness, float) {
            ++borders;
            EXPECT_NEAR(distance, 0.025f, 1e-5f);
            EXPECT_NEAR(steepness, 1, 1e-5f);
        });
    EXPECT_EQ(borders, 1);
    EXPECT_NEAR(cell.fromMiddle.x, 0.4f, 1e-5f);
    EXPECT_NEAR(cell.fromMiddle.y, 0, 1e-5f);
}

TEST(TileCells, RepeatAfterOne)
{
    const TileCells cells(5, 7, 1, 4);
    const auto nearest = [&](Vec2 at) {
        float distance = 1;
        const TileCells::Cell cell =
            cells.visit(at, 0.1f, [&](float d, float, float) { distance = std::min(distance, d); });
        return Vec2(cell.random, distance);
    };
    for (std::uint64_t i = 0; i < 2000; ++i)
    {
        const Vec2 at = drawn(i, 0, 1);
        const Vec2 here = nearest(at);
        const Vec2 there = nearest(at + Vec2(-1, 1));
        if (here.y < 1e-4f)
            continue; // on a border rounding decides
        EXPECT_EQ(here.x, there.x);
        EXPECT_NEAR(here.y, there.y, 1e-4f);
    }
}

TEST(TileCells, ABorderHasTheSameNumberFromEitherSide)
{
    const TileCells cells(6, 6, 0.8f, 4);
    int compared = 0;
    for (std::uint64_t i = 0; i < 4000; ++i)
    {
        const Vec2 at = drawn(i, 0, 1);
        const auto seen = [&](Vec2 from) {
            Vec3 result(1, 0, 0);
            const TileCells::Cell cell = cells.visit(from, 0.02f, [&](float distance, float, float random) {
                if (distance < result.x)
                    result = {distance, random, 0};
            });
            result.z = cell.random;
            return result;
        };
        const Vec3 here = seen(at);
        const Vec3 there = seen(at + Vec2(0.004f, 0));
        // Neighbours across one border, far from corners.
        if (here.z == there.z || here.x > 0.004f || there.x > 0.004f)
            continue;
        int near = 0;
        cells.visit(at, 0.02f, [&](float, float, float) { ++near; });
        if (near != 1)
            continue;
        ++compared;
        EXPECT_FLOAT_EQ(here.y, there.y);
    }
    EXPECT_GT(compared, 10);
}

} // namespace espalier
