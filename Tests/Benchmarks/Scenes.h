#pragma once

#include <Espalier/Archetype/Archetype.h>
#include <Espalier/Inference/Inference.h>
#include <Espalier/Mesh/TubeMesher.h>
#include <Espalier/Species/Grow.h>
#include <Inference/SampleArchetypes.h>
#include <benchmark/benchmark.h>
#include <cstdio>
#include <map>

// What is measured, made once. A benchmark shows the hash of its result beside its time, so that a faster wrong answer
// shows.
namespace espalier::scenes {

/// thesis, oak, bush, or a number: a tree of so many instances grown at random.
inline const Archetype& archetype(const std::string& name)
{
    static std::map<std::string, Archetype> known;
    if (const auto found = known.find(name); found != known.end())
        return found->second;
    const std::filesystem::path root = ESPALIER_SOURCE_ROOT;
    if (name == "thesis")
        return known[name] = samples::thesis();
    if (name == "bush")
        return known[name] = samples::bush();
    if (name == "oak")
        return known[name] = loadArchetype(root / "Content/Oak.archetype", {{root / "Templates"}}).value();
    return known[name] = samples::randomArchetype(Seed{1}, static_cast<std::uint32_t>(std::stoul(name)));
}

inline const Species& species(const std::string& name)
{
    static std::map<std::string, Species> known;
    if (const auto found = known.find(name); found != known.end())
        return found->second;
    InferenceOptions options;
    options.name = name;
    if (archetype(name).instances.size() > 1000) // calibrating is another benchmark
    {
        options.mergeWeight = 0.1;
        options.ruleWeight = 0;
    }
    return known[name] = inferSpecies({&archetype(name), 1}, options).value();
}

/// The first tree of the species.
inline const Skeleton& skeleton(const std::string& name)
{
    static std::map<std::string, Skeleton> known;
    if (const auto found = known.find(name); found != known.end())
        return found->second;
    return known[name] = grow(species(name), Seed{1}).value();
}

inline const TreeMesh& mesh(const std::string& name)
{
    static std::map<std::string, TreeMesh> known;
    if (const auto found = known.find(name); found != known.end())
        return found->second;
    TubeScratch scratch;
    TreeMesh& made = known[name];
    if (meshTubes(skeleton(name), species(name).appearance.bark, {}, {}, scratch, made) != MeshResult::Ok)
        std::fprintf(stderr, "%s has no mesh\n", name.c_str());
    return made;
}

inline void label(benchmark::State& state, std::uint64_t hash)
{
    char text[17];
    std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(hash));
    state.SetLabel(text);
}

} // namespace espalier::scenes
