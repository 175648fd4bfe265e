#pragma once

#include <Espalier/Archetype/Archetype.h>
#include <Espalier/Core/Random.h>
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
    Archetype archetype;
    archetype.libraryName = "mixed.templates";
    archetype.library = mixedLibrary();
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

/// One shoot upon the other.
inline Archetype chain(std::uint32_t instances)
{
    Archetype archetype;
    archetype.libraryName = "mixed.templates";
    archetype.library = mixedLibrary();
    const auto shoot = static_cast<std::uint32_t>(archetype.library.find("shoot"));
    for (std::uint32_t i = 0; i < instances; ++i)
        archetype.instances.push_back({shoot, i == 0 ? kNoInstance : i - 1, 0, {1, 0, 45, 0}});
    return archetype;
}

} // namespace espalier::samples
