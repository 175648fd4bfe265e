#include <Espalier/Bake/GltfSkeleton.h>

#include <gtest/gtest.h>

namespace espalier {

namespace {

constexpr const char* kHead = R"({"asset":{"version":"2.0"},)";

ImportedSkeleton read(const std::string& text, const ImportSettings& settings = {})
{
    auto result = parseGltfSkeleton(text, "t.gltf", settings);
    EXPECT_TRUE(result) << (result ? "" : toString(result.error())) << '\n' << text;
    return result.value_or(ImportedSkeleton{});
}

void expectNear(const Vec3& a, const Vec3& b)
{
    EXPECT_NEAR(a.x, b.x, 1e-6);
    EXPECT_NEAR(a.y, b.y, 1e-6);
    EXPECT_NEAR(a.z, b.z, 1e-6);
}

std::string littleEndian(std::uint32_t value)
{
    std::string bytes;
    for (int i = 0; i < 4; ++i)
        bytes += static_cast<char>(value >> (8 * i) & 0xff);
    return bytes;
}

std::string glb(const std::string& json, std::uint32_t version = 2)
{
    return "glTF" + littleEndian(version) + littleEndian(static_cast<std::uint32_t>(20 + json.size())) +
           littleEndian(static_cast<std::uint32_t>(json.size())) + "JSON" + json;
}

} // namespace

TEST(GltfSkeleton, TranslationsOfNodesAreSegments)
{
    const Skeleton s = read(std::string(kHead) + R"("nodes":[
        {"children":[1]},
        {"translation":[0,2,0],"children":[2,3]},
        {"translation":[1,1,0]},
        {"translation":[-1,1,0]}]})")
                           .skeleton;
    ASSERT_EQ(s.size(), 3u);
    EXPECT_TRUE(isSound(s));
    EXPECT_EQ(s.ends, (std::vector<Vec3>{{0, 2, 0}, {1, 3, 0}, {-1, 3, 0}}));
    EXPECT_EQ(s.parents, (std::vector<std::uint32_t>{kNoSegment, 0, 0}));
    EXPECT_FALSE(s.widthsGiven);
}

TEST(GltfSkeleton, RotationsScalesAndMatricesAreApplied)
{
    // A quarter turn about Z brings Y to -X, and twice the size.
    const char* const kTurned =
        R"({"rotation":[0,0,0.70710678118654757,0.70710678118654757],"scale":[2,2,2],"children":[1]})";
    const char* const kMatrix = R"({"matrix":[0,2,0,0,-2,0,0,0,0,0,2,0,0,0,0,1],"children":[1]})";
    for (const char* const root : {kTurned, kMatrix})
    {
        SCOPED_TRACE(root);
        const Skeleton s = read(std::string(kHead) + R"("nodes":[)" + root +
                                R"(,{"translation":[0,1,0],"children":[2]},{"translation":[0,0,1]}]})")
                               .skeleton;
        ASSERT_EQ(s.size(), 2u);
        expectNear(s.ends[0], {-2, 0, 0});
        expectNear(s.ends[1], {-2, 0, 2});
    }
}

TEST(GltfSkeleton, TheJointsOfASkinLeaveOutOtherNodes)
{
    // 0 the armature, turned and moved; 1 a bone; 2 a helper that moves; 3 and 4 bones; 5 the mesh.
    const Skeleton s = read(std::string(kHead) + R"("scene":0,"scenes":[{"nodes":[0]}],
        "skins":[{"joints":[1,3,4]}],"nodes":[
        {"translation":[9,9,9],"children":[1,5]},
        {"children":[2]},
        {"translation":[0,1,0],"children":[3]},
        {"translation":[0,1,0],"children":[4]},
        {"translation":[1,0,0]},
        {"mesh":0,"skin":0,"translation":[50,0,0]}]})")
                           .skeleton;
    EXPECT_EQ(s.ends, (std::vector<Vec3>{{0, 2, 0}, {1, 2, 0}}));
}

TEST(GltfSkeleton, OnlyTheScenesNodesCount)
{
    const Skeleton s = read(std::string(kHead) + R"("scene":1,"scenes":[{"nodes":[0]},{"nodes":[2]}],"nodes":[
        {"children":[1]},{"translation":[0,5,0]},{"children":[3]},{"translation":[0,7,0]}]})")
                           .skeleton;
    ASSERT_EQ(s.size(), 1u);
    EXPECT_EQ(s.ends[0], Vec3(0, 7, 0));
}

TEST(GltfSkeleton, BinaryFilesAreReadByTheirJson)
{
    const std::string json = std::string(kHead) + R"("nodes":[{"children":[1]},{"translation":[0,1,0]}]})";
    EXPECT_EQ(read(glb(json)).skeleton.size(), 1u);
    EXPECT_EQ(read(glb(json + "   ") + "BIN chunks and what else follows").skeleton.size(), 1u);
}

TEST(GltfSkeleton, BuffersInTheTextMayBeLong)
{
    EXPECT_EQ(read(std::string(kHead) + R"("buffers":[{"uri":"data:,)" + std::string(200000, 'A') +
                   R"("}],"nodes":[{"children":[1]},{"translation":[0,1,0]}]})")
                  .skeleton.size(),
              1u);
}

TEST(GltfSkeleton, WhatIsWrongHasItsPlace)
{
    struct Case
    {
        std::string text;
        const char* message;
    };
    const std::string head = kHead;
    const std::string json = head + R"("nodes":[{"children":[1]},{"translation":[0,1,0]}]})";
    std::string tooLong = glb(json);
    tooLong[12] = static_cast<char>(0xff);
    tooLong[15] = static_cast<char>(0xff);
    const Case kCases[] = {
        {"", "t.gltf:1:1: the file is empty"},
        {"{}", "\"asset\" is missing"},
        {R"({"asset":{"version":"1.0"},"nodes":[{}]})", "the file is glTF 1.0"},
        {head + R"("nodes":[]})", "t.gltf:1:36: the file has no node"},
        {head + R"("nodes":[{"children":[1,1]},{}]})", "node 1 is a child of node 0 already"},
        {head + R"("nodes":[{"children":[2]},{"children":[2]},{}]})", "node 2 is a child of node 0 already"},
        {head + R"("nodes":[{"children":[1]},{"children":[0]}]})", "hangs on itself"},
        {head + R"("nodes":[{"children":[0]}]})", "node 0 hangs on itself"},
        {head + R"("nodes":[{"children":[7]}]})", "t.gltf:1:50: a child is 7; expected a whole number from 0 to 0"},
        {head + R"("nodes":[{"children":[-1]}]})", "a child is -1"},
        {head + R"("nodes":[{"translation":[1,2]}]})", "translation has 2 numbers; expected 3"},
        {head + R"("nodes":[{"translation":[1,2,"x"]}]})", "translation is the string \"x\"; expected a number"},
        {head + R"("nodes":[{"translation":[1,2,1e999]}]})", "1e999 is too large"},
        {head + R"("nodes":[{"matrix":[1],"scale":[1,1,1]}]})", "a matrix and a scale"},
        {head + R"("nodes":[{"matrix":[1,0,0,1,0,1,0,0,0,0,1,0,0,0,0,1]}]})", "perspective"},
        {head + R"("nodes":[{"rotation":[0,0,0,0]}]})", "no unit quaternion"},
        {head +
             R"("nodes":[{"scale":[1e300,1,1],"children":[1]},{"scale":[1e300,1,1],"children":[2]},{"translation":[1,0,0]}]})",
         "overflow"},
        {head + R"("nodes":[{"children":[1]},{"translation":[0,3e5,0]}]})", "the limit coordinate"},
        {head + R"("scenes":[{"nodes":[1]}],"nodes":[{"children":[1]},{}]})", "nodes without a parent as the roots"},
        {head + R"("scene":3,"scenes":[{"nodes":[0]}],"nodes":[{}]})", "scene is 3"},
        {head + R"("scenes":[{}],"nodes":[{}]})", "the scene has no nodes"},
        {head + R"("skins":[{"joints":[5]}],"nodes":[{}]})", "a joint is 5"},
        {head + R"("skins":[{}],"nodes":[{}]})", "\"joints\" is missing"},
        {"glTF", "the binary glTF ends within its head"},
        {glb(json, 1), "this is version 1 of binary glTF"},
        {tooLong, "the file has room for"},
        {glb(json).substr(0, 30), "the head tells of"},
    };
    for (const Case& c : kCases)
    {
        const auto result = parseGltfSkeleton(c.text, "t.gltf");
        ASSERT_FALSE(result) << c.text;
        EXPECT_NE(toString(result.error()).find(c.message), std::string::npos)
            << c.text << '\n'
            << toString(result.error()) << "\nexpected: " << c.message;
    }
}

TEST(GltfSkeleton, AHierarchyOfThousandsNeedsNoCallStack)
{
    std::string text = std::string(kHead) + R"("nodes":[{"children":[1]})";
    constexpr int kNodes = 100000;
    for (int i = 1; i < kNodes; ++i)
        text += R"(,{"translation":[0,0.01,0])" +
                (i + 1 < kNodes ? R"(,"children":[)" + std::to_string(i + 1) + "]}" : std::string("}"));
    Limits limits;
    limits.jsonValues = 16u << 20;
    const auto result = parseGltfSkeleton(text + "]}", "t.gltf", {}, limits);
    ASSERT_TRUE(result) << toString(result.error());
    EXPECT_EQ(result->skeleton.size(), static_cast<std::uint32_t>(kNodes - 1));
}

TEST(GltfSkeleton, KeepsItsLimits)
{
    Limits limits;
    limits.nodes = 1;
    const auto result = parseGltfSkeleton(std::string(kHead) + R"("nodes":[{},{}]})", "t.gltf", {}, limits);
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().kind, ErrorKind::Limit);
}

} // namespace espalier
