#include <Espalier/Mesh/Triangulation.h>
#include <algorithm>
#include <cmath>

// Ear clipping: G. H. Meisters, "Polygons Have Ears", Am. Math. Monthly, 1975. Only corners that bend inwards can lie
// in an ear, so only they are looked at. Departure: a corner that touches a corner of the ear does not spoil it,
// because outlines drawn by a turtle often return to where they have been.

namespace espalier {
namespace {

/// Twice an area below this share of the polygon's extent squared is none: rounding of corners on one line.
constexpr double kFlat = 1e-10;

double twiceArea(const DVec2& a, const DVec2& b, const DVec2& c)
{
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

class EarClipper
{
public:
    EarClipper(std::span<const DVec2> corners, std::uint64_t& work, TriangulationScratch& scratch,
               std::vector<std::uint32_t>& triangles)
        : corners_(corners), work_(work), next_(scratch.next), previous_(scratch.previous), reflex_(scratch.reflex),
          triangles_(triangles)
    {}

    void run()
    {
        link();
        std::uint32_t corner = 0;
        const auto count = static_cast<std::uint32_t>(corners_.size());
        for (std::uint32_t i = 0; i < count; ++i)
        {
            if (next_[i] != i && isFlat(i))
                corner = cut(i);
        }
        findReflex();
        for (std::uint32_t failures = 0; left_ > 3 && failures < left_;)
        {
            if (reflex_.empty() || !spend())
                break;
            if (!isEar(corner))
            {
                corner = next_[corner];
                ++failures;
                continue;
            }
            addTriangle(previous_[corner], corner, next_[corner]);
            // On with the one after the next: fans of slivers round one corner look poor.
            corner = next_[cut(corner)];
            failures = 0;
        }
        fan(corner);
    }

private:
    void link()
    {
        const auto count = static_cast<std::uint32_t>(corners_.size());
        DVec2 low = corners_[0];
        DVec2 high = corners_[0];
        next_.resize(count);
        previous_.resize(count);
        for (std::uint32_t i = 0; i < count; ++i)
        {
            next_[i] = i + 1 < count ? i + 1 : 0;
            previous_[i] = i > 0 ? i - 1 : count - 1;
            low = {std::min(low.x, corners_[i].x), std::min(low.y, corners_[i].y)};
            high = {std::max(high.x, corners_[i].x), std::max(high.y, corners_[i].y)};
        }
        const double extent = std::max(high.x - low.x, high.y - low.y);
        flat_ = kFlat * extent * extent;
        left_ = count;
    }

    void findReflex()
    {
        reflex_.clear();
        for (std::uint32_t i = 0; i < next_.size(); ++i)
        {
            if (next_[i] != i && areaAt(i) < 0)
                reflex_.push_back(i);
        }
    }

    bool spend()
    {
        work_ -= work_ > 0 ? 1 : 0;
        return work_ > 0;
    }

    [[nodiscard]] double areaAt(std::uint32_t i) const
    {
        return twiceArea(corners_[previous_[i]], corners_[i], corners_[next_[i]]);
    }

    /// True at corners on a line and at the tips of spikes.
    [[nodiscard]] bool isFlat(std::uint32_t i) const { return std::abs(areaAt(i)) <= flat_; }

    /// True if the corner can be cut off.
    bool isEar(std::uint32_t i)
    {
        if (areaAt(i) <= flat_)
            return false;
        const DVec2 a = corners_[previous_[i]];
        const DVec2 b = corners_[i];
        const DVec2 c = corners_[next_[i]];
        for (std::size_t k = 0; k < reflex_.size();)
        {
            const std::uint32_t other = reflex_[k];
            if (next_[other] == other || areaAt(other) >= 0) // cut off, or bent outwards by what was
            {
                reflex_[k] = reflex_.back();
                reflex_.pop_back();
                continue;
            }
            ++k;
            spend();
            const DVec2 p = corners_[other];
            if (p == a || p == b || p == c)
                continue;
            if (twiceArea(a, b, p) >= 0 && twiceArea(b, c, p) >= 0 && twiceArea(c, a, p) >= 0)
                return false;
        }
        return true;
    }

    /// Cuts a corner off, with all neighbours that are flat then: of the two corners at the foot of a spike, one would
    /// look like an ear. Returns the corner after them.
    std::uint32_t cut(std::uint32_t i)
    {
        std::uint32_t before = previous_[i];
        std::uint32_t after = next_[i];
        for (std::uint32_t gone = i;;)
        {
            next_[before] = after;
            previous_[after] = before;
            next_[gone] = gone;
            --left_;
            if (left_ < 3)
                return after;
            gone = isFlat(before) ? before : after;
            if (!isFlat(gone))
                return after;
            before = previous_[gone];
            after = next_[gone];
        }
    }

    void fan(std::uint32_t first)
    {
        std::uint32_t corner = next_[first];
        for (std::uint32_t k = 2; k < left_; ++k)
        {
            const std::uint32_t after = next_[corner];
            if (twiceArea(corners_[first], corners_[corner], corners_[after]) < 0)
                addTriangle(first, after, corner);
            else
                addTriangle(first, corner, after);
            corner = after;
        }
    }

    void addTriangle(std::uint32_t a, std::uint32_t b, std::uint32_t c)
    {
        if (twiceArea(corners_[a], corners_[b], corners_[c]) > flat_)
            triangles_.insert(triangles_.end(), {a, b, c});
    }

    std::span<const DVec2> corners_;
    std::uint64_t& work_;
    std::vector<std::uint32_t>& next_; ///< A corner that is cut off is its own.
    std::vector<std::uint32_t>& previous_;
    std::vector<std::uint32_t>& reflex_;
    std::vector<std::uint32_t>& triangles_;
    double flat_ = 0;
    std::uint32_t left_ = 0; ///< Corners not cut off.
};

} // namespace

void triangulate(std::span<const DVec2> corners, std::uint64_t& work, TriangulationScratch& scratch,
                 std::vector<std::uint32_t>& triangles)
{
    if (corners.size() >= 3)
        EarClipper(corners, work, scratch, triangles).run();
}

} // namespace espalier
