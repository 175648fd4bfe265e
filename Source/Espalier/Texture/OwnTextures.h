#pragma once

#include <Espalier/Core/Error.h>
#include <Espalier/Core/Limits.h>
#include <Espalier/Species/Appearance.h>
#include <Espalier/Texture/MaterialTextures.h>
#include <filesystem>
#include <vector>

namespace espalier {

/// An artist's own pictures: of bark first, then by kind of leaf, as Appearance::images. Those that are empty or
/// beyond are generated.
using OwnTextures = std::vector<MaterialTextures>;

/// Loads the pictures that the appearance names, from `folder` and below it.
///
/// All pictures of a material have the size of its colour, sides from 1 to kMaxTextureSize. Where there is no normal
/// map the material is flat, where there is no roughness it has that of the appearance. Texels of leaves that are cut
/// out take the colour of the nearest leaf.
///
/// Fails with Io for a file that is not there, with BadInput for one that is no PNG or of another size, with Limit for
/// one that is too large, or where all have more than limits.texels; the error names the file.
[[nodiscard]] Expected<OwnTextures> loadOwnTextures(const Appearance& appearance, const std::filesystem::path& folder,
                                                    const Limits& limits = {});

} // namespace espalier
