#pragma once

#include <Espalier/Core/Error.h>
#include <Espalier/Core/Progress.h>
#include <Espalier/Core/Vector.h>
#include <Espalier/Render/Picture.h>
#include <cstdint>
#include <span>
#include <string>

namespace espalier {

struct TreeMesh;
struct Appearance;

/// Light, ground and quality of a preview picture. Needs no GPU.
struct RenderSettings
{
    std::uint32_t width = 800;            ///< Pixels. [16, 8192]
    std::uint32_t height = 1000;          ///< Pixels. [16, 8192]
    std::uint32_t samplesPerPixel = 64;   ///< Camera rays, each with one shadow ray and one sky ray. [1, 4096]
    float sunAzimuth = 2.3f;              ///< Radians round Y from +Z towards +X.
    float sunElevation = 0.75f;           ///< Radians above the horizon. (0, pi/2]
    float sunRadius = 0.03f;              ///< Angular radius, radians: how soft shadows are. [0, 0.5]
    float cameraAzimuth = 0.0f;           ///< Radians round Y from +Z towards +X: where the camera stands.
    float cameraElevation = 0.10f;        ///< Radians above the horizon. [-1.5, 1.5]
    float fieldOfView = 0.45f;            ///< Vertical, radians. (0, 3)
    std::uint32_t threads = 0;            ///< 0: one per processor. The picture does not depend on it.
};

/// One tree of a picture. The mesh and appearance must outlive the call.
struct RenderSubject
{
    const TreeMesh* mesh = nullptr;
    const Appearance* appearance = nullptr;
    std::string label; ///< Written under it on strips and sheets; may be empty.
};

/// One tree, framed whole with its shadow, standing on the ground under a clear sky.
[[nodiscard]] Expected<Picture> renderPicture(const RenderSubject& subject, const RenderSettings& settings, const Progress& progress = {});

/// The tree from `views` sides round it, side by side; all framed alike. width and height are those of one view.
[[nodiscard]] Expected<Picture> renderTurntable(const RenderSubject& subject, std::uint32_t views, const RenderSettings& settings,
                                                const Progress& progress = {});

/// Several trees in a grid of `columns`, row by row, all at the same scale, each with its label: the archetype first,
/// then its relatives. width and height are those of one cell.
[[nodiscard]] Expected<Picture> renderContactSheet(std::span<const RenderSubject> subjects, std::uint32_t columns,
                                                   const RenderSettings& settings, const Progress& progress = {});

} // namespace espalier
