#include <Espalier/Turtle/TurtleAlphabet.h>

#include <algorithm>
#include <array>
#include <bit>
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
    hasArguments = std::ranges::any_of(arities, [](std::uint8_t arity) { return arity > 0; });
    for (std::size_t letter = 0; letter < count; ++letter)
    {
        const std::array<LetterId, 1> alone = {static_cast<LetterId>(letter)};
        single.push_back(comesTo(alone));
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

std::int8_t TurtleAlphabet::yawOf(LetterId letter) const
{
    if (arities[letter] > 0)
        return 0;
    return commands[letter] == TurtleCommand::TurnLeft ? 1 : commands[letter] == TurtleCommand::TurnRight ? -1 : 0;
}

TurtleAlphabet::Step TurtleAlphabet::comesTo(std::span<const LetterId> letters) const
{
    using enum TurtleCommand;
    const auto commandOf = [&](std::size_t i) { return yawOf(letters[i]) != 0 ? Nothing : commands[letters[i]]; };
    Step sum{};
    std::size_t i = 0;
    while (i < letters.size() && sum.command == Nothing)
    {
        std::size_t end = i + 1;
        if (commandOf(i) == Push)
            while (end < letters.size() && commandOf(end) == Nothing)
                ++end;
        const bool isEmptyBranch = commandOf(i) == Push && end < letters.size() && commandOf(end) == Pop;
        if (!isEmptyBranch)
        {
            sum.command = commandOf(i);
            sum.yaw = static_cast<std::int8_t>(sum.yaw + yawOf(letters[i]));
        }
        for (const std::size_t next = isEmptyBranch ? end + 1 : i + 1; i < next; ++i)
            sum.arguments += arities[letters[i]];
        sum.arity = arities[letters[i - 1]];
    }
    sum.letters = static_cast<std::uint8_t>(i);
    return sum;
}

} // namespace espalier
