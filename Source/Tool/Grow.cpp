#include "Input.h"

#include <Espalier/Bake/Gltf.h>
#include <Espalier/Bake/Swc.h>
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
    bool skeleton = false;
    bool json = false;
};

/// Whether the output is skeletons, not meshes.
bool wantsSkeletons(const GrowCommand& command)
{
    const std::filesystem::path ending = std::filesystem::path(command.output).extension();
    if (command.skeleton && ending != ".swc")
        failUsage("grow: " + command.output + ": expected an output that ends in .swc for --skeleton");
    if (ending != ".swc" && ending != ".glb")
        failUsage("grow: " + command.output + ": expected an output that ends in .glb, or .swc for the skeleton");
    return ending == ".swc";
}

void growSkeletons(const GrowCommand& command)
{
    const SeedRange range = parseSeeds(command.seeds);
    SeededGrower grower(command.species, command.iterations);
    const Progress progress = terminalProgress();
    Skeleton skeleton;
    nlohmann::ordered_json report = nlohmann::ordered_json::array();
    for (std::uint64_t i = 0; i < range.count(); ++i)
    {
        const Seed seed{range.first + i};
        grower.grow(seed, skeleton);
        if (skeleton.empty())
            fail({ErrorKind::BadInput, nothingDrawn(grower.steps()), {}, {}, {command.species, 0, 0}});
        const std::filesystem::path path = numberedPath(command.output, seed.value, range.isRange);
        const std::string steps = grower.steps() ? ", steps " + std::to_string(*grower.steps()) : "";
        orFail(saveSwc(path, skeleton,
                       "espalier " ESPALIER_VERSION "\nspecies " + grower.species().name + ", seed " +
                           std::to_string(seed.value) + steps +
                           "\nsegments alone; a step without a line comes as a segment, leaves and shapes not at all"));
        progress("growing", static_cast<double>(i + 1) / static_cast<double>(range.count()));
        if (command.json)
            report.push_back({{"seed", seed.value}, {"file", path.string()}, {"segments", skeleton.size()}});
        else
            std::cout << path.string() << ": " << skeleton.size() << " segments\n";
    }
    if (command.json)
        std::cout << (range.isRange ? report : report[0]).dump(2) << '\n';
}

void growTrees(const GrowCommand& command)
{
    if (wantsSkeletons(command))
        return growSkeletons(command);
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
    CLI::App* verb = app.add_subcommand(
        "grow", "Grow trees of a species or a grammar and bake each to a GLB, or write its skeleton");
    verb->add_option("species", command->species, "S.species or G.lsys")->required();
    verb->add_option("--seed", command->seeds,
                     "A seed N, a range A..B (writes out-A.glb ... out-B.glb), or exemplar: the drawn tree")
        ->capture_default_str();
    verb->add_option("-o,--output", command->output, "out.glb, or out.swc for the skeleton")->required();
    verb->add_flag(
        "--skeleton", command->skeleton,
        "Write the skeleton, as SWC: a point a line, as `espalier fit` and tools for neurons and roots read");
    addIterations(*verb, command->iterations);
    verb->add_flag("--json", command->json, "One JSON document with the files and their sizes");
    verb->callback([command] { growTrees(*command); });
}

} // namespace espalier::tool
