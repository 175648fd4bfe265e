#include <Espalier/Core/Random.h>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <numeric>
#include <vector>

namespace espalier {

namespace {

constexpr std::uint32_t kMany = 40000;
constexpr Purpose kPurposes[] = {Purpose::ChooseProduction, Purpose::DrawTransform, Purpose::Expression,
                                 Purpose::Shuffle, Purpose::Sampling};

RandomKey root(std::uint64_t seed = 1)
{
    return RandomKey(Seed{seed});
}

// Pearson's statistic of counts that should all be alike.
double chiSquare(const std::vector<int>& counts)
{
    const double expected = std::accumulate(counts.begin(), counts.end(), 0.0) / static_cast<double>(counts.size());
    double sum = 0;
    for (const int count : counts)
        sum += (count - expected) * (count - expected) / expected;
    return sum;
}

// Far above what fair counts reach: mean + 5 deviations of the chi-square distribution.
double suspicious(std::size_t cells)
{
    const double freedom = static_cast<double>(cells - 1);
    return freedom + 5 * std::sqrt(2 * freedom) + 5;
}

double correlation(const std::vector<double>& a, const std::vector<double>& b)
{
    const double n = static_cast<double>(a.size());
    const double meanA = std::accumulate(a.begin(), a.end(), 0.0) / n;
    const double meanB = std::accumulate(b.begin(), b.end(), 0.0) / n;
    double ab = 0;
    double aa = 0;
    double bb = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
    {
        ab += (a[i] - meanA) * (b[i] - meanB);
        aa += (a[i] - meanA) * (a[i] - meanA);
        bb += (b[i] - meanB) * (b[i] - meanB);
    }
    return ab / std::sqrt(aa * bb);
}

// Part of the file format: the same species and seed must give the same tree for ever. The values were computed by a
// second implementation, in Python.
TEST(Random, GivesTheFrozenValues)
{
    const RandomKey key = root(42).child(3).child(1);
    EXPECT_EQ(key.value(), 6313050122435377936u);
    EXPECT_EQ(key.bits(Purpose::ChooseProduction), 3684277202411578537u);
    EXPECT_EQ(key.bits(Purpose::Sampling, 7), 17177736628749773230u);
    EXPECT_EQ(key.uniform(Purpose::Expression), 0x1.a967c18009529p-1);
    EXPECT_EQ(key.uniform(Purpose::Expression, -2.0, 5.0), 0x1.e87592a010508p+1);
    EXPECT_EQ(key.normal(Purpose::Expression, 10.0, 2.0), 0x1.10aa02900d895p+3);
    EXPECT_EQ(key.below(Purpose::Shuffle, 1000000), 751635u);
    std::array<std::uint32_t, 6> order{};
    permutation(order, key);
    EXPECT_EQ(order, (std::array<std::uint32_t, 6>{5, 2, 1, 0, 3, 4}));
}

TEST(Random, UniformStaysInItsHalfOpenRange)
{
    constexpr double kMax = std::numeric_limits<double>::max();
    const double next = std::nextafter(1.0, 2.0);
    for (std::uint32_t i = 0; i < kMany; ++i)
    {
        const double unit = root().uniform(Purpose::Sampling, i);
        ASSERT_TRUE(unit >= 0 && unit < 1);
        const double value = root().uniform(Purpose::Sampling, -3.0, 2.0, i);
        ASSERT_TRUE(value >= -3 && value < 2);
        ASSERT_EQ(root().uniform(Purpose::Sampling, 1.0, next, i), 1.0) << "rounding must not reach the end";
        ASSERT_EQ(root().uniform(Purpose::Sampling, 2.0, 2.0, i), 2.0);
        ASSERT_EQ(root().uniform(Purpose::Sampling, 2.0, -1.0, i), 2.0);
        ASSERT_TRUE(std::isfinite(root().uniform(Purpose::Sampling, -kMax, kMax, i)));
    }
}

TEST(Random, BelowIsUniform)
{
    for (const std::uint64_t count : {1u, 2u, 3u, 7u, 64u, 1000u})
    {
        std::vector<int> counts(count);
        for (std::uint32_t i = 0; i < kMany; ++i)
            ++counts.at(root(count).below(Purpose::Sampling, count, i));
        EXPECT_LT(chiSquare(counts), suspicious(counts.size())) << count;
    }
    constexpr std::uint64_t kHuge = std::numeric_limits<std::uint64_t>::max();
    EXPECT_LT(root().below(Purpose::Sampling, kHuge), kHuge);
    EXPECT_GT(root().below(Purpose::Sampling, kHuge), 0u);
}

TEST(Random, NormalHasItsMeanDeviationAndTails)
{
    double sum = 0;
    double squares = 0;
    double fourths = 0;
    int withinOne = 0;
    for (std::uint32_t i = 0; i < kMany; ++i)
    {
        const double z = (root(9).normal(Purpose::Sampling, 5.0, 2.0, i) - 5.0) / 2.0;
        ASSERT_LE(std::abs(z), 8.6);
        sum += z;
        squares += z * z;
        fourths += z * z * z * z;
        withinOne += std::abs(z) < 1;
    }
    EXPECT_NEAR(sum / kMany, 0.0, 5 / std::sqrt(kMany));
    EXPECT_NEAR(squares / kMany, 1.0, 5 * std::sqrt(2.0 / kMany));
    EXPECT_NEAR(fourths / kMany, 3.0, 5 * std::sqrt(96.0 / kMany));
    EXPECT_NEAR(withinOne / double{kMany}, 0.6826895, 0.012);
    EXPECT_EQ(root().normal(Purpose::Sampling, 5.0, 0.0), 5.0);
}

TEST(Random, PurposesCountersSiblingsAndGenerationsAreIndependent)
{
    const RandomKey parent = root(5);
    const double limit = 5 / std::sqrt(kMany);
    std::vector<std::vector<double>> streams;
    for (const Purpose purpose : kPurposes)
    {
        std::vector<double> ofChildren;
        std::vector<double> ofCounters;
        for (std::uint32_t i = 0; i < kMany; ++i)
        {
            ofChildren.push_back(parent.child(i).uniform(purpose));
            ofCounters.push_back(parent.uniform(purpose, i));
        }
        streams.push_back(ofChildren);
        streams.push_back(ofCounters);
    }
    std::vector<double> ofGrandchildren;
    std::vector<double> ofOtherSeeds;
    std::vector<double> normals;
    for (std::uint32_t i = 0; i < kMany; ++i)
    {
        ofGrandchildren.push_back(parent.child(i).child(0).uniform(Purpose::Sampling));
        ofOtherSeeds.push_back(root(i).uniform(Purpose::Sampling));
        normals.push_back(parent.normal(Purpose::Sampling, 0, 1, i));
    }
    streams.push_back(ofGrandchildren);
    streams.push_back(ofOtherSeeds);
    for (std::size_t a = 0; a < streams.size(); ++a)
    {
        EXPECT_NEAR(correlation({streams[a].begin(), streams[a].end() - 1}, {streams[a].begin() + 1, streams[a].end()}),
                    0, limit)
            << "neighbours in stream " << a;
        for (std::size_t b = 0; b < a; ++b)
            EXPECT_NEAR(correlation(streams[a], streams[b]), 0, limit) << a << " and " << b;
    }
    EXPECT_NEAR(correlation({normals.begin(), normals.end() - 1}, {normals.begin() + 1, normals.end()}), 0, limit);
}

TEST(Random, EveryInputBitChangesAboutHalfTheOutputBits)
{
    const auto difference = [](RandomKey a, RandomKey b) {
        return std::popcount(a.bits(Purpose::Sampling) ^ b.bits(Purpose::Sampling));
    };
    for (unsigned bit = 0; bit < 64; ++bit)
    {
        double ofSeeds = 0;
        double ofChildren = 0;
        for (std::uint64_t i = 0; i < 200; ++i)
        {
            ofSeeds += difference(root(i), root(i ^ (std::uint64_t{1} << bit))) / 200.0;
            ofChildren += difference(root().child(i), root().child(i ^ (std::uint64_t{1} << bit))) / 200.0;
        }
        EXPECT_NEAR(ofSeeds, 32, 2) << bit;
        EXPECT_NEAR(ofChildren, 32, 2) << bit;
    }
}

TEST(Random, PathsThatDifferGiveKeysThatDiffer)
{
    std::vector<std::uint64_t> keys;
    for (std::uint64_t i = 0; i < 200; ++i)
    {
        keys.push_back(root(7).child(i).value());
        for (std::uint64_t j = 0; j < 200; ++j)
            keys.push_back(root(7).child(i).child(j).value());
    }
    std::sort(keys.begin(), keys.end());
    EXPECT_EQ(std::adjacent_find(keys.begin(), keys.end()), keys.end());
}

TEST(WeightedChoice, SaysSizeWhenNothingCanBeChosen)
{
    EXPECT_EQ(weightedChoice({}, 0.5), 0u);
    EXPECT_EQ(weightedChoice(std::vector<double>{0.0, 0.0}, 0.0), 2u);
    EXPECT_EQ(weightedChoice(std::vector<double>{-1.0, std::nan("")}, 0.5), 2u);
}

TEST(WeightedChoice, FollowsTheWeights)
{
    constexpr double kMax = std::numeric_limits<double>::max();
    constexpr double kTiny = std::numeric_limits<double>::denorm_min();
    const double almostOne = std::nextafter(1.0, 0.0);
    struct Case
    {
        std::vector<double> weights;
        double uniform;
        std::size_t chosen;
    };
    const Case cases[] = {
        {{1.0}, 0.0, 0},
        {{1.0}, almostOne, 0},
        {{1, 3}, 0.0, 0},
        {{1, 3}, 0.2499, 0},
        {{1, 3}, 0.25, 1},
        {{0, 1, 0, 1, 0}, 0.0, 1}, // weight 0 is never chosen, not even at the ends
        {{0, 1, 0, 1, 0}, 0.5, 3},
        {{0, 1, 0, 1, 0}, almostOne, 3},
        {{0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1}, almostOne, 9},
        {{kMax, kMax, kMax, kMax}, 0.6, 2},
        {{kTiny, kTiny}, 0.75, 1},
        {{kTiny, 0.0}, almostOne, 0},
        {{1e-300, 1e300}, 0.0, 0},
    };
    for (const Case& c : cases)
        EXPECT_EQ(weightedChoice(c.weights, c.uniform), c.chosen) << c.uniform;

    const std::vector<double> weights = {1, 0, 2, 5};
    std::array<int, 4> counts{};
    for (std::uint32_t i = 0; i < kMany; ++i)
        ++counts.at(weightedChoice(weights, root().uniform(Purpose::ChooseProduction, i)));
    for (std::size_t i = 0; i < 4; ++i)
        EXPECT_NEAR(counts.at(i) / double{kMany}, weights[i] / 8, 0.013);
    EXPECT_EQ(counts[1], 0);
}

TEST(Permutation, OfNothingAndOfOneIsThatOne)
{
    permutation({}, root());
    std::uint32_t one = 17;
    permutation({&one, 1}, root());
    EXPECT_EQ(one, 0u);
}

TEST(Permutation, HoldsEveryIndexOnce)
{
    std::vector<std::uint32_t> order(1000);
    permutation(order, root(3));
    std::sort(order.begin(), order.end());
    for (std::uint32_t i = 0; i < order.size(); ++i)
        ASSERT_EQ(order[i], i);
}

TEST(Permutation, AllOrdersAreEquallyLikely)
{
    for (const std::size_t size : {2u, 3u, 4u})
    {
        std::vector<std::uint32_t> order(size);
        std::iota(order.begin(), order.end(), 0u);
        std::vector<std::vector<std::uint32_t>> orders;
        do
            orders.push_back(order);
        while (std::next_permutation(order.begin(), order.end()));

        std::vector<int> counts(orders.size());
        for (std::uint32_t i = 0; i < 24000; ++i)
        {
            permutation(order, root().child(i));
            ++counts.at(static_cast<std::size_t>(std::find(orders.begin(), orders.end(), order) - orders.begin()));
        }
        EXPECT_LT(chiSquare(counts), suspicious(counts.size())) << size;
    }
}

} // namespace

} // namespace espalier
