#include <Espalier/Bake/Gltf.h>

#include <Espalier/Core/File.h>
#include <Espalier/Species/Appearance.h>
#include <Render/HandMadeMesh.h>
#include <cstring>
#include <filesystem>
#include <functional>
#include <gtest/gtest.h>
#include <limits>
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

template <class T>
std::string bytesOf(const std::vector<T>& values)
{
    return {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T)};
}

bool contains(const std::string& text, const std::string& part)
{
    return text.find(part) != std::string::npos;
}

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
    std::vector<Vec2> fromTop = mesh.uvs;
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
    struct Size
    {
        std::uint32_t sides;
        std::uint32_t rings;
        bool isShort;
    };
    // (sides + 1) * rings vertices; index 65535 would be the restart value.
    for (const Size size : {Size{4, 13107, true}, Size{7, 8192, false}})
    {
        const TreeMesh mesh = handMade({.sides = size.sides, .rings = size.rings});
        ASSERT_EQ(mesh.positions.size(), size.isShort ? 65535u : 65536u);
        const auto glb = bakeGlb(mesh, {}, kOak);
        ASSERT_TRUE(glb);
        EXPECT_EQ(contains(documentOf(*glb), R"("componentType":5123)"), size.isShort);
        EXPECT_EQ(contains(documentOf(*glb), R"("componentType":5125)"), !size.isShort);
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

TEST(Gltf, WritesWhatItBakes)
{
    const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "EspalierGltf";
    std::filesystem::create_directories(folder);
    const auto path = folder / "Oak.glb";
    ASSERT_TRUE(writeGlb(path, handMade({}), {}, kOak));
    EXPECT_EQ(*readFile(path, 1 << 20), *bakeGlb(handMade({}), {}, kOak));
    std::filesystem::remove_all(folder);

    const auto lost = writeGlb(folder / "missing" / "Oak.glb", handMade({}), {}, kOak);
    ASSERT_FALSE(lost);
    EXPECT_EQ(lost.error().kind, ErrorKind::Io);
}

} // namespace espalier
