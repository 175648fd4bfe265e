#include <Espalier/Mesh/Bounds.h>
#include <Espalier/Mesh/Foliage.h>

#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Core/Random.h>
#include <Espalier/Core/Simd.h>
#include <Espalier/Mesh/RingFrames.h>
#include <Espalier/Plant/Places.h>
#include <Espalier/Species/LeafOutline.h>
#include <algorithm>
#include <cmath>

// Phyllotaxis along every shoot, then light: what the crown shades too much falls. Candidates are placed without a look
// at each other, so that where one stands depends on its shoot alone.

namespace espalier {
namespace {

/// Where the hashes of leaves' places begin.
constexpr Seed kLeaves{0x666f6c6961676521u};

/// Degrees from one leaf to the next in a spiral: the smaller part of a circle in the golden section.
constexpr double kGoldenAngle = 137.50776405003785;

/// The square of the sine of the angle to the sky below which a direction has no left of its own.
constexpr float kUpright = 1e-4f;

/// As smooth as the tubes, turn by turn (TubeSettings::maxRingAngle).
constexpr double kMaxTurn = 0.26;

/// A leaf that a taper makes shorter than this share of its kind's length is not worth its triangles.
constexpr float kShortest = 0.05f;

/// How dark a leaf is that gets no light.
constexpr float kDarkest = 0.58f;

/// Vertices of a leaf, at the least.
constexpr std::uint64_t kFewestVertices = 4;

/// How much of the way out is that of the whole crown, rather than of the clump that a leaf is in.
constexpr float kWholeCrown = 0.6f;

using simd::all;
using simd::Four;
using simd::three;

/// The unit vector along one whose length is about 1; `otherwise` where most of it cancelled out.
Four unitOr(Four v, Four otherwise)
{
    const float square = simd::dot(v, v);
    return square > 1e-8f ? v * all(1 / std::sqrt(square)) : otherwise;
}

/// The unit vector normal to `heading` nearest to `wish`, or where that is of no help, to `otherwise`.
Four faceOf(Four heading, Four wish, Four otherwise)
{
    Four face = wish - all(simd::dot(wish, heading)) * heading;
    face -= all(simd::dot(face, heading)) * heading; // what rounding left, where the wish was nearly the heading
    const float square = simd::dot(face, face);
    return square > 1e-6f ? face * all(1 / std::sqrt(square)) : sideNormalTo(heading, otherwise);
}

/// True where a run of wood without a gap begins.
bool startsShoot(const Skeleton& skeleton, std::uint32_t segment)
{
    return skeleton.startsAxis(segment) || skeleton.starts[segment] != skeleton.ends[skeleton.parents[segment]];
}

/// Leaves at one node.
std::uint32_t perNode(const LeafAppearance& kind)
{
    switch (kind.arrangement)
    {
    case LeafArrangement::Spiral:
    case LeafArrangement::Alternate:
        return 1;
    case LeafArrangement::Opposite:
        return 2;
    case LeafArrangement::Whorled:
        return kind.perNode;
    }
    return 1;
}

/// Degrees round the shoot from the left side: of leaf `leaf` at node `node`, counted from the tip.
double turnOf(const LeafAppearance& kind, double phase, std::uint32_t node, std::uint32_t leaf)
{
    switch (kind.arrangement)
    {
    case LeafArrangement::Spiral:
    {
        const double turn = phase + kGoldenAngle * node;
        return turn - 360 * std::floor(turn / 360);
    }
    case LeafArrangement::Alternate:
        return 180.0 * (node % 2);
    case LeafArrangement::Opposite:
        return 90.0 * (node % 2) + 180.0 * leaf;
    case LeafArrangement::Whorled:
        return phase + (360.0 * leaf + 180.0 * (node % 2)) / kind.perNode;
    }
    return 0;
}

/// Three even values in [0, 1) from one draw.
struct Lots
{
    float a, b, c;

    Lots(const RandomKey& key, std::uint32_t counter)
    {
        const std::uint64_t bits = key.bits(Purpose::Foliage, counter);
        constexpr std::uint64_t kMask = (1u << 21) - 1;
        const auto even = [&](unsigned shift) { return static_cast<float>((bits >> shift) & kMask) * 0x1p-21f; };
        a = even(0);
        b = even(21);
        c = even(42);
    }
};

float coverOf(const LeafAppearance& kind, std::vector<FoliageScratch::Cover>& known)
{
    for (const FoliageScratch::Cover& cover : known)
        if (cover.kind == kind)
            return cover.share;
    constexpr std::size_t kMostKnown = 64; // all the seasons of a few species
    if (known.size() == kMostKnown)
        known.clear();
    known.reserve(kMostKnown);
    known.push_back({kind, LeafSurface(kind).coverage()});
    return known.back().share;
}

/// Square metres that one leaf of the kind takes light from, in squares of its length.
float areaOf(const LeafAppearance& kind, std::vector<FoliageScratch::Cover>& known)
{
    if (kind.form == LeafForm::Ball)
        return static_cast<float>(math::kPi) / 4 * (1 - kind.stalk) * (1 - kind.stalk);
    const float surfaces = kind.form == LeafForm::Crossed ? 2 : 1;
    return surfaces * coverOf(kind, known) * kind.width;
}

class Placer
{
public:
    Placer(const Skeleton& skeleton, std::span<const LeafAppearance> kinds, float smoothing, const Limits& limits,
           FoliageScratch& scratch)
        : skeleton_(skeleton), kinds_(kinds.first(std::min(kinds.size(), kMaxLeafKinds))), limits_(limits),
          scratch_(scratch), rounding_{.smoothing = clampedTo(smoothing, 0, 1),
                                       .cosMaxTurn = static_cast<float>(math::cos(kMaxTurn))}
    {
        for (std::size_t k = 0; k < kinds_.size(); ++k)
        {
            kept_[k] = withinRanges(kinds_[k]);
            areas_[k] = areaOf(kept_[k], scratch.covers);
            thickest_ = std::max(thickest_, kept_[k].thickestWood);
        }
    }

    /// Counts the places of each kind instead of placing leaves.
    [[nodiscard]] MeshResult count(PlaceCounts& counts)
    {
        counts_ = &counts;
        return place();
    }

    [[nodiscard]] MeshResult place()
    {
        scratch_.candidates.clear();
        scratch_.shaders.clear();
        hashPlaces(skeleton_, scratch_.places);
        for (std::uint32_t i = 0; i < skeleton_.size(); ++i)
        {
            if (!startsShoot(skeleton_, i) || !gatherJoints(i))
                continue;
            const MeshResult result = placeAlongShoot(i);
            if (result != MeshResult::Ok)
                return result;
        }
        return MeshResult::Ok;
    }

private:
    /// False if nothing can stand on the shoot that starts at `segment`.
    bool gatherJoints(std::uint32_t segment)
    {
        std::vector<AxisJoint>& joints = scratch_.joints;
        joints.clear();
        const auto append = [&](const Vec3& position, float radius) {
            AxisJoint& joint = joints.emplace_back();
            simd::storeThree(&joint.position, three(position));
            joint.radius = radius;
        };
        append(skeleton_.starts[segment], skeleton_.startRadii[segment]);
        joints[0].piece = segment;
        float thinnest = joints[0].radius;
        for (std::uint32_t i = segment; i != kNoSegment; i = skeleton_.continuations[i])
        {
            if (i != segment && startsShoot(skeleton_, i))
                break;
            const float radius = skeleton_.endRadii[i];
            thinnest = std::min(thinnest, radius);
            if (areApart(joints.back().position, skeleton_.ends[i]))
            {
                joints.back().piece = i;
                append(skeleton_.ends[i], radius);
            }
            else
                joints.back().radius = radius;
        }
        return joints.size() > 1 && thinnest <= thickest_;
    }

    /// Radius of the parent that the shoot grows out of; 0 if it stands alone.
    [[nodiscard]] float parentRadius(std::uint32_t segment) const
    {
        const std::uint32_t parent = skeleton_.parents[segment];
        const bool isJoined = parent != kNoSegment && skeleton_.starts[segment] == skeleton_.ends[parent];
        return isJoined ? skeleton_.endRadii[parent] : 0.f;
    }

    void sampleShoot(std::uint32_t segment)
    {
        const std::vector<AxisJoint>& joints = scratch_.joints;
        const Vec3 span = joints[1].position - joints[0].position;
        const Vec3 own = directionOr(span, Vec3(0, 1, 0));
        AxisStart start{.tangent = own, .reach = glm::length(span)};
        if (const float radius = parentRadius(segment); radius > 0)
        {
            // As the tubes have it: the thicker a branch, the more it bends out of its parent.
            const std::uint32_t parent = skeleton_.parents[segment];
            const Vec3 way = skeleton_.ends[parent] - skeleton_.starts[parent];
            const float lean = 0.5f * std::min(skeleton_.startRadii[segment] / radius, 1.f);
            start.tangent = directionOr(glm::mix(own, directionOr(way, skeleton_.headings[parent]), lean), own);
            start.reach = glm::length(way);
        }
        sampleAxis(start, rounding_, scratch_.joints, scratch_.points);

        // It begins with its left side as seen by somebody who looks down on it, so that two ranks lie flat. Upright
        // there, it takes the side that it has further on.
        const std::vector<CurvePoint>& points = scratch_.points;
        const Vec3 sky(0, 1, 0);
        const Vec3 reach = points.back().position - points[0].position;
        Vec3 side = skeleton_.lefts[segment];
        if (const Vec3 flat = glm::cross(sky, points[0].tangent); glm::dot(flat, flat) > kUpright)
            side = flat;
        else if (const Vec3 bent = glm::cross(sky, directionOr(reach, sky)); glm::dot(bent, bent) > kUpright)
            side = bent;
        scratch_.sides.resize(points.size());
        Four position = three(points[0].position);
        Four tangent = three(points[0].tangent);
        Four carried = sideNormalTo(tangent, three(side));
        simd::storeThree(&scratch_.sides[0], carried);
        for (std::size_t i = 1; i < points.size(); ++i)
        {
            const Four nextPosition = three(points[i].position);
            const Four nextTangent = three(points[i].tangent);
            carried = transportSide(carried, position, tangent, nextPosition, nextTangent);
            simd::storeThree(&scratch_.sides[i], carried);
            position = nextPosition;
            tangent = nextTangent;
        }
    }

    MeshResult placeAlongShoot(std::uint32_t segment)
    {
        sampleShoot(segment);
        const float base = parentRadius(segment);
        const RandomKey shoot = RandomKey(kLeaves).child(scratch_.places[segment]);
        for (std::uint32_t k = 0; k < kinds_.size(); ++k)
        {
            const MeshResult result = placeKind(kept_[k], k, base, shoot.child(k));
            if (result != MeshResult::Ok)
                return result;
        }
        return MeshResult::Ok;
    }

    /// Where wood begins to be thin enough, counted from the tip downwards; the shoot's length if it nowhere is.
    [[nodiscard]] float leafyFrom(float thickest, float base) const
    {
        const std::vector<CurvePoint>& points = scratch_.points;
        std::size_t i = points.size();
        while (i > 0 && points[i - 1].radius <= thickest)
            --i;
        if (i == points.size())
            return points.back().along;
        if (i == 0)
            return base;
        const CurvePoint& thick = points[i - 1];
        const CurvePoint& thin = points[i];
        const float share = (thick.radius - thickest) / (thick.radius - thin.radius);
        return std::max(base, thick.along + share * (thin.along - thick.along));
    }

    MeshResult placeKind(const LeafAppearance& kind, std::uint32_t number, float base, const RandomKey& shoot)
    {
        if (!(kind.density > 0))
            return MeshResult::Ok;
        const std::vector<CurvePoint>& points = scratch_.points;
        const float end = points.back().along;
        if (points.back().radius > kind.thickestWood)
            return MeshResult::Ok;
        const float from = leafyFrom(kind.thickestWood, base);
        const Stretch stretch{from, end};
        const double nodes =
            std::max(0.0, std::floor(static_cast<double>(end - from) / static_cast<double>(kind.spacing)));
        const std::uint32_t each = perNode(kind);
        places_ += nodes * each + (kind.atTip ? 1 : 0);
        if (places_ > static_cast<double>(limits_.vertices))
            return MeshResult::TooManyVertices;
        if (counts_ != nullptr)
        {
            (*counts_)[number] += static_cast<std::uint64_t>(nodes) * each + (kind.atTip ? 1 : 0);
            return MeshResult::Ok;
        }

        if (kind.atTip)
        {
            CurvePoint tip = points.back();
            tip.position += tip.radius * tip.tangent; // where its round end is
            tip.radius = 0;
            const Lots stays(shoot, 1);
            if (stays.a < kind.density &&
                !add(kind, number, stretch, tip, three(scratch_.sides.back()), shoot, stays, 0, 0, isTip))
                return MeshResult::TooManyVertices;
        }
        const double phase = 360 * shoot.uniform(Purpose::Foliage);
        std::size_t next = points.size() - 1;
        const auto count = static_cast<std::uint32_t>(nodes);
        for (std::uint32_t node = 1; node <= count; ++node)
        {
            const RandomKey key = shoot.child(node);
            CurvePoint point;
            Four side{};
            bool isBare = true;
            for (std::uint32_t leaf = 0; leaf < each; ++leaf)
            {
                const Lots stays(key, 2 * leaf + 1);
                if (!(stays.a < kind.density))
                    continue;
                if (isBare) // where the node is matters only if something stands there
                {
                    const float along = end - static_cast<float>(node) * kind.spacing;
                    while (next > 1 && points[next - 1].along > along)
                        --next;
                    const CurvePoint& before = points[next - 1];
                    point = pointBetween(before, points[next], std::max(along, before.along));
                    side = transportSide(three(scratch_.sides[next - 1]), three(before.position), three(before.tangent),
                                         three(point.position), three(point.tangent));
                    isBare = false;
                }
                if (!add(kind, number, stretch, point, side, key, stays, turnOf(kind, phase, node, leaf), leaf))
                    return MeshResult::TooManyVertices;
            }
        }
        return MeshResult::Ok;
    }

    struct Stretch
    {
        float from, end; // metres along the shoot
    };
    static constexpr bool isTip = true;

    /// The side that ranks lie on: horizontal as far as faces look up.
    [[nodiscard]] static Four rankSide(const LeafAppearance& kind, Four tangent, Four side)
    {
        if (kind.arrangement != LeafArrangement::Alternate)
            return side;
        Four flat = simd::cross(Four{0, 1, 0, 0}, tangent);
        flat = simd::dot(flat, side) < 0 ? -flat : flat;
        return sideNormalTo(tangent, all(1 - kind.facing) * side + all(2 * kind.facing) * flat);
    }

    /// Places a leaf for which there is a lot that lets it stay. False if there are too many.
    bool add(const LeafAppearance& kind, std::uint32_t number, const Stretch& stretch, const CurvePoint& point,
             Four side, const RandomKey& node, const Lots& stays, double turn, std::uint32_t leaf,
             bool endsShoot = false)
    {
        const Lots bearing(node, 2 * leaf + 2);
        const float share =
            stretch.end > stretch.from ? (point.along - stretch.from) / (stretch.end - stretch.from) : 1.f;
        const float hump = std::sqrt(std::max(4 * share * (1 - share), 0.f));
        const float size = (1 + kind.lengthSpread * (2 * bearing.b - 1)) * (1 - kind.taper * (1 - hump));
        if (!(size >= kShortest))
            return true;

        const Four tangent = three(point.tangent);
        const math::SinCos round = math::sinCosDegrees(turn);
        const Four left = rankSide(kind, tangent, side);
        const Four back = simd::cross(tangent, left);
        const Four radial = all(static_cast<float>(round.cos)) * left + all(static_cast<float>(round.sin)) * back;
        const float spread = kind.angleSpread * (2 * bearing.a - 1);
        const math::SinCos lean = math::sinCos(static_cast<double>(endsShoot ? 0.5f * spread : kind.angle + spread));
        const Four sin = all(static_cast<float>(lean.sin));
        const Four cos = all(static_cast<float>(lean.cos));
        const Four risen = cos * tangent + sin * radial;

        FoliageScratch::Candidate& candidate = scratch_.candidates.emplace_back();
        PlacedLeaf& placed = candidate.leaf;
        const Four heading = unitOr(simd::mix(risen, Four{0, -1, 0, 0}, kind.droop), risen);
        // Its upper side looks towards the tip of the shoot, or as far as wanted to the sky.
        const Four towardsTip = sin * tangent - cos * radial;
        const Four face = faceOf(heading, simd::mix(towardsTip, Four{0, 1, 0, 0}, kind.facing), towardsTip);
        const Four foot = three(point.position) + all(point.radius) * radial;
        simd::storeThree(&placed.heading, heading);
        simd::storeThree(&placed.face, face);
        simd::storeThree(&placed.foot, foot);
        placed.length = size * kind.length;
        placed.segment = point.piece;
        placed.lot = stays.b;
        const float shade = 1 - kind.colourSpread * stays.c;
        placed.outward = Vec3(shade); // until its place in the crown is known
        candidate.kind = number;
        candidate.lot = stays.a;
        Shader& shader = scratch_.shaders.emplace_back();
        simd::storeThree(&shader.place, foot + all(0.5f * placed.length) * heading);
        shader.area = areas_[number] * placed.length * placed.length;
        return scratch_.candidates.size() * kFewestVertices <= limits_.vertices;
    }

    const Skeleton& skeleton_;
    std::span<const LeafAppearance> kinds_;
    const Limits& limits_;
    FoliageScratch& scratch_;
    AxisRounding rounding_;
    std::array<LeafAppearance, kMaxLeafKinds> kept_; ///< The kinds within their ranges.
    std::array<float, kMaxLeafKinds> areas_{};       ///< Of a leaf of each kind, in squares of its length.
    float thickest_ = 0;                             // wood that any kind stands on
    double places_ = 0;
    PlaceCounts* counts_ = nullptr; ///< None: leaves are placed.
};

/// The crown as an ellipsoid: its middle, and one over the squares of its half axes, up to a factor.
struct CrownShape
{
    Vec3 middle{0};
    Vec3 narrowness{1};

    explicit CrownShape(std::span<const Shader> leaves)
    {
        DVec3 sum(0);
        for (const Shader& leaf : leaves)
            sum += DVec3(leaf.place);
        const double count = std::max<double>(1, static_cast<double>(leaves.size()));
        const DVec3 mean = sum / count;
        DVec3 squares(0);
        for (const Shader& leaf : leaves)
        {
            const DVec3 arm = DVec3(leaf.place) - mean;
            squares += arm * arm;
        }
        const double largest = std::max({squares.x, squares.y, squares.z, 1e-12});
        middle = Vec3(mean);
        // No crown is flatter than one to three: a lone frond has no inside.
        for (int axis = 0; axis < 3; ++axis)
            narrowness[axis] = static_cast<float>(largest / std::max(squares[axis], largest / 9));
    }

    [[nodiscard]] Four outwardFrom(const Vec3& place) const
    {
        return simd::directionOr((three(place) - three(middle)) * three(narrowness), Four{0, 1, 0, 0});
    }
};

/// Drops what gets too little light and finishes the rest, kind by kind.
void settle(std::span<const LeafAppearance> kinds, FoliageScratch& scratch, Foliage& foliage)
{
    scratch.light.measure(scratch.shaders);
    const CrownShape crown(scratch.shaders);
    for (std::uint32_t k = 0; k < kMaxLeafKinds; ++k)
    {
        foliage.starts[k] = static_cast<std::uint32_t>(foliage.leaves.size());
        if (k >= kinds.size())
            continue;
        const float density = clampedTo(kinds[k].density, 0, 1);
        const float sensitivity = clampedTo(kinds[k].shade, 0, 1);
        for (std::size_t i = 0; i < scratch.candidates.size(); ++i)
        {
            const FoliageScratch::Candidate& candidate = scratch.candidates[i];
            if (candidate.kind != k)
                continue;
            const Vec3 place = scratch.shaders[i].place;
            const FoliageLight::Sample here = scratch.light.at(place);
            if (!(candidate.lot < density * (1 - sensitivity * (1 - here.light))))
                continue;
            PlacedLeaf& leaf = foliage.leaves.emplace_back(candidate.leaf);
            leaf.tint = tintOf(Vec3(leaf.outward.x * (kDarkest + (1 - kDarkest) * here.light)));
            const Four whole = crown.outwardFrom(place);
            simd::storeThree(&leaf.outward, unitOr(simd::mix(three(here.outward), whole, kWholeCrown), whole));
        }
    }
    foliage.starts[kMaxLeafKinds] = static_cast<std::uint32_t>(foliage.leaves.size());
}

} // namespace

LeafAppearance withinRanges(const LeafAppearance& kind) noexcept
{
    constexpr auto kPi = static_cast<float>(math::kPi);
    LeafAppearance leaf = kind;
    leaf.thickestWood = clampedTo(kind.thickestWood, 0, 10);
    leaf.spacing = clampedTo(kind.spacing, 0.001f, 100);
    leaf.perNode = std::clamp(kind.perNode, 1u, 16u);
    leaf.density = clampedTo(kind.density, 0, 1);
    leaf.shade = clampedTo(kind.shade, 0, 1);
    leaf.angle = clampedTo(kind.angle, 0, kPi);
    leaf.angleSpread = clampedTo(kind.angleSpread, 0, kPi);
    leaf.droop = clampedTo(kind.droop, 0, 1);
    leaf.facing = clampedTo(kind.facing, 0, 1);
    leaf.length = clampedTo(kind.length, 0.001f, 20);
    leaf.lengthSpread = clampedTo(kind.lengthSpread, 0, 1);
    leaf.taper = clampedTo(kind.taper, 0, 1);
    leaf.width = clampedTo(kind.width, 0.01f, 4);
    leaf.stalk = clampedTo(kind.stalk, 0, 0.9f);
    // Beyond these a blade would be a closed tube or a hook.
    leaf.fold = clampedTo(kind.fold, 0, 1.2f);
    leaf.arch = clampedTo(kind.arch, -0.4f, 0.4f);
    leaf.leaves = std::clamp(kind.leaves, 1u, 64u);
    leaf.colourSpread = clampedTo(kind.colourSpread, 0, 1);
    leaf.crownNormals = clampedTo(kind.crownNormals, 0, 1);
    return leaf;
}

void Foliage::clear() noexcept
{
    leaves.clear();
    starts.fill(0);
}

std::span<const PlacedLeaf> Foliage::ofKind(std::size_t kind) const noexcept
{
    return std::span(leaves).subspan(starts[kind], starts[kind + 1] - starts[kind]);
}

namespace {

/// Ok if leaves can be looked for.
MeshResult check(const Skeleton& skeleton, std::span<const LeafAppearance> kinds, const Limits& limits)
{
    if (kinds.empty() || skeleton.empty())
        return MeshResult::EmptySkeleton;
    if (!isSound(skeleton) || !isWoodWithin(skeleton, static_cast<float>(limits.coordinate)))
        return MeshResult::UnsoundSkeleton;
    return MeshResult::Ok;
}

} // namespace

MeshResult placeLeaves(const Skeleton& skeleton, std::span<const LeafAppearance> kinds, float smoothing,
                       const Limits& limits, FoliageScratch& scratch, Foliage& foliage)
{
    foliage.clear();
    if (const MeshResult result = check(skeleton, kinds, limits); result != MeshResult::Ok)
        return result;
    const MeshResult result = Placer(skeleton, kinds, smoothing, limits, scratch).place();
    if (result != MeshResult::Ok)
        return result;
    settle(kinds.first(std::min(kinds.size(), kMaxLeafKinds)), scratch, foliage);
    return foliage.leaves.empty() ? MeshResult::EmptySkeleton : MeshResult::Ok;
}

MeshResult countPlaces(const Skeleton& skeleton, std::span<const LeafAppearance> kinds, float smoothing,
                       const Limits& limits, FoliageScratch& scratch, PlaceCounts& counts)
{
    counts.fill(0);
    if (const MeshResult result = check(skeleton, kinds, limits); result != MeshResult::Ok)
        return result;
    return Placer(skeleton, kinds, smoothing, limits, scratch).count(counts);
}

} // namespace espalier
