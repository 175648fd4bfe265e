#pragma once

#include <Espalier/Core/Vector.h>
#include <cstdint>

namespace espalier {

/// Smooth noise in [0, 1], 1/2 on average. Repeats in x after `period` (1..4096) and in y after 4096.
[[nodiscard]] float smoothNoise(Vec2 at, std::uint32_t period) noexcept;

} // namespace espalier
