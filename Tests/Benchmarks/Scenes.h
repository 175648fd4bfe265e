#pragma once

#include <Espalier/Archetype/Archetype.h>
#include <Espalier/Inference/Inference.h>
#include <Espalier/Mesh/TubeMesher.h>
#include <Espalier/Species/AppearanceFile.h>
#include <Espalier/Species/Grow.h>
#include <Inference/SampleArchetypes.h>
#include <benchmark/benchmark.h>
#include <cstdio>
#include <ctime>
#include <map>

// What is measured, made once. A benchmark shows the hash of its result beside its time, so that a faster wrong answer
// shows.
namespace espalier::scenes {

/// A kind of Content/ by its name in small letters.
inline std::filesystem::path contentFile(std::string name, const std::string& extension)
{
    name[0] = static_cast<char>(name[0] - 'a' + 'A');
    return std::filesystem::path(ESPALIER_SOURCE_ROOT) / "Content" / (name + extension);
}

/// thesis, bush, a kind of Content/, or a number: a tree of so many instances grown at random.
inline const Archetype& archetype(const std::string& name)
{
    static std::map<std::string, Archetype> known;
    if (const auto found = known.find(name); found != known.end())
        return found->second;
    if (name == "thesis")
        return known[name] = samples::thesis();
    if (name == "bush")
        return known[name] = samples::bush();
    if (name[0] >= '0' && name[0] <= '9')
        return known[name] = samples::randomArchetype(Seed{1}, static_cast<std::uint32_t>(std::stoul(name)));
    const std::filesystem::path templates = std::filesystem::path(ESPALIER_SOURCE_ROOT) / "Templates";
    return known[name] = loadArchetype(contentFile(name, ".archetype"), {{templates}}).value();
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

/// What a kind of Content/ looks like in summer.
inline const Appearance& appearance(const std::string& name)
{
    static std::map<std::string, Appearance> known;
    if (const auto found = known.find(name); found != known.end())
        return found->second;
    Appearance& made = known[name];
    made = loadAppearance(contentFile(name, ".appearance")).value();
    made.pipes = species(name).appearance.pipes;
    return made;
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

/// Of this thread: others may want the machine too.
inline double processorSeconds()
{
    timespec now{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Times `work`, and `baseline` by turns with it: the counter `ratio` says how many times as long the work takes. Runs
/// of it are registered with UseManualTime().
template <class Work, class Baseline>
void timeBeside(benchmark::State& state, const Work& work, const Baseline& baseline)
{
    double worked = 0;
    double waited = 0;
    for (auto _ : state)
    {
        const double start = processorSeconds();
        work();
        const double middle = processorSeconds();
        baseline();
        waited += processorSeconds() - middle;
        worked += middle - start;
        state.SetIterationTime(middle - start);
    }
    state.counters["ratio"] = worked / waited;
}

inline void label(benchmark::State& state, std::uint64_t hash)
{
    char text[17];
    std::snprintf(text, sizeof text, "%016llx", static_cast<unsigned long long>(hash));
    state.SetLabel(text);
}

} // namespace espalier::scenes
