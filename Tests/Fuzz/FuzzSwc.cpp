// Reads `.swc` files. What is read is sound, prints to a text that reads back the same, and if it is small it can be
// fitted within the tolerance that the report tells.

#include "Fuzzing.h"

#include <Espalier/Archetype/Archetype.h>
#include <Espalier/Bake/Swc.h>
#include <Espalier/Inference/Fit.h>
#include <algorithm>

using namespace espalier;

namespace {

void fitSmall(const Skeleton& skeleton)
{
    const auto fitted = fitArchetype(skeleton);
    if (!fitted)
        return; // nothing with a length, or reaching too far
    fuzzing::promiseValue(validate(fitted->archetype), "a fitted archetype is valid");
    const auto library = parseTemplates(printTemplates(fitted->archetype.library), "fuzz.templates", {});
    fuzzing::promiseValue(library, "fitted templates read back");
    const auto again = parseArchetype(printArchetype(fitted->archetype), "fuzz.archetype", *library, authoringLimits());
    fuzzing::promiseValue(again, "a fitted archetype reads back");
    fuzzing::promise(*again == fitted->archetype, "a fitted archetype reads back the same");
    const FitReport& report = fitted->report;
    fuzzing::promise(report.largestDistance <= std::max(report.tolerance, 1e-5 * report.size),
                     "a fit keeps its tolerance");
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    const auto plant = parseSwc(fuzzing::textOf(data, size), "fuzz.swc");
    if (!plant)
        return 0;
    const Skeleton& skeleton = plant->skeleton;
    fuzzing::promise(isSound(skeleton), "what the reader accepts is sound");
    const auto again = parseSwc(printSwc(skeleton, "fuzz"), "printed.swc");
    if (skeleton.empty())
        return 0;
    fuzzing::promiseValue(again, "a printed skeleton reads back");
    // Next to nothing may round to the root's place: then a later root is the first that something grows from.
    const bool isMoved = skeleton.starts[0] != Vec3(0);
    fuzzing::promise(isMoved ||
                         (again->skeleton.starts == skeleton.starts && again->skeleton.ends == skeleton.ends &&
                          again->skeleton.startRadii == skeleton.startRadii &&
                          again->skeleton.endRadii == skeleton.endRadii && again->skeleton.parents == skeleton.parents),
                     "a printed skeleton reads back the same");
    constexpr std::uint32_t kSmall = 2000;
    if (skeleton.size() <= kSmall)
        fitSmall(skeleton);
    return 0;
}
