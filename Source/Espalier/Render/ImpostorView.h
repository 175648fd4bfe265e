#pragma once

#include <Espalier/Core/Vector.h>
#include <Espalier/Mesh/Impostor.h>
#include <cstdint>

namespace espalier {

class PreviewScene;
struct MaterialTextures;

/// What is to be seen from one level side, in a square as large as the ball round the plant.
struct ImpostorView
{
    double covered = 0; ///< In pixels.
    DVec3 colour{0};    ///< Sum over what is covered, linear.

    [[nodiscard]] DVec3 mean() const noexcept; ///< Black where nothing is covered.
};

/// Unit, level: to who looks from `azimuth`, radians from +Z towards +X.
[[nodiscard]] Vec3 toViewerAt(double azimuth) noexcept;

// Both look from `azimuth`, in pixels * pixels with four rays each.

[[nodiscard]] ImpostorView viewPlant(const PreviewScene& scene, const Impostor& impostor, double azimuth,
                                     std::uint32_t pixels, std::uint32_t threads);

/// Requires an atlas of this impostor.
[[nodiscard]] ImpostorView viewImpostor(const Impostor& impostor, const MaterialTextures& atlas, double azimuth,
                                        std::uint32_t pixels, std::uint32_t threads);

} // namespace espalier
