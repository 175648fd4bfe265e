#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Mesh/PartCursors.h>
#include <Espalier/Mesh/RingFrames.h>
#include <Espalier/Mesh/TubeMesher.h>
#include <Espalier/Plant/Skeleton.h>
#include <Espalier/Species/Appearance.h>
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

// Two passes. The first plans every tube down to its rings and counts vertices, so that limits are kept before memory
// is taken; the second writes by index into arrays of exactly the right size.

namespace espalier {
namespace {

/// Metres. A gap this small between parent and child is the rounding of whoever moved the branch, no turtle's move.
constexpr float kJoinTolerance = 1e-4f;

/// Metres. Joints nearer than this are one: shorter segments have no reliable direction.
constexpr float kSmallestStep = 1e-6f;

/// A branch at most this wide at the joint, in radii of its parent, stays hidden in it.
constexpr float kHiddenWidth = 0.95f;

/// Two rings are one straight cone if they agree this well: cosine of 0.1 degrees, slope, and share of the radius.
constexpr float kStraightCosine = 0.9999985f;
constexpr float kStraightSlope = 0.002f;
constexpr float kStraightRadius = 0.01f;

/// And the way from one to the other must lead where they face (a cosine): at the corners of a staircase all face
/// diagonally.
constexpr float kStraightAhead = 0.9f;

/// Bark is never repeated more often than this many times per tile along thin twigs: finer only shimmers.
constexpr float kFinestBark = 16.f;

/// Where branches leave, an axis keeps this share of what it is about to lose to them: wood narrows above a fork.
constexpr float kForkHold = 0.5f;

/// How deep a collar's foot lies below the parent's surface, in radii of the branch: facets must not bare it.
constexpr float kFootDepth = 0.1f;

constexpr std::uint32_t kMaxCapRings = 4;

struct Plan
{
    const Skeleton& skeleton;
    TubeSettings settings;
    AxisRounding rounding;
    float tile;
    TubeScratch& scratch;
};

TubeSettings clamped(TubeSettings settings)
{
    // Written so that NaN becomes the lower bound.
    const auto clamp = [](float value, float low, float high) { return value > low ? std::min(value, high) : low; };
    settings.colours = std::clamp<std::uint16_t>(settings.colours, 1, kMaxPalette);
    settings.maxSides = std::clamp<std::uint16_t>(settings.maxSides, 3, 256);
    settings.minSides = std::clamp<std::uint16_t>(settings.minSides, 3, settings.maxSides);
    settings.chordError = clamp(settings.chordError, 1e-9f, 1e9f);
    settings.smoothing = clamp(settings.smoothing, 0, 1);
    settings.maxRingAngle = clamp(settings.maxRingAngle, 1e-3f, static_cast<float>(math::kPi));
    settings.collarFlare = clamp(settings.collarFlare, 0, 4);
    settings.collarLength = clamp(settings.collarLength, 0, 20);
    settings.rootFlare = clamp(settings.rootFlare, 0, 4);
    settings.rootFlareLength = clamp(settings.rootFlareLength, 0, 20);
    return settings;
}

bool isWithin(const Skeleton& skeleton, float limit)
{
    const auto inside = [&](const Vec3& v) {
        return std::abs(v.x) <= limit && std::abs(v.y) <= limit && std::abs(v.z) <= limit;
    };
    for (std::uint32_t i = 0; i < skeleton.size(); ++i)
    {
        if (!inside(skeleton.starts[i]) || !inside(skeleton.ends[i]) || skeleton.startRadii[i] > limit ||
            skeleton.endRadii[i] > limit)
            return false;
    }
    return true;
}

Vec3 directionOf(const Skeleton& skeleton, std::uint32_t segment)
{
    const Vec3 heading = directionOr(skeleton.headings[segment], Vec3(0, 1, 0));
    const Vec3 span = skeleton.ends[segment] - skeleton.starts[segment];
    return glm::dot(span, span) > kSmallestStep * kSmallestStep ? directionOr(span, heading) : heading;
}

/// True if the segment starts where its parent ends, so that one can grow out of the other.
bool isJoined(const Skeleton& skeleton, std::uint32_t segment)
{
    const std::uint32_t parent = skeleton.parents[segment];
    if (parent == kNoSegment)
        return false;
    const Vec3 gap = skeleton.starts[segment] - skeleton.ends[parent];
    return glm::dot(gap, gap) <= kJoinTolerance * kJoinTolerance;
}

bool startsTube(const Skeleton& skeleton, std::uint32_t segment)
{
    return skeleton.startsAxis(segment) || !isJoined(skeleton, segment);
}

void markForks(const Skeleton& skeleton, std::vector<std::uint8_t>& forks)
{
    forks.assign(skeleton.size(), 0);
    for (std::uint32_t i = 0; i < skeleton.size(); ++i)
    {
        if (skeleton.startsAxis(i) && isJoined(skeleton, i))
            forks[skeleton.parents[i]] = 1;
    }
}

/// The radius of the tube where `segment` ends.
float endRadiusOf(const Skeleton& skeleton, const std::vector<std::uint8_t>& forks, std::uint32_t segment)
{
    const float lost = skeleton.startRadii[segment] - skeleton.endRadii[segment];
    return skeleton.endRadii[segment] + (forks[segment] && lost > 0 ? kForkHold * lost : 0.f);
}

/// Collects the joints of the tube that starts at `segment`. False if there is nothing to sweep.
bool gatherJoints(const Skeleton& skeleton, std::uint32_t segment, TubeScratch& scratch)
{
    std::vector<AxisJoint>& joints = scratch.joints;
    joints.clear();
    joints.push_back({.position = skeleton.starts[segment], .radius = skeleton.startRadii[segment], .piece = segment});
    float thickest = joints[0].radius;
    for (std::uint32_t i = segment; i != kNoSegment; i = skeleton.continuations[i])
    {
        if (i != segment && !isJoined(skeleton, i))
            break;
        const Vec3 step = skeleton.ends[i] - joints.back().position;
        const float radius = endRadiusOf(skeleton, scratch.forks, i);
        thickest = std::max(thickest, radius);
        if (glm::dot(step, step) > kSmallestStep * kSmallestStep)
        {
            joints.back().piece = i;
            joints.push_back({.position = skeleton.ends[i], .radius = radius});
        }
        else
            joints.back().radius = radius;
    }
    return joints.size() > 1 && thickest > 0;
}

float meanRadiusOf(const std::vector<CurvePoint>& points)
{
    float area = 0;
    for (std::size_t i = 1; i < points.size(); ++i)
        area += 0.5f * (points[i].radius + points[i - 1].radius) * (points[i].along - points[i - 1].along);
    return area / points.back().along;
}

/// Facets between a chord and its circle: the half angle a of each obeys r (1 - cos a) <= r a^2 / 2 <= chordError.
std::uint32_t sidesFor(float radius, const TubeSettings& settings)
{
    const float sides = std::ceil(static_cast<float>(math::kPi) * std::sqrt(radius / (2 * settings.chordError)));
    return static_cast<std::uint32_t>(
        std::clamp(sides, static_cast<float>(settings.minSides), static_cast<float>(settings.maxSides)));
}

/// How the trunk widens towards the ground: 1 there, fading smoothly to 0.
struct RootFlare
{
    float share = 0;  ///< How much wider at the ground, in radii.
    float length = 0; ///< Metres.

    void widen(CurvePoint& point) const
    {
        if (point.along >= length)
            return;
        const float left = 1 - point.along / length;
        const float factor = 1 + share * left * left * left;
        const float factorSlope = -3 * share * left * left / length;
        point.slope = point.slope * factor + point.radius * factorSlope;
        point.radius *= factor;
    }
};

RootFlare rootFlareOf(const Plan& plan, std::uint32_t segment)
{
    const std::vector<CurvePoint>& points = plan.scratch.points;
    const float radius = points[0].radius;
    const bool standsOnGround =
        plan.skeleton.parents[segment] == kNoSegment && std::abs(points[0].position.y) <= radius;
    const float length = std::min(plan.settings.rootFlareLength * radius, 0.75f * points.back().along);
    return standsOnGround && length > 0 ? RootFlare{plan.settings.rootFlare, length} : RootFlare{};
}

/// Distances along an axis where rings are wanted whatever its curve; ascending.
struct Stations
{
    std::array<float, 8> along{};
    std::size_t count = 0;

    void add(float station, float shortest)
    {
        if (station > (count == 0 ? 0 : along[count - 1]) + shortest)
            along[count++] = station;
    }
};

Stations flareStations(const RootFlare& flare)
{
    Stations stations;
    if (flare.share > 0)
    {
        for (const float share : {0.1f, 0.22f, 0.38f, 0.6f, 1.f})
            stations.add(share * flare.length, 0);
    }
    return stations;
}

/// A place seen from the parent of a branch.
struct ParentView
{
    Vec3 away{0};       ///< Unit, from the parent's axis; 0 on it.
    float distance = 0; ///< From its axis, metres.
    float radius = 0;   ///< The parent's there, metres.
};

ParentView viewFromParent(const TubeCollar& collar, const Vec3& position)
{
    const Vec3 arm = position - collar.joint;
    const bool isAfter = glm::dot(arm, collar.before + collar.after) > 0;
    const Vec3& axis = isAfter ? collar.after : collar.before;
    const float along = glm::dot(arm, axis);
    const Vec3 offset = arm - axis * along;
    const float distance = glm::length(offset);
    const float radius = collar.parentRadius + along * (isAfter ? collar.slopeAfter : collar.slopeBefore);
    return {.away = distance > 1e-5f * collar.parentRadius ? offset / distance : Vec3(0),
            .distance = distance,
            .radius = std::clamp(radius, 0.3f * collar.parentRadius, 3 * collar.parentRadius)};
}

float heightOverParent(const TubeCollar& collar, const Vec3& position)
{
    const ParentView view = viewFromParent(collar, position);
    return view.distance - view.radius;
}

float slopeBetween(const Skeleton& skeleton, std::uint32_t segment, float startRadius, float endRadius)
{
    const float length = glm::length(skeleton.ends[segment] - skeleton.starts[segment]);
    return length > kSmallestStep ? (endRadius - startRadius) / length : 0.f;
}

/// What is known of the collar before the branch's curve is.
TubeCollar collarOf(const Plan& plan, std::uint32_t segment)
{
    const Skeleton& skeleton = plan.skeleton;
    TubeCollar collar;
    if (!isJoined(skeleton, segment))
        return collar;
    const std::vector<std::uint8_t>& forks = plan.scratch.forks;
    const std::uint32_t parent = skeleton.parents[segment];
    const std::uint32_t onward = skeleton.continuations[parent];
    collar.joint = skeleton.starts[segment];
    collar.parentRadius = endRadiusOf(skeleton, forks, parent);
    collar.before = directionOf(skeleton, parent);
    collar.after = collar.before;
    collar.slopeBefore = slopeBetween(skeleton, parent, skeleton.startRadii[parent], collar.parentRadius);
    if (isJoined(skeleton, onward))
    {
        collar.after = directionOf(skeleton, onward);
        collar.slopeAfter = slopeBetween(skeleton, onward, collar.parentRadius, endRadiusOf(skeleton, forks, onward));
    }
    return collar;
}

/// Sizes the collar on the sampled curve and returns where it wants rings: at its foot, just inside the parent, and as
/// the fillet rises.
Stations layCollar(const Plan& plan, TubeCollar& collar)
{
    const std::vector<CurvePoint>& points = plan.scratch.points;
    const float radius = std::min(points[0].radius, kHiddenWidth * collar.parentRadius);
    const float height = plan.settings.collarFlare * radius;
    Stations stations;
    if (height <= 1.5f * plan.settings.chordError)
        return stations;

    float highest = 0;
    for (const CurvePoint& point : points)
        highest = std::max(highest, heightOverParent(collar, point.position));
    collar.length = std::min(plan.settings.collarLength * radius, 0.8f * highest);
    if (collar.length < 0.3f * radius)
        return stations;

    const bool isFine = height > 4 * plan.settings.chordError;
    constexpr std::array<float, 5> kFine{0, 0.07f, 0.22f, 0.48f, 1};
    constexpr std::array<float, 3> kCoarse{0, 0.25f, 1};
    std::size_t k = 0;
    float reached = heightOverParent(collar, points[0].position);
    float next = heightOverParent(collar, points[1].position);
    for (const float level : isFine ? std::span<const float>(kFine) : std::span<const float>(kCoarse))
    {
        const float target = level * collar.length;
        while (next < target && k + 2 < points.size())
        {
            ++k;
            reached = next;
            next = heightOverParent(collar, points[k + 1].position);
        }
        const float share = next > reached ? std::clamp((target - reached) / (next - reached), 0.f, 1.f) : 0.f;
        collar.end = points[k].along + share * (points[k + 1].along - points[k].along);
        stations.add(collar.end, 0.02f * radius);
    }
    if (stations.count < 2)
        return {};

    // Where a branch hardly parts from its parent there is no corner to fill, and no room for a fillet.
    collar.start = stations.along[0];
    const float steepness = std::min(collar.parentRadius / collar.start, collar.length / (collar.end - collar.start));
    collar.height = height * std::clamp((steepness - 0.2f) / 0.3f, 0.f, 1.f);
    if (collar.height <= 0)
        return {};
    return stations;
}

/// A branch thicker than its parent begins hidden in it and swells within a parent's diameter.
void hideStart(const TubeCollar& collar, CurvePoint& point, float startRadius)
{
    const float widest = kHiddenWidth * collar.parentRadius;
    const float length = 2 * collar.parentRadius;
    if (startRadius <= widest || point.along >= length)
        return;
    const float t = point.along / length;
    const float smooth = t * t * (3 - 2 * t);
    const float hidden = widest / startRadius;
    const float factor = hidden + (1 - hidden) * smooth;
    const float factorSlope = (1 - hidden) * 6 * t * (1 - t) / length;
    point.slope = point.slope * factor + point.radius * factorSlope;
    point.radius *= factor;
}

TubeRing ringAt(const CurvePoint& point)
{
    const float scale = 1 / std::sqrt(1 + point.slope * point.slope);
    return {.centre = point.position,
            .radius = point.radius,
            .tangent = point.tangent,
            .along = point.along,
            .slope = point.slope,
            .normal = {scale, -point.slope * scale},
            .segment = point.piece};
}

/// True if the tube between two rings passes through itself on the inside of a bend.
bool foldsBetween(const TubeRing& a, const TubeRing& b)
{
    const Vec3 forward = a.tangent + b.tangent;
    const Vec3 turn = b.tangent - a.tangent;
    const float advance = glm::dot(b.centre - a.centre, forward);
    const float inside = (a.radius + b.radius) * 0.5f * glm::length(turn) * glm::length(forward);
    return advance < 1.1f * inside;
}

bool isStraightBetween(const TubeRing& a, const TubeRing& b)
{
    const Vec3 chord = b.centre - a.centre;
    const float ahead = glm::dot(chord, a.tangent);
    return ahead * ahead >= kStraightAhead * kStraightAhead * glm::dot(chord, chord) &&
           glm::dot(a.tangent, b.tangent) > kStraightCosine && std::abs(a.slope - b.slope) < kStraightSlope &&
           std::abs(a.radius + a.slope * (b.along - a.along) - b.radius) <= kStraightRadius * a.radius;
}

/// The rings of one tube while they are laid; drops those that would fold the tube or that a straight cone does
/// without.
class RingRow
{
public:
    explicit RingRow(std::vector<TubeRing>& rings) : rings_(rings), first_(rings.size()) {}

    void add(const TubeRing& ring)
    {
        if (count() > 0 && foldsBetween(rings_.back(), ring))
            return;
        if (count() > 1 && !rings_.back().pinned)
        {
            const TubeRing& before = rings_[rings_.size() - 2];
            if (isStraightBetween(before, rings_.back()) && isStraightBetween(before, ring))
                rings_.pop_back();
        }
        rings_.push_back(ring);
    }

    /// The end of the axis, which is kept at the cost of what it would fold with.
    void addLast(const TubeRing& ring)
    {
        while (count() > 1 && foldsBetween(rings_.back(), ring))
            rings_.pop_back();
        const bool folds = foldsBetween(rings_.back(), ring);
        if (!folds)
            add(ring);
        else
            rings_.push_back(ring);
    }

    [[nodiscard]] std::uint32_t count() const { return static_cast<std::uint32_t>(rings_.size() - first_); }

private:
    std::vector<TubeRing>& rings_;
    std::size_t first_;
};

/// A dome of one radius' height over the last ring, as round as the chord error asks; its last ring is the apex.
void addCap(const TubeSettings& settings, std::vector<TubeRing>& rings)
{
    const TubeRing end = rings.back();
    if (!(end.radius > 0))
        return;
    const float wanted = 0.25f * static_cast<float>(math::kPi) * std::sqrt(end.radius / (2 * settings.chordError));
    const auto count = static_cast<std::uint32_t>(std::clamp(std::ceil(wanted), 1.f, static_cast<float>(kMaxCapRings)));
    for (std::uint32_t i = 1; i <= count; ++i)
    {
        const math::SinCos angle = math::sinCosDegrees(90.0 * i / count);
        TubeRing ring = end;
        ring.normal = {static_cast<float>(angle.cos), static_cast<float>(angle.sin)};
        ring.centre += end.tangent * (end.radius * ring.normal.y);
        ring.radius *= ring.normal.x;
        ring.along += end.radius * static_cast<float>(0.5 * math::kPi * i / count);
        rings.push_back(ring);
    }
}

void layFrames(const Vec3& firstSide, std::span<TubeRing> rings)
{
    rings[0].side = sideNormalTo(rings[0].tangent, firstSide);
    for (std::size_t i = 1; i < rings.size(); ++i)
    {
        const TubeRing& before = rings[i - 1];
        rings[i].side = transportSide(before.side, before.centre, before.tangent, rings[i].centre, rings[i].tangent);
    }
}

AxisStart startOf(const Plan& plan, std::uint32_t segment, const TubeCollar& collar)
{
    const Skeleton& skeleton = plan.skeleton;
    const std::vector<AxisJoint>& joints = plan.scratch.joints;
    const Vec3 own = directionOr(joints[1].position - joints[0].position, Vec3(0, 1, 0));
    if (collar.parentRadius <= 0)
        return {.tangent = own, .reach = glm::length(joints[1].position - joints[0].position)};

    // As thick as its parent, a branch bends out of it just as the continuation does; thinner, it bends less.
    const std::uint32_t parent = skeleton.parents[segment];
    const float lean = 0.5f * std::min(skeleton.startRadii[segment] / collar.parentRadius, 1.f);
    const Vec3 tangent = directionOr(glm::mix(own, directionOf(skeleton, parent), lean), own);
    return {.tangent = tangent, .reach = glm::length(skeleton.ends[parent] - skeleton.starts[parent])};
}

/// Lowers the first ring of a leaning trunk until no edge of it is above its centre.
void sinkBase(TubeRing& ring)
{
    const float upright = std::max(ring.tangent.y, 0.f);
    const float lean = std::sqrt(std::max(1 - upright * upright, 0.f));
    const float sink = ring.radius * std::min(lean / std::max(upright, 1e-3f), 1.f);
    ring.centre -= ring.tangent * sink;
    ring.along -= sink;
}

void planTube(const Plan& plan, std::uint32_t segment)
{
    TubeScratch& scratch = plan.scratch;
    Tube tube{.firstRing = static_cast<std::uint32_t>(scratch.rings.size()), .collar = collarOf(plan, segment)};
    tube.colour = std::min<std::uint32_t>(plan.skeleton.materials[segment], plan.settings.colours - 1u);
    sampleAxis(startOf(plan, segment, tube.collar), plan.rounding, scratch.joints, scratch.points);

    const float startRadius = scratch.points[0].radius;
    const RootFlare flare = rootFlareOf(plan, segment);
    const bool isBranch = tube.collar.parentRadius > 0;
    const Stations stations = isBranch ? layCollar(plan, tube.collar) : flareStations(flare);
    const auto shaped = [&](CurvePoint point, bool pinned) {
        flare.widen(point);
        if (isBranch)
            hideStart(tube.collar, point, startRadius);
        TubeRing ring = ringAt(point);
        ring.pinned = pinned;
        return ring;
    };

    RingRow row(scratch.rings);
    std::size_t nextStation = 0;
    float thickest = 0;
    if (tube.collar.height <= 0)
        row.add(shaped(scratch.points[0], true));
    for (std::size_t i = 1; i < scratch.points.size(); ++i)
    {
        const CurvePoint& point = scratch.points[i];
        for (; nextStation < stations.count && stations.along[nextStation] < point.along; ++nextStation)
            row.add(shaped(pointBetween(scratch.points[i - 1], point, stations.along[nextStation]), true));
        // A collared branch begins at the collar's foot; what lies before is hidden in the parent.
        const bool isLast = i + 1 == scratch.points.size();
        if (isLast)
            row.addLast(shaped(point, true));
        else if (tube.collar.height <= 0 || point.along > tube.collar.start)
            row.add(shaped(point, false));
        thickest = std::max(thickest, point.radius);
    }
    thickest = std::max(thickest, scratch.rings[tube.firstRing].radius);

    if (flare.share > 0)
        sinkBase(scratch.rings[tube.firstRing]);
    addCap(plan.settings, scratch.rings);
    const std::span<TubeRing> rings = std::span(scratch.rings).subspan(tube.firstRing);
    layFrames(plan.skeleton.lefts[segment], rings);

    const float circumference = 2 * static_cast<float>(math::kPi) * meanRadiusOf(scratch.points);
    tube.ringCount = static_cast<std::uint32_t>(rings.size());
    tube.sides = sidesFor(thickest, plan.settings);
    tube.repeats = std::max(1.f, std::floor(circumference / plan.tile + 0.5f));
    tube.repeatsPerMetre = 1 / std::max(circumference / tube.repeats, plan.tile / kFinestBark);
    tube.baseVertices = tube.collar.height > 0 ? tube.sides + 1 : rings[0].radius > 0 ? tube.sides : 0;
    scratch.tubes.push_back(tube);
}

std::uint64_t vertexCountOf(const Tube& tube)
{
    return std::uint64_t{tube.ringCount} * (tube.sides + 1) + tube.baseVertices;
}

/// Two triangles a side between rings, one towards the apex. A lid is a fan over its rim, a root a fan round its apex.
std::uint64_t indexCountOf(const Tube& tube)
{
    const std::uint32_t base = tube.baseVertices == 0 ? 0 : tube.collar.height > 0 ? tube.sides : tube.sides - 2;
    return 3 * (std::uint64_t{tube.sides} * (2 * tube.ringCount - 3) + base);
}

bool isInCollar(const Tube& tube, const TubeRing& ring)
{
    return tube.collar.height > 0 && ring.along < tube.collar.end;
}

/// Makes sure that the circle of `sides` sides is in the table.
void prepareCircle(std::uint32_t sides, TubeScratch& scratch)
{
    if (scratch.circleStarts[sides] != 0)
        return;
    scratch.circleStarts[sides] = static_cast<std::uint32_t>(scratch.circlePoints.size()) + 1;
    for (std::uint32_t j = 0; j <= sides; ++j)
    {
        const math::SinCos point = math::sinCosDegrees(360.0 * (j % sides) / sides);
        scratch.circlePoints.push_back({static_cast<float>(point.cos), static_cast<float>(point.sin)});
    }
}

/// A point on a ring in the collar's reach.
///
/// The collar is a fillet over the parent's surface. Its rings are lines of equal height over that surface rather than
/// flat: each vertex slides along the branch to the height of its ring's centre, then along the parent's surface away
/// from the branch, by a quarter ellipse's width at that height. It slides furthest in the crotch, where the surfaces
/// face each other (1 - away.outward is large), and stays where they already run together.
Vec3 collarPoint(const TubeCollar& collar, const TubeRing& ring, const Vec3& outward)
{
    const float centreHeight = heightOverParent(collar, ring.centre);
    const float level = std::clamp(centreHeight / collar.length, 0.f, 1.f);
    const float rest = 1 - level;
    const float farthest = std::min(1.5f * ring.radius, 0.7f * ring.along);
    const float footing = -kFootDepth * ring.radius * rest * rest;

    const Vec3 bare = ring.centre + ring.radius * outward;
    const ParentView view = viewFromParent(collar, bare);
    const float bareHeight = view.distance - view.radius;
    const float climb = std::max(glm::dot(view.away, ring.tangent), 0.1f);
    const float slide = std::clamp(rest * (centreHeight + footing - bareHeight) / climb, -farthest, farthest);
    const float wanted = bareHeight + slide * climb;

    const float facing = glm::dot(view.away, outward);
    const float root = std::sqrt(level * (2 - level));
    const float width = collar.height * (1.05f - facing);
    const Vec3 aside = directionOr(outward - view.away * facing, outward);
    const Vec3 spread = bare + slide * ring.tangent + (width * (1 - root)) * aside;

    // Sliding over a round parent lifts off it; come back to the wanted height.
    const ParentView settled = viewFromParent(collar, spread);
    return spread + settled.away * (rest * (settled.radius + wanted - settled.distance));
}

/// The normal of a collar's vertex: the mesh's own, turned into the parent's towards the foot, so that light crosses
/// the joint without an edge.
Vec3 collarNormal(const TubeCollar& collar, const TubeRing& ring, const Vec3& position, const Vec3& own)
{
    const float level = std::clamp(heightOverParent(collar, ring.centre) / collar.length, 0.f, 1.f);
    const float rest = (1 - level) * (1 - level);
    const Vec3 parents = viewFromParent(collar, position).away;
    const float agreement = std::clamp(2 * glm::dot(parents, own) - 0.3f, 0.f, 1.f);
    return directionOr(glm::mix(own, parents, 0.9f * rest * rest * agreement), own);
}

/// What wood of this radius is tinted by: young wood differs from the bark of boughs.
Tint woodTint(const BarkAppearance& bark, float radius)
{
    constexpr float kOld = 3; // times as thick as young wood: nothing of the tint is left
    const float age = std::clamp((radius / std::max(bark.youngRadius, 1e-6f) - 1) / (kOld - 1), 0.f, 1.f);
    return tintOf(glm::mix(bark.youngTint, Vec3(1), age));
}

/// Writes tubes one after the other: vertices as they come, indices each into the run of its colour.
class TubeWriter
{
public:
    TubeWriter(const Plan& plan, const BarkAppearance& bark, TreeMesh& mesh, std::size_t vertex, PartCursors& cursors)
        : scratch_(plan.scratch), streams_(plan.settings.streams), tile_(plan.tile), bark_(bark), mesh_(mesh),
          vertex_(vertex), cursors_(cursors)
    {}

    void write(const Tube& tube)
    {
        index_ = cursors_.next(tube.colour);
        const auto first = static_cast<std::uint32_t>(vertex_);
        const std::span<const Vec2> circle(&scratch_.circlePoints[scratch_.circleStarts[tube.sides] - 1],
                                           tube.sides + 1);
        const std::span<const TubeRing> rings(&scratch_.rings[tube.firstRing], tube.ringCount);
        for (const TubeRing& ring : rings)
        {
            writeRing(tube, ring, circle);
            if (isInCollar(tube, ring))
                placeCollarRing(tube.collar, ring, circle);
        }
        if (tube.collar.height > 0)
            shadeCollar(tube, rings, first);
        writeSides(tube, first);
        if (tube.collar.height > 0)
            writeRoot(tube, rings[0], first);
        else if (tube.baseVertices > 0)
            writeLid(tube, rings[0], first);
        cursors_.advance(tube.colour, index_);
    }

private:
    void writeRing(const Tube& tube, const TubeRing& ring, std::span<const Vec2> circle)
    {
        const Vec3 up = glm::cross(ring.tangent, ring.side);
        const Vec3 lean = ring.tangent * ring.normal.y;
        const float v = ring.along * tube.repeatsPerMetre;
        const float uStep = tube.repeats / static_cast<float>(tube.sides);
        // Plain pointers: through the vectors, every store would make the compiler load their addresses again.
        Vec3* const positions = &mesh_.positions[vertex_];
        Vec3* const normals = &mesh_.normals[vertex_];
        Vec4* const tangents = &mesh_.tangents[vertex_];
        Vec2* const uvs = &mesh_.uvs[vertex_];
        const TubeRing here = ring;
        for (std::size_t j = 0; j < circle.size(); ++j)
        {
            const Vec2 point = circle[j];
            const Vec3 outward = here.side * point.x + up * point.y;
            positions[j] = here.centre + outward * here.radius;
            normals[j] = outward * here.normal.x + lean;
            tangents[j] = Vec4(up * point.x - here.side * point.y, 1);
            uvs[j] = {static_cast<float>(j) * uStep, v};
        }
        writeStreams(ring, circle.size());
        vertex_ += circle.size();
        mesh_.uvs[vertex_ - 1].x = tube.repeats;
    }

    /// The optional arrays of `count` vertices that belong to `ring`, from the next one on.
    void writeStreams(const TubeRing& ring, std::size_t count)
    {
        if (streams_.tints)
            std::fill_n(&mesh_.tints[vertex_], count, woodTint(bark_, ring.radius));
        if (streams_.sources)
            std::fill_n(&mesh_.sources[vertex_], count, VertexSource{.segment = ring.segment});
    }

    void placeCollarRing(const TubeCollar& collar, const TubeRing& ring, std::span<const Vec2> circle)
    {
        const Vec3 up = glm::cross(ring.tangent, ring.side);
        const std::size_t first = vertex_ - circle.size();
        for (std::size_t j = 0; j < circle.size(); ++j)
            mesh_.positions[first + j] = collarPoint(collar, ring, ring.side * circle[j].x + up * circle[j].y);
    }

    /// Normals and tangents of a collar's rings from the vertices around each.
    void shadeCollar(const Tube& tube, std::span<const TubeRing> rings, std::size_t first)
    {
        const std::size_t stride = tube.sides + 1;
        for (std::size_t i = 0; isInCollar(tube, rings[i]); ++i)
        {
            const std::size_t row = first + i * stride;
            const std::size_t below = i == 0 ? row : row - stride;
            for (std::size_t j = 0; j < tube.sides; ++j)
            {
                const std::size_t before = j == 0 ? tube.sides - 1u : j - 1;
                const Vec3 round = mesh_.positions[row + j + 1] - mesh_.positions[row + before];
                const Vec3 along = mesh_.positions[row + stride + j] - mesh_.positions[below + j];
                const Vec3 own = directionOr(glm::cross(round, along), mesh_.normals[row + j]);
                const Vec3 normal = collarNormal(tube.collar, rings[i], mesh_.positions[row + j], own);
                const Vec3 tangent(mesh_.tangents[row + j]);
                mesh_.normals[row + j] = normal;
                mesh_.tangents[row + j] = Vec4(sideNormalTo(normal, glm::dot(tangent, round) > 0 ? round : tangent), 1);
            }
            mesh_.normals[row + tube.sides] = mesh_.normals[row];
            mesh_.tangents[row + tube.sides] = mesh_.tangents[row];
        }
    }

    void writeSides(const Tube& tube, std::uint32_t first)
    {
        const std::uint32_t sides = tube.sides;
        const std::uint32_t stride = sides + 1;
        std::uint32_t* next = &mesh_.indices[index_];
        const auto triangle = [&next](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
            next[0] = a;
            next[1] = b;
            next[2] = c;
            next += 3;
        };
        for (std::uint32_t i = 0; i + 1 < tube.ringCount; ++i)
        {
            const bool toApex = i + 2 == tube.ringCount;
            for (std::uint32_t a = first + i * stride; a < first + i * stride + sides; ++a)
            {
                triangle(a, a + 1, a + stride);
                if (!toApex)
                    triangle(a + 1, a + stride + 1, a + stride);
            }
        }
        index_ = static_cast<std::size_t>(next - mesh_.indices.data());
    }

    /// A flat lid on the first ring.
    void writeLid(const Tube& tube, const TubeRing& ring, std::uint32_t first)
    {
        const auto rim = static_cast<std::uint32_t>(vertex_);
        for (std::uint32_t j = 0; j < tube.sides; ++j)
            writeBaseVertex(ring, mesh_.positions[first + j], -ring.tangent);
        for (std::uint32_t j = 1; j + 1 < tube.sides; ++j)
            writeTriangle(rim, rim + j + 1, rim + j);
    }

    /// A cone from the collar's foot down to the parent's axis: whatever shows of it, there is no hole.
    void writeRoot(const Tube& tube, const TubeRing& ring, std::uint32_t first)
    {
        const auto rim = static_cast<std::uint32_t>(vertex_);
        const Vec3 apex = tube.collar.joint;
        for (std::uint32_t j = 0; j < tube.sides; ++j)
        {
            const Vec3 arm = directionOr(mesh_.positions[first + j] - apex, ring.tangent);
            const Vec3 outward = mesh_.positions[first + j] - ring.centre;
            writeBaseVertex(ring, mesh_.positions[first + j], sideNormalTo(arm, outward));
        }
        writeBaseVertex(ring, apex, -ring.tangent);
        for (std::uint32_t j = 0; j < tube.sides; ++j)
            writeTriangle(rim + tube.sides, rim + (j + 1) % tube.sides, rim + j);
    }

    void writeBaseVertex(const TubeRing& ring, const Vec3& position, const Vec3& normal)
    {
        const Vec3 up = glm::cross(ring.tangent, ring.side);
        const Vec3 arm = position - ring.centre;
        mesh_.positions[vertex_] = position;
        mesh_.normals[vertex_] = normal;
        mesh_.tangents[vertex_] = Vec4(sideNormalTo(normal, ring.side), -1);
        mesh_.uvs[vertex_] = Vec2(glm::dot(arm, ring.side), glm::dot(arm, up)) / tile_;
        writeStreams(ring, 1);
        ++vertex_;
    }

    void writeTriangle(std::uint32_t a, std::uint32_t b, std::uint32_t c)
    {
        mesh_.indices[index_++] = a;
        mesh_.indices[index_++] = b;
        mesh_.indices[index_++] = c;
    }

    const TubeScratch& scratch_;
    MeshStreams streams_;
    float tile_;
    const BarkAppearance& bark_;
    TreeMesh& mesh_;
    std::size_t vertex_;
    std::size_t index_ = 0;
    PartCursors& cursors_;
};

} // namespace

MeshResult meshTubes(const Skeleton& skeleton, const BarkAppearance& bark, const TubeSettings& settings,
                     const Limits& limits, TubeScratch& scratch, TreeMesh& mesh)
{
    if (!isSound(skeleton) || !isWithin(skeleton, static_cast<float>(limits.coordinate)))
        return MeshResult::UnsoundSkeleton;

    const TubeSettings kept = clamped(settings);
    const AxisRounding rounding{.smoothing = kept.smoothing,
                                .cosMaxTurn = static_cast<float>(math::cos(static_cast<double>(kept.maxRingAngle)))};
    const Plan plan{skeleton, kept, rounding, std::clamp(bark.tile, 1e-3f, 100.f), scratch};

    markForks(skeleton, scratch.forks);
    scratch.rings.clear();
    scratch.tubes.clear();
    std::uint64_t vertices = mesh.positions.size();
    std::uint64_t indices = mesh.indices.size();
    PartCursors cursors;
    for (std::uint32_t i = 0; i < skeleton.size(); ++i)
    {
        if (!startsTube(skeleton, i) || !gatherJoints(skeleton, i, scratch))
            continue;
        planTube(plan, i);
        vertices += vertexCountOf(scratch.tubes.back());
        indices += indexCountOf(scratch.tubes.back());
        cursors.count(scratch.tubes.back().colour, indexCountOf(scratch.tubes.back()));
        if (vertices > limits.vertices || indices > std::numeric_limits<std::uint32_t>::max())
            return MeshResult::TooManyVertices;
        prepareCircle(scratch.tubes.back().sides, scratch);
    }
    if (scratch.tubes.empty())
        return MeshResult::EmptySkeleton;

    const std::size_t firstVertex = mesh.positions.size();
    mesh.resizeVertices(vertices, kept.streams);
    cursors.open(MeshMaterial::Bark, mesh);
    TubeWriter writer(plan, bark, mesh, firstVertex, cursors);
    for (const Tube& tube : scratch.tubes)
        writer.write(tube);
    return MeshResult::Ok;
}

} // namespace espalier
