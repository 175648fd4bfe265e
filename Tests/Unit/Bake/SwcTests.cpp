#include <Espalier/Bake/Swc.h>

#include <Espalier/Core/File.h>
#include <Espalier/Core/Random.h>
#include <Plant/SampleSkeletons.h>
#include <gtest/gtest.h>
#include <limits>

namespace espalier {

namespace {

ImportedSkeleton read(std::string_view text, const ImportSettings& settings = {})
{
    auto result = parseSwc(text, "t.swc", settings);
    EXPECT_TRUE(result) << (result ? "" : toString(result.error())) << '\n' << text;
    return result.value_or(ImportedSkeleton{});
}

/// Where segments run, with their radii at both ends, and on what they hang.
void expectSameGeometry(const Skeleton& a, const Skeleton& b)
{
    ASSERT_EQ(a.size(), b.size());
    EXPECT_EQ(a.starts, b.starts);
    EXPECT_EQ(a.ends, b.ends);
    EXPECT_EQ(a.startRadii, b.startRadii);
    EXPECT_EQ(a.endRadii, b.endRadii);
    EXPECT_EQ(a.parents, b.parents);
    EXPECT_EQ(a.continuations, b.continuations);
}

Skeleton randomPlant(std::uint64_t seed)
{
    Skeleton skeleton;
    const RandomKey key(Seed{seed});
    std::uint32_t draw = 0;
    const auto next = [&](double low, double high) {
        return static_cast<float>(key.uniform(Purpose::Sampling, low, high, ++draw));
    };
    for (std::uint32_t i = 0; i < 60; ++i)
    {
        const bool isBase = i == 0 || next(0, 1) < 0.05f;
        const auto parent = static_cast<std::uint32_t>(next(0, 0.999) * static_cast<float>(i));
        const float x = next(-1, 1);
        const float y = next(-1, 1);
        const float z = next(-1, 1);
        samples::grow(skeleton, isBase ? kNoSegment : parent, Vec3(x, y, z));
    }
    completeAxes(skeleton, {});
    return skeleton;
}

} // namespace

TEST(Swc, ReadsAForkOfThreeSegments)
{
    const ImportedSkeleton plant = read("# a comment\n"
                                        "1 2 0 0 0 0.5 -1\n"
                                        "2 2 0 2 0 0.4 1\n"
                                        "3 2 1 3 0 0.3 2\n"
                                        "4 2 -1 3 0 0.2 2\n");
    const Skeleton& s = plant.skeleton;
    ASSERT_EQ(s.size(), 3u);
    EXPECT_TRUE(isSound(s));
    EXPECT_EQ(s.starts, (std::vector<Vec3>{{0, 0, 0}, {0, 2, 0}, {0, 2, 0}}));
    EXPECT_EQ(s.ends, (std::vector<Vec3>{{0, 2, 0}, {1, 3, 0}, {-1, 3, 0}}));
    EXPECT_EQ(s.parents, (std::vector<std::uint32_t>{kNoSegment, 0, 0}));
    EXPECT_EQ(s.startRadii, (std::vector<float>{0.5f, 0.4f, 0.4f}));
    EXPECT_EQ(s.endRadii, (std::vector<float>{0.4f, 0.3f, 0.2f}));
    EXPECT_TRUE(s.widthsGiven);
    EXPECT_FLOAT_EQ(s.lengths[0], 2);
    EXPECT_EQ(s.lefts[0], Vec3(-1, 0, 0)) << "an upright segment has the turtle's frame";
    EXPECT_FLOAT_EQ(s.maxY, 3);
    EXPECT_EQ(plant.points, 4u);
    EXPECT_EQ(plant.roots, 1u);
}

TEST(Swc, ReadsWhatArchivesHold)
{
    const Skeleton plain = read("1 2 0 0 0 1 -1\n2 2 0 1 0 1 1\n3 2 0 2 1 1 2\n").skeleton;
    const std::pair<const char*, const char*> kTexts[] = {
        {"CRLF", "1 2 0 0 0 1 -1\r\n2 2 0 1 0 1 1\r\n3 2 0 2 1 1 2\r\n"},
        {"no end of line", "1 2 0 0 0 1 -1\n2 2 0 1 0 1 1\n3 2 0 2 1 1 2"},
        {"blank lines, tabs", "\n\t1\t2 0 0 0 1\t-1\n\n \n2\t2\t0\t1\t0 1 1\n3 2 0 2 1 1 2\n\n"},
        {"further columns and comments", "# \xb5m\n1 2 0 0 0 1 -1 7 x\n2 2 0 1 0 1 1 # c\n3 2 0 2 1 1 2\n"},
        {"parents after children", "3 2 0 2 1 1 2\n2 2 0 1 0 1 1\n1 2 0 0 0 1 -1\n"},
        {"ids with gaps", "70 2 0 0 0 1 -1\n5 2 0 1 0 1 70\n123456789012 2 0 2 1 1 5\n"},
        {"other spellings", "1.0 2 0.0 -0 +0 1e0 -1.0\n2 2 0 1.000 0 1 1\n3 2 0 2 1 1. 2\n"},
        {"moved", "1 2 5 6 7 1 -1\n2 2 5 7 7 1 1\n3 2 5 8 8 1 2\n"},
        {"repeated points", "1 2 0 0 0 1 -1\n2 2 0 1 0 1 1\n4 2 0 1 0 1 2\n3 2 0 2 1 1 4\n"},
    };
    for (const auto& [name, text] : kTexts)
    {
        SCOPED_TRACE(name);
        expectSameGeometry(read(text).skeleton, plain);
    }
}

TEST(Swc, MovesTheRootToTheOriginAndSaysWhence)
{
    const ImportedSkeleton plant = read("1 2 10 20 30 1 -1\n2 2 10 20 31 1 1\n", {0.5, UpAxis::Z});
    EXPECT_EQ(plant.origin, DVec3(10, 20, 30));
    EXPECT_EQ(plant.skeleton.ends[0], Vec3(0, 0.5f, 0)) << "z points up, half a metre a unit";
    EXPECT_EQ(plant.skeleton.endRadii[0], 0.5f);
}

TEST(Swc, ReadsPartsThatHangOnNothing)
{
    const ImportedSkeleton plant = read("1 2 0 0 0 1 -1\n2 2 0 1 0 1 1\n3 2 4 0 0 1 -1\n4 2 4 1 0 1 3\n");
    EXPECT_EQ(plant.roots, 2u);
    EXPECT_EQ(plant.skeleton.parents, (std::vector<std::uint32_t>{kNoSegment, kNoSegment}));
    EXPECT_EQ(plant.skeleton.starts[1], Vec3(4, 0, 0));
}

TEST(Swc, APointAloneIsNoOrigin)
{
    const ImportedSkeleton plant = read("9 0 1 0 0 1 -1\n20 0 50 0 0 1 -1\n21 0 51 1 0 1 20\n");
    EXPECT_EQ(plant.origin, DVec3(50, 0, 0));
    EXPECT_EQ(plant.skeleton.starts, std::vector<Vec3>{Vec3(0)});
}

TEST(Swc, ASomaOfThreePointsIsOne)
{
    const ImportedSkeleton plant =
        read("1 1 0 0 0 5 -1\n2 1 0 -5 0 5 1\n3 1 0 5 0 5 1\n4 3 8 0 0 1 1\n5 3 9 0 0 1 4\n");
    ASSERT_EQ(plant.skeleton.size(), 2u);
    EXPECT_EQ(plant.skeleton.starts[0], Vec3(0));
    EXPECT_EQ(plant.skeleton.startRadii[0], 1.f) << "a branch does not begin as thick as the soma";
    EXPECT_EQ(plant.repeatedPoints, 2u);
}

TEST(Swc, WithoutRadiiWidthsAreNotGiven)
{
    EXPECT_FALSE(read("1 2 0 0 0 0 -1\n2 2 0 1 0 0 1\n").skeleton.widthsGiven);
}

TEST(Swc, APointAloneIsAnEmptySkeleton)
{
    EXPECT_TRUE(read("1 1 3 3 3 5 -1\n").skeleton.empty());
}

TEST(Swc, WhatIsWrongHasItsPlace)
{
    struct Case
    {
        const char* text;
        const char* message;
    };
    const Case kCases[] = {
        {"", "t.swc:1:1: the file holds no point"},
        {"# nothing\n", "the file holds no point"},
        {"1 2 0 0 0 1\n", "t.swc:1:12: the line ends after 6 numbers; expected seven"},
        {"1 2 0 0 0 1 -1\n2 2 0 zero 0 1 1\n", "t.swc:2:7: `zero` is no number; expected the y"},
        {"1 2 0 0 0 1 -1\n2 2 0 1,5 0 1 1\n", "t.swc:2:7: `1,5` is no number"},
        {"1 2 nan 0 0 1 -1\n", "t.swc:1:5: the x is nan; expected a finite number"},
        {"1 2 0 inf 0 1 -1\n", "t.swc:1:7: the y is inf"},
        {"1 2 0 1e999 0 1 -1\n", "t.swc:1:7: the y 1e999 is too large"},
        {"1 2 0 0 0 -1 -1\n", "t.swc:1:11: the radius is -1; expected a number of 0 or more"},
        {"1 2 0 0 0 1 -1\n1 2 0 1 0 1 1\n", "t.swc:2:1: the id 1 is taken by line 1"},
        {"1 2 0 0 0 1 -1\n2 2 0 1 0 1 9\n", "t.swc:2:13: there is no point 9"},
        {"1 2 0 0 0 1 -2\n", "t.swc:1:13: there is no point -2"},
        {"1 2 0 0 0 1 2\n2 2 0 1 0 1 1\n", "hangs on itself"},
        {"1 2 0 0 0 1 -1\n2 2 0 1 0 1 2\n", "t.swc:2:13: the point 2 hangs on itself"},
        {"1 2 0 0 0 1 -1\n2 2 1 1 1 1 4\n3 2 0 1 0 1 2\n4 2 0 1 0 1 3\n", "hangs on itself"},
        {"1.5 2 0 0 0 1 -1\n", "t.swc:1:1: the id is 1.5; expected a whole number"},
        {"-1 2 0 0 0 1 -1\n", "t.swc:1:1: the id is -1"},
        {"1e300 2 0 0 0 1 -1\n", "the id is 1e300"},
        {"1 2 0 0 0 1 -1\n2 2 0 2e5 0 1 1\n", "2e+05 m away from the root along an axis"},
        {"1 2 0 0 0 2e5 -1\n", "a radius is 2e+05 m large"},
        {"1 2 -1e308 0 0 1 -1\n2 2 1e308 0 0 1 1\n", "the limit coordinate"},
        {"\x01\xff\n", "t.swc:1:1: `??` is no number"},
        {"1 2 +-0 0 0 1 -1\n", "`+-0` is no number"},
    };
    for (const Case& c : kCases)
    {
        const auto result = parseSwc(c.text, "t.swc");
        ASSERT_FALSE(result) << c.text;
        EXPECT_NE(toString(result.error()).find(c.message), std::string::npos)
            << c.text << '\n'
            << toString(result.error()) << "\nexpected: " << c.message;
    }
}

TEST(Swc, KeepsItsLimits)
{
    Limits limits;
    limits.nodes = 2;
    const auto many = parseSwc("1 2 0 0 0 1 -1\n2 2 0 1 0 1 1\n3 2 0 2 0 1 2\n", "t.swc", {}, limits);
    ASSERT_FALSE(many);
    EXPECT_EQ(toString(many.error()), "t.swc:3:1: more than 2 points; expected at most the limit nodes");
    limits.fileBytes = 10;
    const auto large = parseSwc("1 2 0 0 0 1 -1\n", "t.swc", {}, limits);
    ASSERT_FALSE(large);
    EXPECT_EQ(large.error().kind, ErrorKind::Limit);
}

TEST(Swc, WhatIsWrittenReadsBackToTheBit)
{
    for (std::uint64_t seed = 0; seed < 50; ++seed)
    {
        SCOPED_TRACE(seed);
        const Skeleton plant = randomPlant(seed);
        const ImportedSkeleton again = read(printSwc(plant, "seed " + std::to_string(seed)));
        // The reader goes depth first; a second time nothing changes.
        ASSERT_EQ(again.skeleton.size(), plant.size());
        EXPECT_EQ(again.origin, DVec3(0));
        expectSameGeometry(read(printSwc(again.skeleton, "")).skeleton, again.skeleton);
        std::uint32_t found = 0;
        for (std::uint32_t i = 0; i < plant.size(); ++i)
            for (std::uint32_t j = 0; j < plant.size(); ++j)
                if (again.skeleton.ends[j] == plant.ends[i] && again.skeleton.starts[j] == plant.starts[i] &&
                    again.skeleton.startRadii[j] == plant.startRadii[i] &&
                    again.skeleton.endRadii[j] == plant.endRadii[i])
                {
                    ++found;
                    break;
                }
        EXPECT_EQ(found, plant.size());
    }
}

TEST(Swc, AMoveComesBackAsASegment)
{
    Skeleton skeleton;
    samples::grow(skeleton, kNoSegment, {0, 1, 0});
    samples::addSegment(skeleton, 0, {0, 2, 0}, {0, 3, 0});
    completeAxes(skeleton, {});
    const Skeleton again = read(printSwc(skeleton, "")).skeleton;
    ASSERT_EQ(again.size(), 3u);
    EXPECT_EQ(again.starts[1], Vec3(0, 1, 0));
    EXPECT_EQ(again.ends[1], Vec3(0, 2, 0));
}

TEST(Swc, RootsInOnePlaceKeepTheirOrder)
{
    const Skeleton plant =
        read("1 2 0 0 0 1 -1\n2 2 0 1 0 1 1\n3 2 5 0 0 1 -1\n4 2 5 1 0 1 3\n5 2 0 0 0 2 -1\n6 2 1 0 0 1 5\n").skeleton;
    ASSERT_EQ(plant.size(), 3u);
    expectSameGeometry(read(printSwc(plant, "")).skeleton, plant);
}

TEST(Swc, TheHeadSaysWhereItCameFrom)
{
    Skeleton skeleton;
    samples::grow(skeleton, kNoSegment, {0, 1, 0});
    completeAxes(skeleton, {});
    EXPECT_EQ(printSwc(skeleton, "espalier\nseed 7"),
              "# espalier\n# seed 7\n# metres, Y up: id type x y z radius parent\n1 0 0 0 0 0.00800000038 -1\n"
              "2 0 0 1 0 0.00400000019 1\n");
}

} // namespace espalier
