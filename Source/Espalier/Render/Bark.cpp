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

constexpr std::uint32_t kRidges = 14; // in one repeat round the axis

/// Where `uv` lies across the ridges: furrows run at whole numbers, all along the axis. The shifts change by less than
/// kRidges per repeat round the axis (1.5 * frequency * amplitude each), so that the sum always grows: furrows wander,
/// but close no loops.
float acrossRidges(Vec2 uv)
{
    const float wander = smoothNoise({uv.x * 2, uv.y * 0.9f}, 2) - 0.5f;
    const float wobble = smoothNoise({uv.x * 7, uv.y * 3.1f + 5.3f}, 7) - 0.5f;
    const float tear = smoothNoise({uv.x * 28, uv.y * 17 + 2.1f}, 28) - 0.5f;
    return uv.x * static_cast<float>(kRidges) + 1.8f * wander + 0.5f * wobble + 0.07f * tear;
}

/// Height of the bark in [0, 1] at `uv`; `age` in [0, 1] widens the furrows.
float barkHeight(Vec2 at, float age)
{
    const Vec2 uv(wrapped(at.x, 1), wrapped(at.y, kWrap));
    const float across = acrossRidges(uv);
    const float furrow = std::floor(across + 0.5f); // the nearest one
    const float distance = std::abs(across - furrow);
    // Furrows deepen and fade out along their way, which breaks and joins the ridges between them.
    const float depth = smoothStep(0.22f, 0.62f, smoothNoise({furrow + 1, uv.y * 1.7f}, kRidges));
    const float width = std::lerp(0.12f, 0.2f + 0.22f * depth, age);
    const float ridge = smoothStep(0.15f * width, width, distance);

    // Cracks across a ridge part it into plates, at heights of its own.
    const float number = std::floor(across) + 1;
    const auto column = static_cast<std::uint32_t>(wrapped(number, kRidges));
    const float slant = 0.5f * (across - std::floor(across)) * (2 * latticeValue(column, 7919) - 1);
    const float along = uv.y * 4.2f + 4 * latticeValue(column, 4801) + slant;
    const float crackAt = std::floor(along + 0.5f);
    const float open = latticeValue(column, static_cast<std::uint32_t>(crackAt) + 9973);
    const float crack = open * open * (1 - smoothStep(0, 0.17f, std::abs(along - crackAt))) * ridge;

    const float grain = smoothNoise({4 * across, uv.y * 19 + 3.7f}, 4 * kRidges);
    return std::max(0.0f, std::lerp(1.0f, ridge, 0.42f + 0.58f * depth) * 0.74f - 0.42f * crack + 0.26f * grain);
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
    const float height = barkHeight(uv, age);
    BarkRelief relief;
    relief.shade = std::lerp(0.92f + 0.16f * height, 0.33f + 1.05f * height, age);
    if (age > 0)
    {
        relief.slope.x = (barkHeight({uv.x + kStep, uv.y}, age) - height) / (kStep * metresPerRepeat.x);
        relief.slope.y = (barkHeight({uv.x, uv.y + kStep}, age) - height) / (kStep * metresPerRepeat.y);
        relief.slope *= kDepth * age;
    }
    return relief;
}

} // namespace espalier
