#include <Espalier/Inference/Fit.h>

#include <Espalier/Archetype/Placement.h>
#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Core/Random.h>
#include <Espalier/Inference/Comparison.h>
#include <Espalier/Inference/FitPaths.h>
#include <Espalier/Inference/Inference.h>
#include <Espalier/Plant/Measure.h>
#include <Espalier/Species/Grow.h>
#include <Inference/SampleArchetypes.h>
#include <Plant/SampleSkeletons.h>
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <map>
#include <tuple>

namespace espalier {

namespace {

FittedArchetype fit(const Skeleton& skeleton, const FitSettings& settings = {})
{
    auto result = fitArchetype(skeleton, settings);
    EXPECT_TRUE(result) << (result ? "" : toString(result.error()));
    return result.value_or(FittedArchetype{});
}

std::vector<std::string> words(const Archetype& archetype)
{
    std::vector<std::string> result;
    for (const Template& piece : archetype.library.templates)
        result.push_back(piece.name + ": " + printWord(piece));
    return result;
}

/// From a point to the nearest segment.
double distanceTo(const DVec3& point, const Skeleton& skeleton, const DVec3& origin)
{
    double least = std::numeric_limits<double>::infinity();
    for (std::uint32_t i = 0; i < skeleton.size(); ++i)
    {
        const std::vector<DVec3> line{DVec3(skeleton.starts[i]) + origin, DVec3(skeleton.ends[i]) + origin};
        least = std::min(least, espalier::distanceTo(point, line));
    }
    return least;
}

/// The archetype is what the file holds, and draws what the report says: measured here anew, from each end of a segment
/// of one to the nearest segment of the other.
void expectTrueReport(const Skeleton& skeleton, const FittedArchetype& fitted)
{
    const FitReport& report = fitted.report;
    ASSERT_TRUE(validate(fitted.archetype));
    EXPECT_LE(report.largestDistance, std::max(report.tolerance, 3e-6 * report.size));
    EXPECT_LE(report.meanDistance, report.largestDistance);
    const auto library = parseTemplates(printTemplates(fitted.archetype.library), "t.templates", {});
    ASSERT_TRUE(library) << toString(library.error());
    const auto read = parseArchetype(printArchetype(fitted.archetype), "t.archetype", *library, authoringLimits());
    ASSERT_TRUE(read) << toString(read.error());
    EXPECT_TRUE(*read == fitted.archetype) << printTemplates(fitted.archetype.library);
    if (report.trees != 1)
        return;
    const auto drawn = drawArchetype(*read);
    ASSERT_TRUE(drawn) << toString(drawn.error());
    const DVec3 origin(skeleton.starts[0]);
    double largest = 0;
    for (std::uint32_t i = 0; i < skeleton.size(); ++i)
        largest = std::max(largest, distanceTo(DVec3(skeleton.ends[i]), *drawn, origin));
    for (std::uint32_t i = 0; i < drawn->size(); ++i)
        largest = std::max(largest, distanceTo(DVec3(drawn->ends[i]) + origin, skeleton, DVec3(0)));
    EXPECT_LE(largest, report.largestDistance * (1 + 1e-9) + 1e-12) << "the nearest is no farther than the own piece";
}

Skeleton helix(int steps)
{
    Skeleton skeleton;
    std::uint32_t last = kNoSegment;
    Vec3 at(0);
    for (int i = 1; i <= steps; ++i)
    {
        const math::SinCos turn = math::sinCosDegrees(20.0 * i);
        const Vec3 next(static_cast<float>(turn.cos - 1), 0.1f * static_cast<float>(i), static_cast<float>(turn.sin));
        last = samples::addSegment(skeleton, last, at, next);
        at = next;
    }
    completeAxes(skeleton, {});
    return skeleton;
}

struct Random
{
    RandomKey key;
    std::uint32_t draw = 0;

    float operator()(double low, double high)
    {
        return static_cast<float>(key.uniform(Purpose::Sampling, low, high, ++draw));
    }
};

/// Crooked branches of some segments each, with repeated points, at random places; in `planar` all at z = 0.
Skeleton randomPlant(std::uint64_t seed, bool planar)
{
    Skeleton skeleton;
    Random next{RandomKey(Seed{seed})};
    const auto branches = static_cast<int>(next(1, 40));
    for (int branch = 0; branch < branches; ++branch)
    {
        std::uint32_t from = branch == 0 || next(0, 1) < 0.1f
                                 ? kNoSegment
                                 : static_cast<std::uint32_t>(next(0, 0.999) * static_cast<float>(skeleton.size()));
        Vec3 step(next(-1, 1), next(-1, 1), planar ? 0.f : next(-1, 1));
        const float size = next(0, 1) < 0.2f ? 0.01f : next(0.1, 1);
        const auto segments = static_cast<int>(next(1, 12));
        for (int i = 0; i < segments; ++i)
        {
            const float bend = next(0, 1) < 0.3f ? 0.f : 0.3f;
            step += Vec3(next(-bend, bend), next(-bend, bend), planar ? 0.f : next(-bend, bend));
            from = samples::grow(skeleton, from, next(0, 1) < 0.05f ? Vec3(0) : step * size);
        }
    }
    completeAxes(skeleton, {});
    return skeleton;
}

/// Crooked paths of about `points` points that fork in two, from five that leave one place.
Skeleton neuron(std::uint64_t seed, int points)
{
    Skeleton skeleton;
    Random next{RandomKey(Seed{seed})};
    struct Tip
    {
        std::uint32_t from;
        Vec3 step;
    };
    const auto bent = [&](Vec3 step, double by) {
        const float x = next(-by, by);
        const float y = next(-by, by);
        const float z = next(-by, by);
        return step + Vec3(x, y, z);
    };
    std::vector<Tip> tips;
    for (int i = 0; i < 5; ++i)
        tips.push_back({kNoSegment, bent(Vec3(0, 0.2f, 0), 1)});
    for (std::size_t i = 0; i < tips.size() && skeleton.size() < static_cast<std::size_t>(points); ++i)
    {
        Tip tip = tips[i];
        const auto steps = static_cast<int>(next(8, 24));
        for (int k = 0; k < steps; ++k)
        {
            tip.step = bent(tip.step, 0.2);
            tip.step *= 1 / std::max(0.1f, std::sqrt(glm::dot(tip.step, tip.step)));
            tip.from = samples::grow(skeleton, tip.from, tip.step);
        }
        if (next(0, 1) < 0.75f)
            for (int k = 0; k < 2; ++k)
                tips.push_back({tip.from, bent(tip.step, 0.8)});
    }
    completeAxes(skeleton, {});
    return skeleton;
}

Skeleton grown(const std::string& grammarText)
{
    const auto grammar = parseGrammar(grammarText, "t.lsys", {});
    EXPECT_TRUE(grammar);
    const auto grower = Grower::make(*grammar);
    EXPECT_TRUE(grower);
    GrowScratch scratch;
    Skeleton skeleton;
    EXPECT_TRUE(grower->grow(Seed{1}, {}, scratch, skeleton));
    return skeleton;
}

/// Different branches, whole.
std::size_t limbs(const Archetype& archetype)
{
    const AnchorTable anchors = anchorsOf(archetype);
    std::vector<std::size_t> limbOf(archetype.instances.size());
    std::map<std::vector<double>, std::size_t> numbers;
    for (std::size_t i = archetype.instances.size(); i-- > 0;)
    {
        const TemplateInstance& instance = archetype.instances[i];
        const InstanceTransform& t = instance.transform;
        std::vector<double> key{static_cast<double>(instance.piece), t.scaling, t.rotation, t.branchingAngle, t.roll};
        for (std::uint32_t a = anchors.firstChild[i]; a < anchors.firstChild[i + 1]; ++a)
            key.push_back(anchors.children[a] == kNoInstance ? -1.0 : static_cast<double>(limbOf[anchors.children[a]]));
        limbOf[i] = numbers.try_emplace(key, numbers.size()).first->second;
    }
    return numbers.size();
}

} // namespace

TEST(Fit, ASkeletonWithoutLengthIsRefused)
{
    Skeleton skeleton;
    EXPECT_FALSE(fitArchetype(skeleton));
    samples::grow(skeleton, kNoSegment, Vec3(0));
    completeAxes(skeleton, {});
    const auto result = fitArchetype(skeleton);
    ASSERT_FALSE(result);
    EXPECT_NE(toString(result.error()).find("no segment with a length"), std::string::npos);
}

TEST(Fit, SettingsOutOfRangeAreRefused)
{
    const Skeleton skeleton = samples::straightTrunk();
    for (const double tolerance :
         {-1.0, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
        EXPECT_FALSE(fitArchetype(skeleton, {.tolerance = tolerance}));
    EXPECT_FALSE(fitArchetype(skeleton, {.templates = 0}));
    EXPECT_FALSE(fitArchetype(skeleton, {.templates = 1025}));
}

TEST(Fit, AForkOfThreeSegments)
{
    Skeleton skeleton;
    const std::uint32_t trunk = samples::grow(skeleton, kNoSegment, {0, 1, 0});
    samples::grow(skeleton, trunk, {-1, 1, 0});   // left, 45 degrees
    samples::grow(skeleton, trunk, {0.5f, 0, 0}); // right, 90 degrees, shorter
    completeAxes(skeleton, {});
    const FittedArchetype fitted = fit(skeleton, {.libraryName = "y.templates"});
    EXPECT_EQ(words(fitted.archetype), (std::vector<std::string>{"tip: F(1.41421)", "fork2: F[A]Z"}));
    EXPECT_EQ(fitted.archetype.libraryName, "y.templates");
    ASSERT_EQ(fitted.archetype.instances.size(), 3u);
    const auto& [fork, side, on] =
        std::tie(fitted.archetype.instances[0], fitted.archetype.instances[1], fitted.archetype.instances[2]);
    EXPECT_EQ(fork.transform, (InstanceTransform{1, 0, 45, 0}));
    EXPECT_EQ(side.anchor, 0u);
    EXPECT_EQ(side.transform, (InstanceTransform{0.353554, -90, 45, 0})) << "in a plane + and - are left and right";
    EXPECT_EQ(on.anchor, 1u) << "the longer branch goes on, at Z";
    EXPECT_EQ(on.transform.rotation, 45);
    EXPECT_EQ(fitted.report.segments, 3u);
    EXPECT_EQ(fitted.report.internodes, 3u);
    EXPECT_EQ(fitted.report.depth, 2u);
    expectTrueReport(skeleton, fitted);
}

TEST(Fit, InSpaceRollTellsTheSideAndRotationTheAngle)
{
    Skeleton skeleton;
    const std::uint32_t trunk = samples::grow(skeleton, kNoSegment, {0, 1, 0});
    samples::grow(skeleton, trunk, {-1, 1, 0}); // left
    samples::grow(skeleton, trunk, {0, 1, 1});  // up in the turtle's sense: a quarter roll from left
    samples::grow(skeleton, trunk, {1, 1, 0});  // right
    completeAxes(skeleton, {});
    const FittedArchetype fitted = fit(skeleton);
    std::vector<double> rolls;
    for (const TemplateInstance& instance : fitted.archetype.instances)
        if (instance.parent != kNoInstance)
        {
            EXPECT_EQ(instance.transform.rotation, 45);
            rolls.push_back(instance.transform.roll);
        }
    // The trunk turns its first side branch to the left; the first branch of all continues.
    EXPECT_EQ(fitted.archetype.instances[0].transform.roll, 90);
    EXPECT_EQ(rolls, (std::vector<double>{0, 90, -90}));
    expectTrueReport(skeleton, fitted);
}

TEST(Fit, StraightRunsOfSegmentsAreOnePiece)
{
    const FittedArchetype fitted = fit(samples::straightTrunk({.segments = 7}));
    EXPECT_EQ(fitted.archetype.instances.size(), 1u);
    EXPECT_EQ(fitted.report.segments, 7u);
    const FittedArchetype all = fit(samples::straightTrunk({.segments = 7}), {.tolerance = 0});
    EXPECT_EQ(all.archetype.instances.size(), 7u) << "tolerance 0 keeps every point";
}

TEST(Fit, AHelixIsFollowedWithinTheTolerance)
{
    const Skeleton skeleton = helix(200);
    std::uint32_t before = 0xffffffff;
    for (const double tolerance : {0.0, 0.001, 0.01, 0.1, 0.5})
    {
        SCOPED_TRACE(tolerance);
        const FittedArchetype fitted = fit(skeleton, {.tolerance = tolerance});
        EXPECT_EQ(fitted.report.tolerance, tolerance);
        EXPECT_LE(fitted.report.instances, before) << "a larger tolerance takes fewer pieces";
        before = fitted.report.instances;
        expectTrueReport(skeleton, fitted);
    }
    EXPECT_EQ(fit(skeleton, {.tolerance = 0}).report.instances, 200u);
    EXPECT_LT(before, 100u);
}

TEST(Fit, RandomPlantsLieWithinTheTolerance)
{
    for (std::uint64_t seed = 0; seed < 120; ++seed)
    {
        SCOPED_TRACE(seed);
        const Skeleton skeleton = randomPlant(seed, seed % 3 == 0);
        if (measure(skeleton).totalLength == 0)
            continue;
        for (const std::uint32_t templates : {1u, 3u, 24u, 200u})
        {
            const FittedArchetype fitted = fit(skeleton, {.templates = templates});
            expectTrueReport(skeleton, fitted);
            std::uint32_t joints = 0;
            for (const Template& piece : fitted.archetype.library.templates)
                joints += piece.name.starts_with("joint");
            EXPECT_LE(fitted.report.templates - joints, templates);
        }
        expectTrueReport(skeleton, fit(skeleton, {.tolerance = 0}));
        const FittedArchetype coarse = fit(skeleton, {.tolerance = 0.3});
        EXPECT_LE(coarse.report.largestDistance, 0.3);
    }
}

TEST(Fit, TipsAndForksAreAllKept)
{
    for (std::uint64_t seed = 0; seed < 60; ++seed)
    {
        SCOPED_TRACE(seed);
        const Skeleton skeleton = randomPlant(seed, false);
        const FittedArchetype fitted = fit(skeleton);
        const FitPaths paths = pathsOf(skeleton);
        const auto drawn = drawArchetype(fitted.archetype);
        ASSERT_TRUE(drawn);
        const SkeletonFacts facts = measure(*drawn);
        const auto tips = std::ranges::count(paths.internodes, 0u, &Internode::childCount);
        const auto forks = std::ranges::count_if(paths.internodes, [](const Internode& i) { return i.childCount > 1; });
        EXPECT_EQ(facts.tips, static_cast<std::uint64_t>(tips));
        EXPECT_EQ(facts.forks, static_cast<std::uint64_t>(forks + (paths.trees[0].childCount > 1 ? 1 : 0)));
    }
}

TEST(Fit, SeveralPlacesAreSeveralTrees)
{
    Skeleton skeleton;
    samples::grow(skeleton, kNoSegment, {0, 1, 0});
    samples::addSegment(skeleton, kNoSegment, {5, 0, 0}, {5, 2, 0});
    samples::addSegment(skeleton, kNoSegment, {5, 0, 0}, {6, 2, 0});
    completeAxes(skeleton, {});
    const FittedArchetype fitted = fit(skeleton);
    EXPECT_EQ(fitted.report.trees, 2u);
    EXPECT_LT(fitted.report.largestDistance, 1e-4);
    const auto second = drawArchetype(fitted.archetype, 1);
    ASSERT_TRUE(second);
    EXPECT_EQ(second->size(), 2u) << "two branches of one place, on a joint";
    EXPECT_EQ(words(fitted.archetype).back(), "joint2: [A]Z");
}

TEST(Fit, AGapIsBridged)
{
    Skeleton skeleton;
    samples::grow(skeleton, kNoSegment, {0, 1, 0});
    samples::addSegment(skeleton, 0, {1, 1, 0}, {1, 2, 0});
    completeAxes(skeleton, {});
    const FittedArchetype fitted = fit(skeleton);
    const auto drawn = drawArchetype(fitted.archetype);
    ASSERT_TRUE(drawn);
    EXPECT_NEAR(measure(*drawn).totalLength, 3, 1e-4);
}

TEST(Fit, MoreBranchesThanLettersHangOnJoints)
{
    for (const int branches : {2, 23, 24, 25, 26, 60, 600, 3000})
    {
        SCOPED_TRACE(branches);
        for (const bool hasTrunk : {false, true})
        {
            Skeleton skeleton;
            const std::uint32_t base = hasTrunk ? samples::grow(skeleton, kNoSegment, {0, 1, 0}) : kNoSegment;
            Random next{RandomKey(Seed{1})};
            for (int i = 0; i < branches; ++i)
            {
                const float x = next(-1, 1);
                const float z = next(-1, 1);
                samples::grow(skeleton, base, {x, 1, z});
            }
            completeAxes(skeleton, {});
            const FittedArchetype fitted = fit(skeleton);
            const auto drawn = drawArchetype(fitted.archetype);
            ASSERT_TRUE(drawn) << toString(drawn.error());
            EXPECT_EQ(drawn->size(), skeleton.size());
            EXPECT_EQ(measure(*drawn).forks, 1u) << "they still start in one point";
            EXPECT_LE(fitted.report.largestDistance, fitted.report.tolerance);
            EXPECT_LE(fitted.report.depth, 6u);
        }
    }
}

TEST(Fit, EqualBranchesOfAGrammarGetEqualNumbers)
{
    // Ternary tree, n = 6: 364 instances, but only two for each level and one for the base can differ.
    const FittedArchetype ternary = fit(grown("iterations: 6\naxiom: /(45)A\nlet d = 137.5\nlet a = 18.95\n"
                                              "A -> F(0.5)[&(a)F(0.5)A]/(d)[&(a)F(0.5)A]/(d)[&(a)F(0.5)A]\n"
                                              "F(l) -> F(l*1.3)\n"));
    EXPECT_EQ(ternary.report.instances, 1093u);
    EXPECT_EQ(ternary.report.templates, 2u);
    EXPECT_LE(limbs(ternary.archetype), 3u * 7u);
    // In a plane, branches to the left and to the right are the same branch, turned.
    const FittedArchetype planar = fit(grown("iterations: 5\nangle: 30\naxiom: A\nA -> F[+A]-A\nF -> FF\n"));
    EXPECT_LE(limbs(planar.archetype), 2u * 6u);
    // Where a trunk goes on, it rolls so that its branch is at the left: each whorl is the same but for its size.
    const FittedArchetype whorls = fit(grown("iterations: 8\naxiom: A\nA -> F[&(50)F(0.4)]/(137.5)A\n"));
    int trunks = 0;
    for (const TemplateInstance& instance : whorls.archetype.instances)
    {
        if (instance.parent == kNoInstance || whorls.archetype.library.templates[instance.piece].anchors.size() < 2)
            continue;
        EXPECT_EQ(instance.transform.roll, 137.5);
        ++trunks;
    }
    EXPECT_EQ(trunks, 6);
}

TEST(Fit, BentBranchesThatRecurShareATemplate)
{
    // Hooks of one shape in space, turned and scaled at random.
    std::string grammar = "axiom: ";
    Random next{RandomKey(Seed{3})};
    for (int i = 0; i < 12; ++i)
    {
        const std::string scale = std::to_string(next(0.3, 2));
        grammar += "F(2)[/(" + std::to_string(next(0, 360)) + ")&(" + std::to_string(next(20, 90)) + ")/(" +
                   std::to_string(next(0, 360)) + ")F(" + scale + ")+(30)F(" + scale + ")/(40)+(30)F(" + scale +
                   ")]/(" + std::to_string(next(0, 360)) + ")&(9)";
    }
    const Skeleton skeleton = grown(grammar + "F\n");
    const FittedArchetype fitted = fit(skeleton);
    expectTrueReport(skeleton, fitted);
    const auto hook = std::ranges::find(fitted.archetype.library.templates, "tip_bent1", &Template::name);
    ASSERT_NE(hook, fitted.archetype.library.templates.end()) << printTemplates(fitted.archetype.library);
    const auto uses = std::ranges::count(fitted.archetype.instances, hook - fitted.archetype.library.templates.begin(),
                                         [](const TemplateInstance& i) { return std::ptrdiff_t{i.piece}; });
    EXPECT_EQ(uses, 12);
    EXPECT_LT(fitted.report.largestDistance, 1e-3);
    // The dial: no template to spare, so the hooks are chains of links.
    const FittedArchetype plain = fit(skeleton, {.templates = 3});
    EXPECT_EQ(plain.report.templates, 3u);
    EXPECT_GT(plain.report.instances, fitted.report.instances);
    expectTrueReport(skeleton, plain);
}

TEST(Fit, WhatAnArchetypeDrewIsFittedClosely)
{
    for (const Archetype& archetype : {samples::thesis(), samples::randomArchetype(Seed{4}, 60)})
    {
        const auto skeleton = drawArchetype(archetype);
        ASSERT_TRUE(skeleton);
        const FittedArchetype fitted = fit(*skeleton);
        expectTrueReport(*skeleton, fitted);
        const auto drawn = drawArchetype(fitted.archetype);
        ASSERT_TRUE(drawn);
        EXPECT_NEAR(measure(*drawn).totalLength / measure(*skeleton).totalLength, 1, 0.002);
    }
}

TEST(Fit, APathBetweenTwoForksIsOnePiece)
{
    for (std::uint64_t seed = 0; seed < 40; ++seed)
    {
        SCOPED_TRACE(seed);
        const Skeleton skeleton = neuron(seed, 600);
        const FittedArchetype fitted = fit(skeleton);
        expectTrueReport(skeleton, fitted);
        EXPECT_EQ(fitted.report.instances, fitted.report.internodes + 1) << "and a joint at the base";
        EXPECT_GT(fit(skeleton, {.templates = 24}).report.instances, 3 * fitted.report.instances) << "else chains";
    }
}

TEST(Fit, TreesInferredFromAFittedNeuronAreItsKin)
{
    const FittedArchetype fitted = fit(neuron(1, 900));
    const auto species = inferSpecies({&fitted.archetype, 1}, {});
    ASSERT_TRUE(species) << toString(species.error());
    const auto comparison = compare({&fitted.archetype, 1}, *species, {.seeds = 100});
    ASSERT_TRUE(comparison) << toString(comparison.error());
    EXPECT_GE(comparison->size.within, 0.8);
    EXPECT_NEAR(comparison->size.mean / comparison->size.exemplar, 1, 0.2);
    EXPECT_LE(comparison->anchorDivergence, 0.05);
    EXPECT_GE(comparison->distinct, 0.9);
}

TEST(Fit, EqualInputGivesEqualOutput)
{
    const Skeleton skeleton = randomPlant(7, false);
    EXPECT_TRUE(fit(skeleton).archetype == fit(skeleton).archetype);
}

TEST(Fit, SizeDoesNotMatter)
{
    const Skeleton skeleton = randomPlant(11, false);
    const FittedArchetype usual = fit(skeleton);
    for (const float scale : {1e-6f, 1e-3f, 1e3f, 5e3f})
    {
        SCOPED_TRACE(scale);
        Skeleton scaled;
        for (std::uint32_t i = 0; i < skeleton.size(); ++i)
            samples::addSegment(scaled, skeleton.parents[i], skeleton.starts[i] * scale, skeleton.ends[i] * scale);
        completeAxes(scaled, {});
        const FittedArchetype fitted = fit(scaled);
        expectTrueReport(scaled, fitted);
        EXPECT_EQ(fitted.report.instances, usual.report.instances);
    }
}

TEST(Fit, PiecesLongerThanATemplatesLengthMayBe)
{
    Skeleton skeleton; // as far as coordinates reach, on the diagonal
    const std::uint32_t first = samples::grow(skeleton, kNoSegment, {99000, 99000, 50});
    samples::grow(skeleton, first, {-99000, 0, 50});
    samples::grow(skeleton, first, {0.5f, 0.5f, 0});
    completeAxes(skeleton, {});
    expectTrueReport(skeleton, fit(skeleton));
}

TEST(Fit, LongChainsNestWithoutACallStackAndReadBack)
{
    const Skeleton skeleton = helix(20000);
    const FittedArchetype fitted = fit(skeleton, {.tolerance = 1e-3, .templates = 1});
    EXPECT_GT(fitted.report.depth, 5000u);
    const auto library = parseTemplates(printTemplates(fitted.archetype.library), "t.templates", {});
    const std::string text = printArchetype(fitted.archetype);
    EXPECT_LT(text.size(), 4u << 20) << "a deep file is no file of blanks";
    const auto read = parseArchetype(text, "t.archetype", *library, authoringLimits());
    ASSERT_TRUE(read) << toString(read.error());
    EXPECT_TRUE(*read == fitted.archetype);
}

} // namespace espalier
