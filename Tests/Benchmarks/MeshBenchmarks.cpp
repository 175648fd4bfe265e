#include "Scenes.h"

#include <cstring>

namespace espalier {

namespace {

void meshTree(benchmark::State& state, const std::string& name)
{
    const Skeleton& skeleton = scenes::skeleton(name);
    const BarkAppearance& bark = scenes::species(name).appearance.bark;
    TubeScratch scratch;
    TreeMesh mesh;
    for (auto _ : state)
    {
        mesh.clear();
        if (meshTubes(skeleton, bark, {}, {}, scratch, mesh) != MeshResult::Ok)
            state.SkipWithError("not meshed");
        benchmark::DoNotOptimize(mesh.positions.data());
    }
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(mesh.positions.size()));
    scenes::label(state, hashOf(mesh));
}

template <class T>
void copyBytes(const std::vector<T>& from, std::vector<T>& to)
{
    std::memcpy(to.data(), from.data(), from.size() * sizeof(T));
    benchmark::DoNotOptimize(to.data());
    benchmark::ClobberMemory();
}

/// memcpy of the same bytes: the limit of this machine (GOALS 3).
void copyMesh(benchmark::State& state, const std::string& name)
{
    const TreeMesh& from = scenes::mesh(name);
    TreeMesh to = from;
    for (auto _ : state)
    {
        copyBytes(from.positions, to.positions);
        copyBytes(from.normals, to.normals);
        copyBytes(from.tangents, to.tangents);
        copyBytes(from.uvs, to.uvs);
        copyBytes(from.indices, to.indices);
    }
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(from.positions.size()));
    scenes::label(state, hashOf(to));
}

BENCHMARK_CAPTURE(meshTree, thesis, "thesis")->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(meshTree, oak, "oak")->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(meshTree, random10000, "10000")->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(copyMesh, thesis, "thesis")->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(copyMesh, oak, "oak")->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(copyMesh, random10000, "10000")->Unit(benchmark::kMicrosecond);

} // namespace

} // namespace espalier
