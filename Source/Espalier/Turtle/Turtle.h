#pragma once

#include <Espalier/Core/Error.h>
#include <Espalier/Core/Limits.h>
#include <Espalier/Core/Vector.h>
#include <cstdint>
#include <span>
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
    Sphere,       ///< @
};

/// The command that a symbol spells by convention (DESIGN 6); Nothing for every other symbol. F, G and f are Draw and
/// Move here; a grammar's `draw:` and `move:` may say otherwise.
[[nodiscard]] TurtleCommand turtleCommand(std::string_view symbol) noexcept;

/// Defaults of commands without a parameter.
struct TurtleSettings
{
    double angleDegrees = 25; ///< Of + - & ^ \ /
    double stepLength = 1;    ///< Metres; of F f G
    double width = 0.1;       ///< Metres; the diameter until ! sets it
};

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

/// Memory of a turtle; reuse it and nothing is allocated after warm-up. One per thread.
struct TurtleScratch
{
    struct State
    {
        DVec3 position{0, 0, 0};
        DVec3 heading{0, 1, 0};
        DVec3 left{-1, 0, 0};
        DVec3 up{0, 0, 1};
        double width = 0.1;
        std::uint32_t segment = 0xffffffffu; ///< Drawn last on the way here.
        std::uint16_t material = 0;
        bool cut = false;
    };
    std::vector<State> stack;
    std::vector<std::uint32_t> instances;
};

/// Draws a word into a skeleton, symbol by symbol: start at the origin, heading +Y, left -X, up +Z (DESIGN 6; Abelson
/// and diSessa's turtle in three dimensions, ABOP p. 18). Positions are kept in doubles, so long axes do not drift.
///
/// Misuse (an unbalanced bracket, a parameter that is not finite), a coordinate or diameter out of range or more
/// segments than the limit stop the drawing; error() tells. Polygons, organs and spheres are understood but draw
/// nothing yet beyond the corners' reach.
class Turtle
{
public:
    /// Clears `skeleton`, which with `scratch` must outlive the turtle.
    Turtle(const TurtleSettings& settings, const Limits& limits, TurtleScratch& scratch, Skeleton& skeleton);

    /// Returns false once an error has occurred.
    bool apply(TurtleCommand command, std::span<const double> parameters);

    void beginInstance(std::uint32_t production, std::uint32_t row);
    void endInstance();

    /// Checks that every bracket is closed. The skeleton has segments, parents, frames and instances; completeAxes
    /// gives it axes and radii. On failure the skeleton is empty.
    [[nodiscard]] Expected<void> finish();

    /// Why apply returned false.
    [[nodiscard]] const Error& error() const noexcept { return error_; }

private:
    void draw(double length);
    void move(double length);
    void cover();
    bool fail(ErrorKind kind, std::string what, std::string expected);

    TurtleSettings settings_;
    Limits limits_;
    TurtleScratch& scratch_;
    Skeleton& skeleton_;
    TurtleScratch::State state_;
    bool organ_ = false; ///< The last symbol was ~.
    bool failed_ = false;
    Error error_;
    double minY_ = 0, maxY_ = 0, maxRadiusSquared_ = 0;
};

} // namespace espalier
