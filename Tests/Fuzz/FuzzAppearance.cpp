// Reads `.appearance` files, which people exchange. What is read prints to a text that reads back the same.

#include "Fuzzing.h"

#include <Espalier/Species/AppearanceFile.h>

using namespace espalier;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    const auto appearance = parseAppearance(fuzzing::textOf(data, size), "fuzz.appearance");
    if (!appearance)
        return 0;
    const auto again = parseAppearance(printAppearance(*appearance), "printed.appearance");
    fuzzing::promiseValue(again, "a printed appearance reads back");
    fuzzing::promise(*again == *appearance, "a printed appearance reads back the same");
    return 0;
}
