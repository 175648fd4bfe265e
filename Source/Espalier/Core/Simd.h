#pragma once

#include <Espalier/Core/Vector.h>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

#if defined(__SSE2__)
#include <emmintrin.h>
#endif

namespace espalier::simd {

// Two doubles and four floats that one register holds, in the vector types of GCC and clang: SSE2, NEON and WebAssembly
// alike, and + - * of each element rounds as that of a single number does.

using Two = double __attribute__((vector_size(16)));
using Four = float __attribute__((vector_size(16)));
using FourInts = int __attribute__((vector_size(16)));
using FourCounts = unsigned int __attribute__((vector_size(16)));

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

/// `value` with 0 as its last element.
inline Four firstThree(Four value) noexcept
{
    constexpr FourInts kFirst = {-1, -1, -1, 0};
    return (Four)((FourInts)value & kFirst);
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
inline void store(void* memory, FourInts value) noexcept
{
    std::memcpy(memory, &value, sizeof(value));
}
inline void store(void* memory, FourCounts value) noexcept
{
    std::memcpy(memory, &value, sizeof(value));
}
/// The first three elements.
inline void storeThree(void* memory, Four value) noexcept
{
#if defined(__SSE2__)
    auto* const numbers = static_cast<float*>(memory);
    _mm_storel_pi(reinterpret_cast<__m64*>(numbers), (__m128)value);
    _mm_store_ss(numbers + 2, _mm_movehl_ps((__m128)value, (__m128)value));
#else
    std::memcpy(memory, &value, 3 * sizeof(float)); // GCC goes by way of the stack
#endif
}

// Vectors of three numbers in one register, the fourth element 0. What is called like a function of GLM or of Mesh
// gives the same bits as that one does: sums go from x to z.

/// Reads no more than the three.
inline Four three(const Vec3& v) noexcept
{
#if defined(__SSE2__)
    // Eight bytes and four: as they are stored, so that what was just written need not reach the cache first.
    const __m128 low = _mm_castsi128_ps(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(&v.x)));
    return (Four)_mm_movelh_ps(low, _mm_load_ss(&v.z));
#else
    return Four{v.x, v.y, v.z, 0};
#endif
}

inline Vec3 vec3(Four v) noexcept
{
    Vec3 stored;
    storeThree(&stored, v);
    return stored;
}

inline float dot(Four a, Four b) noexcept
{
    const Four product = a * b;
    return product[0] + product[1] + product[2];
}

inline float length(Four v) noexcept
{
    return std::sqrt(dot(v, v));
}

inline Four cross(Four a, Four b) noexcept
{
    const Four aOn = __builtin_shufflevector(a, a, 1, 2, 0, 3);
    const Four bOn = __builtin_shufflevector(b, b, 1, 2, 0, 3);
    const Four aBack = __builtin_shufflevector(a, a, 2, 0, 1, 3);
    const Four bBack = __builtin_shufflevector(b, b, 2, 0, 1, 3);
    return aOn * bBack - bOn * aBack;
}

inline Four mix(Four a, Four b, float share) noexcept
{
    return a * all(1 - share) + b * all(share);
}

/// The unit vector along `v`, or `otherwise` where `v` has no direction.
inline Four directionOr(Four v, Four otherwise) noexcept
{
    // Scaled first: the square of a short vector would underflow.
    const Four size = (Four)((FourInts)v & 0x7fffffff);
    const float largest = std::max(std::max(size[0], size[1]), size[2]);
    if (!(largest > 0 && largest <= std::numeric_limits<float>::max()))
        return otherwise;
    const Four scaled = v / all(largest);
    return scaled / all(std::sqrt(dot(scaled, scaled)));
}

} // namespace espalier::simd
