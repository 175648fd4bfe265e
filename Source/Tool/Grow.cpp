#include "Bake.h"
#include "Input.h"

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

/// Whether the output is skeletons, not meshes.
bool wantsSkeletons(const GrowCommand& command)
{
    const std::filesystem::path ending = std::filesystem::path(command.output).extension();
    if (command.skeleton && ending != ".swc")
        failUsage("grow: " + command.output + ": expected an output that ends in .swc for --skeleton");
    if (ending != ".swc" && ending != ".glb" && ending != ".obj")
        failUsage("grow: " + command.output +
                  ": expected an output that ends in .glb or .obj, or .swc for the skeleton");
    const BakeChoices& bake = command.bake;
    const bool isPlain = !bake.together && !bake.translucent && bake.profile == "portable" && bake.wind == "none" &&
                         bake.impostor == "none";
    if (ending == ".obj" && !isPlain)
        failUsage("grow: " + command.output +
                  ": OBJ knows no --together, --translucent, --profile, --impostor or --wind; expected an output that "
                  "ends in .glb");
    if (ending == ".swc" && (!isPlain || bake.collision || bake.levels != "0"))
        failUsage("grow: " + command.output +
                  ": a skeleton has no levels, impostor, wind data or shapes; expected an output that "
                  "ends in .glb");
    if (bake.atlas && bake.impostor == "none")
        failUsage("grow: --atlas is that of an impostor; expected --impostor cards or octahedral");
    if (const auto [first, last] = parseLevels(bake.levels); bake.together && first == last)
        failUsage("grow: --together puts several levels into one file; expected a range, such as --lod 0..4");
    return ending == ".swc";
}

/// Grows the plants one after the other and writes each, as a mesh or as its skeleton.
class PlantWriter
{
public:
    PlantWriter(const GrowCommand& command, const SeedRange& range)
        : command_(command), range_(range), writesSkeletons_(wantsSkeletons(command)),
          grower_(command.species, command.iterations, range.exemplar, command.attempt),
          appearance_(grower_.species().appearance), info_{grower_.species().name, 0, {}}
    {
        command_.look.applyTo(appearance_);
        if (!writesSkeletons_)
        {
            // What is baked is the species with this look: its identity must be another one.
            Species shown = grower_.species();
            shown.appearance = appearance_;
            info_.speciesHash = hashOf(shown);
        }
        if (!writesSkeletons_)
            baker_.emplace(command.bake, appearance_, command.species);
    }

    /// What was written, a file an entry: what it holds, and the attempt.
    nlohmann::ordered_json write(Seed seed, const std::filesystem::path& path)
    {
        grower_.grow(seed, skeleton_);
        const std::string label = range_.exemplar ? "exemplar" : "seed " + std::to_string(seed.value);
        nlohmann::ordered_json files = writesSkeletons_ ? writeSkeleton(label, path) : writeMesh(seed, label, path);
        if (grower_.attempt())
            for (nlohmann::ordered_json& file : files)
                file["attempt"] = *grower_.attempt();
        return files;
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

void printFile(const nlohmann::ordered_json& file)
{
    std::cout << file["file"].get<std::string>();
    for (const char* separator = ": "; const auto& [what, value] : file.items())
    {
        if (what == "file")
            continue;
        std::cout << std::exchange(separator, ", ");
        if (what == "error")
            std::cout << "for pixels of " << std::round(1e4 * value.get<double>()) / 10 << " mm";
        else if (what == "attempt")
            std::cout << "attempt " << value;
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
    std::cout << '\n';
}

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
        const nlohmann::ordered_json files = writer.write(seed, path);
        progress("growing", static_cast<double>(i + 1) / static_cast<double>(range.count()));
        for (const nlohmann::ordered_json& file : files)
        {
            if (!command.json)
            {
                printFile(file);
                continue;
            }
            nlohmann::ordered_json entry;
            if (range.exemplar)
                entry["seed"] = "exemplar";
            else
                entry["seed"] = seed.value;
            entry.update(file);
            report.push_back(std::move(entry));
        }
    }
    if (command.json)
        std::cout << (range.isRange || command.bake.writesSeveral() ? report : report[0]).dump(2) << '\n';
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
    verb->add_flag("--json", command->json, "One JSON document with the files, their sizes and the attempt");
    verb->callback([command] { growPlants(*command); });
}

} // namespace espalier::tool
