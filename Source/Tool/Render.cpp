#include "Input.h"

#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Core/File.h>
#include <Espalier/Render/Render.h>
#include <iostream>
#include <memory>

namespace espalier::tool {

namespace {

struct RenderCommand
{
    PlantInput input;
    std::string archetype;
    std::string output;
    bool sheet = false;
    std::uint32_t turntable = 0;
    std::uint32_t columns = 4;
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    std::uint32_t samples = 64;
    double azimuthDegrees = 0;
    double elevationDegrees = 5.7;
};

/// The meshes of all plants to be shown; subjects point into them.
struct Gallery
{
    std::vector<std::unique_ptr<TreeMesh>> meshes;
    std::vector<std::unique_ptr<Appearance>> appearances;
    std::vector<RenderSubject> subjects;
    TubeScratch scratch;

    void add(const PlantInput& input, const Appearance& appearance)
    {
        appearances.push_back(std::make_unique<Appearance>(appearance));
        const Appearance* shown = appearances.back().get();
        input.eachPlant([&](const Plant& plant) {
            auto mesh = std::make_unique<TreeMesh>();
            meshOrFail(plant.skeleton, shown->bark, plant.label, input.path, scratch, *mesh);
            subjects.push_back({mesh.get(), shown, plant.label});
            meshes.push_back(std::move(mesh));
        });
    }
};

void render(const RenderCommand& command)
{
    if (std::filesystem::path(command.output).extension() != ".png")
        failUsage("render: " + command.output + ": expected an output that ends in .png");
    if (command.sheet && command.turntable > 0)
        failUsage("render: expected --sheet or --turntable, not both");
    if (kindOf(command.input.path) == InputKind::Species && !command.sheet && parseSeeds(command.input.seeds).count() > 1)
        failUsage("render: several seeds need --sheet");
    if (command.sheet && kindOf(command.input.path) == InputKind::Species && parseSeeds(command.input.seeds).count() > 256)
        failUsage("render: expected at most 256 trees on a sheet");

    Gallery gallery;
    const Appearance appearance = command.input.appearance();
    if (!command.archetype.empty())
    {
        PlantInput drawn = command.input;
        drawn.path = command.archetype;
        if (kindOf(drawn.path) != InputKind::Archetype)
            failUsage("--archetype " + command.archetype + ": expected an .archetype file");
        gallery.add(drawn, appearance);
    }
    gallery.add(command.input, appearance);

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
        : command.turntable > 0 ? orFail(renderTurntable(gallery.subjects.back(), command.turntable, settings, progress))
                                : orFail(renderPicture(gallery.subjects.back(), settings, progress));
    orFail(writeFileAtomically(command.output, encodePng(picture)));
    std::cout << command.output << ": " << picture.width << " x " << picture.height << " pixels\n";
}

} // namespace

void addRender(CLI::App& app)
{
    const auto command = std::make_shared<RenderCommand>();
    CLI::App* verb = app.add_subcommand("render", "Make a picture of an archetype or of trees of a species");
    command->input.addTo(*verb);
    verb->add_option("-o,--output", command->output, "out.png")->required();
    verb->add_flag("--sheet", command->sheet, "A contact sheet: all trees at one scale, labelled");
    verb->add_option("--archetype", command->archetype, "On a sheet: the drawn tree, shown first");
    verb->add_option("--turntable", command->turntable, "A strip of N views from all sides")->check(CLI::Range(2u, 64u));
    verb->add_option("--columns", command->columns, "Of a contact sheet")->check(CLI::Range(1u, 64u))->capture_default_str();
    verb->add_option("--width", command->width, "Pixels, of one view")->check(CLI::Range(16u, 8192u));
    verb->add_option("--height", command->height, "Pixels, of one view")->check(CLI::Range(16u, 8192u));
    verb->add_option("--samples", command->samples, "Rays a pixel: more is smoother and slower")->check(CLI::Range(1u, 4096u))->capture_default_str();
    verb->add_option("--azimuth", command->azimuthDegrees, "Degrees round the tree at which the camera stands")->check(CLI::Range(-360.0, 360.0));
    verb->add_option("--elevation", command->elevationDegrees, "Degrees above the horizon")->check(CLI::Range(-80.0, 80.0))->capture_default_str();
    verb->callback([command] { render(*command); });
}

} // namespace espalier::tool
