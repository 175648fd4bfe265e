#include <Espalier/Mesh/Foliage.h>
#include <Espalier/Mesh/RingFrames.h>

#include <Allocations.h>
#include <Espalier/Archetype/Placement.h>
#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Mesh/LeafMesher.h>
#include <Espalier/Mesh/TreeMesher.h>
#include <Espalier/Plant/Axes.h>
#include <Espalier/Species/AppearanceFile.h>
#include <Espalier/Species/LeafOutline.h>
#include <Plant/SampleSkeletons.h>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <filesystem>
#include <gtest/gtest.h>
#include <iterator>
#include <limits>
#include <utility>
#include <vector>

namespace espalier {

namespace {

/// A drawn tree of Content with radii.
Skeleton drawn(const std::string& name)
{
    const std::filesystem::path root = ESPALIER_SOURCE_ROOT;
    Skeleton skeleton =
        drawArchetype(loadArchetype(root / "Content" / (name + ".archetype"), {{root / "Templates"}}).value()).value();
    completeAxes(skeleton, suggestPipes(skeleton));
    return skeleton;
}

/// A leaf about which nothing is random.
LeafAppearance plainLeaf()
{
    LeafAppearance leaf;
    leaf.thickestWood = 1;
    leaf.spacing = 0.1f;
    leaf.atTip = false;
    leaf.shade = 0;
    leaf.angle = static_cast<float>(math::kPi) / 2;
    leaf.angleSpread = 0;
    leaf.droop = 0;
    leaf.facing = 0;
    leaf.lengthSpread = 0;
    leaf.colourSpread = 0;
    return leaf;
}

Appearance inLeaf(std::vector<LeafAppearance> kinds)
{
    Appearance appearance;
    appearance.leaves = std::move(kinds);
    return appearance;
}

Foliage placed(const Skeleton& skeleton, const std::vector<LeafAppearance>& kinds)
{
    FoliageScratch scratch;
    Foliage foliage;
    const MeshResult result = placeLeaves(skeleton, kinds, 1, {}, scratch, foliage);
    EXPECT_TRUE(result == MeshResult::Ok || (result == MeshResult::EmptySkeleton && foliage.leaves.empty()));
    return foliage;
}

Foliage placed(const Skeleton& skeleton, const LeafAppearance& kind)
{
    return placed(skeleton, std::vector{kind});
}

/// A straight shoot along `way`, in `segments` segments.
Skeleton shoot(Vec3 way, std::uint32_t segments = 4, float radius = 0.01f)
{
    Skeleton skeleton;
    skeleton.widthsGiven = true;
    std::uint32_t last = kNoSegment;
    for (std::uint32_t i = 0; i < segments; ++i)
        last = samples::grow(skeleton, last, way / static_cast<float>(segments), radius);
    completeAxes(skeleton, {});
    skeleton.endRadii[last] = radius;
    return skeleton;
}

double degreesBetween(const Vec3& a, const Vec3& b)
{
    const Vec3 across = glm::cross(a, b);
    return math::atan2(static_cast<double>(glm::length(across)), static_cast<double>(glm::dot(a, b))) /
           math::kRadiansPerDegree;
}

TreeMesh meshed(const Skeleton& skeleton, const std::vector<LeafAppearance>& kinds, const LeafSettings& settings = {})
{
    LeafScratch scratch;
    TreeMesh mesh;
    const MeshResult result = meshLeaves(placed(skeleton, kinds), kinds, settings, {}, scratch, mesh);
    EXPECT_EQ(result, MeshResult::Ok);
    return mesh;
}

/// The kinds of a species of Content, light left out.
std::vector<LeafAppearance> kindsOf(const std::string& name)
{
    const std::filesystem::path file = std::filesystem::path(ESPALIER_SOURCE_ROOT) / "Content" / (name + ".appearance");
    std::vector<LeafAppearance> kinds = loadAppearance(file).value().leaves;
    for (LeafAppearance& kind : kinds)
        kind.shade = 0;
    return kinds;
}

/// The first segment of each segment's axis.
std::vector<std::uint32_t> axesOf(const Skeleton& skeleton)
{
    std::vector<std::uint32_t> axes(skeleton.size());
    for (std::uint32_t i = 0; i < skeleton.size(); ++i)
        axes[i] = skeleton.startsAxis(i) ? i : axes[skeleton.parents[i]];
    return axes;
}

/// Every bit of each leaf but those that light has a say in, in an order of their own; `nameOf` gives segments names,
/// and kNoSegment to those that are left out.
template <class NameOf>
std::vector<std::array<std::uint32_t, 13>> bitsOf(const Foliage& foliage, const NameOf& nameOf)
{
    std::vector<std::array<std::uint32_t, 13>> all;
    for (std::uint32_t kind = 0; kind < kMaxLeafKinds; ++kind)
        for (const PlacedLeaf& leaf : foliage.ofKind(kind))
        {
            const std::uint32_t name = nameOf(leaf.segment);
            if (name == kNoSegment)
                continue;
            const auto bits = [](float value) { return std::bit_cast<std::uint32_t>(value); };
            all.push_back({name, kind, bits(leaf.lot), bits(leaf.length), bits(leaf.foot.x), bits(leaf.foot.y),
                           bits(leaf.foot.z), bits(leaf.heading.x), bits(leaf.heading.y), bits(leaf.heading.z),
                           bits(leaf.face.x), bits(leaf.face.y), bits(leaf.face.z)});
        }
    std::ranges::sort(all);
    return all;
}

/// Leaves that `full` has and its segments `order`, renumbered, do not, or the other way round; those on cut wood and
/// on the axis `except` do not count.
std::size_t leavesThatDiffer(const Skeleton& full, const std::vector<std::uint32_t>& order,
                             const std::vector<LeafAppearance>& kinds, std::uint32_t except = kNoSegment)
{
    const std::vector<std::uint32_t> axes = axesOf(full);
    std::vector<bool> isKept(full.size(), false);
    for (const std::uint32_t i : order)
        isKept[i] = axes[i] != except;
    const auto before = bitsOf(placed(full, kinds), [&](std::uint32_t i) { return isKept[i] ? i : kNoSegment; });
    const auto after = bitsOf(placed(samples::renumbered(full, order), kinds),
                              [&](std::uint32_t i) { return isKept[order[i]] ? order[i] : kNoSegment; });
    EXPECT_GT(after.size(), 300u);
    std::vector<std::array<std::uint32_t, 13>> differing;
    std::ranges::set_symmetric_difference(before, after, std::back_inserter(differing));
    return differing.size();
}

/// Unit normals and tangents at right angles, triangles whose front is where their normals point, indices in range, and
/// nothing that is not a number.
void expectSound(const TreeMesh& mesh)
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
        ASSERT_EQ(mesh.tangents[i].w, 1);
        ASSERT_GE(std::min(mesh.uvs[i].x, mesh.uvs[i].y), 0);
        ASSERT_LE(std::max(mesh.uvs[i].x, mesh.uvs[i].y), 1);
    }
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3)
    {
        std::array<std::uint32_t, 3> corners{mesh.indices[i], mesh.indices[i + 1], mesh.indices[i + 2]};
        for (const std::uint32_t corner : corners)
            ASSERT_LT(corner, mesh.positions.size());
        const Vec3 a = mesh.positions[corners[0]];
        const Vec3 face = directionOr(glm::cross(mesh.positions[corners[1]] - a, mesh.positions[corners[2]] - a),
                                      mesh.normals[corners[0]]);
        for (const std::uint32_t corner : corners)
            ASSERT_GT(glm::dot(face, mesh.normals[corner]), 0) << "triangle " << i / 3;
    }
}

} // namespace

TEST(Foliage, NeedsKindsAndWood)
{
    FoliageScratch scratch;
    Foliage foliage;
    EXPECT_EQ(placeLeaves(shoot({0, 1, 0}), {}, 1, {}, scratch, foliage), MeshResult::EmptySkeleton);
    const std::vector kinds{plainLeaf()};
    EXPECT_EQ(placeLeaves({}, kinds, 1, {}, scratch, foliage), MeshResult::EmptySkeleton);
    EXPECT_TRUE(placed(shoot({0, 1, 0}, 4, 2.f), kinds).leaves.empty()) << "too thick";
    LeafAppearance none = plainLeaf();
    none.density = 0;
    EXPECT_TRUE(placed(shoot({0, 1, 0}), none).leaves.empty());
}

TEST(Foliage, TurnsBySpeciesArrangement)
{
    struct Case
    {
        LeafArrangement arrangement;
        std::uint32_t perNode;
        double degrees; // from one leaf to the next
    };
    for (const Case& test : {Case{LeafArrangement::Spiral, 1, 137.508}, Case{LeafArrangement::Alternate, 1, 180}})
    {
        LeafAppearance kind = plainLeaf();
        kind.arrangement = test.arrangement;
        for (const Vec3 way : {Vec3(0, 3, 0), Vec3(3, 0, 0), Vec3(1, 2, -1)})
        {
            const Foliage foliage = placed(shoot(way), kind);
            ASSERT_GT(foliage.leaves.size(), 20u);
            for (std::size_t i = 1; i < foliage.leaves.size(); ++i)
            {
                EXPECT_NEAR(degreesBetween(foliage.leaves[i - 1].heading, foliage.leaves[i].heading), test.degrees,
                            0.1);
                EXPECT_NEAR(degreesBetween(foliage.leaves[i].heading, way), 90, 0.1);
            }
        }
    }
}

TEST(Foliage, TurnsSpiralsRoundBendsWithoutTwist)
{
    Skeleton skeleton;
    skeleton.widthsGiven = true;
    std::uint32_t last = kNoSegment;
    for (int i = 0; i < 12; ++i)
    {
        const math::SinCos turn = math::sinCosDegrees(15.0 * i);
        last = samples::grow(skeleton, last, 0.3f * Vec3(static_cast<float>(turn.sin), static_cast<float>(turn.cos), 0),
                             0.01f);
    }
    completeAxes(skeleton, {});
    LeafAppearance kind = plainLeaf();
    kind.arrangement = LeafArrangement::Alternate;
    kind.spacing = 0.02f;
    const Foliage foliage = placed(skeleton, kind);
    ASSERT_GT(foliage.leaves.size(), 150u);
    // The shoot bends in a plane: its ranks stay at right angles to it.
    for (const PlacedLeaf& leaf : foliage.leaves)
        EXPECT_NEAR(std::abs(leaf.heading.z), 1, 0.02);
}

TEST(Foliage, SetsPairsAcrossEachOther)
{
    LeafAppearance kind = plainLeaf();
    kind.arrangement = LeafArrangement::Opposite;
    const Foliage foliage = placed(shoot({0, 2, 1}), kind);
    ASSERT_GT(foliage.leaves.size(), 20u);
    ASSERT_EQ(foliage.leaves.size() % 2, 0u);
    for (std::size_t i = 0; i + 2 < foliage.leaves.size(); i += 2)
    {
        EXPECT_NEAR(degreesBetween(foliage.leaves[i].heading, foliage.leaves[i + 1].heading), 180, 0.1);
        EXPECT_NEAR(degreesBetween(foliage.leaves[i].heading, foliage.leaves[i + 2].heading), 90, 0.1);
    }
}

TEST(Foliage, SetsWhorlsIntoEachOthersGaps)
{
    LeafAppearance kind = plainLeaf();
    kind.arrangement = LeafArrangement::Whorled;
    kind.perNode = 5;
    const Foliage foliage = placed(shoot({0, 2, 1}), kind);
    ASSERT_GT(foliage.leaves.size(), 50u);
    for (std::size_t i = 0; i + 5 < foliage.leaves.size(); i += 5)
    {
        for (std::size_t j = 1; j < 5; ++j)
            EXPECT_NEAR(degreesBetween(foliage.leaves[i + j - 1].heading, foliage.leaves[i + j].heading), 72, 0.1);
        EXPECT_NEAR(degreesBetween(foliage.leaves[i].heading, foliage.leaves[i + 5].heading), 36, 0.1);
    }
}

TEST(Foliage, SpacesNodesAcrossSegmentsFromTheTip)
{
    LeafAppearance kind = plainLeaf();
    const Foliage foliage = placed(shoot({0, 2.05f, 0}, 7), kind);
    ASSERT_EQ(foliage.leaves.size(), 20u);
    for (std::size_t i = 0; i < foliage.leaves.size(); ++i)
    {
        EXPECT_NEAR(foliage.leaves[i].foot.y, 2.05f - 0.1f * static_cast<float>(i + 1), 1e-4);
        EXPECT_NEAR(glm::length(Vec2(foliage.leaves[i].foot.x, foliage.leaves[i].foot.z)), 0.01f, 1e-5)
            << "on the bark";
        EXPECT_EQ(foliage.leaves[i].segment, static_cast<std::uint32_t>(foliage.leaves[i].foot.y * 7 / 2.05f));
    }
    kind.atTip = true;
    const Foliage ended = placed(shoot({0, 2.05f, 0}, 7), kind);
    ASSERT_EQ(ended.leaves.size(), 21u);
    EXPECT_NEAR(ended.leaves[0].foot.y, 2.06f, 1e-5) << "where the round end is";
    EXPECT_NEAR(ended.leaves[0].heading.y, 1, 1e-5);
}

TEST(Foliage, StandsOnThinWoodOnly)
{
    const Skeleton oak = drawn("Oak");
    LeafAppearance kind;
    kind.thickestWood = 0.008f;
    const Foliage foliage = placed(oak, kind);
    ASSERT_GT(foliage.leaves.size(), 1000u);
    for (const PlacedLeaf& leaf : foliage.leaves)
        EXPECT_LE(oak.endRadii[leaf.segment], 0.008f);
    kind.thickestWood = 0.012f;
    EXPECT_GT(placed(oak, kind).leaves.size(), foliage.leaves.size());
}

TEST(Foliage, BeginsOutsideTheParentsBark)
{
    Skeleton skeleton;
    skeleton.widthsGiven = true;
    const std::uint32_t trunk = samples::grow(skeleton, kNoSegment, {0, 1, 0}, 0.3f);
    samples::grow(skeleton, trunk, {0, 1, 0}, 0.3f);
    samples::grow(skeleton, trunk, {1, 0, 0}, 0.02f);
    completeAxes(skeleton, {});
    LeafAppearance kind = plainLeaf();
    kind.thickestWood = 0.1f;
    kind.spacing = 0.01f;
    const Foliage foliage = placed(skeleton, kind);
    ASSERT_GT(foliage.leaves.size(), 60u);
    for (const PlacedLeaf& leaf : foliage.leaves)
        EXPECT_GE(leaf.foot.x, 0.27f);
}

TEST(Foliage, RanksOfAFrondLieFlat)
{
    LeafAppearance kind = plainLeaf();
    kind.arrangement = LeafArrangement::Alternate;
    kind.facing = 1;
    for (const Vec3 way : {Vec3(3, 0, 0), Vec3(2, 2, 0), Vec3(-1, 1, 2)})
    {
        const Foliage foliage = placed(shoot(way), kind);
        ASSERT_GT(foliage.leaves.size(), 20u);
        for (const PlacedLeaf& leaf : foliage.leaves)
        {
            EXPECT_NEAR(leaf.heading.y, 0, 1e-3);
            EXPECT_GT(leaf.face.y, 0.6f);
        }
    }
}

TEST(Foliage, ShortensTheEndsOfTaperedShoots)
{
    LeafAppearance kind = plainLeaf();
    kind.taper = 1;
    const Foliage foliage = placed(shoot({4, 0, 0}), kind);
    ASSERT_GT(foliage.leaves.size(), 30u);
    EXPECT_LT(foliage.leaves.front().length, 0.4f * kind.length);
    EXPECT_LT(foliage.leaves.back().length, 0.4f * kind.length);
    EXPECT_GT(foliage.leaves[foliage.leaves.size() / 2].length, 0.95f * kind.length);
}

TEST(Foliage, HangsAndLooksUpAsToldTo)
{
    LeafAppearance kind = plainLeaf();
    kind.droop = 1;
    for (const PlacedLeaf& leaf : placed(shoot({1, 1, 0}), kind).leaves)
        EXPECT_NEAR(leaf.heading.y, -1, 1e-4);
    kind.droop = 0;
    kind.facing = 1;
    kind.arrangement = LeafArrangement::Spiral;
    for (const PlacedLeaf& leaf : placed(shoot({0, 3, 0}), kind).leaves)
        EXPECT_NEAR(leaf.face.y, 1, 1e-3);
}

TEST(Foliage, HalfTheDensityIsHalfTheLeavesAndTheSameOnes)
{
    const Skeleton oak = drawn("Oak");
    LeafAppearance kind;
    kind.shade = 0;
    const Foliage all = placed(oak, kind);
    kind.density = 0.5f;
    const Foliage half = placed(oak, kind);
    ASSERT_GT(all.leaves.size(), 2000u);
    EXPECT_NEAR(static_cast<double>(half.leaves.size()) / static_cast<double>(all.leaves.size()), 0.5, 0.03);
    std::size_t next = 0;
    for (const PlacedLeaf& leaf : half.leaves)
    {
        while (next < all.leaves.size() && all.leaves[next].foot != leaf.foot)
            ++next;
        ASSERT_LT(next, all.leaves.size()) << "a leaf of its own";
        EXPECT_EQ(all.leaves[next].heading, leaf.heading);
        EXPECT_EQ(all.leaves[next].length, leaf.length);
    }
}

TEST(Foliage, ThinsAndDarkensWhereTheCrownIsDark)
{
    // A ball of shoots.
    Skeleton skeleton;
    skeleton.widthsGiven = true;
    const RandomKey key(Seed{5});
    for (std::uint32_t i = 0; i < 4000; ++i)
    {
        const auto draw = [&](std::uint32_t n) {
            return static_cast<float>(key.child(i).uniform(Purpose::Sampling, -2.0, 2.0, n));
        };
        const float x = draw(0);
        const float y = draw(1);
        const float z = draw(2);
        const Vec3 place(x, y, z);
        if (glm::length(place) < 2)
            samples::addSegment(skeleton, kNoSegment, place, place + Vec3(0.2f, 0, 0), 0.002f);
    }
    completeAxes(skeleton, {});
    LeafAppearance kind = plainLeaf();
    kind.spacing = 0.05f;
    kind.length = 0.15f;
    kind.shade = 0;
    const auto shares = [&](const Foliage& foliage) {
        std::array<double, 3> counts{};
        double shade = 0;
        double inside = 0;
        for (const PlacedLeaf& leaf : foliage.leaves)
        {
            const float from = glm::length(leaf.foot - Vec3(0.1f, 0, 0));
            ++counts[from < 0.7f ? 0 : leaf.foot.y > 0 && from > 1.6f ? 1 : 2];
            shade += from < 0.7f ? leaf.tint.red : 0;
            inside += from < 0.7f ? 1 : 0;
        }
        counts[2] = shade / inside;
        return counts;
    };
    const auto [darkBefore, lightBefore, tint] = shares(placed(skeleton, kind));
    kind.shade = 1;
    const auto [darkAfter, lightAfter, sameTint] = shares(placed(skeleton, kind));
    EXPECT_LT(darkAfter / darkBefore, 0.4);
    EXPECT_GT(lightAfter / lightBefore, 2 * darkAfter / darkBefore);
    EXPECT_LT(tint, 0.8 * 255);
    EXPECT_GT(tint, 0.55 * 255);
    EXPECT_GT(sameTint, 0.55 * 255);
}

TEST(Foliage, LeadsOutOfTheCrown)
{
    const Foliage foliage = placed(drawn("Oak"), LeafAppearance{});
    Vec3 middle(0);
    for (const PlacedLeaf& leaf : foliage.leaves)
        middle += leaf.foot / static_cast<float>(foliage.leaves.size());
    std::size_t out = 0;
    for (const PlacedLeaf& leaf : foliage.leaves)
    {
        EXPECT_NEAR(glm::length(leaf.outward), 1, 1e-4);
        out += glm::dot(leaf.outward, leaf.foot - middle) > 0 ? 1 : 0;
    }
    EXPECT_GT(out, foliage.leaves.size() * 9 / 10);
}

TEST(Foliage, IsTheSameEveryTime)
{
    const Skeleton oak = drawn("Oak");
    const std::vector<LeafAppearance> kinds(2);
    EXPECT_EQ(placed(oak, kinds), placed(oak, kinds));
    FoliageScratch scratch;
    Foliage foliage;
    ASSERT_EQ(placeLeaves(drawn("Palm"), kinds, 1, {}, scratch, foliage), MeshResult::Ok);
    ASSERT_EQ(placeLeaves(oak, kinds, 1, {}, scratch, foliage), MeshResult::Ok);
    EXPECT_EQ(foliage, placed(oak, kinds)) << "whatever was before";
}

TEST(Foliage, KeepsItsLimits)
{
    LeafAppearance kind = plainLeaf();
    const Skeleton stick = shoot({0, 1.95f, 0}); // 19 leaves
    const std::vector kinds{kind};
    FoliageScratch scratch;
    Foliage foliage;
    Limits limits;
    for (const int more : {-1, 0, 1})
    {
        limits.vertices = static_cast<std::uint32_t>(4 * 19 + more);
        EXPECT_EQ(placeLeaves(stick, kinds, 1, limits, scratch, foliage),
                  more < 0 ? MeshResult::TooManyVertices : MeshResult::Ok);
        EXPECT_EQ(foliage.leaves.size(), more < 0 ? 0u : 19u);
    }
    // Fields of wood with a leaf each millimetre: refused before it is tried.
    LeafAppearance dense = kind;
    dense.spacing = 0.001f;
    dense.density = 1e-6f;
    const Skeleton endless = shoot({0, 90000, 0});
    EXPECT_EQ(placeLeaves(endless, std::vector{dense}, 1, {}, scratch, foliage), MeshResult::TooManyVertices);
    EXPECT_EQ(placeLeaves(shoot({0, 200000, 0}), kinds, 1, {}, scratch, foliage), MeshResult::UnsoundSkeleton);

    const Appearance appearance = inLeaf({kind});
    const TreeMesh whole = meshTree(stick, appearance).value();
    for (const int more : {-1, 0, 1})
    {
        limits.vertices = static_cast<std::uint32_t>(static_cast<int>(whole.positions.size()) + more);
        MeshScratch memory;
        TreeMesh mesh;
        EXPECT_EQ(meshTree(stick, appearance, {}, limits, memory, mesh),
                  more < 0 ? MeshResult::TooManyVertices : MeshResult::Ok);
        EXPECT_EQ(mesh, more < 0 ? TreeMesh{} : whole);
    }
}

TEST(Foliage, PutsUpWithAnyPlantAndAnyKind)
{
    for (std::uint64_t seed = 0; seed < 150; ++seed)
    {
        SCOPED_TRACE(seed);
        const Skeleton skeleton = samples::randomTree(seed, 60, samples::Ailments::All);
        const RandomKey key = RandomKey(Seed{seed}).child(1);
        std::uint32_t counter = 0;
        const auto draw = [&](double low, double high) {
            return static_cast<float>(key.uniform(Purpose::Sampling, low, high, counter++));
        };
        std::vector<LeafAppearance> kinds(3);
        for (LeafAppearance& kind : kinds)
        {
            kind.thickestWood = draw(0, 0.2);
            kind.spacing = draw(0.3, 2);
            kind.arrangement = static_cast<LeafArrangement>(key.below(Purpose::Sampling, 4, counter++));
            kind.perNode = static_cast<std::uint32_t>(key.below(Purpose::Sampling, 20, counter++));
            kind.angle = draw(0, 3.2);
            kind.angleSpread = draw(0, 3.2);
            kind.droop = draw(-0.2, 1.2);
            kind.facing = draw(-0.2, 1.2);
            kind.shape = static_cast<LeafShape>(key.below(Purpose::Sampling, 7, counter++));
            kind.form = static_cast<LeafForm>(key.below(Purpose::Sampling, 3, counter++));
            kind.length = draw(0, 3);
            kind.lengthSpread = draw(0, 1);
            kind.taper = draw(0, 1);
            kind.width = draw(0.01, 4);
            kind.stalk = draw(0, 0.9);
            kind.fold = draw(0, 1.5);
            kind.arch = draw(-0.5, 0.5);
            kind.leaves = static_cast<std::uint32_t>(key.below(Purpose::Sampling, 9, counter++));
            kind.crownNormals = draw(-0.2, 1.2);
        }
        const Foliage foliage = placed(skeleton, kinds);
        for (const PlacedLeaf& leaf : foliage.leaves)
        {
            EXPECT_NEAR(glm::length(leaf.heading), 1, 1e-4);
            EXPECT_NEAR(glm::length(leaf.face), 1, 1e-4);
            EXPECT_NEAR(glm::dot(leaf.face, leaf.heading), 0, 1e-4);
            EXPECT_NEAR(glm::length(leaf.outward), 1, 1e-4);
            EXPECT_LT(leaf.segment, skeleton.size());
        }
        for (const float error : {0.f, 0.3f, 2.f})
        {
            LeafScratch scratch;
            TreeMesh mesh;
            const LeafSettings settings{.error = error, .streams = {.tints = true, .sources = true}};
            const LeafCounts counts = countLeaves(foliage, kinds, settings, scratch);
            const MeshResult result = meshLeaves(foliage, kinds, settings, {}, scratch, mesh);
            EXPECT_EQ(result, counts.leaves == 0 ? MeshResult::EmptySkeleton : MeshResult::Ok);
            EXPECT_EQ(mesh.positions.size(), counts.vertices);
            EXPECT_EQ(mesh.indices.size(), counts.indices);
            expectSound(mesh);
        }
    }
}

TEST(Foliage, TakesNoNumberForTheLeast)
{
    const float nan = std::numeric_limits<float>::quiet_NaN();
    LeafAppearance kind;
    kind.thickestWood = 1;
    kind.angle = kind.angleSpread = kind.droop = kind.facing = kind.length = kind.lengthSpread = nan;
    kind.taper = kind.width = kind.stalk = kind.fold = kind.arch = kind.colourSpread = kind.crownNormals = nan;
    const TreeMesh mesh = meshed(shoot({0, 1, 0}), {kind});
    expectSound(mesh);
    kind.density = nan;
    EXPECT_TRUE(placed(shoot({0, 1, 0}), kind).leaves.empty());
}

TEST(LeafMesher, HasOnePartAKind)
{
    std::vector<LeafAppearance> kinds(3);
    kinds[1].density = 0;
    kinds[2].form = LeafForm::Ball;
    kinds[2].spacing = 1;
    const TreeMesh mesh = meshed(drawn("Oak"), kinds);
    ASSERT_EQ(mesh.parts.size(), 2u);
    EXPECT_EQ(mesh.parts[0].colour, 0);
    EXPECT_EQ(mesh.parts[1].colour, 2);
    EXPECT_EQ(mesh.parts[0].material, MeshMaterial::Leaves);
    EXPECT_EQ(mesh.parts[0].firstIndex, 0u);
    EXPECT_EQ(mesh.parts[1].firstIndex, mesh.parts[0].indexCount);
    EXPECT_EQ(mesh.parts[1].firstIndex + mesh.parts[1].indexCount, mesh.indices.size());
    expectSound(mesh);
}

TEST(LeafMesher, NormalsStayInFrontOfEveryTriangle)
{
    for (const LeafForm form : {LeafForm::Blade, LeafForm::Crossed})
        for (const float fold : {0.f, 0.3f, 1.5f})
            for (const float arch : {-0.5f, 0.f, 0.1f, 0.5f})
                for (const float bent : {0.f, 0.6f, 1.f})
                {
                    SCOPED_TRACE(testing::Message() << "fold " << fold << ", arch " << arch << ", bent " << bent);
                    LeafAppearance kind;
                    kind.spacing = 0.5f;
                    kind.form = form;
                    kind.fold = fold;
                    kind.arch = arch;
                    kind.crownNormals = bent;
                    kind.leaves = fold > 0 ? 1 : 5;
                    expectSound(meshed(drawn("Oak"), {kind}));
                }
}

TEST(LeafMesher, CoversWhatIsDrawn)
{
    // Every place of the surface where there is some leaf lies in one of the triangles.
    for (int shape = 0; shape < 7; ++shape)
        for (const std::uint32_t leaves : {1u, 7u})
        {
            SCOPED_TRACE(testing::Message() << "shape " << shape << ", leaves " << leaves);
            LeafAppearance kind = plainLeaf();
            kind.shape = static_cast<LeafShape>(shape);
            kind.leaves = leaves;
            kind.length = 0.4f;
            const LeafSurface surface(kind);
            const TreeMesh mesh = meshed(shoot({0, 0.15f, 0}), {kind});
            ASSERT_EQ(mesh.positions.size(), 9u);
            const auto isCovered = [&](Vec2 at) {
                for (std::size_t i = 0; i < mesh.indices.size(); i += 3)
                {
                    const auto outside = [&](std::size_t a, std::size_t b) {
                        const Vec2 from = mesh.uvs[mesh.indices[i + a]];
                        const Vec2 edge = mesh.uvs[mesh.indices[i + b]] - from;
                        return edge.x * (at.y - from.y) - edge.y * (at.x - from.x) < -1e-6f;
                    };
                    if (!outside(0, 1) && !outside(1, 2) && !outside(2, 0))
                        return true;
                }
                return false;
            };
            for (float v = 0.005f; v < 1; v += 0.01f)
                for (float u = 0.005f; u < 1; u += 0.01f)
                    EXPECT_TRUE(!surface.at({u, v}) || isCovered({u, v})) << u << ", " << v;
        }
}

TEST(LeafMesher, IsFlatWhereBendsAreTooSmallToBeSeen)
{
    const Skeleton stick = shoot({0, 2, 0});
    LeafAppearance kind = plainLeaf();
    EXPECT_EQ(meshed(stick, {kind}).indices.size() % 24, 0u) << "eight triangles a leaf";
    EXPECT_EQ(meshed(stick, {kind}, {.bend = 0.05f}).indices.size() * 4, meshed(stick, {kind}).indices.size());
    kind.fold = 0;
    const std::size_t arched = meshed(stick, {kind}).indices.size();
    EXPECT_EQ(arched % 12, 0u);
    kind.arch = 0;
    EXPECT_EQ(meshed(stick, {kind}).indices.size() * 2, arched);
    kind.fold = 0.3f;
    EXPECT_EQ(meshed(stick, {kind}).indices.size(), arched);
}

TEST(LeafMesher, LargerErrorsKeepSomeOfTheLeavesAndTheArea)
{
    const Skeleton oak = drawn("Oak");
    const std::vector kinds{LeafAppearance{.spacing = 0.02f, .length = 0.08f}};
    const Foliage foliage = placed(oak, kinds);
    ASSERT_GT(foliage.leaves.size(), 8000u);
    LeafScratch scratch;
    std::vector<std::uint32_t> before;
    double fullArea = 0;
    for (const float error : {0.f, 0.015f, 0.035f, 0.05f, 0.075f, 0.125f})
    {
        SCOPED_TRACE(error);
        TreeMesh mesh;
        // Flat at every error, so that areas can be compared.
        const LeafSettings settings{.bend = 1, .error = error, .streams = {.sources = true}, .firstOrgan = 7};
        ASSERT_EQ(meshLeaves(foliage, kinds, settings, {}, scratch, mesh), MeshResult::Ok);
        std::vector<std::uint32_t> organs;
        double area = 0;
        for (std::size_t i = 0; i < mesh.indices.size(); i += 6)
        {
            const std::uint32_t a = mesh.indices[i];
            const std::uint32_t b = mesh.indices[i + 1];
            const std::uint32_t c = mesh.indices[i + 2];
            area += static_cast<double>(
                glm::length(glm::cross(mesh.positions[b] - mesh.positions[a], mesh.positions[c] - mesh.positions[a])));
            organs.push_back(mesh.sources[a].organ);
            const PlacedLeaf& leaf = foliage.leaves[organs.back() - 7];
            EXPECT_EQ(mesh.sources[a].segment, leaf.segment);
            EXPECT_NEAR(glm::length(0.5f * (mesh.positions[a] + mesh.positions[b]) - leaf.foot), 0, 1e-5);
        }
        if (error == 0)
            fullArea = area;
        else
        {
            EXPECT_TRUE(std::ranges::includes(before, organs)) << "nothing comes back";
            EXPECT_LE(organs.size(), before.size());
        }
        EXPECT_NEAR(area / fullArea, 1, 0.1);
        before = organs;
    }
    EXPECT_LT(before.size(), foliage.leaves.size() / 10);
}

/// As MikkTSpace has them: along u in the triangles round a vertex, though bent normals may lean out of these.
TEST(LeafMesher, TangentsRunAlongUWhereNormalsAreBentToo)
{
    for (const LeafForm form : {LeafForm::Blade, LeafForm::Crossed})
    {
        LeafAppearance kind = plainLeaf();
        kind.form = form;
        kind.fold = 0.5f;
        kind.arch = 0.15f;
        kind.crownNormals = 0.8f;
        kind.angleSpread = 0.5f;
        const TreeMesh mesh = meshed(drawn("Birch"), {kind});
        double sum = 0;
        for (std::size_t t = 0; t < mesh.indices.size(); t += 3)
        {
            const std::uint32_t origin = mesh.indices[t];
            const Vec3 a = mesh.positions[mesh.indices[t + 1]] - mesh.positions[origin];
            const Vec3 b = mesh.positions[mesh.indices[t + 2]] - mesh.positions[origin];
            const Vec2 u = mesh.uvs[mesh.indices[t + 1]] - mesh.uvs[origin];
            const Vec2 v = mesh.uvs[mesh.indices[t + 2]] - mesh.uvs[origin];
            const Vec3 alongU = (v.y * a - u.y * b) * (u.x * v.y - u.y * v.x);
            double most = 0;
            double least = 180;
            for (std::size_t corner = t; corner < t + 3; ++corner)
            {
                const Vec3 normal = mesh.normals[mesh.indices[corner]];
                const Vec3 flat = alongU - glm::dot(alongU, normal) * normal;
                const double angle = degreesBetween(flat, Vec3(mesh.tangents[mesh.indices[corner]]));
                most = std::max(most, angle);
                least = std::min(least, angle);
                sum += angle;
            }
            ASSERT_LT(least, 0.1) << "but on the midrib, which lies between two halves";
            ASSERT_LT(most, 60);
        }
        EXPECT_LT(sum / static_cast<double>(mesh.indices.size()), form == LeafForm::Crossed ? 0.01 : 20);
    }
}

TEST(Foliage, KeepsAllOtherLeavesWhenABranchIsCut)
{
    for (const char* name : {"Oak", "Birch", "Spruce"})
    {
        const Skeleton full = drawn(name);
        const std::vector<LeafAppearance> kinds = kindsOf(name);
        const std::vector<std::uint32_t> axes = axesOf(full);
        std::size_t cuts = 0;
        for (std::uint32_t branch = 1; branch < full.size(); branch += full.size() / 40)
        {
            // Where an axis loses its end, its own leaves count from another tip.
            const std::uint32_t stump = full.startsAxis(branch) ? kNoSegment : axes[branch];
            const std::vector<std::uint32_t> kept = samples::allWithout(full, branch);
            if (kept.size() < full.size() / 2)
                continue;
            ++cuts;
            EXPECT_EQ(leavesThatDiffer(full, kept, kinds, stump), 0u) << name << " without " << branch;
        }
        EXPECT_GT(cuts, 20u);
    }
}

TEST(Foliage, KeepsAllOtherLeavesWhenABranchIsAdded)
{
    for (const char* name : {"Oak", "Birch"})
    {
        Skeleton full = drawn(name);
        const std::vector<LeafAppearance> kinds = kindsOf(name);
        const std::uint32_t before = full.size();
        full.widthsGiven = true; // radii stay
        const std::uint32_t branch = samples::grow(full, 1, {0.3f, 0.3f, 0.1f}, 0.004f);
        samples::grow(full, branch, {0.3f, 0.2f, 0.1f}, 0.003f);
        completeAxes(full, {});
        std::vector<std::uint32_t> order{0, 1, branch, branch + 1};
        for (std::uint32_t i = 2; i < before; ++i)
            order.push_back(i);
        const Skeleton with = samples::renumbered(full, order);
        ASSERT_FALSE(placed(with, kinds) == placed(samples::renumbered(with, samples::allWithout(with, 2)), kinds));
        EXPECT_EQ(leavesThatDiffer(with, samples::allWithout(with, 2), kinds), 0u) << name;
    }
}

TEST(Foliage, DoesNotFollowTheNumbersOfSegments)
{
    for (const char* name : {"Oak", "Palm", "Spruce", "Willow", "Birch"})
    {
        const Skeleton full = drawn(name);
        EXPECT_EQ(leavesThatDiffer(full, samples::byDepth(full), kindsOf(name)), 0u) << name;
    }
}

TEST(TreeMesher, WithoutLeavesIsBare)
{
    const Skeleton oak = drawn("Oak");
    MeshScratch scratch;
    TreeMesh bare;
    ASSERT_EQ(meshBare(oak, {}, {}, {}, scratch, bare), MeshResult::Ok);
    EXPECT_EQ(meshTree(oak, {}).value(), bare);
    EXPECT_TRUE(bare.tints.empty());

    const TreeMesh leafy = meshTree(oak, inLeaf({LeafAppearance{}})).value();
    ASSERT_GT(leafy.parts.size(), bare.parts.size());
    EXPECT_EQ(leafy.tints.size(), leafy.positions.size());
    EXPECT_TRUE(std::equal(bare.positions.begin(), bare.positions.end(), leafy.positions.begin()));
    EXPECT_TRUE(std::equal(bare.indices.begin(), bare.indices.end(), leafy.indices.begin()));
}

TEST(TreeMesher, NumbersLeavesAfterWhatTheSkeletonDraws)
{
    Skeleton skeleton = shoot({0, 1, 0});
    skeleton.spheres.push_back({.centre = {1, 1, 1}, .radius = 0.1f, .segment = 0});
    skeleton.organs.push_back({.position = {1, 0, 0}, .heading = {0, 1, 0}, .left = {1, 0, 0}, .segment = 1});
    const Appearance appearance = inLeaf({plainLeaf()});
    const TreeMesh mesh = meshTree(skeleton, appearance, {.sources = true}).value();
    ASSERT_EQ(mesh.sources.size(), mesh.positions.size());
    std::vector<std::uint32_t> organs;
    for (const VertexSource& source : mesh.sources)
        if (source.organ != kNoOrgan)
            organs.push_back(source.organ);
    ASSERT_FALSE(organs.empty());
    EXPECT_TRUE(std::ranges::is_sorted(organs));
    EXPECT_EQ(organs.front(), 0u);
    const auto last = std::unique(organs.begin(), organs.end());
    EXPECT_EQ(static_cast<std::size_t>(last - organs.begin()),
              organs[static_cast<std::size_t>(last - organs.begin()) - 1] + 1u)
        << "every number once";
}

TEST(TreeMesher, AllocatesNothingForLeavesOnceWarm)
{
    if (!ESPALIER_COUNTS_ALLOCATIONS)
        GTEST_SKIP() << "under sanitizers allocations are not counted";
    const Skeleton oak = drawn("Oak");
    const Appearance appearance = inLeaf({LeafAppearance{}, LeafAppearance{.form = LeafForm::Ball}});
    MeshScratch scratch;
    TreeMesh mesh;
    ASSERT_EQ(meshTree(oak, appearance, {}, {}, scratch, mesh), MeshResult::Ok);
    const std::uint64_t before = allocations::count;
    mesh.clear();
    const MeshResult again = meshTree(oak, appearance, {}, {}, scratch, mesh);
    EXPECT_EQ(allocations::count - before, 0u);
    EXPECT_EQ(again, MeshResult::Ok);
}

} // namespace espalier
