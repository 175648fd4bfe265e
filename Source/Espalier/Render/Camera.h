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
    double freeBelow = 0.3; ///< Share of the free height under the subject; a tree in the sky's middle seems to float.
};

/// Which cameras of given axes and lens see all points of a subject. Each side of a camera's pyramid is a plane through
/// it; the points only count by how far out they push the four planes. Metres along `right`, `-right` and so on, where
/// the planes meet the one through the subject's origin that faces the camera.
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
/// What is left free goes half to each side, and above and below as the margins say.
[[nodiscard]] DVec3 nearestStand(const FrameBounds& bounds, const Camera& lens, const FrameMargins& margins) noexcept;

} // namespace espalier
