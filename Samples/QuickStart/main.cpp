// From one drawn tree to a baked relative: the whole path, one function a step.
// Run it from the repository's root: Build/release/bin/espalier_quickstart [out.glb]

#include <Espalier/Archetype/Archetype.h>
#include <Espalier/Bake/Gltf.h>
#include <Espalier/Inference/Inference.h>
#include <Espalier/Mesh/TreeMesher.h>
#include <Espalier/Overlap/Overlap.h>
#include <Espalier/Species/Grow.h>
#include <iostream>

using namespace espalier;

namespace {

template <class T>
T orExit(Expected<T> result)
{
    if (!result)
    {
        std::cerr << toString(result.error()) << '\n';
        std::exit(1);
    }
    if constexpr (!std::is_void_v<T>)
        return std::move(*result);
}

} // namespace

int main(int argc, char** argv)
{
    const std::string output = argc > 1 ? argv[1] : "quickstart.glb";

    // 1. What the designer drew.
    const Archetype archetype = orExit(loadArchetype("Content/Oak.archetype", {{"Templates"}}));

    // 2. The rules behind it. Offline; a game ships the result as a file of some kilobytes.
    const Species oak = orExit(inferSpecies({&archetype, 1}, {.name = "Oak"}));

    // 3. One individual. In a game, keep the Grower and one scratch a thread: nothing is allocated once they are warm.
    const Grower grower = orExit(Grower::make(oak));
    GrowScratch scratch;
    Skeleton skeleton;
    orExit(grower.grow(Seed{42}, {}, scratch, skeleton));

    // 4. Does it cut into itself?
    const OverlapReport overlaps = orExit(findOverlaps(skeleton));

    // 5. Bark, leaves and all. (In a game, the function of this name that takes a scratch.)
    const TreeMesh mesh = orExit(meshTree(skeleton, oak.appearance));

    // 6. A file that every tool reads.
    orExit(writeGlb(output, mesh, oak.appearance, {oak.name, hashOf(oak), Seed{42}}));

    std::cout << output << ": " << skeleton.size() << " segments, " << mesh.indices.size() / 3 << " triangles, "
              << overlaps.overlaps.size() << " overlaps\n";
    return 0;
}
