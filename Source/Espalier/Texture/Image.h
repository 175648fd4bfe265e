#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace espalier {

/// A picture of bytes, row by row from the top, no padding.
struct Image
{
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    std::uint32_t channels = 0;       ///< [1, 4]: grey, grey and alpha, RGB, RGBA.
    std::vector<std::uint8_t> texels; ///< width * height * channels bytes.

    friend bool operator==(const Image&, const Image&) = default;
};

/// The image as the bytes of a PNG file, the same bytes each time; empty if the image is empty, or its texels are not
/// as many as its size says.
[[nodiscard]] std::string encodePng(const Image& image);

} // namespace espalier
