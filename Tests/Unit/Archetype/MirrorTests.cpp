#include <Espalier/Archetype/Mirror.h>

#include <Espalier/Archetype/Placement.h>
#include <Espalier/Inference/Exemplars.h>
#include <Espalier/Inference/Inference.h>
#include <Espalier/Species/Grow.h>
#include <Inference/SampleArchetypes.h>
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>

namespace espalier {

namespace {

std::string imageOf(const std::string& word)
{
    return printWord(mirrorImage(parseTemplates(word, "test.templates", {}).value().templates[0]));
}

/// The second skeleton is the first in a mirror that stands in the plane of +Y and +Z.
void expectMirrored(const Skeleton& drawn, const Skeleton& image)
{
    ASSERT_EQ(image.size(), drawn.size());
    EXPECT_EQ(image.parents, drawn.parents);
    for (std::uint32_t i = 0; i < drawn.size(); ++i)
    {
        EXPECT_NEAR(image.ends[i].x, -drawn.ends[i].x, 1e-4) << i;
        EXPECT_NEAR(image.ends[i].y, drawn.ends[i].y, 1e-4) << i;
        EXPECT_NEAR(image.ends[i].z, drawn.ends[i].z, 1e-4) << i;
    }
}

double meanX(const Skeleton& skeleton)
{
    double sum = 0;
    for (const Vec3& end : skeleton.ends)
        sum += end.x;
    return sum / skeleton.size();
}

/// A stem with branches on its left alone, of some different sizes, that bend to the sky.
Archetype oneSided()
{
    const std::string twig = R"({"template": "twig"})";
    const std::string branch = R"({"template": "branch", "children": {"A": )" + twig + R"(, "Z": )" + twig + "}}";
    const std::string large = R"({"template": "branch", "children": {"A": )" + branch + R"(, "Z": )" + branch + "}}";
    std::string tree = branch;
    for (const std::string& side : {branch, branch, large, branch, large, large, branch, large})
        tree = R"({"template": "stem", "children": {"A": )" + side + R"(, "Z": )" + tree + "}}";
    return samples::read("stem: F[+(60)A]FZ\nbranch: F[+(10)A]F-(20)F-(20)FZ\ntwig: F\n", tree);
}

} // namespace

TEST(Mirror, ShowsATemplatesLeftOnItsRight)
{
    EXPECT_EQ(imageOf("F[-FX]+FY"), "F[+FX]-FY");
    EXPECT_EQ(imageOf("F/(35)[&(20)X]\\^F!(0.1)"), "F\\(35)[&(20)X]/^F!(0.1)");
    EXPECT_EQ(imageOf("F(0.5)FX"), "F(0.5)FX");
    EXPECT_EQ(imageOf("-(10)F+FX"), "-(10)F-FX") << "the first turn is the instance's";
    for (const Template& piece : samples::mixedLibrary().templates)
        EXPECT_EQ(printWord(mirrorImage(mirrorImage(piece))), printWord(piece));
    EXPECT_EQ(mirrorImage(samples::mixedLibrary().templates[0]).name, "fork_mirrored");
    EXPECT_EQ(mirrorImage(samples::mixedLibrary().templates[3]).name, "shoot") << "it is symmetric";
}

TEST(Mirror, ImagesAreOfTheKindOfWhatTheyShow)
{
    const auto kinds = [](const std::string& text) { return kindsOf(parseTemplates(text, "t.templates", {}).value()); };
    EXPECT_EQ(kinds("a: F+X\na_mirrored: F-X\nb: F+X\na_bent1: F+FX\na_bent1_mirrored: F-FX\na_mirrored_2: FFX\n"),
              (std::vector<std::uint32_t>{0, 0, 2, 0, 0, 0}));
    EXPECT_EQ(kinds("a: F+X\na_mirrored: F-Y\na_mirrored_mirrored: F[+X]\n"), (std::vector<std::uint32_t>{0, 1, 0}))
        << "other anchors make another piece";
}

TEST(Mirror, ShowsATreeSegmentBySegment)
{
    for (const char* name : {"Thesis", "Oak", "Spruce", "Palm", "Willow", "Birch"})
    {
        SCOPED_TRACE(name);
        const std::filesystem::path root = ESPALIER_SOURCE_ROOT;
        const Archetype drawn =
            loadArchetype(root / "Content" / (std::string(name) + ".archetype"), {{root / "Templates"}}).value();
        expectMirrored(drawArchetype(drawn).value(), drawArchetype(mirrorImage(drawn)).value());
    }
    for (std::uint64_t seed = 1; seed <= 50; ++seed)
    {
        SCOPED_TRACE(seed);
        const Archetype drawn = samples::randomArchetype(Seed{seed}, 20);
        expectMirrored(drawArchetype(drawn).value(), drawArchetype(mirrorImage(drawn)).value());
    }
}

TEST(Mirror, IsTaughtBesideWhatWasDrawn)
{
    const Archetype drawn = samples::thesis();
    const Species species = inferSpecies({&drawn, 1}, {.mirror = true}).value();
    EXPECT_EQ(parseSpecies(printSpecies(species), "test").value(), species);
    ASSERT_EQ(species.provenance.exemplars, 2u);
    EXPECT_EQ(species.provenance.exemplarInstances, drawn.instances.size());
    GrowScratch scratch;
    Skeleton exemplar;
    Skeleton image;
    ASSERT_TRUE(Grower::makeExemplar(species, 0)->grow(Seed{9}, {}, scratch, exemplar));
    ASSERT_TRUE(Grower::makeExemplar(species, 1)->grow(Seed{9}, {}, scratch, image));
    EXPECT_EQ(exemplar.ends, drawArchetype(drawn)->ends);
    expectMirrored(exemplar, image);
    // What the rules stand for is told of what was drawn.
    std::size_t instances = 0;
    for (const RuleOrigin& rule : species.rules)
        for (const DrawnNode& node : rule.nodes)
        {
            EXPECT_EQ(node.tree, 0u);
            ++instances;
        }
    EXPECT_GE(instances, drawn.instances.size());
    EXPECT_EQ(exemplarsOf({&drawn, 1}, species.provenance)->instances.size(), 2 * drawn.instances.size());
}

TEST(Mirror, LetsBranchesComeToEitherSide)
{
    const Archetype drawn = oneSided();
    const auto leaning = [&](bool mirror) {
        const Species species = inferSpecies({&drawn, 1}, {.mirror = mirror}).value();
        const Grower grower = Grower::make(species).value();
        GrowScratch scratch;
        Skeleton tree;
        int left = 0;
        for (std::uint64_t seed = 1; seed <= 200; ++seed)
        {
            EXPECT_TRUE(grower.grow(Seed{seed}, {}, scratch, tree));
            left += meanX(tree) < 0;
        }
        return left;
    };
    EXPECT_GE(leaning(false), 180);
    EXPECT_NEAR(leaning(true), 100, 30);
}

TEST(Mirror, KeepsWhatBendsToTheSkyBentSo)
{
    const std::string twig = R"({"template": "twig"})";
    std::string trunk = twig;
    for (int i = 0; i < 8; ++i)
        trunk = R"({"template": "stem", "children": {"A": {"template": "branch", "children": {")" +
                std::string(i % 3 == 0 ? "A" : "Z") + R"(": )" + twig + R"(}}, "Z": )" + trunk + "}}";
    const Archetype drawn = samples::read("stem: F[+(60)A]FZ\nbranch: F[+(10)A]F-(20)F-(20)FZ\ntwig: F\n", trunk);
    const Species species = inferSpecies({&drawn, 1}, {.mergeWeight = 1.0, .mirror = true}).value();
    GrowScratch scratch;
    Skeleton tree;
    int branches = 0;
    for (std::uint64_t seed = 1; seed <= 100; ++seed)
    {
        ASSERT_TRUE(Grower::make(species)->grow(Seed{seed}, {}, scratch, tree));
        std::vector<std::vector<float>> rises(tree.instanceRecords.size()); // of its segments
        for (std::uint32_t segment = 0; segment < tree.size(); ++segment)
            rises[tree.instances[segment]].push_back(tree.headings[segment].y);
        constexpr std::size_t kOfABranch = 4;
        for (const std::vector<float>& rise : rises)
            if (rise.size() == kOfABranch && std::abs(rise.front()) < 0.9f)
            {
                EXPECT_GT(rise.back(), rise.front()) << "seed " << seed;
                ++branches;
            }
    }
    EXPECT_GT(branches, 500);
}

TEST(Mirror, PointsBranchesWhereOnesOfTheirAngleWereDrawn)
{
    // Arms that begin with a turn, by 25 or by 75 degrees, along a stem.
    std::string tree = R"({"template": "arm"})";
    for (int i = 0; i < 16; ++i)
        tree = R"({"template": "stem", "children": {"A": {"template": "arm", "branchingAngle": )" +
               std::string(i % 3 == 0 ? "25" : "75") + R"(}, "Z": )" + tree + "}}";
    const Archetype drawn = samples::read("stem: F[A]FZ\narm: +FFX\n", tree);
    const Species species = inferSpecies({&drawn, 1}, {.mergeWeight = 1.0, .jitter = 0, .mirror = true}).value();
    GrowScratch scratch;
    Skeleton grown;
    for (std::uint64_t seed = 1; seed <= 20; ++seed)
    {
        ASSERT_TRUE(Grower::make(species)->grow(Seed{seed}, {}, scratch, grown));
        for (const Vec3& heading : grown.headings)
        {
            const double angle = std::abs(std::atan2(heading.x, heading.y)) / 0.017453293;
            EXPECT_LT(std::min({std::abs(angle), std::abs(angle - 25), std::abs(angle - 45), std::abs(angle - 75)}),
                      1e-3)
                << angle;
        }
    }
}

TEST(Mirror, OfAnglesOutOfTheOrdinaryIsAnArchetypeStill)
{
    const Archetype drawn = samples::read("stem: F[A]FZ\narm: +(2000)FFX\n",
                                          R"({"template": "stem", "children": {"A": {"template": "arm", "rotation": -7},
                                              "Z": {"template": "stem", "children": {"A": {"template": "arm"}}}}})");
    EXPECT_TRUE(validate(mirrorImage(drawn)));
    expectMirrored(drawArchetype(drawn).value(), drawArchetype(mirrorImage(drawn)).value());
    EXPECT_TRUE(inferSpecies({&drawn, 1}, {.mirror = true}));
}

TEST(Mirror, IsForKinAlone)
{
    const Archetype drawn = samples::thesis();
    EXPECT_EQ(inferSpecies({&drawn, 1}, {.preset = "helberg", .mirror = true}).error().kind, ErrorKind::BadInput);
}

} // namespace espalier
