#pragma once

#include <Espalier/Inference/FitLibrary.h>
#include <Espalier/Inference/FitPaths.h>
#include <Espalier/Inference/FitPieces.h>
#include <vector>

namespace espalier {

/// Finds the transform of every piece, and defines the bent templates of `library` on the way. `size` is that of the
/// largest tree, `drift` how far the end of a piece may lie from where it belongs; metres.
[[nodiscard]] std::vector<InstanceTransform> placePieces(const FitPaths& paths, const std::vector<Piece>& pieces,
                                                         FitLibrary& library, double size, double drift);

} // namespace espalier
