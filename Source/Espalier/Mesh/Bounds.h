#pragma once

#include <Espalier/Plant/Skeleton.h>
#include <algorithm>
#include <cmath>
#include <cstdint>

namespace espalier {

/// `value` in [low, high]; NaN becomes `low`.
[[nodiscard]] inline float clampedTo(float value, float low, float high) noexcept
{
    return value > low ? std::min(value, high) : low;
}

/// True if no coordinate is larger than `limit`, either way.
[[nodiscard]] inline bool isWithin(const Vec3& v, float limit) noexcept
{
    return std::abs(v.x) <= limit && std::abs(v.y) <= limit && std::abs(v.z) <= limit;
}

/// True if no coordinate or radius of a segment is larger than `limit`.
[[nodiscard]] inline bool isWoodWithin(const Skeleton& skeleton, float limit) noexcept
{
    for (std::uint32_t i = 0; i < skeleton.size(); ++i)
        if (!isWithin(skeleton.starts[i], limit) || !isWithin(skeleton.ends[i], limit) ||
            skeleton.startRadii[i] > limit || skeleton.endRadii[i] > limit)
            return false;
    return true;
}

} // namespace espalier
