#include "Scenes.h"

#include <Espalier/Core/Hash.h>
#include <Espalier/Overlap/BroadPhase.h>
#include <Espalier/Overlap/Overlap.h>
#include <algorithm>
#include <mutex>

namespace espalier {

namespace {

std::uint64_t hashOf(const OverlapReport& report)
{
    Hash64 hash;
    for (const Overlap& overlap : report.overlaps)
    {
        hash.value(overlap.first);
        hash.value(overlap.second);
        hash.value(overlap.depth);
    }
    return hash.result();
}

void overlaps(benchmark::State& state, const std::string& name, decltype(&findOverlaps) find)
{
    const Skeleton& skeleton = scenes::skeleton(name);
    OverlapReport report;
    for (auto _ : state)
        report = find(skeleton, OverlapSettings{}).value();
    state.SetItemsProcessed(state.iterations() * skeleton.size());
    state.counters["segments"] = skeleton.size();
    scenes::label(state, hashOf(report));
}

/// The candidates alone: boxes of the segments, pairs that touch.
void touchingPairs(benchmark::State& state, const std::string& name, decltype(&visitTouchingPairs) visit)
{
    const Skeleton& skeleton = scenes::skeleton(name);
    std::vector<Box> boxes;
    for (std::uint32_t i = 0; i < skeleton.size(); ++i)
    {
        const Vec3 start(skeleton.startRadii[i]);
        const Vec3 end(skeleton.endRadii[i]);
        boxes.push_back({glm::min(skeleton.starts[i] - start, skeleton.ends[i] - end),
                         glm::max(skeleton.starts[i] + start, skeleton.ends[i] + end)});
    }
    std::vector<std::uint64_t> pairs;
    std::mutex mutex;
    for (auto _ : state)
    {
        pairs.clear();
        const bool whole = visit(boxes, [&](std::span<const BoxPair> batch) {
            const std::scoped_lock lock(mutex);
            for (const BoxPair& pair : batch)
                pairs.push_back(std::uint64_t{std::min(pair.first, pair.second)} << 32 |
                                std::max(pair.first, pair.second));
        });
        if (!whole)
            state.SkipWithError("out of memory");
    }
    std::ranges::sort(pairs);
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
    Hash64 hash;
    hash.values(std::span<const std::uint64_t>(pairs));
    state.SetItemsProcessed(state.iterations() * skeleton.size());
    state.counters["pairs"] = static_cast<double>(pairs.size());
    scenes::label(state, hash.result());
}

BENCHMARK_CAPTURE(overlaps, oak, "oak", findOverlaps)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(overlaps, bush, "bush", findOverlaps)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(overlaps, bush_by_brute_force, "bush", findOverlapsBruteForce)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(overlaps, random10000, "10000", findOverlaps)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(touchingPairs, random10000, "10000", visitTouchingPairs)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(touchingPairs, random10000_by_tree, "10000", visitTouchingPairsByTree)->Unit(benchmark::kMillisecond);

} // namespace

} // namespace espalier
