#include <Espalier/Turtle/Turtle.h>

#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Core/Json.h>
#include <Espalier/Plant/Skeleton.h>
#include <algorithm>
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

namespace {

/// Turns a towards b by the angle, and b away from a.
void rotate(DVec3& a, DVec3& b, const math::SinCos& angle)
{
    const DVec3 turned = a * angle.cos + b * angle.sin;
    b = b * angle.cos - a * angle.sin;
    a = turned;
}

/// Keeps the frame orthonormal: thousands of turns would otherwise let it drift.
void orthonormalise(TurtleScratch::State& state)
{
    state.heading /= std::sqrt(glm::dot(state.heading, state.heading));
    state.left -= state.heading * glm::dot(state.heading, state.left);
    state.left /= std::sqrt(glm::dot(state.left, state.left));
    state.up = glm::cross(state.heading, state.left);
}

} // namespace

Turtle::Turtle(const TurtleSettings& settings, const Limits& limits, TurtleScratch& scratch, Skeleton& skeleton)
    : settings_(settings), limits_(limits), scratch_(scratch), skeleton_(skeleton)
{
    skeleton_.clear();
    scratch_.stack.clear();
    scratch_.instances.clear();
    state_.width = settings.width;
}

bool Turtle::fail(ErrorKind kind, std::string what, std::string expected)
{
    failed_ = true;
    error_ = {kind, std::move(what), std::move(expected), {}, {}};
    return false;
}

bool Turtle::apply(TurtleCommand command, std::span<const double> parameters)
{
    using enum TurtleCommand;
    if (failed_)
        return false;
    // The symbol after ~ names an organ, whatever it would do otherwise; only brackets stay brackets.
    const bool isName = std::exchange(organ_, false);
    if ((isName || state_.cut) && command != Push && command != Pop)
    {
        organ_ = command == Organ && !isName;
        return true;
    }
    const double value = parameters.empty() ? 0.0 : parameters[0];
    if (!std::isfinite(value))
        return fail(ErrorKind::BadInput, "a parameter of the word is not finite", "finite numbers");
    const double angle = parameters.empty() ? settings_.angleDegrees : value;
    const double length = parameters.empty() ? settings_.stepLength : value;
    const auto turn = [&](DVec3& a, DVec3& b, double degrees) {
        if (degrees == 0) // exactly nothing, so that leaving out a turn by 0 changes no bit
            return;
        rotate(a, b, math::sinCosDegrees(std::fmod(degrees, 360.0)));
        orthonormalise(state_);
    };

    switch (command)
    {
    case Nothing:
    case BeginPolygon:
    case EndPolygon:
    case Corner:
    case Sphere:
        break;
    case Draw:
    case Move:
        command == Draw ? draw(length) : move(length);
        break;
    case TurnLeft:
        turn(state_.heading, state_.left, angle);
        break;
    case TurnRight:
        turn(state_.heading, state_.left, -angle);
        break;
    case PitchDown:
        turn(state_.heading, state_.up, -angle);
        break;
    case PitchUp:
        turn(state_.heading, state_.up, angle);
        break;
    case RollLeft:
        turn(state_.left, state_.up, -angle);
        break;
    case RollRight:
        turn(state_.left, state_.up, angle);
        break;
    case TurnAround:
        turn(state_.heading, state_.left, 180.0);
        break;
    case Level:
    {
        const DVec3 horizontal = glm::cross(DVec3(0, 1, 0), state_.heading);
        const double size = std::sqrt(glm::dot(horizontal, horizontal));
        if (size > 1e-9) // closer to the vertical than a nanoradian, left has no horizontal to turn to
        {
            state_.left = horizontal / size;
            state_.up = glm::cross(state_.heading, state_.left);
        }
        break;
    }
    case Width:
        state_.width = parameters.empty() ? state_.width * 0.7 : std::abs(value);
        if (state_.width > limits_.coordinate)
            return fail(ErrorKind::Limit, "a diameter is larger than " + formatNumber(limits_.coordinate) + " m",
                        "at most the limit coordinate");
        skeleton_.widthsGiven = true;
        break;
    case Material:
        state_.material =
            static_cast<std::uint16_t>(parameters.empty() ? std::min(state_.material + 1, 65535)
                                                          : static_cast<int>(std::clamp(value, 0.0, 65535.0)));
        break;
    case Cut:
        state_.cut = true;
        break;
    case Push:
        if (scratch_.stack.size() >= limits_.bracketDepth)
            return fail(ErrorKind::Limit, "brackets nest deeper than " + std::to_string(limits_.bracketDepth),
                        "at most the limit bracketDepth");
        scratch_.stack.push_back(state_);
        break;
    case Pop:
        if (scratch_.stack.empty())
            return fail(ErrorKind::BadInput, "`]` without `[` in the word", "balanced brackets");
        state_ = scratch_.stack.back();
        scratch_.stack.pop_back();
        break;
    case Organ:
        organ_ = true;
        break;
    }
    return !failed_;
}

void Turtle::move(double length)
{
    state_.position += state_.heading * length;
    cover();
}

void Turtle::draw(double length)
{
    const std::uint32_t index = skeleton_.size();
    if (index >= limits_.nodes)
    {
        fail(ErrorKind::Limit, "the plant has more than " + std::to_string(limits_.nodes) + " segments",
             "at most the limit nodes");
        return;
    }
    const DVec3 start = state_.position;
    move(length);
    if (failed_)
        return;
    skeleton_.starts.push_back(Vec3(start));
    skeleton_.ends.push_back(Vec3(state_.position));
    skeleton_.headings.push_back(Vec3(length < 0 ? -state_.heading : state_.heading));
    skeleton_.lefts.push_back(Vec3(state_.left));
    skeleton_.lengths.push_back(static_cast<float>(std::abs(length)));
    skeleton_.startRadii.push_back(static_cast<float>(state_.width * 0.5));
    skeleton_.endRadii.push_back(static_cast<float>(state_.width * 0.5));
    skeleton_.parents.push_back(state_.segment);
    skeleton_.continuations.push_back(kNoSegment);
    skeleton_.orders.push_back(0);
    skeleton_.materials.push_back(state_.material);
    skeleton_.instances.push_back(scratch_.instances.empty() ? kNoSegment : scratch_.instances.back());
    state_.segment = index;
}

void Turtle::cover()
{
    const DVec3& p = state_.position;
    const double most = limits_.coordinate;
    if (!(std::abs(p.x) <= most && std::abs(p.y) <= most && std::abs(p.z) <= most))
    {
        fail(ErrorKind::Limit,
             "the plant reaches farther than " + formatNumber(limits_.coordinate) + " m from the origin",
             "at most the limit coordinate");
        return;
    }
    minY_ = std::min(minY_, p.y);
    maxY_ = std::max(maxY_, p.y);
    maxRadiusSquared_ = std::max(maxRadiusSquared_, p.x * p.x + p.z * p.z);
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
    if (!failed_ && !scratch_.stack.empty())
        fail(ErrorKind::BadInput, "`[` is never closed in the word", "balanced brackets");
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
