#include <Espalier/Mesh/SheetTriangulation.h>

// Points: C. L. Lawson, "Software for C1 Surface Interpolation", Mathematical Software III, 1977 (insertion, flips).
// Lines: S. W. Sloan, "A Fast Algorithm for Generating Constrained Delaunay Triangulations", Computers & Structures,
// 1993 (flips until nothing crosses).
// Departure: the plane is rolled up. Every test takes the images of its points that are nearest to one of them, which
// is safe as long as no side spans half of the turn; flips that would make such a side are refused.

namespace espalier {
namespace {

constexpr std::uint32_t kNone = 0xffffffffu;
constexpr std::int64_t kHalf = kUnrolledTurn / 2;
constexpr std::int64_t kWidestSide = kUnrolledTurn * 45 / 100;

constexpr std::uint32_t after(std::uint32_t k)
{
    return k == 2 ? 0 : k + 1;
}
constexpr std::uint32_t before(std::uint32_t k)
{
    return k == 0 ? 2 : k - 1;
}

struct Offset
{
    std::int64_t x;
    std::int64_t y;
};

Offset operator-(Offset a, Offset b)
{
    return {a.x - b.x, a.y - b.y};
}

/// The shortest way from one point to another.
Offset between(UnrolledPoint from, UnrolledPoint to)
{
    std::int64_t x = to.x - from.x;
    if (x > kHalf)
        x -= kUnrolledTurn;
    else if (x < -kHalf)
        x += kUnrolledTurn;
    return {x, to.y - from.y};
}

std::int64_t cross(Offset a, Offset b)
{
    return a.x * b.y - a.y * b.x;
}

/// True if `d` lies inside the circle through a, b and c, by more than rounding.
bool isInCircle(Offset a, Offset b, Offset c, Offset d)
{
    const auto lift = [&](Offset p) {
        const double x = static_cast<double>(p.x - d.x);
        const double y = static_cast<double>(p.y - d.y);
        return std::array<double, 3>{x, y, x * x + y * y};
    };
    const auto [ax, ay, az] = lift(a);
    const auto [bx, by, bz] = lift(b);
    const auto [cx, cy, cz] = lift(c);
    const double first = az * (bx * cy - by * cx);
    const double second = bz * (ax * cy - ay * cx);
    const double third = cz * (ax * by - ay * bx);
    const double size = (az + bz + cz) * (az + bz + cz);
    return first - second + third > 1e-9 * size;
}

} // namespace

void SheetTriangulation::begin(std::uint32_t sides, std::int64_t height)
{
    points_.clear();
    for (const std::int64_t y : {std::int64_t{0}, height})
    {
        for (std::uint32_t j = 0; j < sides; ++j)
            points_.push_back({kUnrolledTurn * j / sides, y});
    }
    triangles_.clear();
    at_.assign(points_.size(), 0);
    for (std::uint32_t j = 0; j < sides; ++j)
    {
        const std::uint32_t next = j + 1 == sides ? 0 : j + 1;
        const std::uint32_t previous = j == 0 ? sides - 1 : j - 1;
        triangles_.push_back({.corners = {j, next, sides + j}, .neighbours = {2 * j + 1, 2 * previous + 1, kNone}});
        triangles_.push_back({.corners = {next, sides + next, sides + j}, .neighbours = {kNone, 2 * j, 2 * next}});
        at_[j] = 2 * j;
        at_[sides + j] = 2 * j;
    }
    last_ = 0;
    isSettled_ = true;
}

/// True if the triangle contains the point; else `outside` is a corner whose opposite side it lies beyond. `on` is the
/// corner opposite of the side that the point lies on, or -1.
bool SheetTriangulation::holds(std::uint32_t triangle, UnrolledPoint point, int& outside, int& on) const
{
    const auto& c = triangles_[triangle].corners;
    const Offset p = between(points_[c[0]], point);
    const std::array<Offset, 3> at{Offset{0, 0}, between(points_[c[0]], points_[c[1]]),
                                   between(points_[c[0]], points_[c[2]])};
    on = -1;
    for (std::uint32_t k = 0; k < 3; ++k)
    {
        const Offset from = at[after(k)];
        const std::int64_t turn = cross(at[before(k)] - from, p - from);
        if (turn < 0)
        {
            outside = static_cast<int>(k);
            return false;
        }
        if (turn == 0)
            on = static_cast<int>(k);
    }
    return true;
}

std::uint32_t SheetTriangulation::locate(UnrolledPoint point) const
{
    int outside = 0;
    int on = 0;
    std::uint32_t triangle = last_;
    for (std::size_t step = 0; step < triangles_.size() && triangle != kNone; ++step)
    {
        if (holds(triangle, point, outside, on))
            return triangle;
        triangle = triangles_[triangle].neighbours[static_cast<std::size_t>(outside)];
    }
    // The walk went round in circles, or off the band on the far side.
    for (std::uint32_t t = 0; t < triangles_.size(); ++t)
    {
        if (holds(t, point, outside, on))
            return t;
    }
    return kNone;
}

void SheetTriangulation::replaceNeighbour(std::uint32_t triangle, std::uint32_t before_, std::uint32_t after_)
{
    if (triangle == kNone)
        return;
    for (std::uint32_t& neighbour : triangles_[triangle].neighbours)
    {
        if (neighbour == before_)
        {
            neighbour = after_;
            return;
        }
    }
}

std::uint32_t SheetTriangulation::insert(UnrolledPoint point)
{
    const std::uint32_t triangle = locate(point);
    if (triangle == kNone)
        return kNoPoint;
    int outside = 0;
    int on = 0;
    (void)holds(triangle, point, outside, on);
    for (const std::uint32_t corner : triangles_[triangle].corners)
    {
        if (points_[corner].x == point.x && points_[corner].y == point.y)
            return kNoPoint;
    }
    const auto id = static_cast<std::uint32_t>(points_.size());
    if (on >= 0)
    {
        const Side side{triangle, static_cast<std::uint32_t>(on)};
        if (triangles_[triangle].neighbours[side.corner] == kNone)
            return kNoPoint;
        points_.push_back(point);
        at_.push_back(triangle);
        insertOnSide(side, id);
    }
    else
    {
        points_.push_back(point);
        at_.push_back(triangle);
        insertInside(triangle, id);
    }
    legalise();
    last_ = at_[id];
    return id;
}

void SheetTriangulation::insertInside(std::uint32_t triangle, std::uint32_t point)
{
    const SheetTriangle old = triangles_[triangle];
    const auto first = static_cast<std::uint32_t>(triangles_.size());
    const std::array<std::uint32_t, 3> ids{triangle, first, first + 1};
    triangles_.resize(triangles_.size() + 2);
    for (std::uint32_t k = 0; k < 3; ++k) // ids[k] stands on the side opposite of corner k
    {
        const std::uint32_t a = old.corners[after(k)];
        triangles_[ids[k]] = {.corners = {point, a, old.corners[before(k)]},
                              .neighbours = {old.neighbours[k], ids[after(k)], ids[before(k)]},
                              .fixed = {old.fixed[k], false, false}};
        at_[a] = ids[k];
        if (k > 0)
            replaceNeighbour(old.neighbours[k], triangle, ids[k]);
        doubtful_.push_back({ids[k], 0});
    }
}

void SheetTriangulation::insertOnSide(Side side, std::uint32_t point)
{
    const std::uint32_t t = side.triangle;
    const SheetTriangle old = triangles_[t];
    const std::uint32_t u = old.neighbours[side.corner];
    const SheetTriangle other = triangles_[u];
    std::uint32_t m = 0;
    while (other.neighbours[m] != t || other.corners[after(m)] != old.corners[before(side.corner)])
        ++m;
    const std::uint32_t k = side.corner;
    const std::uint32_t c = old.corners[k];
    const std::uint32_t a = old.corners[after(k)];
    const std::uint32_t b = old.corners[before(k)];
    const std::uint32_t d = other.corners[m];
    const auto v = static_cast<std::uint32_t>(triangles_.size());
    const std::uint32_t w = v + 1;
    const bool fixed = old.fixed[k];
    triangles_.resize(triangles_.size() + 2);
    // c over a-b, d below; the point splits a-b.
    triangles_[t] = {.corners = {point, c, a},
                     .neighbours = {old.neighbours[before(k)], u, v},
                     .fixed = {old.fixed[before(k)], fixed, false}};
    triangles_[v] = {.corners = {point, b, c},
                     .neighbours = {old.neighbours[after(k)], t, w},
                     .fixed = {old.fixed[after(k)], false, fixed}};
    triangles_[u] = {.corners = {point, a, d},
                     .neighbours = {other.neighbours[after(m)], w, t},
                     .fixed = {other.fixed[after(m)], false, fixed}};
    triangles_[w] = {.corners = {point, d, b},
                     .neighbours = {other.neighbours[before(m)], v, u},
                     .fixed = {other.fixed[before(m)], fixed, false}};
    replaceNeighbour(old.neighbours[after(k)], t, v);
    replaceNeighbour(other.neighbours[before(m)], u, w);
    at_[point] = t;
    at_[a] = t;
    at_[c] = t;
    at_[b] = v;
    at_[d] = u;
    for (const std::uint32_t id : {t, v, u, w})
        doubtful_.push_back({id, 0});
}

/// Turns the diagonal of the two triangles at a side. False if their quad is not strictly convex, or wide.
bool SheetTriangulation::flip(Side side)
{
    const std::uint32_t t = side.triangle;
    const SheetTriangle old = triangles_[t];
    const std::uint32_t k = side.corner;
    const std::uint32_t u = old.neighbours[k];
    if (u == kNone || old.fixed[k])
        return false;
    const SheetTriangle other = triangles_[u];
    const std::uint32_t c = old.corners[k];
    const std::uint32_t a = old.corners[after(k)];
    const std::uint32_t b = old.corners[before(k)];
    std::uint32_t m = 0;
    while (other.corners[after(m)] != b || other.corners[before(m)] != a)
    {
        if (++m == 3)
            return false;
    }
    const std::uint32_t d = other.corners[m];

    const Offset ac = between(points_[a], points_[c]);
    const Offset ab = between(points_[a], points_[b]);
    const Offset ad = between(points_[a], points_[d]);
    const Offset cd = ad - ac;
    if (cd.x > kWidestSide || cd.x < -kWidestSide || cross(ad, ac) <= 0 || cross(ac - ab, ad - ab) <= 0)
        return false;

    triangles_[t] = {.corners = {c, a, d},
                     .neighbours = {other.neighbours[after(m)], u, old.neighbours[before(k)]},
                     .fixed = {other.fixed[after(m)], false, old.fixed[before(k)]}};
    triangles_[u] = {.corners = {d, b, c},
                     .neighbours = {old.neighbours[after(k)], t, other.neighbours[before(m)]},
                     .fixed = {old.fixed[after(k)], false, other.fixed[before(m)]}};
    replaceNeighbour(other.neighbours[after(m)], u, t);
    replaceNeighbour(old.neighbours[after(k)], t, u);
    at_[a] = t;
    at_[c] = t;
    at_[d] = u;
    at_[b] = u;
    return true;
}

bool SheetTriangulation::wantsFlip(Side side) const
{
    const SheetTriangle& triangle = triangles_[side.triangle];
    const std::uint32_t u = triangle.neighbours[side.corner];
    if (u == kNone || triangle.fixed[side.corner])
        return false;
    const std::uint32_t a = triangle.corners[after(side.corner)];
    const std::uint32_t b = triangle.corners[before(side.corner)];
    const std::uint32_t c = triangle.corners[side.corner];
    for (std::uint32_t m = 0; m < 3; ++m)
    {
        const auto& corners = triangles_[u].corners;
        if (corners[after(m)] == b && corners[before(m)] == a)
            return isInCircle(between(points_[a], points_[c]), Offset{0, 0}, between(points_[a], points_[b]),
                              between(points_[a], points_[corners[m]]));
    }
    return false;
}

void SheetTriangulation::legalise()
{
    // Enough for any honest insertion; a bound, should rounding go round in circles.
    std::size_t left = 64 + 8 * triangles_.size();
    while (!doubtful_.empty() && left-- > 0)
    {
        const Side side = doubtful_.back();
        doubtful_.pop_back();
        const std::uint32_t u = triangles_[side.triangle].neighbours[side.corner];
        if (!wantsFlip(side) || !flip(side))
            continue;
        // The four outer sides: each lies opposite of a corner of the new diagonal.
        doubtful_.push_back({side.triangle, 0});
        doubtful_.push_back({side.triangle, 2});
        doubtful_.push_back({u, 0});
        doubtful_.push_back({u, 2});
    }
    doubtful_.clear();
}

void SheetTriangulation::settle()
{
    if (isSettled_)
        return;
    for (std::uint32_t t = 0; t < triangles_.size(); ++t)
    {
        if (triangles_[t].removed)
            continue;
        for (std::uint32_t k = 0; k < 3; ++k)
            doubtful_.push_back({t, k});
    }
    legalise();
}

/// The side from a to b, seen from the triangle to its left.
bool SheetTriangulation::findSide(std::uint32_t a, std::uint32_t b, Side& side) const
{
    // Round `a`, first one way, then, from the band's border, the other.
    const std::uint32_t start = at_[a];
    for (const bool forward : {true, false})
    {
        std::uint32_t t = start;
        do
        {
            const SheetTriangle& triangle = triangles_[t];
            std::uint32_t k = 0;
            while (triangle.corners[k] != a)
                ++k;
            if (triangle.corners[after(k)] == b)
            {
                side = {t, before(k)};
                return true;
            }
            t = triangle.neighbours[forward ? after(k) : before(k)];
        } while (t != kNone && t != start);
        if (t == start)
            break;
    }
    return false;
}

/// True if the sides a-b and c-d cross between their ends.
bool SheetTriangulation::isCrossed(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) const
{
    if (a == c || a == d || b == c || b == d)
        return false;
    const Offset ab = between(points_[a], points_[b]);
    const Offset ac = between(points_[a], points_[c]);
    const Offset ad = between(points_[a], points_[d]);
    const std::int64_t left = cross(ab, ac);
    const std::int64_t right = cross(ab, ad);
    const std::int64_t start = cross(ad - ac, Offset{0, 0} - ac);
    const std::int64_t end = cross(ad - ac, ab - ac);
    return ((left > 0 && right < 0) || (left < 0 && right > 0)) && ((start > 0 && end < 0) || (start < 0 && end > 0));
}

/// The sides that the line from a to b crosses. False if it runs through a point, or over a side that is fixed.
bool SheetTriangulation::gatherCrossings(std::uint32_t a, std::uint32_t b)
{
    crossings_.clear();
    const Offset ab = between(points_[a], points_[b]);
    const auto sideOf = [&](std::uint32_t p) { return cross(ab, between(points_[a], points_[p])); };
    std::uint32_t t = at_[a];
    const std::uint32_t start = t;
    std::uint32_t k = 0;
    for (;;)
    {
        const SheetTriangle& triangle = triangles_[t];
        k = 0;
        while (triangle.corners[k] != a)
            ++k;
        const std::uint32_t p = triangle.corners[after(k)];
        const std::uint32_t q = triangle.corners[before(k)];
        // In the triangle's corner at a; less than half a turn, so both tests suffice.
        if (sideOf(p) < 0 && sideOf(q) > 0)
            break;
        t = triangle.neighbours[after(k)];
        if (t == kNone || t == start)
            return false;
    }
    std::uint32_t right = triangles_[t].corners[after(k)];
    std::uint32_t left = triangles_[t].corners[before(k)];
    for (std::size_t guard = 0; guard < triangles_.size(); ++guard)
    {
        if (triangles_[t].fixed[k] || triangles_[t].neighbours[k] == kNone)
            return false;
        crossings_.push_back({right, left});
        const std::uint32_t u = triangles_[t].neighbours[k];
        std::uint32_t m = 0;
        while (triangles_[u].corners[after(m)] != left)
            ++m;
        const std::uint32_t apex = triangles_[u].corners[m];
        if (apex == b)
            return true;
        const std::int64_t where = sideOf(apex);
        if (where == 0)
            return false;
        t = u;
        // Go on over the side that the line leaves by: opposite of the corner that is dropped.
        if (where > 0)
        {
            k = after(m);
            left = apex;
        }
        else
        {
            k = before(m);
            right = apex;
        }
    }
    return false;
}

bool SheetTriangulation::fixSide(std::uint32_t a, std::uint32_t b)
{
    Side side{};
    if (!findSide(a, b, side))
    {
        if (!gatherCrossings(a, b))
            return false;
        std::size_t left = 64 + crossings_.size() * crossings_.size() * 4;
        for (std::size_t i = 0; i < crossings_.size() && left-- > 0; ++i)
        {
            const auto [p, q] = crossings_[i];
            Side crossing{};
            if (!findSide(p, q, crossing))
                continue;
            const std::uint32_t u = triangles_[crossing.triangle].neighbours[crossing.corner];
            isSettled_ = false;
            if (!flip(crossing))
            {
                crossings_.push_back({p, q});
                continue;
            }
            const std::uint32_t c = triangles_[crossing.triangle].corners[0];
            const std::uint32_t d = triangles_[u].corners[0];
            if (isCrossed(a, b, c, d))
                crossings_.push_back({c, d});
        }
        if (!findSide(a, b, side))
            return false;
    }
    const std::uint32_t t = side.triangle;
    triangles_[t].fixed[side.corner] = true;
    const std::uint32_t u = triangles_[t].neighbours[side.corner];
    if (u == kNone)
        return false;
    for (std::uint32_t m = 0; m < 3; ++m)
    {
        if (triangles_[u].corners[after(m)] == b && triangles_[u].corners[before(m)] == a)
            triangles_[u].fixed[m] = true;
    }
    return true;
}

bool SheetTriangulation::fixLoop(std::span<const std::uint32_t> loop)
{
    for (std::size_t i = 0; i < loop.size(); ++i)
    {
        if (!fixSide(loop[i], loop[i + 1 == loop.size() ? 0 : i + 1]))
            return false;
    }
    return true;
}

bool SheetTriangulation::cutOut(std::span<const std::uint32_t> loop)
{
    Side side{};
    if (!findSide(loop[0], loop[1], side))
        return false;
    doubtful_.assign(1, side);
    triangles_[side.triangle].removed = true;
    bool isInside = true;
    while (!doubtful_.empty())
    {
        const std::uint32_t t = doubtful_.back().triangle;
        doubtful_.pop_back();
        for (std::uint32_t k = 0; k < 3; ++k)
        {
            if (triangles_[t].fixed[k])
                continue;
            const std::uint32_t u = triangles_[t].neighbours[k];
            if (u == kNone)
                isInside = false;
            else if (!triangles_[u].removed)
            {
                triangles_[u].removed = true;
                doubtful_.push_back({u, 0});
            }
        }
    }
    return isInside;
}

} // namespace espalier
