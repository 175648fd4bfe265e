#include <Espalier/Bake/Gltf.h>

#include <Espalier/Core/File.h>
#include <Espalier/Mesh/WindPresets.h>
#include <Espalier/Species/Appearance.h>
#include <Render/HandMadeMesh.h>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <functional>
#include <gtest/gtest.h>
#include <limits>
#include <meshoptimizer.h>
#include <nlohmann/json.hpp>

namespace espalier {

namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr float kInfinity = std::numeric_limits<float>::infinity();

const BakeInfo kOak{.speciesName = "Oak", .speciesHash = 0x00c0ffee12345678u, .seed = Seed{18446744073709551615u}};

struct Case
{
    const char* name;
    std::function<void(TreeMesh&, Appearance&, BakeInfo&)> spoil;
};

std::uint32_t wordAt(const std::string& bytes, std::size_t offset)
{
    std::uint32_t word = 0;
    std::memcpy(&word, bytes.data() + offset, sizeof(word));
    return word;
}

std::string documentOf(const std::string& glb)
{
    return glb.substr(20, wordAt(glb, 12));
}

std::string payloadOf(const std::string& glb)
{
    const std::size_t chunk = 20 + wordAt(glb, 12);
    return glb.substr(chunk + 8, wordAt(glb, chunk));
}

template <class T, class Allocator>
std::string bytesOf(const std::vector<T, Allocator>& values)
{
    return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

bool contains(const std::string& text, const std::string& part)
{
    return text.find(part) != std::string::npos;
}

/// What a reader of the file sees: the document, and what its accessors hold.
struct Glb
{
    nlohmann::json document;
    std::string payload;

    explicit Glb(const Expected<std::string>& bytes)
    {
        EXPECT_TRUE(bytes) << (bytes ? "" : toString(bytes.error()));
        if (!bytes)
            return;
        document = nlohmann::json::parse(documentOf(*bytes));
        payload = payloadOf(*bytes);
    }

    /// The bytes of a buffer view, decompressed.
    [[nodiscard]] std::string view(std::size_t index) const
    {
        const auto& entry = document["bufferViews"][index];
        if (!entry.contains("extensions"))
            return payload.substr(entry.value("byteOffset", std::size_t{0}), entry["byteLength"]);
        const auto& packed = entry["extensions"]["EXT_meshopt_compression"];
        const std::string in = payload.substr(packed["byteOffset"], packed["byteLength"]);
        const auto* const from = reinterpret_cast<const unsigned char*>(in.data());
        const std::size_t count = packed["count"];
        const std::size_t stride = packed["byteStride"];
        std::string out(count * stride, '\0');
        const int failed = packed["mode"] == "TRIANGLES"
                               ? meshopt_decodeIndexBuffer(out.data(), count, stride, from, in.size())
                               : meshopt_decodeVertexBuffer(out.data(), count, stride, from, in.size());
        EXPECT_EQ(failed, 0);
        if (packed.value("filter", "NONE") == "EXPONENTIAL")
            meshopt_decodeFilterExp(out.data(), count, stride);
        return out;
    }

    /// An accessor's elements, `kSize` numbers each, as a reader has them.
    template <class Stored, std::size_t kSize>
    [[nodiscard]] std::vector<std::array<double, kSize>> read(const nlohmann::json& number) const
    {
        const auto& accessor = document["accessors"][number.get<std::size_t>()];
        const std::size_t viewIndex = accessor["bufferView"];
        const std::string bytes = view(viewIndex);
        const std::size_t stride = document["bufferViews"][viewIndex].value("byteStride", kSize * sizeof(Stored));
        const bool isNormalized = accessor.value("normalized", false);
        std::vector<std::array<double, kSize>> result(accessor["count"].get<std::size_t>());
        for (std::size_t i = 0; i < result.size(); ++i)
            for (std::size_t k = 0; k < kSize; ++k)
            {
                Stored value{};
                std::memcpy(&value,
                            bytes.data() + accessor.value("byteOffset", std::size_t{0}) + i * stride +
                                k * sizeof(Stored),
                            sizeof value);
                result[i][k] = static_cast<double>(value);
                if (isNormalized)
                    result[i][k] = std::max(result[i][k] / double(std::numeric_limits<Stored>::max()), -1.0);
            }
        return result;
    }

    [[nodiscard]] const nlohmann::json& attribute(const char* semantic, std::size_t mesh = 0) const
    {
        return document["meshes"][mesh]["primitives"][0]["attributes"][semantic];
    }
};

double degreesBetween(const std::array<double, 3>& a, const Vec3& b)
{
    const double cross[] = {a[1] * b.z - a[2] * b.y, a[2] * b.x - a[0] * b.z, a[0] * b.y - a[1] * b.x};
    return std::atan2(std::hypot(cross[0], cross[1], cross[2]), a[0] * b.x + a[1] * b.y + a[2] * b.z) * 180 / math::kPi;
}

const std::string kPng = "\x89PNG\r\n\x1a\n";

/// A tube of bark with a part of leaves of kind 1, half of it.
TreeMesh leafy()
{
    TreeMesh mesh = handMade({.sides = 6});
    mesh.parts = {{MeshMaterial::Bark, 0, 18}, {MeshMaterial::Leaves, 18, 18, 1}};
    return mesh;
}

Appearance twoKinds()
{
    Appearance appearance;
    appearance.leaves.resize(2);
    appearance.leaves[1].colour = {0.25f, 0.5f, 0.125f};
    appearance.leaves[1].roughness = 0.75f;
    appearance.leaves[1].translucency = 0.5f;
    return appearance;
}

/// All of joint 0.
constexpr WindInfluence kWhole{{}, {255, 0, 0, 0}};

constexpr GltfEncoding kEncodings[] = {GltfEncoding::Portable, GltfEncoding::Quantized, GltfEncoding::Compressed};

} // namespace

TEST(Gltf, RefusesWhatCannotBeBaked)
{
    const Case cases[] = {
        {"no vertices", [](auto& mesh, auto&, auto&) { mesh.clear(); }},
        {"no triangles", [](auto& mesh, auto&, auto&) { mesh.indices.clear(), mesh.parts.clear(); }},
        {"NaN position", [](auto& mesh, auto&, auto&) { mesh.positions[3].y = kNaN; }},
        {"infinite uv", [](auto& mesh, auto&, auto&) { mesh.uvs[3].x = kInfinity; }},
        {"zero normal", [](auto& mesh, auto&, auto&) { mesh.normals[0] = Vec3(0); }},
        {"NaN normal", [](auto& mesh, auto&, auto&) { mesh.normals[0].x = kNaN; }},
        {"long tangent", [](auto& mesh, auto&, auto&) { mesh.tangents[0].x = 2; }},
        {"tangent without hand", [](auto& mesh, auto&, auto&) { mesh.tangents[0].w = 0; }},
        {"missing normal", [](auto& mesh, auto&, auto&) { mesh.normals.pop_back(); }},
        {"missing tangent", [](auto& mesh, auto&, auto&) { mesh.tangents.pop_back(); }},
        {"missing uv", [](auto& mesh, auto&, auto&) { mesh.uvs.pop_back(); }},
        {"index out of range", [](auto& mesh, auto&, auto&) { mesh.indices[5] = 1000; }},
        {"no part", [](auto& mesh, auto&, auto&) { mesh.parts.clear(); }},
        {"part too short", [](auto& mesh, auto&, auto&) { mesh.parts[0].indexCount -= 3; }},
        {"part too long", [](auto& mesh, auto&, auto&) { mesh.parts[0].indexCount += 3; }},
        {"part starts late", [](auto& mesh, auto&, auto&) { mesh.parts[0].firstIndex = 3; }},
        {"half a triangle", [](auto& mesh, auto&, auto&) { mesh.indices.pop_back(), --mesh.parts[0].indexCount; }},
        {"NaN colour", [](auto&, auto& appearance, auto&) { appearance.bark.colour.z = kNaN; }},
        {"NaN roughness", [](auto&, auto& appearance, auto&) { appearance.bark.roughness = kNaN; }},
        {"NaN in the palette", [](auto&, auto& appearance, auto&) { appearance.palette[3].x = kNaN; }},
        {"name not UTF-8", [](auto&, auto&, auto& info) { info.speciesName = "O\xc3k"; }},
        {"endless name", [](auto&, auto&, auto& info) { info.speciesName.assign(10000, 'o'); }},
    };
    for (const Case& spoilt : cases)
    {
        TreeMesh mesh = handMade({});
        Appearance appearance;
        BakeInfo info = kOak;
        spoilt.spoil(mesh, appearance, info);
        const auto glb = bakeGlb(mesh, appearance, info);
        ASSERT_FALSE(glb) << spoilt.name;
        EXPECT_EQ(glb.error().kind, ErrorKind::BadInput) << spoilt.name;
        EXPECT_FALSE(glb.error().what.empty()) << spoilt.name;
    }
}

TEST(Gltf, IsAGlbOfTwoAlignedChunks)
{
    for (std::uint32_t sides = 3; sides < 12; ++sides) // odd counts of 16-bit indices need padding
    {
        const auto glb = bakeGlb(handMade({.sides = sides}), {}, kOak);
        ASSERT_TRUE(glb) << toString(glb.error());
        EXPECT_EQ(glb->substr(0, 4), "glTF");
        EXPECT_EQ(wordAt(*glb, 4), 2u);
        EXPECT_EQ(wordAt(*glb, 8), glb->size());
        const std::size_t binary = 20 + wordAt(*glb, 12);
        EXPECT_EQ(binary % 4, 0u);
        EXPECT_EQ(glb->substr(16, 4), "JSON");
        EXPECT_EQ(glb->substr(binary + 4, 4), std::string_view("BIN\0", 4));
        EXPECT_EQ(binary + 8 + wordAt(*glb, binary), glb->size());
        EXPECT_EQ(glb->size() % 4, 0u);
    }
}

TEST(Gltf, HoldsTheArraysOfTheMesh)
{
    const TreeMesh mesh = handMade({.sides = 5});
    const auto glb = bakeGlb(mesh, {}, kOak);
    ASSERT_TRUE(glb);
    RawVector<Vec2> fromTop = mesh.uvs;
    for (Vec2& uv : fromTop)
        uv.y = 1 - uv.y;
    const std::vector<std::uint16_t> shorts(mesh.indices.begin(), mesh.indices.end());
    const std::string expected =
        bytesOf(mesh.positions) + bytesOf(mesh.normals) + bytesOf(mesh.tangents) + bytesOf(fromTop) + bytesOf(shorts);
    EXPECT_EQ(payloadOf(*glb).substr(0, expected.size()), expected);
    EXPECT_LT(payloadOf(*glb).size() - expected.size(), 4u);
}

TEST(Gltf, SaysWhereTheTreeComesFrom)
{
    const auto glb = bakeGlb(handMade({}), {}, kOak);
    ASSERT_TRUE(glb);
    const std::string document = documentOf(*glb);
    EXPECT_TRUE(contains(document, R"("generator":"Espalier )")) << document;
    EXPECT_TRUE(contains(document, R"("speciesHash":"00c0ffee12345678")")) << document;
    EXPECT_TRUE(contains(document, R"("seed":"18446744073709551615")")) << document;
    EXPECT_TRUE(contains(document, R"("species":"Oak")")) << document;
    EXPECT_TRUE(contains(document, R"("version":"0.)")) << document;
    EXPECT_FALSE(contains(document, "extensionsRequired")) << document;
}

TEST(Gltf, GivesANamelessSpeciesAName)
{
    const auto glb = bakeGlb(handMade({}), {}, {});
    ASSERT_TRUE(glb);
    EXPECT_TRUE(contains(documentOf(*glb), R"("name":"tree")"));
}

TEST(Gltf, PassesAnyUtf8Name)
{
    BakeInfo info = kOak;
    info.speciesName = "Bäume \"\\\n\x01 木";
    EXPECT_TRUE(bakeGlb(handMade({}), {}, info));
}

TEST(Gltf, NeedsLongIndicesOnlyAbove65535Vertices)
{
    // (sides + 1) * rings vertices; index 65535 would be the restart value.
    for (const HandMadeTube& tube : {HandMadeTube{.sides = 13, .rings = 4681}, HandMadeTube{.sides = 4, .rings = 13107},
                                     HandMadeTube{.sides = 3, .rings = 16384}})
    {
        const TreeMesh mesh = handMade(tube);
        for (const GltfEncoding encoding : kEncodings)
        {
            const Glb glb(bakeGlb(mesh, {}, kOak, {encoding}));
            const auto& indices = glb.document["meshes"][0]["primitives"][0]["indices"];
            const bool isShort = tube.rings != 16384;
            ASSERT_EQ(mesh.positions.size(), tube.rings == 4681 ? 65534u : isShort ? 65535u : 65536u);
            EXPECT_EQ(glb.document["accessors"][indices.get<std::size_t>()]["componentType"], isShort ? 5123 : 5125);
            const auto read = isShort ? glb.read<std::uint16_t, 1>(indices) : glb.read<std::uint32_t, 1>(indices);
            ASSERT_EQ(read.size(), mesh.indices.size());
            double highest = 0;
            for (const auto& index : read)
                highest = std::max(highest, index[0]);
            EXPECT_EQ(highest, double(mesh.positions.size()) - 1);
        }
    }
}

TEST(Gltf, MakesOnePrimitiveAPartAndSkipsEmptyOnes)
{
    TreeMesh mesh = handMade({.sides = 5});
    mesh.parts = {{MeshMaterial::Bark, 0, 9}, {MeshMaterial::Bark, 9, 0}, {MeshMaterial::Bark, 9, 21}};
    const auto glb = bakeGlb(mesh, {}, kOak);
    ASSERT_TRUE(glb);
    const std::string document = documentOf(*glb);
    std::size_t primitives = 0;
    for (std::size_t at = document.find("\"indices\""); at != std::string::npos;
         at = document.find("\"indices\"", at + 1))
        ++primitives;
    EXPECT_EQ(primitives, 2u);
    EXPECT_TRUE(contains(document, R"("byteOffset":18)")) << document;
}

TEST(Gltf, GivesEachKindAndColourOneMaterial)
{
    TreeMesh mesh = handMade({.sides = 5});
    mesh.parts = {{MeshMaterial::Bark, 0, 6},
                  {MeshMaterial::Bark, 6, 6, 2},
                  {MeshMaterial::Surface, 12, 6, 0},
                  {MeshMaterial::Surface, 18, 6, 2},
                  {MeshMaterial::Surface, 24, 6, 0}};
    Appearance appearance;
    appearance.bark.colour = {0.5f, 0.25f, 0};
    appearance.palette = {{0, 1, 0}, {1, 1, 1}, {1, 0, 0}};
    const auto glb = bakeGlb(mesh, appearance, kOak);
    ASSERT_TRUE(glb) << toString(glb.error());
    const auto document = nlohmann::json::parse(documentOf(*glb));
    struct Expected
    {
        const char* name;
        std::vector<double> colour;
        bool isDoubleSided;
    };
    const Expected expected[] = {{"Oak bark", {0.5, 0.25, 0, 1}, false},
                                 {"Oak wood 2", {1, 0, 0, 1}, false},
                                 {"Oak surface 0", {0, 1, 0, 1}, true},
                                 {"Oak surface 2", {1, 0, 0, 1}, true}};
    ASSERT_EQ(document["materials"].size(), 4u);
    for (std::size_t i = 0; i < 4; ++i)
    {
        const auto& material = document["materials"][i];
        EXPECT_EQ(material["name"], expected[i].name);
        EXPECT_EQ(material["pbrMetallicRoughness"].value("baseColorFactor", std::vector<double>{1, 1, 1, 1}),
                  expected[i].colour);
        EXPECT_EQ(material.value("doubleSided", false), expected[i].isDoubleSided);
        EXPECT_EQ(material.value("alphaMode", "OPAQUE"), "OPAQUE");
    }
    const auto& primitives = document["meshes"][0]["primitives"];
    ASSERT_EQ(primitives.size(), 5u);
    const int materials[] = {0, 1, 2, 3, 2};
    for (std::size_t i = 0; i < 5; ++i)
        EXPECT_EQ(primitives[i]["material"], materials[i]);
}

TEST(Gltf, NamesNoBarkWhereThereIsNone)
{
    TreeMesh mesh = handMade({.sides = 5});
    mesh.parts[0].material = MeshMaterial::Surface;
    const auto glb = bakeGlb(mesh, {}, kOak);
    ASSERT_TRUE(glb);
    EXPECT_FALSE(contains(documentOf(*glb), "Oak bark")) << documentOf(*glb);
}

TEST(Gltf, ClampsColoursThatGltfDoesNotAllow)
{
    Appearance appearance;
    appearance.bark.colour = {-1, 0.5f, 7};
    appearance.bark.roughness = 3;
    const auto glb = bakeGlb(handMade({}), appearance, kOak);
    ASSERT_TRUE(glb);
    EXPECT_TRUE(contains(documentOf(*glb), R"("baseColorFactor":[0.0,0.5,1.0,1.0])")) << documentOf(*glb);
}

TEST(Gltf, EqualInputGivesEqualBytes)
{
    const auto first = bakeGlb(handMade({.sides = 9, .rings = 40}), {}, kOak);
    const auto second = bakeGlb(handMade({.sides = 9, .rings = 40}), {}, kOak);
    ASSERT_TRUE(first);
    EXPECT_EQ(*first, *second);
}

TEST(Gltf, LeavesAreCutOutAndSeenFromBothSides)
{
    const Glb glb(bakeGlb(leafy(), twoKinds(), kOak));
    const auto& leaves = glb.document["materials"][1];
    EXPECT_EQ(leaves["name"], "Oak leaves 1");
    EXPECT_EQ(leaves["alphaMode"], "MASK");
    EXPECT_EQ(leaves.value("alphaCutoff", 0.5), 0.5);
    EXPECT_EQ(leaves["doubleSided"], true);
    EXPECT_EQ(leaves["pbrMetallicRoughness"]["roughnessFactor"], 0.75);
    EXPECT_EQ(leaves["pbrMetallicRoughness"]["baseColorFactor"], (std::vector<double>{0.25, 0.5, 0.125, 1}));
    EXPECT_FALSE(glb.document.contains("extensionsUsed"));
    EXPECT_FALSE(leaves.contains("extensions"));
}

TEST(Gltf, TintsAreVertexColours)
{
    TreeMesh mesh = leafy();
    mesh.tints.assign(mesh.positions.size(), Tint{10, 20, 30, 255});
    const Glb glb(bakeGlb(mesh, twoKinds(), kOak));
    const auto& accessor = glb.document["accessors"][glb.attribute("COLOR_0").get<std::size_t>()];
    EXPECT_EQ(accessor["componentType"], 5121);
    EXPECT_EQ(accessor["normalized"], true);
    EXPECT_EQ(accessor["type"], "VEC4");
    for (const auto& colour : glb.read<std::uint8_t, 4>(glb.attribute("COLOR_0")))
        EXPECT_EQ(colour, (std::array<double, 4>{10 / 255.0, 20 / 255.0, 30 / 255.0, 1}));

    const std::vector<Tint> others(mesh.positions.size(), Tint{1, 2, 3, 255});
    BakedLevel level;
    level.mesh = &mesh;
    level.colours = others;
    const Glb coloured(bakeGlb(BakedTree{{&level, 1}, {}, {}}, twoKinds(), kOak));
    EXPECT_EQ((coloured.read<std::uint8_t, 4>(coloured.attribute("COLOR_0"))[0][2]), 3 / 255.0);
}

TEST(Gltf, MaterialsShowTheirImages)
{
    const std::vector<EncodedImages> images{
        {kPng + "bark", kPng + "relief", kPng + "rough"}, {kPng + "unused", {}, {}}, {kPng + "leaf", {}, {}}};
    const TreeMesh mesh = leafy();
    BakedLevel level;
    level.mesh = &mesh;
    for (const GltfEncoding encoding : kEncodings)
    {
        const Glb glb(
            bakeGlb(BakedTree{{&level, 1}, images, {}}, twoKinds(), kOak, {encoding, /*translucentLeaves*/ true}));
        const auto& bark = glb.document["materials"][0];
        const auto& leaves = glb.document["materials"][1];
        const auto imageOf = [&](const nlohmann::json& info) {
            const auto& texture = glb.document["textures"][info["index"].get<std::size_t>()];
            const auto& image = glb.document["images"][texture["source"].get<std::size_t>()];
            EXPECT_EQ(image["mimeType"], "image/png");
            EXPECT_FALSE(image.contains("uri"));
            return glb.view(image["bufferView"]).substr(kPng.size());
        };
        const auto wrapOf = [&](const nlohmann::json& info) {
            const auto& texture = glb.document["textures"][info["index"].get<std::size_t>()];
            const auto& sampler = glb.document["samplers"][texture["sampler"].get<std::size_t>()];
            EXPECT_EQ(sampler["minFilter"], 9987) << "trilinear";
            return sampler.value("wrapS", 10497);
        };
        const auto& surface = bark["pbrMetallicRoughness"];
        EXPECT_EQ(imageOf(surface["baseColorTexture"]), "bark");
        EXPECT_EQ(wrapOf(surface["baseColorTexture"]), 10497) << "repeats";
        EXPECT_EQ(imageOf(bark["normalTexture"]), "relief");
        EXPECT_EQ(imageOf(surface["metallicRoughnessTexture"]), "rough");
        EXPECT_EQ(imageOf(bark["occlusionTexture"]), "rough");
        EXPECT_EQ(surface.value("baseColorFactor", std::vector<double>(4, 1)), std::vector<double>(4, 1));
        EXPECT_EQ(surface.value("roughnessFactor", 1.0), 1);
        EXPECT_EQ(imageOf(leaves["pbrMetallicRoughness"]["baseColorTexture"]), "leaf");
        EXPECT_EQ(wrapOf(leaves["pbrMetallicRoughness"]["baseColorTexture"]), 33071) << "ends at its edge";
        EXPECT_EQ(leaves["pbrMetallicRoughness"]["roughnessFactor"], 0.75) << "no image of it";
        EXPECT_EQ(glb.document["images"].size(), 4u) << "each once, those of no material not at all";
        EXPECT_EQ(glb.document["images"][0]["name"], "Oak bark colour");
        const auto& light = leaves["extensions"]["KHR_materials_diffuse_transmission"];
        EXPECT_EQ(imageOf(light["diffuseTransmissionColorTexture"]), "leaf");
    }
}

TEST(Gltf, WoodOfAColourHasTheReliefOfBarkAlone)
{
    const std::vector<EncodedImages> images{{kPng + "bark", kPng + "relief", {}}};
    TreeMesh mesh = leafy();
    mesh.parts = {{MeshMaterial::Bark, 0, 18, 2}, {MeshMaterial::Surface, 18, 18, 1}};
    BakedLevel level;
    level.mesh = &mesh;
    const Glb glb(bakeGlb(BakedTree{{&level, 1}, images, {}}, {}, kOak));
    EXPECT_FALSE(glb.document["materials"][0]["pbrMetallicRoughness"].contains("baseColorTexture"));
    EXPECT_TRUE(glb.document["materials"][0].contains("normalTexture"));
    EXPECT_FALSE(glb.document["materials"][1].contains("normalTexture"));
}

TEST(Gltf, LightThroughLeavesIsAnExtensionThatNobodyNeeds)
{
    const Glb glb(bakeGlb(leafy(), twoKinds(), kOak, {GltfEncoding::Portable, /*translucentLeaves*/ true}));
    EXPECT_EQ(glb.document["extensionsUsed"], (std::vector<std::string>{"KHR_materials_diffuse_transmission"}));
    EXPECT_FALSE(glb.document.contains("extensionsRequired"));
    const auto& light = glb.document["materials"][1]["extensions"]["KHR_materials_diffuse_transmission"];
    EXPECT_EQ(light["diffuseTransmissionFactor"], 0.5);
    EXPECT_EQ(light["diffuseTransmissionColorFactor"], (std::vector<double>{0.25, 0.5, 0.125}));
    EXPECT_FALSE(glb.document["materials"][0].contains("extensions"));
}

TEST(Gltf, LevelsOfDetailHangOnTheFinest)
{
    const TreeMesh meshes[] = {handMade({.sides = 12}), handMade({.sides = 6}), handMade({.sides = 3})};
    BakedLevel levels[3];
    for (std::uint32_t i = 0; i < 3; ++i)
    {
        levels[i].mesh = &meshes[i];
        levels[i].lod = 2 * i;
        levels[i].error = 0.013f * static_cast<float>(i);
    }
    for (const GltfEncoding encoding : kEncodings)
    {
        const bool isScaled = encoding != GltfEncoding::Portable;
        const Glb glb(bakeGlb(BakedTree{levels, {}, {}}, {}, kOak, {encoding}));
        const auto& nodes = glb.document["nodes"];
        ASSERT_EQ(nodes.size(), isScaled ? 4u : 3u);
        EXPECT_EQ(glb.document["scenes"][0]["nodes"], std::vector<int>{0});
        const std::size_t first = isScaled ? 1 : 0;
        EXPECT_EQ(nodes[first]["extensions"]["MSFT_lod"]["ids"], (std::vector<std::size_t>{first + 1, first + 2}));
        EXPECT_EQ(nodes[0]["extras"]["espalier"]["lod"], 0);
        EXPECT_EQ(nodes[first + 2]["extras"]["espalier"]["lod"], 4);
        EXPECT_EQ(nodes[first + 1]["extras"]["espalier"]["error"], 0.013) << "as short as the float";
        const std::vector<double> coverage = nodes[first]["extras"]["MSFT_screencoverage"];
        ASSERT_EQ(coverage.size(), 3u);
        EXPECT_GT(coverage[0], coverage[1]);
        EXPECT_EQ(coverage[2], 0);
        EXPECT_NE(std::ranges::find(glb.document["extensionsUsed"], "MSFT_lod"), glb.document["extensionsUsed"].end());
        for (std::size_t i = 0; i < 3; ++i)
        {
            EXPECT_EQ(nodes[first + i]["mesh"], i);
            EXPECT_EQ(nodes[first + i].contains("scale"), isScaled);
            const auto& indices = glb.document["meshes"][i]["primitives"][0]["indices"];
            EXPECT_EQ((glb.read<std::uint16_t, 1>(indices).size()), meshes[i].indices.size());
        }
    }
}

TEST(Gltf, ALevelInAFileOfItsOwnSaysWhichItIs)
{
    const TreeMesh mesh = handMade({});
    BakedLevel level;
    level.mesh = &mesh;
    level.lod = 3;
    level.error = 0.25f;
    const Glb glb(bakeGlb(BakedTree{{&level, 1}, {}, {}}, {}, kOak));
    EXPECT_EQ(glb.document["nodes"][0]["extras"]["espalier"]["lod"], 3);
    EXPECT_EQ(glb.document["nodes"][0]["extras"]["espalier"]["error"], 0.25);
    EXPECT_FALSE(glb.document.contains("extensionsUsed"));
    EXPECT_FALSE(contains(documentOf(*bakeGlb(mesh, {}, kOak)), "lod"));
}

TEST(Gltf, QuantizedVerticesAreNearWhereTheyWere)
{
    const TreeMesh mesh = handMade({.sides = 31, .rings = 57, .height = 20, .radius = 0.37f, .base = {3, -1, 2}});
    const std::size_t portable = bakeGlb(mesh, {}, kOak)->size();
    for (const GltfEncoding encoding : {GltfEncoding::Quantized, GltfEncoding::Compressed})
    {
        const auto bytes = bakeGlb(mesh, {}, kOak, {encoding});
        const Glb glb(bytes);
        EXPECT_LT(bytes->size(), portable * (encoding == GltfEncoding::Quantized ? 2 : 1) / 3);
        EXPECT_EQ(glb.document["nodes"][0]["extras"]["espalier"]["species"], "Oak");
        EXPECT_FALSE(glb.document["nodes"][0].contains("scale")) << "free for whoever places the tree";
        const auto& node = glb.document["nodes"][1];
        const double scale = node["scale"][0];
        const std::vector<double> centre = node["translation"];
        const auto positions = glb.read<std::int16_t, 3>(glb.attribute("POSITION"));
        const auto normals = glb.read<std::int8_t, 3>(glb.attribute("NORMAL"));
        const auto tangents = glb.read<std::int8_t, 4>(glb.attribute("TANGENT"));
        const auto uvs = glb.read<float, 2>(glb.attribute("TEXCOORD_0"));
        double worstPosition = 0;
        double worstAngle = 0;
        double worstUv = 0;
        for (std::size_t i = 0; i < mesh.positions.size(); ++i)
        {
            for (std::size_t k = 0; k < 3; ++k)
                worstPosition = std::max(worstPosition, std::abs(centre[k] + scale * positions[i][k] -
                                                                 double(mesh.positions[i][static_cast<int>(k)])));
            worstAngle = std::max(worstAngle, degreesBetween(normals[i], mesh.normals[i]));
            worstAngle = std::max(
                worstAngle, degreesBetween({tangents[i][0], tangents[i][1], tangents[i][2]}, Vec3(mesh.tangents[i])));
            EXPECT_EQ(tangents[i][3], double(mesh.tangents[i].w));
            worstUv = std::max({worstUv, std::abs(uvs[i][0] - double(mesh.uvs[i].x)),
                                std::abs(uvs[i][1] - (1 - double(mesh.uvs[i].y)))});
        }
        EXPECT_LT(worstPosition, 20.0 / 2 / 65534 * 1.01 + 1e-6);
        EXPECT_LT(worstAngle, 0.4);
        EXPECT_LE(worstUv, encoding == GltfEncoding::Compressed ? 0.5 / 4096 + 1e-6 : 1e-6);
        const auto& accessor = glb.document["accessors"][glb.attribute("POSITION").get<std::size_t>()];
        EXPECT_EQ(accessor["max"][1], 32767) << "the grid is used whole";
        EXPECT_EQ(accessor["min"][1], -32767);
    }
}

TEST(Gltf, CompressedTrianglesAreTheSame)
{
    const TreeMesh mesh = handMade({.sides = 31, .rings = 57});
    const Glb glb(bakeGlb(mesh, {}, kOak, {GltfEncoding::Compressed}));
    EXPECT_EQ(glb.document["extensionsRequired"],
              (std::vector<std::string>{"KHR_mesh_quantization", "EXT_meshopt_compression"}));
    const auto read = glb.read<std::uint16_t, 1>(glb.document["meshes"][0]["primitives"][0]["indices"]);
    ASSERT_EQ(read.size(), mesh.indices.size());
    for (std::size_t i = 0; i < read.size(); i += 3)
    {
        std::size_t shift = 0;
        while (shift < 3 && read[i][0] != mesh.indices[i + shift])
            ++shift;
        ASSERT_LT(shift, 3u) << "triangle " << i / 3;
        for (std::size_t k = 0; k < 3; ++k)
            EXPECT_EQ(read[i + k][0], mesh.indices[i + (shift + k) % 3]);
    }
}

TEST(Gltf, LongTextureCoordinatesKeepTheirPlaceOnAGrid)
{
    TreeMesh mesh = handMade({.sides = 5});
    mesh.uvs[0] = {100000.5f, -70000.25f};
    const Glb glb(bakeGlb(mesh, {}, kOak, {GltfEncoding::Compressed}));
    const auto uvs = glb.read<float, 2>(glb.attribute("TEXCOORD_0"));
    EXPECT_NEAR(uvs[0][0], 100000.5, 0.02);
    EXPECT_NEAR(uvs[0][1], 70001.25, 0.02);
}

TEST(Gltf, FurtherTextureCoordinatesPassUnchanged)
{
    const TreeMesh mesh = handMade({.sides = 5});
    std::vector<Vec2> wind(mesh.positions.size());
    for (std::size_t i = 0; i < wind.size(); ++i)
        wind[i] = {0.1f * static_cast<float>(i), -7.25f};
    const std::span<const Vec2> sets[] = {wind, mesh.uvs};
    BakedLevel level;
    level.mesh = &mesh;
    level.furtherUvs = sets;
    for (const GltfEncoding encoding : kEncodings)
    {
        const Glb glb(bakeGlb(BakedTree{{&level, 1}, {}, {}}, {}, kOak, {encoding}));
        const auto first = glb.read<float, 2>(glb.attribute("TEXCOORD_1"));
        const auto second = glb.read<float, 2>(glb.attribute("TEXCOORD_2"));
        for (std::size_t i = 0; i < wind.size(); ++i)
        {
            EXPECT_EQ(first[i], (std::array<double, 2>{double(wind[i].x), double(wind[i].y)}));
            EXPECT_EQ(second[i], (std::array<double, 2>{double(mesh.uvs[i].x), double(mesh.uvs[i].y)}));
        }
    }
}

TEST(Gltf, ASkinAtRestMovesNothing)
{
    const TreeMesh mesh = handMade({.sides = 5, .height = 3, .base = {1, 0, 0}});
    const WindJoint joints[] = {{kNoElement, 0, {1, 0, 0}, {}},
                                {0, 1, {1, 1, 0}, {}},
                                {1, 2, {1.5f, 2, 0.25f}, {}},
                                {kNoElement, 3, {4, 0, 0}, {}}};
    std::vector<WindInfluence> weights(mesh.positions.size());
    for (std::size_t i = 0; i < weights.size(); ++i)
        weights[i] = {{2, 1, 0, 3}, {static_cast<std::uint8_t>(55 + i), static_cast<std::uint8_t>(200 - i), 0, 0}};
    BakedLevel level;
    level.mesh = &mesh;
    level.influences = weights;
    for (const GltfEncoding encoding : kEncodings)
    {
        const Glb glb(bakeGlb(BakedTree{{&level, 1}, {}, joints}, {}, kOak, {encoding}));
        const auto& nodes = glb.document["nodes"];
        const auto& skin = glb.document["skins"][0];
        EXPECT_EQ(nodes[0]["skin"], 0);
        EXPECT_FALSE(nodes[0].contains("scale")) << "readers ignore it on a skinned node";
        EXPECT_EQ(glb.document["scenes"][0]["nodes"], (std::vector<int>{0, 1})) << "the mesh is no child";
        EXPECT_EQ(skin["joints"], (std::vector<int>{2, 3, 4, 5}));
        EXPECT_EQ(skin["skeleton"], 1);
        EXPECT_EQ(nodes[1]["children"], (std::vector<int>{2, 5}));
        EXPECT_EQ(nodes[3]["children"], std::vector<int>{4});
        const auto read = glb.read<std::uint8_t, 4>(glb.attribute("JOINTS_0"));
        const auto shares = glb.read<std::uint8_t, 4>(glb.attribute("WEIGHTS_0"));
        EXPECT_EQ(read[0], (std::array<double, 4>{2, 1, 0, 0})) << "0 where the weight is";
        const auto matrices = glb.read<float, 16>(skin["inverseBindMatrices"]);
        ASSERT_EQ(matrices.size(), 4u);
        const bool isPortable = encoding == GltfEncoding::Portable;
        const auto positions = isPortable ? glb.read<float, 3>(glb.attribute("POSITION"))
                                          : glb.read<std::int16_t, 3>(glb.attribute("POSITION"));
        for (std::size_t i = 0; i < mesh.positions.size(); ++i)
            for (std::size_t axis = 0; axis < 3; ++axis)
            {
                double skinned = 0;
                for (std::size_t k = 0; k < 4; ++k)
                {
                    const auto joint = static_cast<std::size_t>(read[i][k]);
                    skinned +=
                        shares[i][k] * (double(joints[joint].position[static_cast<int>(axis)]) +
                                        matrices[joint][12 + axis] + matrices[joint][5 * axis] * positions[i][axis]);
                }
                EXPECT_NEAR(skinned, double(mesh.positions[i][static_cast<int>(axis)]), isPortable ? 1e-6 : 1e-4);
            }
    }
}

TEST(Gltf, ManyJointsNeedLongIndices)
{
    const TreeMesh mesh = handMade({.sides = 5});
    std::vector<WindJoint> joints(257);
    for (std::uint32_t i = 1; i < 257; ++i)
        joints[i].parent = i - 1;
    std::vector<WindInfluence> weights(mesh.positions.size(), kWhole);
    weights[0] = {{256, 3, 7, 9}, {1, 2, 2, 250}};
    BakedLevel level;
    level.mesh = &mesh;
    level.influences = weights;
    const Glb glb(bakeGlb(BakedTree{{&level, 1}, {}, joints}, {}, kOak));
    EXPECT_EQ((glb.read<std::uint16_t, 4>(glb.attribute("JOINTS_0"))[0]), (std::array<double, 4>{256, 3, 7, 9}));
}

TEST(Gltf, RefusesWhatDoesNotGoWithTheMesh)
{
    struct Wrong
    {
        const char* name;
        std::function<void(TreeMesh&, BakedLevel&, BakedTree&)> spoil;
    };
    static const std::vector<Vec2> shortUvs(3);
    static const std::span<const Vec2> shortSets[] = {shortUvs};
    static const std::vector<WindInfluence> shortWeights(3);
    static std::vector<WindInfluence> weights;
    static std::vector<WindJoint> joints;
    static const std::vector<EncodedImages> noPng{{"JFIF", {}, {}}};
    const Wrong cases[] = {
        {"no level", [](auto&, auto&, auto& tree) { tree.levels = {}; }},
        {"no mesh", [](auto&, auto& level, auto&) { level.mesh = nullptr; }},
        {"tints too short", [](auto& mesh, auto&, auto&) { mesh.tints.resize(3); }},
        {"uvs too short", [](auto&, auto& level, auto&) { level.furtherUvs = shortSets; }},
        {"NaN error", [](auto&, auto& level, auto&) { level.error = kNaN; }},
        {"joints without weights", [](auto&, auto& level, auto&) { level.influences = {}; }},
        {"weights without joints", [](auto&, auto&, auto& tree) { tree.joints = {}; }},
        {"weights too short", [](auto&, auto& level, auto&) { level.influences = shortWeights; }},
        {"weights below 255",
         [](auto&, auto&, auto&) {
             weights[4].weights = {254, 0, 0, 0};
         }},
        {"unknown joint", [](auto&, auto&, auto&) { weights[4].joints[0] = 2; }},
        {"a joint twice",
         [](auto&, auto&, auto&) {
             weights[4] = {{1, 1, 0, 0}, {100, 155, 0, 0}};
         }},
        {"a child before its parent", [](auto&, auto&, auto&) { joints[0].parent = 1; }},
        {"a joint that hangs on itself", [](auto&, auto&, auto&) { joints[1].parent = 1; }},
        {"NaN joint", [](auto&, auto&, auto&) { joints[1].position.z = kNaN; }},
        {"no PNG", [](auto&, auto&, auto& tree) { tree.images = noPng; }},
    };
    for (const GltfEncoding encoding : kEncodings)
        for (const Wrong& wrong : cases)
        {
            TreeMesh mesh = handMade({});
            weights.assign(mesh.positions.size(), kWhole);
            joints.assign(2, {});
            BakedLevel level;
            level.mesh = &mesh;
            level.influences = weights;
            BakedTree tree{{&level, 1}, {}, joints};
            ASSERT_TRUE(bakeGlb(tree, {}, kOak, {encoding}));
            wrong.spoil(mesh, level, tree);
            const auto glb = bakeGlb(tree, {}, kOak, {encoding});
            ASSERT_FALSE(glb) << wrong.name;
            EXPECT_EQ(glb.error().kind, ErrorKind::BadInput) << wrong.name;
        }
}

TEST(Gltf, AMeshThatProvesBadWhileItIsWrittenLeavesTheOldFile)
{
    const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "EspalierGltfBad";
    std::filesystem::create_directories(folder);
    const auto path = folder / "Oak.glb";
    ASSERT_TRUE(writeGlb(path, handMade({}), {}, kOak));
    TreeMesh mesh = handMade({.sides = 100, .rings = 400});
    mesh.indices.back() = 1 << 20; // the last thing that is looked at
    ASSERT_FALSE(writeGlb(path, mesh, {}, kOak));
    EXPECT_EQ(*readFile(path, 1 << 20), *bakeGlb(handMade({}), {}, kOak));
    EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder), {}), 1);
    std::filesystem::remove_all(folder);
}

TEST(Gltf, WritesWhatItBakes)
{
    const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "EspalierGltf";
    std::filesystem::create_directories(folder);
    const auto path = folder / "Oak.glb";
    ASSERT_TRUE(writeGlb(path, handMade({}), {}, kOak));
    EXPECT_EQ(*readFile(path, 1 << 20), *bakeGlb(handMade({}), {}, kOak));
    const TreeMesh large = handMade({.sides = 100, .rings = 400}); // more than one run of each array
    for (const GltfEncoding encoding : kEncodings)
    {
        ASSERT_TRUE(writeGlb(path, large, {}, kOak, {encoding}));
        EXPECT_EQ(*readFile(path, 16 << 20), *bakeGlb(large, {}, kOak, {encoding}));
    }
    std::filesystem::remove_all(folder);

    const auto lost = writeGlb(folder / "missing" / "Oak.glb", handMade({}), {}, kOak);
    ASSERT_FALSE(lost);
    EXPECT_EQ(lost.error().kind, ErrorKind::Io);
}

} // namespace espalier
