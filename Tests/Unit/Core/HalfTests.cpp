#include <Espalier/Core/Half.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <gtest/gtest.h>
#include <limits>

namespace espalier {

namespace {

/// What the bits of a finite half mean (IEEE 754, binary16).
float valueOf(std::uint16_t half)
{
    const int exponent = half >> 10 & 31;
    const int fraction = half & 1023;
    const float magnitude = exponent == 0 ? std::ldexp(static_cast<float>(fraction), -24)
                                          : std::ldexp(static_cast<float>(1024 + fraction), exponent - 25);
    return half & 0x8000 ? -magnitude : magnitude;
}

constexpr std::uint16_t kLargest = 0x7bff; // 65504
constexpr float kInfinity = std::numeric_limits<float>::infinity();

} // namespace

TEST(Half, KeepsWhatIsOne)
{
    for (std::uint32_t bits = 0; bits <= kLargest; ++bits)
        for (const std::uint32_t sign : {0u, 0x8000u})
        {
            const auto half = static_cast<std::uint16_t>(sign | bits);
            ASSERT_EQ(halfOf(valueOf(half)), half);
        }
}

/// Between each half and the next, subnormal or not: what lies in the middle goes to the even one, and the floats
/// beside it each to its nearest.
TEST(Half, RoundsToTheNearestTiesToEven)
{
    for (std::uint32_t bits = 0; bits < kLargest; ++bits)
    {
        const auto low = static_cast<std::uint16_t>(bits);
        const auto high = static_cast<std::uint16_t>(bits + 1);
        const float middle = 0.5f * (valueOf(low) + valueOf(high)); // exact: floats have 13 bits more
        const std::uint16_t even = bits % 2 == 0 ? low : high;
        ASSERT_EQ(halfOf(middle), even) << middle;
        ASSERT_EQ(halfOf(-middle), even | 0x8000) << middle;
        ASSERT_EQ(halfOf(std::nextafter(middle, 0.0f)), low) << middle;
        ASSERT_EQ(halfOf(std::nextafter(middle, kInfinity)), high) << middle;
    }
}

TEST(Half, SmallestAndLargestNumbers)
{
    EXPECT_EQ(halfOf(0.0f), 0);
    EXPECT_EQ(halfOf(-0.0f), 0x8000);
    EXPECT_EQ(halfOf(std::numeric_limits<float>::denorm_min()), 0);
    EXPECT_EQ(halfOf(0x1p-25f), 0) << "half of the smallest: even is nothing";
    EXPECT_EQ(halfOf(0x1.000002p-25f), 1);
    EXPECT_EQ(halfOf(0x1p-24f), 1);
    EXPECT_EQ(halfOf(0x1.8p-24f), 2) << "a tie";
    EXPECT_EQ(halfOf(0x1.ff8p-15f), 0x3ff) << "the largest subnormal";
    EXPECT_EQ(halfOf(0x1.fffffep-15f), 0x400) << "the smallest normal: it carries into the exponent";
    EXPECT_EQ(halfOf(1.0f), 0x3c00);
    EXPECT_EQ(halfOf(-2.5f), 0xc100);
    EXPECT_EQ(halfOf(65504.0f), kLargest);
    EXPECT_EQ(halfOf(65519.9f), kLargest) << "the last that rounds to no infinity";
    EXPECT_EQ(halfOf(-65519.9f), 0xfbff);
    EXPECT_EQ(halfOf(65520.0f), 0x7c00) << "beyond the contract: infinity, as IEEE 754 rounds it";
}

} // namespace espalier
