#include "Input.h"

#include <Espalier/Archetype/Placement.h>
#include <Espalier/Plant/Axes.h>
#include <Espalier/Species/Grow.h>

namespace espalier::tool {

SeededGrower::SeededGrower(std::string path, std::optional<std::uint32_t> iterations,
                           std::optional<std::uint32_t> exemplar, std::optional<std::uint32_t> attempt)
    : path_(std::move(path))
{
    isExemplar_ = exemplar.has_value();
    options_.attempt = attempt;
    const InputKind kind = kindOf(path_, ".species or .lsys");
    if (exemplar && attempt)
        failUsage("--seed exemplar: expected no --attempt, for the drawn tree is one");
    if (attempt && kind != InputKind::Species)
        failUsage(path_ + ": expected no --attempt; only species choose among several");
    if (kind == InputKind::Grammar)
    {
        if (exemplar)
            failUsage(path_ + ": a grammar holds no drawn tree; expected a seed");
        species_.name = std::filesystem::path(path_).stem().string();
        species_.grammar = loadGrammarFile(path_);
        grower_ = orFailIn(path_, Grower::make(species_.grammar, iterations));
    }
    else
    {
        species_ = loadSpeciesFile(path_);
        if (exemplar && iterations)
            failUsage("--seed exemplar: expected no -n, for a drawn tree has no steps");
        grower_ =
            orFailIn(path_, exemplar ? Grower::makeExemplar(species_, *exemplar) : Grower::make(species_, iterations));
    }
}

void SeededGrower::grow(Seed seed, Skeleton& skeleton)
{
    GrowOptions options = options_;
    // A drawn tree and a species without a window have one attempt, which is not worth telling.
    if (species_.window && !isExemplar_)
        options.attempt = attempt_ = orFailIn(path_, grower_->acceptedAttempt(seed, options, scratch_));
    orFailIn(path_, grower_->grow(seed, options, scratch_, skeleton));
}

void PlantInput::addTo(CLI::App& verb)
{
    verb.add_option("input", path, "A.archetype, S.species or G.lsys")->required();
    verb.add_option("--seed", seeds, "Of a species or grammar: a seed N, a range A..B, or exemplar: the drawn tree")
        ->capture_default_str();
    addIterations(verb, iterations);
    addAttempt(verb, attempt);
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
    if (kindOf(path) == InputKind::Archetype)
        appearance.pipes = suggestPipes(orFail(drawArchetype(templates.load(path))));
    return appearance;
}

void PlantInput::eachPlant(const std::function<void(Plant&)>& use) const
{
    Plant plant;
    if (kindOf(path) == InputKind::Archetype)
    {
        if (iterations)
            failUsage(path + ": an archetype is drawn, not derived; expected no -n");
        if (attempt)
            failUsage(path + ": expected no --attempt; only species choose among several");
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
    SeededGrower grower(path, iterations, range.exemplar, attempt);
    for (std::uint64_t i = 0; i < range.count(); ++i)
    {
        const Seed seed{range.first + i};
        if (!range.exemplar)
            plant.seed = seed.value;
        plant.label = range.exemplar ? "exemplar" : "seed " + std::to_string(seed.value);
        grower.grow(seed, plant.skeleton);
        plant.attempt = grower.attempt();
        plant.steps = grower.steps();
        use(plant);
    }
}

bool isMeshedOrFail(MeshResult result, const std::string& label, const std::string& path)
{
    if (result != MeshResult::Ok && result != MeshResult::EmptySkeleton)
        fail({ErrorKind::BadInput, label + " gives no mesh: " + std::string(reasonOf(result)), {}, {}, {path, 0, 0}});
    return result == MeshResult::Ok;
}

std::string nothingDrawn(std::optional<std::uint32_t> steps)
{
    if (!steps)
        return "nothing is drawn";
    return "nothing is drawn after " + std::to_string(*steps) + (*steps == 1 ? " step" : " steps") +
           "; derive more, by `iterations:` or -n, or name what draws in `draw:`";
}

} // namespace espalier::tool
