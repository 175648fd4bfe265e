#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <tl/expected.hpp>

namespace espalier {

/// What kind of trouble an Error is; tools choose their exit code by it.
enum class ErrorKind : std::uint8_t
{
    BadInput,  ///< A file, or data given to a function, says something that cannot be.
    Limit,     ///< A limit of `Limits` would be exceeded; nothing was allocated beyond it.
    Io,        ///< The operating system refused: missing file, full disk, no permission.
    Cancelled, ///< The caller asked to stop. Nothing was published.
};

/// A place in a text. Lines and columns count from 1, columns in code points; 0 means "the whole file".
struct Location
{
    std::string file;
    std::uint32_t line = 0;
    std::uint32_t column = 0;
};

/// Why something did not work, in four sentences a designer can act on.
struct Error
{
    ErrorKind kind = ErrorKind::BadInput;
    std::string what;     ///< What is wrong, with the offending value. Never empty.
    std::string expected; ///< What would have been right; may be empty.
    std::string advice;   ///< What to do about it; may be empty.
    Location where;       ///< Where it stands; the file may be empty for data made in memory.
};

template <class T>
using Expected = tl::expected<T, Error>;

/// `file:line:column: what; expected ...; advice`, leaving out the parts that are empty. No line break at the end.
[[nodiscard]] std::string toString(const Error& error);

/// The usual way to fail: `return failure(ErrorKind::BadInput, where, "what", "what was expected");`
[[nodiscard]] tl::unexpected<Error> failure(ErrorKind kind, Location where, std::string what, std::string expected = {},
                                            std::string advice = {});

/// The location of byte `offset` of `text`: lines end at LF, columns count code points.
/// Offsets beyond the end give the end.
[[nodiscard]] Location locate(std::string_view file, std::string_view text, std::size_t offset);

} // namespace espalier
