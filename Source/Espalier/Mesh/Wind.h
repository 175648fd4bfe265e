#pragma once

#include <Espalier/Core/Vector.h>
#include <Espalier/Mesh/TreeMesh.h>
#include <Espalier/Plant/Skeleton.h>
#include <cstdint>
#include <vector>

namespace espalier {

/// "No element": of a vertex at the base, and the parent of a trunk.
inline constexpr std::uint32_t kNoElement = 0xffffffffu;

/// An axis as the wind sees it: something that turns about the place where it leaves its parent.
struct WindElement
{
    std::uint32_t parent = kNoElement; ///< Lower than the own index; kNoElement of a trunk.
    std::uint32_t segment = 0;         ///< Of the full skeleton: its first.
    Vec3 pivot{0};                     ///< Where it leaves its parent's wood, metres.
    Vec3 direction{0, 1, 0};           ///< Unit, from the pivot to the farthest place on its axis.
    float extent = 0;                  ///< How far that is, metres.
    float radius = 0;                  ///< At its start, metres.
    float parentAlong = 0;             ///< WindVertex::along of its parent where it leaves, metres.
    float phase = 0;                   ///< [0, 1) in steps of 1/2048, from its place (hashPlaces).
    std::uint16_t level = 0;           ///< 0 the trunk, 1 boughs, 2 twigs, 3 and more what hangs on these.

    friend bool operator==(const WindElement&, const WindElement&) = default;
};

/// How one vertex answers the wind: three nested rotations, of its twig, of its bough and of the whole tree, and the
/// flutter of its leaf. A branch has at its foot what its parent has there, so that nothing cracks.
struct WindVertex
{
    float trunkBend = 0;                ///< [0, 1]: 0 at the ground, 1 at the top of the trunk.
    float boughBend = 0;                ///< [0, 1]: 0 at the pivot, 1 at the tip of a slender bough.
    float twigBend = 0;                 ///< [0, 1]: likewise of the axis of level 2.
    float flutter = 0;                  ///< Metres: 0 at a leaf's foot, its length at its tip. 0 of wood and balls.
    float edge = 0;                     ///< [0, 1]: flutter in lengths of the leaf.
    float along = 0;                    ///< Metres along its own axis from where that leaves its parent's wood.
    float boughPhase = 0;               ///< [0, 1)
    float twigPhase = 0;                ///< [0, 1)
    Vec3 boughPivot{0};                 ///< Metres; 0 where there is none.
    Vec3 twigPivot{0};                  ///< Metres; 0 where there is none.
    std::uint16_t boughFacing = 0;      ///< Where the bough leads from its pivot, see windDirection; 0 without one.
    std::uint16_t twigFacing = 0;       ///< Likewise of the twig.
    std::uint32_t element = kNoElement; ///< Its axis, in WindVertices::elements.
    /// Of a leaf: bits 0 to 7 its phase in 1/256, bits 8 to 13 and 14 to 19 the direction in which it beats, see
    /// leafFacing. 0 of wood.
    std::uint32_t leaf = 0;
    std::uint16_t level = 0; ///< Of its axis.

    friend bool operator==(const WindVertex&, const WindVertex&) = default;
};

/// What a mesh needs to move in the wind. A plain value; `clear` keeps the memory.
struct WindVertices
{
    std::vector<WindVertex> vertices;  ///< One for each of the mesh.
    std::vector<WindElement> elements; ///< One for each axis of the full skeleton, parents before children.

    void clear() noexcept;

    friend bool operator==(const WindVertices&, const WindVertices&) = default;
};

/// Memory that computeWind needs in between; reuse it and nothing is allocated after warm-up. One per thread.
struct WindScratch
{
    struct Foot ///< What an axis inherits where it begins.
    {
        float trunkBend = 0;
        float boughBend = 0;
        float twigBend = 0;
        std::uint32_t bough = kNoElement;
        std::uint32_t twig = kNoElement;
        float inside = 0;  ///< How far along it leaves its parent's wood, metres.
        float largest = 1; ///< The bend of its own at its tip, [0, 1].
    };
    std::vector<std::uint32_t> axisOf; ///< Of each segment.
    std::vector<std::uint64_t> places; ///< Of each segment (hashPlaces).
    std::vector<std::uint64_t> shapes; ///< Of each polygon, sphere and organ of the skeleton: likewise.
    std::vector<std::uint32_t> borne;  ///< Of each segment: how many of them it has borne so far.
    /// Of each segment's end: the farthest from its axis' pivot so far, metres; before the pivot, how far it is there,
    /// negative.
    std::vector<float> reachOf;
    std::vector<Foot> feet; ///< Of each axis.
};

/// Fills `wind` for a mesh with sources, whose segments are those of `full`: that of the whole plant for every level of
/// detail, so that levels move alike (meshDetailLevel names its segments; else see nameFullSources).
///
/// Weights are functions of the skeleton at a vertex' place: of how far along its axis it stands, as the deflection of
/// a beam that is clamped at its foot and pulled at its tip, y ~ s^2 (3 - s). A bough has level 1; further trunks of a
/// plant with several count as boughs of no trunk. Where an axis turns back towards its pivot, or hangs, the rest of it
/// moves as one piece instead of stretching. In a collar, within about a radius over its parent's surface, a branch
/// fades into what its parent does there. All vertices of a leaf move with the place on its twig where its foot is:
/// vertices of one organ stand together in the mesh.
///
/// False, and `wind` empty, if the mesh has no sources (an empty one needs none) or one of another skeleton, or the
/// skeleton is not sound. Linear time. Equal input gives equal bytes. Safe to call concurrently on different scratches.
[[nodiscard]] bool computeWind(const Skeleton& full, const TreeMesh& mesh, WindScratch& scratch, WindVertices& wind);

/// A direction out of 12 bits, about unit: octahedral map, u in bits 0 to 5 (-1 at 0, 1 at 63), v in bits 6 to 11.
[[nodiscard]] Vec3 windDirection(std::uint32_t packed) noexcept;

/// The direction in which a leaf beats, about unit: decoded from WindVertex::leaf.
[[nodiscard]] Vec3 leafFacing(std::uint32_t leaf) noexcept;

} // namespace espalier
