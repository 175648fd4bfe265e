#include <Espalier/Grammar/Derivation.h>

#include <Espalier/Core/Json.h>
#include <Espalier/Grammar/RuleChoice.h>
#include <cassert>
#include <cstring>

namespace espalier {

namespace {

using Code = GrammarProgram::Code;

/// Copies `count` values in pieces of kPadding; reads and writes up to one piece too far.
template <class T>
void copyPadded(T* to, const T* from, std::size_t count)
{
    for (std::size_t i = 0; i < count; i += GrammarProgram::kPadding)
        std::memcpy(to + i, from + i, GrammarProgram::kPadding * sizeof(T));
}

tl::unexpected<Error> tooLong(const GrammarProgram& program, std::uint32_t step, double size, const Limits& limits)
{
    const TextPlace place = program.grammar().axiomPlace;
    return failure(ErrorKind::Limit, {{}, place.line, place.column},
                   "step " + std::to_string(step) + " would make a word of " + formatNumber(size) + " modules",
                   "at most " + std::to_string(limits.modules) + " (the limit modules)", "derive fewer steps");
}

tl::unexpected<Error> tooManyArguments(const GrammarProgram& program, std::uint32_t step, std::uint64_t size,
                                       const Limits& limits)
{
    const TextPlace place = program.grammar().axiomPlace;
    return failure(ErrorKind::Limit, {{}, place.line, place.column},
                   "step " + std::to_string(step) + " would make a word of " + std::to_string(size) + " arguments",
                   "at most " + std::to_string(limits.arguments) + " (the limit arguments)", "derive fewer steps");
}

tl::unexpected<Error> tooMuchWork(const GrammarProgram& program, std::uint32_t step, const Limits& limits)
{
    const TextPlace place = program.grammar().axiomPlace;
    return failure(ErrorKind::Limit, {{}, place.line, place.column},
                   "up to step " + std::to_string(step) + " the derivation takes more than " +
                       std::to_string(limits.derivationWork) + " units of work",
                   "at most the limit derivationWork", "derive fewer steps, or try fewer productions for one symbol");
}

/// Rewrites word after word.
class WordDeriver
{
public:
    WordDeriver(const GrammarProgram& program, const Limits& limits, DerivationScratch& scratch, Word& word)
        : program_(program), code_(program.code()), limits_(limits), scratch_(scratch), word_(word),
          chooser_(program, scratch.weights), hasKeys_(program.isRandom())
    {
        for (const std::uint32_t group : code_.groupOfLetter)
            canWake_ |= group != GrammarProgram::kNothing && code_.groups[group].changeable;
    }

    Expected<void> run(RandomKey key, std::uint32_t steps)
    {
        root_ = key;
        if (auto done = writeAxiom(); !done)
            return done;
        for (std::uint32_t step = 1; step <= steps; ++step)
        {
            auto changed = rewrite(step);
            if (!changed)
                return tl::make_unexpected(changed.error());
            if (!*changed && !canWake_)
                break;
        }
        return {};
    }

private:
    Expected<void> writeAxiom()
    {
        const GrammarProgram::Word& axiom = code_.words[0];
        if (axiom.letterCount > limits_.modules)
            return tooLong(program_, 0, axiom.letterCount, limits_);
        word_.letters.assign(code_.letters.begin(), code_.letters.begin() + axiom.letterCount);
        word_.arguments.assign(code_.arguments.begin(), code_.arguments.begin() + axiom.argumentCount);
        ExpressionScope scope = scopeOfSuccessor(nullptr, root_, 0);
        std::uint32_t patch = 0;
        if (!computeArguments(code_, axiom, 0, axiom.letterCount, patch, scope, word_.arguments.data()))
            return tl::make_unexpected(notFinite(program_, 0, scopeOfSuccessor(nullptr, root_, 0)));
        if (hasKeys_)
        {
            scratch_.keys.resize(axiom.letterCount, root_);
            writeKeys(axiom, root_, scratch_.keys.data());
        }
        return {};
    }

    void writeKeys(const GrammarProgram::Word& word, RandomKey key, RandomKey* keys) const
    {
        for (std::uint32_t m = 0; m < word.letterCount; ++m)
            keys[m] = program_.isKeyed(code_.letters[word.firstLetter + m])
                          ? key.child(code_.ordinals[word.firstLetter + m])
                          : key;
    }

    /// One step; false if nothing was rewritten. Rules are chosen first, so the size is known before the memory is
    /// taken.
    Expected<bool> rewrite(std::uint32_t step)
    {
        if (!program_.isContextFree())
            scratch_.contexts.build(program_, word_);
        std::uint64_t letters = 0;
        std::uint64_t arguments = 0;
        const auto rewritten = choose(step, letters, arguments);
        if (!rewritten)
            return tl::make_unexpected(rewritten.error());
        if (scratch_.work > limits_.derivationWork)
            return tooMuchWork(program_, step, limits_);
        if (letters > limits_.modules)
            return tooLong(program_, step, static_cast<double>(letters), limits_);
        if (arguments > limits_.arguments)
            return tooManyArguments(program_, step, arguments, limits_);
        if (auto done = write(step, letters, arguments); !done)
            return tl::make_unexpected(done.error());
        return *rewritten;
    }

    /// The rule of every module, kNothing for those that are copied, into scratch; the size of the word they make.
    Expected<bool> choose(std::uint32_t step, std::uint64_t& letters, std::uint64_t& arguments)
    {
        const auto size = static_cast<std::uint32_t>(word_.letters.size());
        scratch_.choices.resize(size);
        const double* argument = word_.arguments.data();
        bool any = false;
        for (std::uint32_t i = 0; i < size; ++i)
        {
            const LetterId letter = word_.letters[i];
            const std::uint32_t arity = program_.arityOf(letter);
            std::uint32_t rule = code_.fixedRule[letter];
            if (rule == GrammarProgram::kUndecided)
            {
                rule = chooseAt(i, step, {argument, arity});
                if (rule == RuleChooser::kFailed)
                    return tl::make_unexpected(chooser_.error());
                if (scratch_.work + chooser_.work > limits_.derivationWork)
                    return tooMuchWork(program_, step, limits_);
            }
            scratch_.choices[i] = rule;
            argument += arity;
            if (rule == GrammarProgram::kNothing)
            {
                ++letters;
                arguments += arity;
                continue;
            }
            any = true;
            letters += code_.words[rule + 1].letterCount;
            arguments += code_.words[rule + 1].argumentCount;
            scratch_.work += code_.words[rule + 1].patchCost;
        }
        scratch_.work += size + letters + std::exchange(chooser_.work, 0) + 1;
        return any;
    }

    std::uint32_t chooseAt(std::uint32_t position, std::uint32_t step, std::span<const double> arguments)
    {
        const GrammarProgram::Group& group = code_.groups[code_.groupOfLetter[word_.letters[position]]];
        const Rewritten module{arguments, hasKeys_ ? scratch_.keys[position] : root_, static_cast<double>(step)};
        return chooser_.choose(group, module, false, [&](const GrammarProgram::Rule& rule, const double*& parameters) {
            const bool matches =
                scratch_.contexts.matches(rule, position, scratch_.parameters, scratch_.work, limits_.derivationWork);
            parameters = scratch_.parameters.data();
            return matches;
        });
    }

    Expected<void> write(std::uint32_t step, std::uint64_t letters, std::uint64_t arguments)
    {
        Word& next = scratch_.next;
        next.letters.resize(letters + GrammarProgram::kPadding);
        next.arguments.resize(arguments + GrammarProgram::kPadding);
        if (hasKeys_)
            scratch_.nextKeys.resize(letters, root_);
        LetterId* letterOut = next.letters.data();
        double* argumentOut = next.arguments.data();
        RandomKey* keyOut = scratch_.nextKeys.data();
        const double* argument = word_.arguments.data();
        const auto size = static_cast<std::uint32_t>(word_.letters.size());
        for (std::uint32_t i = 0; i < size; ++i)
        {
            const LetterId letter = word_.letters[i];
            const std::uint32_t arity = program_.arityOf(letter);
            const std::uint32_t chosen = scratch_.choices[i];
            if (chosen == GrammarProgram::kNothing)
            {
                *letterOut++ = letter;
                for (std::uint32_t a = 0; a < arity; ++a)
                    *argumentOut++ = argument[a];
                if (hasKeys_)
                    *keyOut++ = keyOfCopy(i);
                argument += arity;
                continue;
            }
            const GrammarProgram::Word& successor = code_.words[chosen + 1];
            copyPadded(letterOut, code_.letters.data() + successor.firstLetter, successor.letterCount);
            if (successor.argumentCount > 0)
                copyPadded(argumentOut, code_.arguments.data() + successor.firstArgument, successor.argumentCount);
            if (successor.patchCount > 0 || code_.rules[chosen].table != GrammarProgram::kNothing)
            {
                const RandomKey key = hasKeys_ ? scratch_.keys[i] : root_;
                const double* parameters = argument;
                if (code_.rules[chosen].contextParameters > 0)
                {
                    std::uint64_t ignored = 0;
                    (void)scratch_.contexts.matches(code_.rules[chosen], i, scratch_.parameters, ignored, ~ignored);
                    parameters = scratch_.parameters.data();
                }
                ExpressionScope scope = scopeOfSuccessor(parameters, key, step);
                double transform[4];
                if (code_.rules[chosen].table != GrammarProgram::kNothing)
                {
                    const std::uint32_t candidates = code_.groups[code_.groupOfLetter[letter]].count;
                    const Rewritten module{{parameters, arity}, key, static_cast<double>(step)};
                    if (auto row = drawTransform(program_, chosen, module, candidates, transform); !row)
                        return tl::make_unexpected(row.error());
                    scope.transform = transform;
                }
                ExpressionScope before = scope;
                std::uint32_t patch = 0;
                if (!computeArguments(code_, successor, 0, successor.letterCount, patch, scope, argumentOut))
                    return tl::make_unexpected(notFinite(program_, chosen + 1, before));
            }
            if (hasKeys_)
            {
                writeKeys(successor, scratch_.keys[i], keyOut);
                keyOut += successor.letterCount;
            }
            letterOut += successor.letterCount;
            argumentOut += successor.argumentCount;
            argument += arity;
        }
        next.letters.resize(letters);
        next.arguments.resize(arguments);
        std::swap(word_, next);
        std::swap(scratch_.keys, scratch_.nextKeys);
        return {};
    }

    /// A module that may match in a later step draws anew there.
    RandomKey keyOfCopy(std::uint32_t position) const
    {
        const std::uint32_t group = code_.groupOfLetter[word_.letters[position]];
        const bool drawsAgain = group != GrammarProgram::kNothing && code_.groups[group].changeable;
        return drawsAgain ? scratch_.keys[position].child(0) : scratch_.keys[position];
    }

    const GrammarProgram& program_;
    const Code& code_;
    const Limits& limits_;
    DerivationScratch& scratch_;
    Word& word_;
    RuleChooser chooser_;
    RandomKey root_{Seed{}};
    bool hasKeys_;
    bool canWake_ = false; ///< What no rule matches now may be matched in a later step.
};

/// Writes the word of a constant program in one go: where an expansion of the same letter by as many steps stands
/// already, it is copied, so the work is that of copying the word in ever larger pieces.
class WordExpander
{
public:
    /// Nested calls and remembered sizes that this is worth.
    static constexpr std::uint32_t kMostSteps = 512;
    static constexpr std::uint64_t kMostSizes = 1u << 20;

    static bool suits(const GrammarProgram& program, std::uint32_t steps)
    {
        return program.isConstant() && !program.isRandom() && steps > 0 && steps <= kMostSteps &&
               std::uint64_t{program.letterCount()} * (steps + 1) <= kMostSizes &&
               std::uint64_t{program.code().letters.size()} * (steps + 1) <= 4 * kMostSizes;
    }

    WordExpander(const GrammarProgram& program, const Limits& limits, DerivationScratch& scratch, Word& word)
        : program_(program), code_(program.code()), limits_(limits), scratch_(scratch), word_(word)
    {}

    /// `word` is the axiom, its arguments computed.
    Expected<void> run(std::uint32_t steps)
    {
        width_ = steps + 1;
        if (auto done = measure(steps); !done)
            return done;
        std::swap(word_, scratch_.next);
        const Word& axiom = scratch_.next;
        const auto [letters, arguments] = sizeOf(axiom.letters, steps);
        word_.letters.resize(letters);
        word_.arguments.resize(arguments);
        scratch_.offsets.assign(2 * program_.letterCount() * width_, kUnwritten);
        letterOut_ = word_.letters.data();
        argumentOut_ = word_.arguments.data();
        writeModules(axiom.letters.data(), axiom.arguments.data(), static_cast<std::uint32_t>(axiom.letters.size()),
                     steps);
        scratch_.work = letters;
        return {};
    }

private:
    static constexpr std::uint64_t kUnwritten = ~std::uint64_t{0};

    struct Size
    {
        std::uint64_t letters;
        std::uint64_t arguments;
    };

    Size size(LetterId letter, std::uint32_t steps) const
    {
        const std::size_t at = 2 * (std::size_t{letter} * width_ + steps);
        return {scratch_.sizes[at], scratch_.sizes[at + 1]};
    }

    Size sizeOf(std::span<const LetterId> letters, std::uint32_t steps) const
    {
        Size sum{0, 0};
        for (const LetterId letter : letters)
        {
            sum.letters += size(letter, steps).letters;
            sum.arguments += size(letter, steps).arguments;
        }
        return sum;
    }

    /// Sizes of the expansions of every letter, step by step. A word that grows too long is refused at its step.
    Expected<void> measure(std::uint32_t steps)
    {
        scratch_.sizes.assign(2 * program_.letterCount() * width_, 0);
        for (std::uint32_t step = 0; step <= steps; ++step)
        {
            for (std::uint32_t l = 0; l < program_.letterCount(); ++l)
            {
                const auto letter = static_cast<LetterId>(l);
                const std::uint32_t rule = code_.fixedRule[letter];
                Size sum{1, program_.arityOf(letter)};
                if (step > 0 && rule != GrammarProgram::kNothing)
                    sum = sizeOf(wordOf(rule), step - 1);
                const std::size_t at = 2 * (std::size_t{letter} * width_ + step);
                // One that is too long stays so, and sums of such numbers stay far from overflow.
                scratch_.sizes[at] = std::min<std::uint64_t>(sum.letters, std::uint64_t{1} << 40);
                scratch_.sizes[at + 1] = std::min<std::uint64_t>(sum.arguments, std::uint64_t{1} << 40);
            }
            const Size whole = sizeOf(word_.letters, step);
            if (whole.letters > limits_.modules)
                return tooLong(program_, step, static_cast<double>(whole.letters), limits_);
            if (whole.arguments > limits_.arguments)
                return tooManyArguments(program_, step, whole.arguments, limits_);
        }
        return {};
    }

    std::span<const LetterId> wordOf(std::uint32_t rule) const
    {
        const GrammarProgram::Word& word = code_.words[rule + 1];
        return std::span(code_.letters).subspan(word.firstLetter, word.letterCount);
    }

    void writeModules(const LetterId* letters, const double* arguments, std::uint32_t count, std::uint32_t steps)
    {
        for (std::uint32_t i = 0; i < count;)
        {
            const std::uint32_t from = i;
            std::uint32_t plain = 0;
            while (i < count && (steps == 0 || code_.fixedRule[letters[i]] == GrammarProgram::kNothing))
                plain += program_.arityOf(letters[i++]);
            if (i > from)
            {
                letterOut_ = std::copy_n(letters + from, i - from, letterOut_);
                argumentOut_ = std::copy_n(arguments, plain, argumentOut_);
                arguments += plain;
                continue;
            }
            arguments += program_.arityOf(letters[i]);
            expand(letters[i++], steps);
        }
    }

    void expand(LetterId letter, std::uint32_t steps)
    {
        const std::size_t at = 2 * (std::size_t{letter} * width_ + steps);
        const Size length = size(letter, steps);
        std::uint64_t* written = scratch_.offsets.data() + at;
        if (written[0] != kUnwritten)
        {
            letterOut_ = std::copy_n(word_.letters.data() + written[0], length.letters, letterOut_);
            argumentOut_ = std::copy_n(word_.arguments.data() + written[1], length.arguments, argumentOut_);
            return;
        }
        const auto letterStart = static_cast<std::uint64_t>(letterOut_ - word_.letters.data());
        const auto argumentStart = static_cast<std::uint64_t>(argumentOut_ - word_.arguments.data());
        const std::uint32_t rule = code_.fixedRule[letter];
        const GrammarProgram::Word& successor = code_.words[rule + 1];
        writeModules(code_.letters.data() + successor.firstLetter, code_.arguments.data() + successor.firstArgument,
                     successor.letterCount, steps - 1);
        written[0] = letterStart; // not before it is whole
        written[1] = argumentStart;
    }

    const GrammarProgram& program_;
    const Code& code_;
    const Limits& limits_;
    DerivationScratch& scratch_;
    Word& word_;
    std::size_t width_ = 0;
    LetterId* letterOut_ = nullptr;
    double* argumentOut_ = nullptr;
};

} // namespace

Expected<void> deriveWord(const GrammarProgram& program, RandomKey key, std::uint32_t steps, const Limits& limits,
                          DerivationScratch& scratch, Word& word)
{
    scratch.work = 0;
    const bool expands = WordExpander::suits(program, steps);
    Expected<void> done = WordDeriver(program, limits, scratch, word).run(key, expands ? 0 : steps);
    if (done && expands)
        done = WordExpander(program, limits, scratch, word).run(steps);
    if (!done)
        word.clear();
    return done;
}

} // namespace espalier
