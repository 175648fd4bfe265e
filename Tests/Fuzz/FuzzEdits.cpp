// Edited grammars, which people write: put into an inferred species, they are printed with their origins, and carried
// over to what is inferred again, by the same choice and by another one. What comes of it reads back the same.

#include "Fuzzing.h"

#include <Espalier/Inference/Inference.h>
#include <Espalier/Inference/RuleEdits.h>
#include <Espalier/Species/Grow.h>

using namespace espalier;

namespace {

/// Two forks, one upon the other, and four shoots, three of them alike.
Archetype drawing()
{
    Archetype archetype;
    archetype.libraryName = "x.templates";
    archetype.library = parseTemplates("fork: F[-FX]+FY\nshoot: F(0.5)FX\n", "x.templates", {}).value();
    archetype.instances = {{0, kNoInstance, 0, {1, 0, 45, 0}}, {0, 0, 0, {1, 10, 45, 0}},  {1, 0, 1, {1, 0, 45, 90}},
                           {1, 1, 0, {0.5, 0, 45, 0}},         {1, 1, 1, {0.5, 0, 45, 0}}, {1, 2, 0, {0.5, 0, 45, 0}}};
    return archetype;
}

Species inferred(double mergeWeight, double ruleWeight)
{
    const Archetype archetype = drawing();
    return inferSpecies({&archetype, 1}, {.mergeWeight = mergeWeight, .ruleWeight = ruleWeight}).value();
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    static const Species kInferred[] = {inferred(0.5, 1.0), inferred(0.5, 0.9), inferred(0.25, 0.0)};
    auto edited = parseGrammar(fuzzing::textOf(data, size), "fuzz.lsys", {});
    if (!edited)
        return 0;
    const Grammar grammar = *edited;
    Species species = kInferred[0];
    (void)lockRules(species, "Shoot", true);
    setGrammar(species, std::move(*edited));
    const auto read = parseGrammar(printWithOrigins(species), "commented.lsys", {});
    fuzzing::promiseValue(read, "a grammar with origins reads back");
    fuzzing::promise(*read == grammar, "a grammar with origins reads back the same");
    const EditSummary summary = summarizeEdits(species);
    fuzzing::promise(summary.kept + summary.weights + summary.changed + summary.removed ==
                         kInferred[0].grammar.productions.size(),
                     "each inferred rule is kept, changed or removed");

    GrowOptions trial;
    trial.budget = {.productions = 500, .depth = 40, .modules = 5000};
    trial.limits.nodes = 5000;
    trial.attempt = 0;
    for (const Species& choice : kInferred)
    {
        Species anew = choice;
        const CarriedEdits carried = carryEdits(species, anew, trial);
        fuzzing::promise(anew.conflicts == carried.conflicts, "conflicts are kept, each once");
        const auto again = parseSpecies(printSpecies(anew), "merged.species");
        fuzzing::promiseValue(again, "a merged species reads back");
        fuzzing::promise(*again == anew, "a merged species reads back the same");
        Species twice = choice;
        (void)carryEdits(anew, twice, trial);
        fuzzing::promise(twice.grammar == anew.grammar, "what was carried once is carried again as it is");
    }
    return 0;
}
