#include <Espalier/Archetype/Placement.h>
#include <Espalier/Plant/Measure.h>
#include <gtest/gtest.h>
#include <string>

namespace espalier {
namespace {

Template pieceOf(std::string_view word)
{
    auto library = parseTemplates(word, "t.templates", {});
    EXPECT_TRUE(library) << word << (library ? "" : toString(library.error()));
    return library ? library->templates[0] : Template{};
}

/// The placed word with its parameters for one transform.
std::string placed(std::string_view word, const InstanceTransform& transform)
{
    std::string text;
    for (const PlacedModule& module : placeTemplate(pieceOf(word)))
    {
        text += module.symbol;
        if (module.source != ParameterSource::None)
            text += '(' + std::to_string(static_cast<int>(parameterValue(module, transform))) + ')';
    }
    return text;
}

/// A tree of one template, or of two where `child` hangs at the first anchor.
Skeleton drawn(std::string_view word, const InstanceTransform& transform, std::string_view child = {},
               const InstanceTransform& childTransform = {})
{
    Archetype archetype;
    archetype.library.templates = {pieceOf(word)};
    archetype.instances = {{0, kNoInstance, 0, transform}};
    if (!child.empty())
    {
        archetype.library.templates.push_back(pieceOf(child));
        archetype.library.templates[1].name = "II";
        archetype.instances.push_back({1, 0, 0, childTransform});
    }
    EXPECT_TRUE(validate(archetype));
    auto skeleton = drawArchetype(archetype);
    EXPECT_TRUE(skeleton) << (skeleton ? "" : toString(skeleton.error()));
    return skeleton ? std::move(*skeleton) : Skeleton{};
}

void expectAt(const Vec3& a, const Vec3& b)
{
    EXPECT_NEAR(a.x, b.x, 1e-6);
    EXPECT_NEAR(a.y, b.y, 1e-6);
    EXPECT_NEAR(a.z, b.z, 1e-6);
}

TEST(Placement, EachSymbolTakesWhatConcernsIt)
{
    const InstanceTransform t{3, 20, 40, 7};
    struct Case
    {
        const char* word;
        const char* placed;
    };
    const Case cases[] = {
        {"FX", "/(7)+(20)F(3)X"},
        {"F[-FX]+FY", "/(7)+(20)F(3)[-(40)F(3)X]+(40)F(3)Y"},
        {"+FX", "/(7)+(60)F(3)X"},
        {"-F-F", "/(7)-(60)F(3)-(40)F(3)"},
        {"-(10)F", "/(7)-(30)F(3)"},
        {"[+F]", "/(7)+(20)[+(40)F(3)]"},
        {"&F^(5)F", "/(7)+(20)&(40)F(3)^(5)F(3)"},
        {"F(2)f(4)G", "/(7)+(20)F(6)f(12)G(3)"},
        {"/F\\(9)F|$F", "/(7)+(20)/F(3)\\(9)F(3)|$F(3)"},
        {"!(2)F!F'(1)F'", "/(7)+(20)!(2)F(3)!F(3)'(1)F(3)'"},
        {"~FF~X.{}@%", "/(7)+(20)~FF(3)~X.{}@%"},
    };
    for (const Case& c : cases)
        EXPECT_EQ(placed(c.word, t), c.placed) << c.word;
}

TEST(Placement, ScalingStretchesAnInstanceAndNotItsChildren)
{
    const Skeleton skeleton = drawn("F(2)X", {3, 0, 45, 0}, "FF");
    EXPECT_EQ(skeleton.lengths, (std::vector<float>{6, 1, 1}));
    EXPECT_EQ(skeleton.ends[2], Vec3(0, 8, 0));
    EXPECT_EQ(drawn("FX", {}, "F", {0.5, 0, 45, 0}).lengths, (std::vector<float>{1, 0.5f}));
}

TEST(Placement, RotationTurnsTheWholeOrTheFirstTurn)
{
    expectAt(drawn("FF", {1, 90, 45, 0}).ends[1], {-2, 0, 0});
    expectAt(drawn("F+F", {1, 90, 90, 0}).ends[1], {-1, -1, 0});
    expectAt(drawn("+F", {1, 50, 40, 0}).ends[0], {-1, 0, 0});
    expectAt(drawn("-F", {1, 50, 40, 0}).ends[0], {1, 0, 0});
    expectAt(drawn("-F", {1, -40, 40, 0}).ends[0], {0, 1, 0});
    expectAt(drawn("+(30)F", {1, 60, 11, 0}).ends[0], {-1, 0, 0});
    expectAt(drawn("FX", {}, "F", {1, 90, 0, 0}).ends[1], {-1, 1, 0});
}

TEST(Placement, TheBranchingAngleIsThatOfTurnsWithoutANumber)
{
    expectAt(drawn("F+F", {1, 0, 90, 0}).ends[1], {-1, 1, 0});
    expectAt(drawn("F-F", {1, 0, 90, 0}).ends[1], {1, 1, 0});
    expectAt(drawn("F&F", {1, 0, 90, 0}).ends[1], {0, 1, -1});
    expectAt(drawn("F^F", {1, 0, 90, 0}).ends[1], {0, 1, 1});
    expectAt(drawn("F+(0)F", {1, 0, 90, 0}).ends[1], {0, 2, 0});
    expectAt(drawn("F/(90)+F", {1, 0, 90, 0}).ends[1], {0, 1, 1});
    expectAt(drawn("FX", {1, 0, 90, 0}, "F+F", {1, 0, 0, 0}).ends[2], {0, 3, 0});
}

TEST(Placement, RollTurnsAboutTheDirectionOfGrowthBeforeEverything)
{
    expectAt(drawn("F+F", {1, 0, 90, 90}).ends[1], {0, 1, 1});
    expectAt(drawn("F", {1, 90, 45, 90}).ends[0], {0, 0, 1});
    expectAt(drawn("FX", {1, 0, 45, 0}, "+F", {1, 0, 90, 180}).ends[1], {1, 1, 0});
}

TEST(Placement, InstancesNestAsInTheArchetype)
{
    const Skeleton skeleton = drawn("F[-FX]+F", {}, "FF");
    EXPECT_EQ(skeleton.instances, (std::vector<std::uint32_t>{0, 0, 1, 1, 0}));
    EXPECT_EQ(skeleton.instanceRecords, (std::vector<SkeletonInstance>{{kNoSegment, 0, 0}, {0, 1, 1}}));
    EXPECT_EQ(skeleton.parents, (std::vector<std::uint32_t>{kNoSegment, 0, 1, 2, 0}));
}

TEST(Placement, ATreeThatIsNotThereOrTooLargeIsRefused)
{
    Archetype archetype;
    archetype.library.templates = {pieceOf("FF")};
    archetype.instances = {{}, {}};
    EXPECT_TRUE(drawArchetype(archetype, 1));
    const auto third = drawArchetype(archetype, 2);
    ASSERT_FALSE(third);
    EXPECT_NE(toString(third.error()).find("no tree number 3"), std::string::npos);
    Limits limits;
    limits.nodes = 1;
    EXPECT_EQ(drawArchetype(archetype, 0, limits).error().kind, ErrorKind::Limit);
    archetype.instances[0].transform.scaling = 1e5;
    EXPECT_EQ(drawArchetype(archetype).error().kind, ErrorKind::Limit);
}

/// The worked example of the thesis; its segments and instances are published, the lengths follow from the scalings.
TEST(Placement, TheTreeOfTheThesisHasItsFacts)
{
    const auto archetype = loadArchetype(std::string(ESPALIER_SOURCE_ROOT) + "/Content/Thesis.archetype",
                                         {{std::string(ESPALIER_SOURCE_ROOT) + "/Templates"}});
    ASSERT_TRUE(archetype) << toString(archetype.error());
    EXPECT_EQ(archetype->instances.size(), 17u);
    const auto skeleton = drawArchetype(*archetype);
    ASSERT_TRUE(skeleton) << toString(skeleton.error());
    const SkeletonFacts facts = measure(*skeleton);
    EXPECT_EQ(facts.segments, 55u);
    EXPECT_EQ(facts.instances, 17u);
    EXPECT_NEAR(facts.totalLength, 52, 1e-5);
    EXPECT_EQ(facts.tips, 18u);
    double total = 0; // a second way: segments of each template times the instance's scaling
    for (const TemplateInstance& instance : archetype->instances)
        for (const TemplateModule& module : archetype->library.templates[instance.piece].modules)
            total += module.symbol == 'F' ? instance.transform.scaling : 0;
    EXPECT_NEAR(total, 52, 1e-12);
}

} // namespace
} // namespace espalier
