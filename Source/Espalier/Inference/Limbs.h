#pragma once

#include <Espalier/Archetype/Archetype.h>
#include <Espalier/Archetype/Mirror.h>
#include <compare>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace espalier {

/// Which way a limb leaves the place where it hangs, degrees. It belongs to the place: whatever is grafted there grows
/// in the direction of what was drawn there.
struct LimbDirection
{
    double rotation = 0;
    double roll = 0;

    friend auto operator<=>(const LimbDirection&, const LimbDirection&) = default;
};

/// A branch with everything it carries, whichever way it points, as it occurs one or more times in the drawn trees:
/// equal limbs are one.
struct Limb
{
    std::uint32_t piece = 0;      ///< Template of its first instance,
    std::uint32_t kind = 0;       ///< and the first template of that one's kind (kindsOf).
    std::uint32_t firstChild = 0; ///< Into LimbTable::children; as many as the template has anchors.
    std::uint32_t count = 0;      ///< Occurrences in the drawn trees, each as often as its tree counts.
    std::uint32_t segments = 0;
    std::uint32_t height = 1;        ///< Nested template instances.
    double scaling = 1;              ///< Of its first instance.
    double branchingAngle = 0;       ///< Likewise, degrees.
    std::uint32_t drawn = 0;         ///< Occurrences in the drawn trees; 0: only their mirror images have it.
    SkySide side = SkySide::Neither; ///< Where mirror images count too: what stands for it must look to the sky alike.
    bool isUpright = true;           ///< So stands each that was drawn.
    /// Likewise: the branching angle of a word that begins with a turn without a number of its own. A mirrored place's
    /// rotation makes up for the turn of what was drawn there, and would point what turns otherwise elsewhere.
    double firstTurn = 0;
    std::uint32_t observations = 0; ///< As `count`, but without mirror images.
};

/// What hangs at a place.
struct LimbUse
{
    std::uint32_t limb = 0; ///< kNoInstance at an open anchor.
    LimbDirection direction;

    friend auto operator<=>(const LimbUse&, const LimbUse&) = default;
};

/// The distinct limbs, in the order of their first occurrence (depth first, parents before children).
struct LimbTable
{
    std::vector<Limb> limbs;
    std::vector<LimbUse> children;
    std::vector<LimbUse> roots;             ///< The whole trees.
    std::vector<std::uint32_t> rootWeights; ///< How often each counts.
    std::vector<std::uint32_t> limbOf;      ///< The limb that begins with each instance of the drawn trees.
    std::uint32_t drawnInstances = 0;       ///< That are no mirror images; these follow.
};

/// Hash-consing, linear time: limbs are equal if template, scaling, branching angle (to the bit) and all that they
/// carry are. `draws[t]` is the number of segments that template t draws; `weights` says how often each tree counts,
/// empty: once. `stances` are those of the instances; empty: nothing stands upright. With `mirrored`, the second half
/// of the instances are mirror images of the first, and limbs differ by their side.
[[nodiscard]] LimbTable shareLimbs(const Archetype& exemplars, const AnchorTable& anchors,
                                   const std::vector<std::uint32_t>& draws, std::span<const std::uint32_t> weights = {},
                                   std::span<const Stance> stances = {}, bool mirrored = false);

/// Segments drawn by each template of a library.
[[nodiscard]] std::vector<std::uint32_t> segmentsDrawn(const TemplateLibrary& library);

/// How coarsely limbs are classed. Bands are logarithmic.
struct KinLevel
{
    double sizeBase = 0;   ///< Size band: floor(log_base(0.999 size / total)); 0: none.
    double heightBase = 0; ///< Height band: floor(log_base height); 0: none.
    bool anchors = false;  ///< Also exchange the occupants of the same anchor of kin parents, open ones included.

    friend bool operator==(const KinLevel&, const KinLevel&) = default;
};

/// Which limbs may stand for each other.
struct KinClasses
{
    KinLevel level;
    double weight = 0;                           ///< Chance that a drawn branch is replaced by one of its kin.
    std::vector<std::uint32_t> classOf;          ///< Of each limb; numbered by first occurrence.
    std::vector<std::vector<std::uint32_t>> kin; ///< The limbs of each class.
    std::vector<std::uint32_t> occurrences;      ///< Of each class, counted with multiplicity.
    /// Of each class, the lengths of the runs in `kin` that share a rule; empty: each limb has a rule of its own.
    std::vector<std::vector<std::uint32_t>> runs;
};

/// Levels from the finest to the coarsest, as they are tried.
[[nodiscard]] const std::vector<KinLevel>& kinLevels();

/// The same in the order of how freely they let branches stand for each other: those that exchange the occupants of
/// anchors too come last.
[[nodiscard]] std::vector<KinLevel> kinLevelsByFreedom();

/// `totalSegments`: size of a whole drawn tree.
[[nodiscard]] KinClasses classify(const LimbTable& limbs, const KinLevel& level, double totalSegments);

/// What hangs at the anchors of a limb; as many as its template has.
[[nodiscard]] std::span<const LimbUse> loadOf(const LimbTable& limbs, std::uint32_t limb);

/// Calls function(number of the first limb, length) for each run of a class, in order.
template <class Function>
void forEachRun(const KinClasses& classes, std::uint32_t c, Function&& function)
{
    const auto size = static_cast<std::uint32_t>(classes.kin[c].size());
    for (std::uint32_t first = 0, run = 0; first < size; ++run)
    {
        const std::uint32_t length = classes.runs.empty() ? 1 : classes.runs[c][run];
        function(first, length);
        first += length;
    }
}

/// What it takes to tell one of so many from the others.
[[nodiscard]] double bitsOf(double choices);

/// What a description of limbs in rules takes, in bits: each name as if all names of its kind were equally likely.
struct DescriptionLength
{
    double classes = 0;   ///< Of the name of one of the classes.
    double open = 1;      ///< Whether an anchor is open.
    double direction = 0; ///< Of a place's direction, one of those drawn.

    [[nodiscard]] static DescriptionLength of(const LimbTable& limbs, const KinClasses& classes);

    /// Of all that a limb carries.
    [[nodiscard]] double load(const LimbTable& limbs, const KinClasses& classes, std::uint32_t limb) const;

    /// What is saved if the `length` limbs from `first` on of class `c` share a rule, in which a range of rows takes
    /// the place of one row: all but one of the rules' names, loads and numbers. Negative: it costs more than it saves.
    [[nodiscard]] double gainOfRun(const LimbTable& limbs, const KinClasses& classes, std::uint32_t c,
                                   std::uint32_t first, std::uint32_t length) const;
};

/// Brings limbs of a class together that carry the same, occur equally often, and differ by their scaling and branching
/// angle alone, and makes runs of them where that shortens the description. Limbs keep the order of their first
/// occurrence otherwise. Nothing is lost: each limb is a row of its run.
void runAlikeLimbs(const LimbTable& limbs, KinClasses& classes);

} // namespace espalier
