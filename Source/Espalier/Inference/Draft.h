#pragma once

#include <Espalier/Archetype/Archetype.h>
#include <cstdint>
#include <string>
#include <vector>

namespace espalier {

/// "No template": an open anchor, an empty rule, the start rule.
inline constexpr std::uint32_t kNoPiece = 0xffffffffu;

/// A drawn tree whose open anchors are nodes too, in breadth-first order. Children of a node lie together.
struct DraftTree
{
    struct Node
    {
        std::uint32_t piece = kNoPiece; ///< Index into the library; kNoPiece: an open anchor.
        std::uint32_t firstChild = 0;   ///< As many as the template has anchors.
        InstanceTransform transform;
    };
    std::vector<Node> nodes;
    std::uint32_t roots = 0; ///< The first nodes.
};

/// One rule of a draft: its right-hand side is a template's word with symbols at the anchors; the start symbol's rules
/// name a symbol alone.
struct DraftRule
{
    std::uint32_t symbol = 0;
    std::uint32_t piece = kNoPiece;
    std::vector<std::uint32_t> children; ///< Symbols at the template's anchors.
    std::uint32_t uses = 1;              ///< How often the drawn trees apply it.
};

/// A grammar under construction. Symbol 0 is the start symbol S.
struct DraftGrammar
{
    std::vector<std::string> names; ///< Of each symbol.
    std::vector<DraftRule> rules;   ///< In symbol order.
};

/// Names of nonterminals: S (S0 if it is taken), then A B C ... Z a b ... z without S and without the symbols in
/// `taken`, then A1 B1 ... and so on.
[[nodiscard]] std::vector<std::string> nonterminalNames(std::size_t count, std::string_view taken);

/// The turtle symbols that the words of a library use.
[[nodiscard]] std::string symbolsUsed(const TemplateLibrary& library);

/// `A -> F[-FB][FC]+FD`; numbers of the templates included, `_` for the empty word.
[[nodiscard]] std::string printRule(const DraftGrammar& draft, const DraftRule& rule, const TemplateLibrary& library);

/// All rules, one a line.
[[nodiscard]] std::string printDraft(const DraftGrammar& draft, const TemplateLibrary& library);

} // namespace espalier
