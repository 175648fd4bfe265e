// Reads `.lsys` texts. What is read prints to a text that reads back the same, keeps its forecast, derives within its
// limits, the same by every way, and is drawn to a sound skeleton or an error.

#include "Fuzzing.h"

#include <Espalier/Grammar/Derivation.h>
#include <Espalier/Grammar/Forecast.h>
#include <Espalier/Grammar/Inspection.h>
#include <Espalier/Plant/Skeleton.h>
#include <Espalier/Turtle/SegmentTurtle.h>
#include <Espalier/Turtle/Turtle.h>
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
    std::uint64_t count = 0;
    std::int64_t open = 0;

    bool modules(std::span<const LetterId> letters, std::span<const double>) override
    {
        count += letters.size();
        return true;
    }
    void beginInstance(std::uint32_t, std::uint32_t) override { ++open; }
    void endInstance() override { --open; }
};

class Collector final : public DerivationSink
{
public:
    Word word;

    bool modules(std::span<const LetterId> letters, std::span<const double> arguments) override
    {
        word.letters.insert(word.letters.end(), letters.begin(), letters.end());
        word.arguments.insert(word.arguments.end(), arguments.begin(), arguments.end());
        return true;
    }
};

void deriveBySteps(const GrammarProgram& program, std::uint32_t steps)
{
    Limits limits;
    limits.modules = 20000;
    limits.derivationWork = 200000;
    limits.nodes = 5000;
    limits.vertices = 5000;
    const RandomKey key{Seed{1}};
    const Forecast price = forecast(program, steps, limits.modules);
    DerivationScratch scratch;
    Word word;
    const auto done = deriveWord(program, key, steps, limits, scratch, word);
    if (!done)
        return;
    const auto length = static_cast<double>(word.letters.size());
    if (price.steps.size() == steps + 1)
        fuzzing::promise(price.steps.back().least <= length && length <= price.steps.back().most,
                         "a word is as long as forecast");
    fuzzing::promise(!price.isExact || price.steps.size() <= steps || price.steps.back().least == length,
                     "an exact forecast is exact");
    Collector drawn;
    if (program.isContextFree())
    {
        Collector streamed;
        const auto plain = streamWord(program, key, steps, Interpretation::None, limits, scratch, streamed);
        fuzzing::promise(!plain || streamed.word == word, "a stream gives the word");
        if (!streamWord(program, key, steps, Interpretation::Apply, limits, scratch, drawn))
            return;
    }
    else if (!emitWord(program, steps, Interpretation::Apply, limits, scratch, word, drawn))
        return;
    const TurtleAlphabet alphabet(program);
    TurtleScratch turtleScratch;
    Skeleton skeleton;
    Turtle turtle(turtleSettings(program.grammar()), limits, turtleScratch, skeleton);
    (void)turtle.apply(alphabet, drawn.word.letters, drawn.word.arguments);
    const bool isDrawn = turtle.finish().has_value();
    fuzzing::promise(isDrawn ? isSound(skeleton) : skeleton.empty(), "what is drawn is sound");

    // Lines alone: into a buffer, small pieces, and with reuse.
    std::vector<TurtleSegment> segments(5000);
    const auto lines =
        drawSegments(program, alphabet, key, steps, SegmentReuse::Never, limits, scratch, turtleScratch, segments);
    fuzzing::promise(!isDrawn || (lines && *lines == skeleton.size()), "lines are those of the skeleton");
    const auto reused =
        drawSegments(program, alphabet, key, steps, SegmentReuse::WhereItCan, limits, scratch, turtleScratch, segments);
    fuzzing::promise(!isDrawn || (reused && *reused == skeleton.size()), "reuse draws as many lines");
    std::size_t passed = 0;
    const auto pieces = drawSegments(program, alphabet, key, steps, SegmentReuse::Never, limits, scratch, turtleScratch,
                                     std::span(segments).first(7), [&](std::span<const TurtleSegment> piece) {
                                         passed += piece.size();
                                         return true;
                                     });
    fuzzing::promise(!isDrawn || (pieces && passed == skeleton.size()), "pieces are the whole");
}

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
    (void)inspect(*program);
    for (const std::uint32_t steps : {0u, 1u, 3u, std::min(grammar->iterations.value_or(6), 40u)})
        deriveBySteps(*program, steps);
    if (!program->isContextFree())
        return 0;
    constexpr DerivationBudget kBudget{.productions = 2000, .depth = 40, .modules = 20000};
    DerivationScratch scratch;
    Counter counter;
    if (const auto done = deriveToEnd(*program, RandomKey(Seed{1}), kBudget, scratch, counter); done)
        fuzzing::promise(counter.open == 0, "every instance that begins ends");
    fuzzing::promise(counter.count <= 2 * std::uint64_t{kBudget.modules}, "a derivation keeps its budget");
    return 0;
}
