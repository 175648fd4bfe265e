// Old oak: plates far longer than wide, between furrows that wander, meet and part. The plates are cells whose borders
// are deep and wide where they run along the axis, and mere cracks where they run across it; finer cracks break the
// plates.

#include <Espalier/Texture/BarkPattern.h>
#include <Espalier/Texture/TileNoise.h>

namespace espalier {

BarkPattern furrowedBark(BarkSize size, std::uint32_t threads)
{
    const TileNoise wander(4, 3, 11, size.tall);
    const TileFractal wobble(13, 8, 3, 12, size.tall);
    const TileFractal tear(66, 39, 2, 13, size.tall);
    const TileCells plates(14, 4, 1, 14, size.tall);
    const TileCells cracks(28, 24, 1, 15, size.tall);
    const TileNoise openness(8, 5, 16, size.tall);
    const TileFractal cork(39, 13, 4, 17, size.tall);
    const TileFractal fissures(63, 10, 2, 21, size.tall);
    const TileFractal grain(190, 85, 2, 18, size.tall);
    const TileFractal weather(5, 4, 3, 19, size.tall);
    const TileFractal lichen(13, 13, 4, 20, size.tall);

    BarkPattern bark(size);
    bark.shading = 0.75f;
    forEachBarkRow(size, threads, [&](const BarkRow& row) {
        const NoiseRow tears(tear, row.v, row.width);
        const NoiseRow wobbles(wobble, row.v, row.width);
        const NoiseRow wanders(wander, row.v, row.width);
        const NoiseRow wandersUp(wander, row.v + 0.5f, row.width);
        const NoiseRow opens(openness, row.v, row.width);
        const NoiseRow grains(grain, row.v, row.width);
        const NoiseRow weathers(weather, row.v, row.width);
        const NoiseRow lichens(lichen, row.v, row.width);
        for (std::uint32_t x = 0; x < row.width; ++x)
        {
            const std::size_t i = row.index(x);
            const Vec2 uv = row.uv(x);
            const float teeth = tears[x];
            const float wave = wobbles[x];
            const Vec2 at(uv.x + 0.024f * wanders[x] + 0.014f * wave + 0.004f * teeth,
                          uv.y + 0.034f * wandersUp[x] + 0.0135f * wave - 0.0054f * teeth);
            const float open = opens[x];

            float ridge = 1;
            float dome = 1;
            constexpr float kReach = 0.033f;
            const auto furrow = [&](float distance, float steepness, float random) {
                const float along = steepness * steepness;
                const float depth =
                    mixed(0.12f, 1.f, along) * std::clamp(0.85f + 0.4f * open + 0.3f * (random - 0.5f), 0.2f, 1.f);
                const float width = mixed(0.008f, 0.018f, along) * (0.85f + 0.45f * open + 0.3f * random);
                const float t = std::min(distance / width, 1.f);
                const float flank = t * (2 - t);
                ridge = std::min(ridge, 1 - depth * (1 - flank * t));
                dome = std::min(dome, distance / kReach);
            };
            const TileCells::Cell plate = plates.visit(at, kReach, furrow);

            float crack = 0;
            const Vec2 cracked(at.x + 0.0027f * teeth, at.y + 0.11f * plate.random + 0.0135f * wave);
            const auto split = [&](float distance, float steepness, float random) {
                const float across = 1 - steepness * steepness;
                const float t = std::min(distance / (0.002f + 0.004f * across), 1.f);
                crack =
                    std::max(crack, (0.1f + 0.9f * across) * smoothStep(0.25f, 0.9f, random + 0.35f * open) * (1 - t));
            };
            const TileCells::Cell scale = cracks.visit(cracked, 0.0067f, split);

            const float layers = cork.at({at.x, at.y + 0.2f * plate.random});
            const float fissure =
                (1 - smoothStep(0, 0.24f, std::abs(fissures.at({at.x + 0.07f * plate.random, at.y})))) *
                smoothStep(-0.5f, 0.5f, layers);
            const float rough = grains[x];
            // Cork stands in layers: flanks are steps rather than slopes.
            const float flanks = ridge * (1 - ridge) * 4;
            float height = ridge * (0.66f + 0.10f * dome + 0.08f * plate.random + 0.10f * scale.random);
            height += flanks * 0.10f * layers + 0.13f * ridge * layers + (0.02f + 0.025f * ridge) * rough;
            height -= ridge * (0.24f * crack + 0.12f * fissure);
            bark.height.values[i] = std::clamp(height, 0.f, 1.f);

            const float old = weathers[x];
            const float top = smoothStep(0.2f, 0.85f, height);
            Vec3 colour = mixed(Vec3(0.27f, 0.205f, 0.15f), Vec3(0.88f, 0.86f, 0.83f), top);
            colour =
                mixed(colour, Vec3(0.64f, 0.48f, 0.35f), 0.5f * flanks * (0.6f + 0.4f * layers)); // freshly torn cork
            colour = mixed(colour, colour * Vec3(1.06f, 0.95f, 0.84f),
                           smoothStep(-0.2f, 0.6f, scale.random - 0.5f - 0.6f * old));
            colour *= 1 + 0.18f * (plate.random - 0.5f) + 0.2f * (scale.random - 0.5f) + 0.14f * old + 0.2f * layers +
                      0.12f * rough;
            colour *= (1 - 0.5f * crack) * (1 - 0.3f * fissure);
            const float growth = top * smoothStep(0.15f, 0.55f, lichens[x] + 0.3f * old);
            colour = mixed(colour, Vec3(0.76f, 0.88f, 0.66f) * (1 + 0.25f * rough), 0.5f * growth);
            bark.colour[i] = colour;
            bark.roughness.values[i] = 1 + 0.05f * rough - 0.06f * top + 0.05f * growth;
        }
    });
    return bark;
}

} // namespace espalier
