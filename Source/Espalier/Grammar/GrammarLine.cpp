#include <Espalier/Grammar/GrammarLine.h>

#include <Espalier/Core/Hash.h>
#include <Espalier/Core/Json.h>
#include <Espalier/Core/Utf8.h>
#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <tuple>

namespace espalier {

namespace {

/// Searching among thousands of long symbols is work that counts.
constexpr std::size_t kStepsPerPart = 32;

bool isDigit(char32_t c)
{
    return c >= '0' && c <= '9';
}

/// A bound as people write it: 1000000, not 1e+06.
std::string plain(double value)
{
    const bool whole = value == std::floor(value) && std::abs(value) < 1e15;
    return whole ? std::to_string(static_cast<std::int64_t>(value)) : formatNumber(value);
}

std::string_view nameOf(ContextSide side)
{
    return side == ContextSide::Left ? "left context" : "right context";
}

} // namespace

std::u32string lettersOf(std::string_view line)
{
    std::u32string all = fromUtf8(line);
    std::ranges::replace(all, U'\u2212', U'-');
    return all;
}

std::string quoted(std::string_view text)
{
    return "`" + shortened(text) + "`";
}

std::string quoted(std::u32string_view text)
{
    return quoted(toUtf8(text.substr(0, 64))); // more than is shown
}

bool startsName(char32_t c)
{
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}

bool continuesName(char32_t c)
{
    return startsName(c) || isDigit(c) || c == '_';
}

bool isBlank(char32_t c)
{
    return c == ' ' || c == '\t' || c == '\r' || c == 0xa0; // pages and books are full of no-break spaces
}

/// What a text pasted from a page may hold and nobody sees.
bool isInvisible(char32_t c)
{
    return c < 0x20 || c == 0x7f || (c >= 0x200b && c <= 0x200f) || c == 0x2028 || c == 0x2029 || c == 0xfeff;
}

std::size_t arrowLength(std::u32string_view text)
{
    if (text.empty() || (text[0] != '-' && text[0] != U'→')) // asked of every letter
        return 0;
    return text.starts_with(U"-->") ? 3 : text.starts_with(U"->") ? 2 : text.starts_with(U"→") ? 1 : 0;
}

void LongSymbols::set(std::vector<std::u32string> names)
{
    names_ = std::move(names);
    std::ranges::sort(names_);
}

LongSymbols::Match LongSymbols::match(std::u32string_view text) const
{
    Match longest;
    auto first = names_.begin();
    auto last = names_.end();
    for (std::size_t length = 0; first != last; ++length)
    {
        if (first->size() == length) // the shortest of those with the same beginning comes first
        {
            longest.length = length;
            if (++first == last)
                break;
        }
        if (length == text.size())
            break;
        ++longest.steps;
        const auto letter = [&](const std::u32string& name) { return name[length]; };
        if (letter(*first) == text[length] && letter(last[-1]) == text[length])
            continue;
        longest.steps += 2 * static_cast<std::size_t>(std::bit_width(static_cast<std::size_t>(last - first)));
        first = std::ranges::lower_bound(first, last, text[length], {}, letter);
        last = std::ranges::upper_bound(first, last, text[length], {}, letter);
    }
    return longest;
}

void ParameterNames::add(std::string_view name, std::uint32_t number, std::size_t column)
{
    entries_.push_back({name, number, column});
}

std::size_t ParameterNames::settle()
{
    std::ranges::sort(entries_, {}, [](const Entry& e) { return std::tuple(e.name, e.column); });
    std::size_t repeated = std::u32string_view::npos;
    for (std::size_t i = 1; i < entries_.size(); ++i)
        if (entries_[i].name == entries_[i - 1].name)
            repeated = std::min(repeated, entries_[i].column);
    return repeated;
}

std::uint32_t ParameterNames::find(std::string_view name) const
{
    const auto found = std::ranges::lower_bound(entries_, name, {}, &Entry::name);
    return found != entries_.end() && found->name == name ? found->number : kNoExpression;
}

/// Reading recurses; what it reads is never higher than this.
struct LineParser::Deeper
{
    explicit Deeper(LineParser& p) : parser(p)
    {
        if (parser.depth_ >= parser.reading_.limits.expressionDepth)
            parser.tooDeep();
        ++parser.depth_;
    }
    ~Deeper() { --parser.depth_; }
    Deeper(const Deeper&) = delete;
    Deeper& operator=(const Deeper&) = delete;
    LineParser& parser;
};

struct LineParser::Operator
{
    std::u32string_view text;
    ExpressionOp op;
};

void LineParser::skipBlanks()
{
    while (position_ < end_ && isBlank(line_[position_]))
        ++position_;
}

bool LineParser::atEnd()
{
    skipBlanks();
    return position_ >= end_;
}

char32_t LineParser::peek(std::size_t ahead) const
{
    return position_ + ahead < end_ ? line_[position_ + ahead] : U'\0';
}

bool LineParser::take(std::u32string_view text)
{
    skipBlanks();
    if (line_.substr(position_, std::min(text.size(), end_ - position_)) != text)
        return false;
    position_ += text.size();
    return true;
}

std::string LineParser::here() const
{
    if (position_ >= line_.size())
        return "the end of the line";
    const std::size_t length = position_ < end_ ? 0 : arrowLength(line_.substr(position_)); // what ends this part
    return quoted(line_.substr(position_, std::max<std::size_t>(length, 1)));
}

std::string LineParser::hereWord() const
{
    std::size_t end = position_;
    while (end < end_ && !isBlank(line_[end]))
        ++end;
    return end == position_ ? here() : quoted(line_.substr(position_, end - position_));
}

void LineParser::fail(std::string what, std::string expected) const
{
    throw GrammarMistake{position_, std::move(what), std::move(expected)};
}

void LineParser::failLimit(std::string what, std::string_view limit, AfterMistake after) const
{
    throw GrammarMistake{position_, std::move(what), "at most the limit " + std::string(limit), ErrorKind::Limit,
                         after};
}

void LineParser::expectEnd(std::string_view after, std::string_view expected)
{
    if (!atEnd())
        fail("unexpected " + here() + " after " + std::string(after), std::string(expected));
}

void LineParser::count(std::size_t parts)
{
    reading_.parts += parts;
    if (reading_.parts > reading_.limits.grammarParts)
        failLimit("the grammar has more than " + std::to_string(reading_.limits.grammarParts) +
                      " modules, parameters, numbers, names and operators",
                  "grammarParts", AfterMistake::EndOfText);
}

std::string LineParser::name(std::string_view role)
{
    skipBlanks();
    if (!startsName(peek()))
        fail("unexpected " + here(), "the name of " + std::string(role));
    const std::size_t start = position_;
    while (continuesName(peek()))
        ++position_;
    return toUtf8(line_.substr(start, position_ - start));
}

SymbolId LineParser::symbol()
{
    skipBlanks();
    auto [length, steps] = reading_.longSymbols.match(line_.substr(position_, end_ - position_));
    count(steps / kStepsPerPart);
    if (length == 0)
    {
        if (position_ < end_ && isInvisible(peek()))
            fail("an invisible character (U+" + hexDigits(peek()).substr(12) + ") stands here", "a symbol, or nothing");
        if (std::u32string_view(U"(),:<>#_ε→").find(peek()) != std::u32string_view::npos)
            fail(here() + " cannot be a symbol", "a symbol such as A, F or [");
        length = 1;
    }
    SymbolTable& symbols = reading_.grammar.symbols;
    const SymbolId id = symbols.intern(toUtf8(line_.substr(position_, length)));
    if (symbols.size() > reading_.limits.symbols)
        failLimit("more than " + std::to_string(reading_.limits.symbols) + " different symbols", "symbols",
                  AfterMistake::EndOfText);
    position_ += length;
    return id;
}

SymbolId LineParser::listedSymbol()
{
    count(1);
    if (peek() == ',')
        fail("unexpected `,` between symbols", "blanks, or nothing, between them");
    return symbol();
}

void LineParser::bracket(const std::string& text, std::size_t start, std::vector<std::size_t>& open,
                         std::string_view role, Brackets brackets)
{
    if (text == "[")
    {
        open.push_back(start);
        if (open.size() <= reading_.limits.bracketDepth)
            return;
        position_ = start;
        failLimit("brackets nest deeper than " + std::to_string(reading_.limits.bracketDepth), "bracketDepth");
    }
    if (text != "]")
        return;
    if (!open.empty())
        open.pop_back();
    else if (brackets == Brackets::Balance)
    {
        position_ = start;
        fail("`]` without `[` in the " + std::string(role), "balanced brackets");
    }
}

void LineParser::expectClosed(const std::vector<std::size_t>& open, std::string_view role)
{
    if (open.empty())
        return;
    position_ = open.back();
    fail("`[` is never closed in the " + std::string(role), "balanced brackets");
}

/// One more module after so many.
void LineParser::countModule(std::size_t before, std::string_view role)
{
    if (before >= reading_.limits.templateModules)
        failLimit("more than " + std::to_string(reading_.limits.templateModules) + " modules in one " +
                      std::string(role),
                  "templateModules");
    count(1);
}

std::vector<Module> LineParser::word(std::string_view role, Brackets brackets)
{
    Grammar& grammar = reading_.grammar;
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
        countModule(modules.size(), role);
        if (peek() == '<' || peek() == '>')
            fail(here() + " cannot be a symbol", "contexts only before a production's colon and arrow");
        const SymbolId id = symbol();
        const std::vector<ExpressionId> arguments = moduleArguments();
        modules.push_back(
            {id, static_cast<std::uint32_t>(grammar.arguments.size()), static_cast<std::uint32_t>(arguments.size())});
        grammar.arguments.insert(grammar.arguments.end(), arguments.begin(), arguments.end());
        bracket(grammar.symbols.name(id), start, open, role, brackets);
    }
    if (brackets == Brackets::Balance)
        expectClosed(open, role);
    modules.shrink_to_fit();
    return modules;
}

std::vector<ContextModule> LineParser::context(ContextSide side, std::vector<std::size_t>& columns)
{
    const std::string_view role = nameOf(side);
    const std::string sign = side == ContextSide::Left ? "<" : ">";
    skipBlanks();
    const std::size_t begin = position_;
    // What other L-systems write for no context. `*()` is the symbol.
    if (const char32_t c = peek(); c == '*' || c == '_' || c == U'ε')
    {
        ++position_;
        const bool alone = atEnd();
        position_ = begin;
        if (alone)
            fail(here() + " is no context",
                 "no " + std::string(role) + " and no `" + sign + "` where any neighbour will do");
    }

    std::vector<ContextModule> modules;
    std::vector<std::size_t> open;
    while (!atEnd())
    {
        const std::size_t start = position_;
        countModule(modules.size(), role);
        ContextModule module{symbol(), {}, static_cast<std::uint32_t>(start + 1)};
        const std::string& text = reading_.grammar.symbols.name(module.symbol);
        const bool isBracket = text == "[" || text == "]";
        if (isBracket && side == ContextSide::Left)
        {
            position_ = start;
            fail(quoted(text) + " cannot stand in a left context",
                 "only the symbols between the base and the predecessor, whatever branches off there");
        }
        skipBlanks();
        if (isBracket && peek() == '(')
            fail("a bracket of a context has no parameters", "a symbol after it, or the other bracket");
        module.parameters = formalParameters(columns);
        bracket(text, start, open, role, Brackets::Balance);
        modules.push_back(std::move(module));
    }
    expectClosed(open, role);
    modules.shrink_to_fit();
    return modules;
}

std::vector<std::string> LineParser::formalParameters(std::vector<std::size_t>& columns)
{
    std::vector<std::string> names;
    if (!take(U"(") || take(U")"))
        return names;
    do
    {
        skipBlanks();
        const std::size_t start = position_;
        std::string text = name("a parameter");
        if (names.size() >= reading_.limits.parameters)
        {
            position_ = start;
            failLimit("more than " + std::to_string(reading_.limits.parameters) + " parameters", "parameters");
        }
        count(1);
        names.push_back(std::move(text));
        columns.push_back(start);
    } while (take(U","));
    if (!take(U")"))
        fail("unexpected " + here() + " in the parameters", "`,` or `)`; names alone, conditions stand after a `:`");
    return names;
}

std::vector<ExpressionId> LineParser::moduleArguments()
{
    std::vector<ExpressionId> arguments;
    if (!take(U"(") || take(U")"))
        return arguments;
    do
    {
        if (arguments.size() >= reading_.limits.parameters)
            failLimit("more than " + std::to_string(reading_.limits.parameters) + " parameters", "parameters");
        arguments.push_back(expression());
    } while (take(U","));
    if (!take(U")"))
        fail("unexpected " + here() + " in a parameter list", "`,` or `)`");
    return arguments;
}

double LineParser::number(double low, double high)
{
    skipBlanks();
    const std::size_t start = position_;
    return valueOf(expression(), start, low, high);
}

double LineParser::listedNumber(double low, double high)
{
    skipBlanks();
    const std::size_t start = position_;
    const bool negative = peek() == '-';
    if (negative || peek() == '+')
        ++position_;
    if (isBlank(peek()))
        fail("a blank stands between a sign and its number", "`-1`, or an expression in parentheses");
    const double value = valueOf(primary(), start, low, high);
    if (position_ < end_ && !isBlank(peek()))
        fail("unexpected " + here() + " after a value", "a blank between values, and expressions in parentheses");
    return negative ? -value : value;
}

double LineParser::valueOf(ExpressionId id, std::size_t start, double low, double high)
{
    ExpressionScope values;
    values.constants = reading_.constantValues.data();
    const double value = evaluate(reading_.grammar.expressions, id, values);
    if (!values.failed && value >= low && value <= high)
        return value;
    position_ = start;
    fail(values.failed ? "the value is not finite" : "the value " + formatNumber(value) + " is out of range",
         "a number from " + plain(low) + " to " + plain(high));
}

void LineParser::tooDeep() const
{
    failLimit("the expression nests deeper than " + std::to_string(reading_.limits.expressionDepth), "expressionDepth");
}

ExpressionId LineParser::leaf(std::size_t start, const ExpressionNode& node)
{
    count(1);
    heights_.push_back(1);
    ExpressionNode placed = node;
    placed.column = static_cast<std::uint32_t>(start + 1);
    return reading_.grammar.expressions.add(placed);
}

/// A node over its arguments; it begins at `start`, and is read from `at` on. Evaluation recurses as deep as the tree
/// is high, and a long sum is a high tree too.
ExpressionId LineParser::node(std::size_t start, std::size_t at, ExpressionOp op, ExpressionId a, ExpressionId b,
                              ExpressionId c)
{
    std::uint32_t height = 0;
    for (const ExpressionId id : {a, b, c})
        height = std::max(height, id == kNoExpression ? 0 : heights_[id - firstExpression_]);
    if (height >= reading_.limits.expressionDepth)
    {
        position_ = at;
        tooDeep();
    }
    count(1);
    heights_.push_back(height + 1);
    return reading_.grammar.expressions.add({op, a, b, c, 0, static_cast<std::uint32_t>(start + 1)});
}

ExpressionId LineParser::choice()
{
    const Deeper deeper(*this);
    skipBlanks();
    const std::size_t start = position_;
    const ExpressionId condition = chain(0);
    skipBlanks();
    const std::size_t at = position_;
    if (!take(U"?"))
        return condition;
    const ExpressionId yes = choice();
    if (!take(U":"))
        fail("unexpected " + here() + " after `?`", "`:` and the other value");
    const ExpressionId no = choice();
    return node(start, at, ExpressionOp::Choose, condition, yes, no);
}

/// Operators between two operands, from those of this level on: 0 binds least.
ExpressionId LineParser::chain(std::size_t level)
{
    using enum ExpressionOp;
    // Longest spelling first.
    static constexpr Operator kOr[] = {{U"||", Or}};
    static constexpr Operator kAnd[] = {{U"&&", And}};
    static constexpr Operator kEqual[] = {{U"==", Equal}, {U"!=", NotEqual}};
    static constexpr Operator kLess[] = {{U"<=", LessEqual}, {U">=", GreaterEqual}, {U"<", Less}, {U">", Greater}};
    static constexpr Operator kSum[] = {{U"+", Add}, {U"-", Subtract}};
    static constexpr Operator kProduct[] = {{U"*", Multiply}, {U"/", Divide}, {U"%", Modulo}};
    static constexpr std::span<const Operator> kLevels[] = {kOr, kAnd, kEqual, kLess, kSum, kProduct};
    if (level == std::size(kLevels))
        return unary();

    skipBlanks();
    const std::size_t start = position_;
    ExpressionId left = chain(level + 1);
    for (;;)
    {
        skipBlanks();
        if (std::u32string_view(U"|&=!<>+-*/%").find(peek()) == std::u32string_view::npos)
            return left;
        const std::size_t at = position_;
        const auto operators = kLevels[level];
        const auto found = std::ranges::find_if(operators, [&](const Operator& o) { return take(o.text); });
        if (found == operators.end())
        {
            if (level == 2 && peek() == '=')
                fail("`=` does not compare", "`==`");
            if (level == 0 && (peek() == '&' || peek() == '|'))
                fail("unexpected " + here(), "`&&` or `||`");
            return left;
        }
        left = node(start, at, found->op, left, chain(level + 1));
    }
}

ExpressionId LineParser::unary()
{
    skipBlanks();
    const std::size_t start = position_;
    if (take(U"-"))
        return node(start, start, ExpressionOp::Negate, operand());
    if (take(U"+"))
        return node(start, start, ExpressionOp::Plus, operand());
    if (peek() == '!' && peek(1) != '=' && take(U"!"))
        return node(start, start, ExpressionOp::Not, operand());
    const ExpressionId base = primary();
    skipBlanks();
    const std::size_t at = position_;
    if (!take(U"^"))
        return base;
    return node(start, at, ExpressionOp::Power, base, operand());
}

ExpressionId LineParser::operand()
{
    const Deeper deeper(*this);
    return unary();
}

ExpressionId LineParser::primary()
{
    skipBlanks();
    if (take(U"("))
    {
        const ExpressionId inner = choice();
        if (!take(U")"))
            fail("unexpected " + here(), "`)`");
        return inner;
    }
    if (isDigit(peek()) || (peek() == '.' && isDigit(peek(1))))
        return numeral();
    if (startsName(peek()))
        return reference();
    fail("unexpected " + here() + " in an expression", "a number, a name or `(`");
}

ExpressionId LineParser::numeral()
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
        fail("no double holds the number " + shortened(text), "0, or a number from 5e-324 to 1.8e308");
    }
    return leaf(start, {.value = value});
}

ExpressionId LineParser::reference()
{
    const std::size_t start = position_;
    const std::string text = name("a value");
    if (const std::uint32_t number = scope ? scope->find(text) : kNoExpression; number != kNoExpression)
        return leaf(start, {ExpressionOp::Parameter, number});
    constexpr std::string_view kTransform = "srbo";
    if (transforms && text.size() == 1 && kTransform.find(text[0]) != std::string_view::npos)
        return leaf(start, {ExpressionOp::Transform, static_cast<std::uint32_t>(kTransform.find(text[0]))});
    if (const auto found = reading_.constants.find(text); found != reading_.constants.end())
        return leaf(start, {ExpressionOp::Constant, found->second});
    if (text == "n")
        return leaf(start, {ExpressionOp::Step});
    if (text == "pi")
        return leaf(start, {ExpressionOp::Pi});
    const auto functions = expressionFunctions();
    const auto function = std::ranges::find(functions, text, &ExpressionFunction::name);
    if (function == functions.end())
        failUnknown(text, start);
    return call(*function, start);
}

void LineParser::failUnknown(const std::string& name, std::size_t start)
{
    position_ = start;
    if (reading_.brokenConstants.contains(name))
        throw GrammarMistake{start, quoted(name) + " has no value", {}, ErrorKind::BadInput, AfterMistake::Nothing};
    if (const auto let = reading_.constantLines.find(name);
        let != reading_.constantLines.end() && let->second > reading_.line)
        fail(quoted(name) + " is not known here", "its `let`, now in line " +
                                                      std::to_string(reading_.place(let->second, 1).line) +
                                                      ", above everything that uses it");
    if (!transforms && scope && name.size() == 1 && std::string_view("srbo").find(name[0]) != std::string_view::npos)
        fail(quoted(name) + " is not known here",
             "a parameter, a constant made by `let`, or a table (`: ~ name`) at the end of the production");
    fail(quoted(name) + " is not known here",
         scope ? "a parameter of this production, a constant made by `let`, or a function such as sin"
               : "a constant made by `let`, or a function such as sin");
}

ExpressionId LineParser::call(const ExpressionFunction& function, std::size_t start)
{
    const std::string text(function.name);
    if (!take(U"("))
        fail("the function " + text + " has no arguments", "`(` after " + text);
    const ExpressionId first = choice();
    ExpressionId second = kNoExpression;
    if (function.arguments == 2)
    {
        if (!take(U","))
            fail("the function " + text + " takes 2 arguments", "`,` and the second one");
        second = choice();
    }
    if (!take(U")"))
        fail("unexpected " + here() + " after the argument of " + text, "`)`");
    return node(start, start, function.op, first, second);
}

} // namespace espalier
