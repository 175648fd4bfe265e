#pragma once

#include <string>
#include <string_view>

namespace espalier {

/// Byte offset of the first invalid UTF-8 sequence (overlong forms and surrogates are invalid), or npos.
[[nodiscard]] std::size_t findInvalidUtf8(std::string_view text) noexcept;

/// The code points of valid UTF-8, and back.
[[nodiscard]] std::u32string fromUtf8(std::string_view text);
[[nodiscard]] std::string toUtf8(std::u32string_view text);

} // namespace espalier
