#include <Espalier/Render/ImpostorAtlas.h>

#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Core/Random.h>
#include <Espalier/Core/Tasks.h>
#include <Espalier/Mesh/TreeMesh.h>
#include <Espalier/Render/PreviewScene.h>
#include <Espalier/Species/Appearance.h>
#include <Espalier/Texture/AppearanceTextures.h>
#include <Espalier/Texture/Srgb.h>
#include <Espalier/Texture/SurfaceMaps.h>
#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

namespace espalier {

namespace {

constexpr std::uint32_t kMinCell = 8;          // texels along a frame
constexpr float kRoughness = 0.7f;             // of leaves and bark together, from afar
constexpr std::uint32_t kCalibratedViews = 16; // more than are compared, so that the fit is not to these alone

/// What one texel shows of the plant.
struct Texel
{
    Vec3 colour{0};  ///< Mean of what is covered, linear.
    Vec3 normal{0};  ///< Mean, plant space, not unit.
    float depth = 0; ///< Metres before the frame's middle, mean.
    float share = 0; ///< Covered, [0, 1].
    float round = 0; ///< Covered of the square round it, [0, 1].
    float open = 0;  ///< Of what is covered, how much light reaches: [0, 1].
};

/// The frames side by side.
struct Canvas
{
    std::uint32_t cell = 0; ///< Texels along a frame.
    std::uint32_t width = 0;
    std::vector<Texel> texels;

    [[nodiscard]] std::size_t at(std::uint32_t frame, std::uint32_t side, std::uint32_t x, std::uint32_t y) const
    {
        return std::size_t{frame / side * cell + y} * width + (frame % side * cell + x);
    }
};

/// The plant, ready to be looked at. Scenes want a paint box that outlives them.
struct Model
{
    Model(const RenderSubject& subject, float size, std::uint32_t threads)
        : paints(makeTextures(*subject.appearance, {.bark = 512, .leaf = 256}, threads)),
          scene(*subject.mesh, *subject.appearance, paints, {.size = static_cast<double>(size)})
    {}

    PaintBox paints;
    PreviewScene scene;
};

Expected<std::unique_ptr<Model>> modelOf(const RenderSubject& subject, const Impostor& impostor, std::uint32_t threads)
{
    if (auto checked = checkSubject(subject); !checked)
        return tl::unexpected(checked.error());
    if (impostor.frames.empty() || impostor.frames.size() > std::size_t{impostor.side} * impostor.side)
        return failure(ErrorKind::BadInput, {},
                       "the impostor has " + std::to_string(impostor.frames.size()) + " frames",
                       "those that makeImpostor gives it for this plant");
    auto model = std::make_unique<Model>(subject, 2 * impostor.radius, threads);
    if (!model->scene.isReady())
        return failure(ErrorKind::Limit, {}, "the impostor's scene does not fit into memory");
    return model;
}

/// Metres from the middle of a frame from where nothing of the plant is behind.
float farFrom(const Impostor& impostor)
{
    return 2.5f * impostor.radius;
}

/// A texel or pixel in space: seen from its viewer, its lower left corner and its sides, in metres.
struct Patch
{
    Vec3 corner;
    Vec3 right;
    Vec3 up;
    Vec3 toViewer;
};

/// What the plant shows in `patch`, by samples * samples rays. `key` is the patch's own.
Texel look(const PreviewScene& scene, const Patch& patch, float far, std::uint32_t samples, const RandomKey& key)
{
    Texel texel;
    std::uint32_t covered = 0;
    const float step = 1 / static_cast<float>(samples);
    const auto random = [&](std::uint32_t i) { return static_cast<float>(key.uniform(Purpose::Sampling, i)); };
    for (std::uint32_t i = 0; i < samples * samples; ++i)
    {
        // Somewhere in its cell: on a lattice, a trunk would be as wide as the columns that happen to meet it.
        const float x = (static_cast<float>(i % samples) + random(4 * i)) * step;
        const float y = (static_cast<float>(i / samples) + random(4 * i + 1)) * step;
        const auto sight = scene.sight(patch.corner + x * patch.right + y * patch.up + far * patch.toViewer,
                                       -patch.toViewer, {random(4 * i + 2), random(4 * i + 3)});
        if (!sight)
            continue;
        ++covered;
        texel.colour += sight->colour;
        texel.normal += sight->normal;
        texel.depth += far - sight->distance;
        texel.open += sight->isOpen ? 1.0f : 0.0f;
    }
    if (covered == 0)
        return texel;
    const auto count = static_cast<float>(covered);
    texel.colour /= count;
    texel.depth /= count;
    texel.open /= count;
    texel.share = count * step * step;
    return texel;
}

/// Fills Texel::round. Sums over rows, then over columns of these; beyond a frame there is nothing.
void lookRound(std::uint32_t side, Canvas& canvas)
{
    const std::uint32_t reach = std::max(canvas.cell / 64, 1u);
    const auto window = static_cast<float>(2 * reach + 1);
    std::vector<float> rows(std::size_t{canvas.cell} * canvas.cell);
    const auto sumAround = [&](std::uint32_t middle, const auto& at) {
        float sum = 0;
        for (std::uint32_t i = middle - std::min(middle, reach); i <= std::min(middle + reach, canvas.cell - 1); ++i)
            sum += at(i);
        return sum / window;
    };
    for (std::uint32_t frame = 0; frame < side * side; ++frame)
    {
        for (std::uint32_t y = 0; y < canvas.cell; ++y)
            for (std::uint32_t x = 0; x < canvas.cell; ++x)
                rows[std::size_t{y} * canvas.cell + x] =
                    sumAround(x, [&](std::uint32_t i) { return canvas.texels[canvas.at(frame, side, i, y)].share; });
        for (std::uint32_t y = 0; y < canvas.cell; ++y)
            for (std::uint32_t x = 0; x < canvas.cell; ++x)
                canvas.texels[canvas.at(frame, side, x, y)].round = std::min(
                    sumAround(y, [&](std::uint32_t i) { return rows[std::size_t{i} * canvas.cell + x]; }), 1.0f);
    }
}

Expected<Canvas> photograph(const PreviewScene& scene, const Impostor& impostor, const AtlasSettings& settings,
                            const Progress& progress)
{
    const std::uint32_t side = impostor.side;
    Canvas canvas;
    canvas.cell = std::max(kMinCell, settings.size / side);
    canvas.width = canvas.cell * side;
    canvas.texels.resize(std::size_t{canvas.width} * canvas.width);
    const std::uint32_t rows = canvas.width;
    const auto row = [&](std::uint32_t task) {
        const std::uint32_t y = task % canvas.cell;
        for (std::uint32_t column = 0; column < side; ++column)
        {
            const std::uint32_t number = task / canvas.cell * side + column;
            if (number >= impostor.frames.size())
                continue;
            const ImpostorFrame& frame = impostor.frames[number];
            const float texel = 2 / static_cast<float>(canvas.cell);
            const Vec3 right = frame.halfExtent.x * texel * frame.right;
            const Vec3 up = frame.halfExtent.y * texel * frame.up;
            const Vec3 left = frame.middle - frame.halfExtent.x * frame.right + frame.halfExtent.y * frame.up -
                              static_cast<float>(y + 1) * up;
            for (std::uint32_t x = 0; x < canvas.cell; ++x)
            {
                const std::size_t at = canvas.at(number, side, x, y);
                const Patch patch{left + static_cast<float>(x) * right, right, up, frame.toViewer};
                canvas.texels[at] =
                    look(scene, patch, farFrom(impostor), settings.samples, RandomKey(Seed{}).child(at));
            }
        }
    };
    forEachTask(rows, threadsFor(settings.threads), progress, row,
                [&](std::uint32_t taken) { progress("impostor", static_cast<double>(taken) / rows); });
    if (progress.wantsStop())
        return failure(ErrorKind::Cancelled, {}, "painting the impostor was cancelled");
    lookRound(side, canvas);
    return canvas;
}

/// Alpha, all or nothing. A texel is seldom all plant, and rounded each by itself far twigs would vanish: what one is
/// given too much its neighbours are given less (Floyd and Steinberg, 1976). Only where there is some of the plant:
/// what would spread into the air waits for the next texel that has some.
///
/// `density` above 0 makes the plant denser where it covers a texel in part, below 0 thinner where there is little of
/// it round a texel: a trunk stays as solid as it is.
void cutOut(const Canvas& canvas, std::uint32_t side, double density, Image& colour)
{
    std::vector<float> wanted(std::size_t{canvas.cell} * canvas.cell);
    const auto cell = static_cast<std::int32_t>(canvas.cell);
    for (std::uint32_t frame = 0; frame < side * side; ++frame)
    {
        const auto texelAt = [&](std::int32_t x, std::int32_t y) {
            return canvas.at(frame, side, static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y));
        };
        const auto place = [&](std::int32_t x, std::int32_t y) { return static_cast<std::size_t>(y * cell + x); };
        for (std::int32_t y = 0; y < cell; ++y)
            for (std::int32_t x = 0; x < cell; ++x)
            {
                const Texel& texel = canvas.texels[texelAt(x, y)];
                const auto share = static_cast<double>(texel.share);
                wanted[place(x, y)] =
                    static_cast<float>(density > 0 ? math::pow(share, math::pow(2, -density))
                                                   : share * math::pow(static_cast<double>(texel.round), -density));
            }
        float waiting = 0;
        for (std::int32_t y = 0; y < cell; ++y)
            for (std::int32_t i = 0; i < cell; ++i)
            {
                const std::int32_t forward = y % 2 == 0 ? 1 : -1; // to and fro, or slanting lines would show
                const std::int32_t x = forward > 0 ? i : cell - 1 - i;
                std::uint8_t& alpha = colour.texels[4 * texelAt(x, y) + 3];
                alpha = 0;
                if (!(canvas.texels[texelAt(x, y)].share > 0))
                    continue;
                const float here = wanted[place(x, y)] + std::exchange(waiting, 0.0f);
                alpha = here >= 0.5f ? 255 : 0;
                const float left = here - (alpha > 0 ? 1.0f : 0.0f);
                struct Neighbour
                {
                    std::int32_t x;
                    std::int32_t y;
                    float weight;
                };
                const std::array neighbours{Neighbour{x + forward, y, 7}, Neighbour{x - forward, y + 1, 3},
                                            Neighbour{x, y + 1, 5}, Neighbour{x + forward, y + 1, 1}};
                const auto takes = [&](const Neighbour& n) {
                    return n.x >= 0 && n.x < cell && n.y < cell && canvas.texels[texelAt(n.x, n.y)].share > 0;
                };
                float weights = 0;
                for (const Neighbour& n : neighbours)
                    weights += takes(n) ? n.weight : 0;
                if (!(weights > 0))
                    waiting = left;
                for (const Neighbour& n : neighbours)
                    if (takes(n))
                        wanted[place(n.x, n.y)] += left * n.weight / weights;
            }
    }
}

/// The share of light that reaches a texel, from all that is seen round it: a few rays each are too few.
float openAt(const Canvas& canvas, std::uint32_t frame, std::uint32_t side, std::uint32_t x, std::uint32_t y)
{
    constexpr std::uint32_t kReach = 2; // texels
    const auto first = [&](std::uint32_t at) { return at - std::min(at, kReach); };
    const auto last = [&](std::uint32_t at) { return std::min(at + kReach, canvas.cell - 1); };
    float sum = 0;
    float whole = 0;
    for (std::uint32_t ny = first(y); ny <= last(y); ++ny)
        for (std::uint32_t nx = first(x); nx <= last(x); ++nx)
        {
            const Texel& texel = canvas.texels[canvas.at(frame, side, nx, ny)];
            sum += texel.share * texel.open;
            whole += texel.share;
        }
    return whole > 0 ? sum / whole : 1;
}

std::uint8_t signedByte(float value)
{
    return byteOf(0.5f + 0.5f * value);
}

/// Everything but alpha.
MaterialTextures develop(const Canvas& canvas, const Impostor& impostor)
{
    const std::size_t count = canvas.texels.size();
    std::vector<std::uint8_t> isDrawn(count);
    for (std::size_t i = 0; i < count; ++i)
        isDrawn[i] = canvas.texels[i].share > 0;
    const std::vector<std::uint32_t> nearest = nearestDrawn(isDrawn, canvas.width);
    const bool isOctahedral = impostor.kind == ImpostorKind::Octahedral;
    MaterialTextures atlas;
    atlas.colour = {canvas.width, canvas.width, 4, std::vector<std::uint8_t>(4 * count)};
    const std::size_t channels = isOctahedral ? 4 : 3;
    atlas.normal = {canvas.width, canvas.width, static_cast<std::uint32_t>(channels),
                    std::vector<std::uint8_t>(channels * count)};
    atlas.roughness = {canvas.width, canvas.width, 3, std::vector<std::uint8_t>(3 * count)};
    for (std::uint32_t number = 0; number < impostor.frames.size(); ++number)
    {
        const ImpostorFrame& frame = impostor.frames[number];
        for (std::uint32_t y = 0; y < canvas.cell; ++y)
            for (std::uint32_t x = 0; x < canvas.cell; ++x)
            {
                const std::size_t i = canvas.at(number, impostor.side, x, y);
                const Texel& texel = canvas.texels[nearest[i]];
                for (int c = 0; c < 3; ++c)
                    atlas.colour.texels[4 * i + static_cast<std::size_t>(c)] = srgbFromLinear(texel.colour[c]);
                atlas.roughness.texels[3 * i] = byteOf(openAt(canvas, number, impostor.side, x, y));
                atlas.roughness.texels[3 * i + 1] = byteOf(kRoughness);
                const float length = glm::length(texel.normal);
                const Vec3 normal = length > 1e-6f ? texel.normal / length : frame.toViewer;
                const Vec3 stored =
                    isOctahedral ? normal
                                 : Vec3(glm::dot(normal, frame.right), glm::dot(normal, frame.up),
                                        std::max(glm::dot(normal, frame.toViewer), 0.05f)); // to the viewer's side
                std::uint8_t* bytes = &atlas.normal.texels[channels * i];
                for (int c = 0; c < 3; ++c)
                    bytes[c] = signedByte(stored[c]);
                if (isOctahedral)
                    bytes[3] = signedByte(texel.depth / impostor.radius);
            }
    }
    return atlas;
}

constexpr double kNothing = 1e-12;

/// Rays along each side of a pixel where the plant or its impostor is looked at.
constexpr std::uint32_t kViewSamples = 2;

/// What is to be seen from one side, in a square as large as the ball round the plant.
struct View
{
    double covered = 0; ///< In pixels.
    DVec3 colour{0};    ///< Sum over what is covered.

    [[nodiscard]] DVec3 mean() const { return colour / std::max(covered, kNothing); }
};

struct ViewAxis
{
    Vec3 toViewer;
    Vec3 right;
    static constexpr Vec3 kUp{0, 1, 0};
};

ViewAxis axisOf(double azimuth)
{
    const auto [sin, cos] = math::sinCos(azimuth);
    const auto s = static_cast<float>(sin);
    const auto c = static_cast<float>(cos);
    return {{s, 0, c}, {c, 0, -s}};
}

/// Rows are added up in order, whichever thread looked at them.
template <class LookAt>
View viewOf(std::uint32_t pixels, std::uint32_t threads, const LookAt& lookAt)
{
    std::vector<View> rows(pixels);
    forEachTask(
        pixels, threadsFor(threads), {},
        [&](std::uint32_t y) {
            for (std::uint32_t x = 0; x < pixels; ++x)
            {
                const Texel texel = lookAt(x, y);
                rows[y].covered += static_cast<double>(texel.share);
                rows[y].colour += static_cast<double>(texel.share) * DVec3(texel.colour);
            }
        },
        [](std::uint32_t) {});
    View sum;
    for (const View& row : rows)
    {
        sum.covered += row.covered;
        sum.colour += row.colour;
    }
    return sum;
}

View viewPlant(const PreviewScene& scene, const Impostor& impostor, double azimuth, std::uint32_t pixels,
               std::uint32_t threads)
{
    const ViewAxis axis = axisOf(azimuth);
    const float pixel = 2 * impostor.radius / static_cast<float>(pixels);
    const Vec3 corner = impostor.centre - impostor.radius * (axis.right + ViewAxis::kUp);
    return viewOf(pixels, threads, [&](std::uint32_t x, std::uint32_t y) {
        const Vec3 at = corner + pixel * (static_cast<float>(x) * axis.right + static_cast<float>(y) * ViewAxis::kUp);
        return look(scene, {at, pixel * axis.right, pixel * ViewAxis::kUp, axis.toViewer}, farFrom(impostor),
                    kViewSamples, RandomKey(Seed{}).child(y).child(x));
    });
}

/// Interleaved gradient noise (Jimenez, "Next Generation Post Processing in Call of Duty: Advanced Warfare", 2014).
float ditherAt(std::uint32_t x, std::uint32_t y)
{
    const auto fract = [](float value) { return value - std::floor(value); };
    return fract(52.9829189f * fract(0.06711056f * static_cast<float>(x) + 0.00583715f * static_cast<float>(y)));
}

View viewImpostor(const Impostor& impostor, const MaterialTextures& atlas, double azimuth, std::uint32_t pixels,
                  std::uint32_t threads)
{
    const ViewAxis axis = axisOf(azimuth);
    const std::uint32_t rays = kViewSamples * pixels;
    const float step = 2 * impostor.radius / static_cast<float>(rays);
    return viewOf(rays, threads, [&](std::uint32_t x, std::uint32_t y) {
        const RandomKey key = RandomKey(Seed{}).child(y).child(x);
        const float right = static_cast<float>(x) + static_cast<float>(key.uniform(Purpose::Sampling, 0));
        const float up = static_cast<float>(y) + static_cast<float>(key.uniform(Purpose::Sampling, 1));
        const Vec2 at = step * Vec2(right, up) - impostor.radius;
        const auto sight = seeImpostor(impostor, atlas, axis.toViewer,
                                       impostor.centre + at.x * axis.right + at.y * ViewAxis::kUp, ditherAt(x, y));
        constexpr float kShare = 1.0f / (kViewSamples * kViewSamples);
        return sight ? Texel{.colour = sight->colour, .share = kShare} : Texel{};
    });
}

/// Multiplies the linear colours of one frame.
void tone(const Canvas& canvas, std::uint32_t frame, std::uint32_t side, const Vec3& gain, Image& colour)
{
    for (std::uint32_t y = 0; y < canvas.cell; ++y)
        for (std::uint32_t x = 0; x < canvas.cell; ++x)
            for (int c = 0; c < 3; ++c)
            {
                std::uint8_t& texel = colour.texels[4 * canvas.at(frame, side, x, y) + static_cast<std::size_t>(c)];
                texel = srgbFromLinear(gain[c] * linearFromSrgb(texel));
            }
}

/// Cuts the frames out so that the impostor covers as much as the plant in the mean of all calibrated views, for cards
/// hide each other's holes and filters eat edges; then tones them so that it is as bright, for of what is cut off more
/// is leaf than wood.
void calibrate(const PreviewScene& scene, const Impostor& impostor, const Canvas& canvas, std::uint32_t threads,
               MaterialTextures& atlas)
{
    const std::uint32_t pixels = std::clamp(canvas.cell / kViewSamples, 64u, 128u);
    const auto azimuth = [](std::uint32_t view) { return 2 * math::kPi * view / kCalibratedViews; };
    std::array<View, kCalibratedViews> plant{};
    for (std::uint32_t view = 0; view < kCalibratedViews; ++view)
        plant[view] = viewPlant(scene, impostor, azimuth(view), pixels, threads);
    std::array<View, kCalibratedViews> shown{};
    const auto coverage = [&](double density) {
        cutOut(canvas, impostor.side, density, atlas.colour);
        double sum = 0;
        for (std::uint32_t view = 0; view < kCalibratedViews; ++view)
        {
            shown[view] = viewImpostor(impostor, atlas, azimuth(view), pixels, threads);
            sum += shown[view].covered / std::max(plant[view].covered, kNothing);
        }
        return sum / kCalibratedViews;
    };
    double low = -4;
    double high = 4;
    constexpr int kSteps = 8;
    for (int step = 0; step < kSteps; ++step)
    {
        const double density = 0.5 * (low + high);
        (coverage(density) < 1 ? low : high) = density;
    }
    constexpr int kTones = 6;
    for (int step = 0; step < kTones; ++step)
    {
        for (std::uint32_t frame = 0; frame < impostor.frames.size(); ++frame)
        {
            DVec3 own(0);
            DVec3 theirs(0);
            for (std::uint32_t view = 0; view < kCalibratedViews; ++view)
            {
                // Of cards those count that see them square on; frames from above have no view of their own.
                const auto facing = std::max(
                    static_cast<double>(glm::dot(impostor.frames[frame].toViewer, axisOf(azimuth(view)).toViewer)),
                    0.0);
                const double weight = impostor.kind == ImpostorKind::Cards ? math::pow(facing, 8) : 1;
                own += weight * plant[view].mean();
                theirs += weight * shown[view].mean();
            }
            // Half the way: neighbours, which are seen beside it, move too.
            const DVec3 gain = glm::sqrt(glm::clamp(own / glm::max(theirs, DVec3(kNothing)), DVec3(0.5), DVec3(2)));
            tone(canvas, frame, impostor.side, Vec3(gain), atlas.colour);
        }
        for (std::uint32_t view = 0; view < kCalibratedViews; ++view)
            shown[view] = viewImpostor(impostor, atlas, azimuth(view), pixels, threads);
    }
}

/// Bilinear, as graphics cards look textures up; within the frame, for those never look beyond the margin.
Vec4 lookUp(const Image& image, Vec2 uv, bool isSrgb)
{
    static const std::array<float, 256> kLight = [] {
        std::array<float, 256> light{};
        for (std::size_t i = 0; i < light.size(); ++i)
            light[i] = linearFromSrgb(static_cast<std::uint8_t>(i));
        return light;
    }();
    const auto last = static_cast<float>(image.width - 1);
    const Vec2 at = glm::clamp(uv * static_cast<float>(image.width) - Vec2(0.5f), 0.0f, last);
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
            sum[c] += share * (isSrgb && c < 3 ? kLight[texel[c]] : static_cast<float>(texel[c]) / 255);
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
    const Vec2 cell(static_cast<float>(frame % impostor.side), static_cast<float>(frame / impostor.side));
    return (cell + 0.5f * Vec2(1 + at.x, 1 - at.y)) / static_cast<float>(impostor.side);
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
    const FrameBlend blend = framesFor(toViewer, impostor.side);
    const bool isFirst = dither < blend.shares[0];
    const std::uint32_t picked = blend.frames[isFirst ? 0 : dither < blend.shares[0] + blend.shares[1] ? 1 : 2];
    const ImpostorFrame& frame = impostor.frames[picked];
    OnFrame on = meet(frame, toViewer, through, 0);
    if (!on.isInside)
        return std::nullopt;
    // What is seen lies before the plane: once more where it is as deep as the picture says.
    const float depth = 2 * lookUp(atlas.normal, placeInAtlas(impostor, picked, on.at), false).w - 1;
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

Expected<void> checkSettings(const AtlasSettings& settings)
{
    const auto within = [](std::uint32_t value, std::uint32_t low, std::uint32_t high) {
        return value >= low && value <= high;
    };
    if (within(settings.size, 64, 4096) && within(settings.samples, 1, 16) && within(settings.threads, 0, 256))
        return {};
    return failure(ErrorKind::BadInput, {},
                   "an atlas of " + std::to_string(settings.size) + " texels, " + std::to_string(settings.samples) +
                       " samples and " + std::to_string(settings.threads) + " threads is asked for",
                   "64 to 4096 texels, 1 to 16 samples and at most 256 threads");
}

} // namespace

std::optional<ImpostorSight> seeImpostor(const Impostor& impostor, const MaterialTextures& atlas, const Vec3& toViewer,
                                         const Vec3& through, float dither) noexcept
{
    return impostor.kind == ImpostorKind::Cards ? seeCards(impostor, atlas, toViewer, through)
                                                : seePicked(impostor, atlas, toViewer, through, dither);
}

Expected<MaterialTextures> paintImpostor(const RenderSubject& subject, const Impostor& impostor,
                                         const AtlasSettings& settings, const Progress& progress)
{
    if (auto checked = checkSettings(settings); !checked)
        return tl::unexpected(checked.error());
    const auto model = modelOf(subject, impostor, settings.threads);
    if (!model)
        return tl::unexpected(model.error());
    const PreviewScene& scene = (*model)->scene;
    const auto canvas = photograph(scene, impostor, settings, progress);
    if (!canvas)
        return tl::unexpected(canvas.error());
    MaterialTextures atlas = develop(*canvas, impostor);
    calibrate(scene, impostor, *canvas, settings.threads, atlas);
    progress("impostor", 1);
    return atlas;
}

Expected<std::array<ImpostorDifference, kImpostorViews>> compareImpostor(const RenderSubject& subject,
                                                                         const Impostor& impostor,
                                                                         const MaterialTextures& atlas, float turn,
                                                                         std::uint32_t threads)
{
    const auto model = modelOf(subject, impostor, threads);
    if (!model)
        return tl::unexpected(model.error());
    constexpr std::uint32_t kPixels = 128;
    std::array<ImpostorDifference, kImpostorViews> differences;
    for (std::uint32_t i = 0; i < kImpostorViews; ++i)
    {
        const double azimuth = static_cast<double>(turn) + 2 * math::kPi * i / kImpostorViews;
        const View plant = viewPlant((*model)->scene, impostor, azimuth, kPixels, threads);
        const View shown = viewImpostor(impostor, atlas, azimuth, kPixels, threads);
        differences[i].coverage = static_cast<float>(shown.covered / std::max(plant.covered, kNothing));
        differences[i].colour = Vec3(shown.mean() / glm::max(plant.mean(), DVec3(kNothing)));
    }
    return differences;
}

} // namespace espalier
