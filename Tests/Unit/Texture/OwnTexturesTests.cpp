#include <Espalier/Texture/OwnTextures.h>

#include <Espalier/Core/File.h>
#include <Espalier/Texture/AppearanceTextures.h>
#include <array>
#include <filesystem>
#include <gtest/gtest.h>
#include <unistd.h>

namespace espalier {

namespace {

Image evenImage(std::uint32_t width, std::uint32_t height, std::vector<std::uint8_t> texel)
{
    Image image{width, height, static_cast<std::uint32_t>(texel.size()), {}};
    for (std::uint32_t i = 0; i < width * height; ++i)
        image.texels.insert(image.texels.end(), texel.begin(), texel.end());
    return image;
}

Appearance withImages(std::vector<ImageNames> images)
{
    Appearance appearance;
    appearance.leaves.resize(2);
    appearance.images = std::move(images);
    return appearance;
}

class OwnTexturesTest : public testing::Test
{
protected:
    void SetUp() override { std::filesystem::create_directories(folder); }
    void TearDown() override { std::filesystem::remove_all(folder); }
    void write(const std::string& name, const Image& image)
    {
        ASSERT_TRUE(writeFileAtomically(folder / name, encodePng(image)));
    }
    [[nodiscard]] std::string errorOf(const Appearance& appearance) const
    {
        const auto own = loadOwnTextures(appearance, folder);
        return own ? std::string() : toString(own.error());
    }

    const std::filesystem::path folder =
        std::filesystem::temp_directory_path() / ("espalier-own-textures-" + std::to_string(::getpid()));
};

} // namespace

TEST_F(OwnTexturesTest, TakeThePlaceOfGeneratedOnes)
{
    const Image bark = evenImage(48, 32, {200, 100, 50});
    const Image normal = evenImage(48, 32, {10, 20, 250});
    write("bark.png", bark);
    write("normal.png", normal);
    Appearance appearance = withImages({{"bark.png", "normal.png", ""}});
    appearance.bark.roughness = 0.4f;
    const OwnTextures own = loadOwnTextures(appearance, folder).value();
    const AppearanceTextures all = makeTextures(appearance, {.bark = 64, .leaf = 32}, 1, &own);
    EXPECT_EQ(all.bark.colour, bark);
    EXPECT_EQ(all.bark.normal, normal);
    EXPECT_EQ(all.bark.roughness, evenImage(48, 32, {255, 102, 0})) << "the appearance's";
    ASSERT_EQ(all.leaves.size(), 2u);
    EXPECT_EQ(all.leaves[0].colour, makeLeafTextures(appearance.leaves[0], 32).colour) << "generated as ever";
}

TEST_F(OwnTexturesTest, OfOneKindOfLeafLeaveTheOthersAsTheyAre)
{
    write("leaf.png", evenImage(8, 16, {1, 2, 3, 255}));
    const Appearance appearance = withImages({{}, {}, {"leaf.png", "", ""}});
    const OwnTextures own = loadOwnTextures(appearance, folder).value();
    const AppearanceTextures all = makeTextures(appearance, {.bark = 16, .leaf = 16}, 1, &own);
    EXPECT_EQ(all.leaves[1].colour, evenImage(8, 16, {1, 2, 3, 255}));
    EXPECT_EQ(all.leaves[1].normal, evenImage(8, 16, {128, 128, 255})) << "flat";
    EXPECT_EQ(all.bark.colour, makeBarkTextures(appearance.bark, 16).colour);
    EXPECT_EQ(all.leaves[0].colour, makeLeafTextures(appearance.leaves[0], 16).colour);
}

/// Else mip maps would draw an edge of what the artist left under the holes, often black or white.
TEST_F(OwnTexturesTest, HolesHaveTheColourOfTheLeafBesideThem)
{
    Image leaf = evenImage(8, 8, {0, 0, 0, 0});
    for (std::size_t i = 27; i < 29; ++i)
        for (std::size_t c = 0; c < 4; ++c)
            leaf.texels[4 * i + c] = std::array<std::uint8_t, 4>{90, 160, 40, 255}[c];
    write("leaf.png", leaf);
    const OwnTextures own = loadOwnTextures(withImages({{}, {"leaf.png", "", ""}}), folder).value();
    const Image& filled = own[1].colour;
    for (std::size_t i = 0; i < 64; ++i)
    {
        EXPECT_EQ(filled.texels[4 * i], 90) << i;
        EXPECT_EQ(filled.texels[4 * i + 3], leaf.texels[4 * i + 3]) << i;
    }
}

TEST_F(OwnTexturesTest, KeepTheLimitOnAllOfThemTogether)
{
    write("bark.png", evenImage(16, 16, {1, 2, 3}));
    const Appearance appearance = withImages({{"bark.png", "bark.png", ""}, {"bark.png", "", ""}});
    Limits limits;
    limits.texels = 3 * 256;
    EXPECT_TRUE(loadOwnTextures(appearance, folder, limits));
    limits.texels = 3 * 256 - 1;
    const auto own = loadOwnTextures(appearance, folder, limits);
    ASSERT_FALSE(own);
    EXPECT_EQ(own.error().kind, ErrorKind::Limit);
    EXPECT_NE(own.error().what.find("16 x 16"), std::string::npos);
}

TEST_F(OwnTexturesTest, SayWhichFileIsWrong)
{
    write("bark.png", evenImage(16, 16, {1, 2, 3}));
    write("small.png", evenImage(8, 16, {1, 2, 3}));
    EXPECT_NE(errorOf(withImages({{"none.png", "", ""}})).find("none.png: "), std::string::npos);
    const std::string size = errorOf(withImages({{"bark.png", "small.png", ""}}));
    EXPECT_NE(size.find("small.png: the picture has 8 x 16 texels; expected 16 x 16, as bark.png has"),
              std::string::npos)
        << size;
    ASSERT_TRUE(writeFileAtomically(folder / "text.png", "hello"));
    EXPECT_NE(errorOf(withImages({{"text.png", "", ""}})).find("text.png: this is no PNG file"), std::string::npos);
}

} // namespace espalier
