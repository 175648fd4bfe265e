#pragma once

#include <bit>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

namespace espalier {

/// A 64-bit hash of bytes for golden files, provenance and benchmarks: FNV-1a. The same on every machine (values are
/// fed least significant byte first). Not for hostile keys.
class Hash64
{
public:
    constexpr void bytes(std::string_view text) noexcept
    {
        for (const char c : text)
            byte(static_cast<unsigned char>(c));
    }

    template <class T>
    requires(std::is_arithmetic_v<T> || std::is_enum_v<T>) constexpr void value(T v) noexcept
    {
        if constexpr (std::is_same_v<T, float>)
            word(std::bit_cast<std::uint32_t>(v), 4);
        else if constexpr (std::is_same_v<T, double>)
            word(std::bit_cast<std::uint64_t>(v), 8);
        else
            word(static_cast<std::uint64_t>(v), sizeof(T));
    }

    template <class T>
    constexpr void values(std::span<const T> all) noexcept
    {
        for (const T& v : all)
            value(v);
    }

    [[nodiscard]] constexpr std::uint64_t result() const noexcept { return state_; }

private:
    constexpr void byte(std::uint64_t b) noexcept { state_ = (state_ ^ b) * 0x100000001b3u; }
    constexpr void word(std::uint64_t w, std::size_t size) noexcept
    {
        for (std::size_t i = 0; i < size; ++i, w >>= 8)
            byte(w & 0xff);
    }

    std::uint64_t state_ = 0xcbf29ce484222325u;
};

/// 16 lower-case hexadecimal digits.
[[nodiscard]] inline std::string hexDigits(std::uint64_t value)
{
    std::string digits(16, '0');
    for (std::size_t i = digits.size(); i-- > 0; value >>= 4)
        digits[i] = "0123456789abcdef"[value & 15];
    return digits;
}

} // namespace espalier
