#include <Espalier/Grammar/Inspection.h>

#include <Espalier/Core/Json.h>
#include <Espalier/Grammar/Forecast.h>
#include <algorithm>
#include <cmath>
#include <span>

namespace espalier {

namespace {

using Code = GrammarProgram::Code;
constexpr std::uint32_t kNothing = GrammarProgram::kNothing;

/// Finds the letters that can occur and the rules that can be taken.
class Reachability
{
public:
    explicit Reachability(const GrammarProgram& program)
        : program_(program), code_(program.code()), reached_(program.letterCount(), false),
          reachedBy_(program.letterCount()), reachedOf_(program.grammar().symbols.size(), kNothing),
          missing_(code_.rules.size(), 0)
    {
        listReasons();
        waitForContexts();
        reachWord(0);
        while (!pending_.empty())
        {
            const std::uint32_t rule = pending_.back();
            pending_.pop_back();
            reachWord(rule + 1);
        }
        for (std::uint32_t l = program.letterCount(); l-- > 0;)
            if (reached_[l])
                reachedOf_[program.symbolOf(static_cast<LetterId>(l))] = l;
    }

    [[nodiscard]] bool reaches(LetterId letter) const { return reached_[letter]; }
    [[nodiscard]] bool occurs(SymbolId symbol) const { return reachedOf_[symbol] != kNothing; }
    [[nodiscard]] bool canBeTaken(std::uint32_t rule) const { return reasons_[rule].empty() && missing_[rule] == 0; }

    /// Why a rule can never be taken.
    [[nodiscard]] std::string reasonOf(std::uint32_t rule) const
    {
        if (!reasons_[rule].empty())
            return reasons_[rule];
        const GrammarProgram::Rule& one = code_.rules[rule];
        const auto contexts = std::span(code_.leftContexts).subspan(one.firstLeft, one.leftCount);
        for (std::size_t i = contexts.size(); i-- > 0;)
            if (!reaches(contexts[i]))
                return text(contexts[i]) + " never occurs";
        for (const GrammarProgram::ContextStep& step :
             std::span(code_.rightContexts).subspan(one.firstRight, one.rightCount))
            if (!reaches(step.letter))
                return text(step.letter) + " never occurs";
        const Production& source = program_.sourceOf(one);
        const std::string reason = text(source.predecessor, source.parameters.size()) + " never occurs";
        const std::uint32_t other = reachedOf_[source.predecessor];
        return other == kNothing ? reason : reason + ", but " + text(static_cast<LetterId>(other)) + " does";
    }

    std::string text(LetterId letter) const { return text(program_.symbolOf(letter), program_.arityOf(letter)); }

    std::string text(SymbolId symbol, std::size_t parameters) const
    {
        std::string result = "`" + program_.grammar().symbols.name(symbol) + "`";
        if (parameters > 0)
            result += " with " + std::to_string(parameters) + (parameters == 1 ? " parameter" : " parameters");
        return result;
    }

private:
    /// What speaks against a rule by itself and by those before it in its group.
    void listReasons()
    {
        reasons_.resize(code_.rules.size());
        for (const GrammarProgram::Group& group : code_.groups)
        {
            const GrammarProgram::Rule* sure = nullptr; // always matches: none after it is asked
            for (const std::uint32_t index : std::span(code_.candidates).subspan(group.first, group.count))
            {
                const GrammarProgram::Rule& rule = code_.rules[index];
                if (rule.hasCondition && rule.condition.isConstant())
                    reasons_[index] = "its condition never holds";
                else if (sure && !(sure->hasWeight && rule.hasWeight && rule.leftSide == sure->leftSide))
                    reasons_[index] = "the production of line " + std::to_string(program_.sourceOf(*sure).place.line) +
                                      " always matches before it";
                else if (rule.hasWeight && rule.weight.isConstant() && rule.weight.value == 0)
                    reasons_[index] = "its weight is 0";
                if (!sure && rule.isUnconditional())
                    sure = &rule;
            }
        }
    }

    /// A rule is pending once its predecessor and every letter of its contexts have been reached.
    void waitForContexts()
    {
        for (std::uint32_t r = 0; r < code_.rules.size(); ++r)
        {
            const GrammarProgram::Rule& rule = code_.rules[r];
            std::vector<LetterId> needed;
            for (std::uint32_t i = 0; i < rule.leftCount; ++i)
                needed.push_back(code_.leftContexts[rule.firstLeft + i]);
            for (std::uint32_t i = 0; i < rule.rightCount; ++i)
                needed.push_back(code_.rightContexts[rule.firstRight + i].letter);
            std::ranges::sort(needed);
            needed.erase(std::unique(needed.begin(), needed.end()),
                         needed.end()); // clang 14 cannot read std::ranges::unique
            for (const LetterId letter : needed)
                reachedBy_[letter].push_back(r);
            missing_[r] = static_cast<std::uint32_t>(needed.size()) + 1;
        }
        for (std::uint32_t l = 0; l < program_.letterCount(); ++l)
            for (const std::uint32_t g : {code_.groupOfLetter[l], code_.interpretationGroup[l]})
                if (g != kNothing)
                    for (const std::uint32_t r :
                         std::span(code_.candidates).subspan(code_.groups[g].first, code_.groups[g].count))
                        reachedBy_[l].push_back(r);
    }

    void reachWord(std::uint32_t index)
    {
        const GrammarProgram::Word& word = code_.words[index];
        // What `interpret:` writes is drawn, and never rewritten or interpreted again.
        if (index > 0 && code_.rules[index - 1].isInterpretation)
            return;
        for (const LetterId letter : std::span(code_.letters).subspan(word.firstLetter, word.letterCount))
        {
            if (reached_[letter])
                continue;
            reached_[letter] = true;
            for (const std::uint32_t rule : reachedBy_[letter])
                if (--missing_[rule] == 0 && reasons_[rule].empty())
                    pending_.push_back(rule);
        }
    }

    const GrammarProgram& program_;
    const Code& code_;
    std::vector<bool> reached_;
    std::vector<std::vector<std::uint32_t>> reachedBy_; ///< Rules that wait for a letter.
    std::vector<std::uint32_t> reachedOf_;              ///< The first letter of each symbol that is reached.
    std::vector<std::uint32_t> missing_;                ///< Letters that a rule still waits for.
    std::vector<std::uint32_t> pending_;
    std::vector<std::string> reasons_;
};

void findUseless(const GrammarProgram& program, const Reachability& reachability, GrammarInspection& result)
{
    std::vector<bool> told(program.grammar().symbols.size(), false);
    for (std::uint32_t r = 0; r < program.code().rules.size(); ++r)
    {
        if (reachability.canBeTaken(r))
            continue;
        const GrammarProgram::Rule& rule = program.code().rules[r];
        const Production& source = program.sourceOf(rule);
        result.findings.push_back({GrammarFinding::Kind::UselessProduction, source.place,
                                   "the production `" + shortened(printProduction(program.grammar(), source)) +
                                       "` can never be taken: " + reachability.reasonOf(r)});
    }
    // Symbols that have productions or stand in successors, and that no derivation ever holds.
    const auto tell = [&](SymbolId symbol, TextPlace place) {
        if (reachability.occurs(symbol) || told[symbol])
            return;
        told[symbol] = true;
        result.findings.push_back(
            {GrammarFinding::Kind::UnreachableSymbol, place,
             "the symbol `" + program.grammar().symbols.name(symbol) + "` cannot be reached from the axiom"});
    };
    for (const auto* list : {&program.grammar().productions, &program.grammar().interpretations})
        for (const Production& production : *list)
            tell(production.predecessor, production.place);
    for (const Production& production : program.grammar().productions)
        for (const Module& module : production.successor)
            tell(module.symbol, production.place);
}

/// Modules that nothing rewrites although their symbol has productions, for other numbers of parameters; and `/*`.
void findSlips(const GrammarProgram& program, const Reachability& reachability, GrammarInspection& result)
{
    const GrammarProgram::Code& code = program.code();
    std::vector<std::uint32_t> rewritten(program.grammar().symbols.size(), kNothing); // a letter of the symbol
    for (std::uint32_t l = 0; l < program.letterCount(); ++l)
        if (program.isKeyed(static_cast<LetterId>(l)))
            rewritten[program.symbolOf(static_cast<LetterId>(l))] = l;
    std::vector<bool> told(program.letterCount(), false);
    const SymbolId slash = program.grammar().symbols.find("/");
    const SymbolId star = program.grammar().symbols.find("*");
    for (std::uint32_t w = 0; w < code.words.size(); ++w)
    {
        if (w > 0 && (code.rules[w - 1].isInterpretation || !reachability.canBeTaken(w - 1)))
            continue;
        const TextPlace place = w == 0 ? program.grammar().axiomPlace : program.sourceOf(code.rules[w - 1]).place;
        SymbolId before = program.grammar().symbols.size();
        for (const LetterId letter :
             std::span(code.letters).subspan(code.words[w].firstLetter, code.words[w].letterCount))
        {
            const SymbolId symbol = program.symbolOf(letter);
            if (before == slash && symbol == star)
                result.findings.push_back({GrammarFinding::Kind::NoComment, place,
                                           "`/*` begins no comment: what follows is symbols; `#` begins one"});
            before = symbol;
            if (program.isKeyed(letter) || rewritten[symbol] == kNothing || told[letter])
                continue;
            told[letter] = true;
            const auto text = [&](LetterId l) {
                return reachability.text(l) + (program.arityOf(l) == 0 ? " without parameters" : "");
            };
            result.findings.push_back(
                {GrammarFinding::Kind::UnmatchedModule, place,
                 text(letter) + " has no production; " + text(static_cast<LetterId>(rewritten[symbol])) + " has"});
        }
    }
}

/// Long words are forecast until a double cannot hold them; the last steps tell how they grow in the long run.
void findGrowth(const GrammarProgram& program, const Limits& limits, GrammarInspection& result)
{
    constexpr std::uint32_t kManySteps = 4096;
    const Forecast far = forecast(program, kManySteps, 1e300);
    result.isBound = !far.hasExpectation;
    std::vector<double> sizes;
    for (const WordForecast& step : far.steps)
    {
        const double size = far.hasExpectation ? step.expected : step.most;
        if (!std::isfinite(size))
            break;
        sizes.push_back(size);
    }
    const auto isSafe = [&](std::size_t step) {
        return std::max(far.steps[step].most, far.drawn[step].most) <= limits.modules;
    };
    for (std::size_t step = 0; step < far.steps.size() && isSafe(step); ++step)
        result.safeSteps = static_cast<std::uint32_t>(step);
    result.isSafeBeyond = result.safeSteps + 1 == far.steps.size();
    result.isGrowthKnown = far.isComplete || sizes.back() > 1e100 || sizes.size() > 128;
    const std::size_t last = sizes.size() - 1;
    if (last < 32 || sizes[last] <= 0)
    {
        // It vanishes, or outgrows every number within a few steps.
        const double ratio = last > 0 && sizes[last - 1] > 0 ? sizes[last] / sizes[last - 1] : 0;
        if (ratio > 1.001)
        {
            result.growth = GrowthKind::Exponential;
            result.factor = ratio;
        }
        return;
    }
    const double doubled = sizes[last] / sizes[last / 2];
    const double before = sizes[last / 2] / sizes[last / 4];
    if (doubled <= 1.001)
        return;
    // Twice the steps multiply an exponential by what they multiplied it by before, squared, and a power by the same.
    if (doubled > before * 1.5 || doubled > 1e12)
    {
        result.growth = GrowthKind::Exponential;
        result.factor = std::pow(sizes[last] / sizes[last - 16], 1.0 / 16);
        return;
    }
    result.growth = GrowthKind::Polynomial;
    result.degree = std::round(std::log2(doubled) * 4) / 4;
}

} // namespace

GrammarInspection inspect(const GrammarProgram& program, const Limits& limits)
{
    GrammarInspection result;
    const Reachability reachability(program);
    findUseless(program, reachability, result);
    findSlips(program, reachability, result);
    std::ranges::stable_sort(
        result.findings, [](const GrammarFinding& a, const GrammarFinding& b) { return a.place.line < b.place.line; });
    findGrowth(program, limits, result);
    return result;
}

} // namespace espalier
