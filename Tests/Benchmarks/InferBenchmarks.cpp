#include "Scenes.h"

#include <cmath>
#include <ctime>

namespace espalier {

namespace {

void infer(benchmark::State& state, const std::string& name, const std::string& preset)
{
    const Archetype& archetype = scenes::archetype(name);
    InferenceOptions options;
    options.preset = preset;
    std::uint64_t hash = 0;
    for (auto _ : state)
        hash = hashOf(inferSpecies({&archetype, 1}, options).value());
    scenes::label(state, hash);
    state.counters["instances"] = static_cast<double>(archetype.instances.size());
}

/// The rules alone: level and weight are given, so that few trial trees are grown.
void inferRules(benchmark::State& state)
{
    const Archetype& archetype = scenes::archetype(std::to_string(state.range(0)));
    InferenceOptions options;
    options.mergeWeight = 0.1;
    options.ruleWeight = 0;
    std::uint64_t hash = 0;
    for (auto _ : state)
        hash = hashOf(inferSpecies({&archetype, 1}, options).value());
    scenes::label(state, hash);
    state.SetComplexityN(state.range(0));
    state.SetItemsProcessed(state.iterations() * state.range(0));
}

/// The whole inference of a tree of so many instances, every choice made for it. `exponent`: 1 where the time grows as
/// the tree does; fitted to all sizes that were run so far, from 1,000 on, for below it the bars of relatives are
/// tried, which takes a time of its own. `ratio`: of the time an instance takes to that in a tree of 1,000 in the same
/// run.
void inferWhole(benchmark::State& state, samples::Repetition repetition)
{
    const auto instances = static_cast<std::uint32_t>(state.range(0));
    const Archetype archetype = samples::grownArchetype(Seed{1}, instances, repetition);
    Species species;
    const std::clock_t start = std::clock(); // of the processor: others may keep the machine busy
    for (auto _ : state)
        species = inferSpecies({&archetype, 1}).value();
    const double seconds =
        static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC / static_cast<double>(state.iterations());
    scenes::label(state, hashOf(species));
    state.counters["productions"] = static_cast<double>(species.grammar.productions.size());
    state.SetItemsProcessed(state.iterations() * instances);

    constexpr std::uint32_t kFirst = 1000;
    static std::map<std::pair<samples::Repetition, std::uint32_t>, double> times;
    times[{repetition, instances}] = seconds;
    double count = 0;
    double x = 0;
    double y = 0;
    double xx = 0;
    double xy = 0;
    for (const auto& [scene, time] : times)
        if (scene.first == repetition && scene.second >= kFirst)
        {
            const double size = std::log(scene.second);
            ++count;
            x += size;
            y += std::log(time);
            xx += size * size;
            xy += size * std::log(time);
        }
    if (count > 1)
        state.counters["exponent"] = (count * xy - x * y) / (count * xx - x * x);
    if (const auto first = times.find({repetition, kFirst}); first != times.end())
        state.counters["ratio"] = seconds / instances / (first->second / kFirst);
}

void sizes(benchmark::internal::Benchmark* benchmark)
{
    for (std::int64_t instances = 100; instances <= 1'000'000; instances *= 10)
        benchmark->Arg(instances);
}

BENCHMARK_CAPTURE(infer, thesis_kin, "thesis", "kin")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(infer, thesis_helberg, "thesis", "helberg")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(infer, oak_kin, "oak", "kin")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(infer, oak_helberg, "oak", "helberg")->Unit(benchmark::kMillisecond);
BENCHMARK(inferRules)
    ->RangeMultiplier(10)
    ->Range(1000, 100000)
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond)
    ->Complexity();

BENCHMARK_CAPTURE(inferWhole, copied, samples::Repetition::Copied)
    ->Apply(sizes)
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(inferWhole, distinct, samples::Repetition::Distinct)
    ->Apply(sizes)
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);

} // namespace

} // namespace espalier
