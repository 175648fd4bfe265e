#pragma once

#include <Espalier/Archetype/Template.h>
#include <Espalier/Inference/Limbs.h>
#include <Espalier/Species/Species.h>

namespace espalier {

/// Fills the grammar and the tables of `species` from a choice of classes and weight: one production for each distinct
/// limb, weighted so that where limb k was drawn, limb k grows with chance 1 - w and any of its class, by occurrence,
/// with chance w.
void writeKinGrammar(const TemplateLibrary& library, const LimbTable& limbs, const KinClasses& classes,
                     Species& species);

} // namespace espalier
