#pragma once

#include <Espalier/Core/Vector.h>
#include <limits>
#include <span>

namespace espalier {

/// The directions of a camera that stands at `azimuth` and `elevation` (radians, as in RenderSettings) and looks at
/// what it photographs. Orthonormal; `right` is always level, so moving along it changes neither ground nor horizon.
struct ViewAxes
{
    DVec3 right;
    DVec3 up;
    DVec3 forward;
};

[[nodiscard]] ViewAxes viewAxes(double azimuth, double elevation) noexcept;

/// A pinhole camera.
struct Camera
{
    ViewAxes axes;
    DVec3 position{0};
    double slopeX = 0; ///< Tangent of half the horizontal field of view.
    double slopeY = 0; ///< Tangent of half the vertical field of view.
};

/// The part of a frame, each side counted from the centre line, that the subject may fill. (0, 1]
struct FrameMargins
{
    double side = 1;
    double top = 1;
    double bottom = 1;
};

/// Which cameras with given axes and lens see all points of a subject: a camera at (x, y, z) of the view axes does if
/// x - left * z >= `left` bound and so on for the four sides of its pyramid. Four numbers replace all points.
struct FrameBounds
{
    double left = -std::numeric_limits<double>::infinity();
    double right = -std::numeric_limits<double>::infinity();
    double bottom = -std::numeric_limits<double>::infinity();
    double top = -std::numeric_limits<double>::infinity();
};

/// The bounds of `points` seen from `lens` (its position is ignored), relative to `origin`.
[[nodiscard]] FrameBounds frameBounds(std::span<const Vec3> points, DVec3 origin, const Camera& lens,
                                      const FrameMargins& margins) noexcept;

/// Bounds that hold for both subjects, each of them centred from left to right on its own.
[[nodiscard]] FrameBounds together(const FrameBounds& a, const FrameBounds& b) noexcept;

/// Where in the view axes, relative to the subject's origin, the nearest camera stands that sees all of `bounds`.
/// What is left free goes half to each side, and mostly to the sky above.
[[nodiscard]] DVec3 nearestStand(const FrameBounds& bounds, const Camera& lens, const FrameMargins& margins) noexcept;

} // namespace espalier
