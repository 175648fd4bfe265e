#include <Espalier/Turtle/TurtleState.h>

#include <bit>
#include <cmath>

namespace espalier {

TurtleTurns::TurtleTurns(double angleDegrees) : angleDegrees_(angleDegrees)
{
    for (std::uint32_t i = 0; i <= kMost; ++i)
    {
        turns_[kMost + i] = TurtleTurn(math::sinCosDegrees(std::fmod(i * angleDegrees, 360.0)));
        turns_[kMost - i] = turns_[kMost + i].back();
    }
}

TurtleTurn TurtleTurns::by(std::uint32_t yaw) const
{
    if (has(yaw))
        return (*this)[yaw];
    const double degrees = static_cast<std::int32_t>(yaw) * angleDegrees_;
    return TurtleTurn(math::sinCosDegrees(std::fmod(degrees, 360.0)));
}

void TurnCache::add(double degrees) noexcept
{
    Entry* const pair = &entries_[pairOf(degrees)];
    pair[1] = pair[0];
    pair[0] = {degrees, TurtleTurn(math::sinCosDegrees(std::fmod(degrees, 360.0)))};
}

void TurtleScratch::begin(double angleDegrees)
{
    if (std::bit_cast<std::uint64_t>(angleDegrees) != std::bit_cast<std::uint64_t>(unitTurns.angleDegrees()))
        unitTurns = TurtleTurns(angleDegrees);
    cutPolygons.clear();
    makeRoom(16);
    places[0] = TurtlePlace();
    axes[0] = TurtleAxes();
}

void TurtleScratch::makeRoom(std::size_t count)
{
    if (count > places.size())
    {
        places.resize(count);
        axes.resize(count);
    }
}

} // namespace espalier
