#pragma once

#include <Espalier/Mesh/TubeMesher.h>
#include <span>

namespace espalier {

/// What planning one mesh of tubes works with.
struct TubePlan
{
    const Skeleton& skeleton;
    TubeSettings settings; ///< Clamped.
    AxisRounding rounding;
    const BarkAppearance& bark;
    float tile; ///< Metres round the wood, clamped.
    TubeScratch& scratch;

    /// How many times as thick a segment is as what grew.
    [[nodiscard]] float wideningOf(std::uint32_t segment) const
    {
        return settings.widening.empty() ? 1.0f : settings.widening[segment];
    }
};

/// Settings brought into their ranges.
[[nodiscard]] TubeSettings clamped(TubeSettings settings) noexcept;

/// True if `segment` starts where its parent ends, so that one can grow out of the other.
[[nodiscard]] bool isJoined(const Skeleton& skeleton, std::uint32_t segment) noexcept;

/// Cosine and sine of `sides` points on a circle, the first again at the end; made when they are first asked for. Good
/// until the next call.
[[nodiscard]] std::span<const Vec2> circleOf(std::uint32_t sides, TubeScratch& scratch);

/// Clears the plan and notes which segments bear branches.
void beginPlan(const TubePlan& plan);

/// Appends the tube that starts at `segment` to scratch.tubes, but for the sides of its rings. False if none does, or
/// if there is nothing to sweep.
[[nodiscard]] bool planTubeAt(const TubePlan& plan, std::uint32_t segment);

/// Finds the sides of all rings: who only counts does without.
void frameTubes(const TubePlan& plan);

} // namespace espalier
