#include <Espalier/Plant/Measure.h>
#include <Espalier/Plant/Skeleton.h>
#include <Espalier/Turtle/Turtle.h>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <map>
#include <string>

namespace espalier {
namespace {

struct Drawing
{
    Skeleton skeleton;
    std::string error;
};

/// Draws a word of single-character symbols, some with a number in parentheses.
Drawing drawn(std::string_view word, const TurtleSettings& settings = {}, const Limits& limits = {},
              const std::map<char, TurtleCommand>& commands = {})
{
    Drawing result;
    TurtleScratch scratch;
    Turtle turtle(settings, limits, scratch, result.skeleton);
    for (std::size_t i = 0; i < word.size(); ++i)
    {
        const auto given = commands.find(word[i]);
        const TurtleCommand command = given == commands.end() ? turtleCommand(word.substr(i, 1)) : given->second;
        double value = 0;
        std::size_t parameters = 0;
        if (i + 1 < word.size() && word[i + 1] == '(')
        {
            const std::size_t end = word.find(')', i);
            value = std::stod(std::string(word.substr(i + 2, end - i - 2)));
            parameters = 1;
            i = end;
        }
        if (!turtle.apply(command, {&value, parameters}))
            break;
    }
    if (const auto done = turtle.finish(); !done)
        result.error = toString(done.error());
    else
        EXPECT_TRUE(isSound(result.skeleton)) << word;
    return result;
}

Skeleton skeletonOf(std::string_view word, const TurtleSettings& settings = {})
{
    Drawing result = drawn(word, settings);
    EXPECT_EQ(result.error, "") << word;
    return std::move(result.skeleton);
}

void expectNear(const Vec3& a, const Vec3& b, float tolerance, std::string_view of)
{
    EXPECT_NEAR(a.x, b.x, tolerance) << of;
    EXPECT_NEAR(a.y, b.y, tolerance) << of;
    EXPECT_NEAR(a.z, b.z, tolerance) << of;
}

TEST(Turtle, AnEmptyWordDrawsNothing)
{
    const Skeleton skeleton = skeletonOf("");
    EXPECT_TRUE(skeleton.empty());
    EXPECT_TRUE(skeleton == Skeleton{});
    EXPECT_TRUE(skeletonOf("AX01{.}@[[]]").empty());
}

TEST(Turtle, KnowsTheConventionalSymbolsAndNoOthers)
{
    using enum TurtleCommand;
    const std::pair<char, TurtleCommand> known[] = {
        {'F', Draw},       {'G', Draw},      {'f', Move},      {'+', TurnLeft},   {'-', TurnRight},    {'&', PitchDown},
        {'^', PitchUp},    {'\\', RollLeft}, {'/', RollRight}, {'|', TurnAround}, {'$', Level},        {'!', Width},
        {'\'', Material},  {'%', Cut},       {'[', Push},      {']', Pop},        {'{', BeginPolygon}, {'.', Corner},
        {'}', EndPolygon}, {'~', Organ},     {'@', Sphere}};
    std::map<char, TurtleCommand> all(std::begin(known), std::end(known));
    for (int c = 1; c < 256; ++c)
    {
        const char symbol = static_cast<char>(c);
        EXPECT_EQ(turtleCommand({&symbol, 1}), all.contains(symbol) ? all[symbol] : Nothing) << c;
    }
    EXPECT_EQ(turtleCommand(""), Nothing);
    EXPECT_EQ(turtleCommand("FF"), Nothing);
}

/// Frames worked out by hand from the definitions of the symbols (Content/Grammars/LANGUAGE.md); turns by 90 degrees
/// are exact, bit for bit.
TEST(Turtle, TurnsByTheBook)
{
    struct Case
    {
        const char* word;
        Vec3 heading, left;
    };
    const Case cases[] = {
        {"F", {0, 1, 0}, {-1, 0, 0}},      {"+F", {-1, 0, 0}, {0, -1, 0}},      {"-F", {1, 0, 0}, {0, 1, 0}},
        {"&F", {0, 0, -1}, {-1, 0, 0}},    {"^F", {0, 0, 1}, {-1, 0, 0}},       {"\\F", {0, 1, 0}, {0, 0, -1}},
        {"/F", {0, 1, 0}, {0, 0, 1}},      {"|F", {0, -1, 0}, {1, 0, 0}},       {"|(30)F", {0, -1, 0}, {1, 0, 0}},
        {"++F", {0, -1, 0}, {1, 0, 0}},    {"+(450)F", {-1, 0, 0}, {0, -1, 0}}, {"+(-90)F", {1, 0, 0}, {0, 1, 0}},
        {"+(0)F", {0, 1, 0}, {-1, 0, 0}},  {"+-F", {0, 1, 0}, {-1, 0, 0}},      {"&+F", {-1, 0, 0}, {0, 0, 1}},
        {"+&F", {0, 0, -1}, {0, -1, 0}},   {"/+F", {0, 0, 1}, {0, -1, 0}},      {"\\^F", {-1, 0, 0}, {0, 0, -1}},
        {"+/&F", {0, -1, 0}, {0, 0, 1}},   {"+$F", {-1, 0, 0}, {0, 0, 1}},      {"&\\$F", {0, 0, -1}, {-1, 0, 0}},
        {"/$F", {0, 1, 0}, {0, 0, 1}}, // the heading is vertical: nothing
        {"[+F]F", {-1, 0, 0}, {0, -1, 0}},
    };
    for (const Case& c : cases)
    {
        const Skeleton skeleton = skeletonOf(c.word, {.angleDegrees = 90});
        ASSERT_GE(skeleton.size(), 1u) << c.word;
        EXPECT_EQ(skeleton.headings[0], c.heading) << c.word;
        EXPECT_EQ(skeleton.lefts[0], c.left) << c.word;
        EXPECT_EQ(skeleton.ends[0], c.heading) << c.word;
    }
}

TEST(Turtle, ObliqueTurnsFollowTheirFormulas)
{
    const double a = 25.7 * 3.14159265358979323846 / 180;
    const auto c = static_cast<float>(std::cos(a));
    const auto s = static_cast<float>(std::sin(a));
    expectNear(skeletonOf("+(25.7)F").headings[0], {-s, c, 0}, 1e-7f, "+");
    expectNear(skeletonOf("-(25.7)F").headings[0], {s, c, 0}, 1e-7f, "-");
    expectNear(skeletonOf("&(25.7)F").headings[0], {0, c, -s}, 1e-7f, "&");
    expectNear(skeletonOf("^(25.7)F").headings[0], {0, c, s}, 1e-7f, "^");
    expectNear(skeletonOf("\\(25.7)F").lefts[0], {-c, 0, -s}, 1e-7f, "\\");
    expectNear(skeletonOf("/(25.7)F").lefts[0], {-c, 0, s}, 1e-7f, "/");
}

TEST(Turtle, LevelMakesLeftHorizontalAndKeepsTheHeading)
{
    const Skeleton skeleton = skeletonOf("+(30)&(50)/(70)F$F");
    expectNear(skeleton.headings[0], skeleton.headings[1], 0, "heading");
    EXPECT_NEAR(skeleton.lefts[1].y, 0, 1e-7);
    EXPECT_GT(std::abs(skeleton.lefts[0].y), 0.1f);
    EXPECT_GE(glm::cross(skeleton.headings[1], skeleton.lefts[1]).y, 0) << "up points upwards";
}

TEST(Turtle, FramesStayOrthonormal)
{
    std::string word;
    for (int i = 0; i < 2000; ++i)
        word += "+(13.7)&(71)/(137.5)f(0)";
    const Skeleton skeleton = skeletonOf(word + "F");
    EXPECT_NEAR(glm::length(skeleton.headings[0]), 1, 1e-6);
    EXPECT_NEAR(glm::length(skeleton.lefts[0]), 1, 1e-6);
    EXPECT_NEAR(glm::dot(skeleton.headings[0], skeleton.lefts[0]), 0, 1e-6);
}

TEST(Turtle, ATurnByNothingChangesNoBit)
{
    EXPECT_TRUE(skeletonOf("+(10)F/(0)&(0)+(0)-(0)F") == skeletonOf("+(10)FF"));
}

TEST(Turtle, HugeAnglesAreTakenModuloATurn)
{
    EXPECT_EQ(skeletonOf("+(36000000090)F").headings[0], Vec3(-1, 0, 0));
    EXPECT_EQ(drawn("+(1e300)FF").error, "");
    EXPECT_EQ(drawn("&(-1e308)FF").error, "");
}

TEST(Turtle, LengthsComeFromTheParameterOrTheStep)
{
    const Skeleton skeleton = skeletonOf("F(2)FG(0)F(-3)f(4)F", {.stepLength = 0.5});
    EXPECT_EQ(skeleton.lengths, (std::vector<float>{2, 0.5f, 0, 3, 0.5f}));
    EXPECT_EQ(skeleton.ends[3], Vec3(0, -0.5f, 0));
    EXPECT_EQ(skeleton.headings[3], Vec3(0, -1, 0)) << "a negative length grows backwards";
    EXPECT_EQ(skeleton.headings[2], Vec3(0, 1, 0)) << "a length of 0 still points somewhere";
    EXPECT_EQ(skeleton.starts[4], Vec3(0, 3.5f, 0));
    EXPECT_EQ(skeleton.parents, (std::vector<std::uint32_t>{kNoSegment, 0, 1, 2, 3})) << "a move keeps the chain";
}

TEST(Turtle, WidthsAndMaterialsAreSetAndScoped)
{
    const Skeleton skeleton = skeletonOf("F!(0.4)F[!F'F]F'(7)F''F!(-2)F'(1e9)F'F'(-3)F", {.width = 0.2});
    const std::vector<float> radii = {0.1f, 0.2f, 0.14f, 0.14f, 0.2f, 0.2f, 0.2f, 1, 1, 1, 1};
    ASSERT_EQ(skeleton.size(), radii.size());
    for (std::size_t i = 0; i < radii.size(); ++i)
        EXPECT_FLOAT_EQ(skeleton.startRadii[i], radii[i]) << i;
    EXPECT_EQ(skeleton.materials, (std::vector<std::uint16_t>{0, 0, 0, 1, 0, 7, 9, 9, 65535, 65535, 0}));
    EXPECT_TRUE(skeleton.widthsGiven);
    EXPECT_FALSE(skeletonOf("FF").widthsGiven);
}

TEST(Turtle, CutDropsTheRestOfItsBranch)
{
    EXPECT_EQ(skeletonOf("F[F%FF[F]F]F").size(), 3u);
    EXPECT_EQ(skeletonOf("F%F[F]F").size(), 1u);
    EXPECT_EQ(skeletonOf("F[%+!(3)'f(100)]F").materials, skeletonOf("FF").materials);
    EXPECT_EQ(skeletonOf("[%f(9)]F").maxY, 1) << "what is cut covers nothing";
}

TEST(Turtle, AnOrganIsNamedByTheNextSymbol)
{
    EXPECT_EQ(skeletonOf("F~FF").size(), 2u);
    EXPECT_EQ(skeletonOf("~+F").headings[0], Vec3(0, 1, 0));
    EXPECT_EQ(skeletonOf("~~F").size(), 1u) << "the organ is called ~";
    EXPECT_EQ(skeletonOf("~").size(), 0u);
    EXPECT_EQ(skeletonOf("F[~]F").size(), 2u) << "a bracket is no name";
    EXPECT_EQ(skeletonOf("F[%~[F]F]F").size(), 2u);
    EXPECT_EQ(skeletonOf("~[F]F").size(), 2u);
}

TEST(Turtle, PolygonsCoverWhatTheirCornersReach)
{
    const Skeleton skeleton = skeletonOf("F[{+(90)f(3).f(-1).}]");
    EXPECT_EQ(skeleton.size(), 1u);
    EXPECT_EQ(skeleton.maxRadius, 3);
}

TEST(Turtle, DrawnSymbolsMayBeNamedByTheGrammar)
{
    const Drawing drawing = drawn("AFA", {}, {}, {{'A', TurtleCommand::Draw}, {'F', TurtleCommand::Nothing}});
    EXPECT_EQ(drawing.skeleton.size(), 2u);
}

TEST(Turtle, MisuseIsAnErrorAndLeavesNothing)
{
    Limits limits;
    limits.bracketDepth = 2;
    limits.nodes = 3;
    limits.coordinate = 10;
    struct Case
    {
        const char* word;
        const char* part; ///< Empty: it is allowed.
    };
    const Case cases[] = {
        {"F]", "`]` without `[`"},
        {"F[F]]F", "`]` without `[`"},
        {"F[F", "`[` is never closed"},
        {"[[F]]", ""},
        {"[[[F]]]", "the limit bracketDepth"},
        {"FFF", ""},
        {"FFFF", "more than 3 segments"},
        {"F(10)", ""},
        {"f(-10)", ""},
        {"F(10.001)", "farther than 10 m"},
        {"&(90)F(11)", "farther than 10 m"},
        {"+(90)f(11)", "farther than 10 m"},
        {"F(1e308)F(1e308)", "farther than 10 m"},
        {"!(10)F", ""},
        {"!(11)F", "the limit coordinate"},
        {"!(-1e300)F", "the limit coordinate"},
        {"F(nan)", "not finite"},
        {"+(inf)F", "not finite"},
        {"&(nan)F", "not finite"},
        {"!(inf)F", "not finite"},
        {"'(nan)F", "not finite"},
    };
    for (const Case& c : cases)
    {
        const Drawing drawing = drawn(c.word, {}, limits);
        if (*c.part == 0)
        {
            EXPECT_EQ(drawing.error, "") << c.word;
            continue;
        }
        EXPECT_NE(drawing.error.find(c.part), std::string::npos) << c.word << ": " << drawing.error;
        EXPECT_TRUE(drawing.skeleton == Skeleton{}) << c.word;
    }
}

TEST(Turtle, WhatASymbolDoesNotReadMayBeAnything)
{
    const double nan = std::numeric_limits<double>::quiet_NaN();
    TurtleScratch scratch; // its stack is short at first, and long the second time
    for (int i = 0; i < 2; ++i)
    {
        Skeleton skeleton;
        Turtle turtle({}, {}, scratch, skeleton);
        for (int depth = 0; depth < 100; ++depth)
            EXPECT_TRUE(turtle.apply(TurtleCommand::Push, std::span(&nan, 1)));
        for (const TurtleCommand command : {TurtleCommand::TurnAround, TurtleCommand::Level, TurtleCommand::Corner})
            EXPECT_TRUE(turtle.apply(command, std::span(&nan, 1)));
        for (int depth = 0; depth < 100; ++depth)
            EXPECT_TRUE(turtle.apply(TurtleCommand::Pop, std::span(&nan, 1)));
        EXPECT_TRUE(turtle.finish());
    }
}

TEST(Turtle, AfterAnErrorNothingIsApplied)
{
    Skeleton skeleton;
    TurtleScratch scratch;
    Turtle turtle({}, {}, scratch, skeleton);
    EXPECT_TRUE(turtle.apply(TurtleCommand::Draw, {}));
    EXPECT_FALSE(turtle.apply(TurtleCommand::Pop, {}));
    EXPECT_FALSE(turtle.apply(TurtleCommand::Draw, {}));
    EXPECT_EQ(turtle.error().what, "module 2 of the word: `]` without `[`");
    EXPECT_FALSE(turtle.finish());
    EXPECT_TRUE(skeleton.empty());

    // The same memory serves the next tree.
    Turtle next({}, {}, scratch, skeleton);
    EXPECT_TRUE(next.apply(TurtleCommand::Draw, {}));
    EXPECT_TRUE(next.finish());
    EXPECT_EQ(skeleton.size(), 1u);
}

TEST(Turtle, SegmentsKnowTheirInstances)
{
    Skeleton skeleton;
    TurtleScratch scratch;
    Turtle turtle({}, {}, scratch, skeleton);
    const auto draw = [&] { EXPECT_TRUE(turtle.apply(TurtleCommand::Draw, {})); };
    draw();
    turtle.beginInstance(4, 40);
    draw();
    turtle.beginInstance(5, 50);
    draw();
    turtle.endInstance();
    draw();
    turtle.beginInstance(6, 60);
    turtle.endInstance();
    turtle.endInstance();
    draw();
    ASSERT_TRUE(turtle.finish());
    EXPECT_EQ(skeleton.instances, (std::vector<std::uint32_t>{kNoSegment, 0, 1, 0, kNoSegment}));
    EXPECT_EQ(skeleton.instanceRecords, (std::vector<SkeletonInstance>{{kNoSegment, 4, 40}, {0, 5, 50}, {0, 6, 60}}));
    EXPECT_TRUE(isSound(skeleton));
}

TEST(Turtle, AForkAndAGapAreMeasuredAsDefined)
{
    const SkeletonFacts facts = measure(skeletonOf("F[+(90)Ff(2)F][-(90)F]F"));
    EXPECT_EQ(facts.segments, 5u);
    EXPECT_EQ(facts.tips, 3u);
    EXPECT_EQ(facts.forks, 1u);
    EXPECT_EQ(facts.maxDepth, 3u);
    EXPECT_EQ(facts.strahler, 2u);
    EXPECT_EQ(facts.totalLength, 5);
    EXPECT_EQ(facts.maxY, 2);
    EXPECT_EQ(facts.maxRadius, 4);
    EXPECT_EQ(measure(skeletonOf("[F][+F]")).forks, 1u) << "the base can be a fork";
    EXPECT_EQ(measure(skeletonOf("f(-3)F")).minY, -3);
}

std::string rewritten(std::string word, const std::map<char, std::string>& productions, int steps)
{
    for (int step = 0; step < steps; ++step)
    {
        std::string next;
        for (const char c : word)
            if (const auto found = productions.find(c); found != productions.end())
                next += found->second;
            else
                next += c;
        word = std::move(next);
    }
    return word;
}

/// Facts of published L-systems, computed twice by other means: rewriting of words, and a tree of axes with
/// quaternions.
TEST(Turtle, DrawsThePublishedPlants)
{
    struct Case
    {
        const char* source;
        const char* axiom;
        std::map<char, std::string> productions;
        double angle;
        int steps;
        std::size_t length;
        std::uint32_t segments, tips, forks, maxDepth;
        double minY, maxY, maxRadius;
        std::map<char, TurtleCommand> commands;
    };
    using enum TurtleCommand;
    const Case cases[] = {
        {"Wikipedia, L-system, example 3: Cantor set",
         "A",
         {{'A', "ABA"}, {'B', "BBB"}},
         0,
         4,
         81,
         16,
         1,
         0,
         16,
         0,
         81,
         0,
         {{'A', Draw}, {'B', Move}}},
        {"example 4: Koch curve", "F", {{'F', "F+F-F-F+F"}}, 90, 4, 1249, 625, 1, 0, 625, 0, 81, 40, {}},
        {"example 5: Sierpinski triangle",
         "F-G-G",
         {{'F', "F-G+F+G-F"}, {'G', "GG"}},
         120,
         5,
         1215,
         729,
         1,
         0,
         729,
         0,
         32,
         27.71281292,
         {}},
        {"example 6: dragon curve", "F", {{'F', "F+G"}, {'G', "F-G"}}, 90, 5, 63, 32, 1, 0, 32, -5, 1, 5, {}},
        {"example 7: fractal plant",
         "X",
         {{'X', "F+[[X]-X]-F[-FX]+X"}, {'F', "FF"}},
         25,
         5,
         6263,
         1488,
         256,
         170,
         93,
         0,
         79.15861927,
         38.26628513,
         {}},
        {"ABOP fig. 1.24a", "F", {{'F', "F[+F]F[-F]F"}}, 25.7, 5, 7811, 3125, 1563, 1562, 243, 0, 243, 46.2589743, {}},
        {"ABOP fig. 1.24b", "F", {{'F', "F[+F]F[-F][F]"}}, 20, 5, 9373, 3125, 1875, 1250, 63, 0, 63, 17.03314804, {}},
        {"ABOP fig. 1.24c",
         "F",
         {{'F', "FF-[-F+F+F]+[+F-F-F]"}},
         22.5,
         4,
         11116,
         4096,
         1024,
         512,
         61,
         0,
         55.89834021,
         24.07375845,
         {}},
        {"ABOP fig. 1.26: a plant with flowers",
         "P",
         {{'P', "I+[P+W]--//[--L]I[++L]-[PW]++PW"},
          {'I', "FS[//&&L][//^^L]FS"},
          {'S', "SFS"},
          {'L', "['{+f-ff-f+|+f-ff-f}]"},
          {'W', "[&&&D'/G////G////G////G////G]"},
          {'D', "FF"},
          {'G', "['^F][{&&&&-f+f|-f+f}]"}},
         18,
         5,
         15325,
         533,
         195,
         74,
         63,
         0,
         60.91018896,
         29.63950892,
         {{'G', Nothing}}},
    };
    for (const Case& c : cases)
    {
        const std::string word = rewritten(c.axiom, c.productions, c.steps);
        EXPECT_EQ(word.size(), c.length) << c.source;
        const Drawing drawing = drawn(word, {.angleDegrees = c.angle}, {}, c.commands);
        EXPECT_EQ(drawing.error, "") << c.source;
        const SkeletonFacts facts = measure(drawing.skeleton);
        EXPECT_EQ(facts.segments, c.segments) << c.source;
        EXPECT_EQ(facts.totalLength, c.segments) << c.source;
        EXPECT_EQ(facts.tips, c.tips) << c.source;
        EXPECT_EQ(facts.forks, c.forks) << c.source;
        EXPECT_EQ(facts.maxDepth, c.maxDepth) << c.source;
        EXPECT_NEAR(facts.minY, c.minY, 1e-5) << c.source;
        EXPECT_NEAR(facts.maxY, c.maxY, 1e-5) << c.source;
        EXPECT_NEAR(facts.maxRadius, c.maxRadius, 1e-5) << c.source;
    }
}

} // namespace
} // namespace espalier
