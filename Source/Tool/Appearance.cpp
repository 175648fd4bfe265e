#include "Look.h"

#include <Espalier/Core/Json.h>
#include <Espalier/Species/AppearanceFile.h>
#include <algorithm>
#include <iostream>
#include <memory>

namespace espalier::tool {

Appearance loadLook(const std::string& path)
{
    if (std::filesystem::path(path).extension() == ".appearance")
        return orFail(loadAppearance(path));
    if (kindOf(path) != InputKind::Species)
        failUsage(path + ": expected a look from an .appearance or a .species file");
    return loadSpeciesFile(path).appearance;
}

void dress(Appearance& appearance, Appearance look)
{
    look.pipes = appearance.pipes;
    appearance = std::move(look);
}

void LookOptions::addTo(CLI::App& verb)
{
    verb.add_option("--appearance", file, "A.appearance or S.species: look like this instead")
        ->check(CLI::ExistingFile);
    verb.add_option("--season", season, "One of the seasons that the appearance names, such as autumn");
    verb.add_flag("--no-leaves", bare, "Wood alone");
}

void LookOptions::applyTo(Appearance& appearance) const
{
    if (!file.empty())
        dress(appearance, loadLook(file));
    if (!season.empty() && std::ranges::find(appearance.seasons, season, &Season::name) == appearance.seasons.end())
    {
        std::string known;
        for (const Season& one : appearance.seasons)
            known += (known.empty() ? "" : ", ") + one.name;
        failUsage("--season " + season + ": expected " +
                  (known.empty() ? "none, for this appearance has no seasons" : "one of " + known));
    }
    appearance = inSeason(appearance, season);
    if (bare)
        appearance.leaves.clear();
}

namespace {

struct AppearanceCommand
{
    std::string species;
    std::string given;
};

std::string summary(const Appearance& appearance)
{
    std::string text =
        counted(appearance.leaves.size(), "kind") + " of leaves, " + counted(appearance.seasons.size(), "season");
    for (std::size_t i = 0; i < appearance.seasons.size(); ++i)
        text += (i == 0 ? " (" : ", ") + appearance.seasons[i].name;
    return text + (appearance.seasons.empty() ? "" : ")");
}

void appearance(const AppearanceCommand& command)
{
    Species species = loadSpeciesFile(command.species);
    if (command.given.empty())
    {
        std::cout << printAppearance(species.appearance);
        return;
    }
    dress(species.appearance, loadLook(command.given));
    orFail(saveSpecies(command.species, species, authoringLimits()));
    std::cout << command.species << ": " << summary(species.appearance) << '\n';
}

} // namespace

void addAppearance(CLI::App& app)
{
    const auto command = std::make_shared<AppearanceCommand>();
    CLI::App* verb = app.add_subcommand(
        "appearance", "Print what a species looks like - bark, leaves, seasons, wind - or give it another look");
    verb->add_option("species", command->species, "S.species")->required();
    verb->add_option("--set", command->given,
                     "A.appearance, or another species: puts its look into the species, in place. Its rules and the "
                     "thickness of its wood stay")
        ->check(CLI::ExistingFile);
    verb->callback([command] { appearance(*command); });
}

} // namespace espalier::tool
