#include <Espalier/Grammar/Derivation.h>
#include <Grammar/RandomGrammar.h>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <gtest/gtest.h>
#include <map>
#include <string>

namespace espalier {
namespace {

/// Writes the word down, instances in braces, and keeps all arguments.
class WordSink final : public DerivationSink
{
public:
    explicit WordSink(const GrammarProgram& program) : program_(program) {}

    std::string word;
    std::vector<double> arguments;
    std::vector<std::uint32_t> rows;
    std::uint64_t count = 0;
    std::uint64_t stopAfter = ~std::uint64_t{0};
    bool balanced = true;

    bool modules(std::span<const LetterId> letters, std::span<const double> values) override
    {
        for (const LetterId letter : letters)
        {
            const std::string& name = program_.grammar().symbols.name(program_.symbolOf(letter));
            depth_ += name == "[" ? 1 : name == "]" ? -1 : 0;
            balanced = balanced && depth_ >= 0;
            if (++count <= 10000)
                word += name;
        }
        arguments.insert(arguments.end(), values.begin(), values.end());
        return count < stopAfter;
    }
    void beginInstance(std::uint32_t, std::uint32_t row) override
    {
        rows.push_back(row);
        word += '{';
    }
    void endInstance() override { word += '}'; }
    [[nodiscard]] bool closed() const { return balanced && depth_ == 0; }

private:
    const GrammarProgram& program_;
    int depth_ = 0;
};

Grammar parsed(const std::string& text)
{
    auto grammar = parseGrammar(text, "g.lsys", {});
    EXPECT_TRUE(grammar) << text << "\n" << (grammar ? "" : toString(grammar.error()));
    return grammar ? std::move(*grammar) : Grammar{};
}

struct Derived
{
    std::string word;
    std::vector<double> arguments;
    std::vector<std::uint32_t> rows;
    bool whole = false;
    std::string error;
};

Derived derived(const GrammarProgram& program, std::uint64_t seed = 1, const DerivationBudget& budget = {})
{
    WordSink sink(program);
    DerivationScratch scratch;
    const auto done = deriveToEnd(program, RandomKey(Seed{seed}), budget, scratch, sink);
    return {sink.word, sink.arguments, sink.rows, done && *done && sink.closed(), done ? "" : toString(done.error())};
}

GrammarProgram programOf(const std::string& text, std::span<const TransformTable> tables = {})
{
    auto program = GrammarProgram::make(parsed(text), tables);
    EXPECT_TRUE(program) << (program ? "" : toString(program.error()));
    return std::move(*program);
}

Derived derived(const std::string& text, std::uint64_t seed = 1, const DerivationBudget& budget = {})
{
    return derived(programOf(text), seed, budget);
}

std::string makeError(const std::string& text, std::span<const TransformTable> tables = {})
{
    const auto program = GrammarProgram::make(parsed(text), tables);
    EXPECT_FALSE(program) << text;
    return program ? "" : toString(program.error());
}

double secondsOf(const auto& function)
{
    const auto start = std::chrono::steady_clock::now();
    function();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// How often each word comes out over `draws` seeds.
std::map<std::string, double> frequencies(const GrammarProgram& program, int draws)
{
    std::map<std::string, double> counts;
    DerivationScratch scratch;
    for (int i = 0; i < draws; ++i)
    {
        WordSink sink(program);
        const auto done =
            deriveToEnd(program, RandomKey(Seed{1000}).child(static_cast<std::uint64_t>(i)), {}, scratch, sink);
        EXPECT_TRUE(done) << toString(done.error());
        ++counts[sink.word];
    }
    return counts;
}

/// Pearson's statistic of `counts` against shares that sum to 1; infinite where a share of 0 was drawn.
double chiSquare(std::map<std::string, double> counts, const std::map<std::string, double>& shares, double draws)
{
    double sum = 0;
    for (const auto& [word, share] : shares)
    {
        const double expected = share * draws;
        sum += expected > 0 ? (counts[word] - expected) * (counts[word] - expected) / expected : counts[word] * 1e9;
        counts.erase(word);
    }
    return counts.empty() ? sum : 1e9;
}

TEST(Derivation, NothingIsLeftOfNothing)
{
    EXPECT_EQ(derived("axiom: _\n").word, "");
    EXPECT_EQ(derived("axiom: A\nA ->\n").word, "");
    EXPECT_EQ(derived("axiom: A[+B]\n").word, "A[+B]");
}

TEST(Derivation, RewritesUntilNothingCanBe)
{
    EXPECT_EQ(derived("axiom: A+A\nA -> F[B]\nB -> G C\nC -> f\n").word, "F[Gf]+F[Gf]");
    const Derived parametric =
        derived("let r = 0.5\naxiom: A(8)\nA(l) : l > 1 -> F(l)[-(l*10)A(l*r)]\nA(l) : l <= 1 -> G(l)\n");
    EXPECT_EQ(parametric.word, "F[-F[-F[-G]]]");
    EXPECT_EQ(parametric.arguments, (std::vector<double>{8, 80, 4, 40, 2, 20, 1}));
}

TEST(Derivation, WhatNoProductionMatchesIsCopied)
{
    EXPECT_EQ(derived("axiom: A A(1) A(1,2)\nA(x) -> F\n").word, "AFA") << "another number of parameters";
    const Derived condition = derived("axiom: F(4)\nF(l) : l > 1 -> F(l/2) F(l/2)\n");
    EXPECT_EQ(condition.word, "FFFF") << "no condition holds";
    EXPECT_EQ(condition.arguments, (std::vector<double>{1, 1, 1, 1}));
}

TEST(Derivation, TheStepIsTheNumberOfTheDerivationStep)
{
    EXPECT_EQ(derived("axiom: F(n)A\nA : n < 4 -> F(n)A\nA : n >= 4 -> G(n)\n").arguments,
              (std::vector<double>{0, 1, 2, 3, 4}));
}

TEST(Derivation, TheFirstMatchDecidesWhetherWeightsCount)
{
    EXPECT_EQ(derived("axiom: A\nA -> F\nA -> G : 1000\n").word, "F");
    const auto counts = frequencies(programOf("axiom: A\nA -> F : 1\nA -> G\nA -> f : 1\n"), 400);
    EXPECT_EQ(counts.size(), 2u);
    EXPECT_FALSE(counts.contains("G"));
    const auto conditional =
        frequencies(programOf("axiom: A(1)\nA(x) : x > 1 -> G\nA(y) : y > 0 -> F : y\nA(z) -> f : z\n"), 400);
    EXPECT_EQ(conditional.size(), 2u);
    EXPECT_FALSE(conditional.contains("G"));
}

TEST(Derivation, ProductionsAreChosenByTheirWeights)
{
    constexpr int kDraws = 4000;
    const std::map<std::string, double> shares = {{"F", 0.1}, {"G", 0.3}, {"f", 0.6}, {"g", 0}};
    for (const char* text : {
             "axiom: A\nA -> F : 1\nA -> G : 3\nA -> g : 0\nA -> f : 6\n",
             "let w = 2\naxiom: A\nA -> F : w/20\nA -> G : 0.3\nA -> g : 0\nA -> f : 0.6\n",
             "axiom: A(5)\nA(x) -> F : x/5\nA(x) -> G : 3\nA(x) -> g : x-5\nA(x) -> f : 6\n",
             "axiom: A(5)\nA(x) : x > 1 -> F : 1e300\nA(x) : x < 9 -> G : 3e300\nA(x) : x > 9 -> g : 1e300\nA(x) -> f "
             ": 6e300\n",
             "axiom: A\nA -> F : 1e307\nA -> G : 3e307\nA -> g : 0\nA -> f : 6e307\n",
         })
        EXPECT_LT(chiSquare(frequencies(programOf(text), kDraws), shares, kDraws), 16.3)
            << text; // p = 0.001 of 3 degrees
}

TEST(Derivation, HugeWeightsKeepTheirProportions)
{
    constexpr int kDraws = 2000;
    const auto counts =
        frequencies(programOf("axiom: A\nA -> F : 1.5e308\nA -> G : 1.5e308\nA -> f : 1.5e308\n"), kDraws);
    EXPECT_LT(chiSquare(counts, {{"F", 1.0 / 3}, {"G", 1.0 / 3}, {"f", 1.0 / 3}}, kDraws), 13.8);
}

/// Inferred limbs: the drawn one, or with chance w any kin. Multiplying by a parameter hides the form from the table.
TEST(Derivation, TheTabulatedChoiceHasTheDistributionOfTheListedOne)
{
    constexpr int kDraws = 4000;
    const auto textOf = [](const char* axiom, double w, const char* factor) {
        std::string text = "let w = " + std::to_string(w) + "\naxiom: " + axiom + "\n";
        const char* symbols[] = {"F", "G", "f", "g"};
        const char* counts[] = {"1", "4", "0", "5"};
        for (int k = 0; k < 4; ++k)
            text += std::string("A(i, one) -> ") + symbols[k] + " : (i==" + std::to_string(k) + ")*(1-w)" + factor +
                    "+w*" + counts[k] + "/10\n";
        return text;
    };
    for (const double w : {0.0, 0.3, 1.0})
        for (int i = 0; i <= 4; ++i)
        {
            if (w == 0 && i == 4)
                continue;
            const std::string axiom = "A(" + std::to_string(i) + ", 1)";
            std::map<std::string, double> shares = {{"F", w * 0.1}, {"G", w * 0.4}, {"f", 0}, {"g", w * 0.5}};
            const char* symbols[] = {"F", "G", "f", "g"};
            if (i < 4)
                shares[symbols[i]] += 1 - w;
            double total = 0;
            for (const auto& share : shares)
                total += share.second;
            for (auto& share : shares)
                share.second /= total;
            for (const char* factor : {"", "*one"})
                EXPECT_LT(chiSquare(frequencies(programOf(textOf(axiom.c_str(), w, factor)), kDraws), shares, kDraws),
                          16.3)
                    << "w = " << w << ", limb " << i << ", factor " << factor;
        }
}

/// The listed choice would draw others, for it adds up in another order.
TEST(Derivation, TabulatesMultiplesOfAWeight)
{
    constexpr int kDraws = 500;
    const auto textOf = [](int i, const std::string& before, const std::string& inside, const std::string& behind) {
        std::string text = "let w = 0.3\nlet two = 2\naxiom: A(" + std::to_string(i) + ", 1)\n";
        const char* symbols[] = {"F", "G", "f", "g"};
        for (int k = 0; k < 4; ++k)
            text += std::string("A(i, one) -> ") + symbols[k] + " : " + before + "(i==" + std::to_string(k) +
                    ")*(1-w)" + inside + "+w/4" + inside + behind + "\n";
        return text;
    };
    bool differs = false;
    for (int i = 0; i <= 4; ++i)
    {
        const auto plain = frequencies(programOf(textOf(i, "", "", "")), kDraws);
        EXPECT_EQ(frequencies(programOf(textOf(i, "2*(", "", ")")), kDraws), plain);
        EXPECT_EQ(frequencies(programOf(textOf(i, "two*(", "", ")")), kDraws), plain);
        EXPECT_EQ(frequencies(programOf(textOf(i, "(", "", ")*two")), kDraws), plain);
        EXPECT_EQ(frequencies(programOf(textOf(i, "(", "", ")/two")), kDraws), plain);
        EXPECT_EQ(frequencies(programOf(textOf(i, "4*((", "", ")/two)*2")), kDraws), plain);
        EXPECT_EQ(frequencies(programOf(textOf(i, "", "*two", "")), kDraws), plain);
        differs = differs || frequencies(programOf(textOf(i, "one*(", "", ")")), kDraws) != plain;
    }
    EXPECT_TRUE(differs);
}

TEST(Derivation, TwoProductionsOfOneKeyShareTheBonus)
{
    constexpr int kDraws = 4000;
    const auto counts =
        frequencies(programOf("axiom: A(1)\nA(i) -> F : (i==1)*3+0\nA(i) -> G : (i==1)*5+0\nA(i) -> f : (i==2)*1+0\n"
                              "A(i) -> g : 2\n"),
                    kDraws);
    EXPECT_LT(chiSquare(counts, {{"F", 0.3}, {"G", 0.5}, {"f", 0}, {"g", 0.2}}, kDraws), 16.3);
}

TEST(Derivation, RandomConditionsOfTwoProductionsAreIndependent)
{
    constexpr int kDraws = 4000;
    const auto counts = frequencies(
        programOf("axiom: A(1)\nA(x) : rand(0, 1) < 0.5 -> F\nA(x) : rand(0, 1) < 0.5 -> G\nA(x) -> f\n"), kDraws);
    EXPECT_LT(chiSquare(counts, {{"F", 0.5}, {"G", 0.25}, {"f", 0.25}}, kDraws), 13.8);
}

TEST(Derivation, TheSameSeedGivesTheSameWordAndOthersGiveOthers)
{
    const GrammarProgram program = programOf("axiom: A A A A A A A A\nA -> F(rand(0, 1)) A : 1\nA -> G : 1\n");
    EXPECT_EQ(derived(program, 5).word, derived(program, 5).word);
    EXPECT_EQ(derived(program, 5).arguments, derived(program, 5).arguments);
    EXPECT_NE(derived(program, 5).arguments, derived(program, 6).arguments);
}

TEST(Derivation, EditingOneBranchLeavesItsSiblingsAsTheyWere)
{
    const std::string rules = "A -> F(rand(0, 1))[A][A] : 1\nA -> G : 2\nA -> f(rand(0,1))A : 1\n";
    const Derived before = derived("axiom: B A A\nB -> A\n" + rules, 3);
    const auto tailOf = [](const Derived& d, char mark) { return d.word.substr(d.word.find(mark) + 1); };
    for (const char* first : {"B -> A A A X\n", "B -> X\n", "B -> F(rand(0, 1)) G [ f f ] A X\n"})
    {
        const Derived marked = derived(std::string("axiom: B A A\n") + first + rules, 3);
        EXPECT_TRUE(before.word.ends_with(tailOf(marked, 'X'))) << first << before.word << "\n" << marked.word;
        EXPECT_GT(tailOf(marked, 'X').size(), 1u);
    }
    // Symbols that nothing rewrites do not count in the path.
    const Derived inserted = derived("axiom: B + + A - A\nB -> X\n" + rules, 3);
    std::string stripped = inserted.word;
    std::erase_if(stripped, [](char c) { return c == '+' || c == '-'; });
    EXPECT_EQ(stripped, derived("axiom: B A A\nB -> X\n" + rules, 3).word);
}

TEST(Derivation, ANegativeOrUndefinedValueNamesItsProductionAndLine)
{
    struct Case
    {
        const char* text;
        const char* start;
        const char* part;
    };
    const Case cases[] = {
        {"axiom: A\nA -> F : -1\n", "2:10: ", "the weight of the production `A -> F : -1` is -1"},
        {"axiom: A(1)\nA(x) -> F : 1\nA(x) -> G : x-2\n", "3:13: ", "`A(x) -> G : x-2` is -1"},
        {"axiom: A(1)\nA(x) -> F : 1\nA(x) -> G : 1/(x-1)\n", "3:13: ", "`A(x) -> G : 1/(x-1)`"},
        {"axiom: A(1)\nA(x) : log(-x) > 0 -> F\n", "2:8: ", "`A(x) : log(-x)>0 -> F`"},
        {"axiom: A(1)\n\nA(x) -> F B(x/0)\nB(x) -> G\n", "3:13: ", "`A(x) -> FB(x/0)`"},
        {"axiom: A(1)\nA(x) -> F(1+2/(x-1)+3)\n", "2:13: ", "no finite value"},
        {"axiom: A(1/0)\nA(x) -> F\n", "1:10: an argument of the axiom", "`A(1/0)`"},
        {"axiom: A(1)\nA(x) -> F : 0\nA(x) -> G : x-1\n", "2:1: ", "`A(1)` add up to 0"},
        {"axiom: A(3)\nA(i) -> F : (i==1)*1+0\nA(i) -> G : (i==2)*1+0\n", "2:1: ", "`A(3)` add up to 0"},
    };
    for (const Case& c : cases)
    {
        const Derived result = derived(c.text);
        EXPECT_TRUE(result.error.starts_with(c.start)) << c.text << result.error;
        EXPECT_NE(result.error.find(c.part), std::string::npos) << c.text << result.error;
    }
    EXPECT_EQ(derived("axiom: A(0)\nA(x) : x != 0 ? 1/x > 1 : 0 -> F\nA(x) -> G\n").word, "G");
}

TEST(Derivation, AStoppingSinkStopsIt)
{
    const GrammarProgram program = programOf("axiom: A\nA -> F A\n");
    WordSink sink(program);
    sink.stopAfter = 7;
    DerivationScratch scratch;
    const auto done = deriveToEnd(program, RandomKey(Seed{}), {.depth = 1u << 30, .modules = 1u << 30}, scratch, sink);
    ASSERT_TRUE(done);
    EXPECT_FALSE(*done);
    EXPECT_GE(sink.count, 7u);
    EXPECT_LT(sink.count, 5000u) << "it stops within one run of modules";
}

TEST(Derivation, ABudgetEndsWithACompleteWord)
{
    const GrammarProgram program = programOf("axiom: A [A] A\n"
                                             "A -> F [ A ] [ + A ] A : 5\n"
                                             "A -> G G B : 1\n"
                                             "A -> f : 0.001\n"
                                             "B -> [ A ] C : 3\n"
                                             "B -> _ : 1\n"
                                             "C -> C C : 1\nC -> D : 1\nD -> f : 1\n");
    for (std::uint64_t seed = 0; seed < 20; ++seed)
        for (const std::uint32_t productions : {0u, 1u, 2u, 3u, 10u, 100u})
            for (const std::uint32_t depth : {0u, 1u, 2u, 5u, 40u})
            {
                const Derived result = derived(program, seed, {productions, depth, 1000});
                ASSERT_TRUE(result.whole) << result.error;
                ASSERT_EQ(result.word.find_first_of("ABCD"), std::string::npos) << result.word;
            }
    EXPECT_EQ(derived(program, 0, {.productions = 0}).word, "f[f]f") << "the cheapest ends at once";
    EXPECT_EQ(derived(program, 0, {.depth = 0}).word, "f[f]f");
}

TEST(Derivation, ModulesMayDoubleWhileAWordIsCompleted)
{
    const GrammarProgram program = programOf("axiom: A A A A\nA -> F F A : 1\nA -> f f : 1e-9\n");
    for (std::uint32_t modules = 0; modules < 40; ++modules)
    {
        const Derived result = derived(program, 1, {.modules = modules});
        if (result.whole)
        {
            ASSERT_LE(result.word.size(), 2 * modules);
            ASSERT_EQ(result.word.find('A'), std::string::npos);
        }
        else
            ASSERT_NE(result.error.find("modules"), std::string::npos) << result.error;
        ASSERT_EQ(result.whole, modules >= 8 || derived(program, 1, {.modules = modules}).error.empty());
    }
    EXPECT_TRUE(derived(program, 1, {.modules = 20}).whole);
}

TEST(Derivation, GrammarsWithoutAnEndAreCutToWholes)
{
    for (const char* text : {
             "axiom: A\nA -> A A\n",
             "axiom: A\nA -> F A\n",
             "axiom: A\nA -> F [ A ] A\n",
             "axiom: A\nA -> B\nB -> A\n",
             "axiom: A\nA -> A : 1\nA -> A A : 1\n",
             "axiom: F\nF -> F F\n",
             "axiom: A(1)\nA(x) -> F(x) A(x+1)\n",
             "axiom: A\nA -> F A : 1\nA -> G : 0\n",
             "axiom: A\nA -> A A : 1\nA -> G : 0\n",
             "axiom: A\nA -> [ A ] A : 1e9\nA -> G : 1\n",
         })
    {
        const GrammarProgram program = programOf(text);
        Derived result;
        EXPECT_LT(secondsOf([&] { result = derived(program, 1, {.productions = 10000, .modules = 10000}); }), 0.1)
            << text;
        EXPECT_TRUE(result.whole) << text << result.error;
        EXPECT_EQ(result.word.find_first_of("AB"), std::string::npos) << text;
        for (const std::uint32_t few : {0u, 1u, 2u})
        {
            const Derived little = derived(program, 1, {.productions = few, .modules = 100});
            EXPECT_TRUE(little.whole || little.error.find("does not end within") != std::string::npos) << text;
        }
    }
}

TEST(Derivation, ACompletionThatExplodesIsALimitError)
{
    // Each symbol's only production doubles it: finite, and far too large.
    std::string text = "axiom: a\n";
    const std::string letters = "abcdehijklmnopqrstuvwxyzABCDEHIJKLMNOPQRSTUVWXYZ";
    for (std::size_t i = 0; i + 1 < letters.size(); ++i)
        text += std::string(1, letters[i]) + " -> " + letters[i + 1] + letters[i + 1] + "\n";
    for (const char* last : {"Z -> F\n", "Z -> _\n"})
    {
        const GrammarProgram program = programOf(text + last);
        Derived result;
        EXPECT_LT(secondsOf([&] { result = derived(program, 1, {.productions = 1000, .modules = 10000}); }), 0.5);
        EXPECT_NE(result.error.find("does not end within"), std::string::npos) << result.error;
    }
}

TEST(Derivation, PricesBeyondAnyNumberAreNever)
{
    std::string symbols = "symbols:";
    std::string rules;
    for (int i = 0; i < 1100; ++i)
    {
        symbols += " S" + std::to_string(i) + "x";
        rules += "S" + std::to_string(i) + "x -> S" + std::to_string(i + 1) + "x S" + std::to_string(i + 1) + "x\n";
    }
    const Derived result =
        derived(symbols + " S1100x\naxiom: F S0x\nS1100x -> F\n" + rules, 1, {.productions = 10, .modules = 100});
    EXPECT_TRUE(result.whole) << result.error;
    EXPECT_EQ(result.word, "F") << "what cannot be completed is dropped";
}

const TransformTable kTable{"t", {{1, 10, 20, 30}, {2, 11, 21, 31}, {3, 12, 22, 32}}, {0, 0, 0, 0}};

TEST(TransformTables, MustBeKnownAndHold)
{
    const TransformTable tables[] = {kTable, {"empty", {}, {}}};
    EXPECT_TRUE(makeError("axiom: A\nA -> F(s) : ~ u\n", tables)
                    .starts_with("2:1: the production `A -> F(s) : ~ u` draws from the table u"));
    EXPECT_TRUE(makeError("axiom: A\n\nA -> F : ~ empty\n", tables).starts_with("3:1: "));
    const std::string row = makeError("axiom: A\nA -> F : ~ t(3)\n", tables);
    EXPECT_TRUE(row.starts_with("2:1: ")) << row;
    EXPECT_NE(row.find("a row from 0 to 2"), std::string::npos) << row;
    (void)makeError("let k = -1\naxiom: A\nA -> F : ~ t(k)\n", tables);
    (void)programOf("axiom: A\nA -> F : ~ t(2)\n", tables);
}

TEST(TransformTables, ARowOutOfRangeIsFoundWhenItIsDrawn)
{
    const GrammarProgram program = programOf("axiom: A(2)A(5)\nA(i) -> F(s) : ~ t(i)\n", {&kTable, 1});
    const Derived result = derived(program);
    EXPECT_TRUE(
        result.error.starts_with("2:20: the production `A(i) -> F(s) : ~ t(i)` takes row 5 of a table with 3 rows"))
        << result.error;
    const Derived undefined = derived(programOf("axiom: A(0)\nA(i) -> F(s) : ~ t(1/i)\n", {&kTable, 1}));
    EXPECT_NE(undefined.error.find("no finite value"), std::string::npos) << undefined.error;
}

TEST(TransformTables, RowsStayTogether)
{
    const GrammarProgram chosen = programOf("axiom: A(0)A(1)A(2.9)\nA(i) -> F(s, r, b, o) : ~ t(i)\n", {&kTable, 1});
    const Derived rows = derived(chosen);
    EXPECT_EQ(rows.word, "{F}{F}{F}");
    EXPECT_EQ(rows.rows, (std::vector<std::uint32_t>{0, 1, 2}));
    EXPECT_EQ(rows.arguments, (std::vector<double>{1, 10, 20, 30, 2, 11, 21, 31, 3, 12, 22, 32}));

    const GrammarProgram drawn = programOf("axiom: A\nA -> F(s, r, b, o) : ~ t\n", {&kTable, 1});
    std::map<std::string, double> counts;
    for (std::uint64_t seed = 0; seed < 3000; ++seed)
    {
        const Derived one = derived(drawn, seed);
        const auto& row = kTable.rows[one.rows[0]];
        ASSERT_TRUE(std::ranges::equal(one.arguments, row)) << "seed " << seed;
        ++counts[std::to_string(one.rows[0])];
    }
    EXPECT_LT(chiSquare(counts, {{"0", 1.0 / 3}, {"1", 1.0 / 3}, {"2", 1.0 / 3}}, 3000), 13.8);
}

TEST(TransformTables, SmoothingKeepsTheMeanTheSpreadAndTheBounds)
{
    const TransformTable table{"t", {{2, 10, 0, -5}}, {0.4, 3, 0, 100}};
    const GrammarProgram program = programOf("axiom: A\nA -> F(s, r, b, o) : ~ t\n", {&table, 1});
    constexpr int kDraws = 4000;
    const double means[] = {2, 10, 0, -5};
    const double deviations[] = {0.8, 3, 0, 100};
    double sums[4] = {};
    double squares[4] = {};
    double together = 0;
    for (std::uint64_t seed = 0; seed < kDraws; ++seed)
    {
        const Derived one = derived(program, seed);
        ASSERT_GT(one.arguments[0], 0);
        for (std::size_t i = 0; i < 4; ++i)
        {
            const double offset = one.arguments[i] - means[i];
            ASSERT_LE(std::abs(offset), deviations[i] * std::sqrt(6.0) + 1e-12);
            sums[i] += offset;
            squares[i] += offset * offset;
        }
        together += (one.arguments[0] - 2) / 0.8 * (one.arguments[1] - 10) / 3;
    }
    for (std::size_t i = 0; i < 4; ++i)
    {
        EXPECT_NEAR(sums[i] / kDraws, 0, 5 * deviations[i] / std::sqrt(kDraws) + 1e-12);
        EXPECT_NEAR(std::sqrt(squares[i] / kDraws), deviations[i], 0.05 * deviations[i]);
    }
    EXPECT_NEAR(together / kDraws, 0, 5 / std::sqrt(kDraws)) << "components are smoothed independently";
}

TEST(TransformTables, InstancesNestAsTheProductionsDo)
{
    EXPECT_EQ(derived(programOf("axiom: A\nA -> F[B]B : ~ t(0)\nB -> G C : ~ t(1)\nC -> f\n", {&kTable, 1})).word,
              "{F[{Gf}]{Gf}}");
}

/// Whatever the grammar: an error, or a word that is whole.
TEST(Derivation, RandomGrammarsGiveWholesOrErrors)
{
    const TransformTable tables[] = {{"VII", {{1, 0, 45, 0}}, {0.1, 2, 0, 0}},
                                     {"t_1", {{1, 0, 45, 0}, {0.5, 1, 2, 3}}, {}}};
    int wholes = 0;
    for (std::uint64_t seed = 0; seed < 500; ++seed)
    {
        Grammar grammar = samples::RandomGrammar(seed, {.contexts = false}).make();
        grammar.interpretations.clear(); // those of brackets need not balance
        const auto program = GrammarProgram::make(grammar, tables);
        if (!program)
            continue;
        for (const std::uint32_t productions : {0u, 3u, 200u})
        {
            const Derived result = derived(*program, seed, {productions, 8, 1000});
            ASSERT_EQ(result.whole, result.error.empty()) << "seed " << seed << "\n" << printGrammar(grammar);
            wholes += result.whole ? 1 : 0;
        }
    }
    EXPECT_GT(wholes, 300);
}

} // namespace
} // namespace espalier
