// Reads `.archetype` files over a fixed library. What is read prints to a text that reads back the same, can be drawn,
// and if it is small its rules can be inferred.

#include "Fuzzing.h"

#include <Espalier/Archetype/Placement.h>
#include <Espalier/Inference/Inference.h>

using namespace espalier;

namespace {

const TemplateLibrary& library()
{
    // The thesis' templates first, so that what ships is a seed; then one that draws nothing, one of other commands and
    // a loner.
    static const TemplateLibrary kLibrary =
        parseTemplates("FX\nF-FX\nF+FX\nF[-FX]+FY\nF[-FX]FY\nF[FX]+FY\nF[-FX][FY]+FZ\nF[+FX]F[-FY]FZ\n"
                       "empty: XY\nmixed: -(30)F(0.5)[&f(2)X]/(120)$!(0.1)G|Y'(3)@\nbud: F\n",
                       "library", {})
            .value();
    return kLibrary;
}

void inferFrom(const Archetype& archetype, const std::string& preset)
{
    InferenceOptions options;
    options.preset = preset;
    options.mergeWeight = 0.5;
    options.ruleWeight = 0.5;
    const auto species = inferSpecies({&archetype, 1}, options);
    if (!species)
    {
        fuzzing::promise(species.error().kind == ErrorKind::Limit,
                         "a valid archetype has rules: " + toString(species.error()));
        return;
    }
    const auto again = parseSpecies(printSpecies(*species), "printed.species");
    fuzzing::promiseValue(again, "an inferred species reads back");
    fuzzing::promise(*again == *species, "an inferred species reads back the same");
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    const auto archetype = parseArchetype(fuzzing::textOf(data, size), "fuzz.archetype", library(), {});
    if (!archetype)
        return 0;
    fuzzing::promiseValue(validate(*archetype), "what the reader accepts is valid");
    const auto again = parseArchetype(printArchetype(*archetype), "printed.archetype", library(), {});
    fuzzing::promiseValue(again, "a printed archetype reads back");
    fuzzing::promise(*again == *archetype, "a printed archetype reads back the same");

    for (std::size_t tree = 0; tree < anchorsOf(*archetype).roots.size(); ++tree)
        if (const auto skeleton = drawArchetype(*archetype, tree); skeleton)
            fuzzing::promise(skeleton->size() <= Limits{}.nodes, "a drawing keeps the limits");
    constexpr std::size_t kSmall = 24; // larger ones take longer than a fuzzer should
    if (archetype->instances.size() <= kSmall)
        for (const std::string_view preset : inferencePresets())
            inferFrom(*archetype, std::string(preset));
    return 0;
}
