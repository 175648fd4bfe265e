#include <Espalier/Render/LineDrawing.h>

#include <Espalier/Plant/Skeleton.h>
#include <Espalier/Render/Camera.h>
#include <Espalier/Render/Render.h>
#include <Espalier/Species/Appearance.h>
#include <algorithm>
#include <vector>

namespace espalier {

TubeSettings lineTubes()
{
    return {.smoothing = 0, .collarFlare = 0, .rootFlare = 0};
}

void divideIntoStrokes(Skeleton& skeleton)
{
    std::vector<bool> isCut(skeleton.size(), false);
    for (std::uint32_t i = 0; i < skeleton.size(); ++i)
    {
        const std::uint32_t next = skeleton.continuations[i];
        if (next == kNoSegment)
            continue;
        isCut[i] = skeleton.materials[next] != skeleton.materials[i] || skeleton.starts[next] != skeleton.ends[i];
        if (isCut[i])
            skeleton.continuations[i] = kNoSegment;
    }
    for (std::uint32_t i = 0; i < skeleton.size(); ++i)
    {
        // All children of a cut become roots: a branch would bend out of the axis that went on there.
        if (skeleton.parents[i] != kNoSegment && isCut[skeleton.parents[i]])
            skeleton.parents[i] = kNoSegment;
        if (skeleton.continuations[i] == kNoSegment)
            skeleton.endRadii[i] = skeleton.startRadii[i];
    }
}

void dipInInk(Appearance& appearance)
{
    constexpr float kDepth = 0.55f;
    appearance.bark.colour = {0.010f, 0.010f, 0.012f};
    for (Vec3& colour : appearance.palette)
        colour *= kDepth;
}

void thickenLines(Skeleton& skeleton, float pixels, const RenderSettings& settings)
{
    if (!(pixels > 0) || skeleton.empty())
        return;
    const ViewAxes axes =
        viewAxes(static_cast<double>(settings.cameraAzimuth), static_cast<double>(settings.cameraElevation));
    const auto extentAlong = [&](const DVec3& direction) {
        double low = glm::dot(DVec3(skeleton.starts[0]), direction);
        double high = low;
        for (const std::vector<Vec3>* points : {&skeleton.starts, &skeleton.ends, &skeleton.corners})
            for (const Vec3& point : *points)
            {
                const double at = glm::dot(DVec3(point), direction);
                low = std::min(low, at);
                high = std::max(high, at);
            }
        return high - low;
    };
    constexpr double kFilled = 0.9; // of the frame; see the margins of renderPicture
    const double metresPerPixel =
        std::max(extentAlong(axes.right) / settings.width, extentAlong(axes.up) / settings.height) / kFilled;
    const auto least = static_cast<float>(0.5 * static_cast<double>(pixels) * metresPerPixel);
    for (std::vector<float>* radii : {&skeleton.startRadii, &skeleton.endRadii})
        for (float& radius : *radii)
            radius = skeleton.widthsGiven ? std::max(radius, least) : least;
}

} // namespace espalier
