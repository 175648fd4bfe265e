#include <Espalier/Mesh/TreeMesher.h>
#include <Espalier/Species/Appearance.h>
#include <algorithm>
#include <string>

namespace espalier {
namespace {

struct MeshSizes
{
    std::size_t vertices;
    std::size_t indices;
    std::size_t parts;
};

void shrink(const MeshSizes& to, TreeMesh& mesh)
{
    mesh.resizeVertices(to.vertices, {});
    mesh.indices.resize(to.indices);
    mesh.parts.resize(to.parts);
}

/// Tints where the species has any; they are all or nothing.
MeshStreams streamsFor(const Appearance& appearance, const MeshSettings& settings)
{
    const bool hasYoungWood = appearance.bark.youngRadius > 0 && appearance.bark.youngTint != Vec3(1);
    return {.tints = hasYoungWood || !appearance.leaves.empty(), .sources = settings.sources};
}

} // namespace

MeshResult meshTree(const Skeleton& skeleton, const Appearance& appearance, const MeshSettings& settings,
                    const Limits& limits, MeshScratch& scratch, TreeMesh& mesh)
{
    const MeshSizes before{mesh.positions.size(), mesh.indices.size(), mesh.parts.size()};
    TubeSettings tubes = settings.tubes;
    const std::size_t entries = std::clamp<std::size_t>(appearance.palette.size(), 1, kMaxPalette);
    tubes.colours = std::min(tubes.colours, static_cast<std::uint16_t>(entries));
    tubes.streams = streamsFor(appearance, settings);
    const MeshResult wood = meshTubes(skeleton, appearance.bark, tubes, limits, scratch.tubes, mesh);
    if (wood != MeshResult::Ok && wood != MeshResult::EmptySkeleton)
        return wood;
    ShapeSettings shapeSettings = settings.shapes;
    shapeSettings.streams = tubes.streams;
    const MeshResult shapes = meshShapes(skeleton, appearance, shapeSettings, limits, scratch.shapes, mesh);
    if (shapes == MeshResult::EmptySkeleton)
        return wood;
    if (shapes != MeshResult::Ok)
        shrink(before, mesh);
    return shapes;
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
