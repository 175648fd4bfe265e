#include <Espalier/Texture/AppearanceTextures.h>

namespace espalier {

AppearanceTextures makeTextures(const Appearance& appearance, const TextureSizes& sizes, std::uint32_t threads)
{
    AppearanceTextures textures{makeBarkTextures(appearance.bark, sizes.bark, threads), {}};
    for (const LeafAppearance& leaf : appearance.leaves)
        textures.leaves.push_back(makeLeafTextures(leaf, sizes.leaf, threads));
    return textures;
}

} // namespace espalier
