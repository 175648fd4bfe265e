#include <Espalier/Grammar/Derivation.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <queue>

namespace espalier {

namespace {

/// The value of an expression that depends on nothing but constants; nothing otherwise.
bool constantValue(const ExpressionPool& pool, ExpressionId id, const std::vector<double>& constants, double& value)
{
    const auto isConstant = [&](const auto& self, ExpressionId e) -> bool {
        using enum ExpressionOp;
        if (e == kNoExpression)
            return true;
        const ExpressionNode& node = pool[e];
        switch (node.op)
        {
        case Number:
        case Constant:
        case Pi:
            return true;
        case Parameter:
        case Transform:
        case Step:
        case Rand:
        case Normal:
            return false;
        default:
            return self(self, node.first) && self(self, node.second) && self(self, node.third);
        }
    };
    if (!isConstant(isConstant, id))
        return false;
    ExpressionScope scope;
    scope.constants = constants.data();
    value = evaluate(pool, id, scope);
    return !scope.failed;
}

} // namespace

Expected<GrammarProgram> GrammarProgram::make(const Grammar& grammar, std::span<const TransformTable> tables)
{
    GrammarProgram program;
    program.grammar_ = grammar;
    program.tables_.assign(tables.begin(), tables.end());
    if (auto done = program.evaluateConstants(); !done)
        return tl::make_unexpected(done.error());
    if (auto done = program.resolveTables(); !done)
        return tl::make_unexpected(done.error());
    program.groupProductions();
    for (Group& group : program.groups_)
        program.tabulate(group);
    program.price();
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

Expected<void> GrammarProgram::resolveTables()
{
    std::vector<std::uint32_t> byName(tables_.size());
    std::iota(byName.begin(), byName.end(), 0u);
    std::ranges::stable_sort(byName, {}, [&](std::uint32_t i) { return std::string_view(tables_[i].name); });
    for (const Production& production : grammar_.productions)
    {
        tableOf_.push_back(kNothing);
        if (production.table.empty())
            continue;
        const auto found = std::ranges::lower_bound(byName, std::string_view(production.table), {},
                                                    [&](std::uint32_t i) { return std::string_view(tables_[i].name); });
        if (found == byName.end() || tables_[*found].name != production.table || tables_[*found].rows.empty())
            return failure(ErrorKind::BadInput, {{}, production.line, 1},
                           "the production `" + printProduction(grammar_, production) + "` draws from the table " +
                               production.table + ", which does not exist or is empty",
                           "the name of a table of transforms with at least one row");
        tableOf_.back() = *found;
        const std::size_t rows = tables_[*found].rows.size();
        double row = 0;
        if (production.row != kNoExpression && constantValue(grammar_.expressions, production.row, constants_, row) &&
            !(row >= 0 && row < static_cast<double>(rows)))
            return failure(ErrorKind::BadInput, {{}, production.line, 1},
                           "the production `" + printProduction(grammar_, production) +
                               "` takes a row that the table " + production.table + " lacks",
                           "a row from 0 to " + std::to_string(rows - 1));
    }
    return {};
}

void GrammarProgram::groupProductions()
{
    // Counting sort by group keeps the order of the text inside each group.
    firstGroup_.assign(grammar_.symbols.size(), kNothing);
    std::vector<std::uint32_t> groupOfProduction;
    for (const Production& production : grammar_.productions)
    {
        const auto parameters = static_cast<std::uint32_t>(production.parameters.size());
        std::uint32_t* link = &firstGroup_[production.predecessor];
        while (*link != kNothing && groups_[*link].parameters != parameters)
            link = &groups_[*link].next;
        if (*link == kNothing)
        {
            *link = static_cast<std::uint32_t>(groups_.size());
            groupOfProduction.push_back(*link);
            Group group;
            group.parameters = parameters;
            group.count = 1;
            groups_.push_back(group); // invalidates link
            continue;
        }
        groupOfProduction.push_back(*link);
        ++groups_[*link].count;
    }
    std::uint32_t total = 0;
    for (Group& group : groups_)
    {
        group.first = total;
        total += group.count;
        group.count = 0;
    }
    candidates_.resize(total);
    for (std::uint32_t i = 0; i < groupOfProduction.size(); ++i)
    {
        Group& group = groups_[groupOfProduction[i]];
        candidates_[group.first + group.count++] = i;
    }
    tabulated_.resize(total);
    byKey_.resize(total);
}

std::uint32_t GrammarProgram::groupOf(const Module& module) const noexcept
{
    std::uint32_t group = firstGroup_[module.symbol];
    while (group != kNothing && groups_[group].parameters != module.argumentCount)
        group = groups_[group].next;
    return group;
}

/// Recognises `(p == key) * bonus + base`, the weight of an inferred limb: "the drawn one, or with chance w any kin".
bool GrammarProgram::tabulateWeight(const Production& production, Tabulated& entry, double& base) const
{
    const ExpressionPool& pool = grammar_.expressions;
    if (production.condition != kNoExpression || production.weight == kNoExpression)
        return false;
    if (constantValue(pool, production.weight, constants_, base))
        return base >= 0;
    const ExpressionNode& sum = pool[production.weight];
    if (sum.op != ExpressionOp::Add || pool[sum.first].op != ExpressionOp::Multiply)
        return false;
    const ExpressionNode& product = pool[sum.first];
    const ExpressionNode& test = pool[product.first];
    return test.op == ExpressionOp::Equal && pool[test.first].op == ExpressionOp::Parameter &&
           pool[test.first].first == 0 && constantValue(pool, test.second, constants_, entry.key) &&
           constantValue(pool, product.second, constants_, entry.bonus) &&
           constantValue(pool, sum.second, constants_, base) && entry.bonus >= 0 && base >= 0;
}

void GrammarProgram::tabulate(Group& group)
{
    double baseSum = 0;
    double bonusSum = 0;
    for (std::uint32_t i = group.first; i < group.first + group.count; ++i)
    {
        double base = 0;
        tabulated_[i] = {};
        if (!tabulateWeight(grammar_.productions[candidates_[i]], tabulated_[i], base))
            return;
        baseSum += base;
        bonusSum += tabulated_[i].bonus;
        tabulated_[i].baseSum = baseSum;
    }
    if (!std::isfinite(baseSum + bonusSum))
        return;
    group.tabulated = true;
    const auto members = std::span(byKey_).subspan(group.first, group.count);
    std::iota(members.begin(), members.end(), group.first);
    std::ranges::stable_sort(members, {}, [&](std::uint32_t i) { return tabulated_[i].key; });
}

void GrammarProgram::price()
{
    // Knuth, "A generalization of Dijkstra's algorithm" (1977): groups are settled cheapest first; a production has its
    // price once all groups in its successor are settled.
    const auto productionCount = static_cast<std::uint32_t>(grammar_.productions.size());
    costs_.assign(productionCount, kNever);
    std::vector<std::uint32_t> groupOfProduction(productionCount);
    for (std::uint32_t g = 0; g < groups_.size(); ++g)
        for (std::uint32_t i = groups_[g].first; i < groups_[g].first + groups_[g].count; ++i)
            groupOfProduction[candidates_[i]] = g;

    std::vector<std::vector<std::uint32_t>> users(groups_.size()); // a production stands once for every mention
    std::vector<std::uint32_t> unsettled(productionCount, 0);
    std::vector<double> sums(productionCount);
    using Entry = std::pair<double, std::uint32_t>; // cost, group
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
    const auto settleProduction = [&](std::uint32_t p) {
        if (sums[p] == kNever) // more than a double counts is never
            return;
        costs_[p] = sums[p];
        queue.emplace(costs_[p], groupOfProduction[p]);
    };
    for (std::uint32_t p = 0; p < productionCount; ++p)
    {
        sums[p] = 1.0 + static_cast<double>(grammar_.productions[p].successor.size());
        for (const Module& module : grammar_.productions[p].successor)
            if (const std::uint32_t group = groupOf(module); group != kNothing)
            {
                users[group].push_back(p);
                ++unsettled[p];
            }
        if (unsettled[p] == 0)
            settleProduction(p);
    }
    while (!queue.empty())
    {
        const auto [cost, group] = queue.top();
        queue.pop();
        if (groups_[group].cost != kNever)
            continue;
        groups_[group].cost = cost;
        for (const std::uint32_t p : users[group])
        {
            sums[p] += cost;
            if (--unsettled[p] == 0)
                settleProduction(p);
        }
    }
}

} // namespace espalier
