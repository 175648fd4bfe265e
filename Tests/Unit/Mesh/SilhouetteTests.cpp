#include <Espalier/Mesh/Silhouette.h>
#include <Espalier/Species/LeafOutline.h>
#include <gtest/gtest.h>

namespace espalier {

namespace {

/// A rectangle that faces +Z, its corners mapped to [0, 1].
TreeMesh rectangle(Vec2 low, Vec2 high, MeshMaterial material = MeshMaterial::Surface)
{
    TreeMesh mesh;
    mesh.positions = {{low.x, low.y, 0}, {high.x, low.y, 0}, {high.x, high.y, 0}, {low.x, high.y, 0}};
    mesh.normals.assign(4, Vec3(0, 0, 1));
    mesh.tangents.assign(4, Vec4(1, 0, 0, 1));
    mesh.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    mesh.indices = {0, 1, 2, 0, 2, 3};
    mesh.parts = {{.material = material, .firstIndex = 0, .indexCount = 6}};
    return mesh;
}

SilhouetteDifference compared(const TreeMesh& full, const TreeMesh& coarse, float pixel,
                              std::span<const LeafAppearance> kinds = {})
{
    SilhouetteScratch scratch;
    return compareSilhouettes(full, coarse, kinds, pixel, scratch);
}

} // namespace

TEST(Silhouette, TheSameMeshLooksTheSame)
{
    const TreeMesh mesh = rectangle({-1, 0}, {1, 3});
    const SilhouetteDifference difference = compared(mesh, mesh, 0.1f);
    EXPECT_EQ(difference.coverage, 1);
    EXPECT_EQ(difference.outline, 0);
}

TEST(Silhouette, HalfOfItCoversHalfAndMissesHalf)
{
    const SilhouetteDifference difference = compared(rectangle({-1, 0}, {1, 4}), rectangle({-1, 0}, {1, 2}), 0.05f);
    EXPECT_NEAR(difference.coverage, 0.5f, 0.01f);
    EXPECT_NEAR(difference.outline, 0.5f, 0.01f);
}

TEST(Silhouette, WhatMovesByLessThanAPixelHardlyCounts)
{
    const TreeMesh full = rectangle({-1, 0}, {1, 4});
    const TreeMesh moved = rectangle({-1, 0.05f}, {1, 4.05f});
    EXPECT_LT(compared(full, moved, 0.5f).outline, 0.06f);
    EXPECT_GT(compared(full, rectangle({-1, 1}, {1, 5}), 0.5f).outline, 0.4f);
    EXPECT_NEAR(compared(full, moved, 0.5f).coverage, 1, 0.02f);
}

TEST(Silhouette, LeavesAreCutOut)
{
    LeafAppearance leaf;
    leaf.width = 1;
    const TreeMesh whole = rectangle({-1, 0}, {1, 2});
    const TreeMesh cut = rectangle({-1, 0}, {1, 2}, MeshMaterial::Leaves);
    EXPECT_NEAR(compared(whole, cut, 0.05f, {&leaf, 1}).coverage, LeafSurface(leaf).coverage(), 0.02f);
}

TEST(Silhouette, NothingComparesAsTheSame)
{
    const SilhouetteDifference difference = compared({}, rectangle({-1, 0}, {1, 2}), 0.1f);
    EXPECT_EQ(difference.coverage, 1);
    EXPECT_EQ(difference.outline, 0);
}

} // namespace espalier
