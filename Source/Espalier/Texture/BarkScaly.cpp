// Spruce: thin roundish flakes that part from the bark along their rims, each at a tilt of its own.

#include <Espalier/Texture/BarkPattern.h>
#include <Espalier/Texture/TileNoise.h>

namespace espalier {

BarkPattern scalyBark(std::uint32_t size, std::uint32_t threads)
{
    const TileNoise wander(5, 5, 31);
    const TileNoise wobble(18, 18, 32);
    const TileNoise tear(52, 48, 33);
    const TileCells flakes(13, 12, 1, 34);
    const TileCells chips(34, 30, 1, 35);
    const TileFractal grain(60, 60, 3, 36);
    const TileFractal weather(3, 3, 4, 37);

    BarkPattern bark(size);
    bark.shading = 0.9f;
    forEachTexel(size, threads, [&](std::size_t i, Vec2 uv) {
        const float wave = wobble.at(uv);
        const float teeth = tear.at(uv);
        const Vec2 at(uv.x + 0.02f * wander.at(uv) + 0.011f * wave + 0.0022f * teeth,
                      uv.y + 0.02f * wander.at({uv.x + 0.5f, uv.y}) + 0.011f * wobble.at({uv.x, uv.y + 0.5f}) +
                          0.0022f * teeth);
        constexpr float kReach = 0.03f;
        float rim = kReach; // distance to it
        const TileCells::Cell flake =
            flakes.visit(at, kReach, [&](float distance, float, float) { rim = std::min(rim, distance); });
        constexpr float kChipReach = 0.01f;
        float edge = kChipReach;
        const TileCells::Cell chip =
            chips.visit(at, kChipReach, [&](float distance, float, float) { edge = std::min(edge, distance); });

        const float rough = grain.at(uv);
        const float old = weather.at(uv);
        const float gap = 1 - smoothStep(0.001f, 0.0065f, rim);
        const float lift = smoothStep(0.028f, 0.008f, rim);
        const float chipped = (chip.random < 0.4f ? 1.f : 0.25f) * (1 - smoothStep(0.0005f, 0.003f, edge));
        // The upper rim is free, the lower one lies under the next flake's.
        const float tilt = std::clamp(
            0.5f - 0.7f * flake.fromMiddle.y + 0.35f * (2 * flake.random - 1) * flake.fromMiddle.x, 0.f, 1.f);
        float height =
            0.3f + 0.22f * flake.random + (0.10f + 0.24f * tilt) * lift + 0.09f * (chip.random - 0.5f) + 0.06f * rough;
        height = height * (1 - 0.85f * gap) - 0.1f * chipped * (1 - gap);
        bark.height.values[i] = std::clamp(height, 0.f, 1.f);

        const float own = flake.random * 7 - std::floor(flake.random * 7);
        Vec3 colour =
            mixed(Vec3(0.74f, 0.56f, 0.44f), Vec3(0.82f, 0.79f, 0.76f), smoothStep(0.1f, 0.9f, own + 0.35f * old));
        colour *= 0.82f + 0.3f * (flake.random - 0.5f) + 0.22f * (chip.random - 0.5f) + 0.22f * rough + 0.12f * old;
        colour = mixed(colour, Vec3(0.95f, 0.91f, 0.86f), 0.35f * lift * (1 - gap) * tilt); // worn rims
        colour = mixed(colour, Vec3(0.24f, 0.15f, 0.11f), 0.85f * gap);
        colour *= 1 - 0.4f * chipped;
        bark.colour[i] = colour;
        bark.roughness.values[i] = 1 + 0.06f * rough + 0.05f * gap - 0.05f * lift;
    });
    return bark;
}

} // namespace espalier
