#pragma once

#include <Espalier/Core/Error.h>
#include <cstdint>
#include <vector>

namespace espalier {

struct Skeleton;

/// Two segments of one skeleton that cut into each other although they are not neighbours along it.
///
/// Each is taken as a tapered capsule, the convex hull of two spheres of its start and end radius. That hull is the
/// union of the spheres round every point of its axis, so `depth` is the largest r1 + r2 - distance over all pairs of
/// such spheres, one of each capsule. Of plain cylinders' capsules it is how far they must move apart; of one capsule
/// inside another it is larger.
struct Overlap
{
    std::uint32_t first = 0;  ///< Segment index, lower than `second`.
    std::uint32_t second = 0; ///< Segment index.
    float depth = 0;          ///< Metres, > 0; exact but for rounding.

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
    float tolerance = 0.001f; ///< Metres of depth that are ignored: bark touches. [0, inf)

    /// Segments are neighbours, and never reported, if the path between them along the skeleton is no longer than this
    /// many times the largest of their radii: branches leave each other gradually. The path's length is that of the
    /// segments strictly between the two, so parent and child, and siblings at one fork, always are neighbours. [0,
    /// 100]
    float neighbourhood = 3.0f;

    std::uint32_t maxOverlaps = 1u << 20; ///< More is an error of kind Limit. [0, 2^28]
};

/// Overlaps of `skeleton`. Embree finds the candidates, in builds without it a tree of boxes; we test them exactly, so
/// the answer does not depend on threads, CPU or build. Fails with BadInput if a number of the skeleton is not finite,
/// beyond 1e15 or negative where it must not be, or an index is out of range: an unsound plant is refused, never passed
/// as free of overlaps. Safe to call concurrently. An empty skeleton has no overlaps.
///
/// Cost: n log n plus the pairs whose boxes touch, neighbours included; segments much shorter than they are thick have
/// many of these.
[[nodiscard]] Expected<OverlapReport> findOverlaps(const Skeleton& skeleton, const OverlapSettings& settings = {});

/// The same answer from all pairs, in quadratic time: the reference that tests and benchmarks compare with.
[[nodiscard]] Expected<OverlapReport> findOverlapsBruteForce(const Skeleton& skeleton,
                                                             const OverlapSettings& settings = {});

} // namespace espalier
