#include <Espalier/Texture/Image.h>

#include <limits>

#if defined(__GNUC__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wunused-function"
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wsign-conversion"
#pragma GCC diagnostic ignored "-Wshadow"
#endif
#define STB_IMAGE_WRITE_STATIC
#define STB_IMAGE_WRITE_IMPLEMENTATION
#include <stb_image_write.h>
#if defined(__GNUC__)
#pragma GCC diagnostic pop
#endif

namespace espalier {
namespace {

void appendBytes(void* context, void* data, int size)
{
    static_cast<std::string*>(context)->append(static_cast<const char*>(data), static_cast<std::size_t>(size));
}

} // namespace

std::string encodePng(const Image& image)
{
    std::string bytes;
    const std::uint64_t size = std::uint64_t{image.width} * image.height * image.channels;
    const bool fits = size <= static_cast<std::uint64_t>(std::numeric_limits<int>::max()); // stb counts in ints
    if (image.channels < 1 || image.channels > 4 || size == 0 || !fits || image.texels.size() != size)
        return bytes;
    stbi_write_png_to_func(appendBytes, &bytes, static_cast<int>(image.width), static_cast<int>(image.height),
                           static_cast<int>(image.channels), image.texels.data(),
                           static_cast<int>(image.width * image.channels));
    return bytes;
}

} // namespace espalier
