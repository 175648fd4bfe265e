#include <Espalier/Grammar/Derivation.h>

#include <Espalier/Core/Json.h>
#include <algorithm>

namespace espalier {

/// One derivation under way.
class Deriver
{
public:
    Deriver(const GrammarProgram& program, const DerivationBudget& budget, DerivationScratch& scratch,
            DerivationSink& sink)
        : program_(program), grammar_(program.grammar_), budget_(budget), scratch_(scratch), sink_(sink),
          wantsArguments_(sink.wantsArguments())
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
                const auto rewritten = rewrite(program_.groups_[group], frame.key.child(frame.ordinal++));
                if (!rewritten)
                    return tl::make_unexpected(rewritten.error());
                if (*rewritten)
                    continue;
            }
            if (++emitted_ > 2 * std::uint64_t{budget_.modules})
                return endless("modules", 2 * std::uint64_t{budget_.modules});
            if (!sink_.module(module.symbol, scratch_.arguments))
                return false;
        }
        return true;
    }

    [[nodiscard]] std::uint64_t work() const noexcept { return emitted_ + applied_ + scanned_; }

private:
    static constexpr std::uint32_t kAxiom = GrammarProgram::kNothing;

    /// Candidates whose weight or condition may be evaluated one by one: some tenths of a second. A file of some
    /// hundred kilobytes could otherwise ask for hours.
    static constexpr std::uint64_t kMostScans = std::uint64_t{1} << 24;

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
        scope.step = static_cast<double>(scratch_.frames.size() - 1);
        // Draws are numbered by where they stand, so that those of one module do not shift another's.
        scope.draws = frame.position << 8;
        for (std::uint32_t i = 0; i < module.argumentCount; ++i)
            scratch_.arguments.push_back(
                evaluate(grammar_.expressions, grammar_.arguments[module.firstArgument + i], scope));
        return !scope.failed;
    }

    /// For the condition, weight and row of a group's candidate number `candidate`. Its draws are its own, so that the
    /// conditions of two productions are independent.
    ExpressionScope scopeOfArguments(RandomKey key, std::uint32_t candidate) const
    {
        ExpressionScope scope;
        scope.draws = 0x80000000u | (candidate << 8);
        scope.step = static_cast<double>(scratch_.frames.size());
        scope.parameters = scratch_.arguments.data();
        scope.constants = program_.constants_.data();
        scope.key = key;
        return scope;
    }

    /// Chooses a production for the module whose arguments stand in scratch, and enters it. False if none matches. A
    /// module that has to be completed and cannot be is dropped: in a tree grammar that is an open anchor.
    Expected<bool> rewrite(const GrammarProgram::Group& group, RandomKey key)
    {
        const bool completing =
            applied_ >= budget_.productions || scratch_.frames.size() > budget_.depth || emitted_ >= budget_.modules;
        // Completion by weight could still go round in a grammar edited by hand; by price alone it cannot.
        const bool byPriceAlone = scratch_.frames.size() > std::size_t{budget_.depth} * 2 + 64 ||
                                  emitted_ + applied_ > 3 * (std::uint64_t{budget_.modules} + budget_.productions) / 2;
        if (scanned_ > kMostScans)
            return failure(ErrorKind::Limit, {},
                           "the derivation looks at more than " + std::to_string(kMostScans) +
                               " weights and conditions",
                           "fewer productions for one symbol",
                           "weights of the form (i == 3)*a + b, with constants a and b, are not counted");
        std::uint32_t chosen = GrammarProgram::kNothing;
        if (byPriceAlone)
            chosen = cheapest(group);
        else if (group.tabulated && !completing)
        {
            chosen = chooseTabulated(group, key.uniform(Purpose::ChooseProduction));
            if (chosen == GrammarProgram::kNothing)
                return tl::make_unexpected(weightless(group));
        }
        else
        {
            auto listed = chooseListed(group, key, completing);
            if (!listed)
                return tl::make_unexpected(listed.error());
            chosen = *listed;
            if (chosen == GrammarProgram::kNothing)
                return false;
        }
        if (chosen == GrammarProgram::kNothing || (completing && program_.costs_[chosen] == GrammarProgram::kNever))
            return true;
        if (auto done = enter(group, chosen, key); !done)
            return tl::make_unexpected(done.error());
        return true;
    }

    std::uint32_t chooseTabulated(const GrammarProgram::Group& group, double uniform)
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
        scanned_ += same.size();
        double bonus = 0;
        for (const std::uint32_t i : same)
            bonus += tabulated[i].bonus;
        const std::uint32_t last = group.first + group.count - 1;
        const double total = bonus + tabulated[last].baseSum;
        double x = uniform * total;
        std::uint32_t favoured = GrammarProgram::kNothing;
        for (const std::uint32_t i : same)
        {
            if (tabulated[i].bonus > 0)
                favoured = program_.candidates_[i];
            if (x < tabulated[i].bonus)
                return favoured;
            x -= tabulated[i].bonus;
        }
        const auto bases = std::span(tabulated).subspan(group.first, group.count);
        if (!(bases.back().baseSum > 0))
            return favoured;
        auto found = std::ranges::upper_bound(bases, x, {}, &GrammarProgram::Tabulated::baseSum);
        if (found == bases.end()) // rounding: take the last that has a share
            found = std::ranges::lower_bound(bases, bases.back().baseSum, {}, &GrammarProgram::Tabulated::baseSum);
        return program_.candidates_[group.first + static_cast<std::uint32_t>(found - bases.begin())];
    }

    /// Any group: conditions and weights are evaluated one by one. When completing, the cheapest that could be drawn.
    /// Nothing if no condition holds.
    Expected<std::uint32_t> chooseListed(const GrammarProgram::Group& group, RandomKey key, bool completing)
    {
        scanned_ += group.count;
        scratch_.weights.assign(group.count, 0.0);
        bool first = true;
        bool weighted = false;
        std::uint32_t best = GrammarProgram::kNothing;
        for (std::uint32_t i = 0; i < group.count; ++i)
        {
            const std::uint32_t index = program_.candidates_[group.first + i];
            const Production& production = grammar_.productions[index];
            ExpressionScope scope = scopeOfArguments(key, i);
            const bool matches = production.condition == kNoExpression ||
                                 evaluate(grammar_.expressions, production.condition, scope) != 0;
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
            if (scratch_.weights[i] > 0 &&
                (best == GrammarProgram::kNothing || program_.costs_[index] < program_.costs_[best]))
                best = index;
        }
        if (!first && best == GrammarProgram::kNothing)
            return tl::make_unexpected(weightless(group));
        if (completing || first)
            return best;
        const std::size_t chosen = weightedChoice(scratch_.weights, key.uniform(Purpose::ChooseProduction));
        return program_.candidates_[group.first + chosen];
    }

    std::uint32_t cheapest(const GrammarProgram::Group& group) const
    {
        const auto candidates = std::span(program_.candidates_).subspan(group.first, group.count);
        const auto best = std::ranges::min_element(candidates, {}, [&](std::uint32_t i) { return program_.costs_[i]; });
        return program_.costs_[*best] == GrammarProgram::kNever ? GrammarProgram::kNothing : *best;
    }

    static tl::unexpected<Error> endless(std::string_view limit, std::uint64_t value)
    {
        return failure(ErrorKind::Limit, {},
                       "the derivation does not end within " + std::to_string(value) + " " + std::string(limit),
                       "a grammar whose cheapest productions end soon",
                       "raise the limit " + std::string(limit) + ", or mend the grammar");
    }

    Expected<void> enter(const GrammarProgram::Group& group, std::uint32_t index, RandomKey key)
    {
        // What is completed may take as many productions as modules: the modules are what was asked to be bounded.
        if (const std::uint64_t most = budget_.productions + 2 * std::uint64_t{budget_.modules}; ++applied_ > most)
            return endless("productions", most);
        const Production& production = grammar_.productions[index];
        DerivationScratch::Frame frame{index, 0,           0, static_cast<std::uint32_t>(scratch_.parameters.size()),
                                       key,   {1, 0, 0, 0}};
        std::uint32_t row = 0;
        if (const std::uint32_t table = program_.tableOf_[index]; table != GrammarProgram::kNothing)
        {
            const auto& rows = program_.tables_[table].rows;
            if (production.row == kNoExpression)
                row = static_cast<std::uint32_t>(key.below(Purpose::DrawTransform, rows.size()));
            else
            {
                ExpressionScope scope = scopeOfArguments(key, group.count);
                const double value = evaluate(grammar_.expressions, production.row, scope);
                if (scope.failed)
                    return tl::make_unexpected(notFinite(index));
                if (!(value >= 0 && value < static_cast<double>(rows.size())))
                    return failure(ErrorKind::BadInput, {{}, production.line, 1},
                                   "the production `" + printProduction(grammar_, production) + "` takes row " +
                                       formatNumber(value) + " of a table with " + std::to_string(rows.size()) +
                                       " rows",
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

    /// The row with each component moved by a triangular kernel: bounded by sqrt(6) deviations, so a scaling stays
    /// positive, and cheap, being the sum of two uniforms.
    static void smooth(const std::array<double, 4>& row, const std::array<double, 4>& spread, RandomKey key,
                       double* transform)
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

    Error weightless(const GrammarProgram::Group& group) const
    {
        const Production& first = grammar_.productions[program_.candidates_[group.first]];
        std::string module = grammar_.symbols.name(first.predecessor);
        for (std::size_t i = 0; i < scratch_.arguments.size(); ++i)
            module += (i == 0 ? "(" : ", ") + formatNumber(scratch_.arguments[i]);
        module += scratch_.arguments.empty() ? "" : ")";
        return {ErrorKind::BadInput,
                "the weights of the productions that match `" + module + "` add up to 0",
                "at least one weight above 0",
                {},
                {{}, first.line, 1}};
    }

    Error notFinite(std::uint32_t index) const
    {
        const bool isAxiom = index == kAxiom;
        return {ErrorKind::BadInput,
                (isAxiom
                     ? "an argument of the axiom `" + printWord(grammar_, grammar_.axiom)
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
    std::uint64_t scanned_ = 0;
};

Expected<bool> derive(const GrammarProgram& program, RandomKey key, const DerivationBudget& budget,
                      DerivationScratch& scratch, DerivationSink& sink)
{
    Deriver deriver(program, budget, scratch, sink);
    auto whole = deriver.run(key);
    scratch.work = deriver.work();
    return whole;
}

} // namespace espalier
