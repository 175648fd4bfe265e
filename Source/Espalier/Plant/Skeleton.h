#pragma once

#include <Espalier/Core/Vector.h>
#include <cstdint>
#include <vector>

namespace espalier {

/// "No segment" in the index arrays of a Skeleton: the parent of a segment at the base, the continuation of a tip.
inline constexpr std::uint32_t kNoSegment = 0xffffffffu;

/// A template instance as it stands in a grown tree: where its segments came from.
struct SkeletonInstance
{
    std::uint32_t parent = kNoSegment; ///< The instance it hangs on; kNoSegment for the first of a tree.
    std::uint32_t production = 0;      ///< Index in the species' grammar, or of the template in an archetype's library.
    std::uint32_t row = 0;             ///< Row of the observed transform, or the instance's index in the archetype.

    friend bool operator==(const SkeletonInstance&, const SkeletonInstance&) = default;
};

/// A flat shape between the turtle's { and }: a leaf, a petal. Its corners run round it, in either sense.
struct SkeletonPolygon
{
    std::uint32_t firstCorner = 0;      ///< Into Skeleton::corners.
    std::uint32_t cornerCount = 0;      ///< At least 3.
    std::uint32_t segment = kNoSegment; ///< It hangs on this one; kNoSegment at the base.
    std::uint16_t material = 0;         ///< Set by the turtle's '.

    friend bool operator==(const SkeletonPolygon&, const SkeletonPolygon&) = default;
};

/// A ball: a berry, a bud.
struct SkeletonSphere
{
    Vec3 centre{0};   ///< Metres.
    float radius = 0; ///< Metres, >= 0.
    std::uint32_t segment = kNoSegment;
    std::uint16_t material = 0;

    friend bool operator==(const SkeletonSphere&, const SkeletonSphere&) = default;
};

/// A place for an organ of the species, such as a leaf or a flower.
struct SkeletonOrgan
{
    Vec3 position{0};        ///< Metres; where it is attached.
    Vec3 heading{0};         ///< Unit; it grows this way.
    Vec3 left{0};            ///< Unit, normal to the heading.
    float size = 1;          ///< Metres, > 0: its length.
    std::uint32_t organ = 0; ///< Which one: its number among the organs that the plant's maker knows by name.
    std::uint32_t segment = kNoSegment;
    std::uint16_t material = 0;

    friend bool operator==(const SkeletonOrgan&, const SkeletonOrgan&) = default;
};

/// One plant as geometry without skin: straight segments, parents before children.
///
/// All segment arrays have equal length. A segment usually starts where its parent ends; after a turtle's move it
/// starts elsewhere but still hangs on the segment drawn last. Chains of continuations form axes: the trunk has
/// order 0, what leaves it order 1. Plant space: metres, Y up, right-handed, base at the origin.
///
/// A plain value: copy, compare, save; a const one may be read from any thread. `clear` keeps the memory.
struct Skeleton
{
    std::vector<Vec3> starts;                 ///< Metres.
    std::vector<Vec3> ends;                   ///< Metres.
    std::vector<Vec3> headings;               ///< Unit; the direction of growth, also of zero-length segments.
    std::vector<Vec3> lefts;                  ///< Unit, normal to the heading; up = cross(heading, left).
    std::vector<float> lengths;               ///< Metres, >= 0, as the turtle was told.
    std::vector<float> startRadii;            ///< Metres, >= 0.
    std::vector<float> endRadii;              ///< Metres, >= 0. The start radius of the continuation, if there is one.
    std::vector<std::uint32_t> parents;       ///< Lower than the own index, or kNoSegment at the base.
    std::vector<std::uint32_t> continuations; ///< The child that carries the axis on, or kNoSegment at its tip.
    std::vector<std::uint16_t> orders;        ///< Axes between this one and the trunk.
    std::vector<std::uint16_t> materials;     ///< Set by the turtle's '.
    std::vector<std::uint32_t> instances;     ///< Index into `instanceRecords`; kNoSegment outside template instances.

    std::vector<SkeletonInstance> instanceRecords; ///< Parents before children; empty for plain L-systems.

    std::vector<Vec3> corners; ///< Of all polygons, metres.
    std::vector<SkeletonPolygon> polygons;
    std::vector<SkeletonSphere> spheres;
    std::vector<SkeletonOrgan> organs;

    bool widthsGiven = false; ///< The turtle set diameters with `!`; otherwise radii follow from the pipe model.

    // What the turtle's path covered: the origin and every position drawn or moved to.
    float minY = 0;      ///< Metres.
    float maxY = 0;      ///< Metres.
    float maxRadius = 0; ///< Largest distance from the Y axis, metres.

    [[nodiscard]] std::uint32_t size() const noexcept { return static_cast<std::uint32_t>(parents.size()); }
    [[nodiscard]] bool empty() const noexcept { return parents.empty(); }
    /// True where an axis begins: at the base, and at every child that does not continue its parent.
    [[nodiscard]] bool startsAxis(std::uint32_t segment) const noexcept
    {
        return parents[segment] == kNoSegment || continuations[parents[segment]] != segment;
    }
    void clear() noexcept;

    friend bool operator==(const Skeleton&, const Skeleton&) = default;
};

/// A stable hash of every array, bit for bit: the identity that golden files record.
[[nodiscard]] std::uint64_t hashOf(const Skeleton& skeleton) noexcept;

/// True if all segment arrays have equal length, no number is NaN or infinite, no length or radius negative, and every
/// index in range: parents before children, a continuation among the children.
[[nodiscard]] bool isSound(const Skeleton& skeleton) noexcept;

} // namespace espalier
