#include <Espalier/Texture/MaterialTextures.h>

#include <algorithm>
#include <bit>

namespace espalier {

MaterialTextures makeLeafTextures(const LeafAppearance&, std::uint32_t height, std::uint32_t)
{
    const std::uint32_t side = std::bit_floor(std::clamp(height, kMinTextureSize, kMaxTextureSize));
    const Image blank{side, side, 3, std::vector<std::uint8_t>(std::size_t{3} * side * side, 128)};
    return {{side, side, 4, std::vector<std::uint8_t>(std::size_t{4} * side * side, 255)}, blank, blank};
}

} // namespace espalier
