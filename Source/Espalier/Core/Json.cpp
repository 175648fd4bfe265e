#include <Espalier/Core/Json.h>

#include <Espalier/Core/Utf8.h>

#include <algorithm>
#include <cassert>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>

namespace espalier {

namespace {

constexpr std::size_t kShownBytes = 40; ///< Of a string quoted in a message.
constexpr int kNumberOverflow = 406;    ///< nlohmann's name for 1e400.

bool isSpace(char c)
{
    return c == ' ' || c == '\t' || c == '\n' || c == '\r';
}

bool isDigit(char c)
{
    return c >= '0' && c <= '9';
}

bool isWordCharacter(char c)
{
    return isDigit(c) || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
}

bool isNumberCharacter(char c)
{
    return isDigit(c) || c == '-' || c == '+' || c == '.' || c == 'e' || c == 'E';
}

std::size_t skipSpace(std::string_view text, std::size_t at)
{
    while (at < text.size() && isSpace(text[at]))
        ++at;
    return at;
}

template <class Predicate>
std::string_view runOf(Predicate belongs, std::string_view text, std::size_t at)
{
    std::size_t end = at;
    while (end < text.size() && belongs(text[end]))
        ++end;
    return text.substr(at, end - at);
}

// The number that begins at `at`: a sign, whole digits, a fraction, an exponent. In "01" it is the 0.
std::string_view numberAt(std::string_view text, std::size_t at)
{
    std::size_t end = at;
    const auto take = [&](std::string_view characters) {
        const bool found = end < text.size() && characters.find(text[end]) != std::string_view::npos;
        end += found ? 1 : 0;
        return found;
    };
    const auto takeDigits = [&] { end += runOf(isDigit, text, end).size(); };
    take("-");
    if (!take("0"))
        takeDigits();
    if (take("."))
        takeDigits();
    if (take("eE"))
    {
        take("+-");
        takeDigits();
    }
    return text.substr(at, end - at);
}

std::string escapedControl(char c, std::string_view prefix)
{
    constexpr char kDigits[] = "0123456789abcdef";
    const auto byte = static_cast<unsigned char>(c);
    return std::string(prefix) + "00" + kDigits[byte >> 4] + kDigits[byte & 15];
}

} // namespace

// Fills a document from nlohmann's parser events. These come without positions, so a cursor of our own follows them
// through the text: what stands between two tokens is white space, a comma or a colon.
class JsonBuilder
{
public:
    JsonBuilder(JsonDocument& document, const Limits& limits) : document_(document), limits_(limits) {}

    [[nodiscard]] Expected<void> build()
    {
        const bool whole = nlohmann::json::sax_parse(text(), this);
        // To nlohmann a NUL character is the end.
        if (whole && skipSpace(text(), cursor_) < text().size())
            explain(0);
        return error_ ? Expected<void>(tl::unexpected<Error>(std::move(*error_))) : Expected<void>();
    }

    // The events, named as nlohmann calls them; false stops.
    bool null()
    {
        add(JsonDocument::Type::Null, 4);
        return !error_;
    }
    bool boolean(bool value)
    {
        const std::size_t length = value ? 4 : 5;
        add(JsonDocument::Type::Boolean, length).boolean = value;
        return !error_;
    }
    bool number_integer(std::int64_t value) { return addNumber(static_cast<double>(value)); }
    bool number_unsigned(std::uint64_t value) { return addNumber(static_cast<double>(value)); }
    bool number_float(double value, const std::string&) { return addNumber(value); }
    bool string(std::string& value)
    {
        const std::size_t start = tokenStart();
        const std::size_t length = stringEnd(start) - start;
        const std::size_t size = value.size();
        add(JsonDocument::Type::String, length).string = store(std::move(value));
        return keepsStringLimit(start, size);
    }
    bool binary(std::vector<std::uint8_t>&) { return false; } // No JSON text gives this.

    bool start_object(std::size_t) { return open(JsonDocument::Type::Object); }
    bool start_array(std::size_t) { return open(JsonDocument::Type::Array); }
    bool key(std::string& value)
    {
        keyStart_ = tokenStart();
        cursor_ = stringEnd(keyStart_);
        const std::size_t size = value.size();
        key_ = store(std::move(value));
        return keepsStringLimit(keyStart_, size);
    }
    bool end_object()
    {
        const std::uint32_t object = open_.back().node;
        close();
        return hasUniqueKeys(object);
    }
    bool end_array()
    {
        close();
        return true;
    }
    bool parse_error(std::size_t bytesRead, const std::string&, const nlohmann::detail::exception& exception)
    {
        if (exception.id == kNumberOverflow)
        {
            const std::size_t at = tokenStart();
            const std::string number = shortened(numberAt(text(), at));
            report(ErrorKind::BadInput, at, number + " is too large for a number", "at most 1.7976931348623157e+308");
        }
        else
            explain(bytesRead);
        return false;
    }

private:
    struct OpenContainer
    {
        std::uint32_t node;
        std::uint32_t lastChild;
    };

    const std::string& text() const { return document_.text_; }

    void report(ErrorKind kind, std::size_t at, std::string what, std::string expected, std::string advice = {})
    {
        error_ =
            Error{kind, std::move(what), std::move(expected), std::move(advice), locate(document_.file_, text(), at)};
    }

    std::size_t tokenStart() const
    {
        constexpr std::string_view kFirstCharacters = "{}[]\"-0123456789tfn";
        return std::min(text().find_first_of(kFirstCharacters, cursor_), text().size());
    }

    std::size_t stringEnd(std::size_t start) const
    {
        std::size_t at = start + 1;
        while (at < text().size() && text()[at] != '"')
            at += text()[at] == '\\' ? 2 : 1;
        return std::min(at + 1, text().size());
    }

    std::uint32_t store(std::string value)
    {
        document_.strings_.push_back(std::move(value));
        return static_cast<std::uint32_t>(document_.strings_.size() - 1);
    }

    // Appends a value, links it to its container and moves the cursor behind its token of `length` bytes.
    JsonDocument::Node& add(JsonDocument::Type type, std::size_t length)
    {
        auto& nodes = document_.nodes_;
        if (nodes.size() >= limits_.jsonValues && !error_)
            report(ErrorKind::Limit, tokenStart(),
                   "the file holds more than " + std::to_string(limits_.jsonValues) + " values",
                   "at most the limit jsonValues");
        const auto index = static_cast<std::uint32_t>(nodes.size());
        JsonDocument::Node node;
        node.type = type;
        node.start = static_cast<std::uint32_t>(tokenStart());
        node.keyStart = static_cast<std::uint32_t>(keyStart_);
        node.key = std::exchange(key_, JsonDocument::kNone);
        nodes.push_back(node);
        if (!open_.empty())
        {
            OpenContainer& container = open_.back();
            JsonDocument::Node& parent = nodes[container.node];
            (parent.children++ == 0 ? parent.first : nodes[container.lastChild].next) = index;
            container.lastChild = index;
        }
        cursor_ = node.start + length;
        return nodes.back();
    }

    bool addNumber(double value)
    {
        const std::string_view token = numberAt(text(), tokenStart());
        const bool negativeZero = value == 0 && token.front() == '-'; // nlohmann reads -0 as an integer.
        add(JsonDocument::Type::Number, token.size()).number = negativeZero ? -0.0 : value;
        return !error_;
    }

    bool open(JsonDocument::Type type)
    {
        if (open_.size() >= limits_.jsonDepth)
        {
            report(ErrorKind::Limit, tokenStart(), "objects and arrays are nested too deeply",
                   "at most " + std::to_string(limits_.jsonDepth) + " levels (limit jsonDepth)");
            return false;
        }
        add(type, 1);
        open_.push_back({static_cast<std::uint32_t>(document_.nodes_.size() - 1), 0});
        return !error_;
    }

    void close()
    {
        cursor_ = tokenStart() + 1;
        open_.pop_back();
    }

    bool keepsStringLimit(std::size_t start, std::size_t size)
    {
        if (size > limits_.stringBytes)
            report(ErrorKind::Limit, start, "the string has " + std::to_string(size) + " bytes",
                   "at most " + std::to_string(limits_.stringBytes) + " (limit stringBytes)");
        return !error_;
    }

    bool hasUniqueKeys(std::uint32_t object)
    {
        const auto& nodes = document_.nodes_;
        const auto keyOf = [&](std::uint32_t node) -> const std::string& {
            return document_.strings_[nodes[node].key];
        };

        std::vector<std::uint32_t> members;
        members.reserve(nodes[object].children);
        for (std::uint32_t child = nodes[object].first; child != JsonDocument::kNone; child = nodes[child].next)
            members.push_back(child);
        std::sort(members.begin(), members.end(),
                  [&](std::uint32_t a, std::uint32_t b) { return keyOf(a) != keyOf(b) ? keyOf(a) < keyOf(b) : a < b; });

        std::size_t earliest = 0;
        for (std::size_t i = 1; i < members.size(); ++i)
        {
            if (keyOf(members[i]) == keyOf(members[i - 1]) && (earliest == 0 || members[i] < members[earliest]))
                earliest = i;
        }
        if (earliest == 0)
            return true;
        const Location first = locate({}, text(), nodes[members[earliest - 1]].keyStart);
        report(ErrorKind::BadInput, nodes[members[earliest]].keyStart,
               "the key " + quoteJson(shortened(keyOf(members[earliest]))) + " stands here a second time",
               "each key once", "the first is at " + std::to_string(first.line) + ':' + std::to_string(first.column));
        return false;
    }

    // Finds out what is wrong behind the cursor, from what may stand there.
    void explain(std::size_t bytesRead)
    {
        const std::string_view all = text();
        std::size_t at = skipSpace(all, cursor_);
        const auto take = [&](char c) {
            const bool found = at < all.size() && all[at] == c;
            if (found)
                at = skipSpace(all, at + 1);
            return found;
        };

        const bool isFirst = !open_.empty() && document_.nodes_[open_.back().node].children == 0;
        const bool inObject = !open_.empty() && document_.nodes_[open_.back().node].type == JsonDocument::Type::Object;
        std::string expected = "a value";
        if (document_.nodes_.empty())
        {
            if (at == all.size())
                return report(ErrorKind::BadInput, 0, "the file is empty", "a JSON object");
        }
        else if (open_.empty())
            return unexpected(at, "the end of the file");
        else if (key_ != JsonDocument::kNone)
        {
            if (!take(':'))
                return unexpected(at, "':' after the key");
        }
        else if (!isFirst && !take(','))
            return unexpected(at, inObject ? "',' or '}'" : "',' or ']'");
        else if (inObject)
        {
            expected = isFirst ? "a key in quotes, or '}'" : "a key in quotes";
            if (at < all.size() && all[at] != '"')
                return unexpected(at, std::move(expected));
        }
        else if (isFirst)
            expected = "a value or ']'";

        // The right kind of token begins here, so the token itself is broken, or something else stands here.
        const char c = at < all.size() ? all[at] : '\0';
        if (c == '"')
            return explainString(at, bytesRead);
        if (c == '-' || isDigit(c))
            return report(ErrorKind::BadInput, at,
                          "the number " + shortened(runOf(isNumberCharacter, all, at)) + " is not complete",
                          "a number such as -1, 0.5 or 2e3");
        unexpected(at, std::move(expected));
    }

    void explainString(std::size_t start, std::size_t bytesRead)
    {
        const std::size_t end = stringEnd(start);
        const auto isControl = [](char c) { return static_cast<unsigned char>(c) < 0x20; };
        const auto begin = text().begin();
        const auto control = std::find_if(begin + static_cast<std::ptrdiff_t>(start),
                                          begin + static_cast<std::ptrdiff_t>(end), isControl);
        const auto controlAt = static_cast<std::size_t>(control - begin);
        const std::size_t stoppedAt = std::min(bytesRead, end) - std::min<std::size_t>(bytesRead, 1);
        if (controlAt < end && controlAt <= stoppedAt)
            report(ErrorKind::BadInput, controlAt,
                   "the string contains the character " + escapedControl(*control, "U+"),
                   "'\"', or the character written as " + quoteJson({&*control, 1}));
        else if (bytesRead > end || text()[end - 1] != '"')
            report(ErrorKind::BadInput, start, "the string that begins here does not end", "'\"'");
        else
            report(ErrorKind::BadInput, stoppedAt, "the string contains an unknown escape",
                   R"(\" \\ \/ \b \f \n \r \t or \u and four hexadecimal digits)");
    }

    void unexpected(std::size_t at, std::string expected)
    {
        const std::string_view all = text();
        if (at >= all.size())
            return report(ErrorKind::BadInput, at, "the file ends too early", std::move(expected));

        std::string found;
        if (static_cast<unsigned char>(all[at]) < 0x20)
            found = escapedControl(all[at], "U+");
        else if (isWordCharacter(all[at]))
            found = '\'' + shortened(runOf(isWordCharacter, all, at)) + '\'';
        else
        {
            const auto continues = [](char c) { return (static_cast<unsigned char>(c) & 0xc0u) == 0x80u; };
            found = '\'' + std::string(all.substr(at, 1 + runOf(continues, all, at + 1).size())) + '\'';
        }
        report(ErrorKind::BadInput, at, "unexpected " + found, std::move(expected));
    }

    JsonDocument& document_;
    const Limits& limits_;
    std::vector<OpenContainer> open_;
    std::size_t cursor_ = 0;
    std::size_t keyStart_ = 0;
    std::uint32_t key_ = JsonDocument::kNone; ///< The key whose value comes next.
    std::optional<Error> error_;
};

Expected<JsonDocument> JsonDocument::parse(std::string text, std::string file, const Limits& limits)
{
    const std::size_t maxBytes = std::min<std::size_t>(limits.fileBytes, kNone - 1); // Offsets have 32 bits.
    if (text.size() > maxBytes)
        return failure(ErrorKind::Limit, {std::move(file), 0, 0},
                       "the text has " + std::to_string(text.size()) + " bytes",
                       "at most " + std::to_string(maxBytes) + " (limit fileBytes)");
    if (const std::size_t offset = findInvalidUtf8(text); offset != std::string::npos)
        return failure(ErrorKind::BadInput, locate(file, text, offset), "this byte is not valid", "UTF-8 text");

    JsonDocument document;
    document.text_ = std::move(text);
    document.file_ = std::move(file);
    if (auto built = JsonBuilder(document, limits).build(); !built)
        return tl::unexpected<Error>(std::move(built.error()));
    return document;
}

JsonDocument::Type JsonDocument::Value::type() const noexcept
{
    return node().type;
}

Location JsonDocument::Value::where() const
{
    return locate(document_->file_, document_->text_, node().start);
}

Location JsonDocument::Value::whereKey() const
{
    return node().key == kNone ? where() : locate(document_->file_, document_->text_, node().keyStart);
}

tl::unexpected<Error> JsonDocument::Value::fail(std::string what, std::string expected, std::string advice) const
{
    return failure(ErrorKind::BadInput, where(), std::move(what), std::move(expected), std::move(advice));
}

std::string JsonDocument::Value::description() const
{
    switch (type())
    {
    case Type::Null:
        return "null";
    case Type::Boolean:
        return node().boolean ? "true" : "false";
    case Type::Number:
        return shortened(numberAt(document_->text_, node().start));
    case Type::String:
        return "the string " + quoteJson(shortened(document_->strings_[node().string]));
    case Type::Array:
        return "an array";
    case Type::Object:
        return "an object";
    }
    return {};
}

tl::unexpected<Error> JsonDocument::Value::wrong(std::string_view role, std::string expected) const
{
    return fail(std::string(role) + " is " + description(), std::move(expected));
}

Expected<bool> JsonDocument::Value::boolean(std::string_view role) const
{
    if (type() != Type::Boolean)
        return wrong(role, "true or false");
    return node().boolean;
}

Expected<double> JsonDocument::Value::number(std::string_view role) const
{
    if (type() != Type::Number)
        return wrong(role, "a number");
    return node().number;
}

Expected<double> JsonDocument::Value::number(std::string_view role, double low, double high) const
{
    if (type() != Type::Number || !(node().number >= low && node().number <= high))
        return wrong(role, "a number from " + formatNumber(low) + " to " + formatNumber(high));
    return node().number;
}

Expected<std::uint64_t> JsonDocument::Value::count(std::string_view role, std::uint64_t low, std::uint64_t high) const
{
    const auto fails = [&] {
        return wrong(role, "a whole number from " + std::to_string(low) + " to " + std::to_string(high));
    };
    if (type() != Type::Number)
        return fails();

    // Digits are read as they stand, because a double holds whole numbers only up to 2^53. 1e3 is a whole number too.
    const std::string_view token = numberAt(document_->text_, node().start);
    std::uint64_t value = 0;
    if (const auto parsed = std::from_chars(token.data(), token.data() + token.size(), value);
        parsed.ec != std::errc() || parsed.ptr != token.data() + token.size())
    {
        if (!(node().number >= 0 && node().number <= 0x1p53) || std::floor(node().number) != node().number)
            return fails();
        value = static_cast<std::uint64_t>(node().number);
    }
    if (value < low || value > high)
        return fails();
    return value;
}

Expected<std::string_view> JsonDocument::Value::string(std::string_view role) const
{
    if (type() != Type::String)
        return wrong(role, "a string");
    return std::string_view(document_->strings_[node().string]);
}

Expected<void> JsonDocument::Value::requireArray(std::string_view role) const
{
    if (type() != Type::Array)
        return wrong(role, "an array");
    return {};
}

Expected<void> JsonDocument::Value::requireObject(std::string_view role) const
{
    if (type() != Type::Object)
        return wrong(role, "an object");
    return {};
}

Expected<void> JsonDocument::Value::requireObject(std::string_view role,
                                                  std::initializer_list<std::string_view> keys) const
{
    return requireObject(role, std::span(keys.begin(), keys.size()));
}

Expected<void> JsonDocument::Value::requireObject(std::string_view role, std::span<const std::string_view> keys) const
{
    if (auto isObject = requireObject(role); !isObject)
        return isObject;
    for (std::uint32_t child = node().first; child != kNone; child = document_->nodes_[child].next)
    {
        const Value value(document_, child);
        if (std::find(keys.begin(), keys.end(), value.key()) != keys.end())
            continue;
        std::string known;
        for (const std::string_view key : keys)
            known.append(known.empty() ? "" : ", ").append(key);
        return failure(ErrorKind::BadInput, value.whereKey(),
                       std::string(role) + " has the unknown key " + quoteJson(shortened(value.key())),
                       keys.empty() ? "no keys" : "only " + known);
    }
    return {};
}

std::vector<JsonDocument::Value> JsonDocument::Value::items() const
{
    std::vector<Value> values;
    values.reserve(size());
    for (std::uint32_t child = node().first; child != kNone; child = document_->nodes_[child].next)
        values.push_back(Value(document_, child));
    return values;
}

std::size_t JsonDocument::Value::size() const noexcept
{
    return node().children;
}

std::string_view JsonDocument::Value::key() const noexcept
{
    return node().key == kNone ? std::string_view() : std::string_view(document_->strings_[node().key]);
}

JsonDocument::Value JsonDocument::Value::operator[](std::string_view key) const noexcept
{
    if (type() != Type::Object)
        return {};
    for (std::uint32_t child = node().first; child != kNone; child = document_->nodes_[child].next)
    {
        if (const Value value(document_, child); value.key() == key)
            return value;
    }
    return {};
}

Expected<JsonDocument::Value> JsonDocument::Value::required(std::string_view key, std::string_view expected) const
{
    const Value value = (*this)[key];
    if (!value.exists())
        return fail("the key " + quoteJson(key) + " is missing", quoteJson(key) + ": " + std::string(expected));
    return value;
}

Expected<void> JsonDocument::Value::requireFormat(std::string_view kind, std::uint64_t version) const
{
    if (auto done = requireObject("the file"); !done)
        return done;
    const auto kindValue = required("espalier", quoteJson(kind));
    if (!kindValue)
        return tl::make_unexpected(kindValue.error());
    const auto text = kindValue->string("espalier");
    if (!text)
        return tl::make_unexpected(text.error());
    if (*text != kind)
        return kindValue->fail("this is a file of the kind " + quoteJson(shortened(*text)),
                               "\"espalier\": " + quoteJson(kind));
    const auto versionValue = required("version", std::to_string(version));
    if (!versionValue)
        return tl::make_unexpected(versionValue.error());
    const auto number = versionValue->count("version", 0, 1u << 30);
    if (!number)
        return tl::make_unexpected(number.error());
    if (*number != version)
        return versionValue->fail(
            "the file has version " + std::to_string(*number) + " of the " + std::string(kind) + " format",
            "version " + std::to_string(version), *number > version ? "open it with a newer Espalier" : "");
    return {};
}

const JsonDocument::Node& JsonDocument::Value::node() const noexcept
{
    assert(exists());
    return document_->nodes_[node_];
}

std::string counted(std::size_t number, std::string_view what)
{
    return std::to_string(number).append(" ").append(what).append(number == 1 ? "" : "s");
}

std::string shortened(std::string_view text)
{
    if (text.size() <= kShownBytes)
        return std::string(text);
    std::size_t end = kShownBytes;
    while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xc0u) == 0x80u)
        --end;
    return std::string(text.substr(0, end)) + "...";
}

std::string quoteJson(std::string_view text)
{
    constexpr std::string_view kCharacters = "\"\\\b\f\n\r\t";
    constexpr std::string_view kEscapes = "\"\\bfnrt";
    std::string quoted = "\"";
    for (const char c : text)
    {
        if (const std::size_t known = kCharacters.find(c); known != std::string_view::npos)
            quoted.append({'\\', kEscapes[known]});
        else if (static_cast<unsigned char>(c) < 0x20)
            quoted += escapedControl(c, "\\u");
        else
            quoted += c;
    }
    return quoted += '"';
}

std::string formatNumber(double value)
{
    assert(std::isfinite(value));
    char buffer[32];
    const auto end = std::to_chars(buffer, buffer + sizeof buffer, value).ptr;
    return {buffer, end};
}

} // namespace espalier
