#include <Espalier/Inference/GrammarWriter.h>

#include <Espalier/Inference/Draft.h>
#include <algorithm>

namespace espalier {

namespace {

constexpr std::uint32_t kScaling = 0;
constexpr std::uint32_t kRotation = 1;
constexpr std::uint32_t kBranching = 2;
constexpr std::uint32_t kRoll = 3;

/// The parameter of a placed symbol; kNoExpression where it has none.
ExpressionId parameterExpression(ExpressionPool& pool, const PlacedModule& module, PlacedDirection direction)
{
    using enum ParameterSource;
    const auto transform = [&](std::uint32_t index) { return pool.reference(ExpressionOp::Transform, index); };
    const auto turned = [&](ExpressionId base) {
        return direction.rotation == kNoExpression ? base : pool.binary(ExpressionOp::Add, base, direction.rotation);
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
        return direction.rotation;
    case Roll:
        return direction.roll;
    }
    return kNoExpression;
}

} // namespace

PlacedDirection directionFrom(const TransformTable& table, ExpressionPool& pool)
{
    const auto moved = [&](std::uint32_t component) {
        const bool moves = table.spread[component] != 0 ||
                           std::ranges::any_of(table.rows, [&](const auto& row) { return row[component] != 0; });
        return moves ? pool.reference(ExpressionOp::Transform, component) : kNoExpression;
    };
    return {moved(kRotation), moved(kRoll)};
}

Production placingProduction(Grammar& grammar, SymbolId predecessor, const Template& piece, PlacedDirection direction,
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
        const ExpressionId parameter = parameterExpression(grammar.expressions, module, direction);
        const bool isDirection = module.source == ParameterSource::Rotation || module.source == ParameterSource::Roll;
        if (isDirection && parameter == kNoExpression)
            continue;
        const SymbolId symbol = grammar.symbols.intern(std::string_view(&module.symbol, 1));
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
