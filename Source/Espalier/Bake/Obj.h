#pragma once

#include <Espalier/Bake/Gltf.h>
#include <Espalier/Core/Error.h>
#include <Espalier/Species/Appearance.h>
#include <filesystem>
#include <span>
#include <string>

namespace espalier {

struct TreeMesh;

/// A mesh as text, for programs that know no glTF.
struct ObjText
{
    std::string object;    ///< `.obj`
    std::string materials; ///< `.mtl`
};

/// Wavefront OBJ: positions, normals and texture coordinates (v from the bottom) of each vertex, numbers as short as
/// they can be and read back as the same floats, indices from 1; a group a part, a material a kind and colour of part.
/// The materials hold Kd (linear), roughness as Pr and, where `images` name files ([0] of bark, [1 + k] of leaves of
/// kind k; names are written as they are), map_Kd, map_d for leaves, norm and map_Pr. Lost: tints, tangents, which
/// side is seen. White space in names becomes `_`.
///
/// Equal input gives equal bytes, whatever the locale. Fails with BadInput if the mesh is empty or inconsistent, a
/// number is not finite, or the species' name or an image's is not UTF-8 or has more than a line.
[[nodiscard]] Expected<ObjText> printObj(const TreeMesh& mesh, const Appearance& appearance, const BakeInfo& info,
                                         std::string_view materialFile, std::span<const ImageNames> images = {});

/// Where writeObj puts the materials of `path`: beside it, in a file of the same name that ends in `.mtl`, blanks in
/// the name as `_`, since many readers split names there.
[[nodiscard]] std::filesystem::path materialsPath(const std::filesystem::path& path);

/// Writes `path` and, at its materialsPath, its materials; each atomically, the materials first, the object without
/// ever being in memory as a whole.
[[nodiscard]] Expected<void> writeObj(const std::filesystem::path& path, const TreeMesh& mesh,
                                      const Appearance& appearance, const BakeInfo& info,
                                      std::span<const ImageNames> images = {});

} // namespace espalier
