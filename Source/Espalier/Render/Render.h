#pragma once

#include <Espalier/Core/Error.h>
#include <Espalier/Core/Progress.h>
#include <Espalier/Core/Vector.h>
#include <Espalier/Render/Picture.h>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace espalier {

struct MaterialTextures;
struct TreeMesh;
struct Appearance;

/// Where a tree is shown.
enum class Backdrop : std::uint8_t
{
    Meadow, ///< On open ground under a clear sky, in the sun.
    Paper,  ///< As a figure in a book: on blank paper, in soft light from all around, without ground or shadow on it.
};

/// Light, camera and quality of a preview picture. Needs no GPU.
struct RenderSettings
{
    std::uint32_t width = 800;          ///< Pixels. [16, 8192]
    std::uint32_t height = 1000;        ///< Pixels. [16, 8192]
    std::uint32_t samplesPerPixel = 64; ///< Camera rays, each with one shadow ray and one sky ray. [1, 4096]
    float sunAzimuth = 1.0f;            ///< Radians round Y from +Z towards +X.
    float sunElevation = 0.72f;         ///< Radians above the horizon. (0, pi/2]
    float sunRadius = 0.03f;            ///< Angular radius, radians: how soft shadows are. [0, 0.5]
    float cameraAzimuth = 0.0f;         ///< Radians round Y from +Z towards +X: where the camera stands.
    /// Radians above the middle of the tree; below 0 the tree rises over the horizon. The camera stays above the
    /// ground: where it would sink in, it stands higher. [-1.5, 1.5]
    float cameraElevation = -0.09f;
    float fieldOfView = 0.45f; ///< Vertical, radians. [0.01, 1.5]
    /// A close-up: the frame shows what lies within `focusRadius` metres of `focus`, and what of the plant stands
    /// before it is looked through. A radius of 0: the whole tree.
    Vec3 focus{0};
    float focusRadius = 0; ///< [0, 1e4]
    /// On paper the tree stands in the middle, the camera goes wherever it is put (0 looks level), and light is soft:
    /// the sun's place only says which side is the lighter one.
    Backdrop backdrop = Backdrop::Meadow;
    std::uint32_t threads = 0; ///< 0: one per processor. The picture does not depend on it. [0, 256]
};

/// One tree of a picture. The mesh and appearance must outlive the call.
struct RenderSubject
{
    const TreeMesh* mesh = nullptr;
    const Appearance* appearance = nullptr;
    std::string label; ///< Written under it on strips and sheets; may be empty.
    /// What Cards parts of the mesh are painted with; must outlive the call. None: they are white.
    const MaterialTextures* cards = nullptr;
    /// The artist's own pictures (loadOwnTextures), in place of generated ones; must outlive the call. None: all are
    /// generated.
    const std::vector<MaterialTextures>* own = nullptr;
    double distance = 1; ///< Times as far as where it would fill its frame. [1, 1e4]
};

// All three frame the trees whole, to about nine tenths of the frame. In the meadow they stand on the ground (at y = 0,
// or at their lowest point if that is lower). They fail with BadInput for settings out of range and for a mesh
// that is empty, not finite or inconsistent; with Limit if the picture would exceed 2^28 pixels; with Cancelled.
// `progress` is called on the calling thread only. Equal input gives equal bytes on machines of one kind; Embree's ray
// tests may round differently on another CPU. Safe to call concurrently.

/// One tree.
[[nodiscard]] Expected<Picture> renderPicture(const RenderSubject& subject, const RenderSettings& settings,
                                              const Progress& progress = {});

/// The tree as it turns before the camera, in `views` equal steps, side by side and all to one scale; the light stands
/// still. width and height are those of one view. [1, 64] views
[[nodiscard]] Expected<Picture> renderTurntable(const RenderSubject& subject, std::uint32_t views,
                                                const RenderSettings& settings, const Progress& progress = {});

/// Several trees in a grid of `columns`, row by row, all to one scale and standing on one line, each over its label:
/// the archetype first, then its relatives. width and height are those of one tree's picture. [1, 1024] subjects
[[nodiscard]] Expected<Picture> renderContactSheet(std::span<const RenderSubject> subjects, std::uint32_t columns,
                                                   const RenderSettings& settings, const Progress& progress = {});

} // namespace espalier
