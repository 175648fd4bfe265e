// Beech: a skin with patches of lichen in greys, wrinkled finely across the axis, with rows of small pores.

#include <Espalier/Core/Random.h>
#include <Espalier/Texture/BarkPattern.h>
#include <Espalier/Texture/TileNoise.h>

namespace espalier {

BarkPattern smoothBark(BarkSize size, std::uint32_t threads)
{
    const TileNoise wander(4, 5, 51, size.tall);
    const TileNoise wrinkles(7, 46, 52, size.tall);
    const TileNoise creases(16, 120, 53, size.tall);
    const TileFractal swelling(3, 4, 3, 54, size.tall);
    const TileFractal patches(5, 5, 5, 55, size.tall);
    const TileFractal stains(6, 3, 4, 56, size.tall);
    const TileFractal grain(110, 130, 2, 57, size.tall);

    BarkPattern bark(size);
    bark.shading = 0.5f;
    forEachBarkRow(size, threads, [&](const BarkRow& row) {
        const NoiseRow wanders(wander, row.v, row.width);
        const NoiseRow swellings(swelling, row.v, row.width);
        const NoiseRow grains(grain, row.v, row.width);
        const NoiseRow stainRow(stains, row.v, row.width);
        const NoiseRow patchRow(patches, row.v, row.width);
        for (std::uint32_t x = 0; x < row.width; ++x)
        {
            const std::size_t i = row.index(x);
            const Vec2 uv = row.uv(x);
            const Vec2 at(uv.x, uv.y + 0.02f * wanders[x]);
            const float broad = swellings[x];
            const float folds = wrinkles.at(at);
            const float fine = creases.at(at);
            const float rough = grains[x];
            const float wrinkle = 1 - smoothStep(0, 0.22f, std::abs(folds + 0.2f * fine));
            const float where = smoothStep(-0.3f, 0.5f, broad);
            const float height = 0.62f + 0.25f * broad + 0.05f * folds - 0.13f * wrinkle * where -
                                 0.04f * std::abs(fine) + 0.025f * rough;
            bark.height.values[i] = std::clamp(height, 0.f, 1.f);

            const float patch = patchRow[x];
            const float stain = stainRow[x];
            Vec3 colour(0.78f, 0.775f, 0.75f);
            colour =
                mixed(colour, Vec3(0.90f, 0.93f, 0.90f), 0.8f * smoothStep(0.12f, 0.22f, patch)); // crusts of lichen
            colour = mixed(colour, Vec3(0.60f, 0.66f, 0.54f), 0.6f * smoothStep(0.05f, 0.6f, -patch + 0.3f * stain));
            colour *= 1 + 0.13f * stain + 0.07f * rough + 0.05f * fine - 0.22f * wrinkle * where;
            bark.colour[i] = colour;
            bark.roughness.values[i] = 1 + 0.08f * smoothStep(0.1f, 0.25f, patch) + 0.05f * rough;
        }
    });

    const RandomKey key(Seed{58});
    for (std::uint32_t pore = 0; pore < 240 * size.tall; ++pore)
    {
        const RandomKey own = key.child(pore);
        const auto draw = [&](double low, double high, std::uint32_t counter) {
            return static_cast<float>(own.uniform(Purpose::Sampling, low, high, counter));
        };
        const Vec2 middle(draw(0, 1, 0), draw(0, size.tall, 1));
        const Vec2 half(draw(0.003, 0.009, 2), draw(0.0018, 0.003, 3));
        const float ink = draw(0.2, 0.6, 4);
        forEachTexelRound(size, middle, half, [&](std::size_t i, Vec2 local) {
            const float inside = 1 - (local.x * local.x + local.y * local.y);
            if (inside <= 0)
                return;
            bark.height.values[i] = std::min(1.f, bark.height.values[i] + 0.08f * inside);
            bark.colour[i] *= 1 - ink * smoothStep(0, 0.8f, inside);
        });
    }
    return bark;
}

} // namespace espalier
