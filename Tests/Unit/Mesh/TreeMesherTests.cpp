#include <Espalier/Mesh/TreeMesher.h>

#include <Allocations.h>
#include <Espalier/Archetype/Archetype.h>
#include <Espalier/Inference/Inference.h>
#include <Espalier/Mesh/Collision.h>
#include <Espalier/Mesh/DetailLevel.h>
#include <Espalier/Mesh/VertexLayout.h>
#include <Espalier/Mesh/Wind.h>
#include <Espalier/Species/AppearanceFile.h>
#include <Espalier/Species/Grow.h>
#include <Plant/SampleSkeletons.h>
#include <array>
#include <cstddef>
#include <filesystem>
#include <gtest/gtest.h>
#include <string>
#include <vector>

namespace espalier {

namespace {

/// A plant with its skin.
struct Plant
{
    std::string name;
    Skeleton skeleton;
    Appearance appearance;
};

/// Fruit along the branches, drawn by the skeleton itself.
void addShapes(Skeleton& skeleton)
{
    for (std::uint32_t i = 3; i < skeleton.size(); i += 17)
        skeleton.spheres.push_back({.centre = skeleton.ends[i], .radius = 0.02f, .segment = i, .material = 2});
    for (std::uint32_t i = 5; i < skeleton.size(); i += 19)
        skeleton.organs.push_back(
            {.position = skeleton.ends[i], .heading = {0, 1, 0}, .left = {1, 0, 0}, .segment = i});
    for (std::uint32_t i = 7; i < skeleton.size(); i += 23)
    {
        const auto first = static_cast<std::uint32_t>(skeleton.corners.size());
        for (const Vec3& corner : {Vec3(0), Vec3(0.1f, 0, 0), Vec3(0.1f, 0.1f, 0), Vec3(0.02f, 0.01f, 0)})
            skeleton.corners.push_back(skeleton.ends[i] + corner);
        skeleton.polygons.push_back({.firstCorner = first, .cornerCount = 4, .segment = i});
    }
}

/// Trees of the five kinds of Content/ from several seeds, without a calibration of what they are inferred from.
const std::vector<Plant>& plants()
{
    static const std::vector<Plant> made = [] {
        const std::filesystem::path root = ESPALIER_SOURCE_ROOT;
        std::vector<Plant> all;
        for (const std::string name : {"Oak", "Birch", "Spruce", "Palm", "Willow"})
        {
            const Archetype drawn =
                loadArchetype(root / "Content" / (name + ".archetype"), {{root / "Templates"}}).value();
            InferenceOptions options;
            options.mergeWeight = 0.1;
            options.ruleWeight = 0;
            const Species species = inferSpecies({&drawn, 1}, options).value();
            Appearance appearance = loadAppearance(root / "Content" / (name + ".appearance")).value();
            appearance.pipes = species.appearance.pipes;
            for (std::uint64_t seed = 1; seed <= 3; ++seed)
                all.push_back({name + " " + std::to_string(seed), grow(species, Seed{seed}).value(), appearance});
        }
        Appearance many = all.front().appearance;
        many.leaves.push_back(LeafAppearance{.thickestWood = 0.05f, .form = LeafForm::Ball});
        many.leaves.push_back(LeafAppearance{.density = 0.5f, .form = LeafForm::Crossed});
        for (std::uint64_t seed = 0; seed < 20; ++seed)
        {
            Skeleton skeleton = samples::randomTree(seed, 100, samples::Ailments::All);
            addShapes(skeleton);
            all.push_back({"ailing " + std::to_string(seed), skeleton, many});
        }
        return all;
    }();
    return made;
}

bool isOfContent(const Plant& plant)
{
    return !plant.name.starts_with("ailing");
}

struct Mode
{
    const char* name;
    MeshSettings settings;
    bool inLeaf = true;
};

std::vector<Mode> modes()
{
    std::vector<Mode> all{{.name = "embedded", .settings = {}},
                          {.name = "with sources", .settings = {.sources = true}},
                          {.name = "welded", .settings = {}},
                          {.name = "bare", .settings = {}, .inLeaf = false},
                          {.name = "thinned leaves", .settings = {}}};
    all[2].settings.tubes.joints = TubeJoints::Weld;
    all[4].settings.leaves.error = 0.05f;
    return all;
}

/// Calls visit(plant, mode): small plants in all modes, large ones in two each, so that every kind is seen in all.
template <class Visit>
void forPlants(std::uint64_t seeds, const Visit& visit)
{
    const std::vector<Mode> all = modes();
    std::size_t large = 0;
    for (const Plant& plant : plants())
    {
        const bool isLarge = isOfContent(plant);
        if (isLarge && plant.name.back() > static_cast<char>('0' + seeds))
            continue;
        for (std::size_t k = 0; k < (isLarge ? 2 : all.size()); ++k)
        {
            const Mode& mode = all[isLarge ? large++ % all.size() : k];
            SCOPED_TRACE(plant.name + ", " + mode.name);
            visit(plant, mode);
        }
    }
}

Appearance appearanceIn(const Mode& mode, const Plant& plant)
{
    Appearance appearance = plant.appearance;
    if (!mode.inLeaf)
        appearance.leaves.clear();
    return appearance;
}

std::uint64_t bytesOf(const TreeMesh& mesh)
{
    return mesh.positions.size() * (sizeof(Vec3) + sizeof(Vec3) + sizeof(Vec4) + sizeof(Vec2)) +
           mesh.tints.size() * sizeof(Tint) + mesh.sources.size() * sizeof(VertexSource) +
           mesh.indices.size() * sizeof(std::uint32_t);
}

} // namespace

TEST(TreeMesher, CountsExactlyWhatItAppends)
{
    MeshScratch scratch;
    forPlants(3, [&](const Plant& plant, const Mode& mode) {
        const Appearance appearance = appearanceIn(mode, plant);
        TreeMesh mesh;
        MeshCounts counts;
        // The second time another plant stands behind the first.
        for (int times = isOfContent(plant) ? 1 : 2; times > 0; --times)
        {
            const MeshResult counted = countTree(plant.skeleton, appearance, mode.settings, {}, scratch, counts);
            ASSERT_EQ(meshTree(plant.skeleton, appearance, mode.settings, {}, scratch, mesh), counted);
            EXPECT_EQ(counts, countsOf(mesh));
            EXPECT_EQ(counts.bytes(), bytesOf(mesh));
        }
    });
}

TEST(TreeMesher, IsBoundedBeforeLeavesArePlaced)
{
    MeshScratch scratch;
    double most = 0;
    forPlants(3, [&](const Plant& plant, const Mode& mode) {
        const Appearance appearance = appearanceIn(mode, plant);
        MeshCounts exact;
        MeshCounts bound;
        const MeshResult result = countTree(plant.skeleton, appearance, mode.settings, {}, scratch, exact);
        ASSERT_EQ(meshBound(plant.skeleton, appearance, mode.settings, {}, scratch, bound), result);
        EXPECT_GE(bound.vertices, exact.vertices);
        EXPECT_GE(bound.indices, exact.indices);
        EXPECT_GE(bound.parts, exact.parts);
        EXPECT_EQ(bound.streams, exact.streams);
        if (!mode.inLeaf)
        {
            EXPECT_EQ(bound, exact);
        }
        if (mode.settings.leaves.error == 0 && isOfContent(plant))
            most = std::max(most, static_cast<double>(bound.bytes()) / static_cast<double>(exact.bytes()));
    });
    EXPECT_LT(most, 1.3) << "bytes, as a share of what a tree of Content takes";
}

TEST(TreeMesher, LimitsHoldAlikeForCountsAndMeshes)
{
    const Plant& birch = plants()[3];
    MeshScratch scratch;
    for (const Mode& mode : modes())
    {
        SCOPED_TRACE(mode.name);
        const Appearance appearance = appearanceIn(mode, birch);
        MeshCounts all;
        ASSERT_EQ(countTree(birch.skeleton, appearance, mode.settings, {}, scratch, all), MeshResult::Ok);
        MeshCounts bare;
        ASSERT_EQ(countBare(birch.skeleton, appearance, mode.settings, {}, scratch, bare), MeshResult::Ok);
        for (const std::uint64_t vertices : {all.vertices, all.vertices - 1, bare.vertices, bare.vertices - 1})
        {
            Limits limits;
            limits.vertices = static_cast<std::uint32_t>(vertices);
            MeshCounts counts;
            TreeMesh mesh;
            const MeshResult counted = countTree(birch.skeleton, appearance, mode.settings, limits, scratch, counts);
            EXPECT_EQ(meshTree(birch.skeleton, appearance, mode.settings, limits, scratch, mesh), counted);
            EXPECT_EQ(counted == MeshResult::Ok, all.vertices <= vertices);
            EXPECT_EQ(counts, countsOf(mesh)) << "none, unless it is well";
            MeshCounts bound;
            const MeshResult bounded = meshBound(birch.skeleton, appearance, mode.settings, limits, scratch, bound);
            EXPECT_TRUE(bounded == MeshResult::Ok ? bound.vertices <= vertices : counted != MeshResult::Ok);
        }
    }
}

TEST(TreeMesher, CountsNoFurtherThanAsked)
{
    const Plant& birch = plants()[3];
    MeshScratch scratch;
    for (const Mode& mode : modes())
    {
        SCOPED_TRACE(mode.name);
        const Appearance appearance = appearanceIn(mode, birch);
        MeshCounts all;
        ASSERT_EQ(countBare(birch.skeleton, appearance, mode.settings, {}, scratch, all), MeshResult::Ok);
        for (const std::uint64_t enough : {std::uint64_t{0}, all.indices / 2, all.indices - 1, all.indices})
        {
            MeshCounts counts;
            ASSERT_EQ(countBare(birch.skeleton, appearance, mode.settings, {}, scratch, counts, enough),
                      MeshResult::Ok);
            EXPECT_LE(counts.indices, all.indices);
            EXPECT_EQ(counts.indices > enough, all.indices > enough);
            if (enough == all.indices)
            {
                EXPECT_EQ(counts, all);
            }
        }
    }
}

TEST(TreeMesher, TakesAllItsMemoryAtOnceIfAsked)
{
    const Plant& oak = plants().front();
    MeshScratch scratch;
    MeshCounts counts;
    ASSERT_EQ(countTree(oak.skeleton, oak.appearance, {.sources = true}, {}, scratch, counts), MeshResult::Ok);
    TreeMesh mesh;
    mesh.reserve(counts);
    const Vec3* const positions = mesh.positions.data();
    const std::uint32_t* const indices = mesh.indices.data();
    ASSERT_EQ(meshTree(oak.skeleton, oak.appearance, {.sources = true}, {}, scratch, mesh), MeshResult::Ok);
    EXPECT_EQ(mesh.positions.data(), positions);
    EXPECT_EQ(mesh.indices.data(), indices);
    EXPECT_EQ(mesh.positions.capacity(), counts.vertices);
    EXPECT_EQ(mesh.sources.capacity(), counts.vertices);
    EXPECT_EQ(mesh.indices.capacity(), counts.indices);
}

TEST(TreeMesher, AllocatesNothingOnceWarm)
{
    if (!ESPALIER_COUNTS_ALLOCATIONS)
        GTEST_SKIP() << "under sanitizers allocations are not counted";
    forPlants(1, [&](const Plant& plant, const Mode& mode) {
        const Appearance appearance = appearanceIn(mode, plant);
        MeshScratch scratch;
        TreeMesh mesh;
        WindScratch windScratch;
        WindVertices wind;
        Foliage foliage;
        MeshCounts counts;
        MeshResult result = MeshResult::Ok;
        bool hasWind = false;
        const auto work = [&] {
            mesh.clear();
            result = countTree(plant.skeleton, appearance, mode.settings, {}, scratch, counts);
            (void)meshBound(plant.skeleton, appearance, mode.settings, {}, scratch, counts);
            (void)meshTree(plant.skeleton, appearance, mode.settings, {}, scratch, mesh);
            (void)placeLeaves(plant.skeleton, appearance.leaves, 1, {}, scratch.placing, foliage);
            hasWind = computeWind(plant.skeleton, mesh, windScratch, wind);
        };
        work();
        const std::uint64_t before = allocations::count;
        work();
        const std::uint64_t after = allocations::count;
        EXPECT_EQ(after - before, 0u);
        EXPECT_EQ(result, MeshResult::Ok);
        EXPECT_EQ(hasWind, mode.settings.sources);
    });
}

namespace {

/// Plants small enough to make many levels of: a birch, a spruce and some that ail.
constexpr std::array<std::size_t, 4> kSmall{3, 6, 17, 30};

} // namespace

TEST(DetailLevel, AllocatesNothingOnceWarm)
{
    if (!ESPALIER_COUNTS_ALLOCATIONS)
        GTEST_SKIP() << "under sanitizers allocations are not counted";
    for (const std::size_t index : kSmall)
    {
        const Plant& plant = plants()[index];
        const Mode mode = modes()[index % modes().size()];
        const Appearance appearance = appearanceIn(mode, plant);
        DetailScratch scratch;
        std::array<TreeMesh, 3> meshes;
        std::array<DetailLevel, 3> levels;
        meshDetailLevels(plant.skeleton, appearance, 0, mode.settings, {}, scratch, meshes, levels);
        const std::uint64_t before = allocations::count;
        meshDetailLevels(plant.skeleton, appearance, 0, mode.settings, {}, scratch, meshes, levels);
        const std::uint64_t after = allocations::count;
        EXPECT_EQ(after - before, 0u) << plant.name << ", " << mode.name;
    }
}

TEST(DetailLevel, SeveralAtOnceAreTheSameAsOneByOne)
{
    for (const std::size_t index : kSmall)
    {
        const Plant& plant = plants()[index];
        const Mode mode = modes()[(index + 1) % modes().size()];
        SCOPED_TRACE(plant.name + ", " + mode.name);
        const Appearance appearance = appearanceIn(mode, plant);
        std::array<TreeMesh, 4> meshes;
        std::array<DetailLevel, 4> levels;
        DetailScratch scratch;
        meshDetailLevels(plant.skeleton, appearance, 0, mode.settings, {}, scratch, meshes, levels);
        for (std::uint32_t level = 0; level < 4; ++level)
        {
            DetailScratch own;
            TreeMesh mesh;
            const DetailLevel alone = meshDetailLevel(plant.skeleton, appearance, level, mode.settings, {}, own, mesh);
            EXPECT_EQ(alone.result, levels[level].result);
            EXPECT_EQ(alone.error, levels[level].error);
            EXPECT_TRUE(mesh == meshes[level]) << "level " << level;
        }
    }
}

TEST(Collision, AllocatesNothingOnceWarm)
{
    if (!ESPALIER_COUNTS_ALLOCATIONS)
        GTEST_SKIP() << "under sanitizers allocations are not counted";
    for (const std::size_t index : {0u, 6u, 9u, 17u, 20u})
    {
        const Skeleton& skeleton = plants()[index].skeleton;
        CollisionScratch scratch;
        Capsules capsules;
        ConvexHull hull;
        CollisionMesh mesh;
        const auto work = [&] {
            (void)woodCapsules(skeleton, {}, scratch, capsules);
            (void)crownHull(skeleton, 64, scratch, hull);
            (void)collisionMesh(skeleton, {}, scratch, mesh);
        };
        work();
        const std::uint64_t before = allocations::count;
        work();
        const std::uint64_t after = allocations::count;
        EXPECT_EQ(after - before, 0u) << plants()[index].name;
    }
}

TEST(TubeMesher, ABranchMayLeaveWhereNothingContinuesItsParent)
{
    Skeleton skeleton = samples::fork();
    ASSERT_GT(skeleton.size(), 2u);
    std::ranges::fill(skeleton.continuations, kNoSegment); // all begin axes of their own, and the trunk ends there
    ASSERT_TRUE(isSound(skeleton));
    for (const TubeJoints joints : {TubeJoints::Embed, TubeJoints::Weld})
    {
        TubeSettings settings;
        settings.joints = joints;
        TubeScratch scratch;
        TreeMesh mesh;
        EXPECT_EQ(meshTubes(skeleton, {}, settings, {}, scratch, mesh), MeshResult::Ok);
        EXPECT_EQ(scratch.tubes.size(), skeleton.size());
    }
}

// An engine's way: it asks for sizes, takes memory of its own, and gets the mesh into it.
TEST(VertexLayout, SizesAreKnownBeforeTheMeshIs)
{
    const Plant& birch = plants()[3];
    const std::array<VertexAttributeFormat, 4> attributes{
        {{VertexSemantic::Position, VertexFormat::Float32x3, 0},
         {VertexSemantic::Normal, VertexFormat::Snorm8x4, 12},
         {VertexSemantic::TextureCoordinate, VertexFormat::Float16x2, 16},
         {VertexSemantic::Colour, VertexFormat::Unorm8x4, 20}}};
    const VertexLayout layout{24, attributes};
    MeshScratch scratch;
    TreeMesh mesh;
    std::vector<std::byte> vertices;
    std::vector<std::uint32_t> indices;
    std::uint64_t allocated = 1;
    bool isWritten = false;
    for (int round = 0; round < 2; ++round)
    {
        const std::uint64_t before = allocations::count;
        mesh.clear();
        MeshCounts counts;
        ASSERT_EQ(countTree(birch.skeleton, birch.appearance, {}, {}, scratch, counts), MeshResult::Ok);
        vertices.resize(vertexBytesOf(counts, layout));
        indices.resize(counts.indices);
        ASSERT_EQ(meshTree(birch.skeleton, birch.appearance, {}, {}, scratch, mesh), MeshResult::Ok);
        isWritten = writeVertices(mesh, layout, vertices) == VertexResult::Ok &&
                    writeIndices(mesh, std::span(indices)) == VertexResult::Ok;
        allocated = allocations::count - before;
    }
    EXPECT_TRUE(isWritten);
    EXPECT_EQ(vertices.size(), espalier::bytesOf(mesh, layout));
    EXPECT_EQ(indices, std::vector<std::uint32_t>(mesh.indices.begin(), mesh.indices.end()));
    if (ESPALIER_COUNTS_ALLOCATIONS)
    {
        EXPECT_EQ(allocated, 0u);
    }
}

} // namespace espalier
