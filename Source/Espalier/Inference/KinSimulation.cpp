#include <Espalier/Inference/KinSimulation.h>

#include <Espalier/Archetype/Archetype.h>
#include <algorithm>

namespace espalier {

namespace {

constexpr std::uint32_t kNoProfile = 0xffffffffu;

void note(std::uint64_t& topology, std::uint64_t value)
{
    topology = (topology ^ (value + 1)) * 0x9e3779b97f4a7c15u;
    topology ^= topology >> 29;
}

} // namespace

void SimulatedTree::clear()
{
    shape.labels.clear();
    shape.parents.clear();
    grams.counts.clear();
    grams.total = 0;
    segments = 0;
    depth = 0;
    topology = 0;
    whole = true;
}

KinSimulation::KinSimulation(const LimbTable& limbs, const KinClasses& classes, const std::vector<std::uint32_t>& draws,
                             const std::vector<std::uint32_t>& anchors, TreeRecord record, double settledSegments)
    : limbs_(limbs), anchors_(anchors), record_(record), exchangesAnchors_(classes.level.anchors)
{
    places_.reserve(limbs.limbs.size());
    for (const Limb& limb : limbs.limbs)
        places_.push_back({limb.kind, limb.firstChild, 0, 0, draws[limb.piece]});
    settled_.resize(limbs.limbs.size());
    profileOf_.assign(limbs.limbs.size(), kNoProfile);
    for (const std::vector<std::uint32_t>& kin : classes.kin)
        if (settledSegments > 0 &&
            std::ranges::all_of(kin, [&](std::uint32_t limb) { return limbs.limbs[limb].segments <= settledSegments; }))
            for (const std::uint32_t limb : kin)
                settled_[limb] = true;
    // Where settled limbs stand for each other, only those do that hang at what is not settled: so each drawn one is
    // still expected once.
    std::vector<std::uint32_t> hanging(limbs.limbs.size());
    for (std::size_t tree = 0; tree < limbs.roots.size(); ++tree)
        hanging[limbs.roots[tree].limb] += limbs.rootWeights[tree];
    for (std::size_t i = 0; i < limbs.limbs.size(); ++i)
        for (std::uint32_t a = 0; !settled_[i] && a < anchors[limbs.limbs[i].piece]; ++a)
            if (const std::uint32_t child = limbs.children[limbs.limbs[i].firstChild + a].limb; child != kNoInstance)
                hanging[child] += limbs.limbs[i].count;
    // Of a tree that counts w times turn k stands at (k + 1/2) / w, so that also a few turns are mixed as all are.
    struct Turn
    {
        std::uint64_t position; // doubled
        std::uint64_t weight;
        std::uint32_t tree;
    };
    std::vector<Turn> turns;
    for (std::uint32_t tree = 0; tree < limbs.roots.size(); ++tree)
        for (std::uint64_t k = 0; k < limbs.rootWeights[tree]; ++k)
            turns.push_back({2 * k + 1, limbs.rootWeights[tree], tree});
    std::ranges::stable_sort(
        turns, [](const Turn& a, const Turn& b) { return a.position * b.weight < b.position * a.weight; });
    for (const Turn& turn : turns)
        turns_.push_back(turn.tree);
    for (const std::vector<std::uint32_t>& kin : classes.kin)
    {
        const auto first = static_cast<std::uint32_t>(members_.size());
        for (const std::uint32_t limb : kin)
            members_.insert(members_.end(), settled_[limb] ? hanging[limb] : limbs.limbs[limb].count, limb);
        const auto count = static_cast<std::uint32_t>(members_.size()) - first;
        for (const std::uint32_t limb : kin)
        {
            places_[limb].firstMember = first;
            places_[limb].members = count;
        }
    }
}

void KinSimulation::grow(Seed seed, double weight, std::uint32_t mostSegments, SimulatedTree& tree)
{
    key_ = RandomKey(seed);
    counter_ = 0;
    threshold_ = static_cast<std::uint64_t>(weight * 0x1p53);
    growRecorded(limbs_.roots[beginningOf(seed)].limb, mostSegments, tree);
}

void KinSimulation::drawn(std::size_t index, SimulatedTree& tree)
{
    threshold_ = 0;
    growRecorded(limbs_.roots[index].limb, 0xffffffffu, tree);
}

bool KinSimulation::exchanges()
{
    return threshold_ > 0 && (key_.bits(Purpose::Sampling, counter_++) >> 11) < threshold_;
}

std::uint32_t KinSimulation::kinOf(const Place& place)
{
    return members_[place.firstMember + key_.below(Purpose::Sampling, place.members, counter_++)];
}

void KinSimulation::growRecorded(std::uint32_t root, std::uint32_t mostSegments, SimulatedTree& tree)
{
    if (record_ == TreeRecord::Shape)
        growFrom<TreeRecord::Shape>(root, mostSegments, tree);
    else
        growFrom<TreeRecord::Outline>(root, mostSegments, tree);
}

/// A node's, once its children are pending: the first of them on top. That they may yet be exchanged does not matter,
/// for kin have one template.
void KinSimulation::countGrams(PqGramCounter& grams, std::uint32_t parent, std::uint32_t label,
                               std::size_t firstPending) const
{
    std::uint32_t left = PqGramCounter::kNone;
    for (std::size_t i = pending_.size(); i-- > firstPending;)
    {
        if (pending_[i].limb == kNoInstance)
            continue;
        const std::uint32_t child = places_[pending_[i].limb].piece;
        grams.add(parent, label, left, child);
        left = child;
    }
    grams.add(parent, label, left, PqGramCounter::kNone);
}

const KinSimulation::Profile& KinSimulation::profileOf(std::uint32_t limb)
{
    if (profileOf_[limb] != kNoProfile)
        return profiles_[profileOf_[limb]];
    profileOf_[limb] = static_cast<std::uint32_t>(profiles_.size());
    Profile& profile = profiles_.emplace_back();
    PqGramCounter grams;
    // On top of what is pending in the tree itself.
    const std::size_t bottom = pending_.size();
    pending_.push_back({limb, PqGramCounter::kNone, 1, true});
    while (pending_.size() > bottom)
    {
        const Pending next = pending_.back();
        pending_.pop_back();
        const bool isOpen = next.limb == kNoInstance;
        note(profile.topology, isOpen ? 0 : places_[next.limb].piece + 1);
        if (isOpen)
            continue;
        const Place& place = places_[next.limb];
        const std::size_t firstPending = pending_.size();
        for (std::uint32_t a = anchors_[place.piece]; a-- > 0;)
            pending_.push_back({limbs_.children[place.firstChild + a].limb, place.piece, next.depth + 1, true});
        if (next.depth > 1)
            countGrams(grams, next.parent, place.piece, firstPending);
    }
    profile.grams = grams.take().counts;
    return profile;
}

/// The grams of a settled limb and of all that it carries.
void KinSimulation::addSettled(std::uint32_t limb, std::uint32_t parent)
{
    const Place& place = places_[limb];
    const std::size_t firstPending = pending_.size();
    for (std::uint32_t a = anchors_[place.piece]; a-- > 0;)
        pending_.push_back({limbs_.children[place.firstChild + a].limb, place.piece, 0, true});
    countGrams(grams_, parent, place.piece, firstPending);
    pending_.resize(firstPending);
    for (const PqGrams::Count& count : profileOf(limb).grams)
        grams_.add(count);
}

template <TreeRecord record>
void KinSimulation::growFrom(std::uint32_t root, std::uint32_t mostSegments, SimulatedTree& tree)
{
    constexpr bool isOutline = record == TreeRecord::Outline;
    tree.clear();
    std::uint64_t topology = 0;
    pending_.assign(1, {root, 0, 1, false});
    while (!pending_.empty())
    {
        const Pending next = pending_.back();
        pending_.pop_back();
        if (next.limb == kNoInstance)
        {
            note(topology, 0);
            continue;
        }
        std::uint32_t limb = next.limb;
        if (!next.settled && exchanges())
            limb = kinOf(places_[limb]);
        const bool settled = next.settled || settled_[limb];
        const Place place = places_[limb];
        const std::uint32_t node = tree.shape.size();
        const std::uint32_t parentLabel = node == 0 ? PqGramCounter::kNone : tree.shape.labels[next.parent];
        tree.shape.labels.push_back(place.piece);
        tree.shape.parents.push_back(next.parent);
        // Of an outline, what is settled need not be walked.
        const bool isLump = isOutline && settled;
        note(topology, isLump ? profileOf(limb).topology : place.piece + 1);
        tree.depth = std::max(tree.depth, isLump ? next.depth + limbs_.limbs[limb].height - 1 : next.depth);
        tree.segments += isLump ? limbs_.limbs[limb].segments : place.draws;
        if (tree.segments > mostSegments)
        {
            tree.whole = false;
            grams_.clear();
            break;
        }
        if (isLump)
        {
            addSettled(limb, parentLabel);
            continue;
        }
        const bool exchangesAnchors = !settled && exchangesAnchors_ && place.members > 1;
        const std::size_t firstPending = pending_.size();
        for (std::uint32_t a = anchors_[place.piece]; a-- > 0;)
        {
            const std::uint32_t firstChild =
                exchangesAnchors && exchanges() ? places_[kinOf(place)].firstChild : place.firstChild;
            pending_.push_back({limbs_.children[firstChild + a].limb, node, next.depth + 1, settled});
        }
        if constexpr (isOutline)
            countGrams(grams_, parentLabel, place.piece, firstPending);
    }
    tree.topology = topology;
    if (isOutline && tree.whole)
        tree.grams = grams_.take();
}

} // namespace espalier
