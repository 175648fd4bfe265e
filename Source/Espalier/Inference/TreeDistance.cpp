#include <Espalier/Inference/TreeDistance.h>

#include <algorithm>
#include <cstddef>
#include <iterator>

namespace espalier {

namespace {

/// What Zhang and Shasha's recurrence needs of a tree: nodes numbered in postorder.
struct PostOrder
{
    std::vector<std::uint32_t> labels;
    std::vector<std::uint32_t> firstLeaf; ///< The leftmost leaf below each node.
    std::vector<std::uint32_t> keyRoots;  ///< Nodes that no node with the same leftmost leaf is above, rising.
};

PostOrder postOrderOf(const LabelledTree& tree)
{
    const std::uint32_t size = tree.size();
    // Number of nodes below each, itself included, then postorder places: a subtree ends where it begins plus its size.
    std::vector<std::uint32_t> sizes(size, 1);
    for (std::uint32_t node = size; node-- > 1;)
        sizes[tree.parents[node]] += sizes[node];
    std::vector<std::uint32_t> begins(size, 0); // in postorder, of the subtree's first node
    std::vector<std::uint32_t> next(size, 0);   // where the next child's subtree begins
    for (std::uint32_t node = 1; node < size; ++node)
    {
        const std::uint32_t parent = tree.parents[node];
        begins[node] = next[parent];
        next[node] = begins[node];
        next[parent] += sizes[node];
    }
    PostOrder order;
    order.labels.resize(size);
    order.firstLeaf.resize(size);
    for (std::uint32_t node = 0; node < size; ++node)
    {
        const std::uint32_t place = begins[node] + sizes[node] - 1;
        order.labels[place] = tree.labels[node];
        order.firstLeaf[place] = begins[node];
    }
    std::vector<bool> isTaken(size, false);
    for (std::uint32_t place = size; place-- > 0;)
        if (!isTaken[order.firstLeaf[place]])
        {
            isTaken[order.firstLeaf[place]] = true;
            order.keyRoots.push_back(place);
        }
    std::ranges::reverse(order.keyRoots);
    return order;
}

} // namespace

std::uint32_t editDistance(const LabelledTree& a, const LabelledTree& b)
{
    if (a.size() == 0 || b.size() == 0)
        return a.size() + b.size();
    const PostOrder x = postOrderOf(a);
    const PostOrder y = postOrderOf(b);
    const std::size_t width = std::size_t{b.size()} + 1;
    std::vector<std::uint32_t> trees(std::size_t{a.size()} * b.size());      // between the subtrees of two nodes
    std::vector<std::uint32_t> forests((std::size_t{a.size()} + 1) * width); // between what precedes two nodes
    for (const std::uint32_t i : x.keyRoots)
        for (const std::uint32_t k : y.keyRoots)
        {
            const std::uint32_t firstX = x.firstLeaf[i];
            const std::uint32_t firstY = y.firstLeaf[k];
            const auto forest = [&](std::uint32_t untilX, std::uint32_t untilY) -> std::uint32_t& {
                return forests[std::size_t{untilX - firstX} * width + (untilY - firstY)];
            };
            forest(firstX, firstY) = 0;
            for (std::uint32_t u = firstX; u <= i; ++u)
                forest(u + 1, firstY) = forest(u, firstY) + 1;
            for (std::uint32_t v = firstY; v <= k; ++v)
                forest(firstX, v + 1) = forest(firstX, v) + 1;
            for (std::uint32_t u = firstX; u <= i; ++u)
                for (std::uint32_t v = firstY; v <= k; ++v)
                {
                    const std::uint32_t least = std::min(forest(u, v + 1), forest(u + 1, v)) + 1;
                    std::uint32_t& tree = trees[std::size_t{u} * b.size() + v];
                    if (x.firstLeaf[u] == firstX && y.firstLeaf[v] == firstY)
                    {
                        tree = std::min(least, forest(u, v) + (x.labels[u] != y.labels[v] ? 1 : 0));
                        forest(u + 1, v + 1) = tree;
                    }
                    else
                        forest(u + 1, v + 1) = std::min(least, forest(x.firstLeaf[u], y.firstLeaf[v]) + tree);
                }
        }
    return trees.back();
}

std::vector<std::uint64_t> pqGramsOf(const LabelledTree& tree)
{
    constexpr std::uint64_t kNull = 0xffff;
    const auto labelOf = [&](std::uint32_t node) { return std::uint64_t{tree.labels[node]} & 0xffff; };
    std::vector<std::uint64_t> grams;
    grams.reserve(2 * std::size_t{tree.size()});
    std::vector<std::uint64_t> left(tree.size(), kNull); // the last child seen
    const auto stemOf = [&](std::uint32_t node) {
        return (node == 0 ? kNull : labelOf(tree.parents[node])) << 48 | labelOf(node) << 32;
    };
    for (std::uint32_t node = 1; node < tree.size(); ++node)
    {
        const std::uint32_t parent = tree.parents[node];
        grams.push_back(stemOf(parent) | left[parent] << 16 | labelOf(node));
        left[parent] = labelOf(node);
    }
    for (std::uint32_t node = 0; node < tree.size(); ++node)
        grams.push_back(stemOf(node) | left[node] << 16 | kNull);
    std::ranges::sort(grams);
    return grams;
}

double pqGramDistance(const std::vector<std::uint64_t>& a, const std::vector<std::uint64_t>& b)
{
    if (a.empty() && b.empty())
        return 0;
    std::vector<std::uint64_t> common;
    std::ranges::set_intersection(a, b, std::back_inserter(common));
    return 1 - 2 * static_cast<double>(common.size()) / static_cast<double>(a.size() + b.size());
}

} // namespace espalier
