#pragma once

#include <Espalier/Bake/Gltf.h>
#include <Espalier/Species/Appearance.h>
#include <Espalier/Texture/MaterialTextures.h>
#include <filesystem>
#include <string>
#include <vector>

namespace espalier::tool {

// The pictures of one material as files of their own.

/// STEM-colour.png, STEM-normal.png and STEM-roughness.png.
[[nodiscard]] ImageNames pictureNames(const std::string& stem);

/// Those that there are, in that order.
[[nodiscard]] std::vector<std::string> namesIn(const ImageNames& names);

[[nodiscard]] EncodedImages encode(const MaterialTextures& material);

void writePictures(const std::filesystem::path& folder, const ImageNames& names, const EncodedImages& pictures);

} // namespace espalier::tool
