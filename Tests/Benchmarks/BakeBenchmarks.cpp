#include "Scenes.h"

#include <Espalier/Bake/Gltf.h>
#include <Espalier/Core/Hash.h>
#include <cstdio>
#include <memory>

namespace espalier {

namespace {

std::uint64_t hashOf(const std::string& bytes)
{
    Hash64 hash;
    hash.bytes(bytes);
    return hash.result();
}

void bake(benchmark::State& state, const std::string& name)
{
    const TreeMesh& mesh = scenes::mesh(name);
    std::string bytes;
    for (auto _ : state)
        bytes = bakeGlb(mesh, scenes::species(name).appearance, {name, 0, Seed{1}}).value();
    state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(bytes.size()));
    state.counters["vertices"] = static_cast<double>(mesh.positions.size());
    scenes::label(state, hashOf(bytes));
}

/// fwrite of the same bytes: what a bake is held against (GOALS 3).
void writeBytes(benchmark::State& state, const std::string& name)
{
    const std::string bytes = bakeGlb(scenes::mesh(name), scenes::species(name).appearance, {name, 0, Seed{1}}).value();
    for (auto _ : state)
    {
        const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::tmpfile(), std::fclose);
        if (!file || std::fwrite(bytes.data(), 1, bytes.size(), file.get()) != bytes.size())
            state.SkipWithError("not written");
    }
    state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(bytes.size()));
    scenes::label(state, hashOf(bytes));
}

BENCHMARK_CAPTURE(bake, oak, "oak")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(bake, random10000, "10000")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(writeBytes, oak, "oak")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(writeBytes, random10000, "10000")->Unit(benchmark::kMillisecond);

} // namespace

} // namespace espalier
