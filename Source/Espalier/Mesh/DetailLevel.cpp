#include <Espalier/Mesh/DetailLevel.h>

#include <algorithm>
#include <cmath>

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

MeshResult meshThinned(const Skeleton& full, const Appearance& appearance, float error, const MeshSettings& settings,
                       const Limits& limits, DetailScratch& scratch, TreeMesh& mesh)
{
    thinSkeleton(full, error, scratch.thinning, scratch.thinned);
    return meshTree(scratch.thinned, appearance, coarserBy(error, settings), limits, scratch.mesh, mesh);
}

} // namespace

DetailLevel meshDetailLevel(const Skeleton& full, const Appearance& appearance, std::uint32_t level,
                            const MeshSettings& settings, const Limits& limits, DetailScratch& scratch, TreeMesh& mesh)
{
    DetailLevel detail{meshTree(full, appearance, settings, limits, scratch.mesh, mesh), 0};
    level = std::min(level, kMostDetailLevel);
    if (detail.result != MeshResult::Ok || level == 0)
        return detail;
    const std::size_t wanted = mesh.indices.size() >> level;

    // Facets of the full plant are that far off already: nothing finer than them would be less.
    const float finest = std::max(2 * settings.tubes.chordError, 1e-4f);
    // The same steps for every level: what is too fine for this one is so for the next, so errors never fall.
    int fine = 0;
    int coarse = kSteps;
    while (coarse - fine > 1)
    {
        const int middle = (fine + coarse) / 2;
        scratch.trial.clear();
        const MeshResult result =
            meshThinned(full, appearance, errorAt(middle, finest), settings, limits, scratch, scratch.trial);
        const bool isCoarse = result != MeshResult::Ok || scratch.trial.indices.size() <= wanted;
        (isCoarse ? coarse : fine) = middle;
    }
    detail.error = errorAt(coarse, finest);
    mesh.clear();
    detail.result = meshThinned(full, appearance, detail.error, settings, limits, scratch, mesh);
    return detail;
}

} // namespace espalier
