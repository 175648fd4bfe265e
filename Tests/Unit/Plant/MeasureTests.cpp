#include <Espalier/Plant/Axes.h>
#include <Espalier/Plant/Measure.h>
#include <Plant/SampleSkeletons.h>
#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <set>

namespace espalier {
namespace {

using namespace samples;

TEST(Measure, AnEmptySkeletonHasNothing)
{
    const SkeletonFacts facts = measure(Skeleton{});
    EXPECT_EQ(facts.segments, 0u);
    EXPECT_EQ(facts.tips, 0u);
    EXPECT_EQ(facts.forks, 0u);
    EXPECT_EQ(facts.maxDepth, 0u);
    EXPECT_EQ(facts.strahler, 0u);
    EXPECT_EQ(facts.totalLength, 0.0);
}

TEST(Measure, TheExtentIsWhatTheTurtleCovered)
{
    Skeleton skeleton = fork();
    skeleton.minY = -3;
    skeleton.maxY = 4;
    skeleton.maxRadius = 5;
    const SkeletonFacts facts = measure(skeleton);
    EXPECT_EQ(facts.minY, -3);
    EXPECT_EQ(facts.maxY, 4);
    EXPECT_EQ(facts.maxRadius, 5);
}

TEST(Measure, AForkIsCounted)
{
    Skeleton skeleton = fork();
    skeleton.instanceRecords.resize(3);
    const SkeletonFacts facts = measure(skeleton);
    EXPECT_EQ(facts.segments, 5u);
    EXPECT_EQ(facts.tips, 2u);
    EXPECT_EQ(facts.forks, 1u);
    EXPECT_EQ(facts.maxDepth, 3u);
    EXPECT_EQ(facts.strahler, 2u);
    EXPECT_EQ(facts.instances, 3u);
    EXPECT_NEAR(facts.totalLength, 2.5 + std::sqrt(2.0), 1e-6);
}

TEST(Measure, ZeroLengthSegmentsAndMovesCount)
{
    Skeleton skeleton;
    const std::uint32_t stub = grow(skeleton, kNoSegment, {0, 0, 0});
    addSegment(skeleton, stub, {5, 0, 0}, {5, 1, 0});
    addSegment(skeleton, stub, {7, 0, 0}, {7, 1, 0});
    completeAxes(skeleton, {});
    const SkeletonFacts facts = measure(skeleton);
    EXPECT_EQ(facts.segments, 3u);
    EXPECT_EQ(facts.maxDepth, 2u);
    EXPECT_EQ(facts.forks, 1u);
    EXPECT_EQ(facts.totalLength, 2.0);
}

TEST(Measure, SeveralTrunksForkAtTheBase)
{
    Skeleton skeleton;
    for (int i = 0; i < 3; ++i)
        grow(skeleton, kNoSegment, {static_cast<float>(i), 1, 0});
    completeAxes(skeleton, {});
    const SkeletonFacts facts = measure(skeleton);
    EXPECT_EQ(facts.forks, 1u);
    EXPECT_EQ(facts.tips, 3u);
    EXPECT_EQ(facts.maxDepth, 1u);
    EXPECT_EQ(facts.strahler, 2u);
}

TEST(Measure, StrahlerRisesOnlyWhereEqualsMeet)
{
    // A spine with single twigs all along it stays at 2, however long.
    Skeleton spine;
    std::uint32_t last = grow(spine, kNoSegment, {0, 1, 0});
    for (int i = 0; i < 10; ++i)
    {
        grow(spine, last, {1, 0, 0});
        last = grow(spine, last, {0, 1, 0});
    }
    completeAxes(spine, {});
    EXPECT_EQ(measure(spine).strahler, 2u);

    // A perfect binary tree of n levels has n.
    Skeleton perfect;
    grow(perfect, kNoSegment, {0, 1, 0});
    for (std::uint32_t i = 0; i < 15; ++i)
    {
        grow(perfect, i, {1, 1, 0});
        grow(perfect, i, {-1, 1, 0});
    }
    completeAxes(perfect, {});
    EXPECT_EQ(measure(perfect).strahler, 5u);
}

TEST(Measure, RandomTreesAgreeWithTheRecursiveDefinition)
{
    for (std::uint64_t seed = 0; seed < 60; ++seed)
    {
        const Skeleton skeleton = randomTree(seed, 70, Ailments::All);
        const auto childrenOf = [&](std::uint32_t parent) {
            std::vector<std::uint32_t> children;
            for (std::uint32_t i = 0; i < skeleton.size(); ++i)
            {
                if (skeleton.parents[i] == parent)
                    children.push_back(i);
            }
            return children;
        };
        std::uint32_t forks = 0;
        std::uint32_t tips = 0;
        std::uint32_t deepest = 0;
        const std::function<std::uint32_t(std::uint32_t, std::uint32_t)> visit = [&](std::uint32_t at,
                                                                                     std::uint32_t depth) {
            deepest = std::max(deepest, depth);
            const std::vector<std::uint32_t> children = childrenOf(at);
            std::multiset<std::uint32_t> values;
            for (const std::uint32_t child : children)
                values.insert(visit(child, depth + 1));
            forks += children.size() > 1;
            tips += children.empty();
            if (children.empty())
                return 1u;
            const std::uint32_t highest = *values.rbegin();
            return highest + (values.count(highest) > 1 ? 1 : 0);
        };
        const std::uint32_t strahler = visit(kNoSegment, 0);
        const SkeletonFacts facts = measure(skeleton);
        EXPECT_EQ(facts.strahler, strahler) << "seed " << seed;
        EXPECT_EQ(facts.forks, forks) << "seed " << seed;
        EXPECT_EQ(facts.tips, tips) << "seed " << seed;
        EXPECT_EQ(facts.maxDepth, deepest) << "seed " << seed;
    }
}

/// A tree whose every segment but the tips carries two, `levels` segments from base to tip.
Skeleton binaryTree(std::uint32_t levels)
{
    Skeleton skeleton;
    std::vector<std::uint32_t> row{grow(skeleton, kNoSegment, {0, 1, 0})};
    for (std::uint32_t level = 1; level < levels; ++level)
    {
        std::vector<std::uint32_t> next;
        for (const std::uint32_t segment : row)
            for (const float x : {-0.5f, 0.5f})
                next.push_back(grow(skeleton, segment, {x, 1, 0}));
        row = next;
    }
    completeAxes(skeleton, {});
    return skeleton;
}

TEST(Measure, StreamsOfAPerfectBinaryTreeDouble)
{
    const std::vector<std::uint32_t> streams = strahlerStreams(binaryTree(5));
    EXPECT_EQ(streams, (std::vector<std::uint32_t>{16, 8, 4, 2, 1}));
    EXPECT_NEAR(bifurcationRatio(streams), 2, 1e-12);
}

TEST(Measure, ARunWithoutForksIsOneStream)
{
    Skeleton skeleton;
    std::uint32_t last = kNoSegment;
    for (int i = 0; i < 4; ++i)
        last = grow(skeleton, last, {0, 1, 0});
    EXPECT_EQ(strahlerStreams(skeleton), (std::vector<std::uint32_t>{1}));
    EXPECT_EQ(bifurcationRatio(strahlerStreams(skeleton)), 1);
    EXPECT_TRUE(strahlerStreams({}).empty());
}

TEST(Measure, TheBifurcationRatioIsTheRegressionsOfHorton)
{
    // log counts 4, 2, 0 times log 3 fall by log 9 an order.
    EXPECT_NEAR(bifurcationRatio(std::vector<std::uint32_t>{81, 9, 1}), 9, 1e-12);
    // A slope of -(log 12 - log 1) / 2, whatever lies in the middle.
    EXPECT_NEAR(bifurcationRatio(std::vector<std::uint32_t>{12, 5, 1}), std::sqrt(12.0), 1e-12);
}

TEST(Measure, LateralsHaveAngleAndAzimuth)
{
    Skeleton skeleton;
    const std::uint32_t base = grow(skeleton, kNoSegment, {0, 2, 0});
    const std::uint32_t trunk = grow(skeleton, base, {0, 2, 0});
    grow(skeleton, trunk, {0, 1, 0});
    grow(skeleton, trunk, {0, 1, 0});
    grow(skeleton, base, {1, 1, 0});
    completeAxes(skeleton, {});
    BranchMeasures measures;
    appendBranchMeasures(skeleton, 1, 0, measures);
    EXPECT_EQ(measures.lengths.size(), 5u);
    EXPECT_EQ(measures.widths.size(), 5u);
    EXPECT_NEAR(measures.widths[0], 2 * 0.008 * std::sqrt(3.0), 1e-6); // three tips, each a pipe of 8 mm radius
    ASSERT_EQ(measures.angles.size(), 2u);
    EXPECT_NEAR(measures.angles[0], 0, 1e-3); // goes straight on beside the trunk, so it has no azimuth
    EXPECT_NEAR(measures.angles[1], 45, 1e-3);
    ASSERT_EQ(measures.azimuths.size(), 1u);
    const Vec3 left = skeleton.lefts[base];
    EXPECT_NEAR(measures.azimuths[0], left.x < 0 ? 180 : 0, 1e-3);

    BranchMeasures halves[2];
    for (std::uint32_t offset : {0u, 1u})
        appendBranchMeasures(skeleton, 2, offset, halves[offset]);
    EXPECT_EQ(halves[0].lengths.size() + halves[1].lengths.size(), 5u);
    EXPECT_EQ(halves[0].angles.size() + halves[1].angles.size(), 2u);
}

TEST(Measure, LengthIsCountedAtTheHeightOfTheMiddle)
{
    Skeleton skeleton;
    const std::uint32_t base = grow(skeleton, kNoSegment, {0, 2, 0});
    grow(skeleton, base, {0, 4, 0});
    grow(skeleton, base, {3, -8, 0});
    std::vector<double> bins(4);
    addLengthByHeight(skeleton, 1.0, bins);
    EXPECT_NEAR(bins[0], std::sqrt(73.0), 1e-5); // below the ground
    EXPECT_NEAR(bins[1], 2, 1e-6);
    EXPECT_NEAR(bins[3], 4, 1e-6); // above the last bin
}

} // namespace
} // namespace espalier
