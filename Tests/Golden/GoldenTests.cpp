// The same bits everywhere: what a species of today grows and how it is meshed, against hashes in the
// .golden files beside this one. Every compiler and optimisation must reproduce them. A change of results is meant to
// be seen: say in its commit why, and write the files anew with ESPALIER_UPDATE_GOLDEN=1.

#include "GoldenFile.h"

#include <Espalier/Archetype/Archetype.h>
#include <Espalier/Core/Hash.h>
#include <Espalier/Inference/Inference.h>
#include <Espalier/Mesh/TubeMesher.h>
#include <Espalier/Species/Grow.h>
#include <gtest/gtest.h>

namespace espalier {

namespace {

/// One golden file: an archetype of Data/, inferred by a preset and grown from seeds 1, 2, 3, ...
struct Scene
{
    std::string_view name;
    std::string_view archetype;
    std::string_view preset;
    std::uint64_t seeds;
};

void PrintTo(const Scene& scene, std::ostream* out)
{
    *out << scene.name;
}

constexpr Scene kScenes[] = {
    {"ThesisKin", "Thesis.archetype", "kin", 50},
    {"BushKin", "Bush.archetype", "kin", 50},
    {"OakKin", "Oak.archetype", "kin", 8},
    {"ThesisHelberg", "Thesis.archetype", "helberg", 10},
    {"BushHelberg", "Bush.archetype", "helberg", 10},
};

/// The lines of a golden file. The species stands first: where it differs already, the seeds say nothing more.
Expected<std::vector<std::string>> reproduce(const Scene& scene)
{
    const auto archetype = loadArchetype(golden::kFolder / "Data" / scene.archetype);
    if (!archetype)
        return tl::make_unexpected(archetype.error());
    const auto species =
        inferSpecies({&*archetype, 1}, {.preset = std::string(scene.preset), .name = std::string(scene.name)});
    if (!species)
        return tl::make_unexpected(species.error());
    const auto grower = Grower::make(*species);
    if (!grower)
        return tl::make_unexpected(grower.error());

    std::vector<std::string> lines{"species " + hexDigits(hashOf(*species))};
    GrowScratch growScratch;
    TubeScratch tubeScratch;
    Skeleton skeleton;
    for (std::uint64_t seed = 1; seed <= scene.seeds; ++seed)
    {
        if (auto done = grower->grow(Seed{seed}, {}, growScratch, skeleton); !done)
            return tl::make_unexpected(done.error());
        TreeMesh mesh;
        if (meshTubes(skeleton, species->appearance.bark, {}, {}, tubeScratch, mesh) != MeshResult::Ok)
            return failure(ErrorKind::BadInput, {}, "seed " + std::to_string(seed) + " has no mesh");
        lines.push_back("seed " + std::to_string(seed) + " skeleton " + hexDigits(hashOf(skeleton)) + " mesh " +
                        hexDigits(hashOf(mesh)));
    }
    return lines;
}

} // namespace

class Golden : public testing::TestWithParam<Scene>
{};

TEST_P(Golden, ReproducesItsFile)
{
    const Scene& scene = GetParam();
    const auto lines = reproduce(scene);
    ASSERT_TRUE(lines) << toString(lines.error());
    golden::expectFile(scene.name,
                       std::string(scene.archetype) + " by the preset " + std::string(scene.preset) +
                           ": hashes of the species' text, of each seed's skeleton and of its mesh.",
                       *lines);
}

INSTANTIATE_TEST_SUITE_P(Scenes, Golden, testing::ValuesIn(kScenes),
                         [](const testing::TestParamInfo<Scene>& scene) { return std::string(scene.param.name); });

} // namespace espalier
