#include <Espalier/Species/Grow.h>

#include <Allocations.h>
#include <Espalier/Inference/Inference.h>
#include <Espalier/Plant/Measure.h>
#include <Inference/SampleArchetypes.h>
#include <cstdlib>
#include <gtest/gtest.h>
#include <new>
#include <thread>

namespace espalier::allocations {

std::atomic<std::uint64_t> count{0};
std::atomic<std::uint64_t> bytes{0};

} // namespace espalier::allocations

#if ESPALIER_COUNTS_ALLOCATIONS
[[gnu::noinline]] void* operator new(std::size_t size)
{
    ++espalier::allocations::count;
    espalier::allocations::bytes += size;
    if (void* const memory = std::malloc(size == 0 ? 1 : size))
        return memory;
    std::abort();
}

[[gnu::noinline]] void operator delete(void* memory) noexcept
{
    std::free(memory);
}

[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept
{
    std::free(memory);
}
#endif

namespace espalier {

namespace {

Species speciesOf(const std::string& grammarLines, const std::string& more = {})
{
    const auto species = parseSpecies(
        "{\"espalier\": \"species\", \"version\": 1, \"grammar\": [" + grammarLines + "]" + more + "}", "test");
    if (!species)
        ADD_FAILURE() << toString(species.error());
    return species.value();
}

/// A limb bears two, one or none.
Species bushy(const std::string& more = {})
{
    return speciesOf(
        R"("axiom: A", "A -> F(s)[+(b)A][-(b)A] : 1 : ~ t", "A -> F(s)/(o)A : 1 : ~ t", "A -> F(s) : 1 : ~ t")",
        R"(, "tables": {"t": {"spread": [0.1, 5, 5, 5], "rows": [[1, 0, 30, 90], [0.5, 10, 45, 0]]}})" + more);
}

Species inferred(const Archetype& archetype, const InferenceOptions& options = {})
{
    return inferSpecies({&archetype, 1}, options).value();
}

Skeleton grown(const Grower& grower, Seed seed, const GrowOptions& options, GrowScratch& scratch)
{
    Skeleton skeleton;
    const auto done = grower.grow(seed, options, scratch, skeleton);
    EXPECT_TRUE(done) << toString(done.error());
    return skeleton;
}

} // namespace

TEST(Grow, GivesNothingWhenNothingIsDrawn)
{
    EXPECT_TRUE(grow(speciesOf(R"("axiom: A", "A -> B")"), Seed{1})->empty());
    EXPECT_TRUE(grow(speciesOf(R"("axiom:")"), Seed{1})->empty());
}

TEST(Grow, LeavesNoSkeletonWhenItFails)
{
    const auto grower = Grower::make(speciesOf(R"-("axiom: F A(1)", "A(x) -> F(1/(x - 1)) F")-")).value();
    GrowScratch scratch;
    Skeleton skeleton = grow(bushy(), Seed{3}).value();
    const auto done = grower.grow(Seed{1}, {}, scratch, skeleton);
    ASSERT_FALSE(done);
    EXPECT_EQ(done.error().kind, ErrorKind::BadInput);
    EXPECT_TRUE(skeleton.empty());
    EXPECT_EQ(skeleton, Skeleton{});

    GrowOptions few;
    few.limits.nodes = 3;
    EXPECT_EQ(grow(speciesOf(R"("axiom: FFFF")"), Seed{1}, few).error().kind, ErrorKind::Limit);
    EXPECT_EQ(grow(speciesOf(R"("axiom: FFF")"), Seed{1}, few)->size(), 3u);
}

TEST(Grow, IsAFunctionOfSpeciesAndSeed)
{
    const Species species = inferred(samples::thesis());
    const Grower grower = Grower::make(species).value();
    GrowScratch used;
    Skeleton reused;
    for (const std::uint64_t seed : {std::uint64_t{0}, std::uint64_t{1}, std::uint64_t{42}, ~std::uint64_t{0}})
    {
        ASSERT_TRUE(grower.grow(Seed{seed}, {}, used, reused));
        EXPECT_TRUE(isSound(reused));
        EXPECT_EQ(reused, grow(species, Seed{seed}).value()) << "seed " << seed;
    }
    EXPECT_FALSE(grow(species, Seed{0}).value() == grow(species, Seed{~std::uint64_t{0}}).value());
}

TEST(Grow, GivesTheSameFromManyThreads)
{
    constexpr std::uint64_t kSeeds = 40;
    const Grower grower = Grower::make(inferred(samples::thesis())).value();
    std::vector<std::uint64_t> expected;
    GrowScratch scratch;
    for (std::uint64_t seed = 0; seed < kSeeds; ++seed)
        expected.push_back(hashOf(grown(grower, Seed{seed}, {}, scratch)));
    std::vector<std::thread> threads;
    std::atomic<std::uint32_t> different{0};
    for (std::uint64_t first = 0; first < 8; ++first)
        threads.emplace_back([&, first] {
            GrowScratch own;
            Skeleton skeleton;
            for (std::uint64_t i = 0; i < kSeeds; ++i)
            {
                const std::uint64_t seed = (i + 5 * first) % kSeeds;
                if (!grower.grow(Seed{seed}, {}, own, skeleton) || hashOf(skeleton) != expected[seed])
                    ++different;
            }
        });
    for (std::thread& thread : threads)
        thread.join();
    EXPECT_EQ(different, 0u);
}

TEST(Grow, AllocatesNothingOnceWarm)
{
    if (!ESPALIER_COUNTS_ALLOCATIONS)
        GTEST_SKIP() << "under sanitizers allocations are not counted";
    const Grower grower = Grower::make(inferred(samples::thesis())).value();
    GrowScratch scratch;
    Skeleton skeleton;
    const auto growAll = [&] {
        for (std::uint64_t seed = 0; seed < 100; ++seed)
            if (!grower.grow(Seed{seed}, {}, scratch, skeleton))
                ADD_FAILURE() << "seed " << seed;
    };
    growAll();
    const std::uint64_t before = allocations::count;
    growAll();
    EXPECT_EQ(allocations::count, before);
}

TEST(Grow, CompletesATreeWhoseBudgetIsSpent)
{
    // Twice as many limbs with each generation, for ever, were it not for the budget.
    const Species endless = speciesOf(R"("axiom: A", "A -> F[+A][-A] : 1", "A -> F[-F] : 0.001")");
    for (const std::uint32_t productions : {0u, 1u, 10u, 1000u})
    {
        GrowOptions options;
        options.budget.productions = productions;
        options.budget.depth = 30;
        const auto skeleton = grow(endless, Seed{1}, options);
        ASSERT_TRUE(skeleton) << toString(skeleton.error());
        const SkeletonFacts facts = measure(*skeleton);
        EXPECT_GE(facts.segments, productions);
        EXPECT_LE(facts.segments, 2 * (2 * productions + 1));
        EXPECT_GT(facts.tips, 0u);
    }
    GrowOptions shallow;
    shallow.budget.depth = 3;
    EXPECT_LE(measure(grow(endless, Seed{1}, shallow).value()).maxDepth, 6u);
}

TEST(Grow, AnOnlookerIsToldWhatIsDrawnAndStopsNothing)
{
    class Counter final : public DerivationSink
    {
    public:
        std::uint32_t begun = 0;
        std::uint32_t ended = 0;

        bool modules(std::span<const LetterId>, std::span<const double>) override { return false; }
        void beginInstance(std::uint32_t, std::uint32_t) override { ++begun; }
        void endInstance() override { ++ended; }
    };
    const Species species = inferred(samples::thesis());
    const Grower grower = Grower::make(species).value();
    GrowScratch scratch;
    Skeleton skeleton;
    for (std::uint64_t seed = 1; seed <= 20; ++seed)
    {
        Counter onlooker;
        ASSERT_TRUE(grower.grow(Seed{seed}, {}, scratch, skeleton, &onlooker));
        EXPECT_EQ(onlooker.begun, measure(skeleton).instances);
        EXPECT_EQ(onlooker.ended, onlooker.begun);
        EXPECT_EQ(skeleton.ends, grown(grower, Seed{seed}, {}, scratch).ends);
    }
}

TEST(Grow, TakesTheAttemptItIsTold)
{
    const Grower grower = Grower::make(inferred(samples::thesis())).value();
    GrowScratch scratch;
    GrowOptions pinned;
    for (std::uint64_t seed = 0; seed < 50; ++seed)
    {
        pinned.attempt.reset();
        const auto accepted = grower.acceptedAttempt(Seed{seed}, pinned, scratch);
        ASSERT_TRUE(accepted);
        const Skeleton free = grown(grower, Seed{seed}, pinned, scratch);
        pinned.attempt = *accepted;
        EXPECT_EQ(grown(grower, Seed{seed}, pinned, scratch), free) << "seed " << seed;
        pinned.attempt = *accepted + 1;
        EXPECT_EQ(grower.acceptedAttempt(Seed{seed}, pinned, scratch).value(), *accepted + 1);
        EXPECT_FALSE(grown(grower, Seed{seed}, pinned, scratch) == free) << "seed " << seed;
    }
}

TEST(Grow, AnEditLeavesWhatDoesNotUseItWhereTheAttemptIsPinned)
{
    const Species species = inferred(samples::thesis());
    const Grower grower = Grower::make(species).value();
    GrowScratch scratch;
    const auto untouched = [](const Skeleton& skeleton, std::uint32_t edited) {
        std::vector<std::uint8_t> uses; // of each instance: it or one that carries it is of the edited rule
        for (const SkeletonInstance& record : skeleton.instanceRecords)
            uses.push_back(record.production == edited || (record.parent != kNoSegment && uses[record.parent] != 0));
        std::vector<std::pair<Vec3, Vec3>> segments;
        for (std::uint32_t i = 0; i < skeleton.size(); ++i)
            if (uses[skeleton.instances[i]] == 0)
                segments.emplace_back(skeleton.starts[i], skeleton.ends[i]);
        return segments;
    };
    std::uint32_t compared = 0;
    for (std::uint32_t rule = 0; rule < species.grammar.productions.size(); ++rule)
    {
        if (species.grammar.productions[rule].table.empty())
            continue;
        Species edited = species;
        Grammar& grammar = edited.grammar;
        Production& production = grammar.productions[rule];
        grammar.append(production.successor, grammar.symbols.intern("F")); // its branch ends otherwise
        const Grower other = Grower::make(edited).value();
        for (std::uint64_t seed = 1; seed <= 10; ++seed)
        {
            GrowOptions pinned;
            pinned.attempt = grower.acceptedAttempt(Seed{seed}, {}, scratch).value();
            const Skeleton before = grown(grower, Seed{seed}, pinned, scratch);
            const Skeleton after = grown(other, Seed{seed}, pinned, scratch);
            const auto kept = untouched(before, rule);
            EXPECT_EQ(kept, untouched(after, rule)) << "rule " << rule << ", seed " << seed;
            compared += !kept.empty() && before.size() != after.size() ? 1 : 0;
        }
    }
    EXPECT_GT(compared, 20u) << "edits that some trees use";
}

TEST(Grow, CountsWhatItWouldDraw)
{
    const Grower grower = Grower::make(bushy()).value();
    GrowScratch scratch;
    GrowOptions options;
    for (std::uint32_t attempt = 0; attempt < 100; ++attempt)
    {
        options.attempt = attempt;
        const auto sample = grower.sample(Seed{7}, attempt, options, scratch).value();
        const Skeleton skeleton = grown(grower, Seed{7}, options, scratch);
        EXPECT_TRUE(sample.whole);
        EXPECT_EQ(sample.segments, skeleton.size());
        EXPECT_EQ(sample.instances, skeleton.instanceRecords.size());
        if (sample.segments > 3)
        {
            const auto cut = grower.sample(Seed{7}, attempt, options, scratch, 3).value();
            EXPECT_FALSE(cut.whole);
            EXPECT_EQ(cut.segments, 4u);
        }
    }
}

TEST(Grow, AGrammarAloneGrowsByItsStepsWithRadiiThatSuitIt)
{
    const auto grammar = [](const std::string& text) { return parseGrammar(text, "g.lsys", {}).value(); };
    const std::string rule = "axiom: F\nF -> F[+F]F[-F]F\n";
    GrowScratch scratch;
    Skeleton skeleton;
    ASSERT_TRUE(Grower::make(grammar(rule))->grow(Seed{1}, {}, scratch, skeleton));
    EXPECT_EQ(skeleton.size(), 1u) << "no steps unless something says how many";
    ASSERT_TRUE(Grower::make(grammar("iterations: 2\n" + rule))->grow(Seed{1}, {}, scratch, skeleton));
    EXPECT_EQ(skeleton.size(), 25u);
    ASSERT_TRUE(Grower::make(grammar("iterations: 2\n" + rule), 4)->grow(Seed{1}, {}, scratch, skeleton));
    EXPECT_EQ(skeleton.size(), 625u);
    const float height = skeleton.maxY - skeleton.minY;
    EXPECT_GT(skeleton.startRadii[0], 0.015f * height);
    EXPECT_LT(skeleton.startRadii[0], 0.05f * height);
    ASSERT_TRUE(Grower::make(grammar("axiom: !(0.25)F\n"))->grow(Seed{1}, {}, scratch, skeleton));
    EXPECT_EQ(skeleton.startRadii[0], 0.125f) << "it says so";
}

TEST(Grow, KeepsTheWindow)
{
    const Species species = bushy(R"(, "window": {"segments": [6, 30], "depth": [3, 8], "attempts": 1024})");
    const Grower grower = Grower::make(species).value();
    GrowScratch scratch;
    for (std::uint64_t seed = 0; seed < 500; ++seed)
    {
        const std::uint32_t attempt = grower.acceptedAttempt(Seed{seed}, {}, scratch).value();
        for (std::uint32_t earlier = 0; earlier <= attempt; ++earlier)
        {
            const auto sample = grower.sample(Seed{seed}, earlier, {}, scratch).value();
            const bool fits = sample.segments >= 6 && sample.segments <= 30 && sample.depth >= 3 && sample.depth <= 8;
            EXPECT_EQ(fits, earlier == attempt) << "seed " << seed << " attempt " << earlier;
        }
    }
}

TEST(Grow, GrowsNoCopyWhereThereIsAnythingElse)
{
    Species species = bushy(R"(, "window": {"segments": [3, 5], "attempts": 1024})");
    const Grower free = Grower::make(species).value();
    GrowScratch scratch;
    const auto topologyOf = [&](const Grower& grower, std::uint64_t seed) {
        return grower.sample(Seed{seed}, grower.acceptedAttempt(Seed{seed}, {}, scratch).value(), {}, scratch)
            .value()
            .topology;
    };
    const std::uint64_t forbidden = topologyOf(free, 1);
    species.window->copies = {forbidden};
    const Grower grower = Grower::make(species).value();
    for (std::uint64_t seed = 0; seed < 500; ++seed)
        EXPECT_NE(topologyOf(grower, seed), forbidden) << "seed " << seed;

    // One topology alone: better a copy than nothing.
    Species only = speciesOf(R"("axiom: F[+F]F")", R"(, "window": {"attempts": 4})");
    only.window->copies = {Grower::make(only)->sample(Seed{1}, 0, {}, scratch).value().topology};
    EXPECT_EQ(grow(only, Seed{1})->size(), 3u);
}

TEST(Grow, TakesTheNearestWhenNoneFits)
{
    const Species species = bushy(R"(, "window": {"segments": [40, 41], "attempts": 16})");
    const Grower grower = Grower::make(species).value();
    GrowScratch scratch;
    std::uint32_t missed = 0;
    for (std::uint64_t seed = 0; seed < 200; ++seed)
    {
        const auto excess = [&](std::uint32_t attempt) {
            const double segments = std::max(1u, grower.sample(Seed{seed}, attempt, {}, scratch).value().segments);
            return segments > 2 * 41 ? 1e300 : std::max({1.0, 40 / segments, segments / 41});
        };
        const std::uint32_t taken = grower.acceptedAttempt(Seed{seed}, {}, scratch).value();
        double least = excess(0);
        for (std::uint32_t attempt = 1; attempt < 16; ++attempt)
            least = std::min(least, excess(attempt));
        EXPECT_EQ(excess(taken), least) << "seed " << seed;
        missed += least > 1 ? 1 : 0;
    }
    EXPECT_GT(missed, 100u) << "the window was meant to be hard to hit";
}

} // namespace espalier
