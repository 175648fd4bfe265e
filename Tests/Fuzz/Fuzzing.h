#pragma once

#include <Espalier/Core/Error.h>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

// What the fuzz targets share. Each reads arbitrary bytes as one kind of file: every answer but a crash, a sanitizer's
// report or a broken promise is good.
namespace espalier::fuzzing {

/// Stops the fuzzer, which then keeps the input, unless `kept`.
inline void promise(bool kept, std::string_view what)
{
    if (kept)
        return;
    std::fprintf(stderr, "broken promise: %.*s\n", static_cast<int>(what.size()), what.data());
    std::abort();
}

/// The same for a result, whose error is shown.
template <class T>
void promiseValue(const Expected<T>& result, std::string_view what)
{
    if (!result)
        promise(false, std::string(what) + ": " + toString(result.error()));
}

inline std::string textOf(const std::uint8_t* data, std::size_t size)
{
    return {data, data + size};
}

} // namespace espalier::fuzzing
