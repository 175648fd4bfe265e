#include <Espalier/Inference/FitShapes.h>

#include <Espalier/Core/DeterministicMath.h>
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>

namespace espalier {

namespace {

constexpr std::size_t kSamples = 16;     ///< Points that are compared to twist a shape; the chord's ends come on top.
constexpr std::uint32_t kMostSteps = 96; ///< Of a shape: a word that a person still looks through.
constexpr double kLeastChord = 0.2;      ///< Of a shape, over its length.
constexpr int kMostLeaders = 48;         ///< That a stretch is compared with.

void turnTowards(DVec3& a, DVec3& b, double degrees)
{
    const math::SinCos by = math::sinCosDegrees(degrees);
    const DVec3 from = a;
    a = from * by.cos + b * by.sin;
    b = b * by.cos - from * by.sin;
}

double rounded(double degrees)
{
    return std::floor(degrees * 1000 + 0.5) / 1000 + 0.0;
}

/// Points at equal parts of the length, ends left out.
std::array<DVec3, kSamples> samples(std::span<const DVec3> line)
{
    double total = 0;
    for (std::size_t i = 1; i < line.size(); ++i)
        total += lengthOf(line[i] - line[i - 1]);
    std::array<DVec3, kSamples> result;
    std::size_t segment = 1;
    double before = 0;
    double length = lengthOf(line[1] - line[0]);
    for (std::size_t i = 0; i < kSamples; ++i)
    {
        const double at = total * static_cast<double>(i + 1) / static_cast<double>(kSamples + 1);
        while (segment + 1 < line.size() && before + length < at)
        {
            before += length;
            ++segment;
            length = lengthOf(line[segment] - line[segment - 1]);
        }
        const double t = length > 0 ? std::min((at - before) / length, 1.0) : 0.0;
        result[i] = line[segment - 1] + (line[segment] - line[segment - 1]) * t;
    }
    return result;
}

/// Two unit vectors at right angles to `along` and to each other, the second by a right-handed turn from the first.
std::array<DVec3, 2> acrossOf(const DVec3& along)
{
    const DVec3 a(std::abs(along.x), std::abs(along.y), std::abs(along.z));
    const DVec3 other = a.x <= a.y && a.x <= a.z ? DVec3(1, 0, 0) : a.y <= a.z ? DVec3(0, 1, 0) : DVec3(0, 0, 1);
    DVec3 first = other - along * glm::dot(other, along);
    first /= lengthOf(first);
    return {first, glm::cross(along, first)};
}

/// Whether points at equal parts of the lengths are near. Cheap, and nearly always says at once that shapes differ.
bool mayBeNear(const std::array<DVec3, kSamples>& onLine, const DVec3& start, const DrawnShape& shape,
               const ShapePlacement& placement, double distance)
{
    const auto onShape = samples(shape.points);
    for (std::size_t i = 0; i < kSamples; ++i)
    {
        const DVec3& p = onShape[i];
        const DVec3 placed =
            start +
            (placement.frame.heading * p.x + placement.frame.left * p.y + placement.frame.up * p.z) * placement.scaling;
        if (lengthOf(placed - onLine[i]) > distance)
            return false;
    }
    return true;
}

} // namespace

double degreesOf(double radians)
{
    return radians / math::kRadiansPerDegree;
}

double significant(double value, int digits)
{
    std::array<char, 40> text{};
    const auto end = std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::general, digits);
    std::from_chars(text.data(), end.ptr, value);
    return value;
}

void FitFrame::turnLeft(double degrees)
{
    turnTowards(heading, left, degrees);
}

void FitFrame::pitchDown(double degrees)
{
    turnTowards(heading, up, -degrees);
}

void FitFrame::rollRight(double degrees)
{
    turnTowards(left, up, degrees);
}

FitFrame alongFirstStep(std::span<const DVec3> line)
{
    const DVec3 along = (line[1] - line[0]) / lengthOf(line[1] - line[0]);
    const auto across = acrossOf(along);
    return {along, across[0], across[1]};
}

BentShape shapeOf(std::span<const DVec3> line, double scale, FitFrame frame)
{
    constexpr int kDigits = 5;
    BentShape shape;
    for (std::size_t i = 1; i < line.size(); ++i)
    {
        const DVec3 step = line[i] - line[i - 1];
        const double length = lengthOf(step);
        const double l = glm::dot(step, frame.left);
        const double u = glm::dot(step, frame.up);
        const double aside = std::sqrt(l * l + u * u);
        double roll = aside > 1e-9 * length ? degreesOf(math::atan2(u, l)) : 0;
        double turn = degreesOf(math::atan2(aside, glm::dot(step, frame.heading)));
        if (std::abs(roll) > 90)
        {
            roll += roll > 0 ? -180 : 180;
            turn = -turn;
        }
        const BentShape::Step result{rounded(turn) == 0 ? 0 : rounded(roll), rounded(turn),
                                     significant(length * scale, kDigits)};
        // From here on as it will be drawn, so that rounding does not add up.
        frame.rollRight(result.roll);
        frame.turnLeft(result.turn);
        shape.steps.push_back(result);
    }
    return shape;
}

DrawnShape drawn(const BentShape& shape)
{
    DrawnShape result;
    FitFrame& frame = result.end;
    frame = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    result.points.push_back(DVec3(0));
    for (const BentShape::Step& step : shape.steps)
    {
        frame.rollRight(step.roll);
        frame.turnLeft(step.turn);
        result.points.push_back(result.points.back() + frame.heading * step.length);
    }
    return result;
}

ShapePlacement placeAlong(std::span<const DVec3> line, const DrawnShape& shape)
{
    const DVec3 chord = line.back() - line.front();
    const DVec3 shapeChord = shape.points.back();
    const double length = lengthOf(chord);
    const double shapeLength = lengthOf(shapeChord);
    const DVec3 along = chord / length;
    const DVec3 shapeAlong = shapeChord / shapeLength;
    const auto across = acrossOf(along);
    const auto shapeAcross = acrossOf(shapeAlong);
    const auto onLine = samples(line);
    const auto onShape = samples(shape.points);
    double sine = 0;
    double cosine = 0;
    for (std::size_t i = 0; i < kSamples; ++i)
    {
        const DVec3 p = onLine[i] - line.front();
        const DVec2 a(glm::dot(onShape[i], shapeAcross[0]), glm::dot(onShape[i], shapeAcross[1]));
        const DVec2 b(glm::dot(p, across[0]), glm::dot(p, across[1]));
        cosine += a.x * b.x + a.y * b.y;
        sine += a.x * b.y - a.y * b.x;
    }
    const double norm = std::sqrt(sine * sine + cosine * cosine);
    sine = norm > 0 ? sine / norm : 0;
    cosine = norm > 0 ? cosine / norm : 1;
    const DVec3 first = across[0] * cosine + across[1] * sine;
    const DVec3 second = across[1] * cosine - across[0] * sine;
    const auto turned = [&](const DVec3& v) {
        return along * glm::dot(v, shapeAlong) + first * glm::dot(v, shapeAcross[0]) +
               second * glm::dot(v, shapeAcross[1]);
    };
    return {{turned({1, 0, 0}), turned({0, 1, 0}), turned({0, 0, 1})}, length / shapeLength};
}

double distanceBetween(std::span<const DVec3> line, const DrawnShape& shape, const ShapePlacement& placement)
{
    std::vector<DVec3> placed;
    placed.reserve(shape.points.size());
    for (const DVec3& p : shape.points)
        placed.push_back(line.front() +
                         (placement.frame.heading * p.x + placement.frame.left * p.y + placement.frame.up * p.z) *
                             placement.scaling);
    double most = 0;
    for (const DVec3& p : line)
        most = std::max(most, distanceTo(p, placed));
    for (const DVec3& p : placed)
        most = std::max(most, distanceTo(p, line));
    return most;
}

Stretches stretchesOf(const FitPaths& paths, const NeededPoints& needed)
{
    Stretches stretches;
    std::vector<Stretch> pending;
    for (std::uint32_t i = 0; i < paths.internodes.size(); ++i)
    {
        stretches.firstOf.push_back(static_cast<std::uint32_t>(stretches.all.size()));
        pending.push_back({i, 0, static_cast<std::uint32_t>(needed[i].size() - 1)});
        while (!pending.empty())
        {
            const Stretch stretch = pending.back();
            pending.pop_back();
            const std::vector<DVec3> kept = keptPointsOf(paths, needed, stretch);
            double length = 0;
            for (std::size_t p = 1; p < kept.size(); ++p)
                length += lengthOf(kept[p] - kept[p - 1]);
            const std::uint32_t steps = stretch.last - stretch.first;
            if (steps == 1 || (steps <= kMostSteps && lengthOf(kept.back() - kept.front()) > kLeastChord * length))
            {
                stretches.all.push_back(stretch);
                continue;
            }
            const std::uint32_t middle = stretch.first + steps / 2;
            pending.push_back({i, middle, stretch.last});
            pending.push_back({i, stretch.first, middle});
        }
    }
    stretches.firstOf.push_back(static_cast<std::uint32_t>(stretches.all.size()));
    return stretches;
}

std::span<const DVec3> pointsOf(const FitPaths& paths, const NeededPoints& needed, const Stretch& stretch)
{
    const std::vector<std::uint32_t>& points = needed[stretch.internode];
    const std::uint32_t first = points[stretch.first];
    return paths.pointsOf(paths.internodes[stretch.internode]).subspan(first, points[stretch.last] - first + 1);
}

std::vector<DVec3> keptPointsOf(const FitPaths& paths, const NeededPoints& needed, const Stretch& stretch)
{
    const std::span<const DVec3> points = paths.pointsOf(paths.internodes[stretch.internode]);
    std::vector<DVec3> kept;
    for (std::uint32_t i = stretch.first; i <= stretch.last; ++i)
        kept.push_back(points[needed[stretch.internode][i]]);
    return kept;
}

ShapeClusters clusterShapes(const FitPaths& paths, const NeededPoints& needed, const Stretches& stretches,
                            double tolerance)
{
    ShapeClusters clusters;
    clusters.shapeOf.assign(stretches.all.size(), kNoPath);
    if (tolerance == 0)
        return clusters;
    struct Candidate
    {
        double chord;
        std::uint32_t stretch;
    };
    std::vector<Candidate> candidates;
    for (std::uint32_t i = 0; i < stretches.all.size(); ++i)
    {
        const std::span<const DVec3> line = pointsOf(paths, needed, stretches.all[i]);
        if (stretches.all[i].isBent())
            candidates.push_back({lengthOf(line.back() - line.front()), i});
    }
    std::ranges::stable_sort(candidates, std::ranges::greater{}, &Candidate::chord);

    std::multimap<double, std::uint32_t> leadersBySag; ///< How far half the way leads, over the chord.
    std::vector<DrawnShape> shapes;
    for (const Candidate& candidate : candidates)
    {
        const std::span<const DVec3> line = pointsOf(paths, needed, stretches.all[candidate.stretch]);
        const auto onLine = samples(line);
        const double sag = lengthOf(onLine[kSamples / 2] - line.front()) / candidate.chord;
        const double margin = 2 * tolerance / candidate.chord;
        int tried = 0;
        std::uint32_t& found = clusters.shapeOf[candidate.stretch];
        for (auto leader = leadersBySag.lower_bound(sag - margin);
             leader != leadersBySag.end() && leader->first <= sag + margin && tried < kMostLeaders && found == kNoPath;
             ++leader, ++tried)
        {
            const DrawnShape& shape = shapes[leader->second];
            const ShapePlacement placement = placeAlong(line, shape);
            if (mayBeNear(onLine, line.front(), shape, placement, 3 * tolerance) &&
                distanceBetween(line, shape, placement) <= tolerance)
                found = leader->second;
        }
        if (found != kNoPath)
            continue;
        const std::vector<DVec3> kept = keptPointsOf(paths, needed, stretches.all[candidate.stretch]);
        DrawnShape shape = drawn(shapeOf(kept, 1 / candidate.chord, alongFirstStep(kept)));
        if (distanceBetween(line, shape, placeAlong(line, shape)) > tolerance)
            continue; // rounding, where the tolerance is next to nothing
        found = static_cast<std::uint32_t>(clusters.leaders.size());
        clusters.leaders.push_back(candidate.stretch);
        leadersBySag.emplace(sag, found);
        shapes.push_back(std::move(shape));
    }
    return clusters;
}

} // namespace espalier
