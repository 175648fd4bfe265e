// Regraft among kin: a tree of the kind is the drawn one in which branches have been exchanged for their kin, limbs of
// the same template and about the same vigour. Both the drawn child and its replacements are uniform over a class's
// occurrences, so every drawn instance is expected once, whatever the weight: sizes, branchings and parameters keep
// their means without tuning. What the mean does not keep (tiny and huge trees, copies) the window of accepted sizes
// does.

#include <Espalier/Inference/Comparison.h>
#include <Espalier/Inference/InferenceContext.h>
#include <Espalier/Inference/InstanceTree.h>
#include <Espalier/Inference/KinGrammar.h>
#include <Espalier/Inference/KinNames.h>
#include <Espalier/Inference/KinTrial.h>

#include <Espalier/Core/Json.h>
#include <algorithm>
#include <cmath>
#include <numeric>

namespace espalier {

namespace {

/// One rule for each distinct limb, its symbols already named in `draft`.
DraftGrammar limbRules(const LimbTable& limbs, DraftGrammar draft, const std::vector<std::uint32_t>& symbolOf)
{
    const auto open = static_cast<std::uint32_t>(draft.names.size());
    draft.names.emplace_back(); // an open anchor prints as nothing
    for (std::uint32_t i = 0; i < limbs.limbs.size(); ++i)
    {
        const Limb& limb = limbs.limbs[i];
        DraftRule rule{symbolOf[i], limb.piece, {}, limb.count};
        for (const LimbUse& use : loadOf(limbs, i))
            rule.children.push_back(use.limb == kNoInstance ? open : symbolOf[use.limb]);
        draft.rules.push_back(std::move(rule));
    }
    std::ranges::stable_sort(draft.rules, {}, &DraftRule::symbol);
    return draft;
}

std::string describe(const KinLevel& level)
{
    std::string text = "same template";
    if (level.sizeBase > 0)
        text += ", size within " + formatNumber(level.sizeBase) + " times, height within " +
                formatNumber(level.heightBase) + " times";
    return text + (level.anchors ? ", occupants of anchors too" : "");
}

/// The classes, each with its limbs, as rules without transforms: `Bough(3)` is limb 3 of class Bough.
std::string printKin(const InferenceContext& context)
{
    const TemplateLibrary& library = context.exemplars.library;
    const LimbTable& limbs = context.limbs;
    const KinClasses& classes = context.classes;
    std::vector<std::uint32_t> pieces;
    for (const std::vector<std::uint32_t>& kin : classes.kin)
        pieces.push_back(limbs.limbs[kin[0]].kind);
    const KinNames names = kinNames(library, pieces);
    DraftGrammar draft;
    std::vector<std::uint32_t> symbolOf(limbs.limbs.size());
    for (std::uint32_t c = 0; c < classes.kin.size(); ++c)
        for (std::uint32_t i = 0; i < classes.kin[c].size(); ++i)
        {
            symbolOf[classes.kin[c][i]] = static_cast<std::uint32_t>(draft.names.size());
            draft.names.push_back(names.classes[c] + (classes.kin[c].size() > 1 ? "(" + std::to_string(i) + ")" : ""));
        }
    return printDraft(limbRules(limbs, draft, symbolOf), library);
}

/// The limbs as rules without transforms, each a symbol of its own.
std::string printLimbs(const InferenceContext& context)
{
    const TemplateLibrary& library = context.exemplars.library;
    const LimbTable& limbs = context.limbs;
    std::vector<std::uint32_t> pieces;
    for (const Limb& limb : limbs.limbs)
        pieces.push_back(limb.piece);
    DraftGrammar draft;
    draft.names = kinNames(library, pieces).classes;
    std::vector<std::uint32_t> symbolOf(limbs.limbs.size());
    std::iota(symbolOf.begin(), symbolOf.end(), 0u);
    return printDraft(limbRules(limbs, std::move(draft), symbolOf), library);
}

} // namespace

Expected<void> shareIdenticalLimbs(InferenceContext& context)
{
    context.limbs = shareLimbs(context.exemplars, context.anchors, segmentsDrawn(context.exemplars.library),
                               context.species.provenance.weights, context.stances, context.options.mirror);
    const LimbTable& limbs = context.limbs;

    context.summary = std::to_string(context.exemplars.instances.size()) + " instances are " +
                      std::to_string(limbs.limbs.size()) + " distinct limbs";
    if (context.options.trace)
        context.grammarText = printLimbs(context);
    return {};
}

namespace {

/// The species of a choice: rules, window, and the drawn trees as what is not to be grown again. Returns what each rule
/// stands for.
std::vector<KinRule> writeKin(const InferenceContext& context, const KinClasses& classes,
                              std::optional<GrowthWindow> window, Species& species)
{
    std::vector<KinRule> rules =
        writeKinGrammar(context.exemplars.library, context.limbs, classes, species, context.options.jitter);
    species.provenance.exemplars = static_cast<std::uint32_t>(context.limbs.roots.size());
    if (classes.weight == 0)
        return rules; // where nothing may change, the drawn trees themselves are what is wanted
    species.window = std::move(window);
    for (std::uint32_t tree = 0; tree < std::min(species.provenance.exemplars, kMostCopies); ++tree)
        species.window->copies.push_back(drawnTopology(species, rules, tree));
    return rules;
}

/// Of how many trees to take edit distances, so that they do not take longer than growing them (ComparisonOptions).
std::uint32_t editEveryOf(const InferenceContext& context, std::uint32_t seeds)
{
    constexpr double kWork = 2e6;  ///< Of products of sizes.
    constexpr double kFewest = 20; ///< Whatever it takes.
    double product = 0;
    for (std::size_t tree = 0; tree < context.anchors.roots.size(); ++tree)
    {
        const double size = instanceTreeOf(context.exemplars, context.anchors, tree).size();
        product += size * size;
    }
    const double affordable = std::max(kWork / std::max(1.0, 2 * product), kFewest);
    return static_cast<std::uint32_t>(std::max(1.0, std::floor(seeds / affordable)));
}

/// By how much a trial's trees miss the bars of relatives, each miss as a share of what is asked; 0 where all hold, or
/// where growing enough trees to tell would take long.
Expected<KinShortfall> shortfallOf(const InferenceContext& context, const KinTrial& trial)
{
    constexpr std::uint32_t kMostInstances = 500;
    constexpr double kSegments = 6e5; ///< Of all trees that are grown.
    const Provenance& provenance = context.species.provenance;
    if (provenance.exemplarInstances > kMostInstances || provenance.exemplarSegments > 0.05 * kSegments)
        return KinShortfall{};
    Species species = context.species;
    KinClasses classes = trial.classes;
    runAlikeLimbs(context.limbs, classes);
    writeKin(context, classes, trial.window, species);
    ComparisonOptions options;
    options.first = Seed{0x6b696e2074727565u}; // away from the small numbers that people use
    options.seeds =
        static_cast<std::uint32_t>(std::clamp(kSegments / std::max(1u, provenance.exemplarSegments), 40.0, 400.0));
    options.editEvery = editEveryOf(context, options.seeds);
    options.progress.cancelled = context.options.progress.cancelled;
    const auto comparison = compare({&context.exemplars, 1}, species, options);
    if (!comparison)
        return tl::make_unexpected(comparison.error());
    KinShortfall shortfall;
    shortfall.compared = true;
    for (const Bar& bar : barsOf(*comparison))
    {
        const double low = std::isfinite(bar.low) ? (bar.low - bar.value) / bar.low : 0;
        const double high = std::isfinite(bar.high) ? (bar.value - bar.high) / std::max(bar.high, 0.1) : 0;
        const double miss = std::clamp(std::max(low, high), 0.0, 10.0);
        shortfall.missed += miss;
        if (miss > 0)
            shortfall.bars.push_back(bar.measure + " " + formatNumber(std::round(1e3 * bar.value) / 1e3));
    }
    return shortfall;
}

std::string percent(double share)
{
    return formatNumber(std::round(100 * share)) + " %";
}

constexpr double kManyEqual = 1e-3; ///< Of pairs: there are about a thousand different trees.

/// What a designer should know whose tree allows few relatives, and what would help.
std::string adviceOnFewRelatives(const InferenceContext& context, const KinTrial& chosen)
{
    std::string text = "this tree allows few relatives: ";
    if (chosen.accepted == 0)
        text += "no trial tree was another one of its kind and size";
    else
        text += "of trial trees " + percent(chosen.accepted) + " were of its kind and size";
    if (chosen.accepted > 0 && chosen.equal > kManyEqual)
        text += ", and about " + formatNumber(std::max(1.0, std::round(1 / chosen.equal))) +
                " different ones can be expected";
    constexpr std::uint32_t kFewInstances = 25;
    const std::uint32_t instances = context.species.provenance.exemplarInstances;
    if (instances < kFewInstances)
        text += ". It has " + std::to_string(instances) + " template instances, and from about " +
                std::to_string(kFewInstances) + " on relatives become many";
    return text + ". More branches of the same template and about the same size would help.";
}

} // namespace

Expected<void> classKin(InferenceContext& context)
{
    const InferenceOptions& options = context.options;
    const std::vector<KinLevel> levels = kinLevelsByFreedom();
    const std::vector<std::uint32_t> draws = segmentsDrawn(context.exemplars.library);
    const KinNursery nursery(context.exemplars.library, context.limbs, draws, options.progress);
    const auto coarseness = [&](double dial) {
        return levels[static_cast<std::size_t>(std::round(dial * static_cast<double>(levels.size() - 1)))];
    };
    const auto shortfall = [&](const KinTrial& trial) { return shortfallOf(context, trial); };
    std::vector<KinTrial> tried;
    Expected<KinTrial> trial;
    if (options.ruleWeight && options.mergeWeight)
        trial = nursery.tryOut(coarseness(*options.ruleWeight), *options.mergeWeight);
    else
    {
        trial = options.ruleWeight ? nursery.calibrate(coarseness(*options.ruleWeight))
                                   : nursery.chooseLevel(shortfall, tried);
        // The dial turns the weight on the level that suits the tree, so that it moves one thing only.
        if (trial && options.mergeWeight)
            trial = nursery.tryOut(std::move(trial->classes), *options.mergeWeight);
    }
    if (!trial)
        return tl::make_unexpected(trial.error());
    KinTrial& chosen = *trial;

    context.classes = std::move(chosen.classes);
    runAlikeLimbs(context.limbs, context.classes);
    for (KinTrial& level : tried)
        context.levels.push_back({describe(level.classes.level), level.classes.weight, level.difference, level.accepted,
                                  level.equal, level.score, level.shortfall.compared, std::move(level.shortfall.bars),
                                  level.classes.level == context.classes.level});
    Species& species = context.species;
    context.window = std::move(chosen.window);
    const auto level = std::ranges::find(levels, context.classes.level);
    species.provenance.mergeWeight = context.classes.weight;
    species.provenance.jitter = options.jitter;
    species.provenance.ruleWeight =
        static_cast<double>(level - levels.begin()) / static_cast<double>(levels.size() - 1);
    context.summary =
        std::to_string(context.classes.kin.size()) + " classes of kin (" + describe(context.classes.level) +
        "), exchanged with chance w = " + formatNumber(context.classes.weight) + "; of trial trees " +
        percent(chosen.accepted) + " fit the window, of their pairs " +
        formatNumber(std::round(1e5 * chosen.equal) / 1e3) + " % are equal; two of them differ by about " +
        formatNumber(std::round(100 * chosen.difference) / 100) + " of their edit distance";
    if (context.classes.weight > 0 && (chosen.accepted < 0.1 || chosen.equal > kManyEqual))
        species.provenance.note = adviceOnFewRelatives(context, chosen);
    if (options.trace)
        context.grammarText = printKin(context);
    return {};
}

Expected<void> estimateKin(InferenceContext& context)
{
    Species& species = context.species;
    const std::vector<KinRule> rules = writeKin(context, context.classes, std::move(context.window), species);
    if (context.options.progress.wantsStop())
        return failure(ErrorKind::Cancelled, {}, "the inference was cancelled");
    // Of more rules than anybody reads, the origins would only swell the file.
    constexpr std::size_t kMostOrigins = 16384;
    if (rules.size() <= kMostOrigins)
        species.rules = originsOf(rules, context.limbs, context.classes, context.exemplars, context.anchors);
    context.summary = std::to_string(species.grammar.productions.size()) + " productions over " +
                      std::to_string(species.tables.size()) + " tables of observed transforms";
    if (species.window)
        context.summary += "; accepted are " + std::to_string(species.window->minSegments) + " to " +
                           std::to_string(species.window->maxSegments) + " segments, " +
                           std::to_string(species.window->minDepth) + " to " +
                           std::to_string(species.window->maxDepth) + " instances deep";
    if (context.options.trace)
        context.grammarText = printGrammar(species.grammar);
    return {};
}

} // namespace espalier
