#pragma once

#include <Espalier/Archetype/Archetype.h>
#include <Espalier/Core/Vector.h>
#include <Espalier/Inference/FitPaths.h>
#include <cstdint>
#include <span>
#include <vector>

namespace espalier {

[[nodiscard]] double degreesOf(double radians);

/// `value` shortened to so many significant digits.
[[nodiscard]] double significant(double value, int digits);

/// Where a turtle is turned: unit vectors at right angles, up = cross(heading, left). Its turns are the turtle's.
struct FitFrame
{
    DVec3 heading{0, 1, 0};
    DVec3 left{-1, 0, 0};
    DVec3 up{0, 0, 1};

    void turnLeft(double degrees);
    void pitchDown(double degrees);
    void rollRight(double degrees);
};

/// A bent line as a turtle draws it.
struct BentShape
{
    /// Before a step: a roll to the right and a turn to the left, degrees; then metres.
    struct Step
    {
        double roll;
        double turn;
        double length;
    };
    std::vector<Step> steps; ///< At least 2.
};

/// Some frame that looks along the first step of a line.
[[nodiscard]] FitFrame alongFirstStep(std::span<const DVec3> line);

/// The shape of `line` scaled by `scale`, drawn from `frame`. Turns are rounded to thousandths of a degree, lengths to
/// five digits.
[[nodiscard]] BentShape shapeOf(std::span<const DVec3> line, double scale, FitFrame frame);

/// The points of a shape drawn from the origin in the frame {X, Y, Z}, the first included, and the frame at its end.
struct DrawnShape
{
    std::vector<DVec3> points; ///< Along heading, left and up.
    FitFrame end;              ///< Likewise: heading.x is the part along the heading.
};
[[nodiscard]] DrawnShape drawn(const BentShape& shape);

/// The frame in which `shape`, scaled, leads from the first point of `line` to its last and lies as near as possible to
/// it in between: in the mean of squares, over points at equal parts of the lengths.
struct ShapePlacement
{
    FitFrame frame;
    double scaling = 1;
};
[[nodiscard]] ShapePlacement placeAlong(std::span<const DVec3> line, const DrawnShape& shape);

/// How far the placed shape and `line` are apart: the largest distance from a point of one to the other.
[[nodiscard]] double distanceBetween(std::span<const DVec3> line, const DrawnShape& shape,
                                     const ShapePlacement& placement);

/// A part of an internode that one bent piece can draw, or that is straight.
struct Stretch
{
    std::uint32_t internode = 0;
    std::uint32_t first = 0; ///< Among the needed points of the internode (neededPoints): it leads from this one
    std::uint32_t last = 0;  ///< to this one.

    [[nodiscard]] bool isBent() const { return last - first > 1; }
};

/// The stretches of all internodes, those of each in a row and as few as possible: nearly all have one.
struct Stretches
{
    std::vector<Stretch> all;
    std::vector<std::uint32_t> firstOf; ///< Of each internode; one more than there are.
};

using NeededPoints = std::vector<std::vector<std::uint32_t>>; ///< Of each internode.

/// Cuts where an internode has more points than a template should, or comes back to where it began: from there to
/// there is no direction to place it by.
[[nodiscard]] Stretches stretchesOf(const FitPaths& paths, const NeededPoints& needed);

/// All points of a stretch.
[[nodiscard]] std::span<const DVec3> pointsOf(const FitPaths& paths, const NeededPoints& needed,
                                              const Stretch& stretch);
/// Those that are needed.
[[nodiscard]] std::vector<DVec3> keptPointsOf(const FitPaths& paths, const NeededPoints& needed,
                                              const Stretch& stretch);

/// Which stretches share a bent shape.
struct ShapeClusters
{
    std::vector<std::uint32_t> shapeOf; ///< Of each stretch; kNoPath where it has none.
    std::vector<std::uint32_t> leaders; ///< Of each shape: the stretch that it is taken from.
};

/// Groups the bent stretches by shape: each joins an earlier one whose shape stays within `tolerance` of it, else it
/// leads a group of its own; the longest come first. Nothing has a shape where the tolerance is 0.
[[nodiscard]] ShapeClusters clusterShapes(const FitPaths& paths, const NeededPoints& needed, const Stretches& stretches,
                                          double tolerance);

} // namespace espalier
