#include "Scenes.h"

namespace espalier {

namespace {

void growTree(benchmark::State& state, const std::string& name)
{
    const Grower grower = Grower::make(scenes::species(name)).value();
    GrowScratch scratch;
    Skeleton skeleton;
    std::uint64_t seed = 0;
    std::int64_t segments = 0;
    for (auto _ : state)
    {
        if (!grower.grow(Seed{++seed % 64}, {}, scratch, skeleton))
            state.SkipWithError("not grown");
        segments += skeleton.size();
    }
    state.SetItemsProcessed(segments);
    if (grower.grow(Seed{1}, {}, scratch, skeleton))
        scenes::label(state, hashOf(skeleton));
}

/// Writing a skeleton as large as those grown, array by array: what growing cannot be faster than.
void copySkeleton(benchmark::State& state, const std::string& name)
{
    const Skeleton& from = scenes::skeleton(name);
    Skeleton to = from;
    for (auto _ : state)
    {
        to = from;
        benchmark::DoNotOptimize(to.ends.data());
    }
    state.SetItemsProcessed(state.iterations() * from.size());
    scenes::label(state, hashOf(to));
}

BENCHMARK_CAPTURE(growTree, thesis, "thesis")->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(growTree, oak, "oak")->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(growTree, random10000, "10000")->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(copySkeleton, oak, "oak")->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(copySkeleton, random10000, "10000")->Unit(benchmark::kMicrosecond);

} // namespace

} // namespace espalier
