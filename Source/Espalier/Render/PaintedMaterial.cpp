#include <Espalier/Render/PaintedMaterial.h>

#include <Espalier/Texture/Srgb.h>
#include <algorithm>
#include <array>
#include <cmath>

namespace espalier {
namespace {

const std::array<float, 256>& linearLight()
{
    static const std::array<float, 256> kLight = [] {
        std::array<float, 256> light{};
        for (std::size_t i = 0; i < light.size(); ++i)
            light[i] = linearFromSrgb(static_cast<std::uint8_t>(i));
        return light;
    }();
    return kLight;
}

/// The texel that `place` (in texels, of any sign) falls on.
std::uint32_t wrapped(float place, std::uint32_t count, TextureWrap wrap)
{
    const auto size = static_cast<float>(count);
    if (wrap == TextureWrap::Repeat)
        place -= std::floor(place / size) * size;
    return static_cast<std::uint32_t>(std::clamp(place, 0.f, size - 1));
}

} // namespace

/// Offsets of the four texels round a place, and their shares.
struct PaintedMaterial::Corners
{
    std::array<std::size_t, 4> texel;
    std::array<float, 4> share;
};

PaintedMaterial::PaintedMaterial(MaterialTextures textures, TextureWrap wrap)
    : textures_(std::move(textures)), wrap_(wrap)
{}

PaintedMaterial::Corners PaintedMaterial::cornersAt(const Image& image, Vec2 uv) const noexcept
{
    // The top row is v = 1; a texel's colour is that of its middle.
    const float x = uv.x * static_cast<float>(image.width) - 0.5f;
    const float y = (1 - uv.y) * static_cast<float>(image.height) - 0.5f;
    const float x0 = std::floor(x);
    const float y0 = std::floor(y);
    const float right = x - x0;
    const float down = y - y0;
    const auto offset = [&](float column, float row) {
        return (std::size_t{wrapped(row, image.height, wrap_)} * image.width + wrapped(column, image.width, wrap_)) *
               image.channels;
    };
    return {{offset(x0, y0), offset(x0 + 1, y0), offset(x0, y0 + 1), offset(x0 + 1, y0 + 1)},
            {(1 - right) * (1 - down), right * (1 - down), (1 - right) * down, right * down}};
}

Vec3 PaintedMaterial::colour(Vec2 uv) const noexcept
{
    const std::array<float, 256>& light = linearLight();
    const Corners corners = cornersAt(textures_.colour, uv);
    Vec3 sum(0);
    for (std::size_t i = 0; i < 4; ++i)
    {
        const std::uint8_t* texel = &textures_.colour.texels[corners.texel[i]];
        sum += corners.share[i] * Vec3(light[texel[0]], light[texel[1]], light[texel[2]]);
    }
    return sum;
}

float PaintedMaterial::alpha(Vec2 uv) const noexcept
{
    const Image& image = textures_.colour;
    if (image.channels < 4)
        return 1;
    const std::uint32_t x = wrapped(std::floor(uv.x * static_cast<float>(image.width)), image.width, wrap_);
    const std::uint32_t y = wrapped(std::floor((1 - uv.y) * static_cast<float>(image.height)), image.height, wrap_);
    return static_cast<float>(image.texels[(std::size_t{y} * image.width + x) * 4 + 3]) / 255;
}

float PaintedMaterial::occlusion(Vec2 uv) const noexcept
{
    const Image& image = textures_.roughness;
    if (image.texels.empty())
        return 1;
    const Corners corners = cornersAt(image, uv);
    float sum = 0;
    for (std::size_t i = 0; i < 4; ++i)
        sum += corners.share[i] * static_cast<float>(image.texels[corners.texel[i]]);
    return sum / 255;
}

Vec3 PaintedMaterial::normal(Vec2 uv) const noexcept
{
    const Corners corners = cornersAt(textures_.normal, uv);
    Vec3 sum(0);
    for (std::size_t i = 0; i < 4; ++i)
    {
        const std::uint8_t* texel = &textures_.normal.texels[corners.texel[i]];
        const Vec3 bytes(texel[0], texel[1], texel[2]);
        sum += corners.share[i] * (bytes / 127.5f - Vec3(1));
    }
    return sum;
}

} // namespace espalier
