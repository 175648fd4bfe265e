#include <Espalier/Core/Error.h>

#include <algorithm>

namespace espalier {

namespace {

bool continuesCodePoint(char c)
{
    return (static_cast<unsigned char>(c) & 0xc0u) == 0x80u;
}

} // namespace

std::string toString(const Error& error)
{
    std::string text = error.where.file;
    if (error.where.line > 0)
    {
        if (!text.empty())
            text += ':';
        text += std::to_string(error.where.line) + ':' + std::to_string(error.where.column);
    }
    if (!text.empty())
        text += ": ";
    text += error.what;
    if (!error.expected.empty())
        text += "; expected " + error.expected;
    if (!error.advice.empty())
        text += "; " + error.advice;
    return text;
}

tl::unexpected<Error> failure(ErrorKind kind, Location where, std::string what, std::string expected,
                              std::string advice)
{
    return tl::unexpected<Error>(
        Error{kind, std::move(what), std::move(expected), std::move(advice), std::move(where)});
}

Location locate(std::string_view file, std::string_view text, std::size_t offset)
{
    offset = std::min(offset, text.size());
    if (offset < text.size())
    {
        if (text[offset] == '\n' && offset > 0 && text[offset - 1] == '\r')
            --offset; // CR LF is one line end.
        while (offset > 0 && continuesCodePoint(text[offset]))
            --offset;
    }
    const std::string_view before = text.substr(0, offset);
    const std::size_t lastLineEnd = before.rfind('\n');
    const std::string_view line = lastLineEnd == std::string_view::npos ? before : before.substr(lastLineEnd + 1);
    const auto lineEnds = std::count(before.begin(), before.end(), '\n');
    const auto codePoints = std::count_if(line.begin(), line.end(), [](char c) { return !continuesCodePoint(c); });
    return {std::string(file), static_cast<std::uint32_t>(lineEnds + 1), static_cast<std::uint32_t>(codePoints + 1)};
}

} // namespace espalier
