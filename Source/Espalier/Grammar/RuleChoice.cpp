#include <Espalier/Grammar/RuleChoice.h>

#include <Espalier/Core/Json.h>
#include <algorithm>

namespace espalier {

namespace {

TextPlace placeOf(const GrammarProgram& program, ExpressionId id, TextPlace line)
{
    const std::uint32_t column = id == kNoExpression ? 0 : program.grammar().expressions[id].column;
    return {line.line, column > 0 ? column : line.column};
}

Error undefined(const std::string& whose, TextPlace place)
{
    return {ErrorKind::BadInput,
            whose + " has no finite value",
            "finite values",
            "guard divisions with ?:",
            {{}, place.line, place.column}};
}

std::string quoted(const GrammarProgram& program, const Production& production)
{
    return "the production `" + shortened(printProduction(program.grammar(), production)) + "`";
}

} // namespace

std::uint32_t RuleChooser::chooseTabulated(const GrammarProgram::Group& group, const Rewritten& module)
{
    const GrammarProgram::Code& code = program_.code();
    const auto& tabulated = code.tabulated;
    const auto members = std::span(code.byKey).subspan(group.first, group.count);
    const auto keyOf = [&](std::uint32_t i) { return tabulated[i].key; };
    std::span<const std::uint32_t> same; // by hand: clang 14 cannot read the library's equal_range
    if (!module.arguments.empty())
    {
        const auto first = std::ranges::lower_bound(members, module.arguments[0], {}, keyOf);
        same = {first, std::ranges::upper_bound(first, members.end(), module.arguments[0], {}, keyOf)};
    }
    work += same.size();
    double bonus = 0;
    for (const std::uint32_t i : same)
        bonus += tabulated[i].bonus;
    const std::uint32_t last = group.first + group.count - 1;
    const double total = bonus + tabulated[last].baseSum;
    double x = module.key.uniform(Purpose::ChooseProduction) * total;
    std::uint32_t favoured = kNothing;
    for (const std::uint32_t i : same)
    {
        if (tabulated[i].bonus > 0)
            favoured = code.candidates[i];
        if (x < tabulated[i].bonus)
            return favoured;
        x -= tabulated[i].bonus;
    }
    const auto bases = std::span(tabulated).subspan(group.first, group.count);
    if (!(bases.back().baseSum > 0))
        return favoured != kNothing ? favoured : failWeightless(group, module);
    auto found = std::ranges::upper_bound(bases, x, {}, &GrammarProgram::Tabulated::baseSum);
    if (found == bases.end()) // rounding: take the last that has a share
        found = std::ranges::lower_bound(bases, bases.back().baseSum, {}, &GrammarProgram::Tabulated::baseSum);
    return code.candidates[group.first + static_cast<std::uint32_t>(found - bases.begin())];
}

std::uint32_t RuleChooser::cheapestOf(const GrammarProgram::Group& group) const
{
    const GrammarProgram::Code& code = program_.code();
    const auto candidates = std::span(code.candidates).subspan(group.first, group.count);
    const auto best = std::ranges::min_element(candidates, {}, [&](std::uint32_t r) { return code.rules[r].cost; });
    return code.rules[*best].cost == GrammarProgram::kNever ? kNothing : *best;
}

std::uint32_t RuleChooser::fail(std::uint32_t index, const ExpressionScope& scope, double weight)
{
    const Production& source = program_.sourceOf(program_.code().rules[index]);
    if (!scope.failed)
    {
        const TextPlace place = placeOf(program_, source.weight, source.place);
        error_ = {ErrorKind::BadInput,
                  "the weight of " + quoted(program_, source) + " is " + formatNumber(weight),
                  "weights >= 0",
                  {},
                  {{}, place.line, place.column}};
        return kFailed;
    }
    ExpressionScope again = scope;
    again.constants = program_.constants().data();
    again.draws = scope.draws & ~0xffu;
    ExpressionId culprit = findFailure(program_.grammar().expressions, source.condition, again);
    if (culprit == kNoExpression)
        culprit = findFailure(program_.grammar().expressions, source.weight, again);
    error_ = undefined("an expression of " + quoted(program_, source), placeOf(program_, culprit, source.place));
    return kFailed;
}

std::uint32_t RuleChooser::failWeightless(const GrammarProgram::Group& group, const Rewritten& module)
{
    const Production& first = program_.sourceOf(program_.code().rules[program_.code().candidates[group.first]]);
    std::string text = program_.grammar().symbols.name(first.predecessor);
    for (std::size_t i = 0; i < module.arguments.size(); ++i)
        text += (i == 0 ? "(" : ", ") + formatNumber(module.arguments[i]);
    text += module.arguments.empty() ? "" : ")";
    error_ = {ErrorKind::BadInput,
              "the weights of the productions that match `" + text + "` add up to 0",
              "at least one weight above 0",
              {},
              {{}, first.place.line, first.place.column}};
    return kFailed;
}

Expected<std::uint32_t> drawTransform(const GrammarProgram& program, std::uint32_t ruleIndex, const Rewritten& module,
                                      std::uint32_t candidates, double* transform)
{
    const GrammarProgram::Rule& rule = program.code().rules[ruleIndex];
    const TransformTable& table = program.tables()[rule.table];
    const Production& source = program.sourceOf(rule);
    std::uint32_t index = 0;
    if (source.row == kNoExpression)
        index = static_cast<std::uint32_t>(module.key.below(Purpose::DrawTransform, table.rows.size()));
    else
    {
        ExpressionScope scope = scopeOfCandidate(module, module.arguments.data(), candidates);
        const double value = program.code().expressions.evaluate(rule.row, scope);
        const TextPlace place = placeOf(program, source.row, source.place);
        if (scope.failed)
            return tl::make_unexpected(undefined("an expression of " + quoted(program, source), place));
        if (!(value >= 0 && value < static_cast<double>(table.rows.size())))
            return failure(ErrorKind::BadInput, {{}, place.line, place.column},
                           quoted(program, source) + " takes row " + formatNumber(value) + " of a table with " +
                               std::to_string(table.rows.size()) + " rows",
                           "a row from 0 to " + std::to_string(table.rows.size() - 1));
        index = static_cast<std::uint32_t>(value);
    }
    constexpr double kSqrt6 = 2.449489742783178;
    for (std::uint32_t i = 0; i < 4; ++i)
    {
        transform[i] = table.rows[index][i];
        if (table.spread[i] == 0)
            continue;
        const double a = module.key.uniform(Purpose::SmoothTransform, 2 * i);
        const double b = module.key.uniform(Purpose::SmoothTransform, 2 * i + 1);
        const double moved = kSqrt6 * table.spread[i] * (a + b - 1);
        transform[i] = i == 0 ? table.rows[index][i] * (1 + moved) : table.rows[index][i] + moved;
    }
    return index;
}

Error notFinite(const GrammarProgram& program, std::uint32_t wordIndex, ExpressionScope scope)
{
    const Grammar& grammar = program.grammar();
    scope.constants = program.constants().data();
    const Production* source = wordIndex == 0 ? nullptr : &program.sourceOf(program.code().rules[wordIndex - 1]);
    const std::vector<Module>& word = source ? source->successor : grammar.axiom;
    ExpressionId culprit = kNoExpression;
    for (std::uint32_t m = 0; m < word.size() && culprit == kNoExpression; ++m)
    {
        scope.draws = patchDraws(m);
        for (std::uint32_t a = 0; a < word[m].argumentCount && culprit == kNoExpression; ++a)
        {
            const ExpressionId argument = grammar.arguments[word[m].firstArgument + a];
            culprit = findFailure(grammar.expressions, argument, scope);
            scope.failed = false;
            (void)evaluate(grammar.expressions, argument, scope); // for its draws
            scope.failed = false;
        }
    }
    if (!source)
        return undefined("an argument of the axiom `" + shortened(printWord(grammar, grammar.axiom)) + "`",
                         placeOf(program, culprit, grammar.axiomPlace));
    return undefined("an expression of " + quoted(program, *source), placeOf(program, culprit, source->place));
}

} // namespace espalier
