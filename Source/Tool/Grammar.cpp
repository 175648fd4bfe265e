#include "Command.h"

#include <Espalier/Core/File.h>
#include <Espalier/Species/Grow.h>
#include <iostream>
#include <memory>

namespace espalier::tool {

namespace {

struct GrammarOptions
{
    std::string species;
    std::string edited;
};

void grammar(const GrammarOptions& options)
{
    Species species = loadSpeciesFile(options.species);
    if (options.edited.empty())
    {
        std::cout << printGrammar(species.grammar);
        return;
    }
    Limits limits;
    limits.productions = limits.inferredNodes;
    limits.grammarParts = 2 * limits.inferredNodes;
    const std::string text = orFail(readTextFile(options.edited, limits.fileBytes));
    species.grammar = orFail(parseGrammar(text, options.edited, limits));
    // Named here, where the grammar's own lines are known; saving would name the species file's. Weights that cannot
    // be, such as a `let w = 7`, show when something grows.
    GrowScratch scratch;
    orFailIn(options.edited, orFailIn(options.edited, Grower::make(species)).sample(Seed{1}, 0, {}, scratch));
    orFail(saveSpecies(options.species, species));
    std::cout << options.species << ": " << species.grammar.productions.size() << " productions\n";
}

} // namespace

void addGrammar(CLI::App& app)
{
    const auto options = std::make_shared<GrammarOptions>();
    CLI::App* verb = app.add_subcommand("grammar", "Print a species' grammar as text, or put an edited one back");
    verb->add_option("species", options->species, "S.species")->required();
    verb->add_option("--set", options->edited, "G.lsys: puts this grammar into the species, in place");
    verb->callback([options] { grammar(*options); });
}

} // namespace espalier::tool
