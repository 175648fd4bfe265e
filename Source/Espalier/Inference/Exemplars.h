#pragma once

#include <Espalier/Archetype/Archetype.h>
#include <Espalier/Archetype/Spatial.h>
#include <Espalier/Species/Species.h>
#include <span>
#include <string>

namespace espalier {

/// Several archetypes as one with all their trees, over one library of the templates that they use. Templates of equal
/// word are one; a name that another word has already gets a number. Requires valid archetypes.
[[nodiscard]] Archetype mergeArchetypes(std::span<const Archetype> archetypes);

/// Identity of what was drawn, as Provenance::archetypes has it: a hash of the texts of archetypes and libraries.
[[nodiscard]] std::string identityOf(std::span<const Archetype> archetypes);

/// For drawing one of them: four segments for each instance that an inference takes at most. A skeleton of so many is
/// two gigabytes.
[[nodiscard]] Limits exemplarLimits();

/// What a species is inferred from: the archetypes as one, with the depth that is asked for (giveDepth); with `mirror`
/// their mirror images follow (mirrorImage), in the same order.
[[nodiscard]] Archetype exemplarsOf(std::span<const Archetype> archetypes, std::span<const Azimuths> spatial,
                                    bool mirror);

/// Likewise, as the species says that it was inferred. Fails where that cannot be read.
[[nodiscard]] Expected<Archetype> exemplarsOf(std::span<const Archetype> archetypes, const Provenance& provenance);

} // namespace espalier
