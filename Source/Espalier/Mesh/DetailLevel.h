#pragma once

#include <Espalier/Mesh/Thinning.h>

namespace espalier {

/// Levels of detail that a chain can have beyond the full plant.
inline constexpr std::uint32_t kMostDetailLevel = 12;

/// Memory that meshing a level needs in between. One per thread.
struct DetailScratch
{
    ThinningScratch thinning;
    MeshScratch mesh;
    Skeleton thinned;
    TreeMesh trial; ///< Wood and shapes of the error that is tried.
    TreeMesh best;  ///< Those of the smallest error so far that comes to few enough triangles.
};

/// A mesh of less detail, and how coarse it is.
struct DetailLevel
{
    MeshResult result = MeshResult::Ok;
    float error = 0; ///< Metres, as thinSkeleton has it: the level takes over where this is about a pixel.
};

/// Appends level `level` of a plant to `mesh`, which must be empty: 0 is the full plant, each further one has at most
/// 1 / 2^level of its triangles. Its error is the smallest that comes to so few, to 2
/// %; it never falls from one level to the next. Where even the bare trunk has more, the level is that. `level` is at
/// most kMostDetailLevel.
///
/// The species' foliage stands on the full plant at every level, and is thinned by itself (meshLeaves): so the crown
/// keeps its leaves when twigs go. Sources name segments and organs of the full plant.
///
/// Time: that of some ten meshes without foliage, most of them coarse; leaves are counted until the error is known.
/// Equal input gives equal bytes. Safe to call concurrently on different meshes and
/// scratches.
[[nodiscard]] DetailLevel meshDetailLevel(const Skeleton& full, const Appearance& appearance, std::uint32_t level,
                                          const MeshSettings& settings, const Limits& limits, DetailScratch& scratch,
                                          TreeMesh& mesh);

} // namespace espalier
