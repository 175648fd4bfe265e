#include <Espalier/Archetype/Spatial.h>

#include <Espalier/Archetype/Placement.h>
#include <Espalier/Inference/Inference.h>
#include <Espalier/Plant/Axes.h>
#include <Espalier/Species/Grow.h>
#include <Inference/SampleArchetypes.h>
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

namespace espalier {

namespace {

constexpr Azimuths kPhyllotaxis[] = {Azimuths::Phyllotaxis};
constexpr Azimuths kRandom[] = {Azimuths::Random};

/// `depth` instances of the first template, one upon the other at the anchor Z.
Archetype chain(const std::string& templates, int depth)
{
    std::string trees = R"({"template": "node"})";
    for (int i = 1; i < depth; ++i)
        trees = R"({"template": "node", "children": {"Z": )" + trees + "}}";
    return samples::read(templates, trees);
}

/// Azimuths of the segments that leave the vertical, in their order, degrees round +Y.
std::vector<double> azimuthsOf(const Skeleton& skeleton)
{
    std::vector<double> azimuths;
    for (const Vec3& heading : skeleton.headings)
        if (std::abs(heading.y) < 0.99f)
            azimuths.push_back(std::atan2(heading.z, heading.x) * 57.295779513);
    return azimuths;
}

double turn(double from, double to)
{
    return std::abs(std::remainder(to - from, 360.0));
}

struct Extent
{
    float height = 0, width = 0, depth = 0;
};

Extent extentOf(const Skeleton& skeleton)
{
    Vec3 low(0);
    Vec3 high(0);
    for (const Vec3& end : skeleton.ends)
        for (int i = 0; i < 3; ++i)
        {
            low[i] = std::min(low[i], end[i]);
            high[i] = std::max(high[i], end[i]);
        }
    return {high.y - low.y, high.x - low.x, high.z - low.z};
}

} // namespace

TEST(Spatial, TurnsFromBranchToBranchByTheGoldenAngle)
{
    const Archetype drawn = chain("node: F[-F]Z\n", 12);
    const Skeleton tree = drawArchetype(giveDepth(drawn, kPhyllotaxis)).value();
    const std::vector<double> azimuths = azimuthsOf(tree);
    ASSERT_EQ(azimuths.size(), 12u);
    EXPECT_NEAR(azimuths[0], 0, 1e-3) << "the first stays on the right, where it was drawn";
    for (std::size_t i = 1; i < azimuths.size(); ++i)
        EXPECT_NEAR(turn(azimuths[i - 1], azimuths[i]), 137.5, 0.02) << i;
    const auto highest = [](const Skeleton& s) { return s.maxY; };
    EXPECT_NEAR(highest(tree), highest(drawArchetype(drawn).value()), 1e-4) << "a straight axis stays as it was";
}

TEST(Spatial, KeepsSidesTogetherAndTurnsPairsByHalf)
{
    const std::vector<double> azimuths =
        azimuthsOf(drawArchetype(giveDepth(chain("node: F[-F][+F]Z\n", 6), kPhyllotaxis)).value());
    ASSERT_EQ(azimuths.size(), 12u);
    for (std::size_t i = 0; i < azimuths.size(); i += 2)
    {
        EXPECT_NEAR(turn(azimuths[i], azimuths[i + 1]), 180, 1e-3);
        if (i > 0)
        {
            EXPECT_NEAR(turn(azimuths[i - 2], azimuths[i]), 68.75, 0.02);
        }
    }
    // Branches that leave to the left and to the right in the drawing: what counts is where they stand in the end.
    const Archetype sides = samples::read("node: F[-F]Z\nleft: F[+F]Z\n",
                                          R"({"template": "node", "children": {"Z": {"template": "left", "children": {
                                              "Z": {"template": "node"}}}}})");
    const std::vector<double> alternate = azimuthsOf(drawArchetype(giveDepth(sides, kPhyllotaxis)).value());
    ASSERT_EQ(alternate.size(), 3u);
    EXPECT_NEAR(turn(alternate[0], alternate[1]), 137.5, 0.02);
    EXPECT_NEAR(turn(alternate[1], alternate[2]), 137.5, 0.02);
}

TEST(Spatial, MakesAPlanarTreeOfAboutTheSameHeightDeep)
{
    const Archetype drawn = samples::thesis();
    const Skeleton flat = drawArchetype(drawn).value();
    const Extent before = extentOf(flat);
    EXPECT_NEAR(before.depth, 0, 1e-4);
    for (const auto& azimuths : {kPhyllotaxis, kRandom})
    {
        const Archetype deep = giveDepth(drawn, {azimuths, 1});
        ASSERT_TRUE(validate(deep));
        const Skeleton tree = drawArchetype(deep).value();
        const Extent after = extentOf(tree);
        EXPECT_EQ(tree.size(), flat.size());
        EXPECT_NEAR(after.height / before.height, 1, 0.15);
        EXPECT_GT(after.depth, 0.3f * after.height);
        EXPECT_GT(after.width, 0.3f * after.height);
        EXPECT_EQ(tree.minY, 0) << "nothing hangs below the ground";
    }
}

TEST(Spatial, ActsOnTheOrdersItIsToldTo)
{
    const Archetype drawn = samples::thesis();
    EXPECT_EQ(giveDepth(drawn, {}), drawn);
    const Azimuths asDrawn[] = {Azimuths::AsDrawn};
    EXPECT_EQ(giveDepth(drawn, asDrawn), drawn);
    // A trunk with a limb that bears two twigs in a chain.
    const Archetype limbed = samples::read("node: F[-FX]Z\ntwig: F[-F]Z\n", R"({"template": "node", "children": {
        "X": {"template": "twig", "children": {"Z": {"template": "twig"}}},
        "Z": {"template": "node", "children": {"Z": {"template": "node"}}}}})");
    const Azimuths limbs[] = {Azimuths::AsDrawn, Azimuths::Phyllotaxis};
    const Azimuths trunk[] = {Azimuths::Phyllotaxis, Azimuths::AsDrawn};
    const Archetype onLimbs = giveDepth(limbed, limbs);
    const Archetype onTrunk = giveDepth(limbed, trunk);
    for (std::size_t i = 0; i < limbed.instances.size(); ++i)
    {
        const bool isTwig = limbed.library.templates[limbed.instances[i].piece].name == "twig";
        EXPECT_EQ(onLimbs.instances[i].transform.roll != 0, isTwig) << i;
        EXPECT_EQ(onTrunk.instances[i].transform.roll != 0, !isTwig && i > 0) << i;
    }
}

TEST(Spatial, IsAFunctionOfThePlace)
{
    for (const auto& azimuths : {kPhyllotaxis, kRandom})
    {
        Archetype drawn = samples::randomArchetype(Seed{5}, 60);
        const Archetype whole = giveDepth(drawn, {azimuths, 1});
        EXPECT_EQ(giveDepth(drawn, {azimuths, 1}), whole);
        // The last instance carries nothing: without it the others are as they were, but for the one that bore it, for
        // which a branch less may leave.
        const std::uint32_t bearer = drawn.instances.back().parent;
        drawn.instances.pop_back();
        const Archetype less = giveDepth(drawn, {azimuths, 1});
        std::vector<bool> below(drawn.instances.size());
        for (std::size_t i = 0; i < drawn.instances.size(); ++i)
        {
            const std::uint32_t parent = drawn.instances[i].parent;
            below[i] = i == bearer || (parent != kNoInstance && below[parent]);
            if (!below[i])
            {
                EXPECT_EQ(less.instances[i], whole.instances[i]) << i;
            }
        }
    }
}

TEST(Spatial, IsReadAndPrinted)
{
    EXPECT_EQ(printAzimuths(parseAzimuths("phyllotaxis,drawn,random").value()), "phyllotaxis,drawn,random");
    for (const char* wrong : {"", "spiral", "random,", ",random", "random random"})
        EXPECT_EQ(parseAzimuths(wrong).error().kind, ErrorKind::BadInput) << wrong;
}

TEST(Spatial, IsWhatInferenceLearnsFrom)
{
    const Archetype drawn = samples::thesis();
    const Species species = inferSpecies({&drawn, 1}, {.spatial = {Azimuths::Phyllotaxis}}).value();
    EXPECT_EQ(species.provenance.spatial, "phyllotaxis");
    EXPECT_EQ(parseSpecies(printSpecies(species), "test").value(), species);
    Skeleton deep = drawArchetype(giveDepth(drawn, kPhyllotaxis)).value();
    Skeleton exemplar;
    GrowScratch scratch;
    ASSERT_TRUE(Grower::makeExemplar(species)->grow(Seed{9}, {}, scratch, exemplar));
    EXPECT_EQ(exemplar.ends, deep.ends);
    const Species planar = inferSpecies({&drawn, 1}, {}).value();
    EXPECT_EQ(printSpecies(planar).find("spatial"), std::string::npos);
}

} // namespace espalier
