#include "Command.h"

#include <Espalier/Core/File.h>
#include <charconv>
#include <cstdio>
#include <unistd.h>

namespace espalier::tool {

void fail(const Error& error)
{
    const bool badInput = error.kind == ErrorKind::BadInput || error.kind == ErrorKind::Limit;
    throw Failure{badInput ? kBadInput : kOther, toString(error)};
}

void failUsage(const std::string& message)
{
    throw Failure{kUsage, message};
}

SeedRange parseSeeds(const std::string& text)
{
    const auto number = [&](std::string_view digits) {
        std::uint64_t value = 0;
        const auto read = std::from_chars(digits.data(), digits.data() + digits.size(), value);
        if (digits.empty() || read.ec != std::errc{} || read.ptr != digits.data() + digits.size())
            failUsage("--seed " + text +
                      ": expected a number from 0 to 18446744073709551615, a range such as 1..20, or exemplar for the "
                      "drawn tree itself (exemplar:2 for the second of several)");
        return value;
    };
    SeedRange range;
    if (const std::string_view exemplar = "exemplar"; text.starts_with(exemplar))
    {
        std::uint64_t tree = 1;
        if (text.size() > exemplar.size())
            tree = text[exemplar.size()] == ':' ? number(std::string_view(text).substr(exemplar.size() + 1)) : 0;
        if (tree < 1 || tree > 0xffffffffu)
            failUsage("--seed " + text + ": expected exemplar, or exemplar:2 for the second of several drawn trees");
        range.exemplar = static_cast<std::uint32_t>(tree - 1);
        return range;
    }
    const std::size_t dots = text.find("..");
    if (dots == std::string::npos)
    {
        range.first = range.last = number(text);
        return range;
    }
    range.isRange = true;
    range.first = number(std::string_view(text).substr(0, dots));
    range.last = number(std::string_view(text).substr(dots + 2));
    if (range.last < range.first)
        failUsage("--seed " + text + ": the range is empty; expected the lower seed first");
    if (range.last - range.first >= 10'000'000)
        failUsage("--seed " + text + ": expected at most 10,000,000 seeds");
    return range;
}

void failEnding(const std::filesystem::path& path, std::string_view endings)
{
    std::string message = path.string() + ": expected a file that ends in " + std::string(endings);
    std::error_code ignored;
    if (path.extension() == ".appearance" && endings.find(".appearance") == std::string_view::npos)
        failUsage(message + "; this is a look, which `espalier appearance S.species --set " + path.string() +
                  "` puts into a species");
    // A name alone: perhaps that of a file beside it, or of one that ships.
    for (const char* folder : {"", "Content"})
        for (const char* ending : {".species", ".archetype", ".lsys", ".appearance"})
            if (const std::filesystem::path meant = folder / std::filesystem::path(path.string() + ending);
                endings.find(ending) != std::string_view::npos && std::filesystem::exists(meant, ignored))
                failUsage(message + "; did you mean " + meant.string() + "?");
    for (const char* folder : {"", "Content"})
        if (const std::filesystem::path drawn = folder / std::filesystem::path(path.string() + ".archetype");
            endings.find(".species") != std::string_view::npos && std::filesystem::exists(drawn, ignored))
            failUsage(message + "; `espalier infer " + drawn.string() + " -o " + path.filename().string() +
                      ".species` makes one");
    failUsage(message);
}

InputKind kindOf(const std::filesystem::path& path, std::string_view endings)
{
    if (path.extension() == ".archetype")
        return InputKind::Archetype;
    if (path.extension() == ".species")
        return InputKind::Species;
    if (path.extension() == ".lsys")
        return InputKind::Grammar;
    failEnding(path, endings);
}

std::pair<std::uint32_t, std::uint32_t> parseRange(const std::string& option, const std::string& text,
                                                   std::uint32_t most, const std::string& noun,
                                                   const std::string& example)
{
    const auto number = [&](std::string_view digits) {
        std::uint32_t value = 0;
        const auto read = std::from_chars(digits.data(), digits.data() + digits.size(), value);
        if (read.ec != std::errc{} || read.ptr != digits.data() + digits.size() || value > most)
            failUsage(option + " " + text + ": expected a " + noun + " from 0 to " + std::to_string(most) +
                      ", or a range such as " + example);
        return value;
    };
    const std::size_t dots = text.find("..");
    const std::uint32_t first = number(std::string_view(text).substr(0, dots));
    return {first, dots == std::string::npos ? first : number(std::string_view(text).substr(dots + 2))};
}

void TemplateFolders::addTo(CLI::App& verb)
{
    verb.add_option("--templates", folders,
                    "Folders in which template libraries are looked up, after the archetype's own; default: the "
                    "shipped Templates/ alone")
        ->check(CLI::ExistingDirectory)
        ->expected(1)
        ->take_all();
}

Archetype TemplateFolders::load(const std::filesystem::path& path) const
{
    ArchetypeFolders search;
    search.templates.assign(folders.begin(), folders.end());
    // The shipped libraries: beside the installed program, or in the source tree it was built from.
    std::error_code ignored;
    const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", ignored);
    for (const std::filesystem::path& candidate :
         {program.parent_path() / "../share/espalier/Templates", std::filesystem::path(ESPALIER_SOURCE_TEMPLATES)})
        if (std::filesystem::is_directory(candidate, ignored))
            search.templates.push_back(candidate.lexically_normal());
    return orFail(loadArchetype(path, search, authoringLimits()));
}

Species loadSpeciesFile(const std::filesystem::path& path)
{
    if (path.extension() == ".archetype")
        failUsage(path.string() + ": expected a .species file; `espalier infer " + path.string() + " -o " +
                  path.stem().string() + ".species` makes one");
    if (path.extension() != ".species")
        failEnding(path, ".species");
    return orFail(loadSpecies(path, authoringLimits()));
}

Grammar loadGrammarFile(const std::filesystem::path& path)
{
    if (path.extension() != ".lsys")
        failEnding(path, ".lsys");
    const Limits limits;
    return orFail(parseGrammar(orFail(readTextFile(path, limits.fileBytes)), path.string(), limits));
}

void addIterations(CLI::App& verb, std::optional<std::uint32_t>& iterations)
{
    verb.add_option(
            "-n,--iterations", iterations,
            "Steps of the derivation; default: what the grammar says, else 0 for a G.lsys and all for a species")
        ->check(CLI::Range(0u, 1'000'000u));
}

void addAttempt(CLI::App& verb, std::optional<std::uint32_t>& attempt)
{
    verb.add_option("--attempt", attempt,
                    "Of a species: take this attempt of the seed, whether it fits the window or not, so that an edit "
                    "changes no more than what it says; default: the first that fits, which `grow` tells")
        ->check(CLI::Range(0u, 1023u));
}

std::filesystem::path numberedPath(const std::filesystem::path& path, std::uint64_t seed, bool isRange)
{
    if (!isRange)
        return path;
    std::filesystem::path result = path;
    result.replace_filename(path.stem().string() + "-" + std::to_string(seed) + path.extension().string());
    return result;
}

Progress terminalProgress()
{
    Progress progress;
    if (isatty(STDERR_FILENO) == 0)
        return progress;
    progress.report = [](std::string_view stage, double done) {
        constexpr int kWidth = 32;
        const int filled = static_cast<int>(done * kWidth);
        std::fprintf(stderr, "\r%-12.*s [%.*s%*s] %3d %%", static_cast<int>(stage.size()), stage.data(), filled,
                     "################################", kWidth - filled, "", static_cast<int>(done * 100));
        if (done >= 1)
            std::fprintf(stderr, "\r%*s\r", 60, "");
    };
    return progress;
}

} // namespace espalier::tool
