#include <Espalier/Mesh/DetailLevel.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

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

class LevelMesher
{
public:
    LevelMesher(const Skeleton& full, const Appearance& appearance, const MeshSettings& settings, const Limits& limits,
                DetailScratch& scratch)
        : full_(full), appearance_(appearance), settings_(settings), limits_(limits), scratch_(scratch)
    {}

    /// Wood and shapes of the full plant, and places of its leaves.
    MeshResult begin()
    {
        scratch_.best.clear();
        const MeshResult bare = meshBare(full_, appearance_, settings_, limits_, scratch_.mesh, scratch_.best);
        if (bare != MeshResult::Ok && bare != MeshResult::EmptySkeleton)
            return bare;
        const MeshResult placed = placeLeaves(full_, appearance_.leaves, settings_.tubes.smoothing, limits_,
                                              scratch_.mesh.placing, scratch_.mesh.foliage);
        if (placed == MeshResult::EmptySkeleton)
            return bare;
        if (placed != MeshResult::Ok)
            return placed;
        const LeafCounts leaves = leavesAt(0);
        const bool isMuch = leaves.vertices + scratch_.best.positions.size() > limits_.vertices;
        return isMuch ? MeshResult::TooManyVertices : MeshResult::Ok;
    }

    /// Three a triangle, of `best` with leaves thinned by `error`.
    [[nodiscard]] std::uint64_t bestIndices(float error)
    {
        return scratch_.best.indices.size() + leavesAt(error).indices;
    }

    /// Makes the plant thinned by `error` the best so far, if it has no more indices than wanted.
    bool trial(float error, std::uint64_t wanted)
    {
        const std::uint64_t leaves = leavesAt(error).indices;
        if (leaves > wanted)
            return false;
        thinSkeleton(full_, error, scratch_.thinning, scratch_.thinned);
        scratch_.trial.clear();
        const MeshResult result = meshBare(scratch_.thinned, appearance_, coarserBy(error, settings_), limits_,
                                           scratch_.mesh, scratch_.trial);
        // Nothing left of bare wood is few enough; wood that was widened beyond all limits is no mesh.
        if ((result != MeshResult::Ok && result != MeshResult::EmptySkeleton) ||
            scratch_.trial.indices.size() + leaves > wanted)
            return false;
        nameFullSources(scratch_.thinning, scratch_.trial);
        std::swap(scratch_.best, scratch_.trial);
        return true;
    }

    /// Appends the best so far with leaves thinned by `error`.
    MeshResult finish(float error, TreeMesh& mesh)
    {
        const TreeMesh& best = scratch_.best;
        mesh = best;
        const MeshResult leaves = meshLeaves(scratch_.mesh.foliage, appearance_.leaves, leafSettings(error), limits_,
                                             scratch_.mesh.leaves, mesh);
        if (leaves == MeshResult::EmptySkeleton)
            return best.indices.empty() ? leaves : MeshResult::Ok;
        if (leaves != MeshResult::Ok)
            mesh.clear();
        return leaves;
    }

private:
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
};

} // namespace

DetailLevel meshDetailLevel(const Skeleton& full, const Appearance& appearance, std::uint32_t level,
                            const MeshSettings& settings, const Limits& limits, DetailScratch& scratch, TreeMesh& mesh)
{
    level = std::min(level, kMostDetailLevel);
    if (level == 0)
        return {meshTree(full, appearance, settings, limits, scratch.mesh, mesh), 0};
    LevelMesher mesher(full, appearance, settings, limits, scratch);
    DetailLevel detail{mesher.begin(), 0};
    if (detail.result != MeshResult::Ok)
        return detail;
    const std::uint64_t wanted = mesher.bestIndices(0) >> level;

    // Facets of the full plant are that far off already: nothing finer than them would be less.
    const float finest = std::max(2 * settings.tubes.chordError, 1e-4f);
    // The same steps for every level: what is too fine for this one is so for the next, so errors never fall.
    int fine = 0;
    int coarse = kSteps;
    while (coarse - fine > 1)
    {
        const int middle = (fine + coarse) / 2;
        (mesher.trial(errorAt(middle, finest), wanted) ? coarse : fine) = middle;
    }
    detail.error = errorAt(coarse, finest);
    if (coarse == kSteps) // not tried: even the coarsest has more
        mesher.trial(detail.error, std::numeric_limits<std::uint64_t>::max());
    detail.result = mesher.finish(detail.error, mesh);
    return detail;
}

} // namespace espalier
