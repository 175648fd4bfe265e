#include <Espalier/Render/PaintedMaterial.h>
#include <gtest/gtest.h>

namespace espalier {

namespace {

/// Two by two texels: above red and green, below blue and transparent white.
PaintedMaterial fourColours(TextureWrap wrap)
{
    const Image colour{2, 2, 4, {255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255, 255, 255, 255, 0}};
    const Image normal{1, 1, 3, {128, 128, 255}};
    return {{colour, normal, normal}, wrap};
}

void expectColour(Vec3 found, Vec3 wanted)
{
    for (int i = 0; i < 3; ++i)
        EXPECT_NEAR(found[i], wanted[i], 1e-4f) << i;
}

} // namespace

TEST(PaintedMaterial, TheTopOfTheImageIsTheTip)
{
    const PaintedMaterial material = fourColours(TextureWrap::Clamp);
    expectColour(material.colour({0.25f, 0.75f}), {1, 0, 0});
    expectColour(material.colour({0.75f, 0.75f}), {0, 1, 0});
    expectColour(material.colour({0.25f, 0.25f}), {0, 0, 1});
    expectColour(material.normal({0.5f, 0.5f}), {1 / 255.f, 1 / 255.f, 1});
}

TEST(PaintedMaterial, BlendsLightBetweenTexels)
{
    expectColour(fourColours(TextureWrap::Clamp).colour({0.5f, 0.75f}), {0.5f, 0.5f, 0});
}

TEST(PaintedMaterial, RepeatsOrStopsAtTheEdge)
{
    expectColour(fourColours(TextureWrap::Repeat).colour({3.25f, -4.25f}), {1, 0, 0});
    expectColour(fourColours(TextureWrap::Clamp).colour({-7, 9}), {1, 0, 0});
}

TEST(PaintedMaterial, AlphaCutsWhereTheTexelSaysSo)
{
    const PaintedMaterial material = fourColours(TextureWrap::Clamp);
    EXPECT_EQ(material.alpha({0.9f, 0.1f}), 0);
    EXPECT_EQ(material.alpha({0.1f, 0.1f}), 1);
    EXPECT_EQ(material.alpha({1, 1}), 1);
}

} // namespace espalier
