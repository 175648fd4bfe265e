#pragma once

#include <Espalier/Core/Error.h>
#include <Espalier/Core/Random.h>
#include <filesystem>
#include <optional>
#include <string>

namespace espalier {

struct Appearance;
struct TreeMesh;

/// What a baked tree says of itself: names in the scene, and `extras` of its node:
/// `{"espalier": {"species": name, "speciesHash": "00c0ffee00c0ffee", "seed": "42", "version": "0.1.0"}}`, the version
/// being Espalier's.
struct BakeInfo
{
    std::string speciesName;       ///< UTF-8; names the node, mesh and materials. Empty: "tree".
    std::uint64_t speciesHash = 0; ///< Identity of the species; written as 16 hex digits.
    /// Written as a decimal string: JSON numbers lose bits above 2^53. None: the drawn tree itself, "exemplar".
    std::optional<Seed> seed{Seed{}};
};

/// `mesh` as the bytes of a GLB file in the portable profile: glTF 2.0 without extensions, float attributes
/// (POSITION, NORMAL, TANGENT, TEXCOORD_0), 16-bit indices where they suffice, one opaque material a kind
/// and colour of part, double-sided for surfaces, everything in one buffer. One node, in metres, Y up.
///
/// glTF counts v from the top of an image, so TEXCOORD_0 is (u, 1 - v): an image's top points to the tip of the
/// branch. Tangents pass unchanged: their bitangent points to the image's top, where glTF's normal maps have +Y.
///
/// Equal input gives equal bytes. Fails with BadInput if the mesh is empty or inconsistent, a number in it is not
/// finite, a normal or tangent is not unit or the name is not UTF-8; with Limit if the file would exceed 4 GiB or
/// memory. Safe to call concurrently.
[[nodiscard]] Expected<std::string> bakeGlb(const TreeMesh& mesh, const Appearance& appearance, const BakeInfo& info);

/// bakeGlb, written atomically.
[[nodiscard]] Expected<void> writeGlb(const std::filesystem::path& path, const TreeMesh& mesh,
                                      const Appearance& appearance, const BakeInfo& info);

} // namespace espalier
