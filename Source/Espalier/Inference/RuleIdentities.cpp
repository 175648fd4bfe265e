#include <Espalier/Inference/RuleIdentities.h>

#include <Espalier/Core/Hash.h>
#include <Espalier/Inference/KinGrammar.h>
#include <algorithm>

namespace espalier {

ClassLayout ClassLayout::of(const std::vector<std::string>& parameters)
{
    const auto has = [&](const char* name) { return std::ranges::find(parameters, name) != parameters.end(); };
    const ClassLayout layout{has("i"), has("turn"), has("roll")};
    return layout.names() == parameters ? layout : ClassLayout{};
}

std::vector<std::string> ClassLayout::names() const
{
    std::vector<std::string> names;
    for (const auto& [present, name] : {std::pair(index, "i"), std::pair(turn, "turn"), std::pair(roll, "roll")})
        if (present)
            names.emplace_back(name);
    return names;
}

std::optional<std::uint32_t> ClassLayout::positionIn(const ClassLayout& other, std::uint32_t parameter) const
{
    const std::vector<std::string> others = other.names();
    const auto found = std::ranges::find(others, names()[parameter]);
    return found == others.end() ? std::nullopt : std::optional(static_cast<std::uint32_t>(found - others.begin()));
}

namespace {

/// Row of the table that an inferred rule takes for limb `number` where the drawn limb always grows.
std::optional<std::size_t> drawnRow(const Grammar& grammar, const Production& production, std::uint32_t number)
{
    if (production.row == kNoExpression)
        return {};
    std::vector<double> constants(grammar.constants.size(), 0.0); // w is 0, and there are no others
    std::vector<double> parameters(std::max<std::size_t>(1, production.parameters.size()));
    parameters[0] = number;
    ExpressionScope scope;
    scope.parameters = parameters.data();
    scope.constants = constants.data();
    const double row = evaluate(grammar.expressions, production.row, scope);
    return row >= 0 && row < 4e9 && !scope.failed ? std::optional(static_cast<std::size_t>(row)) : std::nullopt;
}

/// The limbs of all rules of a grammar as it was inferred, class by class in the order of their numbers.
std::map<std::string, std::vector<RuleLimb>> limbsOf(const Grammar& grammar, const std::vector<TransformTable>& tables,
                                                     const std::vector<RuleOrigin>& origins)
{
    const bool known = origins.size() == grammar.productions.size();
    std::map<std::string, std::vector<RuleLimb>> limbs;
    for (std::uint32_t r = 0; r < grammar.productions.size(); ++r)
    {
        const Production& production = grammar.productions[r];
        std::vector<RuleLimb>& limbsOfClass = limbs[grammar.symbols.name(production.predecessor)];
        const auto number = static_cast<std::uint32_t>(limbsOfClass.size());
        if (!known || origins[r].limbs == 1)
        {
            limbsOfClass.push_back({r, number, known ? origins[r].limb : 0, true});
            continue;
        }
        const auto table = std::ranges::find(tables, production.table, &TransformTable::name);
        // Each has a row of its own; a file that somebody wrote may say anything.
        const std::size_t rows = table == tables.end() ? 0 : table->rows.size();
        for (std::uint32_t i = 0; i < std::min<std::size_t>(origins[r].limbs, rows); ++i)
        {
            const auto row = drawnRow(grammar, production, number + i);
            if (!row || *row >= rows)
                break;
            limbsOfClass.push_back(
                {r, number + i, limbIdentity(origins[r].limb, table->rows[*row][0], table->rows[*row][2]), false});
        }
    }
    return limbs;
}

} // namespace

RuleIdentities::RuleIdentities(const Grammar& base, const Species& before, const Grammar& theirs,
                               const Species& inferred)
    : former_(limbsOf(base, before.tables, before.rules))
{
    const std::vector<RuleOrigin>& former = before.rules;
    const std::vector<RuleOrigin>& now = inferred.rules;
    const bool known =
        !former.empty() && former.size() == base.productions.size() && now.size() == theirs.productions.size();
    firstOf_.resize(theirs.productions.size());
    for (const auto& [name, limbs] : limbsOf(theirs, inferred.tables, inferred.rules))
    {
        const ClassLayout layout = ClassLayout::of(theirs.productions[limbs[0].rule].parameters);
        for (const RuleLimb& limb : limbs)
        {
            newLimbs_.emplace_back(NewModule{name, limb.number, layout}, limb.rule);
            if (known)
                byIdentity_.emplace(limb.identity, newLimbs_.size() - 1);
        }
        newClasses_.insert(name);
    }
    for (std::size_t i = newLimbs_.size(); i-- > 0;)
        firstOf_[newLimbs_[i].second] = i;
    for (const Production& production : base.productions)
        layoutOf_[base.symbols.name(production.predecessor)] = ClassLayout::of(production.parameters);
    matchFormer(base, former, theirs, now, known);
}

const RuleIdentities::NewModule& RuleIdentities::moduleOf(const std::string& symbol, std::uint32_t index) const
{
    const std::vector<RuleLimb>& limbs = former_.at(symbol);
    const auto found = index < limbs.size() ? find(limbs[index]) : std::nullopt;
    if (!found)
        throw Uncarried{symbol + (limbs.size() > 1 ? "(" + std::to_string(index) + ")" : "") +
                        ", which it names, is no longer drawn"};
    return newLimbs_[*found].first;
}

RuleIdentities::NewModule RuleIdentities::classOf(const std::string& symbol, bool sameNumbers) const
{
    std::optional<NewModule> common;
    for (const RuleLimb& limb : former_.at(symbol))
    {
        const auto found = find(limb);
        if (!found)
            continue;
        const NewModule& module = newLimbs_[*found].first;
        if ((common && common->symbol != module.symbol) || (sameNumbers && module.index != limb.number))
            throw Uncarried{"the limbs of " + symbol + " are numbered or classed in another way now"};
        common = module;
    }
    if (!common)
        throw Uncarried{symbol + " is no longer drawn"};
    return *common;
}

std::set<std::uint32_t> RuleIdentities::rulesNow(const std::string& symbol, std::uint32_t rule) const
{
    std::set<std::uint32_t> rules;
    const std::vector<RuleLimb>& limbs = former_.at(symbol); // their rules stand in order
    for (auto limb = std::ranges::lower_bound(limbs, rule, {}, &RuleLimb::rule);
         limb != limbs.end() && limb->rule == rule; ++limb)
        if (const auto now = find(*limb))
            rules.insert(newLimbs_[*now].second);
    return rules;
}

/// A limb by itself, or else, if it has a rule of its own, by that.
std::optional<std::size_t> RuleIdentities::find(const RuleLimb& limb) const
{
    const std::uint32_t rule = newOf_[limb.rule];
    const auto [first, last] = byIdentity_.equal_range(limb.identity);
    for (auto same = first; same != last; ++same) // of several equal ones that of the same rule
        if (newLimbs_[same->second].second == rule)
            return same->second;
    if (first != last)
        return first->second;
    return rule == kNoRule || !limb.alone ? std::nullopt : std::optional(firstOf_[rule]);
}

void RuleIdentities::matchFormer(const Grammar& base, const std::vector<RuleOrigin>& former, const Grammar& theirs,
                                 const std::vector<RuleOrigin>& now, bool known)
{
    newOf_.assign(base.productions.size(), kNoRule);
    std::vector<bool> taken(theirs.productions.size(), false);
    const auto round = [&](auto&& formerKey, auto&& newKey) {
        std::multimap<std::string, std::uint32_t> open;
        for (std::uint32_t t = 0; t < theirs.productions.size(); ++t)
            if (!taken[t])
                open.emplace(newKey(t), t); // equal keys stay in their order
        for (std::uint32_t r = 0; r < base.productions.size(); ++r)
        {
            if (newOf_[r] != kNoRule)
                continue;
            const std::string key = formerKey(r);
            const auto first = open.lower_bound(key);
            if (first == open.end() || first->first != key)
                continue;
            newOf_[r] = first->second;
            taken[first->second] = true;
            open.erase(first);
        }
    };
    if (!known) // by what they say
    {
        round([&](std::uint32_t r) { return keyOf(base, base.productions[r]).body(); },
              [&](std::uint32_t t) { return keyOf(theirs, theirs.productions[t]).body(); });
        return;
    }
    round([&](std::uint32_t r) { return hexDigits(former[r].limb); },
          [&](std::uint32_t t) { return hexDigits(now[t].limb); });
    // A limb may have joined others, or left them.
    for (const auto& [name, limbs] : former_)
        for (const RuleLimb& limb : limbs)
            if (const auto same = byIdentity_.find(limb.identity);
                newOf_[limb.rule] == kNoRule && same != byIdentity_.end() && !taken[newLimbs_[same->second].second])
            {
                newOf_[limb.rule] = newLimbs_[same->second].second;
                taken[newOf_[limb.rule]] = true;
            }
    round([&](std::uint32_t r) { return hexDigits(former[r].place); },
          [&](std::uint32_t t) { return hexDigits(now[t].place); });
}

} // namespace espalier
