#pragma once

#include <Espalier/Archetype/Archetype.h>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace espalier {

/// Where branches stand round the axis that bears them.
enum class Azimuths : std::uint8_t
{
    AsDrawn,
    Phyllotaxis, ///< A golden angle, 137.5 degrees, from one to the next along the axis.
    Random,      ///< Anywhere, as a function of the place in the tree.
};

/// Gives a planar archetype depth: rolls its instances so that the branches round axes of order k stand as azimuths[k]
/// says; the last holds for all further orders, and none leaves everything as drawn. A pure function; what one branch
/// carries does not change what another does.
///
/// An axis goes on where a word does outside brackets, from anchor to child; what stands in brackets branches off (the
/// axial trees of ABOP p. 21). In F[-FX]+FY the child at Y continues the axis and that at X is the branch's second
/// piece; the first is drawn by the parent. So a branch is moved round its axis by rolling the instance that bears it,
/// before its word, and what the instance carries goes round with it. An axis without bends stays as it was. A bend
/// inside the instance turns too: an axis that gave way to its branch in the drawing gives way to it in space, and
/// zigzags become spirals. Wherever the axis no longer is as drawn the rotation is chosen anew: so that the instance
/// rises as far as it did in the drawing, by the angle next to the drawn one (of which, in an instance that is rolled
/// by a, cos a is left in its plane). In a plane that lies level it cannot; instances without branches are rolled
/// upright for it.
///
/// Azimuths are counted about the axis from where its mother axis leads, in a frame that is carried along it without
/// twist. The trunk's first branch stays where it was drawn; the first of a limb stands across the plane of the limb
/// and its mother axis, that of the next limb a golden angle further. Where an instance bears branches on j sides they
/// stay as they are to each other, and the next instance is turned by 137.5 / j degrees (multijugate phyllotaxis).
///
/// Scalings, branching angles and templates are kept, so what was kin remains so. Requires a valid archetype.
[[nodiscard]] Archetype giveDepth(const Archetype& archetype, std::span<const Azimuths> azimuths);

/// Reads `phyllotaxis`, `random` or `drawn`, or several of them with commas between, one for each order.
[[nodiscard]] Expected<std::vector<Azimuths>> parseAzimuths(std::string_view text);

/// The text form; parseAzimuths reads it back.
[[nodiscard]] std::string printAzimuths(std::span<const Azimuths> azimuths);

} // namespace espalier
