#pragma once

#include <CLI/CLI.hpp>
#include <Espalier/Archetype/Archetype.h>
#include <Espalier/Core/Error.h>
#include <Espalier/Core/Progress.h>
#include <Espalier/Grammar/Grammar.h>
#include <Espalier/Species/Species.h>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

// What the verbs of the command share. One verb a file: each adds itself to the command line and says what it does.

namespace espalier::tool {

/// Exit codes.
inline constexpr int kGood = 0;
inline constexpr int kOther = 1;
inline constexpr int kUsage = 2;
inline constexpr int kBadInput = 3;

/// How a verb ends early: the message goes to stderr, the code to the shell.
struct Failure
{
    int code;
    std::string message;
};

/// Throws the Failure that tells of `error`.
[[noreturn]] void fail(const Error& error);
[[noreturn]] void failUsage(const std::string& message);

/// The value, or the Failure that tells of its error.
template <class T>
T orFail(Expected<T> expected)
{
    if (!expected)
        fail(expected.error());
    if constexpr (!std::is_void_v<T>)
        return std::move(*expected);
}

/// What kind of file a verb was given, by its ending.
enum class InputKind : std::uint8_t
{
    Archetype,
    Species,
    Grammar, ///< .lsys
};

/// Any other ending fails: "Birch: expected a file that ends in ENDINGS", and what was perhaps meant.
[[nodiscard]] InputKind kindOf(const std::filesystem::path& path,
                               std::string_view endings = ".archetype, .species or .lsys");

/// Fails as kindOf does.
[[noreturn]] void failEnding(const std::filesystem::path& path, std::string_view endings);

/// The value, or the Failure that tells of its error in the file of a grammar, or in that of a species, whose grammar's
/// line it names.
template <class T>
T orFailIn(const std::string& path, Expected<T> expected)
{
    if (!expected && expected.error().where.file.empty())
    {
        Error& error = expected.error();
        error.where.file = path;
        if (kindOf(path) != InputKind::Grammar)
        {
            if (error.where.line > 0)
                error.what = "line " + std::to_string(error.where.line) + " of the grammar: " + error.what;
            error.where = {path, 0, 0};
        }
    }
    return orFail(std::move(expected));
}

/// `--seed N`, `--seed A..B`, or the drawn tree itself: `--seed exemplar`, `--seed exemplar:2` of several.
struct SeedRange
{
    std::uint64_t first = 1;
    std::uint64_t last = 1;
    bool isRange = false;
    std::optional<std::uint32_t> exemplar{}; ///< Which drawn tree; `first` and `last` then mean nothing.

    [[nodiscard]] std::uint64_t count() const { return last - first + 1; }
};

[[nodiscard]] SeedRange parseSeeds(const std::string& text);

/// First and last of `N` or `A..B`, as they are written. Anything but whole numbers up to `most` fails: "OPTION TEXT:
/// expected a NOUN from 0 to MOST, or a range such as EXAMPLE".
[[nodiscard]] std::pair<std::uint32_t, std::uint32_t> parseRange(const std::string& option, const std::string& text,
                                                                 std::uint32_t most, const std::string& noun,
                                                                 const std::string& example);

/// Options every verb that reads archetypes has.
struct TemplateFolders
{
    std::vector<std::string> folders;
    void addTo(CLI::App& verb);
    [[nodiscard]] Archetype load(const std::filesystem::path& path) const;
};

/// A species from a `.species` file.
[[nodiscard]] Species loadSpeciesFile(const std::filesystem::path& path);

/// A grammar from a `.lsys` file.
[[nodiscard]] Grammar loadGrammarFile(const std::filesystem::path& path);

/// `-n N`, the number of derivation steps.
void addIterations(CLI::App& verb, std::optional<std::uint32_t>& iterations);

/// `--attempt N`, the attempt to take instead of the first that fits.
void addAttempt(CLI::App& verb, std::optional<std::uint32_t>& attempt);

/// `oak.glb` for a single seed, `oak-7.glb` for seed 7 of a range.
[[nodiscard]] std::filesystem::path numberedPath(const std::filesystem::path& path, std::uint64_t seed, bool isRange);

/// A progress bar on stderr if that is a terminal; nothing otherwise.
[[nodiscard]] Progress terminalProgress();

void addAppearance(CLI::App& app);
void addCheck(CLI::App& app);
void addCompare(CLI::App& app);
void addDerive(CLI::App& app);
void addFit(CLI::App& app);
void addInfer(CLI::App& app);
void addGrammar(CLI::App& app);
void addGrow(CLI::App& app);
void addMeasure(CLI::App& app);
void addOverlap(CLI::App& app);
void addRender(CLI::App& app);

} // namespace espalier::tool
