#include <Espalier/Mesh/TreeMesher.h>
#include <Espalier/Mesh/WoodShade.h>
#include <Espalier/Species/Appearance.h>
#include <algorithm>
#include <limits>
#include <string>

namespace espalier {
namespace {

/// A mesh as it was.
class Bookmark
{
public:
    explicit Bookmark(const TreeMesh& mesh)
        : vertices_(mesh.positions.size()), tints_(mesh.tints.size()), sources_(mesh.sources.size()),
          indices_(mesh.indices.size()), parts_(mesh.parts.size())
    {}

    void restore(TreeMesh& mesh) const
    {
        mesh.resizeVertices(vertices_, {});
        mesh.tints.resize(tints_);
        mesh.sources.resize(sources_);
        mesh.indices.resize(indices_);
        mesh.parts.resize(parts_);
    }

private:
    std::size_t vertices_, tints_, sources_, indices_, parts_;
};

/// Tints where the species has any; they are all or nothing.
MeshStreams streamsFor(const Appearance& appearance, const MeshSettings& settings)
{
    const bool hasYoungWood = appearance.bark.youngRadius > 0 && appearance.bark.youngTint != Vec3(1);
    return {.tints = hasYoungWood || !appearance.leaves.empty(), .sources = settings.sources};
}

TubeSettings tubeSettingsFor(const Appearance& appearance, const MeshSettings& settings)
{
    TubeSettings tubes = settings.tubes;
    const std::size_t entries = std::clamp<std::size_t>(appearance.palette.size(), 1, kMaxPalette);
    tubes.colours = std::min(tubes.colours, static_cast<std::uint16_t>(entries));
    tubes.streams = streamsFor(appearance, settings);
    return tubes;
}

ShapeSettings shapeSettingsFor(const Appearance& appearance, const MeshSettings& settings)
{
    ShapeSettings shapes = settings.shapes;
    shapes.streams = streamsFor(appearance, settings);
    return shapes;
}

/// True if it is well, even though there may have been nothing to do.
bool isMeshed(MeshResult result)
{
    return result == MeshResult::Ok || result == MeshResult::EmptySkeleton;
}

} // namespace

MeshResult meshBare(const Skeleton& skeleton, const Appearance& appearance, const MeshSettings& settings,
                    const Limits& limits, MeshScratch& scratch, TreeMesh& mesh)
{
    const Bookmark before(mesh);
    const TubeSettings tubes = tubeSettingsFor(appearance, settings);
    const MeshResult wood = meshTubes(skeleton, appearance.bark, tubes, limits, scratch.tubes, mesh);
    if (!isMeshed(wood))
        return wood;
    scratch.woodEnd = mesh.positions.size();
    const MeshResult shapes =
        meshShapes(skeleton, appearance, shapeSettingsFor(appearance, settings), limits, scratch.shapes, mesh);
    if (!isMeshed(shapes))
        before.restore(mesh);
    return shapes == MeshResult::EmptySkeleton ? wood : shapes;
}

MeshResult countBare(const Skeleton& skeleton, const Appearance& appearance, const MeshSettings& settings,
                     const Limits& limits, MeshScratch& scratch, MeshCounts& counts, std::uint64_t enough)
{
    MeshCounts all = counts;
    const TubeSettings tubes = tubeSettingsFor(appearance, settings);
    const MeshResult wood = countTubes(skeleton, appearance.bark, tubes, limits, scratch.tubes, all, enough);
    if (!isMeshed(wood))
        return wood;
    if (all.indices > enough)
    {
        counts = all;
        return wood;
    }
    const MeshResult shapes =
        countShapes(skeleton, appearance, shapeSettingsFor(appearance, settings), limits, scratch.shapes, all);
    if (isMeshed(shapes))
        counts = all;
    return shapes == MeshResult::EmptySkeleton ? wood : shapes;
}

LeafSettings leafSettingsOf(const Skeleton& skeleton, const MeshSettings& settings) noexcept
{
    LeafSettings leaves = settings.leaves;
    leaves.streams = {.tints = true, .sources = settings.sources};
    leaves.firstOrgan =
        static_cast<std::uint32_t>(skeleton.polygons.size() + skeleton.spheres.size() + skeleton.organs.size());
    return leaves;
}

MeshResult meshTree(const Skeleton& skeleton, const Appearance& appearance, const MeshSettings& settings,
                    const Limits& limits, MeshScratch& scratch, TreeMesh& mesh)
{
    const Bookmark before(mesh);
    const std::size_t firstVertex = mesh.positions.size();
    const MeshResult bare = meshBare(skeleton, appearance, settings, limits, scratch, mesh);
    if (!isMeshed(bare))
        return bare;
    MeshResult leaves =
        placeLeaves(skeleton, appearance.leaves, settings.tubes.smoothing, limits, scratch.placing, scratch.foliage);
    if (leaves == MeshResult::Ok)
    {
        shadeWood(scratch.placing.light, appearance.bark.shade, firstVertex, scratch.woodEnd, mesh);
        leaves = meshLeaves(scratch.foliage, appearance.leaves, leafSettingsOf(skeleton, settings), limits,
                            scratch.leaves, mesh);
    }
    if (!isMeshed(leaves))
        before.restore(mesh);
    return leaves == MeshResult::EmptySkeleton ? bare : leaves;
}

MeshResult countTree(const Skeleton& skeleton, const Appearance& appearance, const MeshSettings& settings,
                     const Limits& limits, MeshScratch& scratch, MeshCounts& counts)
{
    MeshCounts all = counts;
    const MeshResult bare = countBare(skeleton, appearance, settings, limits, scratch, all);
    if (!isMeshed(bare))
        return bare;
    MeshResult leaves =
        placeLeaves(skeleton, appearance.leaves, settings.tubes.smoothing, limits, scratch.placing, scratch.foliage);
    if (leaves == MeshResult::Ok)
    {
        const LeafSettings kept = leafSettingsOf(skeleton, settings);
        leaves =
            addLeaves(countLeaves(scratch.foliage, appearance.leaves, kept, scratch.leaves), kept.streams, limits, all);
    }
    if (isMeshed(leaves))
        counts = all;
    return leaves == MeshResult::EmptySkeleton ? bare : leaves;
}

MeshResult meshBound(const Skeleton& skeleton, const Appearance& appearance, const MeshSettings& settings,
                     const Limits& limits, MeshScratch& scratch, MeshCounts& counts)
{
    MeshCounts all = counts;
    const MeshResult bare = countBare(skeleton, appearance, settings, limits, scratch, all);
    if (!isMeshed(bare))
        return bare;
    PlaceCounts places{};
    MeshResult leaves =
        countPlaces(skeleton, appearance.leaves, settings.tubes.smoothing, limits, scratch.placing, places);
    if (leaves == MeshResult::Ok)
    {
        const LeafCounts most =
            countLeaves(places, appearance.leaves, leafSettingsOf(skeleton, settings), scratch.leaves);
        all.vertices = std::min<std::uint64_t>(all.vertices + most.vertices, limits.vertices);
        all.indices = std::min<std::uint64_t>(all.indices + most.indices, std::numeric_limits<std::uint32_t>::max());
        all.parts += most.parts;
        all.streams = streamsFor(appearance, settings);
    }
    if (isMeshed(leaves))
        counts = all;
    return leaves == MeshResult::EmptySkeleton ? bare : leaves;
}

Expected<TreeMesh> meshTree(const Skeleton& skeleton, const Appearance& appearance, const MeshSettings& settings,
                            const Limits& limits)
{
    MeshScratch scratch;
    TreeMesh mesh;
    const MeshResult result = meshTree(skeleton, appearance, settings, limits, scratch, mesh);
    if (result != MeshResult::Ok)
        return failure(result == MeshResult::TooManyVertices ? ErrorKind::Limit : ErrorKind::BadInput, {},
                       "the plant gives no mesh: " + std::string(reasonOf(result)));
    return mesh;
}

} // namespace espalier
