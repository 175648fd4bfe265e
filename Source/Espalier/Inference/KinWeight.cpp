#include <Espalier/Inference/KinWeight.h>

#include <Espalier/Inference/RuleMatch.h>
#include <cmath>
#include <string>
#include <vector>

namespace espalier {

std::optional<KinWeight> kinWeight(const Grammar& grammar, ExpressionId weight)
{
    Production production;
    production.weight = weight;
    if (weight == kNoExpression || grammar.expressions[weight].op != ExpressionOp::Add ||
        !keyOf(grammar, production).index)
        return {};
    return KinWeight{grammar.expressions[weight].first, grammar.expressions[weight].second};
}

namespace {

/// Values of all constants, that of `w` replaced.
std::vector<double> constantsWith(const Grammar& grammar, double w)
{
    std::vector<double> values(grammar.constants.size());
    for (std::size_t i = 0; i < values.size(); ++i)
    {
        ExpressionScope scope;
        scope.constants = values.data();
        values[i] =
            grammar.constants[i].name == "w" ? w : evaluate(grammar.expressions, grammar.constants[i].value, scope);
    }
    return values;
}

/// Of an expression that knows no parameter but the first.
double valueAt(const Grammar& grammar, ExpressionId id, double i, const std::vector<double>& constants)
{
    ExpressionScope scope;
    scope.parameters = &i;
    scope.constants = constants.data();
    return evaluate(grammar.expressions, id, scope);
}

/// Whether an expression is the same wherever `meant` (its key) is, that is whether the limb or another was drawn: it
/// asks for nothing else, and draws nothing.
bool dependsOnlyOn(const Grammar& grammar, ExpressionId id, const std::string& meant)
{
    using enum ExpressionOp;
    if (id == kNoExpression || keyOf(grammar, id) == meant)
        return true;
    const ExpressionNode& node = grammar.expressions[id];
    if (node.op == Number || node.op == Constant)
        return true;
    if (node.op < Negate || node.op == Rand || node.op == Normal) // parameters, transforms, the step; chance
        return false;
    return dependsOnlyOn(grammar, node.first, meant) && dependsOnlyOn(grammar, node.second, meant) &&
           dependsOnlyOn(grammar, node.third, meant);
}

} // namespace

std::optional<WeightFactors> weightFactors(const Grammar& base, const KinWeight& inferred, double index,
                                           const Grammar& ours, ExpressionId edited)
{
    constexpr double kOther = -1;
    constexpr double kTolerance = 1e-9;
    const std::string meant = keyOf(base, base.expressions[inferred.drawn].first);
    if (!dependsOnlyOn(base, inferred.drawn, meant) || !dependsOnlyOn(base, inferred.kin, meant) ||
        !dependsOnlyOn(ours, edited, meant))
        return {};
    std::optional<WeightFactors> factors;
    for (const double w : {0.25, 0.5, 0.8125})
    {
        const std::vector<double> baseConstants = constantsWith(base, w);
        const std::vector<double> ourConstants = constantsWith(ours, w);
        const double kin = valueAt(base, inferred.kin, index, baseConstants);
        const double drawn = valueAt(base, inferred.drawn, index, baseConstants);
        if (!(kin > 0 && drawn > 0))
            return {};
        WeightFactors now;
        now.kin = valueAt(ours, edited, kOther, ourConstants) / kin;
        now.drawn = (valueAt(ours, edited, index, ourConstants) - now.kin * kin) / drawn;
        for (double* factor : {&now.kin, &now.drawn})
        {
            *factor = std::round(*factor * 1e12) / 1e12; // 2, not 2.0000000000000004
            if (!(*factor >= 0 && *factor < 1e9))
                return {};
        }
        if (factors && (std::abs(factors->kin - now.kin) > kTolerance * (1 + now.kin) ||
                        std::abs(factors->drawn - now.drawn) > kTolerance * (1 + now.drawn)))
            return {};
        factors = factors.value_or(now);
    }
    return factors;
}

} // namespace espalier
