#include <Espalier/Texture/TileNoise.h>

#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Core/Random.h>

namespace espalier {

TileNoise::TileNoise(std::uint32_t columns, std::uint32_t rows, std::uint64_t seed)
    : columns_(columns), rows_(rows), gradients_(std::size_t{columns} * rows)
{
    constexpr std::size_t kDirections = 64;
    constexpr double kLength = 1.4142135623730951;
    std::array<Vec2, kDirections> directions;
    for (std::size_t i = 0; i < kDirections; ++i)
    {
        const math::SinCos turn = math::sinCosDegrees(360.0 * static_cast<double>(i) / kDirections);
        directions[i] = {static_cast<float>(kLength * turn.cos), static_cast<float>(kLength * turn.sin)};
    }
    const RandomKey key(Seed{seed});
    for (std::size_t i = 0; i < gradients_.size(); ++i)
        gradients_[i] = directions[key.child(i).bits(Purpose::Sampling) % kDirections];
}

TileFractal::TileFractal(std::uint32_t columns, std::uint32_t rows, std::uint32_t octaves, std::uint64_t seed)
{
    float sum = 0;
    float strength = 1;
    for (std::uint32_t i = 0; i < octaves; ++i)
    {
        octaves_.emplace_back(columns << i, rows << i, seed * 16 + i);
        sum += strength;
        strength *= 0.5f;
    }
    strongest_ = 1.25f / sum;
}

TileCells::TileCells(std::uint32_t columns, std::uint32_t rows, float jitter, std::uint64_t seed)
    : columns_(columns), rows_(rows), points_(std::size_t{columns} * rows)
{
    const RandomKey key(Seed{seed});
    for (std::size_t i = 0; i < points_.size(); ++i)
    {
        const RandomKey own = key.child(i);
        const double x = own.uniform(Purpose::Sampling, 0);
        const double y = own.uniform(Purpose::Sampling, 1);
        points_[i].middle = {static_cast<float>(0.5 + jitter * (x - 0.5)),
                             static_cast<float>(0.5 + jitter * (y - 0.5))};
        points_[i].random = static_cast<float>(own.uniform(Purpose::Sampling, 2));
    }
}

} // namespace espalier
