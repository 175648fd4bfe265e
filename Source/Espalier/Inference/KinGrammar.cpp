#include <Espalier/Inference/KinGrammar.h>

#include <Espalier/Inference/Divergence.h>
#include <Espalier/Inference/Draft.h>
#include <Espalier/Inference/GrammarWriter.h>
#include <Espalier/Inference/KinNames.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace espalier {

namespace {

/// What was observed of each kind of template that occurs (kindsOf), in arrays by its first template.
struct LimbTransforms
{
    std::vector<TransformTable> tables; ///< Distinct scalings and branching angles; directions belong to the places.
    std::vector<std::uint32_t> tableOf; ///< Of each kind; kNoPiece if it does not occur.
    std::vector<std::uint32_t> rowOf;   ///< Of each limb.
    std::vector<bool> rotates;          ///< Of each kind: some place turns it.
    std::vector<bool> rolls;
};

/// What was drawn of one kind of template, of every occurrence.
struct Observed
{
    std::vector<double> scalings, rotations, branchings, rolls;
    std::map<std::array<double, 2>, std::uint32_t> rows; ///< Of its table.
    bool isUpright = true;                               ///< Wherever it was drawn.
};

/// How far each parameter is moved so that two trees with the same branches still differ: a share of what it was seen
/// to vary. At weight 0 nothing moves; at 1 the share is `jitter`. A deviation of scalings counts as at most their
/// mean, and what comes of it stays so small that no scaling can become negative.
///
/// What stands upright is rolled further. The ground does not tell azimuths about an upright axis apart, so heights and
/// angles stay, and the boughs of a trunk, which leave it in few drawn directions, come to stand all round. Where it
/// was always rolled alike, or by half turns, as in a planar tree, it stays so.
std::array<double, 4> smoothing(const Observed& observed, double weight, double jitter)
{
    constexpr double kMostScaling = 0.4;
    constexpr double kUprightRoll = 60; // degrees
    constexpr double kSoonUpright = 50; // with the usual jitter it is reached at weight 0.2
    constexpr double kAlike = 0.01;     // degrees
    const double share = jitter * weight;
    std::array<double, 4> spread{
        std::min({kMostScaling, jitter, share * deviationOf(observed.scalings) / meanOf(observed.scalings)}),
        share * circularDeviationOf(observed.rotations), share * deviationOf(observed.branchings),
        share * circularDeviationOf(observed.rolls)};
    std::vector<double> doubled; // so that half turns are whole ones
    for (const double roll : observed.rolls)
        doubled.push_back(2 * roll);
    if (observed.isUpright && circularDeviationOf(doubled) > 2 * kAlike)
        spread[3] = std::max(spread[3], kUprightRoll * std::min(1.0, kSoonUpright * share));
    for (double& value : spread)
        value = std::round(value * 1e4) / 1e4;
    return spread;
}

LimbTransforms transformsOf(const LimbTable& limbs, const KinClasses& classes, const TemplateLibrary& library,
                            double jitter)
{
    const std::size_t pieces = library.templates.size();
    std::vector<Observed> observed(pieces);
    LimbTransforms result;
    result.tableOf.assign(pieces, kNoPiece);
    result.rotates.assign(pieces, false);
    result.rolls.assign(pieces, false);
    const auto direct = [&](const LimbUse& use, std::uint32_t count) {
        if (use.limb == kNoInstance)
            return;
        const std::uint32_t piece = limbs.limbs[use.limb].kind;
        observed[piece].rotations.insert(observed[piece].rotations.end(), count, use.direction.rotation);
        observed[piece].rolls.insert(observed[piece].rolls.end(), count, use.direction.roll);
        result.rotates[piece] = result.rotates[piece] || use.direction.rotation != 0;
        result.rolls[piece] = result.rolls[piece] || use.direction.roll != 0;
    };
    // Of mirror images nothing is observed: that branches come to either side says nothing of how much they vary.
    const bool mirrored = limbs.drawnInstances < limbs.limbOf.size();
    for (std::size_t tree = 0; tree < limbs.roots.size() / (mirrored ? 2 : 1); ++tree)
        direct(limbs.roots[tree], limbs.rootWeights[tree]);
    for (std::uint32_t i = 0; i < limbs.limbs.size(); ++i)
    {
        const Limb& limb = limbs.limbs[i];
        Observed& seen = observed[limb.kind];
        if (result.tableOf[limb.kind] == kNoPiece)
        {
            result.tableOf[limb.kind] = static_cast<std::uint32_t>(result.tables.size());
            result.tables.push_back({library.templates[limb.kind].name, {}});
        }
        seen.isUpright = seen.isUpright && limb.isUpright;
        seen.scalings.insert(seen.scalings.end(), limb.observations, limb.scaling);
        seen.branchings.insert(seen.branchings.end(), limb.observations, limb.branchingAngle);
        for (const LimbUse& use : loadOf(limbs, i))
            direct(use, limb.observations);
    }
    // A run has rows of its own, one behind the other; other limbs share what is equal.
    result.rowOf.resize(limbs.limbs.size());
    for (std::uint32_t c = 0; c < classes.kin.size(); ++c)
        forEachRun(classes, c, [&](std::uint32_t first, std::uint32_t length) {
            for (std::uint32_t i = first; i < first + length; ++i)
            {
                const Limb& limb = limbs.limbs[classes.kin[c][i]];
                auto& rows = result.tables[result.tableOf[limb.kind]].rows;
                auto row = static_cast<std::uint32_t>(rows.size());
                if (length == 1)
                    row = observed[limb.kind].rows.try_emplace({limb.scaling, limb.branchingAngle}, row).first->second;
                if (row == rows.size())
                    rows.push_back({limb.scaling, 0, limb.branchingAngle, 0});
                result.rowOf[classes.kin[c][i]] = row;
            }
        });
    for (std::size_t piece = 0; piece < pieces; ++piece)
        if (result.tableOf[piece] != kNoPiece)
            result.tables[result.tableOf[piece]].spread = smoothing(observed[piece], classes.weight, jitter);
    return result;
}

/// Writes the grammar of one choice of classes and weight.
class KinGrammarWriter
{
public:
    KinGrammarWriter(const TemplateLibrary& library, const LimbTable& limbs, const KinClasses& classes, double jitter)
        : library_(library), limbs_(limbs), classes_(classes),
          transforms_(transformsOf(limbs, classes, library, jitter)), grammar_(grammarFor(library)),
          indexInClass_(limbs.limbs.size())
    {
        for (const std::vector<std::uint32_t>& kin : classes.kin)
            for (std::uint32_t i = 0; i < kin.size(); ++i)
                indexInClass_[kin[i]] = i;
    }

    /// What each production stands for.
    std::vector<KinRule> write(Species& species)
    {
        std::vector<std::uint32_t> pieces;
        for (const std::vector<std::uint32_t>& kin : classes_.kin)
            pieces.push_back(limbs_.limbs[kin[0]].kind);
        KinNames names = kinNames(library_, pieces);
        start_ = std::move(names.start);
        names_ = std::move(names.classes);
        for (const std::string& name : names_)
            if (name.size() > 1)
                grammar_.longSymbols.push_back(name);
        weight_ = 0;
        grammar_.constants.push_back({"w", grammar_.expressions.number(classes_.weight)});
        axiom();
        for (std::uint32_t c = 0; c < classes_.kin.size(); ++c)
            classProductions(c);
        species.grammar = std::move(grammar_);
        species.tables = std::move(transforms_.tables);
        return std::move(rules_);
    }

private:
    [[nodiscard]] bool alone(std::uint32_t limb) const { return classes_.kin[classes_.classOf[limb]].size() == 1; }

    /// `C(i,turn,roll)`: limb i of class C or one of its kin, in the direction of the place. No i where there is only
    /// one, no turn or roll where none ever is.
    Module moduleOf(const LimbUse& use)
    {
        const std::uint32_t piece = limbs_.limbs[use.limb].kind;
        Module module = indexed(names_[classes_.classOf[use.limb]], use.limb);
        const auto argue = [&](double value) {
            // -20 reads as the negative of 20.
            ExpressionId id = grammar_.expressions.number(std::abs(value));
            if (value < 0)
                id = grammar_.expressions.unary(ExpressionOp::Negate, id);
            grammar_.arguments.push_back(id);
            ++module.argumentCount;
        };
        if (transforms_.rotates[piece])
            argue(use.direction.rotation);
        if (transforms_.rolls[piece])
            argue(use.direction.roll);
        return module;
    }

    Module indexed(const std::string& name, std::uint32_t limb)
    {
        const SymbolId symbol = grammar_.symbols.intern(name);
        const auto first = static_cast<std::uint32_t>(grammar_.arguments.size());
        if (alone(limb))
            return {symbol, first, 0};
        grammar_.arguments.push_back(grammar_.expressions.number(indexInClass_[limb]));
        return {symbol, first, 1};
    }

    /// The direction of a production of class c, which takes it from its module, and the smoothing from the table.
    PlacedDirection direct(std::uint32_t piece, std::vector<std::string>& parameters)
    {
        ExpressionPool& pool = grammar_.expressions;
        const TransformTable& table = transforms_.tables[transforms_.tableOf[piece]];
        const auto component = [&](bool given, const char* name, std::uint32_t index) {
            if (!given)
                return kNoExpression;
            const ExpressionId place =
                pool.reference(ExpressionOp::Parameter, static_cast<std::uint32_t>(parameters.size()));
            parameters.emplace_back(name);
            return table.spread[index] == 0
                       ? place
                       : pool.binary(ExpressionOp::Add, place, pool.reference(ExpressionOp::Transform, index));
        };
        PlacedDirection direction;
        direction.rotation = component(transforms_.rotates[piece], "turn", 1);
        direction.roll = component(transforms_.rolls[piece], "roll", 3);
        return direction;
    }

    void axiom()
    {
        if (limbs_.roots.size() == 1)
        {
            grammar_.axiom.push_back(moduleOf(limbs_.roots[0]));
            return;
        }
        grammar_.longSymbols.push_back(start_);
        const SymbolId start = grammar_.symbols.intern(start_);
        grammar_.append(grammar_.axiom, start);
        for (std::size_t tree = 0; tree < limbs_.roots.size(); ++tree)
        {
            const LimbUse& root = limbs_.roots[tree];
            Production production;
            production.predecessor = start;
            production.successor.push_back(moduleOf(root));
            production.weight = grammar_.expressions.number(limbs_.rootWeights[tree]);
            add(std::move(production), {root.limb, KinRule::kStart});
        }
    }

    /// Limbs `first` to `first + length - 1` of class `c`, which share a rule.
    struct Run
    {
        std::uint32_t c;
        std::uint32_t first;
        std::uint32_t length;
    };

    [[nodiscard]] std::uint32_t firstLimb(Run run) const { return classes_.kin[run.c][run.first]; }
    [[nodiscard]] bool isWholeClass(Run run) const { return run.length == classes_.kin[run.c].size(); }

    /// `1 - w`
    ExpressionId stay()
    {
        const ExpressionId one = grammar_.expressions.number(1);
        return grammar_.expressions.binary(ExpressionOp::Subtract, one,
                                           grammar_.expressions.reference(ExpressionOp::Constant, weight_));
    }
    /// `i == k`, or `i >= a && i < b`: a limb of the run is meant.
    ExpressionId isMeant(Run run)
    {
        using enum ExpressionOp;
        ExpressionPool& pool = grammar_.expressions;
        const ExpressionId i = pool.reference(Parameter, 0);
        const ExpressionId first = pool.number(run.first);
        if (run.length == 1)
            return pool.binary(Equal, i, first);
        const ExpressionId notBefore = pool.binary(GreaterEqual, i, first);
        const ExpressionId notBehind = pool.binary(Less, i, pool.number(run.first + run.length));
        return pool.binary(And, notBefore, notBehind);
    }
    /// `w * count / occurrences`: the chance that the run is taken as any kin.
    ExpressionId kinShare(Run run)
    {
        using enum ExpressionOp;
        ExpressionPool& pool = grammar_.expressions;
        const ExpressionId w = pool.reference(Constant, weight_);
        const std::uint32_t count = run.length * limbs_.limbs[firstLimb(run)].count;
        const ExpressionId share = count == 1 ? w : pool.binary(Multiply, w, pool.number(count));
        return pool.binary(Divide, share, pool.number(classes_.occurrences[run.c]));
    }

    /// `(i == k) * (1 - w) + w * count / occurrences`: the drawn limb, or with chance w any kin. None where there is
    /// only one rule.
    void weigh(Production& production, Run run)
    {
        if (isWholeClass(run))
            return;
        ExpressionPool& pool = grammar_.expressions;
        const ExpressionId meant = isMeant(run);
        const ExpressionId drawn = pool.binary(ExpressionOp::Multiply, meant, stay());
        production.weight = pool.binary(ExpressionOp::Add, drawn, kinShare(run));
    }

    /// Row of the one limb; of several, that of limb i if it is meant and stays, else of any. Where the run was taken
    /// while one of it was meant, it stays with chance (1 - w) : (1 - w + share).
    ExpressionId rowOf(Run run)
    {
        using enum ExpressionOp;
        ExpressionPool& pool = grammar_.expressions;
        const std::uint32_t row = transforms_.rowOf[firstLimb(run)];
        if (run.length == 1)
            return pool.number(row);
        const ExpressionId low = pool.number(0);
        ExpressionId high = pool.number(1);
        if (!isWholeClass(run))
        {
            const ExpressionId staying = stay();
            high = pool.binary(Add, staying, kinShare(run));
        }
        const ExpressionId chance = pool.binary(Rand, low, high);
        ExpressionId stays = pool.binary(Less, chance, stay());
        if (!isWholeClass(run))
        {
            const ExpressionId meant = isMeant(run);
            stays = pool.binary(And, meant, stays);
        }
        const ExpressionId first = pool.number(run.first);
        const ExpressionId any = pool.unary(Floor, pool.binary(Rand, first, pool.number(run.first + run.length)));
        const ExpressionId i = pool.reference(Parameter, 0);
        const ExpressionId number = pool.add({Choose, stays, i, any, 0});
        if (row == run.first)
            return number;
        const double offset = static_cast<double>(row) - run.first;
        return pool.binary(offset > 0 ? Add : Subtract, number, pool.number(std::abs(offset)));
    }

    void classProductions(std::uint32_t c)
    {
        const std::vector<std::uint32_t>& kin = classes_.kin[c];
        const std::uint32_t kind = limbs_.limbs[kin[0]].kind;
        const std::size_t anchorCount = library_.templates[kind].anchors.size();
        std::vector<bool> exchanges(anchorCount, false); // of each anchor: its occupants are exchanged
        for (std::uint32_t a = 0; classes_.level.anchors && kin.size() > 1 && a < anchorCount; ++a)
            exchanges[a] = everOccupied(kin, a);
        forEachRun(classes_, c, [&](std::uint32_t first, std::uint32_t length) {
            const Run run{c, first, length};
            const std::uint32_t limb = firstLimb(run);
            std::vector<Module> children;
            for (std::uint32_t a = 0; a < anchorCount; ++a)
            {
                const LimbUse& child = occupant(limb, a);
                if (exchanges[a])
                    children.push_back(indexed(anchorName(c, a), limb));
                else
                    children.push_back(child.limb == kNoInstance ? Module{kOpenAnchor, 0, 0} : moduleOf(child));
            }
            std::vector<std::string> parameters = indexParameter(limb);
            const PlacedDirection direction = direct(kind, parameters);
            Production production =
                placingProduction(grammar_, grammar_.symbols.intern(names_[c]),
                                  library_.templates[limbs_.limbs[limb].piece], direction, children);
            production.table = library_.templates[kind].name;
            production.parameters = std::move(parameters);
            weigh(production, run);
            production.row = rowOf(run);
            add(std::move(production), {limb, KinRule::kWhole, first, length});
        });
        for (std::uint32_t a = 0; a < anchorCount; ++a)
            if (exchanges[a])
                anchorProductions(c, a);
    }

    /// What hangs at one anchor of the limbs of a class: the drawn occupant, or with chance w that of a kin; open
    /// anchors too.
    void anchorProductions(std::uint32_t c, std::uint32_t anchor)
    {
        grammar_.longSymbols.push_back(anchorName(c, anchor));
        for (std::uint32_t number = 0; number < classes_.kin[c].size(); ++number)
        {
            const std::uint32_t limb = classes_.kin[c][number];
            Production production;
            production.predecessor = grammar_.symbols.intern(anchorName(c, anchor));
            production.parameters = indexParameter(limb);
            if (const LimbUse& child = occupant(limb, anchor); child.limb != kNoInstance)
                production.successor.push_back(moduleOf(child));
            weigh(production, {c, number, 1});
            add(std::move(production), {limb, anchor, number});
        }
    }

    [[nodiscard]] std::vector<std::string> indexParameter(std::uint32_t limb) const
    {
        return alone(limb) ? std::vector<std::string>{} : std::vector<std::string>{"i"};
    }
    [[nodiscard]] const LimbUse& occupant(std::uint32_t limb, std::uint32_t anchor) const
    {
        return loadOf(limbs_, limb)[anchor];
    }
    [[nodiscard]] bool everOccupied(const std::vector<std::uint32_t>& kin, std::uint32_t anchor) const
    {
        return std::ranges::any_of(kin, [&](std::uint32_t limb) { return occupant(limb, anchor).limb != kNoInstance; });
    }
    [[nodiscard]] std::string anchorName(std::uint32_t c, std::uint32_t anchor) const
    {
        return occupantName(names_[c], library_.templates[limbs_.limbs[classes_.kin[c][0]].kind].anchors[anchor]);
    }
    void add(Production production, KinRule rule)
    {
        grammar_.productions.push_back(std::move(production));
        rules_.push_back(rule);
    }

    const TemplateLibrary& library_;
    const LimbTable& limbs_;
    const KinClasses& classes_;
    LimbTransforms transforms_;
    Grammar grammar_;
    std::vector<std::uint32_t> indexInClass_; ///< Of each limb.
    std::vector<std::string> names_;          ///< Of each class.
    std::string start_;
    std::vector<KinRule> rules_; ///< Of each production.
    std::uint32_t weight_ = 0;   ///< Index of the constant w.
};

} // namespace

std::vector<KinRule> writeKinGrammar(const TemplateLibrary& library, const LimbTable& limbs, const KinClasses& classes,
                                     Species& species, double jitter)
{
    return KinGrammarWriter(library, limbs, classes, jitter).write(species);
}

} // namespace espalier
