#pragma once

#include <Espalier/Mesh/FoliageLight.h>
#include <Espalier/Mesh/TreeMesh.h>
#include <cstddef>

namespace espalier {

/// Darkens the tints of the vertices from `first` up to `end` where the crown takes their light away, as leaves are: by
/// `shade` [0, 1] where none arrives. Wood below the crown has the more light the further down it is. What is there has
/// tints; without light to look at, or shade, they stay as they are. A vertex' tint depends on its place alone, so what
/// shares a place and a tint still does.
void shadeWood(const FoliageLight& light, float shade, std::size_t first, std::size_t end, TreeMesh& mesh);

} // namespace espalier
