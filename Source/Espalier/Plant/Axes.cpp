#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Plant/Axes.h>
#include <Espalier/Plant/Skeleton.h>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

namespace espalier {
namespace {

/// Start radii by the pipe model. Counts pipes in `startRadii` itself, from the tips down, so nothing is allocated: a
/// float counts exactly beyond the most segments that Limits allow, and the rounding of pipesPerMetre is invisible.
void applyPipeModel(Skeleton& skeleton, const PipeModel& model)
{
    const double inverseExponent = 1.0 / static_cast<double>(model.exponent);
    std::vector<float>& pipes = skeleton.startRadii;
    pipes.assign(skeleton.size(), 0.f);
    for (std::uint32_t i = skeleton.size(); i-- > 0;)
    {
        // The last segment of a twig is one pipe, however long: its start radius is the model's tip radius.
        const bool isTip = pipes[i] == 0.f;
        pipes[i] = isTip ? 1.f : pipes[i] + model.pipesPerMetre * skeleton.lengths[i];
        if (skeleton.parents[i] != kNoSegment)
            pipes[skeleton.parents[i]] += pipes[i];
    }

    // Most segments carry as many pipes as their neighbour in the arrays; the power is worth remembering.
    float knownPipes = 1.f;
    float knownRadius = model.tipRadius;
    for (float& radius : skeleton.startRadii)
    {
        if (radius != knownPipes)
        {
            knownPipes = radius;
            knownRadius = static_cast<float>(static_cast<double>(model.tipRadius) *
                                             math::pow(static_cast<double>(knownPipes), inverseExponent));
        }
        radius = knownRadius;
    }
}

/// True if `child` carries its parent's axis on rather than `rival`, an earlier child.
bool continuesRather(const Skeleton& skeleton, std::uint32_t child, std::uint32_t rival)
{
    const float childRadius = skeleton.startRadii[child];
    const float rivalRadius = skeleton.startRadii[rival];
    if (childRadius != rivalRadius)
        return childRadius > rivalRadius;
    const Vec3& heading = skeleton.headings[skeleton.parents[child]];
    return glm::dot(heading, skeleton.headings[child]) > glm::dot(heading, skeleton.headings[rival]);
}

void chooseContinuations(Skeleton& skeleton)
{
    skeleton.continuations.assign(skeleton.size(), kNoSegment);
    for (std::uint32_t i = 0; i < skeleton.size(); ++i)
    {
        const std::uint32_t parent = skeleton.parents[i];
        if (parent == kNoSegment)
            continue;
        std::uint32_t& chosen = skeleton.continuations[parent];
        if (chosen == kNoSegment || continuesRather(skeleton, i, chosen))
            chosen = i;
    }
}

} // namespace

void completeAxes(Skeleton& skeleton, const PipeModel& pipes)
{
    assert(!skeleton.widthsGiven || skeleton.startRadii.size() == skeleton.size());
    if (!skeleton.widthsGiven)
        applyPipeModel(skeleton, pipes);
    chooseContinuations(skeleton);

    skeleton.endRadii.resize(skeleton.size());
    skeleton.orders.resize(skeleton.size());
    constexpr int kMaxOrder = std::numeric_limits<std::uint16_t>::max();
    for (std::uint32_t i = 0; i < skeleton.size(); ++i)
    {
        const std::uint32_t next = skeleton.continuations[i];
        skeleton.endRadii[i] = next == kNoSegment ? 0.5f * skeleton.startRadii[i] : skeleton.startRadii[next];

        const std::uint32_t parent = skeleton.parents[i];
        const int below = parent == kNoSegment ? 0 : skeleton.orders[parent] + (skeleton.startsAxis(i) ? 1 : 0);
        skeleton.orders[i] = static_cast<std::uint16_t>(std::min(below, kMaxOrder));
    }
}

PipeModel suggestPipes(const Skeleton& skeleton)
{
    std::vector<bool> carries(skeleton.size(), false);
    for (const std::uint32_t parent : skeleton.parents)
        if (parent != kNoSegment)
            carries[parent] = true;
    std::vector<float> tipLengths;
    for (std::uint32_t i = 0; i < skeleton.size(); ++i)
        if (!carries[i] && skeleton.lengths[i] > 0)
            tipLengths.push_back(skeleton.lengths[i]);
    PipeModel pipes;
    if (tipLengths.empty())
        return pipes;
    std::ranges::sort(tipLengths);
    pipes.tipRadius = std::clamp(std::round(0.03f * tipLengths[tipLengths.size() / 2] * 1e4f) / 1e4f, 1e-4f, 1.0f);

    const double trunkRadius = 0.033 * static_cast<double>(skeleton.maxY - skeleton.minY);
    const double widening = trunkRadius / static_cast<double>(pipes.tipRadius);
    if (widening > 1 && tipLengths.size() > 1)
    {
        const double exponent = math::log(static_cast<double>(tipLengths.size())) / math::log(widening);
        pipes.exponent = static_cast<float>(std::round(std::clamp(exponent, 1.8, 2.6) * 100) / 100);

        // Few tips make a thin trunk whatever the exponent: then the tips are thicker.
        const double reached =
            math::pow(static_cast<double>(tipLengths.size()), 1 / static_cast<double>(pipes.exponent));
        const double wanted = 0.6 * trunkRadius / (reached * static_cast<double>(pipes.tipRadius));
        pipes.tipRadius *= static_cast<float>(std::clamp(wanted, 1.0, 3.0));
        pipes.tipRadius = std::min(std::round(pipes.tipRadius * 1e4f) / 1e4f, 1.0f);
    }
    return pipes;
}

} // namespace espalier
