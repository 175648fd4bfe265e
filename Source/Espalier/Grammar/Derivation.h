#pragma once

#include <Espalier/Core/Error.h>
#include <Espalier/Core/Limits.h>
#include <Espalier/Core/Random.h>
#include <Espalier/Grammar/Grammar.h>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace espalier {

/// Bounds of one derivation. When one is reached, what is left is completed by the cheapest terminating productions, so
/// the result is always whole.
struct DerivationBudget
{
    std::uint32_t productions = 1u << 20; ///< Productions applied freely.
    std::uint32_t depth = 64;             ///< Nested productions.
    /// Modules emitted. Completion may go on to twice as many, and apply twice as many productions more; then it is an
    /// error.
    std::uint32_t modules = 4u << 20;
};

/// A grammar made ready for derivation: productions grouped by predecessor, constants folded, weights of inferred rules
/// tabulated, the cheapest way to an end known for every production. Immutable; share it among threads.
class GrammarProgram
{
public:
    /// Fails when a production names an unknown table or row, or a constant cannot be evaluated.
    [[nodiscard]] static Expected<GrammarProgram> make(const Grammar& grammar, std::span<const TransformTable> tables);

    [[nodiscard]] const Grammar& grammar() const noexcept { return grammar_; }

private:
    friend class Deriver;

    static constexpr std::uint32_t kNothing = 0xffffffffu;
    static constexpr double kNever = std::numeric_limits<double>::infinity();

    /// Productions with the same predecessor and parameter count, in the order of the text.
    struct Group
    {
        std::uint32_t parameters = 0;
        std::uint32_t first = 0; ///< Into candidates_ and the arrays beside it.
        std::uint32_t count = 0;
        bool tabulated = false; ///< Every weight is (p == key) * bonus + base: a binary search instead of a scan.
        double cost = kNever;   ///< Of its cheapest production.
        std::uint32_t next = kNothing; ///< Next group of the same symbol.
    };

    /// The weight of one candidate of a tabulated group.
    struct Tabulated
    {
        double key = 0;
        double bonus = 0;
        double baseSum = 0; ///< Of the bases up to and including this one.
    };

    GrammarProgram() = default;
    [[nodiscard]] std::uint32_t groupOf(const Module& module) const noexcept;
    [[nodiscard]] Expected<void> evaluateConstants();
    [[nodiscard]] Expected<void> resolveTables();
    void groupProductions();
    void tabulate(Group& group);
    [[nodiscard]] bool tabulateWeight(const Production& production, Tabulated& entry, double& base) const;
    void price();

    Grammar grammar_;
    std::vector<TransformTable> tables_;
    std::vector<double> constants_;
    std::vector<std::uint32_t> firstGroup_; ///< Of each symbol.
    std::vector<Group> groups_;
    std::vector<std::uint32_t> candidates_; ///< Production indices.
    std::vector<Tabulated> tabulated_;
    std::vector<std::uint32_t> byKey_;   ///< Each tabulated group's candidates, sorted by key.
    std::vector<double> costs_;          ///< Of each production: fewest modules and productions that end it.
    std::vector<std::uint32_t> tableOf_; ///< Of each production; kNothing for none.
};

/// Memory of a derivation; reuse it and nothing is allocated after warm-up. One per thread.
struct DerivationScratch
{
    struct Frame
    {
        std::uint32_t production;     ///< 0xffffffff: the axiom.
        std::uint32_t position;       ///< Next module of its successor.
        std::uint32_t ordinal;        ///< Rewritten modules met so far: the child's place in the path.
        std::uint32_t firstParameter; ///< Into `parameters`.
        RandomKey key;
        double transform[4];
    };
    std::vector<Frame> frames;
    std::vector<double> parameters; ///< Of all frames.
    std::vector<double> arguments;  ///< Of the module at hand.
    std::vector<double> weights;
    std::uint64_t work = 0; ///< Productions applied and modules emitted by the last derivation.
};

/// Receives a derivation as it happens, depth first, in the order of the word.
class DerivationSink
{
public:
    virtual ~DerivationSink() = default;
    /// A module that nothing rewrites: no production is for its symbol and number of arguments, or no condition holds.
    /// Return false to stop.
    virtual bool module(SymbolId symbol, std::span<const double> arguments) = 0;
    /// A production with a table begins: a template instance. `row` is that of its transform.
    virtual void beginInstance(std::uint32_t production, std::uint32_t row) = 0;
    virtual void endInstance() = 0;
    /// False if the arguments of terminal modules need not be evaluated: `module` then gets none.
    [[nodiscard]] virtual bool wantsArguments() const { return true; }
};

/// Derives the axiom until nothing can be rewritten, depth first, in memory proportional to the depth, into `sink`.
///
/// Of the productions that match a module, those with the weights of the first candidate's kind compete (DESIGN 6).
/// Every choice is keyed by its path: the ordinals of rewritten modules from the axiom down. Returns false if the sink
/// stopped it. Fails with BadInput when an expression has no finite value, a weight is negative, or the weights of all
/// productions that match are 0; with Limit when completion goes too far.
[[nodiscard]] Expected<bool> derive(const GrammarProgram& program, RandomKey key, const DerivationBudget& budget,
                                    DerivationScratch& scratch, DerivationSink& sink);

} // namespace espalier
