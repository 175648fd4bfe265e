#include <Espalier/Archetype/Archetype.h>

#include <Espalier/Core/Json.h>
#include <cmath>

namespace espalier {

AnchorTable anchorsOf(const Archetype& archetype)
{
    AnchorTable table;
    table.firstChild.reserve(archetype.instances.size() + 1);
    std::uint32_t total = 0;
    for (const TemplateInstance& instance : archetype.instances)
    {
        table.firstChild.push_back(total);
        total += static_cast<std::uint32_t>(archetype.library.templates[instance.piece].anchors.size());
    }
    table.firstChild.push_back(total);
    table.children.assign(total, kNoInstance);
    for (std::uint32_t i = 0; i < archetype.instances.size(); ++i)
    {
        const TemplateInstance& instance = archetype.instances[i];
        if (instance.parent == kNoInstance)
            table.roots.push_back(i);
        else
            table.children[table.firstChild[instance.parent] + instance.anchor] = i;
    }
    return table;
}

Limits authoringLimits()
{
    Limits limits;
    limits.fileBytes = std::size_t{512} << 20;
    limits.jsonValues = 16u << 20;   // a gigabyte; seven stand for an instance
    limits.grammarParts = 32u << 20; // a gigabyte; thirty stand for a rule
    limits.generations = 64u << 10;
    limits.templates = 64u << 10; // a fitted tree has one for each shape that a branch of it has
    limits.nodes = limits.inferredNodes;
    return limits;
}

Expected<void> validate(const Archetype& archetype, const Limits& limits)
{
    const auto fail = [](std::size_t instance, std::string what, std::string expected) {
        return failure(ErrorKind::BadInput, {}, "instance " + std::to_string(instance) + ": " + std::move(what),
                       std::move(expected));
    };
    if (archetype.instances.empty())
        return failure(ErrorKind::BadInput, {}, "the archetype has no template instance", "at least one tree");
    if (archetype.instances.size() > limits.inferredNodes)
        return failure(ErrorKind::Limit, {},
                       "the archetype has " + std::to_string(archetype.instances.size()) + " instances",
                       "at most " + std::to_string(limits.inferredNodes) + " (the limit inferredNodes)");
    const auto& templates = archetype.library.templates;
    std::vector<std::uint32_t> firstAnchor;
    std::uint32_t anchors = 0;
    for (std::size_t i = 0; i < archetype.instances.size(); ++i)
    {
        const TemplateInstance& instance = archetype.instances[i];
        firstAnchor.push_back(anchors);
        if (instance.piece >= templates.size())
            return fail(i, "it names template number " + std::to_string(instance.piece),
                        "one of the library's " + std::to_string(templates.size()));
        anchors += static_cast<std::uint32_t>(templates[instance.piece].anchors.size());
        const InstanceTransform& t = instance.transform;
        if (!(std::isfinite(t.scaling) && t.scaling > 0 && t.scaling <= limits.coordinate))
            return fail(i, "the scaling is " + (std::isfinite(t.scaling) ? formatNumber(t.scaling) : "not finite"),
                        "a finite number above 0, at most " + formatNumber(limits.coordinate));
        for (const double angle : {t.rotation, t.branchingAngle, t.roll})
            if (!(std::abs(angle) <= limits.angleDegrees))
                return fail(i, "an angle is not finite or too large",
                            "at most " + formatNumber(limits.angleDegrees) + " degrees either way");
        if (instance.parent == kNoInstance)
            continue;
        if (instance.parent >= i)
            return fail(i,
                        "it hangs on instance " + std::to_string(instance.parent) + ", which does not come before it",
                        "parents before their children; a cycle cannot be a tree");
        if (instance.anchor >= templates[archetype.instances[instance.parent].piece].anchors.size())
            return fail(i,
                        "its parent's template " + templates[archetype.instances[instance.parent].piece].name +
                            " has no anchor number " + std::to_string(instance.anchor),
                        "one of the anchors of the parent's template");
    }
    std::vector<bool> taken(anchors, false);
    for (std::size_t i = 0; i < archetype.instances.size(); ++i)
    {
        const TemplateInstance& instance = archetype.instances[i];
        if (instance.parent == kNoInstance)
            continue;
        const std::size_t anchor = firstAnchor[instance.parent] + instance.anchor;
        if (taken[anchor])
            return fail(i, "the anchor it hangs at has a child already", "one child at each anchor");
        taken[anchor] = true;
    }
    return {};
}

} // namespace espalier
