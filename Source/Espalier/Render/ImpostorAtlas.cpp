#include <Espalier/Render/ImpostorAtlas.h>

#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Render/ImpostorFilm.h>
#include <Espalier/Render/ImpostorView.h>
#include <Espalier/Render/PreviewScene.h>
#include <Espalier/Species/Appearance.h>
#include <Espalier/Texture/AppearanceTextures.h>
#include <Espalier/Texture/Srgb.h>
#include <Espalier/Texture/SurfaceMaps.h>
#include <algorithm>
#include <cmath>
#include <memory>
#include <string>

namespace espalier {

namespace {

constexpr float kRoughness = 0.7f;             // of leaves and bark together, from afar
constexpr std::uint32_t kCalibratedViews = 16; // those that are compared and as many between them

/// The plant, ready to be looked at. Scenes want a paint box that outlives them.
struct Model
{
    Model(const RenderSubject& subject, float size, std::uint32_t threads)
        : paints(makeTextures(*subject.appearance, {.bark = 512, .leaf = 256}, threads, subject.own)),
          scene(*subject.mesh, *subject.appearance, paints, {.size = static_cast<double>(size)})
    {}

    PaintBox paints;
    PreviewScene scene;
};

Expected<void> checkImpostor(const Impostor& impostor)
{
    const bool areCards = impostor.kind == ImpostorKind::Cards;
    const bool isSide = impostor.columns >= kMinImpostorSide && impostor.columns <= kMaxImpostorSide;
    const bool isLaidOut =
        areCards ? impostor.columns == 4 && impostor.rows == 2 : isSide && impostor.rows == impostor.columns;
    if (isLaidOut && impostor.frames.size() == std::size_t{impostor.columns} * impostor.rows && impostor.radius > 0 &&
        std::isfinite(impostor.radius))
        return {};
    return failure(ErrorKind::BadInput, {}, "the impostor has " + std::to_string(impostor.frames.size()) + " frames",
                   "those that makeImpostor gives it for this plant");
}

Expected<std::unique_ptr<Model>> modelOf(const RenderSubject& subject, const Impostor& impostor, std::uint32_t threads)
{
    if (auto checked = checkSubject(subject); !checked)
        return tl::unexpected(checked.error());
    if (auto checked = checkImpostor(impostor); !checked)
        return tl::unexpected(checked.error());
    auto model = std::make_unique<Model>(subject, 2 * impostor.radius, threads);
    if (!model->scene.isReady())
        return failure(ErrorKind::Limit, {}, "the impostor's scene does not fit into memory");
    return model;
}

Expected<void> checkAtlas(const Impostor& impostor, const MaterialTextures& atlas)
{
    const Image& colour = atlas.colour;
    const auto is = [&](const Image& image, std::uint32_t channels) {
        return image.width == colour.width && image.height == colour.height && image.channels == channels &&
               image.texels.size() == std::size_t{image.width} * image.height * channels;
    };
    if (colour.width > 0 && colour.width % impostor.columns == 0 && colour.height > 0 &&
        colour.height % impostor.rows == 0 && is(colour, 4) && is(atlas.normal, 3) && is(atlas.roughness, 3))
        return {};
    return failure(ErrorKind::BadInput, {}, "the impostor's atlas is not of this impostor",
                   "what paintImpostor made of it");
}

/// The share of light that reaches a texel, from all that is seen round it: a few rays each are too few.
float openAt(const Film& film, const FilmFrame& frame, std::uint32_t x, std::uint32_t y)
{
    constexpr std::uint32_t kReach = 2; // texels
    float sum = 0;
    float whole = 0;
    for (std::uint32_t ny = y - std::min(y, kReach); ny <= std::min(y + kReach, film.height - 1); ++ny)
        for (std::uint32_t nx = x - std::min(x, kReach); nx <= std::min(x + kReach, film.width - 1); ++nx)
        {
            const FilmTexel& texel = frame.texels[std::size_t{ny} * film.width + nx];
            sum += texel.share * texel.open;
            whole += texel.share;
        }
    return whole > 0 ? sum / whole : 1;
}

std::uint8_t signedByte(float value)
{
    return byteOf(0.5f + 0.5f * value);
}

/// Calls visit(number of the texel in the frame, number in the atlas, x, y) for all of a frame.
template <class Visit>
void eachTexel(const Film& film, const Impostor& impostor, std::size_t frame, const Visit& visit)
{
    const std::size_t left = frame % impostor.columns * film.width;
    const std::size_t top = frame / impostor.columns * film.height;
    for (std::uint32_t y = 0; y < film.height; ++y)
        for (std::uint32_t x = 0; x < film.width; ++x)
            visit(std::size_t{y} * film.width + x, (top + y) * impostor.columns * film.width + left + x, x, y);
}

/// Everything but colour and alpha.
MaterialTextures printRelief(const Film& film, const Impostor& impostor)
{
    const std::uint32_t width = impostor.columns * film.width;
    const std::uint32_t height = impostor.rows * film.height;
    const std::size_t count = std::size_t{width} * height;
    MaterialTextures atlas;
    atlas.colour = {width, height, 4, std::vector<std::uint8_t>(4 * count)};
    atlas.normal = {width, height, 3, std::vector<std::uint8_t>(3 * count)};
    atlas.roughness = {width, height, 3, std::vector<std::uint8_t>(3 * count)};
    const bool isOctahedral = impostor.kind == ImpostorKind::Octahedral;
    for (std::size_t number = 0; number < film.frames.size(); ++number)
    {
        const ImpostorFrame& frame = impostor.frames[number];
        const FilmFrame& picture = film.frames[number];
        eachTexel(film, impostor, number, [&](std::size_t own, std::size_t i, std::uint32_t x, std::uint32_t y) {
            const FilmTexel& texel = picture.texels[picture.nearest[own]];
            const float length = glm::length(texel.normal);
            const Vec3 normal = length > 1e-6f ? texel.normal / length : frame.toViewer;
            const Vec3 stored = isOctahedral ? normal
                                             : Vec3(glm::dot(normal, frame.right), glm::dot(normal, frame.up),
                                                    std::max(glm::dot(normal, frame.toViewer), 0.05f));
            for (int c = 0; c < 3; ++c)
                atlas.normal.texels[3 * i + static_cast<std::size_t>(c)] = signedByte(stored[c]);
            atlas.roughness.texels[3 * i] = byteOf(openAt(film, picture, x, y));
            atlas.roughness.texels[3 * i + 1] = byteOf(kRoughness);
            atlas.roughness.texels[3 * i + 2] = isOctahedral ? signedByte(texel.depth / impostor.radius) : 0;
        });
    }
    return atlas;
}

void printAlpha(const Film& film, const Impostor& impostor, MaterialTextures& atlas)
{
    for (std::size_t number = 0; number < film.frames.size(); ++number)
        eachTexel(film, impostor, number, [&](std::size_t own, std::size_t i, std::uint32_t, std::uint32_t) {
            atlas.colour.texels[4 * i + 3] = film.frames[number].alpha[own];
        });
}

/// The colours of a frame times `gain`.
void printColour(const Film& film, const Impostor& impostor, std::size_t number, const Vec3& gain,
                 MaterialTextures& atlas)
{
    const FilmFrame& picture = film.frames[number];
    eachTexel(film, impostor, number, [&](std::size_t own, std::size_t i, std::uint32_t, std::uint32_t) {
        const Vec3 colour = gain * picture.texels[picture.nearest[own]].colour;
        for (int c = 0; c < 3; ++c)
            atlas.colour.texels[4 * i + static_cast<std::size_t>(c)] = srgbFromLinear(colour[c]);
    });
}

/// What the calibrated views show, of the plant or of its impostor.
using Views = std::array<ImpostorView, kCalibratedViews>;

double azimuthOf(std::uint32_t view)
{
    return 2 * math::kPi * view / kCalibratedViews;
}

double coveredBy(const Views& views)
{
    double sum = 0;
    for (const ImpostorView& view : views)
        sum += view.covered;
    return sum;
}

/// How much a frame counts in a view: of cards the more, the more squarely they are seen; octahedral frames all alike,
/// for those from above have no level view of their own. Cards from the sides show through the holes of the one in
/// front, so a frame that heeded its own view alone would be toned against its neighbours, ever further.
double weightOf(const Impostor& impostor, std::size_t frame, std::uint32_t view)
{
    if (impostor.kind == ImpostorKind::Octahedral)
        return 1;
    const float facing = std::max(glm::dot(impostor.frames[frame].toViewer, toViewerAt(azimuthOf(view))), 0.0f);
    return static_cast<double>(facing * facing);
}

/// Cuts the frames out so that the impostor covers as much as the plant in all calibrated views together, for cards
/// hide each other's holes and filters eat edges; then tones them so that it is as bright, for of what is cut off more
/// is leaf than wood.
Expected<void> calibrate(const PreviewScene& scene, const Impostor& impostor, const AtlasSettings& settings,
                         const Progress& progress, Film& film, MaterialTextures& atlas)
{
    constexpr int kCuts = 8;
    constexpr int kTones = 8;
    const std::uint32_t pixels = std::clamp(film.height / 2, 64u, 128u);
    double done = 0;
    const auto step = [&] {
        progress("impostor", kPhotographed + (1 - kPhotographed) * ++done / (1 + kCuts + kTones));
        return !progress.wantsStop();
    };
    const auto viewed = [&](const auto& look) {
        Views views;
        for (std::uint32_t i = 0; i < kCalibratedViews; ++i)
            views[i] = look(azimuthOf(i));
        return views;
    };
    const auto cancelled = failure(ErrorKind::Cancelled, {}, "painting the impostor was cancelled");
    const Views plant =
        viewed([&](double azimuth) { return viewPlant(scene, impostor, azimuth, pixels, settings.threads); });
    const auto viewedImpostor = [&] {
        return viewed([&](double azimuth) { return viewImpostor(impostor, atlas, azimuth, pixels, settings.threads); });
    };
    if (!step())
        return cancelled;

    Views shown;
    double low = -4;
    double high = 4;
    for (int i = 0; i < kCuts; ++i)
    {
        const double density = 0.5 * (low + high);
        cutOut(impostor, density, settings.threads, film);
        printAlpha(film, impostor, atlas);
        shown = viewedImpostor();
        (coveredBy(shown) < coveredBy(plant) ? low : high) = density;
        if (!step())
            return cancelled;
    }

    std::vector<DVec3> gains(film.frames.size(), DVec3(1));
    for (int i = 0; i < kTones; ++i)
    {
        for (std::size_t frame = 0; frame < film.frames.size(); ++frame)
        {
            DVec3 own(0);
            DVec3 theirs(0);
            for (std::uint32_t view = 0; view < kCalibratedViews; ++view)
            {
                const double weight = weightOf(impostor, frame, view);
                own += weight * plant[view].mean();
                theirs += weight * shown[view].mean();
            }
            // Half the way: neighbours, which are seen beside it, move too.
            constexpr double kNothing = 1e-9;
            gains[frame] *= glm::sqrt(glm::clamp((own + kNothing) / (theirs + kNothing), DVec3(0.5), DVec3(2)));
            printColour(film, impostor, frame, Vec3(gains[frame]), atlas);
        }
        shown = viewedImpostor();
        if (!step())
            return cancelled;
    }
    return {};
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

Expected<MaterialTextures> paintImpostor(const RenderSubject& subject, const Impostor& impostor,
                                         const AtlasSettings& settings, const Progress& progress)
{
    if (auto checked = checkSettings(settings); !checked)
        return tl::unexpected(checked.error());
    const auto model = modelOf(subject, impostor, settings.threads);
    if (!model)
        return tl::unexpected(model.error());
    const PreviewScene& scene = (*model)->scene;
    auto film = photograph(scene, impostor, settings, progress);
    if (!film)
        return tl::unexpected(film.error());
    MaterialTextures atlas = printRelief(*film, impostor);
    for (std::size_t frame = 0; frame < film->frames.size(); ++frame)
        printColour(*film, impostor, frame, Vec3(1), atlas);
    if (auto calibrated = calibrate(scene, impostor, settings, progress, *film, atlas); !calibrated)
        return tl::unexpected(calibrated.error());
    progress("impostor", 1);
    return atlas;
}

Expected<std::array<ImpostorDifference, kImpostorViews>> compareImpostor(const RenderSubject& subject,
                                                                         const Impostor& impostor,
                                                                         const MaterialTextures& atlas, float turn,
                                                                         std::uint32_t threads)
{
    if (!std::isfinite(turn) || threads > 256)
        return failure(ErrorKind::BadInput, {},
                       "an impostor is compared at a turn that is no number or by too many threads",
                       "a finite turn and at most 256 threads");
    const auto model = modelOf(subject, impostor, threads);
    if (!model)
        return tl::unexpected(model.error());
    if (auto checked = checkAtlas(impostor, atlas); !checked)
        return tl::unexpected(checked.error());
    constexpr std::uint32_t kPixels = 128;
    std::array<ImpostorDifference, kImpostorViews> differences;
    for (std::uint32_t i = 0; i < kImpostorViews; ++i)
    {
        const double azimuth = static_cast<double>(turn) + 2 * math::kPi * i / kImpostorViews;
        const ImpostorView plant = viewPlant((*model)->scene, impostor, azimuth, kPixels, threads);
        const ImpostorView shown = viewImpostor(impostor, atlas, azimuth, kPixels, threads);
        constexpr double kLeast = 0.25;      // pixels: one ray
        constexpr double kLeastLight = 1e-4; // less is black
        differences[i].coverage = static_cast<float>(shown.covered / std::max(plant.covered, kLeast));
        differences[i].colour = Vec3((shown.mean() + kLeastLight) / (plant.mean() + kLeastLight));
    }
    return differences;
}

} // namespace espalier
