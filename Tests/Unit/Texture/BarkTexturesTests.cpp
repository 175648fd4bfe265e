#include <Espalier/Texture/MaterialTextures.h>

#include <Espalier/Core/Hash.h>
#include <Espalier/Texture/Srgb.h>
#include <cmath>
#include <gtest/gtest.h>
#include <span>

namespace espalier {
namespace {

constexpr BarkKind kKinds[] = {BarkKind::Furrowed, BarkKind::Papery, BarkKind::Scaly, BarkKind::Ringed,
                               BarkKind::Smooth};

BarkAppearance barkOf(BarkKind kind)
{
    BarkAppearance bark;
    bark.kind = kind;
    return bark;
}

Vec3 meanLight(const Image& image)
{
    double sum[3] = {};
    for (std::size_t i = 0; i < image.texels.size(); ++i)
        sum[i % 3] += static_cast<double>(linearFromSrgb(image.texels[i]));
    const double count = static_cast<double>(image.texels.size()) / 3;
    return {static_cast<float>(sum[0] / count), static_cast<float>(sum[1] / count), static_cast<float>(sum[2] / count)};
}

double meanByte(const Image& image, std::size_t channel)
{
    double sum = 0;
    for (std::size_t i = channel; i < image.texels.size(); i += 3)
        sum += image.texels[i];
    return sum / (static_cast<double>(image.texels.size()) / 3) / 255;
}

/// Mean difference of two columns (or rows) of texels.
double difference(const Image& image, std::uint32_t a, std::uint32_t b, bool columns)
{
    double sum = 0;
    const std::uint32_t length = columns ? image.height : image.width;
    for (std::uint32_t i = 0; i < length; ++i)
        for (std::uint32_t c = 0; c < 3; ++c)
        {
            const std::size_t one = columns ? std::size_t{i} * image.width + a : std::size_t{a} * image.width + i;
            const std::size_t other = columns ? std::size_t{i} * image.width + b : std::size_t{b} * image.width + i;
            sum += std::abs(image.texels[3 * one + c] - image.texels[3 * other + c]);
        }
    return sum / (3.0 * length);
}

} // namespace

TEST(BarkTextures, HaveTheSizeThatWasAskedFor)
{
    const struct
    {
        std::uint32_t asked, tall, wide, high;
    } sizes[] = {{0, 1, 16, 16},    {17, 1, 16, 16},   {100, 1, 64, 64},  {256, 1, 256, 256},
                 {0, 2, 8, 16},     {64, 2, 32, 64},   {64, 3, 32, 64},   {0, 4, 8, 32},
                 {100, 4, 32, 128}, {128, 4, 64, 256}, {128, 9, 64, 256}, {128, 0, 128, 128}};
    for (const BarkKind kind : kKinds)
        for (const auto& [asked, tall, wide, high] : sizes)
        {
            BarkAppearance bark = barkOf(kind);
            bark.tileHeight = tall;
            const MaterialTextures textures = makeBarkTextures(bark, asked);
            for (const Image* image : {&textures.colour, &textures.normal, &textures.roughness})
            {
                EXPECT_EQ(image->width, wide);
                EXPECT_EQ(image->height, high);
                EXPECT_EQ(image->channels, 3u);
                EXPECT_EQ(image->texels.size(), std::size_t{3} * wide * high);
            }
        }
}

/// What is drawn in one part of a tall tile is not drawn in the others.
TEST(BarkTextures, DoNotRepeatWithinATallTile)
{
    for (const BarkKind kind : kKinds)
    {
        const Image normal = makeBarkTextures(barkOf(kind), 128).normal;
        ASSERT_EQ(normal.height, 4 * normal.width);
        const std::size_t part = normal.texels.size() / 4;
        for (std::size_t i = 1; i < 4; ++i)
        {
            double sum = 0;
            for (std::size_t t = 0; t < part; ++t)
                sum += std::abs(normal.texels[t] - normal.texels[i * part + t]);
            EXPECT_GT(sum / static_cast<double>(part), 3) << static_cast<int>(kind) << ", part " << i;
        }
    }
}

TEST(BarkTextures, HaveTheAppearancesMeans)
{
    const Vec3 colours[] = {
        {0.185f, 0.148f, 0.115f}, {0.7f, 0.68f, 0.62f}, {0.02f, 0.015f, 0.01f}, {0.95f, 0.9f, 0.2f}, {0, 0.5f, 1}};
    for (const BarkKind kind : kKinds)
        for (const Vec3& colour : colours)
        {
            BarkAppearance bark = barkOf(kind);
            bark.colour = colour;
            bark.roughness = 0.7f;
            const MaterialTextures textures = makeBarkTextures(bark, 128);
            const Vec3 mean = meanLight(textures.colour);
            for (int c = 0; c < 3; ++c)
                EXPECT_NEAR(mean[c], colour[c], 0.02f * colour[c]) << static_cast<int>(kind) << ", channel " << c;
            EXPECT_NEAR(meanByte(textures.roughness, 1), 0.7, 0.01);
            EXPECT_EQ(meanByte(textures.roughness, 2), 0) << "bark is no metal";
        }
}

TEST(BarkTextures, TileWithoutASeam)
{
    for (const BarkKind kind : kKinds)
    {
        const MaterialTextures textures = makeBarkTextures(barkOf(kind), 256);
        for (const Image* image : {&textures.colour, &textures.normal, &textures.roughness})
            for (const bool columns : {true, false})
            {
                double greatest = 0;
                const std::uint32_t last = (columns ? image->width : image->height) - 1;
                for (std::uint32_t i = 0; i < last; ++i)
                    greatest = std::max(greatest, difference(*image, i, i + 1, columns));
                // No more changes over the border than elsewhere, and about as much as beside it.
                const double beside =
                    std::max(difference(*image, last - 1, last, columns), difference(*image, 0, 1, columns));
                EXPECT_LE(difference(*image, last, 0, columns), std::min(greatest, 1.6 * beside))
                    << static_cast<int>(kind) << (columns ? ", left to right" : ", top to bottom");
            }
    }
}

TEST(BarkTextures, NormalsAreUnitVectorsThatPointUp)
{
    for (const BarkKind kind : kKinds)
    {
        const Image normal = makeBarkTextures(barkOf(kind), 128).normal;
        Vec3 sum(0);
        for (std::size_t i = 0; i < normal.texels.size(); i += 3)
        {
            const Vec3 n(static_cast<float>(normal.texels[i]) / 127.5f - 1,
                         static_cast<float>(normal.texels[i + 1]) / 127.5f - 1,
                         static_cast<float>(normal.texels[i + 2]) / 127.5f - 1);
            EXPECT_NEAR(glm::length(n), 1, 0.02f);
            EXPECT_GT(n.z, 0);
            sum += n;
        }
        const Vec3 mean = sum / (static_cast<float>(normal.texels.size()) / 3);
        EXPECT_NEAR(mean.x, 0, 0.03f) << static_cast<int>(kind);
        EXPECT_NEAR(mean.y, 0, 0.08f) << static_cast<int>(kind);
    }
}

TEST(BarkTextures, ReliefOverTileDecidesHowSteepTheyAre)
{
    const auto steepness = [](float relief, float tile) {
        BarkAppearance bark;
        bark.relief = relief;
        bark.tile = tile;
        return 1 - meanByte(makeBarkTextures(bark, 128).normal, 2);
    };
    EXPECT_LT(steepness(0, 0.5f), 0.003); // 255 is not quite 1
    EXPECT_LT(steepness(0.005f, 0.5f), 0.8 * steepness(0.01f, 0.5f));
    EXPECT_DOUBLE_EQ(steepness(0.01f, 0.5f), steepness(0.02f, 1));
}

TEST(BarkTextures, OcclusionIsWholeOnFlatBark)
{
    BarkAppearance bark;
    bark.relief = 0;
    EXPECT_DOUBLE_EQ(meanByte(makeBarkTextures(bark, 64).roughness, 0), 1);
    bark.relief = 0.02f;
    const double shaded = meanByte(makeBarkTextures(bark, 64).roughness, 0);
    EXPECT_LT(shaded, 0.97);
    EXPECT_GT(shaded, 0.4);
}

TEST(BarkTextures, AreTheSameBytesFromAnyNumberOfThreads)
{
    for (const BarkKind kind : kKinds)
    {
        const MaterialTextures once = makeBarkTextures(barkOf(kind), 128, 1);
        const MaterialTextures again = makeBarkTextures(barkOf(kind), 128, 3);
        EXPECT_EQ(once.colour, again.colour);
        EXPECT_EQ(once.normal, again.normal);
        EXPECT_EQ(once.roughness, again.roughness);
    }
}

TEST(BarkTextures, KindsDiffer)
{
    for (const BarkKind one : kKinds)
        for (const BarkKind other : kKinds)
            EXPECT_EQ(makeBarkTextures(barkOf(one), 32).normal == makeBarkTextures(barkOf(other), 32).normal,
                      one == other);
}

// Whoever changes how bark looks changes these, on purpose.
TEST(BarkTextures, AreTheSameBytesWithEveryCompiler)
{
    constexpr std::uint64_t kExpected[] = {0x09737b3caeed085au, 0x4180f5a9f87c8f5fu, 0x73a6b8812e87cabeu,
                                           0xbefb1bf271de178du, 0x542a8a8c5c78a9a0u};
    for (std::size_t kind = 0; kind < std::size(kKinds); ++kind)
    {
        const MaterialTextures textures = makeBarkTextures(barkOf(kKinds[kind]), 64);
        Hash64 hashed;
        for (const Image* image : {&textures.colour, &textures.normal, &textures.roughness})
            hashed.values(std::span<const std::uint8_t>(image->texels));
        EXPECT_EQ(hexDigits(hashed.result()), hexDigits(kExpected[kind])) << kind;
    }
}

} // namespace espalier
