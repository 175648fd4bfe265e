// What grammars draw: polygons, spheres, organs, tropism, `draw:` and `move:`, and errors with their place in the word.

#include <Espalier/Grammar/Derivation.h>
#include <Espalier/Plant/Measure.h>
#include <Espalier/Plant/Skeleton.h>
#include <Espalier/Turtle/Turtle.h>
#include <cmath>
#include <gtest/gtest.h>

namespace espalier {
namespace {

struct Drawing
{
    Skeleton skeleton;
    std::string error;
    std::string symbols; ///< Names of all symbols, by id.
};

Drawing drawn(const std::string& text, std::uint32_t steps = 0, const Limits& limits = {})
{
    Drawing result;
    const auto grammar = parseGrammar(text, "g.lsys", {});
    EXPECT_TRUE(grammar) << text << (grammar ? "" : toString(grammar.error()));
    const auto program = GrammarProgram::make(*grammar);
    EXPECT_TRUE(program) << text;
    const TurtleAlphabet alphabet(*program);
    class Sink final : public DerivationSink
    {
    public:
        Sink(Turtle& turtle, const TurtleAlphabet& alphabet) : turtle_(turtle), alphabet_(alphabet) {}
        bool modules(std::span<const LetterId> letters, std::span<const double> arguments) override
        {
            return turtle_.apply(alphabet_, letters, arguments);
        }

    private:
        Turtle& turtle_;
        const TurtleAlphabet& alphabet_;
    };
    TurtleScratch scratch;
    DerivationScratch derivation;
    Turtle turtle(turtleSettings(*grammar), limits, scratch, result.skeleton);
    Sink sink(turtle, alphabet);
    const auto done = streamWord(*program, RandomKey(Seed{1}), steps, Interpretation::Apply, limits, derivation, sink);
    EXPECT_TRUE(done) << toString(done.error());
    if (const auto finished = turtle.finish(); !finished)
        result.error = toString(finished.error());
    else
        EXPECT_TRUE(isSound(result.skeleton)) << text;
    for (SymbolId id = 0; id < grammar->symbols.size(); ++id)
        result.symbols += grammar->symbols.name(id);
    return result;
}

void expectCorners(const Skeleton& skeleton, std::size_t polygon, const std::vector<Vec3>& corners)
{
    ASSERT_GT(skeleton.polygons.size(), polygon);
    const SkeletonPolygon& p = skeleton.polygons[polygon];
    ASSERT_EQ(p.cornerCount, corners.size());
    for (std::size_t i = 0; i < corners.size(); ++i)
        EXPECT_LT(glm::length(skeleton.corners[p.firstCorner + i] - corners[i]), 1e-6f) << "corner " << i;
}

TEST(LSystemDrawing, APolygonHasACornerForEachMoveInside)
{
    const Skeleton skeleton = drawn("angle: 90\naxiom: F'(3){+f-f-f-f}F\n").skeleton;
    EXPECT_EQ(skeleton.size(), 2u);
    ASSERT_EQ(skeleton.polygons.size(), 1u);
    expectCorners(skeleton, 0, {{-1, 1, 0}, {-1, 2, 0}, {0, 2, 0}, {0, 1, 0}});
    EXPECT_EQ(skeleton.polygons[0].segment, 0u);
    EXPECT_EQ(skeleton.polygons[0].material, 3u);
}

TEST(LSystemDrawing, ADotRecordsThePresentPosition)
{
    const Skeleton skeleton = drawn("angle: 90\naxiom: {.[f.]+G(2).}\n").skeleton;
    // G draws and records its end; the dot after it records the same place again.
    expectCorners(skeleton, 0, {{0, 0, 0}, {0, 1, 0}, {0, 1, 0}, {-2, 0, 0}, {-2, 0, 0}});
    EXPECT_EQ(skeleton.size(), 1u);
}

TEST(LSystemDrawing, PolygonsNestAndRunAcrossBrackets)
{
    const Skeleton nested = drawn("axiom: {f{f+f+f}f-f}\n").skeleton;
    ASSERT_EQ(nested.polygons.size(), 2u);
    EXPECT_EQ(nested.polygons[0].cornerCount, 3u) << "the inner one ends first";
    EXPECT_EQ(nested.polygons[1].cornerCount, 3u);
    // ABOP Fig. 5.5: begun inside a branch, ended outside.
    const Skeleton crossing = drawn("axiom: [+f{.]f.-f.}\n").skeleton;
    ASSERT_EQ(crossing.polygons.size(), 1u);
    EXPECT_EQ(crossing.polygons[0].cornerCount, 5u);
}

TEST(LSystemDrawing, TwoCornersAreNoPolygon)
{
    EXPECT_TRUE(drawn("axiom: {}{f}{f.}\n").skeleton.polygons.empty());
    EXPECT_EQ(drawn("axiom: {ff.}\n").skeleton.polygons.size(), 1u);
}

TEST(LSystemDrawing, AtPlacesASphereOfThePresentDiameter)
{
    const Skeleton skeleton = drawn("width: 0.4\naxiom: F'@F!(0.2)@(1)\n").skeleton;
    ASSERT_EQ(skeleton.spheres.size(), 2u);
    EXPECT_EQ(skeleton.spheres[0].centre, Vec3(0, 1, 0));
    EXPECT_FLOAT_EQ(skeleton.spheres[0].radius, 0.2f);
    EXPECT_EQ(skeleton.spheres[0].material, 1u);
    EXPECT_FLOAT_EQ(skeleton.spheres[1].radius, 0.5f);
    EXPECT_EQ(skeleton.spheres[1].segment, 1u);
}

TEST(LSystemDrawing, ATildePlacesTheOrganNamedByTheNextSymbol)
{
    const Drawing drawing = drawn("angle: 90\nstep: 0.5\naxiom: F~L+~F(2)~[F]\n");
    const Skeleton& skeleton = drawing.skeleton;
    EXPECT_EQ(skeleton.size(), 2u) << "the F after ~ draws nothing; the bracket stays a bracket";
    ASSERT_EQ(skeleton.organs.size(), 2u);
    EXPECT_EQ(drawing.symbols[skeleton.organs[0].organ], 'L');
    EXPECT_EQ(drawing.symbols[skeleton.organs[1].organ], 'F');
    EXPECT_FLOAT_EQ(skeleton.organs[0].size, 0.5f);
    EXPECT_FLOAT_EQ(skeleton.organs[1].size, 2.0f);
    EXPECT_EQ(skeleton.organs[0].position, Vec3(0, 0.5f, 0));
    EXPECT_EQ(skeleton.organs[1].heading, Vec3(-1, 0, 0));
}

TEST(LSystemDrawing, TropismBendsTheHeadingTowardsItsDirection)
{
    // One step by hand: H = (-1, 0, 0), T = (0, -1, 0), |H x T| = 1: H turns by 0.3 radians towards T.
    const Skeleton skeleton = drawn("angle: 90\ntropism: 0.3 0 -1 0\naxiom: +FF\n").skeleton;
    ASSERT_EQ(skeleton.size(), 2u);
    EXPECT_EQ(skeleton.headings[0], Vec3(-1, 0, 0)) << "the turtle turns after the segment";
    EXPECT_NEAR(skeleton.headings[1].x, -std::cos(0.3f), 1e-6f);
    EXPECT_NEAR(skeleton.headings[1].y, -std::sin(0.3f), 1e-6f);
    // A direction is taken as it is given, whatever its length; along the heading there is nothing to turn about.
    const Skeleton twice = drawn("angle: 90\ntropism: 0.15 0 -2 0\naxiom: +FF\n").skeleton;
    EXPECT_NEAR(twice.headings[1].x, skeleton.headings[1].x, 1e-6f);
    EXPECT_EQ(drawn("tropism: 0.3 0 -1 0\naxiom: FF\n").skeleton.headings[1], Vec3(0, 1, 0));
    // Moves do not bend.
    EXPECT_EQ(drawn("angle: 90\ntropism: 0.3 0 -1 0\naxiom: +fF\n").skeleton.headings[0], Vec3(-1, 0, 0));
    // Frames stay frames.
    const Skeleton many = drawn("tropism: 0.2 0.3 -1 0.1\naxiom: +(40)A\nA -> F/(30)A\n", 60).skeleton;
    for (std::uint32_t i = 0; i < many.size(); ++i)
    {
        EXPECT_NEAR(glm::length(many.headings[i]), 1, 1e-6f);
        EXPECT_NEAR(glm::dot(many.headings[i], many.lefts[i]), 0, 1e-6f);
    }
}

TEST(LSystemDrawing, TheGrammarSaysWhatDrawsAndWhatMoves)
{
    const Skeleton skeleton = drawn("draw: A\nmove: B F\naxiom: AFBG A\n").skeleton;
    EXPECT_EQ(skeleton.size(), 2u);
    EXPECT_EQ(skeleton.starts[1], Vec3(0, 3, 0));
    EXPECT_EQ(skeleton.parents[1], 0u) << "a move adds no segment: the next hangs on the last drawn";
}

TEST(LSystemDrawing, AWidthOtherThanTheDefaultIsGiven)
{
    EXPECT_FALSE(drawn("axiom: F\n").skeleton.widthsGiven);
    EXPECT_TRUE(drawn("width: 0.2\naxiom: F\n").skeleton.widthsGiven);
    EXPECT_TRUE(drawn("axiom: !F\n").skeleton.widthsGiven);
}

TEST(LSystemDrawing, InterpretationDrawsWhatDerivationKeepsApart)
{
    const Skeleton tree = drawn("angle: 45\ndraw: 0 1\naxiom: 0\n1 -> 11\n0 -> 1[0]0\n"
                                "interpret: [ -> [ +\ninterpret: ] -> ] -\n",
                                2)
                              .skeleton;
    const SkeletonFacts facts = measure(tree);
    EXPECT_EQ(facts.segments, 8u);
    EXPECT_EQ(facts.tips, 4u);
    EXPECT_NEAR(facts.maxY, 3.707106781, 1e-6);
    EXPECT_NEAR(facts.maxRadius, 1.707106781, 1e-6);
}

TEST(LSystemDrawing, MisuseIsToldWithItsPlaceInTheWord)
{
    struct Case
    {
        const char* text;
        const char* error;
    };
    const Case cases[] = {
        {"axiom: F[F]F\ninterpret: ] -> ]]\n", "module 5 of the word: `]` without `[`; expected balanced brackets"},
        {"axiom: F[F]\ninterpret: [ -> [[\n",
         "`[` is never closed in the word of 5 modules; expected balanced brackets"},
        {"axiom: F}\n", "module 2 of the word: `}` without `{`; expected balanced braces"},
        {"axiom: {f\n", "`{` is never closed in the word of 2 modules; expected balanced braces"},
        {"axiom: FFF(1e9)\n", "module 3 of the word: the plant reaches farther than 1e+05 m from the origin"},
    };
    for (const Case& c : cases)
    {
        const Drawing drawing = drawn(c.text);
        EXPECT_TRUE(drawing.error.starts_with(c.error)) << c.text << drawing.error;
        EXPECT_TRUE(drawing.skeleton == Skeleton{});
    }
    Limits limits;
    limits.vertices = 4;
    EXPECT_EQ(drawn("axiom: {ffff}\n", 0, limits).error, "");
    EXPECT_NE(drawn("axiom: {fffff}\n", 0, limits).error.find("the limit vertices"), std::string::npos);
    limits.nodes = 1;
    EXPECT_EQ(drawn("axiom: F{ff}\n", 0, limits).error, "") << "moves are no segments";
    EXPECT_EQ(drawn("axiom: {f.f}\n", 0, limits).error, "");
    EXPECT_NE(drawn("axiom: F{fF}\n", 0, limits).error.find("the limit nodes"), std::string::npos);
    limits.nodes = 0;
    EXPECT_EQ(drawn("axiom: {ff}\n", 0, limits).error, "");
    limits.nodes = 2;
    EXPECT_EQ(drawn("axiom: @@\n", 0, limits).error, "");
    EXPECT_NE(drawn("axiom: @@@\n", 0, limits).error.find("the limit nodes"), std::string::npos);
    EXPECT_NE(drawn("axiom: ~L~L~L\n", 0, limits).error.find("the limit nodes"), std::string::npos);
}

TEST(LSystemDrawing, ACutLeavesPolygonsWhole)
{
    // What is cut off counts for nothing, but a polygon begun before the cut ends where it would have ended.
    const Skeleton skeleton = drawn("axiom: [{fff%{ff}F}F]F\n").skeleton;
    EXPECT_EQ(skeleton.size(), 1u);
    EXPECT_EQ(skeleton.polygons.size(), 1u);
    EXPECT_EQ(skeleton.polygons[0].cornerCount, 3u);
}

TEST(LSystemDrawing, ABraceThatEndsWhatWasCutOffEndsNothingElse)
{
    const Skeleton cut = drawn("axiom: F[%{f]f}F\n").skeleton;
    EXPECT_EQ(cut.size(), 2u);
    EXPECT_TRUE(cut.polygons.empty());
    // From the inside out: the leaf, what was cut off, the polygon round both.
    const Skeleton nested = drawn("axiom: {f[%{]{fff}}ff}\n").skeleton;
    ASSERT_EQ(nested.polygons.size(), 2u);
    EXPECT_EQ(nested.polygons[0].cornerCount, 3u);
    EXPECT_EQ(nested.polygons[1].cornerCount, 3u);
}

} // namespace
} // namespace espalier
