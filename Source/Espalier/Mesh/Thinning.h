#pragma once

#include <Espalier/Mesh/TreeMesher.h>
#include <Espalier/Plant/Skeleton.h>
#include <cstdint>
#include <vector>

namespace espalier {

/// Memory that thinning needs in between; reuse it and nothing is allocated after warm-up. One per thread.
struct ThinningScratch
{
    struct Axis
    {
        std::uint32_t start = kNoSegment; ///< Its first segment.
        float kept = 1;                   ///< Share of axes like it that are kept.
        float area = 0;                   ///< Square metres that it covered as it grew, seen across.
        bool isKept = true;
    };
    std::vector<Axis> axes;
    std::vector<std::uint64_t> places;    ///< Of each segment (hashPlaces).
    std::vector<std::uint32_t> axisOf;    ///< Of each segment.
    std::vector<std::uint8_t> isNeeded;   ///< Of each segment: its end is a corner that stays.
    std::vector<std::uint32_t> thinnedOf; ///< Of each segment: the one of the thinned plant that it is in.
    std::vector<std::uint32_t> fullOf;    ///< Of each segment of the thinned plant: the first of those in it.
    std::vector<float> widening;          ///< Of each segment of the thinned plant: how many times as thick it is.
    std::vector<std::uint32_t> organOf;   ///< Of each shape that the thinned plant draws: its number in the full one.
};

/// A plant with less detail, for the distance at which `error` metres are about a pixel. `thinned` must not be `full`.
///
/// Branches thinner than 0.45 of `error` are too thin to be seen one by one. Of those with a share s of that as their
/// width, a share s is kept, and made 1 / s as wide: together they cover what all did (stochastic simplification; Cook,
/// Halstead, Planck and Ryu, "Stochastic simplification of aggregate detail", ACM TOG 26, 2007). Which are kept is a
/// function of their places (hashPlaces), and what a larger error keeps a smaller one kept too, so nothing comes back
/// on the way. A branch goes with all that it bears; leaves and fruits of those that stay grow by the square root of 1
/// / s. The trunk stays. Widths also make up for what facets of so coarse a tube cut off, for which branches happen to
/// be kept, and a little for what wide ones hide of each other; thin axes end in a point. Corners of an axis that lie
/// within half of the error of the straight way are left out, but for those where branches leave that are not thin:
/// thin ones begin somewhere on the straight way, and are joined to nothing. With `joints` Weld, they stay joined.
///
/// An error that is not positive changes nothing. The plant needs its axes (completeAxes) and must be sound (isSound);
/// so is what comes out. Equal input gives equal bytes. Safe to call concurrently on different scratches and plants.
void thinSkeleton(const Skeleton& full, float error, ThinningScratch& scratch, Skeleton& thinned,
                  TubeJoints joints = TubeJoints::Embed);

/// Makes the sources of a mesh of the thinned plant name segments and organs of the full one. `scratch` is as the call
/// of thinSkeleton left it.
void nameFullSources(const ThinningScratch& scratch, TreeMesh& mesh) noexcept;

/// Settings for meshing a plant that was thinned by `error`: facets and rings no finer than it.
[[nodiscard]] MeshSettings coarserBy(float error, MeshSettings settings = {});

} // namespace espalier
