#pragma once

#include <Espalier/Core/Error.h>
#include <Espalier/Core/Progress.h>
#include <Espalier/Core/Random.h>
#include <Espalier/Core/Vector.h>
#include <Espalier/Mesh/Impostor.h>
#include <cstdint>
#include <vector>

namespace espalier {

class PreviewScene;
struct AtlasSettings;

/// A texel or pixel in space: seen from its viewer, its lower left corner and its sides, in metres.
struct FilmPatch
{
    Vec3 corner{0};
    Vec3 right{0};
    Vec3 up{0};
    Vec3 toViewer{0}; ///< Unit.
};

/// What a patch shows of the plant.
struct FilmTexel
{
    Vec3 colour{0};  ///< Mean of what is covered, linear.
    Vec3 normal{0};  ///< Mean, plant space, not unit.
    float depth = 0; ///< Metres before the patch, mean.
    float share = 0; ///< Covered, [0, 1].
    float round = 0; ///< Covered of the square round it, [0, 1].
    float open = 0;  ///< Of what is covered, how much light reaches: [0, 1].
};

/// Casts samples * samples rays, one somewhere in each cell of the patch, from `far` metres before it. `key` is the
/// patch's own. FilmTexel::round is left 0.
[[nodiscard]] FilmTexel lookAt(const PreviewScene& scene, const FilmPatch& patch, float far, std::uint32_t samples,
                               const RandomKey& key);

/// Metres from the middle of a frame from where nothing of the plant is behind.
[[nodiscard]] inline float farFrom(const Impostor& impostor) noexcept
{
    return 2.5f * impostor.radius;
}

/// One picture before it is printed; row by row from the top.
struct FilmFrame
{
    std::vector<FilmTexel> texels;
    std::vector<std::uint32_t> nearest; ///< Of each texel: the nearest that shows something of the plant.
    std::vector<std::uint8_t> alpha;    ///< 255 where the plant is to be seen, else 0.
};

/// All pictures of an impostor, each `width` times `height` texels.
struct Film
{
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    std::vector<FilmFrame> frames;
};

/// Share of the time that painting an impostor takes: how far progress has come when all pictures are taken.
inline constexpr double kPhotographed = 0.7;

/// Takes all pictures, without alpha. Of two cards back to back both cover the mean of what they do: a silhouette is
/// the same from behind, and so will their alpha be.
[[nodiscard]] Expected<Film> photograph(const PreviewScene& scene, const Impostor& impostor,
                                        const AtlasSettings& settings, const Progress& progress);

/// Gives all frames their alpha, all or nothing.
///
/// A texel is seldom all plant, and rounded each by itself far twigs would vanish: what one is given too much its
/// neighbours are given less (Floyd and Steinberg, 1976). Only where there is some of the plant: what would spread into
/// the air waits for the next texel that has some.
///
/// `density` above 0 makes the plant denser where it covers a texel in part, below 0 thinner where there is little of
/// it round a texel: a trunk stays as solid as it is.
void cutOut(const Impostor& impostor, double density, std::uint32_t threads, Film& film);

} // namespace espalier
