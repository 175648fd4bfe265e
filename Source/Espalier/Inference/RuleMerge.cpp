// The three-way merge of edits: `base` is the grammar as it was inferred, `ours` what people made of it, `theirs` what
// is inferred now. Names and numbers of limbs differ between base and theirs, so whatever is carried over is copied
// symbol by symbol, each limb by its identity.

#include <Espalier/Inference/RuleEdits.h>

#include <Espalier/Core/Hash.h>
#include <Espalier/Core/Json.h>
#include <Espalier/Inference/KinGrammar.h>
#include <Espalier/Inference/RuleMatch.h>
#include <Espalier/Species/Grow.h>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

namespace espalier {

namespace {

/// A part of an edit that cannot be carried, and why. Thrown and caught inside this file.
struct Uncarried
{
    std::string reason;
};

constexpr std::string_view kGone = "what it stands for is no longer drawn";
constexpr std::string_view kBoth = "inference has changed the same";

/// What the parameters of a class of limbs mean, as kin calls them: a limb's number, and the direction of its place.
/// What others call otherwise is none of these.
struct ClassLayout
{
    bool index = false;
    bool turn = false;
    bool roll = false;

    [[nodiscard]] static ClassLayout of(const std::vector<std::string>& parameters)
    {
        const auto has = [&](const char* name) { return std::ranges::find(parameters, name) != parameters.end(); };
        const ClassLayout layout{has("i"), has("turn"), has("roll")};
        return layout.names() == parameters ? layout : ClassLayout{}; // in any other order they are somebody's own
    }
    [[nodiscard]] std::vector<std::string> names() const
    {
        std::vector<std::string> names;
        for (const auto& [present, name] : {std::pair(index, "i"), std::pair(turn, "turn"), std::pair(roll, "roll")})
            if (present)
                names.emplace_back(name);
        return names;
    }
    [[nodiscard]] std::uint32_t size() const { return std::uint32_t{index} + turn + roll; }

    /// Where a parameter of this layout stands in `other`; none: it is missing there.
    [[nodiscard]] std::optional<std::uint32_t> positionIn(const ClassLayout& other, std::uint32_t parameter) const
    {
        const bool isIndex = index && parameter == 0;
        const bool isTurn = turn && parameter == std::uint32_t{index};
        if (isIndex)
            return other.index ? std::optional(0u) : std::nullopt;
        if (isTurn)
            return other.turn ? std::optional(std::uint32_t{other.index}) : std::nullopt;
        return other.roll ? std::optional(std::uint32_t{other.index} + other.turn) : std::nullopt;
    }

    friend bool operator==(const ClassLayout&, const ClassLayout&) = default;
};

/// A limb of a class: the rule that it has, alone or with others, and its number in the class.
struct RuleLimb
{
    std::uint32_t rule = 0;
    std::uint32_t number = 0;
    std::uint64_t identity = 0; ///< Meaningless where origins are unknown.
    bool alone = true;          ///< It shares the rule with no other.
};

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

/// Rules of the former grammar and of the new one that stand for the same.
class RuleIdentities
{
public:
    RuleIdentities(const Grammar& base, const Species& before, const Grammar& theirs, const Species& inferred)
        : former_(limbsOf(base, before.tables, before.rules))
    {
        const std::vector<RuleOrigin>& former = before.rules;
        const std::vector<RuleOrigin>& now = inferred.rules;
        const bool known =
            !former.empty() && former.size() == base.productions.size() && now.size() == theirs.productions.size();
        for (const auto& [name, limbs] : limbsOf(theirs, inferred.tables, inferred.rules))
        {
            firstOf_.resize(theirs.productions.size());
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
        matchRules(base, former, theirs, now, known);
    }

    std::vector<std::uint32_t> newOf; ///< Of each former rule; kNoRule: it is gone.

    [[nodiscard]] bool wasClass(const std::string& symbol) const { return former_.contains(symbol); }
    [[nodiscard]] bool isClass(const std::string& symbol) const { return newClasses_.contains(symbol); }
    /// Of a former class.
    [[nodiscard]] const ClassLayout& formerLayout(const std::string& symbol) const { return layoutOf_.at(symbol); }

    /// What a limb is called now: `index` counts where there is only one too.
    struct NewModule
    {
        std::string symbol;
        std::uint32_t index = 0;
        ClassLayout layout;
    };
    [[nodiscard]] const NewModule& moduleOf(const std::string& symbol, std::uint32_t index) const
    {
        const std::vector<RuleLimb>& limbs = former_.at(symbol);
        const auto found = index < limbs.size() ? find(limbs[index]) : std::nullopt;
        if (!found)
            throw Uncarried{symbol + (limbs.size() > 1 ? "(" + std::to_string(index) + ")" : "") +
                            ", which it names, is no longer drawn"};
        return newLimbs_[*found].first;
    }

    /// The class into which all that is left of a former class has gone; `sameNumbers` demands that its limbs kept
    /// theirs.
    [[nodiscard]] NewModule classOf(const std::string& symbol, bool sameNumbers) const
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

    /// The rules that the limbs of a former rule have now, in order; `newOf` among them, unless that is none.
    [[nodiscard]] std::set<std::uint32_t> rulesNow(const std::string& symbol, std::uint32_t rule) const
    {
        std::set<std::uint32_t> rules;
        const std::vector<RuleLimb>& limbs = former_.at(symbol); // their rules stand in order
        for (auto limb = std::ranges::lower_bound(limbs, rule, {}, &RuleLimb::rule);
             limb != limbs.end() && limb->rule == rule; ++limb)
            if (const auto now = find(*limb))
                rules.insert(newLimbs_[*now].second);
        return rules;
    }

private:
    /// A limb by itself, or else, if it has a rule of its own, by that.
    [[nodiscard]] std::optional<std::size_t> find(const RuleLimb& limb) const
    {
        const std::uint32_t rule = newOf[limb.rule];
        const auto [first, last] = byIdentity_.equal_range(limb.identity);
        for (auto same = first; same != last; ++same) // of several equal ones that of the same rule
            if (newLimbs_[same->second].second == rule)
                return same->second;
        if (first != last)
            return first->second;
        return rule == kNoRule || !limb.alone ? std::nullopt : std::optional(firstOf_[rule]);
    }

    void matchRules(const Grammar& base, const std::vector<RuleOrigin>& former, const Grammar& theirs,
                    const std::vector<RuleOrigin>& now, bool known)
    {
        newOf.assign(base.productions.size(), kNoRule);
        std::vector<bool> taken(theirs.productions.size(), false);
        const auto round = [&](auto&& formerKey, auto&& newKey) {
            std::multimap<std::string, std::uint32_t> open;
            for (std::uint32_t t = 0; t < theirs.productions.size(); ++t)
                if (!taken[t])
                    open.emplace(newKey(t), t); // equal keys stay in their order
            for (std::uint32_t r = 0; r < base.productions.size(); ++r)
            {
                if (newOf[r] != kNoRule)
                    continue;
                const std::string key = formerKey(r);
                const auto first = open.lower_bound(key);
                if (first == open.end() || first->first != key)
                    continue;
                newOf[r] = first->second;
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
                    newOf[limb.rule] == kNoRule && same != byIdentity_.end() && !taken[newLimbs_[same->second].second])
                {
                    newOf[limb.rule] = newLimbs_[same->second].second;
                    taken[newOf[limb.rule]] = true;
                }
        round([&](std::uint32_t r) { return hexDigits(former[r].place); },
              [&](std::uint32_t t) { return hexDigits(now[t].place); });
    }

    std::map<std::string, std::vector<RuleLimb>> former_;
    std::map<std::string, ClassLayout> layoutOf_;               ///< Of each former class.
    std::vector<std::pair<NewModule, std::uint32_t>> newLimbs_; ///< With their rules.
    std::vector<std::size_t> firstOf_;                          ///< Of each new rule, into `newLimbs_`.
    std::multimap<std::uint64_t, std::size_t> byIdentity_;
    std::set<std::string> newClasses_;
};

/// How the parameters of a rule change from its former grammar to the new one.
struct ParameterChange
{
    const RuleIdentities* identities = nullptr;
    std::string symbol; ///< Of the rule, formerly.
    ClassLayout former;
    ClassLayout now;

    [[nodiscard]] bool isIndex(const ExpressionNode& node) const
    {
        return former.index && node.op == ExpressionOp::Parameter && node.first == 0;
    }
    [[nodiscard]] std::uint32_t indexNow(double number) const
    {
        if (!(number >= 0 && number < 4e9 && number == std::floor(number)))
            throw Uncarried{"its weight or condition names a limb by a number that is none"};
        return identities->moduleOf(symbol, static_cast<std::uint32_t>(number)).index;
    }
};

/// Copies pieces of one grammar into another, which must have the constants they use.
class PieceCopy
{
public:
    PieceCopy(const Grammar& from, Grammar& to, const RuleIdentities* identities)
        : from_(from), to_(to), identities_(identities)
    {}

    /// `change`: of the rule that the expression belongs to, if its parameters may change.
    ExpressionId expression(ExpressionId id, const ParameterChange* change) const
    {
        using enum ExpressionOp;
        if (id == kNoExpression)
            return id;
        ExpressionNode node = from_.expressions[id];
        node.column = 0;
        if (node.op == Number || node.op == Transform)
            return to_.expressions.add(node);
        if (node.op == Constant)
        {
            const auto found = std::ranges::find(to_.constants, from_.constants[node.first].name, &NamedConstant::name);
            if (found == to_.constants.end())
                throw Uncarried{"the constant " + from_.constants[node.first].name + ", which it uses, is gone"};
            return to_.expressions.reference(Constant, static_cast<std::uint32_t>(found - to_.constants.begin()));
        }
        if (node.op == Parameter && change && node.first < change->former.size())
        {
            const auto position = change->former.positionIn(change->now, node.first);
            if (change->isIndex(node))
            {
                if (!position)
                    throw Uncarried{"its limb is the only one of its class now, and has no number"};
                (void)identities_->classOf(change->symbol, true); // where it is not only told from others by `==`
            }
            return position ? to_.expressions.reference(Parameter, *position) : to_.expressions.number(0);
        }
        if (node.op == Parameter)
            return to_.expressions.add(node);
        if (change && change->now.index && node.op == Equal && change->isIndex(from_.expressions[node.first]) &&
            from_.expressions[node.second].op == Number)
        {
            const ExpressionId parameter = to_.expressions.reference(Parameter, 0);
            const double now = change->indexNow(from_.expressions[node.second].value);
            return to_.expressions.binary(Equal, parameter, to_.expressions.number(now));
        }
        for (ExpressionId* child : {&node.first, &node.second, &node.third})
            *child = expression(*child, change);
        return to_.expressions.add(node);
    }

    /// A word whose limbs go by the names they have now.
    std::vector<Module> word(const std::vector<Module>& modules, const ParameterChange* change) const
    {
        std::vector<Module> copied;
        for (const Module& module : modules)
        {
            const std::string& name = from_.symbols.name(module.symbol);
            if (identities_ && identities_->wasClass(name))
            {
                copied.push_back(limb(module, name, change));
                continue;
            }
            copied.push_back(withArguments(module, ownSymbol(name), change));
        }
        return copied;
    }

    Production production(const Production& original) const
    {
        Production copied = original;
        copied.place = {};
        copied.predecessor = to_.symbols.intern(from_.symbols.name(original.predecessor));
        for (auto* context : {&copied.left, &copied.right})
            for (ContextModule& module : *context)
                module.symbol = to_.symbols.intern(from_.symbols.name(module.symbol));
        copied.successor = word(original.successor, nullptr);
        for (ExpressionId* id : {&copied.condition, &copied.weight, &copied.row})
            *id = expression(*id, nullptr);
        return copied;
    }

    /// A symbol that is no class: a turtle's or one that people added.
    SymbolId ownSymbol(const std::string& name) const
    {
        if (identities_ && identities_->isClass(name))
            throw Uncarried{name + " is the name of an inferred class now"};
        return to_.symbols.intern(name);
    }

private:
    /// A limb by the name and number it has now, in the same direction.
    Module limb(const Module& module, const std::string& name, const ParameterChange* change) const
    {
        const ClassLayout former = identities_->formerLayout(name);
        if (module.argumentCount != former.size())
            throw Uncarried{name + " has more or fewer arguments than its rules have parameters"};
        const auto argument = [&](std::uint32_t i) { return from_.arguments[module.firstArgument + i]; };
        std::uint32_t index = 0;
        if (former.index)
        {
            const ExpressionNode& number = from_.expressions[argument(0)];
            if (number.op != ExpressionOp::Number) // any of the class
            {
                const RuleIdentities::NewModule now = identities_->classOf(name, true);
                if (!(now.layout == former))
                    throw Uncarried{"the limbs of " + name + " have other parameters now"};
                return withArguments(module, to_.symbols.intern(now.symbol), change);
            }
            index = static_cast<std::uint32_t>(std::clamp(number.value, 0.0, 4e9));
        }
        const RuleIdentities::NewModule& now = identities_->moduleOf(name, index);
        std::vector<ExpressionId> arguments(now.layout.size(), kNoExpression);
        if (now.layout.index)
            arguments[0] = to_.expressions.number(now.index);
        for (std::uint32_t i = former.index ? 1 : 0; i < former.size(); ++i)
        {
            if (const auto position = former.positionIn(now.layout, i))
                arguments[*position] = expression(argument(i), change);
            else if (const ExpressionNode& node = from_.expressions[argument(i)];
                     node.op != ExpressionOp::Number || node.value != 0)
                throw Uncarried{"limbs like " + name + " are no longer turned that way anywhere"};
        }
        for (ExpressionId& missing : arguments)
            if (missing == kNoExpression)
                missing = to_.expressions.number(0);
        const auto first = static_cast<std::uint32_t>(to_.arguments.size());
        to_.arguments.insert(to_.arguments.end(), arguments.begin(), arguments.end());
        return {to_.symbols.intern(now.symbol), first, static_cast<std::uint32_t>(arguments.size())};
    }

    Module withArguments(const Module& module, SymbolId symbol, const ParameterChange* change) const
    {
        std::vector<ExpressionId> arguments;
        for (std::uint32_t i = 0; i < module.argumentCount; ++i)
            arguments.push_back(expression(from_.arguments[module.firstArgument + i], change));
        const auto first = static_cast<std::uint32_t>(to_.arguments.size());
        to_.arguments.insert(to_.arguments.end(), arguments.begin(), arguments.end());
        return {symbol, first, module.argumentCount};
    }

    const Grammar& from_;
    Grammar& to_;
    const RuleIdentities* identities_; ///< None: names mean the same in both.
};

bool usesParameters(const ExpressionPool& pool, ExpressionId id)
{
    if (id == kNoExpression)
        return false;
    const ExpressionNode& node = pool[id];
    using enum ExpressionOp;
    if (node.op == Parameter)
        return true;
    if (node.op == Number || node.op == Constant || node.op == Transform)
        return false;
    return usesParameters(pool, node.first) || usesParameters(pool, node.second) || usesParameters(pool, node.third);
}

/// An inferred weight `(i == k)*(1 - w) + w*c/n`: the share of the drawn limb and that of its kin.
struct KinWeight
{
    ExpressionId drawn = kNoExpression;
    ExpressionId kin = kNoExpression;
};

std::optional<KinWeight> kinWeight(const Grammar& grammar, ExpressionId weight)
{
    Production production;
    production.weight = weight;
    if (weight == kNoExpression || grammar.expressions[weight].op != ExpressionOp::Add ||
        !keyOf(grammar, production).index)
        return {};
    return KinWeight{grammar.expressions[weight].first, grammar.expressions[weight].second};
}

/// By what factors an edited weight differs from the inferred one.
struct WeightFactors
{
    double drawn = 1;
    double kin = 1;
};

/// Values of all constants, that of `w` replaced.
std::vector<double> constantsWith(const Grammar& grammar, double w)
{
    std::vector<double> values(grammar.constants.size());
    for (std::size_t i = 0; i < values.size(); ++i)
    {
        ExpressionScope scope;
        scope.constants = values.data();
        values[i] =
            grammar.constants[i].name == "w" ? w : evaluate(grammar.expressions, grammar.constants[i].value, scope);
    }
    return values;
}

/// Of an expression that knows no parameter but the first.
double valueAt(const Grammar& grammar, ExpressionId id, double i, const std::vector<double>& constants)
{
    ExpressionScope scope;
    scope.parameters = &i;
    scope.constants = constants.data();
    return evaluate(grammar.expressions, id, scope);
}

/// Whether an expression is the same wherever `meant` (its key) is, that is whether the limb or another was drawn: it
/// asks for nothing else, and draws nothing.
bool dependsOnlyOn(const Grammar& grammar, ExpressionId id, const std::string& meant)
{
    using enum ExpressionOp;
    if (id == kNoExpression || keyOf(grammar, id) == meant)
        return true;
    const ExpressionNode& node = grammar.expressions[id];
    if (node.op == Number || node.op == Constant)
        return true;
    if (node.op < Negate || node.op == Rand || node.op == Normal) // parameters, transforms, the step; chance
        return false;
    return dependsOnlyOn(grammar, node.first, meant) && dependsOnlyOn(grammar, node.second, meant) &&
           dependsOnlyOn(grammar, node.third, meant);
}

/// The factors, if the edited weight is a sum of multiples of the inferred one's two shares, however it is written:
/// checked at some values of w, where limb k was drawn and where another was.
std::optional<WeightFactors> weightFactors(const Grammar& base, const KinWeight& inferred, double index,
                                           const Grammar& ours, ExpressionId edited)
{
    constexpr double kOther = -1;
    constexpr double kTolerance = 1e-9;
    const std::string meant = keyOf(base, base.expressions[inferred.drawn].first);
    if (!dependsOnlyOn(base, inferred.drawn, meant) || !dependsOnlyOn(base, inferred.kin, meant) ||
        !dependsOnlyOn(ours, edited, meant))
        return {};
    std::optional<WeightFactors> factors;
    for (const double w : {0.25, 0.5, 0.8125})
    {
        const std::vector<double> baseConstants = constantsWith(base, w);
        const std::vector<double> ourConstants = constantsWith(ours, w);
        const double kin = valueAt(base, inferred.kin, index, baseConstants);
        const double drawn = valueAt(base, inferred.drawn, index, baseConstants);
        if (!(kin > 0 && drawn > 0))
            return {};
        WeightFactors now;
        now.kin = valueAt(ours, edited, kOther, ourConstants) / kin;
        now.drawn = (valueAt(ours, edited, index, ourConstants) - now.kin * kin) / drawn;
        for (double* factor : {&now.kin, &now.drawn})
        {
            *factor = std::round(*factor * 1e12) / 1e12; // 2, not 2.0000000000000004
            if (!(*factor >= 0 && *factor < 1e9))
                return {};
        }
        if (factors && (std::abs(factors->kin - now.kin) > kTolerance * (1 + now.kin) ||
                        std::abs(factors->drawn - now.drawn) > kTolerance * (1 + now.drawn)))
            return {};
        factors = factors.value_or(now);
    }
    return factors;
}

class EditMerge
{
public:
    EditMerge(const Species& before, const Species& inferred)
        : before_(before), inferred_(inferred), base_(before.inferred ? *before.inferred : before.grammar),
          ours_(before.grammar), theirs_(inferred.grammar), identities_(base_, before, theirs_, inferred),
          fromOurs_(ours_, result, &identities_), fromBase_(base_, result, &identities_),
          fromTheirs_(theirs_, result, nullptr)
    {}

    Grammar result;
    std::vector<EditConflict> conflicts;
    std::vector<bool> locked; ///< Of each new rule.

    void merge()
    {
        settings();
        axiom();
        const RuleMatch match = matchRules(base_, ours_);
        locked.assign(theirs_.productions.size(), false);
        rules_.resize(theirs_.productions.size());
        for (std::uint32_t r = 0; r < base_.productions.size(); ++r)
            formerRule(r, match.editedOf[r]);
        addedRules(match);
        for (const Production& production : atFront_)
            result.productions.push_back(production);
        for (std::uint32_t t = 0; t < theirs_.productions.size(); ++t)
        {
            if (!rules_[t].removed)
                result.productions.push_back(rules_[t].edited ? *rules_[t].edited
                                                              : fromTheirs_.production(theirs_.productions[t]));
            for (const Production& production : rules_[t].behind)
                result.productions.push_back(production);
        }
        for (const Production& production : ours_.interpretations)
            carry("", "interpret: " + printProduction(ours_, production),
                  [&] { result.interpretations.push_back(ownProduction(production)); });
    }

private:
    struct NewRule
    {
        bool removed = false;
        std::optional<Production> edited;
        std::vector<Production> behind; ///< Added ones.
    };

    /// Does what may not be possible; a conflict if it is not.
    template <class Function>
    void carry(const std::string& inferred, const std::string& edited, Function&& function)
    {
        try
        {
            function();
        }
        catch (const Uncarried& uncarried)
        {
            conflicts.push_back({inferred, edited, uncarried.reason});
        }
    }

    // ---- Settings ----

    /// A setting takes our value if we changed it and inference did not.
    template <class Value>
    void setting(const std::string& name, Value Grammar::*field)
    {
        const auto text = [&](const Grammar& grammar) { return textOf(grammar, grammar.*field); };
        if (text(ours_) == text(base_))
            return;
        if (text(theirs_) != text(base_) && text(theirs_) != text(ours_))
            conflicts.push_back({name + ": " + text(base_), name + ": " + text(ours_), std::string(kBoth)});
        else if constexpr (std::is_same_v<Value, std::vector<SymbolId>>)
        {
            (result.*field).clear();
            for (const SymbolId id : ours_.*field)
                carry(name + ": " + text(base_), name + ": " + text(ours_),
                      [&] { (result.*field).push_back(fromOurs_.ownSymbol(ours_.symbols.name(id))); });
        }
        else
            result.*field = ours_.*field;
    }

    static std::string textOf(const Grammar&, double value) { return formatNumber(value); }
    static std::string textOf(const Grammar&, MatchOrder order)
    {
        return order == MatchOrder::Listed ? "listed" : "context-first";
    }
    static std::string textOf(const Grammar&, const std::optional<std::uint32_t>& count)
    {
        return count ? std::to_string(*count) : "none";
    }
    static std::string textOf(const Grammar&, const std::optional<Tropism>& tropism)
    {
        if (!tropism)
            return "none";
        std::string text = formatNumber(tropism->elasticity);
        for (const double part : tropism->direction)
            text += ' ' + formatNumber(part);
        return text;
    }
    static std::string textOf(const Grammar& grammar, const std::vector<SymbolId>& symbols)
    {
        std::string text;
        for (const SymbolId id : symbols)
            text += (text.empty() ? "" : " ") + grammar.symbols.name(id);
        return text;
    }

    void settings()
    {
        for (const auto field : {&Grammar::draw, &Grammar::move, &Grammar::ignore})
        {
            (result.*field).clear();
            for (const SymbolId id : theirs_.*field)
                (result.*field).push_back(result.symbols.intern(theirs_.symbols.name(id)));
        }
        result.longSymbols = theirs_.longSymbols;
        for (const std::string& symbol : ours_.longSymbols)
            if (std::ranges::find(base_.longSymbols, symbol) == base_.longSymbols.end() &&
                std::ranges::find(result.longSymbols, symbol) == result.longSymbols.end())
                result.longSymbols.push_back(symbol);
        result.angle = theirs_.angle;
        result.step = theirs_.step;
        result.width = theirs_.width;
        result.order = theirs_.order;
        result.tropism = theirs_.tropism;
        result.iterations = theirs_.iterations;
        setting("angle", &Grammar::angle);
        setting("step", &Grammar::step);
        setting("width", &Grammar::width);
        setting("order", &Grammar::order);
        setting("tropism", &Grammar::tropism);
        setting("iterations", &Grammar::iterations);
        setting("draw", &Grammar::draw);
        setting("move", &Grammar::move);
        setting("ignore", &Grammar::ignore);
        constants();
    }

    /// In our order, for one may use those before it; then those that are new.
    void constants()
    {
        const auto find = [](const Grammar& grammar, const std::string& name) {
            const auto found = std::ranges::find(grammar.constants, name, &NamedConstant::name);
            return found == grammar.constants.end() ? nullptr : &*found;
        };
        const auto line = [](const Grammar& grammar, const NamedConstant* constant) {
            const std::string text = printGrammar(grammar);
            const std::size_t start = text.find("let " + constant->name + " = ");
            return text.substr(start, text.find('\n', start) - start);
        };
        for (const NamedConstant& constant : ours_.constants)
        {
            const NamedConstant* const base = find(base_, constant.name);
            const NamedConstant* const theirs = find(theirs_, constant.name);
            const std::string ours = keyOf(ours_, constant.value);
            const bool weChanged = !base || keyOf(base_, base->value) != ours;
            const bool theyChanged = theirs && (!base || keyOf(base_, base->value) != keyOf(theirs_, theirs->value));
            if (theirs && (theyChanged || !weChanged))
                result.constants.push_back({constant.name, fromTheirs_.expression(theirs->value, nullptr)});
            else if (weChanged)
                carry(base ? line(base_, base) : "", line(ours_, &constant), [&] {
                    result.constants.push_back({constant.name, fromOurs_.expression(constant.value, nullptr)});
                });
            if (weChanged && theyChanged && keyOf(theirs_, theirs->value) != ours)
                conflicts.push_back({base ? line(base_, base) : "", line(ours_, &constant),
                                     "inference now says " + line(theirs_, theirs)});
        }
        for (const NamedConstant& constant : theirs_.constants)
            if (!find(result, constant.name))
                result.constants.push_back({constant.name, fromTheirs_.expression(constant.value, nullptr)});
    }

    void axiom()
    {
        result.axiom = fromTheirs_.word(theirs_.axiom, nullptr);
        if (keyOf(ours_, ours_.axiom) == keyOf(base_, base_.axiom))
            return;
        carry("axiom: " + printWord(base_, base_.axiom), "axiom: " + printWord(ours_, ours_.axiom),
              [&] { result.axiom = threeWay(base_.axiom, ours_.axiom, result.axiom, nullptr, false); });
    }

    // ---- Rules ----

    /// Our word, if inference did not change it too.
    std::vector<Module> threeWay(const std::vector<Module>& base, const std::vector<Module>& ours,
                                 const std::vector<Module>& theirs, const ParameterChange* change, bool regardless)
    {
        std::vector<Module> mine = fromOurs_.word(ours, change);
        if (regardless || keyOf(result, mine) == keyOf(result, theirs))
            return mine;
        bool theyChanged = true;
        try
        {
            theyChanged = keyOf(result, fromBase_.word(base, change)) != keyOf(result, theirs);
        }
        catch (const Uncarried&)
        {} // it named what is gone
        if (theyChanged)
            throw Uncarried{std::string(kBoth)};
        return mine;
    }

    void formerRule(std::uint32_t r, std::uint32_t e)
    {
        const Production& base = base_.productions[r];
        const std::string& symbol = base_.symbols.name(base.predecessor);
        const bool isLocked = r < before_.rules.size() && before_.rules[r].locked;
        if (e != kNoRule && !isLocked && keyOf(base_, base) == keyOf(ours_, ours_.productions[e]))
            return;
        // An edit of what several limbs look like is one of all of them, should they have rules of their own now.
        const std::set<std::uint32_t> now = identities_.rulesNow(symbol, r);
        const auto conflict = [&](std::string reason) {
            conflicts.push_back({printProduction(base_, base),
                                 e == kNoRule ? std::string() : printProduction(ours_, ours_.productions[e]),
                                 std::move(reason)});
        };
        if (now.empty() && e != kNoRule) // what is gone needs no removing
            conflict(std::string(kGone) + (isLocked ? "; it was locked" : ""));
        for (const std::uint32_t t : now)
        {
            const bool wasAlone = r >= before_.rules.size() || before_.rules[r].limbs == 1;
            const bool isAlone = t >= inferred_.rules.size() || inferred_.rules[t].limbs == 1;
            if ((wasAlone && !isAlone) || rules_[t].edited)
                conflict("its limb shares a rule with others now");
            else if (e == kNoRule)
                rules_[t].removed = true;
            else
                mergeRule(base, ours_.productions[e], isLocked, t);
        }
    }

    /// What we made of a former rule, as new rule `t`.
    void mergeRule(const Production& base, const Production& ours, bool isLocked, std::uint32_t t)
    {
        const RuleKey baseKey = keyOf(base_, base);
        const RuleKey ourKey = keyOf(ours_, ours);
        const std::string baseText = printProduction(base_, base);
        const std::string ourText = printProduction(ours_, ours);
        locked[t] = isLocked;
        const Production& theirs = theirs_.productions[t];
        Production merged = fromTheirs_.production(theirs);
        const ParameterChange change{&identities_, base_.symbols.name(base.predecessor),
                                     ClassLayout::of(base.parameters), ClassLayout::of(theirs.parameters)};
        // What was edited and what was not are carried apart, so that one conflict does not take all with it.
        if (isLocked || baseKey.successor != ourKey.successor)
            carry(baseText, ourText, [&] {
                merged.successor = threeWay(base.successor, ours.successor, merged.successor, &change, isLocked);
            });
        if (isLocked || baseKey.condition != ourKey.condition)
            carry(baseText, ourText, [&] { merged.condition = fromOurs_.expression(ours.condition, &change); });
        if (isLocked || baseKey.weight != ourKey.weight)
            carry(baseText, ourText,
                  [&] { merged.weight = weight(base, ours, theirs, merged.weight, change, isLocked); });
        const bool isNumbered = ours.row == kNoExpression || ours_.expressions[ours.row].op == ExpressionOp::Number;
        if (baseKey.draw != ourKey.draw || (isLocked && isNumbered))
            carry(baseText, ourText, [&] {
                try
                {
                    drawFrom(ours, merged);
                }
                catch (const Uncarried&)
                {
                    if (baseKey.draw != ourKey.draw)
                        throw;
                    throw Uncarried{"it is locked, but its transform was drawn anew"};
                }
            });
        if (merged.parameters.size() == ours.parameters.size())
            merged.parameters = ours.parameters; // whatever people call them
        rules_[t].edited = std::move(merged);
    }

    ExpressionId weight(const Production& base, const Production& ours, const Production& theirs,
                        ExpressionId theirWeight, const ParameterChange& change, bool isLocked)
    {
        using enum ExpressionOp;
        ExpressionPool& pool = result.expressions;
        if (ours.weight == kNoExpression)
            return kNoExpression;
        if (isLocked)
            return !change.now.index && usesParameters(ours_.expressions, ours.weight)
                       ? kNoExpression // it is taken whatever it weighs
                       : fromOurs_.expression(ours.weight, &change);
        const ExpressionNode node = ours_.expressions[ours.weight];
        const std::string baseKey = keyOf(base_, base.weight);
        const auto isBase = [&](ExpressionId id) { return !baseKey.empty() && keyOf(ours_, id) == baseKey; };
        const auto scaled = [&](ExpressionOp op, ExpressionId factor, bool inFront) {
            const ExpressionId copied = fromOurs_.expression(factor, &change);
            if (theirWeight == kNoExpression)
                return op == Divide ? pool.binary(Divide, pool.number(1), copied) : copied;
            return inFront ? pool.binary(op, copied, theirWeight) : pool.binary(op, theirWeight, copied);
        };
        if (node.op == Multiply && isBase(node.second))
            return scaled(Multiply, node.first, true);
        if ((node.op == Multiply || node.op == Divide) && isBase(node.first))
            return scaled(node.op, node.second, false);
        if (base.weight == kNoExpression && !usesParameters(ours_.expressions, ours.weight))
            return scaled(Multiply, ours.weight, true);
        if (base.weight != kNoExpression && node.op == Number && base_.expressions[base.weight].op == Number &&
            base_.expressions[base.weight].value != 0 && theirWeight != kNoExpression)
            return byFactor(node.value / base_.expressions[base.weight].value, theirWeight);
        const auto isOfLimbs = [&](const Production& rule) {
            return change.former.index && rule.parameters.size() == base.parameters.size() && !rule.hasContext();
        };
        const auto inferred = kinWeight(base_, base.weight);
        if (inferred && isOfLimbs(base) && isOfLimbs(ours))
            if (const auto factors = weightFactors(base_, *inferred, *keyOf(base_, base).index, ours_, ours.weight))
                return byFactors(*factors, theirs, theirWeight);
        if (!usesParameters(ours_.expressions, ours.weight))
            return fromOurs_.expression(ours.weight, &change);
        // Written anew: it stays so as long as what it was written for stays.
        if (theirWeight == kNoExpression ||
            keyOf(result, fromBase_.expression(base.weight, &change)) != keyOf(result, theirWeight))
            throw Uncarried{"inference has changed the weight too, and the edit is no multiple of it"};
        return fromOurs_.expression(ours.weight, &change);
    }

    ExpressionId byFactor(double factor, ExpressionId theirWeight)
    {
        ExpressionPool& pool = result.expressions;
        if (pool[theirWeight].op == ExpressionOp::Number)
            return pool.number(pool[theirWeight].value * factor);
        return pool.binary(ExpressionOp::Multiply, pool.number(factor), theirWeight);
    }

    ExpressionId byFactors(const WeightFactors& factors, const Production& theirs, ExpressionId theirWeight)
    {
        ExpressionPool& pool = result.expressions;
        if (factors.drawn == 1 && factors.kin == 1)
            return theirWeight;
        const auto shares = kinWeight(theirs_, theirs.weight);
        if (!shares)
            return theirWeight == kNoExpression ? pool.number(factors.drawn) : byFactor(factors.drawn, theirWeight);
        if (factors.drawn == factors.kin)
            return byFactor(factors.kin, theirWeight);
        const auto share = [&](ExpressionId id, double factor) {
            const ExpressionId copied = fromTheirs_.expression(id, nullptr);
            return factor == 1 ? copied : pool.binary(ExpressionOp::Multiply, pool.number(factor), copied);
        };
        const ExpressionId drawn = share(shares->drawn, factors.drawn);
        return pool.binary(ExpressionOp::Add, drawn, share(shares->kin, factors.kin));
    }

    /// Another table or row: rows go by what they hold, for their numbers change.
    void drawFrom(const Production& ours, Production& merged)
    {
        const auto now = std::ranges::find(inferred_.tables, ours.table, &TransformTable::name);
        const auto former = std::ranges::find(before_.tables, ours.table, &TransformTable::name);
        if (!ours.table.empty() && now == inferred_.tables.end())
            throw Uncarried{"there is no table " + ours.table + " any more"};
        ExpressionId row = kNoExpression;
        if (ours.row != kNoExpression)
        {
            const ExpressionNode& node = ours_.expressions[ours.row];
            if (node.op != ExpressionOp::Number || former == before_.tables.end() || !(node.value >= 0) ||
                node.value >= static_cast<double>(former->rows.size()))
                throw Uncarried{"its row is no number of a row"};
            const auto found = std::ranges::find(now->rows, former->rows[static_cast<std::size_t>(node.value)]);
            if (found == now->rows.end())
                throw Uncarried{"the transform of its row is no longer drawn"};
            row = result.expressions.number(static_cast<double>(found - now->rows.begin()));
        }
        merged.table = ours.table;
        merged.row = row;
    }

    void addedRules(const RuleMatch& match)
    {
        std::vector<Production>* place = &atFront_;
        for (std::uint32_t e = 0; e < ours_.productions.size(); ++e)
        {
            if (const std::uint32_t r = match.inferredOf[e]; r != kNoRule)
            {
                if (const std::uint32_t t = identities_.newOf[r]; t != kNoRule)
                    place = &rules_[t].behind;
                continue;
            }
            carry("", printProduction(ours_, ours_.productions[e]),
                  [&] { place->push_back(ownProduction(ours_.productions[e])); });
        }
    }

    /// The parameters of a class, by the names that people gave them.
    static std::vector<std::string> parametersNow(const std::vector<std::string>& ours, const ParameterChange& change)
    {
        std::vector<std::string> names = change.now.names();
        for (std::uint32_t i = 0; i < ours.size(); ++i)
            if (const auto position = change.former.positionIn(change.now, i))
                names[*position] = ours[i];
        return names;
    }

    /// A rule that people wrote: of a symbol of their own, or one more of a class.
    Production ownProduction(const Production& ours)
    {
        Production copied = ours;
        copied.place = {};
        const std::string& name = ours_.symbols.name(ours.predecessor);
        ParameterChange change{&identities_, name, {}, {}};
        const bool isClass = identities_.wasClass(name);
        if (isClass)
        {
            const RuleIdentities::NewModule now = identities_.classOf(name, false);
            copied.predecessor = result.symbols.intern(now.symbol);
            change.former = identities_.formerLayout(name);
            change.now = now.layout;
            if (ours.parameters.size() == change.former.size())
                copied.parameters = parametersNow(ours.parameters, change);
        }
        else
            copied.predecessor = fromOurs_.ownSymbol(name);
        for (auto* context : {&copied.left, &copied.right})
            for (ContextModule& module : *context)
            {
                const std::string& symbol = ours_.symbols.name(module.symbol);
                module.symbol = identities_.wasClass(symbol)
                                    ? result.symbols.intern(identities_.classOf(symbol, false).symbol)
                                    : fromOurs_.ownSymbol(symbol);
            }
        const ParameterChange* const mine = isClass ? &change : nullptr;
        copied.successor = fromOurs_.word(ours.successor, mine);
        for (ExpressionId* id : {&copied.condition, &copied.weight})
            *id = fromOurs_.expression(*id, mine);
        if (!ours.table.empty())
            drawFrom(ours, copied);
        return copied;
    }

    const Species& before_;
    const Species& inferred_;
    const Grammar& base_;
    const Grammar& ours_;
    const Grammar& theirs_;
    RuleIdentities identities_;
    PieceCopy fromOurs_;
    PieceCopy fromBase_;
    PieceCopy fromTheirs_;
    std::vector<NewRule> rules_; ///< Of each new rule.
    std::vector<Production> atFront_;
};

/// A grammar that grows and reads back as it is.
Expected<void> tryOut(const Species& species, const GrowOptions& trial)
{
    const auto read = parseGrammar(printGrammar(species.grammar), "the merged grammar", Limits{}.ofInferredGrammars());
    if (!read)
        return tl::make_unexpected(read.error());
    const auto grower = Grower::make(species);
    if (!grower)
        return tl::make_unexpected(grower.error());
    GrowScratch scratch;
    Skeleton skeleton;
    return grower->grow(Seed{1}, trial, scratch, skeleton);
}

} // namespace

CarriedEdits carryEdits(const Species& before, Species& inferred, const GrowOptions& trial)
{
    CarriedEdits carried;
    // What is not inferred is somebody's, without being asked.
    inferred.appearance.bark = before.appearance.bark;
    inferred.appearance.palette = before.appearance.palette;
    const std::vector<EditConflict> formerConflicts = before.conflicts;
    if (hasEdits(before))
    {
        EditMerge merge(before, inferred);
        merge.merge();
        Species merged = inferred;
        merged.grammar = std::move(merge.result);
        for (std::size_t t = 0; t < merged.rules.size(); ++t)
            merged.rules[t].locked = merge.locked[t];
        if (!(merged.grammar == inferred.grammar))
            merged.inferred = inferred.grammar;
        carried.conflicts = std::move(merge.conflicts);
        if (const auto grows = tryOut(merged, trial); !grows)
        {
            // Each edit by itself could be carried; which of them to leave out is for people to say.
            const std::string reason = "with all edits the grammar would not grow: " + grows.error().what;
            const Grammar& theirs = inferred.grammar;
            const RuleMatch match = matchRules(theirs, merged.grammar);
            for (std::uint32_t t = 0; t < theirs.productions.size(); ++t)
                if (match.editedOf[t] == kNoRule)
                    carried.conflicts.push_back({printProduction(theirs, theirs.productions[t]), "", reason});
            const std::string theirText = printGrammar(theirs);
            const std::string mergedText = printGrammar(merged.grammar);
            const std::vector<std::string_view> theirLines = linesOf(theirText);
            const std::set<std::string_view> known(theirLines.begin(), theirLines.end());
            for (const std::string_view line : linesOf(mergedText))
                if (!known.contains(line) && !line.starts_with("symbols:"))
                    carried.conflicts.push_back({"", std::string(line), reason});
            merged = inferred; // a lock holds what is inferred now
            for (std::size_t t = 0; t < merged.rules.size(); ++t)
                merged.rules[t].locked = merge.locked[t];
        }
        inferred = std::move(merged);
    }
    // Each is told once, and only if it is news.
    inferred.conflicts = formerConflicts;
    std::vector<EditConflict> found;
    found.swap(carried.conflicts);
    for (EditConflict& conflict : found)
        if (std::ranges::find(inferred.conflicts, conflict) == inferred.conflicts.end())
        {
            inferred.conflicts.push_back(conflict);
            carried.conflicts.push_back(std::move(conflict));
        }
    const EditSummary summary = summarizeEdits(inferred);
    carried.edits = summary.edits();
    carried.locks = summary.locked;
    return carried;
}

} // namespace espalier
