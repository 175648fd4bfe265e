#include <Espalier/Core/Json.h>
#include <Espalier/Core/Random.h>
#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <limits>

namespace espalier {

namespace {

Expected<JsonDocument> parse(std::string text, const Limits& limits = {})
{
    return JsonDocument::parse(std::move(text), "f.json", limits);
}

// The message of a text that must be refused, without "f.json:".
std::string errorOf(std::string text, const Limits& limits = {})
{
    const auto document = parse(std::move(text), limits);
    return document ? "no error" : toString(document.error()).substr(std::strlen("f.json:"));
}

template <class T>
std::string errorOf(const Expected<T>& result)
{
    return result ? "no error" : toString(result.error()).substr(std::strlen("f.json:"));
}

std::string placeOf(const Location& location)
{
    return std::to_string(location.line) + ':' + std::to_string(location.column);
}

// A document as text again, in one line: an independent look at everything that was stored.
std::string print(JsonDocument::Value value)
{
    using Type = JsonDocument::Type;
    std::string text;
    switch (value.type())
    {
    case Type::Null:
        return "null";
    case Type::Boolean:
        return *value.boolean("") ? "true" : "false";
    case Type::Number:
        return formatNumber(*value.number(""));
    case Type::String:
        return quoteJson(*value.string(""));
    case Type::Array:
        for (const auto item : value.items())
            text.append(text.empty() ? "" : ",").append(print(item));
        return '[' + text + ']';
    case Type::Object:
        for (const auto item : value.items())
            text.append(text.empty() ? "" : ",").append(quoteJson(item.key())).append(":").append(print(item));
        return '{' + text + '}';
    }
    return text;
}

// Each value must stand where it says it stands. For texts of one line of ASCII.
void expectPlaces(const std::string& text, JsonDocument::Value value)
{
    const char first = text.at(value.where().column - 1);
    constexpr std::string_view kFirst[] = {"n", "tf", "-0123456789", "\"", "[", "{"}; // in the order of Type
    EXPECT_NE(kFirst[static_cast<std::size_t>(value.type())].find(first), std::string_view::npos) << text;
    for (const auto item : value.items())
    {
        EXPECT_TRUE(value.type() != JsonDocument::Type::Object || text.at(item.whereKey().column - 1) == '"') << text;
        expectPlaces(text, item);
    }
}

TEST(Json, SaysWhatIsWrongAndWhere)
{
    struct Case
    {
        std::string text;
        const char* error;
    };
    const Case cases[] = {
        {"", "1:1: the file is empty; expected a JSON object"},
        {" \n\t ", "1:1: the file is empty; expected a JSON object"},
        {"{", "1:2: the file ends too early; expected a key in quotes, or '}'"},
        {"[", "1:2: the file ends too early; expected a value or ']'"},
        {"[1", "1:3: the file ends too early; expected ',' or ']'"},
        {"[1,\n", "2:1: the file ends too early; expected a value"},
        {"{\"a\"", "1:5: the file ends too early; expected ':' after the key"},
        {"{\"a\":", "1:6: the file ends too early; expected a value"},
        {"{\"a\":1", "1:7: the file ends too early; expected ',' or '}'"},
        {"{\"a\":1,", "1:8: the file ends too early; expected a key in quotes"},
        {"]", "1:1: unexpected ']'; expected a value"},
        {"[1,]", "1:4: unexpected ']'; expected a value"},
        {"[1,,2]", "1:4: unexpected ','; expected a value"},
        {"[,1]", "1:2: unexpected ','; expected a value or ']'"},
        {"[1 2]", "1:4: unexpected '2'; expected ',' or ']'"},
        {"[1}", "1:3: unexpected '}'; expected ',' or ']'"},
        {"[01]", "1:3: unexpected '1'; expected ',' or ']'"},
        {"[1-2]", "1:3: unexpected '-'; expected ',' or ']'"},
        {"[1.5.2]", "1:5: unexpected '.'; expected ',' or ']'"},
        {"{\"a\":1,}", "1:8: unexpected '}'; expected a key in quotes"},
        {"{a:1}", "1:2: unexpected 'a'; expected a key in quotes, or '}'"},
        {"{'a':1}", "1:2: unexpected '''; expected a key in quotes, or '}'"},
        {"{\"a\" 1}", "1:6: unexpected '1'; expected ':' after the key"},
        {"{\"a\":1 \"b\":2}", "1:8: unexpected '\"'; expected ',' or '}'"},
        {"{\"a\":}", "1:6: unexpected '}'; expected a value"},
        {"{\"a\":1]", "1:7: unexpected ']'; expected ',' or '}'"},
        {"{1:2}", "1:2: unexpected '1'; expected a key in quotes, or '}'"},
        {"{}\n{}", "2:1: unexpected '{'; expected the end of the file"},
        {"{} // done", "1:4: unexpected '/'; expected the end of the file"},
        {std::string("{}\0garbage", 10), "1:3: unexpected U+0000; expected the end of the file"},
        {std::string("[\0]", 3), "1:2: unexpected U+0000; expected a value or ']'"},
        {"[NaN]", "1:2: unexpected 'NaN'; expected a value or ']'"},
        {"{\"a\":nan}", "1:6: unexpected 'nan'; expected a value"},
        {"[-Infinity]", "1:2: the number - is not complete; expected a number such as -1, 0.5 or 2e3"},
        {"tru", "1:1: unexpected 'tru'; expected a value"},
        {"trueish", "1:5: unexpected 'ish'; expected the end of the file"},
        {"[+1]", "1:2: unexpected '+'; expected a value or ']'"},
        {"[.5]", "1:2: unexpected '.'; expected a value or ']'"},
        {"[1.]", "1:2: the number 1. is not complete; expected a number such as -1, 0.5 or 2e3"},
        {"[2e]", "1:2: the number 2e is not complete; expected a number such as -1, 0.5 or 2e3"},
        {"[1e400]", "1:2: 1e400 is too large for a number; expected at most 1.7976931348623157e+308"},
        {"{\"a\":\n -1e400}", "2:2: -1e400 is too large for a number; expected at most 1.7976931348623157e+308"},
        {"[\"abc", "1:2: the string that begins here does not end; expected '\"'"},
        {"[\"abc\\\"", "1:2: the string that begins here does not end; expected '\"'"},
        {"[\"abc\\", "1:2: the string that begins here does not end; expected '\"'"},
        {"{\"abc", "1:2: the string that begins here does not end; expected '\"'"},
        {"[\"ab\ncd\"]",
         "1:5: the string contains the character U+000a; expected '\"', or the character written as \"\\n\""},
        {"[\"\\x\"]",
         "1:4: the string contains an unknown escape; expected \\\" \\\\ \\/ \\b \\f \\n \\r \\t or \\u and "
         "four hexadecimal digits"},
        {"[\"\\ud800\"]",
         "1:9: the string contains an unknown escape; expected \\\" \\\\ \\/ \\b \\f \\n \\r \\t or \\u and "
         "four hexadecimal digits"},
        {"[\"\xff\"]", "1:3: this byte is not valid; expected UTF-8 text"},
        {"[\xc3\xa4]", "1:2: unexpected '\xc3\xa4'; expected a value or ']'"},
        {"{\"\xc3\xa4\":\r\n\"\xc3\xb6\" x}", "2:5: unexpected 'x'; expected ',' or '}'"},
        {"{\"k\":1,\n \"k\":2}",
         "2:2: the key \"k\" stands here a second time; expected each key once; the first is at 1:2"},
        {"{\"a\":{\"b\":1,\"c\":2,\"b\":3}}",
         "1:19: the key \"b\" stands here a second time; expected each key once; the first is at 1:7"},
        {"{\"a\":1,\"\\u0061\":2}",
         "1:8: the key \"a\" stands here a second time; expected each key once; the first is at 1:2"},
        {"{\"z\":1,\"a\":2,\"z\":3,\"a\":4,\"z\":5}",
         "1:14: the key \"z\" stands here a second time; expected each key once; the first is at 1:2"},
    };
    for (const Case& c : cases)
        EXPECT_EQ(errorOf(c.text), c.error) << c.text;
}

TEST(Json, KeepsItsLimits)
{
    Limits limits;
    limits.jsonDepth = 3;
    limits.stringBytes = 4;
    limits.fileBytes = 40;
    EXPECT_EQ(errorOf("[[{}]]", limits), "no error");
    EXPECT_EQ(errorOf("[[\n{\"a\":[]}]]", limits),
              "2:6: objects and arrays are nested too deeply; expected at most 3 levels (limit jsonDepth)");
    EXPECT_EQ(errorOf("[\"1234\"]", limits), "no error");
    EXPECT_EQ(errorOf("[1, \"12345\"]", limits), "1:5: the string has 5 bytes; expected at most 4 (limit stringBytes)");
    EXPECT_EQ(errorOf("{\"12345\":1}", limits), "1:2: the string has 5 bytes; expected at most 4 (limit stringBytes)");
    EXPECT_EQ(errorOf(std::string(40, ' '), limits), "1:1: the file is empty; expected a JSON object");
    EXPECT_EQ(errorOf(std::string(41, ' '), limits), " the text has 41 bytes; expected at most 40 (limit fileBytes)");
    for (const char* text : {"[[[[", "[\"12345\"]", "                                         "})
        EXPECT_EQ(parse(text, limits).error().kind, ErrorKind::Limit);
    EXPECT_EQ(parse(std::string(1000000, '['), {}).error().kind, ErrorKind::Limit) << "must not recurse";
}

TEST(Json, StoresEverything)
{
    const char* texts[] = {
        "null",
        "true",
        "false",
        "0",
        "-0",
        "\"\"",
        "[]",
        "{}",
        "1e-07",
        "1.7976931348623157e+308",
        "5e-324",
        R"([null,true,false,1,"x",[],{},[[]],[{}],{"a":[]}])",
        R"({"":1,"a":{"b":{"c":[1,2,{"d":null}]}},"e":"f"})",
        R"(["a\"b\\c\nd\u0001",{"\t":"\u001f"}])",
        "[\"\xf0\x9f\x8c\xb3\"]",
    };
    for (const char* text : texts)
    {
        const auto document = parse(text);
        ASSERT_TRUE(document) << toString(document.error());
        EXPECT_EQ(print(document->root()), text);
    }
    EXPECT_EQ(print(parse("\xef\xbb\xbf [ 1 ,\r\n{ \"a\" :\t2 } ] \n")->root()), "[1,{\"a\":2}]");
    EXPECT_EQ(print(parse(R"(["\u00e4\ud83c\udf33\/"])")->root()), "[\"\xc3\xa4\xf0\x9f\x8c\xb3/\"]");
}

TEST(Json, SurvivesBeingMoved)
{
    auto document = parse(R"({"a":"a string that is too long to be stored inside its object"})");
    const JsonDocument moved = std::move(*document);
    EXPECT_EQ(moved.root()["a"].string("").value(), "a string that is too long to be stored inside its object");
}

TEST(Json, KnowsWhereEverythingStood)
{
    const auto document =
        parse("{ \"a\" : [1,\n  \"x,]\\\"\" , -2.5e3,\n  {\"\xc3\xa4\":true, \"c\\\\\" :null}],\n\"d\":{}}");
    ASSERT_TRUE(document);
    const auto root = document->root();
    EXPECT_EQ(placeOf(root.where()), "1:1");
    const auto a = root["a"];
    EXPECT_EQ(placeOf(a.whereKey()), "1:3");
    EXPECT_EQ(placeOf(a.where()), "1:9");
    const auto items = a.items();
    const char* places[] = {"1:10", "2:3", "2:13", "3:3"};
    for (std::size_t i = 0; i < 4; ++i)
        EXPECT_EQ(placeOf(items.at(i).where()), places[i]);
    EXPECT_EQ(placeOf(items[3]["\xc3\xa4"].whereKey()), "3:4");
    EXPECT_EQ(placeOf(items[3]["\xc3\xa4"].where()), "3:8");
    EXPECT_EQ(placeOf(items[3]["c\\"].whereKey()), "3:14");
    EXPECT_EQ(placeOf(items[3]["c\\"].where()), "3:21");
    EXPECT_EQ(placeOf(root["d"].where()), "4:5");
    EXPECT_EQ(placeOf(items[0].whereKey()), placeOf(items[0].where())) << "an element has no key";
    EXPECT_EQ(root.where().file, "f.json");
}

TEST(Json, FindsKeysAndItems)
{
    const auto document = parse(R"({"a":1,"b":[10,20],"":3})");
    const auto root = document->root();
    EXPECT_EQ(root.size(), 3u);
    EXPECT_TRUE(root["a"].exists());
    EXPECT_TRUE(root[""].exists());
    EXPECT_FALSE(root["c"].exists());
    EXPECT_FALSE(root["a"]["b"].exists());
    EXPECT_EQ(root["b"].items()[1].number(""), 20);
    EXPECT_EQ(root["b"].key(), "b");
    EXPECT_EQ(root.key(), "");
    EXPECT_TRUE(root["a"].items().empty());
    EXPECT_EQ(root.required("a", "a number")->number(""), 1);
    EXPECT_EQ(errorOf(root.required("c", "a number")), "1:1: the key \"c\" is missing; expected \"c\": a number");
}

TEST(Json, TypedAccessNamesTheRoleAndTheValue)
{
    const auto document =
        parse(R"({"n":-2.5,"s":"two","b":true,"z":null,"a":[],"o":{"x":1},"i":7,"big":18446744073709551615,)"
              R"("over":18446744073709551616,"thousand":1e3,"long":")" +
              std::string(60, 'x') + "\"}");
    ASSERT_TRUE(document);
    const auto root = document->root();

    EXPECT_EQ(root["n"].number("scaling"), -2.5);
    EXPECT_EQ(root["n"].number("scaling", -2.5, -2.5), -2.5);
    EXPECT_EQ(errorOf(root["s"].number("scaling")), "1:15: scaling is the string \"two\"; expected a number");
    EXPECT_EQ(errorOf(root["n"].number("scaling", 0, 10)), "1:6: scaling is -2.5; expected a number from 0 to 10");
    EXPECT_EQ(errorOf(root["z"].number("scaling", 0, 0.1)), "1:34: scaling is null; expected a number from 0 to 0.1");

    EXPECT_EQ(root["i"].count("depth", 7, 7), 7u);
    EXPECT_EQ(root["thousand"].count("depth", 0, 1000), 1000u);
    EXPECT_EQ(root["big"].count("seed", 0, std::numeric_limits<std::uint64_t>::max()), 18446744073709551615u);
    EXPECT_FALSE(root["over"].count("seed", 0, std::numeric_limits<std::uint64_t>::max()));
    EXPECT_EQ(errorOf(root["n"].count("depth", 0, 64)), "1:6: depth is -2.5; expected a whole number from 0 to 64");
    EXPECT_EQ(errorOf(root["i"].count("depth", 8, 64)).substr(5), " depth is 7; expected a whole number from 8 to 64");
    EXPECT_FALSE(root["b"].count("depth", 0, 64));

    EXPECT_EQ(root["b"].boolean("flag"), true);
    EXPECT_EQ(errorOf(root["a"].boolean("flag")), "1:43: flag is an array; expected true or false");
    EXPECT_EQ(root["s"].string("name"), "two");
    EXPECT_EQ(errorOf(root["b"].string("name")), "1:25: name is true; expected a string");
    EXPECT_NE(errorOf(root["long"].number("n")).find(std::string(40, 'x') + "...\";"), std::string::npos);

    EXPECT_TRUE(root["a"].requireArray("trees"));
    EXPECT_EQ(errorOf(root["o"].requireArray("trees")), "1:50: trees is an object; expected an array");
    EXPECT_TRUE(root["o"].requireObject("tree"));
    EXPECT_TRUE(root["o"].requireObject("tree", {"y", "x"}));
    EXPECT_EQ(errorOf(root["a"].requireObject("tree")), "1:43: tree is an array; expected an object");
    EXPECT_EQ(errorOf(root["o"].requireObject("tree", {"y", "z"})),
              "1:51: tree has the unknown key \"x\"; expected only y, z");
    EXPECT_EQ(errorOf(Expected<void>(root["z"].fail("what", "that", "do this"))), "1:34: what; expected that; do this");
}

TEST(Json, LargeObjectsAreNotQuadratic)
{
    std::string text = "{";
    for (int i = 0; i < 100000; ++i)
        text += "\"key" + std::to_string(i) + "\":" + std::to_string(i) + ",";
    const auto start = std::chrono::steady_clock::now();
    EXPECT_EQ(parse(text + "\"last\":0}")->root().size(), 100001u);
    EXPECT_NE(errorOf(text + "\"key5\":0}").find("the key \"key5\" stands here a second time"), std::string::npos);
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(10)); // Quadratic: minutes.
}

// Whatever stands in a file: a document or an error that points into the text. Sanitizers watch for the rest.
TEST(Json, SurvivesAnyDamage)
{
    const std::string valid = R"({"espalier":"archetype","version":1,"trees":[{"template":"VII","scaling":-1.5e2,)"
                              "\n"
                              R"("children":{"X":null,"Y":{"template":"\u0001\n","roll":0.25,"f":true}}}, [], "\\"]})";
    ASSERT_TRUE(parse(valid));
    constexpr std::string_view kBytes = "{}[]\",:\\ \n0123456789-+.eEtrufalsn\0\x01\xc3\xa4\xff";
    int survivors = 0;
    for (std::uint32_t seed = 0; seed < 20000; ++seed)
    {
        const RandomKey key{Seed{seed}};
        std::string text = valid;
        const std::uint64_t changes = 1 + key.below(Purpose::Sampling, 4);
        for (std::uint32_t i = 0; i < changes && !text.empty(); ++i)
        {
            const RandomKey change = key.child(i);
            const std::size_t at = change.below(Purpose::Sampling, text.size(), 0);
            const std::size_t length = 1 + change.below(Purpose::Sampling, 8, 1);
            const char byte = kBytes[change.below(Purpose::Sampling, kBytes.size(), 2)];
            switch (change.below(Purpose::Sampling, 5, 3))
            {
            case 0:
                text[at] = byte;
                break;
            case 1:
                text.insert(at, 1, byte);
                break;
            case 2:
                text.erase(at, length);
                break;
            case 3:
                text.insert(at, text.substr(change.below(Purpose::Sampling, text.size(), 4), length));
                break;
            default:
                text.resize(at);
            }
        }
        const auto document = parse(text);
        if (document)
        {
            ++survivors;
            const std::string printed = print(document->root());
            const auto again = parse(printed);
            ASSERT_EQ(print(again->root()), printed) << text;
            if (std::none_of(printed.begin(), printed.end(), [](char c) { return static_cast<signed char>(c) < 0; }))
                expectPlaces(printed, again->root());
        }
        else
        {
            const Error& error = document.error();
            ASSERT_FALSE(error.what.empty());
            const Location end = locate("", text, text.size());
            ASSERT_TRUE(error.where.line >= 1 && error.where.column >= 1) << text;
            ASSERT_LE(error.where.line, end.line) << text;
            ASSERT_TRUE(error.where.line < end.line || error.where.column <= end.column) << text;
        }
    }
    EXPECT_GT(survivors, 100);
    EXPECT_LT(survivors, 10000);
}

TEST(QuoteJson, EscapesWhatJsonForbids)
{
    EXPECT_EQ(quoteJson(""), "\"\"");
    EXPECT_EQ(quoteJson("a\"b\\c/"), "\"a\\\"b\\\\c/\"");
    EXPECT_EQ(quoteJson(std::string_view("\b\f\n\r\t\0\x1f\x7f", 8)), "\"\\b\\f\\n\\r\\t\\u0000\\u001f\x7f\"");
    EXPECT_EQ(quoteJson("\xc3\xa4\xf0\x9f\x8c\xb3"), "\"\xc3\xa4\xf0\x9f\x8c\xb3\"");
}

TEST(FormatNumber, IsShort)
{
    struct Case
    {
        double value;
        const char* text;
    };
    const Case cases[] = {
        {0, "0"},
        {-0.0, "-0"},
        {1, "1"},
        {-1, "-1"},
        {0.1, "0.1"},
        {1.0 / 3, "0.3333333333333333"},
        {100, "100"},
        {1e22, "1e+22"},
        {123456, "123456"},
        {1e-7, "1e-07"},
        {2.5e-5, "2.5e-05"},
        {-137.5, "-137.5"},
        {5e-324, "5e-324"},
        {1.7976931348623157e308, "1.7976931348623157e+308"},
    };
    for (const Case& c : cases)
        EXPECT_EQ(formatNumber(c.value), c.text);
}

TEST(FormatNumber, ReadsBackAsTheSameBits)
{
    for (std::uint32_t i = 0; i < 20000; ++i)
    {
        const double value = std::bit_cast<double>(RandomKey(Seed{4}).bits(Purpose::Sampling, i));
        if (!std::isfinite(value))
            continue;
        const double back = *parse(formatNumber(value))->root().number("");
        ASSERT_EQ(std::bit_cast<std::uint64_t>(back), std::bit_cast<std::uint64_t>(value)) << value;
    }
}

} // namespace

} // namespace espalier
