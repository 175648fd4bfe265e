#pragma once

#include <Espalier/Core/Vector.h>
#include <cstdint>
#include <functional>
#include <span>

namespace espalier {

/// An axis-aligned box, edges included. Finite.
struct Box
{
    Vec3 low;
    Vec3 high;
};

/// Two boxes that touch, by index. In no particular order, maybe in both orders: whoever visits sorts.
struct BoxPair
{
    std::uint32_t first = 0;
    std::uint32_t second = 0;
};

/// Gets the pairs in batches, possibly from several threads at once. Must not throw.
using PairVisitor = std::function<void(std::span<const BoxPair>)>;

/// Shows `visit` all pairs of different `boxes` that touch, each at least once. Uses Embree, or in builds without it
/// visitTouchingPairsByTree. False if there was not enough memory: the visits are then incomplete.
[[nodiscard]] bool visitTouchingPairs(std::span<const Box> boxes, const PairVisitor& visit);

/// The same without Embree, on the calling thread, each pair once: a binary tree of boxes, split at the median.
[[nodiscard]] bool visitTouchingPairsByTree(std::span<const Box> boxes, const PairVisitor& visit);

} // namespace espalier
