#include <Espalier/Archetype/Placement.h>

namespace espalier {

std::vector<PlacedModule> placeTemplate(const Template& piece)
{
    using enum ParameterSource;
    std::vector<PlacedModule> placed;
    placed.reserve(piece.modules.size() + 2);
    placed.push_back({'/', TurtleCommand::RollRight, Roll, 0, kNoAnchor});
    const bool startsWithTurn = beginsWithTurn(piece);
    if (!startsWithTurn)
        placed.push_back({'+', TurtleCommand::TurnLeft, Rotation, 0, kNoAnchor});

    bool organ = false;
    for (std::size_t i = 0; i < piece.modules.size(); ++i)
    {
        const TemplateModule& module = piece.modules[i];
        PlacedModule result{module.symbol, TurtleCommand::Nothing, module.hasNumber ? Number : None, module.number,
                            module.anchor};
        if (module.anchor == kNoAnchor)
            result.command = turtleCommand(std::string_view(&module.symbol, 1));
        const bool first = i == 0 && startsWithTurn;
        if (result.command == TurtleCommand::Draw || result.command == TurtleCommand::Move)
        {
            result.source = organ ? None : Scaled;
            result.number = module.hasNumber ? module.number : 1.0;
        }
        else if (result.command >= TurtleCommand::TurnLeft && result.command <= TurtleCommand::PitchUp && !organ)
        {
            if (module.hasNumber)
                result.source = first ? NumberTurned : Number;
            else
                result.source = first ? BranchingTurned : Branching;
        }
        organ = module.symbol == '~' && !organ; // the symbol after ~ is a name
        placed.push_back(result);
    }
    return placed;
}

double parameterValue(const PlacedModule& module, const InstanceTransform& transform) noexcept
{
    using enum ParameterSource;
    switch (module.source)
    {
    case None:
    case Number:
        return module.number;
    case Scaled:
        return module.number * transform.scaling;
    case Branching:
        return transform.branchingAngle;
    case BranchingTurned:
        return transform.branchingAngle + transform.rotation;
    case NumberTurned:
        return module.number + transform.rotation;
    case Rotation:
        return transform.rotation;
    case Roll:
        return transform.roll;
    }
    return 0;
}

std::vector<std::vector<PlacedModule>> placedTemplates(const Archetype& archetype)
{
    std::vector<std::vector<PlacedModule>> placed(archetype.library.templates.size());
    for (const TemplateInstance& instance : archetype.instances)
        if (placed[instance.piece].empty())
            placed[instance.piece] = placeTemplate(archetype.library.templates[instance.piece]);
    return placed;
}

ArchetypeDrawer::ArchetypeDrawer(const Archetype& archetype)
    : archetype_(archetype), anchors_(anchorsOf(archetype)), placed_(placedTemplates(archetype))
{}

Expected<void> ArchetypeDrawer::draw(std::size_t tree, const Limits& limits, Skeleton& skeleton) const
{
    TurtleScratch scratch;
    Turtle turtle(TurtleSettings{}, limits, scratch, skeleton);
    struct Frame
    {
        std::uint32_t instance;
        std::size_t position;
    };
    std::vector<Frame> frames;
    const auto enter = [&](std::uint32_t instance) {
        turtle.beginInstance(archetype_.instances[instance].piece, instance);
        frames.push_back({instance, 0});
    };
    enter(anchors_.roots[tree]);
    while (!frames.empty())
    {
        Frame& frame = frames.back();
        const TemplateInstance& instance = archetype_.instances[frame.instance];
        const std::vector<PlacedModule>& word = placed_[instance.piece];
        if (frame.position == word.size())
        {
            turtle.endInstance();
            frames.pop_back();
            continue;
        }
        const PlacedModule& module = word[frame.position++];
        if (module.anchor != kNoAnchor)
        {
            const std::uint32_t child = anchors_.children[anchors_.firstChild[frame.instance] + module.anchor];
            if (child != kNoInstance)
                enter(child);
            continue;
        }
        const double value = parameterValue(module, instance.transform);
        const bool hasValue = module.source != ParameterSource::None;
        if (!turtle.apply(module.command, {&value, hasValue ? 1u : 0u}))
            break;
    }
    return turtle.finish();
}

Expected<Skeleton> drawArchetype(const Archetype& archetype, std::size_t tree, const Limits& limits)
{
    const ArchetypeDrawer drawer(archetype);
    if (tree >= drawer.trees())
        return failure(ErrorKind::BadInput, {}, "the archetype has no tree number " + std::to_string(tree + 1),
                       "one of its " + std::to_string(drawer.trees()));
    Skeleton skeleton;
    if (auto done = drawer.draw(tree, limits, skeleton); !done)
        return tl::make_unexpected(done.error());
    return skeleton;
}

} // namespace espalier
