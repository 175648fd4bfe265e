#include <Espalier/Inference/Exemplars.h>
#include <Espalier/Inference/InferenceContext.h>

#include <Espalier/Archetype/Placement.h>
#include <Espalier/Plant/Axes.h>
#include <algorithm>
#include <numeric>

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
    Explanation (*explain)(const InferenceContext&) = nullptr; ///< None: it gives no reasons.
};

const std::vector<Preset>& presets()
{
    static const std::vector<Preset> kPresets = {
        {"kin",
         "kin 4",
         {{"infer", shareIdenticalLimbs}, {"generalize", classKin}, {"estimate", estimateKin}},
         explainKin},
        {"helberg",
         "helberg 1",
         {{"infer", inferBreadthFirst},
          {"compress", compressRepeatedSubtrees},
          {"generalize", generalizeByMerging},
          {"estimate", estimatePerTemplate}},
         nullptr},
    };
    return kPresets;
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
    if (options.mirror && options.preset != "kin")
        return failure(ErrorKind::BadInput, {}, "the preset " + options.preset + " mirrors nothing",
                       "mirror images with the preset kin only");
    if (options.weights.empty())
        return {};
    constexpr std::uint32_t kMostWeight = 1000;
    if (options.preset != "kin")
        return failure(ErrorKind::BadInput, {}, "the preset " + options.preset + " does not weigh archetypes",
                       "weights with the preset kin only");
    if (options.weights.size() != archetypes.size())
        return failure(ErrorKind::BadInput, {},
                       "the number of weights is " + std::to_string(options.weights.size()) + ", that of archetypes " +
                           std::to_string(archetypes.size()),
                       "a weight for each archetype");
    for (const std::uint32_t weight : options.weights)
        if (weight < 1 || weight > kMostWeight)
            return failure(ErrorKind::BadInput, {}, "the weight " + std::to_string(weight) + " is out of range",
                           "a whole number from 1 to " + std::to_string(kMostWeight));
    return {};
}

/// How often each drawn tree counts, without a common factor, and its mirror image; none where all count alike.
Expected<std::vector<std::uint32_t>> weightsOfTrees(std::span<const Archetype> archetypes,
                                                    const std::vector<std::uint32_t>& weights, bool mirror)
{
    std::uint32_t divisor = 0;
    for (const std::uint32_t weight : weights)
        divisor = std::gcd(divisor, weight);
    std::vector<std::uint32_t> ofTrees;
    std::uint64_t instances = 0;
    for (std::size_t i = 0; i < weights.size(); ++i)
    {
        const std::uint32_t weight = weights[i] / divisor;
        instances += std::uint64_t{weight} * archetypes[i].instances.size();
        for (const TemplateInstance& instance : archetypes[i].instances)
            if (instance.parent == kNoInstance)
                ofTrees.push_back(weight);
    }
    if (mirror)
    {
        instances *= 2;
        ofTrees.insert(ofTrees.end(), ofTrees.begin(), ofTrees.end());
    }
    const std::uint64_t most = 4 * std::uint64_t{Limits{}.inferredNodes};
    if (instances > most)
        return failure(ErrorKind::Limit, {},
                       "with these weights the archetypes count as " + std::to_string(instances) + " instances",
                       "at most " + std::to_string(most) + " (four times the limit inferredNodes), by smaller weights");
    if (std::ranges::all_of(ofTrees, [](std::uint32_t weight) { return weight == 1; }))
        ofTrees.clear();
    return ofTrees;
}

/// Sizes of the drawn trees for the provenance, pipes that suit them, and how their instances stand.
Expected<void> measureExemplars(InferenceContext& context)
{
    Species& species = context.species;
    std::uint64_t segments = 0;
    context.stances.resize(context.exemplars.instances.size());
    const ArchetypeDrawer drawer(context.exemplars);
    Skeleton skeleton;
    const Limits limits = exemplarLimits();
    for (std::size_t tree = 0; tree < drawer.trees(); ++tree)
    {
        if (auto done = drawer.draw(tree, limits, skeleton); !done)
            return done;
        segments += skeleton.size();
        findStances(skeleton, context.stances);
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

    auto weights = weightsOfTrees(archetypes, options.weights, options.mirror);
    if (!weights)
        return tl::make_unexpected(weights.error());

    InferenceContext context{
        options, exemplarsOf(archetypes, options.spatial, options.mirror), {}, {}, {}, {}, {}, {}, {}, {}, {}, {}, {}};
    // Of each by itself it was; together, and with their images, they may be too many.
    if (auto done = validate(context.exemplars); !done)
        return tl::make_unexpected(done.error());
    context.anchors = anchorsOf(context.exemplars);
    context.species.name = options.name;
    context.species.provenance.method = preset->method;
    context.species.provenance.archetypes = identityOf(archetypes);
    context.species.provenance.weights = std::move(*weights);
    if (std::ranges::any_of(options.spatial, [](Azimuths azimuths) { return azimuths != Azimuths::AsDrawn; }))
        context.species.provenance.spatial = printAzimuths(options.spatial);
    context.species.provenance.mirror = options.mirror;
    if (auto done = measureExemplars(context); !done)
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
    context.species.provenance.tables = tablesIdentityOf(context.species);
    context.species.provenance.pipes = identityOf(context.species.appearance.pipes);
    if (options.explain && preset->explain)
        options.explain(preset->explain(context));
    options.progress("done", 1);
    return std::move(context.species);
}

} // namespace espalier
