#include "Bake.h"
#include "Input.h"
#include "Usage.h"

#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Core/File.h>
#include <Espalier/Mesh/DetailLevel.h>
#include <Espalier/Mesh/Impostor.h>
#include <Espalier/Mesh/WindMotion.h>
#include <Espalier/Render/ImpostorAtlas.h>
#include <Espalier/Render/LineDrawing.h>
#include <Espalier/Render/Render.h>
#include <algorithm>
#include <bit>
#include <glm/common.hpp>
#include <iomanip>
#include <iostream>
#include <limits>
#include <memory>
#include <sstream>

namespace espalier::tool {

namespace {

/// `-n N` or `-n A..B`; nothing: what the grammar says.
std::vector<std::optional<std::uint32_t>> parseSteps(const std::optional<std::string>& given)
{
    if (!given)
        return {std::nullopt};
    const std::string& text = *given;
    const auto [first, last] = parseRange("-n", text, 1'000'000, "number", "0..7");
    if (last < first || last - first >= 256)
        failUsage("-n " + text + ": expected the lower number first, and at most 256 numbers");
    std::vector<std::optional<std::uint32_t>> steps;
    for (std::uint32_t step = first; step <= last; ++step)
        steps.emplace_back(step);
    return steps;
}

struct RenderCommand
{
    std::vector<std::string> inputs;
    std::string seeds = "1";
    TemplateFolders templates;
    std::string output;
    std::optional<std::string> iterations;
    std::optional<std::uint32_t> attempt;
    bool sheet = false;
    std::uint32_t turntable = 0;
    std::uint32_t columns = 4;
    std::uint32_t width = 0;
    std::uint32_t height = 0;
    std::uint32_t samples = 64;
    double azimuthDegrees = 0;
    std::optional<double> elevationDegrees;
    double linePixels = 0;
    bool paper = false;
    std::vector<float> focus; ///< x, y, z, radius
    LookOptions look;
    bool seasons = false;
    std::uint32_t gustFrames = 0;
    std::string branches = "embed";
    std::string levels = "0"; ///< Of detail.
    bool impostor = false;
    bool takeover = false; ///< Levels as far away as they are meant for.
};

/// The meshes of all plants to be shown; subjects point into them.
class Gallery
{
public:
    Gallery(const RenderCommand& command, const RenderSettings& settings)
        : command_(command), settings_(settings), levels_(parseLevels(command.levels))
    {
        if (command.linePixels > 0)
            meshSettings_.tubes = lineTubes();
        meshSettings_.sources = command.gustFrames > 0;
        if (command.branches == "weld")
            meshSettings_.tubes.joints = TubeJoints::Weld;
    }

    /// `name` stands before the labels of what it names; empty: they speak for themselves.
    void add(const PlantInput& input, const std::string& name, bool labelSteps)
    {
        Appearance given = input.appearance();
        command_.look.applyTo(given, input.path);
        own_.push_back(std::make_unique<OwnTextures>(command_.look.pictures(given, input.path)));
        if (command_.paper && command_.linePixels > 0)
            dipInInk(given);
        input.eachPlant([&](Plant& plant) {
            if (command_.linePixels > 0)
                divideIntoStrokes(plant.skeleton);
            thickenLines(plant.skeleton, static_cast<float>(command_.linePixels), settings_);
            const bool isDrawn = !plant.seed;
            std::string label = name.empty() ? plant.label : isDrawn ? name : name + ' ' + plant.label;
            if (labelSteps && input.iterations)
                label = (name.empty() ? "" : name + ' ') + "n = " + std::to_string(*input.iterations);
            addLook(plant, input.path, label, given);
            if (command_.seasons && given.seasons.empty())
                failUsage("render: " + command_.look.source(input.path) + " has no seasons; expected no --seasons");
            if (command_.seasons)
                for (const Season& season : given.seasons)
                    addLook(plant, input.path, season.name, inSeason(given, season.name));
        });
    }

    [[nodiscard]] const std::vector<RenderSubject>& subjects() const { return subjects_; }

private:
    /// The levels of one plant that looks like this.
    void addLook(const Plant& plant, const std::string& path, const std::string& label, Appearance look)
    {
        appearances_.push_back(std::make_unique<Appearance>(std::move(look)));
        const auto [first, last] = levels_;
        float coarsest = 0;
        for (std::uint32_t level = first; level <= last; ++level)
        {
            TreeMesh mesh;
            const DetailLevel detail =
                meshDetailLevel(plant.skeleton, *appearances_.back(), level, meshSettings_, Limits{}, scratch_, mesh);
            if (!isMeshedOrFail(detail.result, plant.label, path))
            {
                if (!command_.sheet)
                    fail({ErrorKind::BadInput, nothingDrawn(plant.steps), {}, {}, {path, 0, 0}});
                std::cerr << path << ": " << plant.label << " is left out: " << nothingDrawn(plant.steps) << '\n';
                return;
            }
            coarsest = detail.error;
            const std::string triangles = std::to_string(mesh.indices.size() / 3) + " triangles";
            const bool isAlone = first == last && !command_.impostor;
            const std::string caption = isAlone ? label : "level " + std::to_string(level) + ": " + triangles;
            if (command_.gustFrames > 0)
                addGust(plant.skeleton, mesh, label);
            else
                addSubject(std::move(mesh), caption, detail.error);
        }
        if (command_.impostor)
            addImpostor(plant, path, label, coarsest);
    }

    /// `coarsest` is the error of the last level, which it takes over from.
    void addImpostor(const Plant& plant, const std::string& path, const std::string& label, float coarsest)
    {
        const Appearance& look = *appearances_.back();
        TreeMesh full;
        if (!isMeshedOrFail(meshDetailLevel(plant.skeleton, look, 0, meshSettings_, Limits{}, scratch_, full).result,
                            label, path))
            return;
        const Impostor impostor = makeImpostor(full, ImpostorKind::Cards);
        // A frame is half as high as the atlas, and needs no more texels than the picture has pixels.
        const std::uint32_t texels = std::clamp(std::bit_ceil(2 * settings_.height), 256u, AtlasSettings{}.size);
        atlases_.push_back(std::make_unique<MaterialTextures>(
            orFail(paintImpostor(subjectOf(full, label), impostor, {.size = texels}, terminalProgress()))));
        TreeMesh cards;
        meshCards(impostor, cards);
        const std::string caption = "impostor: " + std::to_string(cards.indices.size() / 3) + " triangles";
        addSubject(std::move(cards), caption,
                   std::max(impostorError(impostor, atlases_.back()->colour.width), coarsest));
        subjects_.back().cards = atlases_.back().get();
    }

    /// How many times as far as in its frame a plant is where `error` metres are a pixel; nearer is never asked for.
    [[nodiscard]] double distanceFor(const TreeMesh& mesh, float error) const
    {
        Vec3 low(std::numeric_limits<float>::max());
        Vec3 high(std::numeric_limits<float>::lowest());
        for (const Vec3& p : mesh.positions)
        {
            low = glm::min(low, p);
            high = glm::max(high, p);
        }
        constexpr double kFilled = 0.8; // of the frame, about
        const Vec3 extent = high - low;
        const double pixel = std::max(static_cast<double>(extent.y) / settings_.height,
                                      static_cast<double>(std::max(extent.x, extent.z)) / settings_.width) /
                             kFilled;
        return pixel > 0 ? std::clamp(static_cast<double>(error) / pixel, 1.0, 1e4) : 1;
    }

    /// The plant at even times while a gust of a strong breeze rises, from the lull before it.
    void addGust(const Skeleton& skeleton, const TreeMesh& mesh, const std::string& label)
    {
        constexpr float kSeconds = 4;
        constexpr float kLull = 3.4f; // when it is, of the weather's time
        WindScratch scratch;
        WindVertices wind;
        if (!computeWind(skeleton, mesh, scratch, wind))
            return addSubject(mesh, label);
        const WindResponse response = windResponse(skeleton, appearances_.back()->wind);
        for (std::uint32_t frame = 0; frame < command_.gustFrames; ++frame)
        {
            const float time = kSeconds * static_cast<float>(frame) / static_cast<float>(command_.gustFrames);
            const WindWeather weather{.speed = 12, .gust = 0.6f, .time = kLull + time};
            std::ostringstream caption;
            caption << label << ", " << std::fixed << std::setprecision(1) << time << " s";
            addSubject(blownBy(mesh, wind, weather, response), caption.str());
        }
    }

    /// A mesh in the look of the plant that is being added.
    [[nodiscard]] RenderSubject subjectOf(const TreeMesh& mesh, std::string caption) const
    {
        return {.mesh = &mesh,
                .appearance = appearances_.back().get(),
                .label = std::move(caption),
                .own = own_.back()->empty() ? nullptr : own_.back().get()};
    }

    void addSubject(TreeMesh mesh, std::string caption, float error = 0)
    {
        constexpr std::size_t kMost = 1024; // of one sheet
        if (subjects_.size() == kMost)
            failUsage("render: expected at most " + std::to_string(kMost) + " pictures on a sheet");
        meshes_.push_back(std::make_unique<TreeMesh>(std::move(mesh)));
        subjects_.push_back(subjectOf(*meshes_.back(), std::move(caption)));
        if (command_.takeover)
            subjects_.back().distance = distanceFor(*meshes_.back(), error);
    }

    const RenderCommand& command_;
    const RenderSettings& settings_;
    MeshSettings meshSettings_;
    std::pair<std::uint32_t, std::uint32_t> levels_; ///< Of detail, first and last, in which each plant is shown.
    DetailScratch scratch_;
    std::vector<std::unique_ptr<TreeMesh>> meshes_;
    std::vector<std::unique_ptr<Appearance>> appearances_;
    std::vector<std::unique_ptr<OwnTextures>> own_;          ///< Of each input.
    std::vector<std::unique_ptr<MaterialTextures>> atlases_; ///< Of impostors.
    std::vector<RenderSubject> subjects_;
};

/// `branching angle` for branching-angle.archetype.
std::string nameOf(const std::string& path)
{
    std::string name = std::filesystem::path(path).stem().string();
    std::ranges::replace(name, '-', ' ');
    return name;
}

void render(const RenderCommand& command, const CLI::App& verb)
{
    if (std::filesystem::path(command.output).extension() != ".png")
        failUsage("render: " + command.output + ": expected an output that ends in .png");
    if (command.sheet && command.turntable > 0)
        failUsage("render: expected --sheet or --turntable, not both");
    const auto steps = parseSteps(command.iterations);
    if (parseSeeds(command.seeds).count() > 256)
        failUsage("render: expected at most 256 seeds");
    if (steps.size() > 1 && parseSeeds(command.seeds).count() > 1)
        failUsage("render: expected several seeds or several steps -n, not both");

    RenderSettings settings;
    const bool many = command.sheet || command.turntable > 0;
    settings.width = command.width > 0 ? command.width : many ? 480 : 900;
    settings.height = command.height > 0 ? command.height : many ? 560 : 1000;
    settings.samplesPerPixel = command.samples;
    settings.cameraAzimuth = static_cast<float>(command.azimuthDegrees * math::kRadiansPerDegree);
    settings.cameraElevation =
        static_cast<float>(command.elevationDegrees.value_or(command.paper ? 0 : -5) * math::kRadiansPerDegree);
    if (command.paper)
    {
        settings.backdrop = Backdrop::Paper;
        settings.fieldOfView = 0.1f; // from afar, as drawings are: a long row is not seen at a slant at its ends
    }

    if (!command.focus.empty())
    {
        if (!(command.focus[3] > 0))
            failUsage("render: --focus needs a radius above 0, in metres: X,Y,Z,RADIUS");
        settings.focus = {command.focus[0], command.focus[1], command.focus[2]};
        settings.focusRadius = command.focus[3];
    }

    // Two inputs of one kind need names; a drawn tree and its species do not.
    const auto kinds = [&](InputKind kind) {
        return std::ranges::count(command.inputs, kind, [](const std::string& path) { return kindOf(path); });
    };
    const bool needNames = kinds(InputKind::Archetype) > 1 || kinds(InputKind::Species) + kinds(InputKind::Grammar) > 1;
    const auto [firstLevel, lastLevel] = parseLevels(command.levels);
    const bool hasLeaves = !command.look.bare;
    checkNeeds(verb,
               {{"--attempt", kinds(InputKind::Species) > 0, "an S.species; nothing else chooses among several"},
                {"--templates", kinds(InputKind::Archetype) > 0, "an A.archetype"},
                {"--columns", command.sheet, "--sheet"},
                {"--seasons", command.sheet, "--sheet"},
                {"--gust", command.sheet, "--sheet"},
                {"--impostor", command.sheet, "--sheet"},
                {"--lod", command.sheet || firstLevel == lastLevel, "--sheet for a range of levels"},
                {"--takeover", command.impostor || lastLevel > 0, "coarse levels, such as --lod 0..4, or --impostor"},
                {"--season", hasLeaves, "leaves; expected no --no-leaves"}});
    if (command.seasons && (!command.look.season.empty() || command.look.bare))
        failUsage("render: --seasons shows all of them in leaf; expected neither --season nor --no-leaves");
    if (command.gustFrames > 0 && (command.impostor || command.takeover))
        failUsage("render: --gust shows leaves that move; expected neither --impostor nor --takeover");
    Gallery gallery(command, settings);
    for (const std::string& path : command.inputs)
        for (const std::optional<std::uint32_t>& step : kindOf(path) == InputKind::Archetype ? parseSteps({}) : steps)
            gallery.add({path, command.seeds, command.templates, step,
                         kindOf(path) == InputKind::Archetype ? std::nullopt : command.attempt},
                        needNames ? nameOf(path) : "", steps.size() > 1);
    if (gallery.subjects().size() > 1 && !command.sheet)
        failUsage("render: several trees need --sheet; expected that, or one tree");

    if (gallery.subjects().empty())
        fail({ErrorKind::BadInput, "nothing is left to show", {}, {}, {command.inputs.front(), 0, 0}});

    const Progress progress = terminalProgress();
    const Picture picture =
        command.sheet           ? orFail(renderContactSheet(gallery.subjects(), command.columns, settings, progress))
        : command.turntable > 0 ? orFail(renderTurntable(gallery.subjects()[0], command.turntable, settings, progress))
                                : orFail(renderPicture(gallery.subjects()[0], settings, progress));
    orFail(writeFileAtomically(command.output, encodePng(picture)));
    std::cout << command.output << ": " << picture.width << " x " << picture.height << " pixels\n";
}

} // namespace

void addRender(CLI::App& app)
{
    const auto command = std::make_shared<RenderCommand>();
    CLI::App* verb =
        app.add_subcommand("render", "Make a picture of an archetype, or of plants of a species or grammar");
    verb->add_option("inputs", command->inputs,
                     "A.archetype, S.species or G.lsys; several on a sheet, such as a drawn tree and its species")
        ->required();
    verb->add_option("--seed", command->seeds, "Of a species or grammar: a seed N, or a range A..B on a sheet")
        ->capture_default_str();
    verb->add_option("-o,--output", command->output, "out.png")->required();
    verb->add_option(
        "-n,--iterations", command->iterations,
        "Of a grammar: steps N of the derivation, or a range A..B on a sheet; default: what it says, else 0");
    addAttempt(*verb, command->attempt);
    verb->add_flag("--sheet", command->sheet, "A contact sheet: all trees at one scale, labelled");
    verb->add_option("--turntable", command->turntable, "A strip of N views from all sides")
        ->check(CLI::Range(2u, 64u));
    verb->add_option("--columns", command->columns, "Of a contact sheet, at most")
        ->check(CLI::Range(1u, 64u))
        ->capture_default_str();
    verb->add_option("--width", command->width, "Pixels, of one view; default: 900, on a sheet or turntable 480")
        ->check(CLI::Range(16u, 8192u));
    verb->add_option("--height", command->height, "Pixels, of one view; default: 1000, on a sheet or turntable 560")
        ->check(CLI::Range(16u, 8192u));
    verb->add_option("--samples", command->samples, "Rays a pixel: more is smoother and slower")
        ->check(CLI::Range(1u, 4096u))
        ->capture_default_str();
    verb->add_option("--azimuth", command->azimuthDegrees,
                     "Degrees round the tree at which the camera stands; default: 0, towards +Z")
        ->check(CLI::Range(-360.0, 360.0));
    verb->add_option("--elevation", command->elevationDegrees, "Degrees above the horizon; default: -5, with --paper 0")
        ->check(CLI::Range(-80.0, 80.0));
    verb->add_option(
            "--focus", command->focus,
            "A close-up: X,Y,Z,RADIUS in metres; the plant stands at the origin, Y is up, the camera at azimuth 0 "
            "looks along -Z; default: each plant as a whole")
        ->delimiter(',')
        ->expected(4);
    verb->add_flag("--paper", command->paper, "As a figure in a book: on blank paper, lit softly; with --lines in ink");
    verb->add_option("--lines", command->linePixels,
                     "As a line drawing, for curves that are no trees: sharp corners, lines of N pixels; where the "
                     "plant sets widths, no thinner than that; default: 0, a tree")
        ->check(CLI::Range(0.0, 100.0));
    verb->add_option(
            "--lod", command->levels,
            "A level of detail from 0, the full plant, to 12, each one half as many triangles; or a range on a "
            "sheet, such as 0..4")
        ->capture_default_str();
    verb->add_flag("--impostor", command->impostor, "On a sheet: after its levels the cards that stand for the plant");
    verb->add_flag("--takeover", command->takeover,
                   "Levels and cards as far away as they are meant for: where their error is a pixel");
    verb->add_option("--branches", command->branches,
                     "embed: each branch begins inside its parent; weld: all wood is one closed surface")
        ->check(CLI::IsMember({"embed", "weld"}))
        ->capture_default_str();
    command->look.addTo(*verb);
    verb->add_flag("--seasons", command->seasons, "On a sheet: each plant as it is, then in each of its seasons");
    verb->add_option("--gust", command->gustFrames,
                     "On a sheet: each plant in N moments of a gust of a strong breeze, from left to right")
        ->check(CLI::Range(2u, 64u));
    command->templates.addTo(*verb);
    verb->callback([command, verb] { render(*command, *verb); });
}

} // namespace espalier::tool
