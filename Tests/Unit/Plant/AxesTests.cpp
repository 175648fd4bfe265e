#include <Espalier/Plant/Axes.h>
#include <Plant/SampleSkeletons.h>
#include <cmath>
#include <gtest/gtest.h>

namespace espalier {
namespace {

using namespace samples;

TEST(Axes, EmptySkeletonStaysEmpty)
{
    Skeleton skeleton;
    completeAxes(skeleton, {});
    EXPECT_EQ(skeleton, Skeleton{});
}

TEST(Axes, ALoneSegmentIsATipThatHalves)
{
    Skeleton skeleton;
    grow(skeleton, kNoSegment, {0, 3, 0});
    completeAxes(skeleton, {.tipRadius = 0.02f, .pipesPerMetre = 10});
    EXPECT_FLOAT_EQ(skeleton.startRadii[0], 0.02f);
    EXPECT_FLOAT_EQ(skeleton.endRadii[0], 0.01f);
    EXPECT_EQ(skeleton.continuations[0], kNoSegment);
    EXPECT_EQ(skeleton.orders[0], 0);
}

TEST(Axes, TwoEqualBranchesAddTheirCrossSectionsAtExponentTwo)
{
    Skeleton skeleton;
    const std::uint32_t trunk = grow(skeleton, kNoSegment, {0, 1, 0});
    grow(skeleton, trunk, {1, 1, 0});
    grow(skeleton, trunk, {-1, 1, 0});
    completeAxes(skeleton, {.tipRadius = 0.1f, .exponent = 2.f});
    EXPECT_FLOAT_EQ(skeleton.startRadii[trunk], 0.1f * std::sqrt(2.f));
    EXPECT_FLOAT_EQ(skeleton.endRadii[trunk], 0.1f);
}

TEST(Axes, PipesAlongAShootThickenIt)
{
    Skeleton skeleton;
    const std::uint32_t lower = grow(skeleton, kNoSegment, {0, 2, 0});
    grow(skeleton, lower, {0, 5, 0});
    completeAxes(skeleton, {.tipRadius = 0.1f, .exponent = 1.f, .pipesPerMetre = 3});
    EXPECT_FLOAT_EQ(skeleton.startRadii[lower], 0.1f * (1 + 3 * 2));
    EXPECT_FLOAT_EQ(skeleton.endRadii[lower], 0.1f);
}

TEST(Axes, GivenWidthsAreKept)
{
    Skeleton skeleton;
    skeleton.widthsGiven = true;
    const std::uint32_t trunk = grow(skeleton, kNoSegment, {0, 1, 0}, 0.5f);
    const std::uint32_t wider = grow(skeleton, trunk, {0, 1, 0}, 0.7f);
    completeAxes(skeleton, {});
    EXPECT_EQ(skeleton.startRadii, (std::vector<float>{0.5f, 0.7f}));
    EXPECT_EQ(skeleton.endRadii[trunk], 0.7f);
    EXPECT_EQ(skeleton.endRadii[wider], 0.35f);
}

TEST(Axes, TheContinuationIsTheThickestThenTheStraightestThenTheFirst)
{
    struct Case
    {
        const char* name;
        std::array<Vec3, 3> steps;
        std::array<float, 3> radii;
        std::uint32_t continuation;
    };
    const Case cases[] = {
        {"thickest", {Vec3(0, 1, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)}, {0.1f, 0.2f, 0.1f}, 2},
        {"straightest of the thick", {Vec3(1, 1, 0), Vec3(1, 2, 0), Vec3(0, 1, 0)}, {0.2f, 0.2f, 0.1f}, 2},
        {"first of equals", {Vec3(1, 1, 0), Vec3(-1, 1, 0), Vec3(0, 1, 1)}, {0.2f, 0.2f, 0.2f}, 1},
    };
    for (const Case& c : cases)
    {
        Skeleton skeleton;
        skeleton.widthsGiven = true;
        const std::uint32_t trunk = grow(skeleton, kNoSegment, {0, 1, 0}, 1.f);
        for (std::size_t i = 0; i < c.steps.size(); ++i)
            grow(skeleton, trunk, c.steps[i], c.radii[i]);
        completeAxes(skeleton, {});
        EXPECT_EQ(skeleton.continuations[trunk], c.continuation) << c.name;
    }
}

TEST(Axes, SeveralTrunksAllHaveOrderZero)
{
    Skeleton skeleton;
    grow(skeleton, kNoSegment, {0, 1, 0});
    grow(skeleton, kNoSegment, {1, 1, 0});
    completeAxes(skeleton, {});
    EXPECT_EQ(skeleton.orders, (std::vector<std::uint16_t>{0, 0}));
    EXPECT_TRUE(skeleton.startsAxis(0));
    EXPECT_TRUE(skeleton.startsAxis(1));
}

TEST(Axes, OrdersCountWhatLeavesTheAxisBelow)
{
    const Skeleton skeleton = fork();
    EXPECT_EQ(skeleton.orders, (std::vector<std::uint16_t>{0, 0, 0, 1, 1}));
    EXPECT_TRUE(skeleton.startsAxis(3));
    EXPECT_FALSE(skeleton.startsAxis(4));
}

TEST(Axes, RandomTreesKeepThePipeModel)
{
    constexpr PipeModel kPipes{.tipRadius = 0.01f, .exponent = 2.5f, .pipesPerMetre = 1.5f};
    for (std::uint64_t seed = 0; seed < 40; ++seed)
    {
        Skeleton skeleton = randomTree(seed, 80);
        completeAxes(skeleton, kPipes);
        const auto pipesAt = [&](std::uint32_t i) {
            return std::pow(static_cast<double>(skeleton.startRadii[i] / kPipes.tipRadius), 2.5);
        };
        std::vector<double> carried(skeleton.size(), 0);
        for (std::uint32_t i = 1; i < skeleton.size(); ++i)
            carried[skeleton.parents[i]] += pipesAt(i);
        for (std::uint32_t i = 0; i < skeleton.size(); ++i)
        {
            const bool isTip = carried[i] == 0;
            const double expected = isTip ? 1 : carried[i] + 1.5 * static_cast<double>(skeleton.lengths[i]);
            EXPECT_NEAR(pipesAt(i) / expected, 1, 1e-5) << "seed " << seed << ", segment " << i;
            EXPECT_EQ(isTip, skeleton.continuations[i] == kNoSegment);
            EXPECT_LE(skeleton.endRadii[i], skeleton.startRadii[i]);
        }
    }
}

TEST(Axes, CompletingTwiceChangesNothing)
{
    Skeleton once = randomTree(7, 100);
    Skeleton twice = once;
    completeAxes(twice, {});
    EXPECT_EQ(once, twice);
}

} // namespace
} // namespace espalier
