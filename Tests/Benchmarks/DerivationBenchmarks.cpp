// L-systems: derivation and turtle, each beside the straightforward program that a reader of a textbook writes and the
// fastest special-purpose one we know how to write. The label is a hash of the result: equal for equal work.

#include "Scenes.h"

#include <Espalier/Core/Hash.h>
#include <Espalier/Grammar/Derivation.h>
#include <Espalier/Turtle/SegmentTurtle.h>
#include <cmath>
#include <cstring>
#include <functional>
#include <stack>
#include <unordered_map>

namespace espalier {

namespace {

constexpr const char* kFractalPlant = "axiom: X\nX -> F+[[X]-X]-F[-FX]+X\nF -> FF\n";
constexpr const char* kTernaryTree = "let d1 = 94.74\nlet d2 = 132.63\nlet a = 18.95\nlet lr = 1.109\nlet vr = 1.732\n"
                                     "axiom: !(1)F(200)/(45)A\n"
                                     "A -> !(vr)F(50)[&(a)F(50)A]/(d1)[&(a)F(50)A]/(d2)[&(a)F(50)A]\n"
                                     "F(l) -> F(l*lr)\n"
                                     "!(w) -> !(w*vr)\n";
constexpr const char* kHogewegHesper = "ignore: + - F\naxiom: F1F1F1\n"
                                       "0 < 0 > 0 -> 0\n0 < 0 > 1 -> 1[+F1F1]\n0 < 1 > 0 -> 1\n0 < 1 > 1 -> 1\n"
                                       "1 < 0 > 0 -> 0\n1 < 0 > 1 -> 1F1\n1 < 1 > 0 -> 0\n1 < 1 > 1 -> 0\n"
                                       "+ -> -\n- -> +\n";
constexpr const char* kStochasticPlant = "axiom: F\nF -> F[+F]F[-F]F : 0.33\nF -> F[+F]F : 0.33\nF -> F[-F]F : 0.34\n";

/// Room for whatever the benchmarks ask for.
Limits generous()
{
    Limits limits;
    limits.modules = 1u << 30;
    limits.derivationWork = 0xffffffffu;
    limits.arguments = 1u << 30;
    limits.nodes = 1u << 28;
    limits.coordinate = 1e9;
    return limits;
}

GrammarProgram programOf(const char* text)
{
    return GrammarProgram::make(parseGrammar(text, "benchmark", {}).value()).value();
}

std::uint64_t hashOfText(std::string_view text)
{
    Hash64 hash;
    hash.bytes(text);
    return hash.result();
}

std::uint32_t stepsOf(const benchmark::State& state)
{
    return static_cast<std::uint32_t>(state.range(0));
}

// Context-free, without parameters: the fractal plant.

void deriveFractalPlant(benchmark::State& state)
{
    const GrammarProgram program = programOf(kFractalPlant);
    const Limits limits = generous();
    DerivationScratch scratch;
    Word word;
    for (auto _ : state)
    {
        (void)deriveWord(program, RandomKey(Seed{1}), stepsOf(state), limits, scratch, word);
        benchmark::DoNotOptimize(word.letters.data());
    }
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(word.letters.size()));
    scenes::label(state, hashOfText(printWord(program, word)));
}

/// A map from characters to words, a new string each step.
void deriveFractalPlantStraightforwardly(benchmark::State& state)
{
    const std::unordered_map<char, std::string> rules = {{'X', "F+[[X]-X]-F[-FX]+X"}, {'F', "FF"}};
    std::string word;
    for (auto _ : state)
    {
        word = "X";
        for (std::uint32_t step = 0; step < stepsOf(state); ++step)
        {
            std::string next;
            for (const char symbol : word)
            {
                const auto rule = rules.find(symbol);
                if (rule == rules.end())
                    next += symbol;
                else
                    next += rule->second;
            }
            word = std::move(next);
        }
        benchmark::DoNotOptimize(word.data());
    }
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(word.size()));
    scenes::label(state, hashOfText(word));
}

/// A table of bytes, words sized exactly before they are written, copies of a fixed 32 bytes, memory reused.
void deriveFractalPlantByByteTable(benchmark::State& state)
{
    struct Entry
    {
        char text[32];
        std::size_t length;
    };
    std::vector<Entry> table(256);
    for (std::size_t c = 0; c < 256; ++c)
        table[c] = {{static_cast<char>(c)}, 1};
    const auto rule = [&](char symbol, std::string_view text) {
        std::memcpy(table[static_cast<unsigned char>(symbol)].text, text.data(), text.size());
        table[static_cast<unsigned char>(symbol)].length = text.size();
    };
    rule('X', "F+[[X]-X]-F[-FX]+X");
    rule('F', "FF");
    std::vector<char> word, next;
    std::size_t size = 0;
    for (auto _ : state)
    {
        word.resize(std::max<std::size_t>(word.size(), 64));
        word[0] = 'X';
        size = 1;
        for (std::uint32_t step = 0; step < stepsOf(state); ++step)
        {
            std::size_t total = 0;
            for (std::size_t i = 0; i < size; ++i)
                total += table[static_cast<unsigned char>(word[i])].length;
            if (next.size() < total + 32)
                next.resize(total + 32);
            char* out = next.data();
            for (std::size_t i = 0; i < size; ++i)
            {
                const Entry& entry = table[static_cast<unsigned char>(word[i])];
                std::memcpy(out, entry.text, 32);
                out += entry.length;
            }
            std::swap(word, next);
            size = total;
        }
        benchmark::DoNotOptimize(word.data());
    }
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(size));
    scenes::label(state, hashOfText({word.data(), size}));
}

// Parametric: the ternary tree, rules known at run time only.

void deriveTernaryTree(benchmark::State& state)
{
    const GrammarProgram program = programOf(kTernaryTree);
    const Limits limits = generous();
    DerivationScratch scratch;
    Word word;
    for (auto _ : state)
    {
        (void)deriveWord(program, RandomKey(Seed{1}), stepsOf(state), limits, scratch, word);
        benchmark::DoNotOptimize(word.arguments.data());
    }
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(word.letters.size()));
    scenes::label(state, hashOfText(printWord(program, word)));
}

/// Modules with vectors of parameters, rules as functions.
void deriveTernaryTreeStraightforwardly(benchmark::State& state)
{
    struct TextModule
    {
        char symbol;
        std::vector<float> parameters;
    };
    using TextWord = std::vector<TextModule>;
    const float lr = 1.109f, vr = 1.732f, a = 18.95f, d1 = 94.74f, d2 = 132.63f;
    std::unordered_map<char, std::function<TextWord(const std::vector<float>&)>> rules;
    rules['A'] = [&](const std::vector<float>&) {
        TextWord word = {{'!', {vr}}, {'F', {50}}};
        for (const float d : {d1, d2, 0.f})
        {
            for (const TextModule& module : TextWord{{'[', {}}, {'&', {a}}, {'F', {50}}, {'A', {}}, {']', {}}})
                word.push_back(module);
            if (d != 0)
                word.push_back({'/', {d}});
        }
        return word;
    };
    rules['F'] = [&](const std::vector<float>& p) { return TextWord{{'F', {p[0] * lr}}}; };
    rules['!'] = [&](const std::vector<float>& p) { return TextWord{{'!', {p[0] * vr}}}; };
    TextWord word;
    for (auto _ : state)
    {
        word = {{'!', {1}}, {'F', {200}}, {'/', {45}}, {'A', {}}};
        for (std::uint32_t step = 0; step < stepsOf(state); ++step)
        {
            TextWord next;
            for (const TextModule& module : word)
            {
                const auto rule = rules.find(module.symbol);
                if (rule == rules.end())
                    next.push_back(module);
                else
                    for (TextModule& written : rule->second(module.parameters))
                        next.push_back(std::move(written));
            }
            word = std::move(next);
        }
        benchmark::DoNotOptimize(word.data());
    }
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(word.size()));
    Hash64 hash;
    for (const TextModule& module : word)
        hash.value(module.symbol);
    scenes::label(state, hash.result());
}

// Context-sensitive and stochastic.

void derive(benchmark::State& state, const char* text)
{
    const GrammarProgram program = programOf(text);
    const Limits limits = generous();
    DerivationScratch scratch;
    Word word;
    std::uint64_t work = 0;
    for (auto _ : state)
    {
        (void)deriveWord(program, RandomKey(Seed{1}), stepsOf(state), limits, scratch, word);
        benchmark::DoNotOptimize(word.letters.data());
        work = scratch.work;
    }
    // All steps together: a context-sensitive word must be looked at anew each time.
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(work));
    scenes::label(state, hashOfText(printWord(program, word)));
}

// The turtle: 32-byte segments into a buffer of the caller's.

Word wordOf(const GrammarProgram& program, std::uint32_t steps)
{
    DerivationScratch scratch;
    Word word;
    (void)deriveWord(program, RandomKey(Seed{1}), steps, generous(), scratch, word);
    return word;
}

std::uint64_t hashOfSegments(std::span<const TurtleSegment> segments, float grid)
{
    // Rounded to a grid, so that different arithmetic gives the same hash.
    Hash64 hash;
    for (const TurtleSegment& segment : segments)
    {
        for (const float value : {segment.start.x, segment.start.y, segment.end.x, segment.end.y})
            hash.value(static_cast<std::int64_t>(std::floor(value / grid + 0.3137f)));
        hash.value(segment.parent);
    }
    return hash.result();
}

constexpr float kGrid = 0.37f;

/// A grammar whose word is written out, so that only the turtle works.
void drawFractalPlant(benchmark::State& state)
{
    const GrammarProgram source = programOf(kFractalPlant);
    const std::string text = printWord(source, wordOf(source, stepsOf(state)));
    Limits limits = generous();
    limits.templateModules = 1u << 30;
    limits.grammarParts = 1u << 30;
    limits.fileBytes = std::size_t{1} << 30;
    const GrammarProgram program =
        GrammarProgram::make(parseGrammar("axiom: " + text + "\n", "benchmark", limits).value()).value();
    const TurtleAlphabet alphabet(program);
    std::vector<TurtleSegment> segments(static_cast<std::size_t>(std::ranges::count(text, 'F')));
    DerivationScratch scratch;
    TurtleScratch turtle;
    for (auto _ : state)
    {
        (void)drawSegments(program, alphabet, RandomKey(Seed{1}), 0, SegmentReuse::Never, limits, scratch, turtle,
                           segments);
        benchmark::DoNotOptimize(segments.data());
    }
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(segments.size()));
    scenes::label(state, hashOfSegments(segments, kGrid));
}

/// The turtle of a textbook: sine and cosine at every turn, a stack of states, push_back.
void drawFractalPlantStraightforwardly(benchmark::State& state)
{
    const GrammarProgram source = programOf(kFractalPlant);
    const std::string text = printWord(source, wordOf(source, stepsOf(state)));
    struct State
    {
        DVec3 position{0, 0, 0};
        DVec3 heading{0, 1, 0};
        DVec3 left{-1, 0, 0};
        DVec3 up{0, 0, 1};
        std::uint32_t segment = 0xffffffffu;
    };
    std::vector<TurtleSegment> segments;
    for (auto _ : state)
    {
        segments.clear();
        std::stack<State> stack;
        State s;
        const auto turn = [&](double degrees) {
            const double angle = degrees * 3.14159265358979323846 / 180;
            const DVec3 heading = s.heading * std::cos(angle) + s.left * std::sin(angle);
            s.left = s.left * std::cos(angle) - s.heading * std::sin(angle);
            s.heading = heading;
        };
        for (const char symbol : text)
            switch (symbol)
            {
            case 'F':
            {
                const DVec3 start = s.position;
                s.position += s.heading;
                segments.push_back({Vec3(start), 0.05f, Vec3(s.position), s.segment});
                s.segment = static_cast<std::uint32_t>(segments.size() - 1);
                break;
            }
            case '+':
                turn(25);
                break;
            case '-':
                turn(-25);
                break;
            case '[':
                stack.push(s);
                break;
            case ']':
                s = stack.top();
                stack.pop();
                break;
            default:
                break;
            }
        benchmark::DoNotOptimize(segments.data());
    }
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(segments.size()));
    scenes::label(state, hashOfSegments(segments, kGrid));
}

/// Writing so many segments and nothing else: what no turtle can be faster than.
void writeSegments(benchmark::State& state)
{
    const auto count = static_cast<std::size_t>(state.range(0));
    std::vector<TurtleSegment> segments(count);
    Vec3 at{0};
    for (auto _ : state)
    {
        at = Vec3(0);
        for (std::size_t i = 0; i < count; ++i)
        {
            const Vec3 next = at + Vec3(0.1f, 1.f, 0.f);
            segments[i] = {at, 0.05f, next, static_cast<std::uint32_t>(i) - 1};
            at = next;
        }
        benchmark::DoNotOptimize(segments.data());
        benchmark::ClobberMemory();
    }
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(count));
    scenes::label(state, hashOfSegments(segments, kGrid));
}

void growSegments(benchmark::State& state, const char* text, SegmentReuse reuse)
{
    const GrammarProgram program = programOf(text);
    const TurtleAlphabet alphabet(program);
    const Limits limits = generous();
    DerivationScratch scratch;
    TurtleScratch turtle;
    std::vector<TurtleSegment> segments(8u << 20);
    std::size_t count = 0;
    for (auto _ : state)
    {
        count = drawSegments(program, alphabet, RandomKey(Seed{1}), stepsOf(state), reuse, limits, scratch, turtle,
                             segments)
                    .value_or(0);
        benchmark::DoNotOptimize(segments.data());
    }
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(count));
    scenes::label(state, hashOfSegments(std::span(segments).first(count), kGrid));
}

BENCHMARK(deriveFractalPlantStraightforwardly)->Arg(8)->Arg(10)->Unit(benchmark::kMicrosecond);
BENCHMARK(deriveFractalPlantByByteTable)->Arg(8)->Arg(10)->Unit(benchmark::kMicrosecond);
BENCHMARK(deriveFractalPlant)->Arg(8)->Arg(10)->Unit(benchmark::kMicrosecond);
BENCHMARK(deriveTernaryTreeStraightforwardly)->Arg(10)->Unit(benchmark::kMicrosecond);
BENCHMARK(deriveTernaryTree)->Arg(10)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(derive, contextSensitive, kHogewegHesper)->Arg(30)->Arg(45)->Arg(60)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(derive, stochastic, kStochasticPlant)->Arg(8)->Unit(benchmark::kMicrosecond);
BENCHMARK(writeSegments)->Arg(97920)->Unit(benchmark::kMicrosecond);
BENCHMARK(drawFractalPlantStraightforwardly)->Arg(4)->Arg(8)->Unit(benchmark::kMicrosecond);
BENCHMARK(drawFractalPlant)->Arg(4)->Arg(8)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(growSegments, fractalPlant, kFractalPlant, SegmentReuse::Never)
    ->Arg(8)
    ->Arg(10)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(growSegments, fractalPlantReused, kFractalPlant, SegmentReuse::WhereItCan)
    ->Arg(8)
    ->Arg(10)
    ->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(growSegments, ternaryTree, kTernaryTree, SegmentReuse::Never)->Arg(8)->Unit(benchmark::kMicrosecond);

} // namespace

} // namespace espalier
