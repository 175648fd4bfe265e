#pragma once

#include <Espalier/Archetype/Archetype.h>
#include <cstdint>
#include <vector>

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

/// Which side of an instance looks to the sky, as its first segment stands in its tree.
enum class SkySide : std::int8_t
{
    Right = -1,
    Neither = 0, ///< It stands upright, or level as after `$`: its image may take its place as well as it itself.
    Left = 1,
};

/// Of each instance. Requires a valid archetype; fails with Limit where a tree has more segments than `limits` allow.
[[nodiscard]] Expected<std::vector<SkySide>> skySidesOf(const Archetype& archetype, const Limits& limits = {});

/// Of the mirror image.
[[nodiscard]] constexpr SkySide mirrorImage(SkySide side) noexcept
{
    return static_cast<SkySide>(-static_cast<int>(side));
}

} // namespace espalier
