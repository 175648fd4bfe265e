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

TEST(Bark, IsContinuousAcrossTheSeam)
{
    for (float v = -2; v < 2; v += 0.013f)
        EXPECT_NEAR(barkRelief({-1e-5f, v}, Vec2(0.5f)).shade, barkRelief({1e-5f, v}, Vec2(0.5f)).shade, 0.02f);
}

TEST(Bark, FurrowsRunAlongTheAxis)
{
    double across = 0;
    double along = 0;
    for (float v = 0; v < 4; v += 0.021f)
        for (float u = 0; u < 1; u += 0.011f)
        {
            const float shade = barkRelief({u, v}, Vec2(0.5f)).shade;
            across += std::abs(barkRelief({u + 0.02f, v}, Vec2(0.5f)).shade - shade);
            along += std::abs(barkRelief({u, v + 0.02f}, Vec2(0.5f)).shade - shade);
        }
    EXPECT_GT(across, 2 * along);
}

TEST(Bark, FurrowsWidenWithTheGirth)
{
    const auto furrowedShare = [](float metres) {
        int furrowed = 0;
        for (float v = 0; v < 4; v += 0.021f)
            for (float u = 0; u < 1; u += 0.011f)
                furrowed += barkRelief({u, v}, Vec2(metres)).shade < 0.8f ? 1 : 0;
        return furrowed;
    };
    EXPECT_EQ(furrowedShare(0.05f), 0);
    EXPECT_GT(furrowedShare(0.3f), furrowedShare(0.2f));
    EXPECT_GT(furrowedShare(0.5f), furrowedShare(0.3f));
}

TEST(Bark, ShadesByOneOnAverage)
{
    for (const float metres : {0.02f, 0.2f, 0.5f, 2.0f})
    {
        double sum = 0;
        int count = 0;
        for (float v = 0; v < 8; v += 0.021f)
            for (float u = 0; u < 1; u += 0.011f, ++count)
                sum += barkRelief({u, v}, Vec2(metres)).shade;
        EXPECT_NEAR(sum / count, 1, 0.06) << metres;
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
