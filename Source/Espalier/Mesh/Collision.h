#pragma once

#include <Espalier/Mesh/ConvexHull.h>
#include <Espalier/Mesh/TubeMesher.h>
#include <Espalier/Plant/Skeleton.h>
#include <cstdint>
#include <vector>

namespace espalier {

// Shapes that physics engines take in place of a tree mesh. Plant space: metres, Y up.

/// All places within `radius` of the line from `from` to `to`.
struct Capsule
{
    Vec3 from{0};     ///< Metres; towards the base.
    Vec3 to{0};       ///< Metres.
    float radius = 0; ///< Metres, > 0.

    friend bool operator==(const Capsule&, const Capsule&) = default;
};

/// How wood becomes capsules. Settings outside their ranges are clamped.
struct CapsuleSettings
{
    std::uint32_t mostCapsules = 32; ///< [1, 65536]
    float tolerance = 0.06f;         ///< Metres that a capsule's side may stand off the wood in it. [0, 100]
    float thinnest = 0.02f;          ///< Metres: segments that start with a smaller radius are left out. [0, 100]
};

/// Capsules over the thick wood of one plant, the largest first.
struct Capsules
{
    std::vector<Capsule> capsules;
    float gap = 0; ///< Metres: the farthest that the side of one stands off its wood: the tolerance or less, unless
                   ///< a segment tapers by more than 64 of it.
    float volumeShare = 0; ///< Of all wood, what lies in them whole. [0, 1]

    void clear() noexcept;

    friend bool operator==(const Capsules&, const Capsules&) = default;
};

/// Why there is no shape; it is then empty.
enum class CollisionResult : std::uint8_t
{
    Ok,
    EmptySkeleton,   ///< It has no wood, or none as thick as asked for.
    UnsoundSkeleton, ///< Not isSound, or a coordinate beyond Limits::coordinate.
    NoVolume,        ///< All points of the crown lie in a plane.
    BudgetTooSmall,  ///< The barest trunk has more triangles.
};

/// What to tell people: "it has no wood thick enough". Empty for Ok.
[[nodiscard]] std::string_view reasonOf(CollisionResult result) noexcept;

/// Memory that collision shapes need in between; reuse it and nothing is allocated after warm-up. One per thread.
struct CollisionScratch
{
    struct Run
    {
        Capsule capsule;
        float gap = 0;
        double volume = 0;        ///< Cubic metres of wood.
        std::uint32_t number = 0; ///< In the order of the skeleton.
    };
    struct Axis
    {
        std::uint32_t segment = 0; ///< Its first.
        float size = 0;            ///< Extent times radius, at most that of its parent: square metres.
    };
    std::vector<Run> runs;
    std::vector<std::uint32_t> chain;
    std::vector<Vec3> points;
    std::vector<Axis> axes;
    std::vector<std::uint32_t> axisOf; ///< Of each segment.
    std::vector<std::uint32_t> rankOf; ///< Of each axis: its place among all by size.
    std::vector<std::uint32_t> prunedOf;
    std::vector<std::uint32_t> order;
    std::vector<std::uint8_t> isCrown;   ///< Of each segment.
    std::vector<std::uint32_t> first;    ///< Of each vertex: the first in the same place.
    std::vector<std::uint32_t> numberOf; ///< Of each vertex: its number in the shape.
    HullScratch hull;
    TubeScratch tubes;
    Skeleton pruned;
    TreeMesh mesh;
};

/// Fills `shape` with capsules. Runs of segments along an axis become one as long as it holds them and its side stands
/// off the wood by no more than the tolerance: of each run the longest, from the base on. Then those with the most wood
/// are kept. Each holds the tapering wood between its ends whole; its round ends reach a radius beyond. More capsules
/// never hold less wood.
///
/// Segments thicker at their end than at their start count by the start. Equal input gives equal bytes. Safe to call
/// concurrently on different scratches.
[[nodiscard]] CollisionResult woodCapsules(const Skeleton& skeleton, const CapsuleSettings& settings,
                                           CollisionScratch& scratch, Capsules& shape);

/// Fills `hull` with a convex hull of the crown, of at most `mostVertices` vertices: of all boughs, twigs and shapes,
/// and of the trunk from where its first bough leaves; of all if there is no bough. Within ConvexHull::tolerance it
/// holds every end of a segment, corner of a polygon, centre of a sphere and both ends of organs.
[[nodiscard]] CollisionResult crownHull(const Skeleton& skeleton, std::uint32_t mostVertices, CollisionScratch& scratch,
                                        ConvexHull& hull);

/// A closed surface of triangles that share their corners.
struct CollisionMesh
{
    std::vector<Vec3> vertices;         ///< Metres; no two alike.
    std::vector<std::uint32_t> indices; ///< Three a triangle, counter-clockwise seen from outside.
    std::uint32_t axes = 0;             ///< That it shows; the largest.

    void clear() noexcept;

    friend bool operator==(const CollisionMesh&, const CollisionMesh&) = default;
};

/// How wood becomes a coarse mesh. Settings outside their ranges are clamped.
struct CollisionMeshSettings
{
    std::uint32_t mostTriangles = 500; ///< [12, 16 Mi]
    float tolerance = 0.03f; ///< Metres by which corners of axes may be cut, and facets stand off. [1e-4, 100]
    float thinnest = 0.02f;  ///< Metres: branches that start with a smaller radius are left out. [0, 100]
};

/// Fills `shape` with closed tubes of few sides: the trunk and as many of the largest branches, parents first, as the
/// budget holds. Tubes of a fork pass into each other. Where even the trunk has too many triangles its corners are cut
/// more and more.
[[nodiscard]] CollisionResult collisionMesh(const Skeleton& skeleton, const CollisionMeshSettings& settings,
                                            CollisionScratch& scratch, CollisionMesh& shape);

} // namespace espalier
