#include <Espalier/Plant/Measure.h>

#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Plant/Skeleton.h>
#include <algorithm>
#include <cmath>
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

std::vector<std::uint32_t> strahlerStreams(const Skeleton& skeleton)
{
    std::vector<Node> nodes(skeleton.size());
    std::vector<std::uint32_t> streams;
    const auto orderOf = [&](std::uint32_t i) { return nodes[i].children == 0 ? 1 : nodes[i].strahler(); };
    for (std::uint32_t i = skeleton.size(); i-- > 0;)
    {
        const std::uint32_t order = orderOf(i);
        if (order > streams.size())
            streams.resize(order);
        // A stream begins, at its upper end, where its order is higher than that of all that flows in.
        if (nodes[i].children == 0 || order > nodes[i].highest)
            ++streams[order - 1];
        if (skeleton.parents[i] != kNoSegment)
            nodes[skeleton.parents[i]].add(order);
    }
    return streams;
}

double bifurcationRatio(std::span<const std::uint32_t> streams)
{
    if (streams.size() < 2)
        return 1;
    const double meanOrder = 0.5 * static_cast<double>(streams.size() - 1);
    double covariance = 0;
    double variance = 0;
    for (std::size_t i = 0; i < streams.size(); ++i)
    {
        const double deviation = static_cast<double>(i) - meanOrder;
        covariance += deviation * math::log(static_cast<double>(streams[i]));
        variance += deviation * deviation;
    }
    return math::exp(-covariance / variance);
}

void appendBranchMeasures(const Skeleton& skeleton, std::uint32_t stride, std::uint32_t offset,
                          BranchMeasures& measures)
{
    constexpr double kDegrees = 180 / math::kPi;
    const double straight = math::cos(0.5 / kDegrees);
    std::uint32_t laterals = 0;
    for (std::uint32_t i = 0; i < skeleton.size(); ++i)
    {
        if (i % stride == offset % stride)
        {
            measures.lengths.push_back(static_cast<double>(skeleton.lengths[i]));
            measures.widths.push_back(2.0 * static_cast<double>(skeleton.startRadii[i]));
        }
        const std::uint32_t parent = skeleton.parents[i];
        if (parent == kNoSegment || !skeleton.startsAxis(i) || laterals++ % stride != offset % stride)
            continue;
        const Vec3 axis = skeleton.headings[parent];
        const Vec3 left = skeleton.lefts[parent];
        const Vec3 heading = skeleton.headings[i];
        const double cosine = std::clamp(static_cast<double>(glm::dot(axis, heading)), -1.0, 1.0);
        measures.angles.push_back(kDegrees * math::acos(cosine));
        if (std::abs(cosine) > straight)
            continue;
        const auto x = static_cast<double>(glm::dot(left, heading));
        const auto y = static_cast<double>(glm::dot(glm::cross(axis, left), heading));
        const double azimuth = kDegrees * math::atan2(y, x);
        measures.azimuths.push_back(azimuth < 0 ? azimuth + 360 : azimuth);
    }
}

void addLengthByHeight(const Skeleton& skeleton, double binHeight, std::span<double> bins)
{
    const double last = static_cast<double>(bins.size() - 1);
    for (std::uint32_t i = 0; i < skeleton.size(); ++i)
    {
        const double middle = 0.5 * static_cast<double>(skeleton.starts[i].y + skeleton.ends[i].y);
        const double bin = std::clamp(std::floor(middle / binHeight), 0.0, last);
        bins[static_cast<std::size_t>(bin)] += static_cast<double>(skeleton.lengths[i]);
    }
}

} // namespace espalier
