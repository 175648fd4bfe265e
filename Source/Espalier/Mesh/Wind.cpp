#include <Espalier/Mesh/Wind.h>

#include <Espalier/Core/Random.h>
#include <Espalier/Mesh/AxisCurve.h>
#include <Espalier/Mesh/Bounds.h>
#include <Espalier/Mesh/RingFrames.h>
#include <Espalier/Plant/Places.h>
#include <algorithm>
#include <cmath>

// After: T. Sousa, "Vegetation Procedural Animation and Shading in Crysis", GPU Gems 3, chapter 16, 2007 (main bending,
// detail bending); R. Zioma, "GPU-Generated Procedural Wind Animations for Trees", ibid., chapter 6 (branches turn
// about their feet, each with a phase of its own).
// Departure: weights follow the skeleton, not the height or a painter, so that a branch's foot moves as its parent
// does.

namespace espalier {
namespace {

/// Where the hashes of places begin.
constexpr Seed kAxisPlaces{0x77696e6461786573u};
constexpr Seed kLeafPlaces{0x77696e646c656166u};

/// Segments that a vertex may lie beyond the one it names: a thinned segment is a run of at most 32 full ones.
constexpr std::uint32_t kLongestRun = 64;

/// A branch this slender, its extent in radii of its foot, bends as far as any; stouter ones bend less in proportion.
constexpr float kSlender = 40;

/// A branch is on its own so many radii over its parent's surface, and in any case so far from its foot.
constexpr float kCollar = 2.5f;
constexpr float kFarthest = 8;

/// Sine of the smallest angle at which an axis is taken to leave its parent's wood.
constexpr float kFlattest = 0.3f;

/// Collars within collars: how often a vertex asks its parent what the place does.
constexpr std::uint32_t kDeepestCollar = 2;

/// Where a run's mean normal is shorter than this it is seen from all sides: a ball, which has no face to beat with.
constexpr float kBall = 0.1f;

/// The angle by which places of a beam that is clamped at 0 and pulled at its tip turn about its foot: its deflection,
/// s^2 (3 - s) / 2, over the distance s. 1 at the tip.
float beamTurn(float share)
{
    return 0.5f * share * (3 - share);
}

float smooth(float t)
{
    t = std::clamp(t, 0.f, 1.f);
    return t * t * (3 - 2 * t);
}

float mixed(float a, float b, float share)
{
    return a + share * (b - a);
}

/// The nearest point of a segment, as a share of it.
float nearestOn(const Skeleton& skeleton, std::uint32_t segment, const Vec3& position)
{
    const Vec3 way = skeleton.ends[segment] - skeleton.starts[segment];
    const float square = glm::dot(way, way);
    return square > 0 ? std::clamp(glm::dot(position - skeleton.starts[segment], way) / square, 0.f, 1.f) : 1.f;
}

/// Signed unit square of the octahedral map of directions (Cigolle et al., "A survey of efficient representations for
/// independent unit vectors", JCGT 3(2), 2014).
std::uint16_t packedFacing(const Vec3& direction)
{
    const float sum = std::abs(direction.x) + std::abs(direction.y) + std::abs(direction.z);
    float u = sum > 0 ? direction.x / sum : 0;
    float v = sum > 0 ? direction.z / sum : 0;
    if (direction.y < 0)
    {
        const float folded = (1 - std::abs(v)) * (u >= 0 ? 1.f : -1.f);
        v = (1 - std::abs(u)) * (v >= 0 ? 1.f : -1.f);
        u = folded;
    }
    const auto bits = [](float x) {
        return static_cast<std::uint32_t>(std::clamp((x * 0.5f + 0.5f) * 63 + 0.5f, 0.f, 63.f));
    };
    return static_cast<std::uint16_t>(bits(u) | bits(v) << 6);
}

class WindReader
{
public:
    WindReader(const Skeleton& skeleton, const TreeMesh& mesh, WindScratch& scratch, WindVertices& wind)
        : skeleton_(skeleton), mesh_(mesh), scratch_(scratch), wind_(wind)
    {}

    void read()
    {
        hashPlaces(skeleton_, scratch_.places);
        findAxes();
        findShapes();
        for (std::uint32_t i = 0; i < wind_.elements.size(); ++i)
            plantFoot(i);
        wind_.vertices.resize(mesh_.positions.size());
        for (std::size_t i = 0; i < mesh_.sources.size();)
        {
            if (mesh_.sources[i].organ != kNoOrgan)
                i = readOrgan(i);
            else
            {
                wind_.vertices[i] = vertexAt(mesh_.sources[i].segment, mesh_.positions[i]);
                ++i;
            }
        }
    }

private:
    using Foot = WindScratch::Foot;

    /// Weights at a place.
    struct Bends
    {
        float trunk = 0;
        float bough = 0;
        float twig = 0;
        float along = 0; ///< Of its axis.
    };

    void findAxes()
    {
        scratch_.axisOf.resize(skeleton_.size());
        scratch_.reachOf.resize(skeleton_.size());
        std::uint32_t trunk = kNoElement; // the thickest axis at the base; the first among equals
        for (std::uint32_t i = 0; i < skeleton_.size(); ++i)
        {
            const std::uint32_t parent = skeleton_.parents[i];
            const bool starts = skeleton_.startsAxis(i);
            if (starts)
            {
                WindElement element{.segment = i, .pivot = skeleton_.starts[i], .radius = skeleton_.startRadii[i]};
                if (parent != kNoSegment)
                    element.parent = scratch_.axisOf[parent];
                element.phase =
                    static_cast<float>(RandomKey(kAxisPlaces).child(scratch_.places[i]).bits(Purpose::Sampling) >> 53) *
                    0x1p-11f;
                scratch_.axisOf[i] = static_cast<std::uint32_t>(wind_.elements.size());
                if (parent == kNoSegment && (trunk == kNoElement || element.radius > wind_.elements[trunk].radius))
                    trunk = scratch_.axisOf[i];
                wind_.elements.push_back(element);
            }
            else
                scratch_.axisOf[i] = scratch_.axisOf[parent];
        }
        for (std::uint32_t i = 0; i < wind_.elements.size(); ++i)
        {
            WindElement& element = wind_.elements[i];
            if (element.parent != kNoElement)
                element.level = static_cast<std::uint16_t>(std::min(wind_.elements[element.parent].level + 1, 0xffff));
            else
                element.level = i == trunk ? 0 : 1;
        }
    }

    /// Places of what the skeleton draws, in the order in which meshShapes numbers it: of the segment that bears it,
    /// and which of those that it bears.
    void findShapes()
    {
        scratch_.shapes.clear();
        if (skeleton_.polygons.empty() && skeleton_.spheres.empty() && skeleton_.organs.empty())
            return;
        scratch_.borne.assign(skeleton_.size(), 0);
        std::uint32_t atBase = 0;
        const auto find = [&](const auto& all) {
            for (const auto& shape : all)
            {
                const bool isAtBase = shape.segment == kNoSegment;
                const RandomKey bearer(Seed{isAtBase ? 0 : scratch_.places[shape.segment]});
                std::uint32_t& number = isAtBase ? atBase : scratch_.borne[shape.segment];
                scratch_.shapes.push_back(bearer.child(number++).value());
            }
        };
        find(skeleton_.polygons);
        find(skeleton_.spheres);
        find(skeleton_.organs);
    }

    /// Of a leaf, fruit or petal. What the foliage has tells its place by its lot, which is spread over 21 bits.
    [[nodiscard]] RandomKey placeOf(const VertexSource& source) const
    {
        if (source.organ < scratch_.shapes.size())
            return RandomKey(kLeafPlaces).child(scratch_.shapes[source.organ]);
        constexpr float kLots = 0x1p24f; // as many as a float tells apart
        return RandomKey(kLeafPlaces).child(static_cast<std::uint32_t>(clampedTo(source.lot, 0, 1) * kLots));
    }

    /// What axis `index` inherits; its ancestors have been planted.
    void plantFoot(std::uint32_t index)
    {
        if (scratch_.feet.size() < wind_.elements.size())
            scratch_.feet.resize(wind_.elements.size());
        WindElement& element = wind_.elements[index];
        Foot& foot = scratch_.feet[index];
        foot = {};
        if (element.parent != kNoElement)
        {
            const std::uint32_t parent = skeleton_.parents[element.segment];
            const Foot& mother = scratch_.feet[element.parent];
            const Place joint{parent, nearestOn(skeleton_, parent, element.pivot)};
            const Bends there = bendsAt(joint, element.pivot, kDeepestCollar);
            foot.trunkBend = there.trunk;
            foot.boughBend = there.bough;
            foot.twigBend = there.twig;
            foot.bough = mother.bough;
            foot.twig = mother.twig;
            element.parentAlong = there.along;
            foot.inside = insideOf(element, parent);
        }
        measure(element, foot.inside);
        if (element.level == 1)
            foot.bough = index;
        if (element.level == 2)
            foot.twig = index;
        if (element.level > 0 && element.radius > 0)
            foot.largest = std::min(1.f, element.extent / (kSlender * element.radius));
    }

    /// How far along the axis leaves its parent's wood: at most half way.
    [[nodiscard]] float insideOf(const WindElement& element, std::uint32_t parent) const
    {
        float extent = 0;
        Vec3 direction = skeleton_.headings[element.segment];
        for (std::uint32_t i = element.segment; i != kNoSegment; i = skeleton_.continuations[i])
        {
            const Vec3 arm = skeleton_.ends[i] - element.pivot;
            if (const float reach = glm::length(arm); reach > extent)
            {
                extent = reach;
                direction = arm / reach;
            }
        }
        const float sine = glm::length(glm::cross(skeleton_.headings[parent], direction));
        return std::min(skeleton_.endRadii[parent] / std::max(sine, kFlattest), 0.5f * extent);
    }

    /// Finds the pivot of an axis, so far along it, and how far its places are from there.
    void measure(WindElement& element, float inside)
    {
        float left = inside;
        std::uint32_t i = element.segment;
        for (; i != kNoSegment; i = skeleton_.continuations[i])
        {
            const Vec3 way = skeleton_.ends[i] - skeleton_.starts[i];
            const float length = glm::length(way);
            if (length > left)
            {
                element.pivot = skeleton_.starts[i] + (left / length) * way;
                break;
            }
            left -= length;
            scratch_.reachOf[i] = -left;
        }
        float farthest = 0;
        for (; i != kNoSegment; i = skeleton_.continuations[i])
        {
            const Vec3 arm = skeleton_.ends[i] - element.pivot;
            if (const float reach = glm::length(arm); reach > farthest)
            {
                farthest = reach;
                element.direction = arm / reach;
            }
            scratch_.reachOf[i] = farthest;
        }
        element.extent = farthest;
    }

    /// A place on an axis.
    struct Place
    {
        std::uint32_t segment = 0;
        float share = 0; ///< Of the segment.
    };

    [[nodiscard]] Bends bendsOn(const Place& place) const
    {
        const std::uint32_t segment = place.segment;
        const std::uint32_t axis = scratch_.axisOf[segment];
        const WindElement& element = wind_.elements[axis];
        const Foot& foot = scratch_.feet[axis];
        const float from = skeleton_.startsAxis(segment) ? -foot.inside : scratch_.reachOf[skeleton_.parents[segment]];
        const float reach = mixed(from, scratch_.reachOf[segment], place.share);
        const float along = std::max(reach, 0.f);
        const float own = along > 0 ? foot.largest * beamTurn(std::min(along / element.extent, 1.f)) : 0;
        Bends bends{foot.trunkBend, foot.boughBend, foot.twigBend, along};
        if (element.level == 0)
            bends.trunk = own;
        else if (element.level == 1)
            bends.bough = own;
        else if (element.level == 2)
            bends.twig = own;
        return bends;
    }

    /// How far `position` has left the collar of the axis: 0 in its parent, 1 where the axis is on its own.
    [[nodiscard]] float freedom(const WindElement& element, const Vec3& position) const
    {
        const std::uint32_t parent = skeleton_.parents[element.segment];
        if (parent == kNoSegment)
            return 1;
        const float radius = std::max({skeleton_.endRadii[parent], skeleton_.startRadii[parent], element.radius});
        const Vec3 arm = position - skeleton_.starts[element.segment];
        const float square = glm::dot(arm, arm);
        if (!(square < kFarthest * kFarthest * radius * radius))
            return 1;
        const float distance = std::sqrt(square);
        const Vec3 axis = directionOr(skeleton_.headings[parent], Vec3(0, 1, 0));
        const float height = glm::length(arm - glm::dot(arm, axis) * axis) - radius;
        const float width = std::min(kCollar * radius, std::max(0.5f * element.extent, element.radius));
        return smooth(std::max(height / width, distance / (0.5f * kFarthest * radius) - 1));
    }

    /// The place nearest to `position` on `segment`, or further along its axis where that lies before or beyond it.
    [[nodiscard]] Place placeFrom(std::uint32_t segment, const Vec3& position) const
    {
        Place place{segment, nearestOn(skeleton_, segment, position)};
        const bool isBeyond = place.share >= 1;
        for (std::uint32_t step = 0; step < kLongestRun; ++step)
        {
            if (isBeyond ? place.share < 1 : place.share > 0)
                break;
            const bool isLast =
                isBeyond ? skeleton_.continuations[place.segment] == kNoSegment : skeleton_.startsAxis(place.segment);
            if (isLast)
                break;
            const std::uint32_t next =
                isBeyond ? skeleton_.continuations[place.segment] : skeleton_.parents[place.segment];
            place = {next, nearestOn(skeleton_, next, position)};
        }
        return place;
    }

    [[nodiscard]] Bends bendsAt(const Place& place, const Vec3& position, std::uint32_t depth) const
    {
        const WindElement& element = wind_.elements[scratch_.axisOf[place.segment]];
        Bends bends = bendsOn(place);
        const float free = freedom(element, position);
        if (free >= 1)
            return bends;
        const Place parent = placeFrom(skeleton_.parents[element.segment], position);
        const Bends there = depth > 0 ? bendsAt(parent, position, depth - 1) : bendsOn(parent);
        const bool isTwig = element.level == 2;
        const bool isBough = element.level == 1;
        bends.trunk = mixed(there.trunk, bends.trunk, free);
        bends.bough = isBough ? free * bends.bough : mixed(there.bough, bends.bough, free);
        bends.twig = isTwig ? free * bends.twig : mixed(there.twig, bends.twig, free);
        bends.along *= free;
        return bends;
    }

    [[nodiscard]] WindVertex vertexAt(std::uint32_t segment, const Vec3& position) const
    {
        WindVertex vertex;
        if (segment == kNoSegment)
            return vertex;
        const Place here = placeFrom(segment, position);
        const Bends bends = bendsAt(here, position, kDeepestCollar);
        vertex.element = scratch_.axisOf[here.segment];
        vertex.level = wind_.elements[vertex.element].level;
        vertex.trunkBend = bends.trunk;
        vertex.along = bends.along;
        const Foot& foot = scratch_.feet[vertex.element];
        if (foot.bough != kNoElement)
        {
            vertex.boughBend = bends.bough;
            vertex.boughPhase = wind_.elements[foot.bough].phase;
            vertex.boughPivot = wind_.elements[foot.bough].pivot;
            vertex.boughFacing = packedFacing(wind_.elements[foot.bough].direction);
        }
        if (foot.twig != kNoElement)
        {
            vertex.twigBend = bends.twig;
            vertex.twigPhase = wind_.elements[foot.twig].phase;
            vertex.twigPivot = wind_.elements[foot.twig].pivot;
            vertex.twigFacing = packedFacing(wind_.elements[foot.twig].direction);
        }
        return vertex;
    }

    /// The vertices of one leaf, fruit or petal, from `first` on. Returns where they end.
    std::size_t readOrgan(std::size_t first)
    {
        const VertexSource source = mesh_.sources[first];
        std::size_t end = first;
        std::size_t foot = first;
        std::size_t tip = first;
        std::size_t left = first;
        std::size_t right = first;
        Vec3 normals(0);
        for (; end < mesh_.sources.size() && mesh_.sources[end] == source; ++end)
        {
            normals += mesh_.normals[end];
            if (mesh_.uvs[end].y < mesh_.uvs[foot].y)
                foot = end;
            if (mesh_.uvs[end].y > mesh_.uvs[tip].y)
                tip = end;
            if (mesh_.uvs[end].x < mesh_.uvs[left].x)
                left = end;
            if (mesh_.uvs[end].x > mesh_.uvs[right].x)
                right = end;
        }
        const float low = mesh_.uvs[foot].y;
        Vec3 footing(0); // the middle of its lower edge
        float lowest = 0;
        for (std::size_t i = first; i < end; ++i)
            if (mesh_.uvs[i].y <= low)
            {
                footing += mesh_.positions[i];
                ++lowest;
            }
        footing /= std::max(lowest, 1.f);
        WindVertex leaf = vertexAt(source.segment, footing);
        leaf.leaf = static_cast<std::uint32_t>(placeOf(source).bits(Purpose::Sampling) >> 56);
        const Vec3 span = mesh_.positions[tip] - footing;
        const float length = glm::length(span);
        const bool isBall = glm::length(normals) < kBall * static_cast<float>(end - first);
        if (!isBall && length > 0)
        {
            // Out of the blade as it lies, since normals may be bent towards the crown's outside.
            const Vec3 width = mesh_.positions[right] - mesh_.positions[left];
            const Vec3 facing = directionOr(glm::cross(width, span), directionOr(normals, Vec3(0, 1, 0)));
            leaf.leaf |= std::uint32_t{packedFacing(facing)} << 8;
        }
        const float range = mesh_.uvs[tip].y - low;
        for (std::size_t i = first; i < end; ++i)
        {
            leaf.edge = isBall || !(range > 0) ? 0 : (mesh_.uvs[i].y - low) / range;
            leaf.flutter = leaf.edge * length;
            wind_.vertices[i] = leaf;
        }
        return end;
    }

    const Skeleton& skeleton_;
    const TreeMesh& mesh_;
    WindScratch& scratch_;
    WindVertices& wind_;
};

bool agree(const Skeleton& full, const TreeMesh& mesh)
{
    const std::size_t count = mesh.positions.size();
    if (mesh.sources.size() != count || mesh.normals.size() != count || mesh.uvs.size() != count || !isSound(full))
        return false;
    return std::ranges::all_of(mesh.sources, [&](const VertexSource& source) {
        return source.segment == kNoSegment || source.segment < full.size();
    });
}

} // namespace

void WindVertices::clear() noexcept
{
    vertices.clear();
    elements.clear();
}

Vec3 windDirection(std::uint32_t packed) noexcept
{
    const float u = static_cast<float>(packed & 63) * (2.f / 63) - 1;
    const float v = static_cast<float>(packed >> 6 & 63) * (2.f / 63) - 1;
    const float y = 1 - std::abs(u) - std::abs(v);
    const float under = std::max(-y, 0.f);
    const Vec3 direction(u - (u >= 0 ? under : -under), y, v - (v >= 0 ? under : -under));
    return direction / std::sqrt(glm::dot(direction, direction));
}

Vec3 leafFacing(std::uint32_t leaf) noexcept
{
    return windDirection(leaf >> 8);
}

bool computeWind(const Skeleton& full, const TreeMesh& mesh, WindScratch& scratch, WindVertices& wind)
{
    wind.clear();
    if (!agree(full, mesh))
        return false;
    WindReader(full, mesh, scratch, wind).read();
    return true;
}

} // namespace espalier
