#include <Espalier/Grammar/Grammar.h>
#include <algorithm>
#include <chrono>
#include <gtest/gtest.h>
#include <span>
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

struct MistakeCase
{
    std::string text;
    std::uint32_t line, column;
    const char* message; ///< A part of `what; expected ...`.
};

void expectMistakes(std::span<const MistakeCase> cases)
{
    for (const MistakeCase& c : cases)
    {
        const Error error = errorOf(c.text);
        EXPECT_EQ(error.where.file, "g.lsys") << c.text;
        EXPECT_EQ(error.where.line, c.line) << c.text << toString(error);
        EXPECT_EQ(error.where.column, c.column) << c.text << toString(error);
        EXPECT_NE((error.what + "; expected " + error.expected).find(c.message), std::string::npos)
            << c.text << toString(error);
        EXPECT_FALSE(error.expected.empty()) << c.text;
        EXPECT_EQ(error.kind, ErrorKind::BadInput) << c.text;
        EXPECT_TRUE(error.advice.empty()) << "one mistake, one error: " << c.text << toString(error);
    }
}

TEST(GrammarParser, EveryMistakeIsReportedWhereItStands)
{
    const MistakeCase cases[] = {
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
        {"axiom: A\n-> F\n", 2, 1, "no predecessor stands before `->`"},
        {"axiom: A\n : 1 -> F\n", 2, 2, "no predecessor stands before `:`"},
        {"axiom: A\nA B -> F\n", 2, 3, "unexpected `B` after the predecessor"},
        {"axiom: A\nA -> B -> C\n", 2, 3, "a production has one arrow"},
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
        {"axiom: A\nangel: 20\n", 2, 1, "unknown setting `angel:`; expected `angle:`"},
        {"axiom: A\nseed: 20\n", 2, 1, "unknown setting `seed:`; expected one of symbols, angle"},
        {"axiom: A\nangle:\n", 2, 7, "unexpected the end of the line in an expression"},
        {"axiom: A\nangle: 3601\n", 2, 8, "the value 3601 is out of range; expected a number from -3600 to 3600"},
        {"axiom: A\nangle: 1/0\n", 2, 8, "the value is not finite"},
        {"axiom: A\nangle: 20 30\n", 2, 11, "unexpected `3` after the setting"},
        {"axiom: A\nstep: -1\n", 2, 7, "the value -1 is out of range"},
        {"axiom: A\nwidth: -1\n", 2, 8, "the value -1 is out of range"},
        {"axiom: A\ndraw: (\n", 2, 7, "`(` cannot be a symbol"},
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
    expectMistakes(cases);
}

TEST(GrammarParser, MistakesInContextsSayWhatToWrite)
{
    const MistakeCase cases[] = {
        {"axiom: A\n< A -> F\n", 2, 1, "nothing stands before `<`; expected the left context"},
        {"axiom: A\nA > -> F\n", 2, 3, "nothing stands after `>`; expected the right context"},
        {"axiom: A\nA > : 1 -> F\n", 2, 3, "nothing stands after `>`"},
        {"axiom: A\n > B -> F\n", 2, 2, "no predecessor stands before `>`"},
        {"axiom: A\nA < -> F\n", 2, 5, "no predecessor stands before `->`"},
        {"axiom: A\nA < : 1 -> F\n", 2, 5, "no predecessor stands before `:`"},
        {"axiom: A\nA < > B -> F\n", 2, 5, "no predecessor stands before `>`"},
        {"axiom: A\nA < B C > D -> F\n", 2, 7,
         "unexpected `C` after the predecessor; expected exactly one symbol; its neighbours belong into contexts"},
        {"axiom: A\nA(x) x > 1 -> F\n", 2, 6, "its condition after a `:`"},
        {"axiom: A\n* < A > B -> F\n", 2, 1, "`*` is no context; expected no left context and no `<`"},
        {"axiom: A\nB < A > * -> F\n", 2, 9, "`*` is no context; expected no right context and no `>`"},
        {"axiom: A\nB < A > _ -> F\n", 2, 9, "`_` is no context"},
        {"axiom: A\n\xce\xb5 < A -> F\n", 2, 1, "`\xce\xb5` is no context"},
        {"axiom: A\nB C_ < A -> F\n", 2, 4, "`_` cannot be a symbol"},
        {"axiom: A\nA < B < C -> F\n", 2, 7,
         "a second `<` in one production; expected `left < predecessor > right`; several neighbours stand together"},
        {"axiom: A\nA << B -> F\n", 2, 4, "a second `<`"},
        {"axiom: A\nA > B > C -> F\n", 2, 7, "a second `>`"},
        {"axiom: A\nA > B < C -> F\n", 2, 7, "`<` stands after `>`"},
        {"axiom: A\nB[C] < A -> F\n", 2, 2, "`[` cannot stand in a left context; expected only the symbols between"},
        {"axiom: A\nB] < A -> F\n", 2, 2, "`]` cannot stand in a left context"},
        {"axiom: A\nA > B[C -> F\n", 2, 6, "`[` is never closed in the right context"},
        {"axiom: A\nA > B]C -> F\n", 2, 6, "`]` without `[` in the right context"},
        {"axiom: A\nA > B[(x)C] -> F\n", 2, 7, "a bracket of a context has no parameters"},
        {"axiom: A\nB(1) < A -> F\n", 2, 3, "unexpected `1`; expected the name of a parameter"},
        {"axiom: A\nA > B(x -> F\n", 2, 6, "`(` is never closed"},
        {"axiom: A\nA > B(x -> F)\n", 2, 6, "`(` is not closed before the arrow"},
        {"axiom: A\nA, B < C -> F\n", 2, 2, "`,` cannot be a symbol"},
        {"axiom: A\nB < [ -> F\n", 2, 5, "`[` cannot be rewritten, for brackets must balance; expected another"},
        {"axiom: A\nB(x) < A(x) -> F\n", 2, 10,
         "the parameter `x` stands twice; expected different names on the whole left-hand side"},
        {"axiom: A\nB(x) < A > C(y, x) -> F\n", 2, 17, "the parameter `x` stands twice"},
        {"axiom: A\nA > C(y)C(y)C(y) -> F\n", 2, 11, "the parameter `y` stands twice"},
        {"axiom: A\nB(x) < A -> F(y)\n", 2, 15, "`y` is not known here; expected a parameter of this production"},
        {"axiom: A\nB < A > C\n", 2, 1, "neither a setting, a `let` nor a production"},
        {"axiom: A\nB < A -> C > D\n", 2, 12, "`>` cannot be a symbol; expected contexts only before"},
        {"axiom: A\nA(x+1) > B -> C\n", 2, 4, "unexpected `+` in the parameters; expected `,` or `)`; names alone"},
        {"axiom: A\nB < A -> C -> D\n", 2, 7, "a production has one arrow"},
    };
    expectMistakes(cases);
}

TEST(GrammarParser, MistakesInSettingsSayWhatToWrite)
{
    const MistakeCase cases[] = {
        {"axiom: A\norder: last\n", 2, 8,
         "unexpected `last` as the order of productions; expected `listed` (the first that matches) or "
         "`context-first`"},
        {"axiom: A\norder:\n", 2, 7, "unexpected the end of the line as the order of productions"},
        {"axiom: A\norder: listed first\n", 2, 15, "unexpected `f` after the order of productions"},
        {"axiom: A\nignore: F[\n", 2, 10, "`[` cannot be ignored"},
        {"axiom: A\nignore: ] F\n", 2, 9, "`]` cannot be ignored"},
        {"axiom: A\nignore: F, G\n", 2, 10, "unexpected `,` between symbols"},
        {"axiom: A\nignore: F(1)\n", 2, 10, "`(` cannot be a symbol"},
        {"axiom: A\ntropism: 0.2 0 -1\n", 2, 18,
         "the tropism has fewer than four values; expected its strength and a direction"},
        {"axiom: A\ntropism:\n", 2, 9, "the tropism has fewer than four values"},
        {"axiom: A\ntropism: 0.2 0 -1 0 1\n", 2, 21, "unexpected `1` after the tropism's four values"},
        {"axiom: A\ntropism: 0.2, 0, -1, 0\n", 2, 13, "unexpected `,` after a value; expected a blank"},
        {"axiom: A\ntropism: 0.2 0 - 1 0\n", 2, 17, "a blank stands between a sign and its number"},
        {"axiom: A\ntropism: 0.2 0-1 0\n", 2, 15, "unexpected `-` after a value"},
        {"axiom: A\ntropism: 1/0 0 -1 0\n", 2, 11, "unexpected `/` after a value"},
        {"axiom: A\ntropism: (1/0) 0 -1 0\n", 2, 10, "the value is not finite"},
        {"axiom: A\ntropism: 1 0 -100001 0\n", 2, 14, "the value 100001 is out of range"},
        {"axiom: A\ntropism: 1 0 x 0\n", 2, 14, "`x` is not known here; expected a constant made by `let`"},
        {"axiom: A\niterations: 2.5\n", 2, 13, "the value 2.5 is not a whole number"},
        {"axiom: A\niterations: -1\n", 2, 13, "the value -1 is out of range; expected a number from 0 to 1000000"},
        {"axiom: A\niterations: 1000001\n", 2, 13, "the value 1000001 is out of range"},
        {"axiom: A\niterations: many\n", 2, 13, "`many` is not known here"},
        {"axiom: A\n iterations: 3\n iterations: 3\n", 3, 2, "the setting `iterations:` stands twice"},
        {"ignore: F\nignore: G\naxiom: A\n", 2, 1, "the setting `ignore:` stands twice"},
        {"order: listed\norder: listed\naxiom: A\n", 2, 1, "the setting `order:` stands twice"},
        {"tropism: 1 0 1 0\ntropism: 1 0 1 0\naxiom: A\n", 2, 1, "the setting `tropism:` stands twice"},
        {"axiom: A\ninterprete: A -> B\n", 2, 1, "unknown setting `interprete:`; expected `interpret:`"},
        {"axiom: A\ncolours: A -> B\n", 2, 1,
         "unknown setting `colours:`; expected one of symbols, angle, step, width, draw, move, ignore, order, "
         "tropism, iterations, axiom, interpret; or exactly one symbol"},
        {"symbols: interpret\naxiom: A\n", 1, 10, "`interpret` cannot be a symbol"},
    };
    expectMistakes(cases);
}

TEST(GrammarParser, MistakesInInterpretationsSayWhatToWrite)
{
    const MistakeCase cases[] = {
        {"axiom: A\ninterpret: B < A -> F\n", 2, 14, "`interpret:` has no context, `<` stands before its colon"},
        {"axiom: A\ninterpret: A > B -> F\n", 2, 14, "`interpret:` has no context, `>` stands before its colon"},
        {"axiom: A\ninterpret: A -> F : ~ t\n", 2, 21, "`interpret:` draws from no table"},
        {"axiom: A\ninterpret: A -> F : 1 : ~ t\n", 2, 25, "`interpret:` draws from no table"},
        {"axiom: A\ninterpret: A -> F : 1 2\n", 2, 23, "unexpected `2` after the weight; expected the end"},
        {"axiom: A\ninterpret: A -> F[\n", 2, 18, "`[` is never closed in the successor"},
        {"axiom: A\ninterpret: A -> F]\n", 2, 18, "`]` without `[` in the successor"},
        {"axiom: A\ninterpret: A B -> F\n", 2, 14,
         "unexpected `B` after the predecessor; expected exactly one symbol, and its condition after a `:`"},
        {"axiom: A\ninterpret: A F\n", 2, 12, "no arrow stands after `interpret:`; expected a production"},
        {"axiom: A\ninterpret:\n", 2, 11, "no arrow stands after `interpret:`"},
        {"axiom: A\ninterpret: -> F\n", 2, 12, "no predecessor stands before `->`"},
        {"axiom: A\ninterpret: A -> B -> F\n", 2, 14, "a production has one arrow"},
        {"axiom: A\ninterpret: A(x, x) -> F\n", 2, 17, "the parameter `x` stands twice"},
    };
    expectMistakes(cases);
}

TEST(GrammarParser, WordsOfOtherLSystemsAreTranslated)
{
    const MistakeCase cases[] = {
        {"axiom: A\nA = F\n", 2, 3, "`=` is no arrow; expected `predecessor -> successor` for a production, or `let`"},
        {"axiom: A\nA(x) : x == 1 = F\n", 2, 15, "`=` is no arrow"},
        {"axiom: A\nA => F\n", 2, 3, "`=` is no arrow"},
        {"axiom: A\nr = 0.7\n", 2, 3, "or `let` before a constant"},
        {"axiom: A\nderivation length: 5\n", 2, 1, "`derivation` begins no line here; expected `iterations: 5`"},
        {"axiom: A\nLsystem: 1\n", 2, 1, "unknown setting `Lsystem:`; expected one L-system a file"},
        {"axiom: A\nendlsystem\n", 2, 1, "`endlsystem` begins no line here"},
        {"axiom: A\nproduction:\n", 2, 1, "expected only the productions, one a line"},
        {"axiom: A\nhomomorphism\n", 2, 1, "expected `interpret:` before each production"},
        {"axiom: A\nconsider: F\n", 2, 1, "expected `ignore:`"},
        {"axiom: A\nAngle: 20\n", 2, 1, "unknown setting `Angle:`; expected `angle:`, in small letters"},
        {"axiom: A\nangle 20\n", 2, 1, "`angle` begins no line here; expected `angle:`, with a colon"},
        {"axiom: A\nmodule A(x)\n", 2, 1, "expected symbols without declaration"},
    };
    expectMistakes(cases);
}

/// It would never be seen, so the context could never match. The order of the lines does not matter.
TEST(GrammarParser, AContextCannotNameAnIgnoredSymbol)
{
    const MistakeCase cases[] = {
        {"axiom: A\nB + < A -> F\nignore: F +\n", 2, 3,
         "`+` is ignored (line 3), so no context can name it; expected a context without `+`, or `ignore:` without "
         "it"},
        {"ignore: + -\naxiom: A\nA > B(x)[-(y)] -> F\n", 3, 10, "`-` is ignored (line 1)"},
    };
    expectMistakes(cases);
    (void)parsed("ignore: + -\naxiom: A\nB < + > [C] -> -\n"); // the rewritten one may be ignored itself
    const std::string many =
        toString(errorOf("ignore: B\naxiom: A\n" + repeated("B < A > B -> F\n", 1000) + "A -> ]\n"));
    EXPECT_EQ(std::ranges::count(many, '\n'), 19);
    EXPECT_TRUE(many.starts_with("g.lsys:3:1: `B` is ignored (line 1)")) << many;
}

TEST(GrammarParser, AMistakenConstantIsReportedOnce)
{
    const Error error = errorOf("let r = 0.7 0.8\nlet q = r*2\naxiom: A(r)\nA(x) : x > q -> F(r)\nangle: q\nA -> ]\n");
    EXPECT_EQ(error.where.line, 1u);
    EXPECT_TRUE(error.advice.starts_with("1 further:\ng.lsys:6:6: `]` without")) << error.advice;
    EXPECT_TRUE(errorOf("let r 1\naxiom: A(r)\n").advice.empty());
    EXPECT_TRUE(errorOf("let r = 1/0\naxiom: A(r)\n").advice.empty());
}

TEST(GrammarParser, AConstantIsKnownBelowItsLine)
{
    const MistakeCase cases[] = {
        {"axiom: A(r)\nlet r = 1\n", 1, 10, "`r` is not known here; expected its `let`, now in line 2, above"},
        {"axiom: A\nlet r = r\n", 2, 9, "`r` is not known here; expected a constant made by `let`"},
    };
    expectMistakes(cases);
}

TEST(GrammarParser, SymbolsDeclaredBeforeAMistakeAreKnown)
{
    EXPECT_TRUE(errorOf("symbols: Trunk 1\naxiom: Trunk\nTrunk(x) -> F\n").advice.empty());
}

TEST(GrammarParser, MessagesQuoteLittleOfLongTexts)
{
    const std::string longWord(100000, 'x');
    for (const std::string& text :
         {"axiom: A(" + longWord + ")", "axiom: A\n" + longWord + ": 1", "axiom: A\norder: " + longWord,
          "symbols: " + longWord + "\naxiom: A", "let " + longWord + " = 1/0\naxiom: A",
          "axiom: A\nA(" + longWord + "," + longWord + ") -> F", "axiom: A(" + std::string(100000, '9') + ")",
          "symbols: " + std::string(200, 'a') + " " + std::string(200, 'a') + "\naxiom: A", "axiom: A\n" + longWord,
          "axiom: A\n" + longWord + " -> F"})
        EXPECT_LT(toString(errorOf(text)).size(), 400u) << text.substr(0, 40);
}

TEST(GrammarParser, ContextsStandAroundThePredecessor)
{
    const Grammar grammar = parsed("axiom: A\n  B(x) C < A(l) > C[D(y)]E : x > y -> F(l)G(x, y) : x\n"
                                   "B<A->F\nA>B:1>0->F\nB < A : * -> F\n");
    const Production& p = grammar.productions[0];
    const auto spelled = [&](const std::vector<ContextModule>& context) {
        std::string text;
        for (const ContextModule& module : context)
        {
            text += grammar.symbols.name(module.symbol);
            for (const std::string& name : module.parameters)
                text += "," + name;
            text += "@" + std::to_string(module.column) + " ";
        }
        return text;
    };
    EXPECT_EQ(spelled(p.left), "B,x@3 C@8 ");
    EXPECT_EQ(grammar.symbols.name(p.predecessor), "A");
    EXPECT_EQ(p.parameters, std::vector<std::string>{"l"});
    EXPECT_EQ(spelled(p.right), "C@19 [@20 D,y@21 ]@25 E@26 ");
    EXPECT_TRUE(p.place.line == 2 && p.place.column == 3);

    // Predecessor first, then left, then right.
    const ExpressionNode& condition = grammar.expressions[p.condition];
    EXPECT_EQ(grammar.expressions[condition.first].first, 1u);
    EXPECT_EQ(grammar.expressions[condition.second].first, 2u);
    EXPECT_EQ(grammar.expressions[grammar.arguments[p.successor[0].firstArgument]].first, 0u);
    EXPECT_EQ(grammar.expressions[p.weight].first, 1u);

    EXPECT_EQ(spelled(grammar.productions[1].left), "B@1 ");
    EXPECT_EQ(spelled(grammar.productions[2].right), "B@3 ");
    EXPECT_NE(grammar.productions[2].condition, kNoExpression);
    EXPECT_EQ(grammar.productions[3].condition, kNoExpression);
}

TEST(GrammarParser, ALoneStarWithParenthesesIsASymbolInAContext)
{
    const Grammar grammar = parsed("axiom: *\n*() < A > *(x) -> F\n*B < A > ** -> F\n");
    EXPECT_EQ(grammar.symbols.name(grammar.productions[0].left[0].symbol), "*");
    EXPECT_EQ(grammar.productions[1].right.size(), 2u);
}

TEST(GrammarParser, TheRowOfATableMayNameContexts)
{
    const Grammar grammar = parsed("axiom: A\nB(i) < A -> F(s) : ~ t(i)\n");
    EXPECT_EQ(grammar.expressions[grammar.productions[0].row].op, ExpressionOp::Parameter);
}

TEST(GrammarParser, InterpretationsAreApart)
{
    const Grammar grammar = parsed("interpret: 0 -> F\naxiom: 0\n0 -> 1[0]0\ninterpret :  A(x) : x < 1 -> F(x) : 2\n"
                                   "interpret: [ -> [+\ninterpret: ](x) -> -]]\ninterpret: \xe2\x88\x92 -> +\n");
    ASSERT_EQ(grammar.interpretations.size(), 5u);
    EXPECT_EQ(grammar.productions.size(), 1u);
    const Production& p = grammar.interpretations[1];
    EXPECT_TRUE(p.place.line == 4 && p.place.column == 14);
    EXPECT_NE(p.condition, kNoExpression);
    EXPECT_NE(p.weight, kNoExpression);
    EXPECT_EQ(symbolsOf(grammar, grammar.interpretations[2].successor), "[ + ");
    EXPECT_EQ(symbolsOf(grammar, grammar.interpretations[3].successor), "- ] ] ");
    EXPECT_EQ(grammar.interpretations[3].parameters.size(), 1u);
}

TEST(GrammarParser, EachExpressionKnowsWhereItBegins)
{
    struct Case
    {
        const char* text;
        std::uint32_t column;        ///< Of the whole argument.
        std::uint32_t first, second; ///< Of its operands; 0: none.
    };
    const Case cases[] = {
        {"axiom: A( 7)", 11, 0, 0},          {"axiom: A(1+2*3)", 10, 10, 12},  {"axiom: \xc3\xa4( 1 + 2)", 11, 11, 15},
        {"axiom: A((1+2)*(n))", 10, 11, 17}, // parentheses belong to what they are an operand of
        {"axiom: A( - 2)", 11, 13, 0},       {"axiom: A(2 ^ -n)", 10, 10, 14}, {"axiom: A(max(n, pi))", 10, 14, 17},
        {"axiom: A(1 ? 2 : 3)", 10, 10, 14},
    };
    for (const Case& c : cases)
    {
        const Grammar grammar = parsed(c.text);
        const ExpressionPool& pool = grammar.expressions;
        const ExpressionNode& node = pool[grammar.arguments[0]];
        const auto columnOf = [&](ExpressionId id) { return id == kNoExpression ? 0 : pool[id].column; };
        EXPECT_EQ(node.column, c.column) << c.text;
        EXPECT_EQ(columnOf(node.first), c.first) << c.text;
        EXPECT_EQ(columnOf(node.second), c.second) << c.text;
    }
    EXPECT_EQ(parsed("\n axiom:  A").axiomPlace.line, 2u);
    EXPECT_EQ(parsed("\n axiom:  A").axiomPlace.column, 10u);
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
    EXPECT_EQ(production.place.line, 2u);
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

    EXPECT_TRUE(defaults.ignore.empty());
    EXPECT_EQ(defaults.order, MatchOrder::ContextFirst);
    EXPECT_FALSE(defaults.tropism);
    EXPECT_FALSE(defaults.iterations);
    const Grammar contexts = parsed("let e = 0.25\nignore: +-F\norder : listed\ntropism: e (0.5-1) -e \xe2\x88\x92"
                                    "1e0\n"
                                    "iterations: 2*3\naxiom: A\n");
    EXPECT_EQ(contexts.ignore.size(), 3u);
    EXPECT_EQ(contexts.order, MatchOrder::Listed);
    EXPECT_EQ(contexts.tropism->elasticity, 0.25);
    EXPECT_EQ(contexts.tropism->direction, (std::array{-0.5, -0.25, -1.0}));
    EXPECT_EQ(contexts.iterations, 6u);
    EXPECT_EQ(parsed("order: context-first\naxiom: A\n").order, MatchOrder::ContextFirst);
    EXPECT_EQ(parsed("iterations: 1000000\naxiom: A\n").iterations, 1000000u);
    EXPECT_EQ(parsed("tropism: 0.22 0 -1 0\naxiom: A\n").tropism->direction, (std::array{0.0, -1.0, 0.0}));
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
    limits.symbols = 6; // F, G and f are there from the beginning
    limits.grammarParts = 22;
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
        {"axiom: A\nA > [[[]]] ->", "axiom: A\nA > [[[[]]]] ->", "bracketDepth", 2, 8},
        {"axiom: A\ninterpret: [ -> [[[", "axiom: A\ninterpret: [ -> [[[[", "bracketDepth", 2, 20},
        {"axiom: A\nB(x,y) < A(z,w) ->", "axiom: A\nB(x,y,z) < A ->", "parameters", 2, 7},
        {"axiom: A\nFFFFFFF < A ->", "axiom: A\nFFFFFFFF < A ->", "templateModules", 2, 8},
        {"axiom: A\nA > FFFFFFF ->", "axiom: A\nA > FFFFFFFF ->", "templateModules", 2, 12},
        {"axiom: A\nA ->\ninterpret: B ->", "axiom: A\nA ->\ninterpret: B ->\ninterpret: C ->", "productions", 4, 12},
        {"axiom: ABC", "axiom: A\nB -> CD", "symbols", 2, 7},
        {"axiom: FFFFFFF\nA -> FFFFFFF\nB -> F(1)FFFFFF", "axiom: FFFFFFF\nA -> FFFFFFF\nB -> F(1)FFFFF(1)F",
         "grammarParts", 3, 18},
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
    std::string branching = "symbols:"; // a search among these takes many steps for each letter
    for (int letters = 1; letters < 240; ++letters)
        for (int i = 0; i < 20; ++i)
            branching += " " + std::string(static_cast<std::size_t>(letters), 'x') + "y" + std::to_string(i);
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
        branching + "\naxiom: A\n" + repeated("A -> " + std::string(60000, 'x') + "\n", 10),
        "axiom: A\nA(" + repeated("x,", 1 << 19) + ") -> F",
        "axiom: A\n" + std::string(1 << 20, 'B') + " < A -> F",
        "axiom: A\nA > " + std::string(1 << 20, '[') + " -> F",
        "axiom: A\nA > " + repeated("[]", 1 << 19) + " -> F",
        "axiom: A\nA > " + repeated("B(x)", 1 << 18) + " -> F",
        "axiom: A\n" + repeated("B < ", 1 << 18) + "A -> F",
        "axiom: A\n" + std::string(1 << 20, '<'),
        "axiom: A\ninterpret: [ -> " + std::string(1 << 20, '['),
        "axiom: A\ninterpret: ] -> " + std::string(1 << 20, ']'),
        "axiom: A\n" + repeated("A < B > C -> D\n", 1 << 16),
        "axiom: A\n" + repeated("interpret: A -> B\n", 1 << 16),
        "ignore: B\naxiom: A\n" + repeated(std::string(60000, 'B') + " < A -> D\n", 16),
        "ignore: " + std::string(1 << 20, 'F') + "\naxiom: A",
        "tropism: " + repeated("1 ", 1 << 19) + "\naxiom: A",
        repeated("let ", 1 << 18),
        repeated("let a\n", 1 << 17),
    };
    for (const std::string& text : hostile)
        EXPECT_LT(secondsOf([&] { (void)parseGrammar(text, "g.lsys", {}); }), 20.0)
            << text.substr(0, 40) << ", " << text.size() << " bytes";
}

} // namespace
} // namespace espalier
