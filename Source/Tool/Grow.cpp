#include "Input.h"
#include "Look.h"

#include <Espalier/Bake/Gltf.h>
#include <Espalier/Bake/Swc.h>
#include <Espalier/Mesh/DetailLevel.h>
#include <cmath>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

namespace espalier::tool {

namespace {

struct GrowCommand
{
    std::string species;
    std::string seeds = "1";
    std::string output;
    std::optional<std::uint32_t> iterations;
    std::optional<std::uint32_t> attempt;
    std::uint32_t level = 0; // of detail
    LookOptions look;
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

/// Grows the plants one after the other and writes each, as a mesh or as its skeleton.
class PlantWriter
{
public:
    PlantWriter(const GrowCommand& command, const SeedRange& range)
        : command_(command), range_(range), writesSkeletons_(wantsSkeletons(command)),
          grower_(command.species, command.iterations, range.exemplar, command.attempt),
          appearance_(grower_.species().appearance), info_{grower_.species().name,
                                                           writesSkeletons_ ? 0 : hashOf(grower_.species()),
                                                           {}}
    {
        command_.look.applyTo(appearance_);
    }

    /// What it comes to: segments, what a mesh has, and the attempt.
    nlohmann::ordered_json write(Seed seed, const std::filesystem::path& path)
    {
        grower_.grow(seed, skeleton_);
        const std::string label = range_.exemplar ? "exemplar" : "seed " + std::to_string(seed.value);
        nlohmann::ordered_json facts = writesSkeletons_ ? writeSkeleton(label, path) : writeMesh(seed, label, path);
        if (grower_.attempt())
            facts["attempt"] = *grower_.attempt();
        return facts;
    }

private:
    [[noreturn]] void failEmpty() const
    {
        fail({ErrorKind::BadInput, nothingDrawn(grower_.steps()), {}, {}, {command_.species, 0, 0}});
    }

    nlohmann::ordered_json writeSkeleton(const std::string& label, const std::filesystem::path& path)
    {
        if (skeleton_.empty())
            failEmpty();
        const std::string steps = grower_.steps() ? ", steps " + std::to_string(*grower_.steps()) : "";
        orFail(saveSwc(path, skeleton_,
                       "espalier " ESPALIER_VERSION "\nspecies " + grower_.species().name + ", " + label + steps +
                           "\nsegments alone; a step without a line comes as a segment, leaves and shapes not at all"));
        return {{"segments", skeleton_.size()}};
    }

    nlohmann::ordered_json writeMesh(Seed seed, const std::string& label, const std::filesystem::path& path)
    {
        mesh_.clear();
        const DetailLevel level =
            meshDetailLevel(skeleton_, appearance_, command_.level, {}, Limits{}, scratch_, mesh_);
        if (!isMeshedOrFail(level.result, label, command_.species))
            failEmpty();
        info_.seed = range_.exemplar ? std::nullopt : std::optional(seed);
        orFail(writeGlb(path, mesh_, appearance_, info_));
        nlohmann::ordered_json facts{{"segments", skeleton_.size()},
                                     {"vertices", mesh_.positions.size()},
                                     {"triangles", mesh_.indices.size() / 3}};
        if (command_.level > 0)
            facts["error"] = level.error;
        return facts;
    }

    const GrowCommand& command_;
    const SeedRange& range_;
    bool writesSkeletons_;
    SeededGrower grower_;
    Appearance appearance_;
    BakeInfo info_;
    DetailScratch scratch_;
    Skeleton skeleton_;
    TreeMesh mesh_;
};

void growPlants(const GrowCommand& command)
{
    const SeedRange range = parseSeeds(command.seeds);
    PlantWriter writer(command, range);
    const Progress progress = terminalProgress();
    nlohmann::ordered_json report = nlohmann::ordered_json::array();
    for (std::uint64_t i = 0; i < range.count(); ++i)
    {
        const Seed seed{range.first + i};
        const std::filesystem::path path = numberedPath(command.output, seed.value, range.isRange);
        const nlohmann::ordered_json sizes = writer.write(seed, path);
        progress("growing", static_cast<double>(i + 1) / static_cast<double>(range.count()));
        if (!command.json)
        {
            std::cout << path.string();
            for (const char* separator = ": "; const auto& [what, count] : sizes.items())
            {
                std::cout << std::exchange(separator, ", ");
                if (what == "error")
                    std::cout << "for pixels of " << std::round(1e4 * count.get<double>()) / 10 << " mm";
                else if (what == "attempt")
                    std::cout << "attempt " << count;
                else
                    std::cout << count << ' ' << what;
            }
            std::cout << '\n';
            continue;
        }
        nlohmann::ordered_json entry;
        if (range.exemplar)
            entry["seed"] = "exemplar";
        else
            entry["seed"] = seed.value;
        entry["file"] = path.string();
        entry.update(sizes);
        report.push_back(std::move(entry));
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
    addAttempt(*verb, command->attempt);
    verb->add_option("--lod", command->level,
                     "Level of detail: 0 the full plant, each further one half as many triangles")
        ->check(CLI::Range(0u, kMostDetailLevel))
        ->capture_default_str();
    command->look.addTo(*verb);
    verb->add_flag("--json", command->json, "One JSON document with the files, their sizes and the attempt");
    verb->callback([command] { growPlants(*command); });
}

} // namespace espalier::tool
