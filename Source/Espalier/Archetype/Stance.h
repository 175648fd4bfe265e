#pragma once

#include <Espalier/Plant/Skeleton.h>
#include <cstdint>
#include <span>

namespace espalier {

/// Which side looks to the sky.
enum class SkySide : std::int8_t
{
    Right = -1,
    Neither = 0, ///< What is upright, or level as after `$`: a mirror image may take its place as well as it itself.
    Left = 1,
};

/// How an instance stands to the ground, as its first segment does.
struct Stance
{
    SkySide skySide = SkySide::Neither;
    bool isUpright = false; ///< Within 20 degrees. Whichever way it is rolled, it and what it carries rise alike.

    friend bool operator==(const Stance&, const Stance&) = default;
};

/// Finds the stances of the instances of one drawn tree (drawArchetype); those of others, and of instances that draw
/// nothing, stay as they are. `stances` has one for each instance of the archetype.
void findStances(const Skeleton& drawn, std::span<Stance> stances);

} // namespace espalier
