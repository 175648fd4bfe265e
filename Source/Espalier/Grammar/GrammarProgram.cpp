#include <Espalier/Grammar/GrammarProgram.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <numeric>
#include <queue>

namespace espalier {

Expected<GrammarProgram> GrammarProgram::make(const Grammar& grammar, std::span<const TransformTable> tables)
{
    GrammarProgram program;
    program.grammar_ = grammar;
    program.tables_.assign(tables.begin(), tables.end());
    if (auto done = program.evaluateConstants(); !done)
        return tl::make_unexpected(done.error());
    if (auto done = program.resolveTables(); !done)
        return tl::make_unexpected(done.error());
    if (auto done = program.numberLetters(); !done)
        return tl::make_unexpected(done.error());
    if (auto done = program.checkBrackets(); !done)
        return tl::make_unexpected(done.error());

    program.compileRules(program.grammar_.productions, false);
    program.compileRules(program.grammar_.interpretations, true);
    const auto productions = static_cast<std::uint32_t>(grammar.productions.size());
    program.groupRules(0, productions, program.code_.groupOfLetter);
    program.groupRules(productions, static_cast<std::uint32_t>(program.code_.rules.size()),
                       program.code_.interpretationGroup);
    program.compileWord(program.grammar_.axiom, program.grammar_.axiomPlace);
    for (const auto* list : {&program.grammar_.productions, &program.grammar_.interpretations})
        for (const Production& production : *list)
            program.compileWord(production.successor, production.place);
    if (const auto place = program.tooManyDraws_)
        return failure(ErrorKind::Limit, {{}, place->line, place->column},
                       "one module or rule draws more than 255 random values", "at most 255 calls of rand and normal");
    if (program.code_.expressions.isTooDeep())
        return failure(ErrorKind::Limit, {}, "an expression nests too deep to be evaluated",
                       "at most 256 operations that wait for their operands");
    for (Group& group : program.code_.groups)
        program.tabulate(group);
    program.price();
    program.summarise();
    program.countLetters();
    program.expand();
    return program;
}

Expected<void> GrammarProgram::evaluateConstants()
{
    for (const NamedConstant& constant : grammar_.constants)
    {
        ExpressionScope scope;
        scope.constants = constants_.data();
        constants_.push_back(evaluate(grammar_.expressions, constant.value, scope));
        if (scope.failed)
            return failure(ErrorKind::BadInput, {}, "the constant `" + constant.name + "` has no finite value",
                           "a number");
    }
    return {};
}

bool GrammarProgram::constantValue(ExpressionId id, double& value) const
{
    ExpressionCode scratch;
    ExpressionNeeds needs;
    const CompiledExpression compiled = scratch.compile(grammar_.expressions, id, constants_, needs);
    value = compiled.value;
    return compiled.isConstant();
}

Expected<void> GrammarProgram::resolveTables()
{
    std::vector<std::uint32_t> byName(tables_.size());
    std::iota(byName.begin(), byName.end(), 0u);
    std::ranges::stable_sort(byName, {}, [&](std::uint32_t i) { return std::string_view(tables_[i].name); });
    for (const Production& production : grammar_.productions)
    {
        tableOfProduction_.push_back(kNothing);
        if (production.table.empty())
            continue;
        const auto found = std::ranges::lower_bound(byName, std::string_view(production.table), {},
                                                    [&](std::uint32_t i) { return std::string_view(tables_[i].name); });
        if (found == byName.end() || tables_[*found].name != production.table || tables_[*found].rows.empty())
            return failure(ErrorKind::BadInput, {{}, production.place.line, production.place.column},
                           "the production `" + printProduction(grammar_, production) + "` draws from the table " +
                               production.table + ", which does not exist or is empty",
                           "the name of a table of transforms with at least one row",
                           "tables stand in species; a grammar alone has none");
        tableOfProduction_.back() = *found;
        const std::size_t rows = tables_[*found].rows.size();
        double row = 0;
        if (production.row != kNoExpression && constantValue(production.row, row) &&
            !(row >= 0 && row < static_cast<double>(rows)))
            return failure(ErrorKind::BadInput, {{}, production.place.line, production.place.column},
                           "the production `" + printProduction(grammar_, production) +
                               "` takes a row that the table " + production.table + " lacks",
                           "a row from 0 to " + std::to_string(rows - 1));
    }
    return {};
}

/// Letters in the order of their first mention: axiom, productions, interpretations.
Expected<void> GrammarProgram::numberLetters()
{
    lettersOfSymbol_.resize(grammar_.symbols.size());
    bool tooMany = false;
    const auto mention = [&](SymbolId symbol, std::size_t arity) {
        auto& known = lettersOfSymbol_[symbol];
        const auto count = static_cast<std::uint32_t>(arity);
        if (std::ranges::find(known, count, [](const auto& entry) { return entry.first; }) != known.end())
            return;
        if (symbols_.size() >= 65535 || arity > 255)
        {
            tooMany = true;
            return;
        }
        known.emplace_back(count, static_cast<LetterId>(symbols_.size()));
        symbols_.push_back(symbol);
        arities_.push_back(static_cast<std::uint8_t>(count));
    };
    const auto mentionWord = [&](const std::vector<Module>& word) {
        for (const Module& module : word)
            mention(module.symbol, module.argumentCount);
    };
    mentionWord(grammar_.axiom);
    for (const auto* list : {&grammar_.productions, &grammar_.interpretations})
        for (const Production& production : *list)
        {
            mention(production.predecessor, production.parameters.size());
            for (const auto* context : {&production.left, &production.right})
                for (const ContextModule& module : *context)
                    mention(module.symbol, module.parameters.size());
            mentionWord(production.successor);
        }
    if (tooMany)
        return failure(ErrorKind::Limit, {{}, grammar_.axiomPlace.line, grammar_.axiomPlace.column},
                       "the grammar has more than 65535 different symbols, numbers of parameters told apart",
                       "at most the limit symbols");
    for (const SymbolId symbol : symbols_)
    {
        const std::string& name = grammar_.symbols.name(symbol);
        const bool ignored = std::ranges::find(grammar_.ignore, symbol) != grammar_.ignore.end();
        code_.roles.push_back(name == "["   ? LetterRole::Open
                              : name == "]" ? LetterRole::Close
                              : ignored     ? LetterRole::Ignored
                                            : LetterRole::Plain);
    }
    code_.groupOfLetter.assign(symbols_.size(), kNothing);
    code_.interpretationGroup.assign(symbols_.size(), kNothing);
    return {};
}

LetterId GrammarProgram::letterOf(SymbolId symbol, std::size_t arity) const
{
    const auto& known = lettersOfSymbol_[symbol];
    const auto found = std::ranges::find(known, arity, [](const auto& entry) { return std::size_t{entry.first}; });
    assert(found != known.end());
    return found->second;
}

/// In words made by code; what is parsed balances already. Only `interpret:` of a bracket need not.
Expected<void> GrammarProgram::checkBrackets() const
{
    const auto isBracket = [&](SymbolId symbol, const char* bracket) {
        return grammar_.symbols.name(symbol) == bracket;
    };
    const auto balances = [&](const auto& modules) {
        std::int64_t depth = 0;
        for (const auto& module : modules)
        {
            depth += isBracket(module.symbol, "[") ? 1 : isBracket(module.symbol, "]") ? -1 : 0;
            if (depth < 0)
                return false;
        }
        return depth == 0;
    };
    const auto unbalanced = [](TextPlace place) {
        return failure(ErrorKind::BadInput, {{}, place.line, place.column}, "brackets do not balance",
                       "a `]` for every `[` in each word and context");
    };
    if (!balances(grammar_.axiom))
        return unbalanced(grammar_.axiomPlace);
    for (const Production& production : grammar_.productions)
        if (!balances(production.successor) || !balances(production.right))
            return unbalanced(production.place);
    for (const Production& production : grammar_.interpretations)
    {
        const SymbolId symbol = production.predecessor;
        if (!isBracket(symbol, "[") && !isBracket(symbol, "]") && !balances(production.successor))
            return unbalanced(production.place);
    }
    return {};
}

/// Draws are numbered within a module or rule, in a byte.
void GrammarProgram::countDraws(const ExpressionNeeds& needs, TextPlace place)
{
    random_ |= needs.draws > 0;
    if (needs.draws > 255 && !tooManyDraws_)
        tooManyDraws_ = place;
}

void GrammarProgram::compileRules(const std::vector<Production>& productions, bool areInterpretations)
{
    for (std::uint32_t i = 0; i < productions.size(); ++i)
    {
        const Production& production = productions[i];
        Rule rule;
        rule.source = i;
        rule.isInterpretation = areInterpretations;
        ExpressionNeeds needs;
        const auto compile = [&](ExpressionId id, CompiledExpression& compiled) {
            if (id != kNoExpression)
                compiled = code_.expressions.compile(grammar_.expressions, id, constants_, needs);
            return id != kNoExpression;
        };
        rule.hasCondition = compile(production.condition, rule.condition);
        rule.isChangeable = needs.step || needs.draws > 0;
        if (rule.condition.isConstant() && rule.condition.value != 0)
            rule.hasCondition = false;
        rule.hasWeight = compile(production.weight, rule.weight);
        compile(production.row, rule.row);
        rule.trialCost += rule.condition.cost() + rule.weight.cost();
        countDraws(needs, production.place);
        rule.table = areInterpretations ? kNothing : tableOfProduction_[i];
        compileContexts(production, rule);
        code_.rules.push_back(rule);
    }
}

void GrammarProgram::compileContexts(const Production& production, Rule& rule)
{
    rule.firstLeft = static_cast<std::uint32_t>(code_.leftContexts.size());
    rule.leftCount = static_cast<std::uint32_t>(production.left.size());
    for (std::size_t i = production.left.size(); i-- > 0;)
    {
        const ContextModule& module = production.left[i];
        code_.leftContexts.push_back(letterOf(module.symbol, module.parameters.size()));
        rule.contextParameters += static_cast<std::uint32_t>(module.parameters.size());
    }
    rule.firstRight = static_cast<std::uint32_t>(code_.rightContexts.size());
    rule.rightCount = static_cast<std::uint32_t>(production.right.size());
    for (const ContextModule& module : production.right)
    {
        const LetterId letter = letterOf(module.symbol, module.parameters.size());
        code_.rightContexts.push_back({code_.roles[letter], letter});
        rule.contextParameters += static_cast<std::uint32_t>(module.parameters.size());
    }
}

void GrammarProgram::groupRules(std::uint32_t firstRule, std::uint32_t lastRule,
                                std::vector<std::uint32_t>& groupOfLetter)
{
    // Counting sort by letter keeps the order of the text inside each group.
    const auto firstGroup = static_cast<std::uint32_t>(code_.groups.size());
    std::vector<std::uint32_t> groupOfRule;
    for (std::uint32_t r = firstRule; r < lastRule; ++r)
    {
        const Production& production = sourceOf(code_.rules[r]);
        std::uint32_t& group = groupOfLetter[letterOf(production.predecessor, production.parameters.size())];
        if (group == kNothing)
        {
            group = static_cast<std::uint32_t>(code_.groups.size());
            code_.groups.emplace_back();
        }
        groupOfRule.push_back(group);
        ++code_.groups[group].count;
    }
    auto total = static_cast<std::uint32_t>(code_.candidates.size());
    for (std::uint32_t g = firstGroup; g < code_.groups.size(); ++g)
    {
        code_.groups[g].first = total;
        total += code_.groups[g].count;
        code_.groups[g].count = 0;
    }
    code_.candidates.resize(total);
    for (std::uint32_t r = firstRule; r < lastRule; ++r)
    {
        Group& group = code_.groups[groupOfRule[r - firstRule]];
        code_.candidates[group.first + group.count++] = r;
    }
    code_.tabulated.resize(total);
    code_.byKey.resize(total);
    for (std::uint32_t g = firstGroup; g < code_.groups.size(); ++g)
        classify(code_.groups[g]);
}

void GrammarProgram::classify(Group& group)
{
    const auto members = std::span(code_.candidates).subspan(group.first, group.count);
    // Tried in this order, the first match decides, whichever MatchOrder the grammar has.
    if (grammar_.order == MatchOrder::ContextFirst)
        std::ranges::stable_sort(members, {}, [&](std::uint32_t r) { return !code_.rules[r].hasContext(); });

    // Rules with the same contexts compete by weight. Contexts are compared once, in sorted order.
    std::vector<std::uint32_t> sorted(members.begin(), members.end());
    const auto compareContexts = [&](std::uint32_t a, std::uint32_t b) {
        const Rule& x = code_.rules[a];
        const Rule& y = code_.rules[b];
        const auto left = [&](const Rule& r) {
            return std::span(code_.leftContexts).subspan(r.firstLeft, r.leftCount);
        };
        const auto right = [&](const Rule& r) {
            return std::span(code_.rightContexts).subspan(r.firstRight, r.rightCount);
        };
        const auto letters = [](const ContextStep& step) { return step.letter; };
        if (!std::ranges::equal(left(x), left(y)))
            return std::ranges::lexicographical_compare(left(x), left(y)) ? -1 : 1;
        if (std::ranges::equal(right(x), right(y), {}, letters, letters))
            return 0;
        return std::ranges::lexicographical_compare(right(x), right(y), {}, letters, letters) ? -1 : 1;
    };
    std::ranges::stable_sort(sorted, [&](std::uint32_t a, std::uint32_t b) { return compareContexts(a, b) < 0; });
    for (std::size_t i = 0; i < sorted.size(); ++i)
    {
        const bool same = i > 0 && compareContexts(sorted[i - 1], sorted[i]) == 0;
        code_.rules[sorted[i]].leftSide = same ? code_.rules[sorted[i - 1]].leftSide : static_cast<std::uint32_t>(i);
    }

    const Rule& first = code_.rules[members.front()];
    const bool alone = std::ranges::none_of(members.subspan(1), [&](std::uint32_t r) {
        return code_.rules[r].leftSide == first.leftSide && code_.rules[r].hasWeight;
    });
    group.always =
        first.isUnconditional() && (!first.hasWeight || (alone && first.weight.isConstant() && first.weight.value > 0));
    for (const std::uint32_t r : members)
    {
        const Rule& rule = code_.rules[r];
        group.certain |= rule.isUnconditional();
        group.changeable |= rule.isChangeable;
    }
}

void GrammarProgram::compileWord(const std::vector<Module>& modules, TextPlace place)
{
    Word word;
    word.firstLetter = static_cast<std::uint32_t>(code_.letters.size());
    word.letterCount = static_cast<std::uint32_t>(modules.size());
    word.firstArgument = static_cast<std::uint32_t>(code_.arguments.size());
    word.firstPatch = static_cast<std::uint32_t>(code_.patches.size());
    word.firstRewritable = static_cast<std::uint32_t>(code_.rewritables.size());
    std::uint32_t ordinal = 0;
    for (std::uint32_t m = 0; m < modules.size(); ++m)
    {
        const Module& module = modules[m];
        const LetterId letter = letterOf(module.symbol, module.argumentCount);
        code_.letters.push_back(letter);
        code_.moduleArguments.push_back(word.argumentCount);
        code_.ordinals.push_back(ordinal);
        ordinal += isKeyed(letter) ? 1 : 0;
        if (code_.groupOfLetter[letter] != kNothing)
            code_.rewritables.push_back(m);
        ExpressionNeeds needs;
        for (std::uint32_t a = 0; a < module.argumentCount; ++a)
        {
            const CompiledExpression value = code_.expressions.compile(
                grammar_.expressions, grammar_.arguments[module.firstArgument + a], constants_, needs);
            if (!value.isConstant())
            {
                code_.patches.push_back({word.argumentCount, m, value});
                word.patchCost += value.cost();
            }
            code_.arguments.push_back(value.isConstant() ? value.value : 0);
            ++word.argumentCount;
        }
        countDraws(needs, place);
    }
    word.patchCount = static_cast<std::uint32_t>(code_.patches.size()) - word.firstPatch;
    word.rewritableCount = static_cast<std::uint32_t>(code_.rewritables.size()) - word.firstRewritable;
    code_.words.push_back(word);
}

/// Recognises `(p == key) * bonus + base`, the weight of an inferred limb: "the drawn one, or with chance w any kin";
/// and multiples of the whole or of its parts, which people make of it.
bool GrammarProgram::tabulateWeight(const Rule& rule, Tabulated& entry, double& base) const
{
    const ExpressionPool& pool = grammar_.expressions;
    if (!rule.isUnconditional() || !rule.hasWeight)
        return false;
    base = rule.weight.value;
    if (rule.weight.isConstant())
        return base >= 0;
    // What is left of an expression without the constants that multiply or divide it.
    const auto withoutFactors = [&](ExpressionId id, double& factor) {
        for (double constant = 1;;)
        {
            const ExpressionNode& node = pool[id];
            if (node.op == ExpressionOp::Multiply && constantValue(node.second, constant))
                factor *= constant;
            else if (node.op == ExpressionOp::Divide && constantValue(node.second, constant))
                factor /= constant;
            else if (node.op == ExpressionOp::Multiply && constantValue(node.first, constant))
            {
                factor *= constant;
                id = node.second;
                continue;
            }
            else
                return id;
            id = node.first;
        }
    };
    double factor = 1;
    const ExpressionNode& sum = pool[withoutFactors(sourceOf(rule).weight, factor)];
    if (sum.op != ExpressionOp::Add)
        return false;
    entry.bonus = factor;
    const ExpressionNode& test = pool[withoutFactors(sum.first, entry.bonus)];
    if (test.op != ExpressionOp::Equal || pool[test.first].op != ExpressionOp::Parameter ||
        pool[test.first].first != 0 || !constantValue(test.second, entry.key) || !constantValue(sum.second, base))
        return false;
    base *= factor;
    return entry.bonus >= 0 && base >= 0; // false where there is no number, as by a division by 0
}

void GrammarProgram::tabulate(Group& group)
{
    double baseSum = 0;
    double bonusSum = 0;
    for (std::uint32_t i = group.first; i < group.first + group.count; ++i)
    {
        double base = 0;
        code_.tabulated[i] = {};
        if (!tabulateWeight(code_.rules[code_.candidates[i]], code_.tabulated[i], base))
            return;
        baseSum += base;
        bonusSum += code_.tabulated[i].bonus;
        code_.tabulated[i].baseSum = baseSum;
    }
    if (!std::isfinite(baseSum + bonusSum))
        return;
    group.tabulated = true;
    const auto members = std::span(code_.byKey).subspan(group.first, group.count);
    std::iota(members.begin(), members.end(), group.first);
    std::ranges::stable_sort(members, {}, [&](std::uint32_t i) { return code_.tabulated[i].key; });
}

void GrammarProgram::price()
{
    // Knuth, "A generalization of Dijkstra's algorithm" (1977): groups are settled cheapest first; a production has its
    // price once all groups in its successor are settled.
    const auto productionCount = static_cast<std::uint32_t>(grammar_.productions.size());
    std::vector<std::uint32_t> groupOfRule(productionCount, kNothing);
    for (std::uint32_t g = 0; g < code_.groups.size(); ++g)
        for (std::uint32_t i = code_.groups[g].first; i < code_.groups[g].first + code_.groups[g].count; ++i)
            if (code_.candidates[i] < productionCount)
                groupOfRule[code_.candidates[i]] = g;

    std::vector<std::vector<std::uint32_t>> users(code_.groups.size()); // a production stands once for every mention
    std::vector<std::uint32_t> unsettled(productionCount, 0);
    std::vector<double> sums(productionCount);
    using Entry = std::pair<double, std::uint32_t>; // cost, group
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
    const auto settleProduction = [&](std::uint32_t p) {
        if (sums[p] == kNever) // more than a double counts is never
            return;
        code_.rules[p].cost = sums[p];
        queue.emplace(sums[p], groupOfRule[p]);
    };
    for (std::uint32_t p = 0; p < productionCount; ++p)
    {
        const Word& word = code_.words[p + 1];
        sums[p] = 1.0 + static_cast<double>(word.letterCount);
        for (std::uint32_t i = 0; i < word.rewritableCount; ++i)
        {
            const std::uint32_t module = code_.rewritables[word.firstRewritable + i];
            users[code_.groupOfLetter[code_.letters[word.firstLetter + module]]].push_back(p);
            ++unsettled[p];
        }
        if (unsettled[p] == 0)
            settleProduction(p);
    }
    while (!queue.empty())
    {
        const auto [cost, group] = queue.top();
        queue.pop();
        if (code_.groups[group].cost != kNever)
            continue;
        code_.groups[group].cost = cost;
        for (const std::uint32_t p : users[group])
        {
            sums[p] += cost;
            if (--unsettled[p] == 0)
                settleProduction(p);
        }
    }
}

void GrammarProgram::summarise()
{
    for (const Rule& rule : code_.rules)
    {
        contextFree_ &= !rule.hasContext();
        random_ |= rule.table != kNothing;
    }
    for (const Group& group : code_.groups)
        for (std::uint32_t i = group.first; i < group.first + group.count; ++i)
            random_ |= !group.always && code_.rules[code_.candidates[i]].hasWeight;
    for (const std::uint32_t group : code_.groupOfLetter)
        constant_ &= group == kNothing || code_.groups[group].always;
    for (std::size_t p = 0; p < grammar_.productions.size(); ++p)
        constant_ &= code_.words[p + 1].patchCount == 0 && code_.rules[p].table == kNothing;
    constant_ &= contextFree_;
    for (const std::uint32_t group : code_.groupOfLetter)
        code_.fixedRule.push_back(group == kNothing            ? kNothing
                                  : code_.groups[group].always ? code_.candidates[code_.groups[group].first]
                                                               : kUndecided);
    code_.letters.resize(code_.letters.size() + kPadding);
    code_.arguments.resize(code_.arguments.size() + kPadding);
}

void GrammarProgram::countLetters()
{
    std::vector<std::uint32_t> counts(letterCount(), 0);
    for (const Word& word : code_.words)
    {
        const auto first = static_cast<std::uint32_t>(code_.letterCounts.size());
        code_.firstLetterCount.push_back(first);
        const auto letters = std::span(code_.letters).subspan(word.firstLetter, word.letterCount);
        for (const LetterId letter : letters)
            if (counts[letter]++ == 0)
                code_.letterCounts.push_back({letter, 0});
        for (LetterCount& of : std::span(code_.letterCounts).subspan(first))
            of.count = std::exchange(counts[of.letter], 0u);
    }
    code_.firstLetterCount.push_back(static_cast<std::uint32_t>(code_.letterCounts.size()));
}

/// Short expansions of a constant program, from the shortest on: streaming them costs a copy, not a walk.
void GrammarProgram::expand()
{
    if (!constant_ || random_)
        return;
    code_.expansions.resize(std::size_t{letterCount()} * kExpandedSteps);
    for (std::uint32_t steps = 1; steps <= kExpandedSteps; ++steps)
        for (std::uint32_t letter = 0; letter < letterCount(); ++letter)
            if (const std::uint32_t rule = code_.fixedRule[letter]; rule != kNothing)
                code_.expansions[std::size_t{letter} * kExpandedSteps + steps - 1] = expansionOf(rule, steps);
    code_.expandedLetters.resize(code_.expandedLetters.size() + kPadding);
    code_.expandedArguments.resize(code_.expandedArguments.size() + kPadding);
}

/// Appends the expansion to those written out; gives up, and takes it back, once it is too long.
GrammarProgram::Expansion GrammarProgram::expansionOf(std::uint32_t rule, std::uint32_t steps)
{
    const Word& word = code_.words[rule + 1];
    std::vector<LetterId>& letters = code_.expandedLetters;
    std::vector<double>& arguments = code_.expandedArguments;
    const std::size_t firstLetter = letters.size();
    const std::size_t firstArgument = arguments.size();
    const double* argument = code_.arguments.data() + word.firstArgument;
    bool fits = word.letterCount <= kExpandedLength;
    for (std::uint32_t m = 0; m < word.letterCount && fits; ++m)
    {
        const LetterId letter = code_.letters[word.firstLetter + m];
        const std::uint32_t arity = arityOf(letter);
        if (steps == 1 || code_.fixedRule[letter] == kNothing)
        {
            letters.push_back(letter);
            arguments.insert(arguments.end(), argument, argument + arity);
        }
        else if (const Expansion* part = expansion(letter, steps - 1))
        {
            for (std::uint32_t i = 0; i < part->letterCount; ++i)
                letters.push_back(letters[part->firstLetter + i]);
            for (std::uint32_t i = 0; i < part->argumentCount; ++i)
                arguments.push_back(arguments[part->firstArgument + i]);
        }
        else
            fits = false;
        argument += arity;
        fits &= letters.size() - firstLetter <= kExpandedLength && letters.size() <= kExpandedTotal &&
                arguments.size() <= kExpandedTotal;
    }
    if (!fits)
    {
        letters.resize(firstLetter);
        arguments.resize(firstArgument);
        return {};
    }
    return {static_cast<std::uint32_t>(firstLetter), static_cast<std::uint32_t>(letters.size() - firstLetter),
            static_cast<std::uint32_t>(firstArgument), static_cast<std::uint32_t>(arguments.size() - firstArgument)};
}

} // namespace espalier
