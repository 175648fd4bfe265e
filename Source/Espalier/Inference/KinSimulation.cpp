#include <Espalier/Inference/KinSimulation.h>

#include <Espalier/Archetype/Archetype.h>
#include <algorithm>

namespace espalier {

void SimulatedTree::clear()
{
    shape.labels.clear();
    shape.parents.clear();
    segments = 0;
    depth = 0;
    topology = 0;
    whole = true;
}

KinSimulation::KinSimulation(const LimbTable& limbs, const KinClasses& classes, const std::vector<std::uint32_t>& draws,
                             const std::vector<std::uint32_t>& anchors)
    : limbs_(limbs), classes_(classes), draws_(draws), anchors_(anchors)
{
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
    firstMember_.reserve(classes.kin.size() + 1);
    firstMember_.push_back(0);
    for (const std::vector<std::uint32_t>& kin : classes.kin)
    {
        for (const std::uint32_t limb : kin)
            members_.insert(members_.end(), limbs.limbs[limb].count, limb);
        firstMember_.push_back(static_cast<std::uint32_t>(members_.size()));
    }
}

void KinSimulation::grow(Seed seed, double weight, std::uint32_t mostSegments, SimulatedTree& tree)
{
    key_ = RandomKey(seed);
    counter_ = 0;
    threshold_ = static_cast<std::uint64_t>(weight * 0x1p53);
    growFrom(limbs_.roots[turns_[seed.value % turns_.size()]].limb, mostSegments, tree);
}

void KinSimulation::drawn(std::size_t index, SimulatedTree& tree)
{
    threshold_ = 0;
    growFrom(limbs_.roots[index].limb, 0xffffffffu, tree);
}

bool KinSimulation::exchanges()
{
    return threshold_ > 0 && (key_.bits(Purpose::Sampling, counter_++) >> 11) < threshold_;
}

std::uint32_t KinSimulation::kinOf(std::uint32_t limb)
{
    const std::uint32_t c = classes_.classOf[limb];
    const std::uint32_t first = firstMember_[c];
    return members_[first + key_.below(Purpose::Sampling, firstMember_[c + 1] - first, counter_++)];
}

std::uint32_t KinSimulation::childAt(std::uint32_t limb, std::uint32_t anchor) const
{
    return limbs_.children[limbs_.limbs[limb].firstChild + anchor].limb;
}

void KinSimulation::growFrom(std::uint32_t root, std::uint32_t mostSegments, SimulatedTree& tree)
{
    tree.clear();
    const auto note = [&](std::uint64_t value) {
        tree.topology = (tree.topology ^ (value + 1)) * 0x9e3779b97f4a7c15u;
        tree.topology ^= tree.topology >> 29;
    };
    pending_.assign(1, {root, 0, 1});
    while (!pending_.empty())
    {
        Pending next = pending_.back();
        pending_.pop_back();
        if (next.limb == kNoInstance)
        {
            note(0);
            continue;
        }
        if (exchanges())
            next.limb = kinOf(next.limb);
        const std::uint32_t piece = limbs_.limbs[next.limb].piece;
        const std::uint32_t node = tree.shape.size();
        tree.shape.labels.push_back(piece);
        tree.shape.parents.push_back(next.parent);
        note(piece + 1);
        tree.depth = std::max(tree.depth, next.depth);
        tree.segments += draws_[piece];
        if (tree.segments > mostSegments)
        {
            tree.whole = false;
            return;
        }
        const bool exchangesAnchors =
            classes_.level.anchors &&
            firstMember_[classes_.classOf[next.limb] + 1] - firstMember_[classes_.classOf[next.limb]] > 1;
        for (std::uint32_t a = anchors_[piece]; a-- > 0;)
        {
            const std::uint32_t donor = exchangesAnchors && exchanges() ? kinOf(next.limb) : next.limb;
            pending_.push_back({childAt(donor, a), node, next.depth + 1});
        }
    }
}

} // namespace espalier
