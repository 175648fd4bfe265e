// Spruce: thin roundish flakes that lie over each other, each with a tilt of its own, and part from the bark along
// their rims. They are laid one after the other, so later ones lie on top.

#include <Espalier/Core/Random.h>
#include <Espalier/Texture/BarkPattern.h>
#include <Espalier/Texture/TileNoise.h>

namespace espalier {
namespace {

/// What the topmost flake is at each texel.
struct Flakes
{
    Field level;  ///< [0, 1]: how high it lies.
    Field out;    ///< From its middle, 0, to its rim, 1.
    Field random; ///< [0, 1), the flake's own.
};

/// Flakes over what is there, `columns` a tile's width either way, of about `share` of their room. They leave gaps
/// where `share` is small. What lies at the rim is bent by `bend` and `bendUp`.
void layFlakes(BarkSize size, std::uint64_t seed, std::uint32_t columns, float share, Vec2 levels, const Field& bend,
               const Field& bendUp, Flakes& flakes)
{
    const RandomKey key(Seed{seed});
    const std::uint32_t count = columns * columns * size.tall;
    std::vector<std::uint32_t> order(count);
    permutation(order, key);
    for (std::uint32_t i = 0; i < count; ++i)
    {
        const RandomKey own = key.child(i);
        const auto draw = [&](double low, double high, std::uint32_t counter) {
            return static_cast<float>(own.uniform(Purpose::Sampling, low, high, counter));
        };
        const auto cells = static_cast<float>(columns);
        const Vec2 middle((static_cast<float>(order[i] % columns) + draw(0, 1, 0)) / cells,
                          (static_cast<float>(order[i] / columns) + draw(0, 1, 1)) / cells);
        const float radius = share / cells * draw(0.75, 1.3, 2);
        const Vec2 half(radius, radius * draw(0.85, 1.35, 3));
        const Vec2 tilt(draw(-0.3, 0.3, 4), draw(-0.45, 0.1, 5));
        const float random = draw(0, 1, 6);
        const float level = mixed(levels.x, levels.y, static_cast<float>(i) / static_cast<float>(count));
        constexpr float kRoom = 1.35f; // for rims that bend outwards
        forEachTexelRound(size, middle, kRoom * half, [&](std::size_t texel, Vec2 local) {
            const Vec2 at = kRoom * local + Vec2(bend.values[texel], bendUp.values[texel]) / (cells * half);
            const float squared = at.x * at.x + at.y * at.y;
            if (squared >= 1)
                return;
            flakes.level.values[texel] = level + 0.16f * (at.x * tilt.x + at.y * tilt.y) + 0.10f * squared * squared;
            flakes.out.values[texel] = squared;
            flakes.random.values[texel] = random;
        });
    }
}

} // namespace

BarkPattern scalyBark(BarkSize size, std::uint32_t threads)
{
    const TileFractal wobble(15, 15, 3, 32, size.tall);
    const TileFractal grain(60, 52, 3, 36, size.tall);
    const TileNoise layers(26, 30, 38, size.tall);
    const TileFractal weather(3, 3, 4, 37, size.tall);

    Field bend(size.width, size.height());
    Field bendUp(size.width, size.height());
    forEachBarkRow(size, threads, [&](const BarkRow& row) {
        const NoiseRow wobbles(wobble, row.v, row.width);
        const NoiseRow wobblesUp(wobble, row.v + 0.4f, row.width);
        for (std::uint32_t x = 0; x < row.width; ++x)
        {
            const std::size_t i = row.index(x);
            bend.values[i] = 0.42f * wobbles[x];
            bendUp.values[i] = 0.42f * wobblesUp[x];
        }
    });
    Flakes flakes{Field(size.width, size.height(), 0.05f), Field(size.width, size.height(), 0.5f),
                  Field(size.width, size.height(), 0.5f)};
    layFlakes(size, 31, 15, 0.80f, {0.10f, 0.45f}, bend, bendUp, flakes);
    layFlakes(size, 33, 13, 0.62f, {0.30f, 0.62f}, bend, bendUp, flakes);
    layFlakes(size, 34, 24, 0.33f, {0.45f, 0.70f}, bend, bendUp, flakes);

    BarkPattern bark(size);
    bark.shading = 1;
    forEachBarkRow(size, threads, [&](const BarkRow& row) {
        const NoiseRow grains(grain, row.v, row.width);
        const NoiseRow weathers(weather, row.v, row.width);
        const NoiseRow layerRow(layers, row.v, row.width);
        for (std::uint32_t x = 0; x < row.width; ++x)
        {
            const std::size_t i = row.index(x);
            const float rough = grains[x];
            const float old = weathers[x];
            const float layer = layerRow[x];
            const float random = flakes.random.values[i];
            const float rim = smoothStep(0.55f, 0.98f, flakes.out.values[i]);
            const float own = random * 7 - std::floor(random * 7);
            bark.height.values[i] = std::clamp(flakes.level.values[i] + 0.06f * rough + 0.04f * layer, 0.f, 1.f);
            Vec3 colour =
                mixed(Vec3(0.72f, 0.55f, 0.44f), Vec3(0.80f, 0.78f, 0.76f), smoothStep(0, 1, own + 0.5f * old));
            colour *= 0.90f + 0.34f * (random - 0.5f) + 0.22f * rough + 0.14f * old + 0.12f * layer;
            colour = mixed(colour, Vec3(0.92f, 0.87f, 0.81f) * (1 + 0.2f * rough),
                           0.40f * rim * smoothStep(-0.4f, 0.4f, layer)); // worn rims
            bark.colour[i] = colour * (0.55f + 0.7f * flakes.level.values[i]);
            bark.roughness.values[i] = 1 + 0.06f * rough - 0.05f * rim;
        }
    });
    return bark;
}

} // namespace espalier
