#include <Espalier/Texture/Srgb.h>

#include <cmath>
#include <gtest/gtest.h>
#include <limits>

namespace espalier {

TEST(Srgb, EveryByteComesBack)
{
    for (int i = 0; i < 256; ++i)
        EXPECT_EQ(srgbFromLinear(linearFromSrgb(static_cast<std::uint8_t>(i))), i);
}

TEST(Srgb, IsTheStandardsCurve)
{
    for (int i = 0; i < 256; ++i)
    {
        const double srgb = i / 255.0;
        const double linear = srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4);
        EXPECT_NEAR(linearFromSrgb(static_cast<std::uint8_t>(i)), linear, 1e-7) << i;
    }
    EXPECT_EQ(srgbFromLinear(0.5f), 188);
    EXPECT_EQ(srgbFromLinear(0.18f), 118);
}

TEST(Srgb, NeverFallsAndIsClamped)
{
    int last = 0;
    for (int i = 0; i <= 100000; ++i)
    {
        const int now = srgbFromLinear(static_cast<float>(i) * 1e-5f);
        EXPECT_GE(now, last) << i;
        EXPECT_LE(now, last + 1) << i;
        last = now;
    }
    EXPECT_EQ(last, 255);
    EXPECT_EQ(srgbFromLinear(7), 255);
    EXPECT_EQ(srgbFromLinear(std::numeric_limits<float>::infinity()), 255);
    EXPECT_EQ(srgbFromLinear(-1), 0);
    EXPECT_EQ(srgbFromLinear(std::numeric_limits<float>::quiet_NaN()), 0);
}

} // namespace espalier
