#pragma once

#include <Espalier/Core/Vector.h>
#include <Espalier/Plant/Axes.h>
#include <cstddef>
#include <vector>

namespace espalier {

/// The skin of a species' wood. Colours are linear RGB in [0, 1].
struct BarkAppearance
{
    Vec3 colour{0.185f, 0.148f, 0.115f};
    float roughness = 0.9f; ///< [0, 1], as in glTF.
    float tile = 0.5f;      ///< Metres of bark that one repeat of the texture shows. (0, 100]

    friend bool operator==(const BarkAppearance&, const BarkAppearance&) = default;
};

/// Entries of a palette; a skeleton's materials beyond share the last.
inline constexpr std::size_t kMaxPalette = 64;

/// The colours of a species that names none: 0 fresh leaf, 1 green, 2 yellow green, 3 blossom, 4 warm yellow, 5 berry
/// red, 6 violet blue, 7 withered leaf.
[[nodiscard]] std::vector<Vec3> defaultPalette();

/// What a species looks like beyond its skeleton. Leaves, LODs and wind will stand beside the bark.
struct Appearance
{
    PipeModel pipes;
    BarkAppearance bark;
    /// Linear RGB in [0, 1], by the material index of what the skeleton draws (the turtle's '); indices beyond take the
    /// last entry. Wood of index 0 has the bark's colour, so entry 0 is that of leaves. [1, kMaxPalette] entries
    std::vector<Vec3> palette = defaultPalette();

    friend bool operator==(const Appearance&, const Appearance&) = default;
};

} // namespace espalier
