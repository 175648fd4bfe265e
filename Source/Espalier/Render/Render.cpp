#include <Espalier/Render/Render.h>

#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Core/Random.h>
#include <Espalier/Core/Tasks.h>
#include <Espalier/Mesh/TreeMesh.h>
#include <Espalier/Render/Camera.h>
#include <Espalier/Render/PreviewScene.h>
#include <Espalier/Species/Appearance.h>
#include <Espalier/Texture/AppearanceTextures.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace espalier {

namespace {

constexpr std::uint64_t kMaxPixels = std::uint64_t{1} << 28;
constexpr std::uint32_t kMaxSubjects = 1024;
constexpr std::uint32_t kMaxViews = 64;
constexpr std::uint32_t kTileSize = 32;
constexpr FrameMargins kMeadowMargins{.side = 0.92, .top = 0.93, .bottom = 0.86};
constexpr FrameMargins kPaperMargins{.side = 0.93, .top = 0.93, .bottom = 0.93, .freeBelow = 0.5};

/// One cell of a picture.
struct Shot
{
    const RenderSubject* subject = nullptr;
    double turn = 0;   ///< Radians by which the tree turns before the camera.
    double ground = 0; ///< Metres.
    FrameBounds bounds{};
    Camera camera{};
    float nearest = 0; ///< Metres from the camera; nearer things are looked through.
};

Expected<void> checkRange(const char* name, double value, double low, double high)
{
    if (value >= low && value <= high)
        return {};
    return failure(ErrorKind::BadInput, {}, std::string("render setting ") + name + " is " + std::to_string(value),
                   "a number from " + std::to_string(low) + " to " + std::to_string(high));
}

Expected<void> checkSettings(const RenderSettings& settings)
{
    struct Range
    {
        const char* name;
        double value;
        double low;
        double high;
    };
    const std::array ranges{
        Range{"width", static_cast<double>(settings.width), 16, 8192},
        Range{"height", static_cast<double>(settings.height), 16, 8192},
        Range{"samplesPerPixel", static_cast<double>(settings.samplesPerPixel), 1, 4096},
        Range{"sunAzimuth", settings.sunAzimuth, -1e6, 1e6},
        Range{"sunElevation", settings.sunElevation, 1e-3, 1.5708},
        Range{"sunRadius", settings.sunRadius, 0, 0.5},
        Range{"cameraAzimuth", settings.cameraAzimuth, -1e6, 1e6},
        Range{"cameraElevation", settings.cameraElevation, -1.5, 1.5},
        Range{"fieldOfView", settings.fieldOfView, 0.01, 1.5},
        Range{"focus.x", settings.focus.x, -1e7, 1e7},
        Range{"focus.y", settings.focus.y, -1e7, 1e7},
        Range{"focus.z", settings.focus.z, -1e7, 1e7},
        Range{"focusRadius", settings.focusRadius, 0, 1e4},
        Range{"threads", static_cast<double>(settings.threads), 0, 256},
    };
    for (const Range& range : ranges)
        if (auto checked = checkRange(range.name, range.value, range.low, range.high); !checked)
            return checked;
    return {};
}

double groundUnder(const TreeMesh& mesh)
{
    float lowest = 0;
    float highest = 0;
    for (const std::uint32_t index : mesh.indices)
    {
        lowest = std::min(lowest, mesh.positions[index].y);
        highest = std::max(highest, mesh.positions[index].y);
    }
    // Roots that dip a little into the earth do not lift the tree out of it, and twigs that droop below its foot do not
    // leave it hanging in the air. What has much below its foot is a root itself, and is to be seen.
    constexpr float kRootShare = 0.03f;
    constexpr double kMuch = 0.25;
    const float depth = -kRootShare * (highest - lowest);
    const auto below =
        std::ranges::count_if(mesh.indices, [&](std::uint32_t index) { return mesh.positions[index].y < depth; });
    return static_cast<double>(below) > kMuch * static_cast<double>(mesh.indices.size()) ? lowest : 0.0;
}

/// The ends of the axes of the ball in focus.
std::array<Vec3, 6> pointsInFocus(const RenderSettings& settings)
{
    std::array<Vec3, 6> points;
    points.fill(settings.focus);
    for (int axis = 0; axis < 3; ++axis)
    {
        points[static_cast<std::size_t>(2 * axis)][axis] -= settings.focusRadius;
        points[static_cast<std::size_t>(2 * axis + 1)][axis] += settings.focusRadius;
    }
    return points;
}

/// Two and a half radii before the middle of a close-up.
float nearestShown(const Shot& shot, const RenderSettings& settings)
{
    const double away = glm::dot(DVec3(settings.focus) - shot.camera.position, shot.camera.axes.forward);
    return static_cast<float>(std::max(away - 2.5 * static_cast<double>(settings.focusRadius), 0.0));
}

/// Places the cameras of all shots: one distance, one height over the ground, each tree centred from left to right.
void frameShots(std::span<Shot> shots, const RenderSettings& settings)
{
    constexpr double kEyeShare = 0.035; // least height over the ground, per metre of distance
    constexpr int kMaxLifts = 32;
    Camera lens;
    lens.slopeY = math::tan(0.5 * static_cast<double>(settings.fieldOfView));
    lens.slopeX = lens.slopeY * settings.width / settings.height;
    double elevation = static_cast<double>(settings.cameraElevation);
    const bool onPaper = settings.backdrop == Backdrop::Paper;
    const FrameMargins& margins = onPaper ? kPaperMargins : kMeadowMargins;
    const bool isCloseUp = settings.focusRadius > 0;
    const std::array<Vec3, 6> inFocus = pointsInFocus(settings);
    for (int lift = 0;; ++lift)
    {
        FrameBounds all;
        for (Shot& shot : shots)
        {
            lens.axes = viewAxes(static_cast<double>(settings.cameraAzimuth) - shot.turn, elevation);
            shot.camera = lens;
            const std::span<const Vec3> shown =
                isCloseUp ? std::span<const Vec3>(inFocus) : shot.subject->mesh->positions;
            shot.bounds = frameBounds(shown, {0, shot.ground, 0}, lens, margins);
            all = together(all, shot.bounds);
        }
        double missing = 0;
        for (Shot& shot : shots)
        {
            const DVec3 stand = nearestStand(all, shot.camera, margins);
            const double x = nearestStand(shot.bounds, shot.camera, margins).x;
            const double distance = std::max(-stand.z, 1e-3) * shot.subject->distance;
            const ViewAxes& axes = shot.camera.axes;
            const DVec3 fromBase = x * axes.right + stand.y * axes.up - distance * axes.forward;
            shot.camera.position = DVec3(0, shot.ground, 0) + fromBase;
            // Before a close-up things are looked through, the ground among them.
            if (!isCloseUp)
                missing = std::max(missing, kEyeShare - fromBase.y / distance);
            shot.nearest = isCloseUp ? nearestShown(shot, settings) : 0;
        }
        if (missing <= 0 || onPaper || lift == kMaxLifts)
            return;
        elevation = std::min(elevation + std::max(missing, 1e-3), 1.5);
    }
}

/// Six numbers a sample, evenly spread over the samples of a pixel: the additive recurrence on powers of the root of
/// x^7 = x + 1 (Roberts, "The Unreasonable Effectiveness of Quasirandom Sequences", 2018), shifted at random.
class PixelSamples
{
public:
    PixelSamples(std::uint32_t x, std::uint32_t y)
    {
        const RandomKey key = RandomKey(Seed{}).child(y).child(x);
        for (std::uint32_t i = 0; i < state_.size(); ++i)
            state_[i] = static_cast<std::uint32_t>(key.bits(Purpose::Sampling, i) >> 32);
    }

    void next()
    {
        for (std::size_t i = 0; i < state_.size(); ++i)
            state_[i] += kSteps[i];
    }

    [[nodiscard]] Vec2 pair(std::size_t first) const
    {
        const auto unit = [this](std::size_t i) { return static_cast<float>(state_[i] >> 8) * 0x1p-24f; };
        return {unit(first), unit(first + 1)};
    }

private:
    static constexpr std::array<std::uint32_t, 6> kSteps = [] {
        constexpr double kRoot = 1.1127756842787055;
        std::array<std::uint32_t, 6> steps{};
        double power = 1;
        for (std::uint32_t& step : steps)
        {
            power /= kRoot;
            step = static_cast<std::uint32_t>(power * 0x1p32);
        }
        return steps;
    }();
    std::array<std::uint32_t, 6> state_{};
};

/// Where in [-1, 1] a pixel of tent-shaped sensitivity looks.
float tentOffset(float random)
{
    return random < 0.5f ? std::sqrt(2 * random) - 1 : 1 - std::sqrt(2 - 2 * random);
}

/// Where between two bytes a value goes up: an ordered pattern (Bayer 1973) instead of a half, so that the sky shows no
/// bands.
double ditherAt(std::uint32_t x, std::uint32_t y)
{
    constexpr std::array<std::array<double, 4>, 4> kOrder{
        {{0, 8, 2, 10}, {12, 4, 14, 6}, {3, 11, 1, 9}, {15, 7, 13, 5}}};
    return (kOrder[y % 4][x % 4] + 0.5) / 16;
}

std::uint8_t srgbByte(double linear, double dither)
{
    const double encoded = linear <= 0.0031308 ? 12.92 * linear : 1.055 * math::pow(linear, 1 / 2.4) - 0.055;
    return static_cast<std::uint8_t>(std::min(encoded * 255 + dither, 255.0));
}

float filmicTone(float linear)
{
    // The filmic curve by Narkowicz ("ACES Filmic Tone Mapping Curve", 2015): soft shoulder, slightly deepened shadows.
    constexpr float kExposure = 0.92f;
    const float x = kExposure * linear;
    return std::clamp(x * (2.51f * x + 0.03f) / (x * (2.43f * x + 0.59f) + 0.14f), 0.0f, 1.0f);
}

Vec3 pixelLight(const PreviewScene& scene, const Shot& shot, std::uint32_t x, std::uint32_t y,
                const RenderSettings& settings)
{
    const Camera& camera = shot.camera;
    const Vec3 origin(camera.position);
    const Vec3 right(camera.axes.right * camera.slopeX);
    const Vec3 up(camera.axes.up * camera.slopeY);
    const Vec3 forward(camera.axes.forward);
    PixelSamples samples(x, y);
    Vec3 sum(0);
    for (std::uint32_t i = 0; i < settings.samplesPerPixel; ++i)
    {
        const Vec2 jitter = samples.pair(0);
        const float px = static_cast<float>(x) + 0.5f + tentOffset(jitter.x);
        const float py = static_cast<float>(y) + 0.5f + tentOffset(jitter.y);
        const float ndcX = 2 * px / static_cast<float>(settings.width) - 1;
        const float ndcY = 1 - 2 * py / static_cast<float>(settings.height);
        const Vec3 direction = glm::normalize(forward + ndcX * right + ndcY * up);
        sum += scene.radiance(origin, direction, shot.nearest, {.sun = samples.pair(2), .sky = samples.pair(4)});
        samples.next();
    }
    return sum / static_cast<float>(settings.samplesPerPixel);
}

void traceTile(const PreviewScene& scene, const Shot& shot, const RenderSettings& settings, std::uint32_t tileX,
               std::uint32_t tileY, Picture& picture)
{
    const std::uint32_t right = std::min(settings.width, (tileX + 1) * kTileSize);
    const std::uint32_t bottom = std::min(settings.height, (tileY + 1) * kTileSize);
    for (std::uint32_t y = tileY * kTileSize; y < bottom; ++y)
        for (std::uint32_t x = tileX * kTileSize; x < right; ++x)
        {
            const Vec3 light = pixelLight(scene, shot, x, y, settings);
            std::uint8_t* pixel = picture.rgb.data() + 3 * (std::size_t{y} * picture.width + x);
            // Paper is of one colour, so it needs no pattern against bands, and stays white without a shoulder.
            for (int channel = 0; channel < 3; ++channel)
                pixel[channel] = settings.backdrop == Backdrop::Paper
                                     ? srgbByte(static_cast<double>(light[channel]), 0.5)
                                     : srgbByte(static_cast<double>(filmicTone(light[channel])), ditherAt(x, y));
        }
}

Surroundings surroundingsOf(const Shot& shot, const RenderSettings& settings)
{
    // The light turns with the camera, so that it is the tree that seems to turn.
    const double azimuth = static_cast<double>(settings.sunAzimuth) - shot.turn;
    const DVec3 base(0, shot.ground, 0);
    const double distance = -glm::dot(shot.camera.position - base, shot.camera.axes.forward);
    return {.toSun = -viewAxes(azimuth, static_cast<double>(settings.sunElevation)).forward,
            .sunRadius = static_cast<double>(settings.sunRadius),
            .base = base,
            .size = 2 * distance * shot.camera.slopeY,
            .backdrop = settings.backdrop};
}

/// As many texels as a picture of this size can show of a tree, or as a close-up can.
TextureSizes textureSizes(const RenderSettings& settings)
{
    constexpr std::uint32_t kLarge = 512; // pixels
    if (settings.focusRadius > 0)
        return {.bark = 2048, .leaf = 1024};
    if (std::max(settings.width, settings.height) >= kLarge)
        return {.bark = 1024, .leaf = 256};
    return {.bark = 256, .leaf = 128};
}

Expected<std::vector<Picture>> traceShots(std::span<Shot> shots, const RenderSettings& settings,
                                          const Progress& progress)
{
    for (Shot& shot : shots)
        shot.ground = groundUnder(*shot.subject->mesh);
    frameShots(shots, settings);

    const std::uint32_t threads = threadsFor(settings.threads);
    const std::uint32_t tilesX = (settings.width + kTileSize - 1) / kTileSize;
    const std::uint32_t tilesY = (settings.height + kTileSize - 1) / kTileSize;
    const std::uint32_t tiles = tilesX * tilesY;
    std::vector<Picture> pictures;
    std::optional<PaintBox> paints;
    const Appearance* painted = nullptr;
    const OwnTextures* own = nullptr;
    for (const Shot& shot : shots)
    {
        const Appearance& appearance = *shot.subject->appearance;
        if (!painted || *painted != appearance || own != shot.subject->own)
            paints.emplace(makeTextures(appearance, textureSizes(settings), threads, shot.subject->own));
        painted = &appearance;
        own = shot.subject->own;
        paints->cards.clear();
        if (shot.subject->cards)
            paints->cards.emplace_back(*shot.subject->cards, TextureWrap::Clamp);
        const PreviewScene scene(*shot.subject->mesh, appearance, *paints, surroundingsOf(shot, settings));
        if (!scene.isReady())
            return failure(ErrorKind::Limit, {}, "the picture's scene does not fit into memory");
        Picture picture(settings.width, settings.height);
        const auto done = static_cast<double>(pictures.size());
        forEachTask(
            tiles, threads, progress,
            [&](std::uint32_t tile) { traceTile(scene, shot, settings, tile % tilesX, tile / tilesX, picture); },
            [&](std::uint32_t taken) {
                progress("render", (done + 1.0 * taken / tiles) / static_cast<double>(shots.size()));
            });
        if (progress.wantsStop())
            return failure(ErrorKind::Cancelled, {}, "rendering was cancelled");
        pictures.push_back(std::move(picture));
    }
    progress("render", 1);
    return pictures;
}

/// The pictures of all shots on one page, each over its label; a single label is that of the whole row.
Expected<Picture> renderPage(std::span<Shot> shots, std::span<const std::string> labels, std::uint32_t columns,
                             const RenderSettings& settings, const Progress& progress)
{
    constexpr Vec3 kPaper{0.973f, 0.965f, 0.945f};
    constexpr Vec3 kInk{0.20f, 0.19f, 0.17f};
    const auto count = static_cast<std::uint32_t>(shots.size());
    columns = std::min(columns, count);
    const std::uint32_t rows = (count + columns - 1) / columns;
    const std::uint32_t gutter = std::max(2u, std::min(settings.width, settings.height) / 80);
    const std::uint32_t textScale = std::max(1u, std::min(settings.width, settings.height) / 160);
    const bool hasLabels = std::any_of(labels.begin(), labels.end(), [](const auto& label) { return !label.empty(); });
    const std::uint32_t caption = hasLabels ? 8 * textScale + gutter + gutter / 2 : 0;
    const std::uint64_t width = gutter + std::uint64_t{columns} * (settings.width + gutter);
    const std::uint64_t height = gutter + std::uint64_t{rows} * (settings.height + caption + gutter);
    if (width * height > kMaxPixels)
        return failure(ErrorKind::Limit, {},
                       "the page would have " + std::to_string(width) + " x " + std::to_string(height) + " pixels",
                       "at most 2^28 pixels", "draw fewer or smaller pictures");

    auto pictures = traceShots(shots, settings, progress);
    if (!pictures)
        return tl::unexpected(pictures.error());
    Picture page(static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height));
    for (std::size_t i = 0; i < page.rgb.size(); ++i)
        page.rgb[i] = static_cast<std::uint8_t>(kPaper[static_cast<int>(i % 3)] * 255);
    const auto write = [&](std::string_view label, std::uint32_t left, std::uint32_t room, std::uint32_t top) {
        label = label.substr(0, room / (6 * textScale));
        const auto textWidth = static_cast<std::uint32_t>(label.size()) * 6 * textScale;
        drawText(label, left + (room - textWidth) / 2, top, textScale, kInk, page);
    };
    for (std::uint32_t i = 0; i < count; ++i)
    {
        const std::uint32_t x = gutter + i % columns * (settings.width + gutter);
        const std::uint32_t y = gutter + i / columns * (settings.height + caption + gutter);
        paste((*pictures)[i], x, y, page);
        if (labels.size() == count)
            write(labels[i], x, settings.width, y + settings.height + gutter);
    }
    if (labels.size() != count)
        write(labels[0], 0, page.width, gutter + settings.height + gutter);
    return page;
}

} // namespace

Expected<Picture> renderPicture(const RenderSubject& subject, const RenderSettings& settings, const Progress& progress)
{
    if (auto checked = checkSettings(settings); !checked)
        return tl::unexpected(checked.error());
    if (auto checked = checkSubject(subject); !checked)
        return tl::unexpected(checked.error());
    Shot shot{.subject = &subject};
    auto pictures = traceShots({&shot, 1}, settings, progress);
    if (!pictures)
        return tl::unexpected(pictures.error());
    return std::move(pictures->front());
}

Expected<Picture> renderTurntable(const RenderSubject& subject, std::uint32_t views, const RenderSettings& settings,
                                  const Progress& progress)
{
    if (auto checked = checkSettings(settings); !checked)
        return tl::unexpected(checked.error());
    if (auto checked = checkRange("views", views, 1, kMaxViews); !checked)
        return tl::unexpected(checked.error());
    if (auto checked = checkSubject(subject); !checked)
        return tl::unexpected(checked.error());
    std::vector<Shot> shots(views, Shot{.subject = &subject});
    for (std::uint32_t i = 0; i < views; ++i)
        shots[i].turn = 2 * math::kPi * i / views;
    return renderPage(shots, {&subject.label, 1}, views, settings, progress);
}

Expected<Picture> renderContactSheet(std::span<const RenderSubject> subjects, std::uint32_t columns,
                                     const RenderSettings& settings, const Progress& progress)
{
    if (auto checked = checkSettings(settings); !checked)
        return tl::unexpected(checked.error());
    if (auto checked = checkRange("columns", columns, 1, kMaxSubjects); !checked)
        return tl::unexpected(checked.error());
    if (auto checked = checkRange("subjects", static_cast<double>(subjects.size()), 1, kMaxSubjects); !checked)
        return tl::unexpected(checked.error());
    std::vector<Shot> shots;
    std::vector<std::string> labels;
    for (const RenderSubject& subject : subjects)
    {
        if (auto checked = checkSubject(subject); !checked)
            return tl::unexpected(checked.error());
        shots.push_back({.subject = &subject});
        labels.push_back(subject.label);
    }
    return renderPage(shots, labels, columns, settings, progress);
}

} // namespace espalier
