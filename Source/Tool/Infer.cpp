#include "Command.h"

#include <Espalier/Inference/Inference.h>
#include <cmath>
#include <iostream>
#include <memory>

namespace espalier::tool {

namespace {

struct InferOptions
{
    std::vector<std::string> archetypes;
    std::string output;
    std::string preset = "kin";
    std::optional<double> mergeWeight;
    std::optional<double> ruleWeight;
    std::string name;
    bool trace = false;
    TemplateFolders templates;
};

void infer(const InferOptions& options)
{
    if (options.output.empty() && !options.trace)
        failUsage("infer: expected -o S.species, or --trace to see the grammar only");
    for (const std::optional<double>& weight : {options.mergeWeight, options.ruleWeight})
        if (weight && !std::isfinite(*weight))
            failUsage("infer: expected a weight from 0 to 1");
    if (!options.output.empty() && std::filesystem::path(options.output).extension() != ".species")
        failUsage("infer: " + options.output + ": expected an output that ends in .species");
    std::vector<Archetype> archetypes;
    for (const std::string& path : options.archetypes)
    {
        if (kindOf(path) != InputKind::Archetype)
            failUsage(path + ": expected an .archetype file");
        archetypes.push_back(options.templates.load(path));
    }
    InferenceOptions inference;
    inference.preset = options.preset;
    inference.mergeWeight = options.mergeWeight;
    inference.ruleWeight = options.ruleWeight;
    inference.name = options.name.empty() ? std::filesystem::path(options.archetypes[0]).stem().string() : options.name;
    inference.progress = terminalProgress();
    if (options.trace)
        inference.trace = [](std::string_view pass, const std::string& summary, const std::string& grammar) {
            std::cout << "# " << pass << ": " << summary << '\n' << grammar << '\n';
        };
    const Species species = orFail(inferSpecies(archetypes, inference));
    if (options.output.empty())
        return;
    orFail(saveSpecies(options.output, species));
    if (!options.trace)
        std::cout << options.output << ": " << species.provenance.exemplarInstances << " instances, "
                  << species.grammar.productions.size() << " productions, merge weight "
                  << species.provenance.mergeWeight << (options.mergeWeight ? "" : " (chosen)") << '\n';
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
    verb->add_option("--name", options->name, "Name of the species; default: the archetype's file name");
    verb->add_flag("--trace", options->trace, "Print the grammar after each pass");
    options->templates.addTo(*verb);
    verb->callback([options] { infer(*options); });
}

} // namespace espalier::tool
