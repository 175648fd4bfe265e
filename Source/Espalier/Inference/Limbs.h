#pragma once

#include <Espalier/Archetype/Archetype.h>
#include <cstdint>
#include <string>
#include <vector>

namespace espalier {

/// A branch with everything it carries, as it occurs one or more times in the drawn trees: equal limbs are one.
struct Limb
{
    std::uint32_t piece = 0;      ///< Template of its first instance.
    std::uint32_t firstChild = 0; ///< Into LimbTable::children; as many as the template has anchors.
    std::uint32_t count = 0;      ///< Occurrences in the drawn trees.
    std::uint32_t segments = 0;
    std::uint32_t height = 1; ///< Nested template instances.
    InstanceTransform transform;
};

/// The distinct limbs, in the order of their first occurrence (depth first, parents before children).
struct LimbTable
{
    std::vector<Limb> limbs;
    std::vector<std::uint32_t> children; ///< Limbs; kNoInstance at an open anchor.
    std::vector<std::uint32_t> roots;    ///< The limb that is each whole tree.
    std::vector<std::uint32_t> limbOf;   ///< The limb that begins with each instance of the drawn trees.
};

/// Hash-consing, linear time: limbs are equal if template, transform (to the bit) and children are.
/// `draws[t]` is the number of segments that template t draws.
[[nodiscard]] LimbTable shareLimbs(const Archetype& exemplars, const AnchorTable& anchors,
                                   const std::vector<std::uint32_t>& draws);

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
};

/// Levels from the finest to the coarsest.
[[nodiscard]] const std::vector<KinLevel>& kinLevels();

/// `totalSegments`: size of a whole drawn tree.
[[nodiscard]] KinClasses classify(const LimbTable& limbs, const KinLevel& level, double totalSegments);

} // namespace espalier
