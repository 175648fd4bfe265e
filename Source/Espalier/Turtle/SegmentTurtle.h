#pragma once

#include <Espalier/Core/Error.h>
#include <Espalier/Core/Limits.h>
#include <Espalier/Core/Random.h>
#include <Espalier/Core/Vector.h>
#include <Espalier/Grammar/Derivation.h>
#include <Espalier/Turtle/Turtle.h>
#include <cstdint>
#include <functional>
#include <span>

namespace espalier {

/// A drawn segment and nothing else, for those who only want lines: previews, instancing, an engine's debug view.
struct TurtleSegment
{
    Vec3 start{0};    ///< Metres.
    float radius = 0; ///< Metres; half the turtle's diameter.
    Vec3 end{0};      ///< Metres.
    std::uint32_t parent =
        0xffffffffu; ///< The segment drawn before it on the way from the base; 0xffffffff at the base.
};
static_assert(sizeof(TurtleSegment) == 32);

/// How a word becomes segments.
enum class SegmentReuse : std::uint8_t
{
    /// Every symbol is carried out, so that the segments are those of a Turtle, bit for bit.
    Never,
    /// Where rules are fixed and nothing but position and direction is inherited, what an expansion of the same letter
    /// by as many steps has drawn is copied, turned and moved: several times faster, and off by some 1e-6 of the size.
    WhereItCan,
};

/// Called with the segments of a full buffer, which is then filled anew; false stops. Parents count from the first
/// segment of all.
using SegmentConsumer = std::function<bool(std::span<const TurtleSegment>)>;

/// Derives `program`, of which `alphabet` is, by `steps` steps (interpreted) and draws it into `buffer`; returns the
/// number of segments. Memory beyond the buffer is proportional to the depth of the derivation, for grammars without
/// contexts; where expansions are reused, some megabytes more at most. Polygons, spheres and organs draw nothing here,
/// and how many segments there may be is a matter of the buffer, not of Limits::nodes.
///
/// What is certain to exceed `limits` is refused before anything is drawn. Fails with Limit if the buffer is too small
/// and there is no `consumer`, or as streamWord and Turtle do; with Cancelled if the consumer stops it. What the buffer
/// then holds is not defined. With a consumer nothing is reused.
[[nodiscard]] Expected<std::size_t> drawSegments(const GrammarProgram& program, const TurtleAlphabet& alphabet,
                                                 RandomKey key, std::uint32_t steps, SegmentReuse reuse,
                                                 const Limits& limits, DerivationScratch& derivationScratch,
                                                 TurtleScratch& turtleScratch, std::span<TurtleSegment> buffer,
                                                 const SegmentConsumer& consumer = {});

} // namespace espalier
