#pragma once

#include <Espalier/Archetype/Archetype.h>
#include <Espalier/Core/Random.h>
#include <algorithm>
#include <filesystem>

// Archetypes that tests and benchmarks share.
namespace espalier::samples {

/// The worked example of the thesis, as Tests/Golden keeps it.
inline Archetype thesis()
{
    return loadArchetype(std::filesystem::path(ESPALIER_SOURCE_ROOT) / "Tests/Golden/Data/Thesis.archetype").value();
}

/// Two bushes in three dimensions.
inline Archetype bush()
{
    return loadArchetype(std::filesystem::path(ESPALIER_SOURCE_ROOT) / "Tests/Golden/Data/Bush.archetype").value();
}

/// Trees as an archetype's file lists them, over the templates of a text.
inline Archetype read(const std::string& templates, const std::string& trees)
{
    const TemplateLibrary library = parseTemplates(templates, "test.templates", {}).value();
    return parseArchetype(R"({"espalier":"archetype","version":1,"library":"test.templates","trees":[)" + trees + "]}",
                          "test.archetype", library, {})
        .value();
}

inline TemplateLibrary mixedLibrary()
{
    return parseTemplates(
               "fork: F[-FX]+FY\nside: F[&F(0.5)X]F(0.8)Y\nwhorl: F[+FX]/(120)[+(30)FY]/(120)[+FZ]\nshoot: FFX\n"
               "turn: -(10)F+FX\ntwig: F(0.4)[^F(0.2)]\nbud: F(0.2)\nopen: XY\n",
               "mixed.templates", {})
        .value();
}

/// Grown at random over mixedLibrary(): each further instance hangs at a random open anchor of its tree. Transforms
/// repeat, so that some subtrees are equal.
inline Archetype randomArchetype(Seed seed, std::uint32_t instances, std::uint32_t trees = 1)
{
    Archetype archetype{"mixed.templates", mixedLibrary(), {}};
    struct OpenAnchor
    {
        std::uint32_t parent;
        std::uint32_t anchor;
    };
    const RandomKey key(seed);
    constexpr std::uint64_t kBranching = 5; // templates at the front of the library that have anchors and segments
    for (std::uint32_t tree = 0; tree < trees; ++tree)
    {
        std::vector<OpenAnchor> open{{kNoInstance, 0}};
        for (std::uint32_t i = 0; i < instances && !open.empty(); ++i)
        {
            const auto index = static_cast<std::uint32_t>(archetype.instances.size());
            const RandomKey here = key.child(index);
            const std::uint64_t place = here.below(Purpose::Sampling, open.size());
            const OpenAnchor at = open[place];
            open[place] = open.back();
            open.pop_back();
            const std::uint64_t kinds = open.size() < 2 ? kBranching : archetype.library.templates.size();
            TemplateInstance instance;
            instance.piece = static_cast<std::uint32_t>(here.below(Purpose::Sampling, kinds, 1));
            instance.parent = at.parent;
            instance.anchor = at.anchor;
            instance.transform.scaling = 0.5 + 0.25 * static_cast<double>(here.below(Purpose::Sampling, 5, 2));
            instance.transform.rotation = 15 * static_cast<double>(here.below(Purpose::Sampling, 3, 3)) - 15;
            instance.transform.branchingAngle = 30 + 15 * static_cast<double>(here.below(Purpose::Sampling, 2, 4));
            instance.transform.roll = 90 * static_cast<double>(here.below(Purpose::Sampling, 2, 5));
            archetype.instances.push_back(instance);
            for (std::uint32_t a = 0; a < archetype.library.templates[instance.piece].anchors.size(); ++a)
                open.push_back({index, a});
        }
    }
    return archetype;
}

/// How much the instances of a tree repeat.
enum class Repetition
{
    Copied,   ///< Designers' trees: few transforms, side branches copied again and again.
    Distinct, ///< Traced trees: no two transforms are equal, so no two limbs are.
};

/// A tree of just so many instances over mixedLibrary(), grown from the trunk by sharing out how many each branch is to
/// have: of what it carries a leading shoot gets up to two thirds. About 2.5 log2(instances) instances deep.
inline Archetype grownArchetype(Seed seed, std::uint32_t instances, Repetition repetition)
{
    Archetype archetype{"mixed.templates", mixedLibrary(), {}};
    struct Pending
    {
        std::uint32_t parent;
        std::uint32_t anchor;
        std::uint32_t size; ///< Instances of the branch.
        RandomKey key;      ///< Branches of equal key and size are equal, where they are copied.
    };
    // Sizes that a copied branch may have: each about a third larger than the one before.
    const auto copiedSize = [](std::uint32_t size) {
        std::uint32_t step = 1;
        while (step + (step + 2) / 3 <= size)
            step += (step + 2) / 3;
        return step;
    };
    const bool copies = repetition == Repetition::Copied;
    const RandomKey copied = RandomKey(seed).child(1);
    std::vector<Pending> pending{{kNoInstance, 0, instances, RandomKey(seed).child(0)}};
    while (!pending.empty())
    {
        const Pending at = pending.back();
        pending.pop_back();
        const auto below = [&](std::uint64_t count, std::uint32_t draw) {
            return static_cast<std::uint32_t>(at.key.below(Purpose::Sampling, count, draw));
        };
        const auto index = static_cast<std::uint32_t>(archetype.instances.size());
        constexpr std::uint32_t kForks = 3; // at the front of the library, with two or three anchors
        constexpr std::uint32_t kBranching = 5;
        constexpr std::uint32_t kTips = 5; // twig and bud follow
        TemplateInstance instance;
        instance.piece = at.size == 1 ? kTips + below(2, 0) : below(at.size < 4 ? kBranching : kForks, 0);
        instance.parent = at.parent;
        instance.anchor = at.anchor;
        if (copies)
            instance.transform = {0.75 + 0.125 * below(3, 1), 0, 30.0 + 15 * below(2, 2), 90.0 * below(2, 3)};
        else
            instance.transform = {
                at.key.uniform(Purpose::Sampling, 0.6, 1.1, 1), at.key.uniform(Purpose::Sampling, -15, 15, 2),
                at.key.uniform(Purpose::Sampling, 25, 60, 3), at.key.uniform(Purpose::Sampling, -180, 180, 4)};
        archetype.instances.push_back(instance);
        const auto anchors = static_cast<std::uint32_t>(archetype.library.templates[instance.piece].anchors.size());
        std::uint32_t left = at.size - 1;
        for (std::uint32_t a = 0; a < anchors && left > 0; ++a)
        {
            std::uint32_t size = left;
            RandomKey key = at.key.child(a);
            if (a + 1 < anchors)
            {
                size = std::max(1u, static_cast<std::uint32_t>(left * (0.33 + 0.01 * below(34, 5 + a))));
                if (copies)
                {
                    size = copiedSize(size);
                    key = copied.child(size).child(below(4, 8 + a));
                }
            }
            left -= size;
            pending.push_back({index, a, size, key});
        }
    }
    return archetype;
}

/// One shoot upon the other.
inline Archetype chain(std::uint32_t instances)
{
    Archetype archetype{"mixed.templates", mixedLibrary(), {}};
    const auto shoot = static_cast<std::uint32_t>(archetype.library.find("shoot"));
    for (std::uint32_t i = 0; i < instances; ++i)
        archetype.instances.push_back({shoot, i == 0 ? kNoInstance : i - 1, 0, {1, 0, 45, 0}});
    return archetype;
}

} // namespace espalier::samples
