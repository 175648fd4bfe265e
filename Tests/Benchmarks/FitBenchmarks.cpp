// How long it takes to make an archetype of a skeleton that no template drew.

#include <Espalier/Core/Random.h>
#include <Espalier/Inference/Fit.h>
#include <Espalier/Plant/Axes.h>
#include <Plant/SampleSkeletons.h>
#include <benchmark/benchmark.h>

namespace espalier {

namespace {

/// Crooked branches of some twenty segments, as tracings have them, each at a random place of an earlier one.
Skeleton traced(std::uint32_t segments)
{
    Skeleton skeleton;
    const RandomKey key(Seed{1});
    std::uint32_t draw = 0;
    const auto next = [&](double low, double high) {
        return static_cast<float>(key.uniform(Purpose::Sampling, low, high, ++draw));
    };
    while (skeleton.size() < segments)
    {
        std::uint32_t from = skeleton.empty()
                                 ? kNoSegment
                                 : static_cast<std::uint32_t>(key.below(Purpose::Shuffle, skeleton.size(), ++draw));
        Vec3 step(0, 1, 0);
        const auto length = static_cast<int>(next(10, 30));
        for (int i = 0; i < length; ++i)
        {
            const float x = next(-0.4, 0.4);
            const float y = next(-0.4, 0.4);
            const float z = next(-0.4, 0.4);
            step = glm::normalize(step + Vec3(x, y, z));
            from = samples::grow(skeleton, from, step);
        }
    }
    completeAxes(skeleton, {});
    return skeleton;
}

void Fit(benchmark::State& state)
{
    const Skeleton skeleton = traced(static_cast<std::uint32_t>(state.range(0)));
    std::uint32_t instances = 0;
    for (auto _ : state)
    {
        const auto fitted = fitArchetype(skeleton);
        instances = fitted->report.instances;
    }
    state.counters["instances"] = instances;
    state.SetComplexityN(state.range(0));
}
BENCHMARK(Fit)->Arg(1000)->Arg(10000)->Arg(50000)->Unit(benchmark::kMillisecond)->Complexity();

} // namespace

} // namespace espalier
