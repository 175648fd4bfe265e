#include "Command.h"

#include <Espalier/Bake/GltfSkeleton.h>
#include <Espalier/Bake/Swc.h>
#include <Espalier/Inference/Fit.h>
#include <cmath>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

namespace espalier::tool {

namespace {

struct FitCommand
{
    std::string skeleton;
    std::string output;
    std::optional<std::uint32_t> templates;
    std::optional<double> tolerance;
    double scale = 1;
    std::string up = "y";
    bool json = false;
};

ImportedSkeleton readSkeleton(const FitCommand& command)
{
    const ImportSettings settings{command.scale, command.up == "z" ? UpAxis::Z : UpAxis::Y};
    const std::filesystem::path ending = std::filesystem::path(command.skeleton).extension();
    if (ending == ".swc")
        return orFail(loadSwc(command.skeleton, settings, authoringLimits()));
    if (ending == ".gltf" || ending == ".glb")
        return orFail(loadGltfSkeleton(command.skeleton, settings, authoringLimits()));
    failUsage("fit: " + command.skeleton + ": expected a skeleton that ends in .swc, .gltf or .glb");
}

nlohmann::ordered_json toJson(const ImportedSkeleton& imported, const FitReport& report)
{
    return {{"points", imported.points},
            {"repeatedPoints", imported.repeatedPoints},
            {"roots", imported.roots},
            {"origin", {imported.origin.x, imported.origin.y, imported.origin.z}},
            {"segments", report.segments},
            {"internodes", report.internodes},
            {"trees", report.trees},
            {"templates", report.templates},
            {"instances", report.instances},
            {"depth", report.depth},
            {"size", report.size},
            {"tolerance", report.tolerance},
            {"largestDistance", report.largestDistance},
            {"meanDistance", report.meanDistance}};
}

void tell(const ImportedSkeleton& imported, const FitReport& report)
{
    std::cout << "  read: " << imported.points << " points, " << report.segments << " segments in " << report.internodes
              << " internodes";
    if (imported.repeatedPoints > 0)
        std::cout << " (" << imported.repeatedPoints << " points repeat their parent's place)";
    std::cout << "\n  made: " << report.trees << (report.trees == 1 ? " tree of " : " trees of ") << report.instances
              << " instances of " << report.templates << " templates, nested " << report.depth << " deep\n"
              << "  distance: at most " << report.largestDistance << " m, " << report.meanDistance
              << " m in the mean; tolerance " << report.tolerance << " m, size " << report.size << " m\n";
    if (report.largestDistance > report.tolerance)
        std::cout << "  note: coordinates have 24 bits; nearer than this the tolerance cannot be kept\n";
    if (report.trees > 1)
        std::cout
            << "  trees: each root is a drawn tree of its own, put at the origin; a seed grows one relative of them\n";
    if (imported.origin != DVec3(0))
        std::cout << "  moved: the root from (" << imported.origin.x << ", " << imported.origin.y << ", "
                  << imported.origin.z << ") of the file to the origin\n";
    if (imported.skeleton.widthsGiven)
        std::cout << "  widths: an archetype has none; the pipe model gives them when it is drawn\n";
}

void fit(const FitCommand& command)
{
    const std::filesystem::path output = command.output;
    if (output.extension() != ".archetype")
        failUsage("fit: " + command.output + ": expected an output that ends in .archetype");
    if (!(command.scale > 0 && std::isfinite(command.scale)))
        failUsage("fit: --scale: expected a finite number above 0");
    const ImportedSkeleton imported = readSkeleton(command);
    const std::filesystem::path library = std::filesystem::path(output).replace_extension(".templates");
    FitSettings settings;
    settings.templates = command.templates;
    settings.tolerance = command.tolerance;
    settings.libraryName = library.filename().string();
    Expected<FittedArchetype> fitted = fitArchetype(imported.skeleton, settings, authoringLimits());
    if (!fitted)
        fitted.error().where.file = command.skeleton;
    const auto [archetype, report] = orFail(std::move(fitted));
    // The archetype last: whoever finds it finds its library too.
    orFail(saveTemplates(library, archetype.library));
    orFail(saveArchetype(output, archetype, authoringLimits()));
    if (command.json)
    {
        nlohmann::ordered_json json = toJson(imported, report);
        json["archetype"] = output.string();
        json["library"] = library.string();
        std::cout << json.dump(2) << '\n';
        return;
    }
    std::cout << output.string() << ", " << library.string() << ":\n";
    tell(imported, report);
}

} // namespace

void addFit(CLI::App& app)
{
    const auto command = std::make_shared<FitCommand>();
    CLI::App* verb = app.add_subcommand(
        "fit", "Make an archetype and its templates of any skeleton: a traced neuron or root, a bone hierarchy");
    verb->add_option("skeleton", command->skeleton, "skeleton.swc, .gltf or .glb")->required();
    verb->add_option("-o,--output", command->output, "A.archetype; its library A.templates is written beside it")
        ->required();
    verb->add_option(
            "--templates", command->templates,
            "At most so many templates, 1..1024: bent branches are then chains of straight pieces, unless they "
            "recur; default: one for each shape that a branch has between two forks")
        ->check(CLI::Range(1u, 1024u));
    verb->add_option("--tolerance", command->tolerance,
                     "Metres that the archetype may lie from the skeleton; 0 keeps every point; default: 2 % of the "
                     "mean length between branch points, or less")
        ->check(CLI::NonNegativeNumber);
    verb->add_option("--scale", command->scale,
                     "Metres per unit of the file. Neurons are in micrometres: 1 makes a metre of each, 0.01 a tree of "
                     "some metres")
        ->capture_default_str();
    verb->add_option("--up", command->up, "The axis of the file that points up")
        ->check(CLI::IsMember({"y", "z"}))
        ->capture_default_str();
    verb->add_flag("--json", command->json, "One JSON document with what was read, made and measured");
    verb->callback([command] { fit(*command); });
}

} // namespace espalier::tool
