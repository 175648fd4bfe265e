#include <Espalier/Texture/AppearanceTextures.h>

namespace espalier {

AppearanceTextures makeTextures(const Appearance& appearance, const TextureSizes& sizes, std::uint32_t threads,
                                const OwnTextures* own)
{
    const auto isOwn = [&](std::size_t material) {
        return own && material < own->size() && !(*own)[material].colour.texels.empty();
    };
    AppearanceTextures textures;
    textures.bark = isOwn(0) ? (*own)[0] : makeBarkTextures(appearance.bark, sizes.bark, threads);
    for (std::size_t k = 0; k < appearance.leaves.size(); ++k)
        textures.leaves.push_back(isOwn(1 + k) ? (*own)[1 + k]
                                               : makeLeafTextures(appearance.leaves[k], sizes.leaf, threads));
    return textures;
}

} // namespace espalier
