#pragma once

#include <Espalier/Core/Json.h>
#include <Espalier/Core/Simd.h>
#include <Espalier/Turtle/Turtle.h>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>

#define ESPALIER_INLINE __attribute__((always_inline))

namespace espalier {

/// What a turtle does with words: the commands, whatever the pen makes of what is drawn.
///
/// The state is kept in registers while commands follow each other that need no more than arithmetic (carryOut, with
/// no call in it). Anything else leaves that loop: there the state is in memory, and afterwards the loop goes on with
/// the same module or the next (exceptional). Each command has its one place in either.
///
/// A Pen is a small value that is copied into that loop and back. It has
///   bool hasRoom(bool segment, bool corner)   for one more
///   std::uint32_t segment(const TurtleFrame&, Four start, Four end, double length, std::uint32_t parent,
///                         std::uint16_t material)   its index; start and end are positions with the radius
///   void reach(const TurtleVector& position), corner(Four position), widthSet()
///   bool collectsCorners()
/// and for commands outside of the loop, with false where it has failed and told why:
///   bool makeRoom(), beginPolygon(), mark(const TurtleVector&), endPolygon(const TurtleState&),
///        sphere(const TurtleState&, double), organ(const TurtleState&, std::uint32_t which, double size)
///   bool hasPolygon()
template <class Pen>
class TurtleKernel
{
public:
    TurtleKernel(const TurtleSettings& settings, const Limits& limits, const TurtleTurns& turns, TurtleScratch& scratch,
                 TurtleState& state, Pen& pen)
        : settings_(settings), limits_(limits), turns_(turns), scratch_(scratch), state_(state), pen_(pen)
    {}

    Error error; ///< Set when a module failed and the pen has not.

    /// Carries out a run of modules; returns how many were carried out whole: all of them, unless one failed.
    std::size_t run(const TurtleAlphabet& alphabet, std::span<const LetterId> letters, const double* arguments)
    {
        const LetterId* at = letters.data();
        const LetterId* const end = at + letters.size();
        for (;;)
        {
            const LetterId* stop = end;
            if (at != end && (state_.cut || state_.organ)) [[unlikely]]
            {
                const double* const parameter = alphabet.arities[*at] > 0 ? arguments : nullptr;
                const After after = apart(alphabet.commands[*at], parameter, alphabet.symbols[*at]);
                if (after == After::Failure)
                    return static_cast<std::size_t>(at - letters.data());
                if (after == After::Next)
                {
                    arguments += alphabet.arities[*at++];
                    continue;
                }
                stop = at + 1;
            }
            if (state_.depth == scratch_.brackets.size())
                growStack();
            if (alphabet.hasArguments)
                at = carryOut<true, false>(alphabet, at, stop, arguments);
            else if (alphabet.isFlat && !settings_.tropism)
                at = carryOut<false, true>(alphabet, at, stop, arguments);
            else
                at = carryOut<false, false>(alphabet, at, stop, arguments);
            if (state_.depth < state_.cutDepth)
                state_.cut = false;
            if (bends_)
                bend();
            else if (at == end)
                return letters.size();
            else if (at != stop)
            {
                const double* const parameter = alphabet.arities[*at] > 0 ? arguments : nullptr;
                const After after = exceptional(alphabet.commands[*at], parameter);
                if (after == After::Failure)
                    return static_cast<std::size_t>(at - letters.data());
                if (after == After::Next)
                    arguments += alphabet.arities[*at++];
            }
        }
    }

    /// Carries out the turns that are only counted so far.
    void faceAhead()
    {
        if (state_.yaw == 0)
            return;
        saveFrame();
        if (settings_.angleDegrees != 0) // exactly nothing, so that leaving out a turn by 0 changes no bit
            rotate(state_.frame.heading, state_.frame.left, turnBy(state_.yaw));
        state_.yaw = 0;
    }

    /// Saves the frame for the brackets that have it, before it is changed.
    void saveFrame()
    {
        if (state_.unsaved == state_.depth)
            return;
        scratch_.frames[state_.unsaved] = state_.frame;
        state_.unsaved = state_.depth;
    }

private:
    enum class After
    {
        Next,    ///< It is carried out.
        Again,   ///< Now it can be, by carryOut.
        Failure, ///< `error` or the pen tells.
    };

    /// Carries out modules as long as they are of the common kind; returns where it stopped, with `arguments` moved on
    /// likewise. While a branch is cut it is given brackets only.
    template <bool kHasArguments, bool kIsFlat>
    const LetterId* carryOut(const TurtleAlphabet& alphabet, const LetterId* at, const LetterId* end,
                             const double*& givenArguments)
    {
        using enum TurtleCommand;
        TurtleFrame frame = state_.frame;
        std::uint32_t yaw = state_.yaw;
        std::uint32_t segment = state_.segment;
        std::uint16_t material = state_.material;
        std::size_t depth = state_.depth;
        std::size_t unsaved = state_.unsaved;
        Pen pen = pen_;
        const double* arguments = givenArguments;
        const simd::Two step = {settings_.stepLength, settings_.stepLength};
        const bool bends = settings_.tropism.has_value();
        const bool collects = pen.collectsCorners();
        TurtleBracket* const brackets = scratch_.brackets.data();
        TurtleFrame* const frames = scratch_.frames.data();
        const std::size_t room = std::min<std::size_t>(scratch_.brackets.size(), limits_.bracketDepth);
        const std::uint32_t mostYaw = settings_.angleDegrees != 0 ? TurtleTurns::kMost : 0;
        const simd::FourInts farthest = farthestBits();
        simd::Four here = simd::toFloats(frame.position.low, frame.position.high);

        const auto copyFrame = [](TurtleFrame& to, const TurtleFrame& from) ESPALIER_INLINE {
            to.heading = from.heading;
            to.left = from.left;
            if constexpr (!kIsFlat)
                to.up = from.up;
            to.position = from.position;
        };
        // The frame is about to change: the brackets that have it keep it.
        const auto save = [&]() ESPALIER_INLINE {
            if (unsaved == depth)
                return;
            copyFrame(frames[unsaved], frame);
            unsaved = depth;
        };
        // The turns counted so far, before something depends on them.
        const auto face = [&]() ESPALIER_INLINE {
            if (yaw == 0)
                return true;
            if (yaw + mostYaw > 2 * mostYaw) [[unlikely]]
                return false;
            rotate(frame.heading, frame.left, turns_[yaw]);
            yaw = 0;
            return true;
        };
        const auto advance = [&](const double* parameter, bool draws) ESPALIER_INLINE {
            if (!pen.hasRoom(draws, collects)) [[unlikely]]
                return false;
            save();
            if (!face())
                return false;
            const simd::Two length = parameter ? simd::Two{*parameter, *parameter} : step;
            TurtleVector position = frame.position;
            position.low += frame.heading.low * length;
            position.high += frame.heading.high * length;
            const simd::Four there = simd::toFloats(position.low, position.high);
            if (isOutside(there, farthest)) [[unlikely]]
                return false;
            frame.position = position;
            pen.reach(position);
            if (draws)
                segment = pen.segment(frame, here, there, length[0], segment, material);
            if (collects)
                pen.corner(there);
            here = there;
            return true;
        };
        const auto turn = [&](auto& a, auto& b, const double* parameter, std::uint32_t unit) ESPALIER_INLINE {
            if (!parameter)
            {
                if (mostYaw == 0)
                    return true;
                save();
                if (!face())
                    return false;
                rotate(a, b, turns_[unit]);
                return true;
            }
            if (*parameter == 0)
                return true;
            const TurtleTurn* const values = scratch_.turns.find(*parameter);
            if (!values) [[unlikely]]
                return false;
            save();
            if (!face())
                return false;
            rotate(a, b, unit == kLeft ? *values : TurtleTurn{-values->sine, values->cosine});
            return true;
        };

        const TurtleAlphabet::Step* const single = alphabet.single.data();
        const TurtleAlphabet::Step* const groups = alphabet.groups.data();
        constexpr std::ptrdiff_t kRead = TurtleAlphabet::kGroupRead;
        // In a group brackets may come and go unseen: not where there is no room for them.
        const bool areGroups = !alphabet.groups.empty() && end - at >= kRead && depth < room;
        const LetterId* lastGroup = areGroups ? end - (kRead - 1) : at;
        for (bool goesOn = true; goesOn;)
        {
            if (at >= lastGroup && at == end) [[unlikely]]
                break;
            const TurtleAlphabet::Step* const group =
                at < lastGroup ? groups + TurtleAlphabet::groupAt(at) : single + *at;
            at = past(at, group->letters);
            yaw += static_cast<std::uint32_t>(group->yaw);
            const double* parameter = nullptr;
            if constexpr (kHasArguments)
            {
                arguments += group->arguments;
                const std::uint8_t arity = alphabet.arities[at[-1]];
                parameter = arity > 0 ? arguments - arity : nullptr;
            }
            switch (group->command)
            {
            case Nothing:
                continue;
            case Draw:
                goesOn = advance(parameter, true);
                if (bends && goesOn) [[unlikely]]
                {
                    bends_ = true; // which takes trigonometry; the segment is drawn, so it goes on behind it
                    goesOn = false;
                    continue;
                }
                break;
            case Move:
                goesOn = advance(parameter, false);
                break;
            case TurnLeft:
                goesOn = turn(frame.heading, frame.left, parameter, kLeft);
                break;
            case TurnRight:
                goesOn = turn(frame.heading, frame.left, parameter, kRight);
                break;
            case PitchDown:
                goesOn = !kIsFlat && turn(frame.heading, frame.up, parameter, kRight);
                break;
            case PitchUp:
                goesOn = !kIsFlat && turn(frame.heading, frame.up, parameter, kLeft);
                break;
            case RollLeft:
                goesOn = !kIsFlat && turn(frame.left, frame.up, parameter, kRight);
                break;
            case RollRight:
                goesOn = !kIsFlat && turn(frame.left, frame.up, parameter, kLeft);
                break;
            case Width:
            {
                const double radius = parameter ? 0.5 * std::abs(*parameter) : 0.7 * frame.radius();
                goesOn = 2 * radius <= limits_.coordinate;
                if (!goesOn)
                    break;
                save();
                frame.position.high[1] = radius;
                here[3] = static_cast<float>(radius);
                pen.widthSet();
                break;
            }
            case Material:
                goesOn = !parameter || std::isfinite(*parameter);
                if (!parameter)
                    material = static_cast<std::uint16_t>(material + (material < 65535));
                else if (goesOn)
                    material = static_cast<std::uint16_t>(std::clamp(*parameter, 0.0, 65535.0));
                break;
            case Push:
                goesOn = depth < room;
                if (!goesOn)
                    break;
                brackets[depth].frame = static_cast<std::uint32_t>(unsaved);
                brackets[depth].yaw = yaw;
                brackets[depth].segment = segment;
                brackets[depth].material = material;
                if (++depth == room) [[unlikely]]
                    lastGroup = at;
                break;
            case Pop:
                goesOn = depth > 0;
                if (!goesOn)
                    break;
                --depth;
                yaw = brackets[depth].yaw;
                segment = brackets[depth].segment;
                material = brackets[depth].material;
                if (unsaved <= depth) // nothing has changed the frame since
                    break;
                copyFrame(frame, frames[brackets[depth].frame]);
                unsaved = depth;
                here = simd::toFloats(frame.position.low, frame.position.high);
                break;
            case TurnAround:
            case Level:
            case Cut:
            case BeginPolygon:
            case Corner:
            case EndPolygon:
            case Organ:
            case Sphere:
                goesOn = false;
                break;
            default:
                __builtin_unreachable(); // lest every jump is checked
            }
            if (!goesOn) // back to the module that is not carried out
            {
                --at;
                if constexpr (kHasArguments)
                    arguments -= alphabet.arities[*at];
            }
        }
        state_.frame = frame;
        state_.yaw = yaw;
        state_.segment = segment;
        state_.material = material;
        state_.depth = depth;
        state_.unsaved = unsaved;
        pen_ = pen;
        givenArguments = arguments;
        return at;
    }

    /// The symbol after ~ names an organ, whatever it would do otherwise; only brackets stay brackets. In what is cut
    /// off only brackets count, and the brace that ends a polygon begun before the cut. `Again` for brackets.
    After apart(TurtleCommand command, const double* parameter, std::uint32_t organ)
    {
        using enum TurtleCommand;
        const bool isName = std::exchange(state_.organ, false);
        if (command == Push || command == Pop)
            return After::Again;
        if (!state_.cut)
        {
            faceAhead();
            return isFinite(parameter) &&
                           pen_.organ(state_, organ, std::abs(parameter ? *parameter : settings_.stepLength))
                       ? After::Next
                       : After::Failure;
        }
        if (isName)
            return After::Next;
        state_.organ = command == Organ;
        if (command == BeginPolygon)
            ++state_.cutPolygons;
        else if (command == EndPolygon && state_.cutPolygons == 0)
            return exceptional(command, parameter);
        else if (command == EndPolygon)
            --state_.cutPolygons;
        return After::Next;
    }

    /// `at` + `letters`, branching: which letters come next must not wait for a table to tell where they are, and a
    /// branch is guessed. (Adding takes half as long again.)
    ESPALIER_INLINE static const LetterId* past(const LetterId* at, std::uint8_t letters)
    {
        static_assert(TurtleAlphabet::kGroup == 3);
        switch (letters)
        {
        case 1:
            at += 1;
            asm("" : "+r"(at)); // lest the compiler takes the branch away
            return at;
        case 2:
            at += 2;
            asm("" : "+r"(at));
            return at;
        default:
            at += 3;
            asm("" : "+r"(at));
            return at;
        }
    }

    /// What carryOut has stopped at: mistakes, rare commands, and what needs memory or trigonometry first.
    After exceptional(TurtleCommand command, const double* parameter)
    {
        using enum TurtleCommand;
        if (!isFinite(parameter))
            return After::Failure;
        switch (command)
        {
        case Draw:
        case Move:
            if (!pen_.hasRoom(command == Draw, pen_.collectsCorners()))
                return pen_.makeRoom() ? After::Again : After::Failure;
            if (state_.yaw == 0)
                return fail(ErrorKind::Limit,
                            "the plant reaches farther than " + formatNumber(limits_.coordinate) + " m from the origin",
                            "at most the limit coordinate");
            faceAhead();
            return After::Again;
        case TurnLeft:
        case TurnRight:
        case PitchDown:
        case PitchUp:
        case RollLeft:
        case RollRight:
            faceAhead();
            if (parameter)
                scratch_.turns.add(*parameter);
            return After::Again;
        case TurnAround:
            faceAhead();
            saveFrame();
            rotate(state_.frame.heading, state_.frame.left, TurtleTurn({0, -1}));
            return After::Next;
        case Level:
            faceAhead();
            level();
            return After::Next;
        case Width:
            return fail(ErrorKind::Limit, "a diameter is larger than " + formatNumber(limits_.coordinate) + " m",
                        "at most the limit coordinate");
        case Cut:
            state_.cut = true;
            state_.cutDepth = state_.depth;
            state_.cutPolygons = 0;
            return After::Next;
        case Push:
            if (state_.depth >= limits_.bracketDepth)
                return fail(ErrorKind::Limit, "brackets nest deeper than " + std::to_string(limits_.bracketDepth),
                            "at most the limit bracketDepth");
            growStack();
            return After::Again;
        case Pop:
            return fail(ErrorKind::BadInput, "`]` without `[`", "balanced brackets");
        case BeginPolygon:
            return orFailure(pen_.beginPolygon());
        case Corner:
            return orFailure(pen_.mark(state_.frame.position));
        case EndPolygon:
            if (!pen_.hasPolygon())
                return fail(ErrorKind::BadInput, "`}` without `{`", "balanced braces");
            return orFailure(pen_.endPolygon(state_));
        case Organ:
            state_.organ = true;
            return After::Next;
        case Sphere:
            return orFailure(pen_.sphere(state_, parameter ? 0.5 * std::abs(*parameter) : state_.frame.radius()));
        case Nothing:
        case Material:
            break;
        }
        return After::Next;
    }

    void growStack()
    {
        scratch_.brackets.resize(2 * state_.depth + 16);
        scratch_.frames.resize(scratch_.brackets.size());
    }

    static After orFailure(bool done) { return done ? After::Next : After::Failure; }

    After fail(ErrorKind kind, std::string what, std::string expected)
    {
        error = {kind, std::move(what), std::move(expected), {}, {}};
        return After::Failure;
    }

    bool isFinite(const double* parameter)
    {
        if (!parameter || std::isfinite(*parameter)) [[likely]]
            return true;
        (void)fail(ErrorKind::BadInput, "a parameter is not finite", "finite numbers");
        return false;
    }

    /// Turns a towards b, and b away from a.
    ESPALIER_INLINE static void rotate(TurtleVector& a, TurtleVector& b, const TurtleTurn& turn)
    {
        const TurtleVector from = a;
        a.low = a.low * turn.cosine + b.low * turn.sine;
        a.high = a.high * turn.cosine + b.high * turn.sine;
        b.low = b.low * turn.cosine - from.low * turn.sine;
        b.high = b.high * turn.cosine - from.high * turn.sine;
    }

    [[nodiscard]] TurtleTurn turnBy(std::uint32_t yaw) const
    {
        if (yaw + TurtleTurns::kMost <= 2 * TurtleTurns::kMost)
            return turns_[yaw];
        const double degrees = static_cast<std::int32_t>(yaw) * settings_.angleDegrees;
        return TurtleTurn(math::sinCosDegrees(std::fmod(degrees, 360.0)));
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
        const DVec3 heading(state_.frame.heading);
        const DVec3 horizontal = glm::cross(DVec3(0, 1, 0), heading);
        const double size = std::sqrt(glm::dot(horizontal, horizontal));
        if (size > 1e-9) // closer to the vertical than a nanoradian, left has no horizontal to turn to
        {
            saveFrame();
            state_.frame.left = TurtleVector(horizontal / size);
            state_.frame.up = TurtleVector(glm::cross(heading, horizontal / size));
        }
    }

    /// ABOP p. 58: by e |H x T| radians about H x T (Rodrigues' rotation formula).
    void bend()
    {
        bends_ = false;
        const Tropism& tropism = *settings_.tropism;
        const DVec3 towards(tropism.direction[0], tropism.direction[1], tropism.direction[2]);
        const DVec3 torque = glm::cross(DVec3(state_.frame.heading), towards);
        const double size = std::sqrt(glm::dot(torque, torque));
        const double angle = tropism.elasticity * size;
        if (!(size > 1e-12) || angle == 0 || !std::isfinite(angle)) // nothing to turn about
            return;
        const DVec3 axis = torque / size;
        const math::SinCos values = math::sinCos(angle);
        if (!std::isfinite(values.sin))
            return;
        saveFrame();
        for (TurtleVector* vector : {&state_.frame.heading, &state_.frame.left, &state_.frame.up})
        {
            const DVec3 v(*vector);
            *vector = TurtleVector(v * values.cos + glm::cross(axis, v) * values.sin +
                                   axis * (glm::dot(axis, v) * (1 - values.cos)));
        }
    }

    static constexpr std::uint32_t kLeft = 1;
    static constexpr std::uint32_t kRight = 0xffffffffu;

    const TurtleSettings& settings_;
    const Limits& limits_;
    const TurtleTurns& turns_;
    TurtleScratch& scratch_;
    TurtleState& state_;
    Pen& pen_;
    bool bends_ = false; ///< A segment was drawn that the tropism is to bend what follows after.
};

} // namespace espalier

#undef ESPALIER_INLINE
