// Published L-systems through the command, as its users call it: every word of every step, counted, hashed and
// compared, and what the turtle draws of it. The facts are Data/lsystems.json; its "about" says how they were counted.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <map>
#include <nlohmann/json.hpp>
#include <span>
#include <sstream>
#include <string>
#include <string_view>
#include <sys/wait.h>
#include <vector>

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json; // Constants are declared in the order in which they use each other.

const fs::path kData = fs::path(ESPALIER_SOURCE_ROOT) / "Tests/Acceptance/Data/lsystems.json";

/// Of measured lengths and coordinates: the facts have ten digits, and 1e-6 is a micrometre at the scale of a tree.
constexpr double kTolerance = 1e-6;

/// How far a statistic may lie from its expectation, in standard errors. The seeds are fixed, so this never flickers; a
/// sound generator fails one comparison in 150,000 once and for all.
constexpr double kStandardErrors = 4.5;

constexpr int kSeeds = 10000;

// The command ------------------------------------------------------------------------------------------------------

std::string quoted(const std::string& text)
{
    std::string result = "'";
    for (const char c : text)
        result += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return result + "'";
}

/// What `command` prints; stderr goes where the test's own goes.
std::string outputOf(const std::string& command)
{
    std::string output;
    FILE* pipe = popen(command.c_str(), "r");
    if (pipe == nullptr)
    {
        ADD_FAILURE() << "cannot start $ " << command;
        return output;
    }
    std::array<char, 65536> block{};
    for (std::size_t size = 0; (size = fread(block.data(), 1, block.size(), pipe)) > 0;)
        output.append(block.data(), size);
    const int status = pclose(pipe);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << "exit " << WEXITSTATUS(status) << " of $ " << command;
    return output;
}

/// The JSON document that the command prints; null if it prints none.
Json jsonOf(const std::string& arguments)
{
    const std::string text = outputOf(quoted(ESPALIER_COMMAND) + ' ' + arguments + " --json");
    Json json = Json::parse(text, nullptr, false);
    if (json.is_discarded())
    {
        ADD_FAILURE() << "no JSON from espalier " << arguments << " --json, but: " << text.substr(0, 500);
        return {};
    }
    return json;
}

// A case as a grammar ----------------------------------------------------------------------------------------------

/// The object under `key`; an empty one without it.
const Json& objectOf(const Json& facts, const char* key)
{
    static const Json none = Json::object();
    return facts.contains(key) ? facts[key] : none;
}

std::string textOf(const Json& value)
{
    return value.is_string() ? value.get<std::string>() : value.dump();
}

/// `+-F` as `+ - F`.
std::string separated(const std::string& symbols)
{
    std::string text;
    for (const char symbol : symbols)
        text += std::string(text.empty() ? "" : " ") + symbol;
    return text;
}

std::string grammarOf(const Json& facts)
{
    std::ostringstream text;
    text << "# " << facts.at("title").get<std::string>() << "\n# " << facts.at("source").get<std::string>() << '\n';
    for (const auto& [name, value] : objectOf(facts, "constants").items())
        text << "let " << name << " = " << textOf(value) << '\n';
    if (facts.contains("angle_deg"))
        text << "angle: " << facts["angle_deg"].dump() << '\n';
    text << "draw: " << separated(facts.value("draws", "")) << '\n';
    if (facts.contains("moves"))
        text << "move: " << separated(facts["moves"]) << '\n';
    if (facts.contains("ignore"))
        text << "ignore: " << separated(facts["ignore"]) << '\n';
    text << "axiom: " << facts.at("axiom").get<std::string>() << '\n';
    for (const Json& production : facts.at("productions"))
    {
        if (production.contains("left"))
            text << textOf(production["left"]) << " < ";
        text << textOf(production.at("pred"));
        if (production.contains("right"))
            text << " > " << textOf(production["right"]);
        if (production.contains("cond"))
            text << " : " << textOf(production["cond"]);
        text << " -> " << textOf(production.at("succ"));
        if (production.contains("p"))
            text << " : " << production["p"].dump();
        text << '\n';
    }
    for (const auto& [bracket, degrees] : objectOf(facts, "implicit_turn").items())
    {
        const double turn = degrees.get<double>();
        text << "interpret: " << bracket << " -> " << bracket << (turn < 0 ? " -(" : " +(") << std::abs(turn) << ")\n";
    }
    return text.str();
}

// A word -----------------------------------------------------------------------------------------------------------

std::string withoutParameters(std::string_view word)
{
    std::string symbols;
    int depth = 0;
    for (const char c : word)
    {
        depth += c == '(' ? 1 : 0;
        if (depth == 0)
            symbols += c;
        depth -= c == ')' ? 1 : 0;
    }
    return symbols;
}

int bracketDepth(std::string_view symbols)
{
    int depth = 0;
    int deepest = 0;
    for (const char c : symbols)
    {
        depth += c == '[' ? 1 : c == ']' ? -1 : 0;
        deepest = std::max(deepest, depth);
    }
    return deepest;
}

using ClosedForm = std::int64_t (*)(std::int64_t n);

std::int64_t power(std::int64_t base, std::int64_t exponent)
{
    return exponent <= 0 ? 1 : base * power(base, exponent - 1);
}

std::int64_t fibonacci(std::int64_t n)
{
    return n < 2 ? n : fibonacci(n - 1) + fibonacci(n - 2);
}

/// The closed forms of the facts, as written there.
const std::map<std::string, ClosedForm> kClosedForms = {
    {"1", [](std::int64_t) -> std::int64_t { return 1; }},
    {"fib(n)", [](std::int64_t n) { return fibonacci(n); }},
    {"fib(n+1)", [](std::int64_t n) { return fibonacci(n + 1); }},
    {"fib(n+2)", [](std::int64_t n) { return fibonacci(n + 2); }},
    {"2**n", [](std::int64_t n) { return power(2, n); }},
    {"2**n-1", [](std::int64_t n) { return power(2, n) - 1; }},
    {"2**(n+1)-1", [](std::int64_t n) { return power(2, n + 1) - 1; }},
    {"n*2**n//2", [](std::int64_t n) { return n * power(2, n) / 2; }},
    {"3*2**n+n*2**(n-1)-2 if n else 1",
     [](std::int64_t n) { return n > 0 ? 3 * power(2, n) + n * power(2, n - 1) - 2 : 1; }},
    {"3**n", [](std::int64_t n) { return power(3, n); }},
    {"2*3**n", [](std::int64_t n) { return 2 * power(3, n); }},
    {"5*3**n", [](std::int64_t n) { return 5 * power(3, n); }},
    {"2*3**n-1", [](std::int64_t n) { return 2 * power(3, n) - 1; }},
    {"2*(3**n-1)", [](std::int64_t n) { return 2 * (power(3, n) - 1); }},
    {"(3**n+1)//2", [](std::int64_t n) { return (power(3, n) + 1) / 2; }},
    {"3*(3**n-1)//2", [](std::int64_t n) { return 3 * (power(3, n) - 1) / 2; }},
    {"2+17*(3**n-1)//2", [](std::int64_t n) { return 2 + 17 * (power(3, n) - 1) / 2; }},
    {"4**n", [](std::int64_t n) { return power(4, n); }},
    {"3*(4**n-2**n)//2", [](std::int64_t n) { return 3 * (power(4, n) - power(2, n)) / 2; }},
    {"4**n+3*(4**n-2**n)//2+11*(4**n-1)//3",
     [](std::int64_t n) { return power(4, n) + 3 * (power(4, n) - power(2, n)) / 2 + 11 * (power(4, n) - 1) / 3; }},
    {"5**n", [](std::int64_t n) { return power(5, n); }},
    {"2*5**n-1", [](std::int64_t n) { return 2 * power(5, n) - 1; }},
    {"3*5**n-2", [](std::int64_t n) { return 3 * power(5, n) - 2; }},
    {"(5**n-1)//2", [](std::int64_t n) { return (power(5, n) - 1) / 2; }},
    {"(5*5**n-3)//2", [](std::int64_t n) { return (5 * power(5, n) - 3) / 2; }},
    {"8**n", [](std::int64_t n) { return power(8, n); }},
    {"8**n+12*(8**n-1)//7", [](std::int64_t n) { return power(8, n) + 12 * (power(8, n) - 1) / 7; }},
};

// The tests --------------------------------------------------------------------------------------------------------

const Json& allCases()
{
    static const Json cases = [] {
        std::ifstream file(kData);
        const Json document = Json::parse(file, nullptr, false);
        return document.is_discarded() ? Json::array() : document.value("cases", Json::array());
    }();
    return cases;
}

bool isStochastic(const Json& facts)
{
    return facts.at("productions").at(0).contains("p");
}

std::vector<std::string> idsOf(bool stochastic)
{
    std::vector<std::string> ids;
    for (const Json& facts : allCases())
        if (isStochastic(facts) == stochastic)
            ids.push_back(facts.at("id"));
    return ids;
}

/// A test's name has letters, digits and underscores.
std::string testName(const testing::TestParamInfo<std::string>& info)
{
    std::string name = info.param;
    for (char& c : name)
        if (isalnum(static_cast<unsigned char>(c)) == 0)
            c = '_';
    return name;
}

/// One case, written as a grammar into a folder that no other test uses: they may run at the same time.
class LSystemCase : public testing::TestWithParam<std::string>
{
protected:
    void SetUp() override
    {
        for (const Json& each : allCases())
            if (each.at("id") == GetParam())
                facts_ = each;
        folder_ =
            fs::absolute("Acceptance/LSystemCases") / testing::UnitTest::GetInstance()->current_test_info()->name();
        fs::remove_all(folder_);
        fs::create_directories(folder_);
        grammar_ = folder_ / "case.lsys";
        std::ofstream(grammar_, std::ios::binary) << grammarOf(facts_);
    }

    Json derive(int n, const std::string& more = "") const
    {
        return jsonOf("derive " + quoted(grammar_) + " -n " + std::to_string(n) + more);
    }

    void checkWord(const Json& expected);
    void checkDrawing(const Json& expected) const;
    void checkHashes() const;

    Json facts_;
    fs::path folder_;
    fs::path grammar_;
    std::map<std::string, std::string> hashes_; ///< Expected, by file in folder_.
};

void LSystemCase::checkWord(const Json& expected)
{
    const int n = expected.at("n");
    const Json derived = derive(n);
    for (const char* key : {"iterations", "length", "counts", "word"})
        ASSERT_TRUE(derived.contains(key)) << key;
    EXPECT_EQ(derived["iterations"], n);
    EXPECT_EQ(derived["length"], expected.at("length"));
    // Not ordered: the symbols may come in any order.
    EXPECT_EQ(nlohmann::json(derived["counts"]), nlohmann::json(expected.at("counts")));

    const std::string word = derived["word"];
    const std::string symbols = withoutParameters(word);
    EXPECT_EQ(bracketDepth(symbols), expected.at("max_bracket_depth"));
    for (const char* key : {"string", "word"})
    {
        if (expected.contains(key))
        {
            EXPECT_EQ(word, expected[key]);
        }
    }
    for (const char* key : {"expect_strings", "expect_words"})
    {
        if (facts_.contains(key) && facts_[key].contains(std::to_string(n)))
        {
            EXPECT_EQ(word, facts_[key][std::to_string(n)]);
        }
    }
    for (const auto& [what, form] : objectOf(facts_, "closed_forms").items())
    {
        const auto known = kClosedForms.find(form);
        ASSERT_NE(known, kClosedForms.end()) << "kClosedForms lacks " << form;
        const Json counted = what == "length" ? derived["length"] : derived["counts"].value(what, Json(0));
        EXPECT_EQ(counted, known->second(n)) << what << " is " << form;
    }

    const std::string file = std::to_string(n) + ".word";
    std::ofstream(folder_ / file, std::ios::binary) << symbols;
    hashes_[file] = expected.at("sha256");
}

void LSystemCase::checkDrawing(const Json& expected) const
{
    const Json measured = jsonOf("measure " + quoted(grammar_) + " -n " + std::to_string(expected.at("n").get<int>()));
    ASSERT_TRUE(measured.is_object());
    const Json& turtle = expected.at("turtle");
    constexpr std::array<std::array<const char*, 2>, 4> kCounts = {
        {{"segments", "segments"}, {"tips", "terminal_nodes"}, {"forks", "fork_nodes"}, {"maxDepth", "max_depth"}}};
    constexpr std::array<std::array<const char*, 2>, 4> kLengths = {
        {{"totalLength", "total_length"}, {"minY", "min_y"}, {"maxY", "max_y"}, {"maxRadius", "max_radius"}}};
    for (const auto& [ours, theirs] : kCounts)
        EXPECT_EQ(measured.value(ours, -1), turtle.at(theirs)) << ours;
    for (const auto& [ours, theirs] : kLengths)
    {
        const double wanted = turtle.at(theirs);
        EXPECT_NEAR(measured.value(ours, std::nan("")), wanted, kTolerance * std::max(1.0, std::abs(wanted))) << ours;
    }
}

/// All words in one call: the hash is somebody else's code, as a user would check it.
void LSystemCase::checkHashes() const
{
    std::istringstream lines(outputOf("cd " + quoted(folder_) + " && sha256sum -- *.word"));
    std::map<std::string, std::string> found;
    for (std::string hash, file; lines >> hash >> file;)
        found[file] = hash;
    for (const auto& [file, hash] : hashes_)
        EXPECT_EQ(found[file], hash) << (folder_ / file).string();
}

class PublishedLSystem : public LSystemCase
{};

TEST_P(PublishedLSystem, GivesThePublishedWordsAndDrawings)
{
    for (const Json& expected : facts_.at("iterations"))
    {
        SCOPED_TRACE("n = " + expected.at("n").dump() + " of " + grammar_.string());
        checkWord(expected);
        if (expected.contains("turtle"))
            checkDrawing(expected);
        if (HasFatalFailure())
            return; // The rest would say the same again.
    }
    checkHashes();
}

INSTANTIATE_TEST_SUITE_P(Cases, PublishedLSystem, testing::ValuesIn(idsOf(false)), testName);

struct Statistics
{
    double mean = 0;
    double deviation = 0;
    double meanError = 0;      ///< Standard error of the mean.
    double deviationError = 0; ///< Standard error of the deviation.
    double smallest = 0;
    double largest = 0;
};

/// The error of the deviation s is sqrt(m4 - s^4) / (2 s sqrt(N)): the distribution is skewed, so its own fourth moment
/// m4 is taken, not that of a normal distribution.
Statistics statisticsOf(std::span<const double> values)
{
    Statistics result;
    const auto count = static_cast<double>(values.size());
    for (const double value : values)
        result.mean += value / count;
    double second = 0;
    double fourth = 0;
    for (const double value : values)
    {
        const double square = (value - result.mean) * (value - result.mean);
        second += square / count;
        fourth += square * square / count;
    }
    result.deviation = std::sqrt(second);
    result.meanError = std::sqrt(second / count);
    if (second > 0)
        result.deviationError = std::sqrt((fourth - second * second) / count) / (2 * result.deviation);
    result.smallest = *std::ranges::min_element(values);
    result.largest = *std::ranges::max_element(values);
    return result;
}

class StochasticLSystem : public LSystemCase
{
protected:
    Json deriveSeeds(int n, const std::string& more = "") const
    {
        return derive(n, " --seed 1.." + std::to_string(kSeeds) + more);
    }
};

TEST_P(StochasticLSystem, HasThePublishedDistributionOverTenThousandSeeds)
{
    for (const Json& expected : facts_.at("iterations"))
    {
        SCOPED_TRACE("n = " + expected.at("n").dump() + " of " + grammar_.string());
        const Json derived = deriveSeeds(expected.at("n"), " --no-word");
        ASSERT_TRUE(derived.is_array());
        ASSERT_EQ(derived.size(), static_cast<std::size_t>(kSeeds));
        std::vector<double> counts;
        for (std::size_t i = 0; i < derived.size(); ++i)
        {
            ASSERT_EQ(derived[i].value("seed", std::uint64_t{0}), i + 1);
            EXPECT_FALSE(derived[i].contains("word"));
            counts.push_back(derived[i].at("counts").value("F", 0.0));
        }
        const Statistics found = statisticsOf(counts);
        EXPECT_NEAR(found.mean, expected.at("F_mean").get<double>(), kStandardErrors * found.meanError + 1e-9);
        EXPECT_NEAR(found.deviation, expected.at("F_std").get<double>(), kStandardErrors * found.deviationError + 1e-9);
        EXPECT_GE(found.smallest, expected.at("F_min").get<double>());
        EXPECT_LE(found.largest, expected.at("F_max").get<double>());
    }
}

TEST_P(StochasticLSystem, TakesEachProductionAsOftenAsItsWeightSays)
{
    std::map<std::string, double> words;
    for (const Json& derived : deriveSeeds(1))
        words[derived.value("word", "")] += 1.0 / kSeeds;
    double sum = 0;
    for (const Json& production : facts_.at("productions"))
    {
        const double share = production.at("p");
        const double error = std::sqrt(share * (1 - share) / kSeeds);
        EXPECT_NEAR(words[production.at("succ")], share, kStandardErrors * error) << production.at("succ");
        sum += words[production.at("succ")];
    }
    EXPECT_NEAR(sum, 1, 1e-9) << "words that no production gives";
}

TEST_P(StochasticLSystem, GivesTheSameWordForTheSameSeed)
{
    const int n = facts_.at("n");
    const Json first = derive(n, " --seed 7");
    const Json range = derive(n, " --seed 7..8");
    ASSERT_TRUE(first.is_object() && range.is_array() && range.size() == 2);
    EXPECT_EQ(first.at("word"), range[0].at("word"));
    EXPECT_NE(first.at("word"), range[1].at("word"));
}

INSTANTIATE_TEST_SUITE_P(Cases, StochasticLSystem, testing::ValuesIn(idsOf(true)), testName);

TEST(LSystemCases, AreRead)
{
    EXPECT_GE(allCases().size(), 24u) << kData;
}

} // namespace
