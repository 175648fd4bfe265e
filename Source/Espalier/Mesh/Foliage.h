#pragma once

#include <Espalier/Core/Limits.h>
#include <Espalier/Mesh/AxisCurve.h>
#include <Espalier/Mesh/FoliageLight.h>
#include <Espalier/Mesh/TreeMesh.h>
#include <Espalier/Plant/Skeleton.h>
#include <Espalier/Species/Appearance.h>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace espalier {

/// One leaf, spray, flower or fruit in its place.
struct PlacedLeaf
{
    Vec3 foot{0};                       ///< On the bark, metres.
    float length = 0;                   ///< Metres, > 0.
    Vec3 heading{0};                    ///< Unit, from foot to tip.
    std::uint32_t segment = kNoSegment; ///< Of the skeleton: what it stands on.
    Vec3 face{0};                       ///< Unit, normal to the heading: its upper side looks there.
    float lot = 0;                      ///< [0, 1), even: where only a share s of leaves is wanted, those below s stay.
                                        ///< From its place alone, whatever number it has.
    Vec3 outward{0};                    ///< Unit: out of the crown.
    Tint tint;                          ///< Its shade of the kind's colour, darker inside the crown.

    friend bool operator==(const PlacedLeaf&, const PlacedLeaf&) = default;
};

/// All leaves of one plant, before they have a surface.
struct Foliage
{
    std::vector<PlacedLeaf> leaves;                        ///< By kind; within one, along the axes from tip to base.
    std::array<std::uint32_t, kMaxLeafKinds + 1> starts{}; ///< Of each kind's leaves; then the end of the last.

    void clear() noexcept;
    [[nodiscard]] std::span<const PlacedLeaf> ofKind(std::size_t kind) const noexcept;

    friend bool operator==(const Foliage&, const Foliage&) = default;
};

/// Memory that placing leaves needs in between; reuse it and nothing is allocated after warm-up. One per thread.
struct FoliageScratch
{
    struct Candidate
    {
        PlacedLeaf leaf;
        std::uint32_t kind = 0;
        float lot = 0; ///< It stays where at least this share of places bears a leaf.
    };
    /// How much of its surface a kind met before covers: looking takes longer than placing a few hundred.
    struct Cover
    {
        LeafAppearance kind;
        float share = 1;
    };
    std::vector<Cover> covers;
    std::vector<std::uint64_t> places; ///< Of each segment (hashPlaces).
    std::vector<AxisJoint> joints;
    std::vector<CurvePoint> points;
    std::vector<Vec3> sides; ///< Of each point: across the shoot, without twist.
    std::vector<Candidate> candidates;
    std::vector<Shader> shaders;
    FoliageLight light;
};

/// The kind with every number that is out of its range at the nearest that is not; NaN at the least.
[[nodiscard]] LeafAppearance withinRanges(const LeafAppearance& kind) noexcept;

/// Finds the place of every leaf that `kinds` tell of; of more than kMaxLeafKinds the first ones.
///
/// Each kind counts its nodes from the tips of the axes downwards, as far as wood is thin enough, and so that shoots of
/// any length end in leaves; where a branch leaves its parent, nodes begin outside the parent's bark. Axes are as
/// smooth as `smoothing` says: that of the tubes (TubeSettings), so that leaves stand on their bark. Leaves turn round
/// the axis in a frame that does not twist; two ranks lie left and right of the axis as `facing` makes their faces look
/// up. Fewer stand where the crown takes their light away (FoliageLight), and they are darker there.
///
/// Everything random is a function of the place where the shoot begins (hashPlaces), the kind and the node, so that a
/// plant always has the same leaves; one that loses a branch keeps all others, but for what more light does to them;
/// and a smaller `density` or more shade leave out some and move none. Linear time.
///
/// TooManyVertices if leaves, four vertices each, or nodes, whether they bear leaves or not, would exceed
/// Limits::vertices; known before the memory is taken. EmptySkeleton if there is nothing to place. Whatever the
/// result, `foliage` holds what was placed, which is nothing unless Ok. The skeleton needs its axes (completeAxes).
/// Equal input gives equal bytes. Safe to call concurrently on different scratches and results.
[[nodiscard]] MeshResult placeLeaves(const Skeleton& skeleton, std::span<const LeafAppearance> kinds, float smoothing,
                                     const Limits& limits, FoliageScratch& scratch, Foliage& foliage);

/// Of each kind: how many places there are for leaves.
using PlaceCounts = std::array<std::uint64_t, kMaxLeafKinds>;

/// Counts the places where placeLeaves looks whether a leaf stands: never fewer than it finds leaves, all of them where
/// `density` is 1 and `shade` and `taper` are 0. No leaf is placed. Fails as placeLeaves does, but for limits that only
/// leaves that are there exceed.
[[nodiscard]] MeshResult countPlaces(const Skeleton& skeleton, std::span<const LeafAppearance> kinds, float smoothing,
                                     const Limits& limits, FoliageScratch& scratch, PlaceCounts& counts);

} // namespace espalier
