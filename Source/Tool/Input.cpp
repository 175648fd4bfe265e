#include "Input.h"

#include <Espalier/Archetype/Placement.h>
#include <Espalier/Plant/Axes.h>
#include <Espalier/Species/Grow.h>

namespace espalier::tool {

void PlantInput::addTo(CLI::App& verb)
{
    verb.add_option("input", path, "A.archetype or S.species")->required();
    verb.add_option("--seed", seeds, "Of a species: a seed N, or a range A..B")->capture_default_str();
    templates.addTo(verb);
}

bool PlantInput::isArray() const
{
    return parseSeeds(seeds).isRange;
}

Appearance PlantInput::appearance() const
{
    if (kindOf(path) == InputKind::Species)
        return loadSpeciesFile(path).appearance;
    Appearance appearance;
    appearance.pipes = suggestPipes(orFail(drawArchetype(templates.load(path))));
    return appearance;
}

void PlantInput::eachPlant(const std::function<void(const Plant&)>& use) const
{
    Plant plant;
    if (kindOf(path) == InputKind::Archetype)
    {
        const Archetype archetype = templates.load(path);
        const ArchetypeDrawer drawer(archetype);
        const std::size_t trees = drawer.trees();
        for (std::size_t tree = 0; tree < trees; ++tree)
        {
            plant.label = trees == 1 ? "archetype" : "archetype " + std::to_string(tree + 1);
            orFailIn(path, drawer.draw(tree, {}, plant.skeleton));
            completeAxes(plant.skeleton, suggestPipes(plant.skeleton));
            use(plant);
        }
        return;
    }
    const SeedRange range = parseSeeds(seeds);
    const Grower grower = orFail(Grower::make(loadSpeciesFile(path)));
    GrowScratch scratch;
    for (std::uint64_t i = 0; i < range.count(); ++i)
    {
        plant.seed = range.first + i;
        plant.label = "seed " + std::to_string(*plant.seed);
        orFailIn(path, grower.grow(Seed{*plant.seed}, {}, scratch, plant.skeleton));
        use(plant);
    }
}

void meshOrFail(const Skeleton& skeleton, const BarkAppearance& bark, const std::string& label, const std::string& path,
                TubeScratch& scratch, TreeMesh& mesh)
{
    mesh.clear();
    const auto reason = [](TubeResult result) -> std::string_view {
        switch (result)
        {
        case TubeResult::Ok:
            return {};
        case TubeResult::EmptySkeleton:
            return "it has no segments";
        case TubeResult::UnsoundSkeleton:
            return "a number in it is not finite or too large";
        case TubeResult::TooManyVertices:
            return "it would exceed the limit vertices";
        }
        return {};
    }(meshTubes(skeleton, bark, {}, {}, scratch, mesh));
    if (!reason.empty())
        fail({ErrorKind::BadInput, label + " gives no mesh: " + std::string(reason), {}, {}, {path, 0, 0}});
}

} // namespace espalier::tool
