// What a game does: load a species once, then grow as many trees as it has seeds.
//   game SPECIES

#include <Espalier/Mesh/TubeMesher.h>
#include <Espalier/Overlap/Overlap.h>
#include <Espalier/Species/Grow.h>
#include <iostream>

using namespace espalier;

int fail(const Error& error)
{
    std::cerr << toString(error) << '\n';
    return 1;
}

int main(int argc, char** argv)
{
    const auto species = loadSpecies(argc > 1 ? argv[1] : "tree.species");
    if (!species)
        return fail(species.error());
    const auto grower = Grower::make(*species); // immutable: all threads share it
    if (!grower)
        return fail(grower.error());

    GrowScratch growScratch; // one of each a thread: nothing is allocated once they are warm
    TubeScratch tubeScratch;
    Skeleton skeleton;
    TreeMesh mesh;
    for (std::uint64_t seed = 1; seed <= 8; ++seed)
    {
        if (const auto grown = grower->grow(Seed{seed}, {}, growScratch, skeleton); !grown)
            return fail(grown.error());

        mesh.clear();
        if (meshTubes(skeleton, species->appearance.bark, {}, {}, tubeScratch, mesh) != MeshResult::Ok)
            return fail({.what = "tree " + std::to_string(seed) + " has no mesh"});

        const auto overlaps = findOverlaps(skeleton); // do branches cut into each other?
        if (!overlaps)
            return fail(overlaps.error());

        std::cout << "tree " << seed << ": " << skeleton.size() << " segments, " << mesh.indices.size() / 3
                  << " triangles, " << overlaps->overlaps.size() << " overlaps\n";
    }
}
