#pragma once

#include <Espalier/Archetype/Archetype.h>
#include <Espalier/Core/Error.h>
#include <Espalier/Core/Limits.h>
#include <Espalier/Plant/Skeleton.h>
#include <cstdint>
#include <optional>
#include <string>

namespace espalier {

/// How closely a skeleton is followed, and with how many templates.
struct FitSettings
{
    /// Metres: how far the archetype may lie from the skeleton anywhere, [0, inf). Larger leaves out more points of
    /// bent branches; 0 keeps every point. Coordinates are floats, so some 1e-7 of the size remain whatever it is.
    /// Default: 2 % of the mean length between two branch points, but at most half the mean length of a segment and
    /// 0.2 % of the size.
    std::optional<double> tolerance{};

    /// At most so many templates, [1, 1024], apart from the joints at a base with several branches and at points with
    /// more than 24; then only bent pieces that recur have templates of their own, others are chains of straight ones,
    /// and where still fewer are wanted one with an anchor more stands in. Default: as many as there are shapes.
    std::optional<std::uint32_t> templates{};

    std::string libraryName = "fitted.templates"; ///< Archetype::libraryName.
};

/// What a fit came to.
struct FitReport
{
    std::uint32_t segments = 0;   ///< Of the skeleton, with a length.
    std::uint32_t internodes = 0; ///< Between branch points, bases and tips.
    std::uint32_t trees = 0;      ///< Of the archetype: one for each place where the skeleton begins.
    std::uint32_t templates = 0;
    std::uint32_t instances = 0;
    std::uint32_t depth = 0;    ///< Nested instances.
    double size = 0;            ///< Metres: the diagonal of the box around the largest tree.
    double tolerance = 0;       ///< Metres: as given, or chosen.
    double largestDistance = 0; ///< Metres, measured on the drawn archetype (fitArchetype).
    double meanDistance = 0;    ///< Metres: over all points that were compared.
};

struct FittedArchetype
{
    Archetype archetype; ///< With its library.
    FitReport report;
};

/// Makes an archetype that draws `skeleton` within a tolerance, and the templates it is made of.
///
/// The skeleton is cut at its branch points. At each, the child that carries the longest branches continues, at the
/// last anchor, Z; the others stand in brackets before it, A, B, C, ... by what they carry. So brackets nest no deeper
/// than log2 of the number of branches. Between branch points lie internodes. Points that are needed for half the
/// tolerance are kept (Douglas-Peucker, in runs of at most 1024 points); straight pieces become instances of F with as
/// many anchors as branches start at their end. A bent internode is one instance of a template with its bends; those
/// whose shape recurs, whichever way it is turned and scaled, share one. It is cut only where it has more than 96 bends
/// or comes back to its start. With a tolerance of 0, or more shapes than templates, it is a chain of straight pieces.
///
/// A straight piece is placed by its roll about the direction of its parent and its rotation away from it, 0 to 180
/// degrees; in a plant that lies in an upright plane all rolls are 0 and rotations turn left or right. A bent piece
/// has three angles: roll and rotation of its first step and, as branching angle, a turn about that. Where a piece goes
/// on straight, its roll puts its first side branch to the left. Equal branches get equal numbers, as long as what
/// rounding leaves stays within a quarter of the tolerance; where it does not, a piece leads from where the drawing has
/// come to back to the skeleton.
///
/// Segments that start away from their parent's end are led there by a piece. Segments without a length are left out.
/// Each place where the skeleton begins gives a tree of its own, moved to the origin; several branches that begin in
/// one place are one tree, on a joint: a template that draws nothing. Where there are more branches than letters, the
/// last side anchor has a joint with the others. Widths are not kept: an archetype has none, the pipe model gives them.
///
/// The report measures what ArchetypeDrawer draws: from each point of the skeleton to its piece of the drawing, and
/// from each end of a drawn segment to its piece of the skeleton; branch points and tips to what stands for them.
///
/// Deterministic; time is proportional to n log n. Fails with BadInput if the skeleton is not sound, has no segment
/// with a length, or a setting is out of range; with Limit above Limits::inferredNodes segments.
[[nodiscard]] Expected<FittedArchetype> fitArchetype(const Skeleton& skeleton, const FitSettings& settings = {},
                                                     const Limits& limits = {});

} // namespace espalier
