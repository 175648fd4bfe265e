#include <Espalier/Species/Grow.h>

#include <Espalier/Core/Hash.h>
#include <Espalier/Grammar/Forecast.h>
#include <Espalier/Plant/Axes.h>
#include <algorithm>

namespace espalier {

namespace {

/// Draws what is derived, before the eyes of another sink if there is one.
class DrawingSink final : public DerivationSink
{
public:
    DrawingSink(Turtle& turtle, const TurtleAlphabet& alphabet, DerivationSink* onlooker)
        : turtle_(turtle), alphabet_(alphabet), onlooker_(onlooker)
    {}

    bool modules(std::span<const LetterId> letters, std::span<const double> arguments) override
    {
        if (onlooker_)
            onlooker_->modules(letters, arguments);
        return turtle_.apply(alphabet_, letters, arguments);
    }
    void beginInstance(std::uint32_t production, std::uint32_t row) override
    {
        if (onlooker_)
            onlooker_->beginInstance(production, row);
        turtle_.beginInstance(production, row);
    }
    void endInstance() override
    {
        if (onlooker_)
            onlooker_->endInstance();
        turtle_.endInstance();
    }

private:
    Turtle& turtle_;
    const TurtleAlphabet& alphabet_;
    DerivationSink* onlooker_;
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

    bool modules(std::span<const LetterId> letters, std::span<const double>) override
    {
        for (const LetterId letter : letters)
        {
            topology_.add(nameHashes_[letter]);
            if (filter_.carriesOut(commands_[letter]) && commands_[letter] == TurtleCommand::Draw)
                ++sample.segments;
        }
        sample.topology = topology_.value();
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
    TopologyHash topology_;
    std::uint32_t depth_ = 0;
};

/// How far `value` lies outside [low, high], as a ratio >= 1.
double excess(double value, double low, double high)
{
    if (value < low)
        return low / std::max(value, 1.0);
    return value > high ? value / std::max(high, 1.0) : 1.0;
}

} // namespace

std::uint64_t TopologyHash::ofName(std::string_view symbol) noexcept
{
    Hash64 hash;
    hash.bytes(symbol);
    return hash.result();
}

Expected<Grower> Grower::make(const Species& species, std::optional<std::uint32_t> iterations, const Limits& limits)
{
    auto program = GrammarProgram::make(species.grammar, species.tables);
    if (!program)
        return tl::make_unexpected(program.error());
    Grower grower(std::move(*program), species);
    grower.iterations_ = iterations ? iterations : species.grammar.iterations;
    if (grower.iterations_)
    {
        if (auto priced = checkPrice(grower.program_, *grower.iterations_, limits); !priced)
            return tl::make_unexpected(priced.error());
    }
    else if (!grower.program_.isContextFree())
        return failure(ErrorKind::BadInput, {{}, species.grammar.axiomPlace.line, species.grammar.axiomPlace.column},
                       "a grammar with contexts has no end of its own", "a line such as `iterations: 6`");
    return grower;
}

Expected<Grower> Grower::makeExemplar(const Species& species, std::uint32_t tree)
{
    const std::uint32_t trees = species.provenance.exemplars;
    if (tree >= trees)
        return failure(ErrorKind::BadInput, {},
                       trees == 0 ? "the species does not hold the tree that it was inferred from"
                                  : "the species holds no drawn tree number " + std::to_string(tree + 1),
                       trees == 0 ? "one that was inferred with the preset kin"
                                  : "one of its " + std::to_string(trees));
    Species exemplar = species;
    exemplar.window.reset();
    for (TransformTable& table : exemplar.tables)
        table.spread = {};
    Grammar& grammar = exemplar.grammar;
    const auto weight = std::ranges::find(grammar.constants, "w", &NamedConstant::name);
    if (weight != grammar.constants.end())
        weight->value = grammar.expressions.number(0);
    if (trees > 1)
    {
        // The axiom's rules are the drawn trees, in their order.
        std::uint32_t number = 0;
        const auto begins = [&](const Production& production) {
            return grammar.axiom.size() == 1 && production.predecessor == grammar.axiom[0].symbol && number++ == tree;
        };
        const auto rule = std::ranges::find_if(grammar.productions, begins);
        if (rule == grammar.productions.end())
            return failure(ErrorKind::BadInput, {},
                           "no rule of the axiom leads to drawn tree number " + std::to_string(tree + 1),
                           "the axiom and its rules as they were inferred");
        grammar.axiom = rule->successor;
    }
    return make(exemplar);
}

Expected<Grower> Grower::make(const Grammar& grammar, std::optional<std::uint32_t> iterations, const Limits& limits)
{
    Species species;
    species.grammar = grammar;
    auto grower = make(species, iterations.value_or(grammar.iterations.value_or(0)), limits);
    if (grower)
        grower->pipes_.reset();
    return grower;
}

Grower::Grower(GrammarProgram program, const Species& species)
    : program_(std::move(program)), alphabet_(program_), turtle_(turtleSettings(species.grammar)),
      window_(species.window), pipes_(species.appearance.pipes)
{
    for (const SymbolId symbol : alphabet_.symbols)
        nameHashes_.push_back(TopologyHash::ofName(species.grammar.symbols.name(symbol)));
}

Expected<bool> Grower::derive(Seed seed, std::uint32_t attempt, const GrowOptions& options, GrowScratch& scratch,
                              DerivationSink& sink) const
{
    const RandomKey key = RandomKey(seed).child(attempt);
    if (!iterations_)
        return deriveToEnd(program_, key, options.budget, scratch.derivation, sink);
    if (program_.isContextFree())
        return streamWord(program_, key, *iterations_, Interpretation::Apply, options.limits, scratch.derivation, sink);
    if (auto done = deriveWord(program_, key, *iterations_, options.limits, scratch.derivation, scratch.word); !done)
        return tl::make_unexpected(done.error());
    return emitWord(program_, *iterations_, Interpretation::Apply, options.limits, scratch.derivation, scratch.word,
                    sink);
}

Expected<GrowthSample> Grower::sample(Seed seed, std::uint32_t attempt, const GrowOptions& options,
                                      GrowScratch& scratch, std::uint32_t mostSegments) const
{
    CountingSink sink(alphabet_.commands, nameHashes_, mostSegments);
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
    const std::uint64_t mostWork = 32 * (std::uint64_t{options.budget.productions} + options.budget.modules);
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

Expected<void> Grower::grow(Seed seed, const GrowOptions& options, GrowScratch& scratch, Skeleton& skeleton,
                            DerivationSink* onlooker) const
{
    skeleton.clear();
    const auto attempt = acceptedAttempt(seed, options, scratch);
    if (!attempt)
        return tl::make_unexpected(attempt.error());
    Turtle turtle(turtle_, options.limits, scratch.turtle, skeleton);
    DrawingSink sink(turtle, alphabet_, onlooker);
    const auto derived = derive(seed, *attempt, options, scratch, sink);
    if (!derived)
    {
        skeleton.clear();
        return tl::make_unexpected(derived.error());
    }
    if (auto done = turtle.finish(); !done)
        return done;
    if (!pipes_ && !skeleton.widthsGiven)
        completeAxes(skeleton, suggestPipes(skeleton));
    else
        completeAxes(skeleton, pipes_.value_or(PipeModel{}));
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
