#include <Espalier/Texture/MaterialTextures.h>

#include <Espalier/Core/Random.h>
#include <Espalier/Species/LeafOutline.h>
#include <Espalier/Texture/LeafVeins.h>
#include <Espalier/Texture/Srgb.h>
#include <Espalier/Texture/SurfaceMaps.h>
#include <Espalier/Texture/TileNoise.h>
#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>

namespace espalier {
namespace {

constexpr std::uint32_t kNothing = 0xfffffffeu; // in place of a leaf

/// What each texel shows.
struct Drawing
{
    std::uint32_t width;
    std::uint32_t height;
    std::vector<SurfacePoint> points; ///< Of the leaf kNothing where all of the texel is cut out.
    std::vector<std::uint8_t> alpha;
    std::vector<Vec2> uv; ///< Where in its texel the point lies.
};

/// Texels along an edge are looked at in several places, all are where a leaf may pass between two of them.
Drawing drawingOf(const LeafSurface& surface, std::uint32_t width, std::uint32_t height, std::uint32_t threads)
{
    const std::size_t count = std::size_t{width} * height;
    SurfacePoint nothing;
    nothing.leaf = kNothing;
    Drawing drawing{width, height, std::vector<SurfacePoint>(count, nothing), std::vector<std::uint8_t>(count),
                    std::vector<Vec2>(count)};
    const Vec2 texel(1 / static_cast<float>(width), 1 / static_cast<float>(height));
    const auto cornerOf = [&](std::uint32_t x, std::uint32_t y) {
        return Vec2(static_cast<float>(x) * texel.x, 1 - static_cast<float>(y + 1) * texel.y);
    };
    forEachRow(height, threads, [&](std::uint32_t y) {
        for (std::uint32_t x = 0; x < width; ++x)
        {
            const std::size_t i = std::size_t{y} * width + x;
            drawing.uv[i] = cornerOf(x, y) + 0.5f * texel;
            const std::optional<SurfacePoint> point = surface.at(drawing.uv[i]);
            if (point)
                drawing.points[i] = *point;
            drawing.alpha[i] = point ? 255 : 0;
        }
    });

    constexpr std::uint32_t kFine = 256; // texels from foot to tip that miss nothing
    const std::vector<std::uint8_t> middles = drawing.alpha;
    forEachRow(height, threads, [&](std::uint32_t y) {
        for (std::uint32_t x = 0; x < width; ++x)
        {
            const std::size_t i = std::size_t{y} * width + x;
            bool edge = height < kFine;
            for (std::uint32_t ny = y - (y > 0); ny <= std::min(y + 1, height - 1); ++ny)
                for (std::uint32_t nx = x - (x > 0); nx <= std::min(x + 1, width - 1); ++nx)
                    edge = edge || middles[std::size_t{ny} * width + nx] != middles[i];
            edge = edge || (middles[i] != 0 && (x == 0 || y == 0 || x + 1 == width || y + 1 == height));
            if (!edge)
                continue;
            constexpr std::uint32_t kSide = 4;
            std::uint32_t covered = 0;
            float nearest = 2;
            for (std::uint32_t s = 0; s < kSide * kSide; ++s)
            {
                const Vec2 share((static_cast<float>(s % kSide) + 0.5f) / kSide,
                                 (static_cast<float>(s / kSide) + 0.5f) / kSide);
                const Vec2 uv = cornerOf(x, y) + share * texel;
                const std::optional<SurfacePoint> point = surface.at(uv);
                if (!point)
                    continue;
                ++covered;
                const Vec2 off = share - Vec2(0.5f);
                const float away = off.x * off.x + off.y * off.y;
                if (middles[i] == 0 && away < nearest)
                {
                    nearest = away;
                    drawing.points[i] = *point;
                    drawing.uv[i] = uv;
                }
            }
            drawing.alpha[i] = static_cast<std::uint8_t>((covered * 255 + kSide * kSide / 2) / (kSide * kSide));
            if (covered == 0)
                drawing.points[i] = nothing;
        }
    });
    return drawing;
}

/// What a point reflects and how high it lies, in lengths of the surface.
struct Paint
{
    Vec3 colour{0};
    float height = 0;
    float roughness = 1; ///< Relative.
};

Vec3 mixed(Vec3 a, Vec3 b, float share)
{
    return a + (b - a) * share;
}

class LeafPainter
{
public:
    LeafPainter(const LeafAppearance& leaf, const LeafSurface& surface)
        : leaf_(leaf), mottling_(9, 9, 3, 201), grain_(70, 70, 2, 202), cells_(84, 84, 1, 203), rays_(40, 3, 204),
          wood_(mixed(leaf.colour, Vec3(0.20f, 0.13f, 0.06f), 0.65f))
    {
        const RandomKey key(Seed{205});
        for (std::size_t i = 0; i < surface.leaves().size(); ++i)
        {
            const LeafOnSurface& one = surface.leaves()[i];
            Placed placed;
            placed.way = one.tip - one.foot;
            placed.foot = one.foot;
            placed.length = std::sqrt(placed.way.x * placed.way.x + placed.way.y * placed.way.y);
            placed.blade = placed.length * (1 - one.stalk);
            placed.halfWidth = one.halfWidth;
            placed.lines = surface.leaves().size() > 1 ? 2.f : 5.f;
            const float lightness = static_cast<float>(key.child(i).uniform(Purpose::Sampling, 0)) - 0.5f;
            const float warmth = static_cast<float>(key.child(i).uniform(Purpose::Sampling, 1)) - 0.5f;
            if (surface.leaves().size() > 1)
                placed.tint = Vec3(1) * (1 + 0.26f * lightness) + 0.12f * warmth * Vec3(1, 0.2f, -0.3f);
            placed.noise = {static_cast<float>(key.child(i).uniform(Purpose::Sampling, 2)),
                            static_cast<float>(key.child(i).uniform(Purpose::Sampling, 3))};
            placed_.push_back(placed);
            veins_.emplace_back(leaf.shape, one.halfWidth / placed.blade);
        }
    }

    [[nodiscard]] Paint at(const SurfacePoint& point, Vec2 uv) const
    {
        if (point.leaf == SurfacePoint::kShoot)
            return leaf_.shape == LeafShape::Blossom ? heart(point, uv) : stem(point.across, 0.006f, uv);
        const Placed& one = placed_[point.leaf];
        if (point.along <= 0)
            return stem(point.across, 0.006f * one.length, uv);
        const Vec2 arm = Vec2((uv.x - 0.5f) * leaf_.width, uv.y) - one.foot;
        const float aside = (arm.x * one.way.y - arm.y * one.way.x) / (one.length * one.blade);
        Paint paint;
        switch (leaf_.shape)
        {
        case LeafShape::Needle:
            paint = needle(point, one);
            break;
        case LeafShape::Blossom:
            paint = petal(point, aside, one);
            break;
        default:
            paint = blade(point, aside, one, veins_[point.leaf]);
        }
        paint.colour *= one.tint;
        return paint;
    }

private:
    struct Placed
    {
        Vec2 foot;
        Vec2 way;
        float length = 1;
        float blade = 1; ///< Its length without the stalk.
        float halfWidth = 0.5f;
        float lines = 5; ///< Between midrib and margin of a strip; more would blur on the small leaves of a spray.
        Vec3 tint{1};
        Vec2 noise{0}; ///< Where in the noise it lies, so that no two are alike.
    };

    [[nodiscard]] Paint stem(float across, float thickness, Vec2 uv) const
    {
        Paint paint;
        paint.colour = wood_ * (1 + 0.25f * grain_.at(uv)) * (1 - 0.25f * across * across);
        paint.height = thickness * std::sqrt(std::max(0.f, 1 - across * across));
        paint.roughness = 1.1f;
        return paint;
    }

    [[nodiscard]] Paint blade(const SurfacePoint& point, float aside, const Placed& one, const LeafVeins& veins) const
    {
        const LeafVeins::Sample vein = veins.at(point.along, aside);
        const Vec2 on(0.6f * aside + one.noise.x, 0.6f * point.along + one.noise.y);
        constexpr float kReach = 0.0036f;
        float border = kReach;
        const TileCells::Cell cell =
            cells_.visit(on, kReach, [&](float distance, float, float) { border = std::min(border, distance); });
        const float net = 1 - border / kReach;
        const float mottle = mottling_.at(on);
        const float rough = grain_.at(on);
        const float margin = point.across * point.across;
        const bool strip = leaf_.shape == LeafShape::Linear;

        float light = 1 + 0.18f * mottle + 0.06f * rough + 0.10f * (cell.random - 0.5f);
        light *= 1 + 0.14f * smoothStep(0.75f, 1, std::abs(point.across)) + 0.05f * margin;
        light *= 1 - 0.30f * smoothStep(0.75f, 0, point.along) * smoothStep(0.8f, 0, std::abs(point.across));
        light *= 0.94f + 0.9f * vein.bulge;
        Vec3 colour = leaf_.colour * light;
        colour *=
            mixed(Vec3(1), Vec3(1.14f, 1.03f, 0.75f), 0.6f * margin * margin + 0.25f * mottle); // yellower outwards
        const Vec3 pale = mixed(leaf_.colour * Vec3(1.55f, 1.4f, 1.5f), Vec3(0.32f, 0.36f, 0.14f), 0.2f);
        float height = 0.028f * vein.bulge + 0.0003f * (1 - net) + 0.0006f * rough;
        if (strip)
        {
            const float lines =
                std::abs(std::fmod(one.lines * std::abs(point.across) + 0.5f, 1.f) - 0.5f) * 2; // 1 between two
            const float fade = 0.5f + 0.5f * mottle;
            colour = mixed(colour, pale, 0.22f * (1 - lines) * fade);
            height += 0.08f * one.halfWidth / one.blade * lines / one.lines;
        }
        else
            colour = mixed(colour, pale, 0.20f * net * (1 - vein.rib));
        colour = mixed(colour, pale, 0.85f * vein.rib);
        height += 0.6f * vein.ridge;
        return {colour, height * one.blade, 1 + 0.06f * rough + 0.1f * vein.rib - 0.3f * vein.bulge};
    }

    [[nodiscard]] Paint needle(const SurfacePoint& point, const Placed& one) const
    {
        const float across = std::abs(point.across);
        const Vec2 on(one.noise.x + 0.08f * point.across, one.noise.y + 0.5f * point.along);
        float light = 0.82f + 0.25f * (1 - across) + 0.14f * mottling_.at(on);
        light *= 0.85f + 0.25f * smoothStep(0, 0.5f, point.along);
        Vec3 colour = leaf_.colour * light;
        // A pale line of wax to either side of the ridge; the point is dry.
        colour = mixed(colour, leaf_.colour * Vec3(1.35f, 1.35f, 1.7f),
                       0.45f * smoothStep(0.22f, 0.08f, std::abs(across - 0.32f)));
        colour = mixed(colour, wood_, 0.7f * smoothStep(0.93f, 1, point.along));
        const float round = std::sqrt(std::max(0.f, 1 - across * across));
        return {colour, one.halfWidth * (0.45f * round + 0.12f * smoothStep(0.2f, 0, across)), 1 - 0.1f * round};
    }

    [[nodiscard]] Paint petal(const SurfacePoint& point, float aside, const Placed& one) const
    {
        const Vec2 on(one.noise.x + 0.25f * point.across, one.noise.y + 0.25f * point.along);
        const float rays =
            rays_.at({one.noise.x + 0.32f * aside / (0.2f + point.along), one.noise.y + 0.3f * point.along});
        const float tip = smoothStep(0.1f, 0.95f, point.along);
        Vec3 colour = mixed(leaf_.colour * Vec3(0.86f, 0.62f, 0.68f), mixed(leaf_.colour, Vec3(1), 0.45f), tip);
        colour *= 1 + 0.05f * mottling_.at(on) - 0.10f * smoothStep(0.1f, 0.6f, rays) * (1 - 0.6f * tip);
        colour *= 1 - 0.10f * smoothStep(0.25f, 0, std::abs(point.across)) * (1 - tip);
        const float cup = 0.05f * (1 - point.across * point.across) - 0.08f * smoothStep(0.6f, 1, point.along);
        return {colour, one.blade * (0.0022f * rays - cup * 0.6f), 1 - 0.05f * rays};
    }

    [[nodiscard]] Paint heart(const SurfacePoint& point, Vec2 uv) const
    {
        constexpr float kReach = 0.011f;
        float border = kReach;
        const TileCells::Cell grain =
            cells_.visit(uv, kReach, [&](float distance, float, float) { border = std::min(border, distance); });
        const float bead = border / kReach;
        Paint paint;
        paint.colour = Vec3(0.72f, 0.46f, 0.04f) * (0.55f + 0.55f * bead + 0.2f * (grain.random - 0.5f));
        paint.colour =
            mixed(Vec3(0.30f, 0.36f, 0.06f), paint.colour, smoothStep(0.1f, 0.55f, point.along)); // the pistil
        paint.height = 0.02f * (1 - point.along * point.along) + 0.012f * bead;
        paint.roughness = 1.2f;
        return paint;
    }

    const LeafAppearance& leaf_;
    TileFractal mottling_;
    TileFractal grain_;
    TileCells cells_;
    TileNoise rays_;
    Vec3 wood_;
    std::vector<Placed> placed_;
    std::vector<LeafVeins> veins_;
};

/// Normals of each leaf by itself: the step from one to the next is none of its slope.
Image leafNormals(const Drawing& drawing, const Field& height, Vec2 texel, std::uint32_t threads)
{
    Image image{drawing.width, drawing.height, 3, std::vector<std::uint8_t>(3 * drawing.points.size())};
    forEachRow(drawing.height, threads, [&](std::uint32_t y) {
        for (std::uint32_t x = 0; x < drawing.width; ++x)
        {
            const std::size_t i = std::size_t{y} * drawing.width + x;
            const auto slope = [&](std::size_t low, std::size_t high, float step) {
                if (drawing.points[low].leaf != drawing.points[i].leaf)
                    low = i;
                if (drawing.points[high].leaf != drawing.points[i].leaf)
                    high = i;
                const float steps = static_cast<float>(low != i) + static_cast<float>(high != i);
                return steps > 0 ? (height.values[high] - height.values[low]) / (steps * step) : 0.f;
            };
            storeNormal(
                {slope(x == 0 ? i : i - 1, x + 1 == drawing.width ? i : i + 1, texel.x),
                 slope(y + 1 == drawing.height ? i : i + drawing.width, y == 0 ? i : i - drawing.width, texel.y)},
                image.texels.data() + 3 * i);
        }
    });
    return image;
}

/// Share of light that leaves lying above leave to each texel.
std::vector<float> underLeaves(const Drawing& drawing, std::size_t leaves)
{
    std::vector<float> open(drawing.points.size(), 1);
    if (leaves < 2)
        return open;
    Field level(drawing.width, drawing.height);
    for (std::size_t i = 0; i < open.size(); ++i)
        if (drawing.points[i].leaf == SurfacePoint::kShoot)
            level.values[i] = 0.6f;
        else if (drawing.points[i].leaf < leaves)
            level.values[i] = 1 - 0.5f * static_cast<float>(drawing.points[i].leaf) / static_cast<float>(leaves);
    const std::uint32_t radius = std::max(1u, std::min(drawing.height / 48, (drawing.width - 1) / 2));
    const Field round = blurred(level, radius);
    const auto steepness = static_cast<float>(std::min<std::size_t>(leaves, 12));
    for (std::size_t i = 0; i < open.size(); ++i)
        if (drawing.points[i].leaf != kNothing)
            open[i] = 1 / (1 + 0.8f * steepness * std::max(0.f, round.values[i] - level.values[i]));
    return open;
}

std::uint32_t widthFor(float proportion, std::uint32_t height)
{
    const float wanted = std::clamp(proportion, 0.125f, 1.f) * static_cast<float>(height);
    std::uint32_t width = height;
    // The nearer of two powers is that within a factor of the square root of two.
    while (width > height / 8 && width > 1 && static_cast<float>(width) > wanted * 1.4142135f)
        width /= 2;
    return width;
}

} // namespace

MaterialTextures makeLeafTextures(const LeafAppearance& leaf, std::uint32_t height, std::uint32_t threads)
{
    const std::uint32_t tall = std::bit_floor(std::clamp(height, kMinTextureSize, kMaxTextureSize));
    const std::uint32_t wide = widthFor(leaf.width, tall);
    const LeafSurface surface(leaf);
    const Drawing drawing = drawingOf(surface, wide, tall, threads);
    const LeafPainter painter(leaf, surface);
    const std::size_t count = drawing.points.size();

    std::vector<float> open = underLeaves(drawing, surface.leaves().size());
    std::vector<Vec3> colour(count);
    Field relief(wide, tall);
    Field roughness(wide, tall);
    forEachRow(tall, threads, [&](std::uint32_t y) {
        for (std::size_t i = std::size_t{y} * wide; i < std::size_t{y + 1} * wide; ++i)
        {
            if (drawing.points[i].leaf == kNothing)
                continue;
            const Paint paint = painter.at(drawing.points[i], drawing.uv[i]);
            colour[i] = paint.colour * (0.45f + 0.55f * open[i]);
            relief.values[i] = paint.height;
            roughness.values[i] = paint.roughness;
        }
    });

    MaterialTextures textures;
    const Vec2 texel(leaf.width / static_cast<float>(wide), 1 / static_cast<float>(tall));
    textures.normal = leafNormals(drawing, relief, texel, threads);
    textures.colour = {wide, tall, 4, std::vector<std::uint8_t>(4 * count)};
    textures.roughness = {wide, tall, 3, std::vector<std::uint8_t>(3 * count)};

    std::vector<std::uint8_t> shown(count);
    for (std::size_t i = 0; i < count; ++i)
        shown[i] = drawing.alpha[i] >= 128;
    std::vector<std::uint8_t> isDrawn(count);
    for (std::size_t i = 0; i < count; ++i)
        isDrawn[i] = drawing.points[i].leaf != kNothing;
    const std::vector<std::uint32_t> nearest = nearestDrawn(isDrawn, wide);
    std::vector<float> channel(count);
    for (int c = 0; c < 3; ++c)
    {
        for (std::size_t i = 0; i < count; ++i)
            channel[i] = std::max(0.f, colour[i][c]);
        adjustMean(channel, shown, leaf.colour[c]);
        for (std::size_t i = 0; i < count; ++i)
            textures.colour.texels[4 * i + static_cast<std::size_t>(c)] = srgbFromLinear(channel[nearest[i]]);
    }
    adjustMean(roughness.values, shown, leaf.roughness);
    const std::vector<std::uint8_t> normals = textures.normal.texels;
    for (std::size_t i = 0; i < count; ++i)
    {
        const std::size_t from = nearest[i];
        textures.colour.texels[4 * i + 3] = drawing.alpha[i];
        textures.roughness.texels[3 * i] = byteOf(open[from]);
        textures.roughness.texels[3 * i + 1] = byteOf(roughness.values[from]);
        std::copy_n(normals.begin() + static_cast<std::ptrdiff_t>(3 * from), 3,
                    textures.normal.texels.begin() + static_cast<std::ptrdiff_t>(3 * i));
    }
    return textures;
}

} // namespace espalier
