#pragma once

#include <Espalier/Archetype/Archetype.h>
#include <Espalier/Archetype/Spatial.h>
#include <Espalier/Core/Error.h>
#include <Espalier/Core/Progress.h>
#include <Espalier/Inference/Explanation.h>
#include <Espalier/Species/Species.h>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace espalier {

/// How rules are found in what a designer drew.
struct InferenceOptions
{
    std::string preset = "kin"; ///< One of inferencePresets().

    /// How freely branches stand for each other, [0, 1]. kin: the chance that a drawn branch is replaced by one of its
    /// kin; 0 gives the archetype back exactly; default: chosen for the tree. helberg: w_0, the weight of grammar
    /// length against edit distance; default 0.5.
    std::optional<double> mergeWeight{};

    /// [0, 1]. kin: how coarse the classes of kin are, 0 finest; default: chosen for the tree. helberg: w_l, the weight
    /// of rule length against rule uses; default 0.5.
    std::optional<double> ruleWeight{};

    /// [0, 1]. kin: how far parameters are moved so that trees with the same branches still differ, as a share of what
    /// each was observed to vary (angles on the circle, scalings by at most 0.4 of themselves), times the merge weight.
    /// What stands upright, and was drawn rolled in more ways than one, is rolled by a deviation of 60 degrees or more.
    /// 0: every parameter is one that was drawn, and relatives differ by their branches alone.
    double jitter = kUsualJitter;

    /// How often each archetype counts, [1, 1000] each; none: all alike. kin: what it has counts so often wherever kin
    /// are drawn, each of its trees so often as a beginning. What was drawn keeps its own counts (Species::rules).
    std::vector<std::uint32_t> weights{};

    /// Gives the archetypes depth before anything is learned from them (giveDepth); none: they stay as drawn.
    std::vector<Azimuths> spatial{};

    /// kin: what was drawn also counts as a mirror shows it (mirrorImage), whole and branch for branch, as often as
    /// drawn. So branches that were drawn to one side come to either, each where it looks to the sky as what it stands
    /// for did (Stance).
    bool mirror = false;

    std::string name = "species"; ///< Of the species.
    Progress progress{};

    /// Called after each pass with its name, what it came to in a sentence, and the grammar as text.
    std::function<void(std::string_view pass, const std::string& summary, const std::string& grammar)> trace{};

    /// Called at the end with the reasons for the rules; kin only.
    std::function<void(const Explanation& explanation)> explain{};
};

/// Infers the rules behind one or more archetypes of a kind. The archetypes may use different libraries; templates of
/// equal word are one. Trials run on a thread for each processor; the result does not depend on them. Deterministic:
/// equal input gives an equal species. Fails with BadInput for an invalid archetype, an unknown preset or a weight or
/// jitter out of range, with Limit where weights make more of an archetype than memory holds.
[[nodiscard]] Expected<Species> inferSpecies(std::span<const Archetype> archetypes,
                                             const InferenceOptions& options = {});

/// The names of the presets, the default first.
[[nodiscard]] std::vector<std::string_view> inferencePresets();

} // namespace espalier
