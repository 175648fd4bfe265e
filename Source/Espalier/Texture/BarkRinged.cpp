// A palm: each fallen leaf left a scar round the trunk, a ledge over a groove; between them fibres run along the axis
// and split.

#include <Espalier/Core/Random.h>
#include <Espalier/Texture/BarkPattern.h>
#include <Espalier/Texture/TileNoise.h>

namespace espalier {

BarkPattern ringedBark(BarkSize size, std::uint32_t threads)
{
    constexpr std::uint32_t kRings = 7; // in a width
    const std::uint32_t rings = kRings * size.tall;
    const float perTall = 1 / static_cast<float>(size.tall);
    const TileNoise sway(2, 3, 71, size.tall);
    const TileNoise wobble(7, 7, 72, size.tall);
    const TileNoise tear(46, 14, 73, size.tall);
    const TileFractal fibres(90, 5, 2, 74, size.tall);
    const TileNoise strands(30, 3, 75, size.tall);
    const TileNoise splits(26, 9, 76, size.tall);
    const TileFractal grain(120, 90, 2, 77, size.tall);
    const TileFractal weather(3, 4, 4, 78, size.tall);

    std::vector<float> shade(rings);
    const RandomKey key(Seed{79});
    for (std::uint32_t ring = 0; ring < rings; ++ring)
        shade[ring] = static_cast<float>(key.child(ring).uniform(Purpose::Sampling));

    BarkPattern bark(size);
    bark.shading = 0.8f;
    forEachBarkRow(size, threads, [&](const BarkRow& row) {
        const NoiseRow sways(sway, row.v, row.width);
        const NoiseRow wobbles(wobble, row.v, row.width);
        const NoiseRow wears(wobble, row.v + 0.5f, row.width);
        const NoiseRow tears(tear, row.v, row.width);
        const NoiseRow grains(grain, row.v, row.width);
        const NoiseRow weathers(weather, row.v, row.width);
        for (std::uint32_t x = 0; x < row.width; ++x)
        {
            const std::size_t i = row.index(x);
            const Vec2 uv = row.uv(x);
            const float wave = wobbles[x];
            const float teeth = tears[x];
            const CellPlace ring =
                cellPlace(perTall * (uv.y + 0.06f + 0.045f * sways[x] + 0.012f * wave + 0.0035f * teeth), rings);
            const float up = ring.inside; // 0 in the groove above a ledge, 1 on the ledge's brink
            const Vec2 at(uv.x + 0.006f * wave, uv.y);
            const float fibre = fibres.at({at.x + 0.31f * shade[ring.cell], at.y});
            const float strand = strands.at({at.x + 0.17f * shade[ring.cell], at.y});
            const float rough = grains[x];
            const float old = weathers[x];

            const float worn = smoothStep(-0.75f, 0.15f, wears[x]); // little where a scar fades out
            const float brink = smoothStep(0.72f, 0.9f, up + 0.03f * teeth) * (1 - smoothStep(0.965f, 1.f, up)) * worn;
            const float groove = (1 - smoothStep(0.01f, 0.10f + 0.04f * teeth, up)) * (0.35f + 0.65f * worn);
            const float split = smoothStep(0.25f, 0.6f, splits.at({at.x + 0.23f * shade[ring.cell], at.y})) *
                                (1 - smoothStep(0, 0.14f, std::abs(strand))) * (1 - 0.6f * brink);
            float height = 0.42f + 0.16f * up + 0.30f * brink - 0.36f * groove;
            height += (0.09f - 0.04f * brink) * fibre + 0.05f * strand + 0.03f * rough - 0.24f * split;
            bark.height.values[i] = std::clamp(height, 0.f, 1.f);

            Vec3 colour = mixed(Vec3(0.70f, 0.61f, 0.50f), Vec3(0.84f, 0.80f, 0.74f),
                                smoothStep(-0.5f, 0.6f, old + 0.5f * (shade[ring.cell] - 0.5f)));
            colour *=
                0.92f + 0.16f * (shade[ring.cell] - 0.5f) + 0.2f * fibre + 0.1f * strand + 0.12f * rough + 0.12f * old;
            colour = mixed(colour, Vec3(0.93f, 0.89f, 0.82f) * (1 + 0.2f * fibre), 0.5f * brink);
            colour = mixed(colour, Vec3(0.26f, 0.19f, 0.13f), 0.75f * groove);
            colour *= 1 - 0.6f * split;
            bark.colour[i] = colour;
            bark.roughness.values[i] = 1 + 0.06f * rough + 0.05f * groove - 0.05f * brink;
        }
    });
    return bark;
}

} // namespace espalier
