#pragma once

#include <Espalier/Mesh/Wind.h>
#include <Espalier/Species/Appearance.h>

namespace espalier {

/// The air at one moment, the same for all trees of a scene.
struct WindWeather
{
    Vec3 direction{1, 0, 0}; ///< Where it blows to; unit, horizontal.
    float speed = 6;         ///< Metres a second, the mean. [0, 60]. 2 a light breeze, 12 a strong one, 20 a gale.
    float gust = 0.4f;       ///< How far gusts and lulls depart from the mean, as a share of it. [0, 1]
    float time = 0;          ///< Seconds. Single precision: begin again before a day is over.
    Vec3 place{0};           ///< Where the tree stands, metres: gusts come to one tree after the other.
};

/// How one tree answers: the same for all its vertices.
struct WindResponse
{
    float trunkAngle = 0; ///< Radians that its top leans about its foot in a storm without end.
    float boughAngle = 0; ///< Radians, likewise the tip of a slender bough.
    float flutter = 0;    ///< How far the tip of a leaf beats, in its lengths.
    float rate = 0;       ///< Sways a second.
};

/// The usual response of a tree of this height and girth, times what its species says. Sway rates: J. R. Moore and
/// D. A. Maguire, "Natural sway frequencies and damping ratios of trees", Trees 18, 2004: 0.0766 + 3.1219 d / h^2 Hz
/// for conifers of d centimetres at breast height and h metres; kept within [0.12, 0.5] Hz, since crowns in leaf are
/// slower.
[[nodiscard]] WindResponse windResponse(const Skeleton& full, const WindAppearance& wind) noexcept;

/// The three nested rotations of a vertex, each as a Gibbs vector (axis times the tangent of half the angle), and what
/// its leaf does before them.
struct WindTurns
{
    Vec3 leaf{0}; ///< Metres.
    Vec3 twig{0};
    Vec3 bough{0};
    Vec3 trunk{0};
};

[[nodiscard]] WindTurns windTurns(const WindVertex& vertex, const WindWeather& weather,
                                  const WindResponse& response) noexcept;

/// Where a vertex is in the wind: the very computation of Content/Shaders/wind.vert. What
/// varies along a branch is the angle; turned far, its ends come a little nearer, so that the bow keeps its length.
/// Deterministic: + - * / and floor.
[[nodiscard]] Vec3 windDisplaced(const WindVertex& vertex, const Vec3& position, const WindWeather& weather,
                                 const WindResponse& response) noexcept;

/// The mesh at one moment: positions, normals and tangents turned. Requires a vertex of `wind` for each of the mesh.
[[nodiscard]] TreeMesh blownBy(const TreeMesh& mesh, const WindVertices& wind, const WindWeather& weather,
                               const WindResponse& response);

} // namespace espalier
