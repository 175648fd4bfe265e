#pragma once

#include <Espalier/Archetype/Placement.h>
#include <Espalier/Grammar/Grammar.h>
#include <string>
#include <utility>
#include <vector>

namespace espalier {

/// The turn and the roll that begin a placed template, as expressions of its production; kNoExpression: there is none,
/// and nothing is written for it.
struct PlacedDirection
{
    ExpressionId rotation = kNoExpression;
    ExpressionId roll = kNoExpression;
};

/// `r` and `o`, each only if some row of the table moves it.
[[nodiscard]] PlacedDirection directionFrom(const TransformTable& table, ExpressionPool& pool);

/// The production that places a template: its word, its lengths scaled by s, its free angles b. `children` holds, for
/// each anchor, the module to put there; an anchor whose module has the symbol kOpenAnchor stays open.
inline constexpr SymbolId kOpenAnchor = 0xffffffffu;
[[nodiscard]] Production placingProduction(Grammar& grammar, SymbolId predecessor, const Template& piece,
                                           PlacedDirection direction, const std::vector<Module>& children);

/// A grammar that draws with the commands the library uses, so that nonterminals may bear the others' letters.
[[nodiscard]] Grammar grammarFor(const TemplateLibrary& library);

} // namespace espalier
