#include <Espalier/Turtle/SegmentTurtle.h>

#include <Espalier/Grammar/Forecast.h>
#include <Espalier/Turtle/TurtleKernel.h>
#include <algorithm>
#include <cmath>
#include <cstring>

namespace espalier {

namespace {

constexpr std::uint32_t kNone = 0xffffffffu;

/// Writes segments into a buffer.
class SegmentPen
{
public:
    SegmentPen(std::span<TurtleSegment> buffer, const SegmentConsumer& consumer, Error& error)
        : next_(buffer.data()), end_(buffer.data() + buffer.size()), begin_(buffer.data()), consumer_(&consumer),
          error_(&error)
    {}

    /// Segments in the buffer.
    [[nodiscard]] std::size_t count() const { return static_cast<std::size_t>(next_ - begin_); }
    [[nodiscard]] std::size_t total() const { return index_; }
    [[nodiscard]] std::size_t room() const { return static_cast<std::size_t>(end_ - next_); }
    /// `count` segments have been written behind the last one.
    void skip(std::size_t count)
    {
        next_ += count;
        index_ += static_cast<std::uint32_t>(count);
    }

    std::uint32_t segment(const TurtleStroke& stroke, std::uint32_t parent, std::uint16_t)
    {
        // Radius and parent stand where the fourth elements do.
        simd::store(&next_->start, stroke.start);
        simd::store(&next_->end, stroke.end);
        next_->parent = parent;
        ++next_;
        return index_++;
    }
    static void reach(const TurtleVector&) {}
    static void corner(simd::Four) {}
    static void widthSet() {}
    static bool collectsCorners() { return false; }

    [[nodiscard]] bool hasRoom(bool draws) const { return !draws || next_ != end_; }
    bool makeRoom(bool)
    {
        const auto size = static_cast<std::size_t>(end_ - begin_);
        if (index_ >= kNone - size)
            return fail(ErrorKind::Limit, "the plant has more than " + std::to_string(index_) + " segments",
                        "as many as parents can tell apart");
        if (!*consumer_ || size == 0)
            return fail(ErrorKind::Limit, "the plant has more than " + std::to_string(size) + " segments",
                        "a larger buffer");
        if (!(*consumer_)({begin_, size}))
            return fail(ErrorKind::Cancelled, "the drawing was stopped", {});
        next_ = begin_;
        return true;
    }
    static void beginPolygon() {}
    static void endPolygon(const TurtlePlace&) {}
    static bool mark(const TurtleVector&) { return true; }
    static bool sphere(const TurtlePlace&, double) { return true; }
    static bool organ(const TurtlePlace&, const TurtleAxes&, std::uint32_t, double) { return true; }

private:
    bool fail(ErrorKind kind, std::string what, std::string expected)
    {
        *error_ = {kind, std::move(what), std::move(expected), {}, {}};
        return false;
    }

    TurtleSegment* next_;
    TurtleSegment* end_;
    TurtleSegment* begin_;
    std::uint32_t index_ = 0; ///< Of the next segment.
    const SegmentConsumer* consumer_;
    Error* error_;
};

/// The turtle's side of drawSegments.
struct Drawing
{
    using Kernel = TurtleKernel<SegmentPen>;

    Drawing(const GrammarProgram& program, const TurtleAlphabet& givenAlphabet, const Limits& givenLimits,
            TurtleScratch& givenScratch, std::span<TurtleSegment> buffer, const SegmentConsumer& consumer)
        : alphabet(givenAlphabet), settings(turtleSettings(program.grammar())), limits(givenLimits),
          scratch(givenScratch), pen(buffer, consumer, error)
    {
        scratch.begin(settings.angleDegrees);
        scratch.places[0].position.high[1] = 0.5 * settings.width;
    }

    [[nodiscard]] TurtlePlace& place() const { return scratch.places[state.depth]; }
    Kernel kernel() { return {settings, limits, scratch, state, pen}; }

    bool apply(std::span<const LetterId> letters, const double* arguments)
    {
        Kernel turtle = kernel();
        const std::size_t done = turtle.run(alphabet, letters, arguments);
        modules += done;
        if (done == letters.size())
            return true;
        if (!turtle.error.what.empty())
            error = turtle.error;
        error.what = "module " + std::to_string(modules + 1) + " of the word: " + error.what;
        return false;
    }

    const TurtleAlphabet& alphabet;
    TurtleSettings settings;
    const Limits& limits;
    TurtleScratch& scratch;
    Error error;
    SegmentPen pen;
    TurtleState state;
    std::uint64_t modules = 0; ///< Carried out, or copied with what they drew.
};

class DrawingSink final : public DerivationSink
{
public:
    explicit DrawingSink(Drawing& drawing) : drawing_(drawing) {}
    bool modules(std::span<const LetterId> letters, std::span<const double> arguments) override
    {
        return drawing_.apply(letters, arguments.data());
    }

private:
    Drawing& drawing_;
};

/// Draws the expansion of a letter once and copies it wherever it comes again (a level is made of rigid copies of the
/// levels below).
class ReusingDrawer
{
public:
    static constexpr std::uint32_t kMostSteps = 512;
    static constexpr std::uint64_t kMostExpansions = 1u << 18;

    /// Rules are fixed, and a branch inherits nothing but where it is and where it heads.
    static bool suits(const GrammarProgram& program, std::uint32_t steps, const Drawing& drawing)
    {
        if (!program.isConstant() || program.code().words[0].patchCount > 0 || program.isRandom() ||
            program.hasInterpretations() || steps > kMostSteps ||
            std::uint64_t{program.letterCount()} * (steps + 1) > kMostExpansions || drawing.settings.tropism ||
            !isBalanced(program, drawing.alphabet))
            return false;
        return std::ranges::none_of(drawing.alphabet.commands, [](TurtleCommand command) {
            using enum TurtleCommand;
            return command == Level || command == Width || command == Cut || command == Organ ||
                   command == BeginPolygon || command == EndPolygon;
        });
    }

    /// No expansion opens a bracket that it does not close, or closes one that it has not opened.
    static bool isBalanced(const GrammarProgram& program, const TurtleAlphabet& alphabet)
    {
        return std::ranges::all_of(program.code().words, [&](const GrammarProgram::Word& word) {
            std::int64_t depth = 0;
            for (const LetterId letter : std::span(program.code().letters).subspan(word.firstLetter, word.letterCount))
            {
                const bool opens = alphabet.commands[letter] == TurtleCommand::Push;
                const bool closes = alphabet.commands[letter] == TurtleCommand::Pop;
                depth += opens ? 1 : closes ? -1 : 0;
                if (depth < 0 || ((opens || closes) && program.isKeyed(letter))) // what rewrites it may be anything
                    return false;
            }
            return depth == 0;
        });
    }

    ReusingDrawer(const GrammarProgram& program, std::uint32_t steps, std::span<TurtleSegment> buffer, Drawing& drawing)
        : program_(program), code_(program.code()), width_(steps + 1), buffer_(buffer), drawing_(drawing),
          which_(program.letterCount() * width_, kNone)
    {}

    bool draw(std::span<const LetterId> letters, const double* arguments, std::uint32_t steps)
    {
        for (std::size_t i = 0; i < letters.size();)
        {
            const std::size_t from = i;
            const double* first = arguments;
            while (i < letters.size() && (steps == 0 || code_.fixedRule[letters[i]] == GrammarProgram::kNothing))
                arguments += program_.arityOf(letters[i++]);
            if (i > from)
            {
                if (!drawing_.apply(letters.subspan(from, i - from), first))
                    return false;
                continue;
            }
            arguments += program_.arityOf(letters[i]);
            if (!expand(letters[i++], steps))
                return false;
            if (expanded_ * kExpansionWork + drawing_.modules > drawing_.limits.derivationWork)
                return tooMuchWork();
        }
        return true;
    }

private:
    /// What an expansion drew, and how it moved the turtle.
    struct Expansion
    {
        std::size_t first = 0;
        std::size_t count = 0;
        std::uint64_t modules = 0;
        TurtlePlace entry, exit;
        TurtleAxes entryAxes;   ///< With the turns of `entry`.
        TurtleAxes exitAxes;    ///< From which the turns of `exit` are counted.
        bool keepsAxes = false; ///< It turned by counted turns alone.
        double reach = 0;       ///< Farthest of its points from where it began, metres.
    };

    /// Fewer segments than this are drawn faster than copied.
    static constexpr std::size_t kWorthCopying = 8;
    /// More would have to be fetched from farther away than the second-nearest cache; their parts are copied instead.
    static constexpr std::size_t kMostCopied = 4096;

    static constexpr std::size_t kMostRemembered = 4096; ///< Expansions.
    static constexpr std::uint64_t kExpansionWork = 8;   ///< As a rule that is applied, Limits::derivationWork.

    bool expand(LetterId letter, std::uint32_t steps)
    {
        ++expanded_;
        std::uint32_t& which = which_[letter * width_ + steps];
        if (which != kNone && reachesInside(expansions_[which]))
            return copy(expansions_[which]);
        Expansion expansion;
        expansion.first = drawing_.pen.count();
        expansion.modules = drawing_.modules;
        expansion.entry = drawing_.place();
        expansion.entryAxes = drawing_.scratch.axes[expansion.entry.axes];
        const GrammarProgram::Word& word = code_.words[code_.fixedRule[letter] + 1];
        if (!draw(std::span(code_.letters).subspan(word.firstLetter, word.letterCount),
                  code_.arguments.data() + word.firstArgument, steps - 1))
            return false;
        const std::size_t count = drawing_.pen.count() - expansion.first;
        if (which == kNone && count >= kWorthCopying && count <= kMostCopied && expansions_.size() < kMostRemembered)
        {
            which = static_cast<std::uint32_t>(expansions_.size());
            expansions_.push_back(finished(expansion, count));
        }
        return true;
    }

    /// What was begun where the turtle entered, now that it has left.
    Expansion finished(Expansion expansion, std::size_t count) const
    {
        expansion.count = count;
        expansion.modules = drawing_.modules - expansion.modules;
        expansion.exit = drawing_.place();
        expansion.exitAxes = drawing_.scratch.axes[expansion.exit.axes];
        expansion.keepsAxes = std::memcmp(&expansion.entryAxes, &expansion.exitAxes, sizeof(TurtleAxes)) == 0;
        drawing_.scratch.unitTurns.by(expansion.entry.yaw).apply(expansion.entryAxes.heading, expansion.entryAxes.left);
        const DVec3 base(expansion.entry.position);
        for (const TurtleSegment& segment : buffer_.subspan(expansion.first, count))
            for (const Vec3& point : {segment.start, segment.end})
                expansion.reach = std::max(expansion.reach, glm::length(DVec3(point) - base));
        return expansion;
    }

    bool tooMuchWork()
    {
        drawing_.error = {ErrorKind::Limit,
                          "the derivation takes more than " + std::to_string(drawing_.limits.derivationWork) +
                              " units of work",
                          "at most the limit derivationWork",
                          "derive fewer steps",
                          {}};
        return false;
    }

    /// `from`, the first of them with index `first`, turned and moved to `to`. Parents move along by `shift`; one
    /// outside becomes `outside`.
    static void copySegments(std::span<const TurtleSegment> from, std::uint32_t first, TurtleSegment* to,
                             const Vec3 (&columns)[3], const Vec3& moved, std::uint32_t shift, std::uint32_t outside)
    {
        const simd::Four x = {columns[0].x, columns[0].y, columns[0].z, 0};
        const simd::Four y = {columns[1].x, columns[1].y, columns[1].z, 0};
        const simd::Four z = {columns[2].x, columns[2].y, columns[2].z, 0};
        const simd::Four base = {moved.x, moved.y, moved.z, 0};
        const auto count = static_cast<std::uint32_t>(from.size());
        for (const TurtleSegment& segment : from)
        {
            const simd::Four start = simd::load(&segment.start);
            const simd::Four end = simd::load(&segment.end);
            const std::uint32_t parent = segment.parent;
            simd::store(&to->start, simd::withLast(x * simd::splat<0>(start) + y * simd::splat<1>(start) +
                                                       (z * simd::splat<2>(start) + base),
                                                   start));
            simd::store(&to->end, x * simd::splat<0>(end) + y * simd::splat<1>(end) + (z * simd::splat<2>(end) + base));
            to->parent = parent - first < count ? parent + shift : outside;
            ++to;
        }
    }

    bool reachesInside(const Expansion& expansion) const
    {
        const DVec3 p(drawing_.place().position);
        const double room = drawing_.limits.coordinate - 1.0001 * expansion.reach - 0.001;
        return std::abs(p.x) <= room && std::abs(p.y) <= room && std::abs(p.z) <= room;
    }

    /// Draws the expansion again, from where the turtle is now.
    bool copy(const Expansion& expansion)
    {
        SegmentPen& pen = drawing_.pen;
        if (expansion.count > pen.room())
            return pen.makeRoom(true); // which is none: nothing is reused where a consumer could make some
        TurtlePlace& now = drawing_.place();
        const TurtlePlace& exit = expansion.exit;
        // Each axis of then goes to that of now.
        const auto turned = [&then = expansion.entryAxes, facing = drawing_.kernel().axesNow()](const DVec3& v) {
            return DVec3(facing.heading) * glm::dot(DVec3(then.heading), v) +
                   DVec3(facing.left) * glm::dot(DVec3(then.left), v) + DVec3(facing.up) * glm::dot(DVec3(then.up), v);
        };
        const DVec3 moved = DVec3(now.position) - turned(DVec3(expansion.entry.position));
        const Vec3 columns[3] = {Vec3(turned({1, 0, 0})), Vec3(turned({0, 1, 0})), Vec3(turned({0, 0, 1}))};
        const auto shift = static_cast<std::uint32_t>(pen.count() - expansion.first);
        copySegments(buffer_.subspan(expansion.first, expansion.count), static_cast<std::uint32_t>(expansion.first),
                     buffer_.data() + pen.count(), columns, Vec3(moved), shift, now.segment);
        const DVec3 position = turned(DVec3(exit.position)) + moved;
        now.position = TurtleVector(position.x, position.y, position.z, now.radius());
        if (exit.segment != expansion.entry.segment)
            now.segment = exit.segment + shift;
        if (expansion.keepsAxes)
            now.yaw += exit.yaw - expansion.entry.yaw;
        else
        {
            drawing_.kernel().setAxes({TurtleVector(turned(DVec3(expansion.exitAxes.heading))),
                                       TurtleVector(turned(DVec3(expansion.exitAxes.left))),
                                       TurtleVector(turned(DVec3(expansion.exitAxes.up)))});
            now.yaw = exit.yaw;
        }
        pen.skip(expansion.count);
        drawing_.modules += expansion.modules;
        return true;
    }

    const GrammarProgram& program_;
    const GrammarProgram::Code& code_;
    std::size_t width_;
    std::span<TurtleSegment> buffer_;
    Drawing& drawing_;
    std::vector<std::uint32_t> which_; ///< Of expansions_, by letter and steps.
    std::vector<Expansion> expansions_;
    std::uint64_t expanded_ = 0;
};

Expected<void> derive(const GrammarProgram& program, RandomKey key, std::uint32_t steps, const Limits& limits,
                      DerivationScratch& scratch, DerivationSink& sink)
{
    const auto orError = [](const Expected<bool>& done) -> Expected<void> {
        if (!done)
            return tl::make_unexpected(done.error());
        return {};
    };
    if (program.isContextFree())
        return orError(streamWord(program, key, steps, Interpretation::Apply, limits, scratch, sink));
    Word word;
    if (auto done = deriveWord(program, key, steps, limits, scratch, word); !done)
        return done;
    return orError(emitWord(program, steps, Interpretation::Apply, limits, scratch, word, sink));
}

} // namespace

Expected<std::size_t> drawSegments(const GrammarProgram& program, const TurtleAlphabet& alphabet, RandomKey key,
                                   std::uint32_t steps, SegmentReuse reuse, const Limits& limits,
                                   DerivationScratch& derivationScratch, TurtleScratch& turtleScratch,
                                   std::span<TurtleSegment> buffer, const SegmentConsumer& consumer)
{
    if (auto priced = checkPrice(program, steps, limits); !priced)
        return tl::make_unexpected(priced.error());
    Drawing drawing(program, alphabet, limits, turtleScratch, buffer, consumer);
    if (reuse == SegmentReuse::WhereItCan && !consumer && ReusingDrawer::suits(program, steps, drawing))
    {
        const GrammarProgram::Word& axiom = program.code().words[0];
        ReusingDrawer drawer(program, steps, buffer, drawing);
        (void)drawer.draw(std::span(program.code().letters).subspan(axiom.firstLetter, axiom.letterCount),
                          program.code().arguments.data() + axiom.firstArgument, steps);
    }
    else
    {
        DrawingSink sink(drawing);
        if (auto done = derive(program, key, steps, limits, derivationScratch, sink); !done)
            return tl::make_unexpected(done.error());
    }
    if (!drawing.error.what.empty())
        return tl::make_unexpected(drawing.error);
    if (auto unfinished = drawing.kernel().unfinished(drawing.modules))
        return tl::make_unexpected(std::move(*unfinished));
    if (consumer && drawing.pen.count() > 0 && !consumer(buffer.first(drawing.pen.count())))
        return failure(ErrorKind::Cancelled, {}, "the drawing was stopped");
    return drawing.pen.total();
}

} // namespace espalier
