#pragma once

#include <cstddef>
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
/// parent, in its place. Time: editSteps; memory: 4 bytes times the product of the sizes, 8 beyond 32,767 nodes in all.
[[nodiscard]] std::uint32_t editDistance(const LabelledTree& a, const LabelledTree& b);

/// How often editDistance applies its recurrence: some two billion times a second for large trees. At worst the product
/// of the sizes times that of the depths; less where the heaviest children stand at one side, and where twigs are
/// equal. In time about linear.
[[nodiscard]] double editSteps(const LabelledTree& a, const LabelledTree& b);

/// The edit distance over the sum of both sizes, [0, 1].
[[nodiscard]] double normalisedEditDistance(const LabelledTree& a, const LabelledTree& b);

/// A tree's pq-grams, each different one with how often it occurs, in ascending order.
struct PqGrams
{
    struct Count
    {
        std::uint64_t gram;
        std::uint32_t count;
    };
    std::vector<Count> counts;
    std::uint64_t total = 0;
};

/// Counts pq-grams as a tree is walked, in any order. Of labels beyond 65,534 some count as equal.
class PqGramCounter
{
public:
    static constexpr std::uint32_t kNone = 0xffff; ///< The label of what is not there.

    PqGramCounter();
    /// `right` follows `left` among the children of `node`; both are kNone where it has none.
    void add(std::uint32_t parent, std::uint32_t node, std::uint32_t left, std::uint32_t right)
    {
        add({std::uint64_t{parent & 0xffff} << 48 | std::uint64_t{node & 0xffff} << 32 | (left & 0xffff) << 16 |
                 (right & 0xffff),
             1});
    }
    /// One that was counted elsewhere.
    void add(PqGrams::Count counted)
    {
        PqGrams::Count& slot = slotOf(counted.gram);
        const bool isNew = slot.count == 0;
        slot.gram = counted.gram;
        slot.count += counted.count;
        total_ += counted.count;
        if (isNew && 2 * ++used_ > slots_.size())
            widen();
    }
    /// What was counted; it then begins anew.
    [[nodiscard]] PqGrams take();
    void clear();

private:
    /// Where a gram is counted, or would be.
    [[nodiscard]] PqGrams::Count& slotOf(std::uint64_t gram)
    {
        const std::size_t last = slots_.size() - 1;
        std::size_t place = (gram * 0x9e3779b97f4a7c15u) >> 32 & last;
        while (slots_[place].count > 0 && slots_[place].gram != gram)
            place = (place + 1) & last;
        return slots_[place];
    }
    void widen();

    std::vector<PqGrams::Count> slots_; ///< A power of two of them, open addressing; 0 counted: empty.
    std::size_t used_ = 0;
    std::uint64_t total_ = 0;
};

/// The tree's pq-grams with p = q = 2 (Augsten, Boehlen & Gamper, "Approximate matching of hierarchical data using
/// pq-grams", 2005): parent and node over each pair of neighbouring children. Of labels beyond 65,534 some count as
/// equal.
[[nodiscard]] PqGrams pqGramsOf(const LabelledTree& tree);

/// Share of the pq-grams of two trees that they do not have in common, [0, 1]; in time linear in their different ones.
[[nodiscard]] double pqGramDistance(const PqGrams& a, const PqGrams& b);

/// The edit distance of two trees over the sum of their sizes, estimated from their pq-grams: a straight line fitted to
/// trees of 17 to 465 nodes (r = 0.96), up to 0.1 too low above 0.3, and more so the larger the trees are: what was
/// moved within a large tree leaves few grams changed. [0, 0.883]
[[nodiscard]] double editDistanceByGrams(const PqGrams& a, const PqGrams& b);

/// An upper bound of the edit distance over the sum of both sizes, in time about linear: the trees are laid over each
/// other from the root up, at each node the children of equal label in order, then those of other labels; nodes that
/// have no counterpart are deleted or inserted. (Selkow's edits, "The tree-to-tree editing problem", 1977, by the
/// labels of children alone.) [0, 1]
[[nodiscard]] double overlaidDistance(const LabelledTree& a, const LabelledTree& b);

/// A tree with its pq-grams, which may be those of a larger one of which it is the part next the root.
struct OutlinedTree
{
    LabelledTree tree;
    PqGrams grams;
};

/// The edit distance of two trees over the sum of their sizes, estimated in time about linear: the geometric mean of
/// what their pq-grams say, which is too little, and of laying them over each other, which is too much. Relatives of
/// 2,400 nodes whose distances are 0.36 to 0.39 have estimates of 0.29 to 0.30, by their pq-grams alone of 0.10 to
/// 0.13. [0, 1]
[[nodiscard]] double estimatedEditDistance(const OutlinedTree& a, const OutlinedTree& b);

} // namespace espalier
