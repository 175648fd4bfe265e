#include <Espalier/Core/Finite.h>
#include <Espalier/Core/Hash.h>
#include <Espalier/Plant/Skeleton.h>
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace espalier {
namespace {

void hashVector(Hash64& hash, const Vec3& v)
{
    hash.value(v.x);
    hash.value(v.y);
    hash.value(v.z);
}

void hashAll(Hash64& hash, const std::vector<Vec3>& all)
{
    hash.value(std::uint64_t{all.size()});
    for (const Vec3& v : all)
        hashVector(hash, v);
}

template <class T>
void hashAll(Hash64& hash, const std::vector<T>& all)
{
    hash.value(std::uint64_t{all.size()});
    hash.values(std::span<const T>(all));
}

/// Nothing where there are none, so that plants without them keep the hash they always had.
void hashShapes(Hash64& hash, const Skeleton& skeleton)
{
    for (const SkeletonPolygon& polygon : skeleton.polygons)
    {
        for (std::uint32_t i = 0; i < polygon.cornerCount; ++i)
            hashVector(hash, skeleton.corners[polygon.firstCorner + i]);
        hash.value(polygon.cornerCount);
        hash.value(polygon.segment);
        hash.value(polygon.material);
    }
    for (const SkeletonSphere& sphere : skeleton.spheres)
    {
        hashVector(hash, sphere.centre);
        hash.value(sphere.radius);
        hash.value(sphere.segment);
        hash.value(sphere.material);
    }
    for (const SkeletonOrgan& organ : skeleton.organs)
    {
        hashVector(hash, organ.position);
        hashVector(hash, organ.heading);
        hashVector(hash, organ.left);
        hash.value(organ.size);
        hash.value(organ.organ);
        hash.value(organ.segment);
        hash.value(organ.material);
    }
}

bool isMeasure(float metres)
{
    return std::isfinite(metres) && metres >= 0;
}

bool arraysHaveSize(const Skeleton& s, std::size_t size)
{
    return s.starts.size() == size && s.ends.size() == size && s.headings.size() == size && s.lefts.size() == size &&
           s.lengths.size() == size && s.startRadii.size() == size && s.endRadii.size() == size &&
           s.continuations.size() == size && s.orders.size() == size && s.materials.size() == size &&
           s.instances.size() == size;
}

/// Whole arrays at a time, without a way out, so that a compiler looks at several numbers at once: plants are checked
/// at every door.
bool areWithin(std::span<const float> numbers, float least)
{
    std::uint32_t areOutside = 0;
    for (const float number : numbers)
        areOutside |= static_cast<std::uint32_t>(!(number >= least)) |
                      static_cast<std::uint32_t>(!(number <= std::numeric_limits<float>::max()));
    return areOutside == 0;
}

bool areFinite(const std::vector<Vec3>& vectors)
{
    static_assert(sizeof(Vec3) == 3 * sizeof(float));
    return vectors.empty() || areWithin({&vectors[0].x, 3 * vectors.size()}, std::numeric_limits<float>::lowest());
}

bool areMeasures(const std::vector<float>& metres)
{
    return areWithin(metres, 0);
}

bool numbersAreSound(const Skeleton& s)
{
    return areFinite(s.starts) && areFinite(s.ends) && areFinite(s.headings) && areFinite(s.lefts) &&
           areMeasures(s.lengths) && areMeasures(s.startRadii) && areMeasures(s.endRadii);
}

bool indicesAreSound(const Skeleton& s, std::uint32_t i)
{
    const std::uint32_t parent = s.parents[i];
    const std::uint32_t next = s.continuations[i];
    const std::uint32_t instance = s.instances[i];
    return (parent == kNoSegment || parent < i) && (next == kNoSegment || (next < s.size() && s.parents[next] == i)) &&
           (instance == kNoSegment || instance < s.instanceRecords.size());
}

bool shapesAreSound(const Skeleton& s)
{
    const auto isSegment = [&](std::uint32_t segment) { return segment == kNoSegment || segment < s.size(); };
    const auto isCorner = [&](const SkeletonPolygon& p) {
        return p.firstCorner <= s.corners.size() && p.cornerCount <= s.corners.size() - p.firstCorner;
    };
    return std::ranges::all_of(s.corners, isFinite<Vec3>) &&
           std::ranges::all_of(
               s.polygons,
               [&](const SkeletonPolygon& p) { return isCorner(p) && p.cornerCount >= 3 && isSegment(p.segment); }) &&
           std::ranges::all_of(s.spheres,
                               [&](const SkeletonSphere& sphere) {
                                   return isFinite(sphere.centre) && isMeasure(sphere.radius) &&
                                          isSegment(sphere.segment);
                               }) &&
           std::ranges::all_of(s.organs, [&](const SkeletonOrgan& organ) {
               return isFinite(organ.position) && isFinite(organ.heading) && isFinite(organ.left) &&
                      isMeasure(organ.size) && isSegment(organ.segment);
           });
}

} // namespace

void Skeleton::clear() noexcept
{
    starts.clear();
    ends.clear();
    headings.clear();
    lefts.clear();
    lengths.clear();
    startRadii.clear();
    endRadii.clear();
    parents.clear();
    continuations.clear();
    orders.clear();
    materials.clear();
    instances.clear();
    instanceRecords.clear();
    corners.clear();
    polygons.clear();
    spheres.clear();
    organs.clear();
    widthsGiven = false;
    minY = 0;
    maxY = 0;
    maxRadius = 0;
}

std::uint64_t hashOf(const Skeleton& skeleton) noexcept
{
    Hash64 hash;
    hashAll(hash, skeleton.starts);
    hashAll(hash, skeleton.ends);
    hashAll(hash, skeleton.headings);
    hashAll(hash, skeleton.lefts);
    hashAll(hash, skeleton.lengths);
    hashAll(hash, skeleton.startRadii);
    hashAll(hash, skeleton.endRadii);
    hashAll(hash, skeleton.parents);
    hashAll(hash, skeleton.continuations);
    hashAll(hash, skeleton.orders);
    hashAll(hash, skeleton.materials);
    hashAll(hash, skeleton.instances);
    hash.value(std::uint64_t{skeleton.instanceRecords.size()});
    for (const SkeletonInstance& instance : skeleton.instanceRecords)
    {
        hash.value(instance.parent);
        hash.value(instance.production);
        hash.value(instance.row);
    }
    hashShapes(hash, skeleton);
    hash.value(std::uint8_t{skeleton.widthsGiven});
    hash.value(skeleton.minY);
    hash.value(skeleton.maxY);
    hash.value(skeleton.maxRadius);
    return hash.result();
}

bool isSound(const Skeleton& skeleton) noexcept
{
    if (!arraysHaveSize(skeleton, skeleton.parents.size()) || skeleton.parents.size() >= kNoSegment)
        return false;
    if (!numbersAreSound(skeleton))
        return false;
    for (std::uint32_t i = 0; i < skeleton.size(); ++i)
    {
        if (!indicesAreSound(skeleton, i))
            return false;
    }
    for (std::size_t i = 0; i < skeleton.instanceRecords.size(); ++i)
    {
        const std::uint32_t parent = skeleton.instanceRecords[i].parent;
        if (parent != kNoSegment && parent >= i)
            return false;
    }
    if (!shapesAreSound(skeleton))
        return false;
    return std::isfinite(skeleton.minY) && std::isfinite(skeleton.maxY) && isMeasure(skeleton.maxRadius);
}

} // namespace espalier
