#include <Espalier/Inference/Exemplars.h>
#include <Espalier/Inference/InferenceContext.h>

#include <Espalier/Archetype/Placement.h>
#include <Espalier/Core/Hash.h>
#include <Espalier/Plant/Axes.h>
#include <algorithm>

namespace espalier {

namespace {

/// A pass with the name its trace and progress bear.
struct NamedPass
{
    std::string_view name;
    InferencePass run;
};

/// A way to infer: its passes in order. `method` is written into the species; a change of results changes its number.
struct Preset
{
    std::string_view name;
    std::string_view method;
    std::vector<NamedPass> passes;
};

const std::vector<Preset>& presets()
{
    static const std::vector<Preset> kPresets = {
        {"kin", "kin 3", {{"infer", shareIdenticalLimbs}, {"generalize", classKin}, {"estimate", estimateKin}}},
        {"helberg",
         "helberg 1",
         {{"infer", inferBreadthFirst},
          {"compress", compressRepeatedSubtrees},
          {"generalize", generalizeByMerging},
          {"estimate", estimatePerTemplate}}},
    };
    return kPresets;
}

std::string identityOf(std::span<const Archetype> archetypes)
{
    Hash64 hash;
    for (const Archetype& archetype : archetypes)
    {
        hash.bytes(printTemplates(archetype.library));
        hash.bytes(printArchetype(archetype));
    }
    return hexDigits(hash.result());
}

Expected<void> checkOptions(std::span<const Archetype> archetypes, const InferenceOptions& options)
{
    if (archetypes.empty())
        return failure(ErrorKind::BadInput, {}, "there is no archetype to infer from", "at least one");
    for (const Archetype& archetype : archetypes)
        if (auto done = validate(archetype); !done)
            return done;
    for (const auto& [name, weight] :
         {std::pair("merge weight", options.mergeWeight), std::pair("rule weight", options.ruleWeight)})
        if (weight && !(*weight >= 0 && *weight <= 1))
            return failure(ErrorKind::BadInput, {}, std::string("the ") + name + " is out of range",
                           "a number from 0 to 1");
    if (!(options.jitter >= 0 && options.jitter <= 1))
        return failure(ErrorKind::BadInput, {}, "the jitter is out of range", "a share from 0 to 1");
    if (options.jitter != kUsualJitter && options.preset != "kin")
        return failure(ErrorKind::BadInput, {}, "the preset " + options.preset + " moves no parameters",
                       "a jitter with the preset kin only");
    return {};
}

/// Sizes of the drawn trees for the provenance, and pipes that suit them.
Expected<void> measureExemplars(const InferenceContext& context, Species& species)
{
    std::uint64_t segments = 0;
    const ArchetypeDrawer drawer(context.exemplars);
    Skeleton skeleton;
    for (std::size_t tree = 0; tree < drawer.trees(); ++tree)
    {
        if (auto done = drawer.draw(tree, {}, skeleton); !done)
            return done;
        segments += skeleton.size();
        if (tree == 0)
            species.appearance.pipes = suggestPipes(skeleton);
    }
    const std::size_t trees = context.anchors.roots.size();
    species.provenance.exemplarSegments = static_cast<std::uint32_t>(segments / trees);
    species.provenance.exemplarInstances = static_cast<std::uint32_t>(context.exemplars.instances.size() / trees);
    return {};
}

} // namespace

std::vector<std::string_view> inferencePresets()
{
    std::vector<std::string_view> names;
    for (const Preset& preset : presets())
        names.push_back(preset.name);
    return names;
}

Expected<Species> inferSpecies(std::span<const Archetype> archetypes, const InferenceOptions& options)
{
    if (auto done = checkOptions(archetypes, options); !done)
        return tl::make_unexpected(done.error());
    const auto preset = std::ranges::find(presets(), options.preset, &Preset::name);
    if (preset == presets().end())
        return failure(ErrorKind::BadInput, {}, "there is no inference preset \"" + options.preset + "\"",
                       "kin or helberg");

    InferenceContext context{options, mergeArchetypes(archetypes), {}, {}, {}, {}, {}, {}, {}, {}, {}};
    context.anchors = anchorsOf(context.exemplars);
    context.species.name = options.name;
    context.species.provenance.method = preset->method;
    context.species.provenance.archetypes = identityOf(archetypes);
    if (auto done = measureExemplars(context, context.species); !done)
        return tl::make_unexpected(done.error());

    for (std::size_t i = 0; i < preset->passes.size(); ++i)
    {
        const NamedPass& pass = preset->passes[i];
        options.progress(pass.name, static_cast<double>(i) / static_cast<double>(preset->passes.size()));
        if (options.progress.wantsStop())
            return failure(ErrorKind::Cancelled, {}, "the inference was cancelled");
        if (auto done = pass.run(context); !done)
            return tl::make_unexpected(done.error());
        if (options.trace)
            options.trace(pass.name, context.summary, context.grammarText);
    }
    context.species.provenance.grammar = identityOf(context.species.grammar);
    options.progress("done", 1);
    return std::move(context.species);
}

} // namespace espalier
