#pragma once

#include <Espalier/Mesh/TubePlan.h>

namespace espalier {

/// Finds a foot for every planned branch on the tube that it grows out of and cuts those tubes into sheets round them:
/// fills scratch.sheets and what the tubes say of it, scratch.branches and scratch.embedded. A branch for which there
/// is no room stays a tube of its own.
void planWelds(const TubePlan& plan);

} // namespace espalier
