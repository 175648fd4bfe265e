#pragma once

#include <Espalier/Bake/PointTree.h>
#include <Espalier/Core/Error.h>
#include <Espalier/Core/Limits.h>
#include <Espalier/Plant/Skeleton.h>
#include <filesystem>
#include <string>
#include <string_view>

namespace espalier {

// SWC, the format of traced neurons and roots: a point a line, `id type x y z radius parent`, -1 for no parent, `#`
// before a comment (R. C. Cannon et al., An on-line archive of reconstructed hippocampal neurons, J. Neurosci. Methods
// 84 (1998)). Ids are any whole numbers, in any order; there may be several roots, blank lines and further columns.

/// Reads the text of an `.swc` file. A segment runs from its parent's point to each point, with the radii of both
/// (skeletonOf); branches that leave a soma (type 1) start with their own radius. A soma of three points (a root of
/// type 1 with two ends of type 1, which stand for a sphere) is its first point. Refuses, with line and column, what is
/// no number or not finite, a negative radius, an id that is taken or unknown, and points that hang on themselves.
[[nodiscard]] Expected<ImportedSkeleton> parseSwc(std::string_view text, std::string_view file,
                                                  const ImportSettings& settings = {}, const Limits& limits = {});

[[nodiscard]] Expected<ImportedSkeleton> loadSwc(const std::filesystem::path& path, const ImportSettings& settings = {},
                                                 const Limits& limits = {});

/// The segments as SWC, all of type 0, with digits that give every float back to the bit. `comment` goes into the head,
/// a `#` before each line. parseSwc gives positions and radii back, the latter at both ends: where a segment starts
/// elsewhere, or thicker or thinner, than its parent ends, a point of its own stands at its start. So a turtle's move
/// comes back as a segment. Leaves and other shapes are not written. Where the first segment starts away from the
/// origin, what is read back is moved.
[[nodiscard]] std::string printSwc(const Skeleton& skeleton, std::string_view comment);

/// printSwc, written atomically.
[[nodiscard]] Expected<void> saveSwc(const std::filesystem::path& path, const Skeleton& skeleton,
                                     std::string_view comment);

} // namespace espalier
