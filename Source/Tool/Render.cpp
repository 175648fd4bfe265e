#include "Input.h"

#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Core/File.h>
#include <Espalier/Render/Render.h>
#include <algorithm>
#include <iostream>
#include <memory>

namespace espalier::tool {

namespace {

struct RenderCommand
{
    std::vector<std::string> inputs;
    std::string seeds = "1";
    TemplateFolders templates;
    std::string output;
    bool sheet = false;
    std::uint32_t turntable = 0;
    std::uint32_t columns = 4;
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    std::uint32_t samples = 64;
    double azimuthDegrees = 0;
    double elevationDegrees = -5;
};

/// The meshes of all plants to be shown; subjects point into them.
struct Gallery
{
    std::vector<std::unique_ptr<TreeMesh>> meshes;
    std::vector<std::unique_ptr<Appearance>> appearances;
    std::vector<RenderSubject> subjects;
    TubeScratch scratch;

    /// `name` stands before the labels of what it names; empty: they speak for themselves.
    void add(const PlantInput& input, const std::string& name)
    {
        appearances.push_back(std::make_unique<Appearance>(input.appearance()));
        const Appearance* shown = appearances.back().get();
        input.eachPlant([&](const Plant& plant) {
            auto mesh = std::make_unique<TreeMesh>();
            meshOrFail(plant.skeleton, shown->bark, plant.label, input.path, scratch, *mesh);
            const bool isDrawn = !plant.seed;
            const std::string label = name.empty() ? plant.label : isDrawn ? name : name + ' ' + plant.label;
            subjects.push_back({mesh.get(), shown, label});
            meshes.push_back(std::move(mesh));
        });
    }
};

/// `branching angle` for branching-angle.archetype.
std::string nameOf(const std::string& path)
{
    std::string name = std::filesystem::path(path).stem().string();
    std::ranges::replace(name, '-', ' ');
    return name;
}

void render(const RenderCommand& command)
{
    if (std::filesystem::path(command.output).extension() != ".png")
        failUsage("render: " + command.output + ": expected an output that ends in .png");
    if (command.sheet && command.turntable > 0)
        failUsage("render: expected --sheet or --turntable, not both");
    if (parseSeeds(command.seeds).count() > 256)
        failUsage("render: expected at most 256 seeds");

    // Two inputs of one kind need names; a drawn tree and its species do not.
    const auto kinds = [&](InputKind kind) {
        return std::ranges::count(command.inputs, kind, [](const std::string& path) { return kindOf(path); });
    };
    const bool needNames = kinds(InputKind::Archetype) > 1 || kinds(InputKind::Species) > 1;
    Gallery gallery;
    for (const std::string& path : command.inputs)
        gallery.add({path, command.seeds, command.templates}, needNames ? nameOf(path) : "");
    if (gallery.subjects.size() > 1 && !command.sheet)
        failUsage("render: several trees need --sheet; expected that, or one tree");

    RenderSettings settings;
    const bool many = command.sheet || command.turntable > 0;
    settings.width = command.width > 0 ? command.width : many ? 480 : 900;
    settings.height = command.height > 0 ? command.height : many ? 560 : 1000;
    settings.samplesPerPixel = command.samples;
    settings.cameraAzimuth = static_cast<float>(command.azimuthDegrees * math::kRadiansPerDegree);
    settings.cameraElevation = static_cast<float>(command.elevationDegrees * math::kRadiansPerDegree);
    const Progress progress = terminalProgress();
    const Picture picture =
        command.sheet           ? orFail(renderContactSheet(gallery.subjects, command.columns, settings, progress))
        : command.turntable > 0 ? orFail(renderTurntable(gallery.subjects[0], command.turntable, settings, progress))
                                : orFail(renderPicture(gallery.subjects[0], settings, progress));
    orFail(writeFileAtomically(command.output, encodePng(picture)));
    std::cout << command.output << ": " << picture.width << " x " << picture.height << " pixels\n";
}

} // namespace

void addRender(CLI::App& app)
{
    const auto command = std::make_shared<RenderCommand>();
    CLI::App* verb = app.add_subcommand("render", "Make a picture of an archetype or of trees of a species");
    verb->add_option("inputs", command->inputs,
                     "A.archetype or S.species; several on a sheet, such as a drawn tree and its species")
        ->required();
    verb->add_option("--seed", command->seeds, "Of a species: a seed N, or a range A..B on a sheet")
        ->capture_default_str();
    verb->add_option("-o,--output", command->output, "out.png")->required();
    verb->add_flag("--sheet", command->sheet, "A contact sheet: all trees at one scale, labelled");
    verb->add_option("--turntable", command->turntable, "A strip of N views from all sides")
        ->check(CLI::Range(2u, 64u));
    verb->add_option("--columns", command->columns, "Of a contact sheet")
        ->check(CLI::Range(1u, 64u))
        ->capture_default_str();
    verb->add_option("--width", command->width, "Pixels, of one view")->check(CLI::Range(16u, 8192u));
    verb->add_option("--height", command->height, "Pixels, of one view")->check(CLI::Range(16u, 8192u));
    verb->add_option("--samples", command->samples, "Rays a pixel: more is smoother and slower")
        ->check(CLI::Range(1u, 4096u))
        ->capture_default_str();
    verb->add_option("--azimuth", command->azimuthDegrees, "Degrees round the tree at which the camera stands")
        ->check(CLI::Range(-360.0, 360.0));
    verb->add_option("--elevation", command->elevationDegrees, "Degrees above the horizon")
        ->check(CLI::Range(-80.0, 80.0))
        ->capture_default_str();
    command->templates.addTo(*verb);
    verb->callback([command] { render(*command); });
}

} // namespace espalier::tool
