#pragma once

#include <CLI/CLI.hpp>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <vector>

// What is wrong with a command line, told so that the next try is right.

namespace espalier::tool {

/// The name most like `word`; empty if none is like it.
[[nodiscard]] std::string nearestOf(std::string_view word, const std::vector<std::string>& names);

/// Fails where a word is no verb, an option is none of its verb's, or an option that takes a value is followed by
/// another option. CLI11 would tell of these too, but after what is missing, and without what was meant.
/// `words`: the command line without the program's name.
void checkWords(const CLI::App& app, std::span<const char* const> words);

/// `espalier help [VERB]`, where the words say so: the text, else nothing.
[[nodiscard]] std::string helpFor(CLI::App& app, std::span<const char* const> words);

/// What an option needs to have any effect.
struct OptionNeed
{
    const char* option;
    bool isMet;
    const char* need; ///< "--wind bones"
};

/// Fails for the first option that was given and lacks what it needs: "grow: --joints needs --wind bones". So no option
/// of any verb is without effect in silence.
void checkNeeds(const CLI::App& verb, std::initializer_list<OptionNeed> needs);

/// The first of these options that was given; empty if none was.
[[nodiscard]] std::string firstGiven(const CLI::App& verb, std::initializer_list<const char*> options);

} // namespace espalier::tool
