// Reads `.lsys` texts. What is read prints to a text that reads back the same, and derives within its budget.

#include "Fuzzing.h"

#include <Espalier/Grammar/Derivation.h>
#include <algorithm>

using namespace espalier;

namespace {

/// Two rows for each table that the grammar names.
std::vector<TransformTable> tablesFor(const Grammar& grammar)
{
    std::vector<TransformTable> tables;
    for (const Production& production : grammar.productions)
        if (!production.table.empty() &&
            std::ranges::find(tables, production.table, &TransformTable::name) == tables.end())
            tables.push_back({production.table, {{1, 0, 45, 0}, {0.5, 20, 30, 90}}, {0.1, 5, 5, 5}});
    return tables;
}

class Counter final : public DerivationSink
{
public:
    std::uint64_t modules = 0;
    std::int64_t open = 0;

    bool module(SymbolId, std::span<const double>) override
    {
        ++modules;
        return true;
    }
    void beginInstance(std::uint32_t, std::uint32_t) override { ++open; }
    void endInstance() override { --open; }
};

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size)
{
    const auto grammar = parseGrammar(fuzzing::textOf(data, size), "fuzz.lsys", {});
    if (!grammar)
        return 0;
    const std::string printed = printGrammar(*grammar);
    const auto again = parseGrammar(printed, "printed.lsys", {});
    fuzzing::promiseValue(again, "a printed grammar reads back");
    fuzzing::promise(printGrammar(*again) == printed, "a printed grammar reads back the same");

    const auto program = GrammarProgram::make(*grammar, tablesFor(*grammar));
    if (!program)
        return 0;
    constexpr DerivationBudget kBudget{.productions = 2000, .depth = 40, .modules = 20000};
    DerivationScratch scratch;
    Counter counter;
    if (const auto done = derive(*program, RandomKey(Seed{1}), kBudget, scratch, counter); done)
        fuzzing::promise(counter.open == 0, "every instance that begins ends");
    fuzzing::promise(counter.modules <= 2 * std::uint64_t{kBudget.modules}, "a derivation keeps its budget");
    return 0;
}
