#pragma once

#include <Espalier/Core/ChildLists.h>
#include <Espalier/Core/Error.h>
#include <Espalier/Core/Limits.h>
#include <Espalier/Core/Vector.h>
#include <Espalier/Plant/Skeleton.h>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

namespace espalier {

/// Which axis of a file points to the sky.
enum class UpAxis : std::uint8_t
{
    Y, ///< Taken as it stands.
    Z, ///< (x, y, z) becomes (x, z, -y).
};

/// How a foreign file's coordinates become metres of ours.
struct ImportSettings
{
    double scale = 1; ///< Metres per unit of the file, (0, inf): 1e-6 for a neuron in micrometres at its true size.
    UpAxis up = UpAxis::Y;
};

/// A skeleton as a foreign file gave it.
struct ImportedSkeleton
{
    /// With axes; the first root that something grows from stands at the origin. Radii where the file has them
    /// (Skeleton::widthsGiven), else 0.
    Skeleton skeleton;
    DVec3 origin{0};                  ///< Where that root stood in the file, in the file's units and axes.
    std::uint32_t points = 0;         ///< Samples or joints of the file.
    std::uint32_t roots = 0;          ///< Points without a parent.
    std::uint32_t repeatedPoints = 0; ///< At the place of their parent; they make no segment.
};

/// "No point": the parent of a root.
inline constexpr std::uint32_t kNoPoint = kNoParent;

/// Points that hang on each other, in any order: what foreign files of skeletons come to.
struct PointTree
{
    std::vector<DVec3> positions;       ///< In the file's units and axes.
    std::vector<std::uint32_t> parents; ///< kNoPoint at a root.
    std::vector<double> radii;          ///< In the file's units, >= 0; empty if the file has none.
    std::vector<bool> isBody; ///< A body that branches leave, such as the soma of a neuron: they do not begin with its
                              ///< radius. Empty: none is.
};

/// The points from the roots up, parents before children, siblings in the order of the arrays. Points that no root
/// reaches are missing, as they hang on a cycle.
[[nodiscard]] std::vector<std::uint32_t> depthFirstOrder(const PointTree& tree);

/// A point of a cycle, if there is one.
[[nodiscard]] std::optional<std::uint32_t> findCycle(const PointTree& tree);

/// A segment for each point that has a parent elsewhere, from there to it, depth first. It starts with its parent's
/// radius and ends with its own; a point at the place of its parent makes no segment, but what hangs on it starts with
/// its radius. Frames are carried from segment to segment by the smallest rotation, from the turtle's at the base.
/// Requires that no point hangs on a cycle, finite positions and, where there are radii, radii >= 0. Fails with Limit,
/// naming `file`, where a coordinate or radius in metres from the first root exceeds Limits::coordinate.
[[nodiscard]] Expected<ImportedSkeleton> skeletonOf(const PointTree& tree, const ImportSettings& settings,
                                                    std::string_view file, const Limits& limits);

} // namespace espalier
