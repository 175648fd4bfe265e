#pragma once

#include <cstring>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace espalier::simd {

// Two doubles and four floats that one register holds, in the vector types of GCC and clang: SSE2, NEON and WebAssembly
// alike, and + - * of each element rounds as that of a single number does.

using Two = double __attribute__((vector_size(16)));
using Four = float __attribute__((vector_size(16)));
using FourInts = int __attribute__((vector_size(16)));

/// Rounded to the nearest, as static_cast<float> does.
inline Four toFloats(Two low, Two high) noexcept
{
#if defined(__SSE2__)
    return (Four)_mm_movelh_ps(_mm_cvtpd_ps((__m128d)low), _mm_cvtpd_ps((__m128d)high));
#else
    return Four{static_cast<float>(low[0]), static_cast<float>(low[1]), static_cast<float>(high[0]),
                static_cast<float>(high[1])};
#endif
}

/// True if an element has its sign bit set.
inline bool anySign(FourInts mask) noexcept
{
#if defined(__SSE2__)
    return _mm_movemask_ps((__m128)mask) != 0;
#else
    return (mask[0] | mask[1] | mask[2] | mask[3]) < 0;
#endif
}

/// Element kElement, four times.
template <int kElement>
Four splat(Four value) noexcept
{
    return __builtin_shufflevector(value, value, kElement, kElement, kElement, kElement);
}

/// The first three elements of `value`, whose last must be 0, and the last of `last`.
inline Four withLast(Four value, Four last) noexcept
{
    constexpr FourInts kLast = {0, 0, 0, -1};
    return (Four)((FourInts)value | ((FourInts)last & kLast));
}

/// Four times one number.
inline Four all(float value) noexcept
{
    return Four{value, value, value, value};
}

/// Where `memory` need not be aligned.
inline Four load(const void* memory) noexcept
{
    Four value;
    std::memcpy(&value, memory, sizeof(value));
    return value;
}
inline void store(void* memory, Four value) noexcept
{
    std::memcpy(memory, &value, sizeof(value));
}
/// The first three elements.
inline void storeThree(void* memory, Four value) noexcept
{
    std::memcpy(memory, &value, 3 * sizeof(float));
}

} // namespace espalier::simd
