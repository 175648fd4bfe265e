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
constexpr std::size_t kMostSteps = 32;   ///< Of a shape.
constexpr std::size_t kMostPoints = 512; ///< Of an internode that may have one.
constexpr int kMostLeaders = 48;         ///< That an internode is compared with.

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

BentShape shapeOf(std::span<const DVec3> line, double scale)
{
    constexpr int kDigits = 5;
    BentShape shape;
    FitFrame frame;
    for (std::size_t i = 1; i < line.size(); ++i)
    {
        const DVec3 step = line[i] - line[i - 1];
        const double length = lengthOf(step);
        BentShape::Step result{0, 0, significant(length * scale, kDigits)};
        if (i == 1)
        {
            frame.heading = step / length;
            const auto across = acrossOf(frame.heading);
            frame.left = across[0];
            frame.up = across[1];
        }
        else
        {
            const double l = glm::dot(step, frame.left);
            const double u = glm::dot(step, frame.up);
            const double aside = std::sqrt(l * l + u * u);
            double roll = aside > 1e-9 * length ? degreesOf(math::atan2(u, l)) : 0;
            double turn = degreesOf(math::atan2(aside, glm::dot(step, frame.heading)));
            const bool isFirstBend = std::ranges::all_of(shape.steps, [](const auto& s) { return s.turn == 0; });
            if (isFirstBend && rounded(turn) != 0)
            {
                frame.rollRight(roll); // the plane of the first bend is that of the frame
                roll = 0;
            }
            else if (std::abs(roll) > 90)
            {
                roll += roll > 0 ? -180 : 180;
                turn = -turn;
            }
            result.roll = rounded(turn) == 0 ? 0 : rounded(roll);
            result.turn = rounded(turn);
            // From here on as it will be drawn, so that rounding does not add up.
            frame.rollRight(result.roll);
            frame.turnLeft(result.turn);
        }
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

ShapeClusters clusterShapes(const FitPaths& paths, const std::vector<std::vector<std::uint32_t>>& needed,
                            double tolerance)
{
    ShapeClusters clusters;
    clusters.shapeOf.assign(paths.internodes.size(), kNoPath);
    struct Candidate
    {
        double chord;
        std::uint32_t internode;
    };
    std::vector<Candidate> candidates;
    for (std::uint32_t i = 0; i < paths.internodes.size(); ++i)
    {
        const Internode& internode = paths.internodes[i];
        const std::span<const DVec3> line = paths.pointsOf(internode);
        const double chord = lengthOf(line.back() - line.front());
        // What nearly comes back to its start has no direction to be placed by.
        if (needed[i].size() > 2 && needed[i].size() <= kMostSteps + 1 && line.size() <= kMostPoints &&
            chord > 0.2 * internode.length)
            candidates.push_back({chord, i});
    }
    std::ranges::stable_sort(candidates, std::ranges::greater{}, &Candidate::chord);

    std::multimap<double, std::uint32_t> leadersBySag; ///< How far half the way leads, over the chord.
    std::vector<DrawnShape> shapes;
    for (const Candidate& candidate : candidates)
    {
        const std::span<const DVec3> line = paths.pointsOf(paths.internodes[candidate.internode]);
        const double sag = lengthOf(samples(line)[kSamples / 2] - line.front()) / candidate.chord;
        const double margin = 2 * tolerance / candidate.chord;
        int tried = 0;
        std::uint32_t& found = clusters.shapeOf[candidate.internode];
        for (auto leader = leadersBySag.lower_bound(sag - margin);
             leader != leadersBySag.end() && leader->first <= sag + margin && tried < kMostLeaders && found == kNoPath;
             ++leader, ++tried)
        {
            const DrawnShape& shape = shapes[leader->second];
            if (distanceBetween(line, shape, placeAlong(line, shape)) <= tolerance)
                found = leader->second;
        }
        if (found != kNoPath)
            continue;
        std::vector<DVec3> kept;
        for (const std::uint32_t point : needed[candidate.internode])
            kept.push_back(line[point]);
        DrawnShape shape = drawn(shapeOf(kept, 1 / candidate.chord));
        if (distanceBetween(line, shape, placeAlong(line, shape)) > tolerance)
            continue; // rounding, where the tolerance is next to nothing
        found = static_cast<std::uint32_t>(clusters.leaders.size());
        clusters.leaders.push_back(candidate.internode);
        leadersBySag.emplace(sag, found);
        shapes.push_back(std::move(shape));
    }
    return clusters;
}

} // namespace espalier
