#pragma once

#include <Espalier/Core/RawVector.h>
#include <Espalier/Grammar/GrammarProgram.h>
#include <cstdint>
#include <cstring>
#include <span>
#include <string_view>
#include <vector>

namespace espalier {

/// What a symbol makes the turtle do.
enum class TurtleCommand : std::uint8_t
{
    Nothing,
    Draw,         ///< F G: a segment; parameter: length, metres
    Move,         ///< f
    TurnLeft,     ///< +  parameter of the turns: degrees
    TurnRight,    ///< -
    PitchDown,    ///< &
    PitchUp,      ///< ^
    RollLeft,     ///< backslash
    RollRight,    ///< /
    TurnAround,   ///< |
    Level,        ///< $: rolls so that left is horizontal
    Width,        ///< !: parameter: diameter, metres
    Material,     ///< ': parameter: index
    Cut,          ///< %: the rest of the branch is not drawn
    Push,         ///< [
    Pop,          ///< ]
    BeginPolygon, ///< {
    Corner,       ///< .
    EndPolygon,   ///< }
    Organ,        ///< ~: the next symbol, unless a bracket, names an organ
    Sphere,       ///< @: parameter: diameter, metres
};

/// The command that a symbol spells by convention (Content/Grammars/LANGUAGE.md); Nothing for every other symbol. F, G
/// and f are Draw and Move here; a grammar's `draw:` and `move:` may say otherwise.
[[nodiscard]] TurtleCommand turtleCommand(std::string_view symbol) noexcept;

/// What each letter of a program makes the turtle do. Immutable; share it among threads.
struct TurtleAlphabet
{
    std::vector<TurtleCommand> commands;
    std::vector<std::uint8_t> arities;
    std::vector<SymbolId> symbols; ///< What a letter after ~ names.

    TurtleAlphabet() = default;
    explicit TurtleAlphabet(const GrammarProgram& program);
    TurtleAlphabet(std::vector<TurtleCommand> commands, std::vector<std::uint8_t> arities,
                   std::vector<SymbolId> symbols);

    // How a turtle reads letters: as many as it can at once. Turns without a number only add up, many letters mean
    // nothing, and so does a branch without anything in it (if there is room for its bracket). So one entry of a table
    // tells what a group of letters comes to, up to the first that does more.

    static constexpr std::uint32_t kGroup = 3;     ///< Letters.
    static constexpr std::uint32_t kGroupRead = 4; ///< Letters that must be readable where a group begins.
    static constexpr std::uint32_t kGroupBits = 4; ///< Of a letter, if there are groups.

    struct Step
    {
        std::int8_t yaw;         ///< Turns to the left, by the angle of the grammar.
        TurtleCommand command;   ///< Of the last letter; Nothing if all have been added up.
        std::uint8_t letters;    ///< 1 .. kGroup
        std::uint8_t arity;      ///< Of the last letter.
        std::uint32_t arguments; ///< Of all letters.
    };

    std::vector<Step> single; ///< By letter.
    RawVector<Step> groups;   ///< By groupAt; empty where letters have more bits.
    bool hasArguments = false;

    /// Index of the group that begins at `letters`.
    [[nodiscard]] static std::size_t groupAt(const LetterId* letters) noexcept;

private:
    void tabulate();
    /// What letters come to up to the first that is not added up.
    [[nodiscard]] Step comesTo(std::span<const LetterId> letters) const;
    [[nodiscard]] std::int8_t yawOf(LetterId letter) const;
};

inline std::size_t TurtleAlphabet::groupAt(const LetterId* letters) noexcept
{
    // The product brings bits 16 i + [0, 4) to 52 + 4 i, for the first three letters; every other part of it falls
    // below or out at the top.
    constexpr std::uint64_t kFactor = (std::uint64_t{1} << 52) | (std::uint64_t{1} << 40) | (std::uint64_t{1} << 28);
    std::uint64_t four;
    std::memcpy(&four, letters, sizeof(four));
    return (four * kFactor) >> (64 - kGroupBits * kGroup);
}

/// Tells which commands of a word a turtle carries out: not the name after ~, and nothing between a cut and the end of
/// its branch; brackets always. For those who count without drawing.
class TurtleFilter
{
public:
    [[nodiscard]] bool carriesOut(TurtleCommand command) noexcept;

private:
    std::uint32_t depth_ = 0;
    std::uint32_t cutDepth_ = 0xffffffffu; ///< Of the branch that was cut; none at first.
    bool organ_ = false;
};

} // namespace espalier
