#pragma once

#include <Espalier/Core/Error.h>
#include <Espalier/Mesh/Foliage.h>
#include <Espalier/Mesh/LeafMesher.h>
#include <Espalier/Mesh/ShapeMesher.h>
#include <Espalier/Mesh/TubeMesher.h>

namespace espalier {

/// How a plant becomes triangles.
struct MeshSettings
{
    TubeSettings tubes{};
    ShapeSettings shapes{};
    LeafSettings leaves{};
    bool sources = false; ///< Fill TreeMesh::sources: wind, picking and cutting want them.
};

/// Memory that meshing needs in between; reuse it and nothing is allocated after warm-up. One per thread.
struct MeshScratch
{
    TubeScratch tubes;
    std::size_t woodEnd = 0; ///< After meshBare: the wood's vertices are those from where the mesh ended up to here.
    ShapeScratch shapes;
    FoliageScratch placing;
    Foliage foliage; ///< After a successful call, what meshTree placed: for tests and drawings of it.
    LeafScratch leaves;
};

/// Appends the whole plant to `mesh`: the tubes of its segments (meshTubes), the petals, berries and organs that it
/// draws (meshShapes), then the species' foliage (placeLeaves, meshLeaves), which takes light from the rest (shadeWood:
/// the same at every level of detail). EmptySkeleton only if it has none of them.
/// At most one part for each material and entry of the palette or kind of leaf. Streams and numbers of organs among
/// `settings` are filled in: leaves are numbered after all that the skeleton draws. Equal input gives equal bytes. Safe
/// to call concurrently on different meshes and scratches.
[[nodiscard]] MeshResult meshTree(const Skeleton& skeleton, const Appearance& appearance, const MeshSettings& settings,
                                  const Limits& limits, MeshScratch& scratch, TreeMesh& mesh);

/// The same without the species' foliage and its shade, but with the streams that it needs.
[[nodiscard]] MeshResult meshBare(const Skeleton& skeleton, const Appearance& appearance, const MeshSettings& settings,
                                  const Limits& limits, MeshScratch& scratch, TreeMesh& mesh);

/// Adds to `counts` exactly what meshTree will append, and gives its result; so one can know what a plant takes, or
/// reserve it (TreeMesh::reserve), before memory is taken but in `scratch`. Counts are those of the mesh so far, and
/// stay what they are unless the result is Ok. Linear time: that of planning tubes and placing leaves, about half of
/// what meshTree takes.
[[nodiscard]] MeshResult countTree(const Skeleton& skeleton, const Appearance& appearance, const MeshSettings& settings,
                                   const Limits& limits, MeshScratch& scratch, MeshCounts& counts);

/// Adds to `counts` at least what meshTree will append, in less time and scratch than countTree takes: no leaf is
/// placed. Exact for wood, embedded or welded, and for shapes; foliage counts as if every place bore a leaf, and
/// altogether no more vertices than Limits::vertices. Fails where countTree does, but for limits that only leaves that
/// are there exceed; unless the result is Ok, counts stay what they are.
[[nodiscard]] MeshResult meshBound(const Skeleton& skeleton, const Appearance& appearance, const MeshSettings& settings,
                                   const Limits& limits, MeshScratch& scratch, MeshCounts& counts);

/// The same as countTree for meshBare; may stop at more indices than `enough`, as countTubes does.
[[nodiscard]] MeshResult countBare(const Skeleton& skeleton, const Appearance& appearance, const MeshSettings& settings,
                                   const Limits& limits, MeshScratch& scratch, MeshCounts& counts,
                                   std::uint64_t enough = kCountAll);

/// Settings for the foliage of `skeleton`, streams and numbers of organs filled in.
[[nodiscard]] LeafSettings leafSettingsOf(const Skeleton& skeleton, const MeshSettings& settings) noexcept;

/// The same for one plant, in memory of its own.
[[nodiscard]] Expected<TreeMesh> meshTree(const Skeleton& skeleton, const Appearance& appearance,
                                          const MeshSettings& settings = {}, const Limits& limits = {});

} // namespace espalier
