#pragma once

#include <Espalier/Core/Error.h>
#include <cstdint>
#include <string>
#include <string_view>
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

/// The picture in a PNG file as it is stored, whatever the file says of its colour space (glTF 2.0, 3.8.3); 16 bits are
/// rounded to 8, palettes and greys become colours. `channels`: 3, alpha is left out, or 4. `file` is named in errors:
/// BadInput for what is no PNG, Limit for sides above `mostSide` or more than `mostTexels`, before memory is taken for
/// them.
[[nodiscard]] Expected<Image> decodePng(std::string_view bytes, std::uint32_t channels, std::uint32_t mostSide,
                                        std::string_view file, std::uint64_t mostTexels = ~std::uint64_t{0});

} // namespace espalier
