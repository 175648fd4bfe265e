#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Mesh/RingFrames.h>
#include <Espalier/Mesh/TubeCollar.h>
#include <Espalier/Mesh/TubeWeld.h>
#include <Espalier/Plant/Skeleton.h>
#include <algorithm>
#include <cmath>
#include <span>

// A branch's foot is the outline of its collar's first ring on the parent's surface, unrolled into (angle, along).
// There feet make room for each other, a band of the parent round them is cut into triangles, and what the outlines
// enclose is cut out. Since a foot's points are the branch's first ring, the surface is closed by construction,
// whatever the geometry does.
//
// Rejected: zippers between each foot and a rectangle of the parent's cells. They need parents of many sides, and
// whorls and forks, where feet stand shoulder to shoulder, leave no cells between them.

namespace espalier {
namespace {

constexpr double kTurn = 2 * math::kPi;

/// Radians. A foot reaches no farther round its parent: something must be left of it behind.
constexpr double kWidestFoot = 1.4;

/// Feet whose middles are nearer than this share of what both need are moved apart; the rest is clipped off.
constexpr double kElbowRoom = 0.7;
constexpr int kPushes = 12;

/// Between two feet stays this share of the distance between their middles.
constexpr double kGap = 0.12;

/// Feet along a host that are seen from each other.
constexpr std::size_t kCrowd = 500;

/// So often one foot is given up and a host planned again; then all of a band at once.
constexpr int kSingleLosses = 16;

/// Rings between a joint and where its branch comes out of the host.
constexpr int kFarthestRing = 200;

/// A foot clipped to less than this share of its size is lost.
constexpr double kSmallestFoot = 0.08;

// In widths of the parent's facets:
constexpr double kBandMargin = 0.4; ///< from a foot to the end of its band,
constexpr double kSnap = 0.27;      ///< from there to a ring that may serve as the end instead,
constexpr double kBandGap = 0.6;    ///< between bands, or they are one,
constexpr double kClearance = 0.3;  ///< between a foot and the parent's own vertices,
constexpr double kSliver = 0.15;    ///< between a foot and a ridge of the parent that is kept,
constexpr double kFineReach = 1.3;  ///< from a foot as far as the parent gets more vertices.

/// Rows of such vertices in a band at most.
constexpr double kMostLevels = 4096;

double nearestTurn(double angle)
{
    return angle - kTurn * std::floor(angle / kTurn + 0.5);
}

/// A tube while others are welded to it.
struct Host
{
    std::span<const TubeRing> rings;
    std::uint32_t sides;

    [[nodiscard]] double low() const { return static_cast<double>(rings[0].along); }
    /// The last ring before the apex.
    [[nodiscard]] double high() const { return static_cast<double>(rings[rings.size() - 2].along); }

    /// The ring at or before `along`, with one after it.
    [[nodiscard]] std::size_t ringBefore(double along) const
    {
        const auto beyond =
            std::upper_bound(rings.begin() + 1, rings.end() - 1, along,
                             [](double a, const TubeRing& r) { return a < static_cast<double>(r.along); });
        return static_cast<std::size_t>(beyond - rings.begin()) - 1;
    }

    [[nodiscard]] SheetRow rowAt(double along) const
    {
        const std::size_t i = ringBefore(along);
        const double start = static_cast<double>(rings[i].along);
        const double length = static_cast<double>(rings[i + 1].along) - start;
        const double rise = length > 0 ? std::clamp((along - start) / length, 0., 1.) : 0;
        if (static_cast<float>(rise) >= 1)
            return {.ring = static_cast<std::uint32_t>(i + 1)};
        return {.ring = static_cast<std::uint32_t>(i), .rise = static_cast<float>(rise)};
    }

    [[nodiscard]] double radiusAt(double along) const
    {
        const SheetRow row = rowAt(along);
        const float next = rings[std::min<std::size_t>(row.ring + 1, rings.size() - 1)].radius;
        return static_cast<double>(rings[row.ring].radius + row.rise * (next - rings[row.ring].radius));
    }

    [[nodiscard]] double facetAt(double along) const { return kTurn * radiusAt(along) / sides; }

    [[nodiscard]] SheetPoint pointAt(double angle, double along) const
    {
        const double turned = angle - kTurn * std::floor(angle / kTurn);
        const double column = turned / kTurn * sides;
        const double whole = std::min(std::floor(column), static_cast<double>(sides - 1));
        const SheetRow row = rowAt(along);
        return {.ring = row.ring,
                .column = static_cast<std::uint32_t>(whole),
                .rise = row.rise,
                .share = static_cast<float>(std::clamp(column - whole, 0., 1.))};
    }
};

Host hostOf(const TubeScratch& scratch, std::uint32_t tube)
{
    const Tube& t = scratch.tubes[tube];
    return {.rings = std::span(scratch.rings).subspan(t.firstRing, t.ringCount), .sides = t.sides};
}

/// A place seen from the host's axis, from the ring where it is looked for first.
struct Unrolled
{
    double angle;
    double along;
};

Unrolled unroll(const Host& host, std::size_t ring, const Vec3& place)
{
    const auto beyond = [&](std::size_t i) { return glm::dot(place - host.rings[i].centre, host.rings[i].tangent); };
    const std::size_t last = host.rings.size() - 2;
    std::size_t i = std::min(ring, last);
    for (int step = 0; step < kFarthestRing && i > 0 && beyond(i) < 0; ++step)
        --i;
    for (int step = 0; step < kFarthestRing && i < last && beyond(i + 1) > 0; ++step)
        ++i;
    const TubeRing& a = host.rings[i];
    const TubeRing& b = host.rings[i + 1];
    const float above = beyond(i);
    const float below = -beyond(i + 1);
    const float t = above + below > 0 ? std::clamp(above / (above + below), 0.f, 1.f) : 0.f;
    const Vec3 arm = place - glm::mix(a.centre, b.centre, t);
    const Vec3 side = glm::mix(a.side, b.side, t);
    const Vec3 up = glm::cross(directionOr(glm::mix(a.tangent, b.tangent, t), a.tangent), side);
    return {.angle = math::atan2(static_cast<double>(glm::dot(arm, up)), static_cast<double>(glm::dot(arm, side))),
            .along = static_cast<double>(a.along) + static_cast<double>(t) * static_cast<double>(b.along - a.along)};
}

double crossOf(const DVec2& a, const DVec2& b)
{
    return a.x * b.y - a.y * b.x;
}

/// Makes an outline that does not run once counter-clockwise round its middle the ellipse of its extents. Sides of the
/// outline keep the directions that they had on the whole.
void makeStar(std::span<DVec2> outline, double radius)
{
    const DVec2 metric(radius, 1);
    double widest = 0;
    for (const DVec2& p : outline)
        widest = std::max(widest, glm::length(p * metric));
    std::uint32_t turns = 0; // as often as it comes up from below the first axis
    bool isStar = widest > 0;
    for (std::size_t j = 0; j < outline.size(); ++j)
    {
        const DVec2 a = outline[j] * metric;
        const DVec2 b = outline[j + 1 == outline.size() ? 0 : j + 1] * metric;
        isStar = isStar && crossOf(a, b) > 1e-3 * widest * widest / static_cast<double>(outline.size());
        turns += a.y < 0 && b.y >= 0 ? 1 : 0;
    }
    if (isStar && turns < 2)
        return;

    double width = 0;
    double height = 0;
    DVec2 phase(0);
    const double step = kTurn / static_cast<double>(outline.size());
    for (std::size_t j = 0; j < outline.size(); ++j)
    {
        width = std::max(width, std::abs(outline[j].x));
        height = std::max(height, std::abs(outline[j].y));
        const math::SinCos back = math::sinCos(-step * static_cast<double>(j));
        const DVec2 p = outline[j] * metric;
        phase += DVec2(p.x * back.cos - p.y * back.sin, p.x * back.sin + p.y * back.cos);
    }
    const double start = glm::length(phase) > 0 ? math::atan2(phase.y, phase.x) : 0;
    for (std::size_t j = 0; j < outline.size(); ++j)
    {
        const math::SinCos at = math::sinCos(start + step * static_cast<double>(j));
        outline[j] = DVec2(std::max(width, 0.2 * widest / radius) * at.cos, std::max(height, 0.2 * widest) * at.sin);
    }
}

/// Fits the branch's first ring on its host. False if the host has no surface that could bear it.
bool layFoot(const TubePlan& plan, std::uint32_t tube, TubeFoot& foot)
{
    TubeScratch& scratch = plan.scratch;
    const Tube& branch = scratch.tubes[tube];
    const Host host = hostOf(scratch, foot.host);
    if (host.rings.size() < 3 || !(host.high() > host.low()))
        return false;

    const std::uint32_t parent = plan.skeleton.parents[branch.segment];
    const auto beyond = std::upper_bound(host.rings.begin(), host.rings.end(), parent,
                                         [](std::uint32_t s, const TubeRing& ring) { return s < ring.segment; });
    const auto joint = static_cast<std::size_t>(std::max<std::ptrdiff_t>(beyond - host.rings.begin(), 1) - 1);

    const TubeRing& ring = scratch.rings[branch.firstRing];
    const simd::Four side = simd::three(ring.side);
    const simd::Four up = simd::cross(simd::three(ring.tangent), side);
    const CollarRing onParent(branch.collar, ring);
    const Unrolled middle = unroll(host, joint, ring.centre);
    std::vector<DVec2>& offsets = scratch.sheets.offsets;
    foot.tube = tube;
    foot.firstOffset = static_cast<std::uint32_t>(offsets.size());
    foot.count = branch.sides;
    DVec2 mean(0);
    const std::span<const Vec2> circle = circleOf(branch.sides, scratch);
    for (std::uint32_t j = 0; j < branch.sides; ++j)
    {
        const simd::Four outward = side * simd::all(circle[j].x) + up * simd::all(circle[j].y);
        const Unrolled at = unroll(host, joint, simd::vec3(onParent.pointAt(outward, 0)));
        offsets.push_back({nearestTurn(at.angle - middle.angle), at.along});
        mean += offsets.back() / static_cast<double>(branch.sides);
    }
    foot.angle = middle.angle + mean.x;
    foot.along = mean.y;
    foot.radius = host.radiusAt(std::clamp(foot.along, host.low(), host.high()));
    if (!(foot.radius > 0))
        return false;
    const std::span<DVec2> outline = std::span(offsets).subspan(foot.firstOffset);
    for (DVec2& p : outline)
        p -= mean;
    makeStar(outline, foot.radius);
    for (DVec2& p : outline)
    {
        foot.size = std::max(foot.size, glm::length(p * DVec2(foot.radius, 1)));
        if (std::abs(p.x) > kWidestFoot)
            p *= kWidestFoot / std::abs(p.x);
    }
    return foot.size > 0;
}

std::span<DVec2> outlineOf(SheetPlan& sheets, const TubeFoot& foot)
{
    return std::span(sheets.offsets).subspan(foot.firstOffset, foot.count);
}

/// How far an outline reaches along a direction of the unrolled surface, in metres.
double reachOf(std::span<const DVec2> outline, const DVec2& direction, double radius)
{
    double reach = 0;
    for (const DVec2& p : outline)
        reach = std::max(reach, glm::dot(p * DVec2(radius, 1), direction));
    return reach;
}

/// Pulls what reaches beyond `limit` back towards the middle: the outline stays a star.
void clip(std::span<DVec2> outline, const DVec2& direction, double radius, double limit)
{
    for (DVec2& p : outline)
    {
        const double reach = glm::dot(p * DVec2(radius, 1), direction);
        if (reach > limit)
            p *= limit / reach;
    }
}

/// Moves a foot to where the host has room for all of it, or else to the middle of what it has.
void bringInRange(const Host& host, SheetPlan& sheets, TubeFoot& foot)
{
    const std::span<const DVec2> outline = outlineOf(sheets, foot);
    const double margin = std::min(0.15 * host.facetAt(foot.along), 0.1 * (host.high() - host.low()));
    const double lowest = host.low() + margin + reachOf(outline, {0, -1}, 1);
    const double highest = host.high() - margin - reachOf(outline, {0, 1}, 1);
    foot.along = lowest <= highest
                     ? std::clamp(foot.along, lowest, highest)
                     : std::clamp(0.5 * (lowest + highest), host.low() + 2 * margin, host.high() - 2 * margin);
}

struct Pair
{
    DVec2 direction; ///< Unit, from the first to the second.
    double distance;
    double radius;
    double firstReach;
    double secondReach;
};

Pair pairOf(SheetPlan& sheets, const TubeFoot& first, const TubeFoot& second)
{
    Pair pair{};
    pair.radius = 0.5 * (first.radius + second.radius);
    const DVec2 way(nearestTurn(second.angle - first.angle) * pair.radius, second.along - first.along);
    pair.distance = glm::length(way);
    // Branches that leave at one place go up in the order in which they were drawn.
    pair.direction = pair.distance > 1e-6 * pair.radius ? way / pair.distance : DVec2(0, 1);
    pair.firstReach = reachOf(outlineOf(sheets, first), pair.direction, pair.radius);
    pair.secondReach = reachOf(outlineOf(sheets, second), -pair.direction, pair.radius);
    return pair;
}

bool standsBefore(const TubeFoot& a, const TubeFoot& b)
{
    return a.along != b.along ? a.along < b.along : a.tube < b.tube;
}

/// Calls visit(first, second) for all feet of a host that might touch. Of a crowd nobody drew, some pairs are left out:
/// if they overlap, one will be lost.
template <class Visit>
void forNeighbours(std::span<TubeFoot> feet, Visit visit)
{
    std::sort(feet.begin(), feet.end(), standsBefore);
    double largest = 0;
    for (const TubeFoot& foot : feet)
        largest = std::max(largest, foot.size);
    for (std::size_t i = 0; i < feet.size(); ++i)
    {
        const std::size_t end = std::min(feet.size(), i + kCrowd);
        for (std::size_t k = i + 1; k < end; ++k)
        {
            const double apart = std::abs(feet[k].along - feet[i].along);
            if (apart > 2 * (feet[i].size + largest))
                break;
            if (!feet[i].isLost && !feet[k].isLost && apart < 1.2 * (feet[i].size + feet[k].size))
                visit(feet[i], feet[k]);
        }
    }
}

/// Feet on one host are moved apart a little, then clipped along lines between them.
void makeRoom(const Host& host, SheetPlan& sheets, std::span<TubeFoot> feet)
{
    for (TubeFoot& foot : feet)
        bringInRange(host, sheets, foot);
    for (int push = 0; push < kPushes; ++push)
    {
        bool isMoved = false;
        forNeighbours(feet, [&](TubeFoot& first, TubeFoot& second) {
            const Pair pair = pairOf(sheets, first, second);
            const double wanted = kElbowRoom * (pair.firstReach + pair.secondReach);
            if (pair.distance >= wanted || !(wanted > 0))
                return;
            const DVec2 way = pair.direction * (0.6 * (wanted - pair.distance));
            const double share = pair.secondReach / (pair.firstReach + pair.secondReach); // the smaller one yields
            first.angle -= share * way.x / pair.radius;
            first.along -= share * way.y;
            second.angle += (1 - share) * way.x / pair.radius;
            second.along += (1 - share) * way.y;
            bringInRange(host, sheets, first);
            bringInRange(host, sheets, second);
            isMoved = true;
        });
        if (!isMoved)
            break;
    }
    forNeighbours(feet, [&](TubeFoot& first, TubeFoot& second) {
        const Pair pair = pairOf(sheets, first, second);
        const double reach = pair.firstReach + pair.secondReach;
        const double room = (1 - kGap) * pair.distance;
        if (reach <= room)
            return;
        clip(outlineOf(sheets, first), pair.direction, pair.radius, room * pair.firstReach / reach);
        clip(outlineOf(sheets, second), -pair.direction, pair.radius, room * pair.secondReach / reach);
    });
    for (TubeFoot& foot : feet)
    {
        const std::span<DVec2> outline = outlineOf(sheets, foot);
        const double margin = std::min(0.15 * host.facetAt(foot.along), 0.1 * (host.high() - host.low()));
        clip(outline, {0, -1}, 1, foot.along - host.low() - margin);
        clip(outline, {0, 1}, 1, host.high() - margin - foot.along);
        foot.low = foot.along - reachOf(outline, {0, -1}, 1);
        foot.high = foot.along + reachOf(outline, {0, 1}, 1);
        const double width = foot.radius * (reachOf(outline, {1, 0}, 1) + reachOf(outline, {-1, 0}, 1));
        foot.isLost = foot.isLost || width < kSmallestFoot * foot.size ||
                      foot.high - foot.low < kSmallestFoot * foot.size || !(foot.along - host.low() > margin) ||
                      !(host.high() - foot.along > margin);
    }
}

/// Metres between a place and an outline, both seen from the outline's middle; 0 inside.
double distanceTo(std::span<const DVec2> outline, const DVec2& place, double radius)
{
    const DVec2 metric(radius, 1);
    double nearest = 1e60; // squared: roots keep order
    bool isInside = true;
    for (std::size_t j = 0; j < outline.size(); ++j)
    {
        const DVec2 a = outline[j] * metric;
        const DVec2 b = outline[j + 1 == outline.size() ? 0 : j + 1] * metric;
        const DVec2 side = b - a;
        const double square = glm::dot(side, side);
        const double t = square > 0 ? std::clamp(glm::dot(place - a, side) / square, 0., 1.) : 0;
        const DVec2 way = place - a - side * t;
        nearest = std::min(nearest, glm::dot(way, way));
        // In the wedge of this side, which only one is: the outline is a star.
        if (crossOf(a, place) >= 0 && crossOf(place, b) > 0)
            isInside = crossOf(side, place - a) > 0;
    }
    return isInside ? 0 : std::sqrt(nearest);
}

/// A band while it is cut.
struct Band
{
    double low;
    double high;
    std::size_t firstFoot; ///< In the order of their lower ends.
    std::size_t endFoot;
};

/// What is given up where a band cannot be cut.
enum class Loss : std::uint8_t
{
    OneFoot,
    WholeBand,
};

/// One host's bands and their triangles.
class SheetPlanner
{
public:
    SheetPlanner(const Host& host, SheetPlan& plan, std::span<TubeFoot> feet, Loss loss)
        : host_(host), plan_(plan), feet_(feet), loss_(loss)
    {
        plan_.order.clear();
        for (std::uint32_t i = 0; i < feet_.size(); ++i)
        {
            if (!feet_[i].isLost)
                plan_.order.push_back(i);
        }
        std::sort(plan_.order.begin(), plan_.order.end(), [this](std::uint32_t a, std::uint32_t b) {
            return feet_[a].low != feet_[b].low ? feet_[a].low < feet_[b].low : a < b;
        });
    }

    [[nodiscard]] bool isEmpty() const { return plan_.order.empty(); }

    /// Appends the sheet. False if a foot was lost over it: it is marked, and all is to be planned again.
    bool plan()
    {
        TubeSheet sheet{.firstRow = static_cast<std::uint32_t>(plan_.rows.size()),
                        .firstBand = static_cast<std::uint32_t>(plan_.bands.size())};
        std::size_t ring = 0;
        for (std::size_t foot = 0; foot < plan_.order.size();)
        {
            const Band band = gather(foot);
            foot = band.endFoot;
            for (; ring + 1 < host_.rings.size() && alongOf(ring) < band.low; ++ring)
                addRow({.ring = static_cast<std::uint32_t>(ring)}, sheet);
            addRow(host_.rowAt(band.low), sheet);
            SheetBand planned{.lowerRow = static_cast<std::uint32_t>(plan_.rows.size()) - sheet.firstRow - 1};
            addRow(host_.rowAt(band.high), sheet);
            // Rows are told apart by single precision; on a thread of a host whole feet may lie between two of them.
            if (plan_.rows.size() - sheet.firstRow != planned.lowerRow + 2u)
                return lose(band, footAt(band.firstFoot));
            while (ring + 1 < host_.rings.size() && alongOf(ring) <= band.high)
                ++ring;
            if (!cut(band, planned))
                return false;
            plan_.bands.push_back(planned);
        }
        for (; ring < host_.rings.size(); ++ring)
            addRow({.ring = static_cast<std::uint32_t>(ring)}, sheet);
        sheet.rowCount = static_cast<std::uint32_t>(plan_.rows.size()) - sheet.firstRow;
        sheet.bandCount = static_cast<std::uint32_t>(plan_.bands.size()) - sheet.firstBand;
        plan_.sheets.push_back(sheet);
        return true;
    }

private:
    [[nodiscard]] double alongOf(std::size_t ring) const { return static_cast<double>(host_.rings[ring].along); }
    [[nodiscard]] TubeFoot& footAt(std::size_t place) { return feet_[plan_.order[place]]; }

    void addRow(const SheetRow& row, const TubeSheet& sheet)
    {
        const bool isThere = plan_.rows.size() > sheet.firstRow && plan_.rows.back().ring == row.ring &&
                             plan_.rows.back().rise == row.rise;
        if (!isThere)
            plan_.rows.push_back(row);
    }

    /// The end of a band: a ring that is near, or where it was.
    [[nodiscard]] double snapped(double along, double facet) const
    {
        const std::size_t i = host_.ringBefore(along);
        const bool nextIsNearer = i + 2 < host_.rings.size() && alongOf(i + 1) - along < along - alongOf(i);
        const double nearest = alongOf(nextIsNearer ? i + 1 : i);
        return std::abs(nearest - along) < kSnap * facet ? nearest : along;
    }

    Band gather(std::size_t foot)
    {
        const auto lowEnd = [&](std::size_t i) { return footAt(i).low - kBandMargin * host_.facetAt(footAt(i).along); };
        const auto highEnd = [&](std::size_t i) {
            return footAt(i).high + kBandMargin * host_.facetAt(footAt(i).along);
        };
        Band band{.low = lowEnd(foot), .high = highEnd(foot), .firstFoot = foot, .endFoot = foot + 1};
        double facet = host_.facetAt(footAt(foot).along);
        for (; band.endFoot < plan_.order.size(); ++band.endFoot)
        {
            facet = std::max(facet, host_.facetAt(footAt(band.endFoot).along));
            if (lowEnd(band.endFoot) > band.high + kBandGap * facet)
                break;
            band.low = std::min(band.low, lowEnd(band.endFoot));
            band.high = std::max(band.high, highEnd(band.endFoot));
        }
        const double clear = 0.1 * facet;
        const double snappedLow = snapped(std::max(band.low, host_.low()), host_.facetAt(band.low));
        const double snappedHigh = snapped(std::min(band.high, host_.high()), host_.facetAt(band.high));
        double lowest = host_.high();
        double highest = host_.low();
        for (std::size_t i = band.firstFoot; i < band.endFoot; ++i)
        {
            lowest = std::min(lowest, footAt(i).low);
            highest = std::max(highest, footAt(i).high);
        }
        band.low = snappedLow < lowest - clear ? snappedLow : std::max(band.low, host_.low());
        band.high = snappedHigh > highest + clear ? snappedHigh : std::min(band.high, host_.high());
        return band;
    }

    [[nodiscard]] UnrolledPoint unrolled(double angle, double along) const
    {
        const double turned = angle / kTurn - std::floor(angle / kTurn);
        const auto x = static_cast<std::int64_t>(turned * static_cast<double>(kUnrolledTurn) + 0.5);
        return {x >= kUnrolledTurn ? 0 : x, static_cast<std::int64_t>((along - low_) * scale_ + 0.5)};
    }

    bool cut(const Band& band, SheetBand& planned)
    {
        SheetTriangulation& triangulation = plan_.triangulation;
        const double radius = std::max(host_.radiusAt(0.5 * (band.low + band.high)), 1e-9);
        low_ = band.low;
        scale_ = static_cast<double>(kUnrolledTurn) / (kTurn * radius);
        const double height = band.high - band.low;
        scale_ = std::clamp(scale_, 65536 / height, static_cast<double>(kUnrolledHeight / 2) / height);
        height_ = static_cast<std::int64_t>(height * scale_ + 0.5);
        triangulation.begin(host_.sides, height_);

        planned.firstPoint = static_cast<std::uint32_t>(plan_.points.size());
        for (std::size_t i = band.firstFoot; i < band.endFoot; ++i)
        {
            if (!insertFoot(footAt(i)))
                return lose(band, footAt(i));
        }
        std::uint32_t number = 2 * host_.sides;
        for (std::size_t i = band.firstFoot; i < band.endFoot; ++i)
        {
            plan_.loop.clear();
            for (std::uint32_t j = 0; j < footAt(i).count; ++j)
                plan_.loop.push_back(number++);
            if (!triangulation.fixLoop(plan_.loop) || !triangulation.cutOut(plan_.loop))
                return lose(band, footAt(i));
        }
        insertVertices(band);
        triangulation.settle();
        planned.pointCount = static_cast<std::uint32_t>(plan_.points.size()) - planned.firstPoint;
        for (std::size_t i = band.firstFoot; i < band.endFoot; ++i)
            footAt(i).band = static_cast<std::uint32_t>(plan_.bands.size());
        numberCorners(planned);
        return true;
    }

    bool lose(const Band& band, TubeFoot& foot)
    {
        foot.isLost = true;
        for (std::size_t i = band.firstFoot; loss_ == Loss::WholeBand && i < band.endFoot; ++i)
            footAt(i).isLost = true;
        return false;
    }

    bool insertFoot(TubeFoot& foot)
    {
        foot.firstPoint = static_cast<std::uint32_t>(plan_.points.size());
        for (const DVec2& offset : outlineOf(plan_, foot))
        {
            const double angle = foot.angle + offset.x;
            const double along = foot.along + offset.y;
            if (!insert(angle, along))
                return false;
        }
        return true;
    }

    bool insert(double angle, double along)
    {
        const UnrolledPoint point = unrolled(angle, along);
        if (point.y <= 0 || point.y >= height_ || plan_.triangulation.insert(point) == SheetTriangulation::kNoPoint)
            return false;
        SheetPoint place = host_.pointAt(angle, along);
        if (point.x == 0 && place.column > 0) // rounded on to the seam: where a turn begins, not where it ends
        {
            place.column = 0;
            place.share = 0;
        }
        plan_.points.push_back(place);
        return true;
    }

    /// The host's own vertices where its rings lie inside the band, and more near feet, so that the cut follows its
    /// facets.
    void insertVertices(const Band& band)
    {
        const double facet = host_.facetAt(0.5 * (band.low + band.high));
        std::vector<double>& levels = plan_.levels;
        levels.clear();
        for (std::size_t i = host_.ringBefore(band.low); i + 1 < host_.rings.size() && alongOf(i) < band.high; ++i)
        {
            if (alongOf(i) > band.low && (levels.empty() || alongOf(i) > levels.back()))
                levels.push_back(alongOf(i));
        }
        const std::size_t own = levels.size();
        const double height = band.high - band.low;
        const auto more = static_cast<std::size_t>(std::clamp(height / facet - 0.5, 0., kMostLevels));
        for (std::size_t i = 1; i <= more; ++i)
        {
            const double level = band.low + height * static_cast<double>(i) / static_cast<double>(more + 1);
            const auto beyond =
                std::lower_bound(levels.begin(), levels.begin() + static_cast<std::ptrdiff_t>(own), level);
            const bool isNear =
                (beyond != levels.begin() + static_cast<std::ptrdiff_t>(own) && *beyond - level < 0.4 * facet) ||
                (beyond != levels.begin() && level - *(beyond - 1) < 0.4 * facet);
            if (!isNear)
                levels.push_back(level);
        }
        // Upwards; what stands on one column is joined, so that no triangle cuts across a ridge, but where a foot
        // stands in between, or so near that only slivers would fit.
        std::sort(levels.begin(), levels.end());
        plan_.columns.assign(host_.sides, {});
        for (std::uint32_t j = 0; j < host_.sides; ++j)
            plan_.columns[j] = {.point = j, .along = band.low, .coveredTo = band.low - 1};
        plan_.lines.clear();
        std::size_t reached = band.firstFoot; // up to here feet have begun
        std::size_t behind = band.firstFoot;  // up to here all have ended
        for (const double level : levels)
        {
            for (; reached < band.endFoot && footAt(reached).low <= level; ++reached)
                coverColumns(footAt(reached), facet);
            while (behind < band.endFoot && footAt(behind).high + kFineReach * facet < level)
                ++behind;
            const bool isRing = isOwn(level);
            for (std::uint32_t j = 0; j < host_.sides; ++j)
            {
                const double angle = kTurn * j / host_.sides;
                const double distance = distanceToFeet(band, behind, angle, level, facet);
                if (distance <= kClearance * facet || !(isRing || distance < kFineReach * facet))
                    continue;
                if (const std::uint32_t point = insertColumn(j, angle, level); point != SheetTriangulation::kNoPoint)
                    joinColumn(j, point, level);
            }
        }
        for (; reached < band.endFoot; ++reached)
            coverColumns(footAt(reached), facet);
        for (std::uint32_t j = 0; j < host_.sides; ++j)
            joinColumn(j, host_.sides + j, band.high);
        for (const auto& [low, high] : plan_.lines)
            (void)plan_.triangulation.fixSide(low, high);
    }

    void joinColumn(std::uint32_t j, std::uint32_t point, double along)
    {
        SheetColumn& column = plan_.columns[j];
        if (column.coveredTo < column.along)
            plan_.lines.push_back({column.point, point});
        column.point = point;
        column.along = along;
    }

    /// Notes the columns that a foot stands on, or nearly.
    void coverColumns(const TubeFoot& foot, double facet)
    {
        const std::span<const DVec2> outline = outlineOf(plan_, foot);
        const double room = kSliver * facet / foot.radius;
        const double right = reachOf(outline, {1, 0}, 1) + room;
        const double left = reachOf(outline, {-1, 0}, 1) + room;
        for (std::uint32_t j = 0; j < host_.sides; ++j)
        {
            const double way = nearestTurn(kTurn * j / host_.sides - foot.angle);
            if (way < right && way > -left)
                plan_.columns[j].coveredTo = std::max(plan_.columns[j].coveredTo, foot.high);
        }
    }

    /// True if a ring of the host lies there.
    [[nodiscard]] bool isOwn(double level) const
    {
        const std::size_t i = host_.ringBefore(level);
        return alongOf(i) == level || alongOf(i + 1) == level;
    }

    /// Like `insert`, exactly on a column. The point's number.
    std::uint32_t insertColumn(std::uint32_t column, double angle, double along)
    {
        UnrolledPoint point = unrolled(angle, along);
        point.x = kUnrolledTurn * column / host_.sides;
        if (point.y <= 0 || point.y >= height_)
            return SheetTriangulation::kNoPoint;
        const std::uint32_t number = plan_.triangulation.insert(point);
        if (number == SheetTriangulation::kNoPoint)
            return number;
        SheetPoint place = host_.pointAt(0, along);
        place.column = column;
        plan_.points.push_back(place);
        return number;
    }

    /// From the nearest of the feet that are not below, if it is near.
    double distanceToFeet(const Band& band, std::size_t behind, double angle, double along, double facet)
    {
        double nearest = 1e30;
        for (std::size_t i = behind; i < band.endFoot; ++i)
        {
            const TubeFoot& foot = footAt(i);
            if (along < foot.low - kFineReach * facet)
                break;
            if (along > foot.high + kFineReach * facet)
                continue;
            const DVec2 place(nearestTurn(angle - foot.angle) * foot.radius, along - foot.along);
            // Its outline has only shrunk since its size was taken.
            const double farthest = foot.size + 1.01 * kFineReach * facet;
            if (glm::dot(place, place) > farthest * farthest)
                continue;
            nearest = std::min(nearest, distanceTo(outlineOf(plan_, foot), place, foot.radius));
        }
        return nearest;
    }

    /// Triangles as numbers of vertices; whatever reaches over the seam, where u starts anew, gets copies beyond it.
    void numberCorners(SheetBand& planned)
    {
        const std::vector<UnrolledPoint>& points = plan_.triangulation.points();
        const std::uint32_t stride = host_.sides + 1;
        const std::uint32_t count = 2 * stride + planned.pointCount;
        planned.firstCopy = static_cast<std::uint32_t>(plan_.copies.size());
        planned.firstCorner = static_cast<std::uint32_t>(plan_.corners.size());
        plan_.numbers.assign(count, SheetTriangulation::kNoPoint);
        const auto numberOf = [&](std::uint32_t point) {
            return point < host_.sides ? point : point < 2 * host_.sides ? point + 1 : point + 2;
        };
        for (const SheetTriangle& triangle : plan_.triangulation.triangles())
        {
            if (triangle.removed)
                continue;
            std::array<std::int64_t, 3> x{};
            bool isBefore = false;
            for (std::size_t k = 0; k < 3; ++k)
            {
                const std::int64_t here = points[triangle.corners[k]].x;
                const std::int64_t way = here - points[triangle.corners[0]].x;
                const std::int64_t turns = way > kUnrolledTurn / 2 ? -1 : way < -kUnrolledTurn / 2 ? 1 : 0;
                x[k] = turns;
                isBefore = isBefore || turns < 0;
            }
            for (std::size_t k = 0; k < 3; ++k)
            {
                const std::uint32_t number = numberOf(triangle.corners[k]);
                if (x[k] + (isBefore ? 1 : 0) == 0)
                    plan_.corners.push_back(number);
                else if (number == 0 || number == stride)
                    plan_.corners.push_back(number + host_.sides);
                else
                {
                    std::uint32_t& copy = plan_.numbers[number];
                    if (copy == SheetTriangulation::kNoPoint)
                    {
                        copy = count + static_cast<std::uint32_t>(plan_.copies.size()) - planned.firstCopy;
                        plan_.copies.push_back(number);
                    }
                    plan_.corners.push_back(copy);
                }
            }
        }
        planned.copyCount = static_cast<std::uint32_t>(plan_.copies.size()) - planned.firstCopy;
        planned.cornerCount = static_cast<std::uint32_t>(plan_.corners.size()) - planned.firstCorner;
    }

    const Host host_;
    SheetPlan& plan_;
    std::span<TubeFoot> feet_;
    Loss loss_;
    double low_ = 0;
    double scale_ = 1;
    std::int64_t height_ = 1;
};

void noteSegments(const TubePlan& plan)
{
    TubeScratch& scratch = plan.scratch;
    scratch.sheets.tubeOf.assign(plan.skeleton.size(), kNoSheet);
    for (std::uint32_t t = 0; t < scratch.tubes.size(); ++t)
    {
        const std::uint32_t first = scratch.tubes[t].segment;
        for (std::uint32_t i = first; i != kNoSegment; i = plan.skeleton.continuations[i])
        {
            if (i != first && !isJoined(plan.skeleton, i))
                break;
            scratch.sheets.tubeOf[i] = t;
        }
    }
}

/// Back to the state before a sheet was begun.
struct PlanMark
{
    std::size_t rows, bands, points, copies, corners;

    explicit PlanMark(const SheetPlan& plan)
        : rows(plan.rows.size()), bands(plan.bands.size()), points(plan.points.size()), copies(plan.copies.size()),
          corners(plan.corners.size())
    {}

    void restore(SheetPlan& plan) const
    {
        plan.rows.resize(rows);
        plan.bands.resize(bands);
        plan.points.resize(points);
        plan.copies.resize(copies);
        plan.corners.resize(corners);
    }
};

} // namespace

void planWelds(const TubePlan& plan)
{
    TubeScratch& scratch = plan.scratch;
    SheetPlan& sheets = scratch.sheets;
    sheets.feet.clear();
    sheets.offsets.clear();
    sheets.sheets.clear();
    sheets.rows.clear();
    sheets.bands.clear();
    sheets.points.clear();
    sheets.copies.clear();
    sheets.corners.clear();
    noteSegments(plan);
    for (std::uint32_t t = 0; t < scratch.tubes.size(); ++t)
    {
        const Tube& tube = scratch.tubes[t];
        if (!isJoined(plan.skeleton, tube.segment) || !tube.collar.isLaid)
            continue;
        TubeFoot foot{.host = sheets.tubeOf[plan.skeleton.parents[tube.segment]]};
        const std::size_t offsets = sheets.offsets.size();
        if (foot.host != kNoSheet && layFoot(plan, t, foot))
            sheets.feet.push_back(foot);
        else
            sheets.offsets.resize(offsets);
    }
    std::sort(sheets.feet.begin(), sheets.feet.end(), [](const TubeFoot& a, const TubeFoot& b) {
        return a.host != b.host ? a.host < b.host : standsBefore(a, b);
    });

    for (std::size_t first = 0, end = 0; first < sheets.feet.size(); first = end)
    {
        const std::uint32_t tube = sheets.feet[first].host;
        while (end < sheets.feet.size() && sheets.feet[end].host == tube)
            ++end;
        const Host host = hostOf(scratch, tube);
        const std::span<TubeFoot> feet = std::span(sheets.feet).subspan(first, end - first);
        makeRoom(host, sheets, feet);
        const PlanMark mark(sheets);
        for (int losses = 0;; ++losses)
        {
            SheetPlanner planner(host, sheets, feet, losses < kSingleLosses ? Loss::OneFoot : Loss::WholeBand);
            if (planner.isEmpty())
                break;
            if (planner.plan())
            {
                scratch.tubes[tube].sheet = static_cast<std::uint32_t>(sheets.sheets.size()) - 1;
                sheets.sheets.back().firstFoot = static_cast<std::uint32_t>(first);
                sheets.sheets.back().footCount = static_cast<std::uint32_t>(feet.size());
                break;
            }
            mark.restore(sheets);
        }
    }
    for (std::uint32_t i = 0; i < sheets.feet.size(); ++i)
    {
        if (sheets.feet[i].isLost)
            continue;
        Tube& tube = scratch.tubes[sheets.feet[i].tube];
        tube.foot = i;
        tube.baseVertices = 0;
        --scratch.embedded;
    }
}

} // namespace espalier
