#pragma once

#include <Espalier/Core/Random.h>
#include <Espalier/Inference/Limbs.h>
#include <Espalier/Inference/TreeDistance.h>
#include <cstdint>
#include <vector>

namespace espalier {

/// A tree that a choice of classes and weight grows, as the limbs that stand in it.
struct SimulatedTree
{
    LabelledTree shape;         ///< A node for each instance, labelled by its template; depth first.
    std::uint32_t segments = 0; ///< Of all instances.
    std::uint32_t depth = 0;    ///< Nested instances.
    std::uint64_t topology = 0; ///< Equal for equal templates at equal anchors.
    bool whole = true;          ///< False if it was left because it grew too large.

    void clear();
};

/// Grows trees by exchanging kin, without a grammar: as likely as the grammar of the same classes grows them, but not
/// seed by seed the same, and some ten times as fast. What a choice comes to can so be found out by trying.
class KinSimulation
{
public:
    /// `draws[t]` is the number of segments that template t draws; `anchors[t]` that of its anchors. All arguments must
    /// outlive it.
    KinSimulation(const LimbTable& limbs, const KinClasses& classes, const std::vector<std::uint32_t>& draws,
                  const std::vector<std::uint32_t>& anchors);

    /// The tree of `seed` where kin are exchanged with chance `weight`; the drawn trees take turns as its beginning,
    /// each as often as it counts.
    /// Leaves off beyond `mostSegments` segments.
    void grow(Seed seed, double weight, std::uint32_t mostSegments, SimulatedTree& tree);

    /// Drawn tree number `index`.
    void drawn(std::size_t index, SimulatedTree& tree);

private:
    struct Pending
    {
        std::uint32_t limb;
        std::uint32_t parent; ///< Node of the tree.
        std::uint32_t depth;
    };

    void growFrom(std::uint32_t root, std::uint32_t mostSegments, SimulatedTree& tree);
    [[nodiscard]] bool exchanges();
    [[nodiscard]] std::uint32_t kinOf(std::uint32_t limb);
    [[nodiscard]] std::uint32_t childAt(std::uint32_t limb, std::uint32_t anchor) const;

    const LimbTable& limbs_;
    const KinClasses& classes_;
    const std::vector<std::uint32_t>& draws_;
    const std::vector<std::uint32_t>& anchors_;
    std::vector<std::uint32_t> turns_;       ///< The drawn trees in the order in which they begin.
    std::vector<std::uint32_t> members_;     ///< The limbs of all classes, each as often as it was drawn.
    std::vector<std::uint32_t> firstMember_; ///< Of each class, into `members_`; one more than there are classes.
    std::vector<Pending> pending_;
    RandomKey key_{Seed{}};
    std::uint32_t counter_ = 0;
    std::uint64_t threshold_ = 0; ///< Of 2^53: below it, kin are exchanged.
};

} // namespace espalier
