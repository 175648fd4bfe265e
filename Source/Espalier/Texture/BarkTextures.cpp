#include <Espalier/Texture/MaterialTextures.h>

#include <Espalier/Texture/BarkPattern.h>
#include <Espalier/Texture/Srgb.h>
#include <algorithm>
#include <bit>

namespace espalier {
namespace {

BarkPattern patternOf(BarkKind kind, BarkSize size, std::uint32_t threads)
{
    switch (kind)
    {
    case BarkKind::Furrowed:
        return furrowedBark(size, threads);
    case BarkKind::Papery:
        return paperyBark(size, threads);
    case BarkKind::Scaly:
        return scalyBark(size, threads);
    case BarkKind::Ringed:
        return ringedBark(size, threads);
    case BarkKind::Smooth:
        return smoothBark(size, threads);
    }
    return smoothBark(size, threads);
}

/// As many texels as a square of `size` has, or half of them where it is twice as high as wide.
BarkSize barkSizeOf(const BarkAppearance& bark, std::uint32_t size)
{
    const std::uint32_t side = std::bit_floor(std::clamp(size, kMinTextureSize, kMaxTextureSize));
    const std::uint32_t tall = tileHeightOf(bark);
    return {tall == 1 ? side : std::min(side / 2, kMaxTextureSize / tall), tall};
}

/// Share of the sky's light that reaches each texel, from how far it lies below what is round it.
Field openness(const Field& height, float depthOfTile)
{
    Field open(height.width, height.height, 1);
    for (const std::uint32_t share : {128u, 32u})
    {
        const std::uint32_t radius = std::max(1u, height.width / share);
        const Field round = blurred(height, radius);
        // As deep as wide loses half of the light.
        const float steepness = 2 * depthOfTile * static_cast<float>(height.width) / static_cast<float>(2 * radius + 1);
        for (std::size_t i = 0; i < open.values.size(); ++i)
        {
            const float below = std::max(0.f, round.values[i] - height.values[i]) * steepness;
            open.values[i] *= 1 / (1 + below);
        }
    }
    return open;
}

} // namespace

MaterialTextures makeBarkTextures(const BarkAppearance& bark, std::uint32_t size, std::uint32_t threads)
{
    const BarkSize side = barkSizeOf(bark, size);
    BarkPattern pattern = patternOf(bark.kind, side, threads);
    const std::size_t count = pattern.height.values.size();
    const Image blank{side.width, side.height(), 3, std::vector<std::uint8_t>(3 * count)};
    MaterialTextures textures{blank, {}, blank};

    const float depthOfTile = bark.relief / bark.tile;
    textures.normal = normalsOf(pattern.height, depthOfTile * static_cast<float>(side.width), threads);

    // Colours show the shade of cavities even on bark without relief, where it is painted.
    const Field open = openness(pattern.height, depthOfTile);
    const Field painted = openness(pattern.height, 0.04f);
    std::vector<float> channel(count);
    for (int c = 0; c < 3; ++c)
    {
        for (std::size_t i = 0; i < count; ++i)
        {
            const float shade = 1 - pattern.shading * (1 - painted.values[i]);
            channel[i] = std::max(0.f, pattern.colour[i][c] * shade);
        }
        adjustMean(channel, {}, bark.colour[c]);
        for (std::size_t i = 0; i < count; ++i)
            textures.colour.texels[3 * i + static_cast<std::size_t>(c)] = srgbFromLinear(channel[i]);
    }
    adjustMean(pattern.roughness.values, {}, bark.roughness);
    for (std::size_t i = 0; i < count; ++i)
    {
        textures.roughness.texels[3 * i] = byteOf(open.values[i]);
        textures.roughness.texels[3 * i + 1] = byteOf(pattern.roughness.values[i]);
    }
    return textures;
}

} // namespace espalier
