#pragma once

#include <Espalier/Core/Error.h>
#include <Espalier/Core/Limits.h>
#include <Espalier/Grammar/Expression.h>
#include <Espalier/Grammar/Symbols.h>
#include <array>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace espalier {

/// A symbol with its arguments, as it stands in an axiom or a successor.
struct Module
{
    SymbolId symbol = 0;
    std::uint32_t firstArgument = 0; ///< Into Grammar::arguments.
    std::uint32_t argumentCount = 0;
};

/// `predecessor : condition -> successor : weight : ~ table(row)`
struct Production
{
    SymbolId predecessor = 0;
    std::vector<std::string> parameters;    ///< Formal parameters of the predecessor.
    ExpressionId condition = kNoExpression; ///< None: always.
    ExpressionId weight = kNoExpression;    ///< None: unweighted.
    std::vector<Module> successor;
    std::string table;                ///< Table of observed transforms to draw from; empty: none.
    ExpressionId row = kNoExpression; ///< The row to take; none: one is drawn uniformly.
    std::uint32_t line = 0;           ///< In the text it was read from; 0 if it was made by code.
};

/// `let name = value`
struct NamedConstant
{
    std::string name;
    ExpressionId value = kNoExpression;
};

/// A context-free stochastic parametric L-system with its turtle defaults: the document that a designer reads and
/// edits. Lengths in metres; angles in degrees, as in the text form that it mirrors. Brackets balance in every word.
struct Grammar
{
    SymbolTable symbols;
    ExpressionPool expressions;
    std::vector<ExpressionId> arguments;  ///< Of all modules.
    std::vector<std::string> longSymbols; ///< Declared by `symbols:`.
    std::vector<NamedConstant> constants;
    double angle = 25;          ///< Degrees; of turns without a number.
    double step = 1;            ///< Metres; of F f G without a number.
    double width = 0.1;         ///< Metres; the diameter until ! sets it.
    std::vector<SymbolId> draw; ///< Symbols that draw a segment; F and G by default.
    std::vector<SymbolId> move; ///< Symbols that only move; f by default.
    std::vector<Module> axiom;
    std::vector<Production> productions;

    Grammar();
    /// Appends a module with these argument expressions to `word`.
    void append(std::vector<Module>& word, SymbolId symbol, std::initializer_list<ExpressionId> moduleArguments = {});
};

/// Equal if they print the same text.
[[nodiscard]] bool operator==(const Grammar& a, const Grammar& b);

/// Where a line and column of a grammar stand that is part of another file.
using GrammarPlace = std::function<Location(std::uint32_t line, std::uint32_t column)>;

/// Reads the text form (DESIGN 6) of a context-free grammar. Up to 20 errors are collected, each with its line and
/// column; the Error is the first of them, and its advice lists the others. What only other L-systems have (contexts,
/// interpret:, ignore:, order:, tropism:) is refused by name. `file` names the text in errors; `place`, if given, says
/// where its lines stand.
[[nodiscard]] Expected<Grammar> parseGrammar(std::string_view text, std::string_view file, const Limits& limits,
                                             const GrammarPlace& place = {});

/// The text form, ending in a line break. parseGrammar(printGrammar(g)) == g.
[[nodiscard]] std::string printGrammar(const Grammar& grammar);

/// One word or production as text, for traces and messages.
[[nodiscard]] std::string printWord(const Grammar& grammar, const std::vector<Module>& word,
                                    const Production* scope = nullptr);
[[nodiscard]] std::string printProduction(const Grammar& grammar, const Production& production);

/// A table of observed transforms: what the drawn instances of one template looked like. Rows stay together, so what
/// was drawn together is grown together; then each component is smoothed by a triangular kernel of its spread.
struct TransformTable
{
    std::string name;
    std::vector<std::array<double, 4>> rows; ///< scaling, rotation, branching angle, roll (degrees).
    /// Standard deviation of the smoothing: of the scaling as a share of it, [0, 0.4]; of the angles in degrees. 0:
    /// exactly the row.
    std::array<double, 4> spread{};

    friend bool operator==(const TransformTable&, const TransformTable&) = default;
};

} // namespace espalier
