#pragma once

#include <Espalier/Core/Error.h>
#include <Espalier/Core/Random.h>
#include <Espalier/Grammar/GrammarProgram.h>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

// What the ways of deriving share: which rule is taken, the transform it draws, and how mistakes are told.

namespace espalier {

/// A module that is to be rewritten.
struct Rewritten
{
    std::span<const double> arguments;
    RandomKey key{Seed{}};
    double step = 0; ///< n while its rules are tried.
};

/// The scope in which condition, weight and row of the `candidate`th rule of a group are evaluated. Its draws are its
/// own, so that the conditions of two rules are independent.
[[nodiscard]] inline ExpressionScope scopeOfCandidate(const Rewritten& module, const double* parameters,
                                                      std::uint32_t candidate) noexcept
{
    ExpressionScope scope;
    scope.parameters = parameters;
    scope.step = module.step;
    scope.key = module.key;
    scope.draws = 0x80000000u | (candidate << 8);
    return scope;
}

/// The scope of a successor's arguments, but for the draws, which patchDraws tells.
[[nodiscard]] inline ExpressionScope scopeOfSuccessor(const double* parameters, RandomKey key, double step) noexcept
{
    ExpressionScope scope;
    scope.parameters = parameters;
    scope.step = step;
    scope.key = key;
    return scope;
}

/// Where the draws of a module's arguments begin: numbered by where the module stands, so that those of one do not
/// shift another's.
[[nodiscard]] inline std::uint32_t patchDraws(std::uint32_t module) noexcept
{
    return (module + 1) << 8;
}

/// Takes the rule of a group that applies to a module (Content/Grammars/LANGUAGE.md, Which production).
class RuleChooser
{
public:
    static constexpr std::uint32_t kNothing = GrammarProgram::kNothing;
    static constexpr std::uint32_t kFailed = GrammarProgram::kNothing - 1;

    RuleChooser(const GrammarProgram& program, std::vector<double>& weights) : program_(program), weights_(weights) {}

    std::uint64_t work = 0; ///< Of trying rules, as Limits::derivationWork counts it.

    /// The index of the rule; kNothing if none matches; kFailed if an expression or the weights are wrong: error()
    /// tells. With `cheapest`, the cheapest of those that could be drawn. `matches(rule)` gives the parameters of a
    /// rule whose contexts match, or null; it is asked only of rules with contexts.
    template <class Matches>
    [[nodiscard]] std::uint32_t choose(const GrammarProgram::Group& group, const Rewritten& module, bool cheapest,
                                       Matches&& matches)
    {
        const GrammarProgram::Code& code = program_.code();
        if (group.always && !cheapest)
            return code.candidates[group.first];
        if (group.tabulated && !cheapest)
            return chooseTabulated(group, module);
        std::uint32_t decider = kNothing; // the first rule that matches
        std::uint32_t best = kNothing;
        for (std::uint32_t i = 0; i < group.count; ++i)
        {
            const std::uint32_t index = code.candidates[group.first + i];
            const GrammarProgram::Rule& rule = code.rules[index];
            const bool competes =
                decider == kNothing || (rule.hasWeight && rule.leftSide == code.rules[decider].leftSide);
            if (!competes)
                continue;
            work += rule.trialCost;
            const double* parameters = module.arguments.data();
            if (rule.hasContext() && !matches(rule, parameters))
                continue;
            ExpressionScope scope = scopeOfCandidate(module, parameters, i);
            const bool holds = !rule.hasCondition || code.expressions.evaluate(rule.condition, scope) != 0;
            if (scope.failed)
                return fail(index, scope, 0);
            if (!holds)
                continue;
            if (decider == kNothing)
            {
                if (!rule.hasWeight)
                    return index;
                decider = index;
                weights_.assign(group.count, 0.0);
            }
            const double weight = code.expressions.evaluate(rule.weight, scope);
            if (scope.failed || weight < 0)
                return fail(index, scope, weight);
            weights_[i] = weight;
            if (weight > 0 && (best == kNothing || rule.cost < code.rules[best].cost))
                best = index;
        }
        if (decider == kNothing)
            return kNothing;
        if (best == kNothing)
            return failWeightless(group, module);
        if (cheapest)
            return best;
        return code.candidates[group.first + weightedChoice(weights_, module.key.uniform(Purpose::ChooseProduction))];
    }

    /// The same where no rule has a context.
    [[nodiscard]] std::uint32_t choose(const GrammarProgram::Group& group, const Rewritten& module, bool cheapest)
    {
        return choose(group, module, cheapest, [](const GrammarProgram::Rule&, const double*&) { return false; });
    }

    /// The cheapest rule of all; kNothing if none ends.
    [[nodiscard]] std::uint32_t cheapestOf(const GrammarProgram::Group& group) const;

    [[nodiscard]] const Error& error() const noexcept { return error_; }

private:
    [[nodiscard]] std::uint32_t chooseTabulated(const GrammarProgram::Group& group, const Rewritten& module);
    [[nodiscard]] std::uint32_t fail(std::uint32_t index, const ExpressionScope& scope, double weight);
    [[nodiscard]] std::uint32_t failWeightless(const GrammarProgram::Group& group, const Rewritten& module);

    const GrammarProgram& program_;
    std::vector<double>& weights_;
    Error error_;
};

/// Draws a row of a rule's table and smooths it: each component moved by a triangular kernel, bounded by sqrt(6)
/// deviations, so a scaling stays positive, and cheap, being the sum of two uniforms.
[[nodiscard]] Expected<std::uint32_t> drawTransform(const GrammarProgram& program, std::uint32_t ruleIndex,
                                                    const Rewritten& module, std::uint32_t candidates,
                                                    double* transform);

/// Place of the argument after those of module `module` - 1: where `module` begins, or where the word ends.
[[nodiscard]] inline std::uint32_t argumentOf(const GrammarProgram::Code& code, const GrammarProgram::Word& word,
                                              std::uint32_t module)
{
    return module == word.letterCount ? word.argumentCount : code.moduleArguments[word.firstLetter + module];
}

/// Writes the arguments of `word`'s modules [first, last) that must be computed over their places in `arguments`, where
/// those of module `first` begin. `patch` is where to look for the first one, counted within the word; it moves on.
/// False if a value is not finite.
[[nodiscard]] inline bool computeArguments(const GrammarProgram::Code& code, const GrammarProgram::Word& word,
                                           std::uint32_t first, std::uint32_t last, std::uint32_t& patch,
                                           ExpressionScope& scope, double* arguments)
{
    const std::uint32_t base = argumentOf(code, word, first);
    std::uint32_t module = GrammarProgram::kNothing;
    for (; patch < word.patchCount; ++patch)
    {
        const GrammarProgram::ArgumentPatch& one = code.patches[word.firstPatch + patch];
        if (one.module >= last)
            break;
        if (one.module < first) // of modules that nobody wanted the arguments of
            continue;
        if (one.module != module)
            scope.draws = patchDraws(module = one.module);
        arguments[one.argument - base] = code.expressions.evaluate(one.value, scope);
    }
    return !scope.failed;
}

/// An argument of the axiom (word 0) or of a rule's successor has no finite value: names the expression.
[[nodiscard]] Error notFinite(const GrammarProgram& program, std::uint32_t wordIndex, ExpressionScope scope);

} // namespace espalier
