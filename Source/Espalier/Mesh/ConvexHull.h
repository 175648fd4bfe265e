#pragma once

#include <Espalier/Core/Vector.h>
#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace espalier {

/// A closed convex surface of triangles.
struct ConvexHull
{
    std::vector<Vec3> vertices;         ///< Metres.
    std::vector<std::uint32_t> indices; ///< Three a triangle, counter-clockwise seen from outside.
    float tolerance = 0;                ///< Metres: a point may lie so far outside of it, by rounding.
    float overreach = 0; ///< Metres: it reaches at most so far beyond the points' own hull; 0 unless reduced.

    void clear() noexcept;

    friend bool operator==(const ConvexHull&, const ConvexHull&) = default;
};

/// Why there is no hull.
enum class HullResult : std::uint8_t
{
    Ok,
    NoPoints,
    OnePlace,  ///< All points coincide.
    Collinear, ///< They lie on a line.
    Coplanar,  ///< They lie in a plane.
    NotFinite, ///< A coordinate is NaN, infinite or beyond 1e30.
};

/// What to tell people: "all points lie in a plane". Empty for Ok.
[[nodiscard]] std::string_view reasonOf(HullResult result) noexcept;

/// Memory that a hull needs in between; reuse it and nothing is allocated after warm-up. One per thread.
struct HullScratch
{
    using Point = std::array<std::int64_t, 3>; ///< In cells of the grid.
    struct Face
    {
        std::array<std::uint32_t, 3> corners{};    ///< Into points.
        std::array<std::uint32_t, 3> neighbours{}; ///< [k] beyond the edge from corner k to the next.
        Point normal{};                            ///< Outwards, twice the area long.
        std::int64_t offset = 0;                   ///< normal . x of its plane.
        std::uint32_t farthest = 0;                ///< Of the points outside.
        double distance = 0;                       ///< Of that one, cells; 0 if none is outside.
        std::uint32_t firstOutside = 0;            ///< Into next; the face's points, a chain.
        bool isAlive = true;
        bool isVisible = false;
    };
    struct Edge
    {
        std::uint32_t from = 0;
        std::uint32_t to = 0;
        std::uint32_t beyond = 0; ///< The face on its other side, that stays.
    };
    std::vector<Point> points;
    std::vector<Face> faces;
    std::vector<std::uint32_t> next; ///< Of each point, in the chain of the face that it is outside of.
    std::vector<std::uint32_t> visible;
    std::vector<std::uint32_t> orphans;
    std::vector<Edge> horizon;
    std::vector<std::uint32_t> faceFrom; ///< Of each point on the horizon: the new face at the edge that begins there.
    std::vector<std::uint32_t> indexOf;  ///< Of each point: its vertex.
};

/// Fills `hull` with the convex hull of `points`, of at most `mostVertices` vertices (at least 4).
///
/// Quickhull (Barber, Dobkin and Huhdanpaa, "The quickhull algorithm for convex hulls", ACM TOMS 22(4), 1996) over
/// points rounded to a grid of 2^19 cells across them, where all predicates are exact integers. The farthest point
/// comes first; if vertices run out, the hull of those so far is enlarged about a fixed middle until it holds all
/// points, and `overreach` bounds how far that goes. More vertices never overreach more.
///
/// Time grows with the points, and with the square of the hull's vertices. On failure `hull` is empty. Equal input
/// gives equal bytes. Safe to call concurrently on different scratches.
[[nodiscard]] HullResult convexHull(std::span<const Vec3> points, std::uint32_t mostVertices, HullScratch& scratch,
                                    ConvexHull& hull);

} // namespace espalier
