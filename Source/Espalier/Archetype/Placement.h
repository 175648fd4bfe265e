#pragma once

#include <Espalier/Archetype/Archetype.h>
#include <Espalier/Plant/Skeleton.h>
#include <Espalier/Turtle/Turtle.h>
#include <vector>

namespace espalier {

/// Where the parameter of a placed symbol comes from.
enum class ParameterSource : std::uint8_t
{
    None,            ///< The symbol stands alone.
    Number,          ///< `number`
    Scaled,          ///< number * scaling
    Branching,       ///< branching angle
    BranchingTurned, ///< branching angle + rotation: the first turn of a word that starts with + or -
    NumberTurned,    ///< number + rotation: likewise, if it has a number of its own
    Rotation,        ///< rotation: the turn put before a word that starts otherwise
    Roll,            ///< roll
};

/// A symbol of a template as an instance's transform moves it.
struct PlacedModule
{
    char symbol = 'F';
    TurtleCommand command = TurtleCommand::Nothing;
    ParameterSource source = ParameterSource::None;
    double number = 0;
    std::uint32_t anchor = kNoAnchor;
};

/// The one definition of what scaling, rotation, branching angle and roll do to a template (Helberg 2021, chapter 5;
/// roll is ours): its word with a roll and, unless the word starts with a turn, the rotation put before it. Drawing an
/// archetype and writing a grammar both read it, so they agree to the bit.
[[nodiscard]] std::vector<PlacedModule> placeTemplate(const Template& piece);

/// The placed words of the templates that occur in an archetype, by template; those of others are empty.
[[nodiscard]] std::vector<std::vector<PlacedModule>> placedTemplates(const Archetype& archetype);

/// The parameter's value for one transform; without a source, `number`.
[[nodiscard]] double parameterValue(const PlacedModule& module, const InstanceTransform& transform) noexcept;

/// Draws the trees of a valid archetype, which must outlive it. For those who draw several: what the trees share is
/// worked out once.
class ArchetypeDrawer
{
public:
    explicit ArchetypeDrawer(const Archetype& archetype);

    [[nodiscard]] std::size_t trees() const noexcept { return anchors_.roots.size(); }

    /// As drawArchetype, into `skeleton`. Requires tree < trees().
    [[nodiscard]] Expected<void> draw(std::size_t tree, const Limits& limits, Skeleton& skeleton) const;

private:
    const Archetype& archetype_;
    AnchorTable anchors_;
    std::vector<std::vector<PlacedModule>> placed_; ///< Of each template that occurs.
};

/// The skeleton of tree number `tree` of a valid archetype, without axes and radii (completeAxes adds them).
/// An instance record's production is the template's index, its row the instance's.
[[nodiscard]] Expected<Skeleton> drawArchetype(const Archetype& archetype, std::size_t tree = 0,
                                               const Limits& limits = {});

} // namespace espalier
