#include <Espalier/Inference/GrammarWriter.h>

#include <Espalier/Inference/Draft.h>
#include <algorithm>

namespace espalier {

TransformUse transformUse(const TransformTable& table)
{
    const auto moves = [&](std::size_t component) {
        return table.spread[component] != 0 ||
               std::ranges::any_of(table.rows, [&](const auto& row) { return row[component] != 0; });
    };
    return {moves(1), moves(3)};
}

namespace {

constexpr std::uint32_t kScaling = 0;
constexpr std::uint32_t kRotation = 1;
constexpr std::uint32_t kBranching = 2;
constexpr std::uint32_t kRoll = 3;

/// The parameter of a placed symbol as an expression of s, r, b, o; kNoExpression where it has none.
ExpressionId parameterExpression(ExpressionPool& pool, const PlacedModule& module, bool rotates)
{
    using enum ParameterSource;
    const auto transform = [&](std::uint32_t index) { return pool.reference(ExpressionOp::Transform, index); };
    const auto turned = [&](ExpressionId base) {
        return rotates ? pool.binary(ExpressionOp::Add, base, transform(kRotation)) : base;
    };
    switch (module.source)
    {
    case None:
        return kNoExpression;
    case Number:
        return pool.number(module.number);
    case Scaled:
    {
        if (module.number == 1)
            return transform(kScaling);
        const ExpressionId number = pool.number(module.number);
        return pool.binary(ExpressionOp::Multiply, number, transform(kScaling));
    }
    case Branching:
        return transform(kBranching);
    case BranchingTurned:
        return turned(transform(kBranching));
    case NumberTurned:
        return turned(pool.number(module.number));
    case Rotation:
        return transform(kRotation);
    case Roll:
        return transform(kRoll);
    }
    return kNoExpression;
}

} // namespace

Production placingProduction(Grammar& grammar, SymbolId predecessor, const Template& piece, TransformUse use,
                             const std::vector<Module>& children)
{
    Production production;
    production.predecessor = predecessor;
    production.table = piece.name;
    for (const PlacedModule& module : placeTemplate(piece))
    {
        if (module.anchor != kNoAnchor)
        {
            if (children[module.anchor].symbol != kOpenAnchor)
                production.successor.push_back(children[module.anchor]);
            continue;
        }
        if ((module.source == ParameterSource::Rotation && !use.rotation) ||
            (module.source == ParameterSource::Roll && !use.roll))
            continue;
        const SymbolId symbol = grammar.symbols.intern(std::string_view(&module.symbol, 1));
        const ExpressionId parameter = parameterExpression(grammar.expressions, module, use.rotation);
        if (parameter == kNoExpression)
            grammar.append(production.successor, symbol);
        else
            grammar.append(production.successor, symbol, {parameter});
    }
    return production;
}

Grammar grammarFor(const TemplateLibrary& library)
{
    Grammar grammar;
    const std::string used = symbolsUsed(library);
    const auto keepUsed = [&](std::vector<SymbolId>& ids) {
        std::erase_if(ids, [&](SymbolId id) { return used.find(grammar.symbols.name(id)) == std::string::npos; });
    };
    keepUsed(grammar.draw);
    keepUsed(grammar.move);
    return grammar;
}

} // namespace espalier
