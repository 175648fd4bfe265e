#include <Espalier/Grammar/ExpressionCode.h>

#include <Espalier/Core/DeterministicMath.h>
#include <algorithm>
#include <array>
#include <cassert>

namespace espalier {

/// Which parts of an expression are constant, told once so that compiling stays linear in its nodes.
struct ExpressionCode::Folding
{
    const ExpressionPool& pool;
    std::span<const double> constants;
    ExpressionNeeds& needs;

    /// The value of a part that depends on nothing, or nothing. Costs its size: parts of folded parts are asked once
    /// for each level above them, at most as often as the expression is high.
    [[nodiscard]] bool constantValue(ExpressionId id, double& value) const
    {
        if (!dependsOnNothing(id))
            return false;
        ExpressionScope scope;
        scope.constants = constants.data();
        value = espalier::evaluate(pool, id, scope);
        return !scope.failed;
    }

private:
    [[nodiscard]] bool dependsOnNothing(ExpressionId id) const
    {
        using enum ExpressionOp;
        if (id == kNoExpression)
            return true;
        const ExpressionNode& node = pool[id];
        switch (node.op)
        {
        case Number:
        case Constant:
        case Pi:
            return true;
        case Parameter:
        case Transform:
        case Step:
        case Rand:
        case Normal:
            return false;
        default:
            return dependsOnNothing(node.first) && dependsOnNothing(node.second) && dependsOnNothing(node.third);
        }
    }
};

CompiledExpression ExpressionCode::compile(const ExpressionPool& pool, ExpressionId id,
                                           std::span<const double> constants, ExpressionNeeds& needs)
{
    using Form = CompiledExpression::Form;
    using enum ExpressionOp;
    const Folding folding{pool, constants, needs};
    double value = 0;
    if (folding.constantValue(id, value))
        return {Form::Constant, 0, value};
    const ExpressionNode& node = pool[id];
    if (node.op == Parameter)
        return {Form::Parameter, node.first, 0};
    // x - c is x + -c to the bit, and both operations commute.
    if (node.op == Multiply || node.op == Add || node.op == Subtract)
    {
        const Form form = node.op == Multiply ? Form::Product : Form::Sum;
        if (pool[node.first].op == Parameter && folding.constantValue(node.second, value))
            return {form, pool[node.first].first, node.op == Subtract ? -value : value};
        if (node.op != Subtract && pool[node.second].op == Parameter && folding.constantValue(node.first, value))
            return {form, pool[node.second].first, value};
    }
    const auto first = static_cast<std::uint32_t>(instructions_.size());
    deepest_ = std::max(deepest_, emit(pool, id, folding));
    double cost = 0;
    for (std::size_t i = first; i < instructions_.size(); ++i)
    {
        const ExpressionOp op = instructions_[i].op;
        const bool isFunction = instructions_[i].action == Action::Apply && (op == Modulo || op == Power || op >= Sin);
        cost += isFunction ? 64 : 4;
    }
    instructions_.push_back({});
    return {Form::Program, first, cost};
}

std::uint32_t ExpressionCode::emit(const ExpressionPool& pool, ExpressionId id, const Folding& folding)
{
    using enum ExpressionOp;
    double value = 0;
    if (folding.constantValue(id, value))
    {
        instructions_.push_back({Action::Push, Number, 0, value});
        return 1;
    }
    const ExpressionNode& node = pool[id];
    const auto jump = [&](Action action) {
        instructions_.push_back({action, node.op, 0, 0});
        return instructions_.size() - 1;
    };
    const auto land = [&](std::size_t at) {
        instructions_[at].index = static_cast<std::uint32_t>(instructions_.size());
    };
    switch (node.op)
    {
    case Parameter:
        instructions_.push_back({Action::Load, node.op, node.first, 0});
        return 1;
    case Transform:
    case Step:
        folding.needs.step |= node.op == Step;
        instructions_.push_back({Action::Apply, node.op, node.first, 0});
        return 1;
    case And:
    case Or:
    {
        const std::uint32_t first = emit(pool, node.first, folding);
        const std::size_t decided = jump(node.op == And ? Action::AndElse : Action::OrElse);
        const std::uint32_t second = emit(pool, node.second, folding);
        // The truth of the second one: !!x
        instructions_.push_back({Action::Apply, Not, 1, 0});
        instructions_.push_back({Action::Apply, Not, 1, 0});
        land(decided);
        return std::max(first, second);
    }
    case Choose:
    {
        const std::uint32_t condition = emit(pool, node.first, folding);
        const std::size_t otherwise = jump(Action::SkipUnless);
        const std::uint32_t yes = emit(pool, node.second, folding);
        const std::size_t done = jump(Action::Skip);
        land(otherwise);
        const std::uint32_t no = emit(pool, node.third, folding);
        land(done);
        return std::max({condition, yes, no});
    }
    default:
    {
        folding.needs.draws += node.op == Rand || node.op == Normal ? 1 : 0;
        std::uint32_t pending = emit(pool, node.first, folding);
        if (node.second != kNoExpression)
            pending = std::max(pending, 1 + emit(pool, node.second, folding));
        instructions_.push_back({Action::Apply, node.op, node.second == kNoExpression ? 1u : 2u, 0});
        return pending;
    }
    }
}

double ExpressionCode::run(std::uint32_t first, ExpressionScope& scope) const noexcept
{
    std::array<double, kStack> stack; // not initialised: every value is pushed before it is read
    std::size_t height = 0;
    for (const Instruction* at = instructions_.data() + first;; ++at)
    {
        assert(height < kStack);
        switch (at->action)
        {
        case Action::Push:
            stack[height++] = at->value;
            break;
        case Action::Load:
            stack[height++] = scope.parameters[at->index];
            break;
        case Action::Apply:
            if (at->op == ExpressionOp::Step)
                stack[height++] = scope.step;
            else if (at->op == ExpressionOp::Transform)
                stack[height++] = scope.transform[at->index];
            else
            {
                const double b = at->index == 2 ? stack[--height] : 0.0;
                stack[height - 1] = applyOperator(at->op, stack[height - 1], b, scope);
            }
            break;
        case Action::SkipUnless:
            if (stack[--height] == 0)
                at = instructions_.data() + at->index - 1;
            break;
        case Action::AndElse:
        case Action::OrElse:
            if ((stack[--height] != 0) == (at->action == Action::OrElse))
            {
                stack[height++] = at->action == Action::OrElse ? 1.0 : 0.0;
                at = instructions_.data() + at->index - 1;
            }
            break;
        case Action::Skip:
            at = instructions_.data() + at->index - 1;
            break;
        case Action::Return:
            return stack[0];
        }
    }
}

} // namespace espalier
