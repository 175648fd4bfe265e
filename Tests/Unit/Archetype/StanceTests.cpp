#include <Espalier/Archetype/Stance.h>

#include <Espalier/Archetype/Mirror.h>
#include <Espalier/Archetype/Placement.h>
#include <Inference/SampleArchetypes.h>
#include <gtest/gtest.h>

namespace espalier {

namespace {

std::vector<Stance> stancesOf(const Archetype& archetype)
{
    std::vector<Stance> stances(archetype.instances.size());
    const ArchetypeDrawer drawer(archetype);
    Skeleton skeleton;
    for (std::size_t tree = 0; tree < drawer.trees(); ++tree)
    {
        EXPECT_TRUE(drawer.draw(tree, {}, skeleton));
        findStances(skeleton, stances);
    }
    return stances;
}

/// Two trees: limbs to either side; one that levels itself, one that lies on its side, one upright again.
Archetype limbs()
{
    return samples::read("fork: F[+(70)FX][-(70)FY]FZ\ntwig: F\nlevel: $F\nempty: X\n",
                         R"({"template": "fork", "children": {"X": {"template": "twig"},
                             "Y": {"template": "twig"}, "Z": {"template": "twig"}}},
                            {"template": "fork", "children": {"X": {"template": "level"},
                             "Y": {"template": "twig", "roll": 90},
                             "Z": {"template": "twig", "rotation": 30, "children": {}}}})");
}

} // namespace

TEST(Stance, IsHowAnInstanceLooksToTheSky)
{
    using enum SkySide;
    // What leads left has its right side up.
    const std::vector<Stance> expected{{Neither, true}, {Right, false},   {Left, false},    {Neither, true},
                                       {Neither, true}, {Neither, false}, {Neither, false}, {Right, false}};
    EXPECT_EQ(stancesOf(limbs()), expected);
}

TEST(Stance, OfAMirrorImageIsThatOfTheOtherSide)
{
    for (std::uint64_t seed = 1; seed <= 20; ++seed)
    {
        const Archetype drawn = samples::randomArchetype(Seed{seed}, 30);
        std::vector<Stance> expected = stancesOf(drawn);
        for (Stance& stance : expected)
            stance.skySide = mirrorImage(stance.skySide);
        EXPECT_EQ(stancesOf(mirrorImage(drawn)), expected) << "seed " << seed;
    }
}

TEST(Stance, OfWhatDrawsNothingIsLeftAlone)
{
    const Archetype drawn = samples::read("empty: X\n", R"({"template": "empty"})");
    EXPECT_EQ(stancesOf(drawn), std::vector<Stance>{Stance{}});
}

} // namespace espalier
