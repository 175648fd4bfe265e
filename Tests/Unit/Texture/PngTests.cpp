#include <Espalier/Texture/Image.h>

#include <Espalier/Core/Random.h>
#include <gtest/gtest.h>

#if defined(__GNUC__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wsign-conversion"
#pragma GCC diagnostic ignored "-Wshadow"
#endif
#define STB_IMAGE_STATIC
#define STB_IMAGE_IMPLEMENTATION
#define STBI_ONLY_PNG
#define STBI_NO_STDIO
#include <stb_image.h>
#if defined(__GNUC__)
#pragma GCC diagnostic pop
#endif

namespace espalier {
namespace {

Image decoded(const std::string& png)
{
    int width = 0;
    int height = 0;
    int channels = 0;
    stbi_uc* const texels = stbi_load_from_memory(reinterpret_cast<const stbi_uc*>(png.data()),
                                                  static_cast<int>(png.size()), &width, &height, &channels, 0);
    if (!texels)
        return {};
    Image image{static_cast<std::uint32_t>(width),
                static_cast<std::uint32_t>(height),
                static_cast<std::uint32_t>(channels),
                {}};
    image.texels.assign(texels, texels + std::ptrdiff_t{width} * height * channels);
    stbi_image_free(texels);
    return image;
}

/// Half of it noise, which hardly compresses, half of it plain.
Image sample(std::uint32_t width, std::uint32_t height, std::uint32_t channels)
{
    Image image{width, height, channels, std::vector<std::uint8_t>(std::size_t{width} * height * channels, 77)};
    const RandomKey key(Seed{5});
    for (std::size_t i = 0; i < image.texels.size() / 2; ++i)
        image.texels[i] = static_cast<std::uint8_t>(key.child(i).bits(Purpose::Sampling));
    return image;
}

} // namespace

TEST(Png, DecodesToTheSameTexels)
{
    for (std::uint32_t channels = 1; channels <= 4; ++channels)
        for (const std::uint32_t width : {1u, 2u, 37u, 256u})
            for (const std::uint32_t height : {1u, 3u, 64u})
            {
                const Image image = sample(width, height, channels);
                EXPECT_EQ(decoded(encodePng(image)), image)
                    << width << " x " << height << ", " << channels << " channels";
            }
}

TEST(Png, GivesTheSameBytesEachTime)
{
    const Image image = sample(60, 50, 3);
    EXPECT_EQ(encodePng(image), encodePng(image));
}

TEST(Png, IsEmptyForImagesThatAreNone)
{
    EXPECT_EQ(encodePng({}), "");
    const struct
    {
        std::uint32_t width, height, channels;
        std::size_t texels;
    } broken[] = {{0, 5, 3, 0},
                  {5, 0, 3, 0},
                  {5, 5, 0, 0},
                  {5, 5, 5, 125},
                  {5, 5, 3, 74},
                  {5, 5, 3, 76},
                  {0xffffffffu, 0xffffffffu, 1, 1},
                  {65536, 65536, 1, 0}};
    for (const auto& [width, height, channels, texels] : broken)
        EXPECT_EQ(encodePng({width, height, channels, std::vector<std::uint8_t>(texels)}), "")
            << width << " x " << height;
}

TEST(Png, ReadsBackWhatItWrote)
{
    for (std::uint32_t channels = 1; channels <= 4; ++channels)
    {
        const Image image = sample(37, 3, channels);
        const auto read = decodePng(encodePng(image), 4, 4096, "x.png");
        ASSERT_TRUE(read.has_value()) << toString(read.error());
        EXPECT_EQ(read->width, 37u);
        EXPECT_EQ(read->height, 3u);
        for (std::size_t i = 0; i < std::size_t{37} * 3; ++i)
        {
            const std::uint8_t* const texel = &image.texels[i * channels];
            const std::uint8_t alpha = channels % 2 == 0 ? texel[channels - 1] : 255;
            for (std::uint32_t c = 0; c < 3; ++c)
                ASSERT_EQ(read->texels[4 * i + c], texel[channels < 3 ? 0 : c]) << channels << " channels, texel " << i;
            ASSERT_EQ(read->texels[4 * i + 3], alpha);
        }
    }
}

TEST(Png, LeavesAlphaOutWhereItIsNotAskedFor)
{
    const Image image = sample(8, 8, 4);
    const Image read = decodePng(encodePng(image), 3, 4096, "x.png").value();
    ASSERT_EQ(read.channels, 3u);
    ASSERT_EQ(read.texels.size(), 192u);
    for (std::size_t i = 0; i < 64; ++i)
        for (std::size_t c = 0; c < 3; ++c)
            EXPECT_EQ(read.texels[3 * i + c], image.texels[4 * i + c]);
}

/// glTF reads texels as they are stored, whatever a PNG says of its gamma; so do we.
TEST(Png, TakesTexelsAsTheyAreStored)
{
    const Image image = sample(16, 16, 3);
    std::string png = encodePng(image);
    const std::string gamma("\0\0\0\4gAMA\0\1\x86\xa0\x31\xe8\x96\x5f", 16); // 1.0
    png.insert(8 + 25, gamma);                                               // after IHDR
    const auto read = decodePng(png, 3, 4096, "x.png");
    ASSERT_TRUE(read.has_value()) << toString(read.error());
    EXPECT_EQ(*read, image);
}

TEST(Png, SaysWhyItReadsNothing)
{
    const auto errorOf = [](const std::string& bytes, std::uint32_t mostSide) {
        const auto image = decodePng(bytes, 4, mostSide, "x.png");
        return image ? std::string() : toString(image.error());
    };
    const std::string png = encodePng(sample(40, 20, 3));
    EXPECT_EQ(errorOf(png, 40), "");
    EXPECT_EQ(errorOf(png, 39), "x.png: the picture has 40 x 20 texels; expected sides of at most 39");
    EXPECT_EQ(errorOf("GIF89a", 40), "x.png: this is no PNG file; expected a picture as PNG");
    EXPECT_EQ(errorOf("", 40), "x.png: this is no PNG file; expected a picture as PNG");
    constexpr std::size_t kEndChunk = 12; // says nothing: a picture without it is whole
    for (std::size_t length = 0; length + kEndChunk < png.size(); length += 7)
        EXPECT_NE(errorOf(png.substr(0, length), 40), "") << length;
}

} // namespace espalier
