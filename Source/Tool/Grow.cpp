#include "Input.h"

#include <Espalier/Bake/Gltf.h>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

namespace espalier::tool {

namespace {

struct GrowCommand
{
    std::string species;
    std::string seeds = "1";
    std::string output;
    std::optional<std::uint32_t> iterations;
    bool json = false;
};

void growTrees(const GrowCommand& command)
{
    if (std::filesystem::path(command.output).extension() != ".glb")
        failUsage("grow: " + command.output + ": expected an output that ends in .glb");
    const SeedRange range = parseSeeds(command.seeds);
    SeededGrower grower(command.species, command.iterations, range.exemplar);
    const Species& species = grower.species();
    const Progress progress = terminalProgress();
    BakeInfo info{species.name, hashOf(species), {}};
    MeshScratch meshScratch;
    Skeleton skeleton;
    TreeMesh mesh;
    nlohmann::ordered_json report = nlohmann::ordered_json::array();
    for (std::uint64_t i = 0; i < range.count(); ++i)
    {
        const Seed seed{range.first + i};
        const std::string label = range.exemplar ? "exemplar" : "seed " + std::to_string(seed.value);
        if (range.exemplar)
            info.seed.reset();
        else
            info.seed = seed;
        grower.grow(seed, skeleton);
        if (!meshOrFail(skeleton, species.appearance, label, command.species, {}, meshScratch, mesh))
            fail({ErrorKind::BadInput, nothingDrawn(grower.steps()), {}, {}, {command.species, 0, 0}});
        const std::filesystem::path path = numberedPath(command.output, seed.value, range.isRange);
        orFail(writeGlb(path, mesh, species.appearance, info));
        progress("growing", static_cast<double>(i + 1) / static_cast<double>(range.count()));
        if (command.json)
            report.push_back(
                {{"seed", range.exemplar ? nlohmann::ordered_json(label) : nlohmann::ordered_json(seed.value)},
                 {"file", path.string()},
                 {"segments", skeleton.size()},
                 {"vertices", mesh.positions.size()},
                 {"triangles", mesh.indices.size() / 3}});
        else
            std::cout << path.string() << ": " << skeleton.size() << " segments, " << mesh.positions.size()
                      << " vertices, " << mesh.indices.size() / 3 << " triangles\n";
    }
    if (command.json)
        std::cout << (range.isRange ? report : report[0]).dump(2) << '\n';
}

} // namespace

void addGrow(CLI::App& app)
{
    const auto command = std::make_shared<GrowCommand>();
    CLI::App* verb = app.add_subcommand("grow", "Grow trees of a species or a grammar and bake each to a GLB");
    verb->add_option("species", command->species, "S.species or G.lsys")->required();
    verb->add_option("--seed", command->seeds,
                     "A seed N, a range A..B (writes out-A.glb ... out-B.glb), or exemplar: the drawn tree")
        ->capture_default_str();
    verb->add_option("-o,--output", command->output, "out.glb")->required();
    addIterations(*verb, command->iterations);
    verb->add_flag("--json", command->json, "One JSON document with the files and their sizes");
    verb->callback([command] { growTrees(*command); });
}

} // namespace espalier::tool
