#include <Espalier/Grammar/GrammarLine.h>

#include <Espalier/Core/Json.h>
#include <Espalier/Core/Utf8.h>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <utility>

namespace espalier {

namespace {

constexpr std::size_t kMostErrors = 20;
constexpr std::size_t kLongestSymbol = 256;        ///< Code points.
constexpr std::uint32_t kMostIterations = 1000000; ///< Far more than any derivation can take.
constexpr std::size_t kNowhere = std::u32string_view::npos;

constexpr std::string_view kSettings[] = {"symbols", "angle", "step",    "width",      "draw",  "move",
                                          "ignore",  "order", "tropism", "iterations", "axiom", "interpret"};

/// How cpfg, L-Py and others begin lines that are spelled differently here, or not needed.
struct ForeignWord
{
    std::string_view word; ///< In small letters.
    std::string_view instead;
};
constexpr ForeignWord kForeignWords[] = {
    {"derivation", "`iterations: 5`"},
    {"generations", "`iterations: 5`"},
    {"steps", "`iterations: 5`"},
    {"premise", "`axiom: A`"},
    {"start", "`axiom: A`"},
    {"delta", "`angle: 25`"},
    {"homomorphism", "`interpret:` before each production that gives a symbol its shape, as in `interpret: A -> F`"},
    {"interpretation", "`interpret:` before each production that gives a symbol its shape, as in `interpret: A -> F`"},
    {"decomposition", "ordinary productions"},
    {"consider", "`ignore:` and the symbols that contexts do not see"},
    {"production", "only the productions, one a line, as in `A -> F`"},
    {"productions", "only the productions, one a line, as in `A -> F`"},
    {"lsystem", "one L-system a file, without a frame"},
    {"endlsystem", "one L-system a file, without a frame"},
    {"module", "symbols without declaration, or `symbols:` and those of more than one letter"},
    {"const", "`let name = value`"},
    {"define", "`let name = value`"},
    {"constants", "`let name = value`"},
};

bool isSetting(std::string_view name)
{
    return std::ranges::find(kSettings, name) != std::end(kSettings);
}

std::string smallLetters(std::string_view text)
{
    std::string small(text);
    for (char& c : small)
        if (c >= 'A' && c <= 'Z')
            c = static_cast<char>(c - 'A' + 'a');
    return small;
}

/// What to write instead of a word that begins a line elsewhere; empty if it is unheard of.
std::string insteadOf(std::string_view word)
{
    const std::string small = smallLetters(word);
    if (isSetting(small))
        return "`" + small + ":`" + (word == small ? ", with a colon" : ", in small letters");
    const auto found = std::ranges::find(kForeignWords, small, &ForeignWord::word);
    return found == std::end(kForeignWords) ? std::string() : std::string(found->instead);
}

std::size_t endOfWord(std::u32string_view line, std::size_t start)
{
    while (start < line.size() && startsName(line[start]))
        ++start;
    return start;
}

std::size_t skipBlanks(std::u32string_view line, std::size_t start)
{
    while (start < line.size() && isBlank(line[start]))
        ++start;
    return start;
}

/// Calls `function(i)` for every letter outside parentheses until it returns true. Parentheses that nobody opened
/// are no parentheses. Returns where that was, or `end`.
template <class Function>
std::size_t findOutside(std::u32string_view line, std::size_t begin, std::size_t end, Function&& function)
{
    std::size_t depth = 0;
    for (std::size_t i = begin; i < end; ++i)
    {
        depth += line[i] == '(' ? 1u : 0u;
        depth -= line[i] == ')' && depth > 0 ? 1u : 0u;
        if (depth == 0 && function(i))
            return i;
    }
    return end;
}

std::size_t colonOf(std::u32string_view line, std::size_t begin, std::size_t end)
{
    return findOutside(line, begin, end, [&](std::size_t i) { return line[i] == ':'; });
}

struct Arrow
{
    std::size_t begin;
    std::size_t end;
};

/// Which list of the grammar a production belongs to.
enum class Kind : std::uint8_t
{
    Rewriting,
    Interpretation,
};

/// What somebody may have meant who wrote no arrow.
GrammarMistake withoutArrow(std::u32string_view line, std::size_t start, Kind kind)
{
    if (kind == Kind::Interpretation)
        return {start, "no arrow stands after `interpret:`", "a production such as `interpret: A -> F`"};
    const std::u32string_view word = line.substr(start, endOfWord(line, start) - start);
    if (const std::string instead = insteadOf(toUtf8(word.substr(0, kLongestSymbol))); !instead.empty())
        return {start, quoted(word) + " begins no line here", instead};
    const std::size_t equals = findOutside(line, start, line.size(), [&](std::size_t i) {
        constexpr std::u32string_view kCompare = U"=<>!";
        return line[i] == '=' && (i == start || kCompare.find(line[i - 1]) == kNowhere) &&
               (i + 1 == line.size() || line[i + 1] != '=');
    });
    if (equals < line.size())
        return {equals, "`=` is no arrow", "`predecessor -> successor` for a production, or `let` before a constant"};
    return {start, "this line is neither a setting, a `let` nor a production", "`predecessor -> successor`"};
}

/// The last `->`, `-->` or `→` outside parentheses.
Arrow arrowOf(std::u32string_view line, std::size_t start, Kind kind)
{
    Arrow arrow{kNowhere, 0};
    std::size_t depth = 0;
    std::size_t open = start;
    std::size_t enclosing = kNowhere; // the parenthesis around the first arrow that stands inside one
    for (std::size_t i = start; i < line.size(); ++i)
    {
        if (line[i] == '(' && depth++ == 0)
            open = i;
        depth -= line[i] == ')' && depth > 0 ? 1u : 0u;
        const std::size_t length = arrowLength(line.substr(i));
        if (length > 0 && depth > 0)
            enclosing = std::min(enclosing, open);
        if (depth > 0 || length == 0)
            continue;
        arrow = {i, i + length};
        i += length - 1;
    }
    if (arrow.begin != kNowhere)
        return arrow;
    if (depth > 0)
        throw GrammarMistake{open, "`(` is never closed", "`)`, then an arrow such as `->`"};
    if (enclosing != kNowhere)
        throw GrammarMistake{enclosing, "`(` is not closed before the arrow", "`)`, then an arrow such as `->`"};
    throw withoutArrow(line, start, kind);
}

/// The text: collects mistakes line by line.
class FileParser
{
public:
    FileParser(const Limits& limits, const GrammarPlace& place) : limits_(limits), reading_{limits, place} {}

    Expected<Grammar> parse(std::string_view text)
    {
        eachLine(text, [&](std::u32string_view line, std::u32string_view) { declare(line); });
        eachLine(text, [&](std::u32string_view line, std::u32string_view comment) { statement(line, comment); });
        checkIgnored();
        if (!stopped_ && errors_.size() < kMostErrors && !settings_.contains("axiom"))
            errors_.push_back({ErrorKind::BadInput,
                               "the grammar has no axiom",
                               "a line such as `axiom: A`",
                               {},
                               reading_.place(1, 1)});
        if (errors_.empty())
            return std::move(reading_.grammar);
        return tl::make_unexpected(summary());
    }

private:
    // ---- Mistakes ----

    /// Calls `function` with what stands before and from the `#` of each line.
    template <class Function>
    void eachLine(std::string_view text, Function&& function)
    {
        reading_.line = 0;
        for (std::size_t start = 0; start <= text.size() && errors_.size() < kMostErrors && !stopped_;)
        {
            const std::size_t end = std::min(text.find('\n', start), text.size());
            const std::u32string decoded = lettersOf(text.substr(start, end - start));
            start = end + 1;
            ++reading_.line;
            const std::u32string_view whole = decoded;
            const std::size_t comment = std::min(whole.find(U'#'), whole.size());
            try
            {
                function(whole.substr(0, comment), whole.substr(comment));
            }
            catch (const GrammarMistake& mistake)
            {
                report(reading_.line, mistake);
            }
        }
    }

    void report(std::uint32_t line, const GrammarMistake& mistake)
    {
        stopped_ = stopped_ || mistake.after == AfterMistake::EndOfText;
        if (mistake.after == AfterMistake::Nothing)
            return;
        errors_.push_back({mistake.kind,
                           mistake.what,
                           mistake.expected,
                           {},
                           reading_.place(line, static_cast<std::uint32_t>(mistake.column + 1))});
    }

    Error summary()
    {
        std::ranges::stable_sort(errors_, {}, [](const Error& error) { return error.where.line; });
        Error first = errors_.front();
        if (errors_.size() > 1)
        {
            first.advice =
                std::to_string(errors_.size() - 1) + (errors_.size() >= kMostErrors ? " or more" : "") + " further:";
            for (std::size_t i = 1; i < errors_.size(); ++i)
                first.advice += "\n" + toString(errors_[i]);
        }
        return first;
    }

    /// An ignored symbol is never seen, so a context that names it could never match.
    void checkIgnored()
    {
        Grammar& grammar = reading_.grammar;
        std::vector<bool> ignored(grammar.symbols.size());
        for (const SymbolId id : grammar.ignore)
            ignored[id] = true;
        for (const Production& production : grammar.productions)
            for (const auto* context : {&production.left, &production.right})
                for (const ContextModule& module : *context)
                    if (ignored[module.symbol] && errors_.size() < kMostErrors)
                    {
                        const std::string symbol = quoted(grammar.symbols.name(module.symbol));
                        report(production.place.line,
                               {module.column - 1,
                                symbol + " is ignored (line " + std::to_string(reading_.place(ignoreLine_, 1).line) +
                                    "), so no context can name it",
                                "a context without " + symbol + ", or `ignore:` without it"});
                    }
    }

    // ---- Lines ----

    LineParser parserOf(std::u32string_view line, std::size_t begin, std::size_t end)
    {
        return {reading_, line, begin, end};
    }

    /// What later lines, and earlier ones too, depend on: the declared symbols, and where constants are made.
    void declare(std::u32string_view line)
    {
        const std::size_t start = skipBlanks(line, 0);
        if (isLet(line, start))
        {
            const std::size_t name = skipBlanks(line, start + 3);
            std::size_t end = name;
            while (end < line.size() && continuesName(line[end]))
                ++end;
            if (end - name <= kLongestSymbol && reading_.constantLines.size() < limits_.constants)
                reading_.constantLines.emplace(toUtf8(line.substr(name, end - name)), reading_.line);
        }
        else if (line.substr(start, endOfWord(line, start) - start) == U"symbols")
            if (const std::size_t colon = settingColon(line, start); colon != kNowhere)
                declareSymbols(line, start, colon + 1);
    }

    void declareSymbols(std::u32string_view line, std::size_t start, std::size_t begin)
    {
        if (!settings_.insert("symbols").second)
            throw GrammarMistake{start, "the setting `symbols:` stands twice", "each setting once"};
        LineParser parser = parserOf(line, begin, line.size());
        std::vector<std::u32string> names;
        std::set<std::string> known;
        // Those before a mistake are declared all the same, lest every line that uses them seem wrong too.
        const auto declareThem = [&] { reading_.longSymbols.set(std::move(names)); };
        try
        {
            while (!parser.atEnd())
            {
                std::string name = declaredSymbol(parser, known);
                names.push_back(lettersOf(name));
                reading_.grammar.longSymbols.push_back(std::move(name));
            }
        }
        catch (const GrammarMistake&)
        {
            declareThem();
            throw;
        }
        declareThem();
    }

    std::string declaredSymbol(LineParser& parser, std::set<std::string>& known)
    {
        const std::size_t column = parser.position();
        std::string name = parser.name("a symbol");
        if (name == "let" || isSetting(name))
            throw GrammarMistake{column, "`" + name + "` cannot be a symbol, for it begins lines of its own",
                                 "another name"};
        if (name.size() > kLongestSymbol)
            throw GrammarMistake{column, "the symbol has " + std::to_string(name.size()) + " characters",
                                 "at most " + std::to_string(kLongestSymbol), ErrorKind::Limit};
        if (!known.insert(name).second)
            throw GrammarMistake{column, "the symbol " + quoted(name) + " is declared twice", "each symbol once"};
        if (known.size() > limits_.longSymbols)
            throw GrammarMistake{column, "more than " + std::to_string(limits_.longSymbols) + " declared symbols",
                                 "at most the limit longSymbols", ErrorKind::Limit, AfterMistake::EndOfText};
        return name;
    }

    void statement(std::u32string_view line, std::u32string_view comment)
    {
        const std::size_t start = skipBlanks(line, 0);
        if (start == line.size())
            return refuseDirective(comment, line.size());
        if (isLet(line, start))
            return constant(line, start + 3);
        if (const std::size_t colon = settingColon(line, start); colon != kNowhere)
            return setting(line, start, colon);
        production(line, start);
    }

    static void refuseDirective(std::u32string_view comment, std::size_t column)
    {
        for (const std::u32string_view directive : {U"#define", U"#include"})
            if (comment.starts_with(directive) &&
                (comment.size() == directive.size() || !continuesName(comment[directive.size()])))
                throw GrammarMistake{column,
                                     "`" + toUtf8(directive) + "` is the preprocessor's, which is not used here",
                                     "`let name = value` for a constant, and one file a grammar"};
    }

    /// `let < A` is a production whose left context is the symbols l, e and t.
    static bool isLet(std::u32string_view line, std::size_t start)
    {
        if (!line.substr(start).starts_with(U"let") || start + 3 == line.size() || !isBlank(line[start + 3]))
            return false;
        const std::size_t next = skipBlanks(line, start + 3);
        return next == line.size() || line[next] != '<';
    }

    void constant(std::u32string_view line, std::size_t begin)
    {
        Grammar& grammar = reading_.grammar;
        LineParser parser = parserOf(line, begin, line.size());
        parser.skipBlanks();
        const std::size_t column = parser.position();
        const std::string name = parser.name("a constant");
        if (grammar.constants.size() >= limits_.constants)
            throw GrammarMistake{column, "more than " + std::to_string(limits_.constants) + " constants",
                                 "at most the limit constants", ErrorKind::Limit, AfterMistake::EndOfText};
        if (reading_.constants.contains(name))
            throw GrammarMistake{column, "the constant " + quoted(name) + " is defined twice", "each name once"};
        if (name == "n" || name == "pi" ||
            std::ranges::find(expressionFunctions(), name, &ExpressionFunction::name) != expressionFunctions().end())
            throw GrammarMistake{column, "`" + name + "` is built in", "another name for the constant"};
        try
        {
            if (!parser.take(U"="))
                parser.fail("unexpected " + parser.here() + " after the constant's name", "`=`");
            const ExpressionId id = parser.expression();
            parser.expectEnd("the constant's value");
            ExpressionScope scope;
            scope.constants = reading_.constantValues.data();
            const double value = evaluate(grammar.expressions, id, scope);
            if (scope.failed)
                throw GrammarMistake{column, "the constant " + quoted(name) + " has no finite value", "a number"};
            reading_.constantValues.push_back(value);
            reading_.constants.emplace(name, static_cast<std::uint32_t>(grammar.constants.size()));
            grammar.constants.push_back({name, id});
        }
        catch (const GrammarMistake&)
        {
            reading_.brokenConstants.insert(name);
            throw;
        }
    }

    // ---- Settings ----

    /// The colon of `word:` at the start of the line, or kNowhere if that is not a setting but a production. Blanks
    /// before the colon are allowed after the name of a setting.
    [[nodiscard]] std::size_t settingColon(std::u32string_view line, std::size_t start) const
    {
        const std::size_t end = endOfWord(line, start);
        const std::size_t length = end - start;
        if (length < 2)
            return kNowhere;
        const std::size_t colon = skipBlanks(line, end);
        if (colon == line.size() || line[colon] != ':')
            return kNowhere;
        if (colon > end && (length > kLongestSymbol || !isSetting(toUtf8(line.substr(start, length)))))
            return kNowhere;
        const bool isSymbol = reading_.longSymbols.match(line.substr(start, length)).length == length;
        return isSymbol ? kNowhere : colon;
    }

    void setting(std::u32string_view line, std::size_t start, std::size_t colon)
    {
        const std::string name = toUtf8(line.substr(start, endOfWord(line, start) - start));
        if (name == "symbols")
            return; // read before everything else
        if (!isSetting(name))
            unknownSetting(name, start);
        if (name == "interpret")
            return interpretation(line, colon + 1);
        if (!settings_.insert(name).second)
            throw GrammarMistake{start, "the setting `" + name + ":` stands twice", "each setting once"};

        Grammar& grammar = reading_.grammar;
        LineParser parser = parserOf(line, colon + 1, line.size());
        if (name == "angle")
            grammar.angle = parser.number(-limits_.angleDegrees, limits_.angleDegrees);
        else if (name == "step")
            grammar.step = parser.number(0, limits_.coordinate);
        else if (name == "width")
            grammar.width = parser.number(0, limits_.coordinate);
        else if (name == "draw")
            grammar.draw = symbols(parser);
        else if (name == "move")
            grammar.move = symbols(parser);
        else if (name == "ignore")
            ignore(parser);
        else if (name == "order")
            order(parser);
        else if (name == "tropism")
            tropism(parser);
        else if (name == "iterations")
            iterations(parser);
        else if (name == "axiom")
            axiom(parser);
        parser.expectEnd("the setting");
    }

    /// The setting that `name` is within two letters of, or one if it is short (Levenshtein 1966), or nothing.
    static std::string_view nearestSetting(std::string_view name)
    {
        std::string_view nearest;
        std::size_t least = 3;
        for (const std::string_view known : kSettings)
        {
            if (known.size() < 4 || name.size() > known.size() + 2)
                continue;
            std::vector<std::size_t> row(name.size() + 1);
            std::iota(row.begin(), row.end(), std::size_t{0});
            for (std::size_t i = 0; i < known.size(); ++i)
            {
                std::size_t diagonal = std::exchange(row[0], i + 1);
                for (std::size_t k = 0; k < name.size(); ++k)
                {
                    const std::size_t changed = diagonal + (known[i] == name[k] ? 0 : 1);
                    diagonal = row[k + 1];
                    row[k + 1] = std::min({changed, row[k] + 1, diagonal + 1});
                }
            }
            if (row.back() < std::min<std::size_t>(least, known.size() < 5 ? 2 : 3))
            {
                least = row.back();
                nearest = known;
            }
        }
        return nearest;
    }

    [[noreturn]] static void unknownSetting(const std::string& name, std::size_t start)
    {
        std::string expected = insteadOf(name);
        if (const std::string_view meant = nearestSetting(name); expected.empty() && !meant.empty())
            expected = "`" + std::string(meant) + ":`";
        if (expected.empty())
        {
            for (const std::string_view known : kSettings)
                expected += (expected.empty() ? "one of " : ", ") + std::string(known);
            expected += "; or exactly one symbol before a production's condition";
        }
        throw GrammarMistake{start, "unknown setting `" + shortened(name) + ":`", expected};
    }

    static std::vector<SymbolId> symbols(LineParser& parser)
    {
        std::vector<SymbolId> ids;
        while (!parser.atEnd())
            ids.push_back(parser.listedSymbol());
        return ids;
    }

    void ignore(LineParser& parser)
    {
        ignoreLine_ = reading_.line;
        while (!parser.atEnd())
        {
            if (const char32_t c = parser.peek(); c == '[' || c == ']')
                parser.fail(parser.here() + " cannot be ignored, for contexts follow the branches",
                            "symbols that are no brackets");
            reading_.grammar.ignore.push_back(parser.listedSymbol());
        }
    }

    void order(LineParser& parser)
    {
        constexpr std::string_view kExpected = "`listed` (the first that matches) or `context-first` (the default)";
        if (parser.take(U"context-first"))
            reading_.grammar.order = MatchOrder::ContextFirst;
        else if (parser.take(U"listed"))
            reading_.grammar.order = MatchOrder::Listed;
        else
            parser.fail("unexpected " + parser.hereWord() + " as the order of productions", std::string(kExpected));
        parser.expectEnd("the order of productions", kExpected);
    }

    void tropism(LineParser& parser)
    {
        std::array<double, 4> values{};
        for (double& value : values)
        {
            if (parser.atEnd())
                parser.fail("the tropism has fewer than four values",
                            "its strength and a direction, as in `tropism: 0.22 0 -1 0`");
            value = parser.listedNumber(-limits_.coordinate, limits_.coordinate);
        }
        parser.expectEnd("the tropism's four values", "the end of the line; a sum or product in parentheses");
        reading_.grammar.tropism = Tropism{values[0], {values[1], values[2], values[3]}};
    }

    void iterations(LineParser& parser)
    {
        parser.skipBlanks();
        const std::size_t column = parser.position();
        const double value = parser.number(0, kMostIterations);
        if (value != std::floor(value))
            throw GrammarMistake{column, "the value " + formatNumber(value) + " is not a whole number",
                                 "a whole number from 0 to " + std::to_string(kMostIterations)};
        reading_.grammar.iterations = static_cast<std::uint32_t>(value);
    }

    void axiom(LineParser& parser)
    {
        parser.skipBlanks();
        reading_.grammar.axiomPlace = placeOf(parser.position());
        reading_.grammar.axiom = parser.word("axiom");
    }

    // ---- Productions ----

    [[nodiscard]] TextPlace placeOf(std::size_t column) const
    {
        return {reading_.line, static_cast<std::uint32_t>(column + 1)};
    }

    void production(std::u32string_view line, std::size_t start)
    {
        Production read = productionOf(line, start, Kind::Rewriting);
        reading_.grammar.productions.push_back(std::move(read));
    }

    void interpretation(std::u32string_view line, std::size_t begin)
    {
        const std::size_t start = skipBlanks(line, begin);
        Production read = productionOf(line, start, Kind::Interpretation);
        reading_.grammar.interpretations.push_back(std::move(read));
    }

    /// `left < predecessor > right : condition -> successor : weight : ~ table(row)`
    Production productionOf(std::u32string_view line, std::size_t start, Kind kind)
    {
        const Grammar& grammar = reading_.grammar;
        if (grammar.productions.size() + grammar.interpretations.size() >= limits_.productions)
            throw GrammarMistake{start, "more than " + std::to_string(limits_.productions) + " productions",
                                 "at most the limit productions", ErrorKind::Limit, AfterMistake::EndOfText};
        const Arrow arrow = arrowOf(line, start, kind);
        const std::size_t leftColon = colonOf(line, start, arrow.begin);
        const std::size_t rightColon = colonOf(line, arrow.end, line.size());

        Production result;
        result.place = placeOf(start);
        const ParameterNames names = leftHandSide(line, start, leftColon, kind, result);
        if (leftColon < arrow.begin)
        {
            LineParser parser = parserOf(line, leftColon + 1, arrow.begin);
            parser.scope = &names;
            if (!parser.take(U"*"))
                result.condition = parser.expression();
            parser.expectEnd("the condition", "an operator such as `&&`, or the arrow");
        }
        if (rightColon < line.size())
            weightAndTable(line, rightColon + 1, kind, names, result);

        const std::string& predecessor = grammar.symbols.name(result.predecessor);
        LineParser successor = parserOf(line, arrow.end, rightColon);
        successor.scope = &names;
        successor.transforms = !result.table.empty();
        result.successor = successor.word("successor", isBracket(predecessor) ? Brackets::Any : Brackets::Balance);
        return result;
    }

    static bool isBracket(std::string_view symbol) { return symbol == "[" || symbol == "]"; }

    /// Contexts and predecessor; what their parameters are called.
    ParameterNames leftHandSide(std::u32string_view line, std::size_t begin, std::size_t end, Kind kind,
                                Production& result)
    {
        const Contexts signs = contextsOf(line, begin, end, kind);
        const std::size_t predecessorEnd = signs.right == kNowhere ? end : signs.right;
        std::vector<std::size_t> leftColumns;
        std::vector<std::size_t> columns;
        std::vector<std::size_t> rightColumns;
        if (signs.left != kNowhere)
        {
            if (skipBlanks(line.substr(0, signs.left), begin) == signs.left)
                throw GrammarMistake{signs.left, "nothing stands before `<`",
                                     "the left context, as in `B < A -> F`, or no `<`"};
            result.left = parserOf(line, begin, signs.left).context(ContextSide::Left, leftColumns);
        }
        predecessor(line, signs.left == kNowhere ? begin : signs.left + 1, predecessorEnd, kind, columns, result);
        if (signs.right != kNowhere)
        {
            if (skipBlanks(line.substr(0, end), signs.right + 1) == end)
                throw GrammarMistake{signs.right, "nothing stands after `>`",
                                     "the right context, as in `A > B -> F`, or no `>`"};
            result.right = parserOf(line, signs.right + 1, end).context(ContextSide::Right, rightColumns);
        }

        ParameterNames names;
        std::uint32_t number = 0;
        for (std::size_t i = 0; i < columns.size(); ++i)
            names.add(result.parameters[i], number++, columns[i]);
        const auto add = [&](const std::vector<ContextModule>& context, const std::vector<std::size_t>& places) {
            std::size_t i = 0;
            for (const ContextModule& module : context)
                for (const std::string& name : module.parameters)
                    names.add(name, number++, places[i++]);
        };
        add(result.left, leftColumns);
        add(result.right, rightColumns);
        if (const std::size_t repeated = names.settle(); repeated != kNowhere)
            throw GrammarMistake{repeated,
                                 "the parameter " + quoted(parserOf(line, repeated, end).name("a parameter")) +
                                     " stands twice",
                                 "different names on the whole left-hand side"};
        return names;
    }

    /// Where `<` and `>` stand.
    struct Contexts
    {
        std::size_t left = kNowhere;
        std::size_t right = kNowhere;
    };

    static Contexts contextsOf(std::u32string_view line, std::size_t begin, std::size_t end, Kind kind)
    {
        constexpr const char* kForm =
            "`left < predecessor > right`; several neighbours stand together, as in `BC < A > DE`";
        Contexts signs;
        findOutside(line, begin, end, [&](std::size_t i) {
            if (arrowLength(line.substr(i, end - i)) > 0)
                throw GrammarMistake{i, "a production has one arrow", "`predecessor -> successor`"};
            if (line[i] != '<' && line[i] != '>')
                return false;
            const std::string sign = line[i] == '<' ? "`<`" : "`>`";
            if (kind == Kind::Interpretation)
                throw GrammarMistake{i, "`interpret:` has no context, " + sign + " stands before its colon",
                                     "`interpret: symbol -> shapes`, or a comparison after the colon"};
            std::size_t& place = line[i] == '<' ? signs.left : signs.right;
            if (place != kNowhere)
                throw GrammarMistake{i, "a second " + sign + " in one production", kForm};
            if (line[i] == '<' && signs.right != kNowhere)
                throw GrammarMistake{i, "`<` stands after `>`", kForm};
            place = i;
            return false;
        });
        return signs;
    }

    void predecessor(std::u32string_view line, std::size_t begin, std::size_t end, Kind kind,
                     std::vector<std::size_t>& columns, Production& result)
    {
        LineParser parser = parserOf(line, begin, end);
        if (parser.atEnd())
            parser.fail("no predecessor stands before " + parser.here(),
                        "the symbol to rewrite, as in `A -> F` or `B < A > C -> F`");
        const std::size_t start = parser.position();
        result.predecessor = parser.symbol();
        if (const std::string& name = reading_.grammar.symbols.name(result.predecessor);
            kind == Kind::Rewriting && isBracket(name))
            throw GrammarMistake{start, "`" + name + "` cannot be rewritten, for brackets must balance",
                                 "another predecessor, or `interpret: " + name + " -> ...`"};
        result.parameters = parser.formalParameters(columns);
        parser.expectEnd(
            "the predecessor",
            kind == Kind::Rewriting
                ? "exactly one symbol; its neighbours belong into contexts (`left < predecessor > right`), "
                  "its condition after a `:`"
                : "exactly one symbol, and its condition after a `:`");
    }

    void weightAndTable(std::u32string_view line, std::size_t begin, Kind kind, const ParameterNames& names,
                        Production& result)
    {
        LineParser parser = parserOf(line, begin, line.size());
        parser.scope = &names;
        parser.skipBlanks();
        if (parser.peek() != '~')
        {
            result.weight = parser.expression();
            if (parser.atEnd())
                return;
            if (!parser.take(U":"))
                parser.fail("unexpected " + parser.here() + " after the weight",
                            kind == Kind::Rewriting ? "`: ~ table` or the end of the line" : "the end of the line");
        }
        parser.skipBlanks();
        if (kind == Kind::Interpretation)
            parser.fail("`interpret:` draws from no table", "a weight, or the end of the line");
        if (!parser.take(U"~"))
            parser.fail("unexpected " + parser.here(), "`~` and the name of a table");
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
    GrammarReading reading_;
    std::uint32_t ignoreLine_ = 0;
    std::set<std::string, std::less<>> settings_; ///< Those seen, read or not.
    std::vector<Error> errors_;
    bool stopped_ = false;
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
