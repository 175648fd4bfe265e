#include <Espalier/Render/SmoothNoise.h>

#include <cmath>
#include <gtest/gtest.h>

namespace espalier {

TEST(SmoothNoise, RepeatsAfterItsPeriod)
{
    for (float x = -3; x < 3; x += 0.37f)
        for (float y = -3; y < 3; y += 0.41f)
        {
            const float value = smoothNoise({x, y}, 8);
            EXPECT_GE(value, 0);
            EXPECT_LE(value, 1);
            EXPECT_NEAR(smoothNoise({x + 8, y}, 8), value, 1e-5f);
            EXPECT_NEAR(smoothNoise({x, y + 4096}, 8), value, 1e-2f); // that far out floats have 2^-11
        }
}

TEST(SmoothNoise, AveragesOneHalfAndVaries)
{
    double sum = 0;
    double squares = 0;
    constexpr int kSize = 200;
    for (int i = 0; i < kSize; ++i)
        for (int j = 0; j < kSize; ++j)
        {
            const double value = smoothNoise({0.73f * static_cast<float>(i), 0.61f * static_cast<float>(j)}, 4096);
            sum += value;
            squares += value * value;
        }
    const double mean = sum / (kSize * kSize);
    EXPECT_NEAR(mean, 0.5, 0.01);
    EXPECT_GT(squares / (kSize * kSize) - mean * mean, 0.02);
}

TEST(SmoothNoise, StaysInItsRangeFarOutAndForInfiniteCoordinates)
{
    for (const float far : {-3e30f, -1e9f, 1e9f, 3e30f, INFINITY, -INFINITY})
    {
        const float value = smoothNoise({far, -far}, 7);
        EXPECT_GE(value, 0);
        EXPECT_LE(value, 1);
    }
}

} // namespace espalier
