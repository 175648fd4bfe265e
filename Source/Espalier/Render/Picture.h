#pragma once

#include <Espalier/Core/Error.h>
#include <Espalier/Core/Vector.h>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace espalier {

/// An 8-bit sRGB picture, rows from the top, no padding.
struct Picture
{
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    std::vector<std::uint8_t> rgb; ///< 3 * width * height bytes.

    Picture() = default;
    Picture(std::uint32_t w, std::uint32_t h) : width(w), height(h), rgb(std::size_t{3} * w * h) {}
};

/// Copies `source` into `target` with its top left corner at (x, y); what does not fit is cut off.
void paste(const Picture& source, std::uint32_t x, std::uint32_t y, Picture& target);

/// Writes `text` with its top left corner at (x, y). Printable ASCII; anything else shows as `?`. The built-in
/// font is 6 x 8 pixels a character, times `scale` (>= 1).
void drawText(std::string_view text, std::uint32_t x, std::uint32_t y, std::uint32_t scale, Vec3 srgb, Picture& target);

/// The picture as the bytes of a PNG file.
[[nodiscard]] std::string encodePng(const Picture& picture);

} // namespace espalier
