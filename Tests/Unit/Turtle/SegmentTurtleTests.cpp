#include <Espalier/Turtle/SegmentTurtle.h>

#include <Allocations.h>
#include <Espalier/Core/Json.h>
#include <Espalier/Plant/Skeleton.h>
#include <Grammar/RandomGrammar.h>
#include <chrono>
#include <cstring>
#include <gtest/gtest.h>
#include <string>
#include <vector>

namespace espalier {
namespace {

constexpr const char* kFractalPlant = "axiom: X\nangle: 25\nX -> F+[[X]-X]-F[-FX]+X\nF -> FF\n";

GrammarProgram programOf(const std::string& text)
{
    const auto grammar = parseGrammar(text, "test", {});
    if (!grammar)
        ADD_FAILURE() << toString(grammar.error()) << "\n" << text;
    return GrammarProgram::make(grammar.value()).value();
}

/// What drawSegments gives, or its error.
struct Drawn
{
    std::vector<TurtleSegment> segments;
    std::string error;
    Skeleton skeleton; ///< Where a Turtle has drawn it.
};

Drawn segmentsOf(const GrammarProgram& program, std::uint32_t steps, SegmentReuse reuse = SegmentReuse::Never,
                 const Limits& limits = {}, std::size_t room = 1u << 17)
{
    Drawn drawn;
    drawn.segments.resize(room);
    DerivationScratch derivation;
    TurtleScratch turtle;
    const auto count = drawSegments(program, TurtleAlphabet(program), RandomKey(Seed{7}), steps, reuse, limits,
                                    derivation, turtle, drawn.segments);
    if (!count)
        drawn.error = count.error().what;
    drawn.segments.resize(count.value_or(0));
    return drawn;
}

/// The word that is drawn, interpreted.
Word wordOf(const GrammarProgram& program, std::uint32_t steps, const Limits& limits, std::string& error)
{
    struct Collector final : DerivationSink
    {
        Word word;
        bool modules(std::span<const LetterId> letters, std::span<const double> arguments) override
        {
            word.letters.insert(word.letters.end(), letters.begin(), letters.end());
            word.arguments.insert(word.arguments.end(), arguments.begin(), arguments.end());
            return true;
        }
    };
    Collector collector;
    DerivationScratch scratch;
    Word word;
    const RandomKey key(Seed{7});
    if (const auto done = deriveWord(program, key, steps, limits, scratch, word); !done)
        error = done.error().what;
    else if (const auto emitted = emitWord(program, steps, Interpretation::Apply, limits, scratch, word, collector);
             !emitted)
        error = emitted.error().what;
    return std::move(collector.word);
}

/// How a word is handed to a Turtle.
enum class Pieces
{
    Symbols, ///< One by one, as commands.
    Runs,    ///< Of arbitrary lengths.
    Whole,
};

Drawn skeletonOf(const GrammarProgram& program, const Word& word, Pieces pieces, const Limits& limits = {})
{
    // Memory of other turtles must not tell: runs are drawn with that of all before.
    static TurtleScratch shared;
    TurtleScratch own;
    TurtleScratch& scratch = pieces == Pieces::Runs ? shared : own;
    Drawn drawn;
    Skeleton& skeleton = drawn.skeleton;
    const TurtleAlphabet alphabet(program);
    Turtle turtle(turtleSettings(program.grammar()), limits, scratch, skeleton);
    const std::span<const LetterId> letters(word.letters);
    std::span<const double> arguments(word.arguments);
    std::uint64_t random = 88172645463325252u;
    for (std::size_t i = 0; i < letters.size();)
    {
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        std::size_t size = pieces == Pieces::Symbols ? 1 : pieces == Pieces::Runs ? random % 12 : letters.size();
        size = std::min(size, letters.size() - i);
        std::size_t arity = 0;
        for (std::size_t k = i; k < i + size; ++k)
            arity += alphabet.arities[letters[k]];
        // In memory of its own, so that reading beyond the run is found.
        const std::vector<LetterId> run(letters.begin() + static_cast<std::ptrdiff_t>(i),
                                        letters.begin() + static_cast<std::ptrdiff_t>(i + size));
        const bool isDone = pieces == Pieces::Symbols
                                ? turtle.apply(alphabet.commands[letters[i]], arguments.first(arity))
                                : turtle.apply(alphabet, run, arguments.first(arity));
        if (!isDone)
            break;
        arguments = arguments.subspan(arity);
        i += size;
    }
    if (const auto done = turtle.finish(); !done)
        drawn.error = done.error().what;
    for (SkeletonOrgan& organ : skeleton.organs)
        organ.organ = 0; // commands have no names
    for (std::uint32_t i = 0; i < skeleton.size(); ++i)
        drawn.segments.push_back({skeleton.starts[i], skeleton.startRadii[i], skeleton.ends[i], skeleton.parents[i]});
    return drawn;
}

bool sameBits(const std::vector<TurtleSegment>& a, const std::vector<TurtleSegment>& b)
{
    return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), a.size() * sizeof(a[0])) == 0);
}

/// Every way of drawing gives the same.
void expectOneAnswer(const GrammarProgram& program, std::uint32_t steps, const std::string& text,
                     const Limits& limits = {})
{
    std::string wordError;
    const Word word = wordOf(program, steps, limits, wordError);
    const Drawn drawn = segmentsOf(program, steps, SegmentReuse::Never, limits);
    if (!wordError.empty())
    {
        EXPECT_NE(drawn.error, "") << wordError << "\n" << text;
        return;
    }
    const Drawn whole = skeletonOf(program, word, Pieces::Whole, limits);
    for (const Pieces pieces : {Pieces::Symbols, Pieces::Runs})
    {
        const Drawn other = skeletonOf(program, word, pieces, limits);
        EXPECT_TRUE(other.skeleton == whole.skeleton) << static_cast<int>(pieces) << "\n" << text;
        EXPECT_EQ(other.error, whole.error) << static_cast<int>(pieces) << "\n" << text;
    }
    EXPECT_EQ(drawn.error, whole.error) << text;
    if (drawn.error.empty())
    {
        EXPECT_TRUE(sameBits(drawn.segments, whole.segments)) << text;
    }
}

/// A grammar of the turtle's symbols, most of them without parameters, with balanced brackets and few braces.
class PlantWriter
{
public:
    PlantWriter(std::uint64_t seed, bool isRich) : key_(Seed{seed}), isRich_(isRich) {}

    std::string grammar()
    {
        std::string text = "axiom: " + word(3) + "\nangle: " + pick({"25", "90", "22.5", "7", "0", "120"}) + "\n";
        if (isRich_ && draw(4) == 0)
            text += "tropism: 0.3 -1 0.2 0.22\n";
        for (const char* name : {"X", "A", "F"})
            if (draw(4) > 0)
                text += std::string(name) + " -> " + word(3) + "\n";
        return text;
    }

private:
    std::uint32_t draw(std::uint32_t count)
    {
        return static_cast<std::uint32_t>(key_.child(next_++).uniform(Purpose::ChooseProduction) * count);
    }
    std::string pick(const std::vector<std::string>& from)
    {
        return from[draw(static_cast<std::uint32_t>(from.size()))];
    }

    std::string word(int depth)
    {
        static const std::vector<std::string> plain = {"F", "F", "f", "X", "X", "A", "+", "+", "-", "-", "+", "-"};
        static const std::vector<std::string> more = {
            "&",    "^",      "\\",   "/",       "|",     "$",      "!",      "!(0.3)", "'",     "'(3)",
            "%",    "~",      "@",    "@(0.2)",  "{.f.}", "F(0.5)", "f(2)",   "+(0)",   "-(31)", "&(18.95)",
            "/(0)", "/(120)", "F(0)", "+(-1.5)", "{",     "G",      "F(-.3)", ".",      "}",     "\\(94.74)"};
        std::string text;
        const std::uint32_t count = 1 + draw(6);
        for (std::uint32_t i = 0; i < count; ++i)
            if (depth > 0 && draw(3) == 0)
                text += "[" + word(depth - 1) + "]";
            else
                text += isRich_ && draw(3) == 0 ? pick(more) : pick(plain);
        return text;
    }

    RandomKey key_;
    bool isRich_;
    std::uint32_t next_ = 0;
};

TEST(SegmentTurtle, AnEmptyWordDrawsNothing)
{
    const GrammarProgram program = programOf("axiom: X\nX -> [+]\n");
    EXPECT_TRUE(segmentsOf(program, 3).segments.empty());
    EXPECT_EQ(segmentsOf(program, 3, SegmentReuse::WhereItCan, {}, 0).error, "");
}

TEST(SegmentTurtle, DrawsWhatATurtleDraws)
{
    for (std::uint64_t seed = 0; seed < 400; ++seed)
    {
        const std::string text = PlantWriter(seed, seed % 2 == 1).grammar();
        const GrammarProgram program = programOf(text);
        for (const std::uint32_t steps : {0u, 1u, 3u})
            expectOneAnswer(program, steps, text);
    }
}

TEST(SegmentTurtle, DrawsEveryGrammarAsATurtleDoes)
{
    Limits limits;
    limits.modules = 4096;
    limits.derivationWork = 1u << 20;
    for (std::uint64_t seed = 0; seed < 300; ++seed)
    {
        const auto program = GrammarProgram::make(samples::RandomGrammar(seed).make());
        if (program)
            expectOneAnswer(*program, static_cast<std::uint32_t>(seed % 4), "seed " + std::to_string(seed), limits);
    }
}

const char* const kPublished[] = {
    kFractalPlant,
    "axiom: F\nangle: 25.7\nF -> F[+F]F[-F]F\n",
    "axiom: F\nangle: 20\nF -> F[+F]F[-F][F]\n",
    "axiom: F\nangle: 22.5\nF -> FF-[-F+F+F]+[+F-F-F]\n",
    "axiom: F\nangle: 90\nF -> F+F-F-F+F\n",
    "axiom: F-G-G\nangle: 120\nF -> F-G+F+G-F\nG -> GG\n",
    "axiom: A\nangle: 22.5\nA -> [&FL!A]/////'[&FL!A]///////'[&FL!A]\nF -> S/////F\nS -> FL\n"
    "L -> ['''^^{-f+f+f-|-f+f+f}]\n",
    "let d1 = 94.74\nlet d2 = 132.63\nlet a = 18.95\nlet lr = 1.109\nlet vr = 1.732\naxiom: !(1)F(200)/(45)A\n"
    "A -> !(vr)F(50)[&(a)F(50)A]/(d1)[&(a)F(50)A]/(d2)[&(a)F(50)A]\nF(l) -> F(l*lr)\n!(w) -> !(w*vr)\n",
};

TEST(SegmentTurtle, DrawsThePublishedPlants)
{
    for (const char* text : kPublished)
        for (std::uint32_t steps = 0; steps <= 5; ++steps)
            expectOneAnswer(programOf(text), steps, text);
}

/// Off by rounding to floats, of positions and of a rotation, once: what is copied was never itself a copy.
TEST(SegmentTurtle, ReuseIsCloseAndKeepsTopology)
{
    const auto expectClose = [](const std::string& text, std::uint32_t steps) {
        const GrammarProgram program = programOf(text);
        const Drawn exact = segmentsOf(program, steps);
        const Drawn reused = segmentsOf(program, steps, SegmentReuse::WhereItCan);
        ASSERT_EQ(reused.error.empty(), exact.error.empty()) << text;
        ASSERT_EQ(reused.segments.size(), exact.segments.size()) << text;
        float size = 1;
        for (const TurtleSegment& segment : exact.segments)
            size = std::max(size, glm::length(segment.end));
        for (std::size_t i = 0; i < exact.segments.size(); ++i)
        {
            const TurtleSegment& a = exact.segments[i];
            const TurtleSegment& b = reused.segments[i];
            ASSERT_EQ(a.parent, b.parent) << i << "\n" << text;
            ASSERT_EQ(a.radius, b.radius) << i << "\n" << text;
            ASSERT_LT(glm::length(a.start - b.start), 1e-5f * size) << i << "\n" << text;
            ASSERT_LT(glm::length(a.end - b.end), 1e-5f * size) << i << "\n" << text;
        }
    };
    for (const char* text : kPublished)
        for (const std::uint32_t steps : {2u, 4u, 5u})
            expectClose(text, steps);
    expectClose(kFractalPlant, 8);
    for (std::uint64_t seed = 0; seed < 300; ++seed)
        expectClose(PlantWriter(seed, seed % 2 == 1).grammar(), 4);
}

TEST(SegmentTurtle, TheBufferMayBeExactlyFullAndNoSmaller)
{
    const GrammarProgram program = programOf(kFractalPlant);
    const std::size_t count = segmentsOf(program, 6).segments.size();
    for (const SegmentReuse reuse : {SegmentReuse::Never, SegmentReuse::WhereItCan})
    {
        EXPECT_EQ(segmentsOf(program, 6, reuse, {}, count).error, "");
        EXPECT_EQ(segmentsOf(program, 6, reuse, {}, count).segments.size(), count);
        for (const std::size_t room : {count - 1, count / 2, std::size_t{1}, std::size_t{0}})
            EXPECT_TRUE(segmentsOf(program, 6, reuse, {}, room)
                            .error.ends_with("the plant has more than " + std::to_string(room) + " segments"));
    }
}

TEST(SegmentTurtle, AConsumerGetsEverythingInOrder)
{
    const GrammarProgram program = programOf(kFractalPlant);
    const Drawn whole = segmentsOf(program, 6);
    for (const std::size_t room : {std::size_t{1}, std::size_t{7}, whole.segments.size() - 1, whole.segments.size()})
    {
        std::vector<TurtleSegment> buffer(room);
        std::vector<TurtleSegment> all;
        DerivationScratch derivation;
        TurtleScratch turtle;
        const auto collect = [&](std::span<const TurtleSegment> segments) {
            EXPECT_FALSE(segments.empty());
            all.insert(all.end(), segments.begin(), segments.end());
            return true;
        };
        const auto count = drawSegments(program, TurtleAlphabet(program), RandomKey(Seed{7}), 6,
                                        SegmentReuse::WhereItCan, {}, derivation, turtle, buffer, collect);
        ASSERT_TRUE(count);
        EXPECT_EQ(*count, whole.segments.size());
        EXPECT_TRUE(sameBits(all, whole.segments)) << room;

        int calls = 0;
        const auto stopped =
            drawSegments(program, TurtleAlphabet(program), RandomKey(Seed{7}), 6, SegmentReuse::Never, {}, derivation,
                         turtle, buffer, [&](std::span<const TurtleSegment>) { return ++calls < 3; });
        EXPECT_EQ(stopped.has_value(), calls < 3);
        EXPECT_LE(calls, 3);
        if (!stopped)
        {
            EXPECT_EQ(stopped.error().kind, ErrorKind::Cancelled);
        }
    }
}

TEST(SegmentTurtle, MisuseIsAnError)
{
    Limits limits;
    limits.bracketDepth = 2;
    limits.coordinate = 10;
    struct Case
    {
        const char* word;
        const char* part; ///< Empty: it is allowed.
    };
    const Case cases[] = {
        {"F{F", "never closed"},
        {"F%[[[F]]]", "brackets nest deeper"},
        {"F}", "`}` without `{`"},
        {"[[F]]", ""},
        {"[[]][[X]]", ""},
        {"[[[]]]", "brackets nest deeper"},
        {"F(10)", ""},
        {"f(-10)", ""},
        {"F(10.001)", "farther than 10 m"},
        {"+(90)f(11)", "farther than 10 m"},
        {"F(1e308)F(1e308)", "farther than 10 m"},
        {"F(1e308)F(-1e308)", "farther than 10 m"},
        {"!(10)F", ""},
        {"!(11)F", "a diameter is larger"},
        {"F[%{]F", ""},
        {"F[%{]F}F", ""},
        {"F[%{]{F}}F", ""},
        {"F[%{]}}F", "`}` without `{`"},
        {"{{F}}", ""},
        {"{{{F}}}", "polygons nest deeper"},
        {"{F[%}]F", ""},
    };
    for (const Case& c : cases)
    {
        const std::string error =
            segmentsOf(programOf(std::string("axiom: ") + c.word + "\n"), 0, SegmentReuse::Never, limits).error;
        if (*c.part == 0)
            EXPECT_EQ(error, "") << c.word;
        else
            EXPECT_NE(error.find(c.part), std::string::npos) << c.word << ": " << error;
        expectOneAnswer(programOf(std::string("axiom: ") + c.word + "\n"), 0, c.word, limits);
    }
}

TEST(SegmentTurtle, ManyTurnsInARowAreOneTurn)
{
    for (const int turns : {1, 15, 16, 17, 100, 72, 1000})
    {
        const std::string word =
            std::string(static_cast<std::size_t>(turns), '+') + "F[-F]" + std::string(3, '-') + "F";
        const GrammarProgram program = programOf("angle: 5\naxiom: " + word + "\n");
        expectOneAnswer(program, 0, word);
        const GrammarProgram one = programOf("angle: 5\naxiom: +(" + std::to_string(turns * 5) + ")F\n");
        EXPECT_EQ(segmentsOf(program, 0).segments[0].end, segmentsOf(one, 0).segments[0].end) << turns;
    }
}

TEST(SegmentTurtle, TurnsThatCancelChangeNoBit)
{
    EXPECT_TRUE(sameBits(segmentsOf(programOf("axiom: +(13)F+[-X-]-F--++F\n"), 0).segments,
                         segmentsOf(programOf("axiom: +(13)FFF\n"), 0).segments));
    EXPECT_TRUE(sameBits(segmentsOf(programOf("angle: 0\naxiom: +(13)F+F&F/F\n"), 0).segments,
                         segmentsOf(programOf("angle: 0\naxiom: +(13)FFFF\n"), 0).segments));
}

/// A plant of 25 million segments through a buffer of 64 KiB.
TEST(SegmentTurtle, StreamsInLittleMemory)
{
    if (!ESPALIER_COUNTS_ALLOCATIONS)
        GTEST_SKIP() << "under sanitizers allocations are not counted";
    const GrammarProgram program = programOf(kFractalPlant);
    Limits limits;
    limits.modules = 1u << 30;
    limits.derivationWork = 0xffffffffu;
    limits.coordinate = 1e9;
    std::vector<TurtleSegment> buffer(2048);
    std::size_t got = 0;
    const std::uint64_t before = allocations::bytes;
    DerivationScratch derivation;
    TurtleScratch turtle;
    const auto count = drawSegments(program, TurtleAlphabet(program), RandomKey(Seed{7}), 12, SegmentReuse::Never,
                                    limits, derivation, turtle, buffer, [&](std::span<const TurtleSegment> segments) {
                                        got += segments.size();
                                        return true;
                                    });
    ASSERT_TRUE(count);
    EXPECT_EQ(*count, 25159680u);
    EXPECT_EQ(got, *count);
    EXPECT_LT(allocations::bytes - before, 1u << 20);
}

TEST(SegmentTurtle, ReusingTakesLittleMemoryWhereItIsOfNoUse)
{
    if (!ESPALIER_COUNTS_ALLOCATIONS)
        GTEST_SKIP() << "under sanitizers allocations are not counted";
    std::string text = "axiom: F\nsymbols:";
    std::string rules;
    for (int i = 0; i < 3900; ++i)
    {
        text += " X" + std::to_string(i);
        rules += "X" + std::to_string(i) + " -> FX" + std::to_string((i + 1) % 3900) + "\n";
    }
    const GrammarProgram program = programOf(text + "\n" + rules);
    const TurtleAlphabet alphabet(program);
    std::vector<TurtleSegment> buffer(100);
    DerivationScratch derivation;
    TurtleScratch turtle;
    const std::uint64_t before = allocations::bytes;
    ASSERT_TRUE(drawSegments(program, alphabet, RandomKey(Seed{7}), 60, SegmentReuse::WhereItCan, {}, derivation,
                             turtle, buffer));
    EXPECT_LT(allocations::bytes - before, 2u << 20);
}

TEST(SegmentTurtle, WorkHasALimitHoweverLittleIsDrawn)
{
    // A hundred thousand modules that come and go and draw nothing.
    std::string text = "symbols:";
    std::string rules = "B -> C\nC -> B\n";
    for (int i = 0; i < 17; ++i)
    {
        const std::string name = "A" + std::to_string(i);
        const std::string next = i < 16 ? "A" + std::to_string(i + 1) : "B";
        text += " " + name;
        rules += name + " -> " + next + next + "\n";
    }
    const GrammarProgram program = programOf(text + "\naxiom: F A0\n" + rules);
    for (const SegmentReuse reuse : {SegmentReuse::Never, SegmentReuse::WhereItCan})
    {
        Limits limits;
        limits.derivationWork = 1u << 20;
        const Drawn drawn = segmentsOf(program, 300, reuse, limits);
        EXPECT_NE(drawn.error.find("units of work"), std::string::npos) << drawn.error;
    }
}

TEST(SegmentTurtle, WhatIsCertainToBeTooMuchIsRefusedBeforeAnythingIsDrawn)
{
    const GrammarProgram program = programOf("axiom: F\nF -> FF\n");
    std::vector<TurtleSegment> buffer(64);
    DerivationScratch derivation;
    TurtleScratch turtle;
    std::size_t got = 0;
    const auto drawn = drawSegments(program, TurtleAlphabet(program), RandomKey(Seed{7}), 64, SegmentReuse::Never, {},
                                    derivation, turtle, buffer, [&](std::span<const TurtleSegment> segments) {
                                        got += segments.size();
                                        return true;
                                    });
    ASSERT_FALSE(drawn);
    EXPECT_NE(drawn.error().what.find("step 23 makes a word of 8388608 modules"), std::string::npos);
    EXPECT_EQ(got, 0u);
}

/// Letters that are not drawn are not looked at again and again, however little room there is.
TEST(SegmentTurtle, RareCommandsTakeLinearTime)
{
    const std::string rare = "|$.~L{}";
    std::string word;
    for (int i = 0; i < 60000; ++i)
        word += rare[static_cast<std::size_t>(i) % rare.size()];
    word += "FFF";
    for (const char* settings : {"", "tropism: 0.1 0 -1 0\n"})
    {
        const GrammarProgram program = programOf(std::string(settings) + "axiom: " + word + "\n");
        const auto start = std::chrono::steady_clock::now();
        EXPECT_EQ(segmentsOf(program, 0, SegmentReuse::Never, {}, 3).segments.size(), 3u);
        for (int i = 0; i < 8; ++i)
            EXPECT_EQ(skeletonOf(program, wordOf(program, 0, {}, word), Pieces::Whole).skeleton.size(), 3u);
        const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
        EXPECT_LT(taken.count(), 8) << "some hundredths; minutes if they were";
    }
}

} // namespace
} // namespace espalier
