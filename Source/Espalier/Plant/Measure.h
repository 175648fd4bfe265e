#pragma once

#include <cstdint>

namespace espalier {

struct Skeleton;

/// What `espalier measure` reports of one skeleton.
struct SkeletonFacts
{
    std::uint32_t segments = 0;
    double totalLength = 0;      ///< Metres.
    std::uint32_t tips = 0;      ///< Segment ends that nothing grows from.
    std::uint32_t forks = 0;     ///< Points where two or more segments start, the base included.
    std::uint32_t maxDepth = 0;  ///< Most segments from base to tip.
    double minY = 0;             ///< Metres; also over positions moved to.
    double maxY = 0;             ///< Metres.
    double maxRadius = 0;        ///< Largest distance from the Y axis, metres.
    std::uint32_t strahler = 0;  ///< Horton-Strahler number; 0 for an empty skeleton.
    std::uint32_t instances = 0; ///< Template instances.
};

/// Linear time. Segments that start at the base with no parent are counted as a fork at the base if there are several;
/// `strahler` is then that of a node carrying them all.
[[nodiscard]] SkeletonFacts measure(const Skeleton& skeleton);

} // namespace espalier
