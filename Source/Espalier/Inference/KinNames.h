#pragma once

#include <Espalier/Archetype/Template.h>
#include <cstdint>
#include <string>
#include <vector>

namespace espalier {

/// What a grammar calls its classes of limbs.
struct KinNames
{
    std::string start;                ///< The symbol that stands for any of several trees.
    std::vector<std::string> classes; ///< All different; more than one character, or no symbol of the turtle's.
};

/// Names after what the classes stand for: the first class of template `bough` is Bough, the next Bough2 and so on, in
/// the order given. `pieces` is the template of each class. A template whose name cannot be a symbol, such as `f`,
/// which draws, gets a letter.
[[nodiscard]] KinNames kinNames(const TemplateLibrary& library, const std::vector<std::uint32_t>& pieces);

/// The symbol for what hangs at an anchor of a class, such as Bough_X. No class is called so.
[[nodiscard]] std::string occupantName(const std::string& className, char anchor);

} // namespace espalier
