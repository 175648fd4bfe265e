#pragma once

#include <Espalier/Archetype/Template.h>
#include <Espalier/Core/Error.h>
#include <Espalier/Core/Progress.h>
#include <Espalier/Inference/Limbs.h>
#include <Espalier/Species/Grow.h>
#include <vector>

namespace espalier {

/// What a choice of classes and weight comes to when some trees are grown with it.
struct KinTrial
{
    KinClasses classes; ///< With the weight tried.
    GrowthWindow
        window; ///< Whose accepted trees have the drawn trees' mean size, as nearly as its lower bound can bring about.
    double accepted = 0; ///< Share of attempts inside the window.
    double distinct = 0; ///< Share of different topologies among them.
    double difference =
        0; ///< Median edit distance between two of them over the sum of their instances, estimated by pq-grams.
};

/// Grows trees of choices of classes and weight, from seeds of its own, and says what they come to.
class KinNursery
{
public:
    /// All arguments must outlive it.
    KinNursery(const TemplateLibrary& library, const LimbTable& limbs, const Progress& progress);

    /// The trial of one choice.
    [[nodiscard]] Expected<KinTrial> tryOut(KinClasses classes, double weight) const;
    [[nodiscard]] Expected<KinTrial> tryOut(const KinLevel& level, double weight) const;

    /// The smallest weight (to 0.01) at which the trees of a level differ as much as relatives should.
    [[nodiscard]] Expected<KinTrial> calibrate(const KinLevel& level) const;

    /// The finest level whose calibrated trees are different enough, distinct, and often enough of the right size; the
    /// one that comes nearest where none is.
    [[nodiscard]] Expected<KinTrial> chooseLevel() const;

private:
    [[nodiscard]] Expected<std::vector<std::uint64_t>> drawnTopologies() const;
    [[nodiscard]] GrowthWindow windowFor(const std::vector<GrowthSample>& samples) const;

    const TemplateLibrary& library_;
    const LimbTable& limbs_;
    const Progress& progress_;
    double segments_ = 0;                       ///< Mean of the drawn trees.
    double instances_ = 0;                      ///< Likewise.
    std::uint32_t leastSegments_ = 0xffffffffu; ///< Of the smallest drawn tree.
    std::uint32_t mostSegments_ = 0;            ///< Of the largest.
    std::uint32_t leastDepth_ = 0xffffffffu;
    std::uint32_t mostDepth_ = 0;
    Expected<std::vector<std::uint64_t>> drawn_; ///< Topologies of the drawn trees.
};

} // namespace espalier
