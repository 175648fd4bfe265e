// The three-way merge of edits: `base` is the grammar as it was inferred, `ours` what people made of it, `theirs` what
// is inferred now. Names and numbers of limbs differ between base and theirs, so whatever is carried over is copied
// symbol by symbol, each limb by its identity.

#include <Espalier/Inference/RuleEdits.h>

#include <Espalier/Core/Json.h>
#include <Espalier/Inference/KinWeight.h>
#include <Espalier/Inference/RuleIdentities.h>
#include <Espalier/Inference/RuleMatch.h>
#include <Espalier/Species/Grow.h>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

namespace espalier {

namespace {

constexpr std::string_view kGone = "what it stands for is no longer drawn";
constexpr std::string_view kBoth = "inference has changed the same";

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
                if (const std::uint32_t t = identities_.newOf(r); t != kNoRule)
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
    const PipeModel pipes = hasEditedPipes(before) ? before.appearance.pipes : inferred.appearance.pipes;
    inferred.appearance = before.appearance;
    inferred.appearance.pipes = pipes;
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
