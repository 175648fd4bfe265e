// Reads pictures of artists. What is read has as many texels as its size says, and writing it gives the same back.

#include "Fuzzing.h"

#include <Espalier/Texture/Image.h>

using namespace espalier;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    constexpr std::uint32_t kMostSide = 1024;
    const auto image = decodePng(fuzzing::textOf(data, size), 4, kMostSide, "fuzz.png");
    if (!image)
        return 0;
    fuzzing::promise(image->width <= kMostSide && image->height <= kMostSide, "a picture keeps to the limit");
    fuzzing::promise(image->texels.size() == std::size_t{4} * image->width * image->height, "no texel is missing");
    const auto again = decodePng(encodePng(*image), 4, kMostSide, "again.png");
    fuzzing::promiseValue(again, "a picture reads back");
    fuzzing::promise(*again == *image, "a picture reads back the same");
    return 0;
}
