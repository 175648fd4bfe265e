#pragma once

#include <Espalier/Core/Error.h>
#include <Espalier/Core/Limits.h>
#include <Espalier/Grammar/Expression.h>
#include <Espalier/Grammar/Symbols.h>
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
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

/// Where something stands in the text it was read from, counted from 1 (columns in code points); 0 if code made it.
struct TextPlace
{
    std::uint32_t line = 0;
    std::uint32_t column = 0;
};

/// A module of a context: a symbol and the names that its parameters get. In right contexts `[` and `]` stand for the
/// beginning of a branch and for whatever is left of it.
struct ContextModule
{
    SymbolId symbol = 0;
    std::vector<std::string> parameters; ///< As many as the module must have.
    std::uint32_t column = 0;            ///< In the production's line; 0 if code made it.
};

/// `left < predecessor > right : condition -> successor : weight : ~ table(row)`
///
/// Expressions refer to parameters by number: the predecessor's come first, then those of the left context in reading
/// order, then those of the right one. All names of one production differ.
struct Production
{
    SymbolId predecessor = 0;
    std::vector<std::string> parameters;    ///< Formal parameters of the predecessor.
    std::vector<ContextModule> left;        ///< In reading order: the last one stands next to the predecessor.
    std::vector<ContextModule> right;       ///< Brackets balance.
    ExpressionId condition = kNoExpression; ///< None: always.
    ExpressionId weight = kNoExpression;    ///< None: unweighted.
    std::vector<Module> successor;
    std::string table;                ///< Table of observed transforms to draw from; empty: none.
    ExpressionId row = kNoExpression; ///< The row to take; none: one is drawn uniformly.
    TextPlace place;                  ///< Of its first symbol, be it of the left context.

    [[nodiscard]] bool hasContext() const noexcept { return !left.empty() || !right.empty(); }
};

/// Which production is taken if several match.
enum class MatchOrder : std::uint8_t
{
    ContextFirst, ///< Those without context only if none with context matches (ABOP p. 30); then as listed.
    Listed,       ///< As listed.
};

/// After each segment the turtle turns by elasticity * |H x T| radians about H x T: its heading bends towards T (ABOP
/// p. 58). T is taken as it is given, whatever its length.
struct Tropism
{
    double elasticity = 0;
    std::array<double, 3> direction{0, -1, 0};
};

/// `let name = value`
struct NamedConstant
{
    std::string name;
    ExpressionId value = kNoExpression;
};

/// A stochastic, parametric, context-sensitive L-system with its turtle defaults: the document that people write and
/// inference writes for them. Lengths in metres; angles in degrees, as in the text form that it mirrors. Brackets
/// balance in every word but the successors of `interpret: [` and `interpret: ]`.
struct Grammar
{
    SymbolTable symbols;
    ExpressionPool expressions;
    std::vector<ExpressionId> arguments;  ///< Of all modules.
    std::vector<std::string> longSymbols; ///< Declared by `symbols:`.
    std::vector<NamedConstant> constants;
    double angle = 25;            ///< Degrees; of turns without a number.
    double step = 1;              ///< Metres; of F f G without a number.
    double width = 0.1;           ///< Metres; the diameter until ! sets it.
    std::vector<SymbolId> draw;   ///< Symbols that draw a segment; F and G by default.
    std::vector<SymbolId> move;   ///< Symbols that only move; f by default.
    std::vector<SymbolId> ignore; ///< Symbols that contexts do not see; no brackets, and none that a context names.
    MatchOrder order = MatchOrder::ContextFirst;
    std::optional<Tropism> tropism;          ///< In a text, no value exceeds Limits::coordinate.
    std::optional<std::uint32_t> iterations; ///< Steps of a derivation, unless the caller says otherwise. [0, 1000000]
    std::vector<Module> axiom;
    TextPlace axiomPlace; ///< Of its first symbol.
    std::vector<Production> productions;
    std::vector<Production> interpretations; ///< `interpret:`, applied once to the derived word; without contexts.

    Grammar();
    /// Appends a module with these argument expressions to `word`.
    void append(std::vector<Module>& word, SymbolId symbol, std::initializer_list<ExpressionId> moduleArguments = {});
};

/// Equal if they print the same text.
[[nodiscard]] bool operator==(const Grammar& a, const Grammar& b);

/// Where a line and column of a grammar stand that is part of another file.
using GrammarPlace = std::function<Location(std::uint32_t line, std::uint32_t column)>;

/// Reads the text form (Content/Grammars/LANGUAGE.md). Up to 20 errors are collected, each with its line and column;
/// the Error is the first of them, and its advice lists the others. What follows from a reported mistake is not
/// reported. `file` names the text in errors; `place`, if given, says where its lines stand. Linear in the text; within
/// the limits it takes less than 256 MiB.
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
