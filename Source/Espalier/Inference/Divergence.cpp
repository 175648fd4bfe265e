#include <Espalier/Inference/Divergence.h>

#include <Espalier/Core/DeterministicMath.h>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>

namespace espalier {

namespace {

/// A stretch of the line on which the two distribution functions differ by `difference`.
struct Step
{
    double length;
    double difference;
};

/// Between the least and the greatest value; both samples sorted and not empty.
std::vector<Step> differencesOf(const std::vector<double>& a, const std::vector<double>& b)
{
    std::vector<Step> steps;
    std::size_t i = 0;
    std::size_t k = 0;
    while (i < a.size() || k < b.size())
    {
        const double at = k == b.size() || (i < a.size() && a[i] <= b[k]) ? a[i++] : b[k++];
        const double next = i == a.size() && k == b.size() ? at
                            : i == a.size()                ? b[k]
                            : k == b.size()                ? a[i]
                                                           : std::min(a[i], b[k]);
        if (next > at)
            steps.push_back({next - at, static_cast<double>(i) / static_cast<double>(a.size()) -
                                            static_cast<double>(k) / static_cast<double>(b.size())});
    }
    return steps;
}

} // namespace

double jensenShannon(std::span<const double> a, std::span<const double> b)
{
    const double sumA = std::accumulate(a.begin(), a.end(), 0.0);
    const double sumB = std::accumulate(b.begin(), b.end(), 0.0);
    if (!(sumA > 0) || !(sumB > 0))
        return (sumA > 0) == (sumB > 0) ? 0 : 1;
    double nats = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
    {
        const double p = a[i] / sumA;
        const double q = b[i] / sumB;
        const double mean = 0.5 * (p + q);
        for (const double share : {p, q})
            if (share > 0)
                nats += 0.5 * share * math::log(share / mean);
    }
    return std::clamp(nats / math::log(2.0), 0.0, 1.0);
}

double wasserstein(std::vector<double> a, std::vector<double> b)
{
    if (a.empty() || b.empty())
        return 0;
    std::ranges::sort(a);
    std::ranges::sort(b);
    double area = 0;
    for (const Step& step : differencesOf(a, b))
        area += step.length * std::abs(step.difference);
    return area;
}

double circularWasserstein(std::vector<double> a, std::vector<double> b, double period)
{
    if (a.empty() || b.empty())
        return 0;
    for (std::vector<double>* values : {&a, &b})
    {
        for (double& value : *values)
        {
            value = std::fmod(value, period);
            value += value < 0 ? period : 0;
        }
        std::ranges::sort(*values);
    }
    std::vector<Step> steps = differencesOf(a, b);
    const double covered = std::accumulate(steps.begin(), steps.end(), 0.0,
                                           [](double sum, const Step& step) { return sum + step.length; });
    steps.push_back({period - covered, 0}); // from the greatest value round to the least
    // Mass that goes round by the back adds one number to all differences: the best is minus their median.
    std::ranges::sort(steps, {}, &Step::difference);
    double below = 0;
    double median = 0;
    for (const Step& step : steps)
    {
        median = step.difference;
        below += step.length;
        if (below >= 0.5 * period)
            break;
    }
    double area = 0;
    for (const Step& step : steps)
        area += step.length * std::abs(step.difference - median);
    return area;
}

double meanOf(std::span<const double> values)
{
    double sum = 0;
    for (const double value : values)
        sum += value;
    return values.empty() ? 0 : sum / static_cast<double>(values.size());
}

double medianOf(std::vector<double> values)
{
    if (values.empty())
        return 0;
    std::ranges::sort(values);
    const std::size_t half = values.size() / 2;
    return values.size() % 2 == 1 ? values[half] : 0.5 * (values[half - 1] + values[half]);
}

double deviationOf(std::span<const double> values)
{
    const double mean = meanOf(values);
    double squares = 0;
    for (const double value : values)
        squares += (value - mean) * (value - mean);
    return values.empty() ? 0 : std::sqrt(squares / static_cast<double>(values.size()));
}

double circularDeviationOf(std::span<const double> degrees)
{
    double x = 0;
    double y = 0;
    for (const double value : degrees)
    {
        const math::SinCos direction = math::sinCosDegrees(value);
        x += direction.cos;
        y += direction.sin;
    }
    const double mean = math::atan2(y, x) / math::kRadiansPerDegree;
    double squares = 0;
    for (const double value : degrees)
    {
        const double way = std::remainder(value - mean, 360.0);
        squares += way * way;
    }
    return degrees.empty() ? 0 : std::sqrt(squares / static_cast<double>(degrees.size()));
}

} // namespace espalier
