#pragma once

#include <Espalier/Core/Vector.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

namespace espalier {

[[nodiscard]] inline float smoothStep(float low, float high, float x) noexcept
{
    const float t = std::clamp((x - low) / (high - low), 0.f, 1.f);
    return t * t * (3 - 2 * t);
}

/// Where x lies in a period that is cut into `count` cells.
struct CellPlace
{
    std::uint32_t cell; ///< [0, count)
    float inside;       ///< [0, 1)
};

/// x in periods, of any sign; |x| < 1e6.
[[nodiscard]] inline CellPlace cellPlace(float x, std::uint32_t count) noexcept
{
    const auto whole = static_cast<float>(static_cast<std::int32_t>(x));
    const float rest = x < whole ? x - whole + 1 : x - whole;
    const float scaled = rest * static_cast<float>(count);
    const auto cell = static_cast<std::uint32_t>(scaled);
    if (cell >= count) // rest was rounded up to 1
        return {0, 0};
    return {cell, scaled - static_cast<float>(cell)};
}

/// Smooth noise that repeats after 1 along u and after `tall` (a power of two) along v: gradient noise on a lattice of
/// columns by `tall` times rows. Mean 0, about [-1, 1]. (Perlin, "Improving Noise", SIGGRAPH 2002, with gradients of
/// all directions.)
class TileNoise
{
public:
    TileNoise(std::uint32_t columns, std::uint32_t rows, std::uint64_t seed, std::uint32_t tall = 1);

    [[nodiscard]] float at(Vec2 uv) const noexcept
    {
        const CellPlace x = cellPlace(uv.x, columns_);
        const CellPlace y = cellPlace(uv.y * perTall_, rows_);
        const std::uint32_t right = x.cell + 1 == columns_ ? 0 : x.cell + 1;
        const std::uint32_t above = y.cell + 1 == rows_ ? 0 : y.cell + 1;
        const Vec2* const low = gradients_.data() + std::size_t{y.cell} * columns_;
        const Vec2* const high = gradients_.data() + std::size_t{above} * columns_;
        const float a = low[x.cell].x * x.inside + low[x.cell].y * y.inside;
        const float b = low[right].x * (x.inside - 1) + low[right].y * y.inside;
        const float c = high[x.cell].x * x.inside + high[x.cell].y * (y.inside - 1);
        const float d = high[right].x * (x.inside - 1) + high[right].y * (y.inside - 1);
        const float sx = eased(x.inside);
        const float sy = eased(y.inside);
        const float bottom = a + (b - a) * sx;
        const float top = c + (d - c) * sx;
        return bottom + (top - bottom) * sy;
    }

    /// Adds strength times the noise at v and at the middles of texels that cut one repeat.
    void addRow(float v, float strength, std::span<float> texels) const;

private:
    static float eased(float t) noexcept { return t * t * t * (t * (t * 6 - 15) + 10); }

    std::uint32_t columns_;
    std::uint32_t rows_;          ///< In all.
    float perTall_;               ///< Repeats along v in 1.
    std::vector<Vec2> gradients_; ///< Of length sqrt 2.
};

/// Octaves of noise, each twice as fine as the one before and half as strong. About [-1, 1].
class TileFractal
{
public:
    TileFractal(std::uint32_t columns, std::uint32_t rows, std::uint32_t octaves, std::uint64_t seed,
                std::uint32_t tall = 1);

    [[nodiscard]] float at(Vec2 uv) const noexcept
    {
        float sum = 0;
        float strength = strongest_;
        for (const TileNoise& octave : octaves_)
        {
            sum += strength * octave.at(uv);
            strength *= 0.5f;
        }
        return sum;
    }

    void addRow(float v, float strength, std::span<float> texels) const
    {
        strength *= strongest_;
        for (const TileNoise& octave : octaves_)
        {
            octave.addRow(v, strength, texels);
            strength *= 0.5f;
        }
    }

private:
    float strongest_; ///< So that the strengths add up to 1.25: octaves seldom peak together.
    std::vector<TileNoise> octaves_;
};

/// Noise at v and at the middles of `count` texels that cut one repeat: much faster than one by one.
class NoiseRow
{
public:
    template <class Noise>
    NoiseRow(const Noise& noise, float v, std::uint32_t count) : values_(count)
    {
        noise.addRow(v, 1, values_);
    }

    [[nodiscard]] float operator[](std::size_t texel) const noexcept { return values_[texel]; }

private:
    std::vector<float> values_;
};

/// Irregular cells round jittered points of a lattice (Worley 1996), which repeat after 1 along u and after `tall` (a
/// power of two) along v.
class TileCells
{
public:
    /// `jitter` in [0, 1]: how far points leave the middles of their lattice cells, which also are three columns and
    /// rows or more. There are `tall` times `rows` rows in all.
    TileCells(std::uint32_t columns, std::uint32_t rows, float jitter, std::uint64_t seed, std::uint32_t tall = 1);

    /// A cell and its borders as seen from one point.
    struct Cell
    {
        Vec2 fromMiddle; ///< In lattice cells.
        float random;    ///< [0, 1), the cell's own.
    };

    /// The cell that uv lies in. `border(distance, steepness, random)` is called for each border of it that is nearer
    /// than `reach` (less than half a lattice cell): the distance in units of uv, 1 for one along the v axis to 0 for
    /// one along the u axis, and a random number in [0, 1) of this border, the same from either side.
    template <class Border>
    Cell visit(Vec2 uv, float reach, const Border& border) const noexcept
    {
        const CellPlace x = cellPlace(uv.x, columns_);
        const CellPlace y = cellPlace(uv.y * perTall_, rows_);
        const std::size_t stride = columns_ + 2;
        const Point* const around = points_.data() + y.cell * stride + x.cell; // the one to the lower left
        std::array<Vec2, 9> away;
        std::array<float, 9> squared;
        std::size_t nearest = 0;
        for (std::size_t i = 0; i < 9; ++i)
        {
            const Vec2 middle = around[i / 3 * stride + i % 3].middle;
            away[i] = {middle.x + static_cast<float>(i % 3) - 1 - x.inside,
                       middle.y + static_cast<float>(i / 3) - 1 - y.inside};
            squared[i] = away[i].x * away[i].x + away[i].y * away[i].y;
            if (squared[i] < squared[nearest])
                nearest = i;
        }
        const auto across = static_cast<float>(columns_);
        const float up = static_cast<float>(rows_) * perTall_;
        const float own = around[nearest / 3 * stride + nearest % 3].random;
        for (std::size_t i = 0; i < 9; ++i)
        {
            const float lead = 0.5f * (squared[i] - squared[nearest]);
            const float nx = (away[i].x - away[nearest].x) * across;
            const float ny = (away[i].y - away[nearest].y) * up;
            const float steepSquared = nx * nx + ny * ny;
            if (lead * lead >= reach * reach * steepSquared) // also the nearest itself
                continue;
            const float steep = std::sqrt(steepSquared);
            const float both = own + around[i / 3 * stride + i % 3].random;
            border(lead / steep, std::abs(nx) / steep, both >= 1 ? both - 1 : both);
        }
        return {{-away[nearest].x, -away[nearest].y}, own};
    }

private:
    struct Point
    {
        Vec2 middle; ///< In its lattice cell, [0, 1].
        float random;
    };

    std::uint32_t columns_;
    std::uint32_t rows_;        ///< In all.
    float perTall_;             ///< Repeats along v in 1.
    std::vector<Point> points_; ///< With a frame of one more on each side, from the other side.
};

} // namespace espalier
