#include "Scenes.h"

#include <Espalier/Bake/Gltf.h>
#include <Espalier/Bake/Obj.h>
#include <Espalier/Core/File.h>
#include <Espalier/Core/Hash.h>
#include <Espalier/Mesh/VertexLayout.h>
#include <Render/HandMadeMesh.h>
#include <array>
#include <cstdio>
#include <filesystem>
#include <memory>

#include <unistd.h>

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

/// 1,000,000 vertices, 2 million triangles: what GOALS 3 counts in.
const TreeMesh& millionVertices()
{
    static const TreeMesh mesh = handMade({.sides = 99, .rings = 10000, .height = 20});
    return mesh;
}

std::filesystem::path scratchFile(const char* name)
{
    return std::filesystem::temp_directory_path() / (std::to_string(::getpid()) + name);
}

void writeMillion(benchmark::State& state, GltfEncoding encoding)
{
    const TreeMesh& mesh = millionVertices();
    const auto path = scratchFile("-million.glb");
    for (auto _ : state)
        if (!writeGlb(path, mesh, {}, {"tube", 0, Seed{1}}, {encoding}))
            state.SkipWithError("not written");
    const std::string bytes = readFile(path, std::size_t{1} << 30).value_or("");
    std::filesystem::remove(path);
    state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(bytes.size()));
    scenes::label(state, hashOf(bytes));
}

/// The same bytes from memory, by fwrite, flushed to disk and renamed: what writeMillion is held against.
void writeMillionBytes(benchmark::State& state)
{
    const std::string bytes = bakeGlb(millionVertices(), {}, {"tube", 0, Seed{1}}).value();
    const auto path = scratchFile("-bytes.glb");
    const auto temporary = scratchFile("-bytes.tmp");
    for (auto _ : state)
    {
        std::FILE* const file = std::fopen(temporary.c_str(), "wb");
        if (!file || std::fwrite(bytes.data(), 1, bytes.size(), file) != bytes.size() || std::fflush(file) != 0 ||
            ::fsync(::fileno(file)) != 0 || std::fclose(file) != 0)
            state.SkipWithError("not written");
        std::filesystem::rename(temporary, path);
    }
    std::filesystem::remove(path);
    state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(bytes.size()));
    scenes::label(state, hashOf(bytes));
}

void writeMillionObj(benchmark::State& state)
{
    const auto path = scratchFile("-million") / "tube.obj"; // names its materials
    std::filesystem::create_directories(path.parent_path());
    for (auto _ : state)
        if (!writeObj(path, millionVertices(), {}, {"tube", 0, Seed{1}}))
            state.SkipWithError("not written");
    const std::string bytes = readFile(path, std::size_t{1} << 30).value_or("");
    std::filesystem::remove_all(path.parent_path());
    state.SetBytesProcessed(state.iterations() * static_cast<std::int64_t>(bytes.size()));
    scenes::label(state, hashOf(bytes));
}

/// An engine's vertex of 24 bytes, into memory that is there.
void layOut(benchmark::State& state)
{
    const TreeMesh& mesh = millionVertices();
    const std::array<VertexAttributeFormat, 4> attributes{
        {{VertexSemantic::Position, VertexFormat::Float32x3, 0},
         {VertexSemantic::Normal, VertexFormat::Snorm8x4, 12},
         {VertexSemantic::Tangent, VertexFormat::Snorm8x4, 16},
         {VertexSemantic::TextureCoordinate, VertexFormat::Float16x2, 20}}};
    const VertexLayout layout{24, attributes};
    std::string bytes(bytesOf(mesh, layout), '\0');
    for (auto _ : state)
        if (writeVertices(mesh, layout, std::as_writable_bytes(std::span(bytes))) != VertexResult::Ok)
            state.SkipWithError("not written");
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(mesh.positions.size()));
    scenes::label(state, hashOf(bytes));
}

BENCHMARK_CAPTURE(bake, oak, "oak")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(bake, random10000, "10000")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(writeBytes, oak, "oak")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(writeBytes, random10000, "10000")->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(writeMillion, portable, GltfEncoding::Portable)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(writeMillionBytes)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(writeMillion, quantized, GltfEncoding::Quantized)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(writeMillion, compressed, GltfEncoding::Compressed)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(writeMillionObj)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK(layOut)->Unit(benchmark::kMillisecond);

} // namespace

} // namespace espalier
