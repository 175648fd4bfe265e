#pragma once

#include <Espalier/Core/ChildLists.h>
#include <Espalier/Core/Vector.h>
#include <Espalier/Plant/Skeleton.h>
#include <cstdint>
#include <span>
#include <vector>

namespace espalier {

/// "None" among the indices of FitPaths.
inline constexpr std::uint32_t kNoPath = kNoParent;

/// A run of points from one branch point to the next, or to a tip.
struct Internode
{
    std::uint32_t first = 0;      ///< Of its points in FitPaths::points, that of its start included.
    std::uint32_t count = 0;      ///< At least 2; no two in a row are the same place.
    std::uint32_t firstChild = 0; ///< In FitPaths::children: what starts at its end,
    std::uint32_t childCount = 0; ///< the one that continues it first, then the others by what they carry.
    double length = 0;            ///< Metres, along it.
    double carried = 0;           ///< Metres: with all that hangs on it.
};

/// What begins in one place.
struct FitTree
{
    DVec3 origin{0};
    std::uint32_t firstChild = 0;
    std::uint32_t childCount = 0;
    std::uint32_t firstPoint = 0; ///< In FitPaths::points.
    std::uint32_t pointCount = 0;
};

/// A skeleton as internodes, parents before children.
struct FitPaths
{
    std::vector<DVec3> points;
    std::vector<Internode> internodes;
    std::vector<std::uint32_t> children; ///< Indices of internodes.
    std::vector<FitTree> trees;
    std::uint32_t segments = 0; ///< With a length.

    [[nodiscard]] std::span<const DVec3> pointsOf(const Internode& internode) const
    {
        return std::span(points).subspan(internode.first, internode.count);
    }
    /// Points of all internodes of a tree, its origin included.
    [[nodiscard]] std::span<const DVec3> pointsOf(const FitTree& tree) const
    {
        return std::span(points).subspan(tree.firstPoint, tree.pointCount);
    }
};

/// Requires a sound skeleton.
[[nodiscard]] FitPaths pathsOf(const Skeleton& skeleton);

/// Indices of the points of `line` that are needed to stay within `tolerance` of it, ends included (Douglas and
/// Peucker, The Canadian Cartographer 10 (1973), in runs of at most 1024 points so that the time is bounded).
[[nodiscard]] std::vector<std::uint32_t> neededPoints(std::span<const DVec3> line, double tolerance);

[[nodiscard]] double lengthOf(const DVec3& v);

/// From a point to a line of segments. Requires at least one point.
[[nodiscard]] double distanceTo(const DVec3& point, std::span<const DVec3> line);

} // namespace espalier
