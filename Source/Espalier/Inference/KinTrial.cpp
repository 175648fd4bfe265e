#include <Espalier/Inference/KinTrial.h>

#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Inference/Divergence.h>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace espalier {

namespace {

/// Seeds of trials, away from the small numbers that people use.
Seed trialSeed(std::uint32_t trial)
{
    return Seed{0x6b696e2070696c6fu + trial};
}

constexpr double kWantedDifference = 0.30; ///< Between relatives: nearer looks like a copy, farther like a stranger.
constexpr double kLeastDifference = 0.28;
constexpr double kLeastAccepted = 0.1; ///< A window of 32 attempts then misses one seed in 29.

/// Chance that two trees are equal, of 2,000 of which nine in ten are then different. Of a drawn tree of fewer than 25
/// instances there are not so many, and eight in ten must do: more would cost it its likeness.
double mostEqual(double instances)
{
    return instances < 25 ? 4e-4 : 1e-4;
}

constexpr double kTrialInstances = 3e4;    ///< Of all trees of a trial; of large ones so many
constexpr double kFewTrials = 2e6;         ///< as take no more than this.
constexpr std::size_t kMostCompared = 200; ///< Accepted trees, each with the one before it.
constexpr double kFewInstances = 40;       ///< Up to which exact distances take no time.
constexpr double kManyInstances = 2000;    ///< From which on trees are grown in outline.

/// Of a large tree: limbs up to this share of it stand in trials as they were drawn, those of a twig in trees of ten
/// thousands of instances, larger ones the larger it is. There are thousands of them, so that what would be exchanged
/// in each evens out, and a tree drawn in order is quicker to read than one exchanged twig by twig: cache misses are
/// the most of what growing a large one takes.
double settledShareOf(double instances)
{
    constexpr double kMost = 1.0 / 2000;
    constexpr double kByInstance = 1e-9;
    return instances > kManyInstances ? std::min(kMost, kByInstance * instances) : 0;
}

/// How near a trial, or the outcome of a weight, comes to what is wanted, [0, 1].
double scoreOf(const auto& trial, double mostEqual)
{
    // A pair that is equal ten times as often as it may be is as bad as half the difference.
    const double distinct =
        std::clamp(1 - 0.3 / math::log(10) * math::log(std::max(trial.equal, 1e-9) / mostEqual), 0.01, 1.0);
    return std::min(1.0, trial.difference / kLeastDifference) * std::min(1.0, trial.accepted / kLeastAccepted) *
           distinct;
}

/// Share of pairs of equal values.
double shareOfEqualPairs(std::vector<std::uint64_t> values)
{
    if (values.size() < 2)
        return 1;
    std::ranges::sort(values);
    double equal = 0;
    double run = 0;
    for (std::size_t i = 1; i < values.size(); ++i)
    {
        run = values[i] == values[i - 1] ? run + 1 : 0;
        equal += run;
    }
    const double count = static_cast<double>(values.size());
    return equal / (count * (count - 1) / 2);
}

} // namespace

KinNursery::KinNursery(const TemplateLibrary& library, const LimbTable& limbs, const std::vector<std::uint32_t>& draws,
                       const Progress& progress)
    : limbs_(limbs), draws_(draws), progress_(progress)
{
    for (const Template& piece : library.templates)
        anchors_.push_back(static_cast<std::uint32_t>(piece.anchors.size()));
    double trees = 0;
    for (const std::uint32_t weight : limbs.rootWeights)
        trees += weight;
    for (std::size_t tree = 0; tree < limbs.roots.size(); ++tree)
    {
        const Limb& root = limbs.limbs[limbs.roots[tree].limb];
        const double weight = limbs.rootWeights[tree];
        segments_ += weight * root.segments / trees;
        depth_ += weight * root.height / trees;
        leastSegments_ = std::min(leastSegments_, root.segments);
        mostSegments_ = std::max(mostSegments_, root.segments);
        leastDepth_ = std::min(leastDepth_, root.height);
        mostDepth_ = std::max(mostDepth_, root.height);
    }
    for (const Limb& limb : limbs.limbs)
        instances_ += limb.count / trees;
}

TreeRecord KinNursery::record() const
{
    return instances_ > kManyInstances ? TreeRecord::Outline : TreeRecord::Shape;
}

bool KinNursery::accepts(const GrowthWindow& window, const Sample& sample) const
{
    return sample.whole && sample.segments >= window.minSegments && sample.segments <= window.maxSegments &&
           sample.depth >= window.minDepth && sample.depth <= window.maxDepth && !sample.copy;
}

/// The window whose accepted trees have the drawn trees' mean size and no less than their mean depth, as nearly as its
/// lower bounds can bring about without refusing more than half of what the widest lets pass. A trunk that is a chain
/// of equal pieces would else be too short on average: where it is exchanged it can lose more pieces than it can gain.
GrowthWindow KinNursery::windowFor(const std::vector<Sample>& samples) const
{
    constexpr double kMostSegments = 1.5;
    constexpr double kMostDepth = 1.25;
    constexpr double kLeastDepth = 0.97; ///< Mean, of the drawn trees'.
    const auto bound = [](double value) { return static_cast<std::uint32_t>(std::clamp(value, 0.0, 4e9)); };
    GrowthWindow window;
    window.maxSegments = bound(std::floor(kMostSegments * mostSegments_));
    window.maxDepth = bound(std::floor(kMostDepth * mostDepth_));
    GrowthWindow best = window;
    double least = std::numeric_limits<double>::infinity();
    double widest = 0; // accepted by the widest window, the first
    for (int depth = 75; depth <= 95; depth += 5)
        for (int size = 50; size <= 80; size += 2)
        {
            window.minDepth = bound(std::ceil(depth * 0.01 * leastDepth_));
            window.minSegments = bound(std::ceil(size * 0.01 * leastSegments_));
            double segments = 0;
            double depths = 0;
            double count = 0;
            for (const Sample& sample : samples)
                if (accepts(window, sample))
                {
                    segments += sample.segments;
                    depths += sample.depth;
                    ++count;
                }
            widest = std::max(widest, count);
            const double miss = count == 0 ? 1e9
                                           : std::abs(segments / count / segments_ - 1) +
                                                 std::max(0.0, kLeastDepth - depths / count / depth_);
            if (miss < least && 2 * count >= widest)
            {
                least = miss;
                best = window;
            }
        }
    return best;
}

KinNursery::Stand KinNursery::growStand(KinSimulation& simulation, const std::vector<std::uint64_t>& drawn,
                                        double weight) const
{
    // Outlines are quickly grown. Trees of hundreds of thousands are much of a size: fewer tell.
    const double enough = record() == TreeRecord::Outline ? 60 : 10;
    const double fewest = std::clamp(kFewTrials / std::max(1.0, instances_), 4.0, enough);
    const auto trials =
        static_cast<std::uint32_t>(std::clamp(kTrialInstances / std::max(1.0, instances_), fewest, 3000.0));
    Stand stand;
    const auto most = static_cast<std::uint32_t>(std::min(4e9, 1.5 * mostSegments_));
    std::vector<OutlinedTree> shapes(trials);
    SimulatedTree tree;
    for (std::uint32_t i = 0; i < trials; ++i)
    {
        simulation.grow(trialSeed(i), weight, most, tree);
        stand.samples.push_back({tree.segments, tree.depth, tree.topology, tree.whole,
                                 std::ranges::find(drawn, tree.topology) != drawn.end(),
                                 simulation.beginningOf(trialSeed(i))});
        if (tree.whole)
            shapes[i] = {tree.shape, std::move(tree.grams)};
    }
    stand.window = windowFor(stand.samples);
    for (std::size_t i = 0; i < shapes.size() && stand.accepted.size() < kMostCompared; ++i)
        if (accepts(stand.window, stand.samples[i]))
            stand.accepted.push_back(std::move(shapes[i]));
    if (instances_ > kFewInstances && record() == TreeRecord::Shape)
        for (OutlinedTree& accepted : stand.accepted)
            accepted.grams = pqGramsOf(accepted.tree);
    return stand;
}

/// The median over neighbours: exact distances of small trees, estimates of others.
double KinNursery::differenceOf(const std::vector<OutlinedTree>& trees) const
{
    std::vector<double> distances;
    for (std::size_t i = 1; i < trees.size(); ++i)
        distances.push_back(instances_ <= kFewInstances ? normalisedEditDistance(trees[i - 1].tree, trees[i].tree)
                                                        : estimatedEditDistance(trees[i - 1], trees[i]));
    return medianOf(std::move(distances));
}

/// What the estimate of trees that are neither small nor large must be multiplied by: from the exact distances of some
/// pairs, if there is time for enough of them to tell. How far it is off depends on the tree more than on the weight.
double KinNursery::distanceScaleOf(const Stand& stand) const
{
    constexpr double kBudget = 2e6; ///< Products of sizes: some tenths of a second.
    constexpr double kFewestPairs = 3;
    constexpr double kMostPairs = 12;
    const double pairs = std::min(kBudget / (instances_ * instances_), kMostPairs);
    if (instances_ <= kFewInstances || pairs < kFewestPairs)
        return 1;
    const std::size_t count = std::min(stand.accepted.size(), static_cast<std::size_t>(pairs) + 1);
    const std::vector<OutlinedTree> shapes(stand.accepted.begin(),
                                           stand.accepted.begin() + static_cast<std::ptrdiff_t>(count));
    std::vector<double> exact;
    for (std::size_t i = 1; i < shapes.size(); ++i)
        exact.push_back(normalisedEditDistance(shapes[i - 1].tree, shapes[i].tree));
    const double estimated = differenceOf(shapes);
    return exact.empty() || estimated <= 0 ? 1 : std::clamp(medianOf(std::move(exact)) / estimated, 0.25, 2.0);
}

/// Share of attempts that are accepted: where several trees were drawn and there are enough attempts to tell, of those
/// that begin with the one that has the fewest. A kind of its own among them, whose limbs have no kin, would else grow
/// nothing but copies, which are refused, and vanish.
double KinNursery::acceptedOf(const Stand& stand) const
{
    constexpr std::size_t kFewestAttempts = 10;
    struct Count
    {
        double attempts = 0;
        double accepted = 0;
    };
    std::vector<Count> counts(limbs_.roots.size());
    Count all;
    for (const Sample& sample : stand.samples)
        for (Count* count : {&all, &counts[sample.beginning]})
        {
            ++count->attempts;
            count->accepted += accepts(stand.window, sample) ? 1 : 0;
        }
    double least = all.accepted / all.attempts;
    if (stand.samples.size() >= kFewestAttempts * counts.size())
        for (const Count& count : counts)
            if (count.attempts > 0)
                least = std::min(least, count.accepted / count.attempts);
    return least;
}

KinNursery::Outcome KinNursery::outcomeOf(const Stand& stand, double weight) const
{
    Outcome outcome;
    outcome.weight = weight;
    std::vector<std::uint64_t> topologies;
    for (const Sample& sample : stand.samples)
        if (accepts(stand.window, sample))
            topologies.push_back(sample.topology);
    outcome.accepted = acceptedOf(stand);
    outcome.equal = shareOfEqualPairs(std::move(topologies));
    outcome.difference = differenceOf(stand.accepted);
    outcome.window = stand.window;
    return outcome;
}

/// Grows stands of one choice of classes, at several weights; each weight once, for calibrating returns to them.
class KinNursery::Bed
{
public:
    Bed(const KinNursery& nursery, KinClasses classes)
        : nursery_(nursery), classes_(std::move(classes)),
          simulation_(nursery.limbs_, classes_, nursery.draws_, nursery.anchors_, nursery.record(),
                      settledShareOf(nursery.instances_) * nursery.segments_)
    {
        SimulatedTree tree;
        for (std::size_t i = 0; i < std::min(nursery.limbs_.roots.size(), std::size_t{kMostCopies}); ++i)
        {
            simulation_.drawn(i, tree);
            drawn_.push_back(tree.topology);
        }
    }
    Bed(const Bed&) = delete;
    Bed& operator=(const Bed&) = delete;

    /// With the difference as estimated.
    [[nodiscard]] Expected<Outcome> at(double weight)
    {
        if (nursery_.progress_.wantsStop())
            return failure(ErrorKind::Cancelled, {}, "the inference was cancelled");
        const auto [known, isNew] = outcomes_.try_emplace(weight);
        if (isNew)
            known->second = nursery_.outcomeOf(nursery_.growStand(simulation_, drawn_, weight), weight);
        return known->second;
    }

    [[nodiscard]] double distanceScaleAt(double weight)
    {
        const auto [known, isNew] = scales_.try_emplace(weight, 1.0);
        if (isNew && nursery_.record() == TreeRecord::Shape)
            known->second = nursery_.distanceScaleOf(nursery_.growStand(simulation_, drawn_, weight));
        return known->second;
    }

    [[nodiscard]] KinTrial trialOf(Outcome outcome) &&
    {
        classes_.weight = outcome.weight;
        return {
            std::move(classes_), std::move(outcome.window), outcome.accepted, outcome.equal, outcome.difference, 0, {}};
    }

private:
    const KinNursery& nursery_;
    KinClasses classes_;
    KinSimulation simulation_;
    std::vector<std::uint64_t> drawn_; ///< Topologies of the drawn trees.
    std::map<double, Outcome> outcomes_;
    std::map<double, double> scales_;
};

Expected<KinTrial> KinNursery::tryOut(KinClasses classes, double weight) const
{
    Bed bed(*this, std::move(classes));
    auto outcome = bed.at(weight);
    if (!outcome)
        return tl::make_unexpected(outcome.error());
    outcome->difference *= bed.distanceScaleAt(weight);
    return std::move(bed).trialOf(std::move(*outcome));
}

Expected<KinTrial> KinNursery::tryOut(const KinLevel& level, double weight) const
{
    return tryOut(classify(limbs_, level, segments_), weight);
}

/// Differences rise with the weight and acceptance falls, within noise: the trials of all weights grow from the same
/// seeds. Of large trees few are accepted at weight 1, too few to tell differences.
Expected<KinNursery::Outcome> KinNursery::bisect(Bed& bed, double distanceScale) const
{
    const auto tooFew = [](const Outcome& trial) { return trial.accepted < kLeastAccepted; };
    const auto at = [&](double weight) {
        auto outcome = bed.at(weight);
        if (outcome)
            outcome->difference *= distanceScale;
        return outcome;
    };
    auto best = at(1.0);
    if (!best || (best->difference < kLeastDifference && !tooFew(*best)))
        return best;
    // Ten large trees do not tell weights apart that are nearer to each other.
    const int resolution = instances_ > kManyInstances ? 4 : 1;
    int low = 0;    // hundredths: too small a weight
    int high = 100; // a sufficient one
    while (high - low > resolution)
    {
        const int middle = (low + high) / 2;
        auto trial = at(middle / 100.0);
        if (!trial)
            return trial;
        const bool enough = trial->difference >= kWantedDifference && trial->equal <= mostEqual(instances_);
        (enough || tooFew(*trial) ? high : low) = middle;
        if ((enough && !tooFew(*trial)) ||
            scoreOf(*trial, mostEqual(instances_)) > scoreOf(*best, mostEqual(instances_)))
            best = std::move(trial);
    }
    return best;
}

Expected<KinTrial> KinNursery::calibrate(const KinLevel& level) const
{
    constexpr int kMostRounds = 3;
    constexpr double kNear = 0.02;
    Bed bed(*this, classify(limbs_, level, segments_));
    double scale = 1;
    auto best = bisect(bed, scale);
    for (int round = 0; round < kMostRounds && best && best->accepted > 0; ++round)
    {
        const double before = scale;
        scale = bed.distanceScaleAt(best->weight);
        best->difference *= scale / before;
        if (std::abs(scale - before) < kNear * before || std::abs(best->difference - kWantedDifference) < kNear)
            break;
        best = bisect(bed, scale);
    }
    if (!best)
        return tl::make_unexpected(best.error());
    return std::move(bed).trialOf(std::move(*best));
}

Expected<KinTrial> KinNursery::chooseLevel(const Shortfall& shortfall, std::vector<KinTrial>& tried) const
{
    Expected<KinTrial> best;
    double bestScore = -1;
    for (const KinLevel& level : kinLevels())
    {
        progress_("generalize",
                  static_cast<double>(&level - kinLevels().data()) / static_cast<double>(kinLevels().size()));
        auto trial = calibrate(level);
        if (!trial)
            return trial;
        double& score = trial->score;
        score = scoreOf(*trial, mostEqual(instances_));
        if (score > std::max(bestScore, 0.0)) // else it is not the best, whatever it keeps
        {
            auto missed = shortfall(*trial);
            if (!missed)
                return tl::make_unexpected(missed.error());
            trial->shortfall = std::move(*missed);
            score /= 1 + trial->shortfall.missed;
        }
        tried.push_back(*trial);
        tried.back().classes = {level, trial->classes.weight, {}, {}, {}, {}};
        if (score > bestScore)
        {
            bestScore = score;
            best = std::move(trial);
        }
        if (bestScore >= 1)
            break;
    }
    return best;
}

} // namespace espalier
