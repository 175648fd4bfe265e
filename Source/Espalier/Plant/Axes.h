#pragma once

namespace espalier {

struct Skeleton;

/// How radii follow from what a branch carries.
///
/// Leonardo's rule as the pipe model states it (Shinozaki et al. 1964): every tip is a pipe of the tip radius, and
/// where branches join, r^e = r1^e + r2^e + ... A segment starts with the radius of all it carries, itself included,
/// and narrows to that of its continuation.
struct PipeModel
{
    float tipRadius = 0.008f;  ///< Metres, (0, 1]. The start radius of the last segment of a twig.
    float exponent = 2.0f;     ///< [1, 4]. 2 keeps the cross section (Leonardo); larger makes trunks thinner.
    float pipesPerMetre = 0.f; ///< [0, 1000]. Pipes that join along a shoot (its leaves), so that long shoots taper.

    friend bool operator==(const PipeModel&, const PipeModel&) = default;
};

/// Fills `startRadii`, `endRadii`, `continuations` and `orders` from the segments and their parents.
///
/// Radii come from the pipe model, unless the turtle was given widths: then a segment starts with its own width and
/// ends with its continuation's. The continuation is the thickest child; among equals the one that turns least, then
/// the first. At a tip, the end radius is half the start radius. Linear time; deterministic.
void completeAxes(Skeleton& skeleton, const PipeModel& pipes);

/// Pipes in proportion to a plant whose radii nobody has said anything about, so that a plant of metres and one of
/// centimetres both look right: the tip radius is 3 % of the median length of its last segments, and the exponent the
/// one in [1.8, 2.6] that brings the trunk nearest to a radius of 3.3 % of the height, as a grown oak has. Where few
/// tips leave the trunk below 2 %, the tips are up to three times as thick.
[[nodiscard]] PipeModel suggestPipes(const Skeleton& skeleton);

} // namespace espalier
