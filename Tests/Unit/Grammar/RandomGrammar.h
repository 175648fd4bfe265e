#pragma once

#include <Espalier/Core/Random.h>
#include <Espalier/Grammar/Grammar.h>
#include <algorithm>
#include <array>
#include <initializer_list>
#include <string>
#include <string_view>
#include <vector>

namespace espalier::samples {

/// What a random grammar may use.
struct RandomGrammarOptions
{
    bool contexts = true;        ///< Contexts, and symbols that they ignore.
    bool interpretations = true; ///< `interpret:` productions.
};

/// Writes grammars that use everything the text form has. Each is sound: brackets balance, names are known where they
/// stand, contexts name no ignored symbol; nothing says that its expressions have values or its derivation an end.
class RandomGrammar
{
public:
    explicit RandomGrammar(std::uint64_t seed, RandomGrammarOptions options = {}) : key_(Seed{seed}), options_(options)
    {}

    Grammar make()
    {
        if (chance(0.5))
            for (const char* name : {"Bud", "B", "Twig", "Tw_", "Tw_A", "F1", "nn"})
                if (chance(0.6))
                    g_.longSymbols.emplace_back(name);
        for (const char* name : {"q", "Big", "s", "k_1"})
            if (chance(0.5))
            {
                const ExpressionId value = expression(2);
                g_.constants.push_back({name, value});
            }
        g_.angle = chance(0.5) ? std::min(number(), 3600.0) : g_.angle;
        g_.step = chance(0.5) ? number() : g_.step;
        g_.width = chance(0.5) ? number() : g_.width;
        if (chance(0.4))
            g_.draw = symbols();
        if (chance(0.4))
            g_.move = symbols();
        if (chance(0.3))
            g_.order = MatchOrder::Listed;
        if (chance(0.3))
            g_.tropism = Tropism{signedNumber(), {signedNumber(), signedNumber(), signedNumber()}};
        if (chance(0.3))
            g_.iterations = static_cast<std::uint32_t>(below(chance(0.5) ? 10 : 1000001));
        g_.axiom = word();
        const std::uint64_t productions = below(6);
        for (std::uint64_t i = 0; i < productions; ++i)
            g_.productions.push_back(production());
        if (options_.interpretations && chance(0.5))
            for (std::uint64_t i = below(3); i > 0; --i)
                g_.interpretations.push_back(interpretation());
        if (options_.contexts && chance(0.5))
            for (const SymbolId id : symbols())
                if (!isInContext(id))
                    g_.ignore.push_back(id);
        return std::move(g_);
    }

private:
    std::uint64_t below(std::uint64_t count) { return key_.below(Purpose::Sampling, count, counter_++); }
    bool chance(double share) { return key_.uniform(Purpose::Sampling, counter_++) < share; }

    double number()
    {
        constexpr std::array kNumbers = {0.0,   1.0,    2.0,  0.1,    1.0 / 3,           25.7,
                                         137.5, 3600.0, 1e-7, 5e-324, 12345.678901234567};
        return kNumbers[below(kNumbers.size())];
    }

    double signedNumber() { return chance(0.5) ? number() : -number(); }

    SymbolId symbol()
    {
        if (!g_.longSymbols.empty() && chance(0.4))
            return g_.symbols.intern(g_.longSymbols[below(g_.longSymbols.size())]);
        constexpr std::array kSymbols = {
            "A", "B", "T", "w", "i", "g", "F", "G", "f", "1", "0", "+", "-", "&",  "^", "/",        "\\",
            "|", "$", "!", "'", "%", "{", ".", "}", "~", "@", "=", "*", "?", "\"", ";", "\xc3\xa4", "\xf0\x9f\x8c\xb3"};
        return g_.symbols.intern(kSymbols[below(kSymbols.size())]);
    }

    std::vector<SymbolId> symbols()
    {
        std::vector<SymbolId> ids;
        while (chance(0.6))
            ids.push_back(symbol());
        return ids;
    }

    std::vector<Module> word()
    {
        std::vector<Module> modules;
        std::uint64_t open = 0;
        const std::uint64_t length = below(12);
        for (std::uint64_t i = 0; i < length; ++i)
        {
            if (chance(0.15))
            {
                g_.append(modules, g_.symbols.intern("["));
                ++open;
            }
            if (open > 0 && chance(0.15))
            {
                g_.append(modules, g_.symbols.intern("]"));
                --open;
            }
            const SymbolId id = symbol();
            if (chance(0.6))
                g_.append(modules, id);
            else if (chance(0.5))
                g_.append(modules, id, {expression(4)});
            else
            {
                const ExpressionId first = expression(3);
                const ExpressionId second = expression(3);
                g_.append(modules, id, {first, second});
            }
        }
        for (; open > 0; --open)
            g_.append(modules, g_.symbols.intern("]"));
        return modules;
    }

    /// A module of a context with up to two parameters of its own.
    ContextModule contextModule(SymbolId id)
    {
        ContextModule result{id, {}, 0};
        for (std::uint64_t i = below(3); i > 0; --i)
        {
            constexpr std::array kNames = {"s", "b", "k_1", "y", "Y"}; // those of transforms and constants are hidden
            const std::uint64_t which = contextParameters_++;
            result.parameters.push_back(which < kNames.size() ? kNames[which] : "c" + std::to_string(which));
        }
        return result;
    }

    std::vector<ContextModule> leftContext()
    {
        std::vector<ContextModule> modules;
        do
            modules.push_back(contextModule(symbol()));
        while (chance(0.5));
        return modules;
    }

    std::vector<ContextModule> rightContext()
    {
        const auto bracket = [&](const char* text) { return ContextModule{g_.symbols.intern(text), {}, 0}; };
        std::vector<ContextModule> modules;
        std::uint64_t open = 0;
        do
        {
            if (chance(0.2))
            {
                modules.push_back(bracket("["));
                ++open;
            }
            if (chance(0.8))
                modules.push_back(contextModule(symbol()));
            if (open > 0 && chance(0.3))
            {
                modules.push_back(bracket("]"));
                --open;
            }
        } while (modules.empty() || chance(0.5));
        modules.insert(modules.end(), open, bracket("]"));
        return modules;
    }

    [[nodiscard]] bool isInContext(SymbolId id) const
    {
        for (const Production& production : g_.productions)
            for (const auto* context : {&production.left, &production.right})
                for (const ContextModule& module : *context)
                    if (module.symbol == id)
                        return true;
        return false;
    }

    /// Draws shapes for a symbol; for a bracket, they need not balance.
    Production interpretation()
    {
        Production result;
        const bool ofBracket = chance(0.3);
        result.predecessor = ofBracket ? g_.symbols.intern(chance(0.5) ? "[" : "]") : symbol();
        if (chance(0.3))
            result.parameters.emplace_back("x");
        enter(result);
        if (chance(0.3))
            result.condition = expression(3);
        if (chance(0.3))
            result.weight = expression(3);
        result.successor = word();
        if (ofBracket)
            for (std::uint64_t i = below(3); i > 0; --i)
                g_.append(result.successor, g_.symbols.intern(chance(0.5) ? "[" : "]"));
        leave();
        return result;
    }

    /// From here on expressions name the parameters of `production`.
    void enter(const Production& production)
    {
        scope_ = production.parameters;
        for (const auto* context : {&production.left, &production.right})
            for (const ContextModule& module : *context)
                scope_.insert(scope_.end(), module.parameters.begin(), module.parameters.end());
    }
    void leave() { scope_.clear(); }

    Production production()
    {
        Production result;
        result.predecessor = symbol();
        for (const char* name : {"x", "n", "long_name2", "pi", "q"})
            if (chance(0.3))
                result.parameters.emplace_back(name);
        contextParameters_ = 0;
        if (options_.contexts && chance(0.4))
            result.left = leftContext();
        if (options_.contexts && chance(0.4))
            result.right = rightContext();
        enter(result);
        if (chance(0.5))
            result.condition = expression(4);
        if (chance(0.5))
            result.weight = expression(4);
        if (chance(0.5))
        {
            result.table = chance(0.5) ? "VII" : "t_1";
            if (chance(0.5))
                result.row = expression(3);
        }
        transforms_ = !result.table.empty();
        result.successor = word();
        transforms_ = false;
        leave();
        return result;
    }

    /// What the leaf called `name` means here; others with the same name are hidden.
    [[nodiscard]] bool isParameter(std::string_view name) const
    {
        return std::ranges::find(scope_, name) != scope_.end();
    }

    ExpressionId leaf()
    {
        using enum ExpressionOp;
        ExpressionPool& pool = g_.expressions;
        switch (below(6))
        {
        case 0:
            if (!scope_.empty())
                return pool.reference(Parameter, static_cast<std::uint32_t>(below(scope_.size())));
            break;
        case 1:
            if (!g_.constants.empty())
            {
                const auto index = static_cast<std::uint32_t>(below(g_.constants.size()));
                const std::string& name = g_.constants[index].name;
                if (!isParameter(name) && !(transforms_ && name == "s"))
                    return pool.reference(Constant, index);
            }
            break;
        case 2:
            if (const std::uint64_t component = below(4);
                transforms_ && !isParameter(std::string_view("srbo").substr(component, 1)))
                return pool.reference(Transform, static_cast<std::uint32_t>(component));
            break;
        case 3:
            if (!isParameter("n"))
                return pool.reference(Step, kNoExpression);
            break;
        case 4:
            if (!isParameter("pi"))
                return pool.reference(Pi, kNoExpression);
            break;
        default:
            break;
        }
        return pool.number(number());
    }

    ExpressionId expression(int depth)
    {
        using enum ExpressionOp;
        if (depth == 0 || chance(0.2))
            return leaf();
        constexpr std::array kUnary = {Negate, Plus, Not};
        constexpr std::array kBinary = {Add,      Subtract, Multiply,  Divide,  Modulo,       Power, Equal,
                                        NotEqual, Less,     LessEqual, Greater, GreaterEqual, And,   Or};
        const ExpressionId first = expression(depth - 1);
        const std::uint64_t kind = below(10);
        if (kind < 2)
            return g_.expressions.unary(kUnary[below(kUnary.size())], first);
        if (kind < 3)
        {
            const auto functions = expressionFunctions();
            const ExpressionFunction function = functions[below(functions.size())];
            return function.arguments == 1 ? g_.expressions.unary(function.op, first)
                                           : g_.expressions.binary(function.op, first, expression(depth - 1));
        }
        const ExpressionId second = expression(depth - 1);
        if (kind < 5)
            return g_.expressions.add({Choose, first, second, expression(depth - 1), 0});
        return g_.expressions.binary(kBinary[below(kBinary.size())], first, second);
    }

    RandomKey key_;
    std::uint32_t counter_ = 0;
    Grammar g_;
    RandomGrammarOptions options_;
    std::vector<std::string> scope_; ///< What parameters are called, by their numbers.
    std::uint64_t contextParameters_ = 0;
    bool transforms_ = false;
};

} // namespace espalier::samples
