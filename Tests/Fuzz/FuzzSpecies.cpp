// Reads `.species` files, which are mod content. What is read prints to a text that reads back the same, and grows
// within its budget.

#include "Fuzzing.h"

#include <Espalier/Plant/Skeleton.h>
#include <Espalier/Species/Grow.h>

using namespace espalier;

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
    return 0;
}
