#include <Espalier/Core/Random.h>
#include <Espalier/Mesh/Impostor.h>
#include <Espalier/Mesh/TreeMesh.h>
#include <Espalier/Plant/Skeleton.h>
#include <cmath>
#include <gtest/gtest.h>

namespace espalier {

namespace {

Vec3 randomPoint(std::uint32_t i)
{
    const RandomKey key = RandomKey(Seed{7}).child(i);
    const auto next = [&](std::uint32_t k) { return static_cast<float>(key.uniform(Purpose::Sampling, k)) * 2 - 1; };
    const float x = next(0);
    const float y = next(1);
    return {x, y, next(2)};
}

/// Small triangles all over a box from y = 0 upwards.
TreeMesh cloud(std::uint32_t triangles)
{
    TreeMesh mesh;
    for (std::uint32_t i = 0; i < triangles; ++i)
    {
        const Vec3 at = randomPoint(i) * Vec3(3, 4, 2) + Vec3(1, 4, 0);
        for (const Vec3 corner : {Vec3(0, 0, 0), Vec3(0.2f, 0, 0), Vec3(0, 0.2f, 0.1f)})
        {
            mesh.indices.push_back(static_cast<std::uint32_t>(mesh.positions.size()));
            mesh.positions.push_back(at + corner);
        }
    }
    mesh.normals.assign(mesh.positions.size(), Vec3(0, 0, 1));
    mesh.tangents.assign(mesh.positions.size(), Vec4(1, 0, 0, 1));
    mesh.uvs.assign(mesh.positions.size(), Vec2(0));
    mesh.parts = {{MeshMaterial::Bark, 0, static_cast<std::uint32_t>(mesh.indices.size())}};
    return mesh;
}

} // namespace

TEST(Impostor, AnyDirectionAboveTheHorizonReturnsFromTheSquare)
{
    for (std::uint32_t i = 0; i < 2000; ++i)
    {
        Vec3 direction = glm::normalize(randomPoint(i));
        direction.y = std::abs(direction.y);
        const Vec2 square = hemiOctahedral(direction);
        EXPECT_GE(std::min(square.x, square.y), 0);
        EXPECT_LE(std::max(square.x, square.y), 1);
        EXPECT_LT(glm::length(hemiDirection(square) - direction), 1e-5f);
    }
    EXPECT_EQ(hemiOctahedral({0, 1, 0}), Vec2(0.5f));
    EXPECT_EQ(hemiOctahedral({0, 0, 0}), Vec2(0.5f));
    EXPECT_EQ(hemiOctahedral({0, -1, 2}), hemiOctahedral({0, 0, 1}));
    EXPECT_EQ(hemiOctahedral({0, -1, 0}), Vec2(0.5f));
}

TEST(Impostor, BlendsTheFramesRoundADirection)
{
    constexpr std::uint32_t kSide = 9;
    for (std::uint32_t i = 0; i < 2000; ++i)
    {
        Vec3 direction = glm::normalize(randomPoint(i));
        direction.y = std::abs(direction.y);
        const FrameBlend blend = framesFor(direction, kSide);
        Vec2 mean(0);
        float sum = 0;
        for (std::size_t k = 0; k < 3; ++k)
        {
            ASSERT_LT(blend.frames[k], kSide * kSide);
            EXPECT_GE(blend.shares[k], -1e-6f);
            sum += blend.shares[k];
            mean += blend.shares[k] *
                    Vec2(static_cast<float>(blend.frames[k] % kSide), static_cast<float>(blend.frames[k] / kSide));
        }
        EXPECT_NEAR(sum, 1, 1e-5f);
        EXPECT_LT(glm::length(mean / static_cast<float>(kSide - 1) - hemiOctahedral(direction)), 1e-5f);
    }
}

TEST(Impostor, AFrameIsAloneInItsOwnDirection)
{
    const Impostor impostor = makeImpostor(cloud(20), ImpostorKind::Octahedral, 6);
    ASSERT_EQ(impostor.frames.size(), 36u);
    for (std::uint32_t i = 0; i < 36; ++i)
    {
        const FrameBlend blend = framesFor(impostor.frames[i].toViewer, 6);
        float own = 0;
        for (std::size_t k = 0; k < 3; ++k)
            own += blend.frames[k] == i ? blend.shares[k] : 0;
        EXPECT_NEAR(own, 1, 1e-4f) << i;
    }
}

TEST(Impostor, EveryFrameHoldsTheWholePlantOffItsRim)
{
    const TreeMesh mesh = cloud(400);
    for (const ImpostorKind kind : {ImpostorKind::Cards, ImpostorKind::Octahedral})
    {
        const Impostor impostor = makeImpostor(mesh, kind, 7);
        EXPECT_EQ(impostor.frames.size(), impostor.columns * impostor.rows);
        for (const ImpostorFrame& frame : impostor.frames)
        {
            EXPECT_NEAR(glm::length(frame.toViewer), 1, 1e-5f);
            EXPECT_NEAR(glm::length(frame.right), 1, 1e-5f);
            EXPECT_LT(glm::length(frame.up - glm::cross(frame.toViewer, frame.right)), 1e-5f);
            for (const Vec3& p : mesh.positions)
            {
                EXPECT_LT(std::abs(glm::dot(p - frame.middle, frame.right)), 0.97f * frame.halfExtent.x);
                EXPECT_LT(std::abs(glm::dot(p - frame.middle, frame.up)), 0.97f * frame.halfExtent.y);
            }
        }
    }
}

TEST(Impostor, CardsLieBackToBackEachWithItsOwnFront)
{
    TreeMesh mesh;
    meshCards(makeImpostor(cloud(50), ImpostorKind::Cards), mesh);
    ASSERT_EQ(mesh.indices.size(), 3 * 16u);
    ASSERT_EQ(mesh.parts.size(), 1u);
    EXPECT_EQ(mesh.parts[0].material, MeshMaterial::Cards);
    Vec3 allFaces(0);
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3)
    {
        const std::uint32_t* corner = &mesh.indices[i];
        const Vec3 along = mesh.positions[corner[1]] - mesh.positions[corner[0]];
        const Vec3 across = mesh.positions[corner[2]] - mesh.positions[corner[0]];
        const Vec3 face = glm::normalize(glm::cross(along, across));
        allFaces += face;
        const Vec2 uAlong = mesh.uvs[corner[1]] - mesh.uvs[corner[0]];
        const Vec2 uAcross = mesh.uvs[corner[2]] - mesh.uvs[corner[0]];
        const float area = uAlong.x * uAcross.y - uAlong.y * uAcross.x;
        const Vec3 u = (along * uAcross.y - across * uAlong.y) / area;
        const Vec3 v = (across * uAlong.x - along * uAcross.x) / area;
        for (std::size_t k = 0; k < 3; ++k)
        {
            const Vec3 normal = mesh.normals[corner[k]];
            const Vec4 tangent = mesh.tangents[corner[k]];
            EXPECT_GT(glm::dot(face, normal), 0.9999f);
            EXPECT_GT(glm::dot(Vec3(tangent), glm::normalize(u)), 0.9999f);
            EXPECT_GT(glm::dot(tangent.w * glm::cross(normal, Vec3(tangent)), glm::normalize(v)), 0.9999f);
        }
    }
    EXPECT_LT(glm::length(allFaces), 1e-4f);
}

TEST(Impostor, CardsMayFollowOtherTriangles)
{
    TreeMesh mesh = cloud(3);
    mesh.tints.assign(mesh.positions.size(), Tint{1, 2, 3});
    mesh.sources.assign(mesh.positions.size(), VertexSource{});
    const TreeMesh before = mesh;
    meshCards(makeImpostor(before, ImpostorKind::Cards), mesh);
    EXPECT_EQ(mesh.tints.size(), mesh.positions.size());
    EXPECT_EQ(mesh.tints.back(), Tint{});
    EXPECT_EQ(mesh.sources.front().segment, 0u);
    EXPECT_EQ(mesh.sources.back().segment, kNoSegment);
    ASSERT_EQ(mesh.parts.size(), 2u);
    EXPECT_EQ(mesh.parts[1].firstIndex, before.indices.size());
    EXPECT_GE(mesh.indices[before.indices.size()], before.positions.size());
}

TEST(Impostor, CardsAreNeverForPlantsOfManyPixels)
{
    const Impostor cards = makeImpostor(cloud(50), ImpostorKind::Cards);
    float height = 0;
    for (const ImpostorFrame& frame : cards.frames)
        height = std::max(height, 2 * frame.halfExtent.y);
    EXPECT_GT(impostorError(cards, 128), impostorError(cards, 256));
    EXPECT_EQ(impostorError(cards, 2048), impostorError(cards, 4096));
    EXPECT_FLOAT_EQ(impostorError(cards, 4096), height / 96);
}

TEST(Impostor, NothingHasNoFramesAndOctahedralOnesNoMesh)
{
    EXPECT_TRUE(makeImpostor({}, ImpostorKind::Cards).frames.empty());
    TreeMesh mesh;
    meshCards(makeImpostor({}, ImpostorKind::Cards), mesh);
    meshCards(makeImpostor(cloud(3), ImpostorKind::Octahedral), mesh);
    EXPECT_TRUE(mesh.positions.empty());
    EXPECT_TRUE(mesh.parts.empty());
    EXPECT_EQ(makeImpostor(cloud(3), ImpostorKind::Octahedral, 0).columns, kMinImpostorSide);
    EXPECT_EQ(makeImpostor(cloud(3), ImpostorKind::Octahedral, 1000).columns, kMaxImpostorSide);
}

} // namespace espalier
