#pragma once

#include <Espalier/Core/Error.h>
#include <Espalier/Core/Progress.h>
#include <Espalier/Mesh/Impostor.h>
#include <Espalier/Render/Render.h>
#include <Espalier/Texture/MaterialTextures.h>
#include <array>
#include <cstdint>
#include <optional>

namespace espalier {

/// How finely an impostor is painted. It takes about 70 bytes of memory a texel.
struct AtlasSettings
{
    /// Texels along each side of the atlas, rounded down to whole frames of at least eight. A power of two is one of
    /// the atlas too, with the usual sides. [64, 4096]
    std::uint32_t size = 1024;
    std::uint32_t samples = 3; ///< Rays along each side of a texel. [1, 16]
    std::uint32_t threads = 0; ///< 0: one per processor. The pictures do not depend on it. [0, 256]
};

/// The pictures of an impostor, by casting rays at the full plant, unlit: as glTF's material has them.
///
/// `colour`: sRGB, and alpha of 255 where the plant is to be seen, else 0. What of it a texel shows is seldom all or
/// nothing; neighbours make up for what one is rounded, so that far twigs do not vanish, and the crown is made denser
/// or thinner, as far as it goes, for the impostor to cover as much as the plant in sixteen level views together, and
/// to be as bright. That holds at the size of its texels: cut at one half, the mip maps of a sparse crown cover up to a
/// quarter more or less. Texels that show nothing of the plant have the colour of the nearest that does.
///
/// `normal`: three channels; of cards in the space of the card, of octahedral frames in plant space, from [-1, 1].
///
/// `roughness`: as glTF has it, of which red, occlusion, is the share of the light of an even sky that the rest of the
/// plant lets pass: flat pictures cannot shade themselves. Blue is 0, or of octahedral frames how far before the
/// frame's middle the plant is, from -radius to radius.
///
/// Fails as renderPicture does, with BadInput too if the impostor is none that makeImpostor gives. Equal input gives
/// equal bytes on machines of one kind (Embree). Safe to call concurrently.
[[nodiscard]] Expected<MaterialTextures> paintImpostor(const RenderSubject& subject, const Impostor& impostor,
                                                       const AtlasSettings& settings = {},
                                                       const Progress& progress = {});

/// One point of an impostor as it is drawn.
struct ImpostorSight
{
    Vec3 colour{0}; ///< Linear, unlit.
    Vec3 normal{0}; ///< Plant space, unit.
};

/// What is to be seen of an impostor from infinitely far in the direction `toViewer` (unit), on the ray that passes
/// `through` (metres, plant space): what a graphics card does with meshCards, or with Content/Shaders/impostor.frag.
/// Nothing where it is cut out. `dither`, in [0, 1), evenly spread over the pixels, picks one of the frames round a
/// direction. Requires an atlas of this impostor.
[[nodiscard]] std::optional<ImpostorSight> seeImpostor(const Impostor& impostor, const MaterialTextures& atlas,
                                                       const Vec3& toViewer, const Vec3& through,
                                                       float dither = 0.5f) noexcept;

/// How an impostor looks beside the plant itself, unlit, from one side.
struct ImpostorDifference
{
    float coverage = 0; ///< What it covers, as a share of what the plant covers.
    Vec3 colour{0};     ///< The mean colour of what is covered, linear, as a share of the plant's.
};

/// Level views from which impostors are compared: 45 degrees apart, the first from +Z.
inline constexpr std::uint32_t kImpostorViews = 8;

/// Compares from kImpostorViews sides, turned by `turn` radians about Y, at the size of the atlas' texels or coarser.
/// Errors as for paintImpostor, and BadInput if the atlas is none of this impostor.
[[nodiscard]] Expected<std::array<ImpostorDifference, kImpostorViews>>
compareImpostor(const RenderSubject& subject, const Impostor& impostor, const MaterialTextures& atlas, float turn = 0,
                std::uint32_t threads = 0);

} // namespace espalier
