#include <Espalier/Texture/SurfaceMaps.h>

#include <Espalier/Core/Random.h>
#include <gtest/gtest.h>
#include <numeric>

namespace espalier {
namespace {

std::vector<float> noise(std::size_t count, double low, double high)
{
    std::vector<float> values;
    const RandomKey key(Seed{8});
    for (std::size_t i = 0; i < count; ++i)
        values.push_back(static_cast<float>(key.child(i).uniform(Purpose::Sampling, low, high)));
    return values;
}

double meanOf(const std::vector<float>& values)
{
    return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

} // namespace

TEST(AdjustMean, HitsTheMeanAndStaysInRange)
{
    for (const double high : {0.4, 1.0, 3.0})
        for (const float mean : {0.f, 0.003f, 0.2f, 0.7f, 0.97f, 1.f})
        {
            std::vector<float> values = noise(5000, 0, high);
            adjustMean(values, {}, mean);
            EXPECT_NEAR(meanOf(values), mean, 1e-5 + 1e-4 * static_cast<double>(mean)) << high;
            EXPECT_GE(*std::min_element(values.begin(), values.end()), 0);
            EXPECT_LE(*std::max_element(values.begin(), values.end()), 1);
        }
}

TEST(AdjustMean, TakesPlainFieldsAndBlackOnes)
{
    for (const float value : {0.f, 0.5f, 1.f, 2.f})
        for (const float mean : {0.f, 0.3f, 1.f})
        {
            std::vector<float> values(10, value);
            adjustMean(values, {}, mean);
            EXPECT_NEAR(meanOf(values), mean, 1e-6) << value;
        }
}

TEST(AdjustMean, CountsWhatHasWeightAlone)
{
    std::vector<float> values = {0.2f, 0.4f, 0.9f};
    adjustMean(values, {1, 1, 0}, 0.15f);
    EXPECT_FLOAT_EQ(values[0], 0.1f);
    EXPECT_FLOAT_EQ(values[1], 0.2f);
    EXPECT_FLOAT_EQ(values[2], 0.45f);
    std::vector<float> none = {0.2f, 0.4f};
    adjustMean(none, {0, 0}, 0.3f);
    EXPECT_FLOAT_EQ(none[0], 0.3f);
}

TEST(Blurred, IsTheMeanAllRoundOverTheBorders)
{
    Field field(9, 7);
    field.values = noise(field.values.size(), 0, 1);
    constexpr int kRadius = 2;
    const Field result = blurred(field, kRadius);
    for (int y = 0; y < 7; ++y)
        for (int x = 0; x < 9; ++x)
        {
            double sum = 0;
            for (int dy = -kRadius; dy <= kRadius; ++dy)
                for (int dx = -kRadius; dx <= kRadius; ++dx)
                    sum +=
                        static_cast<double>(field.row(static_cast<std::uint32_t>((y + dy + 7) % 7))[(x + dx + 9) % 9]);
            EXPECT_NEAR(result.row(static_cast<std::uint32_t>(y))[x], sum / 25, 1e-5);
        }
}

TEST(NormalsOf, LeanAwayFromARise)
{
    // A saw along x whose teeth are so wide that its middle is a slope of 45 degrees; rows are alike.
    Field field(16, 4);
    for (std::uint32_t y = 0; y < 4; ++y)
        for (std::uint32_t x = 0; x < 16; ++x)
            field.row(y)[x] = static_cast<float>(x) / 16;
    const Image across = normalsOf(field, 16, 1);
    const std::uint8_t* const texel = across.texels.data() + 3 * (16 + 8);
    EXPECT_NEAR(texel[0], 127.5 * (1 - 0.70711), 1);
    EXPECT_NEAR(texel[1], 127.5, 1);
    EXPECT_NEAR(texel[2], 127.5 * (1 + 0.70711), 1);

    Field rising(4, 16); // towards the top row
    for (std::uint32_t y = 0; y < 16; ++y)
        for (std::uint32_t x = 0; x < 4; ++x)
            rising.row(y)[x] = -static_cast<float>(y) / 16;
    const Image up = normalsOf(rising, 16, 1);
    const std::uint8_t* const below = up.texels.data() + std::size_t{3} * 8 * 4;
    EXPECT_NEAR(below[0], 127.5, 1);
    EXPECT_NEAR(below[1], 127.5 * (1 - 0.70711), 1);
}

} // namespace espalier
