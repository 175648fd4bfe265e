#pragma once

#include <Espalier/Core/Vector.h>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace espalier {

/// A corner of an axis before it is smoothed.
struct AxisJoint
{
    Vec3 position{0};        ///< Metres.
    float radius = 0;        ///< Metres.
    Vec3 tangent{0};         ///< Unit; the curve's direction here.
    float slope = 0;         ///< Of the radius along the axis.
    Vec3 direction{0};       ///< Unit, to the next joint.
    float length = 0;        ///< To the next joint, metres; positive.
    std::uint32_t piece = 0; ///< What leads from here to the next joint: the caller's number for it.
};

/// A point of a smoothed axis.
struct CurvePoint
{
    Vec3 position{0};        ///< Metres.
    float along = 0;         ///< Metres from the axis' start.
    Vec3 tangent{0};         ///< Unit.
    float radius = 0;        ///< Metres.
    float slope = 0;         ///< d radius / d along.
    std::uint32_t piece = 0; ///< That it lies on; a joint lies on the one before it.
};

/// How an axis begins.
struct AxisStart
{
    Vec3 tangent{0}; ///< Unit.
    float reach = 0; ///< Metres; the tangent bends the first segment as it would beside a neighbour of this length.
};

/// How an axis is rounded.
struct AxisRounding
{
    float smoothing = 1;  ///< 0 straight segments, 1 a smooth curve.
    float cosMaxTurn = 1; ///< Cosine of the angle that the curve may turn by from one point to the next.
};

/// True if `b` may follow `a` as a joint: nearer ones, within a micrometre or a few roundings of their coordinates, are
/// one place, for the way between them has no reliable direction.
[[nodiscard]] bool areApart(const Vec3& a, const Vec3& b) noexcept;

/// Replaces `points` by points of the curve through `joints`: every joint, and as many between two of them as keep its
/// turns small. Positions and radii of the joints are given, the rest of them is filled in; neighbours must be
/// apart and there must be two or more.
///
/// The curve is a cubic between two joints, with one direction at each but lengths of tangent that shrink beside short
/// neighbours and in sharp corners, so that it never swings out. Radii follow a monotone cubic: no bumps.
void sampleAxis(const AxisStart& start, const AxisRounding& rounding, std::vector<AxisJoint>& joints,
                std::vector<CurvePoint>& points);

/// The point `along` the curve, between its neighbours `a` and `b`.
[[nodiscard]] CurvePoint pointBetween(const CurvePoint& a, const CurvePoint& b, float along) noexcept;

} // namespace espalier
