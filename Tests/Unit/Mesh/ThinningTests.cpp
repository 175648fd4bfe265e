#include <Espalier/Mesh/Thinning.h>

#include <Espalier/Archetype/Placement.h>
#include <Espalier/Mesh/DetailLevel.h>
#include <Espalier/Mesh/Silhouette.h>
#include <Espalier/Plant/Axes.h>
#include <Espalier/Species/Appearance.h>
#include <Plant/SampleSkeletons.h>
#include <algorithm>
#include <array>
#include <filesystem>
#include <gtest/gtest.h>
#include <iterator>
#include <map>
#include <set>

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

Skeleton thinned(const Skeleton& full, float error)
{
    ThinningScratch scratch;
    Skeleton result;
    thinSkeleton(full, error, scratch, result);
    return result;
}

/// Square metres that all segments cover, seen across: twice the mean radius times the length.
double areaOf(const Skeleton& skeleton)
{
    double area = 0;
    for (std::uint32_t i = 0; i < skeleton.size(); ++i)
        area += static_cast<double>(skeleton.startRadii[i] + skeleton.endRadii[i]) *
                static_cast<double>(glm::length(skeleton.ends[i] - skeleton.starts[i]));
    return area;
}

/// Where its axes begin.
std::set<std::array<float, 3>> axesOf(const Skeleton& skeleton)
{
    std::set<std::array<float, 3>> axes;
    for (std::uint32_t i = 0; i < skeleton.size(); ++i)
        if (skeleton.startsAxis(i))
        {
            const Vec3 start = skeleton.starts[i];
            axes.insert({start.x, start.y, start.z});
        }
    return axes;
}

} // namespace

TEST(Thinning, WithoutAnErrorChangesNothing)
{
    const Skeleton full = drawn("Thesis");
    EXPECT_EQ(thinned(full, 0), full);
    EXPECT_EQ(thinned(full, -1), full);
    EXPECT_EQ(thinned(Skeleton{}, 0.1f), Skeleton{});
}

TEST(Thinning, KeepsPlantsSoundAndTheirTrunks)
{
    for (const char* name : {"Thesis", "Oak", "Spruce", "Palm", "Willow", "Birch"})
    {
        const Skeleton full = drawn(name);
        std::uint32_t before = full.size() + 1;
        for (const float error : {0.001f, 0.01f, 0.05f, 0.2f, 1.0f, 100.0f})
        {
            SCOPED_TRACE(std::string(name) + " by " + std::to_string(error));
            const Skeleton thin = thinned(full, error);
            EXPECT_TRUE(isSound(thin));
            ASSERT_FALSE(thin.empty());
            EXPECT_LE(thin.size(), before);
            before = thin.size();
            EXPECT_EQ(thin.starts[0], full.starts[0]);
            EXPECT_GE(thin.startRadii[0], full.startRadii[0]);
            EXPECT_LE(thin.startRadii[0], 1.14f * full.startRadii[0]) << "what facets cut off";
            for (std::uint32_t i = 0; i < thin.size(); ++i)
                if (const std::uint32_t next = thin.continuations[i]; next != kNoSegment)
                {
                    EXPECT_EQ(thin.starts[next], thin.ends[i]);
                    EXPECT_EQ(thin.startRadii[next], thin.endRadii[i]);
                }
            EXPECT_EQ(thinned(full, error), thin) << "the same again";
        }
    }
}

TEST(Thinning, KeepsAilingPlantsSound)
{
    for (std::uint64_t seed = 0; seed < 200; ++seed)
    {
        const Skeleton full = samples::randomTree(seed, 60, samples::Ailments::All);
        for (const float error : {1e-6f, 0.01f, 0.1f, 10.0f})
            EXPECT_TRUE(isSound(thinned(full, error))) << "seed " << seed << ", error " << error;
    }
}

TEST(Thinning, CoversWhatTheFullPlantDid)
{
    for (const char* name : {"Oak", "Willow"})
    {
        const Skeleton full = drawn(name);
        for (const float error : {0.01f, 0.02f, 0.04f})
        {
            const Skeleton thin = thinned(full, error);
            // Facets cut some of it off, and wide twigs hide more of each other.
            EXPECT_NEAR(areaOf(thin) / areaOf(full), 1.1, 0.12) << name << " by " << error;
            EXPECT_LT(thin.size(), full.size());
        }
    }
}

TEST(Thinning, BringsNothingBack)
{
    const Skeleton full = drawn("Oak");
    std::set<std::array<float, 3>> before = axesOf(full);
    for (float error = 0.005f; error < 1; error *= 1.3f)
    {
        const std::set<std::array<float, 3>> now = axesOf(thinned(full, error));
        EXPECT_TRUE(std::ranges::includes(before, now)) << error;
        before = now;
    }
    EXPECT_LT(before.size(), 200u);
}

TEST(Thinning, ChoosesBranchesByTheirPlacesAlone)
{
    for (const char* name : {"Oak", "Birch"})
    {
        const Skeleton full = drawn(name);
        for (const float error : {0.01f, 0.03f})
        {
            const Skeleton thin = thinned(full, error);
            EXPECT_EQ(axesOf(thinned(samples::renumbered(full, samples::byDepth(full)), error)), axesOf(thin))
                << name << " by " << error;
            for (std::uint32_t branch = 1; branch < full.size(); branch += full.size() / 20)
            {
                if (!full.startsAxis(branch))
                    continue;
                // Where branches begin, those on the one that is cut left out.
                const std::vector<std::uint32_t> kept = samples::allWithout(full, branch);
                const Skeleton cut = samples::renumbered(full, kept);
                const std::set<std::array<float, 3>> there = axesOf(cut);
                std::set<std::array<float, 3>> expected;
                std::ranges::set_intersection(axesOf(thin), there, std::inserter(expected, expected.end()));
                std::set<std::array<float, 3>> found = axesOf(thinned(cut, error));
                const Vec3 joint = full.starts[branch]; // of the cut branch too, whether others begin there or not
                expected.erase({joint.x, joint.y, joint.z});
                found.erase({joint.x, joint.y, joint.z});
                EXPECT_EQ(found, expected) << name << " by " << error << " without " << branch;
            }
        }
    }
}

TEST(DetailLevel, HasHalfAsManyTrianglesAsTheOneBefore)
{
    for (const char* name : {"Oak", "Palm"})
    {
        const Skeleton full = drawn(name);
        DetailScratch scratch;
        float error = 0;
        std::size_t all = 0;
        for (std::uint32_t level = 0; level <= 5; ++level)
        {
            SCOPED_TRACE(std::string(name) + " level " + std::to_string(level));
            TreeMesh mesh;
            const DetailLevel detail = meshDetailLevel(full, {}, level, {}, {}, scratch, mesh);
            ASSERT_EQ(detail.result, MeshResult::Ok);
            all = level == 0 ? mesh.indices.size() : all;
            EXPECT_LE(mesh.indices.size(), all >> level);
            EXPECT_GT(mesh.indices.size(), all >> (level + 2)) << "not fewer than need be";
            EXPECT_GE(detail.error, error);
            EXPECT_EQ(detail.error > 0, level > 0);
            error = detail.error;
            for (std::size_t i = 0; i < mesh.normals.size(); ++i)
                ASSERT_NEAR(glm::length(mesh.normals[i]), 1, 1e-3);
        }
    }
}

namespace {

MeshSettings withSources()
{
    MeshSettings settings;
    settings.sources = true;
    return settings;
}

/// Of each leaf of a mesh, by its number: the square of its length from foot to tip.
std::map<std::uint32_t, double> leavesOf(const TreeMesh& mesh)
{
    struct Ends
    {
        std::array<Vec3, 2> sums{Vec3(0), Vec3(0)};
        std::array<float, 2> counts{};
    };
    std::map<std::uint32_t, Ends> ends;
    for (std::size_t i = 0; i < mesh.positions.size(); ++i)
        if (const float along = mesh.uvs[i].y; mesh.sources[i].organ != kNoOrgan && (along == 0 || along == 1))
        {
            Ends& leaf = ends[mesh.sources[i].organ];
            leaf.sums[along == 0 ? 0 : 1] += mesh.positions[i];
            leaf.counts[along == 0 ? 0 : 1] += 1;
        }
    std::map<std::uint32_t, double> squares;
    for (const auto& [organ, leaf] : ends)
    {
        const Vec3 way = leaf.sums[1] / leaf.counts[1] - leaf.sums[0] / leaf.counts[0];
        squares[organ] = static_cast<double>(glm::dot(way, way));
    }
    return squares;
}

} // namespace

TEST(DetailLevel, KeepsTheCrownInLeaf)
{
    struct Case
    {
        const char* name;
        LeafForm form;
    };
    for (const Case& test : {Case{"Oak", LeafForm::Blade}, Case{"Spruce", LeafForm::Crossed}})
    {
        const Skeleton full = drawn(test.name);
        Appearance appearance;
        appearance.leaves = {LeafAppearance{.thickestWood = 0.015f, .spacing = 0.06f, .form = test.form}};
        DetailScratch scratch;
        float error = 0;
        std::size_t all = 0;
        std::map<std::uint32_t, double> before;
        double wholeArea = 0;
        for (std::uint32_t level = 0; level <= 6; ++level)
        {
            SCOPED_TRACE(std::string(test.name) + " level " + std::to_string(level));
            TreeMesh mesh;
            const DetailLevel detail = meshDetailLevel(full, appearance, level, withSources(), {}, scratch, mesh);
            ASSERT_EQ(detail.result, MeshResult::Ok);
            all = level == 0 ? mesh.indices.size() : all;
            EXPECT_LE(mesh.indices.size(), all >> level);
            EXPECT_GT(mesh.indices.size(), all >> (level + 2)) << "not fewer than need be";
            EXPECT_GE(detail.error, error);
            error = detail.error;
            ASSERT_EQ(mesh.sources.size(), mesh.positions.size());
            for (const VertexSource& source : mesh.sources)
                ASSERT_LT(source.segment, full.size());

            const std::map<std::uint32_t, double> leaves = leavesOf(mesh);
            double area = 0;
            for (const auto& [organ, square] : leaves)
            {
                area += square;
                ASSERT_TRUE(level == 0 || before.contains(organ)) << "leaf " << organ << " comes back";
            }
            wholeArea = level == 0 ? area : wholeArea;
            EXPECT_NEAR(area / wholeArea, 1, 0.1);
            before = leaves;
        }
    }
}

TEST(DetailLevel, BareCrownsCoverWhatTheyDid)
{
    for (const char* name : {"Birch", "Oak"})
    {
        const Skeleton full = drawn(name);
        DetailScratch scratch;
        SilhouetteScratch silhouettes;
        std::array<TreeMesh, 6> meshes;
        std::array<DetailLevel, 6> levels;
        meshDetailLevels(full, {}, 0, {}, {}, scratch, meshes, levels);
        for (const std::size_t level : {3u, 5u}) // finer ones take long to draw
        {
            const SilhouetteDifference difference =
                compareSilhouettes(meshes[0], meshes[level], {}, levels[level].error, silhouettes);
            EXPECT_NEAR(difference.coverage, 1, 0.1) << name << " level " << level;
        }
    }
}

TEST(DetailLevel, ThinWoodHasTheTintOfWhatGrew)
{
    const Skeleton full = drawn("Birch");
    Appearance appearance;
    appearance.bark.youngTint = {0.5f, 0, 0};
    appearance.bark.youngRadius = 0.004f;
    DetailScratch scratch;
    std::array<TreeMesh, 5> meshes;
    std::array<DetailLevel, 5> levels;
    meshDetailLevels(full, appearance, 0, {}, {}, scratch, meshes, levels);
    const auto isYoung = [](const Tint& tint) { return tint.green < 128; };
    const auto shareOf = [&](const TreeMesh& mesh) {
        return static_cast<double>(std::ranges::count_if(mesh.tints, isYoung)) / static_cast<double>(mesh.tints.size());
    };
    EXPECT_GT(shareOf(meshes[0]), 0.5);
    EXPECT_GT(shareOf(meshes[4]), 0.5);
}

TEST(DetailLevel, SourcesNameTheFullPlant)
{
    Skeleton full = drawn("Oak");
    for (std::uint32_t i = 100; i < full.size(); i += 50)
        full.spheres.push_back({.centre = full.ends[i], .radius = 0.02f, .segment = i});
    DetailScratch scratch;
    TreeMesh mesh;
    const DetailLevel detail = meshDetailLevel(full, {}, 4, withSources(), {}, scratch, mesh);
    ASSERT_EQ(detail.result, MeshResult::Ok);
    ASSERT_EQ(mesh.sources.size(), mesh.positions.size());
    std::set<std::uint32_t> organs;
    for (std::size_t i = 0; i < mesh.positions.size(); ++i)
    {
        const VertexSource source = mesh.sources[i];
        ASSERT_LT(source.segment, full.size());
        if (source.organ == kNoOrgan)
            continue;
        ASSERT_LT(source.organ, full.spheres.size());
        organs.insert(source.organ);
        const SkeletonSphere& sphere = full.spheres[source.organ];
        EXPECT_LT(glm::length(mesh.positions[i] - sphere.centre), 0.02f + 3 * detail.error);
        EXPECT_LE(source.segment, sphere.segment) << "the first of those that were joined";
    }
    EXPECT_LT(organs.size(), full.spheres.size());
    EXPECT_GT(organs.size(), 0u);
}

} // namespace espalier
