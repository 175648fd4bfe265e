#pragma once

#include <Espalier/Core/Vector.h>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace espalier {

/// What takes light away: a leaf, seen as so much surface in one place.
struct Shader
{
    Vec3 place{0};  ///< Metres.
    float area = 0; ///< Square metres.
};

/// How light it is within a crown, and which way leads out of it: cubes over the cloud of its leaves, some thousands
/// whatever the size of the plant. A plain value; `measure` keeps the memory.
struct FoliageLight
{
    /// Light from the sky, and some from all sides, dims as it passes leaves (Beer's law, with randomly turned leaves).
    /// Linear time. Equal input gives equal bytes.
    void measure(std::span<const Shader> leaves);

    /// What a place in the crown has.
    struct Sample
    {
        float light = 1; ///< Share of that under the open sky. [0, 1]
        Vec3 outward{0}; ///< From where leaves are dense to where they are not: as long as that is clear, at most 1.
    };
    [[nodiscard]] Sample at(const Vec3& place) const noexcept;

    Vec3 low{0};                          ///< Of the cubes' lowest corner, metres.
    float edge = 1;                       ///< Of a cube, metres.
    std::array<std::uint32_t, 3> count{}; ///< Cubes along x, y, z.
    std::vector<float> density;           ///< Square metres of leaves in a cubic metre; x runs fastest, then z, then y.
    std::vector<float> smooth;            ///< The same with neighbours.
    std::vector<Vec3> outward;            ///< See Sample.
    std::vector<float> light;             ///< [0, 1]
    std::vector<float> depths;            ///< Of layers while light passes them.
};

} // namespace espalier
