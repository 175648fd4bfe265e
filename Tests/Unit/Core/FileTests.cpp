#include <Espalier/Core/File.h>
#include <Espalier/Core/Utf8.h>
#include <csignal>
#include <fstream>
#include <gtest/gtest.h>
#include <iterator>
#include <thread>

#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

namespace espalier {

namespace {

namespace fs = std::filesystem;

class File : public testing::Test
{
protected:
    File()
    {
        std::string pattern = (fs::temp_directory_path() / "espalier-file-XXXXXX").string();
        folder_ = ::mkdtemp(pattern.data());
    }
    ~File() override { fs::remove_all(folder_); }

    fs::path at(const char* name) const { return folder_ / name; }
    void put(const char* name, std::string_view bytes) const
    {
        std::ofstream(at(name), std::ios::binary).write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    }
    std::string get(const char* name) const
    {
        std::ifstream in(at(name), std::ios::binary);
        return {std::istreambuf_iterator<char>(in), {}};
    }
    std::size_t entries() const
    {
        return static_cast<std::size_t>(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()));
    }

private:
    fs::path folder_;
};

TEST_F(File, ReadsWhatIsThere)
{
    const std::string binary("a\0b\xff\r\n", 6);
    for (const std::string& bytes : {std::string(), binary, std::string(100000, 'x')})
    {
        put("f", bytes);
        const auto read = readFile(at("f"), bytes.size());
        ASSERT_TRUE(read) << toString(read.error());
        EXPECT_EQ(*read, bytes);
    }
}

TEST_F(File, RefusesAFileAboveTheLimitWithoutReadingIt)
{
    put("f", "12345");
    const auto read = readFile(at("f"), 4);
    ASSERT_FALSE(read);
    EXPECT_EQ(read.error().kind, ErrorKind::Limit);
    EXPECT_EQ(toString(read.error()),
              at("f").string() + ":1:1: the file has 5 bytes; expected at most 4 (limit fileBytes)");

    put("huge", "");
    fs::resize_file(at("huge"), std::uintmax_t{1} << 40); // Sparse: no machine could read it.
    const auto huge = readFile(at("huge"), std::size_t{16} << 20);
    ASSERT_FALSE(huge);
    EXPECT_EQ(huge.error().kind, ErrorKind::Limit);
}

TEST_F(File, RefusesWhatIsNotARegularFile)
{
    ASSERT_EQ(::mkfifo(at("pipe").c_str(), 0600), 0);
    struct Case
    {
        fs::path path;
        const char* says;
    };
    const Case cases[] = {
        {at("missing"), "No such file or directory"},
        {at("."), "this is a folder"},
        {at("pipe"), "this is a pipe"},
        {"/dev/zero", "device"},
        {"", "No such file or directory"},
    };
    for (const Case& c : cases)
    {
        const auto read = readFile(c.path, 1000);
        ASSERT_FALSE(read) << c.path;
        EXPECT_EQ(read.error().kind, ErrorKind::Io);
        EXPECT_EQ(read.error().where.file, c.path.string());
        EXPECT_NE(toString(read.error()).find(c.says), std::string::npos) << toString(read.error());
    }
}

TEST_F(File, ReadsFilesThatHideTheirSize)
{
    if (!fs::exists("/proc/self/status"))
        GTEST_SKIP();
    const auto read = readFile("/proc/self/status", 1u << 20);
    ASSERT_TRUE(read);
    EXPECT_FALSE(read->empty());
    const auto limited = readFile("/proc/self/status", 10);
    ASSERT_FALSE(limited);
    EXPECT_EQ(limited.error().kind, ErrorKind::Limit);
}

TEST_F(File, DropsOneByteOrderMarkFromText)
{
    put("f", "\xef\xbb\xbfh\xc3\xa4");
    EXPECT_EQ(readTextFile(at("f"), 100).value(), "h\xc3\xa4");
    put("f", "\xef\xbb\xbf");
    EXPECT_EQ(readTextFile(at("f"), 100).value(), "");
    put("f", "");
    EXPECT_EQ(readTextFile(at("f"), 100).value(), "");
}

TEST_F(File, SaysWhereTextIsNotUtf8)
{
    put("f", "\xef\xbb\xbfone\r\nt\xc3\xa4\xff");
    const auto text = readTextFile(at("f"), 100);
    ASSERT_FALSE(text);
    EXPECT_EQ(text.error().kind, ErrorKind::BadInput);
    EXPECT_EQ(toString(text.error()), at("f").string() + ":2:3: the byte 0xff is not valid here; expected UTF-8 text; "
                                                         "save the file as UTF-8");
}

TEST_F(File, WritesANewFileWithTheUsualPermissions)
{
    const mode_t mask = ::umask(027);
    const auto written = writeFileAtomically(at("f"), std::string_view("a\0b", 3));
    ::umask(mask);
    ASSERT_TRUE(written) << toString(written.error());
    EXPECT_EQ(get("f"), std::string("a\0b", 3));
    EXPECT_EQ(fs::status(at("f")).permissions(), fs::perms(0640));
    EXPECT_EQ(entries(), 1u);
}

TEST_F(File, ReplacesAFileAndKeepsItsPermissions)
{
    put("f", "a longer old content");
    fs::permissions(at("f"), fs::perms(0604));
    ASSERT_TRUE(writeFileAtomically(at("f"), "new"));
    EXPECT_EQ(get("f"), "new");
    EXPECT_EQ(fs::status(at("f")).permissions(), fs::perms(0604));
    ASSERT_TRUE(writeFileAtomically(at("f"), ""));
    EXPECT_EQ(get("f"), "");
    EXPECT_EQ(entries(), 1u);
}

TEST_F(File, WritesThroughASymbolicLink)
{
    put("f", "old");
    fs::create_symlink("f", at("link"));
    ASSERT_TRUE(writeFileAtomically(at("link"), "new"));
    EXPECT_EQ(get("f"), "new");
    EXPECT_TRUE(fs::is_symlink(at("link")));
}

TEST_F(File, WritesAFileWithTheLongestName)
{
    const std::string name(255, 'n');
    EXPECT_TRUE(writeFileAtomically(at(name.c_str()), "new"));
    EXPECT_EQ(get(name.c_str()), "new");
}

TEST_F(File, WritesInTheWorkingFolder)
{
    const fs::path before = fs::current_path();
    fs::current_path(at("."));
    const auto written = writeFileAtomically("f", "new");
    fs::current_path(before);
    EXPECT_TRUE(written);
    EXPECT_EQ(get("f"), "new");
}

TEST_F(File, RefusesToWriteWhereNoFileCanBe)
{
    fs::create_directory(at("folder"));
    fs::create_symlink("nowhere/f", at("dangling"));
    put("f", "old");
    struct Case
    {
        fs::path path;
        const char* says;
    };
    const Case cases[] = {
        {at("folder"), "this is a folder"},
        {at("missing/f"), "does not exist; make the folder first"},
        {at("f/g"), "Not a directory"},
        {at("dangling"), "No such file or directory"},
        {"/dev/null", "device"},
        {"", "No such file or directory"},
    };
    for (const Case& c : cases)
    {
        const auto written = writeFileAtomically(c.path, "new");
        ASSERT_FALSE(written) << c.path;
        EXPECT_EQ(written.error().kind, ErrorKind::Io);
        EXPECT_EQ(written.error().where.file, c.path.string());
        EXPECT_NE(toString(written.error()).find(c.says), std::string::npos) << toString(written.error());
    }
    EXPECT_EQ(entries(), 3u);
    EXPECT_EQ(get("f"), "old");
}

TEST_F(File, LeavesTheOldFileWhenTheDiskIsFull)
{
    put("f", "old");
    rlimit before{};
    ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
    const auto handler = std::signal(SIGXFSZ, SIG_IGN);
    const rlimit small{4096, before.rlim_max};
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
    const auto written = writeFileAtomically(at("f"), std::string(100000, 'x'));
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
    std::signal(SIGXFSZ, handler);

    ASSERT_FALSE(written);
    EXPECT_EQ(toString(written.error()),
              at("f").string() + ": the file cannot be written: File too large; the old file is intact");
    EXPECT_EQ(get("f"), "old");
    EXPECT_EQ(entries(), 1u) << "the temporary file must go";
}

TEST_F(File, ReadersSeeOldOrNewNeverAMixture)
{
    const std::string versions[] = {std::string(50000, 'a'), std::string(70000, 'b')};
    put("f", versions[0]);
    std::thread writer([&] {
        for (int i = 0; i < 40; ++i)
            ASSERT_TRUE(writeFileAtomically(at("f"), versions[i % 2]));
    });
    for (int i = 0; i < 200; ++i)
    {
        const auto read = readFile(at("f"), 1u << 20);
        EXPECT_TRUE(read && (*read == versions[0] || *read == versions[1]));
    }
    writer.join();
}

TEST(Utf8, FindsTheFirstInvalidSequence)
{
    struct Case
    {
        std::string text;
        std::size_t at;
    };
    constexpr std::size_t kValid = std::string::npos;
    const Case cases[] = {
        {"", kValid},
        {std::string("a\0\x7f", 3), kValid},
        {"\xc2\x80\xdf\xbf", kValid},                 // U+0080, U+07FF
        {"\xe0\xa0\x80\xef\xbf\xbf", kValid},         // U+0800, U+FFFF
        {"\xed\x9f\xbf\xee\x80\x80", kValid},         // around the surrogates
        {"\xf0\x90\x80\x80\xf4\x8f\xbf\xbf", kValid}, // U+10000, U+10FFFF
        {"a\x80", 1},                                 // a continuation alone
        {"ab\xc3", 2},                                // the end inside a sequence
        {"\xe2\x82", 0},
        {"\xf0\x9f\x8c", 0},
        {"\xc3(", 0},
        {"\xe2\x82(", 0},
        {"\xc0\xaf", 0}, // overlong
        {"\xc1\xbf", 0},
        {"\xe0\x9f\xbf", 0},
        {"\xf0\x8f\xbf\xbf", 0},
        {"x\xed\xa0\x80", 1},    // a surrogate
        {"\xf4\x90\x80\x80", 0}, // beyond U+10FFFF
        {"\xf5\x80\x80\x80", 0},
        {"\xff", 0},
    };
    for (const Case& c : cases)
        EXPECT_EQ(findInvalidUtf8(c.text), c.at) << testing::PrintToString(c.text);
}

// Every code point, encoded the long way round, against what the standard says is one.
TEST(Utf8, AcceptsExactlyTheScalarValues)
{
    for (std::uint32_t c = 0x80; c < 0x120000; ++c)
    {
        const auto continuation = [c](int shift) { return static_cast<char>(0x80 | ((c >> shift) & 0x3f)); };
        std::string text;
        if (c < 0x800)
            text = {static_cast<char>(0xc0 | (c >> 6)), continuation(0)};
        else if (c < 0x10000)
            text = {static_cast<char>(0xe0 | (c >> 12)), continuation(6), continuation(0)};
        else
            text = {static_cast<char>(0xf0 | (c >> 18)), continuation(12), continuation(6), continuation(0)};
        const bool isScalar = c < 0xd800 || (c > 0xdfff && c < 0x110000);
        ASSERT_EQ(findInvalidUtf8(text) == std::string::npos, isScalar) << std::hex << c;
    }
}

} // namespace

TEST_F(File, WritesWhatComesInPieces)
{
    const auto produce = [](const ByteSink& sink) -> Expected<void> {
        for (const std::string_view piece : {"one ", "", "two ", "three"})
            if (auto written = sink(piece); !written)
                return written;
        return {};
    };
    ASSERT_TRUE(writeFileAtomically(at("f"), produce));
    EXPECT_EQ(get("f"), "one two three");
    EXPECT_EQ(entries(), 1u);
}

TEST_F(File, KeepsTheOldFileWhenThePiecesFail)
{
    put("f", "old");
    const auto produce = [](const ByteSink& sink) -> Expected<void> {
        if (auto written = sink("half"); !written)
            return written;
        return failure(ErrorKind::BadInput, {}, "no more");
    };
    const auto written = writeFileAtomically(at("f"), produce);
    ASSERT_FALSE(written);
    EXPECT_EQ(written.error().what, "no more");
    EXPECT_EQ(get("f"), "old");
    EXPECT_EQ(entries(), 1u) << "nothing half-written stays behind";
}

} // namespace espalier
