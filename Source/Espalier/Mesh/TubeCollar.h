#pragma once

#include <Espalier/Core/Simd.h>
#include <Espalier/Mesh/TubeMesher.h>

namespace espalier {

/// How deep the collar's foot of an embedded branch lies below the parent's surface, in radii of the branch: facets
/// must not bare it.
inline constexpr float kFootDepth = 0.1f;

/// How far a place lies above the parent's surface, metres.
[[nodiscard]] float heightOverParent(const TubeCollar& collar, const Vec3& position) noexcept;

/// A ring in the collar's reach, and what its points share.
struct CollarRing
{
    const TubeCollar& collar;
    const TubeRing& ring;
    float height; ///< Of its centre over the parent's surface, metres.
    float level;  ///< How far up the collar it stands: 0 at the foot, 1 where it ends.

    CollarRing(const TubeCollar& of, const TubeRing& which) noexcept;

    /// A point on the ring, `outward` (unit) from its centre.
    ///
    /// The collar is a fillet over the parent's surface. Its rings are lines of equal height over that surface rather
    /// than flat: each vertex slides along the branch to the height of its ring's centre, then along the parent's
    /// surface away from the branch, by a quarter ellipse's width at that height. It slides furthest in the crotch,
    /// where the surfaces face each other (1 - away.outward is large), and stays where they already run together.
    [[nodiscard]] simd::Four pointAt(simd::Four outward, float footDepth) const noexcept;

    /// The normal of a vertex: the mesh's own, turned into the parent's towards the foot, so that light crosses the
    /// joint without an edge.
    [[nodiscard]] simd::Four normalAt(simd::Four position, simd::Four own) const noexcept;
};

} // namespace espalier
