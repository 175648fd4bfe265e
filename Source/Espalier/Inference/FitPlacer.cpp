#include <Espalier/Inference/FitPlacer.h>

#include <Espalier/Core/DeterministicMath.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

namespace espalier {

namespace {

/// Below this a piece goes straight on and its roll is free. Degrees.
constexpr double kStraight = 0.02;

double decimals(double value, double perUnit)
{
    return std::floor(value * perUnit + 0.5) / perUnit + 0.0; // + 0: no -0
}

/// Values that differ in their last digits only, brought together: equal branches shall get equal numbers.
class Snapper
{
public:
    /// Neighbours up to `gap` apart belong together, relative to the value if `isRelative`.
    Snapper(double gap, bool isRelative) : gap_(gap), isRelative_(isRelative) {}

    void add(double value) { values_.push_back(value); }

    void finish()
    {
        // Longer chains of neighbours are not one value with noise, but many: they are left as they are.
        constexpr double kMostWidth = 5;
        std::ranges::sort(values_);
        for (std::size_t i = 0; i < values_.size();)
        {
            const double gap = gap_ * unit(values_[i]);
            std::size_t end = i + 1;
            while (end < values_.size() && values_[end] - values_[end - 1] <= gap)
                ++end;
            if (values_[end - 1] - values_[i] <= kMostWidth * gap)
                groups_.push_back(
                    {values_[i], values_[end - 1], simplest(values_[i], values_[i + (end - i) / 2], values_[end - 1])});
            i = end;
        }
        values_.clear();
    }

    [[nodiscard]] double operator()(double value) const
    {
        const double margin = 0.5 * gap_ * unit(value);
        auto group = std::ranges::lower_bound(groups_, value - margin, {}, &Group::high);
        if (group != groups_.end() && group->low <= value + margin)
            return group->value;
        return shortened(value);
    }

private:
    struct Group
    {
        double low, high, value;
    };
    [[nodiscard]] double unit(double value) const { return isRelative_ ? std::abs(value) : 1.0; }
    /// Near `middle`, with as few digits as there are numbers of between `low` and `high`.
    [[nodiscard]] double simplest(double low, double middle, double high) const
    {
        const double slack = isRelative_ ? 1e-7 * middle : 1e-5;
        for (int digits = 0; digits < kDigits; ++digits)
        {
            const double value = rounded(middle, digits);
            if (value >= low - slack && value <= high + slack)
                return value;
        }
        return shortened(middle);
    }
    /// To ten-thousandths of a degree, or six digits.
    [[nodiscard]] double shortened(double value) const { return rounded(value, kDigits); }
    [[nodiscard]] double rounded(double value, int digits) const
    {
        constexpr std::array<double, kDigits + 1> kPowers = {1, 10, 100, 1000, 10000};
        return isRelative_ ? significant(value, digits + 2)
                           : decimals(value, kPowers[static_cast<std::size_t>(digits)]);
    }

    static constexpr int kDigits = 4;
    double gap_;
    bool isRelative_;
    std::vector<double> values_;
    std::vector<Group> groups_;
};
/// Finds the transform of every piece.
class Placer
{
public:
    Placer(const FitPaths& paths, const std::vector<Piece>& pieces, FitLibrary& library, double size, double drift)
        : paths_(paths), pieces_(pieces), library_(library), drift_(drift), placed_(pieces.size()),
          planes_(paths.trees.size()), noise_(noiseOf(size)),
          angles_(std::clamp(2 * degreesOf(noise_), 0.002, 0.02), false),
          scalings_(std::clamp(noise_, 1e-5, 1e-3), true)
    {
        for (std::uint32_t tree = 0; tree < paths.trees.size(); ++tree)
            planes_[tree] = planeRoll(tree);
    }

    std::vector<InstanceTransform> place()
    {
        for (std::uint32_t i = 0; i < pieces_.size(); ++i)
            observe(i);
        angles_.finish();
        scalings_.finish();
        std::vector<InstanceTransform> transforms(pieces_.size());
        for (std::uint32_t i = 0; i < pieces_.size(); ++i)
            transforms[i] = decide(i);
        return transforms;
    }

private:
    /// Where the turtle is after a piece.
    struct Placed
    {
        FitFrame ideal; ///< Without rounding.
        FitFrame frame; ///< As it will be drawn.
        DVec3 position{0};
    };

    [[nodiscard]] DVec3 origin(const Piece& piece) const { return paths_.trees[piece.tree].origin; }
    [[nodiscard]] std::span<const DVec3> lineOf(const Piece& piece) const { return espalier::lineOf(paths_, piece); }
    [[nodiscard]] Placed startOf(const Piece& piece) const
    {
        if (piece.parent != kNoInstance)
            return placed_[piece.parent];
        return {{}, {}, origin(piece)};
    }

    /// Pass one: what numbers there would be.
    void observe(std::uint32_t index)
    {
        const Piece& piece = pieces_[index];
        const Placed start = startOf(piece);
        if (piece.kind == Piece::Kind::Bent && !library_.isDefined(index))
            define(index, start.ideal);
        Placed& end = placed_[index];
        end = start;
        const InstanceTransform transform = idealTransform(index, start.ideal);
        end.ideal = draw(index, transform, start.ideal, DVec3(0)).ideal;
        if (piece.kind == Piece::Kind::Joint)
            return;
        angles_.add(transform.roll);
        angles_.add(transform.rotation);
        if (piece.kind == Piece::Kind::Bent)
            angles_.add(transform.branchingAngle);
        scalings_.add(transform.scaling);
    }

    /// Pass two: the drawing, with rounded numbers as long as it stays near.
    InstanceTransform decide(std::uint32_t index)
    {
        const Piece& piece = pieces_[index];
        const Placed start = startOf(piece);
        InstanceTransform transform = idealTransform(index, start.ideal);
        const FitFrame ideal = draw(index, transform, start.ideal, DVec3(0)).ideal;
        transform.roll = snapped(transform.roll);
        transform.rotation = snapped(transform.rotation);
        if (piece.kind == Piece::Kind::Bent)
            transform.branchingAngle = snapped(transform.branchingAngle);
        transform.scaling = piece.kind == Piece::Kind::Joint ? 1 : scalings_(transform.scaling);
        Placed end = draw(index, transform, start.frame, start.position);
        end.ideal = ideal;
        if (piece.kind == Piece::Kind::Joint || isNear(piece, end, ideal))
        {
            placed_[index] = end;
            return transform;
        }
        // From where the drawing has come to, back to the skeleton.
        const InstanceTransform exact = transformTowards(index, start);
        transform = {significant(exact.scaling, 8), decimals(exact.rotation, 1e5),
                     piece.kind == Piece::Kind::Bent ? decimals(exact.branchingAngle, 1e5) : exact.branchingAngle,
                     decimals(exact.roll, 1e5)};
        end = draw(index, transform, start.frame, start.position);
        if (lengthOf(end.position - lineOf(piece).back()) > 0.25 * drift_)
        {
            transform = exact;
            end = draw(index, transform, start.frame, start.position);
        }
        end.ideal = end.frame; // its children go on from here, so that they can be equal to each other again
        placed_[index] = end;
        return transform;
    }

    /// Whether the drawing may go on like this: a long piece corrects it early, for a short one would turn aside.
    [[nodiscard]] bool isNear(const Piece& piece, const Placed& end, const FitFrame& ideal) const
    {
        const std::span<const DVec3> line = lineOf(piece);
        const double span = lengthOf(line.back() - line.front());
        double off = lengthOf(end.position - line.back());
        if (piece.kind == Piece::Kind::Bent)
            off += span * lengthOf(end.frame.left - ideal.left);
        return off <= 0.25 * drift_ || (off <= drift_ && span < 20 * off);
    }

    [[nodiscard]] double snapped(double degrees) const
    {
        const double value = angles_(degrees);
        return value <= -180 + 1e-9 ? value + 360 : value;
    }

    [[nodiscard]] InstanceTransform idealTransform(std::uint32_t index, const FitFrame& frame) const
    {
        const Piece& piece = pieces_[index];
        if (piece.kind == Piece::Kind::Joint)
        {
            InstanceTransform transform;
            if (piece.parent == kNoInstance)
                transform.roll = planes_[piece.tree].value_or(0);
            return transform;
        }
        const std::span<const DVec3> line = lineOf(piece);
        if (piece.kind == Piece::Kind::Bent)
        {
            InstanceTransform transform = bentTransform(index, frame, line.front());
            if (!library_.isShared(index)) // as it was defined
                transform.branchingAngle = InstanceTransform{}.branchingAngle;
            return transform;
        }
        return straightTransform(index, frame, line.back() - line.front());
    }

    [[nodiscard]] InstanceTransform transformTowards(std::uint32_t index, const Placed& start) const
    {
        const Piece& piece = pieces_[index];
        if (piece.kind == Piece::Kind::Bent)
            return bentTransform(index, start.frame, start.position);
        return straightTransform(index, start.frame, lineOf(piece).back() - start.position);
    }

    [[nodiscard]] InstanceTransform straightTransform(std::uint32_t index, const FitFrame& from,
                                                      const DVec3& step) const
    {
        InstanceTransform transform = directed(pieces_[index], from, step);
        transform.scaling = std::max(lengthOf(step), 1e-6 * drift_) / library_.spanOf(index);
        return transform;
    }

    /// The roll and the rotation that lead along `step`.
    [[nodiscard]] InstanceTransform directed(const Piece& piece, const FitFrame& from, const DVec3& step) const
    {
        InstanceTransform transform;
        const std::optional<double>& plane = planes_[piece.tree];
        FitFrame frame = from;
        const double before = piece.parent == kNoInstance ? plane.value_or(0) : 0;
        frame.rollRight(before);
        transform.roll = before;
        const double h = glm::dot(step, frame.heading);
        const double l = glm::dot(step, frame.left);
        const double u = glm::dot(step, frame.up);
        if (plane)
        {
            transform.rotation = degreesOf(math::atan2(l, h));
            return transform;
        }
        const double aside = std::sqrt(l * l + u * u);
        transform.rotation = degreesOf(math::atan2(aside, h));
        const bool isStraight = std::min(transform.rotation, 180 - transform.rotation) < kStraight;
        if (!isStraight || aside > 0.25 * drift_)
            transform.roll = degreesOf(math::atan2(u, l));
        else
        {
            transform.rotation = transform.rotation < 90 ? 0 : 180;
            // A bent piece turns its side branches by its branching angle.
            const bool isFree = transform.rotation == 0 && piece.kind == Piece::Kind::Straight;
            transform.roll = isFree ? rollOfFirstSide(piece, frame) : 0;
        }
        return transform;
    }

    /// The roll that brings the first side branch to the left.
    [[nodiscard]] double rollOfFirstSide(const Piece& piece, const FitFrame& frame) const
    {
        if (piece.firstSide == kNoInstance || pieces_[piece.firstSide].kind == Piece::Kind::Joint)
            return 0;
        const std::span<const DVec3> line = lineOf(pieces_[piece.firstSide]);
        const DVec3 step = line.back() - line.front();
        const double l = glm::dot(step, frame.left);
        const double u = glm::dot(step, frame.up);
        const double aside = degreesOf(math::atan2(std::sqrt(l * l + u * u), std::abs(glm::dot(step, frame.heading))));
        return aside < kStraight ? 0 : degreesOf(math::atan2(u, l));
    }

    /// From `start` to where the piece ends, turned about the way between as fits best.
    [[nodiscard]] InstanceTransform bentTransform(std::uint32_t index, const FitFrame& from, const DVec3& start) const
    {
        const Piece& piece = pieces_[index];
        const std::span<const DVec3> line = lineOf(piece);
        std::vector<DVec3> moved(line.begin(), line.end());
        moved.front() = start;
        const ShapePlacement placement = placeAlong(moved, library_.shapeOf(index));
        InstanceTransform transform =
            directed(piece, from, placement.frame.heading * lengthOf(line.back() - line.front()));
        transform.scaling = placement.scaling;
        const FitFrame frame = turned(from, transform, 0);
        transform.branchingAngle = -degreesOf(
            math::atan2(glm::dot(placement.frame.left, frame.up), glm::dot(placement.frame.left, frame.left)));
        return transform;
    }

    /// One that stands in one place only is defined as it stands there, at the usual branching angle.
    void define(std::uint32_t index, const FitFrame& from)
    {
        const Piece& piece = pieces_[index];
        const InstanceTransform transform = directed(piece, from, library_.firstStep(piece));
        library_.define(index, piece, turned(from, transform, transform.branchingAngle));
    }

    /// What roll, rotation and the twist of a bent piece do to a frame.
    [[nodiscard]] static FitFrame turned(FitFrame frame, const InstanceTransform& transform, double twist)
    {
        frame.rollRight(transform.roll);
        frame.turnLeft(transform.rotation);
        frame.rollRight(-twist);
        return frame;
    }

    /// What the turtle does.
    [[nodiscard]] Placed draw(std::uint32_t index, const InstanceTransform& transform, const FitFrame& from,
                              const DVec3& start) const
    {
        const Piece& piece = pieces_[index];
        FitFrame frame = from;
        frame.rollRight(transform.roll);
        frame.turnLeft(transform.rotation);
        DVec3 position = start;
        if (piece.kind == Piece::Kind::Straight)
            position += frame.heading * (library_.spanOf(index) * transform.scaling);
        else if (piece.kind == Piece::Kind::Bent)
        {
            frame.rollRight(-transform.branchingAngle);
            const DrawnShape& shape = library_.shapeOf(index);
            const auto placed = [&](const DVec3& v) { return frame.heading * v.x + frame.left * v.y + frame.up * v.z; };
            position += placed(shape.points.back()) * transform.scaling;
            frame = {placed(shape.end.heading), placed(shape.end.left), placed(shape.end.up)};
        }
        return {frame, frame, position};
    }

    /// How much the last bits of coordinates in a plant of `size` change the directions of its short pieces: radians.
    [[nodiscard]] double noiseOf(double size) const
    {
        std::vector<double> spans;
        for (const Piece& piece : pieces_)
        {
            if (piece.kind == Piece::Kind::Joint)
                continue;
            const std::span<const DVec3> line = lineOf(piece);
            spans.push_back(lengthOf(line.back() - line.front()));
        }
        const auto decile = spans.begin() + static_cast<std::ptrdiff_t>(spans.size() / 10);
        std::nth_element(spans.begin(), decile, spans.end());
        constexpr double kLastBits = 4 * 0x1p-23;
        return kLastBits * size / *decile;
    }

    /// If a tree lies in an upright plane, the roll at its base that turns left into the plane.
    [[nodiscard]] std::optional<double> planeRoll(std::uint32_t tree) const;

    const FitPaths& paths_;
    const std::vector<Piece>& pieces_;
    FitLibrary& library_;
    double drift_;
    std::vector<Placed> placed_;
    std::vector<std::optional<double>> planes_;
    double noise_;
    Snapper angles_;
    Snapper scalings_;
};

std::optional<double> Placer::planeRoll(std::uint32_t tree) const
{
    const DVec3& base = paths_.trees[tree].origin;
    const std::span<const DVec3> points = paths_.pointsOf(paths_.trees[tree]);
    DVec3 farthest(0);
    double most = 0;
    double size = 0;
    for (const DVec3& point : points)
    {
        const DVec3 p = point - base;
        size = std::max(size, glm::dot(p, p));
        const double square = p.x * p.x + p.z * p.z;
        if (square > most)
        {
            most = square;
            farthest = p;
        }
    }
    constexpr double kFlat = 1e-5; // of the size: the last bits of floats
    if (most <= kFlat * kFlat * size)
        return 0.0; // a pole
    const DVec3 normal = DVec3(farthest.z, 0, -farthest.x) / std::sqrt(most);
    const double thickness = std::min(kFlat * std::sqrt(size), 0.25 * drift_);
    const auto isInPlane = [&](const DVec3& p) { return std::abs(glm::dot(p - base, normal)) <= thickness; };
    if (!std::ranges::all_of(points, isInPlane))
        return {};
    // Left is -X, up +Z; of the two ways into the plane the one that takes the smaller roll.
    double roll = degreesOf(math::atan2(farthest.z, -farthest.x));
    roll = roll > 90 ? roll - 180 : roll <= -90 ? roll + 180 : roll;
    const double shortened = decimals(roll, 1e3);
    return std::abs(shortened - roll) * math::kRadiansPerDegree * std::sqrt(most) <= 0.25 * drift_ ? shortened : roll;
}

} // namespace

std::vector<InstanceTransform> placePieces(const FitPaths& paths, const std::vector<Piece>& pieces, FitLibrary& library,
                                           double size, double drift)
{
    return Placer(paths, pieces, library, size, drift).place();
}

} // namespace espalier
