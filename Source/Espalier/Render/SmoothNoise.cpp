#include <Espalier/Render/SmoothNoise.h>

#include <algorithm>
#include <cmath>

namespace espalier {

namespace {

constexpr std::uint32_t kWrap = 4096;

float latticeValue(std::uint32_t x, std::uint32_t y)
{
    std::uint32_t h = x * 0x9e3779b1u ^ y * 0x85ebca77u;
    h = (h ^ (h >> 15)) * 0x2c1b3c6du;
    h = (h ^ (h >> 12)) * 0x297a2d39u;
    return static_cast<float>((h ^ (h >> 15)) >> 8) * 0x1p-24f;
}

/// The remainder in [0, period), also for negative and huge numbers; 0 for infinite ones.
float wrapped(float x, std::uint32_t period)
{
    if (!std::isfinite(x))
        return 0;
    const auto size = static_cast<float>(period);
    const float rest = std::fmod(x, size);
    return rest < 0 ? std::min(rest + size, std::nextafter(size, 0.0f)) : rest;
}

} // namespace

float smoothNoise(Vec2 at, std::uint32_t period) noexcept
{
    const float x = wrapped(at.x, period);
    const float y = wrapped(at.y, kWrap);
    const auto column = static_cast<std::uint32_t>(x);
    const auto row = static_cast<std::uint32_t>(y);
    const float fx = x - static_cast<float>(column);
    const float fy = y - static_cast<float>(row);
    const float sx = fx * fx * (3 - 2 * fx);
    const float sy = fy * fy * (3 - 2 * fy);
    const std::uint32_t nextColumn = (column + 1) % period;
    const std::uint32_t nextRow = (row + 1) % kWrap;
    const float low = std::lerp(latticeValue(column, row), latticeValue(nextColumn, row), sx);
    const float high = std::lerp(latticeValue(column, nextRow), latticeValue(nextColumn, nextRow), sx);
    return std::lerp(low, high, sy);
}

} // namespace espalier
