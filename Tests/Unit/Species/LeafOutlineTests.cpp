#include <Espalier/Species/LeafOutline.h>

#include <Espalier/Core/Random.h>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>

namespace espalier {
namespace {

constexpr LeafShape kShapes[] = {LeafShape::Ovate,  LeafShape::Lobed,  LeafShape::Lanceolate, LeafShape::Deltoid,
                                 LeafShape::Linear, LeafShape::Needle, LeafShape::Blossom};

LeafAppearance leafOf(LeafShape shape, std::uint32_t leaves)
{
    LeafAppearance leaf;
    leaf.shape = shape;
    leaf.leaves = leaves;
    return leaf;
}

float widestAt(LeafShape shape)
{
    float widest = 0;
    for (int i = 1; i < 1000; ++i)
        if (halfWidthOf(shape, static_cast<float>(i) / 1000) > halfWidthOf(shape, widest))
            widest = static_cast<float>(i) / 1000;
    return widest;
}

} // namespace

TEST(LeafOutline, HalfWidthsAreSharesOfTheGreatest)
{
    for (const LeafShape shape : kShapes)
    {
        float greatest = 0;
        for (int i = 1; i < 4000; ++i)
        {
            const float half = halfWidthOf(shape, static_cast<float>(i) / 4000);
            EXPECT_GT(half, 0) << static_cast<int>(shape) << " at " << i;
            EXPECT_LE(half, 1.0001f) << static_cast<int>(shape) << " at " << i;
            greatest = std::max(greatest, half);
        }
        EXPECT_GT(greatest, 0.97f) << static_cast<int>(shape);
        for (const float outside : {-1.f, 0.f, 1.f, 2.f, std::numeric_limits<float>::quiet_NaN()})
            EXPECT_EQ(halfWidthOf(shape, outside), 0) << static_cast<int>(shape);
    }
}

TEST(LeafOutline, HasNoSteps)
{
    for (const LeafShape shape : kShapes)
        for (int i = 40; i < 7960; ++i)
        {
            const float here = halfWidthOf(shape, static_cast<float>(i) / 8000);
            const float next = halfWidthOf(shape, static_cast<float>(i + 1) / 8000);
            EXPECT_LT(std::abs(next - here), 0.03f) << static_cast<int>(shape) << " at " << i;
        }
}

TEST(LeafOutline, IsWidestWhereTheShapeSays)
{
    EXPECT_LT(widestAt(LeafShape::Ovate), 0.5f);
    EXPECT_GT(widestAt(LeafShape::Lobed), 0.5f);
    EXPECT_LT(widestAt(LeafShape::Deltoid), 0.35f);
    EXPECT_GT(widestAt(LeafShape::Blossom), 0.5f);
}

TEST(LeafOutline, LobesAndTeethAreCounted)
{
    const auto baysOf = [](LeafShape shape) {
        int bays = 0;
        for (int i = 2; i < 1998; ++i)
        {
            const auto at = [&](int step) { return halfWidthOf(shape, static_cast<float>(step) / 2000); };
            bays += at(i) < at(i - 1) && at(i) <= at(i + 1);
        }
        return bays;
    };
    EXPECT_EQ(baysOf(LeafShape::Ovate), 0);
    EXPECT_EQ(baysOf(LeafShape::Lobed), 5);
    EXPECT_GE(baysOf(LeafShape::Deltoid), 9);
}

TEST(LeafSurface, OneLeafFillsItsSurface)
{
    for (const LeafShape shape : kShapes)
    {
        if (shape == LeafShape::Blossom)
            continue;
        const LeafAppearance leaf = leafOf(shape, 1);
        const LeafSurface surface(leaf);
        ASSERT_EQ(surface.leaves().size(), 1u);
        for (int i = 1; i < 100; ++i)
        {
            const float along = static_cast<float>(i) / 100;
            const float v = leaf.stalk + (1 - leaf.stalk) * along;
            const float edge = 0.5f * halfWidthOf(shape, along);
            const std::optional<SurfacePoint> inside = surface.at({0.5f + 0.98f * edge, v});
            ASSERT_TRUE(inside) << static_cast<int>(shape) << " at " << along;
            EXPECT_NEAR(inside->along, along, 1e-3f);
            EXPECT_NEAR(inside->across, 0.98f, 0.05f);
            EXPECT_FALSE(surface.at({0.5f - 1.05f * edge, v})) << static_cast<int>(shape) << " at " << along;
        }
        const std::optional<SurfacePoint> stalk = surface.at({0.5f, 0.5f * leaf.stalk});
        ASSERT_TRUE(stalk);
        EXPECT_LT(stalk->along, 0);
    }
}

TEST(LeafSurface, SpraysStayOnTheirSurface)
{
    for (const LeafShape shape : kShapes)
        for (const std::uint32_t leaves : {2u, 3u, 9u, 64u})
            for (const float width : {0.01f, 0.3f, 0.9f, 4.f})
            {
                if (shape == LeafShape::Blossom)
                    continue;
                LeafAppearance leaf = leafOf(shape, leaves);
                leaf.width = width;
                const LeafSurface surface(leaf);
                ASSERT_EQ(surface.leaves().size(), leaves);
                for (const LeafOnSurface& one : surface.leaves())
                    for (const Vec2& end : {one.foot, one.tip})
                    {
                        EXPECT_LE(std::abs(end.x), 0.5f * width + 1e-5f);
                        EXPECT_GE(end.y, 0);
                        EXPECT_LE(end.y, 1 + 1e-5f);
                    }
                EXPECT_EQ(surface.leaves().back().tip.y, 1);
                EXPECT_GT(surface.coverage(), 0.01f) << static_cast<int>(shape) << ", " << leaves << ", " << width;
            }
}

TEST(LeafSurface, ASprayHasAShootAndABlossomAHeart)
{
    const std::optional<SurfacePoint> shoot = LeafSurface(leafOf(LeafShape::Ovate, 9)).at({0.5f, 0.01f});
    ASSERT_TRUE(shoot);
    EXPECT_EQ(shoot->leaf, SurfacePoint::kShoot);

    const LeafSurface blossom(leafOf(LeafShape::Blossom, 1));
    const std::optional<SurfacePoint> heart = blossom.at({0.5f, 0.5f});
    ASSERT_TRUE(heart);
    EXPECT_EQ(heart->leaf, SurfacePoint::kShoot);
    EXPECT_EQ(blossom.leaves().size(), 5u);
    EXPECT_FALSE(blossom.at({0.01f, 0.01f}));
}

TEST(LeafSurface, CoverageIsWhatRandomPointsFind)
{
    const RandomKey key(Seed{1});
    for (const LeafShape shape : kShapes)
        for (const std::uint32_t leaves : {1u, 9u})
        {
            const LeafSurface surface(leafOf(shape, leaves));
            int found = 0;
            constexpr int kDraws = 20000;
            for (std::uint64_t i = 0; i < kDraws; ++i)
            {
                const double u = key.child(i).uniform(Purpose::Sampling, 0);
                const double v = key.child(i).uniform(Purpose::Sampling, 1);
                const std::optional<SurfacePoint> point = surface.at({static_cast<float>(u), static_cast<float>(v)});
                if (!point)
                    continue;
                ++found;
                EXPECT_LE(std::abs(point->across), 1);
                EXPECT_LE(point->along, 1);
            }
            EXPECT_NEAR(surface.coverage(), static_cast<double>(found) / kDraws, 0.02)
                << static_cast<int>(shape) << ", " << leaves;
        }
}

} // namespace espalier
