#include <Espalier/Texture/MaterialTextures.h>

#include <Espalier/Core/Hash.h>
#include <Espalier/Species/LeafOutline.h>
#include <Espalier/Texture/Srgb.h>
#include <cmath>
#include <gtest/gtest.h>
#include <span>

namespace espalier {
namespace {

struct NamedLeaf
{
    const char* name;
    LeafAppearance leaf;
};

LeafAppearance leafOf(LeafShape shape, float width, float stalk, std::uint32_t leaves)
{
    LeafAppearance leaf;
    leaf.shape = shape;
    leaf.width = width;
    leaf.stalk = stalk;
    leaf.leaves = leaves;
    return leaf;
}

std::vector<NamedLeaf> allLeaves()
{
    return {{"beech", leafOf(LeafShape::Ovate, 0.55f, 0.12f, 1)},
            {"oak", leafOf(LeafShape::Lobed, 0.6f, 0.1f, 1)},
            {"willow", leafOf(LeafShape::Lanceolate, 0.18f, 0.08f, 1)},
            {"birch", leafOf(LeafShape::Deltoid, 0.75f, 0.25f, 1)},
            {"palm", leafOf(LeafShape::Linear, 0.1f, 0, 1)},
            {"needle", leafOf(LeafShape::Needle, 0.06f, 0, 1)},
            {"cherry", leafOf(LeafShape::Blossom, 1, 0, 1)},
            {"spray of beech", leafOf(LeafShape::Ovate, 0.9f, 0.1f, 9)},
            {"spray of oak", leafOf(LeafShape::Lobed, 1, 0.1f, 7)},
            {"spray of needles", leafOf(LeafShape::Needle, 0.5f, 0, 48)},
            {"frond", leafOf(LeafShape::Linear, 0.6f, 0, 40)},
            {"wide blossom", leafOf(LeafShape::Blossom, 4, 0, 1)},
            {"thread", leafOf(LeafShape::Linear, 0.01f, 0.9f, 1)},
            {"full spray", leafOf(LeafShape::Deltoid, 4, 0.9f, 64)}};
}

} // namespace

TEST(LeafTextures, AreAsWideAsTheLeafsProportion)
{
    const struct
    {
        float width;
        std::uint32_t height, wide, tall;
    } sizes[] = {{1, 64, 64, 64},    {4, 64, 64, 64},    {0.55f, 64, 32, 64}, {0.75f, 64, 64, 64}, {0.70f, 64, 32, 64},
                 {0.3f, 64, 16, 64}, {0.01f, 64, 8, 64}, {0.125f, 16, 2, 16}, {1, 0, 16, 16},      {0.5f, 100, 32, 64}};
    for (const auto& [width, height, wide, tall] : sizes)
    {
        const MaterialTextures textures = makeLeafTextures(leafOf(LeafShape::Ovate, width, 0.1f, 1), height);
        for (const Image* image : {&textures.colour, &textures.normal, &textures.roughness})
        {
            EXPECT_EQ(image->width, wide) << width << ", " << height;
            EXPECT_EQ(image->height, tall) << width << ", " << height;
            EXPECT_EQ(image->texels.size(), std::size_t{image->channels} * wide * tall);
        }
        EXPECT_EQ(textures.colour.channels, 4u);
        EXPECT_EQ(textures.normal.channels, 3u);
        EXPECT_EQ(textures.roughness.channels, 3u);
    }
}

TEST(LeafTextures, AlphaCoversWhatTheSurfaceCovers)
{
    for (const NamedLeaf& named : allLeaves())
        for (const std::uint32_t height : {64u, 512u})
        {
            const Image colour = makeLeafTextures(named.leaf, height).colour;
            double sum = 0;
            for (std::size_t i = 3; i < colour.texels.size(); i += 4)
                sum += colour.texels[i];
            const double covered = sum / 255 / (static_cast<double>(colour.texels.size()) / 4);
            EXPECT_NEAR(covered, LeafSurface(named.leaf).coverage(), 0.02) << named.name << " at " << height;
        }
}

TEST(LeafTextures, AlphaFollowsTheSurfacePointByPoint)
{
    for (const NamedLeaf& named : allLeaves())
    {
        const LeafSurface surface(named.leaf);
        const Image colour = makeLeafTextures(named.leaf, 256).colour;
        std::size_t wrong = 0;
        for (std::uint32_t y = 0; y < colour.height; ++y)
            for (std::uint32_t x = 0; x < colour.width; ++x)
            {
                const std::uint8_t alpha = colour.texels[4 * (std::size_t{y} * colour.width + x) + 3];
                const bool covered = surface
                                         .at({(static_cast<float>(x) + 0.5f) / static_cast<float>(colour.width),
                                              1 - (static_cast<float>(y) + 0.5f) / static_cast<float>(colour.height)})
                                         .has_value();
                wrong += (alpha == 255 && !covered) || (alpha == 0 && covered);
            }
        EXPECT_LE(wrong, colour.texels.size() / 4 / 1000) << named.name << ": more than a few points of leaves";
    }
}

TEST(LeafTextures, HaveTheAppearancesMeans)
{
    const Vec3 colours[] = {{0.15f, 0.245f, 0.062f}, {0.86f, 0.6f, 0.66f}, {0.03f, 0.05f, 0.02f}, {0.6f, 0.2f, 0.02f}};
    for (NamedLeaf& named : allLeaves())
        for (const Vec3& wanted : colours)
        {
            named.leaf.colour = wanted;
            const MaterialTextures textures = makeLeafTextures(named.leaf, 128);
            double sum[3] = {};
            double rough = 0;
            double count = 0;
            for (std::size_t i = 0; i < textures.colour.texels.size() / 4; ++i)
                if (textures.colour.texels[4 * i + 3] >= 128)
                {
                    for (std::size_t c = 0; c < 3; ++c)
                        sum[c] += static_cast<double>(linearFromSrgb(textures.colour.texels[4 * i + c]));
                    rough += textures.roughness.texels[3 * i + 1];
                    EXPECT_EQ(textures.roughness.texels[3 * i + 2], 0);
                    ++count;
                }
            for (int c = 0; c < 3; ++c)
                EXPECT_NEAR(sum[c] / count, wanted[c], 0.02 * static_cast<double>(wanted[c]))
                    << named.name << ", channel " << c;
            EXPECT_NEAR(rough / count / 255, named.leaf.roughness, 0.01) << named.name;
        }
}

TEST(LeafTextures, WhatIsCutOutHasTheColourOfANearLeaf)
{
    for (const NamedLeaf& named : allLeaves())
    {
        const MaterialTextures textures = makeLeafTextures(named.leaf, 64);
        // No texel is darker than the darkest that is drawn: nothing bleeds in.
        int darkest[3] = {255, 255, 255};
        const Image& colour = textures.colour;
        for (std::size_t i = 0; i < colour.texels.size(); i += 4)
            for (std::size_t c = 0; c < 3; ++c)
                if (colour.texels[i + 3] > 0)
                    darkest[c] = std::min<int>(darkest[c], colour.texels[i + c]);
        for (std::size_t i = 0; i < colour.texels.size(); i += 4)
            for (std::size_t c = 0; c < 3; ++c)
                EXPECT_GE(colour.texels[i + c], darkest[c]) << named.name;
        // Beside an edge it is one of its neighbours'.
        for (std::uint32_t y = 1; y + 1 < colour.height; ++y)
            for (std::uint32_t x = 1; x + 1 < colour.width; ++x)
            {
                const std::size_t own = std::size_t{y} * colour.width + x;
                if (colour.texels[4 * own + 3] > 0)
                    continue;
                bool beside = false;
                bool same = false;
                for (const std::size_t other : {own - 1, own + 1, own - colour.width, own + colour.width})
                {
                    if (colour.texels[4 * other + 3] == 0)
                        continue;
                    beside = true;
                    same = same ||
                           std::equal(&colour.texels[4 * own], &colour.texels[4 * own + 3], &colour.texels[4 * other]);
                }
                EXPECT_TRUE(same || !beside) << named.name << ": " << x << ", " << y;
            }
    }
}

TEST(LeafTextures, NormalsAreUnitVectorsThatPointUp)
{
    for (const NamedLeaf& named : allLeaves())
    {
        const Image normal = makeLeafTextures(named.leaf, 256).normal;
        for (std::size_t i = 0; i < normal.texels.size(); i += 3)
        {
            const Vec3 n(static_cast<float>(normal.texels[i]) / 127.5f - 1,
                         static_cast<float>(normal.texels[i + 1]) / 127.5f - 1,
                         static_cast<float>(normal.texels[i + 2]) / 127.5f - 1);
            ASSERT_NEAR(glm::length(n), 1, 0.02f) << named.name;
            ASSERT_GT(n.z, 0) << named.name;
        }
    }
}

TEST(LeafTextures, RibsAreLighterThanTheBlade)
{
    for (const LeafShape shape : {LeafShape::Ovate, LeafShape::Lobed, LeafShape::Deltoid, LeafShape::Lanceolate})
    {
        const Image colour = makeLeafTextures(leafOf(shape, 0.5f, 0, 1), 256).colour;
        const auto greenAt = [&](std::uint32_t x, std::uint32_t y) {
            return colour.texels[4 * (std::size_t{y} * colour.width + x) + 1];
        };
        int lighter = 0;
        for (std::uint32_t y = 96; y < 224; ++y)
            lighter += greenAt(colour.width / 2, y) > greenAt(colour.width / 2 + 12, y);
        EXPECT_GT(lighter, 100) << static_cast<int>(shape);
    }
}

TEST(LeafTextures, LeavesOfASprayDiffer)
{
    const LeafAppearance leaf = leafOf(LeafShape::Ovate, 0.9f, 0.1f, 9);
    const LeafSurface surface(leaf);
    const Image colour = makeLeafTextures(leaf, 256).colour;
    std::vector<double> sums(9);
    std::vector<double> counts(9);
    for (std::uint32_t y = 0; y < colour.height; ++y)
        for (std::uint32_t x = 0; x < colour.width; ++x)
        {
            const std::optional<SurfacePoint> point =
                surface.at({(static_cast<float>(x) + 0.5f) / static_cast<float>(colour.width),
                            1 - (static_cast<float>(y) + 0.5f) / static_cast<float>(colour.height)});
            if (!point || point->leaf == SurfacePoint::kShoot)
                continue;
            sums[point->leaf] +=
                static_cast<double>(linearFromSrgb(colour.texels[4 * (std::size_t{y} * colour.width + x) + 1]));
            ++counts[point->leaf];
        }
    double darkest = 1;
    double lightest = 0;
    for (std::size_t i = 0; i < sums.size(); ++i)
    {
        darkest = std::min(darkest, sums[i] / counts[i]);
        lightest = std::max(lightest, sums[i] / counts[i]);
    }
    EXPECT_GT(lightest / darkest, 1.05);
    EXPECT_LT(lightest / darkest, 1.6);
}

TEST(LeafTextures, HugeSizesAreClamped)
{
    const Image colour = makeLeafTextures(leafOf(LeafShape::Needle, 0.05f, 0, 1), 0xffffffffu, 0).colour;
    EXPECT_EQ(colour.height, kMaxTextureSize);
    EXPECT_EQ(colour.width, kMaxTextureSize / 8);
}

TEST(LeafTextures, AreTheSameBytesFromAnyNumberOfThreads)
{
    for (const NamedLeaf& named : allLeaves())
    {
        const MaterialTextures once = makeLeafTextures(named.leaf, 128, 1);
        const MaterialTextures again = makeLeafTextures(named.leaf, 128, 3);
        EXPECT_EQ(once.colour, again.colour) << named.name;
        EXPECT_EQ(once.normal, again.normal) << named.name;
        EXPECT_EQ(once.roughness, again.roughness) << named.name;
    }
}

// Whoever changes how leaves look changes these, on purpose.
TEST(LeafTextures, AreTheSameBytesWithEveryCompiler)
{
    struct Case
    {
        LeafShape shape;
        std::uint64_t one, spray;
    };
    constexpr Case kCases[] = {{LeafShape::Ovate, 0x20ab90761eb3aeb9u, 0x27c594a1a815acbdu},
                               {LeafShape::Lobed, 0xc613436410e2c7a7u, 0x89b3099b5ae346c4u},
                               {LeafShape::Lanceolate, 0x215c0d67e935fc8cu, 0x7f3c2a7cbaa3cfffu},
                               {LeafShape::Deltoid, 0xc0ef72cddf781ed6u, 0x37bea9648c01447bu},
                               {LeafShape::Linear, 0x2541834842f53394u, 0xb2a5c646ef664667u},
                               {LeafShape::Needle, 0x79d08753a71204d9u, 0x6db6fe3e562ff994u},
                               {LeafShape::Blossom, 0x0275bc4566e5403bu, 0x0275bc4566e5403bu}};
    for (const Case& c : kCases)
        for (const std::uint32_t leaves : {1u, 9u})
        {
            LeafAppearance leaf;
            leaf.shape = c.shape;
            leaf.leaves = leaves;
            const MaterialTextures textures = makeLeafTextures(leaf, 64);
            Hash64 hashed;
            for (const Image* image : {&textures.colour, &textures.normal, &textures.roughness})
                hashed.values(std::span<const std::uint8_t>(image->texels));
            EXPECT_EQ(hexDigits(hashed.result()), hexDigits(leaves == 1 ? c.one : c.spray))
                << static_cast<int>(c.shape) << ", " << leaves;
        }
}

} // namespace espalier
