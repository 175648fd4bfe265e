#include <Espalier/Grammar/Derivation.h>

#include <algorithm>

namespace espalier {

/// One derivation under way.
class Deriver
{
public:
    Deriver(const GrammarProgram& program, const DerivationBudget& budget, DerivationScratch& scratch, DerivationSink& sink)
        : program_(program), grammar_(program.grammar_), budget_(budget), scratch_(scratch), sink_(sink), wantsArguments_(sink.wantsArguments())
    {
        scratch_.frames.clear();
        scratch_.parameters.clear();
    }

    Expected<bool> run(RandomKey key)
    {
        scratch_.frames.push_back({kAxiom, 0, 0, 0, key, {}});
        while (!scratch_.frames.empty())
        {
            DerivationScratch::Frame& frame = scratch_.frames.back();
            const std::vector<Module>& word =
                frame.production == kAxiom ? grammar_.axiom : grammar_.productions[frame.production].successor;
            if (frame.position == word.size())
            {
                leave(frame);
                continue;
            }
            const Module& module = word[frame.position++];
            const std::uint32_t group = program_.groupOf(module);
            scratch_.arguments.clear();
            if ((group != GrammarProgram::kNothing || wantsArguments_) && !evaluateArguments(frame, module))
                return tl::make_unexpected(notFinite(frame.production));
            if (group != GrammarProgram::kNothing)
            {
                if (auto done = rewrite(program_.groups_[group], frame.key.child(frame.ordinal++)); !done)
                    return tl::make_unexpected(done.error());
                continue;
            }
            if (++emitted_ > 2 * std::uint64_t{budget_.modules})
                return endless("modules", budget_.modules);
            if (!sink_.module(module.symbol, scratch_.arguments))
                return false;
        }
        return true;
    }

private:
    static constexpr std::uint32_t kAxiom = GrammarProgram::kNothing;

    void leave(const DerivationScratch::Frame& frame)
    {
        scratch_.parameters.resize(frame.firstParameter);
        if (frame.production != kAxiom && program_.tableOf_[frame.production] != GrammarProgram::kNothing)
            sink_.endInstance();
        scratch_.frames.pop_back();
    }

    bool evaluateArguments(DerivationScratch::Frame& frame, const Module& module)
    {
        if (module.argumentCount == 0)
            return true;
        ExpressionScope scope;
        scope.parameters = scratch_.parameters.data() + frame.firstParameter;
        scope.constants = program_.constants_.data();
        scope.transform = frame.transform;
        scope.key = frame.key;
        // Draws are numbered by where they stand, so that those of one module do not shift another's.
        scope.draws = frame.position << 8;
        for (std::uint32_t i = 0; i < module.argumentCount; ++i)
            scratch_.arguments.push_back(evaluate(grammar_.expressions, grammar_.arguments[module.firstArgument + i], scope));
        return !scope.failed;
    }

    ExpressionScope scopeOfArguments(RandomKey key) const
    {
        ExpressionScope scope;
        scope.parameters = scratch_.arguments.data();
        scope.constants = program_.constants_.data();
        scope.key = key;
        return scope;
    }

    /// Chooses a production for the module whose arguments stand in scratch, and enters it. A module that no production
    /// matches is dropped: in a tree grammar that is an open anchor.
    Expected<void> rewrite(const GrammarProgram::Group& group, RandomKey key)
    {
        const bool completing = applied_ >= budget_.productions || scratch_.frames.size() > budget_.depth || emitted_ >= budget_.modules;
        // Completion by weight could still go round in a grammar edited by hand; by price alone it cannot.
        const bool byPriceAlone = scratch_.frames.size() > std::size_t{budget_.depth} * 2 + 64 ||
                                  emitted_ + applied_ > 3 * (std::uint64_t{budget_.modules} + budget_.productions) / 2;
        std::uint32_t chosen = GrammarProgram::kNothing;
        if (byPriceAlone)
            chosen = cheapest(group);
        else if (group.tabulated && !completing)
            chosen = chooseTabulated(group, key.uniform(Purpose::ChooseProduction));
        else
        {
            auto listed = chooseListed(group, key, completing);
            if (!listed)
                return tl::make_unexpected(listed.error());
            chosen = *listed;
        }
        if (chosen == GrammarProgram::kNothing || (completing && program_.costs_[chosen] == GrammarProgram::kNever))
            return {};
        return enter(chosen, key);
    }

    std::uint32_t chooseTabulated(const GrammarProgram::Group& group, double uniform) const
    {
        const auto& tabulated = program_.tabulated_;
        const auto members = std::span(program_.byKey_).subspan(group.first, group.count);
        const auto keyOf = [&](std::uint32_t i) { return tabulated[i].key; };
        std::span<const std::uint32_t> same; // by hand: clang 14 cannot read the library's equal_range
        if (!scratch_.arguments.empty())
        {
            const auto first = std::ranges::lower_bound(members, scratch_.arguments[0], {}, keyOf);
            same = {first, std::ranges::upper_bound(first, members.end(), scratch_.arguments[0], {}, keyOf)};
        }
        double bonus = 0;
        for (const std::uint32_t i : same)
            bonus += tabulated[i].bonus;
        const std::uint32_t last = group.first + group.count - 1;
        const double total = bonus + tabulated[last].baseSum;
        if (!(total > 0))
            return GrammarProgram::kNothing;
        double x = uniform * total;
        for (const std::uint32_t i : same)
        {
            if (x < tabulated[i].bonus)
                return program_.candidates_[i];
            x -= tabulated[i].bonus;
        }
        const auto bases = std::span(tabulated).subspan(group.first, group.count);
        auto found = std::ranges::upper_bound(bases, x, {}, &GrammarProgram::Tabulated::baseSum);
        if (found == bases.end()) // rounding: take the last that has a share
            found = std::ranges::lower_bound(bases, bases.back().baseSum, {}, &GrammarProgram::Tabulated::baseSum);
        return program_.candidates_[group.first + static_cast<std::uint32_t>(found - bases.begin())];
    }

    /// Any group: conditions and weights are evaluated one by one. When completing, the cheapest that could be drawn.
    Expected<std::uint32_t> chooseListed(const GrammarProgram::Group& group, RandomKey key, bool completing)
    {
        scratch_.weights.assign(group.count, 0.0);
        bool first = true;
        bool weighted = false;
        std::uint32_t best = GrammarProgram::kNothing;
        for (std::uint32_t i = 0; i < group.count; ++i)
        {
            const std::uint32_t index = program_.candidates_[group.first + i];
            const Production& production = grammar_.productions[index];
            ExpressionScope scope = scopeOfArguments(key);
            const bool matches = production.condition == kNoExpression || evaluate(grammar_.expressions, production.condition, scope) != 0;
            if (matches && first)
            {
                first = false;
                weighted = production.weight != kNoExpression;
                if (!weighted && !scope.failed)
                    return index;
            }
            if (matches && production.weight != kNoExpression)
                scratch_.weights[i] = evaluate(grammar_.expressions, production.weight, scope);
            if (scope.failed || scratch_.weights[i] < 0)
                return tl::make_unexpected(notFinite(index));
            if (scratch_.weights[i] > 0 && (best == GrammarProgram::kNothing || program_.costs_[index] < program_.costs_[best]))
                best = index;
        }
        if (completing)
            return best;
        const std::size_t chosen = weightedChoice(scratch_.weights, key.uniform(Purpose::ChooseProduction));
        return chosen < group.count ? program_.candidates_[group.first + chosen] : GrammarProgram::kNothing;
    }

    std::uint32_t cheapest(const GrammarProgram::Group& group) const
    {
        const auto candidates = std::span(program_.candidates_).subspan(group.first, group.count);
        const auto best = std::ranges::min_element(candidates, {}, [&](std::uint32_t i) { return program_.costs_[i]; });
        return program_.costs_[*best] == GrammarProgram::kNever ? GrammarProgram::kNothing : *best;
    }

    static tl::unexpected<Error> endless(std::string_view limit, std::uint32_t value)
    {
        return failure(ErrorKind::Limit, {},
                       "the derivation does not end within twice " + std::to_string(value) + " " + std::string(limit),
                       "a grammar whose cheapest productions end soon", "raise the limit " + std::string(limit) + ", or mend the grammar");
    }

    Expected<void> enter(std::uint32_t index, RandomKey key)
    {
        if (++applied_ > 2 * std::uint64_t{budget_.productions})
            return endless("productions", budget_.productions);
        const Production& production = grammar_.productions[index];
        DerivationScratch::Frame frame{index, 0, 0, static_cast<std::uint32_t>(scratch_.parameters.size()), key, {1, 0, 0, 0}};
        std::uint32_t row = 0;
        if (const std::uint32_t table = program_.tableOf_[index]; table != GrammarProgram::kNothing)
        {
            const auto& rows = program_.tables_[table].rows;
            if (production.row == kNoExpression)
                row = static_cast<std::uint32_t>(key.below(Purpose::DrawTransform, rows.size()));
            else
            {
                ExpressionScope scope = scopeOfArguments(key);
                const double value = evaluate(grammar_.expressions, production.row, scope);
                if (scope.failed || !(value >= 0 && value < static_cast<double>(rows.size())))
                    return failure(ErrorKind::BadInput, {{}, production.line, 1},
                                   "the production `" + printProduction(grammar_, production) + "` takes row " + std::to_string(value) + " of a table with " +
                                       std::to_string(rows.size()) + " rows",
                                   "a row from 0 to " + std::to_string(rows.size() - 1));
                row = static_cast<std::uint32_t>(value);
            }
            smooth(rows[row], program_.tables_[table].spread, key, frame.transform);
            sink_.beginInstance(index, row);
        }
        scratch_.parameters.insert(scratch_.parameters.end(), scratch_.arguments.begin(), scratch_.arguments.end());
        scratch_.frames.push_back(frame);
        return {};
    }

    /// The row with each component moved by a triangular kernel: bounded by sqrt(6) deviations, so a scaling stays positive, and
    /// cheap, being the sum of two uniforms.
    static void smooth(const std::array<double, 4>& row, const std::array<double, 4>& spread, RandomKey key, double* transform)
    {
        constexpr double kSqrt6 = 2.449489742783178;
        for (std::uint32_t i = 0; i < 4; ++i)
        {
            transform[i] = row[i];
            if (spread[i] == 0)
                continue;
            const double a = key.uniform(Purpose::SmoothTransform, 2 * i);
            const double b = key.uniform(Purpose::SmoothTransform, 2 * i + 1);
            const double moved = kSqrt6 * spread[i] * (a + b - 1);
            transform[i] = i == 0 ? row[i] * (1 + moved) : row[i] + moved;
        }
    }

    Error notFinite(std::uint32_t index) const
    {
        const bool isAxiom = index == kAxiom;
        return {ErrorKind::BadInput,
                (isAxiom ? "an argument of the axiom `" + printWord(grammar_, grammar_.axiom)
                         : "an expression of the production `" + printProduction(grammar_, grammar_.productions[index])) +
                    "` has no finite value, or a weight is negative",
                "finite values and weights >= 0",
                "guard divisions with ?:",
                {{}, isAxiom ? 0 : grammar_.productions[index].line, isAxiom ? 0u : 1u}};
    }

    const GrammarProgram& program_;
    const Grammar& grammar_;
    const DerivationBudget& budget_;
    DerivationScratch& scratch_;
    DerivationSink& sink_;
    bool wantsArguments_;
    std::uint64_t emitted_ = 0;
    std::uint64_t applied_ = 0;
};

Expected<bool> derive(const GrammarProgram& program, RandomKey key, const DerivationBudget& budget, DerivationScratch& scratch,
                      DerivationSink& sink)
{
    return Deriver(program, budget, scratch, sink).run(key);
}

} // namespace espalier
