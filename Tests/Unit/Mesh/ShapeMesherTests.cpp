#include <Espalier/Core/Random.h>
#include <Espalier/Mesh/TreeMesher.h>
#include <Espalier/Species/Appearance.h>
#include <Plant/SampleSkeletons.h>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>

namespace espalier {
namespace {

using namespace samples;

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

void addPolygon(Skeleton& skeleton, const std::vector<Vec3>& corners, std::uint16_t material = 0)
{
    skeleton.polygons.push_back({.firstCorner = static_cast<std::uint32_t>(skeleton.corners.size()),
                                 .cornerCount = static_cast<std::uint32_t>(corners.size()),
                                 .material = material});
    skeleton.corners.insert(skeleton.corners.end(), corners.begin(), corners.end());
}

Skeleton polygon(const std::vector<Vec3>& corners)
{
    Skeleton skeleton;
    addPolygon(skeleton, corners);
    return skeleton;
}

Skeleton sphere(float radius, Vec3 centre = Vec3(1, 2, 3))
{
    Skeleton skeleton;
    skeleton.spheres.push_back({.centre = centre, .radius = radius});
    return skeleton;
}

Skeleton organ(float size, Vec3 heading = Vec3(0, 1, 0), Vec3 left = Vec3(-1, 0, 0))
{
    Skeleton skeleton;
    skeleton.organs.push_back({.position = Vec3(1, 2, 3), .heading = heading, .left = left, .size = size});
    return skeleton;
}

/// An outline with bays and a tip, as a turtle might draw a lobed leaf, in a leaning plane.
std::vector<Vec3> lobedLeaf()
{
    const Vec3 right = glm::normalize(Vec3(1, 0.2f, -0.4f));
    const Vec3 up = glm::normalize(glm::cross(Vec3(0.3f, 0.1f, 1), right));
    std::vector<Vec3> corners;
    for (const Vec2 at : {Vec2(0, 0), Vec2(2, 1), Vec2(0.7f, 1.2f), Vec2(2, 2.5f), Vec2(0.6f, 2.3f), Vec2(0, 4),
                          Vec2(-0.6f, 2.3f), Vec2(-2, 2.5f), Vec2(-0.7f, 1.2f), Vec2(-2, 1)})
        corners.push_back(Vec3(5, 6, 7) + at.x * right + at.y * up);
    return corners;
}

struct Meshed
{
    MeshResult result;
    TreeMesh mesh;
};

Meshed meshed(const Skeleton& skeleton, const Limits& limits = {}, const Appearance& appearance = {})
{
    ShapeScratch scratch;
    Meshed m{};
    m.result = meshShapes(skeleton, appearance, {}, limits, scratch, m.mesh);
    return m;
}

Vec3 faceArea(const TreeMesh& mesh, std::size_t index)
{
    const Vec3 a = mesh.positions[mesh.indices[index]];
    return 0.5f * glm::cross(mesh.positions[mesh.indices[index + 1]] - a, mesh.positions[mesh.indices[index + 2]] - a);
}

double areaOf(const TreeMesh& mesh)
{
    double area = 0;
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3)
        area += static_cast<double>(glm::length(faceArea(mesh, i)));
    return area;
}

/// Half the sum of crossed corners: of any flat outline, in the direction of its plane.
double shoelaceArea(const std::vector<Vec3>& corners)
{
    DVec3 sum(0);
    for (std::size_t i = 1; i + 1 < corners.size(); ++i)
        sum += glm::cross(DVec3(corners[i] - corners[0]), DVec3(corners[i + 1] - corners[0]));
    return glm::length(sum) / 2;
}

void expectGoodMesh(const TreeMesh& mesh)
{
    ASSERT_EQ(mesh.normals.size(), mesh.positions.size());
    ASSERT_EQ(mesh.tangents.size(), mesh.positions.size());
    ASSERT_EQ(mesh.uvs.size(), mesh.positions.size());
    for (std::size_t i = 0; i < mesh.positions.size(); ++i)
    {
        const Vec3 tangent(mesh.tangents[i]);
        ASSERT_TRUE(std::isfinite(glm::dot(mesh.positions[i], mesh.positions[i])));
        ASSERT_NEAR(glm::length(mesh.normals[i]), 1, 1e-4);
        ASSERT_NEAR(glm::length(tangent), 1, 1e-4);
        ASSERT_NEAR(glm::dot(tangent, mesh.normals[i]), 0, 1e-4);
        ASSERT_EQ(std::abs(mesh.tangents[i].w), 1.f);
        ASSERT_GE(mesh.uvs[i].x, 0);
        ASSERT_LE(mesh.uvs[i].x, 1);
        ASSERT_GE(mesh.uvs[i].y, 0);
        ASSERT_LE(mesh.uvs[i].y, 1);
    }
    std::uint32_t covered = 0;
    for (const MeshPart& part : mesh.parts)
    {
        ASSERT_EQ(part.firstIndex, covered);
        ASSERT_EQ(part.indexCount % 3, 0u);
        covered += part.indexCount;
    }
    ASSERT_EQ(covered, mesh.indices.size());
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3)
    {
        for (std::size_t k = 0; k < 3; ++k)
            ASSERT_LT(mesh.indices[i + k], mesh.positions.size());
        const Vec3 area = faceArea(mesh, i);
        ASSERT_GT(glm::length(area), 0) << "triangle " << i / 3;
        ASSERT_GT(glm::dot(area, mesh.normals[mesh.indices[i]]), 0) << "triangle " << i / 3;
    }
}

/// The bitangent that normal, tangent and w promise runs along +v, and the tangent along +u.
void expectTangentsAlongTexture(const TreeMesh& mesh)
{
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3)
    {
        const std::uint32_t* corner = &mesh.indices[i];
        const Vec3 edge1 = mesh.positions[corner[1]] - mesh.positions[corner[0]];
        const Vec3 edge2 = mesh.positions[corner[2]] - mesh.positions[corner[0]];
        const Vec2 t1 = mesh.uvs[corner[1]] - mesh.uvs[corner[0]];
        const Vec2 t2 = mesh.uvs[corner[2]] - mesh.uvs[corner[0]];
        const float area = t1.x * t2.y - t2.x * t1.y;
        ASSERT_GT(area, 0);
        const Vec3 alongU = (edge1 * t2.y - edge2 * t1.y) / area;
        const Vec3 alongV = (edge2 * t1.x - edge1 * t2.x) / area;
        const Vec4 tangent = mesh.tangents[corner[0]];
        const Vec3 bitangent = tangent.w * glm::cross(mesh.normals[corner[0]], Vec3(tangent));
        ASSERT_GT(glm::dot(alongU, Vec3(tangent)), 0);
        ASSERT_GT(glm::dot(alongV, bitangent), 0);
    }
}

} // namespace

TEST(ShapeMesher, WhatHasNoAreaLeavesTheMeshAlone)
{
    const Vec3 a(1, 2, 3);
    const Skeleton cases[] = {
        Skeleton{},
        straightTrunk(),
        polygon({a, a, a}),
        polygon({a, a + Vec3(1, 1, 1), a}),
        polygon({a, a + Vec3(1, 1, 1), a + Vec3(2, 2, 2), a + Vec3(5, 5, 5)}),
        polygon({a, a + Vec3(1e-8f, 0, 0), a + Vec3(0, 1e-8f, 0)}),
        sphere(0),
        organ(0),
    };
    for (const Skeleton& skeleton : cases)
    {
        const Meshed m = meshed(skeleton);
        EXPECT_EQ(m.result, MeshResult::EmptySkeleton);
        EXPECT_EQ(m.mesh, TreeMesh{});
    }
}

TEST(ShapeMesher, UnsoundShapesAreRefused)
{
    Skeleton beyond = polygon(lobedLeaf());
    beyond.polygons[0].cornerCount = 11;
    Skeleton notFinite = polygon(lobedLeaf());
    notFinite.corners[3].y = kNaN;
    Skeleton far = polygon(lobedLeaf());
    far.corners[3].y = 1.01e5f;
    for (const Skeleton& skeleton : {beyond, notFinite, far, sphere(-1), sphere(1e30f), sphere(1, Vec3(1e6f)),
                                     organ(kNaN), organ(1e30f), organ(1, Vec3(kNaN))})
    {
        const Meshed m = meshed(skeleton);
        EXPECT_EQ(m.result, MeshResult::UnsoundSkeleton);
        EXPECT_EQ(m.mesh, TreeMesh{});
    }
}

TEST(ShapeMesher, KeepsTheLimitBeforeAnythingIsTaken)
{
    Skeleton skeleton = polygon(lobedLeaf());
    skeleton.spheres = sphere(1).spheres;
    skeleton.organs = organ(1).organs;
    const auto enough = static_cast<std::uint32_t>(meshed(skeleton).mesh.positions.size());
    EXPECT_EQ(meshed(skeleton, {.vertices = enough}).result, MeshResult::Ok);
    const Meshed tooMany = meshed(skeleton, {.vertices = enough - 1});
    EXPECT_EQ(tooMany.result, MeshResult::TooManyVertices);
    EXPECT_EQ(tooMany.mesh, TreeMesh{});

    // A million polygons that share a million corners: refused by counting, not by trying.
    Skeleton hostile;
    hostile.corners.assign(1u << 20, Vec3(0));
    hostile.polygons.assign(1u << 20, {.firstCorner = 0, .cornerCount = 1u << 20});
    EXPECT_EQ(meshed(hostile).result, MeshResult::TooManyVertices);
}

TEST(ShapeMesher, FillsAConcavePolygon)
{
    const Meshed m = meshed(polygon(lobedLeaf()));
    ASSERT_EQ(m.result, MeshResult::Ok);
    expectGoodMesh(m.mesh);
    expectTangentsAlongTexture(m.mesh);
    EXPECT_EQ(m.mesh.positions.size(), 10u);
    EXPECT_EQ(m.mesh.indices.size(), 3u * 8);
    EXPECT_NEAR(areaOf(m.mesh), shoelaceArea(lobedLeaf()), 1e-4);
    ASSERT_EQ(m.mesh.parts.size(), 1u);
    EXPECT_EQ(m.mesh.parts[0].material, MeshMaterial::Surface);
    EXPECT_EQ(m.mesh.uvs[0].y, 0) << "where it is attached";
    EXPECT_EQ(m.mesh.uvs[5].y, 1) << "its tip";
}

TEST(ShapeMesher, PolygonsOfAnyShapeGiveGoodTriangles)
{
    std::vector<Vec3> warped = lobedLeaf();
    warped[2] += Vec3(0.1f, 0.1f, 0.1f);
    const std::vector<std::vector<Vec3>> cases = {
        warped,
        {{0, 0, 0}, {0, 0, 0}, {1, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 0, 0}},     // repeats
        {{0, 0, 0}, {2, 2, 0}, {2, 0, 0}, {0, 2, 0}},                           // a bow tie whose halves cancel
        {{0, 0, 0}, {1, 0, 0}, {1, 1, 1}, {0, 1, 0}},                           // bent
        {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 0, 1}, {1, 0, 1e-7f}, {0, 0, 1}}, // nearly cut in two
    };
    for (const std::vector<Vec3>& corners : cases)
    {
        const Meshed m = meshed(polygon(corners));
        ASSERT_EQ(m.result, MeshResult::Ok);
        expectGoodMesh(m.mesh);
    }
    for (std::uint64_t seed = 0; seed < 200; ++seed) // scribbles
    {
        const RandomKey key(Seed{seed});
        std::vector<Vec3> corners;
        for (std::uint32_t i = 0; i < 3 + seed % 20; ++i)
        {
            const auto draw = [&](std::uint32_t k) { return static_cast<float>(key.uniform(Purpose::Sampling, k)); };
            const float x = draw(3 * i);
            const float y = draw(3 * i + 1);
            corners.emplace_back(x, y, seed % 2 == 0 ? 0.f : 0.05f * draw(3 * i + 2));
        }
        const Meshed m = meshed(polygon(corners));
        ASSERT_EQ(m.result, MeshResult::Ok) << "seed " << seed;
        for (const Vec3& normal : m.mesh.normals)
            ASSERT_NEAR(glm::length(normal), 1, 1e-4) << "seed " << seed;
    }
}

TEST(ShapeMesher, SpheresAreRound)
{
    const Meshed m = meshed(sphere(0.5f));
    ASSERT_EQ(m.result, MeshResult::Ok);
    expectGoodMesh(m.mesh);
    expectTangentsAlongTexture(m.mesh);
    EXPECT_EQ(m.mesh.indices.size(), 3u * 120);
    for (std::size_t i = 0; i < m.mesh.positions.size(); ++i)
    {
        const Vec3 arm = m.mesh.positions[i] - Vec3(1, 2, 3);
        EXPECT_NEAR(glm::length(arm), 0.5f, 1e-5);
        EXPECT_NEAR(glm::length(arm / 0.5f - m.mesh.normals[i]), 0, 1e-5);
    }
}

TEST(ShapeMesher, AnOrganIsALeafAlongItsHeading)
{
    const Meshed m = meshed(organ(2));
    ASSERT_EQ(m.result, MeshResult::Ok);
    expectGoodMesh(m.mesh);
    expectTangentsAlongTexture(m.mesh);
    float highest = 0;
    float widest = 0;
    for (const Vec3& position : m.mesh.positions)
    {
        const Vec3 arm = position - Vec3(1, 2, 3);
        EXPECT_GE(arm.y, 0);
        EXPECT_LE(arm.y, 2);
        highest = std::max(highest, arm.y);
        widest = std::max(widest, std::abs(arm.x));
        EXPECT_LT(std::abs(arm.z), 0.5f) << "in the plane of heading and left, but for its fold";
    }
    EXPECT_EQ(highest, 2);
    EXPECT_NEAR(widest, 2 * 0.26, 0.05);
    EXPECT_EQ(m.mesh.indices.size(), 3u * 20);
    EXPECT_GT(m.mesh.normals[0].z, 0.5f) << "its face looks up: cross(heading, left)";

    // A frame that is none still gives a leaf.
    expectGoodMesh(meshed(organ(1, Vec3(0), Vec3(0))).mesh);
    expectGoodMesh(meshed(organ(1, Vec3(0, 3, 0), Vec3(0, 1, 0))).mesh);
}

TEST(ShapeMesher, OnePartAColourInAscendingOrder)
{
    Skeleton skeleton;
    for (const std::uint16_t material : std::vector<std::uint16_t>{5, 0, 5, 2, 65535, 0, 63, 7})
        addPolygon(skeleton, lobedLeaf(), material);
    skeleton.spheres = sphere(1).spheres;
    skeleton.spheres[0].material = 2;
    const Meshed m = meshed(skeleton);
    ASSERT_EQ(m.result, MeshResult::Ok);
    expectGoodMesh(m.mesh);
    ASSERT_EQ(m.mesh.parts.size(), 4u);
    const std::uint16_t colours[] = {0, 2, 5, 7};
    const std::uint32_t triangles[] = {16, 128, 16, 24};
    for (std::size_t i = 0; i < 4; ++i)
    {
        EXPECT_EQ(m.mesh.parts[i].colour, colours[i]);
        EXPECT_EQ(m.mesh.parts[i].indexCount, 3 * triangles[i]);
    }

    Appearance poor;
    poor.palette = {Vec3(1)};
    EXPECT_EQ(meshed(skeleton, {}, poor).mesh.parts.size(), 1u);
    poor.palette.clear();
    EXPECT_EQ(meshed(skeleton, {}, poor).mesh.parts.size(), 1u);
}

TEST(ShapeMesher, AppendsAndRepeatsItself)
{
    const Skeleton skeleton = polygon(lobedLeaf());
    ShapeScratch scratch;
    TreeMesh mesh;
    ASSERT_EQ(meshShapes(sphere(1), {}, {}, {}, scratch, mesh), MeshResult::Ok);
    ASSERT_EQ(meshShapes(skeleton, {}, {}, {}, scratch, mesh), MeshResult::Ok);
    expectGoodMesh(mesh);
    EXPECT_EQ(mesh.parts.size(), 2u);
    mesh.clear();
    ASSERT_EQ(meshShapes(skeleton, {}, {}, {}, scratch, mesh), MeshResult::Ok);
    EXPECT_EQ(mesh, meshed(skeleton).mesh);
}

TEST(TreeMesher, NothingAtAllIsNoPlant)
{
    const auto mesh = meshTree(Skeleton{}, {});
    ASSERT_FALSE(mesh);
    EXPECT_EQ(mesh.error().what, "the plant gives no mesh: there is nothing to draw");
}

TEST(TreeMesher, TubesAloneAreWhatTheyWere)
{
    TubeScratch scratch;
    TreeMesh tubes;
    ASSERT_EQ(meshTubes(fork(), {}, {}, {}, scratch, tubes), MeshResult::Ok);
    const auto tree = meshTree(fork(), {});
    ASSERT_TRUE(tree);
    EXPECT_EQ(*tree, tubes);
    EXPECT_EQ(hashOf(*tree), hashOf(tubes));
}

TEST(TreeMesher, ShapesNeedNoWood)
{
    Skeleton point = polygon(lobedLeaf());
    grow(point, kNoSegment, {0, 0, 0});
    completeAxes(point, {});
    for (const Skeleton& skeleton : {point, polygon(lobedLeaf()), sphere(1), organ(1)})
    {
        const auto mesh = meshTree(skeleton, {});
        ASSERT_TRUE(mesh);
        expectGoodMesh(*mesh);
    }
}

TEST(TreeMesher, WoodFirstThenShapesEachByColour)
{
    Skeleton skeleton = fork();
    const std::uint32_t branch = 3; // the first segment of its axis
    skeleton.materials[branch] = 4;
    addPolygon(skeleton, lobedLeaf(), 2);
    const auto mesh = meshTree(skeleton, {});
    ASSERT_TRUE(mesh);
    ASSERT_EQ(mesh->parts.size(), 3u);
    EXPECT_EQ(mesh->parts[0].material, MeshMaterial::Bark);
    EXPECT_EQ(mesh->parts[0].colour, 0);
    EXPECT_EQ(mesh->parts[1].material, MeshMaterial::Bark);
    EXPECT_EQ(mesh->parts[1].colour, 4);
    EXPECT_EQ(mesh->parts[2].material, MeshMaterial::Surface);
    EXPECT_EQ(mesh->parts[2].colour, 2);

    // Colours sort triangles into parts and change nothing else.
    Skeleton plain = skeleton;
    plain.materials[branch] = 0;
    const auto same = meshTree(plain, {});
    ASSERT_TRUE(same);
    EXPECT_EQ(same->positions, mesh->positions);
    EXPECT_EQ(same->indices, mesh->indices) << "the branch's tube was the last already";
    EXPECT_NE(hashOf(*same), hashOf(*mesh));
}

TEST(TreeMesher, OverTheLimitTheMeshIsUntouched)
{
    Skeleton skeleton = fork();
    addPolygon(skeleton, lobedLeaf());
    const auto whole = meshTree(skeleton, {});
    ASSERT_TRUE(whole);
    const Limits limits{.vertices = static_cast<std::uint32_t>(whole->positions.size() - 1)};
    const auto refused = meshTree(skeleton, {}, {}, limits);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().kind, ErrorKind::Limit);

    MeshScratch scratch;
    TreeMesh mesh = meshed(sphere(1)).mesh;
    const TreeMesh before = mesh;
    EXPECT_EQ(meshTree(skeleton, {}, {}, limits, scratch, mesh), MeshResult::TooManyVertices);
    EXPECT_EQ(mesh, before);
}

} // namespace espalier
