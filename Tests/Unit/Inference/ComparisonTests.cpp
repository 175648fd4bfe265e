#include <Espalier/Inference/Comparison.h>
#include <Espalier/Inference/Inference.h>
#include <Inference/SampleArchetypes.h>
#include <cmath>
#include <gtest/gtest.h>

namespace espalier {
namespace {

Archetype read(const std::string& trees)
{
    return samples::read("shoot: F(2)X\nfork: F[-(30)F(1)X]F(1)Y\nbud: F(1)", trees);
}

/// A species that grows exactly `archetype`.
Species copyOf(const Archetype& archetype)
{
    return inferSpecies({&archetype, 1}, {.mergeWeight = 0.0}).value();
}

Comparison compared(const Archetype& drawn, const Species& species, std::uint32_t seeds = 4)
{
    auto comparison = compare({&drawn, 1}, species, {.seeds = seeds});
    EXPECT_TRUE(comparison) << toString(comparison.error());
    return comparison.value();
}

const char* const kTwoShoots = R"({"template":"shoot","children":{"X":{"template":"shoot"}}})";
const char* const kThreeShoots =
    R"({"template":"shoot","children":{"X":{"template":"shoot","children":{"X":{"template":"shoot"}}}}})";
const char* const kForkWithBud = R"({"template":"fork","children":{"X":{"template":"bud"}}})";

TEST(Comparison, ACopyDiffersInNothing)
{
    for (const Archetype& archetype : {samples::thesis(), read(kForkWithBud), samples::randomArchetype(Seed{5}, 60)})
    {
        const Comparison c = compared(archetype, copyOf(archetype));
        EXPECT_EQ(c.seeds, 4u);
        EXPECT_EQ(c.size.mean, c.size.exemplar);
        EXPECT_EQ(c.size.within, 1);
        EXPECT_EQ(c.size.tiny, 0);
        EXPECT_EQ(c.size.unfinished, 0);
        EXPECT_NEAR(c.anchorDivergence, 0, 1e-12);
        for (const ParameterComparison& p :
             {c.parameters.angle, c.parameters.length, c.parameters.width, c.parameters.azimuth})
            EXPECT_NEAR(p.distance, 0, 1e-6);
        EXPECT_EQ(c.depth.mean, c.depth.exemplar);
        EXPECT_EQ(c.depthHistogram, 0);
        EXPECT_EQ(c.strahlerWithin1, 1);
        EXPECT_EQ(c.bifurcation.mean, c.bifurcation.exemplar);
        EXPECT_EQ(c.editDistance.exemplarMedian, 0);
        EXPECT_EQ(c.editDistance.pairMedian, 0);
        EXPECT_EQ(c.distinct, 0.25);
        EXPECT_EQ(c.copies, 1);
        EXPECT_NEAR(c.crown.profile, 0, 1e-9);
        EXPECT_EQ(c.crown.height.mean, c.crown.height.exemplar);
    }
}

TEST(Comparison, MeasuresAChainAgainstALongerOneByHand)
{
    const Comparison c = compared(read(kTwoShoots), copyOf(read(kThreeShoots)));
    EXPECT_EQ(c.size.exemplar, 2);
    EXPECT_EQ(c.size.median, 3);
    EXPECT_EQ(c.size.within, 1);                // just 1.5 times
    EXPECT_EQ(c.anchorDivergence, 0);           // shoots on shoots in both
    EXPECT_EQ(c.parameters.length.distance, 0); // a spread of 0, and no difference
    EXPECT_EQ(c.depth.exemplar, 2);
    EXPECT_EQ(c.depth.mean, 3);
    EXPECT_NEAR(c.depthHistogram, 0.5, 1e-12); // {1, 2} to {1, 2, 3}: a third by 1 from 1, a sixth ... mean 1.5 to 2
    EXPECT_NEAR(c.editDistance.exemplarMedian, 1.0 / 5, 1e-12);
    EXPECT_EQ(c.copies, 0);
    EXPECT_EQ(c.crown.height.exemplar, 4);
    EXPECT_EQ(c.crown.height.mean, 6);
    // Metres by height: 2 + 2 in middles at 1 and 3, against 2 + 2 + 2 at 1, 3 and 5: a third goes up by 3 on average.
    EXPECT_NEAR(c.crown.profile, 1.0 / 4, 0.02);
    EXPECT_EQ(c.crown.width.mean, 0);
}

TEST(Comparison, TellsWhereOtherThingsHang)
{
    const Comparison c =
        compared(read(kForkWithBud), copyOf(read(R"({"template":"fork","children":{"Y":{"template":"bud"}}})")));
    EXPECT_NEAR(c.anchorDivergence, 1, 1e-12);   // no place in common
    EXPECT_EQ(c.editDistance.exemplarMedian, 0); // anchors are no labels
    EXPECT_EQ(c.copies, 0);
}

TEST(Comparison, ASpreadOfNothingIsNoExcuse)
{
    // Both branch once, at 30 and at 50 degrees: a distance of 20 over a spread of 0.
    const std::string steeper = R"({"template":"fork","children":{"X":{"template":"bud"}}})";
    Archetype other = read(steeper);
    for (TemplateModule& module : other.library.templates[1].modules)
        if (module.symbol == '-')
            module.number = 50;
    const Comparison c = compared(read(kForkWithBud), copyOf(other));
    EXPECT_EQ(c.parameters.angle.spread, 0);
    EXPECT_TRUE(std::isinf(c.parameters.angle.distance));
    EXPECT_EQ(c.parameters.azimuth.distance, 0);
}

TEST(Comparison, TakesTheNearestOfSeveralDrawnTrees)
{
    const Archetype drawn[] = {read(kTwoShoots), read(kForkWithBud)};
    const Comparison c = compare(drawn, copyOf(read(kForkWithBud)), {.seeds = 3}).value();
    EXPECT_EQ(c.exemplars, 2u);
    EXPECT_EQ(c.editDistance.exemplarMedian, 0);
    EXPECT_EQ(c.copies, 1);
    EXPECT_EQ(c.size.exemplar, 3); // (2 + 4) / 2
    EXPECT_GT(c.anchorDivergence, 0);
}

TEST(Comparison, DoesNotDependOnThreads)
{
    const Archetype archetype = samples::randomArchetype(Seed{5}, 60);
    const Species species = inferSpecies({&archetype, 1}).value();
    const auto with = [&](std::uint32_t threads) {
        return compare({&archetype, 1}, species, {.seeds = 150, .threads = threads}).value();
    };
    const Comparison one = with(1);
    for (const std::uint32_t threads : {2u, 3u, 7u})
    {
        const Comparison several = with(threads);
        EXPECT_EQ(several.exemplarDistances, one.exemplarDistances);
        EXPECT_EQ(several.pairDistances, one.pairDistances);
        EXPECT_EQ(several.grown.segments, one.grown.segments);
        EXPECT_EQ(several.grown.branches.azimuths, one.grown.branches.azimuths);
        EXPECT_EQ(several.grown.lengthByShare, one.grown.lengthByShare);
        EXPECT_EQ(several.distinct, one.distinct);
        EXPECT_EQ(several.anchorDivergence, one.anchorDivergence);
    }
}

TEST(Comparison, TakesEditDistancesOfAsManyTreesAsThereIsTimeFor)
{
    const Archetype archetype = samples::randomArchetype(Seed{5}, 60);
    const Species species = inferSpecies({&archetype, 1}).value();
    const auto with = [&](double steps, std::uint32_t every = 0) {
        return compare({&archetype, 1}, species, {.seeds = 200, .editSteps = steps, .editEvery = every}).value();
    };
    const Comparison all = with(1e9);
    EXPECT_EQ(all.editDistance.pairs, 200u);
    EXPECT_EQ(all.pairDistances.size(), 199u); // the first has none before it
    EXPECT_FALSE(all.editDistance.estimated);

    const Comparison few = with(0, 9);
    EXPECT_EQ(few.editDistance.pairs, 20u); // of ten one, each with the one before it
    ASSERT_EQ(few.pairDistances.size(), 20u);
    for (std::size_t i = 0; i < 20; ++i)
    {
        EXPECT_EQ(few.exemplarDistances[i], all.exemplarDistances[10 * i + 9]);
        EXPECT_EQ(few.pairDistances[i], all.pairDistances[10 * i + 8]);
    }

    const Comparison none = with(1);
    EXPECT_TRUE(none.editDistance.estimated);
    EXPECT_EQ(none.editDistance.pairs, 200u);
}

TEST(Comparison, ItsBarsHoldWhereTheyShould)
{
    Comparison c = compared(read(kForkWithBud), copyOf(read(kForkWithBud)));
    const auto holding = [&](std::string_view measure) {
        for (const Bar& bar : barsOf(c))
            if (bar.measure.starts_with(measure))
                return bar.holds();
        ADD_FAILURE() << measure;
        return false;
    };
    EXPECT_TRUE(holding("divergence"));
    EXPECT_FALSE(holding("exact copies"));
    EXPECT_FALSE(holding("edit distance between trees"));
    c.parameters.angle.distance = 0.12;
    EXPECT_TRUE(holding("branching angles")); // 2 instances: 0.15
    c.exemplarInstances = 25;
    EXPECT_FALSE(holding("branching angles"));
    c.size.tiny = 1e-9;
    EXPECT_FALSE(holding("trees under 10 %"));
}

TEST(Comparison, SaysWhatItCannotCompare)
{
    const Archetype archetype = read(kTwoShoots);
    EXPECT_FALSE(compare({}, copyOf(archetype)));
    EXPECT_FALSE(compare({&archetype, 1}, copyOf(archetype), {.seeds = 1}));
    Species plain;
    plain.grammar = parseGrammar("axiom: F", "plain", {}).value();
    const auto refused = compare({&archetype, 1}, plain);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().kind, ErrorKind::BadInput);
    std::atomic<bool> stop{true};
    Progress progress;
    progress.cancelled = &stop;
    EXPECT_EQ(compare({&archetype, 1}, copyOf(archetype), {.progress = progress}).error().kind, ErrorKind::Cancelled);
}

TEST(Comparison, RelativesOfTheThesisTreeAreNeitherCopiesNorStrangers)
{
    const Archetype archetype = samples::thesis();
    const Comparison c = compared(archetype, inferSpecies({&archetype, 1}).value(), 2000);
    for (const Bar& bar : barsOf(c))
    {
        if (bar.measure.starts_with("crown"))
            continue; // its relatives droop
        EXPECT_TRUE(bar.holds()) << bar.measure << ": " << bar.value;
    }
}

} // namespace
} // namespace espalier
