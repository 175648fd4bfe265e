#include "Usage.h"

#include "Command.h"

#include <algorithm>
#include <numeric>

namespace espalier::tool {

namespace {

/// Letters to be put in, left out or changed to make one word of the other (Levenshtein); as many as `a` and `b` have
/// at most.
std::size_t editsBetween(std::string_view a, std::string_view b)
{
    std::vector<std::size_t> row(b.size() + 1);
    std::iota(row.begin(), row.end(), std::size_t{0});
    for (std::size_t i = 0; i < a.size(); ++i)
    {
        std::size_t diagonal = row[0];
        row[0] = i + 1;
        for (std::size_t j = 0; j < b.size(); ++j)
        {
            const std::size_t changed = diagonal + (a[i] == b[j] ? 0 : 1);
            diagonal = row[j + 1];
            row[j + 1] = std::min({changed, diagonal + 1, row[j] + 1});
        }
    }
    return row.back();
}

std::string didYouMean(std::string_view word, const std::vector<std::string>& names)
{
    const std::string nearest = nearestOf(word, names);
    return nearest.empty() ? "" : " (did you mean " + nearest + "?)";
}

std::vector<const CLI::App*> verbsOf(const CLI::App& app)
{
    return app.get_subcommands([](const CLI::App*) { return true; });
}

std::vector<std::string> namesOf(const std::vector<const CLI::App*>& verbs)
{
    std::vector<std::string> names;
    for (const CLI::App* verb : verbs)
        names.push_back(verb->get_name());
    return names;
}

const CLI::App* verbOrFail(const CLI::App& app, const std::string& name)
{
    const auto verbs = verbsOf(app);
    const auto found = std::ranges::find(verbs, name, [](const CLI::App* verb) { return verb->get_name(); });
    if (found != verbs.end())
        return *found;
    const std::vector<std::string> names = namesOf(verbs);
    std::string all;
    for (const std::string& one : names)
        all += (all.empty() ? "" : one == names.back() ? " or " : ", ") + one;
    failUsage("espalier: there is no verb " + name + didYouMean(name, names) + "; expected " + all);
}

/// Whether a word of the command line is an option, not a value: `--lod`, `-o`, and neither `-1` nor `-`.
bool isOption(std::string_view word)
{
    return word.size() > 1 && word[0] == '-' && (word[1] < '0' || word[1] > '9') && word[1] != '.';
}

std::vector<std::string> optionsOf(const CLI::App& verb)
{
    std::vector<std::string> names;
    for (const CLI::Option* option : verb.get_options([](const CLI::Option*) { return true; }))
        for (const std::string& name : option->get_lnames())
            names.push_back("--" + name);
    return names;
}

/// `--lod` of `--lod=3`, `-n` of `-n3`.
std::string nameIn(const std::string& word)
{
    return word.starts_with("--") ? word.substr(0, word.find('=')) : word.substr(0, 2);
}

/// "cards or octahedral", "a number from 64 to 4096": what CLI11's text of the option's checks says; else "a value".
std::string valueOf(const CLI::Option& option)
{
    const std::string text = option.get_type_name();
    if (const auto open = text.find('{'); open != std::string::npos)
    {
        std::vector<std::string> choices = CLI::detail::split(text.substr(open + 1, text.find('}') - open - 1), ',');
        std::erase(choices, "none");
        std::string all;
        for (const std::string& choice : choices)
            all += (all.empty() ? "" : choice == choices.back() ? " or " : ", ") + choice;
        return all;
    }
    const auto open = text.find(" in [");
    const auto dash = text.find(" - ", open);
    if (open != std::string::npos && dash != std::string::npos)
        return "a number from " + text.substr(open + 5, dash - open - 5) + " to " +
               text.substr(dash + 3, text.find(']') - dash - 3);
    return "a value";
}

} // namespace

std::string nearestOf(std::string_view word, const std::vector<std::string>& names)
{
    std::string nearest;
    // Three in ten letters may be wrong, and two of short words: more is another word.
    std::size_t fewest = std::max<std::size_t>(2, word.size() * 3 / 10) + 1;
    for (const std::string& name : names)
        // What was begun and not finished is meant too: --transl.
        if (const std::size_t edits = word.size() > 3 && name.starts_with(word) ? 1 : editsBetween(word, name);
            edits < std::min(fewest, name.size()))
        {
            fewest = edits;
            nearest = name;
        }
    return nearest;
}

void checkWords(const CLI::App& app, std::span<const char* const> words)
{
    if (words.empty() || isOption(words[0]))
        return;
    const CLI::App& verb = *verbOrFail(app, words[0]);
    const CLI::Option* open = nullptr; // takes the next word
    const auto failIfOpen = [&] {
        if (open)
            failUsage(verb.get_name() + ": " + open->get_name() + " needs " + valueOf(*open));
    };
    for (const std::string word : words.subspan(1))
    {
        if (word == "--")
            break;
        if (!isOption(word))
        {
            open = nullptr;
            continue;
        }
        const std::string name = nameIn(word);
        const CLI::Option* option = verb.get_option_no_throw(name);
        failIfOpen();
        if (!option)
            failUsage(verb.get_name() + ": there is no option " + name + didYouMean(name, optionsOf(verb)) +
                      "; `espalier help " + verb.get_name() + "` tells of all");
        if (option->get_items_expected_min() > 0 && word == name)
            open = option;
    }
    failIfOpen();
}

std::string helpFor(CLI::App& app, std::span<const char* const> words)
{
    if (words.empty() || std::string_view(words[0]) != "help")
        return {};
    return words.size() == 1 ? app.help() : verbOrFail(app, words[1])->help("espalier");
}

void checkNeeds(const CLI::App& verb, std::initializer_list<OptionNeed> needs)
{
    for (const OptionNeed& need : needs)
        if (!need.isMet && verb.count(need.option) > 0)
            failUsage(verb.get_name() + ": " + need.option + " needs " + need.need);
}

std::string firstGiven(const CLI::App& verb, std::initializer_list<const char*> options)
{
    for (const char* option : options)
        if (verb.count(option) > 0)
            return option;
    return {};
}

} // namespace espalier::tool
