#pragma once

#include <Espalier/Core/Error.h>
#include <Espalier/Core/Limits.h>
#include <Espalier/Core/Random.h>
#include <Espalier/Grammar/Derivation.h>
#include <Espalier/Plant/Skeleton.h>
#include <Espalier/Species/Species.h>
#include <Espalier/Turtle/Turtle.h>
#include <optional>
#include <string_view>
#include <vector>

namespace espalier {

/// How one tree is grown. The same species, seed and options give the same bits.
struct GrowOptions
{
    DerivationBudget budget{.productions = 1u << 20, .depth = 1u << 16, .modules = 4u << 20};
    Limits limits{};
    std::optional<std::uint32_t>
        attempt{}; ///< Take this attempt whether it fits the window or not (while a designer edits).
};

/// Memory that growing needs; reuse it and nothing is allocated after warm-up. One per thread.
struct GrowScratch
{
    DerivationScratch derivation;
    Word word; ///< Of a context-sensitive grammar.
    TurtleScratch turtle;
};

/// What one attempt would become, without drawing it.
struct GrowthSample
{
    std::uint32_t segments = 0;
    std::uint32_t instances = 0;
    std::uint32_t depth = 0;    ///< Nested template instances.
    std::uint64_t topology = 0; ///< Hash of its word without parameters.
    bool whole = true;          ///< False if it was left because it grew too large.
};

/// GrowthSample::topology of a word, symbol by symbol: for those who know what will be derived.
class TopologyHash
{
public:
    /// What stands for a symbol: numbers depend on the text, names do not.
    [[nodiscard]] static std::uint64_t ofName(std::string_view symbol) noexcept;
    void add(std::uint64_t nameHash) noexcept
    {
        value_ = (value_ ^ nameHash) * 0x100000001b3u;
        value_ ^= value_ >> 29;
    }
    [[nodiscard]] std::uint64_t value() const noexcept { return value_; }

private:
    std::uint64_t value_ = 0;
};

/// A species made ready: its grammar compiled, its symbols bound to the turtle. Immutable; share it among threads.
class Grower
{
public:
    /// A species grows by so many steps of its grammar if `iterations`, or else the grammar's `iterations:`, tells how
    /// many; otherwise until nothing can be rewritten, as inferred species do, which needs a grammar without contexts.
    /// What is certain to exceed `limits` is refused here, before anything is grown.
    [[nodiscard]] static Expected<Grower> make(const Species& species, std::optional<std::uint32_t> iterations = {},
                                               const Limits& limits = {});

    /// A grammar alone: derived by `iterations` steps, else by its `iterations:`, else by none. Where it sets no
    /// widths, radii suit each plant (suggestPipes).
    [[nodiscard]] static Expected<Grower> make(const Grammar& grammar, std::optional<std::uint32_t> iterations = {},
                                               const Limits& limits = {});

    /// What gives back drawn tree number `tree`, parameters and all, whatever the seed. Fails with BadInput if the
    /// species does not hold it: hand-written ones hold none, nor do those of presets that generalise without return.
    [[nodiscard]] static Expected<Grower> makeExemplar(const Species& species, std::uint32_t tree = 0);

    /// Grows the tree of `seed` into `skeleton`, axes and radii included. Depth first, without building a word unless
    /// the grammar has contexts; nothing is allocated once `scratch` and `skeleton` are warm. On failure `skeleton` is
    /// empty. `onlooker` is told what the turtle is told, and stops nothing.
    [[nodiscard]] Expected<void> grow(Seed seed, const GrowOptions& options, GrowScratch& scratch, Skeleton& skeleton,
                                      DerivationSink* onlooker = nullptr) const;

    /// The attempt that grow takes for `seed`.
    [[nodiscard]] Expected<std::uint32_t> acceptedAttempt(Seed seed, const GrowOptions& options,
                                                          GrowScratch& scratch) const;

    /// Derives one attempt and counts. Leaves off once there are more than `mostSegments`.
    [[nodiscard]] Expected<GrowthSample> sample(Seed seed, std::uint32_t attempt, const GrowOptions& options,
                                                GrowScratch& scratch, std::uint32_t mostSegments = 0xffffffffu) const;

    /// Derives one attempt into a sink of the caller's, interpreted.
    [[nodiscard]] Expected<bool> derive(Seed seed, std::uint32_t attempt, const GrowOptions& options,
                                        GrowScratch& scratch, DerivationSink& sink) const;

    [[nodiscard]] const GrammarProgram& program() const noexcept { return program_; }
    /// Of the derivation; none: until nothing can be rewritten.
    [[nodiscard]] std::optional<std::uint32_t> iterations() const noexcept { return iterations_; }

private:
    Grower(GrammarProgram program, const Species& species);

    GrammarProgram program_;
    TurtleAlphabet alphabet_;
    std::vector<std::uint64_t> nameHashes_; ///< Of each letter.
    std::optional<std::uint32_t> iterations_;
    TurtleSettings turtle_;
    std::optional<GrowthWindow> window_;
    std::optional<PipeModel> pipes_; ///< None: such as suit the plant.
};

/// One tree, for those who grow few: Grower::make and grow in one call.
[[nodiscard]] Expected<Skeleton> grow(const Species& species, Seed seed, const GrowOptions& options = {});

} // namespace espalier
