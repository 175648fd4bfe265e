#include <Espalier/Mesh/Bounds.h>
#include <Espalier/Mesh/Collision.h>
#include <Espalier/Mesh/RingFrames.h>

#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Species/Appearance.h>
#include <algorithm>
#include <array>
#include <cmath>

namespace espalier {
namespace {

using Run = CollisionScratch::Run;

/// Metres. Shorter and thinner things are no shapes.
constexpr float kSmallest = 1e-6f;

/// Segments of one capsule: time stays linear.
constexpr std::uint32_t kLongestRun = 256;

/// A trunk that has too many triangles is cut twice as much, so many times.
constexpr int kMostCuts = 24;

CollisionResult check(const Skeleton& skeleton)
{
    if (!isSound(skeleton))
        return CollisionResult::UnsoundSkeleton;
    const auto limit = static_cast<float>(Limits{}.coordinate);
    for (std::uint32_t i = 0; i < skeleton.size(); ++i)
        if (!isWithin(skeleton.starts[i], limit) || !isWithin(skeleton.ends[i], limit) ||
            skeleton.startRadii[i] > limit)
            return CollisionResult::UnsoundSkeleton;
    return CollisionResult::Ok;
}

/// Of the cone between two radii.
double volumeOf(const Skeleton& skeleton, std::uint32_t segment)
{
    const auto length = static_cast<double>(glm::length(skeleton.ends[segment] - skeleton.starts[segment]));
    const auto a = static_cast<double>(skeleton.startRadii[segment]);
    const auto b = static_cast<double>(skeleton.endRadii[segment]);
    return math::kPi / 3 * length * (a * a + a * b + b * b);
}

bool isJoined(const Skeleton& skeleton, std::uint32_t segment)
{
    return skeleton.starts[segment] == skeleton.ends[skeleton.parents[segment]];
}

/// The capsule round segments that follow each other, or nothing if its side would stand off too far.
bool fitCapsule(const Skeleton& skeleton, const std::vector<std::uint32_t>& chain, float tolerance, Run& run)
{
    Capsule capsule{skeleton.starts[chain.front()], skeleton.ends[chain.back()], 0};
    const Vec3 way = capsule.to - capsule.from;
    const float square = glm::dot(way, way);
    float thinnest = skeleton.startRadii[chain.front()];
    const auto hold = [&](const Vec3& joint, float radius) {
        const Vec3 arm = joint - capsule.from;
        const float along = square > 0 ? std::clamp(glm::dot(arm, way) / square, 0.f, 1.f) : 0.f;
        const float off = glm::length(arm - along * way);
        capsule.radius = std::max(capsule.radius, off + radius);
        thinnest = std::min(thinnest, radius - off);
    };
    for (const std::uint32_t segment : chain)
    {
        hold(skeleton.starts[segment], skeleton.startRadii[segment]);
        hold(skeleton.ends[segment], skeleton.endRadii[segment]);
    }
    const float gap = capsule.radius - thinnest;
    if (chain.size() > 1 && !(gap <= tolerance))
        return false;
    run.capsule = capsule;
    run.gap = gap;
    return true;
}

/// Cuts a segment that tapers too much for one capsule into pieces that do not.
void addSegment(const Skeleton& skeleton, std::uint32_t segment, float tolerance, std::vector<Run>& runs)
{
    const float taper = std::abs(skeleton.startRadii[segment] - skeleton.endRadii[segment]);
    const auto pieces =
        static_cast<std::uint32_t>(std::clamp(std::ceil(taper / std::max(tolerance, 1e-4f)), 1.f, 64.f));
    const Vec3 from = skeleton.starts[segment];
    const Vec3 way = skeleton.ends[segment] - from;
    const auto radiusAt = [&](float share) {
        return skeleton.startRadii[segment] + share * (skeleton.endRadii[segment] - skeleton.startRadii[segment]);
    };
    for (std::uint32_t i = 0; i < pieces; ++i)
    {
        const float low = static_cast<float>(i) / static_cast<float>(pieces);
        const float high = static_cast<float>(i + 1) / static_cast<float>(pieces);
        const auto a = static_cast<double>(radiusAt(low));
        const auto b = static_cast<double>(radiusAt(high));
        const auto length = static_cast<double>((high - low) * glm::length(way));
        Run run;
        run.capsule = {from + low * way, from + high * way, std::max(radiusAt(low), radiusAt(high))};
        run.gap = std::abs(radiusAt(low) - radiusAt(high));
        run.volume = math::kPi / 3 * length * (a * a + a * b + b * b);
        run.number = static_cast<std::uint32_t>(runs.size());
        runs.push_back(run);
    }
}

/// Capsules along one axis from `first` on.
void addRuns(const Skeleton& skeleton, std::uint32_t first, const CapsuleSettings& settings, CollisionScratch& scratch)
{
    const auto isThick = [&](std::uint32_t i) {
        return skeleton.startRadii[i] >= std::max(settings.thinnest, kSmallest) &&
               glm::length(skeleton.ends[i] - skeleton.starts[i]) > kSmallest;
    };
    for (std::uint32_t i = first; i != kNoSegment;)
    {
        if (!isThick(i))
        {
            i = skeleton.continuations[i];
            continue;
        }
        Run run;
        scratch.chain.assign(1, i);
        bool fits = fitCapsule(skeleton, scratch.chain, settings.tolerance, run) && run.gap <= settings.tolerance;
        if (!fits)
        {
            addSegment(skeleton, i, settings.tolerance, scratch.runs);
            i = skeleton.continuations[i];
            continue;
        }
        run.volume = volumeOf(skeleton, i);
        std::uint32_t next = skeleton.continuations[i];
        while (next != kNoSegment && scratch.chain.size() < kLongestRun && isThick(next) && isJoined(skeleton, next))
        {
            scratch.chain.push_back(next);
            Run longer = run;
            if (!fitCapsule(skeleton, scratch.chain, settings.tolerance, longer))
                break;
            longer.volume += volumeOf(skeleton, next);
            run = longer;
            next = skeleton.continuations[next];
        }
        run.number = static_cast<std::uint32_t>(scratch.runs.size());
        scratch.runs.push_back(run);
        i = next;
    }
}

/// Boughs and all on them, and the trunk from its first bough on.
void gatherCrown(const Skeleton& skeleton, CollisionScratch& scratch)
{
    std::vector<Vec3>& points = scratch.points;
    std::vector<std::uint8_t>& isCrown = scratch.isCrown;
    points.clear();
    const bool hasBoughs = std::ranges::any_of(skeleton.orders, [](std::uint16_t order) { return order > 0; });
    isCrown.assign(skeleton.size(), hasBoughs ? 0 : 1);
    for (std::uint32_t i = 0; i < skeleton.size(); ++i)
    {
        const std::uint32_t parent = skeleton.parents[i];
        if (skeleton.orders[i] > 0)
        {
            isCrown[i] = 1;
            if (parent != kNoSegment && skeleton.orders[parent] == 0)
                for (std::uint32_t j = skeleton.continuations[parent]; j != kNoSegment && !isCrown[j];
                     j = skeleton.continuations[j])
                    isCrown[j] = 1;
        }
    }
    for (std::uint32_t i = 0; i < skeleton.size(); ++i)
        if (isCrown[i])
        {
            points.push_back(skeleton.starts[i]);
            points.push_back(skeleton.ends[i]);
        }
    points.insert(points.end(), skeleton.corners.begin(), skeleton.corners.end());
    for (const SkeletonSphere& sphere : skeleton.spheres)
        points.push_back(sphere.centre);
    for (const SkeletonOrgan& organ : skeleton.organs)
    {
        points.push_back(organ.position);
        points.push_back(organ.position + organ.size * organ.heading);
    }
}

/// Axes by size, parents before children.
void rankAxes(const Skeleton& skeleton, float thinnest, CollisionScratch& scratch)
{
    scratch.axes.clear();
    scratch.axisOf.resize(skeleton.size());
    for (std::uint32_t i = 0; i < skeleton.size(); ++i)
    {
        if (skeleton.startsAxis(i))
        {
            scratch.axisOf[i] = static_cast<std::uint32_t>(scratch.axes.size());
            scratch.axes.push_back({.segment = i});
        }
        else
            scratch.axisOf[i] = scratch.axisOf[skeleton.parents[i]];
        CollisionScratch::Axis& axis = scratch.axes[scratch.axisOf[i]];
        const float reach = glm::length(skeleton.ends[i] - skeleton.starts[axis.segment]);
        axis.size = std::max(axis.size, reach * skeleton.startRadii[axis.segment]);
    }
    scratch.order.clear();
    for (std::uint32_t i = 0; i < scratch.axes.size(); ++i)
    {
        CollisionScratch::Axis& axis = scratch.axes[i];
        const std::uint32_t parent = skeleton.parents[axis.segment];
        if (skeleton.startRadii[axis.segment] < std::max(thinnest, kSmallest))
            axis.size = 0;
        if (parent != kNoSegment)
            axis.size = std::min(axis.size, scratch.axes[scratch.axisOf[parent]].size);
        if (axis.size > 0)
            scratch.order.push_back(i);
    }
    std::sort(scratch.order.begin(), scratch.order.end(), [&](std::uint32_t a, std::uint32_t b) {
        const float sizeA = scratch.axes[a].size;
        const float sizeB = scratch.axes[b].size;
        return sizeA != sizeB ? sizeA > sizeB : a < b; // a child is numbered after its parent
    });
    scratch.rankOf.assign(scratch.axes.size(), kNoSegment);
    for (std::uint32_t i = 0; i < scratch.order.size(); ++i)
        scratch.rankOf[scratch.order[i]] = i;
}

/// Whether the joints between `first` and `last`, which follow each other, lie near enough to the straight cone.
bool isStraight(const Skeleton& skeleton, std::uint32_t first, std::uint32_t last, float tolerance)
{
    const Vec3 way = skeleton.ends[last] - skeleton.starts[first];
    const float square = glm::dot(way, way);
    for (std::uint32_t i = first; i != last; i = skeleton.continuations[i])
    {
        const Vec3 arm = skeleton.ends[i] - skeleton.starts[first];
        const float along = square > 0 ? std::clamp(glm::dot(arm, way) / square, 0.f, 1.f) : 0.f;
        const float radius = glm::mix(skeleton.startRadii[first], skeleton.endRadii[last], along);
        const Vec3 off = arm - along * way;
        if (glm::dot(off, off) > tolerance * tolerance || std::abs(skeleton.endRadii[i] - radius) > tolerance)
            return false;
    }
    return true;
}

/// One straight segment in place of those from `first` to `last`. Returns its number.
std::uint32_t addStraight(const Skeleton& skeleton, std::uint32_t first, std::uint32_t last, std::uint32_t parent,
                          Skeleton& pruned)
{
    const Vec3 way = skeleton.ends[last] - skeleton.starts[first];
    const Vec3 heading = directionOr(way, skeleton.headings[first]);
    const Vec3 left = skeleton.lefts[first] - glm::dot(skeleton.lefts[first], heading) * heading;
    pruned.starts.push_back(skeleton.starts[first]);
    pruned.ends.push_back(skeleton.ends[last]);
    pruned.headings.push_back(heading);
    pruned.lefts.push_back(directionOr(left, skeleton.headings[first]));
    pruned.lengths.push_back(glm::length(way));
    pruned.startRadii.push_back(skeleton.startRadii[first]);
    pruned.endRadii.push_back(skeleton.endRadii[last]);
    pruned.parents.push_back(parent);
    pruned.continuations.push_back(kNoSegment);
    pruned.orders.push_back(skeleton.orders[first]);
    pruned.materials.push_back(0); // one part
    pruned.instances.push_back(kNoSegment);
    return pruned.size() - 1;
}

/// The `count` largest axes alone, each in as few segments as the tolerance allows. A branch may begin beside the joint
/// that it left: within the tolerance, in its parent's wood.
void prune(const Skeleton& skeleton, std::uint32_t count, float tolerance, CollisionScratch& scratch)
{
    Skeleton& pruned = scratch.pruned;
    pruned.clear();
    scratch.prunedOf.assign(skeleton.size(), kNoSegment);
    for (std::uint32_t axis = 0; axis < scratch.axes.size(); ++axis)
    {
        if (scratch.rankOf[axis] >= count)
            continue;
        const std::uint32_t mother = skeleton.parents[scratch.axes[axis].segment];
        std::uint32_t parent = mother == kNoSegment ? kNoSegment : scratch.prunedOf[mother];
        bool continues = false;
        for (std::uint32_t first = scratch.axes[axis].segment; first != kNoSegment;)
        {
            std::uint32_t last = first;
            for (std::uint32_t run = 1; run < kLongestRun; ++run)
            {
                const std::uint32_t next = skeleton.continuations[last];
                if (next == kNoSegment || !isJoined(skeleton, next) || !isStraight(skeleton, first, next, tolerance))
                    break;
                last = next;
            }
            const std::uint32_t own = addStraight(skeleton, first, last, parent, pruned);
            if (continues)
                pruned.continuations[parent] = own;
            for (std::uint32_t i = first;; i = skeleton.continuations[i])
            {
                scratch.prunedOf[i] = own;
                if (i == last)
                    break;
            }
            continues = true;
            parent = own;
            first = skeleton.continuations[last];
        }
    }
    pruned.widthsGiven = true;
}

/// Triangles of the `count` largest axes; the mesh is in scratch.mesh.
std::size_t meshAxes(const Skeleton& skeleton, std::uint32_t count, float tolerance, float cut,
                     CollisionScratch& scratch)
{
    prune(skeleton, count, cut, scratch);
    TubeSettings tubes;
    tubes.minSides = 3;
    tubes.maxSides = 8;
    tubes.chordError = tolerance;
    tubes.smoothing = 0;
    tubes.maxRingAngle = static_cast<float>(math::kPi);
    tubes.collarFlare = 0;
    tubes.rootFlare = 0;
    scratch.mesh.clear();
    const MeshResult result = meshTubes(scratch.pruned, {}, tubes, {}, scratch.tubes, scratch.mesh);
    return result == MeshResult::Ok ? scratch.mesh.indices.size() / 3 : 0;
}

/// Copies the triangles with corners that share a place made one, and without those that this leaves no area.
void share(CollisionScratch& scratch, CollisionMesh& shape)
{
    const TreeMesh& mesh = scratch.mesh;
    std::vector<std::uint32_t>& order = scratch.order;
    std::vector<std::uint32_t>& first = scratch.first;
    std::vector<std::uint32_t>& numberOf = scratch.numberOf;
    const auto before = [&](std::uint32_t a, std::uint32_t b) {
        const Vec3& p = mesh.positions[a];
        const Vec3& q = mesh.positions[b];
        if (p.x != q.x)
            return p.x < q.x;
        if (p.y != q.y)
            return p.y < q.y;
        return p.z != q.z ? p.z < q.z : a < b;
    };
    order.resize(mesh.positions.size());
    for (std::uint32_t i = 0; i < order.size(); ++i)
        order[i] = i;
    std::sort(order.begin(), order.end(), before);
    first.resize(mesh.positions.size());
    for (std::size_t i = 0; i < order.size(); ++i)
        first[order[i]] =
            i > 0 && mesh.positions[order[i]] == mesh.positions[order[i - 1]] ? first[order[i - 1]] : order[i];
    numberOf.assign(mesh.positions.size(), kNoSegment);
    for (std::size_t t = 0; t + 2 < mesh.indices.size(); t += 3)
    {
        std::array<std::uint32_t, 3> corners{};
        for (std::size_t k = 0; k < 3; ++k)
            corners[k] = first[mesh.indices[t + k]];
        if (corners[0] == corners[1] || corners[1] == corners[2] || corners[2] == corners[0])
            continue;
        for (const std::uint32_t corner : corners)
        {
            if (numberOf[corner] == kNoSegment)
            {
                numberOf[corner] = static_cast<std::uint32_t>(shape.vertices.size());
                shape.vertices.push_back(mesh.positions[corner]);
            }
            shape.indices.push_back(numberOf[corner]);
        }
    }
}

} // namespace

void Capsules::clear() noexcept
{
    capsules.clear();
    gap = 0;
    volumeShare = 0;
}

void CollisionMesh::clear() noexcept
{
    vertices.clear();
    indices.clear();
    axes = 0;
}

std::string_view reasonOf(CollisionResult result) noexcept
{
    switch (result)
    {
    case CollisionResult::Ok:
        return {};
    case CollisionResult::EmptySkeleton:
        return "it has no wood thick enough";
    case CollisionResult::UnsoundSkeleton:
        return "a number in it is not finite or too large";
    case CollisionResult::NoVolume:
        return "its crown lies in a plane";
    case CollisionResult::BudgetTooSmall:
        return "its trunk alone has more triangles than allowed";
    }
    return {};
}

CollisionResult woodCapsules(const Skeleton& skeleton, const CapsuleSettings& settings, CollisionScratch& scratch,
                             Capsules& shape)
{
    shape.clear();
    if (const CollisionResult result = check(skeleton); result != CollisionResult::Ok)
        return result;
    const CapsuleSettings kept{.mostCapsules = std::clamp(settings.mostCapsules, 1u, 65536u),
                               .tolerance = clampedTo(settings.tolerance, 0, 100),
                               .thinnest = clampedTo(settings.thinnest, 0, 100)};
    double wood = 0;
    scratch.runs.clear();
    for (std::uint32_t i = 0; i < skeleton.size(); ++i)
    {
        wood += volumeOf(skeleton, i);
        if (skeleton.startsAxis(i))
            addRuns(skeleton, i, kept, scratch);
    }
    if (scratch.runs.empty())
        return CollisionResult::EmptySkeleton;
    std::sort(scratch.runs.begin(), scratch.runs.end(), [](const Run& a, const Run& b) {
        return a.volume != b.volume ? a.volume > b.volume : a.number < b.number;
    });
    scratch.runs.resize(std::min<std::size_t>(scratch.runs.size(), kept.mostCapsules));
    double held = 0;
    for (const Run& run : scratch.runs)
    {
        shape.capsules.push_back(run.capsule);
        shape.gap = std::max(shape.gap, run.gap);
        held += run.volume;
    }
    shape.volumeShare = static_cast<float>(std::min(held / wood, 1.0));
    return CollisionResult::Ok;
}

CollisionResult crownHull(const Skeleton& skeleton, std::uint32_t mostVertices, CollisionScratch& scratch,
                          ConvexHull& hull)
{
    hull.clear();
    if (const CollisionResult result = check(skeleton); result != CollisionResult::Ok)
        return result;
    gatherCrown(skeleton, scratch);
    switch (convexHull(scratch.points, mostVertices, scratch.hull, hull))
    {
    case HullResult::Ok:
        return CollisionResult::Ok;
    case HullResult::NoPoints:
        return CollisionResult::EmptySkeleton;
    case HullResult::NotFinite:
        return CollisionResult::UnsoundSkeleton;
    case HullResult::OnePlace:
    case HullResult::Collinear:
    case HullResult::Coplanar:
        return CollisionResult::NoVolume;
    }
    return CollisionResult::NoVolume;
}

CollisionResult collisionMesh(const Skeleton& skeleton, const CollisionMeshSettings& settings,
                              CollisionScratch& scratch, CollisionMesh& shape)
{
    shape.clear();
    if (const CollisionResult result = check(skeleton); result != CollisionResult::Ok)
        return result;
    const std::size_t most = std::clamp(settings.mostTriangles, 12u, 16u << 20);
    const float thinnest = clampedTo(settings.thinnest, 0, 100);
    const float tolerance = clampedTo(settings.tolerance, 1e-4f, 100);
    rankAxes(skeleton, thinnest, scratch);
    if (scratch.order.empty())
        return CollisionResult::EmptySkeleton;
    std::uint32_t fitting = 0;
    auto tooMany = static_cast<std::uint32_t>(scratch.order.size()) + 1;
    while (tooMany - fitting > 1)
    {
        const std::uint32_t middle = fitting + (tooMany - fitting) / 2;
        (meshAxes(skeleton, middle, tolerance, tolerance, scratch) <= most ? fitting : tooMany) = middle;
    }
    float cut = tolerance;
    std::size_t triangles = meshAxes(skeleton, std::max(fitting, 1u), tolerance, cut, scratch);
    for (int i = 0; i < kMostCuts && triangles > most; ++i)
    {
        cut *= 2;
        triangles = meshAxes(skeleton, 1, tolerance, cut, scratch);
    }
    if (triangles > most)
        return CollisionResult::BudgetTooSmall;
    if (triangles == 0)
        return CollisionResult::EmptySkeleton;
    shape.axes = std::max(fitting, 1u);
    share(scratch, shape);
    return CollisionResult::Ok;
}

} // namespace espalier
