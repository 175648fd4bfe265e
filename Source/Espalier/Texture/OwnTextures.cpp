#include <Espalier/Texture/OwnTextures.h>

#include <Espalier/Core/File.h>
#include <Espalier/Texture/SurfaceMaps.h>
#include <algorithm>
#include <array>
#include <string>

namespace espalier {

namespace {

/// Takes its texels from what `limits` allow.
Expected<Image> loadImage(const std::filesystem::path& path, std::uint32_t channels, Limits& limits)
{
    const auto bytes = readFile(path, limits.fileBytes);
    if (!bytes)
        return tl::make_unexpected(bytes.error());
    auto image = decodePng(*bytes, channels, kMaxTextureSize, path.string(), limits.texels);
    if (image)
        limits.texels -= image->width * image->height;
    return image;
}

/// An image of one colour, as large as another.
Image evenImage(const Image& like, std::array<std::uint8_t, 3> colour)
{
    Image image{like.width, like.height, 3, {}};
    image.texels.resize(std::size_t{3} * like.width * like.height);
    for (std::size_t i = 0; i < image.texels.size(); ++i)
        image.texels[i] = colour[i % 3];
    return image;
}

/// Gives what is cut out the colour of the nearest texel that is not.
void fillCutOut(Image& colour)
{
    std::vector<std::uint8_t> isDrawn(std::size_t{colour.width} * colour.height);
    for (std::size_t i = 0; i < isDrawn.size(); ++i)
        isDrawn[i] = colour.texels[4 * i + 3] >= 128;
    const std::vector<std::uint32_t> nearest = nearestDrawn(isDrawn, colour.width);
    for (std::size_t i = 0; i < isDrawn.size(); ++i)
        if (!isDrawn[i])
            std::copy_n(&colour.texels[std::size_t{4} * nearest[i]], 3, &colour.texels[4 * i]);
}

Expected<MaterialTextures> loadMaterial(const ImageNames& names, std::uint32_t channels, float roughness,
                                        const std::filesystem::path& folder, Limits& limits)
{
    MaterialTextures material;
    auto colour = loadImage(folder / names.colour, channels, limits);
    if (!colour)
        return tl::make_unexpected(colour.error());
    material.colour = std::move(*colour);
    if (channels == 4)
        fillCutOut(material.colour);

    const auto loadBeside = [&](const std::string& name, std::array<std::uint8_t, 3> without) -> Expected<Image> {
        if (name.empty())
            return evenImage(material.colour, without);
        auto image = loadImage(folder / name, 3, limits);
        const auto sizeOf = [](const Image& of) {
            return std::to_string(of.width) + " x " + std::to_string(of.height);
        };
        if (image && (image->width != material.colour.width || image->height != material.colour.height))
            return failure(ErrorKind::BadInput, {(folder / name).string()},
                           "the picture has " + sizeOf(*image) + " texels",
                           sizeOf(material.colour) + ", as " + names.colour + " has");
        return image;
    };
    constexpr std::array<std::uint8_t, 3> kFlat{128, 128, 255};
    auto normal = loadBeside(names.normal, kFlat);
    if (!normal)
        return tl::make_unexpected(normal.error());
    auto rough = loadBeside(names.roughness, {255, byteOf(roughness), 0});
    if (!rough)
        return tl::make_unexpected(rough.error());
    material.normal = std::move(*normal);
    material.roughness = std::move(*rough);
    return material;
}

} // namespace

Expected<OwnTextures> loadOwnTextures(const Appearance& appearance, const std::filesystem::path& folder,
                                      const Limits& limits)
{
    Limits left = limits;
    OwnTextures all(std::min(appearance.images.size(), 1 + appearance.leaves.size()));
    for (std::size_t i = 0; i < all.size(); ++i)
    {
        if (appearance.images[i].colour.empty())
            continue;
        const float roughness = i == 0 ? appearance.bark.roughness : appearance.leaves[i - 1].roughness;
        auto material = loadMaterial(appearance.images[i], i == 0 ? 3 : 4, roughness, folder, left);
        if (!material)
            return tl::make_unexpected(material.error());
        all[i] = std::move(*material);
    }
    return all;
}

} // namespace espalier
