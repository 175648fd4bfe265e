#pragma once

#include <Espalier/Mesh/Thinning.h>
#include <span>
#include <vector>

namespace espalier {

/// Levels of detail that a chain can have beyond the full plant.
inline constexpr std::uint32_t kMostDetailLevel = 12;

/// Memory that meshing levels needs in between; reuse it and nothing is allocated after warm-up. One per thread.
struct DetailScratch
{
    /// What one error comes to; levels of one plant share many.
    struct Trial
    {
        int step = 0;             ///< Stands for the error.
        std::uint64_t leaves = 0; ///< Indices.
        std::uint64_t bare = 0;   ///< Indices of wood and shapes, or as many as have been counted.
        bool isCounted = false;   ///< All of them have been.
        bool hasMesh = false;     ///< They have one, even if it is empty.
    };
    ThinningScratch thinning;
    MeshScratch mesh;
    Skeleton thinned;
    std::vector<Trial> tried;
};

/// A mesh of less detail, and how coarse it is.
struct DetailLevel
{
    MeshResult result = MeshResult::Ok;
    float error = 0; ///< Metres, as thinSkeleton has it: the level takes over where this is about a pixel.
};

/// Fills `mesh` with level `level` of a plant: 0 is the full plant, each further one has at most 1 / 2^level of its
/// triangles. Its error is the smallest that comes to so few, to 2 %; it never falls from one level to the next. Where
/// even the bare trunk has more, the level is that. `level` is at most kMostDetailLevel. The mesh is empty unless the
/// result is Ok.
///
/// The species' foliage stands on the full plant at every level, and is thinned by itself (meshLeaves): so the crown
/// keeps its leaves when twigs go. Sources name segments and organs of the full plant.
///
/// Time: that of placing leaves, of planning some ten plants without foliage, most of them coarse and none beyond the
/// triangles that are wanted, and of one mesh.
/// Equal input gives equal bytes. Safe to call concurrently on different meshes and scratches.
[[nodiscard]] DetailLevel meshDetailLevel(const Skeleton& full, const Appearance& appearance, std::uint32_t level,
                                          const MeshSettings& settings, const Limits& limits, DetailScratch& scratch,
                                          TreeMesh& mesh);

/// The same for levels `first`, `first` + 1 and so on, one for each of `meshes`: quicker than one by one, since leaves
/// are placed once and what errors come to is counted once. Requires as many `levels` as meshes.
void meshDetailLevels(const Skeleton& full, const Appearance& appearance, std::uint32_t first,
                      const MeshSettings& settings, const Limits& limits, DetailScratch& scratch,
                      std::span<TreeMesh> meshes, std::span<DetailLevel> levels);

} // namespace espalier
