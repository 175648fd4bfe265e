// The same bits everywhere, of all that a tree in leaf is baked into: its mesh with every stream, welded, and in levels
// of detail; wind data, collision shapes, vertices in engines' formats, textures and files. Trees are cut down, so
// that it takes seconds without optimisation too. Pictures are hashed before they are encoded, and documents without
// versions and without regard to how they are spelled; how EXT_meshopt_compression encodes may change with its library.

#include "GoldenFile.h"

#include <Espalier/Archetype/Archetype.h>
#include <Espalier/Bake/Gltf.h>
#include <Espalier/Core/Hash.h>
#include <Espalier/Inference/Inference.h>
#include <Espalier/Mesh/Collision.h>
#include <Espalier/Mesh/DetailLevel.h>
#include <Espalier/Mesh/VertexLayout.h>
#include <Espalier/Mesh/WindPresets.h>
#include <Espalier/Species/AppearanceFile.h>
#include <Espalier/Species/Grow.h>
#include <Espalier/Texture/AppearanceTextures.h>
#include <Plant/SampleSkeletons.h>
#include <algorithm>
#include <bit>
#include <cstring>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <numeric>

namespace espalier {

namespace {

constexpr std::uint64_t kSeeds = 2;
constexpr std::uint32_t kLevels = 5;
constexpr std::uint32_t kSegments = 300; ///< That are left of a tree: its trunk and lowest boughs.

/// A hash that is fed whatever is to be the same.
class Digest
{
public:
    template <class... Values>
    explicit Digest(const Values&... values)
    {
        (add(values), ...);
    }

    template <class T>
    requires(std::is_arithmetic_v<T>) void add(T value) { hash_.value(value); }
    void add(const std::string& text) { hash_.bytes(text); }
    void add(const Vec2& v) { addAll(v.x, v.y); }
    void add(const Vec3& v) { addAll(v.x, v.y, v.z); }
    void add(const Vec4& v) { addAll(v.x, v.y, v.z, v.w); }
    void add(const Tint& t) { addAll(t.red, t.green, t.blue, t.alpha); }
    void add(std::byte value) { hash_.value(static_cast<std::uint8_t>(value)); }
    void add(const Image& image) { addAll(image.width, image.height, image.channels, image.texels); }
    void add(const MaterialTextures& textures) { addAll(textures.colour, textures.normal, textures.roughness); }
    void add(const Capsule& capsule) { addAll(capsule.from, capsule.to, capsule.radius); }
    void add(const WindElement& e)
    {
        addAll(e.parent, e.segment, e.pivot, e.direction, e.extent, e.radius, e.parentAlong, e.phase, e.level);
    }
    void add(const WindVertex& v)
    {
        addAll(v.trunkBend, v.boughBend, v.twigBend, v.flutter, v.edge, v.along, v.boughPhase, v.twigPhase,
               v.boughPivot, v.twigPivot, v.element, v.leaf, v.level);
    }
    void add(const WindJoint& joint) { addAll(joint.parent, joint.element, joint.position, joint.translation); }
    void add(const WindInfluence& influence) { addAll(influence.joints, influence.weights); }
    template <class T, std::size_t N>
    void add(const std::array<T, N>& all)
    {
        for (const T& value : all)
            add(value);
    }
    template <class T>
    void add(const std::vector<T>& all)
    {
        add(std::uint64_t{all.size()});
        for (const T& value : all)
            add(value);
    }

    [[nodiscard]] std::string text() const { return hexDigits(hash_.result()); }

private:
    template <class... Values>
    void addAll(const Values&... values)
    {
        (add(values), ...);
    }

    Hash64 hash_;
};

/// The bits of a float, and what it is to people.
std::string exactly(float value)
{
    return hexDigits(std::bit_cast<std::uint32_t>(value)).substr(8) + " (" + std::to_string(value) + ")";
}

/// The document and the payload of a GLB file.
std::string digestOf(const Expected<std::string>& glb)
{
    if (!glb)
        return toString(glb.error());
    std::uint32_t length = 0;
    std::memcpy(&length, glb->data() + 12, sizeof length);
    auto document = nlohmann::json::parse(glb->substr(20, length));
    document["asset"].erase("generator");
    const auto forgetVersion = [](auto& node) {
        if (node.contains("extras") && node["extras"].contains("espalier"))
            node["extras"]["espalier"].erase("version");
    };
    for (auto& node : document["nodes"])
        forgetVersion(node);
    return Digest(document.dump(), glb->substr(20 + length)).text();
}

/// One tree in leaf, and all that becomes of it.
class DressedPlant
{
public:
    DressedPlant(const Skeleton& skeleton, const Appearance& appearance, std::string label)
        : skeleton_(skeleton), appearance_(appearance), label_(std::move(label))
    {}

    [[nodiscard]] std::vector<std::string> lines()
    {
        mesh();
        wind();
        layouts();
        collision();
        files();
        return std::move(lines_);
    }

private:
    void say(const std::string& what) { lines_.push_back(label_ + " " + what); }

    void mesh()
    {
        MeshSettings settings{.sources = true};
        for (std::uint32_t lod = 0; lod <= kLevels; ++lod)
        {
            TreeMesh& mesh = levels_.emplace_back();
            const DetailLevel level = meshDetailLevel(skeleton_, appearance_, lod, settings, {}, scratch_, mesh);
            EXPECT_EQ(level.result, MeshResult::Ok);
            errors_.push_back(level.error);
            say("level " + std::to_string(lod) + " error " + exactly(level.error) + " triangles " +
                std::to_string(mesh.indices.size() / 3) + " mesh " + hexDigits(hashOf(mesh)));
        }
        settings.tubes.joints = TubeJoints::Weld;
        for (const std::uint32_t lod : {0u, 2u})
        {
            TreeMesh mesh;
            const DetailLevel level = meshDetailLevel(skeleton_, appearance_, lod, settings, {}, scratch_, mesh);
            EXPECT_EQ(level.result, MeshResult::Ok);
            say("welded level " + std::to_string(lod) + " error " + exactly(level.error) + " mesh " +
                hexDigits(hashOf(mesh)));
        }
    }

    void wind()
    {
        EXPECT_TRUE(computeWind(skeleton_, levels_[0], windScratch_, wind_));
        skin_ = windSkin(wind_);
        WindChannels crytek;
        fillWindChannels(WindPreset::Generic, wind_, channels_);
        fillWindChannels(WindPreset::Crytek, wind_, crytek);
        WindChannels painter;
        fillWindChannels(WindPreset::PivotPainter, wind_, painter);
        const PivotTable table = pivotTable(wind_);
        say("wind " + Digest(wind_.elements, wind_.vertices).text() + " generic " +
            Digest(channels_.texcoords, channels_.colours).text() + " crytek " +
            Digest(crytek.texcoords, crytek.colours).text());
        say("wind pivots " +
            Digest(painter.texcoords, painter.colours, table.side, table.pivots, table.directions, table.levels)
                .text() +
            " bones " + Digest(skin_.joints, skin_.influences).text());
        const WindResponse response = windResponse(skeleton_, appearance_.wind);
        say("wind blown " + hexDigits(hashOf(blownBy(levels_[0], wind_, {.speed = 9, .time = 3.5f}, response))));
    }

    void layouts()
    {
        using enum VertexSemantic;
        using enum VertexFormat;
        constexpr VertexAttributeFormat kWide[] = {{Position, Float32x3, 0},
                                                   {Normal, Float32x3, 12},
                                                   {Tangent, Float32x4, 24},
                                                   {TextureCoordinate, Float32x2, 40},
                                                   {Colour, Unorm8x4, 48}};
        constexpr VertexAttributeFormat kNarrow[] = {{Position, Snorm16x4, 0},
                                                     {Normal, OctahedralSnorm16x2, 8},
                                                     {Tangent, Snorm8x4, 12},
                                                     {TextureCoordinate, Float16x2, 16},
                                                     {Colour, Float16x4, 20}};
        constexpr VertexAttributeFormat kHalves[] = {
            {Position, Float16x4, 0}, {Normal, Snorm16x4, 8}, {Tangent, Unorm8x4, 16}};
        const TreeMesh& mesh = levels_[0];
        const PositionFit fit = fitPositions(mesh);
        const auto written = [&](const VertexLayout& layout) {
            std::vector<std::byte> bytes(bytesOf(mesh, layout));
            EXPECT_EQ(writeVertices(mesh, layout, bytes), VertexResult::Ok);
            return Digest(bytes).text();
        };
        const std::string wide = written({.stride = 52, .attributes = kWide});
        const std::string narrow =
            written({.stride = 28, .attributes = kNarrow, .positionCentre = fit.centre, .positionScale = fit.scale});
        const std::string halves =
            written({.stride = 20, .attributes = kHalves, .textureOrigin = TextureOrigin::BottomLeft});
        say("vertices wide " + wide + " narrow " + narrow + " halves " + halves);
    }

    void collision()
    {
        CollisionScratch scratch;
        Capsules capsules;
        ConvexHull hull;
        CollisionMesh mesh;
        EXPECT_EQ(woodCapsules(skeleton_, {}, scratch, capsules), CollisionResult::Ok);
        EXPECT_EQ(crownHull(skeleton_, 64, scratch, hull), CollisionResult::Ok);
        EXPECT_EQ(collisionMesh(skeleton_, {}, scratch, mesh), CollisionResult::Ok);
        say("capsules " + Digest(capsules.capsules, capsules.gap, capsules.volumeShare).text() + " hull " +
            Digest(hull.vertices, hull.indices, hull.tolerance, hull.overreach).text() + " collision mesh " +
            Digest(mesh.vertices, mesh.indices, mesh.axes).text());
    }

    void files()
    {
        BakeInfo info{.speciesName = "golden", .seed = Seed{7}, .wind = windResponse(skeleton_, appearance_.wind)};
        std::vector<std::span<const Vec2>> uvs;
        for (const std::vector<Vec2>& channel : channels_.texcoords)
            if (!channel.empty())
                uvs.emplace_back(channel);
        const BakedLevel moving{.mesh = &levels_[0], .colours = {}, .furtherUvs = uvs, .influences = {}};
        const BakedLevel boned{.mesh = &levels_[0], .colours = {}, .furtherUvs = {}, .influences = skin_.influences};
        const auto baked = [&](std::span<const BakedLevel> levels, std::span<const WindJoint> joints,
                               const BakeOptions& options) {
            return digestOf(bakeGlb({.levels = levels, .images = {}, .joints = joints}, appearance_, info, options));
        };
        say("portable " + baked({&moving, 1}, {}, {GltfEncoding::Portable, true}) + " quantized " +
            baked({&moving, 1}, {}, {GltfEncoding::Quantized, true}) + " compressed " +
            baked({&moving, 1}, {}, {GltfEncoding::Compressed, true}));
        say("boned portable " + baked({&boned, 1}, skin_.joints, {GltfEncoding::Portable}) + " quantized " +
            baked({&boned, 1}, skin_.joints, {GltfEncoding::Quantized}) + " compressed " +
            baked({&boned, 1}, skin_.joints, {GltfEncoding::Compressed}));
        std::vector<BakedLevel> together;
        for (std::uint32_t lod = 0; lod < levels_.size(); ++lod)
        {
            BakedLevel& level = together.emplace_back();
            level.mesh = &levels_[lod];
            level.lod = lod;
            level.error = errors_[lod];
        }
        info.wind = {};
        say("levels together portable " + baked(together, {}, {GltfEncoding::Portable}) + " quantized " +
            baked(together, {}, {GltfEncoding::Quantized}) + " compressed " +
            baked(together, {}, {GltfEncoding::Compressed}));
    }

    const Skeleton& skeleton_;
    const Appearance& appearance_;
    std::string label_;
    std::vector<std::string> lines_;
    DetailScratch scratch_;
    WindScratch windScratch_;
    std::vector<TreeMesh> levels_;
    std::vector<float> errors_;
    WindVertices wind_;
    WindChannels channels_;
    WindSkin skin_;
};

Expected<std::vector<std::string>> reproduce(const std::string& name)
{
    const std::filesystem::path data = golden::kFolder / "Data";
    const auto archetype = loadArchetype(data / (name + ".archetype"));
    if (!archetype)
        return tl::make_unexpected(archetype.error());
    // Weights are given, so that none is chosen by trials.
    auto species = inferSpecies({&*archetype, 1}, {.mergeWeight = 0.5, .ruleWeight = 0.5, .name = name});
    if (!species)
        return tl::make_unexpected(species.error());
    auto look = loadAppearance(data / (name + ".appearance"));
    if (!look)
        return tl::make_unexpected(look.error());
    look->pipes = species->appearance.pipes;
    species->appearance = *look;
    const auto grower = Grower::make(*species);
    if (!grower)
        return tl::make_unexpected(grower.error());

    std::vector<std::string> lines{"species " + hexDigits(hashOf(*species))};
    const AppearanceTextures textures = makeTextures(species->appearance, {.bark = 32, .leaf = 32});
    lines.push_back("textures bark " + Digest(textures.bark).text() + " leaves " + Digest(textures.leaves).text());
    GrowScratch scratch;
    Skeleton skeleton;
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed)
    {
        if (auto done = grower->grow(Seed{seed}, {}, scratch, skeleton); !done)
            return tl::make_unexpected(done.error());
        std::vector<std::uint32_t> lowest(std::min(skeleton.size(), kSegments));
        std::iota(lowest.begin(), lowest.end(), 0u);
        skeleton = samples::renumbered(skeleton, lowest);
        completeAxes(skeleton, suggestPipes(skeleton)); // thin wood, which bears leaves
        const std::string label = "seed " + std::to_string(seed);
        lines.push_back(label + " segments " + std::to_string(skeleton.size()) + " skeleton " +
                        hexDigits(hashOf(skeleton)));
        for (std::string& line : DressedPlant(skeleton, species->appearance, label).lines())
            lines.push_back(std::move(line));
    }
    return lines;
}

} // namespace

class Dressed : public testing::TestWithParam<const char*>
{};

TEST_P(Dressed, ReproducesItsFile)
{
    const std::string name = GetParam();
    const auto lines = reproduce(name);
    ASSERT_TRUE(lines) << toString(lines.error());
    golden::expectFile(
        name + "Dressed",
        name + ".archetype in leaf as " + name +
            ".appearance says: hashes of the lowest boughs of trees and of all that they are baked into.",
        *lines);
}

INSTANTIATE_TEST_SUITE_P(Species, Dressed, testing::Values("Oak", "Birch", "Spruce", "Palm", "Willow"),
                         [](const testing::TestParamInfo<const char*>& name) { return std::string(name.param); });

} // namespace espalier
