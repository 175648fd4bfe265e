#include <Espalier/Bake/Obj.h>

#include <Espalier/Core/File.h>
#include <Espalier/Mesh/TreeMesh.h>
#include <Espalier/Species/Appearance.h>
#include <Render/HandMadeMesh.h>
#include <charconv>
#include <filesystem>
#include <functional>
#include <gtest/gtest.h>
#include <limits>
#include <sstream>

namespace espalier {

namespace {

const BakeInfo kOak{.speciesName = "English oak", .speciesHash = 0xc0ffee, .seed = Seed{7}};

TreeMesh leafy()
{
    TreeMesh mesh = handMade({.sides = 7, .rings = 5});
    mesh.parts = {{MeshMaterial::Bark, 0, 60},
                  {MeshMaterial::Leaves, 60, 60, 1},
                  {MeshMaterial::Surface, 120, 0, 3},
                  {MeshMaterial::Bark, 120, 48, 2}};
    return mesh;
}

/// What a reader makes of the text.
struct ReadBack
{
    RawVector<Vec3> positions;
    RawVector<Vec3> normals;
    RawVector<Vec2> uvs;
    RawVector<std::uint32_t> indices;
    std::vector<std::string> groups;
    std::vector<std::string> materials;
    std::string materialFile;

    explicit ReadBack(const std::string& text)
    {
        std::istringstream lines(text);
        for (std::string line; std::getline(lines, line);)
        {
            std::istringstream words(line);
            std::string keyword;
            words >> keyword;
            std::vector<std::string> rest;
            for (std::string word; words >> word;)
                rest.push_back(word);
            const auto number = [&](std::size_t i) {
                float value = 0;
                const char* const end = rest[i].data() + rest[i].size();
                EXPECT_EQ(std::from_chars(rest[i].data(), end, value).ptr, end) << line;
                return value;
            };
            if (keyword == "v")
                positions.emplace_back(number(0), number(1), number(2));
            else if (keyword == "vn")
                normals.emplace_back(number(0), number(1), number(2));
            else if (keyword == "vt")
                uvs.emplace_back(number(0), number(1));
            else if (keyword == "g")
                groups.push_back(rest[0]);
            else if (keyword == "usemtl")
                materials.push_back(rest[0]);
            else if (keyword == "mtllib")
                materialFile = line.substr(7);
            else if (keyword == "f")
                for (const std::string& corner : rest)
                {
                    const auto index = static_cast<std::uint32_t>(std::stoul(corner));
                    const std::string one = std::to_string(index);
                    EXPECT_EQ(corner, one + '/' + one + '/' + one);
                    indices.push_back(index - 1);
                }
            else
                EXPECT_TRUE(keyword == "#" || keyword == "o") << line;
        }
    }
};

} // namespace

TEST(Obj, ReadsBackToTheBit)
{
    TreeMesh mesh = leafy();
    mesh.positions[3] = {0.1f, 1e-20f, -123456.789f};
    const auto text = printObj(mesh, {}, kOak, "English oak.mtl");
    ASSERT_TRUE(text) << toString(text.error());
    const ReadBack read(text->object);
    EXPECT_EQ(read.positions, mesh.positions);
    EXPECT_EQ(read.normals, mesh.normals);
    EXPECT_EQ(read.uvs, mesh.uvs);
    EXPECT_EQ(read.indices, mesh.indices);
    EXPECT_EQ(read.materialFile, "English oak.mtl");
    EXPECT_EQ(read.materials,
              (std::vector<std::string>{"English_oak_bark", "English_oak_leaves_1", "English_oak_wood_2"}));
    EXPECT_EQ(read.groups.size(), 3u) << "empty parts are left out";
    EXPECT_EQ(text->object.find("-0 "), std::string::npos);
    EXPECT_NE(text->object.find("v 0.1 1e-20 -123456.79\n"), std::string::npos) << "numbers are short";
    EXPECT_TRUE(text->object.starts_with("# Espalier ")) << text->object.substr(0, 100);
}

TEST(Obj, MaterialsNameTheirImages)
{
    Appearance appearance;
    appearance.bark.colour = {0.5f, 0.25f, 2};
    appearance.bark.roughness = 0.75f;
    appearance.leaves.resize(2);
    appearance.leaves[1].roughness = 0.5f;
    const std::vector<ImageNames> images{
        {"bark.png", "bark-n.png", "bark-r.png"}, {"other.png", "", ""}, {"leaf.png", "", ""}};
    const auto text = printObj(leafy(), appearance, kOak, "oak.mtl", images);
    ASSERT_TRUE(text);
    EXPECT_EQ(
        text->materials, "newmtl English_oak_bark\nKd 1 1 1\nPr 0.75\nPm 0\nillum 1\n"
                         "map_Kd bark.png\nnorm bark-n.png\nmap_Pr bark-r.png\n\n"
                         "newmtl English_oak_leaves_1\nKd 1 1 1\nPr 0.5\nPm 0\nillum 1\n"
                         "map_Kd leaf.png\nmap_d leaf.png\n\n"
                         "newmtl English_oak_wood_2\nKd " +
                             [&] {
                                 std::ostringstream colour;
                                 const Vec3 c = appearance.palette[2];
                                 colour << c.x << ' ' << c.y << ' ' << c.z;
                                 return colour.str();
                             }() +
                             "\nPr 0.75\nPm 0\nillum 1\nnorm bark-n.png\nmap_Pr bark-r.png\n");
    EXPECT_EQ(printObj(handMade({}), appearance, kOak, "oak.mtl")->materials,
              "newmtl English_oak_bark\nKd 0.5 0.25 1\nPr 0.75\nPm 0\nillum 1\n");
}

TEST(Obj, RefusesWhatCannotBeWritten)
{
    struct Case
    {
        const char* name;
        std::function<void(TreeMesh&, BakeInfo&, std::vector<ImageNames>&)> spoil;
    };
    const Case kCases[] = {
        {"no vertices", [](auto& mesh, auto&, auto&) { mesh.clear(); }},
        {"NaN", [](auto& mesh, auto&, auto&) { mesh.uvs[1].x = std::numeric_limits<float>::quiet_NaN(); }},
        {"too few normals", [](auto& mesh, auto&, auto&) { mesh.normals.pop_back(); }},
        {"index out of range", [](auto& mesh, auto&, auto&) { mesh.indices[1] = 1000; }},
        {"parts that leave something out", [](auto& mesh, auto&, auto&) { mesh.parts.pop_back(); }},
        {"a name of two lines", [](auto&, auto& info, auto&) { info.speciesName = "Oak\nv 1 2 3"; }},
        {"an image's name of two lines", [](auto&, auto&, auto& images) { images[0].normal = "a\rb"; }},
    };
    for (const Case& c : kCases)
    {
        TreeMesh mesh = leafy();
        BakeInfo info = kOak;
        std::vector<ImageNames> images(1);
        c.spoil(mesh, info, images);
        const auto text = printObj(mesh, {}, info, "oak.mtl", images);
        ASSERT_FALSE(text) << c.name;
        EXPECT_EQ(text.error().kind, ErrorKind::BadInput) << c.name;
    }
}

TEST(Obj, WritesBothFiles)
{
    const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "EspalierObj";
    std::filesystem::create_directories(folder);
    const TreeMesh large = handMade({.sides = 100, .rings = 100}); // more than one run of text
    ASSERT_TRUE(writeObj(folder / "oak.obj", large, {}, kOak));
    const auto text = printObj(large, {}, kOak, "oak.mtl");
    EXPECT_EQ(*readFile(folder / "oak.obj", 16 << 20), text->object);
    EXPECT_EQ(*readFile(folder / "oak.mtl", 16 << 20), text->materials);
    EXPECT_EQ(ReadBack(text->object).indices, large.indices);
    ASSERT_TRUE(writeObj(folder / "English oak.obj", large, {}, kOak));
    EXPECT_EQ(ReadBack(*readFile(folder / "English oak.obj", 16 << 20)).materialFile, "English_oak.mtl");
    EXPECT_EQ(*readFile(folder / "English_oak.mtl", 16 << 20), text->materials);
    EXPECT_FALSE(writeObj(folder / "oak.mtl", large, {}, kOak)) << "one would replace the other";
    EXPECT_FALSE(writeObj(folder / "missing" / "oak.obj", large, {}, kOak));
    std::filesystem::remove_all(folder);
}

} // namespace espalier
