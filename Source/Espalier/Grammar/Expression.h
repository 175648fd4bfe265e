#pragma once

#include <Espalier/Core/Random.h>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace espalier {

/// What one node of an expression does. Arguments are other nodes of the same pool.
enum class ExpressionOp : std::uint8_t
{
    Number,    ///< `value`
    Parameter, ///< Parameter `first` of the production: its predecessor's, then those of its contexts.
    Constant,  ///< Constant `first` of the grammar (`let`).
    Transform, ///< Component `first` of the drawn transform: 0 s, 1 r, 2 b, 3 o.
    Step,      ///< n, the number of the derivation step.
    Pi,

    Negate,
    Plus, ///< Unary +, kept so that a printed grammar reads back the same.
    Not,

    Add,
    Subtract,
    Multiply,
    Divide,
    Modulo,
    Power,
    Equal,
    NotEqual,
    Less,
    LessEqual,
    Greater,
    GreaterEqual,
    And,
    Or,
    Choose, ///< first ? second : third

    // Functions; angles in degrees.
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
    Atan2,
    Sqrt,
    Exp,
    Log,
    Pow,
    Abs,
    Min,
    Max,
    Floor,
    Ceil,
    Round,
    Sign,
    Rand,
    Normal,
};

/// Index of an expression's topmost node in its pool.
using ExpressionId = std::uint32_t;
inline constexpr ExpressionId kNoExpression = 0xffffffffu;

struct ExpressionNode
{
    ExpressionOp op = ExpressionOp::Number;
    std::uint32_t first = kNoExpression;
    std::uint32_t second = kNoExpression;
    std::uint32_t third = kNoExpression;
    double value = 0;
    /// Where it begins in its line of text, from 1; 0 if code made it. Parentheses belong to what they are an operand
    /// of.
    std::uint32_t column = 0;
};

/// A function of the expression language.
struct ExpressionFunction
{
    std::string_view name;
    ExpressionOp op;
    std::uint32_t arguments;
};

/// All functions, in no particular order.
[[nodiscard]] std::span<const ExpressionFunction> expressionFunctions() noexcept;

/// The expressions of one grammar in one flat array; arguments come before the nodes that use them.
class ExpressionPool
{
public:
    ExpressionId number(double value)
    {
        return add({ExpressionOp::Number, kNoExpression, kNoExpression, kNoExpression, value});
    }
    ExpressionId add(const ExpressionNode& node)
    {
        nodes_.push_back(node);
        return static_cast<ExpressionId>(nodes_.size() - 1);
    }
    ExpressionId unary(ExpressionOp op, ExpressionId a) { return add({op, a, kNoExpression, kNoExpression, 0}); }
    ExpressionId binary(ExpressionOp op, ExpressionId a, ExpressionId b) { return add({op, a, b, kNoExpression, 0}); }
    /// A reference to parameter, constant or transform component `index`.
    ExpressionId reference(ExpressionOp op, std::uint32_t index)
    {
        return add({op, index, kNoExpression, kNoExpression, 0});
    }

    [[nodiscard]] const ExpressionNode& operator[](ExpressionId id) const { return nodes_[id]; }
    [[nodiscard]] std::uint32_t size() const noexcept { return static_cast<std::uint32_t>(nodes_.size()); }

private:
    std::vector<ExpressionNode> nodes_;
};

/// What an expression may refer to while it is evaluated.
struct ExpressionScope
{
    const double* parameters = nullptr;
    const double* constants = nullptr;
    const double* transform = nullptr; ///< Four values, or null outside a successor with a table.
    double step = 0;
    RandomKey key{Seed{}};   ///< Where rand() and normal() draw.
    std::uint32_t draws = 0; ///< Counts them.
    bool failed = false;     ///< Set when a division by zero or another non-finite result occurred.
};

/// What an operator or function of one or two arguments gives. A non-finite result sets `scope.failed` and is 0
/// instead; rand() and normal() draw at scope.key. Not for leaves, && || ?:.
[[nodiscard]] double applyOperator(ExpressionOp op, double a, double b, ExpressionScope& scope) noexcept;

/// The topmost node whose own evaluation fails, below `id`; kNoExpression if none does. For messages.
[[nodiscard]] ExpressionId findFailure(const ExpressionPool& pool, ExpressionId id, ExpressionScope scope) noexcept;

/// The value of expression `id`. Sets `scope.failed` instead of giving a non-finite result; && || ?: evaluate only what
/// they need. Recurses at most Limits::expressionDepth deep; does not allocate.
[[nodiscard]] double evaluate(const ExpressionPool& pool, ExpressionId id, ExpressionScope& scope) noexcept;

} // namespace espalier
