// Regraft among kin: a tree of the kind is the drawn one in which branches have been exchanged for their kin, limbs of the same
// template and about the same vigour. Both the drawn child and its replacements are uniform over a class's occurrences, so every
// drawn instance is expected once, whatever the weight: sizes, branchings and parameters keep their means without tuning. What the
// mean does not keep (tiny and huge trees, copies) the window of accepted sizes does.

#include <Espalier/Inference/GrammarWriter.h>
#include <Espalier/Inference/InferenceContext.h>

#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Core/Json.h>
#include <Espalier/Species/Grow.h>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <set>

namespace espalier {

namespace {

constexpr Seed kPilotSeed{0x6b696e2070696c6f}; ///< Seeds of trial growth, away from the small numbers that people use.

/// The tables of transforms, one a template, each distinct transform once; and the row of each limb.
struct LimbTransforms
{
    std::vector<TransformTable> tables;
    std::vector<std::uint32_t> tableOf; ///< Of each template; kNoPiece if it does not occur.
    std::vector<std::uint32_t> rowOf;   ///< Of each limb.
};

LimbTransforms transformsOf(const LimbTable& limbs, const TemplateLibrary& library)
{
    LimbTransforms result;
    result.tableOf.assign(library.templates.size(), kNoPiece);
    std::vector<std::map<std::array<double, 4>, std::uint32_t>> known;
    for (const Limb& limb : limbs.limbs)
    {
        if (result.tableOf[limb.piece] == kNoPiece)
        {
            result.tableOf[limb.piece] = static_cast<std::uint32_t>(result.tables.size());
            result.tables.push_back({library.templates[limb.piece].name, {}});
            known.emplace_back();
        }
        const std::uint32_t table = result.tableOf[limb.piece];
        const std::array<double, 4> row{limb.transform.scaling, limb.transform.rotation, limb.transform.branchingAngle, limb.transform.roll};
        auto& rows = result.tables[table].rows;
        const auto [entry, isNew] = known[table].try_emplace(row, static_cast<std::uint32_t>(rows.size()));
        if (isNew)
            rows.push_back(row);
        result.rowOf.push_back(entry->second);
    }
    return result;
}

/// Smooths each table by a share of what it was seen to vary, so that two trees with the same branches still differ. At weight 0
/// nothing moves; at 1 the share is a tenth, which leaves the distribution of each parameter recognisably the drawn one.
void smoothTables(std::vector<TransformTable>& tables, double weight)
{
    constexpr double kShare = 0.1;
    constexpr double kMostScaling = 0.1;
    for (TransformTable& table : tables)
        for (std::size_t component = 0; component < 4; ++component)
        {
            double sum = 0;
            double squares = 0;
            for (const auto& row : table.rows)
            {
                sum += row[component];
                squares += row[component] * row[component];
            }
            const double count = static_cast<double>(table.rows.size());
            const double mean = sum / count;
            double spread = kShare * weight * std::sqrt(std::max(0.0, squares / count - mean * mean));
            if (component == 0)
                spread = std::min(kMostScaling, spread / mean);
            table.spread[component] = std::round(spread * 1e4) / 1e4;
        }
}

/// Writes the grammar of one choice of classes and weight.
class KinGrammarWriter
{
public:
    KinGrammarWriter(const TemplateLibrary& library, const LimbTable& limbs, const KinClasses& classes)
        : library_(library), limbs_(limbs), classes_(classes), transforms_(transformsOf(limbs, library)), grammar_(grammarFor(library)),
          indexInClass_(limbs.limbs.size())
    {
        smoothTables(transforms_.tables, classes.weight);
        for (const std::vector<std::uint32_t>& kin : classes.kin)
            for (std::uint32_t i = 0; i < kin.size(); ++i)
                indexInClass_[kin[i]] = i;
    }

    void write(Species& species)
    {
        // F, G and f stay the turtle's even where the library does not use them: a class called F is a riddle.
        std::vector<std::string> names = nonterminalNames(classes_.kin.size() + 1, symbolsUsed(library_) + "FGf");
        start_ = names[0];
        names_.assign(names.begin() + 1, names.end());
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
    }

private:
    [[nodiscard]] bool alone(std::uint32_t limb) const { return classes_.kin[classes_.classOf[limb]].size() == 1; }

    /// `C(i)`: limb i of class C or one of its kin; `C` where there is only one.
    Module moduleOf(std::uint32_t limb) { return indexed(names_[classes_.classOf[limb]], limb); }

    Module indexed(const std::string& name, std::uint32_t limb)
    {
        const SymbolId symbol = grammar_.symbols.intern(name);
        const auto first = static_cast<std::uint32_t>(grammar_.arguments.size());
        if (alone(limb))
            return {symbol, first, 0};
        grammar_.arguments.push_back(grammar_.expressions.number(indexInClass_[limb]));
        return {symbol, first, 1};
    }

    void axiom()
    {
        if (limbs_.roots.size() == 1)
        {
            grammar_.axiom.push_back(moduleOf(limbs_.roots[0]));
            return;
        }
        const SymbolId start = grammar_.symbols.intern(start_);
        grammar_.append(grammar_.axiom, start);
        for (const std::uint32_t root : limbs_.roots)
        {
            Production production;
            production.predecessor = start;
            production.successor.push_back(moduleOf(root));
            production.weight = grammar_.expressions.number(1);
            grammar_.productions.push_back(std::move(production));
        }
    }

    /// `(i == limb) * (1 - w) + w * count / occurrences`: the drawn limb, or with chance w any kin. None where it is alone.
    void weigh(Production& production, std::uint32_t limb)
    {
        if (alone(limb))
            return;
        production.parameters = {"i"};
        ExpressionPool& pool = grammar_.expressions;
        using enum ExpressionOp;
        const ExpressionId i = pool.reference(Parameter, 0);
        const ExpressionId index = pool.number(indexInClass_[limb]);
        const ExpressionId isDrawn = pool.binary(Equal, i, index);
        const ExpressionId one = pool.number(1);
        const ExpressionId stay = pool.binary(Subtract, one, pool.reference(Constant, weight_));
        const ExpressionId drawn = pool.binary(Multiply, isDrawn, stay);
        const ExpressionId w = pool.reference(Constant, weight_);
        const std::uint32_t count = limbs_.limbs[limb].count;
        const ExpressionId share = count == 1 ? w : pool.binary(Multiply, w, pool.number(count));
        const ExpressionId kin = pool.binary(Divide, share, pool.number(classes_.occurrences[classes_.classOf[limb]]));
        production.weight = pool.binary(Add, drawn, kin);
    }

    void classProductions(std::uint32_t c)
    {
        const std::vector<std::uint32_t>& kin = classes_.kin[c];
        const std::uint32_t piece = limbs_.limbs[kin[0]].piece;
        const Template& shape = library_.templates[piece];
        const bool exchangesAnchors = classes_.level.anchors && kin.size() > 1;
        for (const std::uint32_t limb : kin)
        {
            std::vector<Module> children;
            for (std::uint32_t a = 0; a < shape.anchors.size(); ++a)
            {
                const std::uint32_t child = occupant(limb, a);
                if (exchangesAnchors && everOccupied(kin, a))
                    children.push_back(indexed(anchorName(c, a), limb));
                else
                    children.push_back(child == kNoInstance ? Module{kOpenAnchor, 0, 0} : moduleOf(child));
            }
            Production production = placingProduction(grammar_, grammar_.symbols.intern(names_[c]), shape,
                                                      transformUse(transforms_.tables[transforms_.tableOf[piece]]), children);
            weigh(production, limb);
            production.row = grammar_.expressions.number(transforms_.rowOf[limb]);
            grammar_.productions.push_back(std::move(production));
        }
        for (std::uint32_t a = 0; exchangesAnchors && a < shape.anchors.size(); ++a)
            if (everOccupied(kin, a))
                anchorProductions(c, a);
    }

    /// What hangs at one anchor of the limbs of a class: the drawn occupant, or with chance w that of a kin; open anchors too.
    void anchorProductions(std::uint32_t c, std::uint32_t anchor)
    {
        grammar_.longSymbols.push_back(anchorName(c, anchor));
        for (const std::uint32_t limb : classes_.kin[c])
        {
            Production production;
            production.predecessor = grammar_.symbols.intern(anchorName(c, anchor));
            if (const std::uint32_t child = occupant(limb, anchor); child != kNoInstance)
                production.successor.push_back(moduleOf(child));
            weigh(production, limb);
            grammar_.productions.push_back(std::move(production));
        }
    }

    [[nodiscard]] std::uint32_t occupant(std::uint32_t limb, std::uint32_t anchor) const
    {
        return limbs_.children[limbs_.limbs[limb].firstChild + anchor];
    }
    [[nodiscard]] bool everOccupied(const std::vector<std::uint32_t>& kin, std::uint32_t anchor) const
    {
        return std::ranges::any_of(kin, [&](std::uint32_t limb) { return occupant(limb, anchor) != kNoInstance; });
    }
    /// Such as AX: the occupant of anchor X of class A.
    [[nodiscard]] std::string anchorName(std::uint32_t c, std::uint32_t anchor) const
    {
        return names_[c] + library_.templates[limbs_.limbs[classes_.kin[c][0]].piece].anchors[anchor];
    }

    const TemplateLibrary& library_;
    const LimbTable& limbs_;
    const KinClasses& classes_;
    LimbTransforms transforms_;
    Grammar grammar_;
    std::vector<std::uint32_t> indexInClass_; ///< Of each limb.
    std::vector<std::string> names_;          ///< Of each class.
    std::string start_;
    std::uint32_t weight_ = 0; ///< Index of the constant w.
};

/// The drawn trees' mean size.
struct Exemplar
{
    double segments = 0;
    double depth = 0;
    std::uint32_t most = 0; ///< Segments of the largest.
};

/// One rule for each distinct limb, its symbols already named in `draft`.
DraftGrammar limbRules(const LimbTable& limbs, const TemplateLibrary& library, DraftGrammar draft, const std::vector<std::uint32_t>& symbolOf)
{
    const auto open = static_cast<std::uint32_t>(draft.names.size());
    draft.names.emplace_back(); // an open anchor prints as nothing
    for (std::uint32_t i = 0; i < limbs.limbs.size(); ++i)
    {
        const Limb& limb = limbs.limbs[i];
        DraftRule rule{symbolOf[i], limb.piece, {}, limb.count};
        for (std::uint32_t a = 0; a < library.templates[limb.piece].anchors.size(); ++a)
        {
            const std::uint32_t child = limbs.children[limb.firstChild + a];
            rule.children.push_back(child == kNoInstance ? open : symbolOf[child]);
        }
        draft.rules.push_back(std::move(rule));
    }
    std::ranges::stable_sort(draft.rules, {}, &DraftRule::symbol);
    return draft;
}

Exemplar exemplarOf(const LimbTable& limbs)
{
    Exemplar exemplar;
    for (const std::uint32_t root : limbs.roots)
    {
        exemplar.segments += limbs.limbs[root].segments;
        exemplar.depth += limbs.limbs[root].height;
        exemplar.most = std::max(exemplar.most, limbs.limbs[root].segments);
    }
    exemplar.segments /= static_cast<double>(limbs.roots.size());
    exemplar.depth /= static_cast<double>(limbs.roots.size());
    return exemplar;
}

/// What a choice of classes and weight comes to, from trial growth.
struct Trial
{
    KinClasses classes;
    GrowthWindow window;
    double accepted = 0; ///< Share of attempts inside the window.
    double distinct = 0; ///< Share of different topologies among them.
};

bool accepts(const GrowthWindow& window, const GrowthSample& sample)
{
    return sample.whole && sample.segments >= window.minSegments && sample.segments <= window.maxSegments &&
           sample.depth >= window.minDepth && sample.depth <= window.maxDepth &&
           std::ranges::find(window.copies, sample.topology) == window.copies.end();
}

/// The window whose accepted trees have the exemplar's mean size, as nearly as its lower bound can bring about.
GrowthWindow windowFor(const std::vector<GrowthSample>& samples, const Exemplar& exemplar, std::vector<std::uint64_t> copies)
{
    constexpr double kMostSegments = 1.5;
    constexpr double kDepth = 0.25;
    const auto bound = [](double value) { return static_cast<std::uint32_t>(std::clamp(value, 0.0, 4e9)); };
    GrowthWindow window;
    window.maxSegments = bound(std::floor(kMostSegments * exemplar.segments));
    window.minDepth = bound(std::ceil((1 - kDepth) * exemplar.depth));
    window.maxDepth = bound(std::floor((1 + kDepth) * exemplar.depth));
    window.copies = std::move(copies);
    GrowthWindow best = window;
    double least = std::numeric_limits<double>::infinity();
    for (int percent = 50; percent <= 80; percent += 2)
    {
        window.minSegments = bound(std::ceil(percent * 0.01 * exemplar.segments));
        double sum = 0;
        std::uint32_t count = 0;
        for (const GrowthSample& sample : samples)
            if (accepts(window, sample))
            {
                sum += sample.segments;
                ++count;
            }
        const double miss = count == 0 ? 1e9 : std::abs(sum / count / exemplar.segments - 1);
        if (miss < least)
        {
            least = miss;
            best = window;
        }
    }
    return best;
}

/// Topologies of the drawn trees, which the window keeps from being grown again: each is what its limbs give when every limb is a
/// class of its own.
Expected<std::vector<std::uint64_t>> drawnTopologies(const InferenceContext& context)
{
    LimbTable one = context.limbs;
    KinClasses apart;
    for (std::uint32_t limb = 0; limb < one.limbs.size(); ++limb)
    {
        apart.classOf.push_back(limb);
        apart.kin.push_back({limb});
        apart.occurrences.push_back(one.limbs[limb].count);
    }
    std::vector<std::uint64_t> topologies;
    for (const std::uint32_t root : context.limbs.roots)
    {
        one.roots = {root};
        Species species;
        KinGrammarWriter(context.exemplars.library, one, apart).write(species);
        const auto grower = Grower::make(species);
        if (!grower)
            return tl::make_unexpected(grower.error());
        GrowScratch scratch;
        const auto sample = grower->sample(Seed{}, 0, {}, scratch);
        if (!sample)
            return tl::make_unexpected(sample.error());
        topologies.push_back(sample->topology);
    }
    return topologies;
}

Expected<Trial> tryOut(const InferenceContext& context, KinClasses classes, double weight, const Exemplar& exemplar,
                       const std::vector<std::uint64_t>& drawn)
{
    classes.weight = weight;
    Species species;
    KinGrammarWriter(context.exemplars.library, context.limbs, classes).write(species);
    const auto grower = Grower::make(species);
    if (!grower)
        return tl::make_unexpected(grower.error());
    GrowScratch scratch;
    std::vector<GrowthSample> samples;
    const auto pilots = static_cast<std::uint32_t>(std::clamp(1e5 / std::max(1.0, exemplar.segments), 16.0, 400.0));
    for (std::uint32_t i = 0; i < pilots; ++i)
    {
        const auto sample = grower->sample(Seed{kPilotSeed.value + i}, 0, {}, scratch, 4 * exemplar.most);
        if (!sample)
            return tl::make_unexpected(sample.error());
        samples.push_back(*sample);
    }
    Trial trial;
    trial.classes = std::move(classes);
    // Where nothing may change, the drawn trees themselves are what is wanted.
    trial.window = windowFor(samples, exemplar, weight == 0 ? std::vector<std::uint64_t>{} : drawn);
    std::set<std::uint64_t> topologies;
    std::uint32_t accepted = 0;
    for (const GrowthSample& sample : samples)
        if (accepts(trial.window, sample))
        {
            ++accepted;
            topologies.insert(sample.topology);
        }
    trial.accepted = static_cast<double>(accepted) / pilots;
    trial.distinct = accepted == 0 ? 0 : static_cast<double>(topologies.size()) / accepted;
    return trial;
}

/// The chance that a limb drawn at random from its class is another one, averaged over the drawn branches.
double freedomOf(const KinClasses& classes, const LimbTable& limbs)
{
    double others = 0;
    double all = 0;
    for (std::uint32_t limb = 0; limb < limbs.limbs.size(); ++limb)
    {
        const double count = limbs.limbs[limb].count;
        others += count * (1 - count / classes.occurrences[classes.classOf[limb]]);
        all += count;
    }
    return others / all;
}

/// The share of branches to exchange that gives relatives, neither copies nor strangers. A fit to measured trees of 17 to 465
/// instances whose pairs then differ in 0.3 of their edit distance: 0.4 up to 100 instances, less for larger trees, where
/// each exchange moves more.
double wantedExchange(double instances)
{
    return 0.4 * std::min(1.0, math::pow(100 / instances, 0.8));
}

/// Tries the levels from the finest to the coarsest and takes the first that gives enough different trees of the right size; if
/// none does, the one that comes nearest.
Expected<Trial> chooseLevel(const InferenceContext& context, const Exemplar& exemplar, const std::vector<std::uint64_t>& drawn)
{
    constexpr double kLeastAccepted = 0.1; // a window of 32 attempts then misses one seed in 29
    constexpr double kLeastDistinct = 0.9;
    constexpr double kLeastFreedom = 0.4;
    const double instances = static_cast<double>(context.exemplars.instances.size()) / static_cast<double>(context.limbs.roots.size());
    Trial best;
    double bestScore = -1;
    for (const KinLevel& level : kinLevels())
    {
        if (context.options.progress.wantsStop())
            return failure(ErrorKind::Cancelled, {}, "the inference was cancelled");
        KinClasses classes = classify(context.limbs, level, exemplar.segments);
        const double freedom = freedomOf(classes, context.limbs);
        const double weight = freedom > 0 ? std::min(1.0, std::round(100 * wantedExchange(instances) / freedom) / 100) : 1.0;
        auto trial = tryOut(context, std::move(classes), weight, exemplar, drawn);
        if (!trial)
            return trial;
        const double score = std::min(1.0, trial->accepted / kLeastAccepted) * std::min(1.0, trial->distinct / kLeastDistinct) *
                             std::min(1.0, freedom / kLeastFreedom);
        if (score > bestScore)
        {
            bestScore = score;
            best = std::move(*trial);
        }
        if (score >= 1)
            break;
    }
    return best;
}

std::string describe(const KinLevel& level)
{
    std::string text = "same template";
    if (level.sizeBase > 0)
        text += ", size within " + formatNumber(level.sizeBase) + " times, height within " + formatNumber(level.heightBase) + " times";
    return text + (level.anchors ? ", occupants of anchors too" : "");
}

/// The classes, each with its limbs, as rules without transforms: `D(3)` is limb 3 of class D.
std::string printKin(const InferenceContext& context)
{
    const TemplateLibrary& library = context.exemplars.library;
    const LimbTable& limbs = context.limbs;
    const KinClasses& classes = context.classes;
    const std::vector<std::string> names = nonterminalNames(classes.kin.size() + 1, symbolsUsed(library) + "FGf");
    DraftGrammar draft;
    std::vector<std::uint32_t> symbolOf(limbs.limbs.size());
    for (std::uint32_t c = 0; c < classes.kin.size(); ++c)
        for (std::uint32_t i = 0; i < classes.kin[c].size(); ++i)
        {
            symbolOf[classes.kin[c][i]] = static_cast<std::uint32_t>(draft.names.size());
            draft.names.push_back(names[c + 1] + (classes.kin[c].size() > 1 ? "(" + std::to_string(i) + ")" : ""));
        }
    return printDraft(limbRules(limbs, library, draft, symbolOf), library);
}

} // namespace

Expected<void> shareIdenticalLimbs(InferenceContext& context)
{
    context.limbs = shareLimbs(context.exemplars, context.anchors, segmentsDrawn(context.exemplars.library));
    const LimbTable& limbs = context.limbs;

    DraftGrammar draft;
    draft.names = nonterminalNames(limbs.limbs.size() + 1, symbolsUsed(context.exemplars.library) + "FGf");
    draft.names.erase(draft.names.begin()); // S is not needed: a limb is named by its first letter
    std::vector<std::uint32_t> symbolOf(limbs.limbs.size());
    std::iota(symbolOf.begin(), symbolOf.end(), 0u);
    context.summary = std::to_string(context.exemplars.instances.size()) + " instances are " + std::to_string(limbs.limbs.size()) + " distinct limbs";
    context.grammarText = printDraft(limbRules(limbs, context.exemplars.library, std::move(draft), symbolOf), context.exemplars.library);
    return {};
}

Expected<void> classKin(InferenceContext& context)
{
    const InferenceOptions& options = context.options;
    const std::vector<KinLevel>& levels = kinLevels();
    const Exemplar exemplar = exemplarOf(context.limbs);
    const auto drawn = drawnTopologies(context);
    if (!drawn)
        return tl::make_unexpected(drawn.error());

    Trial chosen;
    if (options.ruleWeight)
    {
        const auto index = static_cast<std::size_t>(std::round(*options.ruleWeight * static_cast<double>(levels.size() - 1)));
        chosen.classes = classify(context.limbs, levels[index], exemplar.segments);
        chosen.classes.weight = options.mergeWeight.value_or(0.6);
    }
    else
    {
        auto best = chooseLevel(context, exemplar, *drawn);
        if (!best)
            return tl::make_unexpected(best.error());
        chosen = std::move(*best);
    }
    // The dial turns the weight on the level that suits the tree, so that it moves one thing only.
    if (options.ruleWeight || options.mergeWeight)
    {
        const double weight = options.mergeWeight.value_or(chosen.classes.weight);
        auto trial = tryOut(context, std::move(chosen.classes), weight, exemplar, *drawn);
        if (!trial)
            return tl::make_unexpected(trial.error());
        chosen = std::move(*trial);
    }

    context.classes = std::move(chosen.classes);
    Species& species = context.species;
    species.window = std::move(chosen.window);
    const auto level = std::ranges::find(levels, context.classes.level);
    species.provenance.mergeWeight = context.classes.weight;
    species.provenance.ruleWeight = static_cast<double>(level - levels.begin()) / static_cast<double>(levels.size() - 1);
    const auto percent = [](double share) { return formatNumber(std::round(100 * share)) + " %"; };
    context.summary = std::to_string(context.classes.kin.size()) + " classes of kin (" + describe(context.classes.level) + "), exchanged with chance w = " +
                      formatNumber(context.classes.weight) + "; of trial trees " + percent(chosen.accepted) + " fit the window, of these " +
                      percent(chosen.distinct) + " are different";
    if (context.classes.weight > 0 && (chosen.accepted < 0.1 || chosen.distinct < 0.6))
        species.provenance.note = "this tree allows few relatives: of trial trees " + percent(chosen.accepted) + " were of its kind and size, and of these " +
                                  percent(chosen.distinct) + " different. More branches of the same template and size would help.";
    context.grammarText = printKin(context);
    return {};
}

Expected<void> estimateKin(InferenceContext& context)
{
    Species& species = context.species;
    KinGrammarWriter(context.exemplars.library, context.limbs, context.classes).write(species);
    const GrowthWindow& window = *species.window;
    context.summary = std::to_string(species.grammar.productions.size()) + " productions over " + std::to_string(species.tables.size()) +
                      " tables of observed transforms; accepted are " + std::to_string(window.minSegments) + " to " +
                      std::to_string(window.maxSegments) + " segments, " + std::to_string(window.minDepth) + " to " +
                      std::to_string(window.maxDepth) + " instances deep";
    context.grammarText = printGrammar(species.grammar);
    return {};
}

} // namespace espalier
