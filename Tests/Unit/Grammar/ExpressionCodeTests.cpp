#include <Espalier/Grammar/ExpressionCode.h>
#include <Espalier/Grammar/Grammar.h>
#include <Grammar/RandomGrammar.h>
#include <array>
#include <bit>
#include <gtest/gtest.h>

namespace espalier {
namespace {

/// What both evaluators make of one expression.
struct Outcome
{
    double value = 0;
    bool failed = false;
    std::uint32_t draws = 0;
};

void expectSameOutcome(const Grammar& grammar, ExpressionId id, const std::vector<double>& constants,
                       const std::string& what)
{
    ExpressionCode code;
    ExpressionNeeds needs;
    const CompiledExpression compiled = code.compile(grammar.expressions, id, constants, needs);
    ASSERT_FALSE(code.isTooDeep());
    // As many as random grammars have names for; a rule that looks at its neighbours has theirs too.
    constexpr std::array kValues = {1.0, 2.0, 3.0, 0.0, -1.0, 0.5, 1e300, -0.0, 90.0, 1e-300};
    std::vector<std::vector<double>> parameterSets(2, std::vector<double>(256));
    for (std::size_t i = 0; i < 256; ++i)
    {
        parameterSets[0][i] = static_cast<double>(i + 1);
        parameterSets[1][i] = kValues[i % kValues.size()];
    }
    const double transform[4] = {0.5, 10, 20, 30};
    for (const auto& parameters : parameterSets)
    {
        const auto outcomeOf = [&](const auto& evaluator) {
            ExpressionScope scope;
            scope.parameters = parameters.data();
            scope.constants = constants.data();
            scope.transform = transform;
            scope.step = 3;
            scope.key = RandomKey(Seed{7});
            scope.draws = 5;
            const double value = evaluator(scope);
            return Outcome{value, scope.failed, scope.draws};
        };
        const Outcome tree =
            outcomeOf([&](ExpressionScope& scope) { return evaluate(grammar.expressions, id, scope); });
        const Outcome compiledOutcome =
            outcomeOf([&](ExpressionScope& scope) { return code.evaluate(compiled, scope); });
        ASSERT_EQ(tree.failed, compiledOutcome.failed) << what;
        if (tree.failed)
            continue;
        ASSERT_EQ(std::bit_cast<std::uint64_t>(tree.value), std::bit_cast<std::uint64_t>(compiledOutcome.value))
            << what;
        ASSERT_EQ(tree.draws, compiledOutcome.draws) << what;
    }
}

/// All expressions of 1,200 random grammars: the same bits, failures and draws as the tree evaluator.
TEST(ExpressionCode, GivesWhatTheTreeGives)
{
    int compared = 0;
    for (std::uint64_t seed = 0; seed < 1200; ++seed)
    {
        const Grammar grammar = samples::RandomGrammar(seed).make();
        std::vector<double> constants;
        bool finite = true;
        for (const NamedConstant& constant : grammar.constants)
        {
            ExpressionScope scope;
            scope.constants = constants.data();
            constants.push_back(evaluate(grammar.expressions, constant.value, scope));
            finite = finite && !scope.failed;
        }
        if (!finite)
            continue;
        for (const Production& production : grammar.productions)
        {
            for (const ExpressionId id : {production.condition, production.weight, production.row})
                if (id != kNoExpression)
                {
                    expectSameOutcome(grammar, id, constants, printProduction(grammar, production));
                    ++compared;
                }
            for (const Module& module : production.successor)
                for (std::uint32_t a = 0; a < module.argumentCount; ++a)
                {
                    expectSameOutcome(grammar, grammar.arguments[module.firstArgument + a], constants,
                                      printProduction(grammar, production));
                    ++compared;
                }
            if (testing::Test::HasFatalFailure())
                return;
        }
    }
    EXPECT_GT(compared, 3000);
}

TEST(ExpressionCode, FoldsWhatIsConstant)
{
    const auto grammar = parseGrammar("let r = 0.7\naxiom: A(sin(30)*r + 2^3, 1/0, 0 ? 1/0 : 5)\n", "g.lsys", {});
    ASSERT_TRUE(grammar);
    const std::vector<double> constants = {0.7};
    ExpressionCode code;
    ExpressionNeeds needs;
    const auto compiled = [&](std::uint32_t argument) {
        return code.compile(grammar->expressions, grammar->arguments[argument], constants, needs);
    };
    EXPECT_TRUE(compiled(0).isConstant());
    EXPECT_DOUBLE_EQ(compiled(0).value, 8.35);
    EXPECT_FALSE(compiled(1).isConstant()) << "it fails when it is evaluated, not before";
    EXPECT_TRUE(compiled(2).isConstant());
    EXPECT_EQ(compiled(2).value, 5);
    EXPECT_FALSE(needs.draws > 0 || needs.step);
}

TEST(ExpressionCode, TellsWhenAnExpressionIsTooDeepForItsStack)
{
    Grammar grammar;
    ExpressionPool& pool = grammar.expressions;
    ExpressionId sum = pool.reference(ExpressionOp::Step, kNoExpression);
    for (int i = 0; i < 300; ++i)
        sum = pool.binary(ExpressionOp::Add, pool.reference(ExpressionOp::Step, kNoExpression), sum);
    ExpressionCode code;
    ExpressionNeeds needs;
    (void)code.compile(pool, sum, {}, needs);
    EXPECT_TRUE(code.isTooDeep());
}

} // namespace
} // namespace espalier
