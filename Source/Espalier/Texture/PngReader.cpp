#include <Espalier/Texture/Image.h>

#include <algorithm>
#include <png.h>

// libpng's own simplified reader: its memory is that of the picture, however its data unpacks. It sees no chunk that we
// do not need: neither what would have it change colours, nor texts that unpack to anything.

namespace espalier {

namespace {

constexpr std::string_view kSignature("\x89PNG\r\n\x1a\n", 8);

std::uint32_t bigEndian(std::string_view bytes)
{
    std::uint32_t number = 0;
    for (const char byte : bytes.substr(0, 4))
        number = number << 8 | static_cast<std::uint8_t>(byte);
    return number;
}

/// The file without the chunks that may be left out (their names begin with a small letter) and that we do not need, up
/// to the first that is cut short; empty if it is no PNG.
std::string neededChunks(std::string_view bytes)
{
    constexpr std::size_t kFrame = 12; // length, name and checksum of a chunk
    if (!bytes.starts_with(kSignature))
        return {};
    std::string needed(kSignature);
    needed.reserve(bytes.size());
    bytes.remove_prefix(kSignature.size());
    while (bytes.size() >= kFrame)
    {
        const std::uint64_t length = kFrame + std::uint64_t{bigEndian(bytes)};
        if (length > bytes.size())
            break;
        const bool isCritical = (bytes[4] & 0x20) == 0;
        if (isCritical || bytes.substr(4, 4) == "tRNS")
            needed += bytes.substr(0, length);
        bytes.remove_prefix(length);
    }
    return needed;
}

/// The state of the reader, freed whatever happens.
struct Reader
{
    png_image image{};

    Reader() { image.version = PNG_IMAGE_VERSION; }
    ~Reader() { png_image_free(&image); }
    Reader(const Reader&) = delete;
    Reader& operator=(const Reader&) = delete;
};

} // namespace

Expected<Image> decodePng(std::string_view bytes, std::uint32_t channels, std::uint32_t mostSide, std::string_view file,
                          std::uint64_t mostTexels)
{
    const Location where{std::string(file)};
    const std::string needed = neededChunks(bytes);
    if (needed.empty())
        return failure(ErrorKind::BadInput, where, "this is no PNG file", "a picture as PNG");
    Reader reader;
    png_image& image = reader.image;
    const auto broken = [&] {
        return failure(ErrorKind::BadInput, where, "the PNG file is broken: " + std::string(image.message),
                       "a picture that other programs open");
    };
    if (png_image_begin_read_from_memory(&image, needed.data(), needed.size()) == 0)
        return broken();
    if (image.width > mostSide || image.height > mostSide)
        return failure(ErrorKind::Limit, where,
                       "the picture has " + std::to_string(image.width) + " x " + std::to_string(image.height) +
                           " texels",
                       "sides of at most " + std::to_string(mostSide));
    if (std::uint64_t{image.width} * image.height > mostTexels)
        return failure(ErrorKind::Limit, where,
                       "the picture has " + std::to_string(image.width) + " x " + std::to_string(image.height) +
                           " texels",
                       "at most " + std::to_string(mostTexels) + ", what the other pictures leave of the limit");
    image.format = PNG_FORMAT_RGBA;
    image.flags |= PNG_IMAGE_FLAG_16BIT_sRGB; // else 16 bits are taken for linear light
    Image picture{image.width, image.height, 4, {}};
    picture.texels.resize(std::size_t{4} * image.width * image.height);
    if (png_image_finish_read(&image, nullptr, picture.texels.data(), 0, nullptr) == 0)
        return broken();
    if (channels == 3)
    {
        const std::size_t texels = std::size_t{picture.width} * picture.height;
        for (std::size_t i = 0; i < texels; ++i)
            std::copy_n(&picture.texels[4 * i], 3, &picture.texels[3 * i]);
        picture.texels.resize(3 * texels);
        picture.channels = 3;
    }
    return picture;
}

} // namespace espalier
