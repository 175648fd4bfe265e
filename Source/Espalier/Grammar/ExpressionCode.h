#pragma once

#include <Espalier/Grammar/Expression.h>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

namespace espalier {

/// An expression made ready: constants folded, the commonest forms recognised, the rest a run of stack instructions in
/// the ExpressionCode that compiled it.
struct CompiledExpression
{
    enum class Form : std::uint8_t
    {
        Constant,  ///< value
        Parameter, ///< p
        Product,   ///< p * value
        Sum,       ///< p + value
        Program,   ///< instructions from `index` on
    };
    Form form = Form::Constant;
    std::uint32_t index = 0; ///< Parameter p, or the first instruction.
    double value = 0;        ///< The constant; of a Program, its cost.

    [[nodiscard]] bool isConstant() const noexcept { return form == Form::Constant; }
    /// Work of one evaluation at most, as Limits::derivationWork counts it.
    [[nodiscard]] std::uint32_t cost() const noexcept
    {
        return form == Form::Program ? static_cast<std::uint32_t>(value) : 1;
    }
};

/// What a value depends on beyond parameters and constants.
struct ExpressionNeeds
{
    bool step = false;       ///< n
    std::uint32_t draws = 0; ///< Calls of rand() and normal().
};

/// The compiled expressions of one grammar. `evaluate` gives what the tree evaluator of Expression.h gives, bit for
/// bit, without recursion (where it fails the value means nothing); neither allocates. Immutable once all is compiled;
/// share it among threads.
class ExpressionCode
{
public:
    /// Compiles expression `id`; `constants` are the values of the grammar's `let`. A part whose value is constant but
    /// not finite stays code, so that evaluating it fails. Adds to `needs`.
    [[nodiscard]] CompiledExpression compile(const ExpressionPool& pool, ExpressionId id,
                                             std::span<const double> constants, ExpressionNeeds& needs);

    [[nodiscard]] double evaluate(const CompiledExpression& expression, ExpressionScope& scope) const noexcept
    {
        double value = expression.value;
        switch (expression.form)
        {
        case CompiledExpression::Form::Constant:
            return value;
        case CompiledExpression::Form::Parameter:
            return scope.parameters[expression.index];
        case CompiledExpression::Form::Product:
            value *= scope.parameters[expression.index];
            break;
        case CompiledExpression::Form::Sum:
            value += scope.parameters[expression.index];
            break;
        case CompiledExpression::Form::Program:
            return run(expression.index, scope);
        }
        scope.failed |= !std::isfinite(value);
        return value;
    }

    /// True once an expression was compiled that nests deeper than evaluating it has room for (256 pending values);
    /// what is read under Limits::expressionDepth never does. Then `evaluate` must not be called.
    [[nodiscard]] bool isTooDeep() const noexcept { return deepest_ > kStack; }

private:
    enum class Action : std::uint8_t
    {
        Push,       ///< value
        Load,       ///< Parameter `index`.
        Apply,      ///< `op` to the topmost one or two values.
        SkipUnless, ///< Pops; if it is 0, goes on at `index`.
        AndElse,    ///< Pops; if it is 0, pushes 0 and goes on at `index`.
        OrElse,     ///< Pops; if it is not 0, pushes 1 and goes on at `index`.
        Skip,       ///< Goes on at `index`.
        Return,
    };
    struct Instruction
    {
        Action action = Action::Return;
        ExpressionOp op = ExpressionOp::Number;
        std::uint32_t index = 0;
        double value = 0;
    };
    static constexpr std::uint32_t kStack = 256;

    struct Folding;
    /// Returns how many values are pending at most while it is evaluated.
    std::uint32_t emit(const ExpressionPool& pool, ExpressionId id, const Folding& folding);
    [[nodiscard]] double run(std::uint32_t first, ExpressionScope& scope) const noexcept;

    std::vector<Instruction> instructions_;
    std::uint32_t deepest_ = 0;
};

} // namespace espalier
