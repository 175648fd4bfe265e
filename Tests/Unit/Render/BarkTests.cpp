#include <Espalier/Render/Bark.h>

#include <cmath>
#include <gtest/gtest.h>

namespace espalier {

TEST(Bark, NoiseRepeatsAfterItsPeriod)
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

TEST(Bark, NoiseAveragesOneHalfAndVaries)
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

TEST(Bark, ReliefHasNoSeamRoundTheAxis)
{
    for (float v = -2; v < 2; v += 0.13f)
    {
        const BarkRelief begin = barkRelief({0, v}, Vec2(0.5f));
        const BarkRelief end = barkRelief({3, v}, Vec2(0.5f));
        EXPECT_NEAR(begin.shade, end.shade, 1e-3f);
        EXPECT_NEAR(begin.slope.x, end.slope.x, 0.02f);
        EXPECT_NEAR(begin.slope.y, end.slope.y, 0.02f);
    }
}

TEST(Bark, TwigsAreSmoothAndTrunksAreFurrowed)
{
    float roughest = 0;
    float darkest = 1;
    for (float u = 0; u < 1; u += 0.01f)
    {
        EXPECT_EQ(barkRelief({u, 0.3f}, Vec2(0.02f)).slope, Vec2(0));
        EXPECT_GT(barkRelief({u, 0.3f}, Vec2(0.02f)).shade, 0.85f);
        roughest = std::max(roughest, std::abs(barkRelief({u, 0.3f}, Vec2(0.5f)).slope.x));
        darkest = std::min(darkest, barkRelief({u, 0.3f}, Vec2(0.5f)).shade);
    }
    EXPECT_GT(roughest, 0.3f);
    EXPECT_LT(darkest, 0.7f);
}

TEST(Bark, HugeCoordinatesStayFinite)
{
    for (const Vec2 uv : {Vec2(1e30f), Vec2(-1e30f), Vec2(3e38f, -3e38f)})
    {
        const BarkRelief relief = barkRelief(uv, Vec2(0.5f));
        EXPECT_TRUE(std::isfinite(relief.shade) && std::isfinite(relief.slope.x) && std::isfinite(relief.slope.y));
    }
}

} // namespace espalier
