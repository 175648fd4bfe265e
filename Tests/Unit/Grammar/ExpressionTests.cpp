#include <Espalier/Grammar/Grammar.h>
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <set>
#include <string>

namespace espalier {
namespace {

struct Outcome
{
    double value = 0;
    bool failed = false;
};

/// The value of `text` with x = 3 and y = -2, drawn at `key`.
Outcome valueOf(const std::string& text, RandomKey key = RandomKey(Seed{7}))
{
    const auto grammar = parseGrammar("let k = 0.5\naxiom: A\nA(x, y) -> F(" + text + ")\n", "e.lsys", {});
    if (!grammar)
    {
        ADD_FAILURE() << text << ": " << toString(grammar.error());
        return {};
    }
    const double parameters[] = {3, -2};
    const double constants[] = {0.5};
    ExpressionScope scope;
    scope.parameters = parameters;
    scope.constants = constants;
    scope.step = 4;
    scope.key = key;
    const double value = evaluate(grammar->expressions, grammar->arguments[0], scope);
    EXPECT_TRUE(std::isfinite(value)) << text;
    return {value, scope.failed};
}

TEST(Expression, IsEvaluatedByTheOrderOfItsOperators)
{
    struct Case
    {
        const char* text;
        double value;
    };
    const Case cases[] = {
        {"-2^2", -4},
        {"(-2)^2", 4},
        {"2^-1", 0.5},
        {"2^-2^0", 0.5},
        {"2^3^2", 512},
        {"(2^3)^2", 64},
        {"-x^2", -9},
        {"!0^0", 0},
        {"!x", 0},
        {"!!x", 1},
        {"--x", 3},
        {"-+-x", 3},
        {"2+3*4", 14},
        {"(2+3)*4", 20},
        {"10-3-2", 5},
        {"10-(3-2)", 9},
        {"24/4/2", 3},
        {"24/(4/2)", 12},
        {"2*3%4", 2},
        {"7-6%4", 5},
        {"1+1 == 2", 1},
        {"1 < 2 == 1", 1},
        {"3 > 2 > 1", 0},
        {"1 == 1 != 0", 1},
        {"2 <= 2", 1},
        {"2 >= 2.5", 0},
        {"2 != 2", 0},
        {"1 || 0 && 0", 1},
        {"(1 || 0) && 0", 0},
        {"0 || -0.1", 1},
        {"5 && 7", 1},
        {"0 ? 1 : 2", 2},
        {"0 ? 1 : 0 ? 2 : 3", 3},
        {"1 ? 0 ? 4 : 5 : 6", 5},
        {"1 || 0 ? 8 : 9", 8},
        {"x > 1 && y < 0 ? x*2 : y", 6},
        {"1e3", 1000},
        {"1E-3", 0.001},
        {"1e+2", 100},
        {".5", 0.5},
        {"5.", 5},
        {"0.1+0.2", 0.1 + 0.2},
        {"5e-324", 5e-324},
        {"k*4", 2},
        {"n", 4},
        {"\xe2\x88\x92x", -3}, // the Unicode minus
        {"7\xe2\x88\x92x", 4},
    };
    for (const Case& c : cases)
    {
        const Outcome outcome = valueOf(c.text);
        EXPECT_FALSE(outcome.failed) << c.text;
        EXPECT_EQ(outcome.value, c.value) << c.text;
    }
}

TEST(Expression, RemaindersTakeTheSignOfTheDividend)
{
    EXPECT_EQ(valueOf("7 % 3").value, 1);
    EXPECT_EQ(valueOf("-7 % 3").value, -1);
    EXPECT_EQ(valueOf("7 % -3").value, 1);
    EXPECT_EQ(valueOf("7.5 % 2").value, 1.5);
}

TEST(Expression, FunctionsWorkInDegrees)
{
    struct Case
    {
        const char* text;
        double value;
        double tolerance;
    };
    const Case cases[] = {
        {"sin(90)", 1, 0},
        {"cos(90)", 0, 0},
        {"cos(180)", -1, 0},
        {"sin(30)", 0.5, 1e-15},
        {"tan(45)", 1, 1e-15},
        {"tan(180)", 0, 0},
        {"asin(1)", 90, 1e-13},
        {"acos(-1)", 180, 1e-13},
        {"acos(0)", 90, 1e-13},
        {"atan(1)", 45, 1e-13},
        {"atan2(1, -1)", 135, 1e-13},
        {"atan2(-1, 0)", -90, 1e-13},
        {"atan2(0, 0)", 0, 0},
        {"sqrt(16)", 4, 0},
        {"exp(1)", 2.718281828459045, 1e-15},
        {"exp(-1000)", 0, 0},
        {"log(exp(2))", 2, 1e-15},
        {"pow(2, 10)", 1024, 0},
        {"abs(y)", 2, 0},
        {"min(x, y)", -2, 0},
        {"max(x, y)", 3, 0},
        {"floor(-1.5)", -2, 0},
        {"ceil(-1.5)", -1, 0},
        {"round(2.5)", 3, 0},
        {"round(-2.5)", -3, 0},
        {"sign(y)", -1, 0},
        {"sign(0)", 0, 0},
        {"sign(0.001)", 1, 0},
        {"pi", 3.141592653589793, 0},
    };
    for (const Case& c : cases)
    {
        const Outcome outcome = valueOf(c.text);
        EXPECT_FALSE(outcome.failed) << c.text;
        EXPECT_NEAR(outcome.value, c.value, c.tolerance) << c.text;
    }
}

TEST(Expression, WhatIsNotFiniteFails)
{
    for (const char* text :
         {"1/0",          "-1/0",       "0/0",         "1%0",          "x/(y+2)",      "tan(90)",    "tan(-270)",
          "asin(1.5)",    "acos(2)",    "sqrt(-1)",    "log(0)",       "log(-1)",      "exp(1000)",  "pow(0, -1)",
          "0^-1",         "(-8)^(1/3)", "1e308*10",    "1e308+1e308",  "-1e308-1e308", "sin(1e300)", "min(1/0, 1)",
          "sqrt(-1) > 0", "!(1/0)",     "1/0 ? 1 : 2", "rand(0, 1/0)", "floor(1/0)",   "1/0 || 1",   "1e308*10 == 1"})
        EXPECT_TRUE(valueOf(text).failed) << text;
}

TEST(Expression, WhatIsNotNeededIsNotEvaluated)
{
    for (const char* text : {"0 && 1/0", "x < 0 && log(y) > 0"})
    {
        EXPECT_FALSE(valueOf(text).failed) << text;
        EXPECT_EQ(valueOf(text).value, 0) << text;
    }
    for (const char* text : {"1 || 1/0", "x != 0 ? 1 : 1/(x-3)", "x == 3 ? 1 : 1/0", "x != 3 ? 1/(x-3) : 1"})
    {
        EXPECT_FALSE(valueOf(text).failed) << text;
        EXPECT_EQ(valueOf(text).value, 1) << text;
    }
    EXPECT_TRUE(valueOf("1 && 1/0").failed);
    EXPECT_TRUE(valueOf("0 || 1/0").failed);
}

TEST(Expression, RandomValuesDependOnTheKeyAlone)
{
    const RandomKey here = RandomKey(Seed{1}).child(2);
    for (const char* text : {"rand(2, 5)", "normal(10, 2)", "rand(0, 1) + rand(0, 1)"})
    {
        EXPECT_EQ(valueOf(text, here).value, valueOf(text, here).value) << text;
        EXPECT_NE(valueOf(text, here).value, valueOf(text, here.child(0)).value) << text;
    }
    EXPECT_NE(valueOf("rand(0, 1) - rand(0, 1)", here).value, 0) << "two draws of one expression are independent";
    EXPECT_EQ(valueOf("rand(3, 3)").value, 3);
    EXPECT_EQ(valueOf("normal(3, 0)").value, 3);
}

TEST(Expression, RandomValuesHaveTheirDistributions)
{
    constexpr int kDraws = 400;
    double sum = 0;
    double squares = 0;
    double uniformSum = 0;
    for (int i = 0; i < kDraws; ++i)
    {
        const RandomKey key = RandomKey(Seed{3}).child(static_cast<std::uint64_t>(i));
        const double normal = valueOf("normal(10, 2)", key).value;
        const double uniform = valueOf("rand(2, 5)", key).value;
        EXPECT_GE(uniform, 2);
        EXPECT_LT(uniform, 5);
        uniformSum += uniform;
        sum += normal;
        squares += (normal - 10) * (normal - 10);
    }
    const double count = kDraws;
    EXPECT_NEAR(uniformSum / count, 3.5, 5 * std::sqrt(0.75 / count));
    EXPECT_NEAR(sum / count, 10, 5 * 2 / std::sqrt(count));
    EXPECT_NEAR(squares / count, 4, 5 * 4 * std::sqrt(2 / count));
}

TEST(Expression, EveryFunctionIsReadByItsNameOnceWithItsArguments)
{
    std::set<std::string_view> names;
    for (const ExpressionFunction& function : expressionFunctions())
    {
        EXPECT_TRUE(names.insert(function.name).second) << function.name;
        const std::string call = std::string(function.name) + (function.arguments == 2 ? "(0.5, 0.75)" : "(0.5)");
        EXPECT_FALSE(valueOf(call).failed) << call;
    }
    EXPECT_EQ(names.size(), 20u);
}

} // namespace
} // namespace espalier
