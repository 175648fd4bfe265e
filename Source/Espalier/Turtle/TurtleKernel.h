#pragma once

#include <Espalier/Core/Json.h>
#include <Espalier/Core/Simd.h>
#include <Espalier/Turtle/Turtle.h>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#define ESPALIER_INLINE __attribute__((always_inline))

namespace espalier {

/// A line that the turtle draws.
struct TurtleStroke
{
    simd::Four start, end; ///< Position, metres, with the radius.
    TurtleVector heading, left;
    double length; ///< Metres; less than 0 for a step backwards.
};

/// What a turtle does with words: the commands, whatever the pen makes of what is drawn.
///
/// Commands that need no more than arithmetic are carried out in one loop, with all that they change in registers
/// (carryOut, Registers). What takes more ends that loop, and is done with the state in memory (exceptional).
///
/// A Pen is a small value that is copied into that loop and back. It has
///   bool collectsCorners(), hasRoom(bool draws)   for a step, with a corner if it collects them
///   std::size_t room()   for so many steps that draw
///   std::uint32_t segment(const TurtleStroke&, std::uint32_t parent, std::uint16_t material)   its index
///   void reach(const TurtleVector& position), corner(simd::Four position), widthSet()
///   void beginPolygon(), endPolygon(const TurtlePlace&)
/// and, false where it has failed and told why:
///   bool makeRoom(bool draws), mark(const TurtleVector&), sphere(const TurtlePlace&, double radius),
///        organ(const TurtlePlace&, const TurtleAxes&, std::uint32_t which, double size)
template <class Pen>
class TurtleKernel
{
public:
    TurtleKernel(const TurtleSettings& settings, const Limits& limits, TurtleScratch& scratch, TurtleState& state,
                 Pen& pen)
        : settings_(settings), limits_(limits), scratch_(scratch), state_(state), pen_(pen)
    {}

    Error error; ///< Set when a module failed and the pen has not.

    /// Carries out a run of modules; returns how many were carried out whole: all of them, unless one failed.
    std::size_t run(const TurtleAlphabet& alphabet, std::span<const LetterId> letters, const double* arguments)
    {
        const LetterId* at = letters.data();
        const LetterId* const end = at + letters.size();
        const LetterId* stop = at;
        while (at != end)
        {
            const bool isApart = state_.cut || state_.organ;
            if (!isApart) [[likely]]
            {
                const LetterId* const from = at;
                if (at >= stop)
                    stop = stopOf(alphabet, at, end);
                at = alphabet.hasArguments ? carryOut<true>(alphabet, at, stop, arguments)
                                           : carryOut<false>(alphabet, at, stop, arguments);
                if (at == stop && at != from)
                {
                    if (settings_.tropism && alphabet.commands[at[-1]] == TurtleCommand::Draw)
                        bend();
                    continue;
                }
            }
            const TurtleCommand command = alphabet.commands[*at];
            const double* const parameter = alphabet.arities[*at] > 0 ? arguments : nullptr;
            const After after =
                isApart ? apart(command, parameter, alphabet.symbols[*at]) : exceptional(command, parameter);
            if (after == After::Failure)
                return static_cast<std::size_t>(at - letters.data());
            if (after == After::Next)
                arguments += alphabet.arities[*at++];
            if (command == TurtleCommand::BeginPolygon || command == TurtleCommand::EndPolygon)
                stop = at; // steps need room for corners now, or no longer
        }
        return letters.size();
    }

    /// The axes with the turns that are only counted so far.
    [[nodiscard]] TurtleAxes axesNow() const
    {
        TurtleAxes axes = scratch_.axes[place().axes];
        scratch_.unitTurns.by(place().yaw).apply(axes.heading, axes.left);
        return axes;
    }

    /// Turns to `axes`; brackets that share the present ones keep those.
    void setAxes(const TurtleAxes& axes)
    {
        const bool areShared = state_.depth > 0 && (&place())[-1].axes == place().axes;
        place().axes += areShared;
        scratch_.axes[place().axes] = axes;
        place().yaw = 0;
    }

    /// Why a word of so many modules cannot end here, if so.
    [[nodiscard]] std::optional<Error> unfinished(std::uint64_t modules) const
    {
        if (state_.depth == 0 && scratch_.cutPolygons.empty())
            return {};
        const bool isBracket = state_.depth > 0;
        return Error{ErrorKind::BadInput,
                     std::string(isBracket ? "`[`" : "`{`") + " is never closed in the word of " +
                         std::to_string(modules) + " modules",
                     isBracket ? "balanced brackets" : "balanced braces",
                     {},
                     {}};
    }

    [[nodiscard]] TurtlePlace& place() const { return scratch_.places[state_.depth]; }

private:
    enum class After
    {
        Next,    ///< It is carried out.
        Again,   ///< Now carryOut can.
        Failure, ///< `error` or the pen tells.
    };

    /// `at` + `letters`, by branches: the processor guesses those, and reads the next letters meanwhile; for a sum it
    /// would have to wait (value speculation).
    ESPALIER_INLINE static const LetterId* past(const LetterId* at, std::uint8_t letters)
    {
        static_assert(TurtleAlphabet::kGroup == 3);
        if (letters == 1)
            return opaque(at + 1);
        if (letters == 2)
            return opaque(at + 2);
        return opaque(at + 3);
    }
    /// `at`, but the compiler cannot tell: otherwise it would see that the branches are one sum.
    ESPALIER_INLINE static const LetterId* opaque(const LetterId* at)
    {
        asm("" : "+r"(at));
        return at;
    }

    /// What the loop over the modules works on, and how the common commands change it. Nothing has changed where they
    /// return false, because it takes more.
    struct Registers
    {
        explicit Registers(TurtleKernel& kernel, const LetterId* firstLetter, const double* firstArgument)
            : at(firstLetter), arguments(firstArgument), pen(kernel.pen_), bottom(kernel.scratch_.places.data()),
              top(bottom + kernel.state_.depth), position(top->position), here(position), yaw(top->yaw),
              segment(top->segment), axes(kernel.scratch_.axes.data()), unitTurns(kernel.scratch_.unitTurns),
              turns(kernel.scratch_.turns), stepLength{kernel.settings_.stepLength, kernel.settings_.stepLength},
              coordinate(kernel.limits_.coordinate), farthest(kernel.farthestBits()), collects(pen.collectsCorners())
        {
            const std::size_t room = std::min<std::size_t>(kernel.scratch_.places.size(), kernel.limits_.bracketDepth);
            last = bottom + std::max<std::size_t>(room, 1) - 1;
        }

        const LetterId* at;
        const double* arguments;
        Pen pen;
        TurtlePlace* bottom; ///< Of the stack of places.
        TurtlePlace* last;   ///< Where it is full.
        TurtlePlace* top;    ///< The place of now, but for these:
        TurtleVector position;
        simd::Four here; ///< The position, rounded.
        std::uint32_t yaw;
        std::uint32_t segment;
        TurtleAxes* axes;
        const TurtleTurns& unitTurns;
        const TurnCache& turns;
        simd::Two stepLength;
        double coordinate; ///< The limit.
        simd::FourInts farthest;
        bool collects;

        void store() const
        {
            top->position = position;
            top->yaw = yaw;
            top->segment = segment;
        }

        ESPALIER_INLINE bool advance(const double* parameter, bool draws)
        {
            if (!TurtleTurns::has(yaw)) [[unlikely]]
                return false;
            const simd::Two length = parameter ? simd::Two{*parameter, *parameter} : stepLength;
            const TurtleTurn& turn = unitTurns[yaw];
            const TurtleAxes& from = axes[top->axes];
            const TurtleVector heading = turn.towards(from.heading, from.left);
            const TurtleVector next = position + heading * length;
            const simd::Four there(next);
            if (isOutside(there, farthest)) [[unlikely]]
                return false;
            position = next;
            pen.reach(position);
            if (draws)
            {
                const TurtleVector left = turn.back().towards(from.left, from.heading);
                segment = pen.segment({here, there, heading, left, length[0]}, segment, top->material);
            }
            if (collects)
                pen.corner(there);
            here = there;
            return true;
        }

        /// Turns one axis towards another, or away from it.
        ESPALIER_INLINE bool turn(TurtleVector TurtleAxes::*axis, TurtleVector TurtleAxes::*other, bool isAway,
                                  const double* degrees)
        {
            if (degrees && *degrees == 0)
                return true;
            const TurtleTurn* const by = degrees ? turns.find(*degrees) : &unitTurns[1];
            if (!by || !TurtleTurns::has(yaw)) [[unlikely]]
                return false;
            TurtleAxes turned = axes[top->axes];
            if (yaw != 0)
                unitTurns[yaw].apply(turned.heading, turned.left);
            (isAway ? by->back() : *by).apply(turned.*axis, turned.*other);
            top->axes += top != bottom && top[-1].axes == top->axes;
            yaw = 0;
            axes[top->axes] = turned;
            return true;
        }

        ESPALIER_INLINE bool setWidth(const double* diameter)
        {
            const double radius = diameter ? 0.5 * std::abs(*diameter) : 0.7 * position.high[1];
            if (!(2 * radius <= coordinate))
                return false;
            position.high[1] = radius;
            here = simd::Four(position);
            pen.widthSet();
            return true;
        }

        ESPALIER_INLINE bool setMaterial(const double* index)
        {
            if (index && !std::isfinite(*index))
                return false;
            top->material = index ? static_cast<std::uint16_t>(std::clamp(*index, 0.0, 65535.0))
                                  : static_cast<std::uint16_t>(top->material + (top->material < 65535));
            return true;
        }

        ESPALIER_INLINE bool push()
        {
            if (top >= last)
                return false;
            store();
            top[1].axes = top->axes;
            top[1].material = top->material;
            ++top;
            return true;
        }

        ESPALIER_INLINE bool pop()
        {
            if (top == bottom)
                return false;
            --top;
            position = top->position;
            yaw = top->yaw;
            segment = top->segment;
            here = simd::Four(position);
            return true;
        }

        /// Carries out the letters of a step; false if the last of them takes more.
        template <bool kHasArguments>
        ESPALIER_INLINE bool perform(const TurtleAlphabet::Step& step)
        {
            using enum TurtleCommand;
            using Axes = TurtleAxes;
            yaw += static_cast<std::uint32_t>(std::int32_t{step.yaw});
            const double* parameter = nullptr;
            if constexpr (kHasArguments)
            {
                arguments += step.arguments;
                parameter = step.arity > 0 ? arguments - step.arity : nullptr;
            }
            at = past(at, step.letters);
            // What words are made of by branches: they are guessed better than the one jump of a switch.
            if (step.command == Draw)
                return advance(parameter, true);
            if (step.command == Push)
                return push();
            if (step.command == Pop)
                return pop();
            if (step.command == Nothing)
                return true;
            switch (step.command)
            {
            case Move:
                return advance(parameter, false);
            case TurnLeft:
                return turn(&Axes::heading, &Axes::left, false, parameter);
            case TurnRight:
                return turn(&Axes::heading, &Axes::left, true, parameter);
            case PitchUp:
                return turn(&Axes::heading, &Axes::up, false, parameter);
            case PitchDown:
                return turn(&Axes::heading, &Axes::up, true, parameter);
            case RollRight:
                return turn(&Axes::left, &Axes::up, false, parameter);
            case RollLeft:
                return turn(&Axes::left, &Axes::up, true, parameter);
            case Width:
                return setWidth(parameter);
            case Material:
                return setMaterial(parameter);
            default:
                return false;
            }
        }
    };

    /// Carries out modules as long as they are of the common kind; returns where it stopped, with `arguments` moved on
    /// likewise. Neither cut nor organ is set; the pen has room for what is drawn.
    template <bool kHasArguments>
    const LetterId* carryOut(const TurtleAlphabet& alphabet, const LetterId* begin, const LetterId* end,
                             const double*& arguments)
    {
        Registers now(*this, begin, arguments);
        bool goesOn = true;
        // In a group brackets come and go unseen, which takes room for one more.
        if (!alphabet.groups.empty() && now.top < now.last)
        {
            const TurtleAlphabet::Step* const groups = alphabet.groups.data();
            constexpr std::ptrdiff_t kRead = TurtleAlphabet::kGroupRead;
            while (goesOn && end - now.at >= kRead)
                goesOn = now.template perform<kHasArguments>(groups[TurtleAlphabet::groupAt(now.at)]);
        }
        while (goesOn && now.at != end)
            goesOn = now.template perform<kHasArguments>(alphabet.single[*now.at]);
        if (!goesOn) // back to the module that is not carried out
            now.arguments -= alphabet.arities[*--now.at];
        now.store();
        state_.depth = static_cast<std::size_t>(now.top - now.bottom);
        pen_ = now.pen;
        arguments = now.arguments;
        return now.at;
    }

    /// How far carryOut can go from `at`: as far as the pen has room, or to where that has to be looked at anew; with a
    /// tropism no farther than to the end of a segment, which bends what follows.
    const LetterId* stopOf(const TurtleAlphabet& alphabet, const LetterId* at, const LetterId* end) const
    {
        constexpr std::size_t kAmple = 64;
        const std::size_t room = pen_.room();
        if (!settings_.tropism && room >= kAmple)
            return at + std::min(room, static_cast<std::size_t>(end - at)); // a letter takes room for one at most
        const LetterId* const next = std::find_if(at, end, [&](LetterId letter) {
            using enum TurtleCommand;
            const TurtleCommand command = alphabet.commands[letter];
            return command == Draw || command == Move || command == BeginPolygon || command == Corner ||
                   command == EndPolygon;
        });
        return next == end ? end : next + hasRoomFor(alphabet.commands[*next]);
    }

    [[nodiscard]] bool hasRoomFor(TurtleCommand command) const
    {
        return command == TurtleCommand::Draw   ? pen_.hasRoom(true)
               : command == TurtleCommand::Move ? pen_.hasRoom(false)
                                                : true;
    }

    /// The symbol after ~ names an organ, whatever it would do otherwise; only brackets stay brackets. In what is cut
    /// off only brackets and braces count.
    After apart(TurtleCommand command, const double* parameter, std::uint32_t organ)
    {
        using enum TurtleCommand;
        const bool isName = std::exchange(state_.organ, false);
        if (command == Push || command == Pop)
            return exceptional(command, parameter);
        if (!state_.cut)
        {
            const double size = std::abs(parameter ? *parameter : settings_.stepLength);
            return isFinite(parameter) ? orFailure(pen_.organ(place(), axesNow(), organ, size)) : After::Failure;
        }
        if (isName)
            return After::Next;
        state_.organ = command == Organ;
        if (command == BeginPolygon)
            ++state_.cutPolygons;
        else if (command == EndPolygon)
            return exceptional(command, parameter);
        return After::Next;
    }

    /// What carryOut leaves: mistakes, rare commands, and what needs memory or trigonometry first.
    After exceptional(TurtleCommand command, const double* parameter)
    {
        using enum TurtleCommand;
        if (readsParameter(command) && !isFinite(parameter))
            return After::Failure;
        switch (command)
        {
        case Draw:
        case Move:
            if (!hasRoomFor(command))
                return pen_.makeRoom(command == Draw) ? After::Again : After::Failure;
            if (TurtleTurns::has(place().yaw))
                return fail(ErrorKind::Limit,
                            "the plant reaches farther than " + formatNumber(limits_.coordinate) + " m from the origin",
                            "at most the limit coordinate");
            setAxes(axesNow());
            return After::Again;
        case TurnLeft:
        case TurnRight:
        case PitchDown:
        case PitchUp:
        case RollLeft:
        case RollRight:
            if (!TurtleTurns::has(place().yaw))
                setAxes(axesNow());
            if (parameter)
                scratch_.turns.add(*parameter);
            return After::Again;
        case TurnAround:
        {
            TurtleAxes axes = axesNow();
            TurtleTurn({0, -1}).apply(axes.heading, axes.left);
            setAxes(axes);
            return After::Next;
        }
        case Level:
            level();
            return After::Next;
        case Width:
            return fail(ErrorKind::Limit, "a diameter is larger than " + formatNumber(limits_.coordinate) + " m",
                        "at most the limit coordinate");
        case Cut:
            state_.cut = true;
            state_.cutDepth = state_.depth;
            return After::Next;
        case Push:
            if (state_.depth >= limits_.bracketDepth)
                return fail(ErrorKind::Limit, "brackets nest deeper than " + std::to_string(limits_.bracketDepth),
                            "at most the limit bracketDepth");
            scratch_.makeRoom(state_.depth + 2);
            ++state_.depth;
            place() = (&place())[-1];
            return After::Next;
        case Pop:
            if (state_.depth == 0)
                return fail(ErrorKind::BadInput, "`]` without `[`", "balanced brackets");
            --state_.depth;
            state_.cut = state_.cut && state_.depth >= state_.cutDepth;
            return After::Next;
        case BeginPolygon:
            if (scratch_.cutPolygons.size() >= limits_.bracketDepth)
                return fail(ErrorKind::Limit, "polygons nest deeper than " + std::to_string(limits_.bracketDepth),
                            "at most the limit bracketDepth");
            pen_.beginPolygon();
            scratch_.cutPolygons.push_back(std::exchange(state_.cutPolygons, 0));
            return After::Next;
        case Corner:
            return orFailure(pen_.mark(place().position));
        case EndPolygon:
            if (state_.cutPolygons > 0) // it ends one that was cut off
            {
                --state_.cutPolygons;
                return After::Next;
            }
            if (scratch_.cutPolygons.empty())
                return fail(ErrorKind::BadInput, "`}` without `{`", "balanced braces");
            state_.cutPolygons = scratch_.cutPolygons.back();
            scratch_.cutPolygons.pop_back();
            pen_.endPolygon(place());
            return After::Next;
        case Organ:
            state_.organ = true;
            return After::Next;
        case Sphere:
            return orFailure(pen_.sphere(place(), parameter ? 0.5 * std::abs(*parameter) : place().radius()));
        case Nothing:
        case Material:
            break;
        }
        return After::Next;
    }

    static After orFailure(bool done) { return done ? After::Next : After::Failure; }

    After fail(ErrorKind kind, std::string what, std::string expected)
    {
        error = {kind, std::move(what), std::move(expected), {}, {}};
        return After::Failure;
    }

    static bool readsParameter(TurtleCommand command)
    {
        using enum TurtleCommand;
        return command == Draw || command == Move || command == TurnLeft || command == TurnRight ||
               command == PitchDown || command == PitchUp || command == RollLeft || command == RollRight ||
               command == Width || command == Material || command == Sphere;
    }

    bool isFinite(const double* parameter)
    {
        if (!parameter || std::isfinite(*parameter)) [[likely]]
            return true;
        (void)fail(ErrorKind::BadInput, "a parameter is not finite", "finite numbers");
        return false;
    }

    /// Bits of the largest float within the limit: magnitudes compare as these integers do, and NaN is beyond all.
    [[nodiscard]] simd::FourInts farthestBits() const
    {
        const auto rounded = static_cast<float>(limits_.coordinate);
        const int bits = std::bit_cast<std::int32_t>(rounded) - (rounded > limits_.coordinate);
        return simd::FourInts{bits, bits, bits, bits};
    }

    [[nodiscard]] ESPALIER_INLINE static bool isOutside(simd::Four position, simd::FourInts farthest)
    {
        constexpr simd::FourInts kMagnitude = {0x7fffffff, 0x7fffffff, 0x7fffffff, 0};
        return simd::anySign(((simd::FourInts)position & kMagnitude) > farthest);
    }

    void level()
    {
        TurtleAxes axes = axesNow();
        const DVec3 heading(axes.heading);
        const DVec3 horizontal = glm::cross(DVec3(0, 1, 0), heading);
        const double size = std::sqrt(glm::dot(horizontal, horizontal));
        if (size <= 1e-9) // so close to the vertical left has no horizontal to turn to
            return;
        axes.left = TurtleVector(horizontal / size);
        axes.up = TurtleVector(glm::cross(heading, horizontal / size));
        setAxes(axes);
    }

    /// ABOP p. 58: by e |H x T| radians about H x T (Rodrigues' rotation formula).
    void bend()
    {
        const Tropism& tropism = *settings_.tropism;
        TurtleAxes axes = axesNow();
        const DVec3 towards(tropism.direction[0], tropism.direction[1], tropism.direction[2]);
        const DVec3 torque = glm::cross(DVec3(axes.heading), towards);
        const double size = std::sqrt(glm::dot(torque, torque));
        const double angle = tropism.elasticity * size;
        if (!(size > 1e-12) || angle == 0 || !std::isfinite(angle)) // nothing to turn about
            return;
        const DVec3 axis = torque / size;
        const math::SinCos values = math::sinCos(angle);
        if (!std::isfinite(values.sin))
            return;
        for (TurtleVector* vector : {&axes.heading, &axes.left, &axes.up})
        {
            const DVec3 v(*vector);
            *vector = TurtleVector(v * values.cos + glm::cross(axis, v) * values.sin +
                                   axis * (glm::dot(axis, v) * (1 - values.cos)));
        }
        setAxes(axes);
    }

    const TurtleSettings& settings_;
    const Limits& limits_;
    TurtleScratch& scratch_;
    TurtleState& state_;
    Pen& pen_;
};

} // namespace espalier

#undef ESPALIER_INLINE
