#include <Espalier/Render/ImpostorView.h>

#include <Espalier/Core/Tasks.h>
#include <Espalier/Render/Camera.h>
#include <Espalier/Render/ImpostorAtlas.h>
#include <Espalier/Render/ImpostorFilm.h>
#include <Espalier/Render/PreviewScene.h>
#include <Espalier/Texture/Srgb.h>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <vector>

namespace espalier {

namespace {

/// Rays along each side of a pixel.
constexpr std::uint32_t kSamples = 2;

constexpr Vec3 kUp{0, 1, 0};

/// Rows are added up in order, whichever thread looked at them.
template <class LookAt>
ImpostorView viewOf(std::uint32_t pixels, std::uint32_t threads, const LookAt& look)
{
    std::vector<ImpostorView> rows(pixels);
    forEachTask(
        pixels, threadsFor(threads), {},
        [&](std::uint32_t y) {
            for (std::uint32_t x = 0; x < pixels; ++x)
            {
                const FilmTexel texel = look(x, y);
                rows[y].covered += static_cast<double>(texel.share);
                rows[y].colour += static_cast<double>(texel.share) * DVec3(texel.colour);
            }
        },
        [](std::uint32_t) {});
    ImpostorView sum;
    for (const ImpostorView& row : rows)
    {
        sum.covered += row.covered;
        sum.colour += row.colour;
    }
    return sum;
}

/// Interleaved gradient noise (Jimenez, "Next Generation Post Processing in Call of Duty: Advanced Warfare", 2014).
float ditherAt(std::uint32_t x, std::uint32_t y)
{
    const auto fract = [](float value) { return value - std::floor(value); };
    return fract(52.9829189f * fract(0.06711056f * static_cast<float>(x) + 0.00583715f * static_cast<float>(y)));
}

/// Bilinear, as graphics cards look textures up; within the frame, for those never look beyond the margin.
Vec4 lookUp(const Image& image, Vec2 uv, bool isSrgb)
{
    const Vec2 size(static_cast<float>(image.width), static_cast<float>(image.height));
    const Vec2 at = glm::clamp(uv * size - Vec2(0.5f), Vec2(0), size - Vec2(1));
    const Vec2 floor(std::floor(at.x), std::floor(at.y));
    const Vec2 in = at - floor;
    const auto x0 = static_cast<std::size_t>(floor.x);
    const auto y0 = static_cast<std::size_t>(floor.y);
    const std::size_t x1 = std::min<std::size_t>(x0 + 1, image.width - 1);
    const std::size_t y1 = std::min<std::size_t>(y0 + 1, image.height - 1);
    Vec4 sum(0);
    const auto add = [&](std::size_t x, std::size_t y, float share) {
        const std::uint8_t* texel = &image.texels[(y * image.width + x) * image.channels];
        for (int c = 0; c < static_cast<int>(image.channels); ++c)
            sum[c] += share * (isSrgb && c < 3 ? linearFromSrgb(texel[c]) : static_cast<float>(texel[c]) / 255);
    };
    add(x0, y0, (1 - in.x) * (1 - in.y));
    add(x1, y0, in.x * (1 - in.y));
    add(x0, y1, (1 - in.x) * in.y);
    add(x1, y1, in.x * in.y);
    return sum;
}

/// Where in the atlas, from its top left, a place of a frame lies: `at` in half extents from the frame's middle.
Vec2 placeInAtlas(const Impostor& impostor, std::uint32_t frame, Vec2 at)
{
    const Vec2 cell(static_cast<float>(frame % impostor.columns), static_cast<float>(frame / impostor.columns));
    return (cell + 0.5f * Vec2(1 + at.x, 1 - at.y)) /
           Vec2(static_cast<float>(impostor.columns), static_cast<float>(impostor.rows));
}

/// A ray's place on the plane of a frame, moved by `depth` metres to the frame's viewer; in half extents.
struct OnFrame
{
    Vec2 at;
    float towards; ///< Metres along the ray, towards who looks.
    bool isInside;
};

OnFrame meet(const ImpostorFrame& frame, const Vec3& toViewer, const Vec3& through, float depth)
{
    const float slope = glm::dot(frame.toViewer, toViewer);
    constexpr float kEdgeOn = 1e-3f;
    if (std::abs(slope) < kEdgeOn)
        return {Vec2(0), 0, false};
    OnFrame on;
    on.towards = (glm::dot(frame.middle - through, frame.toViewer) + depth) / slope;
    const Vec3 from = through + on.towards * toViewer - frame.middle;
    on.at = Vec2(glm::dot(from, frame.right), glm::dot(from, frame.up)) / frame.halfExtent;
    on.isInside = std::abs(on.at.x) <= 1 && std::abs(on.at.y) <= 1;
    return on;
}

Vec3 directionOf(const Vec4& stored)
{
    return 2.0f * Vec3(stored) - Vec3(1);
}

std::optional<ImpostorSight> seeCards(const Impostor& impostor, const MaterialTextures& atlas, const Vec3& toViewer,
                                      const Vec3& through)
{
    float nearest = -std::numeric_limits<float>::infinity();
    std::optional<ImpostorSight> sight;
    for (std::uint32_t i = 0; i < impostor.frames.size(); ++i)
    {
        const ImpostorFrame& frame = impostor.frames[i];
        const OnFrame on = meet(frame, toViewer, through, 0);
        const bool isFront = glm::dot(frame.toViewer, toViewer) > 0;
        if (!on.isInside || !isFront || on.towards <= nearest)
            continue;
        const Vec2 uv = placeInAtlas(impostor, i, on.at);
        const Vec4 colour = lookUp(atlas.colour, uv, true);
        if (colour.w < 0.5f)
            continue;
        nearest = on.towards;
        const Vec3 own = directionOf(lookUp(atlas.normal, uv, false));
        const Vec3 normal = own.x * frame.right + own.y * frame.up + own.z * frame.toViewer;
        sight = ImpostorSight{Vec3(colour), glm::normalize(normal)};
    }
    return sight;
}

/// One frame a ray, picked by its share: mixing all three would lose everything thin, for it lies elsewhere in each.
std::optional<ImpostorSight> seePicked(const Impostor& impostor, const MaterialTextures& atlas, const Vec3& toViewer,
                                       const Vec3& through, float dither)
{
    const FrameBlend blend = framesFor(toViewer, impostor.columns);
    const bool isFirst = dither < blend.shares[0];
    const std::uint32_t picked = blend.frames[isFirst ? 0 : dither < blend.shares[0] + blend.shares[1] ? 1 : 2];
    const ImpostorFrame& frame = impostor.frames[picked];
    OnFrame on = meet(frame, toViewer, through, 0);
    if (!on.isInside)
        return std::nullopt;
    // What is seen lies before the plane: once more where it is as deep as the picture says.
    const float depth = 2 * lookUp(atlas.roughness, placeInAtlas(impostor, picked, on.at), false).z - 1;
    on = meet(frame, toViewer, through, depth * impostor.radius);
    if (!on.isInside)
        return std::nullopt;
    const Vec2 uv = placeInAtlas(impostor, picked, on.at);
    const Vec4 seen = lookUp(atlas.colour, uv, true);
    if (seen.w < 0.5f)
        return std::nullopt;
    const Vec3 normal = directionOf(lookUp(atlas.normal, uv, false));
    const float length = glm::length(normal);
    return ImpostorSight{Vec3(seen), length > 0 ? normal / length : toViewer};
}

} // namespace

Vec3 toViewerAt(double azimuth) noexcept
{
    return Vec3(-viewAxes(azimuth, 0).forward);
}

DVec3 ImpostorView::mean() const noexcept
{
    return covered > 0 ? colour / covered : DVec3(0);
}

std::optional<ImpostorSight> seeImpostor(const Impostor& impostor, const MaterialTextures& atlas, const Vec3& toViewer,
                                         const Vec3& through, float dither) noexcept
{
    return impostor.kind == ImpostorKind::Cards ? seeCards(impostor, atlas, toViewer, through)
                                                : seePicked(impostor, atlas, toViewer, through, dither);
}

ImpostorView viewPlant(const PreviewScene& scene, const Impostor& impostor, double azimuth, std::uint32_t pixels,
                       std::uint32_t threads)
{
    const Vec3 right(viewAxes(azimuth, 0).right);
    const Vec3 toViewer = toViewerAt(azimuth);
    const float pixel = 2 * impostor.radius / static_cast<float>(pixels);
    const Vec3 corner = impostor.centre - impostor.radius * (right + kUp);
    return viewOf(pixels, threads, [&](std::uint32_t x, std::uint32_t y) {
        const Vec3 at = corner + pixel * (static_cast<float>(x) * right + static_cast<float>(y) * kUp);
        return lookAt(scene, {at, pixel * right, pixel * kUp, toViewer}, farFrom(impostor), kSamples,
                      RandomKey(Seed{}).child(y).child(x));
    });
}

ImpostorView viewImpostor(const Impostor& impostor, const MaterialTextures& atlas, double azimuth, std::uint32_t pixels,
                          std::uint32_t threads)
{
    const Vec3 right(viewAxes(azimuth, 0).right);
    const Vec3 toViewer = toViewerAt(azimuth);
    const std::uint32_t rays = kSamples * pixels;
    const float step = 2 * impostor.radius / static_cast<float>(rays);
    return viewOf(rays, threads, [&](std::uint32_t x, std::uint32_t y) {
        const RandomKey key = RandomKey(Seed{}).child(y).child(x);
        const float across = static_cast<float>(x) + static_cast<float>(key.uniform(Purpose::Sampling, 0));
        const float along = static_cast<float>(y) + static_cast<float>(key.uniform(Purpose::Sampling, 1));
        const Vec2 at = step * Vec2(across, along) - impostor.radius;
        const auto sight =
            seeImpostor(impostor, atlas, toViewer, impostor.centre + at.x * right + at.y * kUp, ditherAt(x, y));
        constexpr float kShare = 1.0f / (kSamples * kSamples);
        return sight ? FilmTexel{.colour = sight->colour, .share = kShare} : FilmTexel{};
    });
}

} // namespace espalier
