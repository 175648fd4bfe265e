#pragma once

#include <cstdint>
#include <vector>

namespace espalier {

struct Skeleton;

/// Fills `places` with a key for each segment, a hash of the way that leads there from the base, node by node. What is
/// random about a branch follows from the key of its first segment, and so stays as it is whatever else is cut, added
/// or numbered otherwise.
///
/// Which of several ways goes on from a node is told by the direction as its parent sees it, straight on or one of
/// eight sides, so a branch may go, come or bend a little and leave its neighbours' keys as they were. Of those that
/// share a side the last has the side's key, and the others of the node count on backwards: only these depend on any
/// other. Radii, lengths, positions, continuations and numbers do not matter, but for the order among those. A segment
/// put in, or one that parts in two, changes the keys of all that it bears.
///
/// Trees of one shape have the same keys: a seed is no part of them. Linear time; nothing is allocated once `places` is
/// warm. Requires: each parent index is lower than its child's. Equal input gives equal bytes.
void hashPlaces(const Skeleton& skeleton, std::vector<std::uint64_t>& places);

} // namespace espalier
