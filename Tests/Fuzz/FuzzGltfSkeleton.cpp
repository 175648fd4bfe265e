// Reads the bones of `.gltf` and `.glb` files. What is read is sound, and reading it again gives the same.

#include "Fuzzing.h"

#include <Espalier/Bake/GltfSkeleton.h>

using namespace espalier;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    const auto plant = parseGltfSkeleton(fuzzing::textOf(data, size), "fuzz.gltf");
    if (!plant)
        return 0;
    fuzzing::promise(isSound(plant->skeleton), "what the reader accepts is sound");
    fuzzing::promise(plant->skeleton.size() <= plant->points, "no more segments than joints");
    const auto again = parseGltfSkeleton(fuzzing::textOf(data, size), "fuzz.gltf");
    fuzzing::promise(again && hashOf(again->skeleton) == hashOf(plant->skeleton), "equal bytes give equal skeletons");
    return 0;
}
