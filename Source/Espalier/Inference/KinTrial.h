#pragma once

#include <Espalier/Archetype/Template.h>
#include <Espalier/Core/Error.h>
#include <Espalier/Core/Progress.h>
#include <Espalier/Inference/KinSimulation.h>
#include <Espalier/Inference/Limbs.h>
#include <Espalier/Species/Species.h>
#include <functional>
#include <string>
#include <vector>

namespace espalier {

/// Drawn trees that a window keeps from being grown again. Of very many the first will do: none of them is then met
/// often.
inline constexpr std::uint32_t kMostCopies = 32;

/// What a trial's trees miss of what is wanted of relatives beyond difference and number.
struct KinShortfall
{
    double missed = 0;             ///< 0: nothing.
    bool compared = false;         ///< Trees were grown to tell.
    std::vector<std::string> bars; ///< What they miss.
};

/// What a choice of classes and weight comes to when some trees are grown with it.
struct KinTrial
{
    KinClasses classes; ///< With the weight tried.
    /// Whose accepted trees have the drawn trees' mean size, as nearly as its lower bound can bring about. Without
    /// copies.
    GrowthWindow window;
    double accepted = 0; ///< Share of attempts inside the window that are no copies; of the drawn tree with the fewest.
    double equal = 1;    ///< Chance that two accepted trees are the same but for transforms.
    /// Median edit distance between two of them over the sum of their instances; of trees that are not small an
    /// estimate, held to exact distances where there is time for some.
    double difference = 0;
    double score = 0;       ///< How near all this comes to what is wanted, [0, 1].
    KinShortfall shortfall; ///< As far as it was asked for.
};

/// Grows trees of choices of classes and weight, from seeds of its own, and says what they come to.
class KinNursery
{
public:
    using Shortfall = std::function<Expected<KinShortfall>(const KinTrial& trial)>;

    /// All arguments must outlive it.
    KinNursery(const TemplateLibrary& library, const LimbTable& limbs, const std::vector<std::uint32_t>& draws,
               const Progress& progress);

    /// The trial of one choice.
    [[nodiscard]] Expected<KinTrial> tryOut(KinClasses classes, double weight) const;
    [[nodiscard]] Expected<KinTrial> tryOut(const KinLevel& level, double weight) const;

    /// The smallest weight (to 0.01) at which the trees of a level differ as much as relatives should.
    [[nodiscard]] Expected<KinTrial> calibrate(const KinLevel& level) const;

    /// The finest level whose calibrated trees are different enough, distinct, often enough of the right size, and miss
    /// nothing else; the one that comes nearest where none is.
    /// `tried` receives the best trial of each level, without the classes.
    [[nodiscard]] Expected<KinTrial> chooseLevel(const Shortfall& shortfall, std::vector<KinTrial>& tried) const;

private:
    /// Size, depth and topology of an attempt.
    struct Sample
    {
        std::uint32_t segments;
        std::uint32_t depth;
        std::uint64_t topology;
        bool whole;
        bool copy;               ///< Of a drawn tree.
        std::uint32_t beginning; ///< The drawn tree it began with.
    };
    /// The first accepted of all attempts, and what is seen of the others.
    struct Stand
    {
        std::vector<Sample> samples;
        std::vector<OutlinedTree> accepted;
        GrowthWindow window;
    };
    /// What a KinTrial says of one weight, its difference as estimated.
    struct Outcome
    {
        double weight = 0;
        GrowthWindow window;
        double accepted = 0;
        double equal = 1;
        double difference = 0;
    };
    class Bed;

    [[nodiscard]] TreeRecord record() const;
    [[nodiscard]] bool accepts(const GrowthWindow& window, const Sample& sample) const;
    [[nodiscard]] double acceptedOf(const Stand& stand) const;
    [[nodiscard]] GrowthWindow windowFor(const std::vector<Sample>& samples) const;
    [[nodiscard]] Stand growStand(KinSimulation& simulation, const std::vector<std::uint64_t>& drawn,
                                  double weight) const;
    [[nodiscard]] Outcome outcomeOf(const Stand& stand, double weight) const;
    [[nodiscard]] Expected<Outcome> bisect(Bed& bed, double distanceScale) const;
    [[nodiscard]] double differenceOf(const std::vector<OutlinedTree>& trees) const;
    [[nodiscard]] double distanceScaleOf(const Stand& stand) const;

    const LimbTable& limbs_;
    const std::vector<std::uint32_t>& draws_;
    const Progress& progress_;
    std::vector<std::uint32_t> anchors_;        ///< Number of each template.
    double segments_ = 0;                       ///< Mean of the drawn trees.
    double depth_ = 0;                          ///< Likewise.
    double instances_ = 0;                      ///< Likewise.
    std::uint32_t leastSegments_ = 0xffffffffu; ///< Of the smallest drawn tree.
    std::uint32_t mostSegments_ = 0;            ///< Of the largest.
    std::uint32_t leastDepth_ = 0xffffffffu;
    std::uint32_t mostDepth_ = 0;
};

} // namespace espalier
