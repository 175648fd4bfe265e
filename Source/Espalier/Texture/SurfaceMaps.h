#pragma once

#include <Espalier/Core/Progress.h>
#include <Espalier/Core/Tasks.h>
#include <Espalier/Core/Vector.h>
#include <Espalier/Texture/Image.h>
#include <cstdint>
#include <vector>

namespace espalier {

/// One number for each texel, row by row from the top.
struct Field
{
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    std::vector<float> values;

    Field() = default;
    Field(std::uint32_t w, std::uint32_t h, float value = 0) : width(w), height(h), values(std::size_t{w} * h, value) {}

    [[nodiscard]] float* row(std::uint32_t y) noexcept { return values.data() + std::size_t{y} * width; }
    [[nodiscard]] const float* row(std::uint32_t y) const noexcept { return values.data() + std::size_t{y} * width; }
};

/// Calls row(y) for each of `height` rows, on several threads.
template <class Row>
void forEachRow(std::uint32_t height, std::uint32_t threads, const Row& row)
{
    constexpr std::uint32_t kBand = 16; // rows a task
    forEachTask((height + kBand - 1) / kBand, threadsFor(threads), Progress{},
                [&](std::uint32_t band) {
                    for (std::uint32_t y = band * kBand; y < std::min(height, (band + 1) * kBand); ++y)
                        row(y);
                },
                [](std::uint32_t) {});
}

/// The mean of the (2 radius + 1) squared texels round each one, of a field that repeats in both directions.
/// Requires: 2 radius < width and height.
[[nodiscard]] Field blurred(const Field& field, std::uint32_t radius);

/// Changes values >= 0 so that their mean, over those of weight 1, is `mean` in [0, 1] and none leaves [0, 1]: all are
/// multiplied, and where that would go beyond 1 the distances from 1 are instead.
void adjustMean(std::vector<float>& values, const std::vector<std::uint8_t>& weights, float mean);

/// Of each texel of an image `width` wide the nearest that is drawn, or as near as two passes over its neighbours find;
/// its own number where nothing is.
[[nodiscard]] std::vector<std::uint32_t> nearestDrawn(const std::vector<std::uint8_t>& isDrawn, std::uint32_t width);

/// A unit vector as three bytes.
void storeNormal(Vec2 slope, std::uint8_t* texel) noexcept;

/// Normals of a surface that repeats in both directions. `steepness`: how steep it is where its height changes by 1
/// from one texel to the next.
[[nodiscard]] Image normalsOf(const Field& height, float steepness, std::uint32_t threads);

/// [0, 1] as a byte.
[[nodiscard]] inline std::uint8_t byteOf(float value) noexcept
{
    return static_cast<std::uint8_t>((value > 0 ? (value < 1 ? value : 1.f) : 0.f) * 255 + 0.5f);
}

} // namespace espalier
