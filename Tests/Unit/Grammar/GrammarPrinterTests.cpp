#include <Espalier/Grammar/Grammar.h>
#include <Grammar/RandomGrammar.h>
#include <algorithm>
#include <gtest/gtest.h>

namespace espalier {
namespace {

Grammar parsed(const std::string& text)
{
    auto grammar = parseGrammar(text, "g.lsys", {});
    EXPECT_TRUE(grammar) << text << "\n" << (grammar ? "" : toString(grammar.error()));
    return grammar ? std::move(*grammar) : Grammar{};
}

/// True if the trees of two expressions are the same, node by node. A negative number is the negation of a positive
/// one.
bool sameTree(const Grammar& a, ExpressionId i, const Grammar& b, ExpressionId k)
{
    if (i == kNoExpression || k == kNoExpression)
        return i == k;
    const ExpressionNode& x = a.expressions[i];
    const ExpressionNode& y = b.expressions[k];
    if (x.op != y.op)
        return false;
    using enum ExpressionOp;
    if (x.op == Number)
        return x.value == y.value;
    if (x.op == Parameter || x.op == Constant || x.op == Transform || x.op == Step || x.op == Pi)
        return x.first == y.first;
    return sameTree(a, x.first, b, y.first) && sameTree(a, x.second, b, y.second) && sameTree(a, x.third, b, y.third);
}

bool sameWord(const Grammar& a, const std::vector<Module>& x, const Grammar& b, const std::vector<Module>& y)
{
    if (x.size() != y.size())
        return false;
    for (std::size_t i = 0; i < x.size(); ++i)
    {
        if (a.symbols.name(x[i].symbol) != b.symbols.name(y[i].symbol) || x[i].argumentCount != y[i].argumentCount)
            return false;
        for (std::uint32_t k = 0; k < x[i].argumentCount; ++k)
            if (!sameTree(a, a.arguments[x[i].firstArgument + k], b, b.arguments[y[i].firstArgument + k]))
                return false;
    }
    return true;
}

bool sameContext(const Grammar& a, const std::vector<ContextModule>& x, const Grammar& b,
                 const std::vector<ContextModule>& y)
{
    return std::ranges::equal(x, y, [&](const ContextModule& left, const ContextModule& right) {
        return a.symbols.name(left.symbol) == b.symbols.name(right.symbol) && left.parameters == right.parameters;
    });
}

void expectSameProductions(const Grammar& a, const std::vector<Production>& ofA, const Grammar& b,
                           const std::vector<Production>& ofB)
{
    ASSERT_EQ(ofA.size(), ofB.size());
    for (std::size_t i = 0; i < ofA.size(); ++i)
    {
        const Production& p = ofA[i];
        const Production& q = ofB[i];
        const std::string text = printProduction(a, p);
        EXPECT_EQ(a.symbols.name(p.predecessor), b.symbols.name(q.predecessor));
        EXPECT_EQ(p.parameters, q.parameters);
        EXPECT_EQ(p.table, q.table);
        EXPECT_TRUE(sameContext(a, p.left, b, q.left)) << text;
        EXPECT_TRUE(sameContext(a, p.right, b, q.right)) << text;
        EXPECT_TRUE(sameTree(a, p.condition, b, q.condition)) << text;
        EXPECT_TRUE(sameTree(a, p.weight, b, q.weight)) << text;
        EXPECT_TRUE(sameTree(a, p.row, b, q.row)) << text;
        EXPECT_TRUE(sameWord(a, p.successor, b, q.successor)) << text;
    }
}

/// Compares meanings, not texts.
void expectSame(const Grammar& a, const Grammar& b)
{
    const auto namesOf = [](const Grammar& g, const std::vector<SymbolId>& ids) {
        std::vector<std::string> names;
        for (const SymbolId id : ids)
            names.push_back(g.symbols.name(id));
        return names;
    };
    EXPECT_EQ(a.longSymbols, b.longSymbols);
    EXPECT_EQ(a.angle, b.angle);
    EXPECT_EQ(a.step, b.step);
    EXPECT_EQ(a.width, b.width);
    EXPECT_EQ(namesOf(a, a.draw), namesOf(b, b.draw));
    EXPECT_EQ(namesOf(a, a.move), namesOf(b, b.move));
    EXPECT_EQ(namesOf(a, a.ignore), namesOf(b, b.ignore));
    EXPECT_EQ(a.order, b.order);
    EXPECT_EQ(a.iterations, b.iterations);
    ASSERT_EQ(a.tropism.has_value(), b.tropism.has_value());
    if (a.tropism)
    {
        EXPECT_EQ(a.tropism->elasticity, b.tropism->elasticity);
        EXPECT_EQ(a.tropism->direction, b.tropism->direction);
    }
    EXPECT_TRUE(sameWord(a, a.axiom, b, b.axiom));
    ASSERT_EQ(a.constants.size(), b.constants.size());
    for (std::size_t i = 0; i < a.constants.size(); ++i)
        EXPECT_TRUE(a.constants[i].name == b.constants[i].name &&
                    sameTree(a, a.constants[i].value, b, b.constants[i].value));
    expectSameProductions(a, a.productions, b, b.productions);
    expectSameProductions(a, a.interpretations, b, b.interpretations);
}

TEST(GrammarPrinter, AnEmptyGrammarIsAnEmptyAxiom)
{
    EXPECT_EQ(printGrammar(Grammar{}), "axiom: \n");
    expectSame(parsed(printGrammar(Grammar{})), Grammar{});
}

TEST(GrammarPrinter, WritesTheShortestForm)
{
    const char* text = "symbols: Bud\n"
                       "let r = 0.7\n"
                       "angle: 30\n"
                       "draw: F\n"
                       "move:\n"
                       "axiom: A(1, r*2) Bud[+F]\n"
                       "A(l, w) : l>0.1&&w>0 -> F(l)[-A(l*r, w)] : 0.6\n"
                       "A(l, w) -> _ : l ? 1 : 2 : ~ VII(l-1)\n"
                       "Bud -> F(s)+(b+r) : ~ II\n"
                       "- -> +\n";
    EXPECT_EQ(printGrammar(parsed(text)), std::string(text).replace(std::string(text).find(") Bud["), 6, ")Bud["));
}

TEST(GrammarPrinter, WritesContextsSettingsAndInterpretations)
{
    const std::string text = "angle: 22.5\n"
                             "ignore: + - F\n"
                             "order: listed\n"
                             "tropism: 0.22 0 -1 0\n"
                             "iterations: 6\n"
                             "axiom: B(1)[A]\n"
                             "B(x) < A(l) > C[D(y)]E : x>y -> F(l) : x\n"
                             "B < A -> _\n"
                             "A > [C][D] -> C\n"
                             "interpret: A(x) : x>1 -> F(x) : 2\n"
                             "interpret: [ -> [+\n";
    EXPECT_EQ(printGrammar(parsed(text)), text);
}

TEST(GrammarPrinter, LeavesOutSettingsThatHaveTheirDefault)
{
    EXPECT_EQ(printGrammar(parsed("order: context-first\nignore:\nangle: 25\naxiom: A\n")), "axiom: A\n");
    EXPECT_EQ(printGrammar(parsed("iterations: 0\ntropism: 0 0 0 0\naxiom: A\n")),
              "tropism: 0 0 0 0\niterations: 0\naxiom: A\n")
        << "nothing is not the same as none";
}

/// Contexts whose plain spelling would be something else.
TEST(GrammarPrinter, ContextsReadBackAsThemselves)
{
    for (const char* text :
         {"axiom: A\nlet < A -> B\n", "axiom: A\n*() < A > *() -> B\n", "axiom: A\n** < A > *(x)* -> B\n",
          "axiom: A\n-- < - > -- -> -\n", "axiom: A\n- > - -> -\n", "axiom: A\naxiom < A > axiom -> B\n",
          "symbols: Tw Twig\naxiom: A\nTw i g < Twig > Tw [ i g ] -> Tw ig\n",
          "axiom: A\nA(a) > A(b) : a<b -> A(a>b)\n"})
    {
        const Grammar grammar = parsed(text);
        expectSame(grammar, parsed(printGrammar(grammar)));
        EXPECT_EQ(grammar.productions.size(), 1u) << text;
    }
}

TEST(GrammarPrinter, KeepsEveryExpression)
{
    for (const char* expression :
         {"-2^2",      "(-2)^2",        "2^-3",    "2^3^4",       "(2^3)^4",     "-(1+2)",      "1-(2-3)",
          "1-2-3",     "1/(2/3)",       "1*(2+3)", "(1?2:3)?4:5", "1?2:3?4:5",   "1?(2?3:4):5", "1?2?3:4:5",
          "(1?2:3)+4", "!(1==2)",       "!1==2",   "--1",         "-+!1",        "1<(2<3)",     "1==(2==3)",
          "(1&&2)||3", "1&&(2||3)",     "(1<2)+3", "1==!2",       "1!=!2",       "1>-2",        "1--2",
          "1e+21",     "1e-07",         "0.1",     "5e-324",      "pow(1, 2)^3", "sin(-1)",     "(-n)^pi",
          "-n^pi",     "min(1?2:3, 4)", "1%2%3",   "1%(2%3)",     "+1",          "1-+1"})
    {
        const Grammar grammar = parsed(std::string("axiom: A(") + expression + ")\n");
        expectSame(grammar, parsed(printGrammar(grammar)));
    }
}

TEST(GrammarPrinter, NumbersMadeByCodeKeepTheirSign)
{
    Grammar grammar;
    ExpressionPool& pool = grammar.expressions;
    const ExpressionId power = pool.binary(ExpressionOp::Power, pool.number(-2), pool.number(2));
    const ExpressionId zero = pool.binary(ExpressionOp::Power, pool.number(-0.0), pool.number(3));
    grammar.append(grammar.axiom, grammar.symbols.intern("F"), {power, zero});
    EXPECT_EQ(printWord(grammar, grammar.axiom), "F((-2)^2, (-0)^3)");
    EXPECT_TRUE(parsed(printGrammar(grammar)) == grammar);
}

TEST(GrammarPrinter, SeparatesSymbolsThatWouldReadAsAnother)
{
    for (const char* text :
         {"symbols: Tw Twig\naxiom: Tw i g\n", "symbols: F1\naxiom: F 1 F1\n", "symbols: Tw_ Tw_A\naxiom: Tw_ A Tw_A\n",
          "symbols: AA\naxiom: A AA A A\n", "symbols: Aa\nmove: A a Aa\naxiom: A a\nA -> A(1)a[a]a\n"})
    {
        const Grammar grammar = parsed(text);
        expectSame(grammar, parsed(printGrammar(grammar)));
    }
}

TEST(GrammarPrinter, WhatIsPrintedIsReadBack)
{
    int unread = 0;
    std::size_t contexts = 0;
    std::size_t interpretations = 0;
    for (std::uint64_t seed = 0; seed < 1200; ++seed)
    {
        const Grammar grammar = samples::RandomGrammar(seed).make();
        const std::string text = printGrammar(grammar);
        const auto read = parseGrammar(text, "g.lsys", {});
        // A constant's value need not be finite; everything else must be read.
        if (!read && read.error().what.find("has no finite value") != std::string::npos)
        {
            ++unread;
            continue;
        }
        ASSERT_TRUE(read) << "seed " << seed << ": " << toString(read.error()) << "\n" << text;
        ASSERT_EQ(printGrammar(*read), text) << "seed " << seed;
        ASSERT_TRUE(*read == grammar);
        expectSame(*read, grammar);
        ASSERT_FALSE(testing::Test::HasFailure()) << "seed " << seed << "\n" << text;
        for (const Production& production : grammar.productions)
            contexts += production.hasContext() ? 1 : 0;
        interpretations += grammar.interpretations.size();
    }
    EXPECT_LT(unread, 200);
    EXPECT_GT(contexts, 1000u);
    EXPECT_GT(interpretations, 300u);
}

TEST(GrammarPrinter, GrammarsThatDifferPrintDifferently)
{
    const Grammar grammar = parsed("axiom: A(1)\nA(x) -> F(x) : 1\n");
    for (const char* text :
         {"axiom: A(2)\nA(x) -> F(x) : 1\n", "axiom: A(1)\nA(y) -> F(y) : 1\n", "axiom: A(1)\nA(x) -> F(x) : 2\n",
          "axiom: A(1)\nA(x) -> F(x)\n", "axiom: A(1)\nangle: 24\nA(x) -> F(x) : 1\n",
          "axiom: A(1)\nB < A(x) -> F(x) : 1\n", "axiom: A(1)\nA(x) > B -> F(x) : 1\n",
          "axiom: A(1)\ninterpret: A(x) -> F(x) : 1\n", "axiom: A(1)\norder: listed\nA(x) -> F(x) : 1\n",
          "axiom: A(1)\nignore: F\nA(x) -> F(x) : 1\n", "axiom: A(1)\niterations: 1\nA(x) -> F(x) : 1\n",
          "axiom: A(1)\ntropism: 1 0 -1 0\nA(x) -> F(x) : 1\n"})
        EXPECT_FALSE(parsed(text) == grammar) << text;
}

TEST(GrammarPrinter, BlanksStandOnlyWhereSymbolsWouldReadDifferently)
{
    const auto axiomOf = [](const std::string& text) {
        const std::string printed = printGrammar(parsed(text));
        const std::size_t start = printed.find("axiom: ") + 7;
        return printed.substr(start, printed.find('\n', start) - start);
    };
    EXPECT_EQ(axiomOf("axiom: F [ - F X ] F F\n"), "F[-FX]FF");
    EXPECT_EQ(axiomOf("symbols: Trunk\naxiom: F F [ Trunk A ] Trunk Trunk F\n"), "FF[TrunkA]TrunkTrunkF");
    EXPECT_EQ(axiomOf("symbols: Trunk\naxiom: T r u n k T r e e\n"), "T runkT ree");
    EXPECT_EQ(axiomOf("symbols: AB ABC\naxiom: AB C ABC A B\n"), "AB CABCA B");
    EXPECT_EQ(axiomOf("symbols: AB ABC\naxiom: A(1)B AB [C] AB\n"), "A(1)BAB[C]AB") << "something stands between";
    EXPECT_EQ(axiomOf("symbols: abc bcd\naxiom: a b c d b\n"), "a b cdb");
}

} // namespace
} // namespace espalier
