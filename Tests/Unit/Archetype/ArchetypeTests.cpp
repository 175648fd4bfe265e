#include <Espalier/Archetype/Archetype.h>
#include <Espalier/Archetype/Placement.h>
#include <Espalier/Core/File.h>
#include <Espalier/Core/Json.h>
#include <Espalier/Core/Random.h>
#include <Espalier/Plant/Measure.h>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <functional>
#include <gtest/gtest.h>
#include <limits>
#include <unistd.h>

namespace espalier {
namespace {

const char* const kThesisTemplates = "FX\nF-FX\nF+FX\nF[-FX]+FY\nF[-FX]FY\nF[FX]+FY\nF[-FX][FY]+FZ\nF[+FX]F[-FY]FZ\n";

TemplateLibrary libraryOf(std::string_view text)
{
    auto library = parseTemplates(text, "t.templates", {});
    EXPECT_TRUE(library) << (library ? "" : toString(library.error()));
    return library ? std::move(*library) : TemplateLibrary{};
}

/// A whole file around the text of its trees.
std::string fileOf(const std::string& trees)
{
    return "{\"espalier\": \"archetype\", \"version\": 1, \"library\": \"t.templates\",\n\"trees\": [\n" + trees + "]}";
}

Expected<Archetype> read(const std::string& text, const Limits& limits = {})
{
    return parseArchetype(text, "a.archetype", libraryOf(kThesisTemplates), limits);
}

Archetype parsed(const std::string& trees)
{
    auto archetype = read(fileOf(trees));
    EXPECT_TRUE(archetype) << trees << "\n" << (archetype ? "" : toString(archetype.error()));
    return archetype ? std::move(*archetype) : Archetype{};
}

/// `depth` instances on top of each other.
std::string chain(std::size_t depth)
{
    std::string text;
    for (std::size_t i = 1; i < depth; ++i)
        text += "{\"template\":\"I\",\"children\":{\"X\":";
    text += "{\"template\":\"I\"}";
    for (std::size_t i = 1; i < depth; ++i)
        text += "}}";
    return text;
}

Archetype twoInstances()
{
    return parsed(R"({"template": "IV", "children": {"Y": {"template": "II"}}})");
}

TEST(ArchetypeValidation, RefusesWhatCannotBe)
{
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
    struct Case
    {
        const char* message; ///< Empty: it is allowed.
        std::function<void(Archetype&)> change;
    };
    const Case cases[] = {
        {"", [](Archetype&) {}},
        {"no template instance", [](Archetype& a) { a.instances.clear(); }},
        {"instance 1: it names template number 8; expected one of the library's 8",
         [](Archetype& a) { a.instances[1].piece = 8; }},
        {"instance 1: its parent's template IV has no anchor number 2",
         [](Archetype& a) { a.instances[1].anchor = 2; }},
        {"instance 1: it hangs on instance 1, which does not come before it",
         [](Archetype& a) { a.instances[1].parent = 1; }},
        {"instance 0: it hangs on instance 1", [](Archetype& a) { a.instances[0].parent = 1; }},
        {"instance 1: it hangs on instance 7", [](Archetype& a) { a.instances[1].parent = 7; }},
        {"instance 2: the anchor it hangs at has a child already",
         [](Archetype& a) { a.instances.push_back(a.instances[1]); }},
        {"", [](Archetype& a) { a.instances.push_back(a.instances[0]); }}, // a second tree
        {"instance 1: the scaling is 0", [](Archetype& a) { a.instances[1].transform.scaling = 0; }},
        {"the scaling is -1", [](Archetype& a) { a.instances[0].transform.scaling = -1; }},
        {"the scaling is not finite", [=](Archetype& a) { a.instances[0].transform.scaling = kNan; }},
        {"the scaling is not finite", [=](Archetype& a) { a.instances[0].transform.scaling = kInfinity; }},
        {"the scaling is 100001", [](Archetype& a) { a.instances[0].transform.scaling = 100001; }},
        {"", [](Archetype& a) { a.instances[0].transform.scaling = 1e-300; }},
        {"", [](Archetype& a) { a.instances[0].transform.rotation = -3600; }},
        {"an angle is", [](Archetype& a) { a.instances[0].transform.rotation = -3600.5; }},
        {"an angle is", [](Archetype& a) { a.instances[1].transform.branchingAngle = 3601; }},
        {"an angle is", [=](Archetype& a) { a.instances[1].transform.branchingAngle = kNan; }},
        {"an angle is", [=](Archetype& a) { a.instances[1].transform.roll = -kInfinity; }},
    };
    for (const Case& c : cases)
    {
        Archetype archetype = twoInstances();
        c.change(archetype);
        const auto done = validate(archetype);
        if (*c.message == 0)
        {
            EXPECT_TRUE(done) << (done ? "" : toString(done.error()));
            continue;
        }
        ASSERT_FALSE(done) << c.message;
        EXPECT_NE(toString(done.error()).find(c.message), std::string::npos) << toString(done.error());
    }
    Limits limits;
    limits.inferredNodes = 1;
    EXPECT_EQ(validate(twoInstances(), limits).error().kind, ErrorKind::Limit);
}

TEST(ArchetypeFile, TreesAreReadDepthFirst)
{
    const Archetype archetype = parsed(R"({"template": "VII", "children": {
        "X": {"template": "III", "rotation": 20, "children": {"X": {"template": "I"}}},
        "Y": null,
        "Z": {"template": "II", "scaling": 0.5, "branchingAngle": -30, "roll": 720}}},
        {"template": "I", "children": {}})");
    ASSERT_EQ(archetype.instances.size(), 5u);
    EXPECT_TRUE(validate(archetype));
    EXPECT_EQ(archetype.libraryName, "t.templates");
    const auto is = [&](std::size_t i, std::uint32_t piece, std::uint32_t parent, std::uint32_t anchor,
                        InstanceTransform t) {
        EXPECT_TRUE((archetype.instances[i] == TemplateInstance{piece, parent, anchor, t})) << i;
    };
    is(0, 6, kNoInstance, 0, {});
    is(1, 2, 0, 0, {1, 20, 45, 0});
    is(2, 0, 1, 0, {});
    is(3, 1, 0, 2, {0.5, 0, -30, 720});
    is(4, 0, kNoInstance, 0, {});

    const AnchorTable anchors = anchorsOf(archetype);
    EXPECT_EQ(anchors.roots, (std::vector<std::uint32_t>{0, 4}));
    EXPECT_EQ(anchors.children,
              (std::vector<std::uint32_t>{1, kNoInstance, 3, 2, kNoInstance, kNoInstance, kNoInstance}));
    EXPECT_EQ(anchors.firstChild, (std::vector<std::uint32_t>{0, 3, 4, 5, 6, 7}));
}

TEST(ArchetypeFile, EveryMistakeIsReportedWhereItStands)
{
    const auto headed = [](const char* head) {
        return std::string("{") + head + ",\n\"trees\": [{\"template\": \"I\"}]}";
    };
    struct Case
    {
        std::string text;
        std::uint32_t line, column;
        const char* message;
    };
    const Case cases[] = {
        {"", 1, 1, "the file is empty"},
        {"{", 1, 2, "too early"},
        {"[]", 1, 1, "expected"},
        {"{}", 1, 1, "the key \"espalier\" is missing"},
        {headed(R"("version": 1, "library": "t")"), 1, 1, "the key \"espalier\" is missing"},
        {headed(R"("espalier": "archetype", "library": "t")"), 1, 1, "the key \"version\" is missing"},
        {headed(R"("espalier": "archetype", "version": 1)"), 1, 1, "the key \"library\" is missing"},
        {R"({"espalier": "archetype", "version": 1, "library": "t"})", 1, 1, "the key \"trees\" is missing"},
        {headed(R"("espalier": "species", "version": 1, "library": "t")"), 1, 14,
         "this is a file of the kind \"species\""},
        {headed(R"("espalier": 1, "version": 1, "library": "t")"), 1, 14, "espalier"},
        {headed(R"("espalier": "archetype", "version": 2, "library": "t")"), 1, 38,
         "version 2 of the archetype format; expected version 1; open it with a newer"},
        {headed(R"("espalier": "archetype", "version": 0, "library": "t")"), 1, 38, "version 0"},
        {headed(R"("espalier": "archetype", "version": "1", "library": "t")"), 1, 38, "version"},
        {headed(R"("espalier": "archetype", "version": 1, "library": 5)"), 1, 52, "library"},
        {headed(R"("espalier": "archetype", "version": 1, "library": "t", "colour": 1)"), 1, 57, "\"colour\""},
        {R"({"espalier": "archetype", "version": 1, "library": "t", "trees": []})", 1, 66, "the archetype has no tree"},
        {R"({"espalier": "archetype", "version": 1, "library": "t", "trees": {}})", 1, 66, "trees"},
        {fileOf("null"), 3, 1, "a template instance"},
        {fileOf("[]"), 3, 1, "a template instance"},
        {fileOf("{}"), 3, 1, "the key \"template\" is missing"},
        {fileOf(R"({"template": 7})"), 3, 14, "template"},
        {fileOf(R"({"template": "IX"})"), 3, 14,
         "the library \"t.templates\" has no template \"IX\"; expected one of I, II, III"},
        {fileOf(R"({"template": "I", "size": 2})"), 3, 19, "\"size\""},
        {fileOf(R"({"template": "I", "scaling": 0})"), 3, 30, "the scaling is 0"},
        {fileOf(R"({"template": "I", "scaling": -2})"), 3, 30, "scaling"},
        {fileOf(R"({"template": "I", "scaling": "2"})"), 3, 30, "scaling"},
        {fileOf(R"({"template": "I", "scaling": 1e400})"), 3, 30, "1e400 is too large"},
        {fileOf(R"({"template": "I", "scaling": NaN})"), 3, 30, "unexpected 'NaN'"},
        {fileOf(R"({"template": "I", "scaling": null})"), 3, 30, "scaling"},
        {fileOf(R"({"template": "I", "rotation": 3601})"), 3, 31, "rotation"},
        {fileOf(R"({"template": "I", "branchingAngle": -3601})"), 3, 37, "branchingAngle"},
        {fileOf(R"({"template": "I", "roll": true})"), 3, 27, "roll"},
        {fileOf(R"({"template": "I", "children": []})"), 3, 31, "children"},
        {fileOf(R"({"template": "I", "children": {"Y": {"template": "I"}}})"), 3, 32,
         "the template I has no anchor \"Y\"; expected one of its anchors: X"},
        {fileOf(R"({"template": "I", "children": {"XX": null}})"), 3, 32, "no anchor \"XX\""},
        {fileOf(R"({"template": "I", "children": {"": null}})"), 3, 32, "no anchor \"\""},
        {fileOf("{\"template\": \"I\", \"children\": {\n\"X\": {\"template\": \"I\"},\n\"X\": {\"template\": \"I\"}}}"),
         5, 1, "a second time"},
        {fileOf(R"({"template": "I", "children": {"X": {"template": "I", "roll": 1e9}}})"), 3, 63, "roll"},
        {fileOf("{\"template\": \"\xff\"}"), 3, 15, "UTF-8"},
    };
    for (const Case& c : cases)
    {
        const auto archetype = read(c.text);
        ASSERT_FALSE(archetype) << c.text;
        const Error& error = archetype.error();
        EXPECT_EQ(error.where.file, "a.archetype");
        EXPECT_EQ(error.where.line, c.line) << c.text << "\n" << toString(error);
        EXPECT_EQ(error.where.column, c.column) << c.text << "\n" << toString(error);
        EXPECT_NE(toString(error).find(c.message), std::string::npos) << c.text << "\n" << toString(error);
    }
}

TEST(ArchetypeFile, EveryTruncationIsAnError)
{
    const std::string text = printArchetype(twoInstances());
    for (std::size_t length = 0; length + 2 < text.size(); ++length)
        ASSERT_FALSE(read(text.substr(0, length))) << text.substr(0, length);
}

TEST(ArchetypeFile, SixtyFourInstancesMayStandOnEachOther)
{
    EXPECT_EQ(parsed(chain(64)).instances.size(), 64u);
    for (const std::size_t depth : {std::size_t{65}, std::size_t{100000}})
    {
        const auto start = std::chrono::steady_clock::now();
        const auto deep = read(fileOf(chain(depth)));
        ASSERT_FALSE(deep);
        EXPECT_EQ(deep.error().kind, ErrorKind::Limit);
        EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), 0.5);
    }
}

TEST(ArchetypeFile, TheNumberOfInstancesIsLimited)
{
    Limits limits;
    limits.nodes = 3;
    EXPECT_TRUE(read(fileOf(chain(3)), limits));
    const auto many = read(fileOf(chain(4)), limits);
    ASSERT_FALSE(many);
    EXPECT_EQ(many.error().kind, ErrorKind::Limit);
    EXPECT_EQ(many.error().where.line, 3u);
}

Archetype randomArchetype(std::uint64_t seed)
{
    const RandomKey key(Seed{seed});
    std::uint32_t counter = 0;
    const auto below = [&](std::uint64_t count) { return key.below(Purpose::Sampling, count, counter++); };
    constexpr double kScalings[] = {1, 0.5, 1.0 / 3, 1e5, 1e-9};
    constexpr double kAngles[] = {0, 45, -45, 137.5, 3600, -3600, 1.0 / 3, -1e-9};
    Archetype archetype;
    archetype.libraryName = "thesis \"quoted\" \xc3\xa4.templates";
    archetype.library = libraryOf(kThesisTemplates);
    // Depth first, children in the order of the anchors: the order in which a file is read.
    const std::function<void(std::uint32_t, std::uint32_t, int)> add = [&](std::uint32_t parent, std::uint32_t anchor,
                                                                           int depth) {
        const auto index = static_cast<std::uint32_t>(archetype.instances.size());
        TemplateInstance instance{static_cast<std::uint32_t>(below(8)), parent, anchor, {}};
        if (below(2) == 0)
            instance.transform = {kScalings[below(5)], kAngles[below(8)], kAngles[below(8)], kAngles[below(8)]};
        archetype.instances.push_back(instance);
        const std::size_t anchors = archetype.library.templates[instance.piece].anchors.size();
        for (std::uint32_t a = 0; a < anchors; ++a)
            if (depth < 6 && below(2) == 0)
                add(index, a, depth + 1);
    };
    for (std::uint64_t trees = 1 + below(3); trees > 0; --trees)
        add(kNoInstance, 0, 1);
    return archetype;
}

TEST(ArchetypeFile, WhatIsPrintedIsReadBack)
{
    for (std::uint64_t seed = 0; seed < 300; ++seed)
    {
        const Archetype archetype = randomArchetype(seed);
        ASSERT_TRUE(validate(archetype));
        const std::string text = printArchetype(archetype);
        const auto back = parseArchetype(text, "a.archetype", archetype.library, {});
        ASSERT_TRUE(back) << toString(back.error()) << "\n" << text;
        ASSERT_TRUE(*back == archetype) << "seed " << seed << "\n" << text;
        ASSERT_EQ(printArchetype(*back), text);
    }
}

/// A folder of its own that is gone afterwards.
class ArchetypeLookup : public testing::Test
{
protected:
    void SetUp() override
    {
        folder = std::filesystem::temp_directory_path() / ("espalier-archetypes-" + std::to_string(::getpid()));
        std::filesystem::remove_all(folder);
        std::filesystem::create_directories(folder / "own" / "sub");
        std::filesystem::create_directories(folder / "shared");
    }
    void TearDown() override { std::filesystem::remove_all(folder); }

    void write(const char* path, std::string_view text) const { ASSERT_TRUE(writeFileAtomically(folder / path, text)); }

    /// Loads own/a.archetype, which names `library`.
    [[nodiscard]] Expected<Archetype> loadWith(const std::string& library) const
    {
        write("own/a.archetype", "{\"espalier\": \"archetype\", \"version\": 1, \"library\": " + quoteJson(library) +
                                     ", \"trees\": [{\"template\": \"I\"}]}");
        return loadArchetype(folder / "own" / "a.archetype", {{folder / "shared"}});
    }

    std::filesystem::path folder;
};

TEST_F(ArchetypeLookup, TheLibraryIsSoughtBesideTheArchetypeThenInTheFolders)
{
    write("shared/t.templates", "F\n");
    EXPECT_EQ(loadWith("t.templates")->library.templates[0].modules.size(), 1u);
    write("own/t.templates", "FF\n");
    EXPECT_EQ(loadWith("t.templates")->library.templates[0].modules.size(), 2u);
    EXPECT_EQ(loadWith("t.templates")->libraryName, "t.templates");
    write("own/sub/t.templates", "FFF\n");
    EXPECT_EQ(loadWith("sub/t.templates")->library.templates[0].modules.size(), 3u);
}

TEST_F(ArchetypeLookup, AMissingLibraryNamesTheFoldersSearched)
{
    const auto missing = loadWith("none.templates");
    ASSERT_FALSE(missing);
    const std::string text = toString(missing.error());
    EXPECT_NE(text.find("\"none.templates\" is not found in " + (folder / "own").string() + ", " +
                        (folder / "shared").string()),
              std::string::npos)
        << text;
    EXPECT_EQ(missing.error().where.line, 1u);
    EXPECT_EQ(missing.error().where.column, 52u);
}

TEST_F(ArchetypeLookup, ALibraryPathMayNotLeaveTheFolders)
{
    write("t.templates", "F\n");
    for (const std::string& path :
         {std::string("../t.templates"), std::string("sub/../../t.templates"), std::string("sub/.."),
          (folder / "t.templates").string(), std::string("..\\t.templates"), std::string("sub\\t.templates"),
          std::string(".."), std::string(), std::string("t\0.templates", 12)})
    {
        const auto archetype = loadWith(path);
        ASSERT_FALSE(archetype) << path;
        EXPECT_NE(archetype.error().what.find("leaves the folders"), std::string::npos) << toString(archetype.error());
        EXPECT_EQ(archetype.error().where.column, 52u);
    }
    EXPECT_FALSE(loadWith("sub")) << "a folder is no library";
    EXPECT_FALSE(loadWith("."));
}

TEST_F(ArchetypeLookup, MistakesInTheLibraryNameTheLibrary)
{
    write("own/t.templates", "F\nF]\n");
    const auto archetype = loadWith("t.templates");
    ASSERT_FALSE(archetype);
    EXPECT_EQ(archetype.error().where.file, (folder / "own" / "t.templates").string());
    EXPECT_EQ(archetype.error().where.line, 2u);
}

TEST_F(ArchetypeLookup, WhatIsSavedIsLoaded)
{
    Archetype archetype = randomArchetype(11);
    archetype.libraryName = "t.templates";
    ASSERT_TRUE(saveTemplates(folder / "own" / "t.templates", archetype.library));
    ASSERT_TRUE(saveArchetype(folder / "own" / "a.archetype", archetype));
    const auto loaded = loadArchetype(folder / "own" / "a.archetype");
    ASSERT_TRUE(loaded) << toString(loaded.error());
    EXPECT_TRUE(*loaded == archetype);

    const auto text = readFile(folder / "own" / "a.archetype", 1 << 20);
    std::string crlf = "\xef\xbb\xbf";
    for (const char c : *text)
        crlf += c == '\n' ? std::string("\r\n") : std::string(1, c);
    write("own/a.archetype", crlf);
    EXPECT_TRUE(*loadArchetype(folder / "own" / "a.archetype") == archetype) << "byte order mark and CR LF";
}

TEST_F(ArchetypeLookup, WhatCouldNotBeLoadedIsNotSaved)
{
    Archetype archetype = twoInstances();
    archetype.instances[1].transform.scaling = -1;
    EXPECT_FALSE(saveArchetype(folder / "a.archetype", archetype));
    archetype = parsed(chain(64));
    EXPECT_TRUE(saveArchetype(folder / "a.archetype", archetype));
    archetype.instances.push_back({0, 63, 0, {}});
    const auto deep = saveArchetype(folder / "b.archetype", archetype);
    ASSERT_FALSE(deep);
    EXPECT_EQ(deep.error().kind, ErrorKind::Limit);
    EXPECT_FALSE(std::filesystem::exists(folder / "b.archetype"));
    EXPECT_EQ(loadArchetype(folder / "c.archetype").error().kind, ErrorKind::Io);
}

} // namespace
} // namespace espalier
