#pragma once

#include <Espalier/Archetype/Archetype.h>
#include <Espalier/Archetype/Stance.h>

namespace espalier {

/// A template as a mirror shows it that stands upright along the growth, its left for its right: `+` and `-`, `\` and
/// `/` change places, all else stays; of a symmetric one the word. The first turn of a word that begins with one stays
/// too, as an instance's rotation moves it either way; so where an instance points belongs to the instance. It is
/// called `name_mirrored`, and is of the kind of `name` (kindsOf). The mirror image of the mirror image has the word
/// again.
[[nodiscard]] Template mirrorImage(const Template& piece);

/// An archetype as it looks in a mirror, tree for tree and instance for instance: what pointed left points right, and
/// heights, lengths and angles between branches stay. A pure function; requires a valid archetype.
[[nodiscard]] Archetype mirrorImage(const Archetype& archetype);

/// A side as the mirror image has it.
[[nodiscard]] constexpr SkySide mirrorImage(SkySide side) noexcept
{
    return static_cast<SkySide>(-static_cast<int>(side));
}

} // namespace espalier
