#include "Bake.h"
#include "Input.h"
#include "Usage.h"

#include <Espalier/Bake/Swc.h>
#include <cmath>
#include <iostream>
#include <memory>
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
    LookOptions look;
    BakeChoices bake;
    bool skeleton = false;
    bool json = false;
};

/// Whether the output is skeletons, not meshes. Fails for options that it knows nothing of.
bool wantsSkeletons(const GrowCommand& command, const CLI::App& verb)
{
    const std::filesystem::path ending = std::filesystem::path(command.output).extension();
    if (command.skeleton && ending != ".swc")
        failUsage("grow: " + command.output + ": expected an output that ends in .swc for --skeleton");
    if (ending != ".swc" && ending != ".glb" && ending != ".obj")
        failUsage("grow: " + command.output +
                  ": expected an output that ends in .glb or .obj, or .swc for the skeleton");
    if (const std::string option =
            firstGiven(verb, {"--lod", "--together", "--profile", "--textures", "--translucent", "--branches", "--wind",
                              "--joints", "--differences", "--impostor", "--atlas", "--frames", "--collision",
                              "--appearance", "--season", "--no-leaves"});
        ending == ".swc" && !option.empty())
        failUsage("grow: a skeleton knows no " + option + "; expected " +
                  (command.skeleton ? "either that or --skeleton" : "none, or an output that ends in .glb or .obj"));
    if (const std::string option = firstGiven(verb, {"--together", "--profile", "--translucent", "--wind", "--joints",
                                                     "--impostor", "--atlas", "--frames"});
        ending == ".obj" && !option.empty())
        failUsage("grow: OBJ knows no " + option + "; expected none, or an output that ends in .glb");
    command.bake.check(verb, !command.look.bare);
    checkNeeds(verb, {{"--season", !command.look.bare, "leaves; expected no --no-leaves"}});
    return ending == ".swc";
}

/// Grows the plants one after the other and writes each, as a mesh or as its skeleton.
class PlantWriter
{
public:
    PlantWriter(const GrowCommand& command, const CLI::App& verb, const SeedRange& range)
        : command_(command), range_(range), writesSkeletons_(wantsSkeletons(command, verb)),
          grower_(command.species, command.iterations, range.exemplar, command.attempt),
          appearance_(grower_.species().appearance), info_{grower_.species().name, 0, {}}
    {
        command_.look.applyTo(appearance_, command.species);
        if (!writesSkeletons_)
        {
            // What is baked is the species with this look: its identity must be another one.
            Species shown = grower_.species();
            shown.appearance = appearance_;
            info_.speciesHash = hashOf(shown);
        }
        if (!writesSkeletons_)
            baker_.emplace(command.bake, appearance_, pictures(), command.species);
    }

    /// The plant: its seed, the attempt, and "files", an entry each with what it holds.
    nlohmann::ordered_json write(Seed seed, const std::filesystem::path& path)
    {
        grower_.grow(seed, skeleton_);
        const std::string label = range_.exemplar ? "exemplar" : "seed " + std::to_string(seed.value);
        nlohmann::ordered_json plant;
        if (range_.exemplar)
            plant["seed"] = "exemplar";
        else
            plant["seed"] = seed.value;
        if (grower_.attempt())
            plant["attempt"] = *grower_.attempt();
        plant["files"] = writesSkeletons_ ? writeSkeleton(label, path) : writeMesh(seed, label, path);
        return plant;
    }

private:
    /// Read only where something shows them.
    [[nodiscard]] OwnTextures pictures() const
    {
        const bool areShown = command_.bake.textures > 0 || command_.bake.impostor != "none";
        return areShown ? command_.look.pictures(appearance_, command_.species) : OwnTextures{};
    }

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
        return nlohmann::ordered_json::array({{{"file", path.string()}, {"segments", skeleton_.size()}}});
    }

    nlohmann::ordered_json writeMesh(Seed seed, const std::string& label, const std::filesystem::path& path)
    {
        info_.seed = range_.exemplar ? std::nullopt : std::optional(seed);
        nlohmann::ordered_json files = baker_->write(skeleton_, info_, label, path);
        if (files.empty())
            failEmpty();
        return files;
    }

    const GrowCommand& command_;
    const SeedRange& range_;
    bool writesSkeletons_;
    SeededGrower grower_;
    Appearance appearance_;
    BakeInfo info_;
    std::optional<PlantBaker> baker_;
    Skeleton skeleton_;
};

void printRange(const char* what, const nlohmann::ordered_json& range)
{
    const auto percent = [&](std::size_t i) { return std::round(1e3 * range[i].get<double>()) / 10; };
    std::cout << what << percent(0) << " to " << percent(1) << " %";
}

void printFile(const nlohmann::ordered_json& file, const nlohmann::ordered_json& plant)
{
    std::cout << file["file"].get<std::string>();
    for (const char* separator = ": "; const auto& [what, value] : file.items())
    {
        if (what == "file" || what == "with")
            continue;
        std::cout << std::exchange(separator, ", ");
        if (what == "error")
            std::cout << "for pixels of " << std::round(1e4 * value.get<double>()) / 10 << " mm";
        else if (what == "distance")
            std::cout << "from " << std::round(10 * value.get<double>()) / 10 << " m on (1080 lines, 60 degrees)";
        else if (what == "levels")
        {
            std::cout << value.size() << " levels of";
            for (const auto& level : value)
                std::cout << ' ' << level["triangles"];
            std::cout << " triangles";
        }
        else if (what == "coverage")
            std::cout << "covers " << std::round(1e3 * value.get<double>()) / 10 << " %";
        else if (what == "coverages")
            printRange("covers ", value);
        else if (what == "colours")
            printRange("as bright as ", value);
        else if (what == "texels")
            std::cout << value << " x " << value << " texels";
        else if (what == "outline")
            std::cout << "outline off by " << std::round(1e3 * value.get<double>()) / 10 << " %";
        else if (what == "volumeShare")
            std::cout << std::round(100 * value.get<double>()) << " % of the wood";
        else if (what == "hullVertices")
            std::cout << "hull of " << value << " vertices";
        else if (what == "collisionTriangles")
            std::cout << "mesh of " << value << " triangles";
        else
            std::cout << value << ' ' << what;
    }
    if (plant.contains("attempt"))
        std::cout << ", attempt " << plant["attempt"];
    std::cout << '\n';
    if (file.contains("with"))
    {
        std::cout << "  with";
        for (const char* separator = " "; const auto& name : file["with"])
            std::cout << std::exchange(separator, ", ") << name.get<std::string>();
        std::cout << '\n';
    }
}

void growPlants(const GrowCommand& command, const CLI::App& verb)
{
    const SeedRange range = parseSeeds(command.seeds);
    PlantWriter writer(command, verb, range);
    const Progress progress = terminalProgress();
    nlohmann::ordered_json report = nlohmann::ordered_json::array();
    for (std::uint64_t i = 0; i < range.count(); ++i)
    {
        const Seed seed{range.first + i};
        nlohmann::ordered_json plant = writer.write(seed, numberedPath(command.output, seed.value, range.isRange));
        progress("growing", static_cast<double>(i + 1) / static_cast<double>(range.count()));
        if (command.json)
            report.push_back(std::move(plant));
        else
            for (const nlohmann::ordered_json& file : plant["files"])
                printFile(file, plant);
    }
    if (command.json)
        std::cout << (range.isRange ? report : report[0]).dump(2) << '\n';
}

} // namespace

void addGrow(CLI::App& app)
{
    const auto command = std::make_shared<GrowCommand>();
    CLI::App* verb = app.add_subcommand(
        "grow", "Grow trees of a species or a grammar and bake each to a GLB or OBJ, or write its skeleton");
    verb->add_option("species", command->species, "S.species or G.lsys")->required();
    verb->add_option("--seed", command->seeds,
                     "A seed N, a range A..B (writes out-A.glb ... out-B.glb), or exemplar: the drawn tree")
        ->capture_default_str();
    verb->add_option("-o,--output", command->output, "out.glb, out.obj, or out.swc for the skeleton")->required();
    verb->add_flag(
        "--skeleton", command->skeleton,
        "Write the skeleton, as SWC: a point a line, as `espalier fit` and tools for neurons and roots read");
    addIterations(*verb, command->iterations);
    addAttempt(*verb, command->attempt);
    command->bake.addTo(*verb);
    command->look.addTo(*verb);
    verb->add_flag("--json", command->json,
                   "One JSON document with each plant's seed, attempt and files; an array for a range of seeds");
    verb->callback([command, verb] { growPlants(*command, *verb); });
}

} // namespace espalier::tool
