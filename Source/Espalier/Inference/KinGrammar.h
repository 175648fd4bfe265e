#pragma once

#include <Espalier/Archetype/Template.h>
#include <Espalier/Inference/Limbs.h>
#include <Espalier/Species/Species.h>
#include <cstdint>
#include <vector>

namespace espalier {

/// What a production of kin's grammar stands for: a limb, the occupant of one of its anchors, or one of several trees.
struct KinRule
{
    static constexpr std::uint32_t kWhole = 0xffffffffu;
    static constexpr std::uint32_t kStart = 0xfffffffeu; ///< One for each tree, in their order.

    std::uint32_t limb = 0;
    std::uint32_t part = kWhole; ///< kWhole, kStart or the number of an anchor.
    std::uint32_t number = 0;    ///< Of the limb in its class, KinClasses::kin.
    std::uint32_t limbs = 1;     ///< That share the rule: those that follow in the class.
};

/// Fills the grammar and the tables of `species` from a choice of classes and weight, parameters moved by `jitter`
/// (InferenceOptions): one production for each distinct limb or run of alike ones, weighted so that where limb k was
/// drawn, limb k grows with chance 1 - w and any of its class, by occurrence, with chance w. Classes are called after
/// their templates (kinNames); the productions of a class stand together, in the order of its limbs, whose indices they
/// bear. Returns what each production stands for.
std::vector<KinRule> writeKinGrammar(const TemplateLibrary& library, const LimbTable& limbs, const KinClasses& classes,
                                     Species& species, double jitter = kUsualJitter);

/// GrowthSample::topology of drawn tree number `tree`, from a grammar as writeKinGrammar left it and the rules it
/// returned. As a Grower for the drawn tree finds it, but in a hundredth of the time and without copies of the grammar.
[[nodiscard]] std::uint64_t drawnTopology(const Species& species, const std::vector<KinRule>& rules,
                                          std::uint32_t tree);

/// The identity of a limb: `load` is the identity of all that it carries, and of its template.
[[nodiscard]] std::uint64_t limbIdentity(std::uint64_t load, double scaling, double branchingAngle);

/// Of each instance, its tree and its number in it, depth first as the archetype's file lists them.
[[nodiscard]] std::vector<DrawnNode> drawnNodesOf(const Archetype& exemplars);

/// The origins of a grammar's rules in the drawn trees, for Species::rules. `exemplars` and `anchors` are what `limbs`
/// was made of.
[[nodiscard]] std::vector<RuleOrigin> originsOf(const std::vector<KinRule>& rules, const LimbTable& limbs,
                                                const KinClasses& classes, const Archetype& exemplars,
                                                const AnchorTable& anchors);

} // namespace espalier
