#include "SurfaceCheck.h"

#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Core/File.h>
#include <Espalier/Grammar/Grammar.h>
#include <Espalier/Inference/Inference.h>
#include <Espalier/Mesh/AxisCurve.h>
#include <Espalier/Mesh/RingFrames.h>
#include <Espalier/Mesh/TubeMesher.h>
#include <Espalier/Species/Appearance.h>
#include <Espalier/Species/Grow.h>
#include <Inference/SampleArchetypes.h>
#include <Plant/SampleSkeletons.h>
#include <cmath>
#include <filesystem>
#include <gtest/gtest.h>
#include <map>
#include <string>
#include <string_view>
#include <tuple>

namespace espalier {
namespace {

using namespace samples;

constexpr TubeSettings kWelded{.joints = TubeJoints::Weld};

struct Meshed
{
    MeshResult result;
    TubeScratch scratch;
    TreeMesh mesh;
};

Meshed meshed(const Skeleton& skeleton, const TubeSettings& settings = kWelded)
{
    Meshed m;
    m.result = meshTubes(skeleton, {}, settings, Limits{}, m.scratch, m.mesh);
    return m;
}

/// A trunk with branches all round one joint, that rise by `rise` metres on their first half metre outwards.
Skeleton whorl(std::uint32_t branches, float radius, double rise = 0.2)
{
    Skeleton skeleton;
    skeleton.widthsGiven = true;
    const std::uint32_t trunk = grow(skeleton, kNoSegment, {0, 1, 0}, 0.12f);
    grow(skeleton, trunk, {0, 1, 0}, 0.12f);
    for (std::uint32_t i = 0; i < branches; ++i)
    {
        const math::SinCos turn = math::sinCosDegrees(360.0 * i / branches + 10);
        const Vec3 aside(DVec3(0.5 * turn.cos, rise, 0.5 * turn.sin));
        grow(skeleton, grow(skeleton, trunk, aside, radius), aside, radius);
    }
    completeAxes(skeleton, {});
    return skeleton;
}

void expectGoodVertices(const TreeMesh& mesh)
{
    for (std::size_t i = 0; i < mesh.positions.size(); ++i)
    {
        const Vec3 tangent(mesh.tangents[i]);
        ASSERT_TRUE(std::isfinite(glm::dot(mesh.positions[i], mesh.positions[i])));
        ASSERT_TRUE(std::isfinite(mesh.uvs[i].x) && std::isfinite(mesh.uvs[i].y));
        ASSERT_NEAR(glm::length(mesh.normals[i]), 1, 1e-4);
        ASSERT_NEAR(glm::length(tangent), 1, 1e-4);
        ASSERT_NEAR(glm::dot(tangent, mesh.normals[i]), 0, 1e-4);
        ASSERT_EQ(std::abs(mesh.tangents[i].w), 1.f);
    }
    for (const std::uint32_t index : mesh.indices)
        ASSERT_LT(index, mesh.positions.size());
}

TEST(Weld, RandomTreesAreOneClosedSurface)
{
    std::uint32_t branches = 0;
    std::uint32_t embedded = 0;
    for (std::uint64_t seed = 0; seed < 100; ++seed)
    {
        SCOPED_TRACE("seed " + std::to_string(seed));
        const Meshed m = meshed(randomTree(seed, 60));
        ASSERT_EQ(m.result, MeshResult::Ok);
        const SurfaceCheck check = checkSurface(m.mesh);
        EXPECT_TRUE(check.isManifold()) << ::testing::PrintToString(check);
        EXPECT_EQ(check.flat, 0u);
        EXPECT_EQ(check.pieces, 1 + m.scratch.embedded);
        EXPECT_GT(check.volume, 0);
        expectGoodVertices(m.mesh);
        branches += m.scratch.branches;
        embedded += m.scratch.embedded;
    }
    EXPECT_LT(embedded, branches / 100);
}

TEST(Weld, SickTreesStayClosed)
{
    for (std::uint64_t seed = 0; seed < 200; ++seed)
    {
        SCOPED_TRACE("seed " + std::to_string(seed));
        const Meshed m = meshed(randomTree(seed, 40, Ailments::All));
        ASSERT_EQ(m.result, MeshResult::Ok);
        EXPECT_EQ(checkSurface(m.mesh).openSides, 0u);
        expectGoodVertices(m.mesh);
    }
}

TEST(Weld, EmbeddedTubesAreClosedEachOfItsOwn)
{
    for (std::uint64_t seed = 0; seed < 100; ++seed)
    {
        const Meshed m = meshed(randomTree(seed, 60), {});
        const SurfaceCheck check = checkSurface(m.mesh);
        EXPECT_TRUE(check.isManifold() && check.flat == 0) << seed << ": " << ::testing::PrintToString(check);
        EXPECT_EQ(m.scratch.embedded, m.scratch.branches);
    }
}

TEST(Weld, GrammarsOfTheContentAreClosed)
{
    const std::filesystem::path folder = std::filesystem::path(ESPALIER_SOURCE_ROOT) / "Content" / "Grammars";
    for (const char* const name : {"TernaryTree", "Abop2-6a", "Abop2-6b", "Abop2-6c", "Abop2-6d", "Abop2-7a",
                                   "Abop2-7b", "Abop2-7c", "Abop2-7d", "Abop2-8a", "Abop2-8d", "Shrub"})
    {
        SCOPED_TRACE(name);
        const auto text = readTextFile(folder / (std::string(name) + ".lsys"), 1 << 20);
        ASSERT_TRUE(text.has_value());
        const auto grammar = parseGrammar(*text, name, {});
        ASSERT_TRUE(grammar.has_value());
        const bool isLarge = std::string_view(name) == "TernaryTree";
        const auto grower = isLarge ? Grower::make(*grammar, 6) : Grower::make(*grammar);
        ASSERT_TRUE(grower.has_value());
        GrowScratch scratch;
        Skeleton skeleton;
        ASSERT_TRUE(grower->grow(Seed{1}, {}, scratch, skeleton).has_value());
        const Meshed m = meshed(skeleton);
        ASSERT_EQ(m.result, MeshResult::Ok);
        const SurfaceCheck check = checkSurface(m.mesh);
        EXPECT_EQ(check.openSides, 0u) << ::testing::PrintToString(check);
        // The shrub draws some of its branches twice, in the same place.
        if (std::string_view(name) != "Shrub")
        {
            EXPECT_TRUE(check.isManifold() && check.flat == 0) << ::testing::PrintToString(check);
            EXPECT_LE(m.scratch.embedded, m.scratch.branches / 100);
        }
        expectGoodVertices(m.mesh);
    }
}

TEST(Weld, TheThesisTreeIsOneClosedSurface)
{
    const Archetype archetype = thesis();
    const auto species = inferSpecies({&archetype, 1}, {});
    ASSERT_TRUE(species.has_value());
    const auto grower = Grower::make(*species);
    ASSERT_TRUE(grower.has_value());
    GrowScratch scratch;
    Skeleton skeleton;
    for (std::uint64_t seed = 1; seed <= 5; ++seed)
    {
        ASSERT_TRUE(grower->grow(Seed{seed}, {}, scratch, skeleton).has_value());
        const Meshed m = meshed(skeleton);
        const SurfaceCheck check = checkSurface(m.mesh);
        EXPECT_TRUE(check.isManifold() && check.flat == 0) << seed << ": " << ::testing::PrintToString(check);
        EXPECT_EQ(m.scratch.embedded, 0u);
        EXPECT_EQ(check.pieces, 1u);
    }
}

TEST(Weld, ForksAndWhorlsFindRoom)
{
    for (const std::uint32_t branches : {1u, 2u, 3u, 6u, 9u})
    {
        for (const float radius : {0.004f, 0.02f, 0.05f, 0.12f, 0.15f})
        {
            SCOPED_TRACE(std::to_string(branches) + " branches of radius " + std::to_string(radius));
            const Meshed m = meshed(whorl(branches, radius));
            const SurfaceCheck check = checkSurface(m.mesh);
            EXPECT_TRUE(check.isManifold() && check.flat == 0) << ::testing::PrintToString(check);
            EXPECT_EQ(m.scratch.embedded, 0u);
            EXPECT_EQ(check.pieces, 1u);
        }
    }
}

/// Welded or not, a plant holds about as much wood.
TEST(Weld, TheVolumeIsThatOfTheOutside)
{
    const double apart = checkSurface(meshed(whorl(1, 0.02f), {}).mesh).volume;
    const double welded = checkSurface(meshed(whorl(1, 0.02f)).mesh).volume;
    EXPECT_LT(welded, apart); // what is inside of the trunk counts once
    EXPECT_GT(welded, 0.97 * apart);
}

TEST(Weld, AFootSharesPlaceNormalTintAndSourceWithItsParent)
{
    TubeSettings settings = kWelded;
    settings.streams = {.tints = true, .sources = true};
    const Meshed m = meshed(whorl(3, 0.05f), settings);
    std::map<std::tuple<float, float, float>, std::size_t> known;
    std::size_t doubled = 0;
    for (std::size_t i = 0; i < m.mesh.positions.size(); ++i)
    {
        const Vec3& p = m.mesh.positions[i];
        const auto [found, isNew] = known.try_emplace({p.x, p.y, p.z}, i);
        if (isNew || p.y < 0.01f) // the lid of the trunk's base has an edge
            continue;
        ++doubled;
        EXPECT_EQ(m.mesh.normals[i], m.mesh.normals[found->second]);
        EXPECT_EQ(m.mesh.tints[i], m.mesh.tints[found->second]);
        EXPECT_EQ(m.mesh.sources[i], m.mesh.sources[found->second]);
    }
    EXPECT_GT(doubled, 30u);
}

TEST(Weld, NormalsStandBeforeTheirTriangles)
{
    // Steep branches on few sides: what parent and branch share stood behind the triangles of the crotch, and renderers
    // that take the side of a surface from its normals drew them black.
    double area = 0;
    double behind = 0;
    for (std::uint32_t branches = 1; branches < 6; ++branches)
    {
        const Meshed m = meshed(whorl(branches, 0.03f, 1.5), {.maxSides = 4, .joints = TubeJoints::Weld});
        ASSERT_EQ(m.result, MeshResult::Ok);
        expectGoodVertices(m.mesh);
        for (std::size_t i = 0; i < m.mesh.indices.size(); i += 3)
        {
            const std::uint32_t* const corner = &m.mesh.indices[i];
            const Vec3 face = glm::cross(m.mesh.positions[corner[1]] - m.mesh.positions[corner[0]],
                                         m.mesh.positions[corner[2]] - m.mesh.positions[corner[0]]);
            for (int k = 0; k < 3; ++k)
            {
                const auto third = static_cast<double>(glm::length(face)) / 3;
                area += third;
                behind += glm::dot(face, m.mesh.normals[corner[k]]) > 0 ? 0 : third;
            }
        }
    }
    EXPECT_LT(behind / area, 1e-4);
}

TEST(Weld, BarkRunsOnOverTheSeam)
{
    for (std::uint64_t seed = 0; seed < 30; ++seed)
    {
        const Meshed m = meshed(randomTree(seed, 60));
        for (std::size_t i = 0; i < m.mesh.indices.size(); i += 3)
        {
            float low = 1e30f;
            float high = -1e30f;
            for (std::size_t k = 0; k < 3; ++k)
            {
                const Vec2 uv = m.mesh.uvs[m.mesh.indices[i + k]];
                const float round = uv.x - m.scratch.tubes[0].lean * uv.y;
                low = std::min(low, round);
                high = std::max(high, round);
            }
            // Where it wraps wrongly, a triangle would hold nearly a whole turn of bark: one repeat or more.
            EXPECT_LT(high - low, 0.75f) << "seed " << seed << ", triangle " << i / 3;
        }
    }
}

/// Triangles that run the other way round in the texture than the hand of their tangents says.
std::size_t mirroredOf(const TreeMesh& mesh)
{
    std::size_t mirrored = 0;
    for (std::size_t t = 0; t < mesh.indices.size(); t += 3)
    {
        const Vec2 origin = mesh.uvs[mesh.indices[t]];
        const Vec2 a = mesh.uvs[mesh.indices[t + 1]] - origin;
        const Vec2 b = mesh.uvs[mesh.indices[t + 2]] - origin;
        const float area = a.x * b.y - a.y * b.x;
        for (std::size_t corner = t; corner < t + 3 && std::abs(area) > 1e-7f; ++corner)
            mirrored += area * mesh.tangents[mesh.indices[corner]].w < 0 ? 1 : 0;
    }
    return mirrored;
}

TEST(Weld, TangentsHaveTheHandOfTheirTexture)
{
    for (const TubeJoints joints : {TubeJoints::Weld, TubeJoints::Embed})
        for (std::uint64_t seed = 0; seed < 150; ++seed)
        {
            const Meshed m = meshed(randomTree(seed, 80), {.joints = joints});
            ASSERT_EQ(m.result, MeshResult::Ok);
            ASSERT_EQ(mirroredOf(m.mesh), 0u) << "seed " << seed;
        }
}

/// A foot with points a rounding beside the seam of its host, where u is 0 and begins anew.
TEST(Weld, AFootOnTheSeamDoesNotMirrorTheTexture)
{
    Skeleton trunk = straightTrunk({.segments = 2, .radius = 0.12f, .endRadius = 0.12f});
    const TreeMesh bare = meshed(trunk).mesh;
    const Vec3 seam = directionOr((bare.positions[0] - trunk.starts[0]) * Vec3(1, 0, 1), Vec3(1, 0, 0));
    const Vec3 beside = glm::cross(Vec3(0, 1, 0), seam);
    for (int power = 8; power < 32; ++power)
        for (const float sign : {-1.f, 1.f})
        {
            Skeleton skeleton = trunk;
            const Vec3 aside = 0.4f * (seam + std::ldexp(sign, -power) * beside) + Vec3(0, 0.2f, 0);
            grow(skeleton, grow(skeleton, 0, aside, 0.02f), aside, 0.02f);
            completeAxes(skeleton, {});
            const Meshed m = meshed(skeleton);
            ASSERT_EQ(m.result, MeshResult::Ok);
            ASSERT_EQ(m.scratch.embedded, 0u);
            EXPECT_EQ(mirroredOf(m.mesh), 0u) << sign << " * 2^-" << power;
        }
}

TEST(Weld, EqualInputGivesEqualBytes)
{
    const Skeleton skeleton = randomTree(11, 200);
    Meshed once = meshed(skeleton);
    TreeMesh other;
    ASSERT_EQ(meshTubes(randomTree(12, 300), {}, kWelded, Limits{}, once.scratch, other), MeshResult::Ok);
    TreeMesh again;
    ASSERT_EQ(meshTubes(skeleton, {}, kWelded, Limits{}, once.scratch, again), MeshResult::Ok); // with a used scratch
    EXPECT_EQ(once.mesh, again);
    TreeMesh embedded;
    ASSERT_EQ(meshTubes(skeleton, {}, {}, Limits{}, once.scratch, embedded), MeshResult::Ok);
    EXPECT_EQ(embedded, meshed(skeleton, {}).mesh);
}

TEST(Weld, AppendsAfterWhatIsThere)
{
    const Meshed alone = meshed(fork());
    Meshed twice = alone;
    ASSERT_EQ(meshTubes(fork(), {}, kWelded, Limits{}, twice.scratch, twice.mesh), MeshResult::Ok);
    const auto vertices = static_cast<std::uint32_t>(alone.mesh.positions.size());
    ASSERT_EQ(twice.mesh.indices.size(), 2 * alone.mesh.indices.size());
    for (std::size_t i = 0; i < alone.mesh.indices.size(); ++i)
        ASSERT_EQ(twice.mesh.indices[alone.mesh.indices.size() + i], alone.mesh.indices[i] + vertices);
    for (std::size_t i = 0; i < vertices; ++i)
    {
        ASSERT_EQ(twice.mesh.positions[vertices + i], alone.mesh.positions[i]);
        ASSERT_EQ(twice.mesh.normals[vertices + i], alone.mesh.normals[i]);
        ASSERT_EQ(twice.mesh.normals[i], alone.mesh.normals[i]);
    }
}

TEST(Weld, TheVertexLimitIsExact)
{
    const Skeleton skeleton = randomTree(2, 100);
    const auto needed = static_cast<std::uint32_t>(meshed(skeleton).mesh.positions.size());
    for (const int beyond : {-1, 0, 1})
    {
        Limits limits;
        limits.vertices = static_cast<std::uint32_t>(static_cast<int>(needed) + beyond);
        TubeScratch scratch;
        TreeMesh mesh;
        const MeshResult result = meshTubes(skeleton, {}, kWelded, limits, scratch, mesh);
        EXPECT_EQ(result, beyond < 0 ? MeshResult::TooManyVertices : MeshResult::Ok);
        EXPECT_EQ(mesh.positions.size(), beyond < 0 ? 0 : needed);
    }
}

TEST(Weld, NonsenseSettingsAreClamped)
{
    const TubeSettings nonsense[] = {
        {.minSides = 3, .maxSides = 3, .joints = TubeJoints::Weld},
        {.chordError = 1e-9f, .joints = TubeJoints::Weld},
        {.smoothing = 0, .collarFlare = 0, .collarLength = 0, .rootFlare = 0, .joints = TubeJoints::Weld},
        {.maxRingAngle = 99, .collarFlare = 99, .collarLength = 999, .rootFlare = 99, .joints = TubeJoints::Weld},
    };
    for (const TubeSettings& settings : nonsense)
    {
        for (std::uint64_t seed = 0; seed < 5; ++seed)
        {
            const Meshed m = meshed(randomTree(seed, 40), settings);
            ASSERT_EQ(m.result, MeshResult::Ok);
            EXPECT_EQ(checkSurface(m.mesh).openSides, 0u) << seed;
            expectGoodVertices(m.mesh);
        }
    }
}

} // namespace
} // namespace espalier
