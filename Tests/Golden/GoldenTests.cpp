// The same bits everywhere: what a species of today grows and how it is meshed, against hashes in the
// .golden files beside this one. Every compiler and optimisation must reproduce them. A change of results is meant to
// be seen: say in its commit why, and write the files anew with ESPALIER_UPDATE_GOLDEN=1.

#include <Espalier/Archetype/Archetype.h>
#include <Espalier/Core/File.h>
#include <Espalier/Core/Hash.h>
#include <Espalier/Inference/Inference.h>
#include <Espalier/Mesh/TubeMesher.h>
#include <Espalier/Species/Grow.h>
#include <cstdlib>
#include <gtest/gtest.h>
#include <sstream>

namespace espalier {

namespace {

const std::filesystem::path kFolder = std::filesystem::path(ESPALIER_SOURCE_ROOT) / "Tests" / "Golden";

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

std::string hex(std::uint64_t value)
{
    std::ostringstream text;
    text << std::hex;
    text.width(16);
    text.fill('0');
    text << value;
    return text.str();
}

/// The lines of a golden file. The species stands first: where it differs already, the seeds say nothing more.
Expected<std::vector<std::string>> reproduce(const Scene& scene)
{
    const auto archetype = loadArchetype(kFolder / "Data" / scene.archetype);
    if (!archetype)
        return tl::make_unexpected(archetype.error());
    const auto species =
        inferSpecies({&*archetype, 1}, {.preset = std::string(scene.preset), .name = std::string(scene.name)});
    if (!species)
        return tl::make_unexpected(species.error());
    const auto grower = Grower::make(*species);
    if (!grower)
        return tl::make_unexpected(grower.error());

    std::vector<std::string> lines{"species " + hex(hashOf(*species))};
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
        lines.push_back("seed " + std::to_string(seed) + " skeleton " + hex(hashOf(skeleton)) + " mesh " +
                        hex(hashOf(mesh)));
    }
    return lines;
}

std::filesystem::path goldenFile(const Scene& scene)
{
    return kFolder / (std::string(scene.name) + ".golden");
}

/// Lines of a text, comments left out.
std::vector<std::string> linesOf(const std::string& text)
{
    std::vector<std::string> lines;
    std::istringstream in(text);
    for (std::string line; std::getline(in, line);)
        if (!line.empty() && line[0] != '#')
            lines.push_back(line);
    return lines;
}

bool updating()
{
    const char* const value = std::getenv("ESPALIER_UPDATE_GOLDEN");
    return value != nullptr && std::string_view(value) == "1";
}

Expected<void> update(const Scene& scene, const std::vector<std::string>& lines)
{
    std::string text = "# " + std::string(scene.archetype) + " by the preset " + std::string(scene.preset) +
                       ": hashes of the species' text, of each seed's skeleton and of its mesh.\n"
                       "# Written by espalier_golden with ESPALIER_UPDATE_GOLDEN=1.\n";
    for (const std::string& line : lines)
        text += line + '\n';
    return writeFileAtomically(goldenFile(scene), text);
}

} // namespace

class Golden : public testing::TestWithParam<Scene>
{};

TEST_P(Golden, ReproducesItsFile)
{
    const Scene& scene = GetParam();
    const auto lines = reproduce(scene);
    ASSERT_TRUE(lines) << toString(lines.error());
    const std::string advice =
        "\nIf this change is wanted, write the golden files anew with ESPALIER_UPDATE_GOLDEN=1 espalier_golden "
        "and say in the commit why.";
    if (updating())
    {
        const auto done = update(scene, *lines);
        ASSERT_TRUE(done) << toString(done.error());
    }
    const auto text = readTextFile(goldenFile(scene), Limits{}.fileBytes);
    ASSERT_TRUE(text) << toString(text.error()) << advice;
    const std::vector<std::string> golden = linesOf(*text);
    ASSERT_EQ(lines->size(), golden.size()) << goldenFile(scene) << " is of another test." << advice;
    for (std::size_t i = 0; i < golden.size(); ++i)
        ASSERT_EQ((*lines)[i], golden[i])
            << "This is the first line of " << goldenFile(scene) << " that differs." << advice;
}

INSTANTIATE_TEST_SUITE_P(Scenes, Golden, testing::ValuesIn(kScenes),
                         [](const testing::TestParamInfo<Scene>& scene) { return std::string(scene.param.name); });

} // namespace espalier
