#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Core/Random.h>

#include <cassert>
#include <cmath>
#include <limits>
#include <utility>

namespace espalier {

namespace {

std::uint64_t highHalfOfProduct(std::uint64_t a, std::uint64_t b)
{
    const std::uint64_t aLow = a & 0xffffffffu;
    const std::uint64_t aHigh = a >> 32;
    const std::uint64_t bLow = b & 0xffffffffu;
    const std::uint64_t bHigh = b >> 32;
    const std::uint64_t middle = aHigh * bLow + ((aLow * bLow) >> 32);
    const std::uint64_t otherMiddle = aLow * bHigh + (middle & 0xffffffffu);
    return aHigh * bHigh + (middle >> 32) + (otherMiddle >> 32);
}

} // namespace

double RandomKey::uniform(Purpose purpose, double low, double high, std::uint32_t counter) const noexcept
{
    const double value = low + (high - low) * uniform(purpose, counter);
    return value < high ? value : low; // Rounding can reach `high`; an empty or NaN range ends here too.
}

double RandomKey::normal(Purpose purpose, double mean, double deviation, std::uint32_t counter) const noexcept
{
    // The second uniform has a purpose of its own, so that draws with other counters stay independent of it.
    const auto anglePurpose = static_cast<Purpose>(static_cast<std::uint32_t>(purpose) | 0x80000000u);
    const double nonZero = 1.0 - uniform(purpose, counter); // (0, 1]
    const double angle = 2.0 * math::kPi * uniform(anglePurpose, counter);
    return mean + deviation * (std::sqrt(-2.0 * math::log(nonZero)) * math::cos(angle));
}

std::uint64_t RandomKey::below(Purpose purpose, std::uint64_t count, std::uint32_t counter) const noexcept
{
    assert(count > 0);
    return highHalfOfProduct(bits(purpose, counter), count);
}

std::size_t weightedChoice(std::span<const double> weights, double uniform) noexcept
{
    double sum = 0;
    for (const double weight : weights)
        sum += weight > 0 ? weight : 0;

    // Finite weights can have an infinite sum; scaled by a power of two they keep their proportions.
    const double scale = sum <= std::numeric_limits<double>::max() ? 1.0 : 0x1p-64;
    if (scale != 1.0)
    {
        sum = 0;
        for (const double weight : weights)
            sum += weight > 0 ? weight * scale : 0;
    }

    const double target = uniform * sum;
    double reached = 0;
    std::size_t chosen = weights.size();
    for (std::size_t i = 0; i < weights.size(); ++i)
    {
        if (!(weights[i] > 0))
            continue;
        chosen = i; // Stays the answer if rounding keeps the last sum at or below the target.
        reached += weights[i] * scale;
        if (target < reached)
            break;
    }
    return chosen;
}

void permutation(std::span<std::uint32_t> indices, RandomKey key) noexcept
{
    for (std::size_t i = 0; i < indices.size(); ++i)
    {
        indices[i] = static_cast<std::uint32_t>(i);
        const std::uint64_t j = key.below(Purpose::Shuffle, i + 1, static_cast<std::uint32_t>(i));
        std::swap(indices[i], indices[j]);
    }
}

} // namespace espalier
