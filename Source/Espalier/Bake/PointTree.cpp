#include <Espalier/Bake/PointTree.h>

#include <Espalier/Core/ChildLists.h>
#include <Espalier/Core/Json.h>
#include <Espalier/Plant/Axes.h>
#include <algorithm>
#include <cmath>
#include <limits>

namespace espalier {

namespace {

struct Frame
{
    DVec3 heading{0, 1, 0};
    DVec3 left{-1, 0, 0};
};

/// The frame turned by the smallest rotation that brings its heading to `heading`.
Frame carriedTo(const DVec3& heading, const Frame& from)
{
    // Mirroring twice, first across the plane between the headings (W. Wang et al., Computation of Rotation Minimizing
    // Frames, ACM TOG 27 (2008)), is that rotation. Headings opposite to each other leave left as it is.
    Frame frame{heading, from.left};
    const DVec3 half = from.heading + heading;
    const double square = glm::dot(half, half);
    if (square > 1e-12)
        frame.left = from.left - half * (2 * glm::dot(half, from.left) / square);
    frame.left -= heading * glm::dot(heading, frame.left);
    frame.left /= std::sqrt(glm::dot(frame.left, frame.left));
    return frame;
}

/// Adds segments to a skeleton, point by point.
class SkeletonBuilder
{
public:
    SkeletonBuilder(const PointTree& tree, const ImportSettings& settings, ImportedSkeleton& result)
        : tree_(tree), settings_(settings), result_(result), places_(tree.positions.size())
    {}

    Expected<void> add(std::uint32_t point, std::string_view file, const Limits& limits)
    {
        const DVec3 position = placed(tree_.positions[point]);
        const double radius = radiusOf(point);
        constexpr double kMost = std::numeric_limits<double>::max(); // a difference or a product may be infinite
        for (const double value : {position.x, position.y, position.z, radius})
            if (!(std::abs(value) <= limits.coordinate))
                return failure(ErrorKind::Limit, {std::string(file), 0, 0},
                               (value == radius ? "a radius is " : "a point lies ") +
                                   formatNumber(std::min(std::abs(value), kMost)) + " m " +
                                   (value == radius ? "large" : "away from the root along an axis"),
                               "at most " + formatNumber(limits.coordinate) + " m (the limit coordinate)",
                               "scale the file down, as with --scale 0.001");
        Place& place = places_[point];
        place.position = Vec3(position);
        const std::uint32_t parent = tree_.parents[point];
        if (parent == kNoPoint)
            return {};
        const Place& before = places_[parent];
        place.segment = before.segment;
        place.frame = before.frame;
        if (place.position == before.position)
        {
            ++result_.repeatedPoints;
            return {};
        }
        const DVec3 step = DVec3(place.position) - DVec3(before.position);
        const double length = std::sqrt(glm::dot(step, step));
        place.frame = carriedTo(step / length, before.frame);
        place.segment = segment(before, place, length,
                                static_cast<float>(isBody(parent) && !isBody(point) ? radius : radiusOf(parent)),
                                static_cast<float>(radius));
        return {};
    }

private:
    struct Place
    {
        Vec3 position{0};
        std::uint32_t segment = kNoSegment; ///< That ends there.
        Frame frame;
    };

    DVec3 placed(const DVec3& position) const
    {
        const DVec3 p = (position - result_.origin) * settings_.scale;
        return settings_.up == UpAxis::Y ? p : DVec3(p.x, p.z, -p.y);
    }

    double radiusOf(std::uint32_t point) const
    {
        return tree_.radii.empty() ? 0 : tree_.radii[point] * settings_.scale;
    }
    bool isBody(std::uint32_t point) const { return !tree_.isBody.empty() && tree_.isBody[point]; }

    std::uint32_t segment(const Place& from, const Place& to, double length, float startRadius, float endRadius)
    {
        Skeleton& skeleton = result_.skeleton;
        const std::uint32_t index = skeleton.size();
        skeleton.starts.push_back(from.position);
        skeleton.ends.push_back(to.position);
        skeleton.headings.push_back(Vec3(to.frame.heading));
        skeleton.lefts.push_back(Vec3(to.frame.left));
        skeleton.lengths.push_back(static_cast<float>(length));
        skeleton.startRadii.push_back(startRadius);
        skeleton.endRadii.push_back(endRadius);
        skeleton.parents.push_back(from.segment);
        skeleton.continuations.push_back(kNoSegment);
        skeleton.orders.push_back(0);
        skeleton.materials.push_back(0);
        skeleton.instances.push_back(kNoSegment);
        skeleton.widthsGiven = skeleton.widthsGiven || startRadius > 0 || endRadius > 0;
        for (const Vec3& p : {from.position, to.position})
        {
            skeleton.minY = std::min(skeleton.minY, p.y);
            skeleton.maxY = std::max(skeleton.maxY, p.y);
            skeleton.maxRadius = std::max(skeleton.maxRadius, std::sqrt(p.x * p.x + p.z * p.z));
        }
        return index;
    }

    const PointTree& tree_;
    const ImportSettings& settings_;
    ImportedSkeleton& result_;
    std::vector<Place> places_;
};

} // namespace

std::vector<std::uint32_t> depthFirstOrder(const PointTree& tree)
{
    const ChildLists children = childListsOf(tree.parents);
    std::vector<std::uint32_t> order;
    order.reserve(tree.parents.size());
    std::vector<std::uint32_t> pending; // the first on top
    for (auto i = static_cast<std::uint32_t>(tree.parents.size()); i-- > 0;)
        if (tree.parents[i] == kNoPoint)
            pending.push_back(i);
    while (!pending.empty())
    {
        const std::uint32_t point = pending.back();
        pending.pop_back();
        order.push_back(point);
        const std::span<const std::uint32_t> next = children.of(point);
        pending.insert(pending.end(), next.rbegin(), next.rend());
    }
    return order;
}

std::optional<std::uint32_t> findCycle(const PointTree& tree)
{
    const std::vector<std::uint32_t> order = depthFirstOrder(tree);
    if (order.size() == tree.parents.size())
        return {};
    std::vector<bool> reached(tree.parents.size(), false);
    for (const std::uint32_t point : order)
        reached[point] = true;
    // From what no root reaches the parents lead into a cycle, and after so many steps are in it.
    auto point = static_cast<std::uint32_t>(std::ranges::find(reached, false) - reached.begin());
    for (std::size_t i = 0; i < tree.parents.size(); ++i)
        point = tree.parents[point];
    return point;
}

namespace {

/// The first root that something grows from.
DVec3 originOf(const PointTree& tree, const std::vector<std::uint32_t>& order)
{
    DVec3 root(0);
    for (const std::uint32_t point : order)
    {
        const std::uint32_t parent = tree.parents[point];
        if (parent == kNoPoint)
            root = tree.positions[point];
        else if (tree.positions[point] != tree.positions[parent])
            return root;
    }
    return order.empty() ? DVec3(0) : tree.positions[order[0]];
}

} // namespace

Expected<ImportedSkeleton> skeletonOf(const PointTree& tree, const ImportSettings& settings, std::string_view file,
                                      const Limits& limits)
{
    ImportedSkeleton result;
    result.points = static_cast<std::uint32_t>(tree.positions.size());
    result.roots = static_cast<std::uint32_t>(std::ranges::count(tree.parents, kNoPoint));
    const std::vector<std::uint32_t> order = depthFirstOrder(tree);
    result.origin = originOf(tree, order);
    SkeletonBuilder builder(tree, settings, result);
    for (const std::uint32_t point : order)
        if (auto done = builder.add(point, file, limits); !done)
            return tl::make_unexpected(done.error());

    // The file's radii are kept: completeAxes would let every tip taper.
    Skeleton& skeleton = result.skeleton;
    const std::vector<float> starts = skeleton.startRadii;
    const std::vector<float> ends = skeleton.endRadii;
    completeAxes(skeleton, {});
    skeleton.startRadii = starts;
    skeleton.endRadii = ends;
    return result;
}

} // namespace espalier
