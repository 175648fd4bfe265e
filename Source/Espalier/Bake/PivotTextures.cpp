// OpenEXR's file layout (openexr.com, "OpenEXR File Layout"), and the numbers of Epic's Pivot Painter 2: its MAXScript
// reference (dev.epicgames.com, Pivot Painter Tool 2.0) and what the engine's material functions
// ms_PivotPainter2_UnpackIntegerAsFloat, _DecodeAxisVector and _Decode8BitAlphaAxisExtent make of them.

#include <Espalier/Bake/PivotTextures.h>

#include <Espalier/Core/Half.h>
#include <Espalier/Core/Vector.h>
#include <Espalier/Mesh/WindPresets.h>
#include <Espalier/Texture/Image.h>
#include <Espalier/Texture/SurfaceMaps.h>
#include <algorithm>
#include <bit>
#include <cmath>
#include <string_view>
#include <vector>

namespace espalier {

namespace {

constexpr float kCentimetres = 100;

/// Whatever the machine's, the file's bytes begin with the lowest.
template <class Number>
void append(std::string& bytes, Number value)
{
    for (std::size_t i = 0; i < sizeof value; ++i)
        bytes += static_cast<char>(static_cast<unsigned char>(value >> (8 * i)));
}

void appendAttribute(std::string& bytes, std::string_view name, std::string_view type, const std::string& value)
{
    bytes.append(name).push_back('\0');
    bytes.append(type).push_back('\0');
    append(bytes, static_cast<std::uint32_t>(value.size()));
    bytes += value;
}

std::string channels()
{
    std::string bytes;
    for (const char channel : {'A', 'B', 'G', 'R'}) // sorted by name
    {
        bytes += channel;
        bytes += '\0';
        append(bytes, std::uint32_t{1}); // half
        append(bytes, std::uint32_t{0}); // not perceptually linear, and three bytes kept for later
        append(bytes, std::uint32_t{1}); // a sample for each texel, across
        append(bytes, std::uint32_t{1}); // and down
    }
    bytes += '\0';
    return bytes;
}

std::string header(std::uint32_t width, std::uint32_t height)
{
    std::string bytes;
    append(bytes, std::uint32_t{20000630}); // magic number
    append(bytes, std::uint32_t{2});        // version, without any of its flags: scan lines
    std::string window;
    for (const std::uint32_t corner : {0u, 0u, width - 1, height - 1})
        append(window, corner);
    std::string one;
    append(one, std::bit_cast<std::uint32_t>(1.0f));
    appendAttribute(bytes, "channels", "chlist", channels());
    appendAttribute(bytes, "compression", "compression", std::string(1, '\0'));
    appendAttribute(bytes, "dataWindow", "box2i", window);
    appendAttribute(bytes, "displayWindow", "box2i", window);
    appendAttribute(bytes, "lineOrder", "lineOrder", std::string(1, '\0'));
    appendAttribute(bytes, "pixelAspectRatio", "float", one);
    appendAttribute(bytes, "screenWindowCenter", "v2f", std::string(8, '\0'));
    appendAttribute(bytes, "screenWindowWidth", "float", one);
    bytes += '\0';
    return bytes;
}

/// As Unreal has the axes of a glTF file.
Vec3 zUp(const Vec4& v)
{
    return {v.x, v.z, v.y};
}

/// Bits of a half that Unreal reads as this whole number: from 1024 on they are none that processors take for zero.
std::uint16_t packed(float number)
{
    return static_cast<std::uint16_t>(static_cast<std::uint32_t>(number) + 1024);
}

} // namespace

std::string encodeExr(std::uint32_t width, std::uint32_t height, std::span<const std::array<std::uint16_t, 4>> texels)
{
    std::string bytes = header(width, height);
    const std::uint32_t lineBytes = width * 4 * 2;
    std::uint64_t place = bytes.size() + std::uint64_t{8} * height;
    for (std::uint32_t y = 0; y < height; ++y, place += 8 + lineBytes)
        append(bytes, place);
    for (std::uint32_t y = 0; y < height; ++y)
    {
        append(bytes, y);
        append(bytes, lineBytes);
        for (const std::size_t channel : {3u, 2u, 1u, 0u})
            for (std::uint32_t x = 0; x < width; ++x)
                append(bytes, texels[std::size_t{y} * width + x][channel]);
    }
    return bytes;
}

Expected<PivotTextures> encodePivots(const PivotTable& table, std::uint32_t elements)
{
    if (elements > kMostPivotElements)
        return failure(ErrorKind::BadInput, {},
                       "the plant has " + std::to_string(elements) + " axes, too many for Pivot Painter's textures",
                       "at most " + std::to_string(kMostPivotElements));
    constexpr float kFarthest = 65504; // the largest half
    constexpr float kMostExtent = 2048;
    const std::size_t texels = std::size_t{table.side} * table.side;
    std::vector<std::array<std::uint16_t, 4>> pivots(texels, {0, 0, 0, packed(0)});
    Image directions{table.side, table.side, 4, std::vector<std::uint8_t>(4 * texels)};
    for (std::size_t i = 0; i < std::min<std::size_t>(elements, texels); ++i)
    {
        const Vec3 pivot = zUp(table.pivots[i]) * kCentimetres;
        for (int axis = 0; axis < 3; ++axis)
        {
            if (!(std::abs(pivot[axis]) <= kFarthest))
                return failure(ErrorKind::BadInput, {}, "a branch begins farther away than half floats hold",
                               "at most 655 m from the origin");
            pivots[i][static_cast<std::size_t>(axis)] = halfOf(pivot[axis]);
        }
        pivots[i][3] = packed(table.pivots[i].w);
        const Vec3 direction = zUp(table.directions[i]);
        std::uint8_t* texel = &directions.texels[4 * i];
        for (int axis = 0; axis < 3; ++axis)
            texel[axis] = byteOf(0.5f + 0.5f * direction[axis]);
        texel[3] = byteOf(table.directions[i].w * kCentimetres / kMostExtent);
    }
    return PivotTextures{encodeExr(table.side, table.side, pivots), encodePng(directions)};
}

} // namespace espalier
