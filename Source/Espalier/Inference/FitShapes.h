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

/// A bent line as a turtle draws it: straight on first, and the first bend to the left.
struct BentShape
{
    /// Before a step: a roll to the right and a turn to the left, degrees; then metres.
    struct Step
    {
        double roll;
        double turn;
        double length;
    };
    std::vector<Step> steps; ///< At least 2; the first neither rolls nor turns.
};

/// The shape of `line` scaled by `scale`, with turns rounded to thousandths of a degree, lengths to five digits.
[[nodiscard]] BentShape shapeOf(std::span<const DVec3> line, double scale);

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

/// Which internodes share a bent shape.
struct ShapeClusters
{
    std::vector<std::uint32_t> shapeOf; ///< Of each internode; kNoPath where it has none.
    std::vector<std::uint32_t> leaders; ///< Of each shape: the internode that it is taken from.
};

/// Groups the bent internodes by shape: each joins an earlier one whose shape stays within `tolerance` of it, else it
/// leads a group of its own; the longest come first. `needed` are the points of each that count (neededPoints).
[[nodiscard]] ShapeClusters clusterShapes(const FitPaths& paths, const std::vector<std::vector<std::uint32_t>>& needed,
                                          double tolerance);

} // namespace espalier
