#pragma once

#include <Espalier/Texture/MaterialTextures.h>
#include <Espalier/Texture/OwnTextures.h>
#include <cstdint>
#include <vector>

namespace espalier {

/// Texels along the sides of generated textures.
struct TextureSizes
{
    std::uint32_t bark = 1024; ///< Square. [kMinTextureSize, kMaxTextureSize]
    std::uint32_t leaf = 512;  ///< From foot to tip. Likewise.

    friend bool operator==(const TextureSizes&, const TextureSizes&) = default;
};

/// All pictures that the materials of a species are painted with.
struct AppearanceTextures
{
    MaterialTextures bark;
    std::vector<MaterialTextures> leaves; ///< By kind, as Appearance::leaves.
};

/// Generates all that are not among the artist's `own`, if there are any, which are taken as they are, whatever their
/// size. Equal input gives equal bytes, from any number of `threads` (0: one per processor).
[[nodiscard]] AppearanceTextures makeTextures(const Appearance& appearance, const TextureSizes& sizes = {},
                                              std::uint32_t threads = 1, const OwnTextures* own = nullptr);

} // namespace espalier
