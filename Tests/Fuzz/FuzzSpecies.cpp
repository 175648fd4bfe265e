// Reads `.species` files, which are mod content. What is read prints to a text that reads back the same, grows within
// its budget, and gives its edits to what is inferred anew.

#include "Fuzzing.h"

#include <Espalier/Inference/Inference.h>
#include <Espalier/Inference/RuleEdits.h>
#include <Espalier/Plant/Skeleton.h>
#include <Espalier/Species/Grow.h>

using namespace espalier;

namespace {

/// Of two forks and three shoots.
Species inferred()
{
    Archetype archetype;
    archetype.libraryName = "x.templates";
    archetype.library = parseTemplates("fork: F[-FX]+FY\nshoot: F(0.5)FX\n", "x.templates", {}).value();
    archetype.instances = {{0, kNoInstance, 0, {1, 0, 45, 0}},
                           {0, 0, 0, {1, 10, 45, 0}},
                           {1, 0, 1, {1, 0, 45, 90}},
                           {1, 1, 0, {0.5, 0, 45, 0}},
                           {1, 1, 1, {0.5, 0, 45, 0}}};
    return inferSpecies({&archetype, 1}, {.mergeWeight = 0.5, .ruleWeight = 1.0}).value();
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    const auto species = parseSpecies(fuzzing::textOf(data, size), "fuzz.species");
    if (!species)
        return 0;
    const auto again = parseSpecies(printSpecies(*species), "printed.species");
    fuzzing::promiseValue(again, "a printed species reads back");
    fuzzing::promise(*again == *species, "a printed species reads back the same");

    const auto grower = Grower::make(*species);
    fuzzing::promiseValue(grower, "what the reader accepts can be made ready");
    GrowOptions options;
    options.budget = {.productions = 500, .depth = 40, .modules = 5000};
    options.limits.nodes = 5000;
    GrowScratch scratch;
    Skeleton skeleton;
    Skeleton twin;
    const bool grown = grower->grow(Seed{1}, options, scratch, skeleton).has_value();
    fuzzing::promise(grown || skeleton.empty(), "a failed growth leaves no skeleton");
    fuzzing::promise(isSound(skeleton), "a grown skeleton is sound");
    fuzzing::promise(grower->grow(Seed{1}, options, scratch, twin).has_value() == grown &&
                         hashOf(twin) == hashOf(skeleton),
                     "the same seed grows the same tree");

    static const Species kInferred = inferred();
    Species anew = kInferred;
    options.attempt = 0;
    const CarriedEdits carried = carryEdits(*species, anew, options);
    fuzzing::promise(anew.conflicts.size() >= carried.conflicts.size(), "new conflicts are kept");
    const auto merged = parseSpecies(printSpecies(anew), "merged.species");
    fuzzing::promiseValue(merged, "a merged species reads back");
    fuzzing::promise(*merged == anew, "a merged species reads back the same");
    return 0;
}
