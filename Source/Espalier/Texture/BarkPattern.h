#pragma once

#include <Espalier/Core/Vector.h>
#include <Espalier/Texture/SurfaceMaps.h>
#include <cmath>
#include <cstdint>
#include <vector>

namespace espalier {

/// Texels of a tile of bark. Patterns are drawn in widths of it: u in [0, 1], v in [0, tall].
struct BarkSize
{
    std::uint32_t width = 0;
    std::uint32_t tall = 1; ///< How many times as high as wide; a power of two.

    [[nodiscard]] std::uint32_t height() const noexcept { return width * tall; }
};

/// A kind of bark before an appearance gives it colour, roughness and relief. Repeats in both directions.
struct BarkPattern
{
    Field height; ///< [0, 1], deepest to highest.
    std::vector<Vec3>
        colour;        ///< Light that each texel reflects, relative to others; >= 0, without the shade of cavities.
    Field roughness;   ///< Relative to others; > 0.
    float shading = 1; ///< How much darker cavities are: 0 not at all.

    explicit BarkPattern(BarkSize size)
        : height(size.width, size.height()), colour(height.values.size()), roughness(size.width, size.height(), 1)
    {}
};

/// Each kind draws all of a pattern of any size; `threads` as in makeBarkTextures.
[[nodiscard]] BarkPattern furrowedBark(BarkSize size, std::uint32_t threads);
[[nodiscard]] BarkPattern paperyBark(BarkSize size, std::uint32_t threads);
[[nodiscard]] BarkPattern scalyBark(BarkSize size, std::uint32_t threads);
[[nodiscard]] BarkPattern ringedBark(BarkSize size, std::uint32_t threads);
[[nodiscard]] BarkPattern smoothBark(BarkSize size, std::uint32_t threads);

/// A row of texels of a tile.
struct BarkRow
{
    std::uint32_t width;
    std::uint32_t y; ///< From the top.
    float v;         ///< From the foot, at the middles of its texels.

    [[nodiscard]] std::size_t index(std::uint32_t x) const noexcept { return std::size_t{y} * width + x; }
    [[nodiscard]] Vec2 uv(std::uint32_t x) const noexcept
    {
        return {(static_cast<float>(x) + 0.5f) / static_cast<float>(width), v};
    }
};

/// Calls draw(row) for each row of a tile, on several threads.
template <class Draw>
void forEachBarkRow(BarkSize size, std::uint32_t threads, const Draw& draw)
{
    const auto top = static_cast<float>(size.tall);
    forEachRow(size.height(), threads, [&](std::uint32_t y) {
        draw(BarkRow{size.width, y, top - (static_cast<float>(y) + 0.5f) / static_cast<float>(size.width)});
    });
}

/// Calls texel(index, local) for each texel of the box round `middle`, which may reach over the edges of the tile;
/// local is in [-1, 1], in units of `half`, up and to the right. Requires: 0 < half < 0.5.
template <class Texel>
void forEachTexelRound(BarkSize size, Vec2 middle, Vec2 half, const Texel& texel)
{
    const auto side = static_cast<float>(size.width);
    const auto tall = static_cast<float>(size.tall);
    const auto wide = static_cast<std::int32_t>(size.width);
    const auto high = static_cast<std::int32_t>(size.height());
    const auto left = static_cast<std::int32_t>(std::floor((middle.x - half.x) * side));
    const auto right = static_cast<std::int32_t>(std::floor((middle.x + half.x) * side));
    const auto top = static_cast<std::int32_t>(std::floor((tall - middle.y - half.y) * side));
    const auto bottom = static_cast<std::int32_t>(std::floor((tall - middle.y + half.y) * side));
    for (std::int32_t y = top; y <= bottom; ++y)
    {
        const float up = (tall - (static_cast<float>(y) + 0.5f) / side - middle.y) / half.y;
        const std::size_t row = static_cast<std::size_t>((y % high + high) % high) * size.width;
        for (std::int32_t x = left; x <= right; ++x)
        {
            const float along = ((static_cast<float>(x) + 0.5f) / side - middle.x) / half.x;
            texel(row + static_cast<std::size_t>((x % wide + wide) % wide), Vec2(along, up));
        }
    }
}

[[nodiscard]] inline float mixed(float a, float b, float share) noexcept
{
    return a + (b - a) * share;
}

[[nodiscard]] inline Vec3 mixed(Vec3 a, Vec3 b, float share) noexcept
{
    return a + (b - a) * share;
}

} // namespace espalier
