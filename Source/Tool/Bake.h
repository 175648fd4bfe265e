#pragma once

#include "Look.h"

#include <Espalier/Bake/Gltf.h>
#include <Espalier/Bake/Obj.h>
#include <Espalier/Bake/PivotTextures.h>
#include <Espalier/Mesh/Collision.h>
#include <Espalier/Mesh/DetailLevel.h>
#include <Espalier/Mesh/Impostor.h>
#include <Espalier/Mesh/Silhouette.h>
#include <Espalier/Mesh/Wind.h>
#include <Espalier/Mesh/WindPresets.h>
#include <Espalier/Render/Render.h>
#include <Espalier/Texture/OwnTextures.h>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace espalier::tool {

/// Options of a verb that bakes plants: what goes into their files, and how.
struct BakeChoices
{
    std::string profile = "portable";
    std::string levels = "0"; ///< Of detail: N or A..B.
    bool together = false;    ///< All levels in one file.
    std::uint32_t textures = 512;
    bool translucent = false;
    std::string wind = "none";
    std::uint32_t joints = 64;
    std::string branches = "embed"; ///< How they join.
    bool collision = false;
    bool differences = false; ///< Tell how levels look beside the full plant.
    std::string impostor = "none";
    std::uint32_t atlas = 1024; ///< Texels along each side of the impostor's.
    std::uint32_t frames = 8;   ///< Along each side of the atlas of an octahedral one.

    void addTo(CLI::App& verb);
    /// Fails for an option that was given and would have no effect.
    void check(const CLI::App& verb, bool hasLeaves) const;
};

/// First and last of the levels of detail that `--lod` names.
[[nodiscard]] std::pair<std::uint32_t, std::uint32_t> parseLevels(const std::string& text);

/// Bakes the plants of one species, one after the other.
class PlantBaker
{
public:
    /// The texture images are made here, once, but for the artist's `own`. `path`, the file of the species, is named in
    /// errors.
    PlantBaker(const BakeChoices& choices, const Appearance& appearance, OwnTextures own, std::string path);

    /// Writes all levels of a plant, and what else was chosen, to files named after `output`; says what came out, an
    /// entry a file. "with" names the files that it refers to, written beside it. The result is empty if there was
    /// nothing to draw.
    nlohmann::ordered_json write(const Skeleton& skeleton, BakeInfo info, const std::string& label,
                                 const std::filesystem::path& output);

private:
    /// One level with all that its file holds.
    struct Level
    {
        TreeMesh mesh;
        float error = 0;
        WindChannels wind;
        WindSkin skin;
    };
    [[nodiscard]] MeshSettings meshSettings() const;
    [[nodiscard]] std::vector<Level> makeLevels(const Skeleton& skeleton, std::uint32_t first, std::uint32_t last,
                                                const std::string& label);
    void addWind(const Skeleton& skeleton, Level& level);
    void addDifferences(const TreeMesh& full, const Level& level, nlohmann::ordered_json& facts);
    [[nodiscard]] RenderSubject subjectOf(const TreeMesh& mesh, const std::string& label) const;
    void addImpostorDifferences(const TreeMesh& full, nlohmann::ordered_json& facts) const;
    nlohmann::ordered_json writeImpostor(ImpostorKind kind, const TreeMesh& full, float coarsest, const BakeInfo& info,
                                         const std::string& label, const std::filesystem::path& output);
    nlohmann::ordered_json writeCards(float error, BakeInfo info, const std::filesystem::path& path) const;
    nlohmann::ordered_json writeFrames(float error, const std::string& label,
                                       const std::filesystem::path& output) const;
    void writeGlbOf(std::span<const Level> levels, std::uint32_t firstLod, const BakeInfo& info,
                    const std::filesystem::path& path) const;
    void writeTextures(const std::filesystem::path& obj);
    nlohmann::ordered_json writeLevelObj(const Level& level, const BakeInfo& info, const std::filesystem::path& path,
                                         const std::filesystem::path& output);
    nlohmann::ordered_json writePivots(const std::string& label, const std::filesystem::path& output) const;
    nlohmann::ordered_json writeCollision(const Skeleton& skeleton, const std::string& label,
                                          const std::filesystem::path& path);

    BakeChoices choices_;
    const Appearance& appearance_;
    OwnTextures own_;
    std::string path_;
    std::optional<WindPreset> preset_;
    std::vector<EncodedImages> images_;
    std::vector<ImageNames> imageFiles_; ///< Of OBJ: written with the first plant, and used by all.
    DetailScratch scratch_;
    TreeMesh full_; ///< Level 0, where something is compared with it or painted from it and it is no level to write.
    PivotTable pivots_; ///< Of the plant, with --wind pivots.
    PivotTextures pivotTextures_;
    std::uint32_t elements_ = 0; ///< In it.
    Impostor impostor_;
    MaterialTextures atlas_; ///< Of the impostor.
    SilhouetteScratch silhouettes_;
    WindScratch windScratch_;
    CollisionScratch collisionScratch_;
};

} // namespace espalier::tool
