#pragma once

#include <Espalier/Grammar/Grammar.h>
#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace espalier {

/// What a mistake means for what comes after it.
enum class AfterMistake : std::uint8_t
{
    NextLine,  ///< It ends its line; reading goes on below.
    EndOfText, ///< It ends the reading: every further line would only repeat it.
    Nothing,   ///< It follows from one that is reported already, and is kept quiet.
};

/// A line's first mistake. Thrown while a line is read and caught where lines are counted, never outside parseGrammar.
struct GrammarMistake
{
    std::size_t column; ///< From 0, in code points.
    std::string what;
    std::string expected;
    ErrorKind kind = ErrorKind::BadInput;
    AfterMistake after = AfterMistake::NextLine;
};

/// The code points of a line; the Unicode minus reads as `-`.
[[nodiscard]] std::u32string lettersOf(std::string_view line);

/// A person's text in a message: between backquotes, and not too long.
[[nodiscard]] std::string quoted(std::string_view text);
[[nodiscard]] std::string quoted(std::u32string_view text);

[[nodiscard]] bool startsName(char32_t c);
[[nodiscard]] bool continuesName(char32_t c);
[[nodiscard]] bool isBlank(char32_t c);

/// Length of the arrow that `text` begins with; 0 if there is none.
[[nodiscard]] std::size_t arrowLength(std::u32string_view text);

/// The declared symbols in alphabetic order, so that a search narrows a range letter by letter.
class LongSymbols
{
public:
    void set(std::vector<std::u32string> names);

    struct Match
    {
        std::size_t length = 0; ///< Of the longest one that the text begins with; 0 if there is none.
        std::size_t steps = 0;  ///< Comparisons that the search took.
    };
    [[nodiscard]] Match match(std::u32string_view text) const;

private:
    std::vector<std::u32string> names_;
};

/// What the parameters of one production are called, and by what number expressions refer to them.
class ParameterNames
{
public:
    /// Names in reading order. Their numbers are given by `number`.
    void add(std::string_view name, std::uint32_t number, std::size_t column);
    /// To be called when all are known. The column of the first name that stands a second time, or npos.
    [[nodiscard]] std::size_t settle();
    /// The number of `name`, or kNoExpression.
    [[nodiscard]] std::uint32_t find(std::string_view name) const;

private:
    struct Entry
    {
        std::string_view name;
        std::uint32_t number;
        std::size_t column;
    };
    std::vector<Entry> entries_;
};

/// What the lines of one text share while it is read.
struct GrammarReading
{
    const Limits& limits;
    const GrammarPlace& place;
    std::uint32_t line = 0; ///< The one being read, from 1.
    Grammar grammar{};
    LongSymbols longSymbols{};
    std::map<std::string, std::uint32_t, std::less<>> constants{}; ///< Where in the grammar each one stands.
    std::vector<double> constantValues{};
    /// Names of `let` lines that have a mistake: whoever uses them makes no second one.
    std::set<std::string, std::less<>> brokenConstants{};
    std::map<std::string, std::uint32_t, std::less<>> constantLines{}; ///< Where each name's `let` stands, read or not.
    std::size_t parts = 0;                                             ///< Counted against Limits::grammarParts.
};

/// A word's brackets.
enum class Brackets : std::uint8_t
{
    Balance,
    Any, ///< Successors of `interpret: [` and `interpret: ]`.
};

enum class ContextSide : std::uint8_t
{
    Left,
    Right,
};

/// Reads one line, or the part of it from `begin` to `end`.
class LineParser
{
public:
    LineParser(GrammarReading& reading, std::u32string_view line, std::size_t begin, std::size_t end)
        : reading_(reading), line_(line), position_(begin), end_(end),
          firstExpression_(reading.grammar.expressions.size())
    {}

    const ParameterNames* scope = nullptr; ///< What expressions may name, apart from constants.
    bool transforms = false;               ///< May they name s, r, b, o?

    [[nodiscard]] std::size_t position() const { return position_; }
    void skipBlanks();
    [[nodiscard]] bool atEnd();
    [[nodiscard]] char32_t peek(std::size_t ahead = 0) const;
    [[nodiscard]] bool take(std::u32string_view text);
    /// What stands here, quoted, for messages.
    [[nodiscard]] std::string here() const;
    [[nodiscard]] std::string hereWord() const; ///< As far as the next blank.
    [[noreturn]] void fail(std::string what, std::string expected = {}) const;
    void expectEnd(std::string_view after, std::string_view expected = "the end of the line");

    [[nodiscard]] std::string name(std::string_view role);

    /// A symbol: a declared one, longest first, or a single character.
    [[nodiscard]] SymbolId symbol();
    /// One of the symbols of a setting.
    [[nodiscard]] SymbolId listedSymbol();
    /// Modules up to the end; `_`, `ε` or nothing is the empty word.
    [[nodiscard]] std::vector<Module> word(std::string_view role, Brackets brackets = Brackets::Balance);
    /// Formal modules up to the end, at least one.
    [[nodiscard]] std::vector<ContextModule> context(ContextSide side, std::vector<std::size_t>& columns);
    /// `(a, b)`, `()` or nothing. The columns of the names are appended.
    [[nodiscard]] std::vector<std::string> formalParameters(std::vector<std::size_t>& columns);

    [[nodiscard]] ExpressionId expression() { return choice(); }
    /// An expression of constants alone, evaluated now: the value of a setting.
    [[nodiscard]] double number(double low, double high);
    /// One of several numbers that blanks separate: a signed number or name, a call, or an expression in parentheses.
    [[nodiscard]] double listedNumber(double low, double high);

private:
    struct Deeper;
    struct Operator;

    [[noreturn]] void failLimit(std::string what, std::string_view limit,
                                AfterMistake after = AfterMistake::NextLine) const;
    void count(std::size_t parts);
    void countModule(std::size_t before, std::string_view role);
    void bracket(const std::string& text, std::size_t start, std::vector<std::size_t>& open, std::string_view role,
                 Brackets brackets);
    void expectClosed(const std::vector<std::size_t>& open, std::string_view role);
    [[nodiscard]] std::vector<ExpressionId> moduleArguments();
    [[nodiscard]] double valueOf(ExpressionId id, std::size_t start, double low, double high);

    [[noreturn]] void tooDeep() const;
    ExpressionId leaf(std::size_t start, const ExpressionNode& node);
    ExpressionId node(std::size_t start, std::size_t at, ExpressionOp op, ExpressionId a,
                      ExpressionId b = kNoExpression, ExpressionId c = kNoExpression);
    ExpressionId choice();
    ExpressionId chain(std::size_t level);
    ExpressionId unary();
    ExpressionId operand();
    ExpressionId primary();
    ExpressionId numeral();
    ExpressionId reference();
    ExpressionId call(const ExpressionFunction& function, std::size_t start);
    [[noreturn]] void failUnknown(const std::string& name, std::size_t start);

    GrammarReading& reading_;
    std::u32string_view line_;
    std::size_t position_;
    std::size_t end_;
    std::uint32_t depth_ = 0;
    ExpressionId firstExpression_;
    std::vector<std::uint32_t> heights_; ///< Of the expressions from firstExpression_ on.
};

} // namespace espalier
