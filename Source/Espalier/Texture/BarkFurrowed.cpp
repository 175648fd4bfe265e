// Old oak: plates far longer than wide, between furrows that wander, meet and part. The plates are cells whose borders
// are deep and wide where they run along the axis, and mere cracks where they run across it; finer cracks break the
// plates.

#include <Espalier/Texture/BarkPattern.h>
#include <Espalier/Texture/TileNoise.h>

namespace espalier {

BarkPattern furrowedBark(std::uint32_t size, std::uint32_t threads)
{
    const TileNoise wander(3, 2, 11);
    const TileNoise wobble(11, 6, 12);
    const TileNoise tear(40, 22, 13);
    const TileCells plates(10, 4, 0.9f, 14);
    const TileCells cracks(20, 17, 1, 15);
    const TileNoise openness(7, 5, 16);
    const TileFractal cork(34, 10, 3, 17);
    const TileFractal grain(130, 84, 2, 18);
    const TileFractal weather(4, 3, 3, 19);
    const TileFractal lichen(9, 9, 4, 20);

    BarkPattern bark(size);
    bark.shading = 0.75f;
    forEachTexel(size, threads, [&](std::size_t i, Vec2 uv) {
        const float teeth = tear.at(uv);
        const float wave = wobble.at(uv);
        const Vec2 at(uv.x + 0.03f * wander.at(uv) + 0.013f * wave + 0.0035f * teeth,
                      uv.y + 0.02f * wobble.at({uv.x, uv.y + 0.5f}) + 0.005f * teeth);
        const float open = openness.at(uv);

        float ridge = 1;
        const auto furrow = [&](float distance, float steepness, float random) {
            const float along = steepness * steepness;
            const float depth =
                mixed(0.32f, 1.f, along) * std::clamp(0.82f + 0.35f * open + 0.3f * (random - 0.5f), 0.25f, 1.f);
            const float width = mixed(0.007f, 0.026f, along) * (0.85f + 0.4f * open + 0.3f * random);
            const float t = std::min(distance / width, 1.f);
            const float flank = t * (2 - t);
            ridge = std::min(ridge, 1 - depth * (1 - flank * flank));
        };
        const TileCells::Cell plate = plates.visit(at, 0.045f, furrow);

        float crack = 0;
        const Vec2 cracked(at.x + 0.006f * teeth, at.y + 0.16f * plate.random + 0.012f * wave);
        const auto split = [&](float distance, float steepness, float random) {
            const float across = 1 - steepness * steepness;
            const float t = std::min(distance / (0.0035f + 0.004f * across), 1.f);
            crack =
                std::max(crack, (0.15f + 0.85f * across) * smoothStep(0.3f, 0.9f, random + 0.25f * open) * (1 - t * t));
        };
        const TileCells::Cell scale = cracks.visit(cracked, 0.01f, split);

        const float layers = cork.at({at.x, at.y + 0.3f * plate.random});
        const float rough = grain.at(uv);
        // Cork stands in layers: flanks are steps rather than slopes.
        const float flanks = ridge * (1 - ridge) * 4;
        float height = ridge * (0.80f + 0.10f * plate.random + 0.06f * scale.random);
        height += flanks * 0.09f * layers;
        height += (0.02f + 0.055f * ridge) * layers + (0.025f + 0.02f * ridge) * rough;
        height -= 0.2f * crack * ridge;
        bark.height.values[i] = std::clamp(height, 0.f, 1.f);

        const float old = weather.at(uv);
        const float top = smoothStep(0.25f, 0.9f, height);
        Vec3 colour = mixed(Vec3(0.30f, 0.235f, 0.175f), Vec3(0.86f, 0.84f, 0.81f), top);
        colour = mixed(colour, Vec3(0.66f, 0.52f, 0.40f), 0.55f * flanks * (0.6f + 0.4f * layers)); // freshly torn cork
        colour *= 1 + 0.16f * (plate.random - 0.5f) + 0.1f * (scale.random - 0.5f) + 0.12f * old + 0.16f * layers +
                  0.13f * rough;
        colour *= 1 - 0.45f * crack;
        const float growth = top * smoothStep(0.18f, 0.6f, lichen.at(uv) + 0.3f * old);
        colour = mixed(colour, Vec3(0.78f, 0.88f, 0.70f) * (1 + 0.2f * rough), 0.45f * growth);
        bark.colour[i] = colour;
        bark.roughness.values[i] = 1 + 0.05f * rough - 0.06f * top + 0.05f * growth;
    });
    return bark;
}

} // namespace espalier
