#include <Espalier/Archetype/Placement.h>
#include <Espalier/Core/Random.h>
#include <Espalier/Mesh/Collision.h>
#include <Espalier/Plant/Axes.h>
#include <Mesh/HullCheck.h>
#include <Plant/SampleSkeletons.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <gtest/gtest.h>
#include <limits>
#include <map>
#include <set>

namespace espalier {

namespace {

constexpr std::array<const char*, 5> kDrawn{"Thesis", "Oak", "Spruce", "Palm", "Willow"};

Skeleton drawn(const std::string& name)
{
    const std::filesystem::path root = ESPALIER_SOURCE_ROOT;
    Skeleton skeleton =
        drawArchetype(loadArchetype(root / "Content" / (name + ".archetype"), {{root / "Templates"}}).value()).value();
    completeAxes(skeleton, suggestPipes(skeleton));
    return skeleton;
}

Capsules capsulesOf(const Skeleton& skeleton, const CapsuleSettings& settings = {})
{
    CollisionScratch scratch;
    Capsules shape;
    EXPECT_EQ(woodCapsules(skeleton, settings, scratch, shape), CollisionResult::Ok);
    return shape;
}

/// Metres that `place` lies outside of a capsule; negative inside.
float outside(const Capsule& capsule, const Vec3& place)
{
    const Vec3 way = capsule.to - capsule.from;
    const float square = glm::dot(way, way);
    const float along = square > 0 ? std::clamp(glm::dot(place - capsule.from, way) / square, 0.f, 1.f) : 0.f;
    return glm::length(place - capsule.from - along * way) - capsule.radius;
}

float outside(const Capsules& shape, const Vec3& place)
{
    float least = std::numeric_limits<float>::infinity();
    for (const Capsule& capsule : shape.capsules)
        least = std::min(least, outside(capsule, place));
    return least;
}

/// Places on the surface of a segment's cone.
std::vector<Vec3> surfaceOf(const Skeleton& skeleton, std::uint32_t segment)
{
    std::vector<Vec3> places;
    const Vec3 way = skeleton.ends[segment] - skeleton.starts[segment];
    const float length = glm::length(way);
    const Vec3 axis = length > 0 ? way / length : Vec3(0, 1, 0);
    const Vec3 side = glm::normalize(glm::cross(axis, std::abs(axis.x) < 0.8f ? Vec3(1, 0, 0) : Vec3(0, 1, 0)));
    const Vec3 other = glm::cross(axis, side);
    for (const float share : {0.f, 0.25f, 0.5f, 0.75f, 1.f})
        for (const Vec3& aside : {side, -side, other, -other})
            places.push_back(skeleton.starts[segment] + share * way +
                             glm::mix(skeleton.startRadii[segment], skeleton.endRadii[segment], share) * aside);
    return places;
}

CollisionMesh meshOf(const Skeleton& skeleton, const CollisionMeshSettings& settings = {})
{
    CollisionScratch scratch;
    CollisionMesh shape;
    EXPECT_EQ(collisionMesh(skeleton, settings, scratch, shape), CollisionResult::Ok);
    return shape;
}

double volumeOf(const CollisionMesh& shape)
{
    double volume = 0;
    for (std::size_t t = 0; t < shape.indices.size(); t += 3)
    {
        const DVec3 a(shape.vertices[shape.indices[t]]);
        const DVec3 b(shape.vertices[shape.indices[t + 1]]);
        const DVec3 c(shape.vertices[shape.indices[t + 2]]);
        volume += glm::dot(a, glm::cross(b, c)) / 6;
    }
    return volume;
}

} // namespace

TEST(Collision, AnswersPlantsWithoutShape)
{
    CollisionScratch scratch;
    Capsules capsules;
    ConvexHull hull;
    CollisionMesh mesh;
    Skeleton broken = samples::fork();
    broken.ends[1].x = std::numeric_limits<float>::quiet_NaN();
    Skeleton far = samples::fork();
    far.ends[1].x = 2e5f;
    Skeleton thin = samples::straightTrunk({.radius = 0.01f, .endRadius = 0.005f});
    struct Case
    {
        const char* name;
        const Skeleton& skeleton;
        CollisionResult wood;
        CollisionResult crown;
    };
    using enum CollisionResult;
    const Skeleton empty;
    const Skeleton flat = samples::fork({.tipRadius = 0.05f});
    for (const Case& c :
         {Case{"empty", empty, EmptySkeleton, EmptySkeleton}, Case{"broken", broken, UnsoundSkeleton, UnsoundSkeleton},
          Case{"far", far, UnsoundSkeleton, UnsoundSkeleton}, Case{"thin and straight", thin, EmptySkeleton, NoVolume},
          Case{"flat", flat, Ok, NoVolume}})
    {
        SCOPED_TRACE(c.name);
        capsules.capsules.resize(1);
        hull.vertices.resize(1);
        mesh.vertices.resize(1);
        EXPECT_EQ(woodCapsules(c.skeleton, {}, scratch, capsules), c.wood);
        EXPECT_EQ(crownHull(c.skeleton, 32, scratch, hull), c.crown);
        EXPECT_EQ(collisionMesh(c.skeleton, {}, scratch, mesh), c.wood);
        if (c.wood != Ok)
        {
            EXPECT_EQ(capsules, Capsules{});
            EXPECT_EQ(mesh, CollisionMesh{});
            EXPECT_FALSE(reasonOf(c.wood).empty());
        }
        EXPECT_EQ(hull, ConvexHull{});
    }
}

TEST(Collision, IsOneCapsuleForAStraightTrunk)
{
    const Skeleton trunk = samples::straightTrunk({.length = 3, .segments = 6, .radius = 0.1f, .endRadius = 0.08f});
    const Capsules shape = capsulesOf(trunk);
    ASSERT_EQ(shape.capsules.size(), 1u);
    EXPECT_EQ(shape.capsules[0].from, Vec3(0));
    EXPECT_NEAR(shape.capsules[0].to.y, 3, 1e-5);
    EXPECT_NEAR(shape.capsules[0].radius, 0.1f, 1e-6);
    EXPECT_NEAR(shape.gap, 0.02f, 1e-6);
    EXPECT_EQ(shape.volumeShare, 1);

    // One segment that tapers by more than the tolerance is cut.
    const Capsules cone = capsulesOf(samples::straightTrunk({.segments = 1, .radius = 0.2f, .endRadius = 0.05f}));
    EXPECT_EQ(cone.capsules.size(), 3u);
    EXPECT_LE(cone.gap, 0.06f);
    EXPECT_NEAR(cone.volumeShare, 1, 1e-6);
}

TEST(Collision, HoldsTheThickWoodWhole)
{
    for (const char* name : kDrawn)
    {
        const Skeleton skeleton = drawn(name);
        const CapsuleSettings all{.mostCapsules = 65536, .tolerance = 0.05f, .thinnest = 0.03f};
        const Capsules shape = capsulesOf(skeleton, all);
        EXPECT_LE(shape.gap, all.tolerance + 1e-5f);
        float farthest = 0;
        std::size_t thick = 0;
        for (std::uint32_t i = 0; i < skeleton.size(); ++i)
            if (skeleton.startRadii[i] >= all.thinnest)
            {
                ++thick;
                for (const Vec3& place : surfaceOf(skeleton, i))
                    farthest = std::max(farthest, outside(shape, place));
            }
        EXPECT_LE(farthest, 1e-4f) << name;
        EXPECT_LT(shape.capsules.size(), thick) << name;
    }
}

/// On the wall of a capsule there is wood within the gap.
TEST(Collision, StandsOffTheWoodByNoMoreThanItSays)
{
    for (const char* name : kDrawn)
    {
        const Skeleton skeleton = drawn(name);
        const Capsules shape = capsulesOf(skeleton, {.mostCapsules = 40});
        for (const Capsule& capsule : shape.capsules)
        {
            const Vec3 way = capsule.to - capsule.from;
            const Vec3 side = glm::normalize(
                glm::cross(way, std::abs(way.x) < 0.8f * glm::length(way) ? Vec3(1, 0, 0) : Vec3(0, 1, 0)));
            for (const float share : {0.1f, 0.5f, 0.9f})
            {
                const Vec3 place = capsule.from + share * way + capsule.radius * side;
                float nearest = std::numeric_limits<float>::infinity();
                for (std::uint32_t i = 0; i < skeleton.size(); ++i)
                {
                    const Vec3 along = skeleton.ends[i] - skeleton.starts[i];
                    const float square = glm::dot(along, along);
                    const float t =
                        square > 0 ? std::clamp(glm::dot(place - skeleton.starts[i], along) / square, 0.f, 1.f) : 0.f;
                    const float radius = glm::mix(skeleton.startRadii[i], skeleton.endRadii[i], t);
                    nearest = std::min(nearest, glm::length(place - skeleton.starts[i] - t * along) - radius);
                }
                EXPECT_LE(nearest, shape.gap + 1e-4f) << name;
            }
        }
    }
}

TEST(Collision, HoldsMoreWoodWithMoreCapsules)
{
    for (const char* name : kDrawn)
    {
        const Skeleton skeleton = drawn(name);
        Capsules before;
        for (const std::uint32_t most : {1u, 4u, 8u, 16u, 32u, 64u, 1000u})
        {
            const Capsules shape = capsulesOf(skeleton, {.mostCapsules = most});
            EXPECT_LE(shape.capsules.size(), most);
            EXPECT_GE(shape.volumeShare, before.volumeShare);
            ASSERT_GE(shape.capsules.size(), before.capsules.size());
            EXPECT_TRUE(std::equal(before.capsules.begin(), before.capsules.end(), shape.capsules.begin()));
            before = shape;
            RecordProperty(std::string(name) + std::to_string(most), std::to_string(shape.volumeShare));
        }
        EXPECT_GT(capsulesOf(skeleton).volumeShare, 0.5f) << name;
    }
}

TEST(Collision, PutsAHullRoundTheCrown)
{
    for (const char* name : kDrawn)
    {
        const Skeleton skeleton = drawn(name);
        CollisionScratch scratch;
        if (name == kDrawn[0])
            continue; // flat
        std::vector<Vec3> crown;
        for (std::uint32_t i = 0; i < skeleton.size(); ++i)
            if (skeleton.orders[i] > 0)
                crown.push_back(skeleton.ends[i]);
        for (const std::uint32_t most : {8u, 24u, 64u, 100000u})
        {
            ConvexHull hull;
            ASSERT_EQ(crownHull(skeleton, most, scratch, hull), CollisionResult::Ok) << name;
            EXPECT_LE(hull.vertices.size(), most);
            EXPECT_LE(farthestOutside(hull, crown), 3 * static_cast<double>(hull.tolerance)) << name << ", " << most;
            RecordProperty(std::string(name) + std::to_string(most),
                           std::to_string(hull.vertices.size()) + " " + std::to_string(hull.overreach));
        }
    }
}

TEST(Collision, LeavesTheBareTrunkOutOfTheHull)
{
    Skeleton skeleton;
    std::uint32_t trunk = samples::grow(skeleton, kNoSegment, {0, 3, 0});
    for (const Vec3 step : {Vec3(1, 1, 0), Vec3(-1, 1, 0.5f), Vec3(0, 1, -1)})
        samples::grow(skeleton, trunk, step);
    trunk = samples::grow(skeleton, trunk, {0, 2, 0});
    samples::grow(skeleton, trunk, {0, 1, 0});
    completeAxes(skeleton, {.tipRadius = 0.05f});
    CollisionScratch scratch;
    ConvexHull hull;
    ASSERT_EQ(crownHull(skeleton, 32, scratch, hull), CollisionResult::Ok);
    for (const Vec3& vertex : hull.vertices)
        EXPECT_GE(vertex.y, 3 - 1e-4f);
    EXPECT_EQ(hull.vertices.size(), 5u);
}

TEST(Collision, MeshesAreClosedAndWithinTheirBudget)
{
    for (const char* name : kDrawn)
    {
        const Skeleton skeleton = drawn(name);
        std::uint32_t before = 0;
        for (const std::uint32_t most : {60u, 200u, 500u, 2000u})
        {
            SCOPED_TRACE(std::string(name) + ", " + std::to_string(most));
            const CollisionMesh shape = meshOf(skeleton, {.mostTriangles = most});
            EXPECT_LE(shape.indices.size() / 3, most);
            EXPECT_GE(shape.axes, before);
            before = shape.axes;
            std::map<std::array<std::uint32_t, 2>, int> edges;
            std::set<std::array<float, 3>> places;
            for (std::size_t t = 0; t < shape.indices.size(); t += 3)
                for (std::size_t k = 0; k < 3; ++k)
                {
                    const std::uint32_t a = shape.indices[t + k];
                    const std::uint32_t b = shape.indices[t + (k + 1) % 3];
                    ASSERT_LT(a, shape.vertices.size());
                    ++edges[{a, b}];
                    --edges[{b, a}];
                }
            for (const auto& [edge, balance] : edges)
                EXPECT_EQ(balance, 0) << "an open edge";
            for (const Vec3& vertex : shape.vertices)
                EXPECT_TRUE(places.insert({vertex.x, vertex.y, vertex.z}).second) << "a place twice";
            EXPECT_GT(volumeOf(shape), 0) << "faces outwards";
            RecordProperty(std::string(name) + std::to_string(most),
                           std::to_string(shape.axes) + " " + std::to_string(shape.indices.size() / 3));
        }
    }
    CollisionScratch scratch;
    CollisionMesh shape;
    Skeleton zigzag;
    std::uint32_t last = kNoSegment;
    for (int i = 0; i < 200; ++i)
        last = samples::grow(zigzag, last, {i % 2 ? 0.5f : -0.5f, 0.5f, 0});
    completeAxes(zigzag, {.tipRadius = 0.1f});
    EXPECT_EQ(collisionMesh(zigzag, {.mostTriangles = 60}, scratch, shape), CollisionResult::Ok);
    EXPECT_LE(shape.indices.size() / 3, 60u);
}

TEST(Collision, PutsUpWithAilingPlants)
{
    CollisionScratch scratch;
    for (std::uint64_t seed = 0; seed < 100; ++seed)
    {
        const Skeleton skeleton = samples::randomTree(seed, 60, samples::Ailments::All);
        Capsules capsules;
        ConvexHull hull;
        CollisionMesh mesh;
        const CollisionResult wood = woodCapsules(skeleton, {}, scratch, capsules);
        if (wood == CollisionResult::Ok)
        {
            EXPECT_LE(capsules.capsules.size(), 32u);
            for (const Capsule& capsule : capsules.capsules)
                EXPECT_TRUE(std::isfinite(capsule.radius) && capsule.radius > 0);
            EXPECT_TRUE(capsules.volumeShare > 0 && capsules.volumeShare <= 1) << capsules.volumeShare;
        }
        EXPECT_EQ(crownHull(skeleton, 16, scratch, hull), CollisionResult::Ok);
        if (collisionMesh(skeleton, {.mostTriangles = 200}, scratch, mesh) == CollisionResult::Ok)
        {
            EXPECT_LE(mesh.indices.size(), 600u);
        }
    }
}

TEST(Collision, IsReproducible)
{
    CollisionScratch scratch;
    for (const char* name : kDrawn)
    {
        const Skeleton skeleton = drawn(name);
        Capsules capsules;
        ConvexHull hull;
        CollisionMesh mesh;
        ASSERT_EQ(woodCapsules(skeleton, {}, scratch, capsules), CollisionResult::Ok);
        const CollisionResult crown = crownHull(skeleton, 32, scratch, hull);
        EXPECT_EQ(crown, name == kDrawn[0] ? CollisionResult::NoVolume : CollisionResult::Ok) << "the thesis' is flat";
        ASSERT_EQ(collisionMesh(skeleton, {}, scratch, mesh), CollisionResult::Ok);
        EXPECT_EQ(capsules, capsulesOf(skeleton));
        EXPECT_EQ(mesh, meshOf(skeleton));
        CollisionScratch fresh;
        ConvexHull again;
        EXPECT_EQ(crownHull(skeleton, 32, fresh, again), crown);
        EXPECT_EQ(hull, again);
    }
}

} // namespace espalier
