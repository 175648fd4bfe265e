#pragma once

#include <Espalier/Core/Vector.h>
#include <Espalier/Mesh/SheetTriangulation.h>
#include <array>
#include <cstdint>
#include <vector>

namespace espalier {

inline constexpr std::uint32_t kNoSheet = 0xffffffffu;

// Where branches are welded in, a tube is no longer a grid of rings: it is a sheet, whose rows go all round as rings
// do, with bands between some of them that are cut into triangles round the branches' feet. All of its points lie on
// the facets that the tube's rings would have.

/// A place on a tube: between two rings, and two columns of vertices.
struct SheetPoint
{
    std::uint32_t ring = 0;   ///< Of the tube.
    std::uint32_t column = 0; ///< [0, sides)
    float rise = 0;           ///< Share of the way to the next ring. [0, 1)
    float share = 0;          ///< Share of the way to the next column. [0, 1)
};

/// A line round a tube.
struct SheetRow
{
    std::uint32_t ring = 0; ///< Of the tube.
    float rise = 0;         ///< Share of the way to the next ring. [0, 1)
};

/// Triangles between two rows.
struct SheetBand
{
    std::uint32_t lowerRow = 0; ///< Of its sheet; the next one is the band's upper end.
    std::uint32_t firstPoint = 0;
    std::uint32_t pointCount = 0; ///< Feet first, each in the order of its branch's columns.
    std::uint32_t firstCopy = 0;
    std::uint32_t copyCount = 0; ///< Points that are also needed a turn further on, where u starts anew.
    std::uint32_t firstCorner = 0;
    std::uint32_t firstVertex = 0; ///< Of the mesh, once it is written.
    std::uint32_t cornerCount = 0; ///< Each numbers: lower row's vertices, upper row's, points, copies.
};

/// A tube with branches welded in.
struct TubeSheet
{
    std::uint32_t firstRow = 0;
    std::uint32_t rowCount = 0;
    std::uint32_t firstBand = 0;
    std::uint32_t bandCount = 0;
    std::uint32_t firstFoot = 0;
    std::uint32_t footCount = 0; ///< Lost ones included.
};

/// A column of vertices while a band is filled from below.
struct SheetColumn
{
    std::uint32_t point = 0; ///< The last one on it.
    double along = 0;        ///< Where that is, metres.
    double coveredTo = 0;    ///< Up to where feet stand on it, metres.
};

/// Where a branch stands on the tube that it grows out of.
struct TubeFoot
{
    std::uint32_t tube = 0;        ///< The branch.
    std::uint32_t host = 0;        ///< What it stands on.
    std::uint32_t firstOffset = 0; ///< Of its outline, one for each of its sides.
    std::uint32_t count = 0;
    double angle = 0;  ///< Of its middle, radians round the host.
    double along = 0;  ///< Of its middle, metres along the host.
    double radius = 0; ///< The host's there, metres.
    double size = 0;   ///< How far its outline reached from the middle before it made room, metres.
    double low = 0;    ///< How far its outline reaches along the host, metres.
    double high = 0;
    std::uint32_t firstPoint = 0;  ///< Into SheetPlan::points.
    std::uint32_t firstVertex = 0; ///< Of the mesh, once the host is written.
    std::uint32_t band = 0;
    bool isLost = false; ///< There is no room for it.
};

/// What welding plans, and the memory it needs in between.
struct SheetPlan
{
    std::vector<std::uint32_t> tubeOf; ///< For each segment of the skeleton, kNoSheet where it has none.
    std::vector<TubeFoot> feet;        ///< By host, then by place along it.
    std::vector<DVec2> offsets;        ///< Outlines from their middles: radians round the host, metres along it.
    std::vector<TubeSheet> sheets;
    std::vector<SheetRow> rows;
    std::vector<SheetBand> bands;
    std::vector<SheetPoint> points;
    std::vector<std::uint32_t> copies;  ///< Points of their bands.
    std::vector<std::uint32_t> corners; ///< Three a triangle.
    SheetTriangulation triangulation;
    std::vector<std::uint32_t> loop;
    std::vector<std::uint32_t> order;
    std::vector<std::array<std::uint32_t, 2>> lines; ///< Sides along columns.
    std::vector<SheetColumn> columns;
    std::vector<double> levels;
    std::vector<std::uint32_t> numbers;
    std::vector<DVec2> wishes;
};

} // namespace espalier
