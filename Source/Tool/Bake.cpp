#include "Bake.h"

#include "Input.h"
#include "Pictures.h"
#include "Usage.h"

#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Core/File.h>
#include <Espalier/Render/ImpostorAtlas.h>
#include <Espalier/Texture/AppearanceTextures.h>
#include <algorithm>
#include <array>
#include <limits>
#include <map>

namespace espalier::tool {

namespace {

const std::map<std::string, GltfEncoding> kProfiles{{"portable", GltfEncoding::Portable},
                                                    {"quantized", GltfEncoding::Quantized},
                                                    {"compressed", GltfEncoding::Compressed}};
const std::map<std::string, std::optional<WindPreset>> kWinds{{"none", std::nullopt},
                                                              {"generic", WindPreset::Generic},
                                                              {"crytek", WindPreset::Crytek},
                                                              {"bones", WindPreset::Bones},
                                                              {"pivots", WindPreset::PivotPainter}};

const std::map<std::string, std::optional<ImpostorKind>> kImpostors{
    {"none", std::nullopt}, {"cards", ImpostorKind::Cards}, {"octahedral", ImpostorKind::Octahedral}};

// Of a usual camera: 1080 lines over 60 degrees of height, 1080 / (2 tan 30 degrees).
constexpr double kPixelsAtOneMetre = 935.3074;

/// oak-7.glb of level 2: oak-7-lod2.glb.
std::filesystem::path levelPath(const std::filesystem::path& path, std::uint32_t lod, bool isRange)
{
    if (!isRange)
        return path;
    return path.parent_path() / (path.stem().string() + "-lod" + std::to_string(lod) + path.extension().string());
}

/// oak-7.glb: oak-7-impostor.glb for "-impostor.glb".
std::filesystem::path besidePath(const std::filesystem::path& path, const std::string& ending)
{
    return path.parent_path() / (path.stem().string() + ending);
}

std::vector<EncodedImages> encodeAll(const AppearanceTextures& textures)
{
    std::vector<EncodedImages> images{encode(textures.bark)};
    for (const MaterialTextures& leaf : textures.leaves)
        images.push_back(encode(leaf));
    return images;
}

/// Where a level or an impostor takes over: what a pixel shows there, and how far away that is at a usual camera.
void addTakeover(float error, nlohmann::ordered_json& facts)
{
    facts["error"] = error;
    facts["distance"] = kPixelsAtOneMetre * static_cast<double>(error);
}

nlohmann::ordered_json toJson(const Vec3& v)
{
    return {v.x, v.y, v.z};
}

nlohmann::ordered_json toJson(std::span<const Vec4> table)
{
    nlohmann::ordered_json all = nlohmann::ordered_json::array();
    for (const Vec4& v : table)
        all.push_back({v.x, v.y, v.z, v.w});
    return all;
}

nlohmann::ordered_json toJson(const std::vector<Vec3>& points)
{
    nlohmann::ordered_json all = nlohmann::ordered_json::array();
    for (const Vec3& point : points)
        all.push_back(toJson(point));
    return all;
}

} // namespace

std::pair<std::uint32_t, std::uint32_t> parseLevels(const std::string& text)
{
    const auto [first, last] = parseRange("--lod", text, kMostDetailLevel, "level", "0..4");
    if (last < first)
        failUsage("--lod " + text + ": expected the lower level first");
    return {first, last};
}

void BakeChoices::addTo(CLI::App& verb)
{
    const auto names = [](const auto& all) {
        std::vector<std::string> keys;
        for (const auto& entry : all)
            keys.push_back(entry.first);
        return keys;
    };
    verb.add_option("--lod", levels,
                    "Level of detail: 0 the full plant, N, at most 12, at most 1 / 2^N of its triangles; or a range "
                    "A..B, a file for each (out-lod0.glb ...)")
        ->capture_default_str();
    verb.add_flag("--together", together, "All levels of a range in one file, as MSFT_lod: for engines that know it");
    verb.add_option("--profile", profile,
                    "portable: every reader; quantized: smaller, KHR_mesh_quantization; compressed: smallest, "
                    "EXT_meshopt_compression")
        ->check(CLI::IsMember(names(kProfiles)))
        ->capture_default_str();
    verb.add_option(
            "--textures", textures,
            "Size of the generated textures: bark has as many texels as a square of this side, rounded down to a power "
            "of two, leaves are half as high; an artist's own pictures keep theirs; 0: no textures, colours alone")
        ->check(CLI::Range(0u, kMaxTextureSize))
        ->capture_default_str();
    verb.add_flag("--translucent", translucent,
                  "Leaves let light through in readers that know KHR_materials_diffuse_transmission");
    verb.add_option("--branches", branches,
                    "embed: each branch begins inside its parent; weld: all wood is one closed surface")
        ->check(CLI::IsMember({"embed", "weld"}))
        ->capture_default_str();
    verb.add_option(
            "--wind", wind,
            "Wind data (Source/Espalier/Mesh/WIND.md): generic: further texture coordinates; crytek: vertex "
            "colours; bones: a skin; pivots: tables as of Pivot Painter 2, out-pivots.json and textures for Unreal")
        ->check(CLI::IsMember(names(kWinds)))
        ->capture_default_str();
    verb.add_option("--joints", joints, "Joints of --wind bones, at most")
        ->check(CLI::Range(1u, 65535u))
        ->capture_default_str();
    verb.add_flag("--differences", differences,
                  "Tell of each level what it covers and how far its outline is off, beside the full plant from eight "
                  "sides, in pixels of its error; takes some seconds a level");
    verb.add_option("--impostor", impostor,
                    "Pictures that stand for the plant from afar: cards: four that cross, in out-impostor.glb; "
                    "octahedral: all sides in an atlas for a shader, out-impostor.json "
                    "(Source/Espalier/Mesh/IMPOSTOR.md)")
        ->check(CLI::IsMember(names(kImpostors)))
        ->capture_default_str();
    verb.add_option("--atlas", atlas, "Texels along each side of the impostor's pictures")
        ->check(CLI::Range(64u, 4096u))
        ->capture_default_str();
    verb.add_option("--frames", frames,
                    "Pictures along each side of an octahedral impostor's atlas: more turn with less of a jump, and "
                    "have fewer texels each")
        ->check(CLI::Range(kMinImpostorSide, kMaxImpostorSide))
        ->capture_default_str();
    verb.add_flag("--collision", collision,
                  "Write collision shapes of each plant too, out.collision.json: capsules, convex hull of the crown, "
                  "coarse mesh");
}

void BakeChoices::check(const CLI::App& verb, bool hasLeaves) const
{
    const auto [first, last] = parseLevels(levels);
    checkNeeds(verb, {{"--together", first != last, "a range of levels, such as --lod 0..4"},
                      {"--translucent", hasLeaves, "leaves; expected no --no-leaves"},
                      {"--joints", wind == "bones", "--wind bones"},
                      {"--atlas", impostor != "none", "--impostor cards or octahedral"},
                      {"--frames", impostor == "octahedral", "--impostor octahedral"}});
}

PlantBaker::PlantBaker(const BakeChoices& choices, const Appearance& appearance, OwnTextures own, std::string path)
    : choices_(choices), appearance_(appearance), own_(std::move(own)), path_(std::move(path)),
      preset_(kWinds.at(choices.wind))
{
    if (choices_.textures > 0)
        images_ = encodeAll(makeTextures(
            appearance, {.bark = choices_.textures, .leaf = std::max(choices_.textures / 2, kMinTextureSize)}, 0,
            &own_));
}

MeshSettings PlantBaker::meshSettings() const
{
    MeshSettings settings;
    settings.sources = preset_.has_value();
    if (choices_.branches == "weld")
        settings.tubes.joints = TubeJoints::Weld;
    return settings;
}

/// All levels of a plant; none if there was nothing to draw.
std::vector<PlantBaker::Level> PlantBaker::makeLevels(const Skeleton& skeleton, std::uint32_t first, std::uint32_t last,
                                                      const std::string& label)
{
    std::vector<TreeMesh> meshes(last - first + 1);
    std::vector<DetailLevel> details(meshes.size());
    meshDetailLevels(skeleton, appearance_, first, meshSettings(), Limits{}, scratch_, meshes, details);
    std::vector<Level> levels(meshes.size());
    for (std::size_t i = 0; i < levels.size(); ++i)
    {
        if (!isMeshedOrFail(details[i].result, label, path_))
            return {};
        levels[i].mesh = std::move(meshes[i]);
        levels[i].error = details[i].error;
        if (preset_)
            addWind(skeleton, levels[i]);
    }
    return levels;
}

void PlantBaker::addWind(const Skeleton& skeleton, Level& level)
{
    WindVertices vertices;
    if (!computeWind(skeleton, level.mesh, windScratch_, vertices))
        fail({ErrorKind::BadInput, "its mesh has vertices that belong to no segment", {}, {}, {path_, 0, 0}});
    if (*preset_ == WindPreset::Bones)
        level.skin = windSkin(vertices, choices_.joints);
    else
        fillWindChannels(*preset_, vertices, level.wind);
    if (*preset_ == WindPreset::PivotPainter) // the same of all levels
    {
        pivots_ = pivotTable(vertices);
        pivotTextures_ = orFailIn(path_, encodePivots(pivots_, static_cast<std::uint32_t>(vertices.elements.size())));
        elements_ = static_cast<std::uint32_t>(vertices.elements.size());
    }
}

void PlantBaker::addDifferences(const TreeMesh& full, const Level& level, nlohmann::ordered_json& facts)
{
    const SilhouetteDifference difference =
        compareSilhouettes(full, level.mesh, appearance_.leaves, level.error, silhouettes_);
    facts["coverage"] = difference.coverage;
    facts["outline"] = difference.outline;
}

nlohmann::ordered_json PlantBaker::write(const Skeleton& skeleton, BakeInfo info, const std::string& label,
                                         const std::filesystem::path& output)
{
    const auto [first, last] = parseLevels(choices_.levels);
    const std::optional<ImpostorKind> impostor = kImpostors.at(choices_.impostor);
    const std::vector<Level> levels = makeLevels(skeleton, first, last, label);
    if (levels.empty())
        return {};
    const TreeMesh* full = &levels[0].mesh;
    if (first > 0 && (choices_.differences || impostor))
    {
        (void)isMeshedOrFail(
            meshDetailLevel(skeleton, appearance_, 0, meshSettings(), Limits{}, scratch_, full_).result, label, path_);
        full = &full_;
    }
    if (preset_)
        info.wind = windResponse(skeleton, appearance_.wind);
    nlohmann::ordered_json made = nlohmann::ordered_json::array();
    for (std::uint32_t lod = first; lod <= last; ++lod)
    {
        const Level& level = levels[lod - first];
        const std::filesystem::path path = levelPath(output, lod, first != last && !choices_.together);
        nlohmann::ordered_json facts{{"file", path.string()},
                                     {"segments", skeleton.size()},
                                     {"vertices", level.mesh.positions.size()},
                                     {"triangles", level.mesh.indices.size() / 3}};
        if (lod > 0)
            addTakeover(level.error, facts);
        if (choices_.differences)
            addDifferences(*full, level, facts);
        if (output.extension() == ".obj")
            facts["with"] = writeLevelObj(level, info, path, output);
        else if (!choices_.together)
            writeGlbOf({&level, 1}, lod, info, path);
        made.push_back(std::move(facts));
    }
    if (choices_.together)
    {
        writeGlbOf(levels, first, info, output);
        // One file, one entry, which tells of each level.
        nlohmann::ordered_json file{{"file", output.string()}, {"segments", skeleton.size()}};
        for (nlohmann::ordered_json& level : made)
        {
            level.erase("file");
            level.erase("segments");
        }
        file["levels"] = std::move(made);
        made = nlohmann::ordered_json::array({std::move(file)});
    }
    if (preset_ == WindPreset::PivotPainter)
        made.push_back(writePivots(label, output));
    if (impostor)
        made.push_back(writeImpostor(*impostor, *full, levels.back().error, info, label, output));
    if (choices_.collision)
        made.push_back(
            writeCollision(skeleton, label, std::filesystem::path(output).replace_extension(".collision.json")));
    return made;
}

/// Pictures of the full plant, as cards in a GLB or as an atlas for a shader. Readers of MSFT_lod load coarse levels
/// first, and Babylon.js loses its way where the pictures of a coarse one come after a finer one: so cards have a file
/// of their own whatever the levels have. `coarsest` is the error of the last of these.
nlohmann::ordered_json PlantBaker::writeImpostor(ImpostorKind kind, const TreeMesh& full, float coarsest,
                                                 const BakeInfo& info, const std::string& label,
                                                 const std::filesystem::path& output)
{
    impostor_ = makeImpostor(full, kind, choices_.frames);
    atlas_ = orFail(paintImpostor(subjectOf(full, label), impostor_, {.size = choices_.atlas}, terminalProgress()));
    const float error = std::max(impostorError(impostor_, atlas_.colour.width), coarsest);
    nlohmann::ordered_json facts = kind == ImpostorKind::Cards
                                       ? writeCards(error, info, besidePath(output, "-impostor.glb"))
                                       : writeFrames(error, label, output);
    facts["texels"] = atlas_.colour.width;
    addTakeover(error, facts);
    if (choices_.differences)
        addImpostorDifferences(full, facts);
    return facts;
}

RenderSubject PlantBaker::subjectOf(const TreeMesh& mesh, const std::string& label) const
{
    return {.mesh = &mesh, .appearance = &appearance_, .label = label, .own = &own_};
}

/// What it covers and how bright it is beside the plant: the least and the most of the sides that it was fitted to and
/// of those between.
void PlantBaker::addImpostorDifferences(const TreeMesh& full, nlohmann::ordered_json& facts) const
{
    constexpr float kBetween = static_cast<float>(math::kPi) / 16;
    std::array<float, 2> coverage{std::numeric_limits<float>::max(), 0};
    std::array<float, 2> colour = coverage;
    const auto widen = [](std::array<float, 2>& range, float value) {
        range = {std::min(range[0], value), std::max(range[1], value)};
    };
    for (const float turn : {0.0f, kBetween})
        for (const ImpostorDifference& view : orFail(compareImpostor(subjectOf(full, {}), impostor_, atlas_, turn)))
        {
            widen(coverage, view.coverage);
            for (int c = 0; c < 3; ++c)
                widen(colour, view.colour[c]);
        }
    facts["coverages"] = coverage;
    facts["colours"] = colour;
}

nlohmann::ordered_json PlantBaker::writeCards(float error, BakeInfo info, const std::filesystem::path& path) const
{
    TreeMesh cards;
    meshCards(impostor_, cards);
    info.wind.reset();                                                // they stand still
    std::vector<EncodedImages> images(1 + appearance_.leaves.size()); // none: those of bark and leaves come first
    images.push_back(encode(atlas_));
    BakedLevel level;
    level.mesh = &cards;
    level.lod = parseLevels(choices_.levels).second + 1;
    level.error = error;
    orFail(writeGlb(path, {.levels = {&level, 1}, .images = images, .joints = {}}, appearance_, info,
                    {.encoding = kProfiles.at(choices_.profile)}));
    return {{"file", path.string()}, {"vertices", cards.positions.size()}, {"triangles", cards.indices.size() / 3}};
}

/// The atlas of an octahedral impostor and what a shader needs to know of it.
nlohmann::ordered_json PlantBaker::writeFrames(float error, const std::string& label,
                                               const std::filesystem::path& output) const
{
    const std::filesystem::path path = besidePath(output, "-impostor.json");
    const ImageNames pictures = pictureNames(output.stem().string() + "-impostor");
    const nlohmann::ordered_json document{{"espalier", "impostor"},
                                          {"version", 1},
                                          {"plant", label},
                                          {"side", impostor_.columns},
                                          {"centre", toJson(impostor_.centre)},
                                          {"radius", impostor_.radius},
                                          {"halfExtent", impostor_.frames[0].halfExtent.x},
                                          {"error", error},
                                          {"colour", pictures.colour},
                                          {"normal", pictures.normal},
                                          {"roughness", pictures.roughness}};
    writePictures(output.parent_path(), pictures, encode(atlas_));
    orFail(writeFileAtomically(path, document.dump(1) + "\n"));
    nlohmann::ordered_json with = nlohmann::ordered_json::array();
    for (const std::string& name : namesIn(pictures))
        with.push_back((output.parent_path() / name).string());
    return {{"file", path.string()}, {"frames", impostor_.frames.size()}, {"with", std::move(with)}};
}

void PlantBaker::writeGlbOf(std::span<const Level> levels, std::uint32_t firstLod, const BakeInfo& info,
                            const std::filesystem::path& path) const
{
    std::vector<BakedLevel> baked;
    std::vector<std::vector<std::span<const Vec2>>> uvs(levels.size());
    for (std::size_t i = 0; i < levels.size(); ++i)
    {
        const Level& level = levels[i];
        for (const std::vector<Vec2>& channel : level.wind.texcoords)
            if (!channel.empty())
                uvs[i].emplace_back(channel);
        baked.push_back({.mesh = &level.mesh,
                         .lod = firstLod + static_cast<std::uint32_t>(i),
                         .error = level.error,
                         .colours = level.wind.colours,
                         .furtherUvs = uvs[i],
                         .influences = level.skin.influences});
    }
    const BakeOptions options{.encoding = kProfiles.at(choices_.profile), .translucentLeaves = choices_.translucent};
    orFail(writeGlb(path, {.levels = baked, .images = images_, .joints = levels[0].skin.joints}, appearance_, info,
                    options));
}

/// oak-bark-colour.png and so on beside oak.obj, once for all plants and levels.
void PlantBaker::writeTextures(const std::filesystem::path& obj)
{
    if (!imageFiles_.empty())
        return;
    std::string stem = obj.stem().string();
    std::ranges::replace(stem, ' ', '_'); // many readers split names at blanks
    for (std::size_t i = 0; i < images_.size(); ++i)
    {
        // Numbered like the materials and as everywhere else: leaves 0 are the first kind.
        imageFiles_.push_back(pictureNames(stem + (i == 0 ? "-bark" : "-leaves" + std::to_string(i - 1))));
        writePictures(obj.parent_path(), imageFiles_.back(), images_[i]);
    }
}

/// The files that the OBJ refers to. Its pictures are named after `output`.
nlohmann::ordered_json PlantBaker::writeLevelObj(const Level& level, const BakeInfo& info,
                                                 const std::filesystem::path& path, const std::filesystem::path& output)
{
    writeTextures(output);
    orFail(writeObj(path, level.mesh, appearance_, info, imageFiles_));
    nlohmann::ordered_json with{materialsPath(path).string()};
    for (const ImageNames& names : imageFiles_)
        for (const std::string& name : namesIn(names))
            with.push_back((output.parent_path() / name).string());
    return with;
}

/// The table as numbers for any engine, and as the textures that Unreal's material functions read.
nlohmann::ordered_json PlantBaker::writePivots(const std::string& label, const std::filesystem::path& output) const
{
    const std::filesystem::path path = besidePath(output, "-pivots.json");
    const std::filesystem::path positions = besidePath(output, "-pivots-position.exr");
    const std::filesystem::path directions = besidePath(output, "-pivots-direction.png");
    const auto rows = [&](const std::vector<Vec4>& table) {
        return toJson(std::span(table).first(std::min<std::size_t>(elements_, table.size())));
    };
    const nlohmann::ordered_json document{{"espalier", "pivots"},
                                          {"version", 1},
                                          {"plant", label},
                                          {"side", pivots_.side},
                                          {"pivots", rows(pivots_.pivots)},
                                          {"directions", rows(pivots_.directions)},
                                          {"levels", rows(pivots_.levels)},
                                          {"positionTexture", positions.filename().string()},
                                          {"directionTexture", directions.filename().string()}};
    orFail(writeFileAtomically(positions, pivotTextures_.pivots));
    orFail(writeFileAtomically(directions, pivotTextures_.directions));
    orFail(writeFileAtomically(path, document.dump() + "\n"));
    return {{"file", path.string()}, {"elements", elements_}, {"with", {positions.string(), directions.string()}}};
}

nlohmann::ordered_json PlantBaker::writeCollision(const Skeleton& skeleton, const std::string& label,
                                                  const std::filesystem::path& path)
{
    constexpr std::uint32_t kHullVertices = 64;
    Capsules capsules;
    ConvexHull hull;
    CollisionMesh mesh;
    const auto made = [&](CollisionResult result) {
        if (result == CollisionResult::UnsoundSkeleton)
            fail({ErrorKind::BadInput,
                  label + " gives no collision shape: " + std::string(reasonOf(result)),
                  {},
                  {},
                  {path_, 0, 0}});
        return result == CollisionResult::Ok;
    };
    nlohmann::ordered_json document{{"espalier", "collision"}, {"version", 1}, {"plant", label}};
    if (made(woodCapsules(skeleton, {}, collisionScratch_, capsules)))
    {
        document["gap"] = capsules.gap;
        document["volumeShare"] = capsules.volumeShare;
        document["capsules"] = nlohmann::ordered_json::array();
        for (const Capsule& capsule : capsules.capsules)
            document["capsules"].push_back(
                {{"from", toJson(capsule.from)}, {"to", toJson(capsule.to)}, {"radius", capsule.radius}});
    }
    if (made(crownHull(skeleton, kHullVertices, collisionScratch_, hull)))
        document["hull"] = {
            {"vertices", toJson(hull.vertices)}, {"indices", hull.indices}, {"overreach", hull.overreach}};
    if (made(collisionMesh(skeleton, {}, collisionScratch_, mesh)))
        document["mesh"] = {{"vertices", toJson(mesh.vertices)}, {"indices", mesh.indices}};
    orFail(writeFileAtomically(path, document.dump(1) + "\n"));
    return {{"file", path.string()},
            {"capsules", capsules.capsules.size()},
            {"volumeShare", capsules.volumeShare},
            {"hullVertices", hull.vertices.size()},
            {"collisionTriangles", mesh.indices.size() / 3}};
}

} // namespace espalier::tool
