#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Mesh/TubeMesher.h>
#include <Espalier/Species/Appearance.h>
#include <Mesh/SurfaceCheck.h>
#include <Plant/SampleSkeletons.h>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <map>
#include <tuple>

namespace espalier {
namespace {

using namespace samples;

/// Plain tubes: nothing but what the skeleton says.
constexpr TubeSettings kPlain{.collarFlare = 0, .rootFlare = 0};

struct Meshed
{
    MeshResult result;
    TubeScratch scratch;
    TreeMesh mesh;
};

Meshed meshed(const Skeleton& skeleton, const TubeSettings& settings = {}, const BarkAppearance& bark = {})
{
    Meshed m;
    m.result = meshTubes(skeleton, bark, settings, Limits{}, m.scratch, m.mesh);
    return m;
}

/// Enclosed volume by the divergence theorem; positive if triangles face outwards.
double volumeOf(const TreeMesh& mesh)
{
    double volume = 0;
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3)
    {
        const DVec3 a(mesh.positions[mesh.indices[i]]);
        const DVec3 b(mesh.positions[mesh.indices[i + 1]]);
        const DVec3 c(mesh.positions[mesh.indices[i + 2]]);
        volume += glm::dot(a, glm::cross(b, c)) / 6.0;
    }
    return volume;
}

/// Positions made ids, so that seams close.
std::vector<std::uint32_t> weldedIds(const TreeMesh& mesh)
{
    std::map<std::tuple<float, float, float>, std::uint32_t> known;
    std::vector<std::uint32_t> ids;
    for (const Vec3& p : mesh.positions)
        ids.push_back(known.try_emplace({p.x, p.y, p.z}, static_cast<std::uint32_t>(known.size())).first->second);
    return ids;
}

/// Every edge is passed as often one way as the other: the surface has no border. In a skeleton without coincidences,
/// exactly once each way.
void expectClosed(const TreeMesh& mesh, bool isPlain, std::uint64_t seed)
{
    const std::vector<std::uint32_t> ids = weldedIds(mesh);
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3)
    {
        for (std::size_t k = 0; k < 3; ++k)
        {
            const std::uint32_t a = ids[mesh.indices[i + k]];
            const std::uint32_t b = ids[mesh.indices[i + (k + 1) % 3]];
            if (a != b)
                ++edges[{a, b}];
        }
    }
    for (const auto& [edge, count] : edges)
    {
        const auto back = edges.find({edge.second, edge.first});
        ASSERT_TRUE(back != edges.end() && back->second == count) << "seed " << seed;
        if (isPlain)
        {
            ASSERT_EQ(count, 1) << "seed " << seed;
        }
    }
}

void expectGoodVertices(const TreeMesh& mesh, std::uint64_t seed)
{
    ASSERT_EQ(mesh.normals.size(), mesh.positions.size());
    ASSERT_EQ(mesh.tangents.size(), mesh.positions.size());
    ASSERT_EQ(mesh.uvs.size(), mesh.positions.size());
    for (std::size_t i = 0; i < mesh.positions.size(); ++i)
    {
        const Vec3 tangent(mesh.tangents[i]);
        ASSERT_TRUE(std::isfinite(glm::dot(mesh.positions[i], mesh.positions[i]))) << "seed " << seed;
        ASSERT_NEAR(glm::length(mesh.normals[i]), 1, 1e-4) << "seed " << seed;
        ASSERT_NEAR(glm::length(tangent), 1, 1e-4) << "seed " << seed;
        ASSERT_NEAR(glm::dot(tangent, mesh.normals[i]), 0, 1e-4) << "seed " << seed;
        ASSERT_EQ(std::abs(mesh.tangents[i].w), 1.f);
        ASSERT_TRUE(std::isfinite(mesh.uvs[i].x) && std::isfinite(mesh.uvs[i].y)) << "seed " << seed;
    }
    for (const std::uint32_t index : mesh.indices)
        ASSERT_LT(index, mesh.positions.size());
}

TEST(TubeMesher, NothingToSweepLeavesTheMeshAlone)
{
    Skeleton point;
    grow(point, kNoSegment, {0, 0, 0});
    completeAxes(point, {});
    Skeleton thread = straightTrunk({.radius = 0, .endRadius = 0});
    for (const Skeleton& skeleton : {Skeleton{}, point, thread})
    {
        const Meshed m = meshed(skeleton);
        EXPECT_EQ(m.result, MeshResult::EmptySkeleton);
        EXPECT_EQ(m.mesh, TreeMesh{});
    }
}

TEST(TubeMesher, UnsoundSkeletonsAreRefused)
{
    Skeleton notFinite = fork();
    notFinite.ends[2].x = std::numeric_limits<float>::quiet_NaN();
    Skeleton farAway = fork();
    farAway.ends[4].x = 1.01e5f;
    Skeleton tooThick = fork();
    tooThick.startRadii[0] = 1e30f;
    for (const Skeleton& skeleton : {notFinite, farAway, tooThick})
    {
        const Meshed m = meshed(skeleton);
        EXPECT_EQ(m.result, MeshResult::UnsoundSkeleton);
        EXPECT_EQ(m.mesh, TreeMesh{});
    }
}

TEST(TubeMesher, RandomTreesGiveClosedTubesWithGoodVertices)
{
    for (std::uint64_t seed = 0; seed < 60; ++seed)
    {
        const Meshed m = meshed(randomTree(seed, 50));
        ASSERT_EQ(m.result, MeshResult::Ok);
        expectGoodVertices(m.mesh, seed);
        expectClosed(m.mesh, true, seed);
    }
}

TEST(TubeMesher, SickTreesGiveClosedTubesWithGoodVertices)
{
    for (std::uint64_t seed = 0; seed < 200; ++seed)
    {
        const Meshed m = meshed(randomTree(seed, 40, Ailments::All));
        ASSERT_EQ(m.result, MeshResult::Ok);
        expectGoodVertices(m.mesh, seed);
        expectClosed(m.mesh, false, seed);
    }
}

TEST(TubeMesher, SegmentsOfAFewRoundingsFarFromTheOriginGiveNoNaN)
{
    const std::uint64_t seed = 56; // has a segment of 0.5 micrometres, 8 m from the origin
    const Meshed m = meshed(randomTree(seed, 80, Ailments::All));
    ASSERT_EQ(m.result, MeshResult::Ok);
    expectGoodVertices(m.mesh, seed);
    expectClosed(m.mesh, false, seed);
}

TEST(TubeMesher, TrianglesFaceWhereTheirNormalsPoint)
{
    for (std::uint64_t seed = 0; seed < 100; ++seed)
    {
        const TreeMesh mesh = meshed(randomTree(seed, 60)).mesh;
        for (std::size_t i = 0; i < mesh.indices.size(); i += 3)
        {
            const std::uint32_t a = mesh.indices[i];
            const std::uint32_t b = mesh.indices[i + 1];
            const std::uint32_t c = mesh.indices[i + 2];
            const Vec3 face = glm::cross(mesh.positions[b] - mesh.positions[a], mesh.positions[c] - mesh.positions[a]);
            if (glm::length(face) < 1e-9f)
                continue;
            EXPECT_GT(glm::dot(face, mesh.normals[a] + mesh.normals[b] + mesh.normals[c]), 0)
                << "seed " << seed << ", triangle " << i / 3;
        }
    }
}

TEST(TubeMesher, BitangentsRunAlongV)
{
    const TreeMesh mesh = meshed(fork()).mesh;
    std::size_t agreeing = 0;
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3)
    {
        const std::uint32_t a = mesh.indices[i];
        const std::uint32_t b = mesh.indices[i + 1];
        const std::uint32_t c = mesh.indices[i + 2];
        const Vec2 ab = mesh.uvs[b] - mesh.uvs[a];
        const Vec2 ac = mesh.uvs[c] - mesh.uvs[a];
        const Vec3 pab = mesh.positions[b] - mesh.positions[a];
        const Vec3 pac = mesh.positions[c] - mesh.positions[a];
        const float area = ab.x * ac.y - ab.y * ac.x;
        const Vec3 alongU = (pab * ac.y - pac * ab.y) * area;
        const Vec3 alongV = (pac * ab.x - pab * ac.x) * area;
        const Vec3 tangent(mesh.tangents[a]);
        const Vec3 bitangent = mesh.tangents[a].w * glm::cross(mesh.normals[a], tangent);
        agreeing += glm::dot(alongU, tangent) > 0 && glm::dot(alongV, bitangent) > 0 ? 1 : 0;
    }
    // The apex and the crotch's fillet squeeze a few; a wrong sign would fail nearly all.
    EXPECT_GT(agreeing, mesh.indices.size() / 3 * 95 / 100);
}

TEST(TubeMesher, VolumesConvergeToTheClosedForm)
{
    struct Case
    {
        const char* name;
        float radius;
        float endRadius;
    };
    constexpr double kLength = 2.0;
    for (const Case& c : {Case{"cylinder", 0.1f, 0.1f}, Case{"frustum", 0.2f, 0.1f}, Case{"cone", 0.2f, 0.f}})
    {
        const double r0 = static_cast<double>(c.radius);
        const double r1 = static_cast<double>(c.endRadius);
        const double exact =
            math::kPi * kLength / 3 * (r0 * r0 + r0 * r1 + r1 * r1) + 2 * math::kPi / 3 * r1 * r1 * r1; // with dome
        double error = 1;
        for (const std::uint16_t sides : {std::uint16_t{8}, std::uint16_t{16}, std::uint16_t{32}, std::uint16_t{64}})
        {
            TubeSettings settings = kPlain;
            settings.minSides = sides;
            settings.maxSides = sides;
            settings.chordError = 1e-6f;
            const double volume =
                volumeOf(meshed(straightTrunk({.radius = c.radius, .endRadius = c.endRadius}), settings).mesh);
            const double newError = std::abs(volume - exact) / exact;
            EXPECT_LT(newError, 0.5 * error) << c.name << ", " << sides << " sides";
            error = newError;
        }
        EXPECT_LT(error, 0.005) << c.name;
    }
}

TEST(TubeMesher, NormalsOfAConeAreItsOwn)
{
    const Skeleton cone = straightTrunk({.length = 1, .segments = 3, .radius = 0.5f, .endRadius = 0.25f});
    const Meshed m = meshed(cone, kPlain);
    const float up = 0.25f / std::sqrt(1 + 0.25f * 0.25f);
    const Tube& tube = m.scratch.tubes[0];
    for (std::uint32_t i = 0; i < 2 * (tube.sides + 1); ++i) // The two rings of the cone proper.
        EXPECT_NEAR(m.mesh.normals[i].y, up, 1e-5);
}

TEST(TubeMesher, BarkTilesWithoutASeam)
{
    const Meshed m = meshed(randomTree(4, 80), {}, {.tile = 0.05f});
    std::size_t vertex = 0;
    for (const Tube& tube : m.scratch.tubes)
    {
        for (std::uint32_t i = 0; i < tube.ringCount; ++i, vertex += tube.sides + 1)
        {
            const std::size_t last = vertex + tube.sides;
            const float across = m.mesh.uvs[last].x - m.mesh.uvs[vertex].x;
            EXPECT_NEAR(across, std::floor(across + 0.5f), 1e-4f);
            EXPECT_GT(across, 0.9f);
            EXPECT_EQ(m.mesh.uvs[last].y, m.mesh.uvs[vertex].y);
            EXPECT_EQ(m.mesh.positions[last], m.mesh.positions[vertex]);
            EXPECT_EQ(m.mesh.normals[last], m.mesh.normals[vertex]);
        }
        vertex += tube.baseVertices;
    }
    EXPECT_EQ(vertex, m.mesh.positions.size());
}

TEST(TubeMesher, BarkKeepsItsScaleOnThickAndThinAxes)
{
    for (const float radius : {0.01f, 0.1f, 0.5f})
    {
        const Meshed m = meshed(straightTrunk({.radius = radius, .endRadius = radius}), kPlain, {.tile = 0.5f});
        const TreeMesh& mesh = m.mesh;
        const std::uint32_t ring = m.scratch.tubes[0].sides + 1; // vertices, the first again at the seam
        const float round = (mesh.uvs[ring - 1].x - mesh.uvs[0].x) / (2 * static_cast<float>(math::kPi) * radius);
        const float along = (mesh.uvs[ring].y - mesh.uvs[0].y) / (mesh.positions[ring].y - mesh.positions[0].y);
        EXPECT_NEAR(along / round, 0.25, 1e-3) << radius << ", of a tile four times as high as wide";
        const Meshed square =
            meshed(straightTrunk({.radius = radius, .endRadius = radius}), kPlain, {.tile = 0.5f, .tileHeight = 1});
        EXPECT_NEAR((square.mesh.uvs[ring].y - square.mesh.uvs[0].y) / (mesh.uvs[ring].y - mesh.uvs[0].y), 4, 1e-3);
        // About one repeat a tile, as a whole number of them goes round; on the thinnest that is one.
        EXPECT_NEAR(round, radius < 0.05f ? 1 / (2 * math::kPi * radius) : 2, 0.5) << radius;
    }
}

/// Grain leans from the axis by the same angle, whatever the shape of a tile: 3.5 degrees.
TEST(TubeMesher, BarkLeansRoundTheAxis)
{
    for (const std::uint32_t tileHeight : {1u, 2u, 4u})
        for (const float radius : {0.1f, 0.5f})
        {
            // Of such a width that it goes round a whole number of times: nothing is stretched.
            const float tile = 2 * static_cast<float>(math::kPi) * radius / 3;
            const Meshed m = meshed(straightTrunk({.radius = radius, .endRadius = radius}), kPlain,
                                    {.tile = tile, .tileHeight = tileHeight});
            const Tube& tube = m.scratch.tubes[0];
            const std::uint32_t ring = tube.sides + 1;
            ASSERT_EQ(tube.repeats, 3);
            const Vec2 lower = m.mesh.uvs[0];
            const Vec2 upper = m.mesh.uvs[ring];
            ASSERT_EQ(m.mesh.positions[0].x, m.mesh.positions[ring].x) << "one above the other";
            const float metresRound = (upper.x - lower.x) * tile;
            const float metresAlong = m.mesh.positions[ring].y - m.mesh.positions[0].y;
            const double degrees = 180 / math::kPi * static_cast<double>(metresRound / metresAlong);
            EXPECT_NEAR(degrees, 3.5, 0.1) << tileHeight << " times as high as wide, " << radius << " m";
        }
}

/// A trunk with a stout branch and a thin one, both of which leave it where a collar is seen.
Skeleton stoutAndThin()
{
    Skeleton skeleton;
    skeleton.widthsGiven = true;
    const std::uint32_t trunk = grow(skeleton, kNoSegment, {0, 1, 0}, 0.18f);
    const std::uint32_t upper = grow(skeleton, trunk, {0, 1, 0}, 0.18f);
    grow(skeleton, upper, {0, 1, 0}, 0.18f);
    grow(skeleton, grow(skeleton, trunk, {1, 1, 0}, 0.08f), {1, 1, 0}, 0.08f);
    grow(skeleton, grow(skeleton, upper, {-1, 1, 0}, 0.02f), {-1, 1, 0}, 0.02f);
    completeAxes(skeleton, {});
    return skeleton;
}

const Tube& tubeOf(const Meshed& m, std::uint32_t segment)
{
    for (const Tube& tube : m.scratch.tubes)
        if (tube.segment == segment)
            return tube;
    ADD_FAILURE() << "no tube begins with segment " << segment;
    return m.scratch.tubes[0];
}

constexpr std::uint32_t kStout = 3; // of stoutAndThin
constexpr std::uint32_t kThinBranch = 5;

/// The rings that the roots want fall on joints of the skeleton here, or beside them.
TEST(TubeMesher, LaysNoRingTwice)
{
    for (const TubeJoints joints : {TubeJoints::Embed, TubeJoints::Weld})
        for (const std::uint32_t segments : {2u, 4u, 8u, 20u, 40u})
            for (const float radius : {0.1f, 0.2f, 0.1000001f})
            {
                const TubeSettings settings{.joints = joints};
                const Meshed m = meshed(straightTrunk({.segments = segments, .radius = radius}), settings);
                const samples::SurfaceCheck check = samples::checkSurface(m.mesh);
                EXPECT_TRUE(check.isManifold() && check.flat == 0)
                    << segments << " segments, radius " << radius << ": " << ::testing::PrintToString(check);
            }
}

TEST(TubeMesher, ThinBranchesHaveNoLid)
{
    const Skeleton skeleton = stoutAndThin();
    for (const float collarFlare : {0.f, 0.6f}) // a lid, and a root
    {
        const Meshed closed = meshed(skeleton, {.collarFlare = collarFlare});
        const Meshed open = meshed(skeleton, {.collarFlare = collarFlare, .openRadius = 0.02f});
        ASSERT_EQ(closed.scratch.tubes.size(), 3u);
        ASSERT_EQ(open.scratch.tubes.size(), 3u);
        for (const std::uint32_t start : {0u, kStout})
            EXPECT_EQ(tubeOf(open, start).baseVertices, tubeOf(closed, start).baseVertices);
        const Tube& lidded = tubeOf(closed, kThinBranch);
        EXPECT_GT(lidded.baseVertices, 0u);
        EXPECT_EQ(tubeOf(open, kThinBranch).baseVertices, 0u);
        const std::size_t triangles = collarFlare > 0 ? lidded.sides : lidded.sides - 2;
        EXPECT_EQ(closed.mesh.indices.size() - open.mesh.indices.size(), 3 * triangles);
        EXPECT_EQ(closed.mesh.positions.size() - open.mesh.positions.size(), lidded.baseVertices);
        EXPECT_TRUE(samples::checkSurface(closed.mesh).isManifold());
        EXPECT_EQ(samples::checkSurface(open.mesh).openSides, lidded.sides) << "the rim of the thin one alone";
        expectGoodVertices(open.mesh, 0);
    }
    // What stands on the ground is closed, however thin.
    EXPECT_TRUE(samples::checkSurface(meshed(straightTrunk({.length = 3}), {.openRadius = 9}).mesh).isManifold());
    const Meshed all = meshed(skeleton, {.openRadius = 9});
    EXPECT_GT(tubeOf(all, 0).baseVertices, 0u);
    EXPECT_EQ(tubeOf(all, kStout).baseVertices, 0u);
}

TEST(TubeMesher, CountsWhatIsOpenAsItIsWritten)
{
    for (std::uint64_t seed = 0; seed < 40; ++seed)
        for (const TubeJoints joints : {TubeJoints::Embed, TubeJoints::Weld})
            for (const float openRadius : {0.f, 0.01f, 9.f})
            {
                const Skeleton skeleton = randomTree(seed, 50);
                TubeSettings settings;
                settings.joints = joints;
                settings.openRadius = openRadius;
                const Meshed m = meshed(skeleton, settings);
                ASSERT_EQ(m.result, MeshResult::Ok);
                TubeScratch scratch;
                MeshCounts counts;
                ASSERT_EQ(countTubes(skeleton, {}, settings, Limits{}, scratch, counts), MeshResult::Ok);
                EXPECT_EQ(counts.vertices, m.mesh.positions.size()) << "seed " << seed;
                EXPECT_EQ(counts.indices, m.mesh.indices.size()) << "seed " << seed;
                EXPECT_EQ(counts.parts, m.mesh.parts.size()) << "seed " << seed;
            }
}

TEST(TubeMesher, WeldingLeavesNothingOpen)
{
    const Meshed closed = meshed(stoutAndThin(), {.joints = TubeJoints::Weld});
    const Meshed open = meshed(stoutAndThin(), {.joints = TubeJoints::Weld, .openRadius = 9});
    EXPECT_TRUE(samples::checkSurface(open.mesh).isManifold());
    EXPECT_EQ(samples::checkSurface(open.mesh).pieces, 1u);
    EXPECT_EQ(open.mesh, closed.mesh);
    for (std::uint64_t seed = 0; seed < 20; ++seed) // what could not be welded is closed, too
        EXPECT_EQ(
            samples::checkSurface(meshed(randomTree(seed, 50), {.joints = TubeJoints::Weld, .openRadius = 9}).mesh)
                .openSides,
            0u)
            << "seed " << seed;
}

/// Wood that was made thicker than it grew has the bark and the sides of what grew.
TEST(TubeMesher, WidenedWoodKeepsItsBarkAndItsSides)
{
    constexpr float kWider = 4;
    const BarkAppearance bark{.tile = 0.1f};
    const Skeleton grown = straightTrunk({.radius = 0.1f, .endRadius = 0.1f});
    Skeleton wide = grown;
    for (std::uint32_t i = 0; i < wide.size(); ++i)
    {
        wide.startRadii[i] *= kWider;
        wide.endRadii[i] *= kWider;
    }
    const std::vector<float> widening(wide.size(), kWider);
    TubeSettings settings = kPlain;
    settings.maxSides = 64;
    const Meshed asGrown = meshed(grown, settings, bark);
    const Meshed asWide = meshed(wide, settings, bark);
    settings.widening = widening;
    const Meshed widened = meshed(wide, settings, bark);

    const Tube& tube = widened.scratch.tubes[0];
    EXPECT_EQ(tube.repeats, 6) << "0.63 m round, of 0.1 m each";
    EXPECT_EQ(tube.repeats, asGrown.scratch.tubes[0].repeats);
    EXPECT_EQ(asWide.scratch.tubes[0].repeats, 25) << "as told nothing";
    EXPECT_EQ(tube.sides, asGrown.scratch.tubes[0].sides);
    EXPECT_GT(asWide.scratch.tubes[0].sides, 2 * tube.sides - 2) << "as the root of four, but for rounding up";
    EXPECT_FLOAT_EQ(tube.repeatsPerMetre, asGrown.scratch.tubes[0].repeatsPerMetre);

    ASSERT_EQ(widened.mesh.uvs[0], asGrown.mesh.uvs[0]);
    EXPECT_FLOAT_EQ(widened.mesh.uvs[tube.sides].x - widened.mesh.uvs[0].x, 6);
    const Vec3 first = widened.mesh.positions[0];
    EXPECT_NEAR(std::sqrt(first.x * first.x + first.z * first.z), kWider * 0.1f, 1e-5f) << "but it is thick";
}

TEST(TubeMesher, EqualInputGivesEqualBytes)
{
    const Skeleton skeleton = randomTree(11, 200);
    Meshed once = meshed(skeleton);
    TreeMesh again;
    ASSERT_EQ(meshTubes(skeleton, {}, {}, Limits{}, once.scratch, again), MeshResult::Ok); // with a used scratch
    EXPECT_EQ(once.mesh, again);
    EXPECT_EQ(hashOf(once.mesh), hashOf(again));
}

TEST(TubeMesher, AppendsAfterWhatIsThere)
{
    const Skeleton skeleton = fork();
    const Meshed alone = meshed(skeleton);
    Meshed twice = alone;
    ASSERT_EQ(meshTubes(skeleton, {}, {}, Limits{}, twice.scratch, twice.mesh), MeshResult::Ok);
    const auto vertices = static_cast<std::uint32_t>(alone.mesh.positions.size());
    ASSERT_EQ(twice.mesh.parts.size(), 2u);
    EXPECT_EQ(twice.mesh.parts[1].firstIndex, alone.mesh.indices.size());
    EXPECT_EQ(twice.mesh.parts[1].indexCount, alone.mesh.indices.size());
    EXPECT_EQ(twice.mesh.indices[alone.mesh.indices.size()], alone.mesh.indices[0] + vertices);
    EXPECT_EQ(twice.mesh.positions[vertices], alone.mesh.positions[0]);
}

TEST(TubeMesher, TheVertexLimitIsExact)
{
    const Skeleton skeleton = randomTree(2, 100);
    const auto needed = static_cast<std::uint32_t>(meshed(skeleton).mesh.positions.size());
    for (const int beyond : {-1, 0, 1})
    {
        Limits limits;
        limits.vertices = static_cast<std::uint32_t>(static_cast<int>(needed) + beyond);
        TubeScratch scratch;
        TreeMesh mesh;
        const MeshResult result = meshTubes(skeleton, {}, {}, limits, scratch, mesh);
        EXPECT_EQ(result, beyond < 0 ? MeshResult::TooManyVertices : MeshResult::Ok);
        EXPECT_EQ(mesh.positions.size(), beyond < 0 ? 0 : needed);
    }
}

TEST(TubeMesher, WarmMemoryIsNotAllocatedAgain)
{
    const Skeleton skeleton = randomTree(2, 100);
    Meshed m = meshed(skeleton);
    const Vec3* positions = m.mesh.positions.data();
    const TubeRing* rings = m.scratch.rings.data();
    m.mesh.clear();
    ASSERT_EQ(meshTubes(skeleton, {}, {}, Limits{}, m.scratch, m.mesh), MeshResult::Ok);
    EXPECT_EQ(m.mesh.positions.data(), positions);
    EXPECT_EQ(m.scratch.rings.data(), rings);
}

TEST(TubeMesher, SkipsAZeroLengthSegment)
{
    const Skeleton plain = straightTrunk({.length = 2, .segments = 2});
    Skeleton doubled;
    doubled.widthsGiven = true;
    std::uint32_t last = grow(doubled, kNoSegment, {0, 1, 0}, plain.startRadii[0]);
    last = grow(doubled, last, {0, 0, 0}, plain.startRadii[1]);
    last = grow(doubled, last, {0, 1, 0}, plain.startRadii[1]);
    completeAxes(doubled, {});
    doubled.endRadii[last] = plain.endRadii[1];
    EXPECT_EQ(meshed(doubled).mesh, meshed(plain).mesh);
}

TEST(TubeMesher, StraightTapersNeedNoRingsBetween)
{
    const Meshed few = meshed(straightTrunk({.segments = 1}), kPlain);
    const Meshed many = meshed(straightTrunk({.segments = 50}), kPlain);
    EXPECT_EQ(many.mesh.positions.size(), few.mesh.positions.size());
}

TEST(TubeMesher, AMovedSegmentStartsATubeOfItsOwn)
{
    Skeleton skeleton;
    const std::uint32_t trunk = grow(skeleton, kNoSegment, {0, 1, 0});
    addSegment(skeleton, trunk, {2, 3, 0}, {2, 4, 0});
    completeAxes(skeleton, {});
    const Meshed m = meshed(skeleton);
    ASSERT_EQ(m.scratch.tubes.size(), 2u);
    EXPECT_EQ(m.scratch.rings[m.scratch.tubes[1].firstRing].centre, Vec3(2, 3, 0));
    EXPECT_EQ(m.scratch.tubes[1].collar.height, 0);
}

TEST(TubeMesher, TheTrunkWidensToTheGround)
{
    const Skeleton trunk = straightTrunk({.radius = 0.1f, .endRadius = 0.1f});
    const Meshed m = meshed(trunk, {}, {.rootFlare = 0.5f, .rootLength = 3});
    EXPECT_FLOAT_EQ(m.scratch.rings[0].radius, 0.15f);
    EXPECT_FLOAT_EQ(meshed(trunk, {.rootFlare = 0.5f}, {.rootFlare = 0.5f}).scratch.rings[0].radius, 0.125f);
    EXPECT_FLOAT_EQ(meshed(trunk, {.rootFlare = 0}).scratch.rings[0].radius, 0.1f);
    for (const TubeRing& ring : m.scratch.rings)
    {
        if (ring.along >= 0.3f && ring.along <= 2)
        {
            EXPECT_NEAR(ring.radius, 0.1f, 1e-5);
        }
    }
}

TEST(TubeMesher, ATrunkPartsIntoButtresses)
{
    const BarkAppearance bark{.rootFlare = 0.5f, .rootLength = 6, .rootLobes = 5, .rootDepth = 1.2f};
    for (const bool isWelded : {false, true})
        for (const float radius : {0.1f, 0.4f})
        {
            const Skeleton trunk = straightTrunk({.length = 6, .radius = radius, .endRadius = radius});
            TubeSettings settings;
            settings.joints = isWelded ? TubeJoints::Weld : TubeJoints::Embed;
            const Meshed m = meshed(trunk, settings, bark);
            const Tube& tube = m.scratch.tubes[0];
            ASSERT_GE(tube.sides, 20u);
            const std::size_t stride = tube.sides + 1;
            float least = 1e9f;
            float most = 0;
            int peaks = 0;
            const auto outAt = [&](std::size_t j) {
                const Vec3 p = m.mesh.positions[j % tube.sides];
                return std::sqrt(p.x * p.x + p.z * p.z) / radius;
            };
            for (std::size_t j = 0; j < tube.sides; ++j)
            {
                least = std::min(least, outAt(j));
                most = std::max(most, outAt(j));
                peaks += outAt(j + 1) > outAt(j) && outAt(j + 1) > outAt(j + 2);
            }
            EXPECT_GT(least, 0.8f);
            EXPECT_LT(least, 1.35f);
            EXPECT_GT(most, 1.65f);
            EXPECT_LE(most, 2.1f);
            EXPECT_EQ(peaks, 5);
            for (std::size_t i = 0; i < tube.ringCount; ++i)
                for (std::size_t j = 0; j < stride && m.scratch.rings[i].along > 6 * radius; ++j)
                {
                    const Vec3 arm = m.mesh.positions[i * stride + j] - m.scratch.rings[i].centre;
                    ASSERT_NEAR(glm::length(arm), m.scratch.rings[i].radius, 1e-4f);
                }
            // Normals are those of the triangles round them, as far as facets allow.
            for (std::size_t t = 0; t + 2 < m.mesh.indices.size(); t += 3)
            {
                const Vec3 a = m.mesh.positions[m.mesh.indices[t]];
                const Vec3 face = glm::cross(m.mesh.positions[m.mesh.indices[t + 1]] - a,
                                             m.mesh.positions[m.mesh.indices[t + 2]] - a);
                for (std::size_t k = 0; k < 3; ++k)
                {
                    const Vec3 normal = m.mesh.normals[m.mesh.indices[t + k]];
                    ASSERT_NEAR(glm::length(normal), 1, 1e-4f);
                    ASSERT_NEAR(glm::dot(normal, Vec3(m.mesh.tangents[m.mesh.indices[t + k]])), 0, 1e-4f);
                    if (glm::length(face) > 1e-6f)
                    {
                        ASSERT_GT(glm::dot(normal, glm::normalize(face)), 0.3f);
                    }
                }
            }
            // Where so few sides are enough, they are not asked to show what they cannot.
            EXPECT_EQ(meshed(trunk, {.maxSides = 12}, bark).scratch.tubes[0].roots.depth, 0);
            EXPECT_EQ(meshed(trunk, {}, {.rootLobes = 2}).scratch.tubes[0].roots.depth, 0);
        }
}

TEST(TubeMesher, ALeaningTrunkLeavesNoGapAboveTheGround)
{
    Skeleton skeleton;
    grow(skeleton, kNoSegment, {0.5f, 1, 0});
    completeAxes(skeleton, {.tipRadius = 0.1f});
    const Meshed m = meshed(skeleton);
    for (std::uint32_t j = 0; j < m.scratch.tubes[0].sides; ++j)
        EXPECT_LE(m.mesh.positions[j].y, 1e-4f);
}

/// Widest extent across the fork's plane within `distance` of the trunk's surface, of the branch alone.
float widthAtFork(const Meshed& m, float distance)
{
    const Tube& branch = m.scratch.tubes[1];
    const Tube& trunk = m.scratch.tubes[0];
    const std::size_t first = trunk.ringCount * (trunk.sides + 1) + trunk.baseVertices;
    float widest = 0;
    for (std::size_t i = first; i < first + branch.ringCount * (branch.sides + 1); ++i)
    {
        const Vec3& p = m.mesh.positions[i];
        const float fromAxis = std::sqrt(p.x * p.x + p.z * p.z);
        if (fromAxis < branch.collar.parentRadius + distance)
            widest = std::max(widest, std::abs(p.z));
    }
    return widest;
}

Skeleton sideBranch()
{
    Skeleton skeleton;
    skeleton.widthsGiven = true;
    const std::uint32_t trunk = grow(skeleton, kNoSegment, {0, 1, 0}, 0.2f);
    const std::uint32_t upper = grow(skeleton, trunk, {0, 1, 0}, 0.2f);
    grow(skeleton, upper, {0, 1, 0}, 0.2f);
    const std::uint32_t branch = grow(skeleton, trunk, {1, 1, 0}, 0.06f);
    grow(skeleton, branch, {1, 1, 0}, 0.06f);
    completeAxes(skeleton, {});
    return skeleton;
}

TEST(TubeMesher, ACollarIsWiderThanItsBranchAndReachesIntoTheParent)
{
    const Meshed m = meshed(sideBranch());
    ASSERT_EQ(m.scratch.tubes.size(), 2u);
    const Tube& branch = m.scratch.tubes[1];
    EXPECT_GT(branch.collar.height, 0);
    EXPECT_GT(widthAtFork(m, 0.01f), 1.3f * 0.06f);
    EXPECT_LT(widthAtFork(meshed(sideBranch(), {.collarFlare = 0}), 0.01f), 1.05f * 0.06f);

    // All of its foot lies inside the parent.
    const Tube& trunk = m.scratch.tubes[0];
    const std::size_t first = trunk.ringCount * (trunk.sides + 1) + trunk.baseVertices;
    for (std::size_t i = first; i < first + branch.sides + 1; ++i)
    {
        const Vec3& p = m.mesh.positions[i];
        EXPECT_LT(std::sqrt(p.x * p.x + p.z * p.z), 0.2f);
    }
}

TEST(TubeMesher, ABranchThickerThanItsParentBeginsHidden)
{
    Skeleton skeleton = sideBranch();
    skeleton.startRadii[0] = skeleton.endRadii[0] = skeleton.startRadii[1] = skeleton.endRadii[1] = 0.03f;
    const Meshed m = meshed(skeleton, kPlain);
    const std::uint32_t first = m.scratch.tubes[1].firstRing;
    EXPECT_LT(m.scratch.rings[first].radius, 0.03f);
    EXPECT_EQ(m.scratch.rings[first + m.scratch.tubes[1].ringCount / 2].radius, 0.06f);
}

TEST(TubeMesher, SidesFollowTheChordError)
{
    for (const float chordError : {0.02f, 0.002f, 0.0002f})
    {
        const Meshed m = meshed(straightTrunk({.radius = 0.1f}),
                                {.minSides = 3, .maxSides = 256, .chordError = chordError, .rootFlare = 0});
        const std::uint32_t sides = m.scratch.tubes[0].sides;
        const auto sagitta = [](std::uint32_t n) { return 0.1 * (1 - math::cos(math::kPi / n)); };
        EXPECT_LE(sagitta(sides), static_cast<double>(chordError) * 1.001);
        EXPECT_GT(sagitta(sides - 2), static_cast<double>(chordError) * 0.9);
    }
}

TEST(TubeMesher, NonsenseSettingsAreClamped)
{
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    const TubeSettings nonsense[] = {
        {.minSides = 0, .maxSides = 0},
        {.minSides = 9999, .maxSides = 9999},
        {.chordError = kNan, .smoothing = kNan, .maxRingAngle = kNan, .collarFlare = kNan, .collarLength = kNan},
        {.chordError = -1, .smoothing = -5, .maxRingAngle = 0, .collarFlare = -1, .rootFlare = -1},
        {.smoothing = 9, .maxRingAngle = 99, .collarFlare = 99, .collarLength = 999, .rootFlare = 99},
        {.collarLength = 0},
    };
    for (const TubeSettings& settings : nonsense)
    {
        const Meshed m = meshed(fork(), settings);
        ASSERT_EQ(m.result, MeshResult::Ok);
        expectGoodVertices(m.mesh, 0);
        expectClosed(m.mesh, false, 0);
    }
}

TEST(TreeMesh, ClearKeepsNothing)
{
    TreeMesh mesh = meshed(fork()).mesh;
    EXPECT_NE(hashOf(mesh), hashOf(TreeMesh{}));
    mesh.clear();
    EXPECT_EQ(mesh, TreeMesh{});
    EXPECT_EQ(hashOf(mesh), hashOf(TreeMesh{}));
}

} // namespace
} // namespace espalier
