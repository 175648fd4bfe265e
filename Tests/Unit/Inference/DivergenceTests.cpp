#include <Espalier/Inference/Divergence.h>

#include <Espalier/Core/Random.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <vector>

namespace espalier {
namespace {

TEST(Divergence, JensenShannonByItsClosedForms)
{
    const std::array<double, 2> even = {3, 3};
    const std::array<double, 2> one = {5, 0};
    const std::array<double, 2> other = {0, 1};
    const std::array<double, 2> none = {0, 0};
    EXPECT_EQ(jensenShannon(even, even), 0);
    EXPECT_DOUBLE_EQ(jensenShannon(one, other), 1) << "nothing in common";
    EXPECT_NEAR(jensenShannon(one, even), 1.5 - 0.75 * std::log2(3.0), 1e-12);
    EXPECT_EQ(jensenShannon(one, even), jensenShannon(even, one));
    EXPECT_EQ(jensenShannon(none, even), 1);
    EXPECT_EQ(jensenShannon(none, none), 0);
}

TEST(Divergence, WassersteinByItsClosedForms)
{
    EXPECT_EQ(wasserstein({1, 2, 3}, {3, 1, 2}), 0);
    EXPECT_DOUBLE_EQ(wasserstein({1, 2, 3}, {5, 4, 6}), 3) << "a shift";
    EXPECT_DOUBLE_EQ(wasserstein({0}, {-1, 1}), 1) << "sizes may differ";
    EXPECT_DOUBLE_EQ(wasserstein({0, 0, 0, 4}, {0, 4}), 1) << "a quarter travels by 4";
    EXPECT_EQ(wasserstein({}, {1}), 0);
}

/// For samples of equal size the plan that sorts both is the best one.
TEST(Divergence, WassersteinIsThePlanThatSorts)
{
    for (std::uint64_t seed = 0; seed < 100; ++seed)
    {
        const RandomKey key = RandomKey(Seed{seed}).child(0);
        std::vector<double> a, b;
        for (std::uint32_t i = 0; i < 40; ++i)
        {
            a.push_back(key.uniform(Purpose::Sampling, 2 * i));
            b.push_back(std::round(10 * key.uniform(Purpose::Sampling, 2 * i + 1)) / 7);
        }
        std::vector<double> sortedA = a, sortedB = b;
        std::ranges::sort(sortedA);
        std::ranges::sort(sortedB);
        double sum = 0;
        for (std::size_t i = 0; i < a.size(); ++i)
            sum += std::abs(sortedA[i] - sortedB[i]);
        EXPECT_NEAR(wasserstein(a, b), sum / 40, 1e-12);
    }
}

TEST(Divergence, OnTheCircleTheShorterWayCounts)
{
    EXPECT_NEAR(circularWasserstein({350}, {10}, 360), 20, 1e-12);
    EXPECT_NEAR(circularWasserstein({-10}, {370}, 360), 20, 1e-12);
    EXPECT_NEAR(circularWasserstein({0, 180}, {90, 270}, 360), 90, 1e-12);
    EXPECT_NEAR(circularWasserstein({0, 120, 240}, {120, 240, 360}, 360), 0, 1e-12);
    EXPECT_NEAR(circularWasserstein({355, 5}, {5}, 360), 5, 1e-12);
}

/// For samples of equal size the best plan matches one sorted sample with the other, rotated by some number of places.
TEST(Divergence, OnTheCircleItIsTheBestRotation)
{
    for (std::uint64_t seed = 0; seed < 100; ++seed)
    {
        const RandomKey key = RandomKey(Seed{seed}).child(0);
        std::vector<double> a, b;
        for (std::uint32_t i = 0; i < 12; ++i)
        {
            a.push_back(key.uniform(Purpose::Sampling, 2 * i));
            b.push_back(0.5 * key.uniform(Purpose::Sampling, 2 * i + 1) + 0.6);
        }
        std::vector<double> sortedA = a, sortedB;
        for (const double value : b)
            sortedB.push_back(value - std::floor(value));
        std::ranges::sort(sortedA);
        std::ranges::sort(sortedB);
        double best = 1e9;
        for (std::size_t shift = 0; shift < a.size(); ++shift)
        {
            double sum = 0;
            for (std::size_t i = 0; i < a.size(); ++i)
            {
                const double apart = std::abs(sortedA[i] - sortedB[(i + shift) % a.size()]);
                sum += std::min(apart, 1 - apart);
            }
            best = std::min(best, sum / 12);
        }
        EXPECT_NEAR(circularWasserstein(a, b, 1), best, 1e-12) << seed;
    }
}

TEST(Divergence, MediansStandInTheMiddle)
{
    EXPECT_EQ(medianOf({}), 0);
    EXPECT_EQ(medianOf({7}), 7);
    EXPECT_EQ(medianOf({9, 1, 2}), 2);
    EXPECT_EQ(medianOf({9, 1, 2, 4}), 3);
}

TEST(Divergence, DeviationsAreThoseOfTheirDefinitions)
{
    EXPECT_DOUBLE_EQ(deviationOf(std::vector{2.0, 4.0, 4.0, 4.0, 5.0, 5.0, 7.0, 9.0}), 2.0);
    EXPECT_EQ(deviationOf({}), 0);
    // Round 0 it makes no difference on which side of it the numbers begin anew.
    EXPECT_NEAR(circularDeviationOf(std::vector{350.0, 10.0}), 10.0, 1e-9);
    EXPECT_NEAR(circularDeviationOf(std::vector{-10.0, 370.0}), 10.0, 1e-9);
    EXPECT_EQ(circularDeviationOf({}), 0);
}

} // namespace
} // namespace espalier
