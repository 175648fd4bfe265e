#pragma once

#include <Espalier/Core/Error.h>
#include <Espalier/Core/Limits.h>
#include <Espalier/Grammar/ExpressionCode.h>
#include <Espalier/Grammar/Grammar.h>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

namespace espalier {

/// A symbol together with its number of arguments, numbered within one GrammarProgram: what words are made of, so that
/// the number of arguments need not be stored with every module.
using LetterId = std::uint16_t;

/// What a letter is to a context.
enum class LetterRole : std::uint8_t
{
    Plain,
    Open,    ///< [
    Close,   ///< ]
    Ignored, ///< Contexts do not see it.
};

/// A grammar made ready for derivation: letters numbered, expressions compiled, productions grouped by what they
/// rewrite and sorted into the order in which they are tried, contexts and successors laid flat, weights of inferred
/// rules tabulated, the cheapest way to an end known for every production. Immutable; share it among threads.
class GrammarProgram
{
public:
    /// Fails when a production names an unknown table or row, a constant cannot be evaluated, an expression nests too
    /// deep, brackets of a word or context do not balance, one module or rule draws more than 255 random values, or
    /// there are more than 65,535 letters.
    [[nodiscard]] static Expected<GrammarProgram> make(const Grammar& grammar,
                                                       std::span<const TransformTable> tables = {});

    [[nodiscard]] const Grammar& grammar() const noexcept { return grammar_; }

    [[nodiscard]] std::uint32_t letterCount() const noexcept { return static_cast<std::uint32_t>(symbols_.size()); }
    [[nodiscard]] SymbolId symbolOf(LetterId letter) const { return symbols_[letter]; }
    [[nodiscard]] std::uint32_t arityOf(LetterId letter) const { return arities_[letter]; }
    /// Of all letters, for loops over words.
    [[nodiscard]] std::span<const std::uint8_t> arities() const noexcept { return arities_; }

    /// No production looks at its neighbours: the derivation can be streamed.
    [[nodiscard]] bool isContextFree() const noexcept { return contextFree_; }
    /// Each letter has one production at most, without condition, choice or computed argument: a step replaces letters
    /// by fixed words.
    [[nodiscard]] bool isConstant() const noexcept { return constant_; }
    /// Something is drawn at random, interpretation included.
    [[nodiscard]] bool isRandom() const noexcept { return random_; }
    [[nodiscard]] bool hasInterpretations() const noexcept { return !grammar_.interpretations.empty(); }

    // What follows is for those who derive, forecast and check: the compiled grammar itself.

    static constexpr std::uint32_t kNothing = 0xffffffffu;
    static constexpr std::uint32_t kUndecided = 0xfffffffeu;
    /// Letters and arguments may be copied in pieces of this many: so many more can be read behind the last word.
    static constexpr std::uint32_t kPadding = 8;
    static constexpr double kNever = std::numeric_limits<double>::infinity();

    /// An argument that must be computed each time.
    struct ArgumentPatch
    {
        std::uint32_t argument = 0; ///< Place among the arguments of the word.
        std::uint32_t module = 0;   ///< Place of its module in the word.
        CompiledExpression value;
    };

    /// The axiom or a successor, ready to be copied: letters and constant arguments in one piece, then the patches.
    struct Word
    {
        std::uint32_t firstLetter = 0; ///< Into letters and, for each letter and one more, into moduleArguments.
        std::uint32_t letterCount = 0;
        std::uint32_t firstArgument = 0; ///< Into arguments.
        std::uint32_t argumentCount = 0;
        std::uint32_t firstPatch = 0; ///< Into patches.
        std::uint32_t patchCount = 0;
        std::uint32_t patchCost = 0;       ///< Work of computing all of them.
        std::uint32_t firstRewritable = 0; ///< Into rewritables: places of letters that have productions.
        std::uint32_t rewritableCount = 0;
    };

    /// One element of a right context.
    struct ContextStep
    {
        LetterRole role = LetterRole::Plain; ///< Plain: this letter; Open: a branch begins; Close: it is left.
        LetterId letter = 0;
    };

    struct Rule
    {
        std::uint32_t source = 0; ///< Index into Grammar::productions, or ::interpretations.
        bool isInterpretation = false;
        bool hasCondition = false;
        bool hasWeight = false;
        bool isChangeable = false; ///< Its condition depends on the step or on chance.
        CompiledExpression condition;
        CompiledExpression weight;
        CompiledExpression row;
        std::uint32_t table = kNothing;
        std::uint32_t leftSide = 0;  ///< Equal for rules of one group with the same contexts.
        std::uint32_t firstLeft = 0; ///< Into leftContexts, nearest letter first.
        std::uint32_t leftCount = 0;
        std::uint32_t firstRight = 0; ///< Into rightContexts.
        std::uint32_t rightCount = 0;
        std::uint32_t contextParameters = 0; ///< Of both contexts.
        std::uint32_t trialCost = 8;         ///< Work of trying it.
        double cost = kNever;                ///< Fewest modules and productions that end it.

        [[nodiscard]] bool hasContext() const noexcept { return leftCount + rightCount > 0; }
        [[nodiscard]] bool isUnconditional() const noexcept { return !hasCondition && !hasContext(); }
    };

    /// Rules for one letter, in the order in which they are tried.
    struct Group
    {
        std::uint32_t first = 0; ///< Into candidates and the arrays beside it.
        std::uint32_t count = 0;
        bool always = false;     ///< The first candidate is taken whatever the module and its neighbours.
        bool certain = false;    ///< Some candidate always matches: the module is never copied.
        bool changeable = false; ///< Whether a candidate matches depends on the step or on chance.
        bool tabulated = false;  ///< Every weight is (p == key) * bonus + base: a binary search instead of a scan.
        double cost = kNever;    ///< Of its cheapest rule.
    };

    /// The weight of one candidate of a tabulated group.
    struct Tabulated
    {
        double key = 0;
        double bonus = 0;
        double baseSum = 0; ///< Of the bases up to and including this one.
    };

    /// What a letter of a constant program becomes in so many steps, written out because it is short.
    struct Expansion
    {
        std::uint32_t firstLetter = 0;        ///< Into expandedLetters.
        std::uint32_t letterCount = kNothing; ///< kNothing: it is not written out.
        std::uint32_t firstArgument = 0;      ///< Into expandedArguments.
        std::uint32_t argumentCount = 0;
    };
    static constexpr std::uint32_t kExpandedSteps = 12;        ///< At most so many steps are written out,
    static constexpr std::uint32_t kExpandedLength = 512;      ///< so many letters each,
    static constexpr std::uint32_t kExpandedTotal = 32u << 10; ///< and so many together: what nearby caches hold.

    /// How often a letter occurs in a word.
    struct LetterCount
    {
        LetterId letter;
        std::uint32_t count;
    };

    /// Word 0 is the axiom; word i + 1 the successor of rule i. Rules: productions, then interpretations.
    struct Code
    {
        ExpressionCode expressions;
        std::vector<Word> words;
        std::vector<LetterId> letters;
        std::vector<std::uint32_t> moduleArguments; ///< Place of each module's first argument in its word.
        std::vector<std::uint32_t> ordinals;        ///< Of each module: modules before it that have a key.
        std::vector<double> arguments;
        std::vector<ArgumentPatch> patches;
        std::vector<std::uint32_t> rewritables;
        std::vector<LetterCount> letterCounts;       ///< Of each word in turn, each letter of it once.
        std::vector<std::uint32_t> firstLetterCount; ///< By word; one more than there are words.
        std::vector<Rule> rules;
        std::vector<LetterId> leftContexts;
        std::vector<ContextStep> rightContexts;
        std::vector<Group> groups;
        std::vector<std::uint32_t> candidates; ///< Rule indices.
        std::vector<Tabulated> tabulated;
        std::vector<std::uint32_t> byKey;               ///< Each tabulated group's candidates, sorted by key.
        std::vector<std::uint32_t> fixedRule;           ///< Of each letter: what always rewrites it; kNothing: it is
                                                        ///< copied; kUndecided: its group must be asked.
        std::vector<std::uint32_t> groupOfLetter;       ///< Productions for a letter; kNothing for none.
        std::vector<std::uint32_t> interpretationGroup; ///< Interpretations of a letter; kNothing for none.
        std::vector<LetterRole> roles;                  ///< Of each letter.
        std::vector<Expansion> expansions; ///< By letter and steps - 1; empty if the program is not constant.
        std::vector<LetterId> expandedLetters;
        std::vector<double> expandedArguments;
    };

    [[nodiscard]] const Code& code() const noexcept { return code_; }
    /// The expansion of a letter by steps > 0, or null if it is not written out.
    [[nodiscard]] const Expansion* expansion(LetterId letter, std::uint32_t steps) const
    {
        if (code_.expansions.empty() || steps > kExpandedSteps)
            return nullptr;
        const Expansion& found = code_.expansions[std::size_t{letter} * kExpandedSteps + steps - 1];
        return found.letterCount == kNothing ? nullptr : &found;
    }
    [[nodiscard]] std::span<const LetterCount> letterCountsOf(std::uint32_t word) const
    {
        return std::span(code_.letterCounts)
            .subspan(code_.firstLetterCount[word], code_.firstLetterCount[word + 1] - code_.firstLetterCount[word]);
    }
    [[nodiscard]] std::span<const TransformTable> tables() const noexcept { return tables_; }
    /// Values of the grammar's `let`.
    [[nodiscard]] std::span<const double> constants() const noexcept { return constants_; }
    /// The production or interpretation that a rule was made from.
    [[nodiscard]] const Production& sourceOf(const Rule& rule) const
    {
        return rule.isInterpretation ? grammar_.interpretations[rule.source] : grammar_.productions[rule.source];
    }
    /// True if modules with this letter take part in the numbering of random choices.
    [[nodiscard]] bool isKeyed(LetterId letter) const
    {
        return code_.groupOfLetter[letter] != kNothing || code_.interpretationGroup[letter] != kNothing;
    }

private:
    GrammarProgram() = default;
    [[nodiscard]] Expected<void> evaluateConstants();
    [[nodiscard]] Expected<void> resolveTables();
    [[nodiscard]] Expected<void> numberLetters();
    [[nodiscard]] Expected<void> checkBrackets() const;
    void countDraws(const ExpressionNeeds& needs, TextPlace place);
    void compileRules(const std::vector<Production>& productions, bool areInterpretations);
    void compileContexts(const Production& production, Rule& rule);
    void groupRules(std::uint32_t firstRule, std::uint32_t lastRule, std::vector<std::uint32_t>& groupOfLetter);
    void classify(Group& group);
    void compileWord(const std::vector<Module>& modules, TextPlace place);
    void tabulate(Group& group);
    [[nodiscard]] bool tabulateWeight(const Rule& rule, Tabulated& entry, double& base) const;
    void price();
    void summarise();
    void countLetters();
    void expand();
    [[nodiscard]] Expansion expansionOf(std::uint32_t rule, std::uint32_t steps);
    [[nodiscard]] LetterId letterOf(SymbolId symbol, std::size_t arity) const;
    [[nodiscard]] bool constantValue(ExpressionId id, double& value) const;

    Grammar grammar_;
    std::vector<TransformTable> tables_;
    std::vector<double> constants_;
    std::vector<SymbolId> symbols_;
    std::vector<std::uint8_t> arities_;
    std::vector<std::vector<std::pair<std::uint32_t, LetterId>>> lettersOfSymbol_; ///< By number of arguments.
    std::vector<std::uint32_t> tableOfProduction_;
    Code code_;
    bool contextFree_ = true;
    bool constant_ = true;
    bool random_ = false;
    std::optional<TextPlace> tooManyDraws_; ///< Of a module or rule that draws more than there are numbers for.
};

} // namespace espalier
