#include <Espalier/Inference/KinTrial.h>

#include <Espalier/Inference/KinGrammar.h>
#include <Espalier/Inference/TreeDistance.h>
#include <Espalier/Species/Grow.h>
#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <span>

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
constexpr double kLeastDistinct = 0.9;

bool accepts(const GrowthWindow& window, const GrowthSample& sample)
{
    return sample.whole && sample.segments >= window.minSegments && sample.segments <= window.maxSegments &&
           sample.depth >= window.minDepth && sample.depth <= window.maxDepth &&
           std::ranges::find(window.copies, sample.topology) == window.copies.end();
}

/// Records the tree of template instances of a derivation.
class ShapeSink final : public DerivationSink
{
public:
    explicit ShapeSink(const std::vector<std::uint32_t>& labelOfProduction) : labelOfProduction_(labelOfProduction) {}

    LabelledTree tree;

    bool modules(std::span<const LetterId>, std::span<const double>) override { return true; }
    void beginInstance(std::uint32_t production, std::uint32_t) override
    {
        tree.labels.push_back(labelOfProduction_[production]);
        tree.parents.push_back(open_.empty() ? 0 : open_.back());
        open_.push_back(tree.size() - 1);
    }
    void endInstance() override { open_.pop_back(); }
    bool wantsArguments() const override { return false; }

private:
    const std::vector<std::uint32_t>& labelOfProduction_;
    std::vector<std::uint32_t> open_;
};

/// Edit distance over the sum of sizes, as pq-grams estimate it (fitted over trees of 17 to 465 instances, r = 0.96).
double estimatedDistance(const std::vector<std::uint64_t>& a, const std::vector<std::uint64_t>& b)
{
    return std::max(0.0, 0.90 * pqGramDistance(a, b) - 0.017);
}

/// How near a trial comes to what is wanted, [0, 1].
double scoreOf(const KinTrial& trial)
{
    return std::min(1.0, trial.difference / kLeastDifference) * std::min(1.0, trial.accepted / kLeastAccepted) *
           std::min(1.0, trial.distinct / kLeastDistinct);
}

/// The template of each production, as a small number.
std::vector<std::uint32_t> labelsOf(const Species& species)
{
    std::vector<std::uint32_t> labels;
    for (const Production& production : species.grammar.productions)
        labels.push_back(static_cast<std::uint32_t>(
            std::ranges::find(species.tables, production.table, &TransformTable::name) - species.tables.begin()));
    return labels;
}

} // namespace

KinNursery::KinNursery(const TemplateLibrary& library, const LimbTable& limbs, const Progress& progress)
    : library_(library), limbs_(limbs), progress_(progress)
{
    const double trees = static_cast<double>(limbs.roots.size());
    for (const std::uint32_t root : limbs.roots)
    {
        segments_ += limbs.limbs[root].segments / trees;
        leastSegments_ = std::min(leastSegments_, limbs.limbs[root].segments);
        mostSegments_ = std::max(mostSegments_, limbs.limbs[root].segments);
        leastDepth_ = std::min(leastDepth_, limbs.limbs[root].height);
        mostDepth_ = std::max(mostDepth_, limbs.limbs[root].height);
    }
    for (const Limb& limb : limbs.limbs)
        instances_ += limb.count / trees;
    drawn_ = drawnTopologies();
}

/// Topologies of the drawn trees, which the window keeps from being grown again: each is what its limbs give when every
/// limb is a class of its own. Of very many trees the first will do: none of them is then grown again often.
Expected<std::vector<std::uint64_t>> KinNursery::drawnTopologies() const
{
    LimbTable one = limbs_;
    KinClasses apart;
    for (std::uint32_t limb = 0; limb < one.limbs.size(); ++limb)
    {
        apart.classOf.push_back(limb);
        apart.kin.push_back({limb});
        apart.occurrences.push_back(one.limbs[limb].count);
    }
    std::vector<std::uint64_t> topologies;
    constexpr std::size_t kMostCopies = 32;
    for (const std::uint32_t root : std::span(limbs_.roots).first(std::min(limbs_.roots.size(), kMostCopies)))
    {
        if (progress_.wantsStop())
            return failure(ErrorKind::Cancelled, {}, "the inference was cancelled");
        one.roots = {root};
        Species species;
        writeKinGrammar(library_, one, apart, species);
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

/// The window whose accepted trees have the drawn trees' mean size, as nearly as its lower bound can bring about.
GrowthWindow KinNursery::windowFor(const std::vector<GrowthSample>& samples) const
{
    constexpr double kMostSegments = 1.5;
    constexpr double kDepth = 0.25;
    const auto bound = [](double value) { return static_cast<std::uint32_t>(std::clamp(value, 0.0, 4e9)); };
    GrowthWindow window;
    window.maxSegments = bound(std::floor(kMostSegments * mostSegments_));
    window.minDepth = bound(std::ceil((1 - kDepth) * leastDepth_));
    window.maxDepth = bound(std::floor((1 + kDepth) * mostDepth_));
    window.copies = *drawn_;
    GrowthWindow best = window;
    double least = std::numeric_limits<double>::infinity();
    for (int percent = 50; percent <= 80; percent += 2)
    {
        window.minSegments = bound(std::ceil(percent * 0.01 * leastSegments_));
        double sum = 0;
        std::uint32_t count = 0;
        for (const GrowthSample& sample : samples)
            if (accepts(window, sample))
            {
                sum += sample.segments;
                ++count;
            }
        const double miss = count == 0 ? 1e9 : std::abs(sum / count / segments_ - 1);
        if (miss < least)
        {
            least = miss;
            best = window;
        }
    }
    return best;
}

Expected<KinTrial> KinNursery::tryOut(KinClasses classes, double weight) const
{
    if (progress_.wantsStop())
        return failure(ErrorKind::Cancelled, {}, "the inference was cancelled");
    if (!drawn_)
        return tl::make_unexpected(drawn_.error());
    classes.weight = weight;
    Species species;
    writeKinGrammar(library_, limbs_, classes, species);
    const auto grower = Grower::make(species);
    if (!grower)
        return tl::make_unexpected(grower.error());

    GrowScratch scratch;
    std::vector<GrowthSample> samples;
    const auto trials = static_cast<std::uint32_t>(std::clamp(4e4 / std::max(1.0, instances_), 16.0, 400.0));
    for (std::uint32_t i = 0; i < trials; ++i)
    {
        const auto sample = grower->sample(trialSeed(i), 0, {}, scratch, 4 * mostSegments_);
        if (!sample)
            return tl::make_unexpected(sample.error());
        samples.push_back(*sample);
    }

    KinTrial trial;
    trial.classes = std::move(classes);
    trial.window = windowFor(samples);
    std::set<std::uint64_t> topologies;
    std::vector<std::vector<std::uint64_t>> shapes; // of the accepted
    const std::vector<std::uint32_t> labels = labelsOf(species);
    for (std::uint32_t i = 0; i < samples.size(); ++i)
    {
        if (!accepts(trial.window, samples[i]))
            continue;
        topologies.insert(samples[i].topology);
        ShapeSink sink(labels);
        if (const auto done = grower->derive(trialSeed(i), 0, {}, scratch, sink); !done)
            return tl::make_unexpected(done.error());
        shapes.push_back(pqGramsOf(sink.tree));
    }
    if (shapes.empty())
        return trial;
    trial.accepted = static_cast<double>(shapes.size()) / trials;
    trial.distinct = static_cast<double>(topologies.size()) / static_cast<double>(shapes.size());
    std::vector<double> distances;
    for (std::size_t step = 1; step <= 2; ++step) // each with its next and its next but one: enough pairs for a median
        for (std::size_t i = step; i < shapes.size(); ++i)
            distances.push_back(estimatedDistance(shapes[i - step], shapes[i]));
    std::ranges::sort(distances);
    trial.difference = distances.empty() ? 0 : distances[distances.size() / 2];
    return trial;
}

Expected<KinTrial> KinNursery::tryOut(const KinLevel& level, double weight) const
{
    return tryOut(classify(limbs_, level, segments_), weight);
}

Expected<KinTrial> KinNursery::calibrate(const KinLevel& level) const
{
    const KinClasses classes = classify(limbs_, level, segments_);
    // Differences rise with the weight and acceptance falls, within noise: the trials of all weights grow from the same
    // seeds. Of large trees few are accepted at weight 1, too few to tell differences.
    const auto tooFew = [](const KinTrial& trial) { return trial.accepted < kLeastAccepted; };
    auto best = tryOut(classes, 1.0);
    if (!best || (best->difference < kLeastDifference && !tooFew(*best)))
        return best;
    int low = 0;    // hundredths: too small a weight
    int high = 100; // a sufficient one
    while (high - low > 1)
    {
        const int middle = (low + high) / 2;
        auto trial = tryOut(classes, 0.01 * middle);
        if (!trial)
            return trial;
        const bool enough = trial->difference >= kWantedDifference;
        (enough || tooFew(*trial) ? high : low) = middle;
        if ((enough && !tooFew(*trial)) || scoreOf(*trial) > scoreOf(*best))
            best = std::move(trial);
    }
    return best;
}

Expected<KinTrial> KinNursery::chooseLevel() const
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
        const double score = scoreOf(*trial);
        if (score > bestScore)
        {
            bestScore = score;
            best = std::move(trial);
        }
        if (score >= 1)
            break;
    }
    return best;
}

} // namespace espalier
