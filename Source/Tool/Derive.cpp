#include "Command.h"

#include <Espalier/Core/Json.h>
#include <Espalier/Grammar/Derivation.h>
#include <Espalier/Grammar/Forecast.h>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

namespace espalier::tool {

namespace {

struct DeriveCommand
{
    std::string grammar;
    std::string seeds = "1";
    std::optional<std::uint32_t> iterations;
    bool json = false;
    bool withoutWord = false;
};

/// How often each symbol occurs, in the order of the grammar.
nlohmann::ordered_json countsOf(const GrammarProgram& program, const Word& word)
{
    std::vector<std::uint64_t> counts(program.grammar().symbols.size(), 0);
    for (const LetterId letter : word.letters)
        ++counts[program.symbolOf(letter)];
    nlohmann::ordered_json json = nlohmann::ordered_json::object();
    for (SymbolId symbol = 0; symbol < counts.size(); ++symbol)
        if (counts[symbol] > 0)
            json[program.grammar().symbols.name(symbol)] = counts[symbol];
    return json;
}

void deriveWords(const DeriveCommand& command)
{
    const SeedRange range = parseSeeds(command.seeds);
    if (range.exemplar)
        failUsage("derive: a grammar holds no drawn tree; expected a seed");
    const Grammar grammar = loadGrammarFile(command.grammar);
    const std::uint32_t steps = command.iterations.value_or(grammar.iterations.value_or(0));
    const Limits limits;
    const GrammarProgram program = orFailIn(command.grammar, GrammarProgram::make(grammar));
    orFailIn(command.grammar, checkPrice(program, steps, limits));

    DerivationScratch scratch;
    Word word;
    if (command.json && range.isRange)
        std::cout << '[';
    for (std::uint64_t i = 0; i < range.count(); ++i)
    {
        const std::uint64_t seed = range.first + i;
        // The first attempt, as growing takes it: the word is that of the plant of this seed.
        const RandomKey key = RandomKey(Seed{seed}).child(0);
        orFailIn(command.grammar, deriveWord(program, key, steps, limits, scratch, word));
        if (!command.json)
        {
            std::cout << printWord(program, word) << '\n';
            continue;
        }
        nlohmann::ordered_json json;
        json["iterations"] = steps;
        json["seed"] = seed;
        json["length"] = word.letters.size();
        json["counts"] = countsOf(program, word);
        // The word may be as long as all the rest of memory: it is not held twice.
        std::string text = json.dump();
        if (!command.withoutWord)
        {
            text.pop_back();
            text += ",\"word\":" + quoteJson(printWord(program, word)) + "}";
        }
        std::cout << (i > 0 ? "," : "") << text;
    }
    if (command.json)
        std::cout << (range.isRange ? "]\n" : "\n");
}

} // namespace

void addDerive(CLI::App& app)
{
    const auto command = std::make_shared<DeriveCommand>();
    CLI::App* verb = app.add_subcommand("derive", "Derive a grammar and print the word, as it is before `interpret:`");
    verb->add_option("grammar", command->grammar, "G.lsys")->required();
    addIterations(*verb, command->iterations);
    verb->add_option("--seed", command->seeds, "A seed N, or a range A..B: one word a line")->capture_default_str();
    CLI::Option* json = verb->add_flag("--json", command->json,
                                       "One JSON document with length, counts and word; an array for a range of seeds");
    verb->add_flag("--no-word", command->withoutWord, "Leave the word out of it")->needs(json);
    verb->callback([command] { deriveWords(*command); });
}

} // namespace espalier::tool
