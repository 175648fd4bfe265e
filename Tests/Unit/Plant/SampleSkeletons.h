#pragma once

#include <Espalier/Core/Random.h>
#include <Espalier/Plant/Axes.h>
#include <Espalier/Plant/Skeleton.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

// Skeletons that tests, samples and benchmarks share. None needs a grammar or a turtle.
namespace espalier::samples {

/// Appends a segment with its frame and returns its index. `completeAxes` must follow when all are there. A radius >= 0
/// is the segment's start radius and needs `widthsGiven`.
inline std::uint32_t addSegment(Skeleton& skeleton, std::uint32_t parent, Vec3 start, Vec3 end, float radius = -1.f)
{
    const Vec3 span = end - start;
    const float length = glm::length(span);
    const Vec3 inherited = parent == kNoSegment ? Vec3(0, 1, 0) : skeleton.headings[parent];
    const Vec3 heading = length > 0 ? span / length : inherited;
    const Vec3 aside = std::abs(heading.z) < 0.9f ? Vec3(0, 0, 1) : Vec3(1, 0, 0);

    skeleton.starts.push_back(start);
    skeleton.ends.push_back(end);
    skeleton.headings.push_back(heading);
    skeleton.lefts.push_back(glm::normalize(glm::cross(aside, heading)) * -1.f);
    skeleton.lengths.push_back(length);
    skeleton.parents.push_back(parent);
    skeleton.materials.push_back(0);
    skeleton.instances.push_back(kNoSegment);
    if (skeleton.widthsGiven)
        skeleton.startRadii.push_back(std::max(radius, 0.f));
    for (const Vec3& point : {start, end})
    {
        skeleton.minY = std::min(skeleton.minY, point.y);
        skeleton.maxY = std::max(skeleton.maxY, point.y);
        skeleton.maxRadius = std::max(skeleton.maxRadius, std::sqrt(point.x * point.x + point.z * point.z));
    }
    return skeleton.size() - 1;
}

/// The same, starting where `parent` ends (at the origin for kNoSegment).
inline std::uint32_t grow(Skeleton& skeleton, std::uint32_t parent, Vec3 step, float radius = -1.f)
{
    const Vec3 start = parent == kNoSegment ? Vec3(0) : skeleton.ends[parent];
    return addSegment(skeleton, parent, start, start + step, radius);
}

struct TrunkShape
{
    float length = 2.f; ///< Metres.
    std::uint32_t segments = 4;
    float radius = 0.1f;     ///< Metres, at the base.
    float endRadius = 0.05f; ///< Metres, at the tip.
};

/// A vertical trunk that tapers evenly.
inline Skeleton straightTrunk(const TrunkShape& shape = {})
{
    Skeleton skeleton;
    skeleton.widthsGiven = true;
    std::uint32_t last = kNoSegment;
    const float count = static_cast<float>(shape.segments);
    for (std::uint32_t i = 0; i < shape.segments; ++i)
    {
        const float along = static_cast<float>(i) / count;
        last =
            grow(skeleton, last, {0, shape.length / count, 0}, shape.radius + (shape.endRadius - shape.radius) * along);
    }
    completeAxes(skeleton, {});
    if (last != kNoSegment)
        skeleton.endRadii[last] = shape.endRadius;
    return skeleton;
}

/// A trunk of two segments; from its middle a branch of two segments leaves at 45 degrees towards +X.
inline Skeleton fork(const PipeModel& pipes = {.tipRadius = 0.05f})
{
    Skeleton skeleton;
    const std::uint32_t trunk = grow(skeleton, kNoSegment, {0, 1, 0});
    const std::uint32_t upper = grow(skeleton, trunk, {0, 1, 0});
    grow(skeleton, upper, {0, 0.5f, 0});
    const std::uint32_t branch = grow(skeleton, trunk, {0.5f, 0.5f, 0});
    grow(skeleton, branch, {0.5f, 0.5f, 0});
    completeAxes(skeleton, pipes);
    return skeleton;
}

/// The segments `order` of a plant, in that order, with all that they bear; the rest is cut off. Nothing changes but
/// numbers: radii and axes stay as they were, and stumps end where they were cut. Requires: each comes after its
/// parent.
inline Skeleton renumbered(const Skeleton& plant, const std::vector<std::uint32_t>& order)
{
    std::vector<std::uint32_t> numberOf(plant.size(), kNoSegment);
    for (std::uint32_t i = 0; i < order.size(); ++i)
        numberOf[order[i]] = i;
    const auto newOf = [&](std::uint32_t segment) { return segment == kNoSegment ? kNoSegment : numberOf[segment]; };
    Skeleton result = plant;
    const auto take = [&](auto& values, const auto& all) {
        values.clear();
        for (const std::uint32_t i : order)
            values.push_back(all[i]);
    };
    take(result.starts, plant.starts);
    take(result.ends, plant.ends);
    take(result.headings, plant.headings);
    take(result.lefts, plant.lefts);
    take(result.lengths, plant.lengths);
    take(result.startRadii, plant.startRadii);
    take(result.endRadii, plant.endRadii);
    take(result.parents, plant.parents);
    take(result.continuations, plant.continuations);
    take(result.orders, plant.orders);
    take(result.materials, plant.materials);
    take(result.instances, plant.instances);
    for (std::uint32_t& parent : result.parents)
        parent = newOf(parent);
    for (std::uint32_t& next : result.continuations)
        next = newOf(next);
    const auto keepBorne = [&](auto& shapes) {
        std::erase_if(shapes, [&](const auto& shape) {
            return shape.segment != kNoSegment && numberOf[shape.segment] == kNoSegment;
        });
        for (auto& shape : shapes)
            shape.segment = newOf(shape.segment);
    };
    keepBorne(result.polygons);
    keepBorne(result.spheres);
    keepBorne(result.organs);
    return result;
}

/// All segments but `branch` and what it bears.
inline std::vector<std::uint32_t> allWithout(const Skeleton& plant, std::uint32_t branch)
{
    std::vector<std::uint32_t> kept;
    std::vector<bool> isCut(plant.size(), false);
    for (std::uint32_t i = 0; i < plant.size(); ++i)
    {
        isCut[i] = i == branch || (plant.parents[i] != kNoSegment && isCut[plant.parents[i]]);
        if (!isCut[i])
            kept.push_back(i);
    }
    return kept;
}

/// All segments, those with fewer between them and the base first.
inline std::vector<std::uint32_t> byDepth(const Skeleton& plant)
{
    std::vector<std::uint32_t> order(plant.size());
    std::vector<std::uint32_t> depths(plant.size(), 0);
    for (std::uint32_t i = 0; i < plant.size(); ++i)
    {
        order[i] = i;
        depths[i] = plant.parents[i] == kNoSegment ? 0 : depths[plant.parents[i]] + 1;
    }
    std::ranges::stable_sort(order, {}, [&](std::uint32_t i) { return depths[i]; });
    return order;
}

enum class Ailments : std::uint8_t
{
    None, ///< A healthy tree: every segment has a length and starts where its parent ends.
    All,  ///< Also zero lengths, hairpins, moves, radius 0, several trunks, hugely uneven lengths and radii.
};

/// A random tree of `segments` segments: any shape, but the same for the same arguments everywhere.
inline Skeleton randomTree(std::uint64_t seed, std::uint32_t segments, Ailments ailments = Ailments::None)
{
    const RandomKey tree(Seed{seed});
    const bool ill = ailments == Ailments::All;
    Skeleton skeleton;
    skeleton.widthsGiven = ill && tree.uniform(Purpose::Sampling) < 0.5;
    for (std::uint32_t i = 0; i < segments; ++i)
    {
        const RandomKey here = tree.child(i);
        const auto draw = [&](std::uint32_t counter) { return here.uniform(Purpose::Sampling, counter); };
        const auto drawSigned = [&](std::uint32_t counter) { return static_cast<float>(2 * draw(counter) - 1); };

        // Mostly the newest segment carries on; sometimes an older one gets another child.
        const auto older = static_cast<std::uint32_t>(draw(0) * i);
        const bool atBase = i == 0 || (ill && draw(1) < 0.02);
        const std::uint32_t parent = atBase ? kNoSegment : draw(2) < 0.7 ? i - 1 : older;
        const Vec3 forward = atBase ? Vec3(0, 1, 0) : skeleton.headings[parent];
        const Vec3 aside(drawSigned(3), drawSigned(4), drawSigned(5));

        Vec3 step = (forward + 0.6f * aside) * static_cast<float>(0.1 + 0.4 * draw(6));
        Vec3 start = atBase ? Vec3(0) : skeleton.ends[parent];
        float radius = static_cast<float>(0.01 + 0.1 * draw(7));
        if (ill)
        {
            const double kind = draw(8);
            if (kind < 0.08)
                step = Vec3(0);
            else if (kind < 0.14)
                step = forward * -0.3f;
            else if (kind < 0.20)
                start += aside;
            else if (kind < 0.24)
                step *= 1e-6f;
            else if (kind < 0.28)
                step *= 50.f;
            if (draw(9) < 0.08)
                radius = 0;
            else if (draw(9) < 0.12)
                radius *= 40;
        }
        addSegment(skeleton, parent, start, start + step, radius);
    }
    completeAxes(skeleton, {});
    return skeleton;
}

} // namespace espalier::samples
