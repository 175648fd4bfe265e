#pragma once

#include <Espalier/Inference/Draft.h>
#include <Espalier/Inference/Explanation.h>
#include <Espalier/Inference/Inference.h>
#include <Espalier/Inference/Limbs.h>
#include <optional>
#include <span>
#include <vector>

namespace espalier {

/// What the passes of an inference work on, from the drawn trees to the finished species. Each pass reads what earlier
/// ones left and adds its own; `summary` and `grammarText` are what the trace shows after it (of a large tree the text
/// takes longer than the pass, so it is not needed where nobody traces).
struct InferenceContext
{
    const InferenceOptions& options;
    Archetype exemplars;         ///< All archetypes in one: merged library, all trees; behind them their mirror images.
    AnchorTable anchors;         ///< Of `exemplars`.
    std::vector<Stance> stances; ///< Likewise, of each instance.

    DraftTree tree;                     ///< helberg: the drawn trees, later with repeated subtrees folded into leaves.
    DraftGrammar draft;                 ///< helberg: the rules.
    LimbTable limbs;                    ///< kin: the distinct limbs.
    KinClasses classes;                 ///< kin: which limbs may stand for each other.
    std::optional<GrowthWindow> window; ///< kin: accepted sizes and depths.
    std::vector<Explanation::Level> levels; ///< kin: that were tried.

    Species species; ///< The result.
    std::string summary;
    std::string grammarText;
};

/// One step of an inference. A new one is a function of this type, named in the list of a preset (Presets.cpp).
using InferencePass = Expected<void> (*)(InferenceContext&);

// helberg: A. Helberg, Template-basierte Synthese von Verzweigungsstrukturen mittels L-Systemen (2021), chapter 5,
// after J. Guo et al., Inverse Procedural Modeling of Branching Structures by Inferring L-Systems, ACM TOG 39 (2020).
Expected<void> inferBreadthFirst(InferenceContext& context);        ///< A fresh symbol for every node and open anchor.
Expected<void> compressRepeatedSubtrees(InferenceContext& context); ///< While C_i falls.
Expected<void> generalizeByMerging(InferenceContext& context);      ///< While the cheapest merge has C_g < 0.
Expected<void> estimatePerTemplate(InferenceContext& context); ///< Tables of transforms by template, weights by use.

// kin: limbs of one class (template, about the same vigour) may stand for each other.
Expected<void> shareIdenticalLimbs(InferenceContext& context); ///< Hash-consing: equal limbs become one.
Expected<void> classKin(InferenceContext& context);    ///< Which limbs are kin, and how freely they are exchanged.
Expected<void> estimateKin(InferenceContext& context); ///< Whole transforms by limb; the window of accepted sizes.
[[nodiscard]] Explanation explainKin(const InferenceContext& context); ///< After its passes.

} // namespace espalier
