#pragma once

#include <Espalier/Core/Vector.h>
#include <Espalier/Mesh/TreeMesh.h>
#include <Espalier/Species/Appearance.h>
#include <cstdint>
#include <span>
#include <vector>

namespace espalier {

/// How a coarser mesh of a plant looks beside the full one, both as dark shapes before a bright sky.
struct SilhouetteDifference
{
    float coverage = 1; ///< What it covers, as a share of what the full plant covers.
    /// Where one covers what the other does not, as a share of what the full plant covers: 0 if they look the same.
    float outline = 0;
};

/// Memory that comparing needs in between; reuse it. One per thread.
struct SilhouetteScratch
{
    struct Mask ///< Of one kind of leaf: which cells of its surface are not cut out.
    {
        static constexpr std::uint32_t kSide = 64;
        std::vector<std::uint8_t> cells;
    };
    std::vector<Mask> masks;
    std::vector<std::uint8_t> samples; ///< Of one view of one mesh: 1 where it is covered.
    std::vector<std::uint8_t> full;    ///< Covered samples of each pixel.
    std::vector<std::uint8_t> coarse;
};

/// Views round the Y axis in which silhouettes are compared.
inline constexpr std::uint32_t kSilhouetteViews = 8;

/// Compares two meshes of one plant in level, parallel views from kSilhouetteViews sides, in pixels of `pixel` metres:
/// the error of a level of detail says from where on it is meant to be seen. A pixel is covered by as much as its
/// sixteen samples are; leaves are cut out as LeafSurface draws `kinds`. Pictures have at most 2,048 pixels a side: on
/// larger plants pixels are larger.
///
/// A full plant that covers nothing gives the default. Requires sound meshes. Equal input gives equal results. Safe to
/// call concurrently on different scratches. Time: that of drawing both meshes so often.
[[nodiscard]] SilhouetteDifference compareSilhouettes(const TreeMesh& full, const TreeMesh& coarse,
                                                      std::span<const LeafAppearance> kinds, float pixel,
                                                      SilhouetteScratch& scratch);

} // namespace espalier
