#pragma once

#include <Espalier/Core/Limits.h>
#include <Espalier/Mesh/Foliage.h>
#include <Espalier/Mesh/TreeMesh.h>
#include <Espalier/Species/Appearance.h>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace espalier {

/// How leaves become triangles. Settings outside their ranges are clamped.
struct LeafSettings
{
    float bend = 0.003f; ///< Metres: where the folds and arches of a kind rise less than this, it is flat. [0, inf)
    /// Metres: of leaves smaller than two of it some are left out, and those that stay are larger (see meshLeaves). 0
    /// keeps all. [0, inf)
    float error = 0;
    MeshStreams streams{};
    std::uint32_t firstOrgan = 0; ///< Number of the first leaf of `foliage` among all organs of the plant.
};

/// One vertex of a kind of leaf. Lengths in the leaf's: x to the right, y from foot to tip, z to its upper side.
struct LeafVertex
{
    Vec3 position{0};
    Vec3 normal{0};                  ///< Unit: of the surface, without any bend out of the crown.
    Vec3 right{0};                   ///< Unit, in the surface: along +u.
    Vec2 uv{0};                      ///< [0, 1]
    Vec3 facing{0};                  ///< Unit: of the layer that it is in; says which side of it looks out.
    std::array<Vec3, 4> triangles{}; ///< Unit normals of those that meet here.
    std::array<float, 4> agree{};    ///< Cosine between each of these and the normal.
    std::uint32_t triangleCount = 0;
    bool isLitAsBefore = false; ///< Normal and tangent are those of the vertex before, in every leaf.
};

/// The triangles of one kind of leaf.
struct LeafPattern
{
    std::vector<LeafVertex> vertices;
    std::vector<std::uint32_t> indices;
    float bends = 0; ///< How far normals are bent outwards.
};

/// How far the drawing on the surface of a kind reaches.
struct LeafReach
{
    static constexpr std::size_t kRows = 32;
    LeafAppearance kind; ///< That it was found for.
    /// Half the width that each row across the surface needs, as a share of the surface's. [0, 1]
    std::array<float, kRows> halfWidths{};
};

/// Memory that meshing leaves needs in between; reuse it and nothing is allocated after warm-up. One per thread.
struct LeafScratch
{
    std::array<LeafPattern, kMaxLeafKinds> patterns;
    std::vector<LeafReach> reaches; ///< Of kinds met before: looking at every row takes longer than meshing them.
};

/// What leaves will take.
struct LeafCounts
{
    std::uint64_t leaves = 0;
    std::uint64_t vertices = 0;
    std::uint64_t indices = 0;
    std::uint32_t parts = 0;
};

/// Exactly what meshLeaves will append. Linear time; no memory is taken but in `scratch`.
[[nodiscard]] LeafCounts countLeaves(const Foliage& foliage, std::span<const LeafAppearance> kinds,
                                     const LeafSettings& settings, LeafScratch& scratch);

/// The same for so many leaves of each kind, none of which is thinned.
[[nodiscard]] LeafCounts countLeaves(const PlaceCounts& places, std::span<const LeafAppearance> kinds,
                                     const LeafSettings& settings, LeafScratch& scratch);

/// Adds leaves to the counts of a mesh, and gives the result that meshLeaves has for it: unless Ok, nothing is added.
[[nodiscard]] MeshResult addLeaves(const LeafCounts& leaves, const MeshStreams& streams, const Limits& limits,
                                   MeshCounts& counts) noexcept;

/// Appends leaves to `mesh`, as Leaves parts: one a kind that has any, in ascending order.
///
/// Blades are a strip of four quads round what LeafOutline draws on their surface, folded along the midrib and arched;
/// less where that would not be seen (LeafSettings::bend). Crossed ones are two quads, the second turned by a right
/// angle about the midrib. Balls hang at the end of their stalk, a thin triangle either way; the whole of their texture
/// is seen. u runs across the surface, v from its foot to its tip. Normals are bent out of the crown as far as the kind
/// says, but stay on that side of every triangle that is its front; viewers turn them.
///
/// With an error, leaves smaller than two errors (as the root of their surface) are thinned: of those with a share s of
/// that area a share s is kept, and made as large, so that the crown stays as dense (stochastic simplification; Cook,
/// Halstead, Planck and Ryu, ACM TOG 26, 2007). What a larger error keeps a smaller one keeps too. It does not matter
/// which wood is left: where leaves are thinned, twigs are far too thin to be missed, and the crown would fall apart if
/// leaves went with them.
///
/// Sources: the leaf's segment and lot, and as its organ `firstOrgan` plus its index in `foliage`, whatever the error.
/// EmptySkeleton if there are no leaves. Requires: `foliage` is of these `kinds`. Equal input gives equal bytes. Safe
/// to call concurrently on different meshes and scratches.
[[nodiscard]] MeshResult meshLeaves(const Foliage& foliage, std::span<const LeafAppearance> kinds,
                                    const LeafSettings& settings, const Limits& limits, LeafScratch& scratch,
                                    TreeMesh& mesh);

} // namespace espalier
