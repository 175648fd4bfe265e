#pragma once

#include <Espalier/Core/Vector.h>
#include <Espalier/Texture/MaterialTextures.h>

namespace espalier {

/// What happens to texture coordinates outside of [0, 1].
enum class TextureWrap : std::uint8_t
{
    Repeat,
    Clamp,
};

/// The textures of one material as a ray looks them up: bilinear, at (u, v) with v upwards. Immutable.
class PaintedMaterial
{
public:
    /// Requires images of at least one texel, the colour of three or four channels, the others of three, or no
    /// roughness.
    PaintedMaterial(MaterialTextures textures, TextureWrap wrap);

    [[nodiscard]] Vec3 colour(Vec2 uv) const noexcept;     ///< Linear.
    [[nodiscard]] float alpha(Vec2 uv) const noexcept;     ///< Of the nearest texel; 1 without an alpha channel.
    [[nodiscard]] float occlusion(Vec2 uv) const noexcept; ///< Share of light; 1 without an image of roughness.
    [[nodiscard]] Vec3 normal(Vec2 uv) const noexcept;     ///< Tangent space, about unit.

private:
    struct Corners;
    [[nodiscard]] Corners cornersAt(const Image& image, Vec2 uv) const noexcept;

    MaterialTextures textures_;
    TextureWrap wrap_;
};

} // namespace espalier
