#pragma once

#include <Espalier/Core/Error.h>
#include <Espalier/Core/Limits.h>
#include <Espalier/Core/Random.h>
#include <Espalier/Core/RawVector.h>
#include <Espalier/Grammar/ContextIndex.h>
#include <Espalier/Grammar/GrammarProgram.h>
#include <Espalier/Grammar/Word.h>
#include <cstdint>
#include <span>
#include <vector>

namespace espalier {

// Three ways through one set of rules (Content/Grammars/LANGUAGE.md). All modules of a word are rewritten at once; a
// module that nothing matches is copied. Every choice is keyed by its path: the ordinals of rewritable modules from the
// axiom down, so a change in one branch leaves the others as they were.
//
//   deriveWord     so many steps, the word in memory; every kind of L-system
//   streamWord     the same word, depth first into a sink, in memory proportional to the depth; context-free ones
//   deriveToEnd    depth first until nothing can be rewritten, completed within a budget; what species grow by
//
// All fail with BadInput when an expression has no finite value, a weight is negative, or the weights of all rules that
// compete are 0; with Limit as each says. Errors have the line and column of the axiom, production or expression.

/// Memory of a derivation; reuse it and nothing is allocated after warm-up. One per thread.
struct DerivationScratch
{
    struct Frame
    {
        std::uint32_t word = 0;           ///< Of the program: 0 is the axiom.
        std::uint32_t nextRewritable = 0; ///< Into the word's rewritables.
        std::uint32_t nextModule = 0;
        std::uint32_t nextPatch = 0;
        std::uint32_t depth = 0; ///< The step that wrote it.
        std::uint32_t firstParameter = 0;
        RandomKey key{Seed{}};
        double transform[4] = {1, 0, 0, 0};
    };
    // Depth first.
    std::vector<Frame> frames;
    std::vector<double> parameters;    ///< Of all frames.
    std::vector<double> arguments;     ///< Of the module at hand.
    std::vector<double> nextArguments; ///< Of what it becomes.
    Word run;                          ///< Modules on their way to the sink.
    // Word by word.
    Word next;
    RawVector<RandomKey> keys;
    RawVector<RandomKey> nextKeys;
    RawVector<std::uint32_t> choices;
    ContextIndex contexts;
    std::vector<std::uint64_t> sizes;   ///< Of expansions, by letter and steps.
    std::vector<std::uint64_t> offsets; ///< Where an expansion was written.
    // Both.
    std::vector<double> weights;
    std::uint64_t work = 0; ///< Of the last derivation, as Limits::derivationWork counts it.
};

/// Replaces `word` by what `steps` steps make of the axiom.
///
/// Fails with Limit before the memory is taken when a word would exceed `limits.modules` or `limits.arguments`, naming
/// the step and the size; when all steps together take more than `limits.derivationWork`. On failure `word` is empty.
[[nodiscard]] Expected<void> deriveWord(const GrammarProgram& program, RandomKey key, std::uint32_t steps,
                                        const Limits& limits, DerivationScratch& scratch, Word& word);

/// Receives a derivation as it happens, depth first, in the order of the word.
class DerivationSink
{
public:
    virtual ~DerivationSink() = default;
    /// Modules that nothing rewrites any more; their arguments stand behind each other (none if wantsArguments is
    /// false). Runs are as long as they happen to be, never empty. Return false to stop.
    virtual bool modules(std::span<const LetterId> letters, std::span<const double> arguments) = 0;
    /// A rule with a table begins: a template instance. `production` is its index in the grammar, `row` that of its
    /// transform.
    virtual void beginInstance(std::uint32_t production, std::uint32_t row)
    {
        (void)production;
        (void)row;
    }
    virtual void endInstance() {}
    /// False if the arguments of terminal modules need not be evaluated.
    [[nodiscard]] virtual bool wantsArguments() const { return true; }
};

/// What a sink gets to see of a derived word.
enum class Interpretation : std::uint8_t
{
    None,  ///< The word as it is derived.
    Apply, ///< After `interpret:`: what is drawn.
};

/// The word of `steps` steps into `sink`, without ever being held. Requires a context-free program. Returns false if
/// the sink stopped it. Fails with Limit beyond `limits.modules` modules, after `interpret:` if that is applied, or
/// beyond `limits.derivationWork`.
[[nodiscard]] Expected<bool> streamWord(const GrammarProgram& program, RandomKey key, std::uint32_t steps,
                                        Interpretation interpretation, const Limits& limits, DerivationScratch& scratch,
                                        DerivationSink& sink);

/// `word`, as deriveWord has just derived it by `steps` steps with this very `scratch` (which holds the keys of its
/// modules), into `sink`; interpreted or as it is. For programs that are not context-free; otherwise streamWord saves
/// the word. Fails with Limit as streamWord does.
[[nodiscard]] Expected<bool> emitWord(const GrammarProgram& program, std::uint32_t steps, Interpretation interpretation,
                                      const Limits& limits, DerivationScratch& scratch, const Word& word,
                                      DerivationSink& sink);

/// Bounds of one derivation to the end. When one is reached, what is left is completed by the cheapest terminating
/// productions, so the result is always whole.
struct DerivationBudget
{
    std::uint32_t productions = 1u << 20; ///< Productions applied freely.
    std::uint32_t depth = 64;             ///< Nested productions.
    /// Modules emitted. Completion may go on to twice as many, and apply twice as many productions more; then it is an
    /// error.
    std::uint32_t modules = 4u << 20;
};

/// Derives the axiom until nothing can be rewritten. Requires a context-free program; interpretations are applied.
/// Returns false if the sink stopped it. Fails with Limit when completion goes too far.
[[nodiscard]] Expected<bool> deriveToEnd(const GrammarProgram& program, RandomKey key, const DerivationBudget& budget,
                                         DerivationScratch& scratch, DerivationSink& sink);

} // namespace espalier
