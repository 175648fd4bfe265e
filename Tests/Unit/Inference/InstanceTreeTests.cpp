#include <Espalier/Inference/Inference.h>
#include <Espalier/Inference/InstanceTree.h>
#include <Espalier/Species/Grow.h>
#include <Inference/SampleArchetypes.h>
#include <algorithm>
#include <gtest/gtest.h>

namespace espalier {
namespace {

Archetype read(const std::string& trees)
{
    return samples::read("fork: F[-FX]+FY\nbud: F\nboth: FXY[Z]", trees);
}

InstanceTree treeOf(const Archetype& archetype, std::size_t tree = 0)
{
    return instanceTreeOf(archetype, anchorsOf(archetype), tree);
}

/// The instance tree of what a species that holds its archetype exactly grows.
InstanceTree grownExemplar(const Species& species, const Archetype& archetype, std::uint32_t tree)
{
    std::vector<std::uint32_t> labels;
    for (const Production& production : species.grammar.productions)
        labels.push_back(static_cast<std::uint32_t>(archetype.library.find(production.table)));
    const Grower grower = Grower::makeExemplar(species, tree).value();
    GrowScratch scratch;
    InstanceTreeSink sink(labels);
    EXPECT_TRUE(grower.derive(Seed{1}, 0, {}, scratch, sink));
    return sink.take();
}

TEST(InstanceTree, NamesTemplatesAndPlacesOfADrawnTree)
{
    const InstanceTree tree = treeOf(read(R"({"template":"fork","children":{
        "X":{"template":"bud"}, "Y":{"template":"fork","children":{"Y":{"template":"bud"}}}}})"));
    EXPECT_EQ(tree.shape.labels, (std::vector<std::uint32_t>{0, 1, 0, 1}));
    EXPECT_EQ(tree.shape.parents, (std::vector<std::uint32_t>{0, 0, 0, 2}));
    EXPECT_EQ(tree.places, (std::vector<std::uint32_t>{0, 3, 0, 0})); // behind X come ] + F, behind Y nothing
    EXPECT_EQ(depthsOf(tree), (std::vector<std::uint32_t>{1, 2, 2, 3}));
}

TEST(InstanceTree, AnchorsWithNothingBetweenAreOnePlace)
{
    const auto withBudAt = [](const std::string& anchor) {
        return treeOf(read(R"({"template":"both","children":{")" + anchor + R"(":{"template":"bud"}}})"));
    };
    EXPECT_EQ(topologyOf(withBudAt("X")), topologyOf(withBudAt("Y")));
    EXPECT_NE(topologyOf(withBudAt("X")), topologyOf(withBudAt("Z")));
}

TEST(InstanceTree, OfADerivationIsThatOfTheDrawnTree)
{
    for (std::uint64_t seed = 0; seed < 20; ++seed)
    {
        const Archetype archetype = samples::randomArchetype(Seed{seed}, 5 + 7 * static_cast<std::uint32_t>(seed), 2);
        const Species species =
            inferSpecies({&archetype, 1}, {.mergeWeight = 0.4, .ruleWeight = static_cast<double>(seed) / 19}).value();
        for (std::uint32_t tree = 0; tree < anchorsOf(archetype).roots.size(); ++tree)
        {
            const InstanceTree drawn = treeOf(archetype, tree);
            const InstanceTree grown = grownExemplar(species, archetype, tree);
            EXPECT_EQ(grown.shape.labels, drawn.shape.labels) << seed;
            EXPECT_EQ(grown.shape.parents, drawn.shape.parents) << seed;
            EXPECT_EQ(grown.places, drawn.places) << seed;
            EXPECT_EQ(grown.unfinished, 0u);
        }
    }
}

} // namespace
} // namespace espalier
