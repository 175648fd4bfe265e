#include <Espalier/Archetype/Template.h>
#include <Espalier/Core/File.h>
#include <Espalier/Core/Random.h>
#include <chrono>
#include <filesystem>
#include <gtest/gtest.h>
#include <set>
#include <unistd.h>

namespace espalier {
namespace {

TemplateLibrary parsed(std::string_view text, const Limits& limits = {})
{
    auto library = parseTemplates(text, "t.templates", limits);
    EXPECT_TRUE(library) << text << "\n" << (library ? "" : toString(library.error()));
    return library ? std::move(*library) : TemplateLibrary{};
}

TEST(RomanNumerals, CountAsTheRomansDid)
{
    const std::pair<std::uint32_t, const char*> known[] = {
        {1, "I"},    {2, "II"},       {3, "III"},        {4, "IV"},         {5, "V"},     {6, "VI"},
        {8, "VIII"}, {9, "IX"},       {14, "XIV"},       {40, "XL"},        {49, "XLIX"}, {90, "XC"},
        {400, "CD"}, {944, "CMXLIV"}, {1999, "MCMXCIX"}, {4096, "MMMMXCVI"}};
    for (const auto& [number, numeral] : known)
        EXPECT_EQ(romanNumeral(number), numeral);
    std::set<std::string> all;
    for (std::uint32_t i = 1; i < 5000; ++i)
        EXPECT_TRUE(all.insert(romanNumeral(i)).second) << i;
}

TEST(Templates, BareWordsAreNumberedAndNamedOnesNamed)
{
    const TemplateLibrary library = parsed("% a comment\nFX\n\n  trunk: F[-FX]+FY % another\nF+FX\n");
    ASSERT_EQ(library.templates.size(), 3u);
    EXPECT_EQ(library.templates[0].name, "I");
    EXPECT_EQ(library.templates[1].name, "trunk");
    EXPECT_EQ(library.templates[2].name, "III");
    EXPECT_EQ(library.templates[1].anchors, "XY");
    EXPECT_EQ(printWord(library.templates[1]), "F[-FX]+FY");
    EXPECT_EQ(library.find("trunk"), 1u);
    EXPECT_EQ(library.find("Trunk"), 3u);
}

TEST(Templates, BentOnesWithTheSameAnchorsAreOfTheKindOfTheStraightOne)
{
    const TemplateLibrary library = parsed("fork: F[-FX]FZ\n"         // 0
                                           "tip: F\n"                 // 1
                                           "fork_bent1: F+F[-FX]FZ\n" // 2, a fork
                                           "fork_bent12: F-F[FX]FZ\n" // 3, likewise
                                           "fork_bent2: F[-FY]FZ\n"   // 4, has other anchors
                                           "fork_bent3: FZ[-FX]F\n"   // 5, has them in another order
                                           "fork_bent: F[FX]FZ\n"     // 6, has no number
                                           "fork_bent4a: F[FX]FZ\n"   // 7, not only one
                                           "fork2: F[FX]FZ\n"         // 8, is not bent
                                           "bow_bent1: FX\n"          // 9, whose straight one is not there
                                           "bow_bent2: F+FX\n");      // 10, of the kind of that one
    EXPECT_EQ(kindsOf(library), (std::vector<std::uint32_t>{0, 1, 0, 0, 4, 5, 6, 7, 8, 9, 9}));
    EXPECT_TRUE(kindsOf({}).empty());
    // What got a number when libraries were merged is a bend of its kind still; other numbers tell templates apart.
    EXPECT_EQ(kindsOf(parsed("bow: FX\nbow_bent1: F+FX\nbow_bent1_2: F-FX\nbow_2: FFX\n")),
              (std::vector<std::uint32_t>{0, 0, 0, 3}));
    // A straight one that comes later is of the kind all the same.
    EXPECT_EQ(kindsOf(parsed("bow_bent1: FX\nbow: FFX\n")), (std::vector<std::uint32_t>{0, 0}));
}

TEST(Templates, LineEndsAndBlanksDoNotMatter)
{
    const TemplateLibrary plain = parsed("FX\nF[-FX]+FY\n");
    for (const char* text :
         {"FX\r\nF[-FX]+FY\r\n", "FX\nF[-FX]+FY", " F X \n\tF [ - F X ] + F Y\t\n", "I:FX\nII :F[-FX]+FY\n"})
        EXPECT_TRUE(parsed(text) == plain) << text;
}

TEST(Templates, APercentAfterABlankBeginsACommentElsewhereItCuts)
{
    EXPECT_EQ(printWord(parsed("F%X % Y\n").templates[0]), "F%X");
    EXPECT_EQ(printWord(parsed("F %X\n").templates[0]), "F");
    EXPECT_EQ(printWord(parsed("stump:%X\n").templates[0]), "%X");
}

TEST(Templates, NumbersStandInParentheses)
{
    const Template piece = parsed("F(0.5)+( 30 )G(1e-3)-(-45)!(+0.2)'(3)f(2)&(3600)\\(7)FX\n").templates[0];
    std::vector<double> numbers;
    for (const TemplateModule& module : piece.modules)
        if (module.hasNumber)
            numbers.push_back(module.number);
    EXPECT_EQ(numbers, (std::vector<double>{0.5, 30, 1e-3, -45, 0.2, 3, 2, 3600, 7}));
    EXPECT_EQ(printWord(piece), "F(0.5)+(30)G(0.001)-(-45)!(0.2)'(3)f(2)&(3600)\\(7)FX");
}

TEST(Templates, AnOrganIsNoAnchor)
{
    const Template piece = parsed("F~XX~x~F\n").templates[0];
    EXPECT_EQ(piece.anchors, "X");
    EXPECT_EQ(piece.modules[2].anchor, kNoAnchor);
    EXPECT_EQ(piece.modules[3].anchor, 0u);
}

TEST(Templates, EveryMistakeIsReportedWhereItStands)
{
    struct Case
    {
        const char* text;
        std::uint32_t line, column;
        const char* message;
    };
    const Case cases[] = {
        {"", 1, 1, "no template"},
        {"% only comments\n\n", 1, 1, "no template"},
        {"FX\nFXX\n", 2, 3, "the anchor X stands twice"},
        {"F[FX\n", 1, 2, "`[` is never closed"},
        {"FX]\n", 1, 3, "`]` without `[`"},
        {"FxX\n", 1, 2, "`x` is no turtle symbol"},
        {"F1\n", 1, 2, "`1` is no turtle symbol"},
        {"F\xc3\xa4X\n", 1, 2, "`\xc3\xa4` is no turtle symbol"},
        {"\xc3\xa4X\n", 1, 1, "`\xc3\xa4` is no turtle symbol"},
        {"F\xe2\x88\x92X\n", 1, 2, "no turtle symbol"},
        {"F()X\n", 1, 3, "a number is missing"},
        {"F(x)\n", 1, 3, "a number is missing"},
        {"F(+-1)\n", 1, 3, "a number is missing"},
        {"F(", 1, 3, "a number is missing"},
        {"F(+", 1, 3, "a number is missing"},
        {"F(1\nFX\n", 1, 2, "`(` is never closed"},
        {"F(1,2)\n", 1, 4, "unexpected `,` after the number"},
        {"F(1e400)\n", 1, 3, "1e400 is out of range"},
        {"F(nan)\n", 1, 3, "out of range; expected a number from 0 to"},
        {"F(inf)\n", 1, 3, "out of range"},
        {"F(-1)\n", 1, 3, "-1 is out of range"},
        {"+(3601)F\n", 1, 3, "3601 is out of range; expected a number from -3600 to 3600"},
        {"'(65536)F\n", 1, 3, "out of range"},
        {"FX(1)\n", 1, 3, "`X` takes no number"},
        {"F|(90)\n", 1, 3, "`|` takes no number"},
        {"F~F(1)\n", 1, 4, "`F` takes no number"},
        {"F~+F\n", 1, 3, "`+` cannot name an organ"},
        {"F[~]\n", 1, 4, "`]` cannot name an organ"},
        {"F~\n", 1, 3, "the template ends in `~`"},
        {"FX\n1st: FX\n", 2, 1, "cannot be the name of a template"},
        {": FX\n", 1, 1, "cannot be the name"},
        {"a b: FX\n", 1, 1, "cannot be the name"},
        {"  twig:\n", 1, 7, "the template twig has no word"},
        {"twig: % F\n", 1, 5, "the template twig has no word"},
        {"twig: FX\ntwig: F\n", 2, 1, "the name twig is taken"},
        {"II: FX\nF\n", 2, 1, "the name II is taken"},
        {"F\xff\n", 1, 2, "not valid UTF-8"},
        {"F\nF % \xc3\n", 2, 5, "not valid UTF-8"},
        {"FX\r\nF]\r\n", 2, 2, "`]` without `[`"},
    };
    for (const Case& c : cases)
    {
        const auto library = parseTemplates(c.text, "t.templates", {});
        ASSERT_FALSE(library) << c.text;
        const Error& error = library.error();
        EXPECT_EQ(error.where.file, "t.templates");
        EXPECT_EQ(error.where.line, c.line) << c.text << toString(error);
        EXPECT_EQ(error.where.column, c.column) << c.text << toString(error);
        EXPECT_NE(toString(error).find(c.message), std::string::npos) << c.text << toString(error);
        EXPECT_EQ(error.kind, ErrorKind::BadInput) << c.text;
    }
}

TEST(Templates, EachLimitMayBeReachedButNotPassed)
{
    Limits limits;
    limits.templates = 2;
    limits.templateModules = 4;
    limits.bracketDepth = 1;
    limits.fileBytes = 12;
    for (const char* allowed : {"F\nF\n", "FFFF", "[][]", "FX % 1234567"})
        (void)parsed(allowed, limits);
    for (const char* refused : {"F\nF\nF\n", "FFFFF", "[[]]", "FX % 12345678"})
    {
        const auto library = parseTemplates(refused, "t.templates", limits);
        ASSERT_FALSE(library) << refused;
        EXPECT_EQ(library.error().kind, ErrorKind::Limit) << refused;
        EXPECT_NE(library.error().expected.find("limit"), std::string::npos) << refused;
    }
}

TEST(Templates, HostileTextsAreAnsweredQuickly)
{
    for (const std::string& text :
         {std::string(1 << 20, '['), std::string(1 << 20, 'F'), std::string(1 << 20, '\n'), std::string(1 << 20, ':'),
          "F(" + std::string(1 << 20, '9') + ")", std::string(1 << 20, ' ')})
    {
        const auto start = std::chrono::steady_clock::now();
        (void)parseTemplates(text, "t.templates", {});
        EXPECT_LT(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count(), 0.5);
    }
}

/// A library of random words over everything a template may hold.
TemplateLibrary randomLibrary(std::uint64_t seed)
{
    const RandomKey key(Seed{seed});
    std::uint32_t counter = 0;
    const auto below = [&](std::uint64_t count) { return key.below(Purpose::Sampling, count, counter++); };
    constexpr std::string_view kPlain = "FGf+-&^\\/|$!'%{}.@";
    constexpr std::string_view kNumbered = "FGf+-&^\\/!'";
    constexpr double kNumbers[] = {0, 1, 0.1, 1.0 / 3, 45, 137.5, 1e-7, 3600};
    TemplateLibrary library;
    const std::uint64_t count = 1 + below(6);
    for (std::uint64_t i = 0; i < count; ++i)
    {
        Template piece;
        piece.name = below(2) == 0 ? romanNumeral(static_cast<std::uint32_t>(i + 1)) : "piece_" + std::to_string(i);
        std::uint64_t open = 0;
        const std::uint64_t length = 1 + below(15);
        const auto add = [&](char symbol) -> TemplateModule& {
            piece.modules.push_back({.symbol = symbol});
            return piece.modules.back();
        };
        for (std::uint64_t k = 0; k < length; ++k)
            switch (below(7))
            {
            case 0:
                add('[');
                ++open;
                break;
            case 1:
                add(open > 0 ? ']' : 'F');
                open -= open > 0 ? 1 : 0;
                break;
            case 2:
                add('~');
                add("LXFa"[below(4)]);
                break;
            case 3:
                if (const char anchor = "ABCXYZ"[below(6)]; piece.anchors.find(anchor) == std::string::npos)
                {
                    add(anchor).anchor = static_cast<std::uint32_t>(piece.anchors.size());
                    piece.anchors += anchor;
                    break;
                }
                [[fallthrough]];
            case 4:
            {
                TemplateModule& module = add(kNumbered[below(kNumbered.size())]);
                module.hasNumber = true;
                module.number = kNumbers[below(std::size(kNumbers))];
                break;
            }
            default:
                add(kPlain[below(kPlain.size())]);
            }
        for (; open > 0; --open)
            add(']');
        library.templates.push_back(std::move(piece));
    }
    return library;
}

TEST(Templates, WhatIsPrintedIsReadBack)
{
    for (std::uint64_t seed = 0; seed < 500; ++seed)
    {
        const TemplateLibrary library = randomLibrary(seed);
        const std::string text = printTemplates(library);
        ASSERT_TRUE(parsed(text) == library) << "seed " << seed << "\n" << text;
    }
}

TEST(Templates, AreSavedAndLoaded)
{
    const std::filesystem::path path =
        std::filesystem::temp_directory_path() / ("espalier-" + std::to_string(::getpid()) + ".templates");
    const TemplateLibrary library = randomLibrary(3);
    ASSERT_TRUE(saveTemplates(path, library));
    const auto loaded = loadTemplates(path, {});
    ASSERT_TRUE(loaded);
    EXPECT_TRUE(*loaded == library);
    ASSERT_TRUE(writeFileAtomically(path, "\xef\xbb\xbf"
                                          "FX\r\n"));
    EXPECT_EQ(loadTemplates(path, {})->templates.size(), 1u) << "a byte order mark is skipped";
    ASSERT_TRUE(writeFileAtomically(path, "FX\nF]"));
    EXPECT_EQ(loadTemplates(path, {}).error().where.file, path.string());
    std::filesystem::remove(path);
    EXPECT_EQ(loadTemplates(path, {}).error().kind, ErrorKind::Io);
}

} // namespace
} // namespace espalier
