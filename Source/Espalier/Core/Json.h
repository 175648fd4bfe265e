#pragma once

#include <Espalier/Core/Error.h>
#include <Espalier/Core/Limits.h>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace espalier {

/// A parsed JSON document that remembers where everything stood, so that a reader can say "line 12, column 9".
/// Strict: duplicate keys, numbers that no double holds (1e400), nesting beyond Limits::jsonDepth, strings beyond
/// Limits::stringBytes and invalid UTF-8 are errors. Values are indices into flat arrays; nothing recurses.
class JsonDocument
{
    struct Node;

public:
    enum class Type : std::uint8_t
    {
        Null,
        Boolean,
        Number,
        String,
        Array,
        Object,
    };

    /// A value of its document; valid as long as the document lives.
    class Value
    {
    public:
        [[nodiscard]] Type type() const noexcept;
        [[nodiscard]] bool isNull() const noexcept { return type() == Type::Null; }
        /// Searches the text for line ends: meant for errors, not for every value.
        [[nodiscard]] Location where() const;

        /// A failure at this value: `where: what; expected ...`.
        [[nodiscard]] tl::unexpected<Error> fail(std::string what, std::string expected, std::string advice = {}) const;

        // Typed access. Anything else is an error that names `role`: `scaling is the string "two"; expected a number`.
        [[nodiscard]] Expected<bool> boolean(std::string_view role) const;
        [[nodiscard]] Expected<double> number(std::string_view role) const;
        [[nodiscard]] Expected<double> number(std::string_view role, double low, double high) const; ///< [low, high]
        [[nodiscard]] Expected<std::uint64_t> count(std::string_view role, std::uint64_t low, std::uint64_t high) const;
        [[nodiscard]] Expected<std::string_view> string(std::string_view role) const;
        [[nodiscard]] Expected<void> requireArray(std::string_view role) const;
        /// An object whose keys are all among `keys`; an unknown one is an error that lists them.
        [[nodiscard]] Expected<void> requireObject(std::string_view role,
                                                   std::initializer_list<std::string_view> keys) const;
        [[nodiscard]] Expected<void> requireObject(std::string_view role, std::span<const std::string_view> keys) const;
        [[nodiscard]] Expected<void> requireObject(std::string_view role) const; ///< Any keys.

        /// Elements of an array, values of an object, in the file's order; empty for other types.
        [[nodiscard]] std::vector<Value> items() const;
        [[nodiscard]] std::size_t size() const noexcept;
        /// The key under which this value stands in its object; empty elsewhere.
        [[nodiscard]] std::string_view key() const noexcept;
        [[nodiscard]] Location whereKey() const;
        /// The value at `key`, or nothing (`exists()` is false).
        [[nodiscard]] Value operator[](std::string_view key) const noexcept;
        [[nodiscard]] bool exists() const noexcept { return document_ != nullptr; }
        /// The value at `key`, or an error that says it is missing.
        [[nodiscard]] Expected<Value> required(std::string_view key, std::string_view expected) const;

        /// The head of all our files: an object whose "espalier" is `kind` and whose "version" is `version`. Looked at
        /// before anything else, so that a newer file is told by its version, not by what it holds.
        [[nodiscard]] Expected<void> requireFormat(std::string_view kind, std::uint64_t version) const;

    private:
        friend class JsonDocument;
        Value() = default;
        Value(const JsonDocument* document, std::uint32_t node) : document_(document), node_(node) {}
        const Node& node() const noexcept;
        std::string description() const;
        tl::unexpected<Error> wrong(std::string_view role, std::string expected) const;

        const JsonDocument* document_ = nullptr;
        std::uint32_t node_ = 0;
    };

    /// `text` should come from readTextFile, which drops a byte order mark. `file` names it in errors.
    [[nodiscard]] static Expected<JsonDocument> parse(std::string text, std::string file, const Limits& limits);

    [[nodiscard]] Value root() const noexcept { return {this, 0}; }

private:
    struct Node
    {
        Type type = Type::Null;
        bool boolean = false;
        std::uint32_t start = 0;      ///< Byte offset of the value.
        std::uint32_t keyStart = 0;   ///< Byte offset of its key, if it has one.
        std::uint32_t key = kNone;    ///< Index into strings_.
        std::uint32_t string = kNone; ///< Index into strings_.
        std::uint32_t next = kNone;   ///< Next sibling.
        std::uint32_t first = kNone;  ///< First child.
        std::uint32_t children = 0;
        double number = 0;
    };
    static constexpr std::uint32_t kNone = 0xffffffffu;
    friend class JsonBuilder;

    std::string text_;
    std::string file_;
    std::vector<Node> nodes_;
    std::vector<std::string> strings_;
};

/// The first bytes of a text that may be long, for messages: whole characters, then "..." if something is left out.
[[nodiscard]] std::string shortened(std::string_view text);

/// `1 limb`, `2 limbs`: for messages.
[[nodiscard]] std::string counted(std::size_t number, std::string_view what);

/// `text` as a JSON string literal, quotes included. Control characters are escaped; other UTF-8 passes through.
[[nodiscard]] std::string quoteJson(std::string_view text);

/// The shortest decimal text that reads back as `value`, without exponent where that is no longer; independent of the
/// locale. Non-finite values, which no file may hold, assert.
[[nodiscard]] std::string formatNumber(double value);

} // namespace espalier
