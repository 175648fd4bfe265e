#pragma once

#include <Espalier/Archetype/Archetype.h>
#include <span>

namespace espalier {

/// Several archetypes as one with all their trees, over one library of the templates that they use. Templates of equal
/// word are one; a name that another word has already gets a number. Requires valid archetypes.
[[nodiscard]] Archetype mergeArchetypes(std::span<const Archetype> archetypes);

} // namespace espalier
