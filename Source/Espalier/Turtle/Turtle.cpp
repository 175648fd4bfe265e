#include <Espalier/Turtle/Turtle.h>

#include <Espalier/Core/Json.h>
#include <Espalier/Plant/Skeleton.h>
#include <Espalier/Turtle/TurtleKernel.h>
#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

namespace espalier {

TurtleCommand turtleCommand(std::string_view symbol) noexcept
{
    using enum TurtleCommand;
    if (symbol.size() != 1)
        return Nothing;
    switch (symbol[0])
    {
    case 'F':
    case 'G':
        return Draw;
    case 'f':
        return Move;
    case '+':
        return TurnLeft;
    case '-':
        return TurnRight;
    case '&':
        return PitchDown;
    case '^':
        return PitchUp;
    case '\\':
        return RollLeft;
    case '/':
        return RollRight;
    case '|':
        return TurnAround;
    case '$':
        return Level;
    case '!':
        return Width;
    case '\'':
        return Material;
    case '%':
        return Cut;
    case '[':
        return Push;
    case ']':
        return Pop;
    case '{':
        return BeginPolygon;
    case '.':
        return Corner;
    case '}':
        return EndPolygon;
    case '~':
        return Organ;
    case '@':
        return Sphere;
    default:
        return Nothing;
    }
}

bool TurtleFilter::carriesOut(TurtleCommand command) noexcept
{
    constexpr std::uint32_t kNone = 0xffffffffu;
    const bool isName = std::exchange(organ_, false);
    if (command == TurtleCommand::Push)
        ++depth_;
    else if (command == TurtleCommand::Pop)
    {
        if (cutDepth_ == depth_)
            cutDepth_ = kNone;
        depth_ -= depth_ > 0 ? 1 : 0;
    }
    else if (isName || cutDepth_ != kNone)
    {
        organ_ = command == TurtleCommand::Organ && !isName;
        return false;
    }
    else if (command == TurtleCommand::Cut)
        cutDepth_ = depth_;
    else if (command == TurtleCommand::Organ)
        organ_ = true;
    return true;
}

TurtleAlphabet::TurtleAlphabet(const GrammarProgram& program)
    : arities(program.arities().begin(), program.arities().end())
{
    const Grammar& grammar = program.grammar();
    std::vector<TurtleCommand> ofSymbol;
    for (SymbolId symbol = 0; symbol < grammar.symbols.size(); ++symbol)
    {
        const TurtleCommand command = turtleCommand(grammar.symbols.name(symbol));
        const bool isGiven = command == TurtleCommand::Draw || command == TurtleCommand::Move; // by `draw:` and `move:`
        ofSymbol.push_back(isGiven ? TurtleCommand::Nothing : command);
    }
    for (const SymbolId symbol : grammar.move)
        ofSymbol[symbol] = TurtleCommand::Move;
    for (const SymbolId symbol : grammar.draw)
        ofSymbol[symbol] = TurtleCommand::Draw;
    for (std::uint32_t letter = 0; letter < program.letterCount(); ++letter)
    {
        symbols.push_back(program.symbolOf(static_cast<LetterId>(letter)));
        commands.push_back(ofSymbol[symbols.back()]);
    }
    tabulate();
}

TurtleAlphabet::TurtleAlphabet(std::vector<TurtleCommand> givenCommands, std::vector<std::uint8_t> givenArities,
                               std::vector<SymbolId> givenSymbols)
    : commands(std::move(givenCommands)), arities(std::move(givenArities)), symbols(std::move(givenSymbols))
{
    tabulate();
}

void TurtleAlphabet::tabulate()
{
    const std::size_t count = commands.size();
    isFlat = std::ranges::none_of(commands, [](TurtleCommand command) {
        using enum TurtleCommand;
        return command == PitchDown || command == PitchUp || command == RollLeft || command == RollRight ||
               command == Level;
    });
    hasArguments = std::ranges::any_of(arities, [](std::uint8_t arity) { return arity > 0; });
    for (std::size_t letter = 0; letter < count; ++letter)
    {
        Step step = {0, commands[letter], 1, arities[letter]};
        const bool left = step.command == TurtleCommand::TurnLeft;
        if (arities[letter] == 0 && (left || step.command == TurtleCommand::TurnRight))
            step = {left ? 1 : -1, TurtleCommand::Nothing, 1, 0};
        single.push_back(step);
    }
    if (count > 1u << kGroupBits || std::endian::native != std::endian::little)
        return;
    groups.resize(std::size_t{1} << (kGroupBits * kGroup));
    std::array<LetterId, kGroupRead> word{};
    const auto letters = static_cast<LetterId>(count);
    for (word[0] = 0; word[0] < letters; ++word[0])
        for (word[1] = 0; word[1] < letters; ++word[1])
            for (word[2] = 0; word[2] < letters; ++word[2])
                groups[groupAt(word.data())] = comesTo(std::span(word).first(kGroup));
}

TurtleAlphabet::Step TurtleAlphabet::comesTo(std::span<const LetterId> letters) const
{
    Step sum{};
    const auto isNothing = [&](std::size_t i) { return single[letters[i]].command == TurtleCommand::Nothing; };
    for (std::size_t i = 0; i < letters.size() && sum.command == TurtleCommand::Nothing; i = sum.letters)
    {
        std::size_t end = i + 1;
        if (single[letters[i]].command == TurtleCommand::Push)
            while (end < letters.size() && isNothing(end))
                ++end;
        const bool isEmptyBranch = single[letters[i]].command == TurtleCommand::Push && end < letters.size() &&
                                   single[letters[end]].command == TurtleCommand::Pop;
        if (!isEmptyBranch)
        {
            sum.command = single[letters[i]].command;
            sum.yaw += single[letters[i]].yaw;
        }
        const std::size_t last = isEmptyBranch ? end : i;
        for (std::size_t k = i; k <= last; ++k)
            sum.arguments = static_cast<std::uint16_t>(sum.arguments + single[letters[k]].arguments);
        sum.letters = static_cast<std::uint8_t>(last + 1);
    }
    return sum;
}

TurtleSettings turtleSettings(const Grammar& grammar)
{
    return {grammar.angle, grammar.step, grammar.width, grammar.width != TurtleSettings{}.width, grammar.tropism};
}

TurtleTurns::TurtleTurns(double angleDegrees)
{
    for (std::uint32_t i = 0; i <= kMost; ++i)
    {
        const math::SinCos values = math::sinCosDegrees(std::fmod(i * angleDegrees, 360.0));
        turns_[kMost - i] = TurtleTurn({-values.sin, values.cos});
        turns_[kMost + i] = TurtleTurn(values);
    }
}

void TurnCache::add(double degrees) noexcept
{
    Entry* const pair = &entries_[pairOf(degrees)];
    pair[1] = pair[0];
    pair[0] = {degrees, TurtleTurn(math::sinCosDegrees(std::fmod(degrees, 360.0)))};
}

/// Writes what a turtle draws into a skeleton.
class SkeletonPen
{
public:
    explicit SkeletonPen(Turtle& turtle)
        : turtle_(&turtle), limits_(&turtle.limits_), scratch_(&turtle.scratch_), skeleton_(&turtle.skeleton_)
    {}

    [[nodiscard]] bool collectsCorners() const { return !scratch_->polygons.empty(); }
    [[nodiscard]] bool hasPolygon() const { return collectsCorners(); }
    [[nodiscard]] bool hasRoom(bool forSegment, bool forCorner) const
    {
        return !(forSegment && isFull()) && !(forCorner && isFullOfCorners());
    }
    bool makeRoom()
    {
        return isFull() ? fail("the plant has more than " + std::to_string(limits_->nodes) + " segments",
                               "at most the limit nodes")
                        : failOfCorners();
    }

    std::uint32_t segment(const TurtleFrame& frame, simd::Four start, simd::Four end, double length,
                          std::uint32_t parent, std::uint16_t material)
    {
        const std::uint32_t index = skeleton_->size();
        const Vec3 heading(frame.heading);
        skeleton_->starts.push_back({start[0], start[1], start[2]});
        skeleton_->ends.push_back({end[0], end[1], end[2]});
        skeleton_->headings.push_back(length < 0 ? -heading : heading);
        skeleton_->lefts.push_back(Vec3(frame.left));
        skeleton_->lengths.push_back(static_cast<float>(std::abs(length)));
        skeleton_->startRadii.push_back(start[3]);
        skeleton_->endRadii.push_back(start[3]);
        skeleton_->parents.push_back(parent);
        skeleton_->continuations.push_back(kNoSegment);
        skeleton_->orders.push_back(0);
        skeleton_->materials.push_back(material);
        skeleton_->instances.push_back(scratch_->instances.empty() ? kNoSegment : scratch_->instances.back());
        return index;
    }

    void reach(const TurtleVector& position)
    {
        const DVec3 p(position);
        turtle_->minY_ = std::min(turtle_->minY_, p.y);
        turtle_->maxY_ = std::max(turtle_->maxY_, p.y);
        turtle_->maxRadiusSquared_ = std::max(turtle_->maxRadiusSquared_, p.x * p.x + p.z * p.z);
    }

    void corner(simd::Four position) { scratch_->corners.push_back({position[0], position[1], position[2]}); }

    bool beginPolygon()
    {
        if (scratch_->polygons.size() >= limits_->bracketDepth)
            return fail("polygons nest deeper than " + std::to_string(limits_->bracketDepth),
                        "at most the limit bracketDepth");
        scratch_->polygons.push_back(static_cast<std::uint32_t>(scratch_->corners.size()));
        return true;
    }

    bool mark(const TurtleVector& position)
    {
        if (scratch_->polygons.empty())
            return true;
        if (isFullOfCorners())
            return failOfCorners();
        scratch_->corners.push_back(Vec3(position));
        return true;
    }

    bool endPolygon(const TurtleState& state)
    {
        const std::uint32_t first = scratch_->polygons.back();
        scratch_->polygons.pop_back();
        const auto count = static_cast<std::uint32_t>(scratch_->corners.size()) - first;
        if (count >= 3)
        {
            skeleton_->polygons.push_back(
                {static_cast<std::uint32_t>(skeleton_->corners.size()), count, state.segment, state.material});
            skeleton_->corners.insert(skeleton_->corners.end(), scratch_->corners.begin() + first,
                                      scratch_->corners.end());
        }
        scratch_->corners.resize(first);
        return true;
    }

    bool sphere(const TurtleState& state, double radius)
    {
        if (skeleton_->spheres.size() >= limits_->nodes)
            return fail("the plant has more than " + std::to_string(limits_->nodes) + " spheres",
                        "at most the limit nodes");
        if (radius > limits_->coordinate)
            return fail("a sphere is larger than " + formatNumber(limits_->coordinate) + " m",
                        "at most the limit coordinate");
        skeleton_->spheres.push_back(
            {Vec3(state.frame.position), static_cast<float>(radius), state.segment, state.material});
        return true;
    }

    bool organ(const TurtleState& state, std::uint32_t which, double size)
    {
        if (skeleton_->organs.size() >= limits_->nodes)
            return fail("the plant has more than " + std::to_string(limits_->nodes) + " organs",
                        "at most the limit nodes");
        if (size > limits_->coordinate)
            return fail("an organ is larger than " + formatNumber(limits_->coordinate) + " m",
                        "at most the limit coordinate");
        skeleton_->organs.push_back({Vec3(state.frame.position), Vec3(state.frame.heading), Vec3(state.frame.left),
                                     static_cast<float>(size), which, state.segment, state.material});
        return true;
    }

    void widthSet() { skeleton_->widthsGiven = true; }

private:
    [[nodiscard]] bool isFull() const { return skeleton_->size() >= limits_->nodes; }
    [[nodiscard]] bool isFullOfCorners() const
    {
        return scratch_->corners.size() + skeleton_->corners.size() >= limits_->vertices;
    }
    bool failOfCorners()
    {
        return fail("the polygons have more than " + std::to_string(limits_->vertices) + " corners",
                    "at most the limit vertices");
    }
    bool fail(std::string what, std::string expected)
    {
        turtle_->error_ = {ErrorKind::Limit, std::move(what), std::move(expected), {}, {}};
        return false;
    }

    Turtle* turtle_;
    const Limits* limits_;
    TurtleScratch* scratch_;
    Skeleton* skeleton_;
};

Turtle::Turtle(const TurtleSettings& settings, const Limits& limits, TurtleScratch& scratch, Skeleton& skeleton)
    : limits_(limits), settings_(settings), scratch_(scratch), skeleton_(skeleton), turns_(settings.angleDegrees)
{
    skeleton_.clear();
    skeleton_.widthsGiven = settings.widthIsGiven;
    scratch_.instances.clear();
    scratch_.corners.clear();
    scratch_.polygons.clear();
    state_.frame.position.high[1] = 0.5 * settings.width;
}

bool Turtle::apply(TurtleCommand command, std::span<const double> parameters)
{
    // Letters 2c and 2c + 1 are command c without and with a parameter.
    constexpr int kCommands = static_cast<int>(TurtleCommand::Sphere) + 1;
    static const TurtleAlphabet everyCommand = [] {
        std::vector<TurtleCommand> commands;
        std::vector<std::uint8_t> arities;
        for (int i = 0; i < 2 * kCommands; ++i)
        {
            commands.push_back(static_cast<TurtleCommand>(i / 2));
            arities.push_back(static_cast<std::uint8_t>(i % 2));
        }
        return TurtleAlphabet(commands, arities, std::vector<SymbolId>(commands.size(), 0));
    }();
    const auto letter = static_cast<LetterId>(2 * static_cast<int>(command) + !parameters.empty());
    return apply(everyCommand, {&letter, 1}, parameters);
}

bool Turtle::apply(const TurtleAlphabet& alphabet, std::span<const LetterId> letters, std::span<const double> arguments)
{
    if (failed_)
        return false;
    SkeletonPen pen(*this);
    TurtleKernel<SkeletonPen> kernel(settings_, limits_, turns_, scratch_, state_, pen);
    const std::size_t done = kernel.run(alphabet, letters, arguments.data());
    applied_ += done;
    if (done == letters.size())
        return true;
    ++applied_;
    return fail(kernel.error);
}

bool Turtle::fail(const Error& error)
{
    failed_ = true;
    if (!error.what.empty())
        error_ = error;
    error_.what = "module " + std::to_string(applied_) + " of the word: " + error_.what;
    return false;
}

void Turtle::beginInstance(std::uint32_t production, std::uint32_t row)
{
    const std::uint32_t parent = scratch_.instances.empty() ? kNoSegment : scratch_.instances.back();
    scratch_.instances.push_back(static_cast<std::uint32_t>(skeleton_.instanceRecords.size()));
    skeleton_.instanceRecords.push_back({parent, production, row});
}

void Turtle::endInstance()
{
    scratch_.instances.pop_back();
}

Expected<void> Turtle::finish()
{
    if (!failed_ && (state_.depth > 0 || !scratch_.polygons.empty()))
    {
        const bool isBracket = state_.depth > 0;
        failed_ = true;
        error_ = {ErrorKind::BadInput,
                  std::string(isBracket ? "`[`" : "`{`") + " is never closed in the word of " +
                      std::to_string(applied_) + " modules",
                  isBracket ? "balanced brackets" : "balanced braces",
                  {},
                  {}};
    }
    if (failed_)
    {
        skeleton_.clear();
        return tl::make_unexpected(error_);
    }
    skeleton_.minY = static_cast<float>(minY_);
    skeleton_.maxY = static_cast<float>(maxY_);
    skeleton_.maxRadius = static_cast<float>(std::sqrt(maxRadiusSquared_));
    return {};
}

} // namespace espalier
