#pragma once

#include <Espalier/Core/Limits.h>
#include <Espalier/Mesh/TreeMesh.h>
#include <cstdint>

namespace espalier {

struct Skeleton;
struct BarkAppearance;

/// How branch axes become closed tubes.
struct TubeSettings
{
    std::uint16_t minSides = 5;      ///< Ring vertices on the thinnest axis. [3, maxSides]
    std::uint16_t maxSides = 24;     ///< Ring vertices on the thickest axis. [3, 256]
    float chordError = 0.0025f;      ///< Metres allowed between a facet and the true circle. (0, inf)
    float smoothing = 1.0f;          ///< How far an axis bends round the corners of its skeleton: 0 straight segments, 1 a smooth curve through all joints. [0, 1]
    float maxRingAngle = 0.26f;      ///< Radians an axis may turn between two rings before another ring is put in. (0, pi]
    float collarFlare = 0.6f;        ///< How much wider a branch is where it leaves its parent, in its own radii. [0, 4]
    float collarLength = 2.5f;       ///< Over what length the collar fades, in radii of the branch. [0, 20]
    float rootFlare = 0.7f;          ///< The same for the trunk where it meets the ground. [0, 4]
    float rootFlareLength = 4.0f;    ///< In radii of the trunk. [0, 20]
};

/// Why there is no mesh.
enum class TubeResult : std::uint8_t
{
    Ok,
    EmptySkeleton,  ///< Nothing to sweep; `mesh` is untouched.
    UnsoundSkeleton,///< A number is not finite or an index out of range; `mesh` is untouched.
    TooManyVertices,///< Limits::vertices would be exceeded; `mesh` is untouched.
};

/// Memory that meshing needs in between; reuse it and nothing is allocated after warm-up. One per thread.
struct TubeScratch
{
    std::vector<std::uint32_t> axis;
    // (filled in by the implementation)
};

/// Appends one closed tube per axis of `skeleton` to `mesh`, as one Bark part.
///
/// Frames are rotation-minimizing (Wang et al. 2008, double reflection); a branch begins inside its parent and widens
/// to a collar at the parent's surface; tips are closed and round. u runs a whole number of texture repeats round each
/// axis, so bark tiles without a seam; v is metres along the axis over the tile. Zero-length segments are
/// skipped; radius 0 closes the tube to a point. Equal input gives equal bytes. Safe to call concurrently on different
/// meshes and scratches.
[[nodiscard]] TubeResult meshTubes(const Skeleton& skeleton, const BarkAppearance& bark, const TubeSettings& settings,
                                   const Limits& limits, TubeScratch& scratch, TreeMesh& mesh);

} // namespace espalier
