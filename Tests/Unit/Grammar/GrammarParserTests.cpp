#include <Espalier/Grammar/Grammar.h>
#include <algorithm>
#include <chrono>
#include <gtest/gtest.h>
#include <string>

namespace espalier {
namespace {

Grammar parsed(const std::string& text, const Limits& limits = {})
{
    auto grammar = parseGrammar(text, "g.lsys", limits);
    EXPECT_TRUE(grammar) << text << "\n" << (grammar ? "" : toString(grammar.error()));
    return grammar ? std::move(*grammar) : Grammar{};
}

Error errorOf(const std::string& text, const Limits& limits = {})
{
    auto grammar = parseGrammar(text, "g.lsys", limits);
    EXPECT_FALSE(grammar) << text.substr(0, 200);
    return grammar ? Error{} : grammar.error();
}

std::string repeated(std::string_view text, std::size_t times)
{
    std::string all;
    for (std::size_t i = 0; i < times; ++i)
        all += text;
    return all;
}

/// The symbols of a word, each followed by a blank.
std::string symbolsOf(const Grammar& grammar, const std::vector<Module>& word)
{
    std::string text;
    for (const Module& module : word)
        text += grammar.symbols.name(module.symbol) + " ";
    return text;
}

double secondsOf(const auto& function)
{
    const auto start = std::chrono::steady_clock::now();
    function();
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

TEST(GrammarParser, EveryMistakeIsReportedWhereItStands)
{
    struct Case
    {
        const char* text;
        std::uint32_t line, column;
        const char* message; ///< A part of `what; expected ...`.
    };
    const Case cases[] = {
        {"", 1, 1, "no axiom"},
        {"A -> F\n", 1, 1, "no axiom; expected a line such as `axiom: A`"},
        {"axiom: A\nA F\n", 2, 1, "neither a setting, a `let` nor a production"},
        {"axiom: A\n  A F\n", 2, 3, "neither"},
        {"axiom: A\nA(x -> F\n", 2, 2, "`(` is never closed"},
        {"axiom: A(1\n", 1, 11, "unexpected the end of the line in a parameter list; expected `,` or `)`"},
        {"axiom: A(1 2)\n", 1, 12, "unexpected `2` in a parameter list"},
        {"axiom: A(1,)\n", 1, 12, "unexpected `)` in an expression"},
        {"axiom: A(1))\n", 1, 12, "`)` cannot be a symbol"},
        {"axiom: A, B\n", 1, 9, "`,` cannot be a symbol"},
        {"axiom: A\xce\xb5\n", 1, 9, "`\xce\xb5` cannot be a symbol"},
        {"axiom: _ A\n", 1, 10, "unexpected `A` after the empty word"},
        {"axiom: A_\n", 1, 9, "`_` cannot be a symbol"},
        {"axiom: F[A\n", 1, 9, "`[` is never closed in the axiom"},
        {"axiom: F]A\n", 1, 9, "`]` without `[` in the axiom"},
        {"axiom: A\nA -> [F[]]]\n", 2, 11, "`]` without `[` in the successor"},
        {"axiom: A\n-> F\n", 2, 1, "`->` cannot be a symbol"},
        {"axiom: A\nA B -> F\n", 2, 3, "unexpected `B` after the predecessor"},
        {"axiom: A\nA -> B -> C\n", 2, 3, "a production has one arrow"},
        {"axiom: A\nA < B -> F\n", 2, 3, "contexts are not part of a species' grammar"},
        {"axiom: A\nB > C : 1 -> F\n", 2, 3, "contexts are not"},
        {"axiom: A\n[ -> F\n", 2, 1, "`[` cannot be rewritten"},
        {"axiom: A\n  ](x) -> F\n", 2, 3, "`]` cannot be rewritten"},
        {"axiom: A\nA(x, x) -> F\n", 2, 6, "the parameter `x` stands twice"},
        {"axiom: A\nA(1) -> F\n", 2, 3, "unexpected `1`; expected the name of a parameter"},
        {"axiom: A\nA(x y) -> F\n", 2, 5, "unexpected `y` in the parameters"},
        {"axiom: A\nA(x,) -> F\n", 2, 5, "unexpected `)`; expected the name of a parameter"},
        {"axiom: A\nA(x) : x = 1 -> F\n", 2, 10, "`=` does not compare; expected `==`"},
        {"axiom: A\nA(x) -> F(x=1)\n", 2, 12, "`=` does not compare"},
        {"axiom: A\nA(x) : x & 1 -> F\n", 2, 10, "unexpected `&`; expected `&&` or `||`"},
        {"axiom: A\nA(x) : x | 1 -> F\n", 2, 10, "unexpected `|`; expected `&&` or `||`"},
        {"axiom: A\nA(x) : -> F\n", 2, 8, "unexpected `->` in an expression"},
        {"axiom: A\nA(x) : x 1 -> F\n", 2, 10, "unexpected `1` after the condition"},
        {"axiom: A\nA(x) : * 1 -> F\n", 2, 10, "unexpected `1` after the condition"},
        {"axiom: A\nA(x) -> F(y)\n", 2, 11, "`y` is not known here"},
        {"axiom: A(x)\n", 1, 10, "`x` is not known here"},
        {"axiom: A\nA -> F(s)\n", 2, 8, "`s` is not known here"},
        {"axiom: A\nA -> F(sin)\n", 2, 11, "the function sin has no arguments"},
        {"axiom: A\nA -> F(sin())\n", 2, 12, "unexpected `)` in an expression"},
        {"axiom: A\nA -> F(sin(1, 2))\n", 2, 13, "unexpected `,` after the argument of sin"},
        {"axiom: A\nA -> F(pow(1))\n", 2, 13, "the function pow takes 2 arguments"},
        {"axiom: A\nA -> F(1 ? 2)\n", 2, 13, "unexpected `)` after `?`"},
        {"axiom: A\nA -> F((1)\n", 2, 11, "unexpected the end of the line in a parameter list"},
        {"axiom: A\nA -> F(1e400)\n", 2, 8, "no double holds the number 1e400"},
        {"axiom: A\nA -> F(1.5.2)\n", 2, 11, "unexpected `.`"},
        {"axiom: A\nA -> F(.)\n", 2, 8, "unexpected `.` in an expression"},
        {"axiom: A\nA -> F(1 $ 2)\n", 2, 10, "unexpected `$`"},
        {"axiom: A\nA -> F :\n", 2, 9, "unexpected the end of the line in an expression"},
        {"axiom: A\nA -> F : 1 2\n", 2, 12, "unexpected `2` after the weight"},
        {"axiom: A\nA -> F : 1 : 2\n", 2, 14, "unexpected `2`; expected `~` and the name of a table"},
        {"axiom: A\nA -> F : ~\n", 2, 11, "the name of a table"},
        {"axiom: A\nA -> F : ~ t(1\n", 2, 15, "unexpected the end of the line after the table's row"},
        {"axiom: A\nA -> F : ~ t u\n", 2, 14, "unexpected `u` after the table"},
        {"axiom: A\naxiom: B\n", 2, 1, "the setting `axiom:` stands twice"},
        {"angle: 10\n angle: 20\naxiom: A\n", 2, 2, "the setting `angle:` stands twice"},
        {"symbols: Ab\nsymbols: Cd\naxiom: A\n", 2, 1, "the setting `symbols:` stands twice"},
        {"symbols: Ab Ab\naxiom: A\n", 1, 13, "the symbol `Ab` is declared twice"},
        {"symbols: 1b\naxiom: A\n", 1, 10, "unexpected `1`; expected the name of a symbol"},
        {"symbols: let\naxiom: A\n", 1, 10, "`let` cannot be a symbol"},
        {"symbols: Ab axiom\naxiom: A\n", 1, 13, "`axiom` cannot be a symbol"},
        {"axiom: A\nangel: 20\n", 2, 1, "unknown setting `angel:`; expected one of symbols, angle"},
        {"axiom: A\nangle:\n", 2, 7, "unexpected the end of the line in an expression"},
        {"axiom: A\nangle: 3601\n", 2, 8, "the value 3601 is out of range; expected a number from -3600 to 3600"},
        {"axiom: A\nangle: 1/0\n", 2, 8, "the value is not finite"},
        {"axiom: A\nangle: 20 30\n", 2, 11, "unexpected `3` after the setting"},
        {"axiom: A\nstep: -1\n", 2, 7, "the value -1 is out of range"},
        {"axiom: A\nwidth: -1\n", 2, 8, "the value -1 is out of range"},
        {"axiom: A\ndraw: (\n", 2, 7, "`(` cannot be a symbol"},
        {"axiom: A\ninterpret: 0 -> F\n", 2, 1, "`interpret:` is not part of a species' grammar"},
        {"axiom: A\nignore: F\n", 2, 1, "`ignore:` is not"},
        {"axiom: A\norder: listed\n", 2, 1, "`order:` is not"},
        {"axiom: A\ntropism: 0.2 0 -1 0\n", 2, 1, "`tropism:` is not"},
        {"axiom: A\n iterations: 3\n", 2, 2, "`iterations:` is not"},
        {"let r = 1\nlet r = 2\naxiom: A\n", 2, 5, "the constant `r` is defined twice"},
        {"let r 1\naxiom: A\n", 1, 7, "unexpected `1` after the constant's name; expected `=`"},
        {"let 1 = 1\naxiom: A\n", 1, 5, "the name of a constant"},
        {"let r = 1 2\naxiom: A\n", 1, 11, "unexpected `2` after the constant's value"},
        {"let r = 1/0\naxiom: A\n", 1, 5, "the constant `r` has no finite value"},
        {"let r = q\nlet q = 1\naxiom: A\n", 1, 9, "`q` is not known here"},
        {"let pi = 3\naxiom: A\n", 1, 5, "`pi` is built in"},
        {"let sin = 3\naxiom: A\n", 1, 5, "`sin` is built in"},
        {"#define r 0.7\naxiom: A\n", 1, 1, "`#define` is the preprocessor's, which is not used here; expected `let"},
        {"axiom: A\n  #include <x>\n", 2, 3, "`#include` is the preprocessor's"},
        {"axiom: A\n\tA(x, x) -> F\n", 2, 7, "stands twice"},
        {"axiom: \xe2\x88\x92\xe2\x88\x92]\n", 1, 10, "`]` without `[`"},
        {"axiom: A\r\nA -> F]\r\n", 2, 7, "`]` without `[`"},
    };
    for (const Case& c : cases)
    {
        const Error error = errorOf(c.text);
        EXPECT_EQ(error.where.file, "g.lsys") << c.text;
        EXPECT_EQ(error.where.line, c.line) << c.text << toString(error);
        EXPECT_EQ(error.where.column, c.column) << c.text << toString(error);
        EXPECT_NE((error.what + "; expected " + error.expected).find(c.message), std::string::npos)
            << c.text << toString(error);
        EXPECT_EQ(error.kind, ErrorKind::BadInput) << c.text;
    }
}

TEST(GrammarParser, AllMistakesComeAtOnce)
{
    const std::string text = toString(errorOf("axiom: F]\nA -> (\nangel: 1\nsymbols: 1\nB(x, x) -> F\n"));
    EXPECT_TRUE(text.starts_with("g.lsys:1:9: `]` without `[`")) << text;
    for (const char* part : {"4 further:", "\ng.lsys:2:6: ", "\ng.lsys:3:1: ", "\ng.lsys:4:10: ", "\ng.lsys:5:6: "})
        EXPECT_NE(text.find(part), std::string::npos) << part << " in " << text;
}

TEST(GrammarParser, ReportsAtMostTwentyMistakes)
{
    const std::string text = toString(errorOf(repeated("A ->]\n", 1000)));
    EXPECT_EQ(std::ranges::count(text, '\n'), 19);
    EXPECT_NE(text.find("19 or more further:"), std::string::npos) << text;
    EXPECT_NE(text.find("g.lsys:20:5: "), std::string::npos) << text;
}

TEST(GrammarParser, LineEndsBlanksAndCommentsDoNotMatter)
{
    const Grammar plain = parsed("angle: 30\naxiom: A(1)[B]\nA(x) : x > 0 -> F(x) : 2\n");
    for (const char* text : {
             "angle: 30\r\naxiom: A(1)[B]\r\nA(x) : x > 0 -> F(x) : 2\r\n",
             "angle: 30\naxiom: A(1)[B]\nA(x) : x > 0 -> F(x) : 2",
             "# first\n\n  angle:30 # here\naxiom:A( 1 ) [ B ]#[\n\t\nA\t(x):x>0->F(x):2#:::\n#",
             "\tangle:\t30\n \t axiom:\tA (1)[\tB]\nA(x)\t:\tx>0\t-->\tF(x)\t:\t2\n",
             "angle: 30\n#defined below\naxiom: A(1)[B]\nA(x) : x > 0 \xe2\x86\x92 F(x) : 2 # define\n",
         })
        EXPECT_TRUE(parsed(text) == plain) << text << "\n" << printGrammar(parsed(text));
}

TEST(GrammarParser, AnEmptySuccessorIsSpelledInThreeWays)
{
    for (const char* text :
         {"axiom: A\nA -> _\n", "axiom: A\nA ->\n", "axiom: A\nA -> \xce\xb5\n", "axiom: A\nA ->  # _\n"})
    {
        const Grammar grammar = parsed(text);
        ASSERT_EQ(grammar.productions.size(), 1u) << text;
        EXPECT_TRUE(grammar.productions[0].successor.empty()) << text;
    }
    EXPECT_TRUE(parsed("axiom: _\n").axiom.empty());
    EXPECT_TRUE(parsed("axiom:\n").axiom.empty());
}

TEST(GrammarParser, TheMinusCanBeRewritten)
{
    for (const char* text : {"axiom: -\n- -> +\n", "axiom: -\n- --> +\n", "axiom: -\n-\xe2\x86\x92+\n",
                             "axiom: -\n- ->+\n", "axiom: \xe2\x88\x92\n\xe2\x88\x92 \xe2\x88\x92> +\n"})
    {
        const Grammar grammar = parsed(text);
        ASSERT_EQ(grammar.productions.size(), 1u) << text;
        EXPECT_EQ(grammar.symbols.name(grammar.productions[0].predecessor), "-") << text;
        EXPECT_EQ(symbolsOf(grammar, grammar.productions[0].successor), "+ ") << text;
        EXPECT_EQ(symbolsOf(grammar, grammar.axiom), "- ") << text;
    }
    const Grammar minus = parsed("axiom: A\nA -> - -F-\n");
    EXPECT_EQ(symbolsOf(minus, minus.productions[0].successor), "- - F - ");
}

TEST(GrammarParser, DeclaredSymbolsAreMatchedLongestFirst)
{
    const Grammar grammar =
        parsed("axiom: TwigTw igTwigsT\nTwigs -> Tw\nsymbols: Tw Twig Twigs # anywhere in the file\n");
    EXPECT_EQ(symbolsOf(grammar, grammar.axiom), "Twig Tw i g Twigs T ");
    EXPECT_EQ(grammar.symbols.name(grammar.productions[0].predecessor), "Twigs");
    EXPECT_EQ(
        symbolsOf(parsed("symbols: Ab Abcd\naxiom: AbcAbcd\n"), parsed("symbols: Ab Abcd\naxiom: AbcAbcd\n").axiom),
        "Ab c Abcd ");
    const Grammar condition = parsed("symbols: Bud\naxiom: Bud(1)\nBud(x): x > 0 -> F\n");
    EXPECT_EQ(condition.productions.size(), 1u);
    EXPECT_EQ(parsed("symbols: Bud\naxiom: Bud\nBud: 1 -> F\n").productions.size(), 1u) << "a condition, no setting";
}

TEST(GrammarParser, ADigitIsASymbolOutsideParentheses)
{
    const Grammar grammar = parsed("axiom: F2(2)\n0 -> 1[0]0\n");
    EXPECT_EQ(symbolsOf(grammar, grammar.axiom), "F 2 ");
    EXPECT_EQ(grammar.axiom[1].argumentCount, 1u);
    EXPECT_EQ(symbolsOf(grammar, grammar.productions[0].successor), "1 [ 0 ] 0 ");
}

TEST(GrammarParser, EmptyParenthesesAreNone)
{
    EXPECT_TRUE(parsed("axiom: A()B( )\nA() -> F\n") == parsed("axiom: AB\nA -> F\n"));
}

TEST(GrammarParser, ParametersHideWhatHasTheirName)
{
    const Grammar grammar =
        parsed("let s = 2\naxiom: A(1)\nA(n) -> F(n)\nA(pi) -> F(pi)\nB(s) -> F(s) : ~ t\nB -> F(s) : ~ t\n"
               "C -> F(s)\n");
    const auto opOf = [&](std::size_t production) {
        return grammar.expressions[grammar.arguments[grammar.productions[production].successor[0].firstArgument]].op;
    };
    EXPECT_EQ(opOf(0), ExpressionOp::Parameter);
    EXPECT_EQ(opOf(1), ExpressionOp::Parameter);
    EXPECT_EQ(opOf(2), ExpressionOp::Parameter);
    EXPECT_EQ(opOf(3), ExpressionOp::Transform);
    EXPECT_EQ(opOf(4), ExpressionOp::Constant);
}

TEST(GrammarParser, TheFirstColonSeparatesTheRestBelongsToTheChoice)
{
    const Grammar grammar =
        parsed("axiom: A(1)\nA(x) : x > 1 ? 0 : 1 -> F(x ? 1 : 2) : x ? 3 : 4 : ~ t(x ? 0 : 1)\nB : * -> F\n");
    const Production& production = grammar.productions[0];
    EXPECT_EQ(grammar.expressions[production.condition].op, ExpressionOp::Choose);
    EXPECT_EQ(grammar.expressions[production.weight].op, ExpressionOp::Choose);
    EXPECT_EQ(grammar.expressions[production.row].op, ExpressionOp::Choose);
    EXPECT_EQ(production.table, "t");
    EXPECT_EQ(production.line, 2u);
    EXPECT_EQ(grammar.productions[1].condition, kNoExpression);
}

TEST(GrammarParser, SettingsReplaceTheDefaults)
{
    const Grammar defaults = parsed("axiom: A\n");
    EXPECT_EQ(defaults.angle, 25);
    EXPECT_EQ(defaults.step, 1);
    EXPECT_EQ(defaults.width, 0.1);
    EXPECT_EQ(defaults.draw.size(), 2u);
    EXPECT_EQ(defaults.move.size(), 1u);

    const Grammar grammar = parsed("let a = 11\nangle: a*2\nstep: 0.5\nwidth: 0\ndraw:\nmove: F g\naxiom: A\n");
    EXPECT_EQ(grammar.angle, 22);
    EXPECT_EQ(grammar.step, 0.5);
    EXPECT_EQ(grammar.width, 0);
    EXPECT_TRUE(grammar.draw.empty());
    ASSERT_EQ(grammar.move.size(), 2u);
    EXPECT_EQ(grammar.symbols.name(grammar.move[1]), "g");
}

TEST(GrammarParser, EachLimitMayBeReachedButNotPassed)
{
    Limits limits;
    limits.bracketDepth = 3;
    limits.parameters = 2;
    limits.longSymbols = 2;
    limits.constants = 2;
    limits.productions = 2;
    limits.templateModules = 7;
    limits.expressionDepth = 4;
    struct Case
    {
        const char* allowed;
        const char* refused;
        const char* limit;
        std::uint32_t line, column; ///< Of the refusal.
    };
    const Case cases[] = {
        {"axiom: [[[]]]", "axiom: [[[[]]]]", "bracketDepth", 1, 11},
        {"axiom: A(1,2)", "axiom: A(1,2,3)", "parameters", 1, 14},
        {"axiom: A\nA(x,y) ->", "axiom: A\nA(x,y,z) ->", "parameters", 2, 7},
        {"axiom: A\nA ->\nB ->", "axiom: A\nA ->\nB ->\nC ->", "productions", 4, 1},
        {"symbols: Aa Ab\naxiom: A", "symbols: Aa Ab Ac\naxiom: A", "longSymbols", 1, 16},
        {"let a = 1\nlet b = 2\naxiom: F", "let a = 1\nlet b = 2\nlet c = 3\naxiom: F", "constants", 3, 5},
        {"axiom: FFFFFFF", "axiom: FFFFFFFF", "templateModules", 1, 15},
        {"axiom: A((((1))))", "axiom: A(((((1)))))", "expressionDepth", 1, 14},
        {"axiom: A(1+1+1+1)", "axiom: A(1+1+1+1+1)", "expressionDepth", 1, 17},
        {"axiom: A(1+2*3^4)", "axiom: A(1+2*3^-4)", "expressionDepth", 1, 11},
        {"axiom: A(---1)", "axiom: A(----1)", "expressionDepth", 1, 14},
        {"axiom: A(2^2^2^2)", "axiom: A(2^2^2^2^2)", "expressionDepth", 1, 18},
        {"axiom: A(sin(cos(tan(1))))", "axiom: A(sin(cos(tan(abs(1)))))", "expressionDepth", 1, 26},
        {"axiom: A(1?2:1?2:1?2:3)", "axiom: A(1?2:1?2:1?2:1?2:3)", "expressionDepth", 1, 24},
        {"axiom: A((1+1+1)+1)", "axiom: A((1+1+1)+(1+1+1)*2)", "expressionDepth", 1, 17},
    };
    for (const Case& c : cases)
    {
        (void)parsed(c.allowed, limits);
        const Error error = errorOf(c.refused, limits);
        EXPECT_EQ(error.kind, ErrorKind::Limit) << c.refused;
        EXPECT_NE(error.expected.find(c.limit), std::string::npos) << toString(error);
        EXPECT_EQ(error.where.line, c.line) << toString(error);
        EXPECT_EQ(error.where.column, c.column) << toString(error);
    }
    limits = {};
    limits.fileBytes = 8;
    (void)parsed("axiom: A", limits);
    EXPECT_EQ(errorOf("axiom: A\n", limits).kind, ErrorKind::Limit);
    EXPECT_EQ(errorOf("symbols: " + std::string(257, 'A') + "\naxiom: A\n").kind, ErrorKind::Limit);
    (void)parsed("symbols: " + std::string(256, 'A') + "\naxiom: A\n");
}

/// Left sums inside left sums: each pair of parentheses may not add the whole length of a sum to the height.
TEST(GrammarParser, TheHeightOfAnExpressionIsBoundedThroughParentheses)
{
    std::string nested = "1";
    for (int i = 0; i < 6; ++i)
        nested = "(" + nested + repeated("+1", 12) + ")";
    EXPECT_EQ(errorOf("axiom: A(" + nested + ")").kind, ErrorKind::Limit);
    (void)parsed("axiom: A(1" + repeated("+1", 63) + ")");
    EXPECT_EQ(errorOf("axiom: A(1" + repeated("+1", 64) + ")").kind, ErrorKind::Limit);
}

TEST(GrammarParser, WhatIsNotUtf8IsRefusedWithItsPlace)
{
    for (const char* text : {"axiom: A\nA -> \xff\n", "axiom: A\nA -> \xc3", "axiom: A\nA -> \xc0\x80\n"})
    {
        const Error error = errorOf(text);
        EXPECT_NE(error.what.find("UTF-8"), std::string::npos);
        EXPECT_EQ(error.where.line, 2u);
        EXPECT_EQ(error.where.column, 6u);
    }
    EXPECT_EQ(errorOf(std::string("axiom: A\0B\n", 11)).where.column, 9u);
}

TEST(GrammarParser, SymbolsMayBeAnyOtherCharacter)
{
    const Grammar grammar = parsed("axiom: \xc3\xa4\xe2\x82\xac\xf0\x9f\x8c\xb3(1)\n\xf0\x9f\x8c\xb3(x) -> F\n");
    EXPECT_EQ(symbolsOf(grammar, grammar.axiom), "\xc3\xa4 \xe2\x82\xac \xf0\x9f\x8c\xb3 ");
}

TEST(GrammarParser, HostileTextsAreAnsweredQuickly)
{
    std::string many = "symbols:";
    for (int i = 0; i < 4096; ++i)
        many += " A" + std::to_string(i);
    std::string comb = "symbols:";
    for (std::size_t i = 1; i <= 256; ++i)
        comb += " " + std::string(i, 'A');
    const std::string thousandBytes = repeated("A999B", 200);
    const std::string hostile[] = {
        "axiom: A(" + std::string(100000, '(') + "1" + std::string(100000, ')') + ")",
        "axiom: A(" + std::string(100000, '-') + "1)",
        "axiom: A(1" + repeated("+1", 100000) + ")",
        "axiom: A(" + repeated("1?1:", 100000) + "1)",
        "axiom: A(" + repeated("sin(", 100000) + "1)",
        "axiom: " + std::string(100000, '['),
        "axiom: " + std::string(100000, '[') + std::string(100000, ']'),
        "axiom: " + std::string(1 << 20, 'F'),
        "axiom: A(" + std::string(1 << 20, '9') + ")",
        "axiom: A(0." + std::string(1 << 20, '9') + "e99999999999)",
        std::string(1 << 20, 'A'),
        std::string(1 << 20, '\n'),
        std::string(1 << 20, '-'),
        repeated("->", 1 << 19),
        repeated("A->\n", 1 << 18),
        "axiom: " + repeated("(", 1 << 20),
        many + "\naxiom: " + repeated(thousandBytes, 60) + "\n",
        comb + "\naxiom: " + repeated(std::string(255, 'A') + "B", 400),
        "symbols: " + std::string(1 << 20, 'A') + "\naxiom: A",
        "axiom: A\nA(" + repeated("x,", 1 << 19) + ") -> F",
    };
    for (const std::string& text : hostile)
        EXPECT_LT(secondsOf([&] { (void)parseGrammar(text, "g.lsys", {}); }), 1.0)
            << text.substr(0, 40) << ", " << text.size() << " bytes";
}

} // namespace
} // namespace espalier
