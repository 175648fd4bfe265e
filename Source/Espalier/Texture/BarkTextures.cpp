#include <Espalier/Texture/MaterialTextures.h>

#include <algorithm>
#include <bit>

namespace espalier {

MaterialTextures makeBarkTextures(const BarkAppearance&, std::uint32_t size, std::uint32_t)
{
    const std::uint32_t side = std::bit_floor(std::clamp(size, kMinTextureSize, kMaxTextureSize));
    const Image blank{side, side, 3, std::vector<std::uint8_t>(std::size_t{3} * side * side, 128)};
    return {blank, blank, blank};
}

} // namespace espalier
