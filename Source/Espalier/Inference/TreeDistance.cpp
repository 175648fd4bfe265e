#include <Espalier/Inference/TreeDistance.h>

#include <Espalier/Core/ChildLists.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <utility>

namespace espalier {

PqGramCounter::PqGramCounter()
{
    clear();
}

void PqGramCounter::clear()
{
    constexpr std::size_t kSlots = 512;
    slots_.assign(std::max(slots_.size(), kSlots), {});
    used_ = 0;
    total_ = 0;
}

PqGrams PqGramCounter::take()
{
    PqGrams grams;
    grams.total = total_;
    grams.counts.reserve(used_);
    std::ranges::copy_if(slots_, std::back_inserter(grams.counts),
                         [](const PqGrams::Count& slot) { return slot.count > 0; });
    std::ranges::sort(grams.counts, {}, &PqGrams::Count::gram);
    clear();
    return grams;
}

void PqGramCounter::widen()
{
    const std::vector<PqGrams::Count> old = std::exchange(slots_, std::vector<PqGrams::Count>(4 * slots_.size()));
    for (const PqGrams::Count& slot : old)
        if (slot.count > 0)
            slotOf(slot.gram) = slot;
}

PqGrams pqGramsOf(const LabelledTree& tree)
{
    constexpr std::uint32_t kNone = PqGramCounter::kNone;
    PqGramCounter counter;
    std::vector<std::uint32_t> left(tree.size(), kNone); // the last child seen
    const auto parentLabel = [&](std::uint32_t node) { return node == 0 ? kNone : tree.labels[tree.parents[node]]; };
    for (std::uint32_t node = 1; node < tree.size(); ++node)
    {
        const std::uint32_t parent = tree.parents[node];
        counter.add(parentLabel(parent), tree.labels[parent], left[parent], tree.labels[node]);
        left[parent] = tree.labels[node];
    }
    for (std::uint32_t node = 0; node < tree.size(); ++node)
        counter.add(parentLabel(node), tree.labels[node], left[node], kNone);
    return counter.take();
}

namespace {

ChildLists childrenOf(const LabelledTree& tree)
{
    std::vector<std::uint32_t> parents = tree.parents;
    parents[0] = kNoParent;
    return childListsOf(parents);
}

} // namespace

double pqGramDistance(const PqGrams& a, const PqGrams& b)
{
    if (a.total + b.total == 0)
        return 0;
    std::uint64_t common = 0;
    for (std::size_t i = 0, k = 0; i < a.counts.size() && k < b.counts.size();)
    {
        if (a.counts[i].gram == b.counts[k].gram)
            common += std::min(a.counts[i++].count, b.counts[k++].count);
        else
            a.counts[i].gram < b.counts[k].gram ? ++i : ++k;
    }
    return 1 - 2 * static_cast<double>(common) / static_cast<double>(a.total + b.total);
}

double editDistanceByGrams(const PqGrams& a, const PqGrams& b)
{
    return std::max(0.0, 0.90 * pqGramDistance(a, b) - 0.017);
}

double overlaidDistance(const LabelledTree& a, const LabelledTree& b)
{
    const double size = static_cast<double>(a.size()) + b.size();
    if (a.size() == 0 || b.size() == 0)
        return size > 0 ? 1 : 0;
    const ChildLists childrenOfA = childrenOf(a);
    const ChildLists childrenOfB = childrenOf(b);
    std::uint32_t laid = 0;
    std::uint32_t relabelled = 0;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> pending{{0, 0}};
    std::vector<std::uint32_t> best; // of what is left of both sequences of children
    while (!pending.empty())
    {
        const auto [x, y] = pending.back();
        pending.pop_back();
        ++laid;
        relabelled += a.labels[x] != b.labels[y] ? 1 : 0;
        const std::span<const std::uint32_t> ofX = childrenOfA.of(x);
        const std::span<const std::uint32_t> ofY = childrenOfB.of(y);
        const auto m = static_cast<std::uint32_t>(ofX.size());
        const auto n = static_cast<std::uint32_t>(ofY.size());
        if (m == 0 || n == 0)
            continue;
        const auto worth = [&](std::uint32_t i, std::uint32_t k) {
            return a.labels[ofX[i]] == b.labels[ofY[k]] ? 3u : 1u;
        };
        const auto cell = [&](std::uint32_t i, std::uint32_t k) -> std::uint32_t& { return best[i * (n + 1) + k]; };
        best.assign(std::size_t{m + 1} * (n + 1), 0);
        for (std::uint32_t i = m; i-- > 0;)
            for (std::uint32_t k = n; k-- > 0;)
                cell(i, k) = std::max({cell(i + 1, k), cell(i, k + 1), cell(i + 1, k + 1) + worth(i, k)});
        for (std::uint32_t i = 0, k = 0; i < m && k < n;)
        {
            if (cell(i, k) == cell(i + 1, k + 1) + worth(i, k))
                pending.emplace_back(ofX[i++], ofY[k++]);
            else
                cell(i, k) == cell(i + 1, k) ? ++i : ++k;
        }
    }
    return (size - 2.0 * laid + relabelled) / size;
}

double estimatedEditDistance(const OutlinedTree& a, const OutlinedTree& b)
{
    return std::sqrt(editDistanceByGrams(a.grams, b.grams) * overlaidDistance(a.tree, b.tree));
}

} // namespace espalier
