#include <Espalier/Overlap/Overlap.h>

#include <Espalier/Overlap/BroadPhase.h>
#include <Espalier/Plant/Skeleton.h>
#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <new>
#include <tuple>

namespace espalier {

namespace {

constexpr std::uint32_t kMaxSegments = 1u << 28;
constexpr float kMeasureLimit = 1e15f; // metres; Embree silently drops boxes beyond 1.84e18
constexpr float kMaxNeighbourhood = 100;
constexpr std::uint32_t kMaxOverlaps = 1u << 28;

/// A tapered capsule: the spheres of radius r + x * taper round start + x * direction, for x in [0, length].
struct Capsule
{
    DVec3 start;
    DVec3 direction; ///< Unit; zero if the length is.
    double length = 0;
    double startRadius = 0;
    double endRadius = 0;
    double taper = 0; ///< Radius gained per metre.

    [[nodiscard]] double radiusAt(double x) const { return startRadius + x * taper; }
    [[nodiscard]] DVec3 pointAt(double x) const { return start + x * direction; }
};

Capsule capsuleOf(const Skeleton& skeleton, std::uint32_t segment)
{
    const DVec3 start(skeleton.starts[segment]);
    const DVec3 axis = DVec3(skeleton.ends[segment]) - start;
    Capsule capsule;
    capsule.start = start;
    capsule.length = glm::length(axis);
    capsule.startRadius = static_cast<double>(skeleton.startRadii[segment]);
    capsule.endRadius = static_cast<double>(skeleton.endRadii[segment]);
    capsule.direction = capsule.length > 0 ? axis / capsule.length : DVec3(0);
    capsule.taper = capsule.length > 0 ? (capsule.endRadius - capsule.startRadius) / capsule.length : 0.0;
    if (capsule.length == 0)
        capsule.startRadius = std::max(capsule.startRadius, capsule.endRadius);
    return capsule;
}

double depthAt(const Capsule& a, double x, const Capsule& b, double y)
{
    return a.radiusAt(x) + b.radiusAt(y) - glm::length(a.pointAt(x) - b.pointAt(y));
}

/// Where on `capsule` the sphere lies that comes deepest into a ball round `centre`: the axis seen from there, moved
/// towards the thick end by the slope of the cone.
double deepestPoint(DVec3 centre, const Capsule& capsule)
{
    if (std::abs(capsule.taper) >= 1) // one end's sphere holds all others
        return capsule.taper > 0 ? capsule.length : 0.0;
    const DVec3 toCentre = centre - capsule.start;
    const double foot = glm::dot(toCentre, capsule.direction);
    const double distance = glm::length(toCentre - foot * capsule.direction);
    const double shift = distance * capsule.taper / std::sqrt(1 - capsule.taper * capsule.taper);
    return std::clamp(foot + shift, 0.0, capsule.length);
}

/// The largest depthAt over both axes. It is concave in (x, y), being linear minus the length of a linear function, so
/// it is largest where its gradient is zero, if that lies within both axes, and else at an end of one of them.
double capsuleDepth(const Capsule& a, const Capsule& b)
{
    double deepest = -std::numeric_limits<double>::infinity();
    for (const double x : {0.0, a.length})
        deepest = std::max(deepest, depthAt(a, x, b, deepestPoint(a.pointAt(x), b)));
    for (const double y : {0.0, b.length})
        deepest = std::max(deepest, depthAt(a, deepestPoint(b.pointAt(y), a), b, y));

    // There the unit vector n from b's point to a's has n . u = a.taper and n . v = -b.taper. Its part in the plane of
    // u and v follows from these; what is left of its length belongs to the common perpendicular, so it also
    // says how long the whole connection is.
    const DVec3 u = a.direction;
    const DVec3 v = b.direction;
    const double cosine = glm::dot(u, v);
    const double determinant = 1 - cosine * cosine;
    constexpr double kParallel = 1e-14; // axes that spread by less than 1e-7 of their length: an end is as good
    if (determinant < kParallel || a.length == 0 || b.length == 0)
        return deepest;
    const double alongU = (a.taper + cosine * b.taper) / determinant; // n's part in the plane is alongU u + alongV v
    const double alongV = (-b.taper - cosine * a.taper) / determinant;
    const double inPlane = a.taper * alongU - b.taper * alongV; // squared length
    if (inPlane >= 1)
        return deepest;
    const DVec3 between = a.start - b.start;
    const double betweenU = glm::dot(between, u);
    const double betweenV = glm::dot(between, v);
    // between = p u + q v + perpendicular
    const double p = (betweenU - cosine * betweenV) / determinant;
    const double q = (betweenV - cosine * betweenU) / determinant;
    const double connection = glm::length(between - p * u - q * v) / std::sqrt(1 - inPlane);
    const double x = std::clamp(connection * alongU - p, 0.0, a.length);
    const double y = std::clamp(q - connection * alongV, 0.0, b.length);
    return std::max(deepest, depthAt(a, x, b, y));
}

/// A box that holds the capsule in spite of all rounding, here and in capsuleDepth.
Box boxOf(const Skeleton& skeleton, std::uint32_t segment)
{
    constexpr double kSlack = 1e-12; // of the largest number involved; double arithmetic is a thousand times better
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    const double startRadius = static_cast<double>(skeleton.startRadii[segment]);
    const double endRadius = static_cast<double>(skeleton.endRadii[segment]);
    Box box;
    for (int axis = 0; axis < 3; ++axis)
    {
        const double start = static_cast<double>(skeleton.starts[segment][axis]);
        const double end = static_cast<double>(skeleton.ends[segment][axis]);
        const double slack = kSlack * (std::abs(start) + std::abs(end) + startRadius + endRadius);
        const double low = std::min(start - startRadius, end - endRadius) - slack;
        const double high = std::max(start + startRadius, end + endRadius) + slack;
        box.low[axis] = std::nextafter(static_cast<float>(low), -kInfinity);
        box.high[axis] = std::nextafter(static_cast<float>(high), kInfinity);
    }
    return box;
}

/// Lengths of paths along a skeleton in logarithmic time, by heavy paths: from any segment to the base one changes
/// path at most log2 n times, because each change at least doubles what the path carries.
class PathLengths
{
public:
    explicit PathLengths(const Skeleton& skeleton)
        : skeleton_(skeleton), startDistances_(skeleton.size()), heads_(skeleton.size())
    {
        const std::uint32_t size = skeleton.size();
        std::vector<std::uint32_t> carried(size, 1);
        for (std::uint32_t i = size; i-- > 0;)
            if (const std::uint32_t parent = skeleton.parents[i]; parent != kNoSegment)
                carried[parent] += carried[i];
        std::vector<std::uint32_t> heaviestChild(size, kNoSegment);
        for (std::uint32_t i = 0; i < size; ++i)
            if (const std::uint32_t parent = skeleton.parents[i]; parent != kNoSegment)
            {
                std::uint32_t& heaviest = heaviestChild[parent];
                if (heaviest == kNoSegment || carried[i] > carried[heaviest])
                    heaviest = i;
            }
        for (std::uint32_t i = 0; i < size; ++i)
        {
            const std::uint32_t parent = skeleton.parents[i];
            startDistances_[i] = parent == kNoSegment ? 0.0 : endDistance(parent);
            heads_[i] = parent != kNoSegment && heaviestChild[parent] == i ? heads_[parent] : i;
        }
    }

    /// Length of the segments strictly between the two, metres.
    [[nodiscard]] double between(std::uint32_t a, std::uint32_t b) const
    {
        const std::uint32_t fork = commonAncestor(a, b);
        const double forkDistance = fork == kNoSegment ? 0.0 : endDistance(fork);
        const double toA = fork == a ? 0.0 : startDistances_[a] - forkDistance;
        const double toB = fork == b ? 0.0 : startDistances_[b] - forkDistance;
        return toA + toB;
    }

private:
    [[nodiscard]] double endDistance(std::uint32_t segment) const
    {
        return startDistances_[segment] + static_cast<double>(skeleton_.lengths[segment]);
    }

    /// The segment nearest the tips that carries both, which may be one of them; kNoSegment if they only share the
    /// base.
    [[nodiscard]] std::uint32_t commonAncestor(std::uint32_t a, std::uint32_t b) const
    {
        // The path whose head has the higher index cannot hold the ancestor: parents come before children.
        while (heads_[a] != heads_[b])
        {
            std::uint32_t& higher = heads_[a] > heads_[b] ? a : b;
            higher = skeleton_.parents[heads_[higher]];
            if (higher == kNoSegment)
                return kNoSegment;
        }
        return std::min(a, b);
    }

    const Skeleton& skeleton_;
    std::vector<double> startDistances_; ///< From the base to the start, metres.
    std::vector<std::uint32_t> heads_;   ///< The first segment of the heavy path through each.
};

/// Finds out about one pair. Immutable.
class PairTest
{
public:
    PairTest(const Skeleton& skeleton, const OverlapSettings& settings) : settings_(settings), paths_(skeleton)
    {
        capsules_.reserve(skeleton.size());
        for (std::uint32_t i = 0; i < skeleton.size(); ++i)
            capsules_.push_back(capsuleOf(skeleton, i));
    }

    /// Metres of overlap, 0 for neighbours and for pairs within the tolerance. Symmetric to the last bit.
    [[nodiscard]] float operator()(std::uint32_t first, std::uint32_t second) const
    {
        if (second < first)
            std::swap(first, second);
        const Capsule& a = capsules_[first];
        const Capsule& b = capsules_[second];
        const double radius = std::max({a.startRadius, a.endRadius, b.startRadius, b.endRadius});
        if (paths_.between(first, second) <= static_cast<double>(settings_.neighbourhood) * radius)
            return 0;
        const auto depth = static_cast<float>(capsuleDepth(a, b));
        return depth > settings_.tolerance ? depth : 0.0f;
    }

private:
    OverlapSettings settings_;
    PathLengths paths_;
    std::vector<Capsule> capsules_;
};

Expected<void> checkInput(const Skeleton& skeleton, const OverlapSettings& settings)
{
    if (!(settings.tolerance >= 0 && settings.tolerance <= std::numeric_limits<float>::max()))
        return failure(ErrorKind::BadInput, {}, "the overlap tolerance is " + std::to_string(settings.tolerance),
                       "metres, 0 or more");
    if (!(settings.neighbourhood >= 0 && settings.neighbourhood <= kMaxNeighbourhood))
        return failure(ErrorKind::BadInput, {},
                       "the overlap neighbourhood is " + std::to_string(settings.neighbourhood), "0 to 100 radii");
    if (settings.maxOverlaps > kMaxOverlaps)
        return failure(ErrorKind::BadInput, {}, "maxOverlaps is " + std::to_string(settings.maxOverlaps),
                       "at most 2^28");
    if (!isSound(skeleton))
        return failure(ErrorKind::BadInput, {}, "the skeleton is unsound, so its overlaps cannot be told",
                       "finite numbers, radii of 0 or more, and parents before their children");
    if (skeleton.size() > kMaxSegments)
        return failure(ErrorKind::Limit, {}, "the skeleton has " + std::to_string(skeleton.size()) + " segments",
                       "at most 2^28");
    const auto isNear = [](Vec3 v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}) <= kMeasureLimit; };
    for (std::uint32_t i = 0; i < skeleton.size(); ++i)
        if (!isNear(skeleton.starts[i]) || !isNear(skeleton.ends[i]) || skeleton.startRadii[i] > kMeasureLimit ||
            skeleton.endRadii[i] > kMeasureLimit)
            return failure(ErrorKind::BadInput, {}, "segment " + std::to_string(i) + " is out of all measure",
                           "coordinates and radii of at most 1e15 metres");
    return {};
}

tl::unexpected<Error> tooMany(const OverlapSettings& settings)
{
    return failure(ErrorKind::Limit, {},
                   "the skeleton has more than " + std::to_string(settings.maxOverlaps) + " overlaps",
                   "at most maxOverlaps", "let the branches grow shorter or thinner, or spread them wider");
}

tl::unexpected<Error> noMemory()
{
    return failure(ErrorKind::Limit, {}, "the overlap check does not fit into memory");
}

bool comesBefore(const Overlap& a, const Overlap& b)
{
    return std::tie(a.first, a.second) < std::tie(b.first, b.second);
}

OverlapReport reportOf(std::vector<Overlap> overlaps)
{
    OverlapReport report;
    for (const Overlap& overlap : overlaps)
        report.deepest = std::max(report.deepest, overlap.depth);
    report.overlaps = std::move(overlaps);
    return report;
}

Expected<OverlapReport> testCandidates(const Skeleton& skeleton, const OverlapSettings& settings)
{
    const PairTest test(skeleton, settings);
    std::vector<Box> boxes;
    boxes.reserve(skeleton.size());
    for (std::uint32_t i = 0; i < skeleton.size(); ++i)
        boxes.push_back(boxOf(skeleton, i));

    std::vector<Overlap> found;
    std::mutex mutex; // of `found`; taken once a batch, and only for one that holds an overlap
    bool isFull = false;
    const std::size_t room = 2 * std::size_t{settings.maxOverlaps}; // a pair may come in both orders
    const bool isComplete = visitTouchingPairs(boxes, [&](std::span<const BoxPair> pairs) {
        std::vector<Overlap> mine;
        try
        {
            for (const BoxPair pair : pairs)
                if (const float depth = test(pair.first, pair.second); depth > 0)
                    mine.push_back({std::min(pair.first, pair.second), std::max(pair.first, pair.second), depth});
            if (mine.empty())
                return;
            const std::scoped_lock lock(mutex);
            isFull = isFull || found.size() + mine.size() > room;
            if (!isFull)
                found.insert(found.end(), mine.begin(), mine.end());
        }
        catch (const std::bad_alloc&)
        {
            const std::scoped_lock lock(mutex);
            isFull = true;
        }
    });
    if (isFull)
        return tooMany(settings);
    if (!isComplete)
        return noMemory();
    std::sort(found.begin(), found.end(), comesBefore);
    found.erase(std::unique(found.begin(), found.end()), found.end());
    if (found.size() > settings.maxOverlaps)
        return tooMany(settings);
    return reportOf(std::move(found));
}

Expected<OverlapReport> testAllPairs(const Skeleton& skeleton, const OverlapSettings& settings)
{
    const PairTest test(skeleton, settings);
    std::vector<Overlap> found;
    for (std::uint32_t first = 0; first < skeleton.size(); ++first)
        for (std::uint32_t second = first + 1; second < skeleton.size(); ++second)
            if (const float depth = test(first, second); depth > 0)
            {
                if (found.size() == settings.maxOverlaps)
                    return tooMany(settings);
                found.push_back({first, second, depth});
            }
    return reportOf(std::move(found));
}

template <class Search>
Expected<OverlapReport> checkedSearch(const Skeleton& skeleton, const OverlapSettings& settings, const Search& search)
{
    if (auto checked = checkInput(skeleton, settings); !checked)
        return tl::unexpected(checked.error());
    try
    {
        return search(skeleton, settings);
    }
    catch (const std::bad_alloc&)
    {
        return noMemory();
    }
}

} // namespace

Expected<OverlapReport> findOverlaps(const Skeleton& skeleton, const OverlapSettings& settings)
{
    return checkedSearch(skeleton, settings, testCandidates);
}

Expected<OverlapReport> findOverlapsBruteForce(const Skeleton& skeleton, const OverlapSettings& settings)
{
    return checkedSearch(skeleton, settings, testAllPairs);
}

} // namespace espalier
