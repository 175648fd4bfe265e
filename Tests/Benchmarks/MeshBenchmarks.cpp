// Skeletons to triangles. `ratio` says how many times as long it takes as what it is held against (GOALS 3): mostly
// memcpy of the same bytes, the limit of this machine. All into memory that is there.

#include "Scenes.h"

#include <Espalier/Core/Hash.h>
#include <Espalier/Mesh/DetailLevel.h>
#include <Espalier/Mesh/TreeMesher.h>
#include <Espalier/Mesh/Wind.h>
#include <Espalier/Plant/Axes.h>
#include <array>
#include <cstring>

namespace espalier {

namespace {

template <class Vector>
void copyBytes(const Vector& from, Vector& to)
{
    to.resize(from.size());
    if (!from.empty())
        std::memcpy(to.data(), from.data(), from.size() * sizeof(typename Vector::value_type));
    benchmark::DoNotOptimize(to.data());
    benchmark::ClobberMemory();
}

void copyBytes(const TreeMesh& from, TreeMesh& to)
{
    copyBytes(from.positions, to.positions);
    copyBytes(from.normals, to.normals);
    copyBytes(from.tangents, to.tangents);
    copyBytes(from.uvs, to.uvs);
    copyBytes(from.tints, to.tints);
    copyBytes(from.sources, to.sources);
    copyBytes(from.indices, to.indices);
}

/// Times what fills `mesh`, and says whether it did, beside copying what it made.
template <class Fill>
void timeBesideCopy(benchmark::State& state, TreeMesh& mesh, const Fill& fill)
{
    TreeMesh copy;
    scenes::timeBeside(
        state,
        [&] {
            mesh.clear();
            if (!fill())
                state.SkipWithError("not meshed");
            benchmark::DoNotOptimize(mesh.positions.data());
        },
        [&] { copyBytes(mesh, copy); });
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(mesh.positions.size()));
    state.counters["vertices"] = static_cast<double>(mesh.positions.size());
    state.counters["triangles"] = static_cast<double>(mesh.indices.size() / 3);
    scenes::label(state, hashOf(mesh));
}

void tubes(benchmark::State& state, const std::string& name)
{
    const Skeleton& skeleton = scenes::skeleton(name);
    const BarkAppearance& bark = scenes::species(name).appearance.bark;
    TubeScratch scratch;
    TreeMesh mesh;
    timeBesideCopy(state, mesh, [&] { return meshTubes(skeleton, bark, {}, {}, scratch, mesh) == MeshResult::Ok; });
}

TubeSettings eightSides()
{
    TubeSettings settings;
    settings.minSides = 8;
    settings.maxSides = 8;
    return settings;
}

/// Tubes of eight sides, as the table of GOALS counts them.
void tubesOfEight(benchmark::State& state, const std::string& name)
{
    const Skeleton& skeleton = scenes::skeleton(name);
    TubeScratch scratch;
    TreeMesh mesh;
    timeBesideCopy(state, mesh,
                   [&] { return meshTubes(skeleton, {}, eightSides(), {}, scratch, mesh) == MeshResult::Ok; });
}

/// A thousand long strands, which leave most of the work to the writing of rings.
const Skeleton& strands()
{
    constexpr std::uint32_t kStrands = 1000;
    constexpr std::uint32_t kSegments = 100;
    static const Skeleton made = [] {
        const Grammar grammar =
            parseGrammar("axiom: S(" + std::to_string(kStrands) + ")\nS(n) : n > 0 -> [!(0.05)A(" +
                             std::to_string(kSegments) +
                             ")]\\(90)f(0.5)/(90)S(n-1)\nA(n) : n > 0 -> F(0.1)+(rand(-4.5, 4.5))A(n-1)\n",
                         "strands", {})
                .value();
        const Grower grower = Grower::make(grammar, kStrands + kSegments + 1).value();
        GrowScratch scratch;
        Skeleton skeleton;
        (void)grower.grow(Seed{1}, {}, scratch, skeleton);
        return skeleton;
    }();
    return made;
}

void tubesOfEightAlongStrands(benchmark::State& state)
{
    TubeScratch scratch;
    TreeMesh mesh;
    timeBesideCopy(state, mesh,
                   [&] { return meshTubes(strands(), {}, eightSides(), {}, scratch, mesh) == MeshResult::Ok; });
}

/// One closed surface beside tubes of their own.
void weld(benchmark::State& state, const std::string& name)
{
    const Skeleton& skeleton = scenes::skeleton(name);
    const BarkAppearance& bark = scenes::species(name).appearance.bark;
    TubeSettings welded;
    welded.joints = TubeJoints::Weld;
    TubeScratch scratch;
    TubeScratch otherScratch;
    TreeMesh mesh;
    TreeMesh other;
    const auto make = [&](const TubeSettings& settings, TubeScratch& memory, TreeMesh& into) {
        into.clear();
        if (meshTubes(skeleton, bark, settings, {}, memory, into) != MeshResult::Ok)
            state.SkipWithError("not meshed");
    };
    scenes::timeBeside(
        state, [&] { make(welded, scratch, mesh); }, [&] { make({}, otherScratch, other); });
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(mesh.positions.size()));
    state.counters["vertices"] = static_cast<double>(mesh.positions.size());
    scenes::label(state, hashOf(mesh));
}

/// Skeleton to plant in leaf.
void wholeTree(benchmark::State& state, const std::string& name)
{
    const Skeleton& skeleton = scenes::skeleton(name);
    const Appearance& appearance = scenes::appearance(name);
    MeshScratch scratch;
    TreeMesh mesh;
    timeBesideCopy(state, mesh,
                   [&] { return meshTree(skeleton, appearance, {}, {}, scratch, mesh) == MeshResult::Ok; });
}

/// Where leaves stand, alone.
void places(benchmark::State& state, const std::string& name)
{
    const Skeleton& skeleton = scenes::skeleton(name);
    const Appearance& appearance = scenes::appearance(name);
    FoliageScratch scratch;
    Foliage foliage;
    std::vector<PlacedLeaf> copy;
    scenes::timeBeside(
        state,
        [&] {
            if (placeLeaves(skeleton, appearance.leaves, 1, {}, scratch, foliage) != MeshResult::Ok)
                state.SkipWithError("no leaves");
        },
        [&] { copyBytes(foliage.leaves, copy); });
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(foliage.leaves.size()));
    state.counters["leaves"] = static_cast<double>(foliage.leaves.size());
}

/// About what "Ash Large" of ez-tree 1.1.0 is (15 ms there, in a browser): a trunk, 10 boughs, 40 branches, 120 twigs,
/// some 28,000 vertices, two thirds of them leaves of two crossed surfaces.
constexpr const char* kAsh = "axiom: A(12)\n"
                             "A(n) : n > 10 -> !(0.06*n)F(1.1)+(rand(-3, 3))A(n-1)\n"
                             "A(n) : n > 0 -> !(0.06*n)F(1.1)+(rand(-3, 3))[/(137.5*n)&(rand(50, 70))B(10)]A(n-1)\n"
                             "B(n) : n < 8 && n > 0 && n % 2 == 1 -> "
                             "!(0.018*n+0.02)F(0.5)+(rand(-10, 10))[/(137.5*n)&(rand(35, 55))C(8)]B(n-1)\n"
                             "B(n) : n > 0 -> !(0.018*n+0.02)F(0.5)+(rand(-10, 10))B(n-1)\n"
                             "C(n) : n < 7 && n > 0 && n % 2 == 0 -> "
                             "!(0.005*n+0.012)F(0.25)+(rand(-12, 12))[/(137.5*n)&(rand(40, 60))D(5)]C(n-1)\n"
                             "C(n) : n > 0 -> !(0.005*n+0.012)F(0.25)+(rand(-12, 12))C(n-1)\n"
                             "D(n) : n > 0 -> !(0.001*n+0.004)F(0.2)+(rand(-12, 12))D(n-1)\n";

void parametersToMesh(benchmark::State& state)
{
    const Grower grower = Grower::make(parseGrammar(kAsh, "ash", {}).value(), 32).value();
    Appearance appearance;
    appearance.leaves = {LeafAppearance{.thickestWood = 0.0046f, .spacing = 0.05f, .form = LeafForm::Crossed}};
    GrowScratch growing;
    Skeleton skeleton;
    MeshScratch scratch;
    TreeMesh mesh;
    timeBesideCopy(state, mesh, [&] {
        return grower.grow(Seed{1}, {}, growing, skeleton) &&
               meshTree(skeleton, appearance, {}, {}, scratch, mesh) == MeshResult::Ok;
    });
    state.counters["segments"] = skeleton.size();
}

/// What is known before a mesh is made, beside making it.
void counts(benchmark::State& state, const std::string& name, decltype(&countTree) count)
{
    const Skeleton& skeleton = scenes::skeleton(name);
    const Appearance& appearance = scenes::appearance(name);
    MeshScratch scratch;
    MeshScratch otherScratch;
    MeshCounts counted;
    TreeMesh mesh;
    scenes::timeBeside(
        state,
        [&] {
            counted = {};
            if (count(skeleton, appearance, {}, {}, scratch, counted) != MeshResult::Ok)
                state.SkipWithError("not counted");
        },
        [&] {
            mesh.clear();
            if (meshTree(skeleton, appearance, {}, {}, otherScratch, mesh) != MeshResult::Ok)
                state.SkipWithError("not meshed");
        });
    state.counters["vertices"] = static_cast<double>(counted.vertices);
    state.counters["share"] = static_cast<double>(counted.bytes()) / static_cast<double>(countsOf(mesh).bytes());
}

/// Levels 1 to 3 of an oak of about 1,100,000 triangles, beside making the full plant.
void threeLevels(benchmark::State& state)
{
    const Skeleton& skeleton = scenes::skeleton("oak");
    Appearance appearance = scenes::appearance("oak");
    appearance.leaves[0].spacing *= 0.5f;
    DetailScratch scratch;
    MeshScratch fullScratch;
    TreeMesh full;
    std::array<TreeMesh, 3> levels;
    std::array<DetailLevel, 3> details;
    scenes::timeBeside(
        state,
        [&] {
            meshDetailLevels(skeleton, appearance, 1, {}, {}, scratch, levels, details);
            for (const DetailLevel& detail : details)
                if (detail.result != MeshResult::Ok)
                    state.SkipWithError("not meshed");
        },
        [&] {
            full.clear();
            if (meshTree(skeleton, appearance, {}, {}, fullScratch, full) != MeshResult::Ok)
                state.SkipWithError("not meshed");
        });
    state.counters["triangles"] = static_cast<double>(full.indices.size() / 3);
    scenes::label(state, hashOf(levels[0]) ^ hashOf(levels[1]) ^ hashOf(levels[2]));
}

void wind(benchmark::State& state, const std::string& name)
{
    const Skeleton& skeleton = scenes::skeleton(name);
    const TreeMesh mesh = meshTree(skeleton, scenes::appearance(name), {.sources = true}).value();
    WindScratch scratch;
    WindVertices vertices;
    std::vector<WindVertex> copy;
    scenes::timeBeside(
        state,
        [&] {
            if (!computeWind(skeleton, mesh, scratch, vertices))
                state.SkipWithError("no wind");
        },
        [&] { copyBytes(vertices.vertices, copy); });
    state.SetItemsProcessed(state.iterations() * static_cast<std::int64_t>(mesh.positions.size()));
    Hash64 hash;
    for (const WindVertex& vertex : vertices.vertices)
    {
        for (const float number : {vertex.trunkBend, vertex.boughBend, vertex.twigBend, vertex.flutter, vertex.along})
            hash.value(number);
        hash.value(vertex.leaf);
    }
    scenes::label(state, hash.result());
}

BENCHMARK_CAPTURE(tubes, thesis, "thesis")->Unit(benchmark::kMicrosecond)->UseManualTime();
BENCHMARK_CAPTURE(tubes, oak, "oak")->Unit(benchmark::kMicrosecond)->UseManualTime();
BENCHMARK_CAPTURE(tubes, random10000, "10000")->Unit(benchmark::kMicrosecond)->UseManualTime();
BENCHMARK_CAPTURE(tubesOfEight, oak, "oak")->Unit(benchmark::kMicrosecond)->UseManualTime();
BENCHMARK(tubesOfEightAlongStrands)->Unit(benchmark::kMicrosecond)->UseManualTime();
BENCHMARK_CAPTURE(weld, oak, "oak")->Unit(benchmark::kMicrosecond)->UseManualTime();
BENCHMARK_CAPTURE(weld, random10000, "10000")->Unit(benchmark::kMicrosecond)->UseManualTime();
BENCHMARK_CAPTURE(wholeTree, oak, "oak")->Unit(benchmark::kMicrosecond)->UseManualTime();
BENCHMARK_CAPTURE(wholeTree, birch, "birch")->Unit(benchmark::kMicrosecond)->UseManualTime();
BENCHMARK_CAPTURE(wholeTree, spruce, "spruce")->Unit(benchmark::kMicrosecond)->UseManualTime();
BENCHMARK_CAPTURE(wholeTree, palm, "palm")->Unit(benchmark::kMicrosecond)->UseManualTime();
BENCHMARK_CAPTURE(wholeTree, willow, "willow")->Unit(benchmark::kMicrosecond)->UseManualTime();
BENCHMARK_CAPTURE(places, oak, "oak")->Unit(benchmark::kMicrosecond)->UseManualTime();
BENCHMARK_CAPTURE(places, willow, "willow")->Unit(benchmark::kMicrosecond)->UseManualTime();
BENCHMARK_CAPTURE(counts, exact, "oak", countTree)->Unit(benchmark::kMicrosecond)->UseManualTime();
BENCHMARK_CAPTURE(counts, bound, "oak", meshBound)->Unit(benchmark::kMicrosecond)->UseManualTime();
BENCHMARK(parametersToMesh)->Unit(benchmark::kMicrosecond)->UseManualTime();
BENCHMARK(threeLevels)->Unit(benchmark::kMillisecond)->UseManualTime();
BENCHMARK_CAPTURE(wind, oak, "oak")->Unit(benchmark::kMicrosecond)->UseManualTime();

} // namespace

} // namespace espalier
