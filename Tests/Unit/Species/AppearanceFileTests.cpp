#include <Espalier/Core/Random.h>
#include <Espalier/Species/AppearanceFile.h>
#include <Espalier/Species/Species.h>
#include <gtest/gtest.h>

namespace espalier {

namespace {

std::string fileWith(const std::string& more)
{
    return "{\"espalier\": \"appearance\", \"version\": 1" + more + "}";
}

std::string errorOf(const std::string& text)
{
    const auto appearance = parseAppearance(text, "x");
    return appearance ? std::string() : toString(appearance.error()).substr(2);
}

/// Numbers that no short decimal hits, in every field that a file holds.
Appearance unusual(std::uint64_t seed)
{
    const RandomKey key{Seed{seed}};
    std::uint32_t drawn = 0;
    const auto number = [&](double low, double high) {
        return static_cast<float>(key.uniform(Purpose::Sampling, low, high, drawn++));
    };
    const auto colour = [&] {
        const float red = number(0, 1);
        const float green = number(0, 1);
        return Vec3(red, green, number(0, 1));
    };
    Appearance appearance;
    appearance.bark = {.colour = colour(), .roughness = number(0, 1), .tile = number(0.01, 2)};
    appearance.bark.kind = static_cast<BarkKind>(key.below(Purpose::Shuffle, 5));
    appearance.bark.relief = number(0, 0.5);
    appearance.bark.youngTint = colour();
    appearance.bark.youngRadius = number(0, 10);
    appearance.bark.tileHeight = static_cast<std::uint32_t>(1 + key.below(Purpose::Shuffle, kMaxTileHeight, 1));
    appearance.bark.shade = number(0, 1);
    appearance.bark.rootFlare = number(0, 4);
    appearance.bark.rootLength = number(0, 20);
    appearance.bark.rootLobes = static_cast<std::uint32_t>(key.below(Purpose::Shuffle, kMaxRootLobes + 1, 2));
    appearance.bark.rootDepth = number(0, 2);
    for (std::uint32_t i = 0; i < 3; ++i)
    {
        LeafAppearance leaf;
        leaf.shape = static_cast<LeafShape>(key.below(Purpose::Shuffle, 7, 10 + i));
        leaf.form = static_cast<LeafForm>(key.below(Purpose::Shuffle, 3, 20 + i));
        leaf.arrangement = static_cast<LeafArrangement>(key.below(Purpose::Shuffle, 4, 30 + i));
        leaf.perNode = 1 + i;
        leaf.leaves = 1 + 5 * i;
        leaf.atTip = i == 1;
        leaf.angle = number(0, 3.1);
        leaf.angleSpread = number(0, 3.1);
        leaf.fold = number(0, 1.18);
        leaf.length = number(0.001, 20);
        leaf.colour = colour();
        leaf.crownNormals = number(0, 1);
        appearance.leaves.push_back(leaf);
    }
    appearance.seasons = {{"autumn", {{colour(), number(0, 1), number(0, 1)}, {colour(), 0.2f, 1}}},
                          {"winter \"x\"", {}}};
    appearance.wind = {number(0, 10), number(0, 10), 1};
    appearance.palette = {colour(), colour()};
    if (seed % 3 == 1)
        appearance.images = {{"bark.png", "more bark/normal.png", ""}, {}, {"leaf.png", "", "leaf \"x\".png"}};
    else if (seed % 3 == 2)
        appearance.images = {{}, {"leaf.png", "", ""}};
    return appearance;
}

} // namespace

TEST(AppearanceFile, WhatIsPrintedReadsBackTheSame)
{
    for (std::uint64_t seed = 0; seed < 200; ++seed)
    {
        const Appearance before = unusual(seed);
        const std::string text = printAppearance(before);
        const auto after = parseAppearance(text, "x.appearance");
        ASSERT_TRUE(after.has_value()) << toString(after.error()) << text;
        EXPECT_EQ(*after, before) << text;
        EXPECT_EQ(printAppearance(*after), text);
    }
}

TEST(AppearanceFile, ASpeciesKeepsItsWholeLook)
{
    Species species =
        parseSpecies("{\"espalier\": \"species\", \"version\": 1, \"grammar\": [\"axiom: F\"]}", "x").value();
    species.appearance = unusual(7);
    species.appearance.pipes.tipRadius = 0.02f;
    EXPECT_EQ(parseSpecies(printSpecies(species), "y").value(), species);
}

TEST(AppearanceFile, AnglesAreDegreesInTheFileAndRadiansInMemory)
{
    const Appearance appearance = parseAppearance(fileWith(R"(, "leaves": [{"angle": 90}])"), "x").value();
    ASSERT_EQ(appearance.leaves.size(), 1u);
    EXPECT_NEAR(appearance.leaves[0].angle, 1.5707963f, 1e-6f);
    EXPECT_NE(printAppearance(appearance).find("\"angle\": 90"), std::string::npos);
}

TEST(AppearanceFile, SaysWhatIsWrongAndWhere)
{
    const std::pair<std::string, std::string> cases[] = {
        {R"(, "pipes": {})", "1:42: appearance has the unknown key \"pipes\""},
        {R"(, "leaves": [{"shape": "round"}])", "1:63: shape is \"round\"; expected one of ovate, lobed"},
        {R"(, "leaves": [{"length": 0}])", "length is 0"},
        {R"(, "leaves": {})", "leaves is an object; expected an array"},
        {R"(, "leaves": [{},{},{},{},{},{},{},{},{}])", "leaves has 9 entries; expected at most 8"},
        {R"(, "leaves": [{"perNode": 1.5}])", "perNode is 1.5"},
        {R"(, "leaves": [{"angle": 181}])", "angle is 181"},
        {R"(, "bark": {"kind": 3})", "kind is 3; expected a string"},
        {R"(, "seasons": {"": []})", "the season has no name"},
        {R"(, "palette": [])", "palette has 0 entries; expected from 1 to 64"},
        {R"(, "bark": {"colour": [1, 2, 0]})", "a colour component is 2"},
        {R"(, "images": {"bark": {"normal": "a.png"}})", "images of bark have no colour"},
        {R"(, "images": {"bark": {"colour": "a.jpg"}})",
         "the picture is \"a.jpg\"; expected a .png file in the folder"},
        {R"(, "images": {"bark": {"colour": "../a.png"}})", "the picture is \"../a.png\""},
        {R"(, "images": {"bark": {"colour": "b/../../a.png"}})", "the picture is \"b/../../a.png\""},
        {R"(, "images": {"bark": {"colour": "/a.png"}})", "the picture is \"/a.png\""},
        {R"(, "images": {"bark": {"colour": "C:a.png"}})", "the picture is \"C:a.png\""},
        {R"(, "images": {"bark": {"colour": "x\u0000.png"}})", "the picture is"},
        {R"(, "images": {"leaf": []})", "images has the unknown key \"leaf\""},
    };
    for (const auto& [text, message] : cases)
        EXPECT_NE(errorOf(fileWith(text)).find(message), std::string::npos) << errorOf(fileWith(text));
    EXPECT_NE(errorOf("{\"espalier\": \"appearance\", \"version\": 2}").find("newer Espalier"), std::string::npos);
}

TEST(Appearance, ASeasonChangesTheLeavesItNames)
{
    Appearance summer;
    summer.leaves = {LeafAppearance{.density = 0.8f}, LeafAppearance{.length = 0.02f}};
    summer.seasons = {{"autumn", {{{0.8f, 0.4f, 0.05f}, 0.5f, 0.5f}}}};
    const Appearance autumn = inSeason(summer, "autumn");
    EXPECT_EQ(autumn.leaves[0].colour, Vec3(0.8f, 0.4f, 0.05f));
    EXPECT_FLOAT_EQ(autumn.leaves[0].density, 0.4f);
    EXPECT_EQ(autumn.leaves[1], summer.leaves[1]);
    EXPECT_EQ(inSeason(summer, ""), summer);
}

} // namespace espalier
