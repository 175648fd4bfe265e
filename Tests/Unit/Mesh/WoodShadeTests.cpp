#include <Espalier/Mesh/WoodShade.h>

#include <Espalier/Mesh/DetailLevel.h>
#include <Espalier/Mesh/TreeMesher.h>
#include <Espalier/Plant/Axes.h>
#include <Espalier/Species/Appearance.h>
#include <Plant/SampleSkeletons.h>
#include <gtest/gtest.h>

namespace espalier {

namespace {

/// A ball of leaves, 2 m across, whose middle is 3 m above the ground.
FoliageLight crown()
{
    std::vector<Shader> leaves;
    for (int x = -10; x <= 10; ++x)
        for (int y = -10; y <= 10; ++y)
            for (int z = -10; z <= 10; ++z)
                if (x * x + y * y + z * z <= 100)
                    leaves.push_back({Vec3(x, y, z) * 0.1f + Vec3(0, 3, 0), 0.008f});
    FoliageLight light;
    light.measure(leaves);
    return light;
}

TreeMesh pointsAt(const std::vector<Vec3>& places)
{
    TreeMesh mesh;
    mesh.resizeVertices(places.size(), {.tints = true});
    mesh.positions.assign(places.begin(), places.end());
    mesh.tints.assign(places.size(), Tint{200, 100, 50, 255});
    return mesh;
}

} // namespace

TEST(WoodShade, DarkensWhatLeavesHide)
{
    TreeMesh mesh = pointsAt({{0, 2.6f, 0}, {0, 3.9f, 0}, {0, 0, 0}, {0, 1.7f, 0}, {0, 2.6f, 0}});
    shadeWood(crown(), 0.6f, 0, mesh.positions.size(), mesh);
    EXPECT_LT(mesh.tints[0].red, 130) << "deep inside";
    EXPECT_GT(mesh.tints[1].red, 140) << "at the top";
    EXPECT_GT(mesh.tints[2].red, 195) << "a trunk's foot, to which light comes from the sides";
    EXPECT_LT(mesh.tints[0].red, mesh.tints[3].red) << "just below";
    EXPECT_EQ(mesh.tints[0], mesh.tints[4]);
    for (const Tint& tint : mesh.tints)
    {
        EXPECT_EQ(tint.alpha, 255);
        EXPECT_NEAR(tint.green, tint.red / 2, 1);
    }
}

TEST(WoodShade, LeavesTintsWhereThereIsNothingToDo)
{
    const TreeMesh before = pointsAt({{0, 2.6f, 0}, {0, 3, 0}});
    TreeMesh mesh = before;
    shadeWood({}, 1, 0, mesh.positions.size(), mesh);
    shadeWood(crown(), 0, 0, mesh.positions.size(), mesh);
    shadeWood(crown(), 1, 2, mesh.positions.size(), mesh);
    EXPECT_EQ(mesh.tints, before.tints);
    mesh.tints.clear();
    shadeWood(crown(), 1, 0, mesh.positions.size(), mesh);
    EXPECT_TRUE(mesh.tints.empty());
    mesh = {};
    shadeWood(crown(), 1, 0, 0, mesh);
}

TEST(WoodShade, IsTheSameAtEveryLevelOfDetail)
{
    Skeleton skeleton = samples::randomTree(3, 400);
    Appearance appearance;
    appearance.leaves.push_back({.thickestWood = 1, .spacing = 0.02f});
    DetailScratch scratch;
    TreeMesh full;
    ASSERT_EQ(meshDetailLevel(skeleton, appearance, 0, {}, {}, scratch, full).result, MeshResult::Ok);
    const TreeMesh direct = meshTree(skeleton, appearance, {}).value();
    ASSERT_EQ(full.tints.size(), direct.tints.size());
    EXPECT_EQ(full.tints, direct.tints);
    Appearance bright = appearance;
    bright.bark.shade = 0;
    const TreeMesh unshaded = meshTree(skeleton, bright, {}).value();
    EXPECT_NE(unshaded.tints, direct.tints);
    EXPECT_EQ(unshaded.positions, direct.positions);
}

} // namespace espalier
