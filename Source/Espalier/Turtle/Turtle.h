#pragma once

#include <Espalier/Core/Error.h>
#include <Espalier/Core/Limits.h>
#include <Espalier/Turtle/TurtleAlphabet.h>
#include <Espalier/Turtle/TurtleState.h>
#include <cstdint>
#include <optional>
#include <span>

namespace espalier {

struct Skeleton;

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

/// Draws a word into a skeleton, symbol by symbol: start at the origin, heading +Y, left -X, up +Z
/// (Content/Grammars/LANGUAGE.md; Abelson and diSessa's turtle in three dimensions, ABOP p. 18). Positions and frame
/// are kept in doubles, so long axes do not drift: a turn is off by some 2^-52, so that even a path of four million
/// turns stays within a billionth.
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
    std::uint64_t applied_ = 0; ///< Modules, for messages.
    bool failed_ = false;
    Error error_;
    double minY_ = 0, maxY_ = 0, maxRadiusSquared_ = 0;
};

} // namespace espalier
