#include <Espalier/Inference/Comparison.h>

#include <Espalier/Archetype/Placement.h>
#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Core/Tasks.h>
#include <Espalier/Inference/Divergence.h>
#include <Espalier/Inference/Exemplars.h>
#include <Espalier/Inference/InstanceTree.h>
#include <Espalier/Plant/Axes.h>
#include <Espalier/Species/Grow.h>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <set>
#include <tuple>

namespace espalier {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Beyond so many instances the edit distance is estimated.
constexpr std::uint32_t kMostEdited = 2000;
/// Medians of fewer trees say less than the estimate does.
constexpr double kFewestEdited = 20;
/// Values of one parameter that are kept of all grown trees.
constexpr double kMostValues = 1 << 20;

/// `distance` in spreads. What differs by rounding alone counts as equal.
ParameterComparison overSpread(double distance, double spread)
{
    constexpr double kNothing = 1e-5; // degrees or metres: a float's rounding of a tree's coordinates
    if (spread <= kNothing)
        return {distance <= kNothing ? 0 : kInfinity, 0};
    return {distance / spread, spread};
}

ParameterComparison compareLinear(const std::vector<double>& drawn, const std::vector<double>& grown)
{
    return overSpread(wasserstein(drawn, grown), deviationOf(drawn));
}

ParameterComparison compareCircular(const std::vector<double>& drawn, const std::vector<double>& grown)
{
    return overSpread(circularWasserstein(drawn, grown, 360.0), circularDeviationOf(drawn));
}

/// Between two histograms with bins of width 1, each of any sum.
double wassersteinOfBins(const std::vector<double>& a, const std::vector<double>& b)
{
    double sumA = 0;
    double sumB = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
    {
        sumA += a[i];
        sumB += b[i];
    }
    if (sumA <= 0 || sumB <= 0)
        return sumA == sumB ? 0 : static_cast<double>(a.size());
    double difference = 0;
    double area = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
    {
        difference += a[i] / sumA - b[i] / sumB;
        area += std::abs(difference);
    }
    return area;
}

/// How often each kind of template hangs at each place of each other.
using AnchorCounts = std::map<std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>, double>;

void countAnchors(const InstanceTree& tree, AnchorCounts& counts)
{
    for (std::uint32_t i = 1; i < tree.size(); ++i)
        ++counts[{tree.shape.labels[tree.shape.parents[i]], tree.places[i], tree.shape.labels[i]}];
}

double divergenceOf(const AnchorCounts& a, const AnchorCounts& b)
{
    AnchorCounts all = a;
    all.insert(b.begin(), b.end());
    std::vector<double> countsA;
    std::vector<double> countsB;
    for (const auto& [key, ignored] : all)
    {
        const auto inA = a.find(key);
        const auto inB = b.find(key);
        countsA.push_back(inA == a.end() ? 0 : inA->second);
        countsB.push_back(inB == b.end() ? 0 : inB->second);
    }
    return jensenShannon(countsA, countsB);
}

/// Edit distances over the sums of sizes; estimated where a tree is too large.
class NormalisedDistance
{
public:
    explicit NormalisedDistance(bool estimate) : estimate_(estimate) {}

    [[nodiscard]] OutlinedTree shapeOf(LabelledTree tree) const
    {
        PqGrams grams = estimate_ ? pqGramsOf(tree) : PqGrams{};
        return {std::move(tree), std::move(grams)};
    }
    [[nodiscard]] double operator()(const OutlinedTree& a, const OutlinedTree& b) const
    {
        return estimate_ ? estimatedEditDistance(a, b) : normalisedEditDistance(a.tree, b.tree);
    }

private:
    bool estimate_;
};

/// What is gathered of drawn trees and of grown ones alike.
struct Gathered
{
    Comparison::Samples samples;
    AnchorCounts anchors;
    std::vector<double> heights;
    std::vector<double> widths;
    std::vector<double> strahler;
    std::vector<double> bifurcation;
    std::vector<double> depth;

    /// Of `skeleton`, of whose branches every `stride`-th is kept. Bins of the profile are `binHeight` high.
    void add(const InstanceTree& tree, const Skeleton& skeleton, std::uint32_t stride, std::uint32_t number,
             double binHeight)
    {
        const SkeletonFacts facts = measure(skeleton);
        samples.segments.push_back(facts.segments);
        heights.push_back(facts.maxY - std::min(0.0, facts.minY));
        widths.push_back(2 * facts.maxRadius);
        strahler.push_back(facts.strahler);
        bifurcation.push_back(bifurcationRatio(strahlerStreams(skeleton)));
        appendBranchMeasures(skeleton, stride, number, samples.branches);
        addLengthByHeight(skeleton, binHeight, samples.lengthByShare);
        countAnchors(tree, anchors);
        std::uint32_t deepest = 0;
        for (std::uint32_t i = 0; const std::uint32_t d : depthsOf(tree))
        {
            deepest = std::max(deepest, d);
            if (i++ % stride == number % stride)
                samples.depths.push_back(d);
        }
        depth.push_back(deepest);
    }
};

/// A drawn tree.
struct Exemplar
{
    InstanceTree tree;
    Skeleton skeleton;
};

Expected<std::vector<Exemplar>> drawExemplars(const Archetype& archetype, const PipeModel& pipes)
{
    const AnchorTable anchors = anchorsOf(archetype);
    const ArchetypeDrawer drawer(archetype);
    const std::vector<std::uint32_t> kinds = kindsOf(archetype.library);
    std::vector<Exemplar> exemplars(drawer.trees());
    for (std::size_t i = 0; i < exemplars.size(); ++i)
    {
        exemplars[i].tree = instanceTreeOf(archetype, anchors, i);
        for (std::uint32_t& label : exemplars[i].tree.shape.labels)
            label = kinds[label];
        if (auto done = drawer.draw(i, {}, exemplars[i].skeleton); !done)
            return tl::make_unexpected(done.error());
        completeAxes(exemplars[i].skeleton, pipes);
    }
    return exemplars;
}

/// The kind of template of each production (kindsOf): the index of its first in the library, or a number of its own if
/// the library does not know it.
std::vector<std::uint32_t> labelsOf(const Species& species, const TemplateLibrary& library)
{
    const std::vector<std::uint32_t> kinds = kindsOf(library);
    std::map<std::string, std::uint32_t> labels;
    for (std::uint32_t i = 0; i < library.templates.size(); ++i)
        labels.emplace(library.templates[i].name, kinds[i]);
    std::vector<std::uint32_t> result;
    for (const Production& production : species.grammar.productions)
        result.push_back(labels.emplace(production.table, static_cast<std::uint32_t>(labels.size())).first->second);
    return result;
}

std::vector<std::uint8_t> rewritableLetters(const Species& species, const TurtleAlphabet& alphabet)
{
    std::set<SymbolId> predecessors;
    for (const Production& production : species.grammar.productions)
        predecessors.insert(production.predecessor);
    std::vector<std::uint8_t> result;
    for (const SymbolId symbol : alphabet.symbols)
        result.push_back(predecessors.contains(symbol) ? 1 : 0);
    return result;
}

/// Grows the trees, batch after batch, and compares them.
class Comparer
{
public:
    Comparer(const std::vector<Exemplar>& exemplars, const std::vector<std::uint32_t>& weights,
             std::vector<std::uint32_t> labels, std::vector<std::uint8_t> rewritable, const ComparisonOptions& options)
        : exemplars_(exemplars),
          weights_(weights.size() == exemplars.size() ? weights : std::vector<std::uint32_t>(exemplars.size(), 1)),
          labels_(std::move(labels)), rewritable_(std::move(rewritable)), options_(options),
          threads_(threadsFor(options.threads)), distance_(planDistances())
    {
        drawn_.samples.lengthByShare.resize(kProfileBins);
        grown_.samples.lengthByShare.resize(kProfileBins);
        double segments = 0;
        double height = 0;
        for (std::size_t i = 0; i < exemplars_.size(); ++i)
        {
            const Exemplar& exemplar = exemplars_[i];
            const double weight = weights_[i];
            trees_ += weight;
            segments += weight * exemplar.skeleton.size();
            height += weight * static_cast<double>(exemplar.skeleton.maxY);
            shapes_.push_back(distance_.shapeOf(exemplar.tree.shape));
            topologies_.insert(topologyOf(exemplar.tree));
        }
        meanSegments_ = segments / trees_;
        binHeight_ = std::max(1e-6, 2 * height / trees_ / static_cast<double>(kProfileBins));
        const double values = meanSegments_ * options.seeds;
        stride_ = static_cast<std::uint32_t>(std::clamp(std::ceil(values / kMostValues), 1.0, 1e9));
        // What counts several times is added as often; of more values than are needed, each time others.
        const bool isWeighted = trees_ > static_cast<double>(exemplars_.size());
        const auto stride =
            isWeighted ? static_cast<std::uint32_t>(std::clamp(std::ceil(segments / kMostValues), 1.0, 1e9)) : 1;
        for (std::size_t i = 0; i < exemplars_.size(); ++i)
            for (std::uint32_t time = 0; time < weights_[i]; ++time)
                drawn_.add(exemplars_[i].tree, exemplars_[i].skeleton, stride, time, binHeight_);
    }

    Expected<void> growAll(const Grower& grower)
    {
        constexpr double kSegments = 4e6; ///< Of all skeletons that are in memory at a time.
        const auto most = static_cast<std::uint32_t>(
            std::clamp(kSegments / std::max(1.0, meanSegments_), 1.0, std::min(64.0, 1.0 * options_.seeds)));
        std::vector<Grown> batch;
        for (std::uint32_t i = 0; i < most; ++i)
            batch.emplace_back(labels_, rewritable_);
        for (std::uint32_t first = 0; first < options_.seeds; first += most)
        {
            const std::uint32_t count = std::min(most, options_.seeds - first);
            forEachTask(
                count, threads_, options_.progress,
                [&](std::uint32_t i) { batch[i].done = growOne(grower, first + i, batch[i]); },
                [&](std::uint32_t taken) { report(first + taken); });
            if (options_.progress.wantsStop())
                return failure(ErrorKind::Cancelled, {}, "the comparison was cancelled");
            for (std::uint32_t i = 0; i < count; ++i)
            {
                if (!batch[i].done)
                    return batch[i].done;
                add(first + i, batch[i]);
            }
            if (pendingNodes_ >= kMostPending || first + count == options_.seeds)
                comparePending(first + count);
            if (options_.progress.wantsStop())
                return failure(ErrorKind::Cancelled, {}, "the comparison was cancelled");
        }
        options_.progress("compare", 1);
        return {};
    }

    [[nodiscard]] Comparison result()
    {
        Comparison c;
        const double seeds = options_.seeds;
        c.seeds = options_.seeds;
        c.exemplars = static_cast<std::uint32_t>(exemplars_.size());
        for (std::size_t i = 0; i < exemplars_.size(); ++i)
            c.exemplarInstances += weights_[i] * exemplars_[i].tree.size() / trees_;

        c.size.exemplar = meanOf(drawn_.samples.segments);
        c.size.mean = meanOf(grown_.samples.segments);
        c.size.median = medianOf(grown_.samples.segments);
        for (const double size : grown_.samples.segments)
        {
            const auto like = [&](double low, double high) {
                return std::ranges::any_of(drawn_.samples.segments,
                                           [&](double e) { return size >= low * e && size <= high * e; });
            };
            c.size.within += like(0.5, 1.5) ? 1 : 0;
            c.size.tiny += like(0.1, kInfinity) ? 0 : 1;
        }
        c.size.unfinished = unfinished_ / seeds;

        c.anchorDivergence = divergenceOf(drawn_.anchors, grown_.anchors);
        const BranchMeasures& drawn = drawn_.samples.branches;
        const BranchMeasures& grown = grown_.samples.branches;
        c.parameters = {compareLinear(drawn.angles, grown.angles), compareLinear(drawn.lengths, grown.lengths),
                        compareLinear(drawn.widths, grown.widths), compareCircular(drawn.azimuths, grown.azimuths)};

        c.depth = {meanOf(drawn_.depth), meanOf(grown_.depth)};
        c.depthHistogram = wasserstein(drawn_.samples.depths, grown_.samples.depths);
        c.strahler = {meanOf(drawn_.strahler), meanOf(grown_.strahler)};
        for (const double order : grown_.strahler)
            if (std::ranges::any_of(drawn_.strahler, [&](double e) { return std::abs(order - e) <= 1; }))
                c.strahlerWithin1 += 1;
        for (double* share : {&c.size.within, &c.size.tiny, &c.strahlerWithin1})
            *share /= seeds;
        c.bifurcation = {meanOf(drawn_.bifurcation), meanOf(grown_.bifurcation)};

        c.editDistance = {medianOf(exemplarDistances_), medianOf(pairDistances_),
                          static_cast<std::uint32_t>(exemplarDistances_.size()), estimate_};
        c.distinct = static_cast<double>(distinct_.size()) / seeds;
        c.copies = copies_ / seeds;
        c.crown.height = {meanOf(drawn_.heights), meanOf(grown_.heights)};
        c.crown.width = {meanOf(drawn_.widths), meanOf(grown_.widths)};
        // The bins reach twice as high as the drawn trees.
        c.crown.profile = wassersteinOfBins(drawn_.samples.lengthByShare, grown_.samples.lengthByShare) * 2 /
                          static_cast<double>(kProfileBins);

        for (double& length : drawn_.samples.lengthByShare)
            length /= trees_;
        for (double& length : grown_.samples.lengthByShare)
            length /= seeds;
        c.drawn = std::move(drawn_.samples);
        c.grown = std::move(grown_.samples);
        c.exemplarDistances = std::move(exemplarDistances_);
        c.pairDistances = std::move(pairDistances_);
        return c;
    }

private:
    /// Nodes of trees that wait to be compared, beyond which they are.
    static constexpr std::uint64_t kMostPending = 1 << 20;

    /// A tree of a batch, and what it takes to grow one.
    struct Grown
    {
        Grown(const std::vector<std::uint32_t>& labels, const std::vector<std::uint8_t>& rewritable)
            : sink(labels, rewritable)
        {}

        GrowScratch scratch;
        InstanceTreeSink sink;
        Skeleton skeleton;
        InstanceTree tree;
        std::uint64_t topology = 0;
        OutlinedTree shape; ///< If it is one of those that are compared.
        Expected<void> done;
    };

    /// Exact distances as long as trees are small enough, and of as many trees as there is time for.
    NormalisedDistance planDistances()
    {
        estimate_ = std::ranges::any_of(exemplars_,
                                        [](const Exemplar& exemplar) { return exemplar.tree.size() > kMostEdited; });
        if (estimate_)
            return NormalisedDistance(true);
        for (const Exemplar& exemplar : exemplars_)
            stepsOfTree_ += 2 * editSteps(exemplar.tree.shape, exemplar.tree.shape);
        const double affordable = options_.editSteps / std::max(1.0, stepsOfTree_);
        if (options_.editEvery > 0)
            every_ = options_.editEvery;
        else if (affordable < std::min<double>(kFewestEdited, options_.seeds))
        {
            estimate_ = true;
            stepsOfTree_ = 0;
        }
        else
            every_ = static_cast<std::uint32_t>(std::max(1.0, std::ceil(options_.seeds / affordable)));
        return NormalisedDistance(estimate_);
    }

    /// Of every `every_` + 1 trees the last two are compared, all if it is 1; the first of two only with the next.
    [[nodiscard]] bool isCompared(std::uint32_t i) const { return every_ == 1 || i % (every_ + 1) == every_; }

    Expected<void> growOne(const Grower& grower, std::uint32_t i, Grown& grown) const
    {
        const Seed seed{options_.first.value + i};
        if (auto done = grower.grow(seed, {}, grown.scratch, grown.skeleton, &grown.sink); !done)
            return done;
        grown.tree = grown.sink.take();
        grown.topology = topologyOf(grown.tree);
        if (isCompared(i) || isCompared(i + 1))
            grown.shape = distance_.shapeOf(grown.tree.shape);
        return {};
    }

    /// In the order of the seeds, so that sums are the same whoever grew the trees.
    void add(std::uint32_t i, Grown& grown)
    {
        grown_.add(grown.tree, grown.skeleton, stride_, i, binHeight_);
        unfinished_ += grown.tree.unfinished > 0 ? 1 : 0;
        copies_ += topologies_.contains(grown.topology) ? 1 : 0;
        distinct_.insert(grown.topology);
        if (!isCompared(i) && !isCompared(i + 1))
            return;
        pending_.push_back({std::move(grown.shape), isCompared(i)});
        pendingNodes_ += grown.tree.size();
    }

    /// Each with the drawn trees and with the one before it. The last stays for the next.
    void comparePending(std::uint32_t grown)
    {
        if (pending_.empty())
            return;
        std::vector<std::uint32_t> compared;
        for (std::uint32_t i = 0; i < pending_.size(); ++i)
            if (pending_[i].isCompared)
                compared.push_back(i);
        std::vector<double> toExemplar(compared.size(), kInfinity);
        std::vector<double> toPrevious(compared.size(), -1);
        // Both distances of a tree are tasks of their own: they may take long, and there may be few.
        forEachTask(
            static_cast<std::uint32_t>(2 * compared.size()), threads_, options_.progress,
            [&](std::uint32_t task) {
                const std::uint32_t i = compared[task / 2];
                const OutlinedTree& shape = pending_[i].shape;
                if (task % 2 == 0)
                    for (const OutlinedTree& exemplar : shapes_)
                        toExemplar[task / 2] = std::min(toExemplar[task / 2], distance_(exemplar, shape));
                else if (i > 0)
                    toPrevious[task / 2] = distance_(pending_[i - 1].shape, shape);
            },
            [&](std::uint32_t taken) { report(grown, 0.5 * taken); });
        exemplarDistances_.insert(exemplarDistances_.end(), toExemplar.begin(), toExemplar.end());
        std::ranges::copy_if(toPrevious, std::back_inserter(pairDistances_), [](double d) { return d >= 0; });
        Pending last = std::move(pending_.back());
        last.isCompared = false;
        pending_.clear();
        pending_.push_back(std::move(last));
        pendingNodes_ = 0;
    }

    /// So many trees were grown, and so many compared since others last were.
    void report(std::uint32_t grown, double compared = 0) const
    {
        constexpr double kSegment = 4e3; ///< Steps that a segment of a tree takes the time of.
        const double growing = kSegment * meanSegments_;
        const double comparing = stepsOfTree_ / (every_ == 1 ? 1 : every_ + 1);
        const double done =
            growing * grown + stepsOfTree_ * (static_cast<double>(exemplarDistances_.size()) + compared);
        options_.progress("compare", std::min(0.99, done / (options_.seeds * (growing + comparing))));
    }

    const std::vector<Exemplar>& exemplars_;
    const std::vector<std::uint32_t> weights_; ///< How often each counts.
    double trees_ = 0;                         ///< The sum of these.
    std::vector<std::uint32_t> labels_;
    std::vector<std::uint8_t> rewritable_;
    const ComparisonOptions& options_;
    const std::uint32_t threads_;
    bool estimate_ = false;
    std::uint32_t every_ = 1;
    double stepsOfTree_ = 0; ///< What comparing one takes.
    NormalisedDistance distance_;
    double meanSegments_ = 0; ///< Of the drawn trees.
    double binHeight_ = 1;
    std::uint32_t stride_ = 1; ///< Of the branches that are kept of each grown tree.
    std::vector<OutlinedTree> shapes_;
    std::set<std::uint64_t> topologies_; ///< Of the drawn trees.
    Gathered drawn_;
    Gathered grown_;
    std::set<std::uint64_t> distinct_;
    struct Pending
    {
        OutlinedTree shape;
        bool isCompared; ///< Else it is only what the next one is compared with.
    };
    std::vector<Pending> pending_; ///< Each with the one before it, but for the first of all.
    std::uint64_t pendingNodes_ = 0;
    std::vector<double> exemplarDistances_;
    std::vector<double> pairDistances_;
    double copies_ = 0;
    double unfinished_ = 0;
};

} // namespace

Expected<Comparison> compare(std::span<const Archetype> archetypes, const Species& species,
                             const ComparisonOptions& options)
{
    if (archetypes.empty())
        return failure(ErrorKind::BadInput, {}, "there is no archetype to compare with", "at least one");
    if (options.seeds < 2)
        return failure(ErrorKind::BadInput, {}, "one tree has nothing to be compared with", "at least 2 seeds");
    for (const Archetype& archetype : archetypes)
        if (auto done = validate(archetype); !done)
            return tl::make_unexpected(done.error());
    if (species.tables.empty())
        return failure(ErrorKind::BadInput, {}, "the species has no template instances to compare",
                       "one that was inferred from archetypes");
    const auto grower = Grower::make(species);
    if (!grower)
        return tl::make_unexpected(grower.error());

    const Archetype merged = mergeArchetypes(archetypes);
    const auto exemplars = drawExemplars(merged, species.appearance.pipes);
    if (!exemplars)
        return tl::make_unexpected(exemplars.error());
    Comparer comparer(*exemplars, species.provenance.weights, labelsOf(species, merged.library),
                      rewritableLetters(species, TurtleAlphabet(grower->program())), options);
    if (auto done = comparer.growAll(*grower); !done)
        return tl::make_unexpected(done.error());
    return comparer.result();
}

std::vector<Bar> barsOf(const Comparison& c)
{
    constexpr double kFewInstances = 25;
    const bool few = c.exemplarInstances < kFewInstances;
    const double parameter = few ? 0.15 : 0.1;
    const auto ratio = [](const MeanComparison& m) { return m.exemplar > 0 ? m.mean / m.exemplar : 1.0; };
    const char* const tooFree = "a smaller --merge-weight keeps relatives nearer to the drawing";
    const char* const tooAlike = "a larger --merge-weight, or more branches of one template and about one size";
    const char* const outline =
        "a smaller --merge-weight; limbs whose pieces begin with $ keep to the ground wherever they hang";
    return {
        {"trees within 0.5 to 1.5 of the exemplar's segments", c.size.within, 0.8, kInfinity, tooFree},
        {"trees under 10 % of its size", c.size.tiny, -kInfinity, 0, tooFree},
        {"unfinished trees", c.size.unfinished, -kInfinity, 0, "rules that end: see `espalier check`"},
        {"divergence of (parent, anchor -> child), bit", c.anchorDivergence, -kInfinity, 0.05, tooFree},
        {"branching angles, distance over spread", c.parameters.angle.distance, -kInfinity, parameter, tooFree},
        {"lengths, distance over spread", c.parameters.length.distance, -kInfinity, parameter, tooFree},
        {"widths, distance over spread", c.parameters.width.distance, -kInfinity, parameter, tooFree},
        {"azimuths, distance over spread", c.parameters.azimuth.distance, -kInfinity, parameter, tooFree},
        {"mean depth over the exemplar's", ratio(c.depth), 0.8, 1.2, tooFree},
        {"Strahler order within 1", c.strahlerWithin1, 0.95, kInfinity, tooFree},
        {"edit distance to the exemplar, median", c.editDistance.exemplarMedian, 0.15, 0.4,
         c.editDistance.exemplarMedian < 0.15 ? tooAlike : tooFree},
        {"edit distance between trees, median", c.editDistance.pairMedian, 0.25, kInfinity, tooAlike},
        {"distinct trees", c.distinct, few ? 0.8 : 0.9, kInfinity, tooAlike},
        {"exact copies of the exemplar", c.copies, -kInfinity, 0.05, tooAlike},
        {"crown height over the exemplar's", ratio(c.crown.height), 0.85, 1.15, outline},
        {"crown width over the exemplar's", ratio(c.crown.width), 0.85, 1.15, outline},
        {"length by height, distance over height", c.crown.profile, -kInfinity, 0.15, outline},
    };
}

} // namespace espalier
