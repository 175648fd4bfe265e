#include <Espalier/Render/Camera.h>

#include <Espalier/Core/DeterministicMath.h>
#include <algorithm>

namespace espalier {

ViewAxes viewAxes(double azimuth, double elevation) noexcept
{
    const auto [sinAzimuth, cosAzimuth] = math::sinCos(azimuth);
    const auto [sinElevation, cosElevation] = math::sinCos(elevation);
    const DVec3 right(cosAzimuth, 0.0, -sinAzimuth);
    const DVec3 forward(-sinAzimuth * cosElevation, -sinElevation, -cosAzimuth * cosElevation);
    return {right, glm::cross(right, forward), forward};
}

FrameBounds frameBounds(std::span<const Vec3> points, DVec3 origin, const Camera& lens,
                        const FrameMargins& margins) noexcept
{
    const double side = lens.slopeX * margins.side;
    const double above = lens.slopeY * margins.top;
    const double below = lens.slopeY * margins.bottom;
    FrameBounds bounds;
    for (const Vec3 point : points)
    {
        const DVec3 p = DVec3(point) - origin;
        const double x = glm::dot(p, lens.axes.right);
        const double y = glm::dot(p, lens.axes.up);
        const double z = glm::dot(p, lens.axes.forward);
        bounds.right = std::max(bounds.right, x - side * z);
        bounds.left = std::max(bounds.left, -x - side * z);
        bounds.top = std::max(bounds.top, y - above * z);
        bounds.bottom = std::max(bounds.bottom, -y - below * z);
    }
    return bounds;
}

FrameBounds together(const FrameBounds& a, const FrameBounds& b) noexcept
{
    // A centred subject needs half of left + right on either side.
    const double half = std::max(a.left + a.right, b.left + b.right) / 2;
    return {.left = half, .right = half, .bottom = std::max(a.bottom, b.bottom), .top = std::max(a.top, b.top)};
}

DVec3 nearestStand(const FrameBounds& bounds, const Camera& lens, const FrameMargins& margins) noexcept
{
    const double side = lens.slopeX * margins.side;
    const double above = lens.slopeY * margins.top;
    const double below = lens.slopeY * margins.bottom;
    const double z =
        std::min(-(bounds.left + bounds.right) / (2 * side), -(bounds.top + bounds.bottom) / (above + below));
    const double lowest = bounds.top + above * z;
    const double highest = -bounds.bottom - below * z;
    return {(bounds.right - bounds.left) / 2, highest + (lowest - highest) * margins.freeBelow, z};
}

} // namespace espalier
