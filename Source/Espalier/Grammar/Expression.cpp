#include <Espalier/Grammar/Expression.h>

#include <Espalier/Core/DeterministicMath.h>
#include <array>
#include <cmath>

namespace espalier {

namespace {

constexpr std::array kFunctions = {
    ExpressionFunction{"sin", ExpressionOp::Sin, 1},     ExpressionFunction{"cos", ExpressionOp::Cos, 1},
    ExpressionFunction{"tan", ExpressionOp::Tan, 1},     ExpressionFunction{"asin", ExpressionOp::Asin, 1},
    ExpressionFunction{"acos", ExpressionOp::Acos, 1},   ExpressionFunction{"atan", ExpressionOp::Atan, 1},
    ExpressionFunction{"atan2", ExpressionOp::Atan2, 2}, ExpressionFunction{"sqrt", ExpressionOp::Sqrt, 1},
    ExpressionFunction{"exp", ExpressionOp::Exp, 1},     ExpressionFunction{"log", ExpressionOp::Log, 1},
    ExpressionFunction{"pow", ExpressionOp::Pow, 2},     ExpressionFunction{"abs", ExpressionOp::Abs, 1},
    ExpressionFunction{"min", ExpressionOp::Min, 2},     ExpressionFunction{"max", ExpressionOp::Max, 2},
    ExpressionFunction{"floor", ExpressionOp::Floor, 1}, ExpressionFunction{"ceil", ExpressionOp::Ceil, 1},
    ExpressionFunction{"round", ExpressionOp::Round, 1}, ExpressionFunction{"sign", ExpressionOp::Sign, 1},
    ExpressionFunction{"rand", ExpressionOp::Rand, 2},   ExpressionFunction{"normal", ExpressionOp::Normal, 2},
};

constexpr double kDegreesPerRadian = 180.0 / math::kPi;

} // namespace

std::span<const ExpressionFunction> expressionFunctions() noexcept
{
    return kFunctions;
}

double applyOperator(ExpressionOp op, double a, double b, ExpressionScope& scope) noexcept
{
    using enum ExpressionOp;
    const auto finite = [&](double value) {
        if (std::isfinite(value))
            return value;
        scope.failed = true;
        return 0.0;
    };
    const auto truth = [](bool value) { return value ? 1.0 : 0.0; };
    switch (op)
    {
    case Negate:
        return -a;
    case Plus:
        return a;
    case Not:
        return truth(a == 0);
    case Add:
        return finite(a + b);
    case Subtract:
        return finite(a - b);
    case Multiply:
        return finite(a * b);
    case Divide:
        return finite(a / b);
    case Modulo:
        return finite(std::fmod(a, b));
    case Power:
    case Pow:
        return finite(math::pow(a, b));
    case Equal:
        return truth(a == b);
    case NotEqual:
        return truth(a != b);
    case Less:
        return truth(a < b);
    case LessEqual:
        return truth(a <= b);
    case Greater:
        return truth(a > b);
    case GreaterEqual:
        return truth(a >= b);
    case Sin:
        return finite(math::sinCosDegrees(a).sin);
    case Cos:
        return finite(math::sinCosDegrees(a).cos);
    case Tan:
    {
        const math::SinCos both = math::sinCosDegrees(a);
        return finite(both.sin / both.cos);
    }
    case Asin:
        return finite(math::asin(a) * kDegreesPerRadian);
    case Acos:
        return finite(math::acos(a) * kDegreesPerRadian);
    case Atan:
        return finite(math::atan(a) * kDegreesPerRadian);
    case Atan2:
        return finite(math::atan2(a, b) * kDegreesPerRadian);
    case Sqrt:
        return finite(std::sqrt(a));
    case Exp:
        return finite(math::exp(a));
    case Log:
        return finite(math::log(a));
    case Abs:
        return std::abs(a);
    case Min:
        return b < a ? b : a;
    case Max:
        return b > a ? b : a;
    case Floor:
        return std::floor(a);
    case Ceil:
        return std::ceil(a);
    case Round:
        return std::round(a);
    case Sign:
        return truth(a > 0) - truth(a < 0);
    case Rand:
        return finite(scope.key.uniform(Purpose::Expression, a, b, scope.draws++));
    case Normal:
        return finite(scope.key.normal(Purpose::Expression, a, b, scope.draws++));
    default:
        return 0;
    }
}

double evaluate(const ExpressionPool& pool, ExpressionId id, ExpressionScope& scope) noexcept
{
    using enum ExpressionOp;
    const ExpressionNode& node = pool[id];
    const auto isTrue = [&](ExpressionId argument) { return evaluate(pool, argument, scope) != 0; };
    switch (node.op)
    {
    case Number:
        return node.value;
    case Parameter:
        return scope.parameters[node.first];
    case Constant:
        return scope.constants[node.first];
    case Transform:
        return scope.transform[node.first];
    case Step:
        return scope.step;
    case Pi:
        return math::kPi;
    case And:
        return isTrue(node.first) && isTrue(node.second) ? 1.0 : 0.0;
    case Or:
        return isTrue(node.first) || isTrue(node.second) ? 1.0 : 0.0;
    case Choose:
        return evaluate(pool, isTrue(node.first) ? node.second : node.third, scope);
    default:
        break;
    }
    const double a = evaluate(pool, node.first, scope); // left before right: draws are numbered as they come
    const double b = node.second == kNoExpression ? 0.0 : evaluate(pool, node.second, scope);
    return applyOperator(node.op, a, b, scope);
}

ExpressionId findFailure(const ExpressionPool& pool, ExpressionId id, ExpressionScope scope) noexcept
{
    if (id == kNoExpression)
        return kNoExpression;
    scope.failed = false;
    ExpressionScope whole = scope;
    (void)evaluate(pool, id, whole);
    if (!whole.failed)
        return kNoExpression;
    using enum ExpressionOp;
    const ExpressionNode& node = pool[id];
    const bool isLeaf = node.op == Number || node.op == Parameter || node.op == Constant || node.op == Transform ||
                        node.op == Step || node.op == Pi;
    if (isLeaf)
        return id;
    for (const ExpressionId argument : {node.first, node.second, node.third})
    {
        if (argument == kNoExpression)
            continue;
        ExpressionScope part = scope;
        const double value = evaluate(pool, argument, part);
        if (part.failed)
            return findFailure(pool, argument, scope);
        scope.draws = part.draws;
        // What is not evaluated cannot be what failed.
        if (argument == node.first && ((node.op == And && value == 0) || (node.op == Or && value != 0)))
            break;
        if (argument == node.first && node.op == Choose)
            return findFailure(pool, value != 0 ? node.second : node.third, scope);
    }
    return id;
}

} // namespace espalier
