#include <Espalier/Texture/TileNoise.h>

#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Core/Random.h>

namespace espalier {

TileNoise::TileNoise(std::uint32_t columns, std::uint32_t rows, std::uint64_t seed, std::uint32_t tall)
    : columns_(columns), rows_(rows * tall), perTall_(1 / static_cast<float>(tall)),
      gradients_(std::size_t{columns_} * rows_)
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

void TileNoise::addRow(float v, float strength, std::span<float> texels) const
{
    const CellPlace y = cellPlace(v * perTall_, rows_);
    const std::uint32_t above = y.cell + 1 == rows_ ? 0 : y.cell + 1;
    const Vec2* const low = gradients_.data() + std::size_t{y.cell} * columns_;
    const Vec2* const high = gradients_.data() + std::size_t{above} * columns_;
    const float sy = eased(y.inside);
    // Along a row, what a corner adds is a line: its slope, and its height at the corner.
    const auto lineOf = [&](std::uint32_t column) {
        const Vec2 bottom(low[column].x, low[column].y * y.inside);
        const Vec2 top(high[column].x, high[column].y * (y.inside - 1));
        return strength * (bottom + sy * (top - bottom));
    };
    const auto count = static_cast<std::uint32_t>(texels.size());
    const float step = static_cast<float>(columns_) / static_cast<float>(count);
    const auto firstIn = [&](std::uint32_t column) {
        const std::int64_t twice = 2 * std::int64_t{column} * count - columns_;
        return twice <= 0 ? 0u : static_cast<std::uint32_t>((twice + 2 * columns_ - 1) / (2 * columns_));
    };
    Vec2 right = lineOf(0);
    for (std::uint32_t column = 0; column < columns_; ++column)
    {
        const Vec2 left = right;
        right = lineOf(column + 1 == columns_ ? 0 : column + 1);
        const auto corner = static_cast<float>(column);
        const std::uint32_t end = firstIn(column + 1);
        for (std::uint32_t x = firstIn(column); x < end; ++x)
        {
            const float t = (static_cast<float>(x) + 0.5f) * step - corner;
            const float fromLeft = left.y + left.x * t;
            const float fromRight = right.y + right.x * (t - 1);
            texels[x] += fromLeft + (fromRight - fromLeft) * eased(t);
        }
    }
}

TileFractal::TileFractal(std::uint32_t columns, std::uint32_t rows, std::uint32_t octaves, std::uint64_t seed,
                         std::uint32_t tall)
{
    float sum = 0;
    float strength = 1;
    for (std::uint32_t i = 0; i < octaves; ++i)
    {
        octaves_.emplace_back(columns << i, rows << i, seed * 16 + i, tall);
        sum += strength;
        strength *= 0.5f;
    }
    strongest_ = 1.25f / sum;
}

TileCells::TileCells(std::uint32_t columns, std::uint32_t rowsInOne, float jitter, std::uint64_t seed,
                     std::uint32_t tall)
    : columns_(columns), rows_(rowsInOne * tall), perTall_(1 / static_cast<float>(tall)),
      points_(std::size_t{columns_ + 2} * (rows_ + 2))
{
    const std::uint32_t rows = rows_;
    const RandomKey key(Seed{seed});
    for (std::uint32_t row = 0; row < rows + 2; ++row)
        for (std::uint32_t column = 0; column < columns + 2; ++column)
        {
            const std::uint32_t cell = (row + rows - 1) % rows * columns + (column + columns - 1) % columns;
            const RandomKey own = key.child(cell);
            const double x = 0.5 + static_cast<double>(jitter) * (own.uniform(Purpose::Sampling, 0) - 0.5);
            const double y = 0.5 + static_cast<double>(jitter) * (own.uniform(Purpose::Sampling, 1) - 0.5);
            Point& point = points_[std::size_t{row} * (columns + 2) + column];
            point.middle = {static_cast<float>(x), static_cast<float>(y)};
            point.random = static_cast<float>(own.uniform(Purpose::Sampling, 2));
        }
}

} // namespace espalier
