#include <Espalier/Grammar/Grammar.h>

#include <Espalier/Core/Json.h>
#include <Espalier/Core/Utf8.h>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <set>

namespace espalier {

namespace {

constexpr std::size_t kMostErrors = 20;
constexpr std::size_t kLongestSymbol = 256; ///< Code points.

constexpr std::string_view kSettings[] = {"symbols", "angle", "step", "width", "draw", "move", "axiom"};
/// Settings that only other L-systems have.
constexpr std::string_view kForeignSettings[] = {"interpret", "ignore", "order", "tropism", "iterations"};

bool isSettingName(std::string_view name)
{
    return std::ranges::find(kSettings, name) != std::end(kSettings) ||
           std::ranges::find(kForeignSettings, name) != std::end(kForeignSettings);
}

/// Thrown and caught inside this file only: a line's first mistake ends the line, not the file.
struct Mistake
{
    std::size_t column; ///< From 0.
    std::string what;
    std::string expected;
    ErrorKind kind = ErrorKind::BadInput;
};

/// Reading the Unicode minus as `-`.
std::u32string letters(std::string_view text)
{
    std::u32string all = fromUtf8(text);
    std::ranges::replace(all, U'\u2212', U'-');
    return all;
}

bool isDigit(char32_t c)
{
    return c >= '0' && c <= '9';
}

bool isNameStart(char32_t c)
{
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}

bool isName(char32_t c)
{
    return isNameStart(c) || isDigit(c) || c == '_';
}

bool isSpace(char32_t c)
{
    return c == ' ' || c == '\t' || c == '\r';
}

std::size_t arrowLength(std::u32string_view text)
{
    return text.starts_with(U"-->") ? 3 : text.starts_with(U"->") ? 2 : text.starts_with(U"→") ? 1 : 0;
}

/// The declared symbols in alphabetic order, so that a search narrows a range letter by letter.
class LongSymbols
{
public:
    void set(std::vector<std::u32string> names)
    {
        names_ = std::move(names);
        std::ranges::sort(names_);
    }

    /// Length of the longest one that `text` begins with; 0 if there is none.
    [[nodiscard]] std::size_t match(std::u32string_view text) const
    {
        std::size_t longest = 0;
        auto first = names_.begin();
        auto last = names_.end();
        for (std::size_t length = 0; first != last; ++length)
        {
            if (first->size() == length) // the shortest of those with the same beginning comes first
            {
                longest = length;
                ++first;
            }
            if (length == text.size())
                break;
            const auto letter = [&](const std::u32string& name) { return name[length]; };
            first = std::ranges::lower_bound(first, last, text[length], {}, letter);
            last = std::ranges::upper_bound(first, last, text[length], {}, letter);
        }
        return longest;
    }

private:
    std::vector<std::u32string> names_;
};

/// Where in the grammar each constant stands.
using ConstantIndex = std::map<std::string, std::uint32_t, std::less<>>;

/// Reads one line, or a part of it that ends at `end`.
class LineParser
{
public:
    LineParser(Grammar& grammar, const LongSymbols& longSymbols, const ConstantIndex& constants, const Limits& limits,
               std::u32string_view line, std::size_t begin, std::size_t end)
        : grammar_(grammar), longSymbols_(longSymbols), constants_(constants), limits_(limits), line_(line),
          position_(begin), end_(end), firstExpression_(grammar.expressions.size())
    {}

    const Production* scope = nullptr; ///< Whose parameters expressions may name.
    bool transforms = false;           ///< May they name s, r, b, o?

    [[nodiscard]] std::size_t position() const { return position_; }

    void skipSpace()
    {
        while (position_ < end_ && isSpace(line_[position_]))
            ++position_;
    }

    [[nodiscard]] bool atEnd()
    {
        skipSpace();
        return position_ >= end_;
    }

    [[nodiscard]] char32_t peek(std::size_t ahead = 0) const
    {
        return position_ + ahead < end_ ? line_[position_ + ahead] : U'\0';
    }

    [[nodiscard]] bool take(std::u32string_view text)
    {
        skipSpace();
        if (line_.substr(position_, std::min(text.size(), end_ - position_)) != text)
            return false;
        position_ += text.size();
        return true;
    }

    [[noreturn]] void fail(std::string what, std::string expected = {}, ErrorKind kind = ErrorKind::BadInput) const
    {
        throw Mistake{position_, std::move(what), std::move(expected), kind};
    }

    /// What stands here, quoted, for messages.
    [[nodiscard]] std::string here() const
    {
        if (position_ < line_.size())
        {
            const std::size_t length =
                position_ < end_ ? 0 : arrowLength(line_.substr(position_)); // what ends this part
            return "`" + toUtf8(line_.substr(position_, std::max<std::size_t>(length, 1))) + "`";
        }
        return "the end of the line";
    }

    void expectEnd(std::string_view after)
    {
        if (!atEnd())
            fail("unexpected " + here() + " after " + std::string(after), "the end of the line");
    }

    [[nodiscard]] std::string name(std::string_view role)
    {
        skipSpace();
        if (!isNameStart(peek()))
            fail("unexpected " + here(), "the name of " + std::string(role));
        const std::size_t start = position_;
        while (isName(peek()))
            ++position_;
        return toUtf8(line_.substr(start, position_ - start));
    }

    /// A symbol: a declared one, longest first, or a single character.
    [[nodiscard]] SymbolId symbol()
    {
        skipSpace();
        std::size_t length = longSymbols_.match(line_.substr(position_, end_ - position_));
        if (length == 0)
        {
            if (std::u32string_view(U"(),:<>#_ε→").find(peek()) != std::u32string_view::npos || peek() < 0x20)
                fail(here() + " cannot be a symbol", "a symbol such as A, F or [");
            length = 1;
        }
        position_ += length;
        return grammar_.symbols.intern(toUtf8(line_.substr(position_ - length, length)));
    }

    /// Modules up to the end; `_`, `ε` or nothing is the empty word. Brackets must balance.
    [[nodiscard]] std::vector<Module> word(std::string_view role)
    {
        std::vector<Module> modules;
        std::vector<std::size_t> open;
        if (take(U"_") || take(U"ε"))
        {
            if (!atEnd())
                fail("unexpected " + here() + " after the empty word", "nothing else in an empty " + std::string(role));
            return modules;
        }
        while (!atEnd())
        {
            const std::size_t start = position_;
            if (modules.size() >= limits_.templateModules)
                fail("more than " + std::to_string(limits_.templateModules) + " modules in one " + std::string(role),
                     "at most the limit templateModules", ErrorKind::Limit);
            const SymbolId id = symbol();
            const std::vector<ExpressionId> arguments = moduleArguments();
            modules.push_back({id, static_cast<std::uint32_t>(grammar_.arguments.size()),
                               static_cast<std::uint32_t>(arguments.size())});
            grammar_.arguments.insert(grammar_.arguments.end(), arguments.begin(), arguments.end());

            const std::string& text = grammar_.symbols.name(id);
            if (text == "[")
            {
                open.push_back(start);
                if (open.size() <= limits_.bracketDepth)
                    continue;
                position_ = start;
                fail("brackets nest deeper than " + std::to_string(limits_.bracketDepth),
                     "at most the limit bracketDepth", ErrorKind::Limit);
            }
            else if (text == "]")
            {
                if (open.empty())
                {
                    position_ = start;
                    fail("`]` without `[` in the " + std::string(role), "balanced brackets");
                }
                open.pop_back();
            }
        }
        if (!open.empty())
        {
            position_ = open.back();
            fail("`[` is never closed in the " + std::string(role), "balanced brackets");
        }
        return modules;
    }

    [[nodiscard]] std::vector<ExpressionId> moduleArguments()
    {
        std::vector<ExpressionId> arguments;
        if (!take(U"("))
            return arguments;
        if (take(U")"))
            return arguments;
        do
        {
            if (arguments.size() >= limits_.parameters)
                fail("more than " + std::to_string(limits_.parameters) + " parameters", "at most the limit parameters",
                     ErrorKind::Limit);
            arguments.push_back(expression());
        } while (take(U","));
        if (!take(U")"))
            fail("unexpected " + here() + " in a parameter list", "`,` or `)`");
        return arguments;
    }

    [[nodiscard]] ExpressionId expression() { return choice(); }

    /// An expression of constants alone, evaluated now: the value of a setting.
    [[nodiscard]] double number(const std::vector<double>& constants, double low, double high)
    {
        skipSpace();
        const std::size_t start = position_;
        const ExpressionId id = expression();
        ExpressionScope values;
        values.constants = constants.data();
        const double value = evaluate(grammar_.expressions, id, values);
        if (values.failed || !(value >= low && value <= high))
        {
            position_ = start;
            fail(values.failed ? "the value is not finite" : "the value " + formatNumber(value) + " is out of range",
                 "a number from " + formatNumber(low) + " to " + formatNumber(high));
        }
        return value;
    }

private:
    [[noreturn]] void tooDeep() const
    {
        fail("the expression nests deeper than " + std::to_string(limits_.expressionDepth),
             "at most the limit expressionDepth", ErrorKind::Limit);
    }

    /// Reading recurses; what it reads is never higher than this.
    struct Deeper
    {
        explicit Deeper(LineParser& p) : parser(p)
        {
            if (parser.depth_ >= parser.limits_.expressionDepth)
                parser.tooDeep();
            ++parser.depth_;
        }
        ~Deeper() { --parser.depth_; }
        LineParser& parser;
    };

    ExpressionId leaf(const ExpressionNode& node)
    {
        heights_.push_back(1);
        return grammar_.expressions.add(node);
    }

    /// A node over its arguments, read from column `at` on. Evaluation recurses as deep as the tree is high, and a long
    /// sum is a high tree too.
    ExpressionId node(std::size_t at, ExpressionOp op, ExpressionId a, ExpressionId b = kNoExpression,
                      ExpressionId c = kNoExpression)
    {
        std::uint32_t height = 0;
        for (const ExpressionId id : {a, b, c})
            height = std::max(height, id == kNoExpression ? 0 : heights_[id - firstExpression_]);
        if (height >= limits_.expressionDepth)
        {
            position_ = at;
            tooDeep();
        }
        heights_.push_back(height + 1);
        return grammar_.expressions.add({op, a, b, c, 0});
    }

    ExpressionId choice()
    {
        const Deeper deeper(*this);
        const ExpressionId condition = chain(0);
        skipSpace();
        const std::size_t at = position_;
        if (!take(U"?"))
            return condition;
        const ExpressionId yes = choice();
        if (!take(U":"))
            fail("unexpected " + here() + " after `?`", "`:` and the other value");
        const ExpressionId no = choice();
        return node(at, ExpressionOp::Choose, condition, yes, no);
    }

    struct Operator
    {
        std::u32string_view text;
        ExpressionOp op;
    };

    /// Binary operators of one level, longest spelling first, and the levels in order of binding.
    static std::span<const Operator> level(std::size_t index)
    {
        using enum ExpressionOp;
        static constexpr Operator kOr[] = {{U"||", Or}};
        static constexpr Operator kAnd[] = {{U"&&", And}};
        static constexpr Operator kEqual[] = {{U"==", Equal}, {U"!=", NotEqual}};
        static constexpr Operator kLess[] = {{U"<=", LessEqual}, {U">=", GreaterEqual}, {U"<", Less}, {U">", Greater}};
        static constexpr Operator kSum[] = {{U"+", Add}, {U"-", Subtract}};
        static constexpr Operator kProduct[] = {{U"*", Multiply}, {U"/", Divide}, {U"%", Modulo}};
        static constexpr std::span<const Operator> kLevels[] = {kOr, kAnd, kEqual, kLess, kSum, kProduct};
        return kLevels[index];
    }
    static constexpr std::size_t kLevels = 6;

    ExpressionId chain(std::size_t index)
    {
        if (index == kLevels)
            return unary();
        ExpressionId left = chain(index + 1);
        for (;;)
        {
            skipSpace();
            const std::size_t at = position_;
            const auto operators = level(index);
            const auto found = std::ranges::find_if(operators, [&](const Operator& o) { return take(o.text); });
            if (found == operators.end())
            {
                if (index == 2 && peek() == '=')
                    fail("`=` does not compare", "`==`");
                if (index == 0 && (peek() == '&' || peek() == '|'))
                    fail("unexpected " + here(), "`&&` or `||`");
                return left;
            }
            left = node(at, found->op, left, chain(index + 1));
        }
    }

    ExpressionId unary()
    {
        skipSpace();
        const std::size_t start = position_;
        if (take(U"-"))
            return node(start, ExpressionOp::Negate, operand());
        if (take(U"+"))
            return node(start, ExpressionOp::Plus, operand());
        if (peek() == '!' && peek(1) != '=' && take(U"!"))
            return node(start, ExpressionOp::Not, operand());
        const ExpressionId base = primary();
        skipSpace();
        const std::size_t at = position_;
        if (!take(U"^"))
            return base;
        return node(at, ExpressionOp::Power, base, operand());
    }

    ExpressionId operand()
    {
        const Deeper deeper(*this);
        return unary();
    }

    ExpressionId primary()
    {
        skipSpace();
        if (take(U"("))
        {
            const ExpressionId inner = choice();
            if (!take(U")"))
                fail("unexpected " + here(), "`)`");
            return inner;
        }
        if (isDigit(peek()) || (peek() == '.' && isDigit(peek(1))))
            return numeral();
        if (isNameStart(peek()))
            return reference();
        fail("unexpected " + here() + " in an expression", "a number, a name or `(`");
    }

    ExpressionId numeral()
    {
        const std::size_t start = position_;
        std::string text;
        const auto digits = [&] {
            while (isDigit(peek()))
                text += static_cast<char>(line_[position_++]);
        };
        digits();
        if (peek() == '.')
        {
            text += '.';
            ++position_;
            digits();
        }
        const std::size_t sign = peek(1) == '+' || peek(1) == '-' ? 2 : 1;
        if ((peek() == 'e' || peek() == 'E') && isDigit(peek(sign)))
        {
            text += 'e';
            if (sign == 2)
                text += static_cast<char>(peek(1));
            position_ += sign;
            digits();
        }
        double value = 0;
        const auto read = std::from_chars(text.data(), text.data() + text.size(), value);
        if (read.ec != std::errc{} || read.ptr != text.data() + text.size() || !std::isfinite(value))
        {
            position_ = start;
            fail("no double holds the number " + text.substr(0, 40), "0, or a number from 5e-324 to 1.8e308");
        }
        return leaf({.value = value});
    }

    ExpressionId reference()
    {
        const std::size_t start = position_;
        const std::string text = name("a value");
        if (scope)
            if (const auto found = std::ranges::find(scope->parameters, text); found != scope->parameters.end())
                return leaf({ExpressionOp::Parameter, static_cast<std::uint32_t>(found - scope->parameters.begin())});
        constexpr std::string_view kTransform = "srbo";
        if (transforms && text.size() == 1 && kTransform.find(text[0]) != std::string_view::npos)
            return leaf({ExpressionOp::Transform, static_cast<std::uint32_t>(kTransform.find(text[0]))});
        if (const auto found = constants_.find(text); found != constants_.end())
            return leaf({ExpressionOp::Constant, found->second});
        if (text == "n")
            return leaf({ExpressionOp::Step});
        if (text == "pi")
            return leaf({ExpressionOp::Pi});
        const auto functions = expressionFunctions();
        const auto function = std::ranges::find(functions, text, &ExpressionFunction::name);
        if (function == functions.end())
        {
            position_ = start;
            fail("`" + text + "` is not known here",
                 "a parameter of the predecessor, a constant made by `let`, or a function such as sin");
        }
        if (!take(U"("))
            fail("the function " + text + " has no arguments", "`(` after " + text);
        const ExpressionId first = choice();
        ExpressionId second = kNoExpression;
        if (function->arguments == 2)
        {
            if (!take(U","))
                fail("the function " + text + " takes 2 arguments", "`,` and the second one");
            second = choice();
        }
        if (!take(U")"))
            fail("unexpected " + here() + " after the argument of " + text, "`)`");
        return node(start, function->op, first, second);
    }

    Grammar& grammar_;
    const LongSymbols& longSymbols_;
    const ConstantIndex& constants_;
    const Limits& limits_;
    std::u32string_view line_;
    std::size_t position_;
    std::size_t end_;
    std::uint32_t depth_ = 0;
    ExpressionId firstExpression_;
    std::vector<std::uint32_t> heights_; ///< Of the expressions from firstExpression_ on.
};

/// The file: collects mistakes line by line.
class FileParser
{
public:
    FileParser(const Limits& limits, const GrammarPlace& place) : limits_(limits), place_(place) {}

    Expected<Grammar> parse(std::string_view text)
    {
        eachLine(text, [&](std::u32string_view line, std::u32string_view) { declareSymbols(line); });
        eachLine(text, [&](std::u32string_view line, std::u32string_view comment) { statement(line, comment); });
        std::ranges::stable_sort(errors_, {}, [](const Error& error) { return error.where.line; });
        if (errors_.empty() && !axiomSeen_)
            errors_.push_back(
                {ErrorKind::BadInput, "the grammar has no axiom", "a line such as `axiom: A`", {}, place_(1, 1)});
        if (errors_.empty())
            return std::move(grammar_);
        return tl::make_unexpected(summary());
    }

private:
    /// Calls `function` with what stands before and from the `#` of each line.
    template <class Function>
    void eachLine(std::string_view text, Function&& function)
    {
        lineNumber_ = 0;
        for (std::size_t start = 0; start <= text.size() && errors_.size() < kMostErrors;)
        {
            const std::size_t end = std::min(text.find('\n', start), text.size());
            const std::u32string decoded = letters(text.substr(start, end - start));
            start = end + 1;
            ++lineNumber_;
            const std::u32string_view whole = decoded;
            const std::size_t comment = std::min(whole.find(U'#'), whole.size());
            try
            {
                function(whole.substr(0, comment), whole.substr(comment));
            }
            catch (const Mistake& mistake)
            {
                errors_.push_back(
                    {mistake.kind,
                     mistake.what,
                     mistake.expected,
                     {},
                     place_(static_cast<std::uint32_t>(lineNumber_), static_cast<std::uint32_t>(mistake.column + 1))});
            }
        }
    }

    Error summary() const
    {
        Error first = errors_.front();
        if (errors_.size() > 1)
        {
            first.advice =
                std::to_string(errors_.size() - 1) + (errors_.size() == kMostErrors ? " or more" : "") + " further:";
            for (std::size_t i = 1; i < errors_.size(); ++i)
                first.advice += "\n" + toString(errors_[i]);
        }
        return first;
    }

    LineParser parserOf(std::u32string_view line, std::size_t begin, std::size_t end)
    {
        return {grammar_, longSymbols_, constantIndex_, limits_, line, begin, end};
    }

    void declareSymbols(std::u32string_view line)
    {
        LineParser parser = parserOf(line, 0, line.size());
        if (!parser.take(U"symbols:"))
            return;
        if (!settings_.insert("symbols").second)
            throw Mistake{parser.position() - 8, "the setting `symbols:` stands twice", "each setting once"};
        std::vector<std::u32string> names;
        std::set<std::string> known;
        while (!parser.atEnd())
        {
            const std::size_t column = parser.position();
            std::string name = parser.name("a symbol");
            if (name == "let" || isSettingName(name))
                throw Mistake{column, "`" + name + "` cannot be a symbol, for it begins lines of its own",
                              "another name"};
            if (name.size() > kLongestSymbol)
                throw Mistake{column, "the symbol has " + std::to_string(name.size()) + " characters",
                              "at most " + std::to_string(kLongestSymbol), ErrorKind::Limit};
            if (!known.insert(name).second)
                throw Mistake{column, "the symbol `" + name + "` is declared twice", "each symbol once"};
            if (grammar_.longSymbols.size() >= limits_.longSymbols)
                throw Mistake{column, "more than " + std::to_string(limits_.longSymbols) + " declared symbols",
                              "at most the limit longSymbols", ErrorKind::Limit};
            names.push_back(letters(name));
            grammar_.longSymbols.push_back(std::move(name));
        }
        longSymbols_.set(std::move(names));
    }

    void statement(std::u32string_view line, std::u32string_view comment)
    {
        LineParser parser = parserOf(line, 0, line.size());
        if (parser.atEnd())
            return refuseDirective(comment, line.size());
        const std::size_t start = parser.position();
        if (line.substr(start).starts_with(U"let") && start + 3 < line.size() && isSpace(line[start + 3]))
        {
            (void)parser.take(U"let");
            return constant(parser);
        }
        if (const std::size_t colon = settingColon(line, start); colon != std::u32string_view::npos)
            return setting(toUtf8(line.substr(start, colon - start)), start, line, colon + 1);
        production(line, start);
    }

    static void refuseDirective(std::u32string_view comment, std::size_t column)
    {
        for (const std::u32string_view directive : {U"#define", U"#include"})
            if (comment.starts_with(directive) &&
                (comment.size() == directive.size() || !isName(comment[directive.size()])))
                throw Mistake{column, "`" + toUtf8(directive) + "` is the preprocessor's, which is not used here",
                              "`let name = value` for a constant, and one file a grammar"};
    }

    void constant(LineParser& parser)
    {
        parser.skipSpace();
        const std::size_t column = parser.position();
        const std::string name = parser.name("a constant");
        if (grammar_.constants.size() >= limits_.constants)
            throw Mistake{column, "more than " + std::to_string(limits_.constants) + " constants",
                          "at most the limit constants", ErrorKind::Limit};
        if (constantIndex_.contains(name))
            throw Mistake{column, "the constant `" + name + "` is defined twice", "each name once"};
        if (name == "n" || name == "pi" ||
            std::ranges::find(expressionFunctions(), name, &ExpressionFunction::name) != expressionFunctions().end())
            throw Mistake{column, "`" + name + "` is built in", "another name for the constant"};
        if (!parser.take(U"="))
            parser.fail("unexpected " + parser.here() + " after the constant's name", "`=`");
        const ExpressionId id = parser.expression();
        parser.expectEnd("the constant's value");
        ExpressionScope scope;
        scope.constants = constants_.data();
        constants_.push_back(evaluate(grammar_.expressions, id, scope));
        if (scope.failed)
            throw Mistake{column, "the constant `" + name + "` has no finite value", "a number"};
        constantIndex_.emplace(name, static_cast<std::uint32_t>(grammar_.constants.size()));
        grammar_.constants.push_back({name, id});
    }

    /// The colon of `word:` at the start of the line, or npos where that is not a setting but a production's.
    [[nodiscard]] std::size_t settingColon(std::u32string_view line, std::size_t start) const
    {
        std::size_t end = start;
        while (end < line.size() && isNameStart(line[end]))
            ++end;
        const bool isSetting = end - start >= 2 && end < line.size() && line[end] == ':';
        const bool isSymbol = longSymbols_.match(line.substr(start, end - start)) == end - start;
        return isSetting && !isSymbol ? end : std::u32string_view::npos;
    }

    void setting(const std::string& name, std::size_t start, std::u32string_view line, std::size_t valueStart)
    {
        if (name == "symbols")
            return; // read before everything else
        LineParser parser = parserOf(line, valueStart, line.size());
        if (std::ranges::find(kForeignSettings, name) != std::end(kForeignSettings))
            throw Mistake{
                start, "`" + name + ":` is not part of a species' grammar",
                "a context-free grammar: symbols, let, angle, step, width, draw, move, axiom and productions"};
        if (!settings_.insert(name).second)
            throw Mistake{start, "the setting `" + name + ":` stands twice", "each setting once"};
        if (name == "angle")
            grammar_.angle = parser.number(constants_, -limits_.angleDegrees, limits_.angleDegrees);
        else if (name == "step")
            grammar_.step = parser.number(constants_, 0, limits_.coordinate);
        else if (name == "width")
            grammar_.width = parser.number(constants_, 0, limits_.coordinate);
        else if (name == "draw")
            grammar_.draw = symbolList(parser);
        else if (name == "move")
            grammar_.move = symbolList(parser);
        else if (name == "axiom")
        {
            grammar_.axiom = parser.word("axiom");
            axiomSeen_ = true;
        }
        else
            throw Mistake{start, "unknown setting `" + name + ":`",
                          "one of symbols, angle, step, width, draw, move, axiom"};
        parser.expectEnd("the setting");
    }

    static std::vector<SymbolId> symbolList(LineParser& parser)
    {
        std::vector<SymbolId> ids;
        while (!parser.atEnd())
            ids.push_back(parser.symbol());
        return ids;
    }

    struct Arrow
    {
        std::size_t begin;
        std::size_t end;
    };

    /// The last `->`, `-->` or `→` outside parentheses.
    static Arrow arrowOf(std::u32string_view line, std::size_t start)
    {
        Arrow arrow{std::u32string_view::npos, 0};
        int depth = 0;
        std::size_t open = 0;
        for (std::size_t i = start; i < line.size(); ++i)
        {
            if (line[i] == '(' && depth++ == 0)
                open = i;
            depth -= line[i] == ')' ? 1 : 0;
            const std::size_t length = arrowLength(line.substr(i));
            if (depth > 0 || length == 0)
                continue;
            arrow = {i, i + length};
            i += length - 1;
        }
        if (arrow.begin == std::u32string_view::npos && depth > 0)
            throw Mistake{open, "`(` is never closed", "`)`, then an arrow such as `->`"};
        if (arrow.begin == std::u32string_view::npos)
            throw Mistake{start, "this line is neither a setting, a `let` nor a production",
                          "`predecessor -> successor`"};
        return arrow;
    }

    static std::size_t colonOf(std::u32string_view line, std::size_t begin, std::size_t end)
    {
        int depth = 0;
        for (std::size_t i = begin; i < end; ++i)
        {
            depth += line[i] == '(' ? 1 : line[i] == ')' ? -1 : 0;
            if (line[i] == ':' && depth == 0)
                return i;
        }
        return end;
    }

    void production(std::u32string_view line, std::size_t start)
    {
        if (grammar_.productions.size() >= limits_.productions)
            throw Mistake{start, "more than " + std::to_string(limits_.productions) + " productions",
                          "at most the limit productions", ErrorKind::Limit};
        const Arrow arrow = arrowOf(line, start);
        Production result;
        result.line = static_cast<std::uint32_t>(lineNumber_);

        const std::size_t leftColon = colonOf(line, start, arrow.begin);
        predecessor(line, start, leftColon, result);
        if (leftColon < arrow.begin)
        {
            LineParser parser = parserOf(line, leftColon + 1, arrow.begin);
            parser.scope = &result;
            if (!parser.take(U"*"))
                result.condition = parser.expression();
            parser.expectEnd("the condition");
        }

        const std::size_t rightColon = colonOf(line, arrow.end, line.size());
        if (rightColon < line.size())
            weightAndTable(line, rightColon + 1, result);

        LineParser successor = parserOf(line, arrow.end, rightColon);
        successor.scope = &result;
        successor.transforms = !result.table.empty();
        result.successor = successor.word("successor");
        grammar_.productions.push_back(std::move(result));
    }

    void predecessor(std::u32string_view line, std::size_t begin, std::size_t end, Production& result)
    {
        for (std::size_t i = begin, depth = 0; i < end; ++i)
        {
            depth += line[i] == '(' ? 1u : 0u;
            depth -= line[i] == ')' && depth > 0 ? 1u : 0u;
            if (depth == 0 && arrowLength(line.substr(i, end - i)) > 0)
                throw Mistake{i, "a production has one arrow", "`predecessor -> successor`"};
            if (depth == 0 && (line[i] == '<' || line[i] == '>'))
                throw Mistake{i, "contexts are not part of a species' grammar", "a predecessor without context"};
        }
        LineParser parser = parserOf(line, begin, end);
        result.predecessor = parser.symbol();
        if (const std::string& name = grammar_.symbols.name(result.predecessor); name == "[" || name == "]")
            throw Mistake{begin, "`" + name + "` cannot be rewritten, for brackets must balance",
                          "another predecessor"};
        if (parser.take(U"(") && !parser.take(U")"))
        {
            do
            {
                parser.skipSpace();
                const std::size_t column = parser.position();
                std::string name = parser.name("a parameter");
                if (std::ranges::find(result.parameters, name) != result.parameters.end())
                    throw Mistake{column, "the parameter `" + name + "` stands twice", "different names"};
                if (result.parameters.size() >= limits_.parameters)
                    throw Mistake{column, "more than " + std::to_string(limits_.parameters) + " parameters",
                                  "at most the limit parameters", ErrorKind::Limit};
                result.parameters.push_back(std::move(name));
            } while (parser.take(U","));
            if (!parser.take(U")"))
                parser.fail("unexpected " + parser.here() + " in the parameters", "`,` or `)`");
        }
        parser.expectEnd("the predecessor (it is exactly one symbol)");
    }

    void weightAndTable(std::u32string_view line, std::size_t begin, Production& result)
    {
        LineParser parser = parserOf(line, begin, line.size());
        parser.scope = &result;
        parser.skipSpace();
        if (parser.peek() != '~')
        {
            result.weight = parser.expression();
            if (parser.atEnd())
                return;
            if (!parser.take(U":"))
                parser.fail("unexpected " + parser.here() + " after the weight", "`: ~ table` or the end of the line");
        }
        if (!parser.take(U"~"))
            parser.fail("unexpected " + parser.here(), "`~` and the name of a table");
        parser.skipSpace();
        result.table = parser.name("a table");
        if (parser.take(U"("))
        {
            result.row = parser.expression();
            if (!parser.take(U")"))
                parser.fail("unexpected " + parser.here() + " after the table's row", "`)`");
        }
        parser.expectEnd("the table");
    }

    const Limits& limits_;
    const GrammarPlace& place_;
    Grammar grammar_;
    LongSymbols longSymbols_;
    std::size_t lineNumber_ = 0;
    std::vector<double> constants_;
    ConstantIndex constantIndex_;
    std::set<std::string> settings_;
    bool axiomSeen_ = false;
    std::vector<Error> errors_;
};

} // namespace

Expected<Grammar> parseGrammar(std::string_view text, std::string_view file, const Limits& limits,
                               const GrammarPlace& place)
{
    if (text.size() > limits.fileBytes)
        return failure(ErrorKind::Limit, {std::string(file), 1, 1},
                       "the grammar has " + std::to_string(text.size()) + " bytes",
                       "at most " + std::to_string(limits.fileBytes) + " (the limit fileBytes)");
    if (const std::size_t invalid = findInvalidUtf8(text); invalid != std::string_view::npos)
        return failure(ErrorKind::BadInput, locate(file, text, invalid), "the text is not valid UTF-8",
                       "a file saved as UTF-8");
    const GrammarPlace inThisFile = [&](std::uint32_t line, std::uint32_t column) {
        return Location{std::string(file), line, column};
    };
    return FileParser(limits, place ? place : inThisFile).parse(text);
}

} // namespace espalier
