#include <Espalier/Plant/Measure.h>
#include <Espalier/Plant/Skeleton.h>
#include <algorithm>
#include <vector>

namespace espalier {
namespace {

/// A point of the tree that segments start from: where a segment ends, or the base.
struct Node
{
    std::uint32_t children = 0;
    std::uint32_t highest = 0;  ///< Largest Strahler number among the children.
    bool highestRecurs = false; ///< More than one child has it.

    void add(std::uint32_t strahler)
    {
        ++children;
        highestRecurs = strahler == highest || (strahler < highest && highestRecurs);
        highest = std::max(highest, strahler);
    }
    [[nodiscard]] std::uint32_t strahler() const { return highest + (highestRecurs ? 1 : 0); }
};

} // namespace

SkeletonFacts measure(const Skeleton& skeleton)
{
    SkeletonFacts facts;
    facts.segments = skeleton.size();
    facts.minY = static_cast<double>(skeleton.minY);
    facts.maxY = static_cast<double>(skeleton.maxY);
    facts.maxRadius = static_cast<double>(skeleton.maxRadius);
    facts.instances = static_cast<std::uint32_t>(skeleton.instanceRecords.size());

    std::vector<std::uint32_t> depths(skeleton.size());
    for (std::uint32_t i = 0; i < skeleton.size(); ++i)
    {
        const std::uint32_t parent = skeleton.parents[i];
        depths[i] = parent == kNoSegment ? 1 : depths[parent] + 1;
        facts.maxDepth = std::max(facts.maxDepth, depths[i]);
        facts.totalLength += static_cast<double>(skeleton.lengths[i]);
    }

    Node base;
    std::vector<Node> nodes(skeleton.size());
    for (std::uint32_t i = skeleton.size(); i-- > 0;)
    {
        facts.tips += nodes[i].children == 0 ? 1 : 0;
        facts.forks += nodes[i].children > 1 ? 1 : 0;
        Node& below = skeleton.parents[i] == kNoSegment ? base : nodes[skeleton.parents[i]];
        below.add(nodes[i].children == 0 ? 1 : nodes[i].strahler());
    }
    facts.forks += base.children > 1 ? 1 : 0;
    facts.strahler = base.strahler();
    return facts;
}

} // namespace espalier
