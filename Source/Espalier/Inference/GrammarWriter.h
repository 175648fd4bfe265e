#pragma once

#include <Espalier/Archetype/Placement.h>
#include <Espalier/Grammar/Grammar.h>
#include <string>
#include <utility>
#include <vector>

namespace espalier {

/// Which parts of its transform a template's table ever moves: a roll of 0 everywhere need not be written.
struct TransformUse
{
    bool rotation = false;
    bool roll = false;
};

[[nodiscard]] TransformUse transformUse(const TransformTable& table);

/// The production that places a template: its word with s, r, b, o where the transform acts. `children` holds, for each
/// anchor, the module to put there; an anchor whose module has the symbol kOpenAnchor stays open.
inline constexpr SymbolId kOpenAnchor = 0xffffffffu;
[[nodiscard]] Production placingProduction(Grammar& grammar, SymbolId predecessor, const Template& piece,
                                           TransformUse use, const std::vector<Module>& children);

/// A grammar that draws with the commands the library uses, so that nonterminals may bear the others' letters.
[[nodiscard]] Grammar grammarFor(const TemplateLibrary& library);

} // namespace espalier
