#include "Look.h"

#include "Pictures.h"

#include <Espalier/Core/File.h>
#include <Espalier/Core/Json.h>
#include <Espalier/Species/AppearanceFile.h>
#include <Espalier/Texture/AppearanceTextures.h>
#include <algorithm>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <string_view>

namespace espalier::tool {

Appearance loadLook(const std::string& path)
{
    if (std::filesystem::path(path).extension() == ".appearance")
        return orFail(loadAppearance(path));
    if (std::filesystem::path(path).extension() != ".species")
        failEnding(path, ".appearance or .species");
    return loadSpeciesFile(path).appearance;
}

void dress(Appearance& appearance, Appearance look)
{
    look.pipes = appearance.pipes;
    appearance = std::move(look);
}

std::string summaryOf(const Appearance& appearance)
{
    std::string text =
        counted(appearance.leaves.size(), "kind") + " of leaves, " + counted(appearance.seasons.size(), "season");
    for (std::size_t i = 0; i < appearance.seasons.size(); ++i)
        text += (i == 0 ? " (" : ", ") + appearance.seasons[i].name;
    return text + (appearance.seasons.empty() ? "" : ")");
}

void LookOptions::addTo(CLI::App& verb)
{
    verb.add_option("--appearance", file, "A.appearance or S.species: look like this instead")
        ->check(CLI::ExistingFile);
    verb.add_option("--season", season,
                    "One of the seasons that the appearance names, such as autumn; summer: the plain look, which is "
                    "the default");
    verb.add_flag("--no-leaves", bare, "Wood alone");
}

namespace {

/// Letters of ASCII alone: names may be in any language, but must be typed alike there.
bool isSameName(std::string_view a, std::string_view b)
{
    const auto lower = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
    return std::ranges::equal(a, b, {}, lower, lower);
}

/// The name of the season as the appearance writes it; empty: the plain look.
std::string seasonOf(const Appearance& appearance, const std::string& given, const std::string& source)
{
    for (const Season& one : appearance.seasons)
        if (one.name == given)
            return given;
    for (const Season& one : appearance.seasons)
        if (isSameName(one.name, given))
            return one.name;
    constexpr std::string_view kPlain = "summer";
    if (isSameName(given, kPlain))
        return {};
    if (appearance.seasons.empty())
        failUsage("--season " + given + ": " + source + " has no seasons; expected no --season");
    std::string known = std::string(kPlain) + " (the plain look)";
    for (const Season& one : appearance.seasons)
        known += (&one == &appearance.seasons.back() ? " or " : ", ") + one.name;
    failUsage("--season " + given + ": " + source + " has no such season; expected " + known);
}

} // namespace

void LookOptions::applyTo(Appearance& appearance, const std::string& input) const
{
    if (!file.empty())
        dress(appearance, loadLook(file));
    if (!season.empty())
        appearance = inSeason(appearance, seasonOf(appearance, season, source(input)));
    if (bare)
        appearance.leaves.clear();
}

namespace {

/// The artist's own pictures that the look of a file names.
OwnTextures picturesOf(const Appearance& look, const std::string& path)
{
    return orFail(loadOwnTextures(look, std::filesystem::path(path).parent_path(), authoringLimits()));
}

} // namespace

OwnTextures LookOptions::pictures(const Appearance& appearance, const std::string& input) const
{
    return picturesOf(appearance, source(input));
}

void tellMissingPictures(const Appearance& look, const std::string& path)
{
    std::string missing;
    for (const ImageNames& names : look.images)
        for (const std::string& name : namesIn(names))
            if (std::error_code unknown;
                !std::filesystem::exists(std::filesystem::path(path).parent_path() / name, unknown))
                missing += (missing.empty() ? "" : ", ") + name;
    if (!missing.empty())
        std::cerr << path << ": its look wants pictures that are not beside it: " << missing
                  << "; copy them there, or name them with their folder\n";
}

namespace {

struct AppearanceCommand
{
    std::string species;
    std::string given;
    std::string pictures; ///< The folder to write them to.
};

/// Writes what the materials are painted with to `folder`, and prints what an appearance beside the pictures says.
void writeAllPictures(const Appearance& look, const OwnTextures& own, const std::filesystem::path& folder)
{
    Appearance painted = look;
    painted.images.clear();
    for (std::size_t i = 0; i <= look.leaves.size(); ++i)
        painted.images.push_back(pictureNames(i == 0 ? "bark" : "leaves" + std::to_string(i - 1)));
    for (const ImageNames& names : painted.images)
        for (const std::string& name : namesIn(names))
            if (std::error_code unknown; std::filesystem::exists(folder / name, unknown))
                failUsage("appearance: " + (folder / name).string() +
                          " is there already; expected a folder without pictures of that name");

    if (std::error_code refused; !std::filesystem::is_directory(folder, refused))
        if (!std::filesystem::create_directory(folder, refused))
            fail({ErrorKind::Io, "the folder cannot be made", {}, {}, {folder.string(), 0, 0}});

    const AppearanceTextures textures = makeTextures(look, {}, 0, &own);
    for (std::size_t i = 0; i < painted.images.size(); ++i)
        writePictures(folder, painted.images[i], encode(i == 0 ? textures.bark : textures.leaves[i - 1]));
    std::cout << printAppearance(painted);
    std::cerr << folder.string() << ": " << 3 * painted.images.size()
              << " pictures; paint over them, save the look printed here beside them, and set it for a species there\n";
}

/// What an .appearance file leaves out and a look has: "bark.relief, seasons". Files are the whole look, so it is lost.
std::string leftOut(const std::string& path, const Appearance& look)
{
    using Json = nlohmann::json;
    // Both were read, or printed, by the library: their depth is known to be small.
    const Json given = Json::parse(orFail(readTextFile(path, Limits{}.fileBytes)), nullptr, false);
    const Json present = Json::parse(printAppearance(look));
    const Json become = Json::parse(printAppearance(orFail(loadAppearance(path))));
    std::string names;
    const auto compare = [&](const std::string& prefix, const Json& before, const Json& file, const Json& after) {
        for (const auto& [key, value] : before.items())
            if (file.is_object() && !file.contains(key) && (!after.contains(key) || after[key] != value))
                names += (names.empty() ? "" : ", ") + prefix + key;
    };
    compare("", present, given, become);
    for (const char* section : {"bark", "wind"})
        if (present.contains(section) && given.contains(section))
            compare(std::string(section) + ".", present[section], given[section],
                    become.value(section, Json::object()));
    return names;
}

void appearance(const AppearanceCommand& command)
{
    Species species = loadSpeciesFile(command.species);
    if (!command.pictures.empty())
    {
        writeAllPictures(species.appearance, picturesOf(species.appearance, command.species), command.pictures);
        return;
    }
    if (command.given.empty())
    {
        std::cout << printAppearance(species.appearance);
        return;
    }
    const Appearance former = species.appearance;
    dress(species.appearance, loadLook(command.given));
    orFail(saveSpecies(command.species, species, authoringLimits()));
    if (std::filesystem::path(command.given).extension() == ".appearance")
        if (const std::string names = leftOut(command.given, former); !names.empty())
            std::cerr << command.given << ": a look is set as a whole: " << command.species << " has lost " << names
                      << ", which the file leaves out; to change a part, edit what `espalier appearance "
                      << command.species << "` prints, and set that\n";
    tellMissingPictures(species.appearance, command.species);
    std::cout << command.species << ": " << summaryOf(species.appearance) << '\n';
}

} // namespace

void addAppearance(CLI::App& app)
{
    const auto command = std::make_shared<AppearanceCommand>();
    CLI::App* verb = app.add_subcommand(
        "appearance", "Print what a species looks like - bark, leaves, seasons, wind - or give it another look");
    verb->add_option("species", command->species, "S.species")->required();
    verb->add_option("--set", command->given,
                     "A.appearance, or another species: puts its look into the species, in place, as a whole: what the "
                     "file leaves out is as usual, not as before. Rules and the thickness of wood stay")
        ->check(CLI::ExistingFile);
    verb->add_option("--pictures", command->pictures,
                     "A folder, made if need be: writes the pictures of bark and leaves there, to paint over, and "
                     "prints the look that names them under \"images\"")
        ->excludes("--set");
    verb->callback([command] { appearance(*command); });
}

} // namespace espalier::tool
