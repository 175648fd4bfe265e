#pragma once

#include <Espalier/Core/Limits.h>
#include <Espalier/Mesh/AxisCurve.h>
#include <Espalier/Mesh/TreeMesh.h>
#include <Espalier/Mesh/TubeSheet.h>
#include <Espalier/Plant/Skeleton.h>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace espalier {

struct BarkAppearance;

/// How branches meet what they grow out of.
enum class TubeJoints : std::uint8_t
{
    Embed, ///< Each branch is a tube of its own that begins inside its parent, closed there too unless it is thin
           ///< (TubeSettings::openRadius): fewest triangles, quickest.
    Weld, ///< All wood that hangs together is one closed surface, without walls inside: for printing, collision shapes,
          ///< displacement, smooth shading across joints.
};

/// How branch axes become tubes.
struct TubeSettings
{
    std::uint16_t minSides = 5;  ///< Ring vertices on the thinnest axis. [3, maxSides]
    std::uint16_t maxSides = 24; ///< Ring vertices on the thickest axis. [3, 256]
    float chordError = 0.0025f;  ///< Metres allowed between a facet and the true circle. (0, inf)
    float smoothing = 1.0f;      ///< How far an axis bends round the corners of its skeleton: 0 straight segments, 1 a
                                 ///< smooth curve through all joints. [0, 1]
    float maxRingAngle = 0.26f;  ///< Radians an axis may turn between two rings before another ring is put in. (0, pi]
    float collarFlare = 0.6f;    ///< How much wider a branch is where it leaves its parent, in its own radii. [0, 4]
    float collarLength = 2.5f;   ///< Over what length the collar fades, in radii of the branch. [0, 20]
    float rootFlare = 1.0f;      ///< Times what the bark says of the trunk where it meets the ground. [0, 4]
    std::uint16_t colours = 64;  ///< Parts at most: materials from this one on share the last. [1, 64]
    TubeJoints joints =
        TubeJoints::Embed; ///< Whether branches are tubes of their own or one surface with their parents.
    MeshStreams streams{}; ///< Tints are those of young wood (BarkAppearance::youngTint).
    /// Metres: embedded branches that begin no thicker than this are open where they do: for levels of detail, where
    /// nobody could see into one. Mostly that is inside their parent; a thinned plant's begin up to half of its error
    /// off the parent's axis (thinSkeleton). [0, inf)
    float openRadius = 0;
    /// Of each segment: how many times as thick as it grew it was made (thinSkeleton). Its bark stays that of what
    /// grew. One for every segment, or none: all are as they grew.
    std::span<const float> widening{};
};

/// A cross section of a tube.
struct TubeRing
{
    Vec3 centre{0};                     ///< Metres.
    float radius = 0;                   ///< Metres, without the collar.
    Vec3 tangent{0};                    ///< Unit; the ring lies normal to it.
    float along = 0;                    ///< Metres from the axis' start.
    Vec3 side{0};                       ///< Unit, normal to the tangent: towards the ring's first vertex.
    float slope = 0;                    ///< d radius / d along, without the collar.
    Vec2 normal{1, 0};                  ///< The surface normal outwards and along the tangent, unit.
    std::uint32_t segment = kNoSegment; ///< Of the skeleton: the one that it stands on.
    bool pinned = false;                ///< Placed on purpose: not dropped because the tube is straight here.
};

/// Where a branch leaves its parent, whose surface nearby is taken for two cones that meet at the joint.
struct TubeCollar
{
    Vec3 joint{0};          ///< On the parent's axis, metres.
    Vec3 before{0};         ///< Unit; the parent's direction up to the joint.
    Vec3 after{0};          ///< Unit; the direction of its continuation.
    float parentRadius = 0; ///< At the joint, metres; 0 if the tube does not grow out of another.
    float slopeBefore = 0;  ///< Of the parent's radius, along `before`.
    float slopeAfter = 0;   ///< Along `after`.
    float height = 0;       ///< How far the collar swells, metres; 0 if there is none.
    float length = 0;       ///< How far from the parent's surface it is felt, metres.
    float start = 0;        ///< Where the branch's axis leaves the parent's surface, metres along it.
    float end = 0;          ///< Where its axis leaves the collar.
    bool isLaid = false;    ///< The first rings follow the parent's surface; without it the tube begins at the joint.
};

/// How a trunk runs out into the ground. So far up, its radius is that of a trunk without roots times
/// 1 + share (w^3 + depth w^4 l), where w falls from 1 at the ground to 0, and l in [-1, 1] is a sum of waves round it.
struct RootFlare
{
    float share = 0;             ///< How much wider the trunk is at the ground, in radii.
    float length = 0;            ///< Metres.
    float depth = 0;             ///< 0: it is round.
    std::uint32_t lobes = 0;     ///< Round it.
    std::array<Vec2, 3> turns{}; ///< Where the waves begin: cosine and sine.

    [[nodiscard]] bool isLobedAt(float along) const noexcept { return depth > 0 && along < length; }
};

inline constexpr std::uint32_t kNoFoot = 0xffffffffu;

/// One planned tube.
struct Tube
{
    std::uint32_t firstRing = 0;
    std::uint32_t ringCount = 0;
    std::uint32_t sides = 0;
    std::uint32_t colour = 0;       ///< Of its part.
    float repeats = 1;              ///< Of the bark round the tube; whole.
    float repeatsPerMetre = 1;      ///< Along it.
    float lean = 0;                 ///< By how many repeats round it the bark is turned for each along it.
    std::uint32_t baseVertices = 0; ///< Closing the start; 0 if its first ring has no radius, or is welded.
    TubeCollar collar;
    RootFlare roots{};
    std::uint32_t segment = kNoSegment; ///< Of the skeleton: the one that it begins with.
    std::uint32_t sheet = kNoSheet;     ///< Of the plan, if branches are welded to it.
    std::uint32_t foot = kNoFoot;       ///< Of the plan, if it is welded to another tube.
};

/// Memory that meshing needs in between; reuse it and nothing is allocated after warm-up. One per thread. After a
/// successful call it holds the plan of the mesh, for tests and drawings of it.
struct TubeScratch
{
    std::vector<std::uint8_t> forks; ///< 1 for segments whose end also bears branches.
    std::vector<AxisJoint> joints;
    std::vector<CurvePoint> points;
    std::vector<TubeRing> rings;
    std::vector<Tube> tubes;
    std::vector<Vec2> circlePoints; ///< Cosine and sine, the first point again at the end.
    std::array<std::uint32_t, 257>
        circleStarts{}; ///< Where in circlePoints the circle of so many sides begins, plus 1.
    SheetPlan sheets;   ///< Of TubeJoints::Weld.
    TreeMesh unwelded;  ///< The rings of one sheet.

    std::uint32_t branches = 0; ///< Tubes that grow out of another.
    std::uint32_t embedded = 0; ///< Those of them that are tubes of their own: all, or what could not be welded.
};

/// Appends one tube per axis of `skeleton` to `mesh`, as Bark parts: one for each material in which an axis begins, in
/// ascending order. Tubes are closed, but for the feet of thin branches if settings.openRadius says so. A tube has one
/// colour, that of its first segment.
///
/// Frames are rotation-minimizing (Wang et al. 2008, double reflection); a branch begins inside its parent and widens
/// to a collar that follows the parent's surface and takes its normals there; tips are closed and round, one radius
/// beyond the skeleton's end; a leaning trunk begins far enough below its start to leave no gap. A segment that starts
/// away from its parent's end begins a tube of its own. Axes without length or radius are skipped; radius 0 closes a
/// tube to a point.
///
/// With TubeJoints::Weld a branch's collar ends on the parent's surface, which is open there: tubes that grow out of
/// each other are one closed surface, in which two triangles meet at every edge (vertices with bit-equal positions
/// taken as one). Nothing changes but around the joints, where light crosses without an edge, but for steep crotches:
/// there normals are turned to the front of their triangles. Branches that hardly come out of their parent, or have no
/// room on it, stay tubes of their own, and scratch.embedded counts them; surfaces may still pass through each other.
///
/// u runs a whole number of texture repeats round each axis, so bark tiles without a seam. v advances with the length
/// at the scale of u on the axis' mean radius, so texels stay square: about one repeat a tile, which shows
/// BarkAppearance::tileHeight times as much as round the axis; more on axes thinner than one tile round. u also grows a
/// little with v, like the grain of most trees, so that what a tile shows is not seen in a column. The lid of a tube's
/// base is mapped flat.
///
/// A trunk that begins at the ground runs out into roots as its bark says: wider, and parted into buttresses where its
/// rings have the sides for them. Trunks of the same radius part in the same way.
///
/// Settings outside their ranges are clamped. Equal input gives equal bytes. Safe to call concurrently on different
/// meshes and scratches.
[[nodiscard]] MeshResult meshTubes(const Skeleton& skeleton, const BarkAppearance& bark, const TubeSettings& settings,
                                   const Limits& limits, TubeScratch& scratch, TreeMesh& mesh);

/// Adds to `counts` exactly what meshTubes will append, and gives its result: the first of its two passes. Counts are
/// those of the mesh so far, and stay what they are unless the result is Ok. Who only asks whether there are more than
/// `enough` indices is told so as soon as that is sure: then counts are too low, but their indices more than `enough`.
[[nodiscard]] MeshResult countTubes(const Skeleton& skeleton, const BarkAppearance& bark, const TubeSettings& settings,
                                    const Limits& limits, TubeScratch& scratch, MeshCounts& counts,
                                    std::uint64_t enough = kCountAll);

} // namespace espalier
