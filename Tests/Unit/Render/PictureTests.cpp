#include <Espalier/Render/Picture.h>

#include <algorithm>
#include <gtest/gtest.h>
#include <set>

namespace espalier {

namespace {

constexpr Vec3 kWhite{1, 1, 1};

Picture filled(std::uint32_t width, std::uint32_t height, std::uint8_t value)
{
    Picture picture(width, height);
    std::fill(picture.rgb.begin(), picture.rgb.end(), value);
    return picture;
}

std::size_t litPixels(const Picture& picture)
{
    std::size_t count = 0;
    for (std::size_t i = 0; i < picture.rgb.size(); i += 3)
        count += picture.rgb[i] > 127;
    return count;
}

Picture written(std::string_view text, std::uint32_t scale = 1)
{
    Picture picture(6 * scale * static_cast<std::uint32_t>(text.size()), 8 * scale);
    drawText(text, 0, 0, scale, kWhite, picture);
    return picture;
}

std::uint32_t bigEndianAt(const std::string& bytes, std::size_t offset)
{
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < 4; ++i)
        value = value << 8 | static_cast<unsigned char>(bytes[offset + i]);
    return value;
}

} // namespace

TEST(Picture, PasteCutsOffWhatDoesNotFit)
{
    struct Case
    {
        std::uint32_t x, y, width, height;
        std::size_t copied;
    };
    const Case cases[] = {
        {0, 0, 3, 2, 6}, {8, 7, 3, 2, 2},           {9, 0, 3, 2, 2},    {10, 0, 3, 2, 0},
        {0, 8, 3, 2, 0}, {0xffffffffu, 0, 3, 2, 0}, {0, 0, 50, 50, 80}, {2, 2, 0, 0, 0},
    };
    for (const Case& c : cases)
    {
        Picture target(10, 8);
        paste(filled(c.width, c.height, 255), c.x, c.y, target);
        EXPECT_EQ(litPixels(target), c.copied) << c.x << ", " << c.y;
    }
}

TEST(Picture, PasteKeepsRowsInOrder)
{
    Picture source(2, 2);
    for (std::size_t i = 0; i < source.rgb.size(); ++i)
        source.rgb[i] = static_cast<std::uint8_t>(i + 1);
    Picture target(4, 4);
    paste(source, 1, 2, target);
    EXPECT_EQ(target.rgb[3 * (2 * 4 + 1)], 1);
    EXPECT_EQ(target.rgb[3 * (3 * 4 + 2) + 2], 12);
}

TEST(Picture, EveryPrintableCharacterHasItsOwnGlyph)
{
    std::set<std::string> glyphs;
    for (char c = ' '; c <= '~'; ++c)
    {
        const Picture picture = written({&c, 1});
        EXPECT_TRUE(glyphs.emplace(picture.rgb.begin(), picture.rgb.end()).second) << c;
    }
}

TEST(Picture, UnknownCharactersShowAsQuestionMarks)
{
    EXPECT_EQ(written("\x01\x7f\xff\n").rgb, written("????").rgb);
}

TEST(Picture, ScaledTextCoversTheSameShareOfItsCell)
{
    const auto once = static_cast<double>(litPixels(written("Espalier 42")));
    for (const std::uint32_t scale : {2u, 3u, 5u})
    {
        const double covered = static_cast<double>(litPixels(written("Espalier 42", scale))) / (scale * scale);
        EXPECT_NEAR(covered / once, 1, 0.25) << scale;
    }
}

TEST(Picture, TextIsCutOffAtTheEdges)
{
    const Picture whole = written("Oak", 2);
    Picture part(11, 9);
    drawText("Oak", 0, 0, 2, kWhite, part);
    for (std::uint32_t y = 0; y < part.height; ++y)
        for (std::uint32_t x = 0; x < part.width; ++x)
            EXPECT_EQ(part.rgb[3 * (y * part.width + x)], whole.rgb[3 * (y * whole.width + x)]);
    Picture untouched(11, 9);
    drawText("Oak", 11, 0, 2, kWhite, untouched);
    drawText("Oak", 0, 9, 2, kWhite, untouched);
    drawText("Oak", 0xffffffffu, 0xffffffffu, 2, kWhite, untouched);
    EXPECT_EQ(litPixels(untouched), 0u);
}

TEST(Picture, EncodesAsPng)
{
    const std::string png = encodePng(filled(37, 19, 90));
    EXPECT_EQ(png.substr(0, 8), "\x89PNG\r\n\x1a\n");
    EXPECT_EQ(bigEndianAt(png, 16), 37u);
    EXPECT_EQ(bigEndianAt(png, 20), 19u);
    EXPECT_EQ(png.substr(png.size() - 8, 4), "IEND");
}

} // namespace espalier
