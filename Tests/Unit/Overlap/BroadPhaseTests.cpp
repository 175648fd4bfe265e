#include <Espalier/Overlap/BroadPhase.h>

#include <Espalier/Core/Random.h>
#include <gtest/gtest.h>
#include <mutex>
#include <set>
#include <utility>
#include <vector>

namespace espalier {

namespace {

using Pairs = std::set<std::pair<std::uint32_t, std::uint32_t>>;
using Search = bool (*)(std::span<const Box>, const PairVisitor&);

Pairs pairsBy(Search search, const std::vector<Box>& boxes)
{
    Pairs pairs;
    std::mutex mutex;
    EXPECT_TRUE(search(boxes, [&](std::span<const BoxPair> batch) {
        const std::scoped_lock lock(mutex);
        for (const BoxPair pair : batch)
            pairs.insert(std::minmax(pair.first, pair.second));
    }));
    return pairs;
}

Pairs allPairs(const std::vector<Box>& boxes)
{
    Pairs pairs;
    for (std::uint32_t a = 0; a < boxes.size(); ++a)
        for (std::uint32_t b = a + 1; b < boxes.size(); ++b)
        {
            bool touching = true;
            for (int axis = 0; axis < 3; ++axis)
                touching =
                    touching && boxes[a].low[axis] <= boxes[b].high[axis] && boxes[b].low[axis] <= boxes[a].high[axis];
            if (touching)
                pairs.emplace(a, b);
        }
    return pairs;
}

std::vector<Box> randomBoxes(std::uint64_t seed)
{
    RandomKey key(Seed{seed});
    std::uint32_t draws = 0;
    const auto draw = [&](double low, double high) {
        return static_cast<float>(key.uniform(Purpose::Sampling, low, high, draws++));
    };
    const float scale = seed % 7 == 0 ? 1e12f : (seed % 7 == 1 ? 1e-20f : 1.0f);
    const float size = draw(0, 0.4);
    std::vector<Box> boxes;
    for (std::uint64_t i = key.below(Purpose::Shuffle, 120); i-- > 0;)
    {
        Box box;
        for (int axis = 0; axis < 3; ++axis)
        {
            box.low[axis] = scale * draw(-1, 1);
            if (seed % 3 == 0) // many shared edges
                box.low[axis] = scale * static_cast<float>(static_cast<int>(4 * box.low[axis] / scale)) / 4;
            box.high[axis] = box.low[axis] + (i % 5 == 0 ? 0 : scale * size * draw(0, 1));
        }
        boxes.push_back(box);
        if (i % 11 == 0)
            boxes.push_back(box);
    }
    return boxes;
}

} // namespace

TEST(BroadPhase, FewBoxesHaveNoPairs)
{
    for (const Search search : {visitTouchingPairs, visitTouchingPairsByTree})
    {
        EXPECT_TRUE(pairsBy(search, {}).empty());
        EXPECT_TRUE(pairsBy(search, {{Vec3(0), Vec3(1)}}).empty());
    }
}

TEST(BroadPhase, BoxesThatOnlyShareACornerTouch)
{
    const std::vector<Box> boxes{{Vec3(0), Vec3(1)}, {Vec3(1), Vec3(2)}, {Vec3(2.5f), Vec3(3)}};
    for (const Search search : {visitTouchingPairs, visitTouchingPairsByTree})
        EXPECT_EQ(pairsBy(search, boxes), (Pairs{{0, 1}}));
}

TEST(BroadPhase, FindsTheSamePairsAsComparingAll)
{
    for (std::uint64_t seed = 0; seed < 150; ++seed)
    {
        const std::vector<Box> boxes = randomBoxes(seed);
        const Pairs expected = allPairs(boxes);
        EXPECT_EQ(pairsBy(visitTouchingPairsByTree, boxes), expected) << "tree, seed " << seed;
        EXPECT_EQ(pairsBy(visitTouchingPairs, boxes), expected) << "seed " << seed;
    }
}

TEST(BroadPhase, TreeShowsEachPairOnce)
{
    const std::vector<Box> same(300, Box{Vec3(-1), Vec3(1)});
    std::size_t shown = 0;
    EXPECT_TRUE(visitTouchingPairsByTree(same, [&](std::span<const BoxPair> batch) { shown += batch.size(); }));
    EXPECT_EQ(shown, 300u * 299u / 2);
}

} // namespace espalier
