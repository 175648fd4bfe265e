#pragma once

#include <Espalier/Core/Random.h>
#include <Espalier/Grammar/Grammar.h>
#include <Espalier/Grammar/Word.h>
#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace espalier::samples {

/// Derivation as the contract tells it (Content/Grammars/LANGUAGE.md), module by module on lists, with the tree
/// evaluator and without any preparation: the second way to the same words. Slow, and made to be compared with the text
/// of the contract.
class NaiveDerivation
{
public:
    struct NaiveModule
    {
        std::string symbol;
        std::vector<double> arguments;
        RandomKey key{Seed{}};
    };
    using NaiveWord = std::vector<NaiveModule>;

    NaiveDerivation(const Grammar& grammar, RandomKey key) : grammar_(grammar), root_(key)
    {
        for (const NamedConstant& constant : grammar.constants)
        {
            ExpressionScope scope;
            scope.constants = constants_.data();
            constants_.push_back(evaluate(grammar.expressions, constant.value, scope));
        }
    }

    bool failed = false; ///< An expression had no value or weights no sum: then the words mean nothing.

    NaiveWord derive(std::uint32_t steps)
    {
        NaiveWord word = written(grammar_.axiom, {}, root_, 0);
        for (std::uint32_t step = 1; step <= steps; ++step)
        {
            NaiveWord next;
            for (std::size_t i = 0; i < word.size(); ++i)
                append(next, rewritten(word, i, grammar_.productions, step));
            word = std::move(next);
        }
        return word;
    }

    NaiveWord interpret(const NaiveWord& word, std::uint32_t steps)
    {
        NaiveWord next;
        for (std::size_t i = 0; i < word.size(); ++i)
            append(next, rewritten(word, i, grammar_.interpretations, steps));
        return next;
    }

private:
    static void append(NaiveWord& word, NaiveWord more) { word.insert(word.end(), more.begin(), more.end()); }

    bool isIgnored(const std::string& symbol) const
    {
        return std::ranges::any_of(grammar_.ignore, [&](SymbolId id) { return grammar_.symbols.name(id) == symbol; });
    }

    bool hasRule(const std::string& symbol, std::size_t arguments, const std::vector<Production>& rules) const
    {
        return std::ranges::any_of(rules, [&](const Production& p) {
            return grammar_.symbols.name(p.predecessor) == symbol && p.parameters.size() == arguments;
        });
    }

    double value(ExpressionId id, const std::vector<double>& parameters, RandomKey key, double step,
                 std::uint32_t& draws)
    {
        ExpressionScope scope;
        scope.parameters = parameters.data();
        scope.constants = constants_.data();
        scope.step = step;
        scope.key = key;
        scope.draws = draws;
        const double result = evaluate(grammar_.expressions, id, scope);
        draws = scope.draws;
        failed |= scope.failed;
        return result;
    }

    /// A successor with its arguments worked out. The key of a module that has rules counts those before it.
    NaiveWord written(const std::vector<Module>& modules, const std::vector<double>& parameters, RandomKey key,
                      std::uint32_t step)
    {
        NaiveWord word;
        std::uint64_t ordinal = 0;
        for (std::size_t m = 0; m < modules.size(); ++m)
        {
            NaiveModule module{grammar_.symbols.name(modules[m].symbol), {}, key};
            std::uint32_t draws = static_cast<std::uint32_t>(m + 1) << 8;
            for (std::uint32_t a = 0; a < modules[m].argumentCount; ++a)
                module.arguments.push_back(
                    value(grammar_.arguments[modules[m].firstArgument + a], parameters, key, step, draws));
            if (hasRule(module.symbol, module.arguments.size(), grammar_.productions) ||
                hasRule(module.symbol, module.arguments.size(), grammar_.interpretations))
                module.key = key.child(ordinal++);
            word.push_back(module);
        }
        return word;
    }

    static bool isModule(const NaiveModule& module, const ContextModule& wanted, const Grammar& grammar)
    {
        return module.symbol == grammar.symbols.name(wanted.symbol) &&
               module.arguments.size() == wanted.parameters.size();
    }

    /// Towards the base from `i`: finished branches skipped, into the parent over the [ of this branch.
    std::optional<std::size_t> towardsBase(const NaiveWord& word, std::size_t i) const
    {
        int finished = 0;
        while (i-- > 0)
        {
            if (word[i].symbol == "]")
                ++finished;
            else if (word[i].symbol == "[")
                finished = std::max(0, finished - 1);
            else if (finished == 0 && !isIgnored(word[i].symbol))
                return i;
        }
        return {};
    }

    static std::size_t endOfBranch(const NaiveWord& word, std::size_t open)
    {
        int depth = 0;
        for (std::size_t i = open;; ++i)
        {
            depth += word[i].symbol == "[" ? 1 : word[i].symbol == "]" ? -1 : 0;
            if (depth == 0)
                return i;
        }
    }

    /// Matches pattern[p...] behind `i`; `open` are the branches entered. Appends the arguments it meets.
    bool matchRight(const NaiveWord& word, const std::vector<ContextModule>& pattern, std::size_t p, std::size_t i,
                    std::vector<std::size_t> open, std::vector<double>& arguments) const
    {
        if (p == pattern.size())
            return true;
        const std::string& symbol = grammar_.symbols.name(pattern[p].symbol);
        if (symbol == "]")
        {
            if (open.empty())
                return false; // patterns balance
            const std::size_t end = endOfBranch(word, open.back());
            open.pop_back();
            return matchRight(word, pattern, p + 1, end, open, arguments);
        }
        for (std::size_t at = i + 1; at < word.size(); ++at)
        {
            if (word[at].symbol == "]")
                return false;
            if (word[at].symbol == "[")
            {
                if (symbol == "[")
                {
                    const std::size_t before = arguments.size();
                    std::vector<std::size_t> entered = open;
                    entered.push_back(at);
                    if (matchRight(word, pattern, p + 1, at, entered, arguments))
                        return true;
                    arguments.resize(before);
                }
                at = endOfBranch(word, at);
                continue;
            }
            if (isIgnored(word[at].symbol))
                continue;
            if (symbol == "[" || !isModule(word[at], pattern[p], grammar_))
                return false;
            arguments.insert(arguments.end(), word[at].arguments.begin(), word[at].arguments.end());
            return matchRight(word, pattern, p + 1, at, open, arguments);
        }
        return false;
    }

    /// The parameters of a rule whose contexts match at `i`: the module's, then those of the contexts.
    std::optional<std::vector<double>> parametersAt(const NaiveWord& word, std::size_t i, const Production& rule) const
    {
        std::vector<double> parameters = word[i].arguments;
        std::vector<std::size_t> left;
        std::size_t at = i;
        for (std::size_t k = rule.left.size(); k-- > 0;)
        {
            const auto next = towardsBase(word, at);
            if (!next || !isModule(word[*next], rule.left[k], grammar_))
                return {};
            at = *next;
            left.push_back(at);
        }
        for (std::size_t k = left.size(); k-- > 0;)
            parameters.insert(parameters.end(), word[left[k]].arguments.begin(), word[left[k]].arguments.end());
        if (!matchRight(word, rule.right, 0, i, {}, parameters))
            return {};
        return parameters;
    }

    static bool sameContexts(const Production& a, const Production& b)
    {
        const auto same = [](const std::vector<ContextModule>& x, const std::vector<ContextModule>& y) {
            return std::ranges::equal(x, y, [](const ContextModule& m, const ContextModule& n) {
                return m.symbol == n.symbol && m.parameters.size() == n.parameters.size();
            });
        };
        return same(a.left, b.left) && same(a.right, b.right);
    }

    NaiveWord rewritten(const NaiveWord& word, std::size_t i, const std::vector<Production>& rules, std::uint32_t step)
    {
        const NaiveModule& module = word[i];
        struct Candidate
        {
            const Production* rule;
            std::vector<double> parameters;
            double weight;
        };
        // Rules for this symbol; which number a rule has among them in the order in which they are tried tells where
        // its draws are.
        std::vector<const Production*> tried;
        for (const Production& rule : rules)
            if (grammar_.symbols.name(rule.predecessor) == module.symbol &&
                rule.parameters.size() == module.arguments.size())
                tried.push_back(&rule);
        if (grammar_.order == MatchOrder::ContextFirst)
            std::stable_partition(tried.begin(), tried.end(),
                                  [](const Production* rule) { return rule->hasContext(); });
        std::vector<Candidate> matching;
        bool mayChange = false;
        for (std::size_t k = 0; k < tried.size(); ++k)
        {
            const Production& rule = *tried[k];
            if (rule.condition != kNoExpression)
                mayChange |= dependsOnStepOrChance(rule.condition);
            auto parameters = parametersAt(word, i, rule);
            if (!parameters)
                continue;
            std::uint32_t draws = 0x80000000u | static_cast<std::uint32_t>(k << 8);
            if (rule.condition != kNoExpression && value(rule.condition, *parameters, module.key, step, draws) == 0)
                continue;
            const double weight =
                rule.weight == kNoExpression ? 0 : value(rule.weight, *parameters, module.key, step, draws);
            matching.push_back({&rule, *parameters, weight});
        }
        if (matching.empty())
            return {{module.symbol, module.arguments, mayChange ? module.key.child(0) : module.key}};
        const Candidate* chosen = &matching[0];
        if (matching[0].rule->weight != kNoExpression)
        {
            std::vector<double> weights;
            for (const Candidate& candidate : matching)
                weights.push_back(candidate.rule->weight != kNoExpression &&
                                          sameContexts(*candidate.rule, *matching[0].rule)
                                      ? candidate.weight
                                      : 0);
            const std::size_t which = weightedChoice(weights, module.key.uniform(Purpose::ChooseProduction));
            failed |= which == weights.size() || std::ranges::any_of(weights, [](double w) { return w < 0; });
            if (failed)
                return {};
            chosen = &matching[which];
        }
        return written(chosen->rule->successor, chosen->parameters, module.key, step);
    }

    bool dependsOnStepOrChance(ExpressionId id) const
    {
        if (id == kNoExpression)
            return false;
        const ExpressionNode& node = grammar_.expressions[id];
        using enum ExpressionOp;
        if (node.op == Step || node.op == Rand || node.op == Normal)
            return true;
        if (node.op == Number || node.op == Parameter || node.op == Constant || node.op == Transform || node.op == Pi)
            return false;
        return dependsOnStepOrChance(node.first) || dependsOnStepOrChance(node.second) ||
               dependsOnStepOrChance(node.third);
    }

    const Grammar& grammar_;
    RandomKey root_;
    std::vector<double> constants_;
};

} // namespace espalier::samples
