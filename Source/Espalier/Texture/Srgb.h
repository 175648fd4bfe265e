#pragma once

#include <cstdint>

namespace espalier {

/// The byte that shows `linear`, clamped to [0, 1], in sRGB (IEC 61966-2-1); 0 for NaN.
[[nodiscard]] std::uint8_t srgbFromLinear(float linear) noexcept;

/// Light, in [0, 1], of a byte in sRGB.
[[nodiscard]] float linearFromSrgb(std::uint8_t srgb) noexcept;

} // namespace espalier
