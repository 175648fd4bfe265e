#pragma once

#include <Espalier/Archetype/Template.h>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace espalier {

/// "No instance": the parent of a root, the child of an open anchor.
inline constexpr std::uint32_t kNoInstance = 0xffffffffu;

/// How a template is placed. Degrees, as in the files, so that what was drawn is kept to the bit.
struct InstanceTransform
{
    double scaling = 1;  ///< Of the instance's own lengths; children do not inherit it. (0, inf)
    double rotation = 0; ///< Degrees: added to the first turn of a word that starts with + or -, else a turn to the
                         ///< left before the word.
    double branchingAngle = 45; ///< Degrees: of every other + - & ^ that has no number of its own.
    double roll = 0;            ///< Degrees: a roll to the right about the direction of growth, before everything else.

    friend bool operator==(const InstanceTransform&, const InstanceTransform&) = default;
};

/// A template placed in a tree.
struct TemplateInstance
{
    std::uint32_t piece = 0;            ///< Index into the library's templates.
    std::uint32_t parent = kNoInstance; ///< Lower than the own index; kNoInstance starts a tree.
    std::uint32_t anchor = 0;           ///< Of the parent's template.
    InstanceTransform transform;

    friend bool operator==(const TemplateInstance&, const TemplateInstance&) = default;
};

/// What a designer drew: one tree of template instances, or several of one kind. Parents before children.
struct Archetype
{
    std::string libraryName; ///< File name of its template library, as the archetype's file mentions it.
    TemplateLibrary library;
    std::vector<TemplateInstance> instances;

    friend bool operator==(const Archetype&, const Archetype&) = default;
};

/// The child at every anchor of every instance, flat: that at anchor `a` of instance `i` is
/// children[firstChild[i] + a], kNoInstance where the anchor is open.
struct AnchorTable
{
    std::vector<std::uint32_t> firstChild; ///< One more than there are instances.
    std::vector<std::uint32_t> children;
    std::vector<std::uint32_t> roots;
};

/// Requires a valid archetype.
[[nodiscard]] AnchorTable anchorsOf(const Archetype& archetype);

/// Refuses what cannot be: no instance, an unknown template or anchor, two children at one anchor, a parent that does
/// not come before its child (which excludes cycles), a scaling that is not finite and positive, an angle out of range.
[[nodiscard]] Expected<void> validate(const Archetype& archetype, const Limits& limits = {});

/// Limits for tools, where a designer's own archetypes may be as large and deep as those that are fitted to traced
/// plants: an unbranched root alone nests as deep as it has pieces.
[[nodiscard]] Limits authoringLimits();

/// Where template libraries are looked up.
struct ArchetypeFolders
{
    std::vector<std::filesystem::path> templates; ///< Searched in order, after the archetype's own folder.
};

/// Reads the text of an `.archetype` file (Samples/README.md). `library` is the one it names. `libraryName` is filled,
/// trees are read depth first.
[[nodiscard]] Expected<Archetype> parseArchetype(std::string text, std::string_view file,
                                                 const TemplateLibrary& library, const Limits& limits);

/// Reads an archetype and the library it names. A library path that leaves the folders is refused.
[[nodiscard]] Expected<Archetype> loadArchetype(const std::filesystem::path& path, const ArchetypeFolders& folders = {},
                                                const Limits& limits = {});

/// The text form; parseArchetype gives an equal archetype (with instances in depth-first order).
[[nodiscard]] std::string printArchetype(const Archetype& archetype);

/// Writes the archetype atomically; its library is a file of its own (saveTemplates). Refuses what loadArchetype would:
/// an archetype that is not valid or deeper than Limits::generations.
[[nodiscard]] Expected<void> saveArchetype(const std::filesystem::path& path, const Archetype& archetype,
                                           const Limits& limits = {});

} // namespace espalier
