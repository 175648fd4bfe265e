#include "Command.h"
#include "Usage.h"

#include <Espalier/Core/File.h>
#include <Espalier/Core/Json.h>
#include <Espalier/Inference/RuleEdits.h>
#include <Espalier/Species/Grow.h>
#include <algorithm>
#include <iostream>
#include <memory>
#include <span>

namespace espalier::tool {

namespace {

struct GrammarOptions
{
    std::string species;
    std::string edited;
    std::vector<std::string> lock;
    std::vector<std::string> unlock;
    bool dismiss = false;
    bool plain = false;
};

void set(Species& species, const GrammarOptions& options)
{
    const Limits limits = Limits{}.ofInferredGrammars();
    const std::string text = orFail(readTextFile(options.edited, limits.fileBytes));
    Grammar edited = orFail(parseGrammar(text, options.edited, limits));
    setGrammar(species, std::move(edited));
    // Named here, where the grammar's own lines are known; saving would name the species file's. Weights that cannot
    // be, such as a `let w = 7`, show when something grows.
    GrowScratch scratch;
    Skeleton skeleton;
    orFailIn(options.edited, orFailIn(options.edited, Grower::make(species)).grow(Seed{1}, {}, scratch, skeleton));
}

void lock(Species& species, const GrammarOptions& options)
{
    for (const auto& [names, locked] : {std::pair(&options.lock, true), std::pair(&options.unlock, false)})
        for (const std::string& name : *names)
            orFailIn(options.species, lockRules(species, name, locked));
}

std::string summary(const Species& species)
{
    const EditSummary edits = summarizeEdits(species);
    std::string text = counted(species.grammar.productions.size(), "production");
    if (species.provenance.method.empty())
        return text;
    text += ": " + std::to_string(edits.kept) + " kept, " + counted(edits.weights, "weight") + " changed, " +
            counted(edits.changed, "rule") + " changed, " + std::to_string(edits.added) + " added, " +
            std::to_string(edits.removed) + " removed";
    if (edits.settings > 0)
        text += ", " + counted(edits.settings, "setting") + " changed";
    if (edits.locked > 0)
        text += "; " + std::to_string(edits.locked) + " locked";
    if (!species.conflicts.empty())
        text += "; " + counted(species.conflicts.size(), "conflict") + " to settle";
    return text;
}

void grammar(const GrammarOptions& options, const CLI::App& verb)
{
    Species species = loadSpeciesFile(options.species);
    const bool changes = !options.edited.empty() || !options.lock.empty() || !options.unlock.empty() || options.dismiss;
    checkNeeds(verb, {{"--plain", !changes, "the grammar to be printed; expected no change of it"}});
    if (!changes)
    {
        std::cout << (options.plain ? printGrammar(species.grammar) : printWithOrigins(species));
        return;
    }
    if (!options.edited.empty())
        set(species, options);
    lock(species, options);
    if (options.dismiss)
        species.conflicts.clear();
    orFail(saveSpecies(options.species, species, authoringLimits()));
    std::cout << options.species << ": " << summary(species) << '\n';
    if (options.edited.empty())
        return;
    constexpr std::size_t kMostTold = 8;
    const std::vector<std::string> doubts = doubtsOf(species);
    for (const std::string& doubt : std::span(doubts).first(std::min(doubts.size(), kMostTold)))
        std::cerr << options.edited << ": is this meant? " << doubt << '\n';
    if (doubts.size() > kMostTold)
        std::cerr << options.edited << ": and " << doubts.size() - kMostTold << " more like these\n";
}

} // namespace

void addGrammar(CLI::App& app)
{
    const auto options = std::make_shared<GrammarOptions>();
    CLI::App* verb = app.add_subcommand("grammar", "Print a species' grammar as text, or put an edited one back");
    verb->add_option("species", options->species, "S.species")->required();
    verb->add_option("--set", options->edited,
                     "G.lsys: puts this grammar into the species, in place; what differs from the inferred one is an "
                     "edit, which survives inferring again");
    verb->add_option(
        "--lock", options->lock,
        "Rules that inferring again leaves as they are: of a symbol (Bough), of a limb (\"Bough(3)\"), or in a "
        "line of what this prints (17)");
    verb->add_option("--unlock", options->unlock, "Likewise: rules to infer again");
    verb->add_flag("--dismiss", options->dismiss, "Forget the conflicts of edits that could not be carried over");
    verb->add_flag("--plain", options->plain, "Print it without comments");
    verb->callback([options, verb] { grammar(*options, *verb); });
}

} // namespace espalier::tool
