#pragma once

#include <Espalier/Core/Vector.h>
#include <cstdint>
#include <span>
#include <vector>

namespace espalier {

/// Memory that triangulating needs in between.
struct TriangulationScratch
{
    std::vector<std::uint32_t> next;
    std::vector<std::uint32_t> previous;
    std::vector<std::uint32_t> reflex; ///< Corners that bend inwards; some that no longer do.
};

/// Appends the triangles that fill a polygon, counter-clockwise, each as three numbers of its corners; none without
/// area. Collinear and repeated corners, spikes and edges that touch are filled as one would draw them; of edges that
/// cross, what cannot be filled without overlap becomes a fan.
///
/// `work` is taken down by one for every corner that is looked at; when it is used up, the rest becomes a fan, so that
/// a polygon of a million corners takes no longer than it may.
///
/// Requires: corners run counter-clockwise.
void triangulate(std::span<const DVec2> corners, std::uint64_t& work, TriangulationScratch& scratch,
                 std::vector<std::uint32_t>& triangles);

} // namespace espalier
