#include <Espalier/Grammar/Derivation.h>

#include <Espalier/Core/Json.h>
#include <Espalier/Grammar/RuleChoice.h>
#include <algorithm>
#include <cassert>
#include <cstring>
#include <optional>

namespace espalier {

namespace {

using Code = GrammarProgram::Code;
constexpr std::uint32_t kNothing = GrammarProgram::kNothing;

tl::unexpected<Error> atAxiom(const GrammarProgram& program, std::string what, std::string expected, std::string advice)
{
    const TextPlace place = program.grammar().axiomPlace;
    return failure(ErrorKind::Limit, {{}, place.line, place.column}, std::move(what), std::move(expected),
                   std::move(advice));
}

tl::unexpected<Error> workLimit(const GrammarProgram& program, std::uint64_t most)
{
    return atAxiom(program, "the derivation takes more than " + std::to_string(most) + " units of work",
                   "at most the limit derivationWork", "derive fewer steps, or try fewer productions for one symbol");
}

/// Collects final modules into runs for the sink, interpreted if that is asked for.
class RunWriter
{
public:
    RunWriter(const GrammarProgram& program, Interpretation interpretation, DerivationScratch& scratch,
              DerivationSink& sink)
        : code_(program.code()), program_(program), run_(scratch.run), sink_(sink), chooser_(program, scratch.weights),
          wantsArguments_(sink.wantsArguments()),
          interprets_(interpretation == Interpretation::Apply && program.hasInterpretations())
    {
        run_.letters.resize(kRun + GrammarProgram::kPadding);
        run_.arguments.resize(kRun + GrammarProgram::kPadding);
    }

    [[nodiscard]] bool interprets() const noexcept { return interprets_; }
    [[nodiscard]] bool wantsArguments() const noexcept { return wantsArguments_ || interprets_; }
    [[nodiscard]] std::uint64_t emitted() const noexcept { return emitted_; }
    [[nodiscard]] std::uint64_t work() const noexcept { return emitted_ + chooser_.work; }
    [[nodiscard]] bool stopped() const noexcept { return stopped_; }
    [[nodiscard]] const Error& error() const noexcept { return error_; }

    /// Room for a piece of a word: its arguments are to be written at the place returned, before anything else is done.
    /// Both arrays may be read in pieces of kPadding.
    double* append(const LetterId* letters, std::size_t count, const double* arguments, std::size_t argumentCount)
    {
        if (!wantsArguments_)
            argumentCount = 0;
        if (letterCount_ + count > kRun || argumentCount_ + argumentCount > kRun)
            makeRoom(count, argumentCount);
        for (std::size_t i = 0; i < count; i += GrammarProgram::kPadding)
            std::memcpy(run_.letters.data() + letterCount_ + i, letters + i,
                        GrammarProgram::kPadding * sizeof(LetterId));
        double* room = run_.arguments.data() + argumentCount_;
        for (std::size_t i = 0; i < argumentCount; i += GrammarProgram::kPadding)
            std::memcpy(room + i, arguments + i, GrammarProgram::kPadding * sizeof(double));
        letterCount_ += count;
        argumentCount_ += argumentCount;
        emitted_ += count;
        return room;
    }

    /// A piece of a word whose arguments are as they stand there. A long one is not copied: it is a run of its own.
    void appendConstant(const LetterId* letters, std::size_t count, const double* arguments, std::size_t argumentCount)
    {
        if (count < kWorthPassing || stopped_)
        {
            (void)append(letters, count, arguments, argumentCount);
            return;
        }
        emitted_ += count;
        if (flush())
            stopped_ = !sink_.modules({letters, count}, {arguments, wantsArguments_ ? argumentCount : 0});
    }

    /// One module, its arguments computed; interpreted if it can be. False if that failed.
    bool module(LetterId letter, const double* arguments, RandomKey key, std::uint32_t step)
    {
        const std::size_t arity = program_.arityOf(letter);
        const std::uint32_t group = interprets_ ? code_.interpretationGroup[letter] : kNothing;
        if (group == kNothing)
            return single(letter, arguments, arity);
        const Rewritten module{{arguments, arity}, key, static_cast<double>(step)};
        const std::uint32_t rule = chooser_.choose(code_.groups[group], module, false);
        if (rule == RuleChooser::kFailed)
        {
            error_ = chooser_.error();
            return false;
        }
        if (rule == kNothing)
            return single(letter, arguments, arity);
        const GrammarProgram::Word& word = code_.words[rule + 1];
        double* room = append(code_.letters.data() + word.firstLetter, word.letterCount,
                              code_.arguments.data() + word.firstArgument, word.argumentCount);
        if (word.patchCount == 0 || !wantsArguments_)
            return true;
        chooser_.work += word.patchCost;
        ExpressionScope scope = scopeOfSuccessor(arguments, key, module.step);
        std::uint32_t patch = 0;
        if (computeArguments(code_, word, 0, word.letterCount, patch, scope, room))
            return true;
        error_ = notFinite(program_, rule + 1, scopeOfSuccessor(arguments, key, module.step));
        return false;
    }

    bool flush()
    {
        if (letterCount_ > 0 && !stopped_)
            stopped_ = !sink_.modules({run_.letters.data(), letterCount_}, {run_.arguments.data(), argumentCount_});
        letterCount_ = 0;
        argumentCount_ = 0;
        return !stopped_;
    }

private:
    static constexpr std::size_t kWorthPassing = 128; ///< Letters.
    static constexpr std::size_t kRun = 2048;         ///< Letters and arguments: what stays in the nearest cache.

    bool single(LetterId letter, const double* arguments, std::size_t arity)
    {
        if (letterCount_ + 1 > kRun || argumentCount_ + arity > kRun)
            makeRoom(1, arity);
        run_.letters[letterCount_++] = letter;
        if (wantsArguments_)
            for (std::size_t a = 0; a < arity; ++a)
                run_.arguments[argumentCount_++] = arguments[a];
        ++emitted_;
        return true;
    }

    void makeRoom(std::size_t letters, std::size_t arguments)
    {
        (void)flush();
        if (letters + GrammarProgram::kPadding > run_.letters.size())
            run_.letters.resize(letters + GrammarProgram::kPadding);
        if (arguments + GrammarProgram::kPadding > run_.arguments.size())
            run_.arguments.resize(arguments + GrammarProgram::kPadding);
    }

    const Code& code_;
    const GrammarProgram& program_;
    Word& run_;
    DerivationSink& sink_;
    RuleChooser chooser_;
    Error error_;
    std::size_t letterCount_ = 0;
    std::size_t argumentCount_ = 0;
    std::uint64_t emitted_ = 0;
    bool wantsArguments_;
    bool interprets_;
    bool stopped_ = false;
};

/// How far a depth-first derivation goes.
struct Bounds
{
    bool toTheEnd = false;
    std::uint32_t steps = 0; ///< Unless it goes to the end.
    DerivationBudget budget;
    std::uint64_t modules = 0; ///< Emitted, at most.
    std::uint64_t work = 0;    ///< At most.
};

/// One depth-first derivation under way.
class StreamDeriver
{
public:
    StreamDeriver(const GrammarProgram& program, Interpretation interpretation, const Bounds& bounds,
                  DerivationScratch& scratch, DerivationSink& sink)
        : program_(program), code_(program.code()), bounds_(bounds), scratch_(scratch), sink_(sink),
          writer_(program, interpretation, scratch, sink), chooser_(program, scratch.weights),
          expands_(!bounds.toTheEnd && !writer_.interprets()), isFixed_(expands_ && !program.isRandom())
    {
        scratch_.frames.clear();
        scratch_.parameters.clear();
    }

    Expected<bool> run(RandomKey key)
    {
        Frame axiom;
        axiom.key = key;
        scratch_.frames.push_back(axiom);
        while (!scratch_.frames.empty())
        {
            Frame& frame = scratch_.frames.back();
            const GrammarProgram::Word& word = code_.words[frame.word];
            const bool isLast = !bounds_.toTheEnd && frame.depth == bounds_.steps;
            const std::uint32_t next = isLast || frame.nextRewritable == word.rewritableCount
                                           ? word.letterCount
                                           : code_.rewritables[word.firstRewritable + frame.nextRewritable];
            if (frame.nextModule < next && !emit(frame, word, next))
                return tl::make_unexpected(error_);
            if (writer_.emitted() > bounds_.modules)
                return tooLong();
            if (work() > bounds_.work)
                return tooMuchWork();
            if (writer_.stopped())
                return false;
            if (next == word.letterCount)
            {
                leave(frame);
                continue;
            }
            ++frame.nextRewritable;
            frame.nextModule = next + 1;
            if (!rewriteModule(frame, word, next))
                return tl::make_unexpected(error_);
        }
        return writer_.flush();
    }

    [[nodiscard]] std::uint64_t work() const noexcept
    {
        return writer_.work() + chooser_.work + 8 * applied_ + computed_;
    }

private:
    using Frame = DerivationScratch::Frame;

    /// Work of trying weights and conditions one by one when deriving to the end: some tenths of a second. A file of
    /// some hundred kilobytes could otherwise ask for hours.
    static constexpr std::uint64_t kMostTrials = std::uint64_t{1} << 27;

    ExpressionScope scopeOf(const Frame& frame) const
    {
        ExpressionScope scope =
            scopeOfSuccessor(scratch_.parameters.data() + frame.firstParameter, frame.key, frame.depth);
        scope.transform = frame.transform;
        return scope;
    }

    bool failNotFinite(const Frame& frame)
    {
        error_ = notFinite(program_, frame.word, scopeOf(frame));
        return false;
    }

    /// Modules from frame.nextModule to `last`, which nothing rewrites.
    bool emit(Frame& frame, const GrammarProgram::Word& word, std::uint32_t last)
    {
        const std::uint32_t first = frame.nextModule;
        const std::uint32_t firstArgument = argumentOf(code_, word, first);
        const std::uint32_t argumentCount = argumentOf(code_, word, last) - firstArgument;
        frame.nextModule = last;
        const LetterId* letters = code_.letters.data() + word.firstLetter + first;
        const double* arguments = code_.arguments.data() + word.firstArgument + firstArgument;
        if (!writer_.interprets())
        {
            if (argumentCount == 0 || word.patchCount == 0 || !writer_.wantsArguments())
            {
                writer_.appendConstant(letters, last - first, arguments, argumentCount);
                return true;
            }
            double* room = writer_.append(letters, last - first, arguments, argumentCount);
            ExpressionScope scope = scopeOf(frame);
            return computeArguments(code_, word, first, last, frame.nextPatch, scope, room) || failNotFinite(frame);
        }
        std::vector<double>& values = scratch_.arguments;
        values.assign(arguments, arguments + argumentCount);
        ExpressionScope scope = scopeOf(frame);
        if (!computeArguments(code_, word, first, last, frame.nextPatch, scope, values.data()))
            return failNotFinite(frame);
        const std::uint32_t step = bounds_.toTheEnd ? frame.depth : bounds_.steps;
        const double* argument = values.data();
        for (std::uint32_t m = first; m < last; ++m)
        {
            const LetterId letter = code_.letters[word.firstLetter + m];
            if (!writer_.module(letter, argument, frame.key.child(code_.ordinals[word.firstLetter + m]), step))
                return failWith(writer_.error());
            if (work() > bounds_.work)
                return failWith(tooMuchWork().value());
            if (writer_.stopped() || writer_.emitted() > bounds_.modules)
                return true; // as `run` will find
            argument += program_.arityOf(letter);
        }
        return true;
    }

    bool rewriteModule(Frame& frame, const GrammarProgram::Word& word, std::uint32_t place)
    {
        LetterId letter = code_.letters[word.firstLetter + place];
        if (expands_)
            if (const auto* expansion = program_.expansion(letter, bounds_.steps - frame.depth))
            {
                writer_.appendConstant(code_.expandedLetters.data() + expansion->firstLetter, expansion->letterCount,
                                       code_.expandedArguments.data() + expansion->firstArgument,
                                       expansion->argumentCount);
                ++applied_;
                return true;
            }
        const std::uint32_t firstArgument = argumentOf(code_, word, place);
        std::size_t arity = program_.arityOf(letter);
        std::vector<double>& values = scratch_.arguments;
        values.clear();
        if (arity > 0)
        {
            const double* arguments = code_.arguments.data() + word.firstArgument + firstArgument;
            values.assign(arguments, arguments + arity);
            ExpressionScope scope = scopeOf(frame);
            if (word.patchCount > 0 &&
                !computeArguments(code_, word, place, place + 1, frame.nextPatch, scope, values.data()))
                return failNotFinite(frame);
        }
        std::uint32_t step = frame.depth + 1;
        if (isFixed_)
        {
            if (const std::optional<bool> done = rewriteFixed(letter, values, step))
                return *done;
            arity = values.size();
        }
        const GrammarProgram::Group& group = code_.groups[code_.groupOfLetter[letter]];
        RandomKey key = program_.isRandom() ? frame.key.child(code_.ordinals[word.firstLetter + place]) : frame.key;
        if (bounds_.toTheEnd)
            return rewriteToTheEnd(letter, group, {{values.data(), arity}, key, frame.depth + 1.0}, frame.depth + 1);
        // What does not match is copied, and may match in a later step.
        for (; step <= bounds_.steps; ++step)
        {
            const Rewritten module{{values.data(), arity}, key, static_cast<double>(step)};
            const std::uint32_t rule = chooser_.choose(group, module, false);
            if (rule == RuleChooser::kFailed)
                return failWith(chooser_.error());
            ++applied_;
            if (work() > bounds_.work)
                return failWith(tooMuchWork().value());
            if (rule != kNothing)
                return enter(rule, group, module, step);
            if (!group.changeable)
                break;
            key = key.child(0);
        }
        return writer_.module(letter, values.data(), key, bounds_.steps) || failWith(writer_.error());
    }

    /// Modules with one rule whose successor is final or a single module again need no frame: they are most of all.
    /// Nothing if it takes more; then `letter`, `values` and `step` are those of the module to be rewritten.
    std::optional<bool> rewriteFixed(LetterId& letter, std::vector<double>& values, std::uint32_t& step)
    {
        std::vector<double>& next = scratch_.nextArguments;
        for (; step <= bounds_.steps; ++step)
        {
            const std::uint32_t rule = code_.fixedRule[letter];
            if (rule == kNothing)
                break;
            if (rule == GrammarProgram::kUndecided)
                return {};
            const GrammarProgram::Word& word = code_.words[rule + 1];
            const bool isFinal = step == bounds_.steps || word.rewritableCount == 0;
            if (!isFinal && word.letterCount != 1)
                return {};
            ++applied_;
            computed_ += word.patchCost;
            if (work() > bounds_.work)
                return failWith(tooMuchWork().value());
            const double* arguments = code_.arguments.data() + word.firstArgument;
            ExpressionScope scope = scopeOfSuccessor(values.data(), RandomKey(Seed{}), step);
            std::uint32_t patch = 0;
            if (isFinal)
            {
                double* room = writer_.append(code_.letters.data() + word.firstLetter, word.letterCount, arguments,
                                              word.argumentCount);
                if (word.patchCount == 0 || !writer_.wantsArguments() ||
                    computeArguments(code_, word, 0, word.letterCount, patch, scope, room))
                    return true;
            }
            else
            {
                next.assign(arguments, arguments + word.argumentCount);
                if (computeArguments(code_, word, 0, 1, patch, scope, next.data()))
                {
                    std::swap(values, next);
                    letter = code_.letters[word.firstLetter];
                    continue;
                }
            }
            return failWith(notFinite(program_, rule + 1, scopeOfSuccessor(values.data(), RandomKey(Seed{}), step)));
        }
        return writer_.module(letter, values.data(), RandomKey(Seed{}), bounds_.steps) || failWith(writer_.error());
    }

    bool failWith(const Error& error)
    {
        error_ = error;
        return false;
    }

    /// Chooses a rule within the budget, and enters it. A module that has to be completed and cannot be is dropped: in
    /// a tree grammar that is an open anchor.
    bool rewriteToTheEnd(LetterId letter, const GrammarProgram::Group& group, const Rewritten& module,
                         std::uint32_t depth)
    {
        const DerivationBudget& budget = bounds_.budget;
        const bool completing =
            applied_ >= budget.productions || depth > budget.depth || writer_.emitted() >= budget.modules;
        // Completion by weight could still go round in a grammar edited by hand; by price alone it cannot.
        const bool byPriceAlone =
            depth > std::uint64_t{budget.depth} * 2 + 64 ||
            writer_.emitted() + applied_ > 3 * (std::uint64_t{budget.modules} + budget.productions) / 2;
        if (chooser_.work > kMostTrials)
            return failWith(
                atAxiom(program_,
                        "the derivation looks at more than " + std::to_string(kMostTrials) + " weights and conditions",
                        "fewer productions for one symbol",
                        "weights of the form (i == 3)*a + b, with constants a and b, are not counted")
                    .value());
        const std::uint32_t rule =
            byPriceAlone ? chooser_.cheapestOf(group) : chooser_.choose(group, module, completing);
        if (rule == RuleChooser::kFailed)
            return failWith(chooser_.error());
        if (rule == kNothing && !byPriceAlone)
            return writer_.module(letter, module.arguments.data(), module.key, depth) || failWith(writer_.error());
        if (rule == kNothing || (completing && code_.rules[rule].cost == GrammarProgram::kNever))
            return true;
        // What is completed may take as many productions as modules: the modules are what was asked to be bounded.
        if (const std::uint64_t most = budget.productions + 2 * std::uint64_t{budget.modules}; ++applied_ > most)
            return failWith(endless("productions", most).value());
        return enter(rule, group, module, depth);
    }

    bool enter(std::uint32_t rule, const GrammarProgram::Group& group, const Rewritten& module, std::uint32_t depth)
    {
        Frame frame;
        frame.word = rule + 1;
        computed_ += code_.words[frame.word].patchCost;
        frame.depth = depth;
        frame.firstParameter = static_cast<std::uint32_t>(scratch_.parameters.size());
        frame.key = module.key;
        if (code_.rules[rule].table != kNothing)
        {
            const auto row = drawTransform(program_, rule, module, group.count, frame.transform);
            if (!row)
                return failWith(row.error());
            (void)writer_.flush();
            sink_.beginInstance(code_.rules[rule].source, *row);
        }
        scratch_.parameters.insert(scratch_.parameters.end(), module.arguments.begin(), module.arguments.end());
        scratch_.frames.push_back(frame);
        return true;
    }

    void leave(const Frame& frame)
    {
        scratch_.parameters.resize(frame.firstParameter);
        if (frame.word > 0 && code_.rules[frame.word - 1].table != kNothing)
        {
            (void)writer_.flush();
            sink_.endInstance();
        }
        scratch_.frames.pop_back();
    }

    static tl::unexpected<Error> endless(std::string_view limit, std::uint64_t value)
    {
        return failure(ErrorKind::Limit, {},
                       "the derivation does not end within " + std::to_string(value) + " " + std::string(limit),
                       "a grammar whose cheapest productions end soon",
                       "raise the limit " + std::string(limit) + ", or mend the grammar");
    }

    tl::unexpected<Error> tooLong() const
    {
        if (bounds_.toTheEnd)
            return endless("modules", bounds_.modules);
        return atAxiom(program_,
                       "step " + std::to_string(bounds_.steps) + " would make a word of more than " +
                           std::to_string(bounds_.modules) + " modules",
                       "at most the limit modules", "derive fewer steps");
    }

    tl::unexpected<Error> tooMuchWork() const { return workLimit(program_, bounds_.work); }

    const GrammarProgram& program_;
    const Code& code_;
    const Bounds& bounds_;
    DerivationScratch& scratch_;
    DerivationSink& sink_;
    RunWriter writer_;
    RuleChooser chooser_;
    bool expands_; ///< What the program has written out may be used.
    bool isFixed_; ///< Nothing but letter and arguments decides what becomes of a module.
    Error error_;
    std::uint64_t applied_ = 0;
    std::uint64_t computed_ = 0; ///< Work of arguments.
};

Expected<bool> derive(const GrammarProgram& program, RandomKey key, Interpretation interpretation, const Bounds& bounds,
                      DerivationScratch& scratch, DerivationSink& sink)
{
    assert(program.isContextFree());
    StreamDeriver deriver(program, interpretation, bounds, scratch, sink);
    auto whole = deriver.run(key);
    scratch.work = deriver.work();
    return whole;
}

} // namespace

Expected<bool> streamWord(const GrammarProgram& program, RandomKey key, std::uint32_t steps,
                          Interpretation interpretation, const Limits& limits, DerivationScratch& scratch,
                          DerivationSink& sink)
{
    Bounds bounds;
    bounds.steps = steps;
    bounds.modules = limits.modules;
    bounds.work = limits.derivationWork;
    return derive(program, key, interpretation, bounds, scratch, sink);
}

Expected<bool> deriveToEnd(const GrammarProgram& program, RandomKey key, const DerivationBudget& budget,
                           DerivationScratch& scratch, DerivationSink& sink)
{
    Bounds bounds;
    bounds.toTheEnd = true;
    bounds.budget = budget;
    bounds.modules = 2 * std::uint64_t{budget.modules};
    bounds.work =
        std::max<std::uint64_t>(Limits{}.derivationWork, 64 * (std::uint64_t{budget.modules} + budget.productions));
    return derive(program, key, Interpretation::Apply, bounds, scratch, sink);
}

Expected<bool> emitWord(const GrammarProgram& program, std::uint32_t steps, Interpretation interpretation,
                        const Limits& limits, DerivationScratch& scratch, const Word& word, DerivationSink& sink)
{
    if (word.letters.empty())
        return true;
    if (interpretation == Interpretation::None || !program.hasInterpretations())
        return sink.modules(word.letters, word.arguments);
    assert(!program.isRandom() || scratch.keys.size() >= word.letters.size());
    RunWriter writer(program, interpretation, scratch, sink);
    const double* argument = word.arguments.data();
    for (std::size_t i = 0; i < word.letters.size() && !writer.stopped(); ++i)
    {
        const RandomKey key = program.isRandom() ? scratch.keys[i] : RandomKey(Seed{});
        if (!writer.module(word.letters[i], argument, key, steps))
            return tl::make_unexpected(writer.error());
        argument += program.arityOf(word.letters[i]);
        if (writer.work() > limits.derivationWork)
            return workLimit(program, limits.derivationWork);
        if (writer.emitted() > limits.modules)
            return atAxiom(program,
                           "`interpret:` makes a word of more than " + std::to_string(limits.modules) + " modules",
                           "at most the limit modules", "derive fewer steps");
    }
    return writer.flush();
}

} // namespace espalier
