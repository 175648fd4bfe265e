#include <Espalier/Species/Grow.h>

#include <Espalier/Core/Hash.h>
#include <Espalier/Plant/Axes.h>
#include <algorithm>

namespace espalier {

namespace {

/// Draws what is derived.
class DrawingSink final : public DerivationSink
{
public:
    DrawingSink(Turtle& turtle, const std::vector<TurtleCommand>& commands) : turtle_(turtle), commands_(commands) {}

    bool module(SymbolId symbol, std::span<const double> arguments) override
    {
        return turtle_.apply(commands_[symbol], arguments);
    }
    void beginInstance(std::uint32_t production, std::uint32_t row) override { turtle_.beginInstance(production, row); }
    void endInstance() override { turtle_.endInstance(); }

private:
    Turtle& turtle_;
    const std::vector<TurtleCommand>& commands_;
};

/// Only counts what is derived.
class CountingSink final : public DerivationSink
{
public:
    CountingSink(const std::vector<TurtleCommand>& commands, const std::vector<std::uint64_t>& nameHashes,
                 std::uint32_t mostSegments)
        : commands_(commands), nameHashes_(nameHashes), mostSegments_(mostSegments)
    {}

    GrowthSample sample;

    bool module(SymbolId symbol, std::span<const double>) override
    {
        sample.topology = (sample.topology ^ nameHashes_[symbol]) * 0x100000001b3u;
        sample.topology ^= sample.topology >> 29;
        if (filter_.carriesOut(commands_[symbol]) && commands_[symbol] == TurtleCommand::Draw)
            ++sample.segments;
        return sample.segments <= mostSegments_;
    }
    void beginInstance(std::uint32_t, std::uint32_t) override
    {
        ++sample.instances;
        sample.depth = std::max(sample.depth, ++depth_);
    }
    void endInstance() override { --depth_; }
    [[nodiscard]] bool wantsArguments() const override { return false; }

private:
    const std::vector<TurtleCommand>& commands_;
    const std::vector<std::uint64_t>& nameHashes_;
    std::uint32_t mostSegments_;
    TurtleFilter filter_;
    std::uint32_t depth_ = 0;
};

/// How far `value` lies outside [low, high], as a ratio >= 1.
double excess(double value, double low, double high)
{
    if (value < low)
        return low / std::max(value, 1.0);
    return value > high ? value / std::max(high, 1.0) : 1.0;
}

std::vector<TurtleCommand> commandsOf(const Grammar& grammar)
{
    std::vector<TurtleCommand> commands;
    for (SymbolId id = 0; id < grammar.symbols.size(); ++id)
    {
        TurtleCommand command = turtleCommand(grammar.symbols.name(id));
        if (command == TurtleCommand::Draw || command == TurtleCommand::Move)
            command = TurtleCommand::Nothing; // `draw:` and `move:` decide
        commands.push_back(command);
    }
    for (const SymbolId id : grammar.move)
        commands[id] = TurtleCommand::Move;
    for (const SymbolId id : grammar.draw)
        commands[id] = TurtleCommand::Draw;
    return commands;
}

} // namespace

Expected<Grower> Grower::make(const Species& species)
{
    auto program = GrammarProgram::make(species.grammar, species.tables);
    if (!program)
        return tl::make_unexpected(program.error());
    return Grower(std::move(*program), species);
}

Grower::Grower(GrammarProgram program, const Species& species)
    : program_(std::move(program)),
      commands_(commandsOf(species.grammar)), turtle_{species.grammar.angle, species.grammar.step,
                                                      species.grammar.width},
      window_(species.window), pipes_(species.appearance.pipes)
{
    for (SymbolId id = 0; id < species.grammar.symbols.size(); ++id)
    {
        Hash64 hash;
        hash.bytes(species.grammar.symbols.name(id));
        nameHashes_.push_back(hash.result());
    }
}

Expected<bool> Grower::derive(Seed seed, std::uint32_t attempt, const GrowOptions& options, GrowScratch& scratch,
                              DerivationSink& sink) const
{
    return espalier::derive(program_, RandomKey(seed).child(attempt), options.budget, scratch.derivation, sink);
}

Expected<GrowthSample> Grower::sample(Seed seed, std::uint32_t attempt, const GrowOptions& options,
                                      GrowScratch& scratch, std::uint32_t mostSegments) const
{
    CountingSink sink(commands_, nameHashes_, mostSegments);
    const auto done = derive(seed, attempt, options, scratch, sink);
    if (!done)
        return tl::make_unexpected(done.error());
    sink.sample.whole = *done;
    return sink.sample;
}

Expected<std::uint32_t> Grower::acceptedAttempt(Seed seed, const GrowOptions& options, GrowScratch& scratch) const
{
    if (options.attempt || !window_)
        return options.attempt.value_or(0);
    // How far an attempt outgrows the window by more than this is not worth finding out.
    const std::uint32_t most = window_->maxSegments < 0x40000000u ? 2 * window_->maxSegments : 0xffffffffu;
    std::uint32_t nearest = 0;
    double least = 1e300;
    // A hostile species may ask for many attempts that each use up the budget.
    const std::uint64_t mostWork = 4 * (std::uint64_t{options.budget.productions} + options.budget.modules);
    std::uint64_t work = 0;
    for (std::uint32_t attempt = 0; attempt < window_->attempts && work < mostWork; ++attempt)
    {
        const auto grown = sample(seed, attempt, options, scratch, most);
        if (!grown)
            return tl::make_unexpected(grown.error());
        work += scratch.derivation.work;
        const bool copy = std::ranges::find(window_->copies, grown->topology) != window_->copies.end();
        const double distance = excess(grown->segments, window_->minSegments, window_->maxSegments) *
                                excess(grown->depth, window_->minDepth, window_->maxDepth);
        if (distance <= 1 && !copy && grown->whole)
            return attempt;
        // A copy is of the kind, only not new: better than anything outside the window, worse than anything inside.
        const double rank = copy ? 1.0 : distance;
        if (grown->whole && rank < least)
        {
            least = rank;
            nearest = attempt;
        }
    }
    return nearest;
}

Expected<void> Grower::grow(Seed seed, const GrowOptions& options, GrowScratch& scratch, Skeleton& skeleton) const
{
    skeleton.clear();
    const auto attempt = acceptedAttempt(seed, options, scratch);
    if (!attempt)
        return tl::make_unexpected(attempt.error());
    Turtle turtle(turtle_, options.limits, scratch.turtle, skeleton);
    DrawingSink sink(turtle, commands_);
    const auto derived = derive(seed, *attempt, options, scratch, sink);
    if (!derived)
    {
        skeleton.clear();
        return tl::make_unexpected(derived.error());
    }
    if (auto done = turtle.finish(); !done)
        return done;
    completeAxes(skeleton, pipes_);
    return {};
}

Expected<Skeleton> grow(const Species& species, Seed seed, const GrowOptions& options)
{
    const auto grower = Grower::make(species);
    if (!grower)
        return tl::make_unexpected(grower.error());
    GrowScratch scratch;
    Skeleton skeleton;
    if (auto done = grower->grow(seed, options, scratch, skeleton); !done)
        return tl::make_unexpected(done.error());
    return skeleton;
}

} // namespace espalier
