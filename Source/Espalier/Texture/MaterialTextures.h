#pragma once

#include <Espalier/Species/Appearance.h>
#include <Espalier/Texture/Image.h>
#include <cstdint>

namespace espalier {

/// The pictures of one material, all of one size. Their top row is v = 1, towards the tip.
struct MaterialTextures
{
    /// sRGB; 3 channels for bark, 4 for leaves, which alpha cuts out. Texels that are cut out have the colour of the
    /// nearest leaf, so that mip maps do not darken its edge.
    Image colour;
    Image normal;    ///< Tangent space, linear, 3 channels; green towards the tip.
    Image roughness; ///< Linear, 3 channels as in glTF: red occlusion, green roughness, blue metal, which is 0.
};

/// Sides of a texture, in texels; others are clamped, and rounded down to a power of two.
inline constexpr std::uint32_t kMinTextureSize = 16;
inline constexpr std::uint32_t kMaxTextureSize = 4096;

/// Bark that shows bark.tile metres by bark.tileHeight times as many, and tiles in both directions: +v along the wood.
/// `size` texels square; where it is higher than wide, half as wide (less, if it were higher than kMaxTextureSize) and
/// bark.tileHeight times as high: a tile of height 4 has as many texels as a square one. The mean of its colour map in
/// linear light is bark.colour. Equal input gives equal bytes, from any number of `threads` (0: one
/// per processor).
[[nodiscard]] MaterialTextures makeBarkTextures(const BarkAppearance& bark, std::uint32_t size,
                                                std::uint32_t threads = 1);

/// The drawing of LeafSurface, `height` texels from foot to tip; as wide as the leaf's proportion says, rounded to a
/// power of two in [1/8, 1] of the height. The mean of what is not cut out, in linear light, is leaf.colour. Equal
/// input gives equal bytes, from any number of `threads` (0: one per processor).
[[nodiscard]] MaterialTextures makeLeafTextures(const LeafAppearance& leaf, std::uint32_t height,
                                                std::uint32_t threads = 1);

} // namespace espalier
