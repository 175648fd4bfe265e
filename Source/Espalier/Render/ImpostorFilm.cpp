#include <Espalier/Render/ImpostorFilm.h>

#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Core/Tasks.h>
#include <Espalier/Render/ImpostorAtlas.h>
#include <Espalier/Render/PreviewScene.h>
#include <Espalier/Texture/SurfaceMaps.h>
#include <algorithm>
#include <array>
#include <utility>

namespace espalier {

namespace {

constexpr std::uint32_t kMinCell = 8; // texels along a frame

/// Cards: of frame i the one that looks from behind is 4 + i.
constexpr std::uint32_t kCardPairs = 4;

/// Fills FilmTexel::round. Sums over rows, then over columns of these; beyond the frame there is nothing.
void lookRound(std::uint32_t width, std::uint32_t height, FilmFrame& frame)
{
    const std::uint32_t reach = std::max(height / 64, 1u);
    const auto window = static_cast<float>(2 * reach + 1);
    std::vector<float> rows(frame.texels.size());
    const auto sumAround = [&](std::uint32_t middle, std::uint32_t count, const auto& at) {
        float sum = 0;
        for (std::uint32_t i = middle - std::min(middle, reach); i <= std::min(middle + reach, count - 1); ++i)
            sum += at(i);
        return sum / window;
    };
    const auto place = [&](std::uint32_t x, std::uint32_t y) { return std::size_t{y} * width + x; };
    for (std::uint32_t y = 0; y < height; ++y)
        for (std::uint32_t x = 0; x < width; ++x)
            rows[place(x, y)] = sumAround(x, width, [&](std::uint32_t i) { return frame.texels[place(i, y)].share; });
    for (std::uint32_t y = 0; y < height; ++y)
        for (std::uint32_t x = 0; x < width; ++x)
            frame.texels[place(x, y)].round =
                std::min(sumAround(y, height, [&](std::uint32_t i) { return rows[place(x, i)]; }), 1.0f);
}

/// The number of a texel's mirror image from left to right.
std::size_t mirrored(std::size_t i, std::uint32_t width)
{
    return i - i % width + (width - 1 - i % width);
}

void pairShares(const Film& film, FilmFrame& front, FilmFrame& back)
{
    for (std::size_t i = 0; i < front.texels.size(); ++i)
    {
        FilmTexel& before = front.texels[i];
        FilmTexel& behind = back.texels[mirrored(i, film.width)];
        const float mean = 0.5f * (before.share + behind.share);
        before.share = mean;
        behind.share = mean;
    }
}

void cutOutFrame(std::uint32_t width, std::uint32_t height, double density, FilmFrame& frame)
{
    const double power = density > 0 ? math::pow(2, -density) : -density;
    std::vector<float> wanted(frame.texels.size());
    for (std::size_t i = 0; i < wanted.size(); ++i)
    {
        const auto share = static_cast<double>(frame.texels[i].share);
        if (share > 0)
            wanted[i] = static_cast<float>(density > 0 ? math::pow(share, power)
                                                       : share * math::pow(double{frame.texels[i].round}, power));
    }
    struct Neighbour
    {
        std::uint32_t x;
        std::uint32_t y;
        float weight;
    };
    frame.alpha.assign(frame.texels.size(), 0);
    float waiting = 0;
    for (std::uint32_t y = 0; y < height; ++y)
        for (std::uint32_t i = 0; i < width; ++i)
        {
            const bool isForward = y % 2 == 0; // to and fro, or slanting lines would show
            const std::uint32_t x = isForward ? i : width - 1 - i;
            const std::size_t at = std::size_t{y} * width + x;
            if (!(frame.texels[at].share > 0))
                continue;
            const float here = wanted[at] + std::exchange(waiting, 0.0f);
            frame.alpha[at] = here >= 0.5f ? 255 : 0;
            const float left = here - (here >= 0.5f ? 1.0f : 0.0f);
            // Beyond the left rim numbers wrap round, and are beyond the right one.
            const std::uint32_t ahead = isForward ? x + 1 : x - 1;
            const std::uint32_t behind = isForward ? x - 1 : x + 1;
            const std::array neighbours{Neighbour{ahead, y, 7}, Neighbour{behind, y + 1, 3}, Neighbour{x, y + 1, 5},
                                        Neighbour{ahead, y + 1, 1}};
            const auto takes = [&](const Neighbour& n) {
                return n.x < width && n.y < height && frame.texels[std::size_t{n.y} * width + n.x].share > 0;
            };
            float weights = 0;
            for (const Neighbour& n : neighbours)
                weights += takes(n) ? n.weight : 0;
            if (!(weights > 0))
                waiting = left;
            for (const Neighbour& n : neighbours)
                if (takes(n))
                    wanted[std::size_t{n.y} * width + n.x] += left * n.weight / weights;
        }
}

} // namespace

FilmTexel lookAt(const PreviewScene& scene, const FilmPatch& patch, float far, std::uint32_t samples,
                 const RandomKey& key)
{
    FilmTexel texel;
    std::uint32_t covered = 0;
    const float step = 1 / static_cast<float>(samples);
    const auto random = [&](std::uint32_t i) { return static_cast<float>(key.uniform(Purpose::Sampling, i)); };
    for (std::uint32_t i = 0; i < samples * samples; ++i)
    {
        // On a lattice, a trunk would be as wide as the columns that happen to meet it.
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

Expected<Film> photograph(const PreviewScene& scene, const Impostor& impostor, const AtlasSettings& settings,
                          const Progress& progress)
{
    Film film;
    film.width = std::max(kMinCell, settings.size / impostor.columns);
    film.height = std::max(kMinCell, settings.size / impostor.rows);
    film.frames.resize(impostor.frames.size());
    for (FilmFrame& frame : film.frames)
        frame.texels.resize(std::size_t{film.width} * film.height);
    const auto rows = static_cast<std::uint32_t>(film.frames.size()) * film.height;
    const auto takeRow = [&](std::uint32_t task) {
        const std::uint32_t y = task % film.height;
        const ImpostorFrame& frame = impostor.frames[task / film.height];
        const Vec3 right = 2 * frame.halfExtent.x / static_cast<float>(film.width) * frame.right;
        const Vec3 up = 2 * frame.halfExtent.y / static_cast<float>(film.height) * frame.up;
        const Vec3 left = frame.middle - frame.halfExtent.x * frame.right + frame.halfExtent.y * frame.up -
                          static_cast<float>(y + 1) * up;
        const RandomKey key = RandomKey(Seed{}).child(task);
        for (std::uint32_t x = 0; x < film.width; ++x)
            film.frames[task / film.height].texels[std::size_t{y} * film.width + x] =
                lookAt(scene, {left + static_cast<float>(x) * right, right, up, frame.toViewer}, farFrom(impostor),
                       settings.samples, key.child(x));
    };
    forEachTask(rows, threadsFor(settings.threads), progress, takeRow,
                [&](std::uint32_t taken) { progress("impostor", kPhotographed * taken / rows); });
    if (progress.wantsStop())
        return failure(ErrorKind::Cancelled, {}, "painting the impostor was cancelled");
    if (impostor.kind == ImpostorKind::Cards)
        for (std::uint32_t i = 0; i < kCardPairs; ++i)
            pairShares(film, film.frames[i], film.frames[i + kCardPairs]);
    for (FilmFrame& frame : film.frames)
    {
        lookRound(film.width, film.height, frame);
        std::vector<std::uint8_t> isDrawn(frame.texels.size());
        // By colour: of two cards back to back one may see a little more than the other.
        for (std::size_t i = 0; i < isDrawn.size(); ++i)
            isDrawn[i] = frame.texels[i].normal != Vec3(0) || frame.texels[i].colour != Vec3(0);
        frame.nearest = nearestDrawn(isDrawn, film.width);
    }
    return film;
}

void cutOut(const Impostor& impostor, double density, std::uint32_t threads, Film& film)
{
    const bool areCards = impostor.kind == ImpostorKind::Cards;
    const auto count = areCards ? kCardPairs : static_cast<std::uint32_t>(film.frames.size());
    forEachTask(
        count, threadsFor(threads), {},
        [&](std::uint32_t i) { cutOutFrame(film.width, film.height, density, film.frames[i]); }, [](std::uint32_t) {});
    if (!areCards)
        return;
    for (std::uint32_t i = 0; i < kCardPairs; ++i)
    {
        const std::vector<std::uint8_t>& front = film.frames[i].alpha;
        std::vector<std::uint8_t>& back = film.frames[i + kCardPairs].alpha;
        back.resize(front.size());
        for (std::size_t k = 0; k < front.size(); ++k)
            back[mirrored(k, film.width)] = front[k];
    }
}

} // namespace espalier
