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

double evaluate(const ExpressionPool& pool, ExpressionId id, ExpressionScope& scope) noexcept
{
    using enum ExpressionOp;
    const ExpressionNode& node = pool[id];
    const auto first = [&] { return evaluate(pool, node.first, scope); };
    const auto second = [&] { return evaluate(pool, node.second, scope); };
    const auto finite = [&](double value) {
        if (std::isfinite(value))
            return value;
        scope.failed = true;
        return 0.0;
    };
    const auto truth = [](bool value) { return value ? 1.0 : 0.0; };

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
    case Negate:
        return -first();
    case Plus:
        return first();
    case Not:
        return truth(first() == 0);
    case And:
        return truth(first() != 0 && second() != 0);
    case Or:
        return truth(first() != 0 || second() != 0);
    case Choose:
        return first() != 0 ? second() : evaluate(pool, node.third, scope);
    case Sin:
        return finite(math::sinCosDegrees(first()).sin);
    case Cos:
        return finite(math::sinCosDegrees(first()).cos);
    case Tan:
    {
        const math::SinCos both = math::sinCosDegrees(first());
        return finite(both.sin / both.cos);
    }
    case Asin:
        return finite(math::asin(first()) * kDegreesPerRadian);
    case Acos:
        return finite(math::acos(first()) * kDegreesPerRadian);
    case Atan:
        return finite(math::atan(first()) * kDegreesPerRadian);
    case Sqrt:
        return finite(std::sqrt(first()));
    case Exp:
        return finite(math::exp(first()));
    case Log:
        return finite(math::log(first()));
    case Abs:
        return std::abs(first());
    case Floor:
        return std::floor(first());
    case Ceil:
        return std::ceil(first());
    case Round:
        return std::round(first());
    case Sign:
    {
        const double a = first();
        return truth(a > 0) - truth(a < 0);
    }
    default:
        break;
    }

    // Two operands, evaluated left to right.
    const double a = first();
    const double b = second();
    switch (node.op)
    {
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
    case Atan2:
        return finite(math::atan2(a, b) * kDegreesPerRadian);
    case Min:
        return b < a ? b : a;
    case Max:
        return b > a ? b : a;
    case Rand:
        return finite(scope.key.uniform(Purpose::Expression, a, b, scope.draws++));
    case Normal:
        return finite(scope.key.normal(Purpose::Expression, a, b, scope.draws++));
    default:
        return 0;
    }
}

} // namespace espalier
