#pragma once

#include <bit>
#include <cstdint>

namespace espalier {

/// The bits of the IEEE 754 half nearest to `value`, ties to even. Requires: less than 65520 in magnitude, so that it
/// rounds to no infinity.
[[nodiscard]] inline std::uint16_t halfOf(float value) noexcept
{
    const auto bits = std::bit_cast<std::uint32_t>(value);
    const std::uint32_t sign = bits >> 16 & 0x8000u;
    const std::uint32_t magnitude = bits & 0x7fffffffu;
    constexpr std::uint32_t kSmallestNormal = 113u << 23; // 2^-14
    if (magnitude < kSmallestNormal)
    {
        // Steps of 2^-24: adding 0.5 lets the processor's own rounding, to even, find the nearest.
        const float shifted = std::bit_cast<float>(magnitude) + 0.5f;
        return static_cast<std::uint16_t>(sign | (std::bit_cast<std::uint32_t>(shifted) - (126u << 23)));
    }
    const std::uint32_t odd = magnitude >> 13 & 1u;
    const std::uint32_t rounded = magnitude + 0xfffu + odd - ((127u - 15u) << 23);
    return static_cast<std::uint16_t>(sign | rounded >> 13);
}

} // namespace espalier
