#include <Espalier/Render/LineDrawing.h>

#include <Espalier/Mesh/TreeMesher.h>
#include <Espalier/Render/Render.h>
#include <Espalier/Species/Appearance.h>
#include <Plant/SampleSkeletons.h>
#include <gtest/gtest.h>

namespace espalier {
namespace {

using namespace samples;

/// Steps to the right and up in turn, each a metre, as thin as a hair.
Skeleton staircase(std::uint32_t steps)
{
    Skeleton skeleton;
    skeleton.widthsGiven = true;
    std::uint32_t last = kNoSegment;
    for (std::uint32_t i = 0; i < steps; ++i)
        last = grow(skeleton, last, i % 2 == 0 ? Vec3(0, 1, 0) : Vec3(1, 0, 0), 1e-4f);
    completeAxes(skeleton, {});
    return skeleton;
}

RenderSettings small()
{
    RenderSettings settings;
    settings.width = 64;
    settings.height = 64;
    settings.samplesPerPixel = 16;
    return settings;
}

} // namespace

TEST(LineDrawing, NothingToThicken)
{
    Skeleton none;
    thickenLines(none, 2, small());
    EXPECT_EQ(none, Skeleton{});
    const Skeleton before = staircase(8);
    for (const float pixels : {0.f, -1.f})
    {
        Skeleton after = before;
        thickenLines(after, pixels, small());
        EXPECT_EQ(after, before);
    }
}

TEST(LineDrawing, RaisesOnlyWhatIsThinner)
{
    Skeleton skeleton = straightTrunk({.length = 57.6f, .radius = 3, .endRadius = 0.1f});
    const std::vector<float> before = skeleton.startRadii;
    RenderSettings level = small();
    level.cameraElevation = 0;
    thickenLines(skeleton, 2, level); // 57.6 metres fill nine tenths of 64 pixels: a metre each
    for (std::uint32_t i = 0; i < skeleton.size(); ++i)
    {
        EXPECT_NEAR(skeleton.startRadii[i], std::max(before[i], 1.f), 1e-4);
        EXPECT_GE(skeleton.endRadii[i], 0.999f);
    }
}

TEST(LineDrawing, ShowsHairsThatAreThinnerThanAPixel)
{
    const auto darkest = [](float pixels) {
        Skeleton skeleton = staircase(40);
        thickenLines(skeleton, pixels, small());
        MeshSettings settings;
        settings.tubes = lineTubes();
        const TreeMesh mesh = meshTree(skeleton, {}, settings).value();
        const Appearance appearance;
        const Picture picture = renderPicture({&mesh, &appearance, ""}, small()).value();
        int least = 255;
        for (std::uint32_t i = 0; i < 64 * 32; ++i) // before the sky
            least = std::min<int>(least, picture.rgb[3 * i + 1]);
        return least;
    };
    EXPECT_GT(darkest(0), 150);
    EXPECT_LT(darkest(2), 120);
}

TEST(LineDrawing, StrokesOfNothing)
{
    Skeleton none;
    divideIntoStrokes(none);
    EXPECT_EQ(none, Skeleton{});
}

TEST(LineDrawing, OneStrokeStaysWhole)
{
    Skeleton skeleton = staircase(6);
    const Skeleton before = skeleton;
    divideIntoStrokes(skeleton);
    EXPECT_EQ(skeleton.parents, before.parents);
    EXPECT_EQ(skeleton.continuations, before.continuations);
    EXPECT_EQ(skeleton.endRadii.back(), skeleton.startRadii.back());
}

TEST(LineDrawing, StrokesEndWhereTheColourChangesOrTheLineBreaks)
{
    Skeleton coloured = staircase(6);
    coloured.materials[3] = coloured.materials[4] = coloured.materials[5] = 2;
    Skeleton broken = staircase(6);
    for (std::uint32_t i = 3; i < 6; ++i)
    {
        broken.starts[i].x += 1;
        broken.ends[i].x += 1;
    }
    for (Skeleton* skeleton : {&coloured, &broken})
    {
        // A branch where the axis ends must not look for what went on there.
        (void)grow(*skeleton, 2, Vec3(0, 0, 1), 1e-4f);
        skeleton->continuations.push_back(kNoSegment);
        skeleton->endRadii.push_back(1e-4f);
        skeleton->orders.push_back(1);
        divideIntoStrokes(*skeleton);
        for (std::uint32_t i = 0; i < skeleton->size(); ++i)
            EXPECT_EQ(skeleton->startsAxis(i), i == 0 || i == 3 || i == 6) << i;
        EXPECT_TRUE(isSound(*skeleton));
        const auto mesh = meshTree(*skeleton, {}, {.tubes = lineTubes()});
        ASSERT_TRUE(mesh);
        EXPECT_EQ(mesh->parts.size(), skeleton == &coloured ? 2u : 1u);
    }
}

TEST(LineDrawing, InkIsDarkerThanWhatItDips)
{
    const Appearance dry;
    Appearance dipped = dry;
    dipInInk(dipped);
    EXPECT_LT(dipped.bark.colour.y, 0.02f);
    ASSERT_EQ(dipped.palette.size(), dry.palette.size());
    for (std::size_t i = 0; i < dry.palette.size(); ++i)
        EXPECT_LT(dipped.palette[i].y, dry.palette[i].y);
}

TEST(LineDrawing, KeepsTheCornersOfAStaircase)
{
    const Skeleton skeleton = staircase(12);
    const TreeMesh mesh = meshTree(skeleton, {}, {.tubes = lineTubes()}).value();
    for (const Vec3& corner : skeleton.ends)
    {
        float nearest = 1;
        for (const Vec3& position : mesh.positions)
            nearest = std::min(nearest, glm::length(position - corner));
        EXPECT_LT(nearest, 0.001f);
    }
}

} // namespace espalier
