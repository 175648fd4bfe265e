#pragma once

#include <Espalier/Core/Error.h>
#include <Espalier/Core/Random.h>
#include <filesystem>
#include <string>

namespace espalier {

struct Appearance;
struct TreeMesh;

/// What a baked tree says of itself: names in the scene, and `extras` of its node.
struct BakeInfo
{
    std::string speciesName;        ///< UTF-8; names the node, mesh and materials.
    std::uint64_t speciesHash = 0;  ///< Identity of the species; written as 16 hex digits.
    Seed seed;                      ///< Written as a decimal string: JSON numbers lose bits above 2^53.
};

/// `mesh` as the bytes of a GLB file in the portable profile: glTF 2.0 without required extensions, float attributes
/// (POSITION, NORMAL, TANGENT, TEXCOORD_0), 16-bit indices where they suffice, one double-sided-free opaque bark material,
/// everything in one buffer. Equal input gives equal bytes. Fails with BadInput if the mesh is empty or a number in it
/// is not finite, with Limit above 4 GiB.
[[nodiscard]] Expected<std::string> bakeGlb(const TreeMesh& mesh, const Appearance& appearance, const BakeInfo& info);

/// bakeGlb, written atomically.
[[nodiscard]] Expected<void> writeGlb(const std::filesystem::path& path, const TreeMesh& mesh, const Appearance& appearance,
                                      const BakeInfo& info);

} // namespace espalier
