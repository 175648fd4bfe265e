// Based on: Zhang & Shasha, "Simple fast algorithms for the editing distance between trees and related problems", 1989.
// Departures, none of which changes a distance:
// - What is computed is the gain of two forests: their sizes less their distance. Next to nothing it is 0, and the
//   recurrence is the greatest of three numbers with nothing to add from node to node, so that a row goes through
//   registers several nodes at once.
// - Keyroots with equal subtrees have equal distances, which are copied. Plants repeat their twigs.
// - Both trees are read from the right where that is less work: mirrored trees are as far apart.

#include <Espalier/Inference/TreeDistance.h>

#include <Espalier/Core/Simd.h>
#include <algorithm>
#include <cstring>
#include <limits>
#include <numeric>
#include <type_traits>
#include <utility>

namespace espalier {

namespace {

/// From which side the children of each node are read.
enum class Reading
{
    FromLeft,
    FromRight,
};

/// The highest of all nodes that have one first leaf.
struct KeyRoot
{
    std::uint32_t node;
    std::uint32_t twin;  ///< Index of the first keyroot with an equal subtree; its own if it is that one.
    std::uint32_t spine; ///< The nodes with this first leaf, rising: where they begin in PostOrder::spines,
    std::uint32_t spineEnd;
};

/// What the recurrence needs of a tree: nodes numbered in postorder.
struct PostOrder
{
    std::vector<std::uint32_t> labels;
    std::vector<std::uint32_t> firstLeaf; ///< The first leaf below each node.
    std::vector<KeyRoot> keyRoots;        ///< Rising.
    std::vector<std::uint32_t> spines;    ///< Of all keyroots.
    double steps = 0;                     ///< Nodes of the keyroots' subtrees, without those that have a twin.

    [[nodiscard]] std::uint32_t size() const noexcept { return static_cast<std::uint32_t>(labels.size()); }
    [[nodiscard]] std::uint32_t sizeOf(std::uint32_t node) const { return node - firstLeaf[node] + 1; }
};

bool areEqual(const PostOrder& order, std::uint32_t a, std::uint32_t b)
{
    const std::uint32_t size = order.sizeOf(a);
    if (order.sizeOf(b) != size)
        return false;
    for (std::uint32_t back = 0; back < size; ++back)
        if (order.labels[a - back] != order.labels[b - back] || order.sizeOf(a - back) != order.sizeOf(b - back))
            return false;
    return true;
}

/// `hashes`, of each keyroot, are equal for equal subtrees; what has an equal one is compared.
void findTwins(PostOrder& order, const std::vector<std::uint64_t>& hashes)
{
    std::vector<std::uint32_t> roots(hashes.size());
    std::iota(roots.begin(), roots.end(), 0u);
    std::ranges::sort(
        roots, [&](std::uint32_t a, std::uint32_t b) { return std::pair(hashes[a], a) < std::pair(hashes[b], b); });
    for (std::size_t i = 0, first = 0; i < roots.size(); ++i)
    {
        if (hashes[roots[i]] != hashes[roots[first]])
            first = i;
        if (areEqual(order, order.keyRoots[roots[first]].node, order.keyRoots[roots[i]].node))
            order.keyRoots[roots[i]].twin = roots[first];
    }
}

PostOrder postOrderOf(const LabelledTree& tree, Reading reading)
{
    const std::uint32_t size = tree.size();
    // Of each subtree: its nodes, those of siblings to the left of it, and a hash.
    std::vector<std::uint32_t> sizes(size, 1);
    std::vector<std::uint32_t> offsets(size, 0);
    constexpr std::uint64_t kOdd = 0x9e3779b97f4a7c15u;
    std::vector<std::uint64_t> hashes;
    for (const std::uint32_t label : tree.labels)
        hashes.push_back((label + std::uint64_t{1}) * kOdd);
    for (std::uint32_t node = size; node-- > 1;)
    {
        const std::uint32_t parent = tree.parents[node];
        sizes[parent] += sizes[node];
        hashes[parent] = (hashes[parent] + (hashes[node] ^ hashes[node] >> 31)) * kOdd;
        hashes[parent] ^= hashes[parent] >> 29;
    }
    std::vector<std::uint32_t> next(size, 0);
    for (std::uint32_t node = 1; node < size; ++node)
        offsets[node] = std::exchange(next[tree.parents[node]], next[tree.parents[node]] + sizes[node]);

    // A subtree stands in postorder from where it begins, its root last.
    PostOrder order;
    order.labels.resize(size);
    order.firstLeaf.resize(size);
    std::vector<std::uint32_t> begins(size, 0);
    std::vector<std::uint32_t> nodeAt(size);
    for (std::uint32_t node = 0; node < size; ++node)
    {
        if (node > 0)
        {
            const std::uint32_t parent = tree.parents[node];
            begins[node] =
                begins[parent] +
                (reading == Reading::FromLeft ? offsets[node] : sizes[parent] - 1 - offsets[node] - sizes[node]);
        }
        const std::uint32_t place = begins[node] + sizes[node] - 1;
        order.labels[place] = tree.labels[node];
        order.firstLeaf[place] = begins[node];
        nodeAt[place] = node;
    }
    // Nodes by their first leaf.
    std::vector<std::uint32_t> ends(size + 1, 0);
    for (const std::uint32_t leaf : order.firstLeaf)
        ++ends[leaf + 1];
    std::partial_sum(ends.begin(), ends.end(), ends.begin());
    order.spines.resize(size);
    std::vector<std::uint64_t> rootHashes;
    next.assign(ends.begin(), ends.end() - 1);
    for (std::uint32_t place = 0; place < size; ++place)
    {
        const std::uint32_t leaf = order.firstLeaf[place];
        order.spines[next[leaf]++] = place;
        if (next[leaf] < ends[leaf + 1])
            continue;
        const auto index = static_cast<std::uint32_t>(order.keyRoots.size());
        order.keyRoots.push_back({place, index, ends[leaf], ends[leaf + 1]});
        rootHashes.push_back(hashes[nodeAt[place]]);
    }
    findTwins(order, rootHashes);
    for (std::uint32_t i = 0; i < order.keyRoots.size(); ++i)
        if (order.keyRoots[i].twin == i)
            order.steps += order.sizeOf(order.keyRoots[i].node);
    return order;
}

/// Two trees read from the side that takes fewer steps.
struct ReadPair
{
    PostOrder x;
    PostOrder y;

    [[nodiscard]] double steps() const noexcept { return x.steps * y.steps; }
};

ReadPair read(const LabelledTree& a, const LabelledTree& b)
{
    constexpr std::uint64_t kFew = 2000; ///< Products of sizes: the second reading would take longer than it can save.
    ReadPair left{postOrderOf(a, Reading::FromLeft), postOrderOf(b, Reading::FromLeft)};
    if (std::uint64_t{a.size()} * b.size() <= kFew)
        return left;
    ReadPair right{postOrderOf(a, Reading::FromRight), postOrderOf(b, Reading::FromRight)};
    return right.steps() < left.steps() ? std::move(right) : std::move(left);
}

using EightShorts = std::int16_t __attribute__((vector_size(16)));

template <class Lanes>
Lanes larger(Lanes a, Lanes b)
{
    return a > b ? a : b;
}

/// Each lane, of numbers >= 0, the largest of its own and those before it.
EightShorts risen(EightShorts v)
{
    const EightShorts zero{};
    v = larger(v, __builtin_shufflevector(zero, v, 7, 8, 9, 10, 11, 12, 13, 14));
    v = larger(v, __builtin_shufflevector(zero, v, 6, 7, 8, 9, 10, 11, 12, 13));
    return larger(v, __builtin_shufflevector(zero, v, 4, 5, 6, 7, 8, 9, 10, 11));
}
simd::FourInts risen(simd::FourInts v)
{
    const simd::FourInts zero{};
    v = larger(v, __builtin_shufflevector(zero, v, 3, 4, 5, 6));
    return larger(v, __builtin_shufflevector(zero, v, 2, 3, 4, 5));
}

/// The last lane in all.
EightShorts lastOf(EightShorts v)
{
    return __builtin_shufflevector(v, v, 7, 7, 7, 7, 7, 7, 7, 7);
}
simd::FourInts lastOf(simd::FourInts v)
{
    return __builtin_shufflevector(v, v, 3, 3, 3, 3);
}

/// The gains of two trees, in registers of several of them. Rows are padded to whole registers: what then stands in the
/// padding is not read as anything else.
template <class Gain>
class GainTable
{
public:
    GainTable(const PostOrder& x, const PostOrder& y)
        : x_(x), y_(y), trees_(std::size_t{x.size()} * y.size() + kLanes),
          forests_((std::size_t{x.size()} + 1) * pitchOf(y.size()))
    {
        for (std::uint32_t k = 0; k < y.keyRoots.size(); ++k)
        {
            beginnings_.push_back(leaves_.size());
            if (y.keyRoots[k].twin != k)
                continue;
            const std::uint32_t node = y.keyRoots[k].node;
            const std::uint32_t first = y.firstLeaf[node];
            for (std::uint32_t v = first; v <= node; ++v)
                leaves_.push_back(static_cast<Place>(y.firstLeaf[v] - first));
            leaves_.resize(padded(leaves_.size()), Place{0});
        }
    }

    /// Of the whole trees.
    [[nodiscard]] std::uint32_t compute()
    {
        for (std::uint32_t i = 0; i < x_.keyRoots.size(); ++i)
        {
            if (x_.keyRoots[i].twin != i)
            {
                copyRows(x_.keyRoots[i], x_.keyRoots[x_.keyRoots[i].twin]);
                continue;
            }
            for (std::uint32_t k = 0; k < y_.keyRoots.size(); ++k)
                if (y_.keyRoots[k].twin != k)
                    copyColumns(x_.keyRoots[i], y_.keyRoots[k], y_.keyRoots[y_.keyRoots[k].twin]);
                else if (y_.sizeOf(y_.keyRoots[k].node) < kLanes)
                    fillNarrow(x_.keyRoots[i], y_.keyRoots[k], leaves_.data() + beginnings_[k]);
                else
                    fill(x_.keyRoots[i], y_.keyRoots[k], leaves_.data() + beginnings_[k]);
        }
        return static_cast<std::uint32_t>(rowOf(x_.size() - 1)[y_.size() - 1]);
    }

private:
    static constexpr std::size_t kLanes = 16 / sizeof(Gain);
    using Lanes = std::conditional_t<kLanes == 8, EightShorts, simd::FourInts>;
    using Place = std::make_unsigned_t<Gain>;

    static constexpr std::size_t padded(std::size_t width) { return (width + kLanes - 1) / kLanes * kLanes; }
    /// From one row of forests to the next: the column of nothing, and `width` more.
    static constexpr std::size_t pitchOf(std::size_t width) { return 1 + padded(width); }

    static Lanes load(const Gain* from)
    {
        Lanes lanes;
        std::memcpy(&lanes, from, sizeof(lanes));
        return lanes;
    }

    /// Of places in `row`. Loaded one by one: a gathering instruction is of no use to numbers so small.
    static Lanes gather(const Gain* row, const Place* places)
    {
        Lanes lanes;
        for (std::size_t lane = 0; lane < kLanes; ++lane)
            lanes[lane] = row[places[lane]];
        return lanes;
    }
    /// cur[v] = max(cur[v - 1], above[v], terms(v)).
    static void sweep(const auto& terms, const Gain* above, Gain* cur, std::size_t width)
    {
        Lanes last{};
        for (std::size_t v = 0; v < width; v += kLanes)
        {
            const Lanes here = larger(risen(larger(terms(v), load(above + v))), last);
            std::memcpy(cur + v, &here, sizeof(here));
            last = lastOf(here);
        }
    }

    [[nodiscard]] Gain* rowOf(std::uint32_t u) { return trees_.data() + std::size_t{u} * y_.size(); }

    void copyRows(const KeyRoot& to, const KeyRoot& from)
    {
        for (std::uint32_t s = 0; s < to.spineEnd - to.spine; ++s)
            std::copy_n(rowOf(x_.spines[from.spine + s]), y_.size(), rowOf(x_.spines[to.spine + s]));
    }
    void copyColumns(const KeyRoot& of, const KeyRoot& to, const KeyRoot& from)
    {
        for (std::uint32_t r = of.spine; r < of.spineEnd; ++r)
            for (std::uint32_t s = 0; s < to.spineEnd - to.spine; ++s)
                rowOf(x_.spines[r])[y_.spines[to.spine + s]] = rowOf(x_.spines[r])[y_.spines[from.spine + s]];
    }

    /// Between the nodes of two spines. `leaves`: of each node below `k`, the first leaf, counted from that of `k`.
    void fill(const KeyRoot& i, const KeyRoot& k, const Place* leaves)
    {
        const std::uint32_t firstX = x_.firstLeaf[i.node];
        const std::uint32_t firstY = y_.firstLeaf[k.node];
        const std::size_t width = y_.sizeOf(k.node);
        const std::size_t pitch = pitchOf(width);
        std::fill_n(forests_.data(), pitch, Gain{0});
        for (std::uint32_t u = firstX; u <= i.node; ++u)
        {
            const Gain* above = forests_.data() + (u - firstX) * pitch;
            Gain* cur = forests_.data() + (u - firstX + 1) * pitch;
            Gain* trees = rowOf(u) + firstY;
            cur[0] = 0;
            if (x_.firstLeaf[u] != firstX)
            {
                const Gain* before = forests_.data() + (x_.firstLeaf[u] - firstX) * pitch;
                sweep([&](std::size_t v) { return gather(before, leaves + v) + load(trees + v); }, above + 1, cur + 1,
                      width);
                continue;
            }
            // Before the subtree of `u` there is nothing. Where there is nothing before that of `v` either, both match.
            for (std::uint32_t s = k.spine; s < k.spineEnd; ++s)
            {
                const std::uint32_t v = y_.spines[s];
                trees[v - firstY] = static_cast<Gain>(above[v - firstY] + (x_.labels[u] == y_.labels[v] ? 2 : 1));
            }
            sweep([&](std::size_t v) { return load(trees + v); }, above + 1, cur + 1, width);
            for (std::uint32_t s = k.spine; s < k.spineEnd; ++s)
                trees[y_.spines[s] - firstY] = cur[y_.spines[s] - firstY + 1];
        }
    }

    /// The same node by node, for `k` that fill no register.
    void fillNarrow(const KeyRoot& i, const KeyRoot& k, const Place* leaves)
    {
        const std::uint32_t firstX = x_.firstLeaf[i.node];
        const std::uint32_t firstY = y_.firstLeaf[k.node];
        const std::size_t width = y_.sizeOf(k.node);
        const std::size_t pitch = width + 1;
        std::fill_n(forests_.data(), pitch, Gain{0});
        for (std::uint32_t u = firstX; u <= i.node; ++u)
        {
            const bool isSpine = x_.firstLeaf[u] == firstX;
            const Gain* before = forests_.data() + (x_.firstLeaf[u] - firstX) * pitch;
            const Gain* above = forests_.data() + (u - firstX) * pitch;
            Gain* cur = forests_.data() + (u - firstX + 1) * pitch;
            Gain* trees = rowOf(u) + firstY;
            Gain left = cur[0] = 0;
            for (std::size_t v = 0; v < width; ++v)
            {
                const bool match = isSpine && leaves[v] == 0;
                const int term =
                    match ? above[v] + (x_.labels[u] == y_.labels[firstY + v] ? 2 : 1) : before[leaves[v]] + trees[v];
                left = std::max({left, above[v + 1], static_cast<Gain>(term)});
                cur[v + 1] = left;
                if (match)
                    trees[v] = left;
            }
        }
    }

    const PostOrder& x_;
    const PostOrder& y_;
    std::vector<Gain> trees_;   ///< Of the subtrees of two nodes.
    std::vector<Gain> forests_; ///< Of what stands in two subtrees up to two nodes.
    std::vector<Place> leaves_;
    std::vector<std::size_t> beginnings_; ///< Of each keyroot in `leaves_`.
};

} // namespace

double editSteps(const LabelledTree& a, const LabelledTree& b)
{
    return a.size() == 0 || b.size() == 0 ? 0 : read(a, b).steps();
}

std::uint32_t editDistance(const LabelledTree& a, const LabelledTree& b)
{
    const std::uint64_t size = std::uint64_t{a.size()} + b.size();
    if (a.size() == 0 || b.size() == 0)
        return static_cast<std::uint32_t>(size);
    const ReadPair pair = read(a, b);
    const std::uint32_t gain = size <= std::numeric_limits<std::int16_t>::max()
                                   ? GainTable<std::int16_t>(pair.x, pair.y).compute()
                                   : GainTable<std::int32_t>(pair.x, pair.y).compute();
    return static_cast<std::uint32_t>(size - gain);
}

double normalisedEditDistance(const LabelledTree& a, const LabelledTree& b)
{
    const double size = static_cast<double>(a.size()) + b.size();
    return size == 0 ? 0 : editDistance(a, b) / size;
}

} // namespace espalier
