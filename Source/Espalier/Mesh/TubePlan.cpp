#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Core/Random.h>
#include <Espalier/Core/Simd.h>
#include <Espalier/Mesh/Bounds.h>
#include <Espalier/Mesh/RingFrames.h>
#include <Espalier/Mesh/TubeCollar.h>
#include <Espalier/Mesh/TubePlan.h>
#include <Espalier/Plant/Skeleton.h>
#include <Espalier/Species/Appearance.h>
#include <algorithm>
#include <bit>
#include <cmath>
#include <span>

namespace espalier {
namespace {

/// Metres. A gap this small between parent and child is the rounding of whoever moved the branch, no turtle's move.
constexpr float kJoinTolerance = 1e-4f;

/// Metres. Joints nearer than this are one: shorter segments have no reliable direction.
constexpr float kSmallestStep = 1e-6f;

/// A branch at most this wide at the joint, in radii of its parent, stays hidden in it.
constexpr float kHiddenWidth = 0.95f;

/// Rings nearer than this are one, in radii: between them there would be slivers, or nothing.
constexpr float kSameRing = 1e-3f;

/// Two rings are one straight cone if they agree this well: cosine of 0.1 degrees, slope, and share of the radius.
constexpr float kStraightCosine = 0.9999985f;
constexpr float kStraightSlope = 0.002f;
constexpr float kStraightRadius = 0.01f;

/// And the way from one to the other must lead where they face (a cosine): at the corners of a staircase all face
/// diagonally.
constexpr float kStraightAhead = 0.9f;

/// Bark is never repeated more often than this many times per tile along thin twigs: finer only shimmers.
constexpr float kFinestBark = 16.f;

/// How far the grain of bark leans from the axis (the tangent of 3.5 degrees): much as that of most trees, whose spiral
/// grain is a few degrees (J. M. Harris, "Spiral Grain and Wave Phenomena in Wood Formation", 1989), and a quarter of
/// a repeat round the axis for each along it where tiles have the usual height.
constexpr float kSpiralGrain = 0.061f;

/// Where branches leave, an axis keeps this share of what it is about to lose to them: wood narrows above a fork.
constexpr float kForkHold = 0.5f;

/// What hardly comes out of its parent cannot be welded to it: so high must it rise over it, in radii of the branch.
constexpr float kShortestWeld = 0.1f;

constexpr std::uint32_t kMaxCapRings = 4;

using simd::Four;
using simd::three;

Vec3 directionOf(const Skeleton& skeleton, std::uint32_t segment)
{
    const Four span = three(skeleton.ends[segment]) - three(skeleton.starts[segment]);
    const float square = simd::dot(span, span);
    if (square > kSmallestStep * kSmallestStep && std::isfinite(square))
        return simd::vec3(simd::directionOr(span, span));
    const Four heading = simd::directionOr(three(skeleton.headings[segment]), Four{0, 1, 0, 0});
    return simd::vec3(square > kSmallestStep * kSmallestStep ? simd::directionOr(span, heading) : heading);
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
    const auto append = [&](const Vec3& position, float radius) {
        AxisJoint& joint = joints.emplace_back(); // filled where it is: see RingRow
        simd::storeThree(&joint.position, three(position));
        joint.radius = radius;
    };
    append(skeleton.starts[segment], skeleton.startRadii[segment]);
    joints[0].piece = segment;
    float thickest = joints[0].radius;
    for (std::uint32_t i = segment; i != kNoSegment; i = skeleton.continuations[i])
    {
        if (i != segment && !isJoined(skeleton, i))
            break;
        const float radius = endRadiusOf(skeleton, scratch.forks, i);
        thickest = std::max(thickest, radius);
        if (areApart(joints.back().position, skeleton.ends[i]))
        {
            joints.back().piece = i;
            append(skeleton.ends[i], radius);
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

/// Widens a trunk where it runs out into its roots.
void widen(const RootFlare& roots, CurvePoint& point)
{
    if (point.along >= roots.length)
        return;
    const float left = 1 - point.along / roots.length;
    const float factor = 1 + roots.share * left * left * left;
    const float factorSlope = -3 * roots.share * left * left / roots.length;
    point.slope = point.slope * factor + point.radius * factorSlope;
    point.radius *= factor;
}

RootFlare rootFlareOf(const TubePlan& plan, std::uint32_t segment)
{
    const BarkAppearance& bark = plan.bark;
    const std::vector<CurvePoint>& points = plan.scratch.points;
    const float radius = points[0].radius;
    const bool standsOnGround =
        plan.skeleton.parents[segment] == kNoSegment && std::abs(points[0].position.y) <= radius;
    const float length = std::min(clampedTo(bark.rootLength, 0, 20) * radius, 0.75f * points.back().along);
    const float share = clampedTo(plan.settings.rootFlare * clampedTo(bark.rootFlare, 0, 4), 0, 4);
    if (!standsOnGround || !(length > 0) || !(share > 0))
        return {};
    RootFlare roots{.share = share, .length = length};
    roots.lobes = std::min(bark.rootLobes, kMaxRootLobes);
    if (roots.lobes < 3)
        return roots;
    // Never so deep that the trunk has no wood left.
    roots.depth = std::min(clampedTo(bark.rootDepth, 0, 2), 1 + 0.5f / share);
    // A tree has no number of its own here, but trunks are rarely of one girth, and all its levels share it.
    const RandomKey key = RandomKey(Seed{0x726f6f7473}).child(std::bit_cast<std::uint32_t>(radius));
    for (std::size_t i = 0; i < roots.turns.size(); ++i)
    {
        const double turn = key.uniform(Purpose::Sampling, 0, 360, static_cast<std::uint32_t>(i));
        const math::SinCos at = math::sinCosDegrees(turn);
        roots.turns[i] = {static_cast<float>(at.cos), static_cast<float>(at.sin)};
    }
    return roots;
}

/// Buttresses want four sides each; where the error asked for hides them they have fewer, and part less.
void giveSides(const TubeSettings& settings, float radius, RootFlare& roots, std::uint32_t& sides)
{
    if (!(roots.depth > 0))
        return;
    if (radius * roots.share * roots.depth > 2 * settings.chordError)
        sides = std::clamp<std::uint32_t>(4 * roots.lobes, sides, std::max<std::uint32_t>(sides, settings.maxSides));
    const float sidesEach = static_cast<float>(sides) / static_cast<float>(roots.lobes);
    roots.depth *= std::clamp((sidesEach - 2.5f) / 1.5f, 0.f, 1.f);
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

Stations flareStations(const RootFlare& roots)
{
    Stations stations;
    if (roots.share > 0)
    {
        for (const float share : {0.1f, 0.22f, 0.38f, 0.6f, 1.f})
            stations.add(share * roots.length, 0);
    }
    return stations;
}

float slopeBetween(const Skeleton& skeleton, std::uint32_t segment, float startRadius, float endRadius)
{
    const float length = glm::length(skeleton.ends[segment] - skeleton.starts[segment]);
    return length > kSmallestStep ? (endRadius - startRadius) / length : 0.f;
}

/// Fills in what is known of the collar before the branch's curve is.
void beginCollar(const TubePlan& plan, std::uint32_t segment, TubeCollar& collar)
{
    const Skeleton& skeleton = plan.skeleton;
    if (!isJoined(skeleton, segment))
        return;
    const std::vector<std::uint8_t>& forks = plan.scratch.forks;
    const std::uint32_t parent = skeleton.parents[segment];
    const std::uint32_t onward = skeleton.continuations[parent];
    collar.joint = skeleton.starts[segment];
    collar.parentRadius = endRadiusOf(skeleton, forks, parent);
    collar.before = directionOf(skeleton, parent);
    collar.after = collar.before;
    collar.slopeBefore = slopeBetween(skeleton, parent, skeleton.startRadii[parent], collar.parentRadius);
    if (onward != kNoSegment && isJoined(skeleton, onward))
    {
        collar.after = directionOf(skeleton, onward);
        collar.slopeAfter = slopeBetween(skeleton, onward, collar.parentRadius, endRadiusOf(skeleton, forks, onward));
    }
}

/// Sizes the collar on the sampled curve and returns where it wants rings: at its foot, just inside the parent, and as
/// the fillet rises.
Stations layCollar(const TubePlan& plan, TubeCollar& collar)
{
    const std::vector<CurvePoint>& points = plan.scratch.points;
    const float radius = std::min(points[0].radius, kHiddenWidth * collar.parentRadius);
    const float height = plan.settings.collarFlare * radius;
    const bool isWelded = plan.settings.joints == TubeJoints::Weld;
    const bool isSwollen = height > 1.5f * plan.settings.chordError;
    Stations stations;
    if (!isSwollen && !isWelded)
        return stations;

    float highest = 0;
    for (const CurvePoint& point : points)
        highest = std::max(highest, heightOverParent(collar, point.position));
    collar.length = std::min(plan.settings.collarLength * radius, 0.8f * highest);
    if (collar.length < (isWelded ? kShortestWeld : 0.3f) * radius)
        return stations;

    const bool isFine = height > 4 * plan.settings.chordError;
    constexpr std::array<float, 5> kFine{0, 0.07f, 0.22f, 0.48f, 1};
    constexpr std::array<float, 3> kCoarse{0, 0.25f, 1};
    constexpr std::array<float, 2> kBare{0, 1};
    const std::span<const float> levels = isFine      ? std::span<const float>(kFine)
                                          : isSwollen ? std::span<const float>(kCoarse)
                                                      : std::span<const float>(kBare);
    std::size_t k = 0;
    float reached = heightOverParent(collar, points[0].position);
    float next = heightOverParent(collar, points[1].position);
    for (const float level : levels)
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
    collar.isLaid = isWelded || collar.height > 0;
    return collar.isLaid ? stations : Stations{};
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

/// True if the tube between two rings passes through itself on the inside of a bend.
bool foldsBetween(const TubeRing& a, const TubeRing& b)
{
    const Four forward = three(a.tangent) + three(b.tangent);
    const Four turn = three(b.tangent) - three(a.tangent);
    const float advance = simd::dot(three(b.centre) - three(a.centre), forward);
    const float inside = (a.radius + b.radius) * 0.5f * simd::length(turn) * simd::length(forward);
    return advance < 1.1f * inside;
}

bool isStraightBetween(const TubeRing& a, const TubeRing& b)
{
    const Four tangent = three(a.tangent);
    const Four chord = three(b.centre) - three(a.centre);
    const float ahead = simd::dot(chord, tangent);
    return ahead * ahead >= kStraightAhead * kStraightAhead * simd::dot(chord, chord) &&
           simd::dot(tangent, three(b.tangent)) > kStraightCosine && std::abs(a.slope - b.slope) < kStraightSlope &&
           std::abs(a.radius + a.slope * (b.along - a.along) - b.radius) <= kStraightRadius * a.radius;
}

/// The rings of one tube while they are laid; drops those that would fold the tube or that a straight cone does
/// without. Rings are filled where they stay: copied right after its numbers were written one by one, a ring would be
/// read in larger pieces than it was written in, for which a processor waits until all of it has reached the cache.
class RingRow
{
public:
    explicit RingRow(std::vector<TubeRing>& rings) : rings_(rings), first_(rings.size()) {}

    /// The ring after all others, to be filled and then kept.
    [[nodiscard]] TubeRing& next() { return rings_.emplace_back(); }

    void keep()
    {
        if (hasNotAdvanced())
        {
            fromBack(2).pinned = fromBack(2).pinned || fromBack(1).pinned;
            rings_.pop_back();
        }
        else if (folds())
            rings_.pop_back();
        else
            straighten();
    }

    /// Keeps the end of the axis at the cost of what it would fold with.
    void keepLast()
    {
        while (count() > 2 && (hasNotAdvanced() || folds()))
            dropBefore();
        if (!folds())
            straighten();
    }

private:
    [[nodiscard]] std::size_t count() const { return rings_.size() - first_; }
    [[nodiscard]] TubeRing& fromBack(std::size_t i) { return rings_[rings_.size() - i]; }

    /// A ring that was asked for where the curve has one anyway, or next to it.
    [[nodiscard]] bool hasNotAdvanced()
    {
        return count() > 1 && fromBack(1).along - fromBack(2).along <= kSameRing * fromBack(2).radius;
    }
    [[nodiscard]] bool folds() { return count() > 1 && foldsBetween(fromBack(2), fromBack(1)); }

    void straighten()
    {
        if (count() > 2 && !fromBack(2).pinned && isStraightBetween(fromBack(3), fromBack(2)) &&
            isStraightBetween(fromBack(3), fromBack(1)))
            dropBefore();
    }

    void dropBefore()
    {
        fromBack(2) = fromBack(1);
        rings_.pop_back();
    }

    std::vector<TubeRing>& rings_;
    std::size_t first_;
};

/// A dome of one radius' height over the last ring, as round as the chord error asks; its last ring is the apex.
void addCap(const TubeSettings& settings, TubeScratch& scratch)
{
    std::vector<TubeRing>& rings = scratch.rings;
    if (!(rings.back().radius > 0))
        return;
    const std::size_t last = rings.size() - 1;
    const float radius = rings[last].radius;
    const float wanted = 0.25f * static_cast<float>(math::kPi) * std::sqrt(radius / (2 * settings.chordError));
    const auto count = static_cast<std::uint32_t>(std::clamp(std::ceil(wanted), 1.f, static_cast<float>(kMaxCapRings)));
    const std::span<const Vec2> circle = circleOf(4 * count, scratch);
    rings.resize(rings.size() + count);
    const TubeRing& end = rings[last];
    const Four centre = three(end.centre);
    const Four tangent = three(end.tangent);
    for (std::uint32_t i = 1; i <= count; ++i)
    {
        TubeRing& ring = rings[last + i];
        ring.normal = circle[i];
        simd::storeThree(&ring.centre, centre + tangent * simd::all(radius * ring.normal.y));
        simd::storeThree(&ring.tangent, tangent);
        ring.radius = radius * ring.normal.x;
        ring.along = end.along + radius * static_cast<float>(0.5 * math::kPi * i / count);
        ring.slope = end.slope;
        ring.segment = end.segment;
        ring.pinned = end.pinned;
    }
}

void layFrames(const Vec3& firstSide, std::span<TubeRing> rings)
{
    Four centre = three(rings[0].centre);
    Four tangent = three(rings[0].tangent);
    Four side = sideNormalTo(tangent, three(firstSide));
    simd::storeThree(&rings[0].side, side);
    for (TubeRing& ring : rings.subspan(1))
    {
        const Four nextCentre = three(ring.centre);
        const Four nextTangent = three(ring.tangent);
        side = transportSide(side, centre, tangent, nextCentre, nextTangent);
        simd::storeThree(&ring.side, side);
        centre = nextCentre;
        tangent = nextTangent;
    }
}

AxisStart startOf(const TubePlan& plan, std::uint32_t segment, const TubeCollar& collar)
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

/// Lowers the first ring of a leaning trunk until no edge of it, `widest` radii from its centre, is above that.
void sinkBase(float widest, TubeRing& ring)
{
    const float upright = std::max(ring.tangent.y, 0.f);
    const float lean = std::sqrt(std::max(1 - upright * upright, 0.f));
    const float sink = widest * ring.radius * std::min(lean / std::max(upright, 1e-3f), 1.f);
    ring.centre -= ring.tangent * sink;
    ring.along -= sink;
}

void planTube(const TubePlan& plan, std::uint32_t segment)
{
    TubeScratch& scratch = plan.scratch;
    Tube& tube = scratch.tubes.emplace_back();
    tube.firstRing = static_cast<std::uint32_t>(scratch.rings.size());
    tube.segment = segment;
    beginCollar(plan, segment, tube.collar);
    tube.colour = std::min<std::uint32_t>(plan.skeleton.materials[segment], plan.settings.colours - 1u);
    sampleAxis(startOf(plan, segment, tube.collar), plan.rounding, scratch.joints, scratch.points);

    const float startRadius = scratch.points[0].radius;
    tube.roots = rootFlareOf(plan, segment);
    const bool isBranch = tube.collar.parentRadius > 0;
    const Stations stations = isBranch ? layCollar(plan, tube.collar) : flareStations(tube.roots);
    RingRow row(scratch.rings);
    const auto lay = [&](const CurvePoint& point, bool pinned) {
        CurvePoint shape;
        shape.along = point.along;
        shape.radius = point.radius;
        shape.slope = point.slope;
        widen(tube.roots, shape);
        if (isBranch)
            hideStart(tube.collar, shape, startRadius);
        const float scale = 1 / std::sqrt(1 + shape.slope * shape.slope);
        TubeRing& ring = row.next();
        simd::storeThree(&ring.centre, three(point.position));
        simd::storeThree(&ring.tangent, three(point.tangent));
        ring.radius = shape.radius;
        ring.along = shape.along;
        ring.slope = shape.slope;
        ring.normal.x = scale;
        ring.normal.y = -shape.slope * scale;
        ring.segment = point.piece;
        ring.pinned = pinned;
    };
    const auto add = [&](const CurvePoint& point, bool pinned) {
        lay(point, pinned);
        row.keep();
    };

    std::size_t nextStation = 0;
    float thickest = 0;
    if (!tube.collar.isLaid)
        add(scratch.points[0], true);
    for (std::size_t i = 1; i < scratch.points.size(); ++i)
    {
        const CurvePoint& point = scratch.points[i];
        for (; nextStation < stations.count && stations.along[nextStation] < point.along; ++nextStation)
            add(pointBetween(scratch.points[i - 1], point, stations.along[nextStation]), true);
        // A collared branch begins at the collar's foot; what lies before is hidden in the parent.
        const bool isLast = i + 1 == scratch.points.size();
        if (isLast)
        {
            lay(point, true);
            row.keepLast();
        }
        else if (!tube.collar.isLaid || point.along > tube.collar.start)
            add(point, false);
        thickest = std::max(thickest, point.radius);
    }
    thickest = std::max(thickest, scratch.rings[tube.firstRing].radius);

    const float widened = plan.wideningOf(segment);
    tube.sides = sidesFor(thickest / widened, plan.settings);
    giveSides(plan.settings, startRadius, tube.roots, tube.sides);
    if (tube.roots.share > 0)
        sinkBase(1 + tube.roots.depth * tube.roots.share / (1 + tube.roots.share), scratch.rings[tube.firstRing]);
    addCap(plan.settings, scratch);
    const std::span<const TubeRing> rings = std::span(scratch.rings).subspan(tube.firstRing);
    const float circumference = 2 * static_cast<float>(math::kPi) * meanRadiusOf(scratch.points) / widened;
    tube.ringCount = static_cast<std::uint32_t>(rings.size());
    tube.repeats = std::max(1.f, std::floor(circumference / plan.tile + 0.5f));
    const auto tall = static_cast<float>(tileHeightOf(plan.bark));
    tube.repeatsPerMetre = 1 / (tall * std::max(circumference / tube.repeats, plan.tile / kFinestBark));
    tube.lean = kSpiralGrain * tall;
    const bool isOpen = startRadius <= plan.settings.openRadius && plan.skeleton.parents[segment] != kNoSegment &&
                        plan.settings.joints == TubeJoints::Embed;
    // Between buttresses a lid is hollow, so it has a middle.
    tube.baseVertices = isOpen                                       ? 0
                        : tube.collar.isLaid || tube.roots.depth > 0 ? tube.sides + 1
                        : rings[0].radius > 0                        ? tube.sides
                                                                     : 0;
}

} // namespace

TubeSettings clamped(TubeSettings settings) noexcept
{
    settings.colours = std::clamp<std::uint16_t>(settings.colours, 1, kMaxPalette);
    settings.maxSides = std::clamp<std::uint16_t>(settings.maxSides, 3, 256);
    settings.minSides = std::clamp<std::uint16_t>(settings.minSides, 3, settings.maxSides);
    settings.chordError = clampedTo(settings.chordError, 1e-9f, 1e9f);
    settings.smoothing = clampedTo(settings.smoothing, 0, 1);
    settings.maxRingAngle = clampedTo(settings.maxRingAngle, 1e-3f, static_cast<float>(math::kPi));
    settings.collarFlare = clampedTo(settings.collarFlare, 0, 4);
    settings.collarLength = clampedTo(settings.collarLength, 0, 20);
    settings.rootFlare = clampedTo(settings.rootFlare, 0, 4);
    settings.openRadius = clampedTo(settings.openRadius, 0, 1e9f);
    return settings;
}

std::span<const Vec2> circleOf(std::uint32_t sides, TubeScratch& scratch)
{
    std::uint32_t& start = scratch.circleStarts[sides]; // plus 1
    if (start == 0)
    {
        start = static_cast<std::uint32_t>(scratch.circlePoints.size()) + 1;
        for (std::uint32_t j = 0; j <= sides; ++j)
        {
            const math::SinCos point = math::sinCosDegrees(360.0 * (j % sides) / sides);
            scratch.circlePoints.push_back({static_cast<float>(point.cos), static_cast<float>(point.sin)});
        }
    }
    return {&scratch.circlePoints[start - 1], sides + 1};
}

bool isJoined(const Skeleton& skeleton, std::uint32_t segment) noexcept
{
    const std::uint32_t parent = skeleton.parents[segment];
    if (parent == kNoSegment)
        return false;
    const Vec3 gap = skeleton.starts[segment] - skeleton.ends[parent];
    return glm::dot(gap, gap) <= kJoinTolerance * kJoinTolerance;
}

void beginPlan(const TubePlan& plan)
{
    markForks(plan.skeleton, plan.scratch.forks);
    plan.scratch.rings.clear();
    plan.scratch.tubes.clear();
    plan.scratch.branches = 0;
    plan.scratch.embedded = 0;
}

bool planTubeAt(const TubePlan& plan, std::uint32_t segment)
{
    if (!startsTube(plan.skeleton, segment) || !gatherJoints(plan.skeleton, segment, plan.scratch))
        return false;
    planTube(plan, segment);
    if (isJoined(plan.skeleton, segment))
    {
        ++plan.scratch.branches;
        ++plan.scratch.embedded;
    }
    return true;
}

void frameTubes(const TubePlan& plan)
{
    for (const Tube& tube : plan.scratch.tubes)
        layFrames(plan.skeleton.lefts[tube.segment],
                  std::span(plan.scratch.rings).subspan(tube.firstRing, tube.ringCount));
}

} // namespace espalier
