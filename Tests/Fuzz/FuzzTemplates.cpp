// Reads `.templates` files. What is read prints to a text that reads back the same.

#include "Fuzzing.h"

#include <Espalier/Archetype/Template.h>

using namespace espalier;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    const auto library = parseTemplates(fuzzing::textOf(data, size), "fuzz.templates", {});
    if (!library)
        return 0;
    const auto again = parseTemplates(printTemplates(*library), "printed.templates", {});
    fuzzing::promiseValue(again, "a printed library reads back");
    fuzzing::promise(*again == *library, "a printed library reads back the same");
    return 0;
}
