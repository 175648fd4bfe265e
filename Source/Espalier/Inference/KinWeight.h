#pragma once

#include <Espalier/Grammar/Grammar.h>
#include <optional>

// The weights of kin's rules, and what people made of them.

namespace espalier {

/// An inferred weight `(i == k)*(1 - w) + w*c/n`: the share of the drawn limb and that of its kin.
struct KinWeight
{
    ExpressionId drawn = kNoExpression;
    ExpressionId kin = kNoExpression;
};

/// None if the weight is no sum of such shares.
[[nodiscard]] std::optional<KinWeight> kinWeight(const Grammar& grammar, ExpressionId weight);

/// By what factors an edited weight differs from the inferred one.
struct WeightFactors
{
    double drawn = 1;
    double kin = 1;
};

/// The factors, if the edited weight is a sum of multiples of the inferred one's two shares, however it is written:
/// checked at some values of w, where limb k was drawn and where another was.
/// None if it is none, or asks for more than whether limb `index` was drawn.
[[nodiscard]] std::optional<WeightFactors> weightFactors(const Grammar& base, const KinWeight& inferred, double index,
                                                         const Grammar& ours, ExpressionId edited);

} // namespace espalier
