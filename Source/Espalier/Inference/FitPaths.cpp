#include <Espalier/Inference/FitPaths.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

namespace espalier {

namespace {

double squareOf(const DVec3& v)
{
    return glm::dot(v, v);
}

/// The skeleton as points that hang on each other, parents before children.
struct Nodes
{
    std::vector<DVec3> positions;
    std::vector<std::uint32_t> parents; ///< kNoPath at a base.
    std::vector<double> carried;        ///< Metres that end here or hang here.

    std::uint32_t add(const DVec3& position, std::uint32_t parent)
    {
        positions.push_back(position);
        parents.push_back(parent);
        return static_cast<std::uint32_t>(positions.size() - 1);
    }
};

Nodes nodesOf(const Skeleton& skeleton)
{
    // A float's last bits: where segments meet they may be computed on two ways.
    double reach = 0;
    for (const Vec3& end : skeleton.ends)
        reach = std::max(reach, lengthOf(DVec3(end)));
    const double gap = 1e-6 * reach;

    Nodes nodes;
    std::map<std::array<float, 3>, std::uint32_t> bases;
    std::vector<std::uint32_t> ends(skeleton.size());
    for (std::uint32_t i = 0; i < skeleton.size(); ++i)
    {
        const Vec3& start = skeleton.starts[i];
        const std::uint32_t parent = skeleton.parents[i];
        std::uint32_t from = kNoPath;
        if (parent == kNoSegment)
        {
            // + 0 makes -0 and 0 one place.
            const auto [base, isNew] = bases.try_emplace({start.x + 0.f, start.y + 0.f, start.z + 0.f}, 0);
            if (isNew)
                base->second = nodes.add(DVec3(start), kNoPath);
            from = base->second;
        }
        else
            from = ends[parent];
        if (lengthOf(DVec3(start) - nodes.positions[from]) > gap)
            from = nodes.add(DVec3(start), from);
        const bool hasLength = skeleton.ends[i] != start && DVec3(skeleton.ends[i]) != nodes.positions[from];
        ends[i] = hasLength ? nodes.add(DVec3(skeleton.ends[i]), from) : from;
    }

    nodes.carried.assign(nodes.positions.size(), 0);
    for (std::size_t i = nodes.positions.size(); i-- > 0;)
    {
        const std::uint32_t parent = nodes.parents[i];
        if (parent == kNoPath)
            continue;
        nodes.carried[i] += lengthOf(nodes.positions[i] - nodes.positions[parent]);
        nodes.carried[parent] += nodes.carried[i];
    }
    return nodes;
}

/// Cuts the points into internodes, trees one after the other, depth first.
class PathCutter
{
public:
    explicit PathCutter(const Nodes& nodes) : nodes_(nodes), children_(childListsOf(nodes.parents)) {}

    FitPaths cut()
    {
        for (std::uint32_t node = 0; node < nodes_.positions.size(); ++node)
        {
            if (nodes_.parents[node] != kNoPath || children_.count(node) == 0)
                continue;
            FitTree tree{nodes_.positions[node], 0, 0, static_cast<std::uint32_t>(paths_.points.size()), 0};
            startChildren(node, DVec3(0, 1, 0), tree.firstChild, tree.childCount);
            while (!pending_.empty())
            {
                const Start start = pending_.back();
                pending_.pop_back();
                follow(start);
            }
            tree.pointCount = static_cast<std::uint32_t>(paths_.points.size()) - tree.firstPoint;
            paths_.trees.push_back(tree);
        }
        return std::move(paths_);
    }

private:
    struct Start
    {
        std::uint32_t node;  ///< Its second point.
        std::uint32_t place; ///< In FitPaths::children.
    };

    /// Puts the children into order, and in the list of what is still to follow.
    void startChildren(std::uint32_t node, const DVec3& heading, std::uint32_t& first, std::uint32_t& count)
    {
        const std::span<std::uint32_t> children = children_.of(node);
        first = static_cast<std::uint32_t>(paths_.children.size());
        count = static_cast<std::uint32_t>(children.size());
        order(children, node, heading);
        paths_.children.resize(first + count, kNoPath);
        for (std::uint32_t i = count; i-- > 0;)
            pending_.push_back({children[i], first + i});
    }

    /// By what they carry; among those that carry the same, the one that turns least comes first, then as they are in
    /// the skeleton. "The same" leaves room for the last bits of floats.
    void order(std::span<std::uint32_t> children, std::uint32_t node, const DVec3& heading) const
    {
        constexpr double kSame = 1e-4;
        const auto carried = [&](std::uint32_t child) { return nodes_.carried[child]; };
        std::ranges::stable_sort(children, std::ranges::greater{}, carried);
        for (std::size_t start = 0; start < children.size();)
        {
            std::size_t end = start + 1;
            while (end < children.size() && carried(children[end]) >= carried(children[start]) * (1 - kSame))
                ++end;
            std::sort(children.begin() + static_cast<std::ptrdiff_t>(start),
                      children.begin() + static_cast<std::ptrdiff_t>(end));
            start = end;
        }
        std::size_t straightest = 0;
        double most = -2;
        for (std::size_t i = 0; i < children.size() && carried(children[i]) >= carried(children[0]) * (1 - 2 * kSame);
             ++i)
        {
            const DVec3 step = nodes_.positions[children[i]] - nodes_.positions[node];
            const double cosine = glm::dot(step, heading) / lengthOf(step);
            if (cosine > most + kSame)
            {
                most = cosine;
                straightest = i;
            }
        }
        std::rotate(children.begin(), children.begin() + static_cast<std::ptrdiff_t>(straightest),
                    children.begin() + static_cast<std::ptrdiff_t>(straightest) + 1);
    }

    void follow(const Start& start)
    {
        Internode internode;
        internode.first = static_cast<std::uint32_t>(paths_.points.size());
        internode.carried = nodes_.carried[start.node];
        paths_.points.push_back(nodes_.positions[nodes_.parents[start.node]]);
        std::uint32_t node = start.node;
        while (true)
        {
            const DVec3 step = nodes_.positions[node] - paths_.points.back();
            internode.length += lengthOf(step);
            paths_.points.push_back(nodes_.positions[node]);
            ++paths_.segments;
            if (children_.count(node) != 1)
            {
                startChildren(node, step / lengthOf(step), internode.firstChild, internode.childCount);
                break;
            }
            node = children_.of(node)[0];
        }
        internode.count = static_cast<std::uint32_t>(paths_.points.size()) - internode.first;
        paths_.children[start.place] = static_cast<std::uint32_t>(paths_.internodes.size());
        paths_.internodes.push_back(internode);
    }

    const Nodes& nodes_;
    ChildLists children_;
    std::vector<Start> pending_;
    FitPaths paths_;
};

double squareToSegment(const DVec3& point, const DVec3& from, const DVec3& to)
{
    const DVec3 along = to - from;
    const double square = squareOf(along);
    const double t = square > 0 ? std::clamp(glm::dot(point - from, along) / square, 0.0, 1.0) : 0.0;
    return squareOf(point - from - along * t);
}

} // namespace

double lengthOf(const DVec3& v)
{
    return std::sqrt(squareOf(v));
}

FitPaths pathsOf(const Skeleton& skeleton)
{
    const Nodes nodes = nodesOf(skeleton);
    return PathCutter(nodes).cut();
}

std::vector<std::uint32_t> neededPoints(std::span<const DVec3> line, double tolerance)
{
    constexpr std::uint32_t kRun = 1024;
    const auto last = static_cast<std::uint32_t>(line.size() - 1);
    std::vector<bool> needed(line.size(), tolerance == 0);
    needed[0] = needed[last] = true;
    struct Run
    {
        std::uint32_t first, last;
    };
    std::vector<Run> pending;
    for (std::uint32_t first = 0; tolerance > 0 && first < last; first += kRun)
    {
        needed[first] = true;
        pending.push_back({first, std::min(first + kRun, last)});
    }
    while (!pending.empty())
    {
        const Run run = pending.back();
        pending.pop_back();
        double most = tolerance * tolerance;
        std::uint32_t farthest = run.first;
        for (std::uint32_t i = run.first + 1; i < run.last; ++i)
        {
            const double square = squareToSegment(line[i], line[run.first], line[run.last]);
            if (square > most)
            {
                most = square;
                farthest = i;
            }
        }
        if (farthest == run.first)
            continue;
        needed[farthest] = true;
        pending.push_back({run.first, farthest});
        pending.push_back({farthest, run.last});
    }
    std::vector<std::uint32_t> indices;
    for (std::uint32_t i = 0; i <= last; ++i)
        if (needed[i])
            indices.push_back(i);
    return indices;
}

double distanceTo(const DVec3& point, std::span<const DVec3> line)
{
    double least = squareOf(point - line[0]);
    for (std::size_t i = 1; i < line.size(); ++i)
        least = std::min(least, squareToSegment(point, line[i - 1], line[i]));
    return std::sqrt(least);
}

} // namespace espalier
