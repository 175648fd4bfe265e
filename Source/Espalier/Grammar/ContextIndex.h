#pragma once

#include <Espalier/Core/RawVector.h>
#include <Espalier/Grammar/GrammarProgram.h>
#include <cstdint>
#include <span>
#include <vector>

namespace espalier {

struct Word;

/// Who is whose neighbour in one word, found in two passes, so that matching a context costs its own length and not
/// that of the branches between (Content/Grammars/LANGUAGE.md, Contexts; ABOP p. 30-32).
class ContextIndex
{
public:
    /// Indexes `word`, which must stay as it is while this is used. Its brackets balance. Keeps the memory.
    void build(const GrammarProgram& program, const Word& word);

    /// True if the contexts of `rule` match around the module at `position`. Then the arguments of that module and
    /// after them those of the contexts, in the order in which expressions number them, stand in `parameters`. Adds
    /// what it looked at to `work` and gives up, without a match, once that exceeds `mostWork`.
    [[nodiscard]] bool matches(const GrammarProgram::Rule& rule, std::uint32_t position,
                               std::vector<double>& parameters, std::uint64_t& work, std::uint64_t mostWork);

    /// Place of the first argument of the module at `position`.
    [[nodiscard]] std::uint32_t firstArgument(std::uint32_t position) const { return arguments_[position]; }

private:
    static constexpr std::uint32_t kNone = 0xffffffffu;

    /// A branch that a pattern has entered.
    struct Branch
    {
        std::uint32_t open;  ///< Place of its [.
        std::uint32_t outer; ///< Index of the branch round it.
    };
    /// Where a right context can be tried otherwise.
    struct Alternative
    {
        std::uint32_t step;   ///< The pattern's [.
        std::uint32_t first;  ///< Where its branches were looked for from.
        std::uint32_t place;  ///< The [ after the one that was entered, or where to look for it.
        std::uint32_t branch; ///< Entered so far.
        std::size_t branches;
        std::size_t parameters;
    };

    [[nodiscard]] bool matchesLeft(const GrammarProgram::Rule& rule, std::uint32_t position);
    [[nodiscard]] bool matchesRight(const GrammarProgram::Rule& rule, std::uint32_t position,
                                    std::vector<double>& parameters, std::uint64_t& work, std::uint64_t mostWork);
    [[nodiscard]] std::uint32_t branchFrom(std::uint32_t place, std::uint64_t& work) const;
    void appendArguments(std::uint32_t position, std::vector<double>& parameters) const;

    const GrammarProgram* program_ = nullptr;
    const Word* word_ = nullptr;
    RawVector<std::uint32_t> arguments_;
    RawVector<std::uint32_t> left_;    ///< The nearest module towards the base that contexts see.
    RawVector<std::uint32_t> right_;   ///< The next one towards the tip on the same axis.
    RawVector<std::uint32_t> partner_; ///< Of brackets: the other one.
    std::vector<std::uint32_t> stack_;
    std::vector<std::uint32_t> neighbours_;
    std::vector<Branch> branches_;
    std::vector<Alternative> alternatives_;
    /// For each step of the pattern, between which places all branches have failed: what comes after a branch does not
    /// depend on how it was reached, so none is tried twice.
    struct Exhausted
    {
        std::uint32_t first = 1;
        std::uint32_t last = 0;
    };
    std::vector<Exhausted> exhausted_;
};

} // namespace espalier
