#pragma once

#include <Espalier/Core/Error.h>
#include <cstdint>
#include <vector>

namespace espalier {

struct Skeleton;

/// Two segments of one skeleton that cut into each other although they are not neighbours along it.
struct Overlap
{
    std::uint32_t first = 0;  ///< Segment index, lower than `second`.
    std::uint32_t second = 0; ///< Segment index.
    float depth = 0;          ///< Metres by which the two tapered capsules intersect, > 0.

    friend bool operator==(const Overlap&, const Overlap&) = default;
};

/// All overlaps of one skeleton, sorted by (first, second), each pair once.
struct OverlapReport
{
    std::vector<Overlap> overlaps;
    float deepest = 0; ///< Metres; 0 if there are none.

    friend bool operator==(const OverlapReport&, const OverlapReport&) = default;
};

/// What counts as an overlap.
struct OverlapSettings
{
    float tolerance = 0.001f;  ///< Metres of depth that are ignored: bark touches. [0, inf)

    /// Segments are neighbours, and never reported, if the path between them along the skeleton is no longer than this
    /// many times the larger of their radii; parent and child, and siblings at one fork, always are neighbours.
    float neighbourhood = 3.0f; ///< [0, 100]
};

/// Overlaps of `skeleton`, its segments taken as tapered capsules (the convex hull of two spheres of the start and end
/// radius). Embree finds the candidates, we test them exactly, so the answer does not depend on threads or CPU.
/// Depth is the largest of r1 + r2 - distance over the two axes. Fails with BadInput if a number of the skeleton is not
/// finite or an index is out of range: an unsound plant is refused, never passed as free of overlaps. Safe to call
/// concurrently.
[[nodiscard]] Expected<OverlapReport> findOverlaps(const Skeleton& skeleton, const OverlapSettings& settings = {});

/// The same answer from all pairs, in quadratic time: the reference that tests and benchmarks compare with.
[[nodiscard]] Expected<OverlapReport> findOverlapsBruteForce(const Skeleton& skeleton, const OverlapSettings& settings = {});

} // namespace espalier
