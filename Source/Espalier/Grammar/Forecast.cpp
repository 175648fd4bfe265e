#include <Espalier/Grammar/Forecast.h>

#include <Espalier/Core/Json.h>
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace espalier {

namespace {

using Code = GrammarProgram::Code;
using LetterCount = GrammarProgram::LetterCount;
using Bag = std::span<const LetterCount>; ///< A word as what it is made of.
constexpr std::uint32_t kNothing = GrammarProgram::kNothing;

/// One way on for a letter: a rule with the share of its weight, or none (the letter is copied).
struct Way
{
    std::uint32_t rule;
    double share; ///< NaN if it is not known.
};

class Forecaster
{
public:
    explicit Forecaster(const GrammarProgram& program) : program_(program), code_(program.code())
    {
        for (std::uint32_t l = 0; l < program.letterCount(); ++l)
        {
            listWays(code_.groupOfLetter[l], ways_, firstWay_);
            listWays(code_.interpretationGroup[l], readings_, firstReading_);
        }
        firstWay_.push_back(static_cast<std::uint32_t>(ways_.size()));
        firstReading_.push_back(static_cast<std::uint32_t>(readings_.size()));
        listReached();
    }

    Forecast run(std::uint32_t steps, double mostModules)
    {
        const std::uint32_t letters = program_.letterCount();
        Forecast result;
        result.isExact = program_.isContextFree() && oneWayOnly();
        result.hasExpectation = areSharesKnown();
        // Backwards: what one letter becomes in so many steps, for bounds; the expectation obeys the same equations.
        std::vector<WordForecast> sizes(letters, {1, 1, 1});
        std::vector<WordForecast> drawn(letters);
        for (const LetterId l : reached_)
            drawn[l] = waysOn(l, readings_, firstReading_, sizes);
        std::vector<WordForecast> next(letters);
        std::uint64_t work = 0;
        for (std::uint32_t step = 0;; ++step)
        {
            result.steps.push_back(sizeOf(bagOf(0), sizes));
            result.drawn.push_back(sizeOf(bagOf(0), drawn));
            work += stepWork_;
            if (step == steps || result.steps.back().least > mostModules || work > kMostWork)
                break;
            const auto advance = [&](std::vector<WordForecast>& values) {
                for (const LetterId l : reached_)
                    next[l] = waysOn(l, ways_, firstWay_, values);
                std::swap(values, next);
            };
            advance(sizes);
            if (program_.hasInterpretations())
                advance(drawn);
            else
                drawn = sizes;
        }
        result.isComplete = result.steps.size() == std::size_t{steps} + 1;
        if (result.hasExpectation)
            result.letters = countLetters(static_cast<std::uint32_t>(result.steps.size() - 1));
        return result;
    }

private:
    /// Additions and multiplications: some milliseconds.
    static constexpr std::uint64_t kMostWork = 1u << 20;

    /// What may become of a letter: its rules up to the first that always matches, those that compete with it, and
    /// being copied if none is sure to match.
    void listWays(std::uint32_t groupIndex, std::vector<Way>& ways, std::vector<std::uint32_t>& firstOfLetter) const
    {
        constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
        firstOfLetter.push_back(static_cast<std::uint32_t>(ways.size()));
        if (groupIndex == kNothing)
        {
            ways.push_back({kNothing, 1});
            return;
        }
        const GrammarProgram::Group& group = code_.groups[groupIndex];
        const auto candidates = std::span(code_.candidates).subspan(group.first, group.count);
        const std::size_t first = ways.size();
        const GrammarProgram::Rule* sure = nullptr;
        bool isKnown = true;
        for (const std::uint32_t index : candidates)
        {
            const GrammarProgram::Rule& rule = code_.rules[index];
            if (sure && !(sure->hasWeight && rule.hasWeight && rule.leftSide == sure->leftSide))
                continue;
            if (rule.hasCondition && rule.condition.isConstant())
                continue; // never holds: what always does is no condition
            isKnown &= rule.isUnconditional() && (!rule.hasWeight || rule.weight.isConstant());
            if (!(rule.hasWeight && rule.weight.isConstant() && rule.weight.value == 0))
                ways.push_back({index, rule.hasWeight ? rule.weight.value : 1});
            if (!sure && rule.isUnconditional())
                sure = &rule;
        }
        if (!sure || ways.size() == first) // no rule with weight: deriving tells
            ways.push_back({kNothing, 1});
        double sum = 0;
        for (std::size_t i = first; i < ways.size(); ++i)
            sum += ways[i].share;
        for (std::size_t i = first; i < ways.size(); ++i)
            ways[i].share = ways.size() == first + 1 ? 1 : isKnown ? ways[i].share / sum : kUnknown;
    }

    /// The letters that can come, and the work of following them for a step.
    void listReached()
    {
        std::vector<bool> isReached(program_.letterCount(), false);
        const auto reachWord = [&](Bag bag) {
            stepWork_ += bag.size();
            for (const LetterCount& item : bag)
                if (!isReached[item.letter])
                {
                    isReached[item.letter] = true;
                    reached_.push_back(item.letter);
                }
        };
        reachWord(bagOf(0));
        for (std::size_t i = 0; i < reached_.size(); ++i)
            for (const Way& way : waysOf(reached_[i]))
            {
                ++stepWork_;
                if (way.rule != kNothing)
                    reachWord(bagOf(way.rule + 1));
            }
    }

    std::span<const Way> waysOf(LetterId letter) const
    {
        return std::span(ways_).subspan(firstWay_[letter], firstWay_[letter + 1] - firstWay_[letter]);
    }

    bool oneWayOnly() const
    {
        return std::ranges::all_of(reached_, [&](LetterId letter) { return waysOf(letter).size() == 1; });
    }

    bool areSharesKnown() const
    {
        return std::ranges::all_of(reached_, [&](LetterId letter) {
            return std::ranges::none_of(waysOf(letter), [](const Way& way) { return std::isnan(way.share); });
        });
    }

    Bag bagOf(std::uint32_t word) const { return program_.letterCountsOf(word); }

    static WordForecast sizeOf(Bag bag, const std::vector<WordForecast>& sizes)
    {
        WordForecast sum;
        for (const LetterCount& item : bag)
        {
            sum.least += item.count * sizes[item.letter].least;
            sum.most += item.count * sizes[item.letter].most;
            sum.expected += item.count * sizes[item.letter].expected;
        }
        return sum;
    }

    WordForecast waysOn(std::uint32_t letter, const std::vector<Way>& ways,
                        const std::vector<std::uint32_t>& firstOfLetter, const std::vector<WordForecast>& sizes) const
    {
        WordForecast result{std::numeric_limits<double>::infinity(), 0, 0};
        for (std::uint32_t w = firstOfLetter[letter]; w < firstOfLetter[letter + 1]; ++w)
        {
            const Way& way = ways[w];
            const WordForecast one = way.rule == kNothing ? sizes[letter] : sizeOf(bagOf(way.rule + 1), sizes);
            result.least = std::min(result.least, one.least);
            result.most = std::max(result.most, one.most);
            result.expected += way.share * one.expected;
        }
        return result;
    }

    /// Forwards: the expected number of each letter.
    std::vector<double> countLetters(std::uint32_t steps) const
    {
        std::vector<double> counts(program_.letterCount(), 0);
        for (const LetterCount& item : bagOf(0))
            counts[item.letter] += item.count;
        std::vector<double> next(counts.size());
        for (std::uint32_t step = 0; step < steps; ++step)
        {
            std::ranges::fill(next, 0.0);
            for (const LetterId l : reached_)
            {
                if (counts[l] == 0)
                    continue;
                for (const Way& way : waysOf(l))
                {
                    if (way.rule == kNothing)
                        next[l] += counts[l] * way.share;
                    else
                        for (const LetterCount& item : bagOf(way.rule + 1))
                            next[item.letter] += counts[l] * way.share * item.count;
                }
            }
            std::swap(counts, next);
        }
        return counts;
    }

    const GrammarProgram& program_;
    const Code& code_;
    std::vector<Way> ways_;
    std::vector<std::uint32_t> firstWay_;
    std::vector<Way> readings_; ///< What `interpret:` makes of a letter.
    std::vector<std::uint32_t> firstReading_;
    std::vector<LetterId> reached_;
    std::uint64_t stepWork_ = 1; ///< Additions and multiplications.
};

} // namespace

Forecast forecast(const GrammarProgram& program, std::uint32_t steps, double mostModules)
{
    return Forecaster(program).run(steps, mostModules);
}

Expected<void> checkPrice(const GrammarProgram& program, std::uint32_t steps, const Limits& limits)
{
    const double most = limits.modules;
    const Forecast price = forecast(program, steps, most);
    const TextPlace place = program.grammar().axiomPlace;
    const bool interpreted = price.steps.back().least <= most;
    if (interpreted && !price.isComplete) // what would be drawn is not known
        return {};
    const WordForecast& size = interpreted ? price.drawn.back() : price.steps.back();
    const double least = size.least;
    if (least <= most)
        return {};
    return failure(ErrorKind::Limit, {{}, place.line, place.column},
                   "step " + std::to_string(price.steps.size() - 1) + " makes a word of " +
                       (!std::isfinite(least) ? std::string("more than 1e308")
                        : least == size.most  ? formatNumber(least)
                                              : "at least " + formatNumber(least)) +
                       " modules" + (interpreted ? " after `interpret:`" : ""),
                   "at most " + std::to_string(limits.modules) + " (the limit modules)", "derive fewer steps");
}

} // namespace espalier
