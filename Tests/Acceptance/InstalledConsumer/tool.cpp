// What a studio's tool does: infer a species from a drawn tree, save it for the game, and bake one tree of it.
//   tool ARCHETYPE TEMPLATES SPECIES GLB PNG

#include <Espalier/Archetype/Archetype.h>
#include <Espalier/Bake/Gltf.h>
#include <Espalier/Core/File.h>
#include <Espalier/Inference/Inference.h>
#include <Espalier/Mesh/TubeMesher.h>
#include <Espalier/Render/Render.h>
#include <Espalier/Species/Grow.h>
#include <iostream>

using namespace espalier;

Expected<void> run(char** paths)
{
    const auto archetype = loadArchetype(paths[0], {{paths[1]}});
    if (!archetype)
        return tl::unexpected(archetype.error());
    const auto species = inferSpecies({&*archetype, 1}, {.name = "Tree"});
    if (!species)
        return tl::unexpected(species.error());
    if (const auto saved = saveSpecies(paths[2], *species); !saved)
        return saved;

    const auto skeleton = grow(*species, Seed{1});
    if (!skeleton)
        return tl::unexpected(skeleton.error());
    TubeScratch scratch;
    TreeMesh mesh;
    if (meshTubes(*skeleton, species->appearance.bark, {}, {}, scratch, mesh) != MeshResult::Ok)
        return tl::unexpected(Error{.what = "the tree has no mesh"});
    if (const auto baked = writeGlb(paths[3], mesh, species->appearance, {"Tree", hashOf(*species), Seed{1}}); !baked)
        return baked;

    const auto picture =
        renderPicture({&mesh, &species->appearance}, {.width = 80, .height = 100, .samplesPerPixel = 4});
    if (!picture)
        return tl::unexpected(picture.error());
    return writeFileAtomically(paths[4], encodePng(*picture));
}

int main(int argc, char** argv)
{
    if (argc != 6)
        return 2;
    if (const auto done = run(argv + 1); !done)
    {
        std::cerr << toString(done.error()) << '\n';
        return 1;
    }
}
