#pragma once

#include <Espalier/Core/Error.h>
#include <array>
#include <cstdint>
#include <span>
#include <string>

namespace espalier {

struct PivotTable;

/// The bytes of an OpenEXR file of half floats: one part, scan lines from the top, not compressed. `texels` are the
/// bits of red, green, blue and alpha, row by row. Requires: width * height of them, and some.
[[nodiscard]] std::string encodeExr(std::uint32_t width, std::uint32_t height,
                                    std::span<const std::array<std::uint16_t, 4>> texels);

/// Elements that Unreal's numbers, which are bits of halves, can tell apart. Epic's own tool allows 30,000.
inline constexpr std::uint32_t kMostPivotElements = 0x7c00 - 1024;

/// The two textures that Epic's Pivot Painter 2 makes by default and PivotPainter2FoliageShader reads: centimetres,
/// Z up, as Unreal has a GLB that it imports (x, z, y). WIND.md has every number.
struct PivotTextures
{
    std::string pivots;     ///< EXR: position, and the number of the parent as bits of a half.
    std::string directions; ///< PNG, linear: direction, and extent / 2048 cm.
};

/// Equal input gives equal bytes. Fails with BadInput if there are more elements than kMostPivotElements or one lies
/// farther than 655 m from the origin, beyond what halves hold.
[[nodiscard]] Expected<PivotTextures> encodePivots(const PivotTable& table, std::uint32_t elements);

} // namespace espalier
