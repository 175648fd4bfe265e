#include <Espalier/Inference/Inference.h>

#include <Espalier/Species/Grow.h>
#include <Inference/SampleArchetypes.h>
#include <algorithm>
#include <array>
#include <gtest/gtest.h>
#include <limits>
#include <set>

namespace espalier {

namespace {

Archetype archetypeOf(const std::string& templates, const std::string& trees)
{
    const TemplateLibrary library = parseTemplates(templates, "t.templates", {}).value();
    return parseArchetype("{\"espalier\": \"archetype\", \"version\": 1, \"library\": \"t.templates\", \"trees\": [" +
                              trees + "]}",
                          "t.archetype", library, {})
        .value();
}

Error errorOf(std::span<const Archetype> archetypes, const InferenceOptions& options = {})
{
    const auto species = inferSpecies(archetypes, options);
    EXPECT_FALSE(species);
    return species ? Error{} : species.error();
}

} // namespace

TEST(Inference, RefusesWhatItCannotUse)
{
    const Archetype thesis = samples::thesis();
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(errorOf({}).kind, ErrorKind::BadInput);
    const Archetype empty;
    EXPECT_EQ(errorOf({&empty, 1}).kind, ErrorKind::BadInput);
    Archetype cyclic = thesis;
    cyclic.instances[1].parent = 2;
    EXPECT_EQ(errorOf({&cyclic, 1}).kind, ErrorKind::BadInput);
    const Error unknown = errorOf({&thesis, 1}, {.preset = "none"});
    EXPECT_EQ(unknown.what, "there is no inference preset \"none\"");
    EXPECT_EQ(unknown.expected, "kin or helberg");
    for (const double weight : {-0.1, 1.1, nan})
    {
        EXPECT_EQ(errorOf({&thesis, 1}, {.mergeWeight = weight}).what, "the merge weight is out of range");
        EXPECT_EQ(errorOf({&thesis, 1}, {.ruleWeight = weight}).what, "the rule weight is out of range");
    }
}

TEST(Inference, IsDeterministicAndSaysWhereItComesFrom)
{
    const Archetype thesis = samples::thesis();
    for (const std::string_view preset : inferencePresets())
    {
        const InferenceOptions options{.preset = std::string(preset), .name = "Thesis"};
        const Species species = inferSpecies({&thesis, 1}, options).value();
        EXPECT_EQ(inferSpecies({&thesis, 1}, options).value(), species);
        EXPECT_EQ(species.name, "Thesis");
        EXPECT_TRUE(species.provenance.method.starts_with(preset));
        EXPECT_EQ(species.provenance.archetypes.size(), 16u);
        EXPECT_EQ(species.provenance.exemplarSegments, 55u);
        EXPECT_EQ(species.provenance.exemplarInstances, 17u);
    }
}

TEST(Inference, TracesEveryPassOnce)
{
    const Archetype thesis = samples::thesis();
    const std::pair<std::string, std::vector<std::string>> cases[] = {
        {"kin", {"infer", "generalize", "estimate"}}, {"helberg", {"infer", "compress", "generalize", "estimate"}}};
    for (const auto& [preset, passes] : cases)
    {
        InferenceOptions options;
        options.preset = preset;
        std::vector<std::string> traced;
        options.trace = [&](std::string_view pass, const std::string& summary, const std::string& grammar) {
            traced.emplace_back(pass);
            EXPECT_FALSE(summary.empty());
            EXPECT_FALSE(grammar.empty());
        };
        double last = 0;
        options.progress.report = [&](std::string_view, double done) {
            EXPECT_TRUE(done >= 0 && done <= 1);
            last = done;
        };
        ASSERT_TRUE(inferSpecies({&thesis, 1}, options));
        EXPECT_EQ(traced, passes);
        EXPECT_EQ(last, 1);
    }
}

TEST(Inference, StopsWhenItIsCancelled)
{
    const Archetype archetype = samples::randomArchetype(Seed{1}, 60);
    for (const std::string_view preset : inferencePresets())
        for (std::uint32_t after = 0; after < 4; ++after) // reports of progress
        {
            std::atomic<bool> cancelled{after == 0};
            std::uint32_t reports = 0;
            InferenceOptions options;
            options.preset = preset;
            options.progress.cancelled = &cancelled;
            options.progress.report = [&](std::string_view, double) { cancelled = ++reports >= after; };
            EXPECT_EQ(errorOf({&archetype, 1}, options).kind, ErrorKind::Cancelled) << preset << " after " << after;
        }
}

TEST(Inference, UnitesTemplatesOfEqualWordAndPartsThoseOfEqualName)
{
    const Archetype first = archetypeOf(
        "a: F[+X]Y\nb: F\n", R"({"template": "a", "children": {"X": {"template": "b"}, "Y": {"template": "b"}}})");
    const Archetype renamed =
        archetypeOf("c: F\nd: F[+X]Y\n", R"({"template": "d", "children": {"X": {"template": "c"}}})");
    const Archetype other =
        archetypeOf("a: FF[-X]\nb: F\n", R"({"template": "a", "children": {"X": {"template": "b"}}})");

    const Archetype equal[] = {first, renamed};
    const Species united = inferSpecies(equal).value();
    ASSERT_EQ(united.tables.size(), 2u);
    EXPECT_EQ(united.tables[0].name, "a");
    EXPECT_EQ(united.tables[1].name, "b");

    const Archetype unequal[] = {first, other};
    for (const std::string_view preset : inferencePresets())
    {
        InferenceOptions options;
        options.preset = preset;
        options.mergeWeight = 0;
        const Species parted = inferSpecies(unequal, options).value();
        std::vector<std::string> names;
        for (const TransformTable& table : parted.tables)
            names.push_back(table.name);
        EXPECT_NE(std::ranges::find(names, "a"), names.end());
        EXPECT_NE(std::ranges::find(names, "a_2"), names.end());
        const auto again = parseSpecies(printSpecies(parted), "again");
        ASSERT_TRUE(again) << toString(again.error());
        EXPECT_TRUE(grow(*again, Seed{1}));
    }
}

/// An archetype over one template of its own, `depth` instances on each other; several depths, several trees.
Archetype chains(const std::string& word, std::initializer_list<std::uint32_t> depths)
{
    Archetype archetype;
    archetype.library = parseTemplates("T: " + word, "t.templates", {}).value();
    for (const std::uint32_t depth : depths)
        for (std::uint32_t i = 0; i < depth; ++i)
        {
            TemplateInstance instance;
            instance.parent = i == 0 ? kNoInstance : static_cast<std::uint32_t>(archetype.instances.size() - 1);
            archetype.instances.push_back(instance);
        }
    return archetype;
}

/// Segments that weight 0 grows from the first seeds.
std::set<std::uint32_t> sizesAtWeightZero(const Archetype& archetype, const std::string& preset)
{
    const auto species = inferSpecies({&archetype, 1}, {.preset = preset, .mergeWeight = 0.0});
    EXPECT_TRUE(species) << toString(species.error());
    std::set<std::uint32_t> sizes;
    for (std::uint64_t seed = 0; species && seed < 40; ++seed)
    {
        const auto skeleton = grow(*species, Seed{seed});
        EXPECT_TRUE(skeleton) << toString(skeleton.error());
        sizes.insert(skeleton ? skeleton->size() : 0);
    }
    return sizes;
}

TEST(Inference, NamesRulesApartFromOrgans)
{
    // An organ called S is not the start symbol; nor does inference fail when organs have taken every letter.
    std::string everyLetter = "F[-X]F";
    for (char letter = 'A'; letter <= 'Z'; ++letter)
        everyLetter += std::string("~") + letter + '~' + static_cast<char>(letter + 'a' - 'A');
    for (const std::string& word : {std::string("F[-X]F~S"), everyLetter})
        for (const std::string preset : {"kin", "helberg"})
            EXPECT_EQ(sizesAtWeightZero(chains(word, {3, 3}), preset), std::set<std::uint32_t>{6}) << word << preset;
}

TEST(Inference, CountsWhatTheTurtleDraws)
{
    const auto species = inferSpecies(std::array{chains("F[-X]~F~G%", {4})});
    ASSERT_TRUE(species) << toString(species.error());
    EXPECT_EQ(species->provenance.exemplarSegments, 4u);
    EXPECT_LE(species->window->minSegments, 4u);
}

TEST(Inference, GrowsDrawnTreesOfAnySizeAtWeightZero)
{
    EXPECT_EQ(sizesAtWeightZero(chains("FX", {3, 40}), "kin"), (std::set<std::uint32_t>{3, 40}));
}

TEST(Inference, TakesTheSmallestTrees)
{
    const Archetype cases[] = {
        archetypeOf("F\n", R"({"template": "I"})"), archetypeOf("XY\n", R"({"template": "I"})"),
        archetypeOf("XY\nF\n", R"({"template": "I", "children": {"Y": {"template": "II"}}})"),
        archetypeOf("F\n", R"({"template": "I"}, {"template": "I"}, {"template": "I", "scaling": 2})")};
    for (const Archetype& archetype : cases)
        for (const std::string_view preset : inferencePresets())
        {
            InferenceOptions options;
            options.preset = preset;
            const auto species = inferSpecies({&archetype, 1}, options);
            ASSERT_TRUE(species) << toString(species.error());
            EXPECT_TRUE(grow(*species, Seed{1}));
        }
}

} // namespace espalier
