#include <Espalier/Grammar/Inspection.h>
#include <gtest/gtest.h>

namespace espalier {
namespace {

GrammarInspection inspected(const std::string& text)
{
    const auto grammar = parseGrammar(text, "g.lsys", {});
    EXPECT_TRUE(grammar) << text << (grammar ? "" : toString(grammar.error()));
    const auto program = GrammarProgram::make(*grammar);
    EXPECT_TRUE(program) << text << (program ? "" : toString(program.error()));
    return inspect(*program);
}

/// One line a finding: `line:column: what`.
std::string findingsOf(const std::string& text)
{
    std::string lines;
    for (const GrammarFinding& finding : inspected(text).findings)
        lines += std::to_string(finding.place.line) + ":" + std::to_string(finding.place.column) + ": " + finding.what +
                 "\n";
    return lines;
}

TEST(Inspection, FindsNothingInASoundGrammar)
{
    for (const char* text : {"axiom: A\n", "axiom: A\nA -> A[+B]F\nB -> A\n",
                             "axiom: A(1)\nA(x) : x > 1 -> A(x-1) : 1\nA(x) -> B : 1\nB -> A(2)\n",
                             "ignore: +\naxiom: A+B\nA < B -> B[C]\nB > [C] -> A\ninterpret: C -> F\n"})
        EXPECT_EQ(findingsOf(text), "") << text;
}

TEST(Inspection, NamesSymbolsThatTheAxiomNeverReaches)
{
    EXPECT_EQ(findingsOf("axiom: A\nA -> F A\nB -> G\n"),
              "3:1: the production `B -> G` can never be taken: `B` never occurs\n"
              "3:1: the symbol `B` cannot be reached from the axiom\n"
              "3:1: the symbol `G` cannot be reached from the axiom\n");
    EXPECT_EQ(findingsOf("axiom: A\nA -> F\ninterpret: X -> F\n"),
              "3:12: the production `X -> F` can never be taken: `X` never occurs\n"
              "3:12: the symbol `X` cannot be reached from the axiom\n");
}

TEST(Inspection, NamesProductionsThatCanNeverMatch)
{
    struct Case
    {
        const char* text;
        const char* reason;
    };
    const Case cases[] = {
        {"axiom: A(1)\nA(x) -> A(x+1)\nA -> F(1)\n",
         "3:1: the production `A -> F(1)` can never be taken: `A` never occurs"},
        {"axiom: A\nA -> F A\nA -> G\n", "the production of line 2 always matches before it"},
        {"axiom: A\nA -> F A\nA -> G : 1\n", "the production of line 2 always matches before it"},
        {"axiom: A\nA : 1 > 2 -> G\nA -> F A\n", "its condition never holds"},
        {"axiom: A\nA -> F A : 1\nA -> G : 0\n", "its weight is 0"},
        {"axiom: AB\nC < A -> F\n", "`C` never occurs"},
        {"axiom: AB\nA > [C] -> F\n", "`[` never occurs"},
        {"axiom: A(1)B\nA(x, y) < B -> F\n", "`A` with 2 parameters never occurs"},
    };
    for (const Case& c : cases)
        EXPECT_NE(findingsOf(c.text).find(c.reason), std::string::npos) << c.text << findingsOf(c.text);
    EXPECT_EQ(findingsOf("axiom: BA\nA -> F\nB < A -> G\n").find("line 2"), std::string::npos)
        << "those with context come first";
    EXPECT_NE(findingsOf("order: listed\naxiom: BA\nA -> F\nB < A -> G\n").find("line 3 always matches"),
              std::string::npos);
}

TEST(Inspection, TellsHowWordsGrow)
{
    struct Case
    {
        const char* text;
        GrowthKind growth;
        double value; ///< Factor or degree.
        bool isBound;
    };
    const Case cases[] = {
        {"axiom: A\n", GrowthKind::Bounded, 0, false},
        {"axiom: A\nA -> B\nB -> A\n", GrowthKind::Bounded, 0, false},
        {"axiom: A\nA -> _\n", GrowthKind::Bounded, 0, false},
        {"axiom: A\nA -> A F\n", GrowthKind::Polynomial, 1, false},
        {"axiom: A\nA -> A B\nB -> B F\n", GrowthKind::Polynomial, 2, false},
        {"axiom: A\nA -> AA\n", GrowthKind::Exponential, 2, false},
        {"axiom: A\nA -> AB\nB -> A\n", GrowthKind::Exponential, 1.6180339887, false},
        {"axiom: A\nA -> B\nB -> AA\n", GrowthKind::Exponential, 1.4142135624, false},
        {"axiom: X\nX -> F+[[X]-X]-F[-FX]+X\nF -> FF\n", GrowthKind::Exponential, 4, false},
        {"axiom: A\nA -> AA : 1\nA -> A : 1\n", GrowthKind::Exponential, 1.5, false},
        {"axiom: A(1)\nA(x) : x > 1 -> A(x)A(x)\nA(x) -> A(x)\n", GrowthKind::Exponential, 2, true},
    };
    for (const Case& c : cases)
    {
        const GrammarInspection inspection = inspected(c.text);
        EXPECT_EQ(inspection.growth, c.growth) << c.text;
        EXPECT_EQ(inspection.isBound, c.isBound) << c.text;
        if (c.growth == GrowthKind::Exponential)
        {
            EXPECT_NEAR(inspection.factor, c.value, 1e-3) << c.text;
        }
        if (c.growth == GrowthKind::Polynomial)
        {
            EXPECT_EQ(inspection.degree, c.value) << c.text;
        }
    }
    EXPECT_EQ(inspected("axiom: A\nA -> AA\n").safeSteps, 22u) << "2^22 modules are the limit";
    EXPECT_EQ(inspected("axiom: A\n").safeSteps, 4096u);
}

TEST(Inspection, NamesSlips)
{
    EXPECT_NE(findingsOf("axiom: A(1, 2)\nA(x) -> F A(x)\n")
                  .find("1:8: `A` with 2 parameters has no production; `A` with 1 parameter has"),
              std::string::npos);
    EXPECT_NE(findingsOf("axiom: A(1)\nA(x) -> F A\n")
                  .find("2:1: `A` without parameters has no production; `A` with 1 parameter has"),
              std::string::npos);
    EXPECT_NE(findingsOf("axiom: A(1)\nA -> F\n").find("`A` never occurs, but `A` with 1 parameter does"),
              std::string::npos);
    EXPECT_NE(findingsOf("axiom: A\nA -> F /* grow */ A\n").find("2:1: `/*` begins no comment"), std::string::npos);
    EXPECT_EQ(findingsOf("axiom: A\nA -> F /(60) A // B(1)\ninterpret: B(x) -> F(x)\n"), "");
}

TEST(Inspection, StepsAreSafeOnlyIfWhatIsDrawnIsSafeToo)
{
    const auto safe = [](const char* text) {
        return inspect(GrammarProgram::make(parseGrammar(text, "g", {}).value()).value()).safeSteps;
    };
    EXPECT_EQ(safe("axiom: A\nA -> AA\n"), 22u);
    EXPECT_EQ(safe("axiom: A\nA -> AA\ninterpret: A -> F F\n"), 21u);
}

} // namespace
} // namespace espalier
