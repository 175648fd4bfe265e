#include "Look.h"
#include "Usage.h"

#include <Espalier/Core/Json.h>
#include <Espalier/Inference/Inference.h>
#include <Espalier/Inference/RuleEdits.h>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>
#include <span>

namespace espalier::tool {

namespace {

struct InferOptions
{
    std::vector<std::string> archetypes;
    std::string output;
    std::string preset = "kin";
    std::optional<double> mergeWeight;
    std::optional<double> ruleWeight;
    // Not said: as when the species was inferred before, or else as usual.
    std::optional<double> jitter;
    std::vector<std::uint32_t> weights;
    std::optional<std::string> spatial;
    std::optional<bool> mirror;
    std::string name;
    std::string appearance; ///< A file; empty: as the species looked before, or bare wood.
    bool trace = false;
    bool explain = false;
    bool fresh = false;
    TemplateFolders templates;
};

/// The species that is about to be inferred again, if there is one. Nothing that somebody did is lost without a word.
std::optional<Species> formerSpecies(const InferOptions& options)
{
    std::error_code ignored;
    if (options.output.empty() || !std::filesystem::exists(options.output, ignored))
        return {};
    const std::string advice = "name another output, or say --fresh to overwrite it";
    auto former = loadSpecies(options.output, authoringLimits());
    if (!former && options.fresh)
    {
        std::cerr << options.output << ": overwritten; it was no species that can be read\n";
        return {};
    }
    if (!former)
    {
        Error error = former.error();
        error.what = "this would be overwritten, and is no species that can be read: " + error.what;
        error.advice = advice;
        fail(error);
    }
    const EditSummary edits = summarizeEdits(*former);
    const std::string held = counted(edits.edits(), "edit") + ", " + counted(edits.locked, "lock") + " and " +
                             counted(former->conflicts.size(), "conflict");
    if (options.fresh)
    {
        if (hasEdits(*former))
            std::cerr << options.output << ": dropped " << held << '\n';
        if (hasEditedPipes(*former) || hasEditedTables(*former))
            std::cerr << options.output << ": dropped edits of its pipes, its tables or its window\n";
        return {};
    }
    const std::string& method = former->provenance.method;
    if (method.empty())
        fail({ErrorKind::BadInput,
              "this would be overwritten, and was written by hand",
              {},
              advice,
              {options.output, 0, 0}});
    if (former->provenance.grammar.empty())
        std::cerr << options.output
                  << ": written by an earlier version, which did not tell edits from what it inferred: they are "
                     "overwritten\n";
    if (!knowsInferred(*former))
        fail({ErrorKind::BadInput,
              "its grammar was edited in the file itself, so inferring again cannot tell the edits",
              "edits made with `grammar --set`",
              "keep the text (`grammar > G.lsys`), infer with --fresh, and put the edits back with `grammar --set`",
              {options.output, 0, 0}});
    if (hasEditedTables(*former))
        std::cerr
            << options.output
            << ": its tables or its window were edited in the file; they are inferred anew, without these edits\n";
    if (hasEdits(*former) && !method.starts_with(options.preset + " "))
        fail({ErrorKind::BadInput,
              "it holds " + held + " of what " + method + " inferred",
              "the same preset, whose rules they can be carried to",
              advice,
              {options.output, 0, 0}});
    return std::move(*former);
}

/// What an archetype's trees counted each when a species was inferred; none where those were other trees.
std::vector<std::uint32_t> recalledWeights(const Provenance& provenance, const std::vector<Archetype>& archetypes)
{
    std::vector<std::uint32_t> weights;
    std::size_t tree = 0;
    for (const Archetype& archetype : archetypes)
    {
        if (tree < provenance.weights.size())
            weights.push_back(provenance.weights[tree]);
        tree +=
            static_cast<std::size_t>(std::ranges::count(archetype.instances, kNoInstance, &TemplateInstance::parent));
    }
    if (tree * (provenance.mirror ? 2 : 1) != provenance.weights.size())
        weights.clear();
    return weights;
}

std::string defaultName(const InferOptions& options)
{
    return std::filesystem::path(options.archetypes[0]).stem().string();
}

/// How a species was inferred holds until something else is said. Tells what is taken over.
void recall(const Species& former, const std::vector<Archetype>& archetypes, InferOptions& options)
{
    const Provenance& p = former.provenance;
    std::string said;
    if (options.name.empty() && former.name != defaultName(options))
    {
        options.name = former.name;
        said += " --name " + quoteJson(former.name);
    }
    if (!options.jitter && p.jitter != kUsualJitter)
    {
        options.jitter = p.jitter;
        said += " --jitter " + formatNumber(p.jitter);
    }
    if (!options.spatial && !p.spatial.empty())
    {
        options.spatial = p.spatial;
        said += " --spatial " + p.spatial;
    }
    if (!options.mirror && p.mirror)
    {
        options.mirror = true;
        said += " --mirror";
    }
    if (options.weights.empty() && !p.weights.empty())
    {
        options.weights = recalledWeights(p, archetypes);
        for (std::size_t i = 0; i < options.weights.size(); ++i)
            said += (i == 0 ? " --weights " : ",") + std::to_string(options.weights[i]);
        if (options.weights.empty())
            std::cerr << options.output << ": was inferred from other trees with --weights; now all count alike\n";
    }
    if (!said.empty())
        std::cout << options.output << ": inferred as before, with" << said << '\n';
}

/// The beginning and the end of a rule: its symbol, and its weight and transform.
std::string abridged(const std::string& rule)
{
    constexpr std::size_t kEnd = 48;
    if (rule.size() <= 2 * kEnd)
        return rule;
    std::string end = rule.substr(rule.size() - kEnd);
    return shortened(rule) + end.substr(std::min(end.find_first_of(" [+-"), end.size()));
}

/// A species that is inferred again looks as it did: of another tree, this is perhaps not meant.
void tellKeptLook(const Appearance& look, const std::string& path)
{
    Appearance plain;
    plain.pipes = look.pipes;
    if (look != plain)
        std::cerr << path << ": keeps the look that it had, " << summaryOf(look)
                  << "; --appearance gives it another, --fresh none\n";
}

/// Carries over what people did to the species as it was inferred before, and tells of it.
void carry(const Species& former, Species& species, const std::string& path)
{
    const CarriedEdits carried = carryEdits(former, species);
    constexpr std::size_t kMostTold = 6;
    const std::size_t told = std::min(carried.conflicts.size(), kMostTold);
    for (const EditConflict& conflict : std::span(carried.conflicts).first(told))
        std::cerr << path << ": conflict: "
                  << (conflict.edited.empty() ? "the removal of `" + abridged(conflict.inferred)
                                              : "the edit `" + abridged(conflict.edited))
                  << "` is not carried over: " << conflict.reason
                  << "; the grammar has it as inferred: edit it again with `grammar --set`, or let it be with "
                     "`grammar --dismiss`\n";
    if (told < carried.conflicts.size())
        std::cerr << path << ": and " << counted(carried.conflicts.size() - told, "conflict")
                  << " more, which `espalier grammar " << path << "` lists\n";
    if (hasEditedPipes(former))
        std::cout << path << ": its pipes, which were edited, are kept\n";
    if (hasEdits(species))
        std::cout << path << ": " << counted(carried.edits, "edit") << " and " << counted(carried.locks, "lock")
                  << " kept, " << counted(species.conflicts.size(), "conflict") << " to settle\n";
}

void infer(InferOptions options, const CLI::App& verb)
{
    checkNeeds(verb, {{"--fresh", !options.output.empty(), "-o S.species"},
                      {"--appearance", !options.output.empty(), "-o S.species"}});
    if (options.output.empty() && !options.trace && !options.explain)
        failUsage("infer: expected -o S.species, or --trace or --explain to see the grammar or the reasons only");
    if (options.explain && options.preset != "kin")
        failUsage("infer: --explain tells of the preset kin; " + options.preset + " has --trace");
    for (const std::optional<double>& weight : {options.mergeWeight, options.ruleWeight})
        if (weight && !std::isfinite(*weight))
            failUsage("infer: expected a weight from 0 to 1");
    if (options.jitter && !std::isfinite(*options.jitter))
        failUsage("infer: expected a jitter from 0 to 1");
    if (!options.output.empty() && std::filesystem::path(options.output).extension() != ".species")
        failUsage("infer: " + options.output + ": expected an output that ends in .species");
    if (!options.weights.empty() && options.weights.size() != options.archetypes.size())
        failUsage("infer: expected --weights with a number for each of the " +
                  counted(options.archetypes.size(), "archetype"));
    std::vector<Archetype> archetypes;
    for (const std::string& path : options.archetypes)
    {
        if (kindOf(path) != InputKind::Archetype)
            failUsage(path + ": expected an .archetype file");
        archetypes.push_back(options.templates.load(path));
    }
    const std::optional<Species> former = formerSpecies(options);
    if (former && former->provenance.method.starts_with(options.preset + " "))
        recall(*former, archetypes, options);
    std::vector<Azimuths> spatial;
    if (options.spatial)
    {
        auto azimuths = parseAzimuths(*options.spatial);
        if (!azimuths)
            failUsage("infer --spatial: " + azimuths.error().what + "; expected " + azimuths.error().expected);
        spatial = std::move(*azimuths);
    }
    InferenceOptions inference;
    inference.preset = options.preset;
    inference.mergeWeight = options.mergeWeight;
    inference.ruleWeight = options.ruleWeight;
    inference.jitter = options.jitter.value_or(kUsualJitter);
    inference.weights = options.weights;
    inference.spatial = spatial;
    inference.mirror = options.mirror.value_or(false);
    inference.name = options.name.empty() ? defaultName(options) : options.name;
    inference.progress = terminalProgress();
    if (options.trace)
        inference.trace = [](std::string_view pass, const std::string& summary, const std::string& grammar) {
            std::cout << "# " << pass << ": " << summary << '\n' << grammar << '\n';
        };
    if (options.explain)
        inference.explain = [](const Explanation& explanation) { std::cout << printExplanation(explanation); };
    Species species = orFail(inferSpecies(archetypes, inference));
    if (options.output.empty())
        return;
    if (former)
        carry(*former, species, options.output);
    if (!options.appearance.empty())
        dress(species.appearance, loadLook(options.appearance));
    else if (former)
        tellKeptLook(species.appearance, options.output);
    orFail(saveSpecies(options.output, species, authoringLimits()));
    tellMissingPictures(species.appearance, options.output);
    if (!options.trace && !options.explain)
        std::cout << options.output << ": " << species.provenance.exemplarInstances << " instances"
                  << (archetypes.size() > 1 ? " in the mean, " : ", ") << species.grammar.productions.size()
                  << " productions, merge weight " << species.provenance.mergeWeight
                  << (options.mergeWeight ? "" : " (chosen)") << '\n';
    std::error_code ignored;
    const std::uintmax_t bytes = std::filesystem::file_size(options.output, ignored);
    if (constexpr Limits kGames; !ignored && bytes > kGames.fileBytes)
        std::cerr << options.output << ": the species has " << bytes << " bytes, more than games read unless they raise"
                  << " the limit fileBytes of " << kGames.fileBytes
                  << "; equal branches, which are written once, would make it smaller\n";
    if (!species.provenance.note.empty())
        std::cerr << species.name << ": " << species.provenance.note << '\n';
}

} // namespace

void addInfer(CLI::App& app)
{
    const auto options = std::make_shared<InferOptions>();
    CLI::App* verb = app.add_subcommand("infer", "Find the rules behind drawn trees: archetypes become a species");
    verb->add_option("archetypes", options->archetypes, "A.archetype ... (several teach one species)")->required();
    verb->add_option("-o,--output", options->output, "The species to write, S.species");
    verb->add_option("--preset", options->preset, "kin: branches stand for their kin; helberg: the thesis' four passes")
        ->check(CLI::IsMember(inferencePresets()))
        ->capture_default_str();
    verb->add_option("--merge-weight", options->mergeWeight,
                     "0..1. kin: how freely kin are exchanged, 0 gives the archetype back; default: chosen for the "
                     "tree. helberg: w_0, default 0.5")
        ->check(CLI::Range(0.0, 1.0));
    verb->add_option(
            "--rule-weight", options->ruleWeight,
            "0..1. kin: how coarse the classes of kin are; default: chosen for the tree. helberg: w_l, default 0.5")
        ->check(CLI::Range(0.0, 1.0));
    verb->add_option(
            "--jitter", options->jitter,
            "0..1. kin: how far parameters are moved, as a share of what each was drawn to vary; 0: not at all; "
            "default: 0.1")
        ->check(CLI::Range(0.0, 1.0));
    verb->add_option("--name", options->name, "Name of the species; default: the archetype's file name");
    verb->add_option(
            "--appearance", options->appearance,
            "A.appearance, or a species that it shall look like: bark, leaves, seasons, wind, colours; default: as "
            "S.species looked before, else bare wood")
        ->check(CLI::ExistingFile);
    verb->add_option("--weights", options->weights,
                     "kin: how often each archetype counts, 1..1000, such as 3,1; default: all alike")
        ->delimiter(',')
        ->allow_extra_args(false)
        ->check(CLI::Range(1u, 1000u));
    verb->add_option(
        "--spatial", options->spatial,
        "Give planar archetypes depth: branches stand round their axis by phyllotaxis (137.5 degrees from "
        "one to the next) or at random; several with commas, for branches of the trunk, of its limbs, ..., "
        "where `drawn` leaves them");
    verb->add_flag_function(
        "--mirror,!--no-mirror", [options](std::int64_t times) { options->mirror = times > 0; },
        "kin: mirror images of what was drawn, of the tree and of every branch, teach the species too");
    verb->add_flag("--fresh", options->fresh,
                   "Overwrite S.species whatever it holds; else its edits and locks are carried over, and --name, "
                   "--jitter, --weights, --spatial and --mirror stay as they were until said otherwise");
    verb->add_flag("--explain", options->explain,
                   "Print why: the classes that were tried, and what became one, with its gain in bits");
    verb->add_flag("--trace", options->trace, "Print the grammar after each pass");
    options->templates.addTo(*verb);
    verb->callback([options, verb] { infer(*options, *verb); });
}

} // namespace espalier::tool
