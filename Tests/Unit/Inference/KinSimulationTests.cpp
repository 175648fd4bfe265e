#include <Espalier/Inference/KinGrammar.h>
#include <Espalier/Inference/KinSimulation.h>
#include <Espalier/Species/Grow.h>
#include <Inference/SampleArchetypes.h>
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

namespace espalier {
namespace {

struct Scene
{
    Archetype archetype;
    std::vector<std::uint32_t> draws;
    std::vector<std::uint32_t> anchors;
    LimbTable limbs;
    double segments = 0;

    explicit Scene(Archetype drawn) : archetype(std::move(drawn)), draws(segmentsDrawn(archetype.library))
    {
        for (const Template& piece : archetype.library.templates)
            anchors.push_back(static_cast<std::uint32_t>(piece.anchors.size()));
        limbs = shareLimbs(archetype, anchorsOf(archetype), draws);
        for (const LimbUse& root : limbs.roots)
            segments += limbs.limbs[root.limb].segments / static_cast<double>(limbs.roots.size());
    }
};

struct Mean
{
    double sum = 0;
    double squares = 0;
    double count = 0;
    void add(double value)
    {
        sum += value;
        squares += value * value;
        ++count;
    }
    [[nodiscard]] double mean() const { return sum / count; }
    [[nodiscard]] double error() const { return std::sqrt(std::max(0.0, squares / count - mean() * mean()) / count); }
};

TEST(KinSimulation, GrowsTheDrawnTreesAtWeightZero)
{
    const Scene scene(samples::randomArchetype(Seed{8}, 50, 3));
    const KinClasses classes = classify(scene.limbs, kinLevels().back(), scene.segments);
    KinSimulation simulation(scene.limbs, classes, scene.draws, scene.anchors);
    SimulatedTree grown;
    SimulatedTree drawn;
    for (std::uint64_t seed = 0; seed < 6; ++seed)
    {
        simulation.grow(Seed{seed}, 0, 1u << 30, grown);
        simulation.drawn(seed % 3, drawn);
        EXPECT_EQ(grown.topology, drawn.topology);
        EXPECT_EQ(grown.shape.labels, drawn.shape.labels);
        EXPECT_EQ(grown.segments, scene.limbs.limbs[scene.limbs.roots[seed % 3].limb].segments);
        EXPECT_EQ(grown.depth, scene.limbs.limbs[scene.limbs.roots[seed % 3].limb].height);
    }
}

TEST(KinSimulation, GrowsWhatTheGrammarGrows)
{
    for (const Archetype& archetype : {samples::thesis(), samples::randomArchetype(Seed{3}, 40)})
    {
        const Scene scene(archetype);
        for (const std::size_t level : {0u, 2u, 5u, 6u})
        {
            KinClasses classes = classify(scene.limbs, kinLevels()[level], scene.segments);
            classes.weight = 0.6;
            runAlikeLimbs(scene.limbs, classes);
            Species species;
            writeKinGrammar(archetype.library, scene.limbs, classes, species);
            const Grower grower = Grower::make(species).value();
            GrowScratch scratch;
            KinSimulation simulation(scene.limbs, classes, scene.draws, scene.anchors);
            SimulatedTree tree;
            Mean simulated[3];
            Mean grown[3];
            constexpr std::uint64_t kSeeds = 4000;
            for (std::uint64_t seed = 0; seed < kSeeds; ++seed)
            {
                simulation.grow(Seed{seed}, classes.weight, 1u << 20, tree);
                simulated[0].add(tree.segments);
                simulated[1].add(tree.depth);
                simulated[2].add(tree.shape.size());
                const GrowthSample sample = grower.sample(Seed{seed}, 0, {}, scratch).value();
                grown[0].add(sample.segments);
                grown[1].add(sample.depth);
                grown[2].add(sample.instances);
            }
            for (int i = 0; i < 3; ++i)
                EXPECT_NEAR(simulated[i].mean(), grown[i].mean(),
                            5 * std::hypot(simulated[i].error(), grown[i].error()) + 1e-9)
                    << "level " << level << ", measure " << i;
        }
    }
}

TEST(KinSimulation, CountsThePqGramsOfTheShape)
{
    const Scene scene(samples::randomArchetype(Seed{8}, 300));
    for (const KinLevel& level : kinLevels())
    {
        const KinClasses classes = classify(scene.limbs, level, scene.segments);
        KinSimulation shapes(scene.limbs, classes, scene.draws, scene.anchors);
        KinSimulation grams(scene.limbs, classes, scene.draws, scene.anchors, TreeRecord::Outline);
        SimulatedTree tree;
        SimulatedTree counted;
        for (std::uint64_t seed = 0; seed < 20; ++seed)
        {
            shapes.grow(Seed{seed}, 0.5, 1000, tree);
            grams.grow(Seed{seed}, 0.5, 1000, counted);
            EXPECT_EQ(counted.topology, tree.topology);
            EXPECT_EQ(counted.whole, tree.whole);
            EXPECT_EQ(counted.shape.labels, tree.shape.labels); // nothing is settled
            const PqGrams expected = tree.whole ? pqGramsOf(tree.shape) : PqGrams{};
            EXPECT_EQ(counted.grams.total, expected.total);
            EXPECT_EQ(pqGramDistance(counted.grams, expected), 0);
        }
    }
}

TEST(KinSimulation, SettledLimbsStandAsDrawn)
{
    const Scene scene(samples::grownArchetype(Seed{2}, 2000, samples::Repetition::Distinct));
    const KinClasses classes = classify(scene.limbs, kinLevels()[0], scene.segments);
    KinSimulation all(scene.limbs, classes, scene.draws, scene.anchors, TreeRecord::Shape, scene.segments);
    KinSimulation few(scene.limbs, classes, scene.draws, scene.anchors, TreeRecord::Shape, scene.segments / 20);
    KinSimulation none(scene.limbs, classes, scene.draws, scene.anchors);
    SimulatedTree drawn;
    SimulatedTree tree;
    none.drawn(0, drawn);
    all.grow(Seed{1}, 1, 1u << 20, tree);
    EXPECT_EQ(tree.topology, drawn.topology); // the whole tree is its own only kin
    Mean size;
    for (std::uint64_t seed = 0; seed < 2000; ++seed)
    {
        few.grow(Seed{seed}, 0.5, 1u << 20, tree);
        EXPECT_NE(tree.topology, drawn.topology);
        size.add(tree.segments);
    }
    EXPECT_NEAR(size.mean(), scene.segments, 5 * size.error()); // each drawn limb is expected once all the same
}

TEST(KinTopology, IsWhatTheGrowerOfTheDrawnTreeFinds)
{
    for (const Archetype& archetype :
         {samples::thesis(), samples::bush(), samples::randomArchetype(Seed{3}, 200, 4), samples::chain(3),
          samples::grownArchetype(Seed{3}, 2000, samples::Repetition::Copied)})
    {
        const Scene scene(archetype);
        for (const KinLevel& level : kinLevels())
        {
            KinClasses classes = classify(scene.limbs, level, scene.segments);
            classes.weight = 0.4;
            runAlikeLimbs(scene.limbs, classes);
            Species species;
            const std::vector<KinRule> rules = writeKinGrammar(archetype.library, scene.limbs, classes, species);
            species.provenance.exemplars = static_cast<std::uint32_t>(scene.limbs.roots.size());
            GrowScratch scratch;
            for (std::uint32_t tree = 0; tree < species.provenance.exemplars; ++tree)
                EXPECT_EQ(drawnTopology(species, rules, tree),
                          Grower::makeExemplar(species, tree)->sample(Seed{}, 0, {}, scratch)->topology);
        }
    }
}

TEST(KinSimulation, LeavesOffWhatGrowsTooLarge)
{
    const Scene scene(samples::randomArchetype(Seed{8}, 500));
    const KinClasses classes = classify(scene.limbs, kinLevels()[0], scene.segments);
    KinSimulation simulation(scene.limbs, classes, scene.draws, scene.anchors);
    SimulatedTree tree;
    simulation.grow(Seed{1}, 0, 100, tree);
    EXPECT_FALSE(tree.whole);
    EXPECT_LT(tree.shape.size(), 500u);
    simulation.grow(Seed{1}, 0, static_cast<std::uint32_t>(scene.segments), tree);
    EXPECT_TRUE(tree.whole);
}

} // namespace
} // namespace espalier
