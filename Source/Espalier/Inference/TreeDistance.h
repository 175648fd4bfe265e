#pragma once

#include <cstdint>
#include <vector>

namespace espalier {

/// An ordered tree whose nodes have labels. Node 0 is the root, parents come before children, and children stand in the
/// order of their indices.
struct LabelledTree
{
    std::vector<std::uint32_t> labels;
    std::vector<std::uint32_t> parents; ///< Lower than the own index; that of node 0 is not read.

    [[nodiscard]] std::uint32_t size() const noexcept { return static_cast<std::uint32_t>(labels.size()); }
};

/// Fewest nodes to delete, insert and relabel that make one tree the other (Zhang & Shasha, "Simple fast algorithms for
/// the editing distance between trees and related problems", 1989). A node that is deleted leaves its children to its
/// parent, in its place. Time: the product of the sizes times that of the depths, at worst; memory: 8 bytes times the
/// product of the sizes.
[[nodiscard]] std::uint32_t editDistance(const LabelledTree& a, const LabelledTree& b);

/// The tree's pq-grams with p = q = 2 (Augsten, Boehlen & Gamper, "Approximate matching of hierarchical data using
/// pq-grams", 2005): parent and node over each pair of neighbouring children, hashed and sorted.
[[nodiscard]] std::vector<std::uint64_t> pqGramsOf(const LabelledTree& tree);

/// Share of the pq-grams of two trees that they do not have in common, [0, 1]; in time linear in their number.
[[nodiscard]] double pqGramDistance(const std::vector<std::uint64_t>& a, const std::vector<std::uint64_t>& b);

} // namespace espalier
