#include <Espalier/Archetype/Placement.h>
#include <Espalier/Inference/Inference.h>
#include <Espalier/Inference/KinGrammar.h>
#include <Espalier/Plant/Measure.h>
#include <Espalier/Species/Grow.h>
#include <Inference/SampleArchetypes.h>
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <set>

namespace espalier {

namespace {

Species inferred(const Archetype& archetype, const InferenceOptions& options = {})
{
    auto species = inferSpecies({&archetype, 1}, options);
    if (!species)
        ADD_FAILURE() << toString(species.error());
    return species.value();
}

/// The grammar of one choice, without trials and without a window.
Species speciesOf(const Archetype& archetype, const KinLevel& level, double weight)
{
    const LimbTable limbs = shareLimbs(archetype, anchorsOf(archetype), segmentsDrawn(archetype.library));
    double segments = 0;
    for (const LimbUse& root : limbs.roots)
        segments += limbs.limbs[root.limb].segments;
    KinClasses classes = classify(limbs, level, segments / static_cast<double>(limbs.roots.size()));
    classes.weight = weight;
    runAlikeLimbs(limbs, classes);
    Species species;
    writeKinGrammar(archetype.library, limbs, classes, species);
    return species;
}

/// A skeleton without what says where its segments came from: growing names productions, drawing instances.
Skeleton anonymous(Skeleton skeleton)
{
    for (SkeletonInstance& record : skeleton.instanceRecords)
        record.production = record.row = 0;
    return skeleton;
}

std::vector<Skeleton> drawn(const Archetype& archetype, const PipeModel& pipes)
{
    std::vector<Skeleton> trees;
    for (std::size_t tree = 0; tree < anchorsOf(archetype).roots.size(); ++tree)
    {
        trees.push_back(drawArchetype(archetype, tree).value());
        completeAxes(trees.back(), pipes);
        trees.back() = anonymous(std::move(trees.back()));
    }
    return trees;
}

} // namespace

TEST(Kin, GivesTheArchetypeBackAtWeightZero)
{
    const auto expectBack = [](const Archetype& archetype, const std::string& which,
                               std::optional<double> ruleWeight = {}) {
        const Species species = inferred(archetype, {.mergeWeight = 0.0, .ruleWeight = ruleWeight});
        const std::vector<Skeleton> trees = drawn(archetype, species.appearance.pipes);
        for (const std::uint64_t seed : {std::uint64_t{0}, std::uint64_t{1}, std::uint64_t{2}, ~std::uint64_t{0}})
        {
            const Skeleton grown = anonymous(grow(species, Seed{seed}).value());
            EXPECT_NE(std::ranges::find(trees, grown), trees.end()) << which << ", seed " << seed;
        }
    };
    expectBack(samples::thesis(), "the thesis' tree");
    expectBack(samples::bush(), "the bush");
    for (std::uint32_t seed = 0; seed < 12; ++seed)
        expectBack(samples::randomArchetype(Seed{seed}, seed < 3 ? seed + 1 : 27 * seed, 1 + seed % 3),
                   "archetype " + std::to_string(seed), seed / 11.0);
}

TEST(Kin, CountsArchetypesAsOftenAsTheirWeightsSay)
{
    const std::string templates = "stem: FX\nleaf: F(0.2)\n";
    const auto stem = [&](const char* scaling) {
        return samples::read(templates, std::string(R"({"template": "stem", "children": {"X": {"template": "leaf",
                                        "scaling": )") +
                                            scaling + "}}}");
    };
    const std::vector<Archetype> archetypes{stem("1"), stem("2")};
    const auto weighted = [&](std::vector<std::uint32_t> weights, double mergeWeight) {
        return inferSpecies(archetypes, {.mergeWeight = mergeWeight, .ruleWeight = 1.0, .weights = std::move(weights)});
    };
    const Species species = weighted({3, 1}, 0.5).value();
    const std::string grammar = printGrammar(species.grammar);
    EXPECT_NE(grammar.find("Tree -> Stem(0) : 3\nTree -> Stem(1) : 1\n"), std::string::npos) << grammar;
    EXPECT_NE(grammar.find("(i==0)*(1-w)+w*3/4 : ~ leaf(0)"), std::string::npos) << grammar;
    EXPECT_NE(grammar.find("(i==1)*(1-w)+w/4 : ~ leaf(1)"), std::string::npos) << grammar;
    for (const RuleOrigin& rule : species.rules)
        EXPECT_EQ(rule.count, 1u) << "as often as it was drawn";
    EXPECT_EQ(species.provenance.weights, (std::vector<std::uint32_t>{3, 1}));
    EXPECT_EQ(parseSpecies(printSpecies(species), "test").value(), species);

    // Three in four trees are of the first kind, and so are three in four leaves.
    for (const double mergeWeight : {0.0, 1.0})
    {
        const Grower grower = Grower::make(weighted({3, 1}, mergeWeight).value()).value();
        GrowScratch scratch;
        Skeleton skeleton;
        double first = 0;
        for (std::uint64_t seed = 0; seed < 4000; ++seed)
        {
            ASSERT_TRUE(grower.grow(Seed{seed}, {.attempt = 0}, scratch, skeleton));
            first += skeleton.lengths[1] < 0.3f ? 1 : 0;
        }
        EXPECT_NEAR(first / 4000, 0.75, 0.03) << mergeWeight;
    }
    // What is drawn stays so.
    for (std::uint32_t tree = 0; tree < 2; ++tree)
    {
        Skeleton skeleton;
        GrowScratch scratch;
        ASSERT_TRUE(Grower::makeExemplar(species, tree)->grow(Seed{}, {}, scratch, skeleton));
        EXPECT_EQ(skeleton.ends, drawArchetype(archetypes[tree])->ends);
    }

    EXPECT_EQ(printSpecies(weighted({7, 7}, 0.5).value()), printSpecies(weighted({}, 0.5).value()));
    for (const std::vector<std::uint32_t>& wrong : {std::vector<std::uint32_t>{1}, {0, 1}, {1, 1001}, {1, 1, 1}})
        EXPECT_EQ(weighted(wrong, 0.5).error().kind, ErrorKind::BadInput);
    EXPECT_FALSE(inferSpecies(archetypes, {.preset = "helberg", .weights = {3, 1}}));
}

TEST(Kin, MovesParametersByTheJitter)
{
    const auto jittered = [](double jitter) {
        return inferred(samples::bush(), {.mergeWeight = 0.5, .ruleWeight = 0.5, .jitter = jitter});
    };
    const Species usual = inferred(samples::bush(), {.mergeWeight = 0.5, .ruleWeight = 0.5});
    EXPECT_EQ(printSpecies(jittered(kUsualJitter)), printSpecies(usual));
    EXPECT_EQ(printSpecies(usual).find("jitter"), std::string::npos);
    const Species exact = jittered(0);
    const Species wide = jittered(0.3);
    ASSERT_EQ(usual.tables.size(), wide.tables.size());
    bool anyMoves = false;
    for (std::size_t t = 0; t < usual.tables.size(); ++t)
        for (std::size_t i = 0; i < 4; ++i)
        {
            EXPECT_EQ(exact.tables[t].spread[i], 0);
            constexpr double kUpright = 60; // degrees; a roll that soon reaches them
            const double spread = usual.tables[t].spread[i];
            EXPECT_NEAR(wide.tables[t].spread[i], i == 3 && spread >= kUpright ? spread : 3 * spread, 2e-4)
                << "rounded to four decimals";
            anyMoves = anyMoves || usual.tables[t].spread[i] > 0;
        }
    EXPECT_TRUE(anyMoves);
    EXPECT_EQ(parseSpecies(printSpecies(wide), "test").value(), wide);
    EXPECT_EQ(wide.provenance.jitter, 0.3);

    // Without it every length is one that was drawn.
    std::set<float> lengths;
    for (const Skeleton& tree : drawn(samples::bush(), {}))
        lengths.insert(tree.lengths.begin(), tree.lengths.end());
    for (std::uint64_t seed = 0; seed < 20; ++seed)
    {
        const Skeleton grown = grow(exact, Seed{seed}).value();
        for (const float length : grown.lengths)
            EXPECT_TRUE(lengths.contains(length)) << length;
    }

    const Archetype bush = samples::bush();
    for (const double jitter : {-0.1, 1.1, std::nan("")})
        EXPECT_EQ(inferSpecies({&bush, 1}, {.jitter = jitter}).error().kind, ErrorKind::BadInput) << jitter;
    EXPECT_FALSE(inferSpecies({&bush, 1}, {.preset = "helberg", .jitter = 0.2}));
}

TEST(Kin, TurnsTheBoughsOfAnUprightTrunkAllRound)
{
    // Pieces of a trunk that bear a bough each, each turned by some degrees from the last.
    const auto trunk = [](double roll) {
        std::string tree = R"({"template": "bough"})";
        for (int i = 0; i < 12; ++i)
            tree = R"({"template": "stem", "roll": )" + std::to_string(i % 2 == 0 ? 0.0 : roll) +
                   R"(, "children": {"A": {"template": "bough"}, "Z": )" + tree + "}}";
        return samples::read("stem: F[-(60)A]FZ\nbough: FF\n", tree);
    };
    const auto boughsOf = [](const Archetype& archetype, double mergeWeight) {
        std::set<int> eighths;
        const Species species = inferred(archetype, {.mergeWeight = mergeWeight});
        GrowScratch scratch;
        Skeleton tree;
        for (std::uint64_t seed = 1; seed <= 20; ++seed)
        {
            EXPECT_TRUE(Grower::make(species)->grow(Seed{seed}, {}, scratch, tree));
            for (std::uint32_t i = 0; i < tree.size(); ++i)
                if (const Vec3 heading = tree.headings[i]; std::abs(heading.y) < 0.9f)
                {
                    EXPECT_NEAR(heading.y, 0.5, 1e-5); // as high as ever
                    eighths.insert(static_cast<int>(std::floor(std::atan2(heading.z, heading.x) / 0.7854)));
                }
        }
        return eighths.size();
    };
    EXPECT_EQ(boughsOf(trunk(10), 0.5), 8u);
    EXPECT_EQ(boughsOf(trunk(0), 0.5), 1u) << "a planar tree stays one";
    EXPECT_LE(boughsOf(trunk(10), 0), 3u);
}

TEST(Kin, RollsNoFurtherWhatWasRolledAlikeOrLiesInAPlane)
{
    for (const auto& [first, second] : {std::pair(30.0, 30.0), std::pair(137.5, 137.5), std::pair(0.0, 180.0)})
    {
        std::string tree = R"({"template": "bough"})";
        for (int i = 0; i < 12; ++i)
            tree = R"({"template": "stem", "roll": )" + std::to_string(i % 2 == 0 ? first : second) +
                   R"(, "children": {"A": {"template": "bough"}, "Z": )" + tree + "}}";
        const Species species = inferred(samples::read("stem: F[-(60)A]FZ\nbough: FF\n", tree), {.mergeWeight = 0.5});
        const auto stem = std::ranges::find(species.tables, "stem", &TransformTable::name);
        ASSERT_NE(stem, species.tables.end());
        // 0 and 180 vary by 90 degrees, of which a twentieth is the usual jitter.
        EXPECT_LT(stem->spread[3], 7) << first << ", " << second;
    }
}

TEST(Kin, LosesNoneOfSeveralDrawnTreesThatHaveLittleInCommon)
{
    // Of the small one nothing has kin in the finest classes, and copies are refused.
    const std::vector<Archetype> drawn{samples::grownArchetype(Seed{4}, 400, samples::Repetition::Distinct),
                                       samples::thesis()};
    const Species species = inferSpecies(drawn).value();
    int small = 0;
    for (std::uint64_t seed = 1; seed <= 100; ++seed)
        small += grow(species, Seed{seed})->size() < 150;
    EXPECT_NEAR(small, 50, 20);
}

TEST(Kin, GrowsEachOfSeveralDrawnTrees)
{
    Archetype archetype = samples::thesis();
    const std::size_t count = archetype.instances.size();
    for (std::uint32_t tree = 1; tree < 3; ++tree)
        for (std::size_t i = 0; i < count; ++i)
        {
            TemplateInstance instance = archetype.instances[i];
            instance.transform.branchingAngle += tree;
            if (instance.parent != kNoInstance)
                instance.parent += static_cast<std::uint32_t>(tree * count);
            archetype.instances.push_back(instance);
        }
    const Species species = inferred(archetype, {.mergeWeight = 0.0});
    const std::vector<Skeleton> trees = drawn(archetype, species.appearance.pipes);
    std::vector<std::uint32_t> met(trees.size(), 0);
    for (std::uint64_t seed = 0; seed < 60; ++seed)
    {
        const auto tree = std::ranges::find(trees, anonymous(grow(species, Seed{seed}).value()));
        ASSERT_NE(tree, trees.end()) << "seed " << seed;
        ++met[static_cast<std::size_t>(tree - trees.begin())];
    }
    for (const std::uint32_t times : met)
        EXPECT_GT(times, 8u);
}

TEST(Kin, HoldsTheDrawnTreesExactlyAtEveryWeight)
{
    for (std::uint32_t seed = 0; seed < 12; ++seed)
    {
        const Archetype archetype = seed == 0   ? samples::thesis()
                                    : seed == 1 ? samples::bush()
                                                : samples::randomArchetype(Seed{seed}, 15 * seed, 1 + seed % 3);
        const Species species =
            inferred(archetype, seed < 6 ? InferenceOptions{}
                                         : InferenceOptions{.mergeWeight = seed / 11.0, .ruleWeight = seed / 11.0});
        const std::vector<Skeleton> trees = drawn(archetype, species.appearance.pipes);
        ASSERT_EQ(species.provenance.exemplars, trees.size());
        for (std::uint32_t tree = 0; tree < trees.size(); ++tree)
        {
            const Grower grower = Grower::makeExemplar(species, tree).value();
            GrowScratch scratch;
            Skeleton grown;
            ASSERT_TRUE(grower.grow(Seed{seed}, {}, scratch, grown));
            EXPECT_EQ(anonymous(grown), trees[tree]) << "archetype " << seed << ", tree " << tree;
        }
        EXPECT_FALSE(Grower::makeExemplar(species, static_cast<std::uint32_t>(trees.size())));
    }
    const Archetype thesis = samples::thesis();
    EXPECT_FALSE(Grower::makeExemplar(inferred(thesis, {.preset = "helberg"})));
    EXPECT_FALSE(Grower::makeExemplar(Species{}));
}

TEST(Kin, GrowsGraftedBranchesInTheDirectionOfTheirPlaces)
{
    // Four branches of one class that differ by what they carry, each at a place with a direction of its own.
    const Archetype archetype = samples::read("trunk: F[+(90)FA]F[+(90)FB]F[+(90)FC]F[+(90)FD]\nlimb: F[+FX]FY\ntip: F",
                                              R"({"template":"trunk","children":{
                          "A":{"template":"limb","rotation":10,"roll":0,"children":{"X":{"template":"tip"}}},
                          "B":{"template":"limb","rotation":-20,"roll":90,"children":{"Y":{"template":"tip"}}},
                          "C":{"template":"limb","rotation":30,"roll":180,"scaling":1.25,"children":{"X":{"template":"tip"}}},
                          "D":{"template":"limb","rotation":-40,"roll":270,"branchingAngle":20,"children":{"Y":{"template":"tip"}}}}})");
    Species species = speciesOf(archetype, kinLevels().back(), 1.0);
    for (TransformTable& table : species.tables)
        table.spread = {}; // the directions themselves
    const Skeleton skeleton = drawArchetype(archetype).value();
    // Heading and left of the first segments of the limbs, in the order of their places.
    const auto directions = [](const Skeleton& tree) {
        std::vector<Vec3> found;
        std::uint32_t last = 0;
        for (std::size_t i = 0; i < tree.size(); ++i)
            if (tree.instances[i] != last && tree.instanceRecords[tree.instances[i]].parent == 0)
            {
                last = tree.instances[i];
                found.push_back(tree.headings[i]);
                found.push_back(tree.lefts[i]);
            }
        return found;
    };
    ASSERT_EQ(directions(skeleton).size(), 8u);
    std::set<std::vector<float>> shapes;
    for (std::uint64_t seed = 0; seed < 50; ++seed)
    {
        const Skeleton grown = grow(species, Seed{seed}).value();
        EXPECT_EQ(directions(grown), directions(skeleton)) << "seed " << seed;
        shapes.insert(grown.lengths);
    }
    EXPECT_GT(shapes.size(), 1u);
}

TEST(Kin, ExpectsEachDrawnInstanceOnceAtEveryWeightAndLevel)
{
    struct Case
    {
        std::string name;
        Archetype archetype;
        std::uint32_t seeds;
    };
    const Case cases[] = {{"thesis", samples::thesis(), 5000},
                          {"random 30", samples::randomArchetype(Seed{3}, 30), 1500},
                          {"random 2 x 40", samples::randomArchetype(Seed{4}, 40, 2), 1500}};
    for (const Case& c : cases)
    {
        double exemplar = 0;
        const std::vector<Skeleton> trees = drawn(c.archetype, {});
        for (const Skeleton& tree : trees)
            exemplar += tree.size() / static_cast<double>(trees.size());
        for (std::size_t level = 0; level < kinLevels().size(); ++level)
            for (const double weight : {0.3, 0.7, 1.0})
            {
                const Grower grower = Grower::make(speciesOf(c.archetype, kinLevels()[level], weight)).value();
                GrowScratch scratch;
                double sum = 0;
                double squares = 0;
                for (std::uint64_t seed = 0; seed < c.seeds; ++seed)
                {
                    const double segments = grower.sample(Seed{seed}, 0, {}, scratch).value().segments;
                    sum += segments;
                    squares += segments * segments;
                }
                const double mean = sum / c.seeds;
                const double error = std::sqrt((squares / c.seeds - mean * mean) / c.seeds);
                EXPECT_LE(std::abs(mean - exemplar), 5 * error + 1e-9)
                    << c.name << ", level " << level << ", w = " << weight << ": mean " << mean << " +- " << error
                    << ", drawn " << exemplar;
            }
    }
}

TEST(Kin, GrowsTheSameFromItsGrammarsText)
{
    for (const double ruleWeight : {0.0, 1.0 / 3, 1.0})
    {
        const Species species = inferred(samples::bush(), {.mergeWeight = 0.7, .ruleWeight = ruleWeight});
        Species reread = species;
        const auto grammar = parseGrammar(printGrammar(species.grammar), "printed", {});
        ASSERT_TRUE(grammar) << toString(grammar.error());
        reread.grammar = *grammar;
        EXPECT_EQ(reread, species);
        for (std::uint64_t seed = 0; seed < 10; ++seed)
            EXPECT_EQ(grow(reread, Seed{seed}).value(), grow(species, Seed{seed}).value()) << "seed " << seed;
    }
}

TEST(Kin, GrowsRelativesOfTheThesisTree)
{
    constexpr std::uint32_t kSeeds = 2000;
    constexpr double kExemplar = 55;
    const Species species = inferred(samples::thesis());
    const Grower grower = Grower::make(species).value();
    GrowScratch scratch;
    Skeleton skeleton;
    double sum = 0;
    std::uint32_t within = 0;
    std::set<std::pair<std::uint32_t, double>> different;
    for (std::uint64_t seed = 0; seed < kSeeds; ++seed)
    {
        ASSERT_TRUE(grower.grow(Seed{seed}, {}, scratch, skeleton));
        const SkeletonFacts facts = measure(skeleton);
        EXPECT_GE(facts.segments, 0.1 * kExemplar) << "seed " << seed;
        sum += facts.segments;
        within += facts.segments >= 0.5 * kExemplar && facts.segments <= 1.5 * kExemplar ? 1 : 0;
        different.emplace(facts.segments, facts.totalLength);
    }
    EXPECT_NEAR(sum / kSeeds / kExemplar, 1, 0.15);
    EXPECT_GE(within, 0.75 * kSeeds);
    EXPECT_GE(static_cast<double>(different.size()), 0.6 * kSeeds);
    RecordProperty("mean", std::to_string(sum / kSeeds));
    RecordProperty("within", std::to_string(within));
    RecordProperty("different", std::to_string(different.size()));
}

TEST(Kin, InfersFromDeepChainsAndLargeTrees)
{
    for (const Archetype& archetype : {samples::chain(5000), samples::randomArchetype(Seed{1}, 20000)})
    {
        const Species species = inferred(archetype, {.mergeWeight = 0.0, .ruleWeight = 0.0});
        EXPECT_EQ(anonymous(grow(species, Seed{1}).value()), drawn(archetype, species.appearance.pipes)[0]);
    }
}

TEST(Kin, HoldsALargeDrawnTreeExactly)
{
    for (const auto repetition : {samples::Repetition::Copied, samples::Repetition::Distinct})
    {
        const Archetype archetype = samples::grownArchetype(Seed{5}, 20000, repetition);
        const Species species = inferred(archetype);
        EXPECT_GT(species.provenance.mergeWeight, 0);
        const Grower grower = Grower::makeExemplar(species).value();
        GrowScratch scratch;
        Skeleton grown;
        ASSERT_TRUE(grower.grow(Seed{}, {}, scratch, grown));
        EXPECT_EQ(anonymous(grown), drawn(archetype, species.appearance.pipes)[0]);
        EXPECT_EQ(species.window->copies, std::vector{grower.sample(Seed{}, 0, {}, scratch)->topology});
    }
}

} // namespace espalier
