#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace espalier {

/// "No parent": of a root.
inline constexpr std::uint32_t kNoParent = 0xffffffffu;

/// The children of every node of a forest, flat, each in the order of its index.
struct ChildLists
{
    std::vector<std::uint32_t> first; ///< Of each node's children, in `all`; one more than there are nodes.
    std::vector<std::uint32_t> all;

    [[nodiscard]] std::uint32_t count(std::uint32_t node) const { return first[node + 1] - first[node]; }
    [[nodiscard]] std::span<const std::uint32_t> of(std::uint32_t node) const
    {
        return std::span(all).subspan(first[node], count(node));
    }
    [[nodiscard]] std::span<std::uint32_t> of(std::uint32_t node)
    {
        return std::span(all).subspan(first[node], count(node));
    }
};

/// `parents[i]` is the parent of node i, anywhere in the array, or kNoParent. Linear time.
[[nodiscard]] inline ChildLists childListsOf(std::span<const std::uint32_t> parents)
{
    ChildLists lists;
    lists.first.assign(parents.size() + 1, 0);
    for (const std::uint32_t parent : parents)
        if (parent != kNoParent)
            ++lists.first[parent + 1];
    for (std::size_t i = 0; i < parents.size(); ++i)
        lists.first[i + 1] += lists.first[i];
    lists.all.resize(lists.first.back());
    std::vector<std::uint32_t> next(lists.first.begin(), lists.first.end() - 1);
    for (std::uint32_t i = 0; i < parents.size(); ++i)
        if (parents[i] != kNoParent)
            lists.all[next[parents[i]]++] = i;
    return lists;
}

} // namespace espalier
