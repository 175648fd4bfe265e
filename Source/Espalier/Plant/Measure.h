#pragma once

#include <cstdint>
#include <span>
#include <vector>

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

/// Horton's streams as Strahler orders them (Strahler, "Quantitative analysis of watershed geomorphology", 1957): an
/// unbranched run of segments of equal order is one. Entry i counts the streams of order i + 1; empty for an empty
/// skeleton.
[[nodiscard]] std::vector<std::uint32_t> strahlerStreams(const Skeleton& skeleton);

/// How many streams of one order come on one of the next: from the regression of log(count) on the order (Horton,
/// "Erosional development of streams", 1945). 1 where there are fewer than two orders.
[[nodiscard]] double bifurcationRatio(std::span<const std::uint32_t> streams);

/// What the segments of plants are like, pooled; one entry for each segment, or each lateral branch.
struct BranchMeasures
{
    std::vector<double> lengths;  ///< Metres; of all segments.
    std::vector<double> widths;   ///< Metres; start diameters of all segments.
    std::vector<double> angles;   ///< Degrees, [0, 180]; between a lateral branch and what it leaves, as each starts.
    std::vector<double> azimuths; ///< Degrees, [0, 360); round the axis that it leaves, from its left; of laterals that
                                  ///< leave it by more than half a degree.
};

/// Appends what every `stride`-th segment and lateral is like, beginning with number `offset`. Requires axes and radii
/// (completeAxes), and stride >= 1.
void appendBranchMeasures(const Skeleton& skeleton, std::uint32_t stride, std::uint32_t offset,
                          BranchMeasures& measures);

/// Adds the length of `skeleton` to `bins`, by the height of each segment's middle: bin i covers heights from i to
/// i + 1 times `binHeight`, metres; what lies below or above goes to the first or last. Requires at least one bin.
void addLengthByHeight(const Skeleton& skeleton, double binHeight, std::span<double> bins);

} // namespace espalier
