#pragma once

#include <Espalier/Core/Error.h>
#include <Espalier/Core/Limits.h>
#include <Espalier/Turtle/Turtle.h>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace espalier {

/// "No anchor": of a module that is a turtle symbol.
inline constexpr std::uint32_t kNoAnchor = 0xffffffffu;

/// One symbol of a template's word.
struct TemplateModule
{
    char symbol = 'F';
    bool hasNumber = false;
    double number = 0;                ///< Metres or degrees, as the symbol's parameter.
    std::uint32_t anchor = kNoAnchor; ///< Index into Template::anchors.

    friend bool operator==(const TemplateModule&, const TemplateModule&) = default;
};

/// An atomic branching piece: a turtle word with anchors, capital letters at which another template may hang.
struct Template
{
    std::string name; ///< A letter, then letters, digits and underscores.
    std::vector<TemplateModule> modules;
    std::string anchors; ///< Their letters, in the order of the word; each stands once.

    friend bool operator==(const Template&, const Template&) = default;
};

/// A set of templates. Names are unique.
struct TemplateLibrary
{
    std::vector<Template> templates;

    /// The index of the template called `name`, or templates.size().
    [[nodiscard]] std::size_t find(std::string_view name) const noexcept;

    friend bool operator==(const TemplateLibrary&, const TemplateLibrary&) = default;
};

/// Whether its word begins with + or -: an instance's rotation is then added to that turn (Placement.h).
[[nodiscard]] bool beginsWithTurn(const Template& piece) noexcept;

/// What the name of a template's mirror image ends with (mirrorImage).
inline constexpr std::string_view kMirrored = "_mirrored";

/// Of each template the first of its kind. `bough_bent1`, `bough_bent2`, ... and `bough_mirrored` are of the kind of
/// `bough`, drawn along other lines, if they have its anchors in its order; every other template is a kind of its own.
/// Templates of a kind are one piece: a tree in which one stands for the other has the same branches, bent otherwise.
[[nodiscard]] std::vector<std::uint32_t> kindsOf(const TemplateLibrary& library);

/// Reads the text of a `.templates` file: one template a line, `name: word` or a bare word, which is then
/// named I, II, III, ... by its place. A word holds turtle symbols, with or without a number in parentheses, and
/// anchors. Errors give line and column.
[[nodiscard]] Expected<TemplateLibrary> parseTemplates(std::string_view text, std::string_view file,
                                                       const Limits& limits);

/// The text form; parseTemplates gives the library back.
[[nodiscard]] std::string printTemplates(const TemplateLibrary& library);

/// The word of a template as text.
[[nodiscard]] std::string printWord(const Template& piece);

[[nodiscard]] Expected<TemplateLibrary> loadTemplates(const std::filesystem::path& path, const Limits& limits);
[[nodiscard]] Expected<void> saveTemplates(const std::filesystem::path& path, const TemplateLibrary& library);

/// I, II, III, IV, ... for 1, 2, 3, 4, ...; [1, 4999].
[[nodiscard]] std::string romanNumeral(std::uint32_t number);

} // namespace espalier
