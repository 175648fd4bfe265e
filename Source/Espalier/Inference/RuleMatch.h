#pragma once

#include <Espalier/Grammar/Grammar.h>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace espalier {

/// "No rule": of an edited rule, it was added; of an inferred one, it was removed.
inline constexpr std::uint32_t kNoRule = 0xffffffffu;

/// A production in parts that compare across grammars: symbols and constants by name, parameters by number, whatever
/// people call them, and no spacing.
struct RuleKey
{
    std::string head; ///< Predecessor with its number of parameters, and contexts.
    std::string condition;
    std::string weight; ///< Empty: none.
    std::string successor;
    std::string draw;            ///< Table and row.
    std::optional<double> index; ///< The k of the first `i == k` or `i >= k` in the weight; i is the first parameter.

    [[nodiscard]] std::string body() const { return head + '|' + successor + '|' + draw; }
    [[nodiscard]] std::string whole() const { return body() + '|' + condition + '|' + weight; }

    friend bool operator==(const RuleKey&, const RuleKey&) = default;
};

[[nodiscard]] RuleKey keyOf(const Grammar& grammar, const Production& production);
[[nodiscard]] std::string keyOf(const Grammar& grammar, ExpressionId expression);
[[nodiscard]] std::string keyOf(const Grammar& grammar, const std::vector<Module>& word);

/// Which rule of an edited grammar is which of the one it was made from.
struct RuleMatch
{
    std::vector<std::uint32_t> inferredOf; ///< Of each edited rule.
    std::vector<std::uint32_t> editedOf;   ///< Of each inferred rule.
};

/// Matches what is equal first, then what differs in weight and condition alone, then what still has the weight, the
/// index in it, or the transform of a rule of its symbol; what is left over on both sides of a symbol last. Each rule
/// is matched once, in order.
[[nodiscard]] RuleMatch matchRules(const Grammar& inferred, const Grammar& edited);

/// The lines of a printed grammar, which ends in a line break; they point into `text`.
[[nodiscard]] std::vector<std::string_view> linesOf(std::string_view text);

} // namespace espalier
