#include <Espalier/Mesh/ConvexHull.h>

#include <algorithm>
#include <cmath>

// Departure from the paper: no merged facets and no thick planes. On the grid a point is outside, inside or exactly in
// a plane, and one in the plane is not outside; so triangles stay as they are and nothing has to be repaired.

namespace espalier {
namespace {

using Point = HullScratch::Point;
using Face = HullScratch::Face;

/// Cells across the points. Differences then have 20 bits, cross products 40, volumes 61: all exact in 64.
constexpr double kCells = 1 << 19;

constexpr std::uint32_t kNone = 0xffffffffu;

Point minus(const Point& a, const Point& b)
{
    return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

Point crossed(const Point& a, const Point& b)
{
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

std::int64_t dotted(const Point& a, const Point& b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

double lengthOf(const Point& a)
{
    const auto x = static_cast<double>(a[0]);
    const auto y = static_cast<double>(a[1]);
    const auto z = static_cast<double>(a[2]);
    return std::sqrt(x * x + y * y + z * z);
}

DVec3 real(const Point& a)
{
    return {static_cast<double>(a[0]), static_cast<double>(a[1]), static_cast<double>(a[2])};
}

class HullBuilder
{
public:
    HullBuilder(std::span<const Vec3> given, HullScratch& scratch) : given_(given), s_(scratch) {}

    HullResult build(std::uint32_t mostVertices)
    {
        if (const HullResult result = snap(); result != HullResult::Ok)
            return result;
        if (const HullResult result = begin(); result != HullResult::Ok)
            return result;
        for (std::uint32_t added = 4; added < std::max(mostVertices, 4u); ++added)
        {
            const std::uint32_t face = farthestFace();
            if (face == kNone)
                break;
            add(s_.faces[face].farthest, face);
        }
        return HullResult::Ok;
    }

    void write(ConvexHull& hull)
    {
        // About whichever middle it takes less. The box' lies in the hull from some number of vertices on.
        Enlargement best = enlargement(middle_);
        if (const Enlargement other = enlargement(boxMiddle_); other.factor > 0 && other.overreach < best.overreach)
            best = other;
        s_.indexOf.assign(s_.points.size(), kNone);
        for (const Face& face : s_.faces)
        {
            if (!face.isAlive)
                continue;
            for (const std::uint32_t corner : face.corners)
            {
                if (s_.indexOf[corner] == kNone)
                {
                    s_.indexOf[corner] = static_cast<std::uint32_t>(hull.vertices.size());
                    const DVec3 place(given_[corner]);
                    const DVec3 middle = origin_ + cell_ * best.middle;
                    hull.vertices.push_back(best.factor > 1 ? Vec3(middle + best.factor * (place - middle))
                                                            : given_[corner]);
                }
                hull.indices.push_back(s_.indexOf[corner]);
            }
        }
        // Half a cell in each coordinate of a point and of a corner, and single precision.
        const DVec3 largest = glm::max(-origin_, origin_ + cell_ * kCells);
        hull.tolerance = static_cast<float>(2 * cell_ + 1e-6 * std::max({largest.x, largest.y, largest.z}));
        hull.overreach = static_cast<float>(best.overreach * cell_);
    }

private:
    HullResult snap()
    {
        if (given_.empty())
            return HullResult::NoPoints;
        DVec3 low(given_[0]);
        DVec3 high(given_[0]);
        for (const Vec3& point : given_)
        {
            for (int i = 0; i < 3; ++i)
                if (!(std::abs(point[i]) <= 1e30f))
                    return HullResult::NotFinite;
            low = glm::min(low, DVec3(point));
            high = glm::max(high, DVec3(point));
        }
        const DVec3 size = high - low;
        const double extent = std::max({size.x, size.y, size.z});
        if (!(extent > 0))
            return HullResult::OnePlace;
        origin_ = low;
        cell_ = extent / kCells;
        boxMiddle_ = 0.5 * size / cell_;
        s_.points.clear();
        for (const Vec3& point : given_)
        {
            const DVec3 at = (DVec3(point) - low) / cell_ + 0.5;
            s_.points.push_back(
                {static_cast<std::int64_t>(at.x), static_cast<std::int64_t>(at.y), static_cast<std::int64_t>(at.z)});
        }
        return HullResult::Ok;
    }

    /// The point for which `measure` is largest; the first among equals.
    template <class Measure>
    [[nodiscard]] std::uint32_t best(const Measure& measure) const
    {
        std::uint32_t found = 0;
        for (std::uint32_t i = 1; i < s_.points.size(); ++i)
            if (measure(s_.points[i]) > measure(s_.points[found]))
                found = i;
        return found;
    }

    /// A tetrahedron of points that are far apart, and what lies outside of it.
    HullResult begin()
    {
        std::array<std::uint32_t, 2> ends{};
        std::int64_t widest = -1;
        for (std::size_t axis = 0; axis < 3; ++axis)
        {
            const std::uint32_t low = best([&](const Point& p) { return -p[axis]; });
            const std::uint32_t high = best([&](const Point& p) { return p[axis]; });
            if (const std::int64_t width = s_.points[high][axis] - s_.points[low][axis]; width > widest)
            {
                widest = width;
                ends = {low, high};
            }
        }
        const Point a = s_.points[ends[0]];
        const Point along = minus(s_.points[ends[1]], a);
        const std::uint32_t third = best([&](const Point& p) { return lengthOf(crossed(along, minus(p, a))); });
        const Point normal = crossed(along, minus(s_.points[third], a));
        if (normal == Point{})
            return HullResult::Collinear;
        const std::uint32_t fourth = best([&](const Point& p) { return std::abs(dotted(normal, minus(p, a))); });
        const std::int64_t volume = dotted(normal, minus(s_.points[fourth], a));
        if (volume == 0)
            return HullResult::Coplanar;

        std::array<std::uint32_t, 4> corners{ends[0], ends[1], third, fourth};
        if (volume > 0)
            std::swap(corners[0], corners[1]); // the fourth corner below the plane of the first three
        middle_ = DVec3(0);
        for (const std::uint32_t corner : corners)
            middle_ += 0.25 * real(s_.points[corner]);
        s_.faces.clear();
        s_.next.assign(s_.points.size(), kNone);
        s_.faceFrom.assign(s_.points.size(), kNone);
        const auto [p, q, r, t] = corners;
        addFace({p, q, r}, {1, 2, 3});
        addFace({q, p, t}, {0, 3, 2});
        addFace({r, q, t}, {0, 1, 3});
        addFace({p, r, t}, {0, 2, 1});
        s_.orphans.clear();
        for (std::uint32_t i = 0; i < s_.points.size(); ++i)
            s_.orphans.push_back(i);
        giveOut(0);
        return HullResult::Ok;
    }

    void addFace(const std::array<std::uint32_t, 3>& corners, const std::array<std::uint32_t, 3>& neighbours)
    {
        Face face{.corners = corners, .neighbours = neighbours, .firstOutside = kNone};
        const Point a = s_.points[corners[0]];
        face.normal = crossed(minus(s_.points[corners[1]], a), minus(s_.points[corners[2]], a));
        face.offset = dotted(face.normal, a);
        s_.faces.push_back(face);
    }

    /// Positive outside.
    [[nodiscard]] std::int64_t sideOf(const Face& face, std::uint32_t point) const
    {
        return dotted(face.normal, s_.points[point]) - face.offset;
    }

    /// Each orphan goes to the first face from `firstFace` on that it is outside of; those inside of all are done with.
    void giveOut(std::uint32_t firstFace)
    {
        for (const std::uint32_t point : s_.orphans)
            for (std::uint32_t i = firstFace; i < s_.faces.size(); ++i)
            {
                Face& face = s_.faces[i];
                const std::int64_t side = sideOf(face, point);
                if (side <= 0)
                    continue;
                const double distance = static_cast<double>(side) / lengthOf(face.normal);
                // Of equal ones the lowest: the order of the orphans is that of chains.
                if (distance > face.distance || (distance == face.distance && point < face.farthest))
                {
                    face.distance = distance;
                    face.farthest = point;
                }
                s_.next[point] = face.firstOutside;
                face.firstOutside = point;
                break;
            }
    }

    [[nodiscard]] std::uint32_t farthestFace() const
    {
        std::uint32_t found = kNone;
        double distance = 0;
        for (std::uint32_t i = 0; i < s_.faces.size(); ++i)
            if (s_.faces[i].isAlive && s_.faces[i].distance > distance)
            {
                distance = s_.faces[i].distance;
                found = i;
            }
        return found;
    }

    /// Replaces all faces that `point` is outside of by a fan from their rim to it.
    void add(std::uint32_t point, std::uint32_t seenFace)
    {
        s_.visible.assign(1, seenFace);
        s_.faces[seenFace].isVisible = true;
        s_.horizon.clear();
        for (std::size_t i = 0; i < s_.visible.size(); ++i)
        {
            const std::uint32_t here = s_.visible[i];
            for (std::size_t k = 0; k < 3; ++k)
            {
                const std::uint32_t other = s_.faces[here].neighbours[k];
                if (s_.faces[other].isVisible)
                    continue;
                if (sideOf(s_.faces[other], point) > 0)
                {
                    s_.faces[other].isVisible = true;
                    s_.visible.push_back(other);
                }
                else
                    s_.horizon.push_back({s_.faces[here].corners[k], s_.faces[here].corners[(k + 1) % 3], other});
            }
        }
        s_.orphans.clear();
        for (const std::uint32_t face : s_.visible)
        {
            s_.faces[face].isAlive = false;
            for (std::uint32_t i = s_.faces[face].firstOutside; i != kNone; i = s_.next[i])
                if (i != point)
                    s_.orphans.push_back(i);
        }
        const auto firstNew = static_cast<std::uint32_t>(s_.faces.size());
        for (const HullScratch::Edge& edge : s_.horizon)
        {
            const auto own = static_cast<std::uint32_t>(s_.faces.size());
            addFace({edge.from, edge.to, point}, {edge.beyond, kNone, kNone});
            s_.faceFrom[edge.from] = own;
            Face& beyond = s_.faces[edge.beyond];
            for (std::size_t k = 0; k < 3; ++k)
                if (beyond.corners[k] == edge.to && beyond.corners[(k + 1) % 3] == edge.from)
                    beyond.neighbours[k] = own;
        }
        for (std::uint32_t i = firstNew; i < s_.faces.size(); ++i)
        {
            const std::uint32_t after = s_.faceFrom[s_.faces[i].corners[1]];
            s_.faces[i].neighbours[1] = after;
            s_.faces[after].neighbours[2] = i;
        }
        giveOut(firstNew);
    }

    struct Enlargement
    {
        DVec3 middle{0};      ///< Cells.
        double factor = 0;    ///< 0 if the middle is not inside.
        double overreach = 0; ///< Cells.
    };

    /// By what factor about a place in it the hull must grow to hold the points that are still outside: 1 if none is.
    [[nodiscard]] Enlargement enlargement(const DVec3& middle)
    {
        s_.orphans.clear();
        for (const Face& face : s_.faces)
            for (std::uint32_t i = face.isAlive ? face.firstOutside : kNone; i != kNone; i = s_.next[i])
                s_.orphans.push_back(i);
        double factor = 1;
        for (const Face& face : s_.faces)
        {
            if (!face.isAlive)
                continue;
            const DVec3 normal = real(face.normal);
            const double plane = glm::dot(normal, real(s_.points[face.corners[0]]) - middle);
            if (!(plane > 0))
                return {};
            for (const std::uint32_t point : s_.orphans)
                factor = std::max(factor, glm::dot(normal, real(s_.points[point]) - middle) / plane);
        }
        double farthest = 0;
        for (const Point& point : s_.points)
            farthest = std::max(farthest, glm::length(real(point) - middle));
        return {middle, factor, (factor - 1) * farthest};
    }

    std::span<const Vec3> given_;
    HullScratch& s_;
    DVec3 origin_{0};
    DVec3 middle_{0};    ///< Of the first tetrahedron: inside, cells.
    DVec3 boxMiddle_{0}; ///< Of all points' box, cells.
    double cell_ = 1;    ///< Metres.
};

} // namespace

void ConvexHull::clear() noexcept
{
    vertices.clear();
    indices.clear();
    tolerance = 0;
    overreach = 0;
}

std::string_view reasonOf(HullResult result) noexcept
{
    switch (result)
    {
    case HullResult::Ok:
        return {};
    case HullResult::NoPoints:
        return "there are no points";
    case HullResult::OnePlace:
        return "all points are in one place";
    case HullResult::Collinear:
        return "all points lie on a line";
    case HullResult::Coplanar:
        return "all points lie in a plane";
    case HullResult::NotFinite:
        return "a coordinate is not finite or too large";
    }
    return {};
}

HullResult convexHull(std::span<const Vec3> points, std::uint32_t mostVertices, HullScratch& scratch, ConvexHull& hull)
{
    hull.clear();
    HullBuilder builder(points, scratch);
    const HullResult result = builder.build(mostVertices);
    if (result == HullResult::Ok)
        builder.write(hull);
    return result;
}

} // namespace espalier
