#include <Espalier/Core/Error.h>
#include <gtest/gtest.h>

namespace espalier {

namespace {

TEST(Error, LeavesOutWhatIsEmpty)
{
    struct Case
    {
        Error error;
        const char* text;
    };
    const Case cases[] = {
        {{ErrorKind::BadInput, "what", {}, {}, {}}, "what"},
        {{ErrorKind::Io, "what", {}, {}, {"a.txt", 0, 0}}, "a.txt: what"},
        {{ErrorKind::BadInput, "what", {}, {}, {"", 2, 3}}, "2:3: what"},
        {{ErrorKind::BadInput, "what", "that", {}, {"a.txt", 2, 3}}, "a.txt:2:3: what; expected that"},
        {{ErrorKind::Limit, "what", {}, "do this", {"a.txt", 2, 3}}, "a.txt:2:3: what; do this"},
        {{ErrorKind::BadInput, "what", "that", "do this", {"a.txt", 2, 3}}, "a.txt:2:3: what; expected that; do this"},
    };
    for (const Case& c : cases)
        EXPECT_EQ(toString(c.error), c.text);
}

TEST(Error, TravelsAsAnUnexpectedValue)
{
    const Expected<int> result = failure(ErrorKind::Limit, {"f", 1, 2}, "what", "that", "do this");
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().kind, ErrorKind::Limit);
    EXPECT_EQ(toString(result.error()), "f:1:2: what; expected that; do this");
}

TEST(Locate, CountsLinesAndCodePointsFromOne)
{
    struct Case
    {
        const char* text;
        std::size_t offset;
        std::uint32_t line;
        std::uint32_t column;
    };
    const Case cases[] = {
        {"", 0, 1, 1},
        {"", 7, 1, 1},
        {"abc", 0, 1, 1},
        {"abc", 2, 1, 3},
        {"abc", 3, 1, 4},
        {"abc", 99, 1, 4},
        {"ab\ncd", 2, 1, 3}, // the line end belongs to its line
        {"ab\ncd", 3, 2, 1},
        {"ab\n", 3, 2, 1},
        {"ab\r\ncd", 2, 1, 3}, // CR LF is one line end
        {"ab\r\ncd", 3, 1, 3},
        {"ab\r\ncd", 4, 2, 1},
        {"ab\rcd", 3, 1, 4}, // a lone CR is none
        {"\n\n\n", 2, 3, 1},
        {"x\xc3\xa4y", 3, 1, 3}, // ä is one column
        {"x\xc3\xa4y", 2, 1, 2}, // inside ä
        {"\xf0\x9f\x8c\xb3!", 4, 1, 2},
        {"\x80\x80", 1, 1, 1}, // not UTF-8: anything sensible
    };
    for (const Case& c : cases)
    {
        const Location location = locate("f", c.text, c.offset);
        EXPECT_EQ(location.line, c.line) << c.text << " @ " << c.offset;
        EXPECT_EQ(location.column, c.column) << c.text << " @ " << c.offset;
        EXPECT_EQ(location.file, "f");
    }
}

} // namespace

} // namespace espalier
