#include <Espalier/Mesh/Thinning.h>

#include <Espalier/Core/Random.h>
#include <Espalier/Plant/Places.h>
#include <algorithm>
#include <cmath>

namespace espalier {

namespace {

/// Where the hashes of branches' places begin.
constexpr Seed kBranches{0x7468696e6e696e67u};

/// A corner further along an axis than so many segments from the last is kept, so that time stays linear.
constexpr std::uint32_t kLongestRun = 32;

/// How wide thinned branches are made, in errors. They end in points and are wider than that where they begin.
constexpr float kThin = 0.45f;

/// How much more few wide twigs, on few others, hide of each other than many thin ones do: measured on the bare birch
/// and oak.
constexpr float kHidden = 0.16f;

/// An axis that ends in a point is made at most so many times as wide as one that does not, to cover the same.
constexpr float kMostPointed = 2;

class Thinner
{
public:
    Thinner(const Skeleton& full, float error, TubeJoints joints, ThinningScratch& scratch, Skeleton& thinned)
        : full_(full), error_(error), thin_(kThin * error), isWelded_(joints == TubeJoints::Weld), scratch_(scratch),
          thinned_(thinned)
    {}

    void thin()
    {
        findAxes();
        markCorners();
        thinned_.clear();
        scratch_.thinnedOf.assign(full_.size(), kNoSegment);
        scratch_.fullOf.clear();
        scratch_.widening.clear();
        scratch_.organOf.clear();
        for (const ThinningScratch::Axis& axis : scratch_.axes)
            if (axis.isKept)
                layOut(axis);
        evenOut();
        thinned_.instanceRecords = full_.instanceRecords;
        thinned_.widthsGiven = full_.widthsGiven;
        thinned_.minY = full_.minY;
        thinned_.maxY = full_.maxY;
        thinned_.maxRadius = full_.maxRadius;
        keepShapes();
    }

private:
    void findAxes()
    {
        scratch_.axes.clear();
        hashPlaces(full_, scratch_.places);
        scratch_.axisOf.resize(full_.size());
        for (std::uint32_t i = 0; i < full_.size(); ++i)
        {
            const std::uint32_t parent = full_.parents[i];
            if (!full_.startsAxis(i))
            {
                scratch_.axisOf[i] = scratch_.axisOf[parent];
                continue;
            }
            scratch_.axisOf[i] = static_cast<std::uint32_t>(scratch_.axes.size());
            ThinningScratch::Axis axis{.start = i};
            for (std::uint32_t k = i; k != kNoSegment; k = full_.continuations[k])
                axis.area += areaOf(full_, k);
            if (parent != kNoSegment)
            {
                const ThinningScratch::Axis& mother = scratch_.axes[scratch_.axisOf[parent]];
                axis.kept = std::min(mother.kept, 2 * full_.startRadii[i] / thin_);
                // Of the branches of mothers that are kept, a share kept : mother.kept.
                const double lot = RandomKey(kBranches).child(scratch_.places[i]).uniform(Purpose::Sampling);
                axis.isKept = mother.isKept && lot * static_cast<double>(mother.kept) < static_cast<double>(axis.kept);
            }
            scratch_.axes.push_back(axis);
        }
    }

    [[nodiscard]] const ThinningScratch::Axis& axisAt(std::uint32_t segment) const
    {
        return scratch_.axes[scratch_.axisOf[segment]];
    }

    /// Ends that stay corners: where a branch that is kept leaves, and where the turtle moved on without drawing.
    void markCorners()
    {
        scratch_.isNeeded.assign(full_.size(), 0);
        for (std::uint32_t i = 0; i < full_.size(); ++i)
            if (const std::uint32_t parent = full_.parents[i]; parent != kNoSegment && axisAt(i).isKept)
                if ((full_.startsAxis(i) && (isWelded_ || !isThin(full_.startRadii[i]))) ||
                    full_.starts[i] != full_.ends[parent])
                    scratch_.isNeeded[parent] = 1;
    }

    /// Whether the corners from `first` up to the end of `last`, which follow each other, lie near enough to the
    /// straight way, in place and in width.
    [[nodiscard]] bool isStraight(std::uint32_t first, std::uint32_t last) const
    {
        const float tolerance = 0.5f * error_;
        const Vec3 way = full_.ends[last] - full_.starts[first];
        const float square = glm::dot(way, way);
        for (std::uint32_t i = first; i != last; i = full_.continuations[i])
        {
            const Vec3 from = full_.ends[i] - full_.starts[first];
            const float along = square > 0 ? std::clamp(glm::dot(from, way) / square, 0.0f, 1.0f) : 0.0f;
            const Vec3 off = from - along * way;
            const float radius = full_.startRadii[first] + along * (full_.endRadii[last] - full_.startRadii[first]);
            if (glm::dot(off, off) > tolerance * tolerance || std::abs(full_.endRadii[i] - radius) > tolerance)
                return false;
        }
        return true;
    }

    /// Appends an axis, in as few segments as will do.
    void layOut(const ThinningScratch::Axis& axis)
    {
        const std::uint32_t begin = thinned_.size();
        const std::uint32_t mother = full_.parents[axis.start];
        std::uint32_t parent = mother == kNoSegment ? kNoSegment : scratch_.thinnedOf[mother];
        for (std::uint32_t first = axis.start; first != kNoSegment;)
        {
            const std::uint32_t own = thinned_.size();
            std::uint32_t last = first;
            scratch_.thinnedOf[first] = own;
            for (std::uint32_t run = 1; run < kLongestRun && !scratch_.isNeeded[last]; ++run)
            {
                const std::uint32_t next = full_.continuations[last];
                if (next == kNoSegment || !isStraight(first, next))
                    break;
                scratch_.thinnedOf[next] = own;
                last = next;
            }
            const Vec3 way = full_.ends[last] - full_.starts[first];
            const float length = glm::length(way);
            const Vec3 heading = first == last || !(length > 0) ? full_.headings[first] : way / length;
            const Vec3 across = full_.lefts[first] - glm::dot(full_.lefts[first], heading) * heading;
            const float width = glm::length(across);
            const bool isTip = full_.continuations[last] == kNoSegment;
            scratch_.fullOf.push_back(first);
            thinned_.starts.push_back(full_.starts[first]);
            thinned_.ends.push_back(full_.ends[last]);
            thinned_.headings.push_back(heading);
            thinned_.lefts.push_back(first == last || !(width > 0) ? full_.lefts[first] : across / width);
            thinned_.lengths.push_back(first == last ? full_.lengths[first] : length);
            thinned_.startRadii.push_back(full_.startRadii[first]);
            thinned_.endRadii.push_back(isTip && isThin(full_.endRadii[last]) ? 0 : full_.endRadii[last]);
            thinned_.parents.push_back(parent);
            thinned_.continuations.push_back(kNoSegment);
            thinned_.orders.push_back(full_.orders[first]);
            thinned_.materials.push_back(full_.materials[first]);
            thinned_.instances.push_back(full_.instances[first]);
            if (first != axis.start)
                thinned_.continuations[parent] = own;
            parent = own;
            first = full_.continuations[last];
        }
        widen(begin, wideningOf(axis, begin));
    }

    /// Too thin to be seen as wide as it is.
    [[nodiscard]] bool isThin(float radius) const { return 2 * radius < thin_; }

    /// How many times as wide the segments from `begin` on must be to cover what all axes like theirs did.
    [[nodiscard]] float wideningOf(const ThinningScratch::Axis& axis, std::uint32_t begin) const
    {
        float drawn = 0;
        float thickest = 0;
        for (std::uint32_t i = begin; i < thinned_.size(); ++i)
        {
            drawn += areaOf(thinned_, i);
            thickest = std::max(thickest, thinned_.startRadii[i]);
        }
        // The trunk stays as it is.
        const bool isBranch = full_.parents[axis.start] != kNoSegment;
        const float pointed = isBranch && drawn > 0 ? std::clamp(axis.area / drawn, 1.0f, kMostPointed) : 1;
        const float wider = pointed / axis.kept;
        return wider * facetLoss(thickest);
    }

    /// Makes up for the lots that were drawn: if much of the thin wood happens to stay, it is less wide, and the other
    /// way round.
    void evenOut()
    {
        double wanted = 0;
        double found = 0;
        for (const ThinningScratch::Axis& axis : scratch_.axes)
        {
            const double share = (1 - static_cast<double>(axis.kept)) * static_cast<double>(axis.area);
            wanted += share;
            found += axis.isKept ? share / static_cast<double>(axis.kept) : 0;
        }
        const float even = found > 0 ? static_cast<float>(std::clamp(wanted / found, 0.5, 2.0)) : 1;
        for (std::uint32_t i = 0; i < thinned_.size(); ++i)
        {
            const float factor = 1 + (1 - axisAt(scratch_.fullOf[i]).kept) * ((1 + kHidden) * even - 1);
            thinned_.startRadii[i] *= factor;
            thinned_.endRadii[i] *= factor;
            scratch_.widening[i] *= factor;
        }
    }

    /// Square metres, seen across.
    [[nodiscard]] static float areaOf(const Skeleton& plant, std::uint32_t segment)
    {
        // Within what floats can hold even if the radii are hardly.
        return std::min(plant.startRadii[segment] + plant.endRadii[segment], 1e9f) *
               std::min(glm::length(plant.ends[segment] - plant.starts[segment]), 1e9f);
    }

    /// Facets cut off what circles cover: how much more those of a level do than those of the full plant.
    ///
    /// It takes for granted how many sides tubes have, and nobody tells if that changes:
    /// * a level's, coarserBy below and sidesFor (TubePlan.cpp): at least three, and ceil(pi sqrt(radius / (2 chord)))
    ///   with a chord error of 0.5 error. So three up to a radius of 9 / pi^2 errors, four up to 16 / pi^2;
    /// * the full plant's: TubeSettings::minSides, five, as its thin wood has.
    /// An error below twice TubeSettings::chordError, which no level has, would give more sides than this counts on.
    [[nodiscard]] float facetLoss(float radius) const
    {
        constexpr float kThreeSides = 0.912f; // errors: 9 / pi^2
        constexpr float kFourSides = 1.62f;   // 16 / pi^2
        // Perimeters of inscribed polygons, n sin(pi / n), of five sides to those of three and of four: what they cover
        // from all sides together.
        constexpr float kFiveToThree = 1.1312f;
        constexpr float kFiveToFour = 1.0391f;
        return radius < kThreeSides * error_ ? kFiveToThree : radius < kFourSides * error_ ? kFiveToFour : 1;
    }

    void widen(std::uint32_t begin, float factor)
    {
        for (std::uint32_t i = begin; i < thinned_.size(); ++i)
        {
            thinned_.startRadii[i] *= factor;
            thinned_.endRadii[i] *= factor;
            scratch_.widening.push_back(factor);
        }
    }

    /// How much larger a leaf on `segment` becomes; 0: it goes. `segment` becomes that of the thinned plant.
    [[nodiscard]] float growth(std::uint32_t& segment) const
    {
        if (segment == kNoSegment)
            return 1;
        const ThinningScratch::Axis& axis = axisAt(segment);
        segment = scratch_.thinnedOf[segment];
        return axis.isKept ? std::sqrt(1 / axis.kept) : 0;
    }

    void keepShapes()
    {
        keep(full_.polygons, thinned_.polygons, [&](SkeletonPolygon& polygon, float larger) {
            const Vec3 foot = full_.corners[polygon.firstCorner];
            const std::uint32_t end = polygon.firstCorner + polygon.cornerCount;
            const auto firstCorner = static_cast<std::uint32_t>(thinned_.corners.size());
            for (std::uint32_t i = polygon.firstCorner; i < end; ++i)
                thinned_.corners.push_back(foot + larger * (full_.corners[i] - foot));
            polygon.firstCorner = firstCorner;
        });
        keep(full_.spheres, thinned_.spheres, [](SkeletonSphere& sphere, float larger) { sphere.radius *= larger; });
        keep(full_.organs, thinned_.organs, [](SkeletonOrgan& organ, float larger) { organ.size *= larger; });
    }

    /// Those of `all` that stay, each made larger by `enlarge(shape, factor)`.
    template <class Shape, class Enlarge>
    void keep(const std::vector<Shape>& all, std::vector<Shape>& kept, const Enlarge& enlarge)
    {
        for (Shape shape : all)
        {
            const std::uint32_t organ = organ_++;
            if (const float larger = growth(shape.segment); larger > 0)
            {
                enlarge(shape, larger);
                kept.push_back(shape);
                scratch_.organOf.push_back(organ);
            }
        }
    }

    const Skeleton& full_;
    const float error_;
    const float thin_; ///< Metres: what is not as wide is thinned.
    const bool isWelded_;
    std::uint32_t organ_ = 0; ///< Of the next shape, as meshShapes counts.
    ThinningScratch& scratch_;
    Skeleton& thinned_;
};

} // namespace

void thinSkeleton(const Skeleton& full, float error, ThinningScratch& scratch, Skeleton& thinned, TubeJoints joints)
{
    if (error > 0)
        Thinner(full, error, joints, scratch, thinned).thin();
    else
    {
        thinned = full;
        scratch.fullOf.clear();
        scratch.widening.clear();
        scratch.organOf.clear();
    }
}

void nameFullSources(const ThinningScratch& scratch, TreeMesh& mesh) noexcept
{
    for (VertexSource& source : mesh.sources)
    {
        if (source.segment < scratch.fullOf.size())
            source.segment = scratch.fullOf[source.segment];
        if (source.organ < scratch.organOf.size())
            source.organ = scratch.organOf[source.organ];
    }
}

MeshSettings coarserBy(float error, MeshSettings settings)
{
    if (!(error > 0))
        return settings;
    constexpr float kBluntAngle = 1.2f; // radians
    settings.tubes.minSides = 3;
    settings.tubes.chordError = std::max(settings.tubes.chordError, 0.5f * error);
    settings.tubes.openRadius = std::max(settings.tubes.openRadius, error);
    settings.tubes.maxRingAngle = std::max(settings.tubes.maxRingAngle, kBluntAngle);
    settings.leaves.error = std::max(settings.leaves.error, error);
    settings.shapes.sphereSides = std::min<std::uint16_t>(settings.shapes.sphereSides, 6);
    return settings;
}

} // namespace espalier
