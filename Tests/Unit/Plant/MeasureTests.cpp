#include <Espalier/Plant/Measure.h>
#include <Plant/SampleSkeletons.h>
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

} // namespace
} // namespace espalier
