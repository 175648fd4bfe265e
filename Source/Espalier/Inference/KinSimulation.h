#pragma once

#include <Espalier/Core/Random.h>
#include <Espalier/Inference/Limbs.h>
#include <Espalier/Inference/TreeDistance.h>
#include <cstdint>
#include <vector>

namespace espalier {

/// What is kept of a tree that is grown. Of one of a million instances the shape takes longer to write down than to
/// grow.
enum class TreeRecord
{
    Shape,
    Outline, ///< The shape down to settled limbs, and the pq-grams of all.
};

/// A tree that a choice of classes and weight grows, as the limbs that stand in it.
struct SimulatedTree
{
    LabelledTree shape;         ///< A node for each instance, labelled by its template; depth first.
    PqGrams grams;              ///< Of an outline, if the tree is whole.
    std::uint32_t segments = 0; ///< Of all instances.
    std::uint32_t depth = 0;    ///< Nested instances.
    std::uint64_t topology = 0; ///< Equal for equal templates at equal anchors, in trees of one simulation.
    bool whole = true;          ///< False if it was left because it grew too large.

    void clear();
};

/// Grows trees by exchanging kin, without a grammar: as likely as the grammar of the same classes grows them, but not
/// seed by seed the same, and some ten times as fast. What a choice comes to can so be found out by trying.
class KinSimulation
{
public:
    /// `draws[t]` is the number of segments that template t draws; `anchors[t]` that of its anchors. Classes none
    /// of whose limbs has more than `settledSegments` segments are settled: their limbs are exchanged, but stand as
    /// they were drawn, with nothing exchanged in them. All arguments must outlive it.
    KinSimulation(const LimbTable& limbs, const KinClasses& classes, const std::vector<std::uint32_t>& draws,
                  const std::vector<std::uint32_t>& anchors, TreeRecord record = TreeRecord::Shape,
                  double settledSegments = 0);

    /// The tree of `seed` where kin are exchanged with chance `weight`; the drawn trees take turns as its beginning,
    /// each as often as it counts.
    /// Leaves off beyond `mostSegments` segments.
    void grow(Seed seed, double weight, std::uint32_t mostSegments, SimulatedTree& tree);

    /// The drawn tree that `seed` begins with.
    [[nodiscard]] std::uint32_t beginningOf(Seed seed) const noexcept { return turns_[seed.value % turns_.size()]; }

    /// Drawn tree number `index`.
    void drawn(std::size_t index, SimulatedTree& tree);

private:
    /// What is looked up of a limb wherever it stands, side by side.
    struct Place
    {
        std::uint32_t piece;       ///< The kind of its template (kindsOf): what trees are compared by.
        std::uint32_t firstChild;  ///< Into LimbTable::children.
        std::uint32_t firstMember; ///< Of its class, into `members_`.
        std::uint32_t members;
        std::uint32_t draws; ///< Segments of its first instance.
    };
    struct Pending
    {
        std::uint32_t limb;
        std::uint32_t parent; ///< Node of the tree; in a profile its label.
        std::uint32_t depth;
        bool settled; ///< Nothing is exchanged from here on.
    };

    /// What a settled limb adds to a tree besides its segments and its height, found out when it is first met.
    struct Profile
    {
        std::uint64_t topology = 0;
        std::vector<PqGrams::Count> grams; ///< Of all that it carries; its own depend on where it hangs.
    };

    template <TreeRecord record>
    void growFrom(std::uint32_t root, std::uint32_t mostSegments, SimulatedTree& tree);
    void growRecorded(std::uint32_t root, std::uint32_t mostSegments, SimulatedTree& tree);
    void countGrams(PqGramCounter& grams, std::uint32_t parent, std::uint32_t label, std::size_t firstPending) const;
    [[nodiscard]] const Profile& profileOf(std::uint32_t limb);
    void addSettled(std::uint32_t limb, std::uint32_t parent);
    [[nodiscard]] bool exchanges();
    [[nodiscard]] std::uint32_t kinOf(const Place& place);

    const LimbTable& limbs_;
    const std::vector<std::uint32_t>& anchors_;
    TreeRecord record_;
    bool exchangesAnchors_;
    std::vector<Place> places_;            ///< Of each limb.
    std::vector<bool> settled_;            ///< Likewise.
    std::vector<std::uint32_t> profileOf_; ///< Likewise, into `profiles_`; kNoProfile: not found out yet.
    std::vector<Profile> profiles_;
    std::vector<std::uint32_t> turns_;   ///< The drawn trees in the order in which they begin.
    std::vector<std::uint32_t> members_; ///< The limbs of all classes, each as often as it was drawn and may be taken.
    std::vector<Pending> pending_;
    PqGramCounter grams_;
    RandomKey key_{Seed{}};
    std::uint32_t counter_ = 0;
    std::uint64_t threshold_ = 0; ///< Of 2^53: below it, kin are exchanged.
};

} // namespace espalier
