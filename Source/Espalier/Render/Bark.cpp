#include <Espalier/Render/Bark.h>

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

float smoothStep(float low, float high, float x)
{
    const float t = std::clamp((x - low) / (high - low), 0.0f, 1.0f);
    return t * t * (3 - 2 * t);
}

/// Height of the bark in [0, 1] at `uv`.
float barkHeight(Vec2 uv)
{
    const float waver = smoothNoise({uv.x * 4, uv.y * 2.3f}, 4) - 0.5f;
    const float plates = smoothNoise({uv.x * 13 + 1.3f * waver, uv.y * 1.5f + 7.3f}, 13);
    const float ridges = smoothNoise({uv.x * 23 + waver, uv.y * 3.3f + 1.9f}, 23);
    const float grain = smoothNoise({uv.x * 61, uv.y * 11.0f + 3.7f}, 61);
    // Furrows run where a smooth field crosses its middle: connected, wavering lines, as bark tears.
    const float furrow = smoothStep(0.0f, 0.34f, std::abs(2 * plates - 1));
    const float crack = smoothStep(0.0f, 0.5f, std::abs(2 * ridges - 1));
    return 0.55f * furrow + 0.27f * crack + 0.18f * grain;
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

BarkRelief barkRelief(Vec2 uv, Vec2 metresPerRepeat) noexcept
{
    constexpr float kDepth = 0.011f;       // metres from ridge to furrow of old bark
    constexpr float kStep = 0.004f;        // of a repeat: the finest grain is seven times as wide
    constexpr float kSmoothRepeat = 0.08f; // metres round a twig that shows no bark yet
    constexpr float kRoughRepeat = 0.45f;
    const float age = smoothStep(kSmoothRepeat, kRoughRepeat, metresPerRepeat.x);
    const float height = barkHeight(uv);
    BarkRelief relief;
    relief.shade = std::lerp(0.92f + 0.16f * height, 0.30f + 1.05f * height, age);
    if (age > 0)
    {
        relief.slope.x = (barkHeight({uv.x + kStep, uv.y}) - height) / (kStep * metresPerRepeat.x);
        relief.slope.y = (barkHeight({uv.x, uv.y + kStep}) - height) / (kStep * metresPerRepeat.y);
        relief.slope *= kDepth * age;
    }
    return relief;
}

} // namespace espalier
