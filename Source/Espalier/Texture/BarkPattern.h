#pragma once

#include <Espalier/Core/Vector.h>
#include <Espalier/Texture/SurfaceMaps.h>
#include <cmath>
#include <cstdint>
#include <vector>

namespace espalier {

/// A kind of bark before an appearance gives it colour, roughness and relief. Repeats in both directions.
struct BarkPattern
{
    Field height; ///< [0, 1], deepest to highest.
    std::vector<Vec3>
        colour;        ///< Light that each texel reflects, relative to others; >= 0, without the shade of cavities.
    Field roughness;   ///< Relative to others; > 0.
    float shading = 1; ///< How much darker cavities are: 0 not at all.

    explicit BarkPattern(std::uint32_t size)
        : height(size, size), colour(height.values.size()), roughness(size, size, 1)
    {}
};

/// Each kind draws all of a pattern of any size; `threads` as in makeBarkTextures.
[[nodiscard]] BarkPattern furrowedBark(std::uint32_t size, std::uint32_t threads);
[[nodiscard]] BarkPattern paperyBark(std::uint32_t size, std::uint32_t threads);
[[nodiscard]] BarkPattern scalyBark(std::uint32_t size, std::uint32_t threads);
[[nodiscard]] BarkPattern ringedBark(std::uint32_t size, std::uint32_t threads);
[[nodiscard]] BarkPattern smoothBark(std::uint32_t size, std::uint32_t threads);

/// A row of texels of a square tile.
struct BarkRow
{
    std::uint32_t size;
    std::uint32_t y; ///< From the top.
    float v;         ///< From the foot, at the middles of its texels.

    [[nodiscard]] std::size_t index(std::uint32_t x) const noexcept { return std::size_t{y} * size + x; }
    [[nodiscard]] Vec2 uv(std::uint32_t x) const noexcept
    {
        return {(static_cast<float>(x) + 0.5f) / static_cast<float>(size), v};
    }
};

/// Calls draw(row) for each row of a tile of `size` texels square, on several threads.
template <class Draw>
void forEachBarkRow(std::uint32_t size, std::uint32_t threads, const Draw& draw)
{
    forEachRow(size, threads, [&](std::uint32_t y) {
        draw(BarkRow{size, y, 1 - (static_cast<float>(y) + 0.5f) / static_cast<float>(size)});
    });
}

/// Calls texel(index, local) for each texel of the box round `middle`, which may reach over the edges of the tile;
/// local is in [-1, 1], in units of `half`, up and to the right. Requires: 0 < half < 0.5.
template <class Texel>
void forEachTexelRound(std::uint32_t size, Vec2 middle, Vec2 half, const Texel& texel)
{
    const auto side = static_cast<float>(size);
    const auto whole = static_cast<std::int32_t>(size);
    const auto left = static_cast<std::int32_t>(std::floor((middle.x - half.x) * side));
    const auto right = static_cast<std::int32_t>(std::floor((middle.x + half.x) * side));
    const auto top = static_cast<std::int32_t>(std::floor((1 - middle.y - half.y) * side));
    const auto bottom = static_cast<std::int32_t>(std::floor((1 - middle.y + half.y) * side));
    for (std::int32_t y = top; y <= bottom; ++y)
    {
        const float up = (1 - (static_cast<float>(y) + 0.5f) / side - middle.y) / half.y;
        const std::size_t row = static_cast<std::size_t>((y % whole + whole) % whole) * size;
        for (std::int32_t x = left; x <= right; ++x)
        {
            const float along = ((static_cast<float>(x) + 0.5f) / side - middle.x) / half.x;
            texel(row + static_cast<std::size_t>((x % whole + whole) % whole), Vec2(along, up));
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
