#pragma once

#include <cstdint>
#include <span>

namespace espalier {

/// What makes one individual. The same species and seed give the same tree, bit for bit, everywhere.
struct Seed
{
    std::uint64_t value = 0;
    friend bool operator==(Seed, Seed) = default;
};

/// What a random value is for. Values of different purposes at one place are independent.
/// The numbers are part of the file format: they never change and are never reused.
enum class Purpose : std::uint32_t
{
    ChooseProduction = 1,
    DrawTransform = 2,
    Expression = 3, ///< rand() and normal() inside expressions.
    Shuffle = 4,
    Sampling = 5, ///< Rays of a picture, probes of a test.
    SmoothTransform = 6,
    Foliage = 7, ///< Where leaves are missing, and how each differs from the next.
};

/// A place in a tree of choices under a seed: randomness is a pure function of (seed, path, purpose, counter).
///
/// The path is the sequence of child indices from the root, folded into 64 bits as one walks. There is no generator
/// state, so results do not depend on traversal order or threads, and cutting a branch leaves the others as they were.
/// Two places collide with probability 2^-64. A value type: copy freely, use from any thread.
class RandomKey
{
public:
    explicit constexpr RandomKey(Seed seed) noexcept : key_(mix(seed.value + 0x9e3779b97f4a7c15u)) {}

    /// The place reached by taking child `index` from here.
    [[nodiscard]] constexpr RandomKey child(std::uint64_t index) const noexcept
    {
        RandomKey result = *this;
        result.key_ = mix(key_ ^ mix(index + 0xd1b54a32d192ed03u));
        return result;
    }

    /// 64 independent fair bits. `counter` numbers several draws for one purpose at one place.
    [[nodiscard]] constexpr std::uint64_t bits(Purpose purpose, std::uint32_t counter = 0) const noexcept
    {
        const std::uint64_t word = (static_cast<std::uint64_t>(purpose) << 32) | counter;
        return mix(mix(key_ + 0x8cb92ba72f3d8dd7u * (word + 1)) ^ key_);
    }

    /// Uniform in [0, 1), all multiples of 2^-53 equally likely.
    [[nodiscard]] constexpr double uniform(Purpose purpose, std::uint32_t counter = 0) const noexcept
    {
        return static_cast<double>(bits(purpose, counter) >> 11) * 0x1p-53;
    }

    /// Uniform in [low, high); `low` if the range is empty.
    [[nodiscard]] double uniform(Purpose purpose, double low, double high, std::uint32_t counter = 0) const noexcept;

    /// Normal deviate by inversion-free Box-Muller over two uniforms; |result - mean| <= 8.6 deviations.
    [[nodiscard]] double normal(Purpose purpose, double mean, double deviation,
                                std::uint32_t counter = 0) const noexcept;

    /// Uniform in [0, count), without modulo bias (bias below 2^-64 * count). Requires count > 0.
    [[nodiscard]] std::uint64_t below(Purpose purpose, std::uint64_t count, std::uint32_t counter = 0) const noexcept;

    /// The folded path itself, for hashes and messages.
    [[nodiscard]] constexpr std::uint64_t value() const noexcept { return key_; }

private:
    // The finaliser of a 64-bit multiply-xorshift hash (constants: D. Stafford, "Better bit mixing", variant 13).
    static constexpr std::uint64_t mix(std::uint64_t x) noexcept
    {
        x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
        x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
        return x ^ (x >> 31);
    }

    std::uint64_t key_;
};

/// Index chosen with probability proportional to `weights`, for `uniform` in [0, 1).
/// Weights are >= 0; entries of weight 0 are never chosen. Returns weights.size() when the sum is not positive.
[[nodiscard]] std::size_t weightedChoice(std::span<const double> weights, double uniform) noexcept;

/// Fills `indices` with a uniformly random order of 0, 1, ..., size-1 (Fisher-Yates).
void permutation(std::span<std::uint32_t> indices, RandomKey key) noexcept;

} // namespace espalier
