#include <Espalier/Grammar/Derivation.h>
#include <Espalier/Grammar/Forecast.h>
#include <Grammar/NaiveDerivation.h>
#include <Grammar/RandomLSystem.h>
#include <chrono>
#include <cmath>
#include <gtest/gtest.h>
#include <map>
#include <string>

namespace espalier {
namespace {

Grammar parsed(const std::string& text)
{
    auto grammar = parseGrammar(text, "g.lsys", {});
    EXPECT_TRUE(grammar) << text << "\n" << (grammar ? "" : toString(grammar.error()));
    return grammar ? std::move(*grammar) : Grammar{};
}

GrammarProgram programOf(const std::string& text)
{
    auto program = GrammarProgram::make(parsed(text));
    EXPECT_TRUE(program) << text << "\n" << (program ? "" : toString(program.error()));
    return std::move(*program);
}

/// The word after so many steps as text, or the error.
std::string derived(const std::string& text, std::uint32_t steps, std::uint64_t seed = 1, const Limits& limits = {})
{
    const GrammarProgram program = programOf(text);
    DerivationScratch scratch;
    Word word;
    const auto done = deriveWord(program, RandomKey(Seed{seed}), steps, limits, scratch, word);
    return done ? printWord(program, word) : toString(done.error());
}

std::vector<std::string> symbolsOf(const GrammarProgram& program, const Word& word)
{
    std::vector<std::string> symbols;
    for (const LetterId letter : word.letters)
        symbols.push_back(program.grammar().symbols.name(program.symbolOf(letter)));
    return symbols;
}

/// Collects a stream into a word.
class CollectingSink final : public DerivationSink
{
public:
    Word word;
    bool modules(std::span<const LetterId> letters, std::span<const double> arguments) override
    {
        word.letters.insert(word.letters.end(), letters.begin(), letters.end());
        word.arguments.insert(word.arguments.end(), arguments.begin(), arguments.end());
        return true;
    }
};

TEST(WordDerivation, NoStepsGiveTheAxiom)
{
    EXPECT_EQ(derived("axiom: _\n", 0), "");
    EXPECT_EQ(derived("axiom: _\nA -> B\n", 5), "");
    EXPECT_EQ(derived("axiom: A(1+1)[+B]\nA(x) -> B\n", 0), "A(2)[+B]");
}

TEST(WordDerivation, AllModulesAreRewrittenAtOnce)
{
    EXPECT_EQ(derived("axiom: AB\nA -> B\nB -> A\n", 1), "BA");
    EXPECT_EQ(derived("axiom: A\nA -> AB\nB -> A\n", 5), "ABAABABAABAAB");
    EXPECT_EQ(derived("axiom: A(8)\nA(l) : l > 1 -> F(l)A(l/2)\n", 3), "F(8)F(4)F(2)A(1)");
}

TEST(WordDerivation, WhatNothingMatchesIsCopied)
{
    EXPECT_EQ(derived("axiom: A A(1) A(1,2)\nA(x) -> F\n", 3), "AFA(1,2)") << "another number of parameters";
    EXPECT_EQ(derived("axiom: A(1)\nA(x) : x > 5 -> F\nA(x) : n == 3 -> G\n", 4), "G")
        << "what does not match yet may match in a later step";
}

TEST(WordDerivation, ContextsLookPastBranchesAndIgnoredSymbols)
{
    struct Case
    {
        const char* text;
        const char* word;
    };
    const Case cases[] = {
        // ABOP p. 32
        {"axiom: ABC[DE][SG[HI[JK]L]MNO]\nBC < S > G[H]M -> X\n", "ABC[DE][XG[HI[JK]L]MNO]"},
        {"axiom: A[B]C\nA < C -> X\n", "A[B]X"},
        {"axiom: A[BC]\nA < B -> X\n", "A[XC]"},
        {"axiom: A[B[C]D]E\nB < D -> X\nD < E -> Y\n", "A[B[C]X]E"},
        {"axiom: AB\nB > A -> X\nA < A -> X\n", "AB"},
        {"axiom: A[B][C]D\nA > D -> X\n", "X[B][C]D"},
        {"axiom: A[B][C]D\nA > [C]D -> X\n", "X[B][C]D"},
        {"axiom: A[B][C]D\nA > [C][B] -> X\n", "A[B][C]D"},
        {"axiom: A[B][B]D\nA > [B][B]D -> X\n", "X[B][B]D"},
        {"axiom: A[B[C]]D\nA > [B[C]]D -> X\n", "X[B[C]]D"},
        {"axiom: A[BC][BD]\nA > [BD] -> X\n", "X[BC][BD]"},
        {"axiom: [A]B\nA > B -> X\n", "[A]B"},
        {"axiom: A[[B]C]\nA > [[B]C] -> X\nA < B -> Y\nA < C -> Z\n", "X[[Y]Z]"},
        {"ignore: + F\naxiom: A+F[+B]F+C\nA > [B]C -> X\nA < C -> Y\n", "X+F[+B]F+Y"},
        {"axiom: A(1)B(2)B\nA(x) < B(y) -> X(x, y)\nA < B -> Y\n", "A(1)X(1,2)B"},
        {"axiom: A(4)B(5)C(6)\nA(x) < B(y) > C(z) : x+y+z > 10 -> E((x+y)/2)F((y+z)/2)\n", "A(4)E(4.5)F(5.5)C(6)"},
        {"axiom: P(1)Q(2)A(3)[R(4)]S(5)\nP(p)Q(q) < A(a) > [R(r)]S(s) -> X(p, q, a, r, s)\n",
         "P(1)Q(2)X(1,2,3,4,5)[R(4)]S(5)"},
    };
    for (const Case& c : cases)
        EXPECT_EQ(derived(c.text, 1), c.word) << c.text;
}

TEST(WordDerivation, ContextsComeFirstUnlessTheOrderIsListed)
{
    const std::string rules = "axiom: BA\nA -> X\nB < A -> Y\n";
    EXPECT_EQ(derived(rules, 1), "BY");
    EXPECT_EQ(derived("order: listed\n" + rules, 1), "BX");
    // Weighted rules compete only with those of the same contexts.
    for (std::uint64_t seed = 0; seed < 50; ++seed)
        EXPECT_EQ(derived("axiom: BA\nA -> X : 1000\nB < A -> Y : 1\n", 1, seed), "BY");
}

TEST(WordDerivation, GivesTheSameWordForTheSameSeed)
{
    const std::string text = "axiom: F\nF -> F[+F]F[-F]F : 0.33\nF -> F[+F]F : 0.33\nF -> F[-F]F(rand(0, 1)) : 0.34\n";
    EXPECT_EQ(derived(text, 5, 7), derived(text, 5, 7));
    EXPECT_NE(derived(text, 5, 7), derived(text, 5, 8));
}

TEST(WordDerivation, ProductionsAreTakenAsOftenAsTheirWeightsSay)
{
    const GrammarProgram program = programOf("axiom: A\nA -> X : 1\nA -> Y : 3\nA -> Z : 6\n");
    DerivationScratch scratch;
    Word word;
    std::map<std::string, double> counts;
    constexpr std::uint64_t kSeeds = 10000;
    for (std::uint64_t seed = 0; seed < kSeeds; ++seed)
    {
        ASSERT_TRUE(deriveWord(program, RandomKey(Seed{seed}), 1, {}, scratch, word));
        ++counts[printWord(program, word)];
    }
    double chiSquare = 0;
    for (const auto& [name, share] : std::map<std::string, double>{{"X", 0.1}, {"Y", 0.3}, {"Z", 0.6}})
    {
        const double expected = share * static_cast<double>(kSeeds);
        chiSquare += std::pow(counts[name] - expected, 2) / expected;
    }
    EXPECT_LT(chiSquare, 13.8) << "p = 0.001 of 2 degrees";
}

TEST(WordDerivation, AChangeInOneBranchLeavesTheOthersAsTheyWere)
{
    // p and q, which no rule rewrites, stand around the branch that is changed.
    const std::string rules = "A -> F[A]A : 1\nA -> G(rand(0, 1)) : 1\nA -> f A : 1\n";
    int changed = 0;
    for (std::uint64_t seed = 0; seed < 300; ++seed)
    {
        const std::string before = derived("axiom: A[A]p[B]q[A]A\nB -> A\n" + rules, 6, seed);
        const std::string after = derived("axiom: A[A]p[B]q[A]A\nB -> X A [A] A\n" + rules, 6, seed);
        const auto outside = [](const std::string& word) {
            return word.substr(0, word.find('p') + 2) + word.substr(word.find('q') - 1);
        };
        EXPECT_EQ(outside(before), outside(after)) << "seed " << seed;
        changed += before != after ? 1 : 0;
    }
    EXPECT_EQ(changed, 300);
}

TEST(WordDerivation, ALongWordIsRefusedAtItsStepWithItsSize)
{
    Limits limits;
    for (const auto& [modules, fits] : {std::pair{15u, false}, {16u, true}, {17u, true}})
    {
        limits.modules = modules;
        const std::string word = derived("# doubles\naxiom: A\nA -> AA\n", 4, 1, limits);
        EXPECT_EQ(word == "AAAAAAAAAAAAAAAA", fits) << word;
        if (!fits)
        {
            EXPECT_EQ(word, "2:8: step 4 would make a word of 16 modules; expected at most 15 (the limit modules); "
                            "derive fewer steps");
        }
    }
    limits.modules = 16;
    EXPECT_NE(derived("axiom: A(1)\nA(x) : x > 0 -> A(1)A(x)\n", 5, 1, limits).find("step 5 would make a word of 32"),
              std::string::npos);
}

TEST(WordDerivation, SlowGrowthIsStoppedByTheWorkItTakes)
{
    Limits limits;
    limits.derivationWork = 5000;
    EXPECT_EQ(derived("axiom: A(0)\nA(x) : x >= 0 -> A(x+1)\n", 100, 1, limits), "A(100)");
    EXPECT_NE(derived("axiom: A(0)\nA(x) : x >= 0 -> A(x+1)\n", 1000, 1, limits).find("the limit derivationWork"),
              std::string::npos);
    limits.derivationWork = 100000;
    EXPECT_NE(derived("axiom: A(1)\nA(x) -> A(sin(sin(sin(sin(sin(sin(x)))))))\n", 5000, 1, limits)
                  .find("the limit derivationWork"),
              std::string::npos)
        << "expressions cost too";
}

TEST(WordDerivation, ManyBranchesAreNotTriedInEveryCombination)
{
    std::string word = "axiom: G";
    std::string pattern;
    for (int i = 0; i < 60; ++i)
        word += "[B]";
    for (int i = 0; i < 30; ++i)
        pattern += "[B]";
    EXPECT_EQ(derived(word + "C\nG > " + pattern + "C -> X\n", 1), "X" + word.substr(8) + "C");
    EXPECT_EQ(derived(word + "C\nG > " + pattern + "D -> X\n", 1), word.substr(7) + "C");
}

TEST(WordDerivation, ArgumentsAreBoundedToo)
{
    Limits limits;
    limits.arguments = 8;
    EXPECT_EQ(derived("axiom: A(1,2)\nA(x, y) -> A(x,y)A(y,x)\n", 2, 1, limits), "A(1,2)A(2,1)A(2,1)A(1,2)");
    EXPECT_NE(
        derived("axiom: A(1,2)\nA(x, y) -> A(x,y)A(y,x)\n", 3, 1, limits).find("16 arguments; expected at most 8"),
        std::string::npos);
    EXPECT_NE(derived("axiom: A\nA -> A A F(1,2,3)\n", 2, 1, limits).find("the limit arguments"), std::string::npos);
}

TEST(WordDerivation, AFailureLeavesTheWordEmptyAndTheMemoryUsable)
{
    const GrammarProgram program = programOf("axiom: A(2)\nA(x) -> F(1/(x-1)) A(x-1)\n");
    DerivationScratch scratch;
    Word word;
    const auto failed = deriveWord(program, RandomKey(Seed{1}), 3, {}, scratch, word);
    ASSERT_FALSE(failed);
    EXPECT_EQ(toString(failed.error()), "2:11: an expression of the production `A(x) -> F(1/(x-1))A(x-1)` has no "
                                        "finite value; expected finite values; guard divisions with ?:");
    EXPECT_TRUE(word.letters.empty());
    ASSERT_TRUE(deriveWord(program, RandomKey(Seed{1}), 1, {}, scratch, word));
    EXPECT_EQ(printWord(program, word), "F(1)A(1)");
}

/// 1,500 random L-systems of all kinds: the word equals the naive derivation's, module by module and bit by bit;
/// streaming equals the word; what was forecast came.
TEST(WordDerivation, EqualsTheContractReadLiterally)
{
    int compared = 0;
    int contextual = 0;
    int exact = 0;
    int weightless = 0;
    for (std::uint64_t seed = 0; seed < 1500; ++seed)
    {
        samples::RandomLSystemOptions options;
        options.contexts = seed % 2 == 1;
        options.weights = seed / 2 % 2 == 1;
        options.parameters = seed / 4 % 2 == 1;
        options.conditions = seed / 8 % 2 == 1;
        options.interpretations = seed / 16 % 2 == 1;
        options.longSymbols = seed / 32 % 4 == 3;
        const std::string text = samples::RandomLSystem(seed, options).make();
        const Grammar grammar = parsed(text);
        const auto program = GrammarProgram::make(grammar);
        ASSERT_TRUE(program) << text << toString(program.error());
        const RandomKey key = RandomKey(Seed{seed}).child(0);
        DerivationScratch scratch;
        Limits limits;
        limits.modules = 2000;
        for (std::uint32_t steps = 0; steps <= 5; ++steps)
        {
            SCOPED_TRACE("seed " + std::to_string(seed) + ", " + std::to_string(steps) + " steps\n" + text);
            const Forecast price = forecast(*program, steps, 1e300);
            const WordForecast& size = price.steps.back();
            ASSERT_EQ(price.steps.size(), steps + 1);
            Word word;
            const auto done = deriveWord(*program, key, steps, limits, scratch, word);
            const bool refused = !checkPrice(*program, steps, limits);
            if (!done)
            {
                samples::NaiveDerivation naive(grammar, key);
                if (done.error().kind == ErrorKind::BadInput) // weights that are all 0
                {
                    (void)naive.derive(steps);
                    ASSERT_TRUE(naive.failed) << toString(done.error());
                    ++weightless;
                    break;
                }
                ASSERT_EQ(done.error().kind, ErrorKind::Limit) << toString(done.error());
                ASSERT_GT(size.most, limits.modules);
                break;
            }
            samples::NaiveDerivation naive(grammar, key);
            if (refused)
            {
                ASSERT_GT(price.drawn.back().least, limits.modules) << "what fits is not refused";
            }
            const auto expected = naive.derive(steps);
            ASSERT_FALSE(naive.failed);
            std::vector<std::string> expectedSymbols;
            std::vector<double> expectedArguments;
            for (const auto& module : expected)
            {
                expectedSymbols.push_back(module.symbol);
                expectedArguments.insert(expectedArguments.end(), module.arguments.begin(), module.arguments.end());
            }
            ASSERT_EQ(symbolsOf(*program, word), expectedSymbols);
            // A printed word reads as that word.
            const std::string declared = options.longSymbols ? "symbols: AB Bud BudF\n" : "";
            const std::string printedWord = word.letters.empty() ? "_" : printWord(*program, word, false);
            const Grammar printed = parsed(declared + "axiom: " + printedWord + "\n");
            ASSERT_TRUE(std::ranges::equal(printed.axiom, expectedSymbols, {}, [&](const Module& module) {
                return printed.symbols.name(module.symbol);
            })) << printedWord;
            ASSERT_TRUE(std::ranges::equal(word.arguments, expectedArguments));
            ++compared;
            contextual += program->isContextFree() ? 0 : 1;

            // The price.
            const auto length = static_cast<double>(word.letters.size());
            ASSERT_LE(size.least, length);
            ASSERT_GE(size.most, length);
            if (price.isExact)
            {
                ++exact;
                ASSERT_EQ(size.least, length);
                ASSERT_EQ(size.most, length);
                ASSERT_EQ(size.expected, length);
                std::vector<double> counts(program->letterCount(), 0);
                for (const LetterId letter : word.letters)
                    ++counts[letter];
                ASSERT_EQ(price.letters, counts);
            }

            // What is drawn.
            const auto drawn = naive.interpret(expected, steps);
            std::vector<std::string> drawnSymbols;
            std::vector<double> drawnArguments;
            for (const auto& module : drawn)
            {
                drawnSymbols.push_back(module.symbol);
                drawnArguments.insert(drawnArguments.end(), module.arguments.begin(), module.arguments.end());
            }
            CollectingSink emitted;
            ASSERT_TRUE(deriveWord(*program, key, steps, limits, scratch, word));
            ASSERT_TRUE(emitWord(*program, steps, Interpretation::Apply, {}, scratch, word, emitted));
            ASSERT_EQ(symbolsOf(*program, emitted.word), drawnSymbols);
            ASSERT_TRUE(std::ranges::equal(emitted.word.arguments, drawnArguments));
            const auto drawnLength = static_cast<double>(drawn.size());
            ASSERT_LE(price.drawn.back().least, drawnLength);
            ASSERT_GE(price.drawn.back().most, drawnLength);

            // The stream.
            if (!program->isContextFree())
                continue;
            CollectingSink plain;
            ASSERT_TRUE(streamWord(*program, key, steps, Interpretation::None, {}, scratch, plain));
            ASSERT_TRUE(plain.word == word);
            CollectingSink interpreted;
            ASSERT_TRUE(streamWord(*program, key, steps, Interpretation::Apply, {}, scratch, interpreted));
            ASSERT_EQ(symbolsOf(*program, interpreted.word), drawnSymbols);
            ASSERT_TRUE(std::ranges::equal(interpreted.word.arguments, drawnArguments));
        }
        // The text.
        const std::string printed = printGrammar(grammar);
        const auto again = parseGrammar(printed, "printed.lsys", {});
        ASSERT_TRUE(again) << printed << toString(again.error());
        ASSERT_EQ(printGrammar(*again), printed);
        const GrammarProgram reread = GrammarProgram::make(*again).value();
        Word word, same;
        const auto first = deriveWord(*program, key, 3, limits, scratch, word);
        const auto second = deriveWord(reread, key, 3, limits, scratch, same);
        ASSERT_EQ(first.has_value(), second.has_value()) << text;
        ASSERT_EQ(symbolsOf(*program, word), symbolsOf(reread, same)) << text << printed;
        ASSERT_TRUE(word.arguments == same.arguments) << text << printed;
    }
    EXPECT_GT(compared, 5000);
    EXPECT_GT(contextual, 1000);
    EXPECT_GT(exact, 1000);
    EXPECT_GT(weightless, 3);
}

TEST(WordDerivation, DrawsTransformsAsStreamingDoes)
{
    const TransformTable tables[] = {{"t", {{1, 10, 20, 30}, {2, 11, 21, 31}}, {0.1, 3, 0, 2}},
                                     {"u", {{3, 1, 2, 4}}, {}}};
    const auto program = GrammarProgram::make(
        parsed("axiom: A(0)A(1)\nA(i) -> F(s)[+(b+r)A(i)/(o)B] : 1 : ~ t(i)\nA(i) -> G(b) : 1 : ~ t\n"
               "B -> F(s)A(0) : ~ u\n"),
        tables);
    ASSERT_TRUE(program) << toString(program.error());
    DerivationScratch scratch;
    for (std::uint64_t seed = 0; seed < 50; ++seed)
    {
        Word word;
        ASSERT_TRUE(deriveWord(*program, RandomKey(Seed{seed}), 6, {}, scratch, word));
        CollectingSink streamed;
        ASSERT_TRUE(streamWord(*program, RandomKey(Seed{seed}), 6, Interpretation::None, {}, scratch, streamed));
        ASSERT_TRUE(streamed.word == word) << "seed " << seed;
    }
}

TEST(WordDerivation, InterpretingStopsAtTheLimitOfModules)
{
    const GrammarProgram program =
        programOf("axiom: " + std::string(1000, 'X') + "\ninterpret: X : rand(0, 1) >= 0 -> " + std::string(1000, 'F') +
                  "\ninterpret: X -> F\n");
    Limits limits;
    limits.modules = 5000;
    DerivationScratch scratch;
    CollectingSink sink;
    const auto done = streamWord(program, RandomKey(Seed{1}), 0, Interpretation::Apply, limits, scratch, sink);
    ASSERT_FALSE(done);
    EXPECT_NE(done.error().expected.find("the limit modules"), std::string::npos) << toString(done.error());
    EXPECT_LE(sink.word.letters.size(), 6000u);
}

/// A stochastic grammar's lengths average to its expectation.
TEST(Forecasts, TheExpectationIsTheMeanOverManySeeds)
{
    const GrammarProgram program = programOf("axiom: F\nF -> F[+F]F[-F]F : 0.33\nF -> F[+F]F : 0.33\nF -> F : 0.34\n");
    const Forecast price = forecast(program, 4, 1e300);
    ASSERT_TRUE(price.hasExpectation);
    EXPECT_FALSE(price.isExact);
    DerivationScratch scratch;
    Word word;
    double sum = 0;
    double squares = 0;
    constexpr int kSeeds = 4000;
    for (std::uint64_t seed = 0; seed < kSeeds; ++seed)
    {
        ASSERT_TRUE(deriveWord(program, RandomKey(Seed{seed}), 4, {}, scratch, word));
        const auto length = static_cast<double>(word.letters.size());
        sum += length;
        squares += length * length;
    }
    const double mean = sum / kSeeds;
    const double error = std::sqrt((squares / kSeeds - mean * mean) / kSeeds);
    EXPECT_NEAR(mean, price.steps.back().expected, 4.5 * error);
}

TEST(Forecasts, WhatIsWrongOtherwiseIsNotCalledLarge)
{
    EXPECT_TRUE(checkPrice(programOf("axiom: A\nA -> B : 0\n"), 3, {})) << "deriving tells that weights are 0";
    std::string useless;
    for (int i = 0; i < 300; ++i)
        useless += "B -> B\n";
    const std::string huge(60000, 'F');
    for (const std::string& more : {std::string(), useless})
        EXPECT_TRUE(checkPrice(
            programOf("axiom: " + std::string(100, 'A') + "\nA -> B\nB -> A\ninterpret: B -> " + huge + "\n" + more),
            100000, {}))
            << "the last step has no B";
}

TEST(Forecasts, WhatIsOnlyAtLeastSoMuchIsCalledSo)
{
    const auto priced = checkPrice(
        programOf("axiom: F\nF -> FF\ninterpret: F : rand(0, 1) > 0.5 -> GGGG\ninterpret: F -> GG\n"), 22, {});
    ASSERT_FALSE(priced);
    EXPECT_NE(priced.error().what.find("at least 8388608 modules after `interpret:`"), std::string::npos)
        << priced.error().what;
}

TEST(Forecasts, RulesThatNothingReachesCostNothing)
{
    std::string text = "axiom: A\nA -> AB\nB -> BF\nsymbols:";
    std::string rules;
    for (int i = 0; i < 4000; ++i)
    {
        text += " X" + std::to_string(i);
        rules += "X" + std::to_string(i) + " -> FFFFX" + std::to_string((i + 1) % 4000) + "\n";
    }
    const GrammarProgram program = programOf(text + "\n" + rules);
    const Forecast price = forecast(program, 10000, 1e300);
    EXPECT_TRUE(price.isComplete);
    EXPECT_TRUE(price.isExact);
    EXPECT_EQ(price.steps.back().expected, 1 + 10000 + 10000.0 * 9999 / 2);
}

TEST(Forecasts, AnExponentialGrammarIsRefusedAtOnceWithItsSize)
{
    for (const char* text : {"axiom: A\nA -> AA\n", "axiom: A(1)\nA(x) : x > 0 -> A(x)A(x)\nA(x) -> A(x)A(x)A(x)\n",
                             "axiom: A\nA -> AA : 1\nA -> AAA : 2\n"})
    {
        const GrammarProgram program = programOf(text);
        const auto start = std::chrono::steady_clock::now();
        const auto priced = checkPrice(program, 1000000, {});
        const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
        ASSERT_FALSE(priced) << text;
        EXPECT_EQ(priced.error().kind, ErrorKind::Limit);
        EXPECT_NE(priced.error().what.find("8388608 modules"), std::string::npos) << priced.error().what;
        EXPECT_EQ(priced.error().where.line, 1u);
        EXPECT_EQ(priced.error().where.column, 8u);
        EXPECT_LT(taken.count(), 5) << "some microseconds; a hang would be minutes";
    }
    EXPECT_TRUE(checkPrice(programOf("axiom: A\nA -> AA\n"), 22, {}));
    EXPECT_FALSE(checkPrice(programOf("axiom: A\nA -> AA\n"), 23, {}));
    EXPECT_FALSE(checkPrice(programOf("axiom: A\nA -> AA\ninterpret: A -> F F\n"), 22, {})) << "drawn, it is too long";
    EXPECT_TRUE(checkPrice(programOf("axiom: A\nA : n > 5 -> AA\n"), 1000000, {})) << "nothing is certain";
}

} // namespace
} // namespace espalier
