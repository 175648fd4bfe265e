#pragma once

#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Core/Error.h>
#include <Espalier/Core/Limits.h>
#include <Espalier/Core/RawVector.h>
#include <Espalier/Core/Simd.h>
#include <Espalier/Core/Vector.h>
#include <Espalier/Grammar/GrammarProgram.h>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace espalier {

struct Skeleton;

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

/// The command that a symbol spells by convention (DESIGN 6); Nothing for every other symbol. F, G and f are Draw and
/// Move here; a grammar's `draw:` and `move:` may say otherwise.
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

    struct Step
    {
        std::int32_t yaw;        ///< Turns to the left, by the angle of the grammar.
        TurtleCommand command;   ///< Of the last letter; Nothing if all have been added up.
        std::uint8_t letters;    ///< So many are carried out.
        std::uint16_t arguments; ///< Of these letters.
    };
    static constexpr std::uint32_t kGroup = 3;     ///< Letters.
    static constexpr std::uint32_t kGroupRead = 4; ///< Letters that must be readable where a group begins.
    static constexpr std::uint32_t kGroupBits = 4; ///< Of a letter, if there are groups.

    std::vector<Step> single; ///< By letter.
    RawVector<Step> groups;   ///< By groupAt; empty where letters have more bits.
    bool hasArguments = false;
    bool isFlat = false; ///< Nothing but a tropism leaves the plane: no need to keep in mind where up is.

    /// Index of the group that begins at `letters`.
    [[nodiscard]] static std::size_t groupAt(const LetterId* letters) noexcept;

private:
    void tabulate();
    /// What letters come to up to the first that is not added up.
    [[nodiscard]] Step comesTo(std::span<const LetterId> letters) const;
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

/// Defaults of commands without a parameter, and what bends the path.
struct TurtleSettings
{
    double angleDegrees = 25;  ///< Of + - & ^ \ /
    double stepLength = 1;     ///< Metres; of F f G
    double width = 0.1;        ///< Metres; the diameter until ! sets it
    bool widthIsGiven = false; ///< The diameter was chosen by somebody: radii are not left to the pipe model.
    std::optional<Tropism> tropism{};
};

/// The settings of a grammar; a width other than the default is a given one.
[[nodiscard]] TurtleSettings turtleSettings(const Grammar& grammar);

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

/// Three doubles, and a fourth that rides along, in two registers.
struct TurtleVector
{
    simd::Two low{0, 0};  ///< x, y
    simd::Two high{0, 0}; ///< z; the radius where this is a position, otherwise 0.

    TurtleVector() = default;
    TurtleVector(double x, double y, double z, double fourth = 0) : low{x, y}, high{z, fourth} {}
    explicit TurtleVector(const DVec3& v) : TurtleVector(v.x, v.y, v.z) {}
    explicit operator DVec3() const { return {low[0], low[1], high[0]}; }
    explicit operator Vec3() const
    {
        return {static_cast<float>(low[0]), static_cast<float>(low[1]), static_cast<float>(high[0])};
    }
};

/// Where a turtle is and how it is turned.
struct TurtleFrame
{
    TurtleVector heading{0, 1, 0};
    TurtleVector left{-1, 0, 0};
    TurtleVector up{0, 0, 1};
    TurtleVector position; ///< Metres; with the radius, half the diameter.

    [[nodiscard]] double radius() const { return position.high[1]; }
};

/// What a turtle knows between two symbols. Turns without a number are only counted until a symbol needs to know where
/// the turtle heads: turns that cancel or that nothing follows cost nothing.
struct TurtleState
{
    TurtleFrame frame;
    std::uint32_t yaw = 0;               ///< Turns to the left still to be carried out, modulo 2^32.
    std::uint32_t segment = 0xffffffffu; ///< Drawn last on the way here.
    std::uint16_t material = 0;
    bool organ = false; ///< The last symbol was ~.
    bool cut = false;   ///< Until fewer than `cutDepth` brackets are open.
    std::size_t cutDepth = 0;
    std::uint32_t cutPolygons = 0; ///< Opened since the cut.
    std::size_t depth = 0;         ///< Of brackets.
    std::size_t unsaved = 0;       ///< The brackets from this one on have the frame of now, not saved yet.
};

/// What [ remembers, but for the frame, which is only saved when it is about to change.
struct TurtleBracket
{
    std::uint32_t frame = 0; ///< Which of the saved ones.
    std::uint32_t yaw = 0;
    std::uint32_t segment = 0;
    std::uint16_t material = 0;
};

/// Sine and cosine, each twice, as vectors want them.
struct TurtleTurn
{
    simd::Two sine{0, 0};
    simd::Two cosine{1, 1};

    TurtleTurn() = default;
    explicit TurtleTurn(const math::SinCos& values) : sine{values.sin, values.sin}, cosine{values.cos, values.cos} {}
    TurtleTurn(simd::Two givenSine, simd::Two givenCosine) : sine(givenSine), cosine(givenCosine) {}
};

/// The turns by -kMost .. kMost times one angle.
class TurtleTurns
{
public:
    static constexpr std::uint32_t kMost = 16;

    explicit TurtleTurns(double angleDegrees);
    /// By `yaw` times the angle, -kMost <= yaw <= kMost (modulo 2^32).
    [[nodiscard]] const TurtleTurn& operator[](std::uint32_t yaw) const { return turns_[yaw + kMost]; }

private:
    std::array<TurtleTurn, 2 * kMost + 1> turns_;
};

/// The turns of the angles seen last.
class TurnCache
{
public:
    /// Null if it has to be added first.
    [[nodiscard]] const TurtleTurn* find(double degrees) const noexcept
    {
        const Entry* const pair = &entries_[pairOf(degrees)];
        if (pair[0].degrees == degrees)
            return &pair[0].turn;
        return pair[1].degrees == degrees ? &pair[1].turn : nullptr;
    }
    void add(double degrees) noexcept;

private:
    struct Entry
    {
        double degrees = std::numeric_limits<double>::quiet_NaN();
        TurtleTurn turn;
    };
    static std::size_t pairOf(double degrees) noexcept
    {
        return ((std::bit_cast<std::uint64_t>(degrees) * 0x9e3779b97f4a7c15u) >> 60) * 2;
    }
    std::array<Entry, 32> entries_;
};

/// Memory of a turtle; reuse it and nothing is allocated after warm-up. One per thread.
struct TurtleScratch
{
    std::vector<TurtleBracket> brackets; ///< Those that are open, and room for more.
    std::vector<TurtleFrame> frames;     ///< Of these brackets.
    std::vector<std::uint32_t> instances;
    std::vector<Vec3> corners;           ///< Of the polygons that are open, the outer ones first.
    std::vector<std::uint32_t> polygons; ///< Where in `corners` each open polygon begins.
    TurnCache turns;
};

/// Draws a word into a skeleton, symbol by symbol: start at the origin, heading +Y, left -X, up +Z (DESIGN 6; Abelson
/// and diSessa's turtle in three dimensions, ABOP p. 18). Positions and frame are kept in doubles, so long axes do not
/// drift: a turn is off by some 2^-52, so that even a path of four million turns stays within a billionth.
///
/// Polygons collect the end of every move and every segment inside { and }, and the position at every `.`; they nest,
/// and run across brackets. Misuse (an unbalanced bracket or brace, a parameter that is not finite), a coordinate or
/// diameter out of range or more segments, corners, spheres or organs than the limits allow stop the drawing; error()
/// tells, with the place in the word.
class Turtle
{
public:
    /// Clears `skeleton`, which with `scratch` must outlive the turtle.
    Turtle(const TurtleSettings& settings, const Limits& limits, TurtleScratch& scratch, Skeleton& skeleton);

    /// Carries out one command, with its parameters. Returns false once an error has occurred.
    bool apply(TurtleCommand command, std::span<const double> parameters);
    /// Carries out a run of modules; `arguments` are those of all of them.
    bool apply(const TurtleAlphabet& alphabet, std::span<const LetterId> letters, std::span<const double> arguments);

    void beginInstance(std::uint32_t production, std::uint32_t row);
    void endInstance();

    /// Checks that every bracket and brace is closed. The skeleton has segments, parents, frames, shapes and instances;
    /// completeAxes gives it axes and radii. On failure the skeleton is empty.
    [[nodiscard]] Expected<void> finish();

    /// Why apply returned false.
    [[nodiscard]] const Error& error() const noexcept { return error_; }

private:
    friend class SkeletonPen;
    bool fail(const Error& error);

    Limits limits_;
    TurtleSettings settings_;
    TurtleScratch& scratch_;
    Skeleton& skeleton_;
    TurtleState state_;
    TurtleTurns turns_;
    std::uint64_t applied_ = 0; ///< Modules, for messages.
    bool failed_ = false;
    Error error_;
    double minY_ = 0, maxY_ = 0, maxRadiusSquared_ = 0;
};

} // namespace espalier
