// Birch: chalky paper in bands, with dark pores drawn out across the axis, torn patches that show the warm layer
// beneath, and black rough scars where branches were shed, under drooping brows.

#include <Espalier/Core/Random.h>
#include <Espalier/Texture/BarkPattern.h>
#include <Espalier/Texture/TileNoise.h>

namespace espalier {
namespace {

/// Random numbers of one of several alike features.
struct Feature
{
    RandomKey key;

    Feature(std::uint64_t kind, std::uint32_t index) : key(RandomKey(Seed{kind}).child(index)) {}

    [[nodiscard]] float draw(double low, double high, std::uint32_t counter) const
    {
        return static_cast<float>(key.uniform(Purpose::Sampling, low, high, counter));
    }
};

void drawPores(BarkPattern& bark, BarkSize size)
{
    constexpr std::uint32_t kRows = 56; // in a width
    const std::uint32_t rows = kRows * size.tall;
    const TileNoise ragged(50, 90, 96, size.tall);
    for (std::uint32_t i = 0; i < 4 * rows; ++i)
    {
        const Feature pore(91, i);
        // Rows keep them apart; most are short, a few are long.
        const float row = (static_cast<float>(i % rows) + pore.draw(0.1, 0.9, 0)) / kRows;
        const Vec2 middle(pore.draw(0, 1, 1), row);
        const float longer = pore.draw(0, 1, 2);
        const Vec2 half(0.006f + 0.055f * longer * longer * longer,
                        pore.draw(0.0014, 0.0036, 3) * (0.7f + 0.6f * longer));
        const float ink = pore.draw(0.35, 0.95, 4);
        const float bend = pore.draw(-0.5, 0.5, 5);
        forEachTexelRound(size, middle, {half.x, 2 * half.y}, [&](std::size_t texel, Vec2 local) {
            const Vec2 uv(middle.x + local.x * half.x, middle.y + 2 * local.y * half.y);
            const float across = 2 * local.y - bend * local.x * local.x + 0.5f * ragged.at(uv);
            const float inside = 1 - local.x * local.x - across * across;
            if (inside <= 0)
                return;
            const float dark = ink * smoothStep(0, 0.55f, inside);
            bark.colour[texel] = mixed(bark.colour[texel], Vec3(0.20f, 0.155f, 0.13f), dark);
            bark.height.values[texel] += 0.11f * smoothStep(0, 0.5f, inside) - 0.16f * smoothStep(0.5f, 0.9f, inside);
            bark.roughness.values[texel] *= 1 + 0.15f * dark;
        });
    }
}

void drawTornPatches(BarkPattern& bark, BarkSize size)
{
    const TileFractal ragged(11, 70, 4, 97, size.tall);
    const TileNoise fibres(24, 150, 98, size.tall);
    for (std::uint32_t i = 0; i < 7 * size.tall; ++i)
    {
        const Feature patch(92, i);
        const Vec2 middle(patch.draw(0, 1, 0), (static_cast<float>(i) + patch.draw(0.1, 0.9, 1)) / 7);
        const Vec2 half(patch.draw(0.08, 0.24, 2), patch.draw(0.014, 0.04, 3));
        const float warm = patch.draw(0.25, 0.8, 4);
        forEachTexelRound(size, middle, half, [&](std::size_t texel, Vec2 local) {
            const Vec2 uv(middle.x + local.x * half.x, middle.y + local.y * half.y);
            const float fading = std::max(0.f, 1 - local.x * local.x - local.y * local.y);
            const float inside = 0.42f - 0.8f * std::abs(local.y) - 0.6f * local.x * local.x + 0.62f * ragged.at(uv);
            const float torn = smoothStep(0, 0.12f, inside) * std::min(1.f, 3 * fading);
            const float curl =
                smoothStep(-0.3f, -0.02f, inside) * (1 - smoothStep(-0.02f, 0.08f, inside)) * std::min(1.f, 3 * fading);
            const Vec3 beneath = Vec3(0.82f, 0.63f, 0.49f) * (0.95f + 0.16f * fibres.at(uv));
            bark.colour[texel] = mixed(bark.colour[texel], beneath, warm * torn);
            bark.colour[texel] = mixed(bark.colour[texel], Vec3(1.0f, 0.97f, 0.93f), 0.35f * curl);
            // Under the upper edge lies its shadow.
            bark.colour[texel] *=
                1 - 0.40f * torn * (1 - smoothStep(0.02f, 0.35f, inside)) * smoothStep(-0.4f, 0.5f, local.y);
            bark.height.values[texel] += 0.09f * curl - 0.10f * torn;
        });
    }
}

void drawScars(BarkPattern& bark, BarkSize size)
{
    const TileFractal edge(13, 24, 4, 99, size.tall);
    const TileFractal crust(40, 60, 3, 100, size.tall);
    // No two alike, none above another, at uneven heights: what repeats is seen from afar.
    struct Scar
    {
        Vec2 middle;
        Vec2 half;
        float droop; // of the brows
        float round; // of the eye: below 1 a slit
        float turn;
    };
    constexpr Scar kScars[] = {
        {{0.27f, 0.71f}, {0.17f, 0.11f}, 0.85f, 1.0f, 0.05f},   {{0.83f, 1.06f}, {0.06f, 0.035f}, 0.4f, 0.6f, -0.1f},
        {{0.56f, 1.60f}, {0.13f, 0.075f}, 1.1f, 0.75f, -0.12f}, {{0.05f, 1.87f}, {0.045f, 0.04f}, 0.7f, 1.2f, 0.1f},
        {{0.38f, 2.23f}, {0.07f, 0.045f}, 0.95f, 0.8f, 0.15f},  {{0.91f, 2.62f}, {0.20f, 0.13f}, 0.8f, 1.15f, -0.06f},
        {{0.60f, 2.85f}, {0.04f, 0.022f}, 0.3f, 0.5f, 0.0f},    {{0.17f, 3.37f}, {0.11f, 0.085f}, 1.0f, 0.9f, 0.12f},
        {{0.68f, 3.79f}, {0.09f, 0.05f}, 0.6f, 0.65f, 0.18f},   {{0.48f, 0.22f}, {0.05f, 0.028f}, 0.5f, 0.7f, -0.08f},
        {{0.72f, 0.55f}, {0.035f, 0.03f}, 0.8f, 1.1f, 0.0f},    {{0.14f, 1.33f}, {0.09f, 0.06f}, 0.9f, 0.9f, 0.1f},
        {{0.78f, 2.04f}, {0.055f, 0.03f}, 0.5f, 0.6f, 0.16f},   {{0.10f, 2.50f}, {0.035f, 0.02f}, 0.4f, 0.8f, 0.0f},
        {{0.80f, 3.21f}, {0.12f, 0.08f}, 1.0f, 1.0f, -0.1f},    {{0.44f, 3.60f}, {0.04f, 0.03f}, 0.6f, 1.1f, 0.05f}};
    for (const Scar& scar : kScars)
    {
        if (scar.middle.y >= static_cast<float>(size.tall))
            continue;
        const Vec2 half = 1.25f * scar.half;
        forEachTexelRound(size, scar.middle, 1.2f * half, [&](std::size_t texel, Vec2 wide) {
            const Vec2 out = 1.2f * wide;
            const Vec2 uv = scar.middle + out * half;
            const Vec2 local(out.x, out.y - scar.turn * out.x);
            const float fringe = edge.at(uv);
            const float rough = crust.at(uv);
            // Two brows droop from above an eye; all is torn.
            const float away = std::abs(local.x);
            const float brow = 0.17f * std::sqrt(std::max(0.f, 1 - away)) -
                               std::abs(local.y - 0.42f + scar.droop * away * std::sqrt(away));
            const float eye = 0.44f * scar.round - std::sqrt(1.2f * scar.round * local.x * local.x +
                                                             2.2f * (local.y + 0.02f) * (local.y + 0.02f));
            const float inside = std::max(brow, eye) + 0.20f * fringe + 0.08f * rough;
            const float fading = std::max(0.f, 1 - (wide.x * wide.x + wide.y * wide.y));
            const float dark = smoothStep(0, 0.09f, inside) * std::min(1.f, 4 * fading);
            const float smudge = smoothStep(-0.30f, 0.05f, inside) * fading;
            bark.colour[texel] *= 1 - 0.4f * smudge;
            const Vec3 crusted = Vec3(0.105f, 0.09f, 0.08f) * (1.15f + 1.1f * rough);
            bark.colour[texel] = mixed(bark.colour[texel], crusted, 0.96f * dark);
            bark.height.values[texel] +=
                dark * (0.10f + 0.42f * rough) + 0.06f * smoothStep(-0.25f, 0, inside) * fading;
            bark.roughness.values[texel] *= 1 + 0.6f * dark;
        });
    }
}

} // namespace

BarkPattern paperyBark(BarkSize size, std::uint32_t threads)
{
    const TileNoise sway(3, 4, 81, size.tall);
    const TileFractal bands(2, 9, 3, 82, size.tall);
    const TileNoise streaks(6, 90, 83, size.tall);
    const TileNoise hairs(14, 230, 84, size.tall);
    const TileFractal chalk(5, 6, 5, 85, size.tall);
    const TileFractal grain(90, 150, 2, 86, size.tall);

    BarkPattern bark(size);
    bark.shading = 0.6f;
    forEachBarkRow(size, threads, [&](const BarkRow& row) {
        const NoiseRow sways(sway, row.v, row.width);
        const NoiseRow dusts(chalk, row.v, row.width);
        const NoiseRow grains(grain, row.v, row.width);
        for (std::uint32_t x = 0; x < row.width; ++x)
        {
            const std::size_t i = row.index(x);
            const Vec2 uv = row.uv(x);
            const Vec2 at(uv.x, uv.y + 0.012f * sways[x]);
            const float band = bands.at(at);
            const float streak = streaks.at(at);
            const float hair = hairs.at(at);
            const float dust = dusts[x];
            const float rough = grains[x];
            const float line = smoothStep(0.32f, 0.75f, streak) * smoothStep(-0.4f, 0.3f, dust);
            bark.height.values[i] = 0.5f + 0.07f * band + 0.05f * streak + 0.02f * hair + 0.012f * rough + 0.04f * dust;
            Vec3 colour = mixed(Vec3(1.0f, 0.965f, 0.92f), Vec3(0.97f, 0.975f, 0.98f), smoothStep(-0.4f, 0.4f, band));
            colour = mixed(colour, Vec3(0.93f, 0.80f, 0.70f), 0.45f * smoothStep(0.05f, 0.7f, -band - 0.4f * dust));
            colour = mixed(colour, Vec3(0.68f, 0.67f, 0.65f), 0.55f * smoothStep(0.2f, 0.75f, dust - 0.3f * band));
            colour *= 0.96f + 0.035f * hair + 0.04f * rough + 0.05f * dust - 0.17f * line;
            bark.colour[i] = colour;
            bark.roughness.values[i] = 1 - 0.08f * band + 0.05f * rough + 0.1f * line;
        }
    });
    drawTornPatches(bark, size);
    drawPores(bark, size);
    drawScars(bark, size);
    for (float& height : bark.height.values)
        height = std::clamp(height, 0.f, 1.f);
    return bark;
}

} // namespace espalier
