#include "Scenes.h"

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

} // namespace

} // namespace espalier
