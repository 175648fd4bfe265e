#include <Espalier/Core/Json.h>
#include <Espalier/Grammar/Grammar.h>

#include <Espalier/Grammar/SymbolWriter.h>
#include <algorithm>
#include <cmath>

namespace espalier {

namespace {

/// How tightly an operator binds; its spelling if it stands between two operands.
struct Binding
{
    int precedence;
    std::string_view between = {};
};

constexpr int kPrimary = 10;

Binding bindingOf(const ExpressionNode& node)
{
    using enum ExpressionOp;
    switch (node.op)
    {
    case Choose:
        return {1};
    case Or:
        return {2, "||"};
    case And:
        return {3, "&&"};
    case Equal:
        return {4, "=="};
    case NotEqual:
        return {4, "!="};
    case Less:
        return {5, "<"};
    case LessEqual:
        return {5, "<="};
    case Greater:
        return {5, ">"};
    case GreaterEqual:
        return {5, ">="};
    case Add:
        return {6, "+"};
    case Subtract:
        return {6, "-"};
    case Multiply:
        return {7, "*"};
    case Divide:
        return {7, "/"};
    case Modulo:
        return {7, "%"};
    case Negate:
    case Plus:
    case Not:
        return {8};
    case Power:
        return {9, "^"};
    case Number:
        return {std::signbit(node.value) ? 8 : kPrimary};
    default:
        return {kPrimary};
    }
}

struct Printer
{
    const Grammar& grammar;
    std::vector<std::string_view> parameters = {}; ///< What expressions call them.
    std::string out = {};
    SymbolWriter symbols{grammar.longSymbols};

    void enter(const Production& production)
    {
        parameters.assign(production.parameters.begin(), production.parameters.end());
        for (const auto* context : {&production.left, &production.right})
            for (const ContextModule& module : *context)
                parameters.insert(parameters.end(), module.parameters.begin(), module.parameters.end());
    }

    void expression(ExpressionId id, int atLeast)
    {
        using enum ExpressionOp;
        const ExpressionNode& node = grammar.expressions[id];
        const Binding binding = bindingOf(node);
        const bool parentheses = binding.precedence < atLeast;
        if (parentheses)
            out += '(';
        switch (node.op)
        {
        case Number:
            out += formatNumber(node.value);
            break;
        case Parameter:
            out +=
                node.first < parameters.size() ? std::string(parameters[node.first]) : "p" + std::to_string(node.first);
            break;
        case Constant:
            out += grammar.constants[node.first].name;
            break;
        case Transform:
            out += "srbo"[node.first];
            break;
        case Step:
            out += 'n';
            break;
        case Pi:
            out += "pi";
            break;
        case Negate:
        case Plus:
        case Not:
            out += node.op == Negate ? '-' : node.op == Plus ? '+' : '!';
            expression(node.first, 8);
            break;
        case Choose:
            expression(node.first, 2);
            out += " ? ";
            expression(node.second, 1);
            out += " : ";
            expression(node.third, 1);
            break;
        case Power:
            expression(node.first, kPrimary);
            out += '^';
            expression(node.second, 8);
            break;
        default:
            if (!binding.between.empty())
            {
                expression(node.first, binding.precedence);
                out += binding.between;
                expression(node.second, binding.precedence + 1);
            }
            else
                function(node);
        }
        if (parentheses)
            out += ')';
    }

    void function(const ExpressionNode& node)
    {
        const auto functions = expressionFunctions();
        const auto found = std::ranges::find(functions, node.op, &ExpressionFunction::op);
        out += found->name;
        out += '(';
        expression(node.first, 1);
        if (found->arguments > 1)
        {
            out += ", ";
            expression(node.second, 1);
        }
        out += ')';
    }

    void symbol(SymbolId id) { symbols.write(out, grammar.symbols.name(id)); }

    void word(const std::vector<Module>& modules)
    {
        for (const Module& module : modules)
        {
            symbol(module.symbol);
            if (module.argumentCount == 0)
                continue;
            out += '(';
            for (std::uint32_t i = 0; i < module.argumentCount; ++i)
            {
                if (i > 0)
                    out += ", ";
                expression(grammar.arguments[module.firstArgument + i], 1);
            }
            out += ')';
        }
    }

    void formalParameters(const std::vector<std::string>& names)
    {
        for (std::size_t i = 0; i < names.size(); ++i)
            out += (i == 0 ? "(" : ", ") + names[i];
        if (!names.empty())
            out += ')';
    }

    void context(const std::vector<ContextModule>& modules)
    {
        for (const ContextModule& module : modules)
        {
            symbol(module.symbol);
            formalParameters(module.parameters);
        }
        // A lone `*` is refused, for elsewhere it means "any neighbour".
        if (modules.size() == 1 && modules[0].parameters.empty() && grammar.symbols.name(modules[0].symbol) == "*")
            out += "()";
    }

    void productionText(const Production& p)
    {
        enter(p);
        if (!p.left.empty())
        {
            context(p.left);
            out += " < ";
        }
        out += grammar.symbols.name(p.predecessor);
        formalParameters(p.parameters);
        if (!p.right.empty())
        {
            out += " > ";
            context(p.right);
        }
        if (p.condition != kNoExpression)
        {
            out += " : ";
            expression(p.condition, 1);
        }
        out += " -> ";
        if (p.successor.empty())
            out += '_';
        else
            word(p.successor);
        if (p.weight != kNoExpression)
        {
            out += " : ";
            expression(p.weight, 1);
        }
        if (!p.table.empty())
        {
            out += " : ~ " + p.table;
            if (p.row != kNoExpression)
            {
                out += '(';
                expression(p.row, 1);
                out += ')';
            }
        }
    }

    void symbolSetting(std::string_view name, const std::vector<SymbolId>& ids)
    {
        out += name;
        for (const SymbolId id : ids)
            out += ' ' + grammar.symbols.name(id);
        out += '\n';
    }
};

} // namespace

std::string printWord(const Grammar& grammar, const std::vector<Module>& word, const Production* scope)
{
    Printer printer{grammar};
    if (scope)
        printer.enter(*scope);
    printer.word(word);
    return printer.out;
}

std::string printProduction(const Grammar& grammar, const Production& production)
{
    Printer printer{grammar};
    printer.productionText(production);
    return printer.out;
}

std::string printGrammar(const Grammar& grammar)
{
    const Grammar defaults;
    const auto sameSymbols = [&](const std::vector<SymbolId>& mine, const std::vector<SymbolId>& theirs) {
        return std::ranges::equal(
            mine, theirs, {}, [&](SymbolId id) { return grammar.symbols.name(id); },
            [&](SymbolId id) { return defaults.symbols.name(id); });
    };

    Printer printer{grammar};
    std::string& out = printer.out;
    if (!grammar.longSymbols.empty())
    {
        out += "symbols:";
        for (const std::string& name : grammar.longSymbols)
            out += ' ' + name;
        out += '\n';
    }
    for (const NamedConstant& constant : grammar.constants)
    {
        out += "let " + constant.name + " = ";
        printer.expression(constant.value, 1);
        out += '\n';
    }
    if (grammar.angle != defaults.angle)
        out += "angle: " + formatNumber(grammar.angle) + '\n';
    if (grammar.step != defaults.step)
        out += "step: " + formatNumber(grammar.step) + '\n';
    if (grammar.width != defaults.width)
        out += "width: " + formatNumber(grammar.width) + '\n';
    if (!sameSymbols(grammar.draw, defaults.draw))
        printer.symbolSetting("draw:", grammar.draw);
    if (!sameSymbols(grammar.move, defaults.move))
        printer.symbolSetting("move:", grammar.move);
    if (!grammar.ignore.empty())
        printer.symbolSetting("ignore:", grammar.ignore);
    if (grammar.order == MatchOrder::Listed)
        out += "order: listed\n";
    if (grammar.tropism)
    {
        out += "tropism: " + formatNumber(grammar.tropism->elasticity);
        for (const double component : grammar.tropism->direction)
            out += ' ' + formatNumber(component);
        out += '\n';
    }
    if (grammar.iterations)
        out += "iterations: " + std::to_string(*grammar.iterations) + '\n';
    out += "axiom: ";
    printer.word(grammar.axiom);
    out += '\n';
    for (const Production& production : grammar.productions)
    {
        printer.productionText(production);
        out += '\n';
    }
    for (const Production& production : grammar.interpretations)
    {
        out += "interpret: ";
        printer.productionText(production);
        out += '\n';
    }
    return out;
}

bool operator==(const Grammar& a, const Grammar& b)
{
    return printGrammar(a) == printGrammar(b);
}

Grammar::Grammar()
{
    draw = {symbols.intern("F"), symbols.intern("G")};
    move = {symbols.intern("f")};
}

void Grammar::append(std::vector<Module>& word, SymbolId symbol, std::initializer_list<ExpressionId> moduleArguments)
{
    word.push_back(
        {symbol, static_cast<std::uint32_t>(arguments.size()), static_cast<std::uint32_t>(moduleArguments.size())});
    arguments.insert(arguments.end(), moduleArguments);
}

} // namespace espalier
