#include <Espalier/Archetype/Template.h>

#include <Espalier/Core/File.h>
#include <Espalier/Core/Json.h>
#include <Espalier/Core/Utf8.h>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <utility>

namespace espalier {

std::size_t TemplateLibrary::find(std::string_view name) const noexcept
{
    return static_cast<std::size_t>(std::ranges::find(templates, name, &Template::name) - templates.begin());
}

bool beginsWithTurn(const Template& piece) noexcept
{
    return !piece.modules.empty() && (piece.modules[0].symbol == '+' || piece.modules[0].symbol == '-');
}

namespace {

constexpr std::string_view kDigits = "0123456789";

/// A name without the number that tells it from another template of that name (mergeArchetypes).
std::string_view unnumbered(std::string_view name)
{
    const std::size_t end = name.find_last_not_of(kDigits);
    const bool isNumbered = end != std::string_view::npos && end > 0 && end + 1 < name.size() && name[end] == '_';
    return isNumbered ? name.substr(0, end) : name;
}

/// A name without the mark of mirror images.
std::string_view unmirrored(std::string_view name)
{
    for (const std::string_view marked : {name, unnumbered(name)})
        if (marked.size() > kMirrored.size() && marked.ends_with(kMirrored))
            return unmirrored(marked.substr(0, marked.size() - kMirrored.size()));
    return name;
}

/// A name without the number of a bend.
std::string_view unbent(std::string_view name)
{
    constexpr std::string_view kBent = "_bent";
    for (const std::string_view marked : {name, unnumbered(name)})
    {
        const std::string_view stem = marked.substr(0, marked.find_last_not_of(kDigits) + 1);
        if (stem.size() < marked.size() && stem.size() > kBent.size() && stem.ends_with(kBent))
            return stem.substr(0, stem.size() - kBent.size());
    }
    return name;
}

} // namespace

std::vector<std::uint32_t> kindsOf(const TemplateLibrary& library)
{
    std::map<std::pair<std::string_view, std::string_view>, std::uint32_t> firsts;
    std::vector<std::uint32_t> kinds;
    for (std::uint32_t i = 0; i < library.templates.size(); ++i)
    {
        const Template& piece = library.templates[i];
        kinds.push_back(firsts.try_emplace({unbent(unmirrored(piece.name)), piece.anchors}, i).first->second);
    }
    return kinds;
}

std::string romanNumeral(std::uint32_t number)
{
    struct Numeral
    {
        std::uint32_t value;
        std::string_view text;
    };
    constexpr Numeral kNumerals[] = {{1000, "M"}, {900, "CM"}, {500, "D"}, {400, "CD"}, {100, "C"},
                                     {90, "XC"},  {50, "L"},   {40, "XL"}, {10, "X"},   {9, "IX"},
                                     {5, "V"},    {4, "IV"},   {1, "I"}};
    std::string text;
    for (const Numeral& numeral : kNumerals)
        for (; number >= numeral.value; number -= numeral.value)
            text += numeral.text;
    return text;
}

namespace {

bool isLetter(char c)
{
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}

bool isDigit(char c)
{
    return c >= '0' && c <= '9';
}

bool isBlank(char c)
{
    return c == ' ' || c == '\t' || c == '\r';
}

/// One file; positions are byte offsets, turned into line and column only for errors.
class TemplatesParser
{
public:
    TemplatesParser(std::string_view text, std::string_view file, const Limits& limits)
        : text_(text), file_(file), limits_(limits)
    {}

    Expected<TemplateLibrary> parse()
    {
        for (std::size_t start = 0; start < text_.size();)
        {
            const std::size_t end = std::min(text_.find('\n', start), text_.size());
            if (auto done = line(start, contentEnd(start, end)); !done)
                return tl::make_unexpected(done.error());
            start = end + 1;
        }
        if (library_.templates.empty())
            return fail(0, "the file holds no template", "one template a line, such as F[-FX]+FY");
        return std::move(library_);
    }

private:
    tl::unexpected<Error> fail(std::size_t offset, std::string what, std::string expected,
                               ErrorKind kind = ErrorKind::BadInput) const
    {
        return failure(kind, locate(file_, text_, offset), std::move(what), std::move(expected));
    }

    /// Where the line's comment begins: a % at its start or after white space. Elsewhere % is the turtle's cut.
    std::size_t contentEnd(std::size_t start, std::size_t end) const
    {
        for (std::size_t i = start; i < end; ++i)
            if (text_[i] == '%' && (i == start || isBlank(text_[i - 1])))
                return i;
        return end;
    }

    std::size_t skipBlanks(std::size_t i, std::size_t end) const
    {
        while (i < end && isBlank(text_[i]))
            ++i;
        return i;
    }

    Expected<void> line(std::size_t start, std::size_t end)
    {
        std::size_t at = skipBlanks(start, end);
        if (at == end)
            return {};
        if (library_.templates.size() >= limits_.templates)
            return fail(at, "more than " + std::to_string(limits_.templates) + " templates",
                        "at most the limit templates", ErrorKind::Limit);
        Template piece;
        const std::size_t nameStart = at;
        const std::size_t colon = text_.substr(0, end).find(':', at);
        if (colon != std::string_view::npos)
        {
            std::size_t nameEnd = colon;
            while (nameEnd > at && isBlank(text_[nameEnd - 1]))
                --nameEnd;
            piece.name = text_.substr(at, nameEnd - at);
            const bool valid =
                !piece.name.empty() && piece.name.size() <= 256 && isLetter(piece.name[0]) &&
                std::ranges::all_of(piece.name, [](char c) { return isLetter(c) || isDigit(c) || c == '_'; });
            if (!valid && (text_[at] == '#' || text_.substr(at).starts_with("//")))
                return fail(at, "this cannot be the name of a template", "a comment to begin with %");
            if (!valid)
                return fail(at, "this cannot be the name of a template",
                            "a letter, then letters, digits or underscores, then `:`");
            at = skipBlanks(colon + 1, end);
            if (at == end)
                return fail(colon, "the template " + piece.name + " has no word",
                            "a word such as F[-FX]+FY after the colon");
        }
        else
            piece.name = romanNumeral(static_cast<std::uint32_t>(library_.templates.size() + 1));
        if (library_.find(piece.name) != library_.templates.size())
            return fail(nameStart, "the name " + piece.name + " is taken by an earlier template",
                        "a name of its own for each template");
        if (auto done = word(at, end, piece); !done)
            return done;
        library_.templates.push_back(std::move(piece));
        return {};
    }

    Expected<void> word(std::size_t at, std::size_t end, Template& piece)
    {
        std::vector<std::size_t> open;
        bool organ = false;
        for (at = skipBlanks(at, end); at < end; at = skipBlanks(at, end))
        {
            if (piece.modules.size() >= limits_.templateModules)
                return fail(at, "more than " + std::to_string(limits_.templateModules) + " symbols in one template",
                            "at most the limit templateModules", ErrorKind::Limit);
            TemplateModule module;
            module.symbol = text_[at];
            const bool isTurtle = turtleCommand(std::string_view(&module.symbol, 1)) != TurtleCommand::Nothing;
            if (!isTurtle && !(organ && isLetter(module.symbol)))
            {
                if (!(module.symbol >= 'A' && module.symbol <= 'Z'))
                    return fail(at, "`" + symbolText(at) + "` is no turtle symbol",
                                "one of F G f + - & ^ \\ / | $ ! ' % [ ] { . } ~ @, or a capital letter as an anchor");
                if (piece.anchors.find(module.symbol) != std::string::npos)
                    return fail(at, std::string("the anchor ") + module.symbol + " stands twice in one template",
                                "a letter of its own for each anchor");
                module.anchor = static_cast<std::uint32_t>(piece.anchors.size());
                piece.anchors += module.symbol;
            }
            if (organ && !isLetter(module.symbol))
                return fail(at, "`" + symbolText(at) + "` cannot name an organ", "a letter after `~`, such as ~L");
            if (module.symbol == '[')
            {
                open.push_back(at);
                if (open.size() > limits_.bracketDepth)
                    return fail(at, "brackets nest deeper than " + std::to_string(limits_.bracketDepth),
                                "at most the limit bracketDepth", ErrorKind::Limit);
            }
            if (module.symbol == ']')
            {
                if (open.empty())
                    return fail(at, "`]` without `[`", "balanced brackets");
                open.pop_back();
            }
            const std::size_t symbolAt = at++;
            if (auto done = parameter(symbolAt, at, end, organ, module); !done)
                return done;
            organ = module.symbol == '~';
            piece.modules.push_back(module);
        }
        if (organ)
            return fail(end, "the template ends in `~`, which names no organ", "a letter after `~`, such as ~L");
        if (!open.empty())
            return fail(open.back(), "`[` is never closed", "balanced brackets");
        return {};
    }

    /// The character at `at`, whole if it is a UTF-8 sequence.
    std::string symbolText(std::size_t at) const
    {
        std::size_t end = at + 1;
        while (end < text_.size() && (static_cast<unsigned char>(text_[end]) & 0xc0) == 0x80)
            ++end;
        return std::string(text_.substr(at, end - at));
    }

    Expected<void> parameter(std::size_t symbolAt, std::size_t& at, std::size_t end, bool isName,
                             TemplateModule& module)
    {
        if (at >= end || text_[at] != '(')
            return {};
        const TurtleCommand command = turtleCommand(std::string_view(&module.symbol, 1));
        using enum TurtleCommand;
        const bool isLength = command == Draw || command == Move || command == Width;
        const bool isAngle = command >= TurnLeft && command <= RollRight;
        if (isName || module.anchor != kNoAnchor || !(isLength || isAngle || command == Material))
            return fail(at, std::string("`") + text_[symbolAt] + "` takes no number",
                        "numbers only after F G f + - & ^ \\ / ! '");
        const std::size_t open = at;
        at = skipBlanks(at + 1, end);
        const bool plus = at < end && text_[at] == '+';
        const std::size_t numberAt = at + (plus ? 1 : 0);
        const auto read = std::from_chars(text_.data() + numberAt, text_.data() + end, module.number);
        const std::size_t numberEnd = static_cast<std::size_t>(read.ptr - text_.data());
        if (read.ec == std::errc::invalid_argument || (plus && text_[numberAt] == '-'))
            return fail(at, "a number is missing", "a number in parentheses, such as (30)");
        const double most = isAngle ? limits_.angleDegrees : isLength ? limits_.coordinate : 65535;
        const double least = isAngle ? -limits_.angleDegrees : 0;
        if (read.ec != std::errc{} || !(module.number >= least && module.number <= most))
            return fail(at,
                        "the number " +
                            std::string(text_.substr(numberAt, std::min<std::size_t>(numberEnd - numberAt, 40))) +
                            " is out of range",
                        "a number from " + formatNumber(least) + " to " + formatNumber(most));
        at = skipBlanks(numberEnd, end);
        if (at >= end)
            return fail(open, "`(` is never closed", "one number, then `)`");
        if (text_[at] != ')')
            return fail(at, "unexpected `" + symbolText(at) + "` after the number", "`)`");
        ++at;
        module.hasNumber = true;
        return {};
    }

    std::string_view text_;
    std::string_view file_;
    const Limits& limits_;
    TemplateLibrary library_;
};

} // namespace

Expected<TemplateLibrary> parseTemplates(std::string_view text, std::string_view file, const Limits& limits)
{
    if (text.size() > limits.fileBytes)
        return failure(ErrorKind::Limit, {std::string(file), 0, 0},
                       "the text has " + std::to_string(text.size()) + " bytes",
                       "at most " + std::to_string(limits.fileBytes) + " (the limit fileBytes)");
    if (const std::size_t invalid = findInvalidUtf8(text); invalid != std::string_view::npos)
        return failure(ErrorKind::BadInput, locate(file, text, invalid), "the text is not valid UTF-8",
                       "a file saved as UTF-8");
    return TemplatesParser(text, file, limits).parse();
}

std::string printWord(const Template& piece)
{
    std::string text;
    for (const TemplateModule& module : piece.modules)
    {
        text += module.symbol;
        if (module.hasNumber)
            text += '(' + formatNumber(module.number) + ')';
    }
    return text;
}

std::string printTemplates(const TemplateLibrary& library)
{
    std::string text;
    for (std::size_t i = 0; i < library.templates.size(); ++i)
    {
        const Template& piece = library.templates[i];
        const std::string word = printWord(piece);
        const bool cuts = word.starts_with('%'); // at the start of a line or after a blank it would begin a comment
        if (cuts || piece.name != romanNumeral(static_cast<std::uint32_t>(i + 1)))
            text += piece.name + (cuts ? ":" : ": ");
        text += word + '\n';
    }
    return text;
}

Expected<TemplateLibrary> loadTemplates(const std::filesystem::path& path, const Limits& limits)
{
    auto text = readTextFile(path, limits.fileBytes);
    if (!text)
        return tl::make_unexpected(text.error());
    return parseTemplates(*text, path.string(), limits);
}

Expected<void> saveTemplates(const std::filesystem::path& path, const TemplateLibrary& library)
{
    return writeFileAtomically(path, printTemplates(library));
}

} // namespace espalier
