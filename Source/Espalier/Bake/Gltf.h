#pragma once

#include <Espalier/Core/Error.h>
#include <Espalier/Core/Random.h>
#include <Espalier/Core/Vector.h>
#include <Espalier/Mesh/WindMotion.h>
#include <filesystem>
#include <optional>
#include <span>
#include <string>

namespace espalier {

struct Appearance;
struct Tint;
struct TreeMesh;
struct WindInfluence;
struct WindJoint;

/// What a baked tree says of itself: names in the scene, and `extras` of its node:
/// `{"espalier": {"species": name, "speciesHash": "00c0ffee00c0ffee", "seed": "42", "version": "0.1.0"}}`, the version
/// being Espalier's; of a level of detail also `"lod": 2, "error": 0.013`.
struct BakeInfo
{
    std::string speciesName;       ///< UTF-8; names the node, mesh and materials. Empty: "tree".
    std::uint64_t speciesHash = 0; ///< Identity of the species; written as 16 hex digits.
    /// Written as a decimal string: JSON numbers lose bits above 2^53. None: the drawn tree itself, "exemplar".
    std::optional<Seed> seed{Seed{}};
    /// With wind data: how this plant answers, as `"wind": {"trunkAngle", "boughAngle", "flutter", "rate"}`, what
    /// Content/Shaders/wind.vert asks for beside the attributes.
    std::optional<WindResponse> wind{};
};

/// How the numbers of vertices are stored. What each costs in bytes, and who reads it: README.md.
enum class GltfEncoding : std::uint8_t
{
    Portable, ///< Floats and no required extension: every reader.
    /// KHR_mesh_quantization, required: positions on a grid of 1/65534 of the tree's largest extent (20 m: 0.16 mm from
    /// where they were on each axis), normals and tangents in bytes (0.4 degrees). Texture coordinates stay floats:
    /// those of bark count repeats, and a grid for them would need KHR_texture_transform on every texture.
    Quantized,
    /// Quantized, in EXT_meshopt_compression, required. Texture coordinates lie on a grid of 1/4096 repeat. The corners
    /// of a triangle may begin with another one.
    Compressed,
};

/// What a bake leaves open.
struct BakeOptions
{
    GltfEncoding encoding = GltfEncoding::Portable;
    /// KHR_materials_diffuse_transmission on leaves that let light through; readers that do not know it ignore it.
    bool translucentLeaves = false;
};

/// Pictures of one material as PNG files; those that are empty are left out. Bark repeats, leaves end at their edge.
struct EncodedImages
{
    std::string colour;    ///< sRGB, its mean the colour of the material; alpha cuts out leaves.
    std::string normal;    ///< Tangent space, green towards the tip.
    std::string roughness; ///< Green roughness, blue metal as in glTF, red occlusion.
};

/// One level of detail of a tree. Spans are the caller's memory and as long as the mesh's vertices, or empty.
struct BakedLevel
{
    const TreeMesh* mesh = nullptr;
    std::uint32_t lod = 0; ///< 0 the full plant.
    float error = 0;       ///< Metres: the level takes over where this is about a pixel.
    /// COLOR_0 in place of the mesh's tints. Every reader multiplies it into the base colour, and alpha cuts leaves.
    std::span<const Tint> colours;
    /// TEXCOORD_1 and up, unchanged: wind data. At most kMostFurtherUvs.
    std::span<const std::span<const Vec2>> furtherUvs;
    std::span<const WindInfluence> influences; ///< Of the tree's joints, different ones; needed if it has joints.
};

inline constexpr std::size_t kMostFurtherUvs = 7;

/// Everything of one tree that can be baked into one file.
struct BakedTree
{
    /// From fine to coarse. More than one become MSFT_lod: readers that do not know it may show all levels at once, so
    /// the portable way is a file for each.
    std::span<const BakedLevel> levels;
    /// [0] of bark, [1 + k] of leaves of kind k, after all kinds those of cards; may be shorter.
    std::span<const EncodedImages> images;
    /// A skin, if there are any (Mesh/WindPresets.h). At most 65,536, parents before children; positions alone count.
    std::span<const WindJoint> joints;
};

/// `tree` as the bytes of a GLB file: glTF 2.0, all in one buffer, 16-bit indices where they suffice (to 65,535
/// vertices), a primitive a part and a material a kind and colour of part. Bark is opaque and one-sided, surfaces are
/// two-sided, leaves two-sided and cut out at alpha 0.5. A node in metres, Y up; where vertices are quantized, below it
/// one that scales them back, unless a skin does.
///
/// glTF counts v from the top of an image, so TEXCOORD_0 is (u, 1 - v): an image's top points to the tip of the
/// branch. Tangents pass unchanged: their bitangent points to the image's top, where glTF's normal maps have +Y.
///
/// Equal input gives equal bytes. Fails with BadInput if there is no level or a mesh is empty or inconsistent, a number
/// is not finite, a normal or tangent not unit, the name not UTF-8, an image no PNG, or a span or joint not as said
/// above; with Limit if the file would exceed 4 GiB or memory. Safe to call concurrently.
[[nodiscard]] Expected<std::string> bakeGlb(const BakedTree& tree, const Appearance& appearance, const BakeInfo& info,
                                            const BakeOptions& options = {});

/// bakeGlb of one mesh that is the full plant.
[[nodiscard]] Expected<std::string> bakeGlb(const TreeMesh& mesh, const Appearance& appearance, const BakeInfo& info,
                                            const BakeOptions& options = {});

/// bakeGlb, written atomically, and straight from the arrays: what it needs beside them is a few hundred KiB, but for
/// Compressed, which is encoded in memory.
[[nodiscard]] Expected<void> writeGlb(const std::filesystem::path& path, const BakedTree& tree,
                                      const Appearance& appearance, const BakeInfo& info,
                                      const BakeOptions& options = {});

[[nodiscard]] Expected<void> writeGlb(const std::filesystem::path& path, const TreeMesh& mesh,
                                      const Appearance& appearance, const BakeInfo& info,
                                      const BakeOptions& options = {});

} // namespace espalier
