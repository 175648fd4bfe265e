#include <Espalier/Bake/PivotTextures.h>

#include <Espalier/Core/Vector.h>
#include <Espalier/Mesh/WindPresets.h>
#include <Espalier/Texture/Image.h>
#include <array>
#include <gtest/gtest.h>
#include <limits>
#include <vector>

namespace espalier {

namespace {

/// `side` texels across; the first elements stand one above the other, each on the one before.
PivotTable tower(std::uint32_t side, std::uint32_t elements)
{
    PivotTable table;
    table.side = side;
    table.pivots.assign(std::size_t{side} * side, Vec4(0));
    table.directions = table.levels = table.pivots;
    for (std::uint32_t i = 0; i < elements; ++i)
    {
        table.pivots[i] = {0.5f, static_cast<float>(i), -0.25f, i == 0 ? 0.0f : static_cast<float>(i - 1)};
        table.directions[i] = {0, 1, 0, 10.24f};
    }
    return table;
}

std::uint32_t wordAt(const std::string& bytes, std::size_t place, std::size_t size)
{
    std::uint32_t word = 0;
    for (std::size_t i = 0; i < size; ++i)
        word |= std::uint32_t{static_cast<unsigned char>(bytes[place + i])} << (8 * i);
    return word;
}

} // namespace

TEST(PivotTextures, ExrHasItsLinesWhereItsTableSays)
{
    const std::vector<std::array<std::uint16_t, 4>> texels{{1, 2, 3, 4},     {5, 6, 7, 8},     {9, 10, 11, 12},
                                                           {13, 14, 15, 16}, {17, 18, 19, 20}, {21, 22, 23, 24}};
    const std::string bytes = encodeExr(2, 3, texels);
    EXPECT_EQ(wordAt(bytes, 0, 4), 20000630u);
    constexpr std::size_t kLine = 8 + 2 * 4 * 2;
    const std::size_t lines = bytes.size() - 3 * kLine;
    for (std::uint32_t y = 0; y < 3; ++y)
    {
        const std::size_t line = lines + y * kLine;
        EXPECT_EQ(wordAt(bytes, lines - 24 + 8 * y, 4), line);
        EXPECT_EQ(wordAt(bytes, line, 4), y);
        EXPECT_EQ(wordAt(bytes, line + 4, 4), 16u);
        for (std::size_t channel = 0; channel < 4; ++channel) // alpha first
            for (std::size_t x = 0; x < 2; ++x)
                EXPECT_EQ(wordAt(bytes, line + 8 + 2 * (2 * channel + x), 2), texels[2 * y + x][3 - channel]);
    }
}

TEST(PivotTextures, NumbersAreThoseOfUnreal)
{
    const auto textures = encodePivots(tower(2, 3), 3);
    ASSERT_TRUE(textures) << toString(textures.error());
    const std::string& exr = textures->pivots;
    const std::size_t second = exr.size() - (8 + 16); // line
    const auto half = [&](std::size_t channel) { return wordAt(exr, second + 8 + 4 * channel, 2); };
    EXPECT_EQ(half(0), 1024u + 1) << "the parent of element 2, as bits";
    EXPECT_EQ(half(1), 0x5a40u) << "blue: 200 cm up";
    EXPECT_EQ(half(2), 0xce40u) << "green: -25 cm of what was z";
    EXPECT_EQ(half(3), 0x5240u) << "red: 50 cm";
    EXPECT_EQ(encodePivots(tower(2, 3), 3)->pivots, exr);
}

TEST(PivotTextures, DirectionsAreThoseOfUnreal)
{
    PivotTable table = tower(2, 3);
    table.directions[1] = {0.48f, 0.64f, -0.6f, 5.12f};
    table.directions[2] = {-1, 0, 0, 30}; // longer than a byte tells
    const auto textures = encodePivots(table, 3);
    ASSERT_TRUE(textures) << toString(textures.error());
    const auto directions = decodePng(textures->directions, 4, 2, "directions.png");
    ASSERT_TRUE(directions) << toString(directions.error());
    ASSERT_EQ(directions->width, 2u);
    ASSERT_EQ(directions->height, 2u);
    using Texel = std::array<int, 4>;
    const auto texel = [&](std::size_t i) {
        const std::uint8_t* bytes = &directions->texels[4 * i];
        return Texel{bytes[0], bytes[1], bytes[2], bytes[3]};
    };
    EXPECT_EQ(texel(0), (Texel{128, 128, 255, 128})) << "straight up, half of 20.48 m";
    EXPECT_EQ(texel(1), (Texel{189, 51, 209, 64})) << "x, z and y as shares of [-1, 1]: 0.74, 0.2 and 0.82; a quarter";
    EXPECT_EQ(texel(2), (Texel{0, 128, 128, 255}));
    EXPECT_EQ(texel(3), (Texel{0, 0, 0, 0})) << "no element";
}

TEST(PivotTextures, RefusesWhatHalvesCannotHold)
{
    PivotTable far = tower(1, 1);
    far.pivots[0].x = 700;
    EXPECT_FALSE(encodePivots(far, 1));
    far.pivots[0].x = std::numeric_limits<float>::quiet_NaN();
    EXPECT_FALSE(encodePivots(far, 1));
    EXPECT_TRUE(encodePivots(tower(256, kMostPivotElements), 10));
    PivotTable many = tower(256, 0);
    EXPECT_TRUE(encodePivots(many, kMostPivotElements));
    EXPECT_FALSE(encodePivots(many, kMostPivotElements + 1));
}

} // namespace espalier
