#pragma once

#include <Espalier/Core/Vector.h>
#include <Espalier/Plant/Axes.h>

namespace espalier {

/// The skin of a species' wood. Colours are linear RGB in [0, 1].
struct BarkAppearance
{
    Vec3 colour{0.185f, 0.148f, 0.115f};
    float roughness = 0.9f; ///< [0, 1], as in glTF.
    float tile = 0.5f;      ///< Metres of bark that one repeat of the texture shows. (0, 100]

    friend bool operator==(const BarkAppearance&, const BarkAppearance&) = default;
};

/// What a species looks like beyond its skeleton. Leaves, LODs and wind will stand beside the bark.
struct Appearance
{
    PipeModel pipes;
    BarkAppearance bark;

    friend bool operator==(const Appearance&, const Appearance&) = default;
};

} // namespace espalier
