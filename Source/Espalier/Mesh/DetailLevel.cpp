#include <Espalier/Mesh/DetailLevel.h>

#include <Espalier/Mesh/WoodShade.h>
#include <algorithm>
#include <cmath>
#include <limits>

namespace espalier {

namespace {

/// Errors are tried in steps of 2 %, up to beyond any plant.
constexpr float kStep = 1.02f;
constexpr int kSteps = 1024;

float errorAt(int step, float finest)
{
    float error = finest;
    for (float factor = kStep; step > 0; step >>= 1, factor *= factor) // no pow: the same bits everywhere
        if (step & 1)
            error *= factor;
    return error;
}

/// Counts what a plant would take at one error or another, and makes it a mesh at the one that is chosen.
class LevelMesher
{
public:
    LevelMesher(const Skeleton& full, const Appearance& appearance, const MeshSettings& settings, const Limits& limits,
                DetailScratch& scratch)
        : full_(full), appearance_(appearance), settings_(settings), limits_(limits), scratch_(scratch),
          finest_(std::max(2 * settings.tubes.chordError, 1e-4f))
    {}

    /// Counts the full plant and finds the places of its leaves.
    MeshResult begin()
    {
        scratch_.tried.clear();
        MeshCounts bare;
        const MeshResult wood = countBare(full_, appearance_, settings_, limits_, scratch_.mesh, bare);
        if (wood != MeshResult::Ok && wood != MeshResult::EmptySkeleton)
            return wood;
        const MeshResult placed = placeLeaves(full_, appearance_.leaves, settings_.tubes.smoothing, limits_,
                                              scratch_.mesh.placing, scratch_.mesh.foliage);
        if (placed != MeshResult::Ok && placed != MeshResult::EmptySkeleton)
            return placed;
        const LeafCounts leaves = leavesAt(0);
        indices_ = bare.indices + leaves.indices;
        if (placed == MeshResult::EmptySkeleton)
            return wood;
        const bool isMuch = leaves.vertices + bare.vertices > limits_.vertices;
        return isMuch ? MeshResult::TooManyVertices : MeshResult::Ok;
    }

    /// The coarser mesh that has at most 1 / 2^level of the full plant's triangles.
    DetailLevel mesh(std::uint32_t level, TreeMesh& mesh)
    {
        const std::uint64_t wanted = indices_ >> level;
        // The same steps for every level: what is too fine for this one is so for the next, so errors never fall.
        int fine = 0;
        int coarse = kSteps;
        while (coarse - fine > 1)
        {
            const int middle = (fine + coarse) / 2;
            (isFewAt(middle, wanted) ? coarse : fine) = middle;
        }
        // Of the last step nobody knows yet whether it has a mesh, even if one of too many triangles.
        const bool hasMesh = coarse < kSteps || isFewAt(coarse, std::numeric_limits<std::uint64_t>::max());
        const float error = errorAt(coarse, finest_);
        return {write(hasMesh ? error : 0, error, mesh), error};
    }

private:
    /// True if the plant thinned by the error of `step` has a mesh, of no more indices than wanted.
    [[nodiscard]] bool isFewAt(int step, std::uint64_t wanted)
    {
        DetailScratch::Trial& trial = trialAt(step);
        if (trial.bare + trial.leaves > wanted)
            return false;
        if (!trial.isCounted)
        {
            // One triangle too many is enough to know: fine steps cost no more than a mesh of what is wanted.
            const std::uint64_t enough = wanted - trial.leaves;
            const float error = errorAt(step, finest_);
            thinSkeleton(full_, error, scratch_.thinning, scratch_.thinned, settings_.tubes.joints);
            MeshCounts bare;
            const MeshResult result =
                countBare(scratch_.thinned, appearance_, woodSettings(error), limits_, scratch_.mesh, bare, enough);
            // Nothing left of bare wood is few enough; wood that was widened beyond all limits is no mesh.
            trial.hasMesh = result == MeshResult::Ok || result == MeshResult::EmptySkeleton;
            trial.bare = bare.indices;
            trial.isCounted = !(trial.hasMesh && trial.bare > enough);
        }
        return trial.hasMesh && trial.bare + trial.leaves <= wanted;
    }

    /// What is known of a step; its leaves are counted.
    [[nodiscard]] DetailScratch::Trial& trialAt(int step)
    {
        const auto known = std::ranges::find(scratch_.tried, step, &DetailScratch::Trial::step);
        if (known != scratch_.tried.end())
            return *known;
        return scratch_.tried.emplace_back(
            DetailScratch::Trial{.step = step, .leaves = leavesAt(errorAt(step, finest_)).indices});
    }

    /// Fills `mesh` with the plant, its wood thinned by one error and its leaves by another.
    MeshResult write(float woodError, float leafError, TreeMesh& mesh)
    {
        mesh.clear();
        thinSkeleton(full_, woodError, scratch_.thinning, scratch_.thinned, settings_.tubes.joints);
        const MeshResult bare =
            meshBare(scratch_.thinned, appearance_, woodSettings(woodError), limits_, scratch_.mesh, mesh);
        nameFullSources(scratch_.thinning, mesh);
        if (!scratch_.mesh.foliage.leaves.empty())
            shadeWood(scratch_.mesh.placing.light, appearance_.bark.shade, 0, scratch_.mesh.woodEnd, mesh);
        const MeshResult leaves = meshLeaves(scratch_.mesh.foliage, appearance_.leaves, leafSettings(leafError),
                                             limits_, scratch_.mesh.leaves, mesh);
        if (leaves == MeshResult::EmptySkeleton)
            return bare;
        if (leaves != MeshResult::Ok)
            mesh.clear();
        return leaves;
    }

    /// For the thinned plant as it is.
    [[nodiscard]] MeshSettings woodSettings(float error) const
    {
        MeshSettings settings = coarserBy(error, settings_);
        settings.tubes.widening = scratch_.thinning.widening;
        return settings;
    }

    [[nodiscard]] LeafSettings leafSettings(float error) const
    {
        return leafSettingsOf(full_, coarserBy(error, settings_));
    }

    [[nodiscard]] LeafCounts leavesAt(float error)
    {
        return countLeaves(scratch_.mesh.foliage, appearance_.leaves, leafSettings(error), scratch_.mesh.leaves);
    }

    const Skeleton& full_;
    const Appearance& appearance_;
    const MeshSettings& settings_;
    const Limits& limits_;
    DetailScratch& scratch_;
    /// Metres. Facets of the full plant are that far off already: nothing finer than them would be less.
    const float finest_;
    std::uint64_t indices_ = 0; ///< Three a triangle, of the full plant.
};

} // namespace

void meshDetailLevels(const Skeleton& full, const Appearance& appearance, std::uint32_t first,
                      const MeshSettings& settings, const Limits& limits, DetailScratch& scratch,
                      std::span<TreeMesh> meshes, std::span<DetailLevel> levels)
{
    LevelMesher mesher(full, appearance, settings, limits, scratch);
    MeshResult begun = MeshResult::Ok;
    bool isBegun = false;
    for (std::size_t i = 0; i < meshes.size(); ++i)
    {
        const auto level = static_cast<std::uint32_t>(std::min<std::size_t>(first + i, kMostDetailLevel));
        if (level == 0)
        {
            meshes[i].clear();
            levels[i] = {meshTree(full, appearance, settings, limits, scratch.mesh, meshes[i]), 0};
            continue;
        }
        if (!isBegun)
            begun = mesher.begin();
        isBegun = true;
        if (begun == MeshResult::Ok)
            levels[i] = mesher.mesh(level, meshes[i]);
        else
        {
            meshes[i].clear();
            levels[i] = {begun, 0};
        }
    }
}

DetailLevel meshDetailLevel(const Skeleton& full, const Appearance& appearance, std::uint32_t level,
                            const MeshSettings& settings, const Limits& limits, DetailScratch& scratch, TreeMesh& mesh)
{
    DetailLevel detail;
    meshDetailLevels(full, appearance, level, settings, limits, scratch, {&mesh, 1}, {&detail, 1});
    return detail;
}

} // namespace espalier
