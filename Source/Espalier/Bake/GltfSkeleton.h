#pragma once

#include <Espalier/Bake/PointTree.h>
#include <Espalier/Core/Error.h>
#include <Espalier/Core/Limits.h>
#include <filesystem>
#include <string>
#include <string_view>

namespace espalier {

/// Reads the bones of a glTF 2.0 file, text (`.gltf`) or binary (`.glb`): a segment from each joint's parent to the
/// joint, where the transforms of their nodes (translation, rotation, scale or a matrix) place them in the scene.
///
/// The joints are those of the file's skins; what lies between two of them in the hierarchy only moves them. Without a
/// skin every node of the scene is a joint, helpers that carry a mesh or a camera too. The scene is the file's default,
/// else its first, else all nodes without a parent. A bone ends where the next begins, so the length of last bones,
/// which glTF does not know, is lost; exporters offer end bones for it. There are no radii: the pipe model gives them.
///
/// Reads transforms and the hierarchy alone, from the JSON part, and opens no other file. Refuses, with line and column
/// in that part, a node with several parents or on a cycle, an index out of range, and numbers that are not finite.
[[nodiscard]] Expected<ImportedSkeleton> parseGltfSkeleton(std::string bytes, std::string_view file,
                                                           const ImportSettings& settings = {},
                                                           const Limits& limits = {});

[[nodiscard]] Expected<ImportedSkeleton>
loadGltfSkeleton(const std::filesystem::path& path, const ImportSettings& settings = {}, const Limits& limits = {});

} // namespace espalier
