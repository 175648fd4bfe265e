#pragma once

#include <Espalier/Archetype/Archetype.h>
#include <Espalier/Core/Error.h>
#include <Espalier/Core/Progress.h>
#include <Espalier/Core/Random.h>
#include <Espalier/Plant/Measure.h>
#include <Espalier/Species/Species.h>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace espalier {

/// One parameter of branches: how far its distribution over the grown trees is from the drawn ones'.
struct ParameterComparison
{
    double distance = 0; ///< Earth mover's distance over `spread`; 0 if both are 0, infinite if only the spread is.
    double spread = 0;   ///< Standard deviation over the drawn trees; of azimuths, of the way round to their mean.
};

/// A value of the drawn trees, or their mean, and the mean of the grown ones'.
struct MeanComparison
{
    double exemplar = 0;
    double mean = 0;
};

/// Similarity and diversity: what the trees of a species have in common with those that it was inferred from, and with
/// each other. Nodes are template instances, labelled by the kind of their template (kindsOf). Where several trees were
/// drawn, their distributions are pooled, their values averaged, and what compares tree with tree takes the nearest.
struct Comparison
{
    std::uint32_t seeds = 0;
    std::uint32_t exemplars = 0;
    double exemplarInstances = 0; ///< Mean.

    struct
    {
        double exemplar = 0; ///< Segments.
        double mean = 0;
        double median = 0;
        double within = 0;     ///< Share of 0.5 to 1.5 times a drawn tree.
        double tiny = 0;       ///< Share below a tenth of every drawn tree.
        double unfinished = 0; ///< Share with symbols left that a rule could still rewrite.
    } size;

    double anchorDivergence = 0; ///< Jensen-Shannon, bit; of (parent template, place, child template).

    struct
    {
        ParameterComparison angle;   ///< Of lateral branches to what they leave.
        ParameterComparison length;  ///< Of segments.
        ParameterComparison width;   ///< Of segments.
        ParameterComparison azimuth; ///< Of lateral branches round what they leave.
    } parameters;

    MeanComparison depth;       ///< Nested template instances.
    double depthHistogram = 0;  ///< Earth mover's distance between the depths of instances, in instances.
    MeanComparison strahler;    ///< Horton-Strahler number.
    double strahlerWithin1 = 0; ///< Share.
    MeanComparison bifurcation; ///< Horton's bifurcation ratio.

    struct
    {
        double exemplarMedian = 0; ///< Edit distance over the sum of the instances.
        double pairMedian = 0;     ///< Likewise, between a tree and the next.
        std::uint32_t pairs = 0;   ///< Trees that were compared each way; large trees: fewer than `seeds`.
        bool estimated = false;    ///< estimatedEditDistance: a tree has more than 2,000 instances or nests too deeply.
    } editDistance;

    double distinct = 0; ///< Share of different trees (templates and places; transforms do not count).
    double copies = 0;   ///< Share that is a drawn tree.

    struct
    {
        MeanComparison height; ///< Metres.
        MeanComparison width;  ///< Metres: twice the largest distance from the Y axis.
        double profile = 0;    ///< Earth mover's distance between length by height, over the drawn trees' height.
    } crown;

    /// What the distances were taken between, for charts: values of drawn trees, and of grown ones (of large numbers,
    /// an even part).
    struct Samples
    {
        BranchMeasures branches;
        std::vector<double> segments;      ///< Of each tree.
        std::vector<double> depths;        ///< Of each instance.
        std::vector<double> lengthByShare; ///< Metres of branch a tree by height, in kProfileBins steps from the ground
                                           ///< to twice the mean height of the drawn trees.
    };
    Samples drawn;
    Samples grown;
    std::vector<double> exemplarDistances; ///< Of each tree that was compared.
    std::vector<double> pairDistances;
};

inline constexpr std::size_t kProfileBins = 128;

struct ComparisonOptions
{
    Seed first{1};
    std::uint32_t seeds = 2000; ///< first, first + 1, ...; at least 2.
    /// How much edit distances may take, all together (editSteps): 3e10 are 15 seconds of one processor. Where it
    /// does not suffice for all trees, an even part of them is compared, and where it would be for fewer than 20,
    /// distances are estimated.
    double editSteps = 3e10;
    /// Instead, trees are compared whatever that takes: all if 1, else of every `editEvery` + 1 the last two.
    std::uint32_t editEvery = 0;
    std::uint32_t threads = 0; ///< 0: one per processor. The comparison does not depend on it.
    Progress progress{};
};

/// Grows trees of `species` and compares them with what it was inferred from, as exemplarsOf gives it: with depth and
/// mirror images, if they were taught. Each drawn tree counts as often as the species says it did there, if it has as
/// many. Tables of the species are matched with the archetypes' templates by name. Deterministic. Fails as Grower does,
/// and with BadInput for an archetype that is not valid, a species without template instances, or fewer than 2 seeds.
[[nodiscard]] Expected<Comparison> compare(std::span<const Archetype> archetypes, const Species& species,
                                           const ComparisonOptions& options = {});

/// One measure against what relatives should keep.
struct Bar
{
    std::string measure;
    double value = 0;
    double low = 0;     ///< -infinity: no bound.
    double high = 0;    ///< infinity: no bound.
    std::string advice; ///< What helps where it does not hold.

    [[nodiscard]] bool holds() const noexcept { return value >= low && value <= high; }
};

/// The bars that relatives are held to: of the drawn kind (sizes, branchings, parameters, depth, order, crown), yet
/// neither copies nor strangers. Of drawn trees with fewer than 25 instances less is asked.
[[nodiscard]] std::vector<Bar> barsOf(const Comparison& comparison);

} // namespace espalier
