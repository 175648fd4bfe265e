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

} // namespace espalier
