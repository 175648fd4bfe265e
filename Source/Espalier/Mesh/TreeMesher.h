#pragma once

#include <Espalier/Core/Error.h>
#include <Espalier/Mesh/ShapeMesher.h>
#include <Espalier/Mesh/TubeMesher.h>

namespace espalier {

/// How a plant becomes triangles.
struct MeshSettings
{
    TubeSettings tubes{};
    ShapeSettings shapes{};
    bool sources = false; ///< Fill TreeMesh::sources: wind, picking and cutting want them.
};

/// Memory that meshing needs in between; reuse it and nothing is allocated after warm-up. One per thread.
struct MeshScratch
{
    TubeScratch tubes;
    ShapeScratch shapes;
};

/// Appends the whole plant to `mesh`: the tubes of its segments (meshTubes), then its leaves, petals and berries
/// (meshShapes). EmptySkeleton only if it has neither. At most one part for each material and entry of the palette.
/// Equal input gives equal bytes. Safe to call concurrently on different meshes and scratches.
[[nodiscard]] MeshResult meshTree(const Skeleton& skeleton, const Appearance& appearance, const MeshSettings& settings,
                                  const Limits& limits, MeshScratch& scratch, TreeMesh& mesh);

/// The same for one plant, in memory of its own.
[[nodiscard]] Expected<TreeMesh> meshTree(const Skeleton& skeleton, const Appearance& appearance,
                                          const MeshSettings& settings = {}, const Limits& limits = {});

} // namespace espalier
