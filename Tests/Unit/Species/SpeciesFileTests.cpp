#include <Espalier/Core/File.h>
#include <Espalier/Inference/Inference.h>
#include <Espalier/Species/Grow.h>
#include <Inference/SampleArchetypes.h>
#include <filesystem>
#include <gtest/gtest.h>
#include <unistd.h>

namespace espalier {

namespace {

/// What a species file must hold, and then `more`.
std::string fileWith(const std::string& more)
{
    return "{\"espalier\": \"species\", \"version\": 1, \"grammar\": [\"axiom: F\"]" + more + "}";
}

/// The message without the file's name; empty if the text is read.
std::string errorOf(std::string text, const Limits& limits = {})
{
    const auto species = parseSpecies(std::move(text), "x", limits);
    return species ? std::string() : toString(species.error()).substr(2);
}

std::string repeated(const std::string& text, int times)
{
    std::string all;
    for (int i = 0; i < times; ++i)
        all += text;
    return all;
}

Species handMade()
{
    return parseSpecies(R"text({"espalier": "species", "version": 1, "name": "by \"hand\" é",
        "grammar": ["let w = 0.5", "symbols: Trunk", "angle: 30", "axiom: Trunk(0)",
                    "Trunk(i) -> F(s) [ +(b + r) Trunk(1) ] /(o) : (i == 0)*(1 - w) + w/2 : ~ t(0)",
                    "Trunk(i) -> F(s) : (i == 1)*(1 - w) + w/2 : ~ t"],
        "tables": {"t": {"spread": [0.1, 2, 2.5, 0], "rows": [[1, 0, 45, 0], [0.1, 20, 30, -90.125]]}},
        "window": {"segments": [2, 9], "depth": [1, 8], "attempts": 8, "copies": ["00000000deadbeef", "ffffffffffffffff"]},
        "appearance": {"pipes": {"tipRadius": 0.01, "exponent": 2, "pipesPerMetre": 1.7},
                       "bark": {"colour": [0.2, 0.15, 1], "roughness": 0.9, "tile": 0.5}},
        "provenance": {"method": "none", "archetypes": "0", "mergeWeight": 0.25, "ruleWeight": 1, "exemplarSegments": 4,
                       "exemplarInstances": 2, "note": "line\nbreak"}})text",
                        "hand.species")
        .value();
}

/// A folder of its own for each test.
class SpeciesOnDisk : public testing::Test
{
protected:
    void SetUp() override
    {
        folder_ = std::filesystem::temp_directory_path() / ("espalier-species-" + std::to_string(::getpid()));
        std::filesystem::create_directory(folder_);
    }
    void TearDown() override { std::filesystem::remove_all(folder_); }

    std::filesystem::path folder_;
};

} // namespace

TEST(SpeciesFile, SaysWhatIsWrongAndWhere)
{
    struct Case
    {
        std::string text;
        std::string message; ///< How the error begins.
    };
    const Case cases[] = {
        {"", "1:1: the file is empty"},
        {"{\"espalier\": \"species\", \"version\": 1, \"gram", "1:39: the string that begins here does not end"},
        {"{\"espalier\": \"species\", \"version\": 1,", "1:38: the file ends too early"},
        {"[]", "1:1: the file is an array; expected an object"},
        {"{\"name\": \"\xC3\x28\"}", "1:11: this byte is not valid; expected UTF-8 text"},
        {"{}", "1:1: the key \"espalier\" is missing"},
        {"{\"espalier\": \"species\", \"version\": 1}", "1:1: the key \"grammar\" is missing"},
        {"{\"espalier\": \"archetype\", \"version\": 1, \"grammar\": []}",
         "1:14: this is a file of the kind \"archetype\""},
        {"{\"espalier\": \"species\", \"version\": 2, \"grammar\": []}",
         "1:36: the file has version 2 of the species format; expected version 1; "
         "open it with a newer Espalier"},
        {"{\"espalier\": \"species\", \"version\": 0, \"grammar\": []}",
         "1:36: the file has version 0 of the species format"},
        {"{\"espalier\": \"species\", \"version\": \"1\", \"grammar\": []}",
         "1:36: version is the string \"1\"; expected a whole number"},
        {fileWith(", \"grammar\": []"), "1:64: the key \"grammar\" stands here a second time"},
        {fileWith(", \"leaves\": {}"),
         "1:64: a species has the unknown key \"leaves\"; expected only espalier, version, name"},
        {fileWith(", \"name\": 7"), "1:72: name is 7; expected a string"},
        {fileWith(", \"name\": null"), "1:72: name is null; expected a string"},
        {fileWith(", \"tables\": []"), "1:74: tables is an array; expected an object"},
        {fileWith(", \"tables\": {\"t\": {}}"), "1:80: the table t has no row; expected at least one row"},
        {fileWith(", \"tables\": {\"t\": {\"rows\": [[1, 2, 3]]}}"),
         "1:90: a row has 3 numbers; expected [scaling, rotation"},
        {fileWith(", \"tables\": {\"t\": {\"rows\": [[-1, 2, 3, 4]]}}"),
         "1:91: a scaling is -1; expected a number from 0"},
        {fileWith(", \"tables\": {\"t\": {\"rows\": [[1e400, 2, 3, 4]]}}"), "1:91: 1e400 is too large for a number"},
        {fileWith(", \"tables\": {\"t\": {\"rows\": [[1, 3601, 3, 4]]}}"),
         "1:94: an angle is 3601; expected a number from -3600 to 3600"},
        {fileWith(", \"tables\": {\"t\": {\"spread\": [0.5, 0, 0, 0], \"rows\": [[1, 2, 3, 4]]}}"),
         "1:92: a scaling is 0.5"},
        {fileWith(", \"tables\": {\"t\": {\"row\": []}}"), "1:81: a table has the unknown key \"row\""},
        {fileWith(", \"window\": 5"), "1:74: window is 5; expected an object"},
        {fileWith(", \"window\": {\"segments\": [1]}"), "1:87: "},
        {fileWith(", \"window\": {\"segments\": [3, 2]}"), "1:91: "},
        {fileWith(", \"window\": {\"depth\": [-1, 2]}"), "1:85: "},
        {fileWith(", \"window\": {\"attempts\": 0}"), "1:87: attempts is 0; expected a whole number from 1 to 1024"},
        {fileWith(", \"window\": {\"attempts\": 1025}"), "1:87: attempts is 1025"},
        {fileWith(", \"window\": {\"copies\": [7]}"), "1:86: a topology hash is 7; expected a string"},
        {fileWith(", \"window\": {\"copies\": [\"xyz\"]}"),
         "1:86: this is no hash; expected 16 lower-case hexadecimal digits"},
        {fileWith(", \"window\": {\"copies\": [\"00000000DEADBEEF\"]}"), "1:86: this is no hash"},
        {fileWith(", \"appearance\": {\"bark\": {\"colour\": [1, 1]}}"), "1:98: the colour has 2 components"},
        {fileWith(", \"appearance\": {\"bark\": {\"colour\": [1, 1, 2]}}"), "1:105: a colour component is 2"},
        {fileWith(", \"appearance\": {\"bark\": {\"tile\": 0}}"), "1:96: tile is 0"},
        {fileWith(", \"appearance\": {\"pipes\": {\"exponent\": 5}}"),
         "1:101: exponent is 5; expected a number from 1 to 4"},
        {fileWith(", \"appearance\": {\"palette\": 7}"), "1:90: palette is 7; expected an array"},
        {fileWith(", \"appearance\": {\"palette\": []}"), "1:90: palette has 0 entries; expected from 1 to 64"},
        {fileWith(", \"appearance\": {\"palette\": [" + repeated("[0, 0, 0], ", 64) + "[0, 0, 0]]}"),
         "1:90: palette has 65 entries; expected from 1 to 64"},
        {fileWith(", \"appearance\": {\"palette\": [[0, 0, 0], [1, 1]]}"), "1:102: the colour has 2 components"},
        {fileWith(", \"appearance\": {\"palette\": [[0, -0.5, 0]]}"), "1:95: a colour component is -0.5"},
        {fileWith(", \"appearance\": {\"wood\": 1}"), "1:79: appearance has the unknown key \"wood\""},
        {fileWith(", \"provenance\": {\"mergeWeight\": 2}"), "1:94: mergeWeight is 2; expected a number from 0 to 1"},
        {fileWith(", \"provenance\": {\"exemplarSegments\": 1.5}"),
         "1:99: exemplarSegments is 1.5; expected a whole number"},
        {fileWith(", \"rules\": [{\"count\": 1}]"),
         "1:73: it tells of 1 rules, but the grammar has 0; expected one entry for each production"},
        {fileWith(", \"rules\": {}"), "1:73: rules is an object; expected an array"},
        {fileWith(", \"rules\": [{\"name\": 1}]"), "1:75: a rule has the unknown key \"name\""},
        {fileWith(", \"rules\": [{\"count\": -1}]"), "1:84: count is -1; expected a whole number"},
        {fileWith(", \"rules\": [{\"limb\": \"12\"}]"), "1:83: this is no hash; expected 16"},
        {fileWith(", \"rules\": [{\"locked\": 1}]"), "1:85: locked is 1; expected true or false"},
        {fileWith(", \"rules\": [{\"nodes\": [\"0:1\"]}]"), "1:84: nodes is an array; expected a string"},
        {fileWith(", \"rules\": [{\"nodes\": \"0\"}]"), "1:84: these are no nodes; expected at most 16 of the form"},
        {fileWith(", \"rules\": [{\"nodes\": \"0:1 \"}]"), "1:84: these are no nodes"},
        {fileWith(", \"rules\": [{\"nodes\": \"0:1,0:2\"}]"), "1:84: these are no nodes"},
        {fileWith(", \"rules\": [{\"nodes\": \"0:4294967296\"}]"), "1:84: these are no nodes"},
        {fileWith(", \"rules\": [{\"nodes\": \"-1:4\"}]"), "1:84: these are no nodes"},
        {fileWith(", \"rules\": [{\"nodes\": \"" + repeated("0:1 ", 16) + "0:1\"}]"), "1:84: these are no nodes"},
        {fileWith(", \"inferred\": [\"axiom: ]\"]"), "1:85: "},
        {fileWith(", \"inferred\": [\"axiom: A\", \"A -> F\"], \"rules\": [{}, {}]"),
         "1:109: it tells of 2 rules, but the grammar as inferred has 1"},
        {fileWith(", \"conflicts\": [{\"edit\": \"x\"}]"), "1:79: a conflict has the unknown key \"edit\""},
        {fileWith(", \"conflicts\": [{\"edited\": \"x\\ny\"}]"), "1:78: a line of the conflict holds a line break"},
        {fileWith("") + "x", "1:63: unexpected 'x'; expected the end of the file"},
        {std::string(100, '['),
         "1:65: objects and arrays are nested too deeply; expected at most 64 levels (limit jsonDepth)"},
    };
    for (const Case& c : cases)
        EXPECT_EQ(errorOf(c.text).substr(0, c.message.size()), c.message) << c.text;
}

TEST(SpeciesFile, PlacesErrorsOfTheGrammarInsideItsLines)
{
    const std::string head = "{\"espalier\": \"species\", \"version\": 1,\r\n \"grammar\": [\"axiom: A\",\r\n  ";
    struct Case
    {
        std::string line;
        std::string message;
    };
    const Case cases[] = {
        {R"text("A -> F(1")text", "3:"},
        {R"text("A -> F ]")text", "3:11: "},
        {R"text("A -> \\ ]")text", "3:12: "}, // a backslash is two in the file
        {R"text("A < -> F")text", "3:8: "},
        {R"text("A -> F(s) : ~ t")text", "3:3: "}, // no such table: the line is known, the column is not
        {R"text("A -> F(s) : ~ t(1/0)")text", "3:"},
        {R"text("A -> F\nB -> F")text",
         "3:3: a line of the grammar holds a line break; expected one string for each line"},
        {"7", "3:3: a line of the grammar is 7; expected a string"},
    };
    for (const Case& c : cases)
        EXPECT_EQ(errorOf(head + c.line + "]}").substr(0, c.message.size()), c.message) << c.line;

    const std::string both = errorOf(head + "\"A -> ]\",\n \"B -> ]\"]}");
    EXPECT_EQ(both.substr(0, 6), "3:9: `");
    EXPECT_NE(both.find("\nx:4:8: "), std::string::npos) << both; // every mistake stands where it stands

    EXPECT_EQ(errorOf("{\"espalier\": \"species\", \"version\": 2, \"new\": 1}").substr(0, 38),
              "1:36: the file has version 2 of the sp");
    EXPECT_EQ(errorOf("{\"espalier\": \"species\", \"version\": 1, \"grammar\": \"axiom: F\"}").substr(0, 13),
              "1:50: grammar");
    EXPECT_EQ(errorOf("{\"espalier\": \"species\", \"version\": 1,\n\"grammar\": []}").substr(0, 6), "2:12: ")
        << "no axiom";
}

TEST(SpeciesFile, ReadsDosLineEndsAndDropsAByteOrderMarkOfAFile)
{
    std::string text = printSpecies(handMade());
    for (std::size_t at = 0; (at = text.find('\n', at)) != std::string::npos; at += 2)
        text.insert(at, 1, '\r');
    const auto species = parseSpecies(text, "dos.species");
    ASSERT_TRUE(species) << toString(species.error());
    EXPECT_EQ(*species, handMade());
}

TEST(SpeciesFile, KeepsTheLimitsItIsGiven)
{
    const std::string text = printSpecies(handMade());
    EXPECT_NE(errorOf(text, {.fileBytes = text.size() - 1}).find("limit fileBytes"), std::string::npos);
    EXPECT_EQ(errorOf(text, {.fileBytes = text.size()}), "");
    EXPECT_NE(errorOf(text, {.jsonDepth = 4}).find("limit jsonDepth"), std::string::npos);
    EXPECT_NE(errorOf(text, {.jsonValues = 10}).find("limit jsonValues"), std::string::npos);
    EXPECT_EQ(errorOf(text, {.stringBytes = 20}), ""); // a rule may be as long as its file
}

TEST(SpeciesFile, ReadsBackWhatItPrints)
{
    const Species species = handMade();
    EXPECT_EQ(species.name, "by \"hand\" é");
    EXPECT_EQ(species.window->copies, (std::vector<std::uint64_t>{0xdeadbeef, 0xffffffffffffffff}));
    EXPECT_EQ(species.tables[0].rows[1], (std::array<double, 4>{0.1, 20, 30, -90.125}));
    const std::string printed = printSpecies(species);
    const auto again = parseSpecies(printed, "again");
    ASSERT_TRUE(again) << toString(again.error());
    EXPECT_EQ(*again, species);
    EXPECT_EQ(printSpecies(*again), printed);
    EXPECT_EQ(hashOf(*again), hashOf(species));
}

TEST(SpeciesFile, RefusesAnInferredGrammarThatItsTablesDoNotFit)
{
    Species species = handMade();
    species.inferred = parseGrammar("axiom: A\nA -> F : 2 : ~ nowhere(7)", "x", {}).value();
    const auto read = parseSpecies(printSpecies(species), "odd");
    ASSERT_FALSE(read);
    EXPECT_NE(read.error().what.find("nowhere"), std::string::npos) << toString(read.error());
}

TEST(SpeciesFile, ReadsBackWhatAuthoringRemembers)
{
    Species species = handMade();
    EXPECT_EQ(printSpecies(species).find("rules"), std::string::npos); // nothing to remember, nothing written
    EXPECT_EQ(printSpecies(species).find("inferred"), std::string::npos);
    EXPECT_EQ(printSpecies(species).find("conflicts"), std::string::npos);
    species.inferred = parseGrammar("axiom: A\nA -> F : 2\nA -> F F : 1", "x", {}).value();
    species.rules = {{0xdeadbeef, 7, 40, 12, std::vector<DrawnNode>(16, {1, 4294967295u}), true}, {0, 0, 0, 1, {}}};
    species.conflicts = {{"A -> \"F\"", "", "gone \\ é"}, {"", "A -> F", ""}};
    species.provenance.grammar = "0123";
    const std::string printed = printSpecies(species);
    const auto again = parseSpecies(printed, "again");
    ASSERT_TRUE(again) << toString(again.error());
    EXPECT_EQ(*again, species);
    EXPECT_EQ(printSpecies(*again), printed);
}

TEST(SpeciesFile, NamesColoursOnlyWhereTheyDifferFromTheUsual)
{
    Species species = handMade();
    EXPECT_EQ(printSpecies(species).find("palette"), std::string::npos);
    for (const std::size_t entries : {std::size_t{1}, std::size_t{7}, kMaxPalette})
    {
        species.appearance.palette.assign(entries, Vec3(0.1f, 0.25f, 1));
        const auto again = parseSpecies(printSpecies(species), "again");
        ASSERT_TRUE(again) << toString(again.error());
        EXPECT_EQ(*again, species);
    }
    species.appearance.palette.resize(2);
    EXPECT_NE(printSpecies(species).find("\n    \"palette\": [[0.1, 0.25, 1], [0.1, 0.25, 1]]\n  },\n"),
              std::string::npos)
        << printSpecies(species);
}

TEST(SpeciesFile, ReadsBackWhatIsInferredAndGrowsTheSame)
{
    for (std::uint32_t seed = 0; seed < 10; ++seed)
        for (const std::string_view preset : inferencePresets())
        {
            const Archetype archetype = samples::randomArchetype(Seed{seed}, 1 + 3 * seed, 1 + seed % 3);
            const auto species = inferSpecies({&archetype, 1}, {.preset = std::string(preset)});
            ASSERT_TRUE(species) << toString(species.error());
            const auto again = parseSpecies(printSpecies(*species), "again");
            ASSERT_TRUE(again) << toString(again.error());
            EXPECT_EQ(*again, *species) << "seed " << seed;
            EXPECT_EQ(grow(*again, Seed{seed}).value(), grow(*species, Seed{seed}).value()) << "seed " << seed;
        }
}

TEST(SpeciesFile, FollowsEditsByHand)
{
    std::string text = printSpecies(handMade());
    const auto replace = [&](std::string_view from, std::string_view to) {
        const std::size_t at = text.find(from);
        ASSERT_NE(at, std::string::npos) << from;
        text.replace(at, from.size(), to);
    };
    replace("let w = 0.5", "let w = 0.75");
    replace("axiom: Trunk(0)", "axiom: F Trunk(0)");
    replace("\"attempts\": 8", "\"attempts\": 64");
    const auto edited = parseSpecies(text, "edited.species");
    ASSERT_TRUE(edited) << toString(edited.error());
    EXPECT_EQ(edited->window->attempts, 64u);
    EXPECT_FALSE(*edited == handMade());
    EXPECT_TRUE(grow(*edited, Seed{1}));
}

TEST_F(SpeciesOnDisk, SavesWhatLoads)
{
    const std::filesystem::path path = folder_ / "a.species";
    ASSERT_TRUE(saveSpecies(path, handMade()));
    const auto loaded = loadSpecies(path);
    ASSERT_TRUE(loaded) << toString(loaded.error());
    EXPECT_EQ(*loaded, handMade());

    ASSERT_TRUE(writeFileAtomically(path, "\xEF\xBB\xBF" + printSpecies(handMade()))); // an editor's byte order mark
    EXPECT_EQ(loadSpecies(path).value(), handMade());
    EXPECT_EQ(loadSpecies(folder_ / "none.species").error().kind, ErrorKind::Io);
    EXPECT_EQ(loadSpecies(path, {.fileBytes = 10}).error().kind, ErrorKind::Limit);
}

TEST_F(SpeciesOnDisk, RefusesToSaveWhatCouldNotBeReadAndKeepsTheOldFile)
{
    const std::filesystem::path path = folder_ / "a.species";
    ASSERT_TRUE(saveSpecies(path, handMade()));
    Species missingTable = handMade();
    missingTable.tables.clear();
    Species badName = handMade();
    badName.name = "\xFF";
    Species badWindow = handMade();
    badWindow.window->attempts = 0;
    Species badWeight = handMade();
    badWeight.provenance.mergeWeight = 2;
    Species twoTables = handMade();
    twoTables.tables.push_back(twoTables.tables[0]);
    Species noColour = handMade();
    noColour.appearance.palette.clear();
    for (const Species& broken : {missingTable, badName, badWindow, badWeight, twoTables, noColour})
        EXPECT_FALSE(saveSpecies(path, broken)) << printSpecies(broken);
    const std::size_t bytes = printSpecies(handMade()).size();
    Species other = handMade();
    other.name += 's';
    EXPECT_NE(toString(saveSpecies(path, other, {.fileBytes = bytes}).error()).find("limit fileBytes"),
              std::string::npos);
    EXPECT_EQ(loadSpecies(path).value(), handMade());
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder_), {}), 1) << "a temporary file is left";
    EXPECT_TRUE(saveSpecies(path, other, {.fileBytes = bytes + 1}));
    EXPECT_FALSE(saveSpecies(folder_ / "missing" / "a.species", handMade()));
}

} // namespace espalier
