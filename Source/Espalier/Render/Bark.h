#pragma once

#include <Espalier/Core/Vector.h>
#include <cstdint>

namespace espalier {

/// Smooth noise in [0, 1], 1/2 on average. Repeats in x after `period` (1..4096) and in y after 4096.
[[nodiscard]] float smoothNoise(Vec2 at, std::uint32_t period) noexcept;

/// What the picture shows of bark at one point, beyond its colour.
struct BarkRelief
{
    float shade = 1;  ///< Factor on the colour: dark in furrows, lighter on ridges, about 1 on average.
    Vec2 slope{0, 0}; ///< Of the surface along u and v, metres per metre.
};

/// Long ridges between furrows that wander along the axis, fade out and never close to a loop; cracks part the ridges
/// into plates. Drawn in texture space, repeating in u after 1. `metresPerRepeat` are the sizes of one repeat along u
/// and v where the point lies: slender twigs are smooth, and furrows widen and deepen with the girth.
[[nodiscard]] BarkRelief barkRelief(Vec2 uv, Vec2 metresPerRepeat) noexcept;

} // namespace espalier
