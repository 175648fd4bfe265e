#include <Espalier/Inference/Fit.h>

#include <Espalier/Archetype/Placement.h>
#include <Espalier/Inference/FitLibrary.h>
#include <Espalier/Inference/FitPaths.h>
#include <Espalier/Inference/FitPieces.h>
#include <Espalier/Inference/FitPlacer.h>
#include <Espalier/Inference/FitShapes.h>
#include <algorithm>
#include <cmath>
#include <utility>

namespace espalier {

namespace {

// Parts of the tolerance, which add up to less than all of it.
constexpr double kPointsShare = 0.4; ///< What points may be left out for.
constexpr double kShapeShare = 0.6;  ///< How far a shared shape may lie from a stretch, its own points included.
constexpr double kDriftShare = 0.25; ///< How far the end of a piece may lie from where it belongs.

/// Draws the archetype and measures how far it is from the skeleton.
Expected<void> measureDistances(const FitPaths& paths, const std::vector<Piece>& pieces, const Archetype& archetype,
                                const Limits& limits, FitReport& report)
{
    Limits drawing = limits;
    drawing.nodes = std::max(limits.nodes, limits.inferredNodes);
    const ArchetypeDrawer drawer(archetype);
    Skeleton skeleton;
    double sum = 0;
    std::size_t count = 0;
    const auto compare = [&](double distance) {
        report.largestDistance = std::max(report.largestDistance, distance);
        sum += distance;
        ++count;
    };
    std::vector<DVec3> line;
    for (std::uint32_t tree = 0; tree < paths.trees.size(); ++tree)
    {
        if (auto done = drawer.draw(tree, drawing, skeleton); !done)
            return done;
        for (std::uint32_t i = 0; i < skeleton.size();)
        {
            const std::uint32_t instance = skeleton.instances[i];
            line.assign(1, DVec3(skeleton.starts[i]) + paths.trees[tree].origin);
            for (; i < skeleton.size() && skeleton.instances[i] == instance; ++i)
                line.push_back(DVec3(skeleton.ends[i]) + paths.trees[tree].origin);
            const Piece& piece = pieces[skeleton.instanceRecords[instance].row];
            const auto original = lineOf(paths, piece);
            compare(lengthOf(line.back() - original.back()));
            for (std::size_t p = 0; p + 1 < original.size(); ++p)
                compare(distanceTo(original[p], line));
            for (std::size_t p = 0; p + 1 < line.size(); ++p)
                compare(distanceTo(line[p], original));
        }
    }
    report.meanDistance = count > 0 ? sum / static_cast<double>(count) : 0;
    return {};
}

double sizeOf(const FitPaths& paths)
{
    double size = 0;
    for (const FitTree& tree : paths.trees)
    {
        DVec3 low = tree.origin;
        DVec3 high = low;
        for (const DVec3& p : paths.pointsOf(tree))
        {
            low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
            high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
        }
        size = std::max(size, lengthOf(high - low));
    }
    return size;
}

double usualTolerance(const FitPaths& paths, double size)
{
    double total = 0;
    for (const Internode& internode : paths.internodes)
        total += internode.length;
    const double internode = total / static_cast<double>(paths.internodes.size());
    const double segment = total / static_cast<double>(paths.segments);
    return significant(std::min({0.02 * internode, 0.5 * segment, 0.002 * size}), 3);
}

std::uint32_t depthOf(const Archetype& archetype)
{
    std::uint32_t most = 0;
    std::vector<std::uint32_t> depths;
    depths.reserve(archetype.instances.size());
    for (const TemplateInstance& instance : archetype.instances)
    {
        depths.push_back(instance.parent == kNoInstance ? 1 : depths[instance.parent] + 1);
        most = std::max(most, depths.back());
    }
    return most;
}

Expected<void> checkSettings(const Skeleton& skeleton, const FitSettings& settings, const Limits& limits)
{
    if (settings.tolerance && !(*settings.tolerance >= 0 && std::isfinite(*settings.tolerance)))
        return failure(ErrorKind::BadInput, {}, "the tolerance is no length", "a number of metres, 0 or more");
    if (settings.templates && (*settings.templates < 1 || *settings.templates > 1024))
        return failure(ErrorKind::BadInput, {}, "templates is " + std::to_string(*settings.templates),
                       "a number from 1 to 1024");
    if (!isSound(skeleton))
        return failure(ErrorKind::BadInput, {}, "the skeleton is not sound",
                       "finite numbers, and parents before their children");
    if (skeleton.size() > limits.inferredNodes)
        return failure(ErrorKind::Limit, {}, "the skeleton has " + std::to_string(skeleton.size()) + " segments",
                       "at most " + std::to_string(limits.inferredNodes) + " (the limit inferredNodes)");
    return {};
}

} // namespace

Expected<FittedArchetype> fitArchetype(const Skeleton& skeleton, const FitSettings& settings, const Limits& limits)
{
    if (auto done = checkSettings(skeleton, settings, limits); !done)
        return tl::make_unexpected(done.error());
    FitOutline outline{pathsOf(skeleton), {}, {}, {}};
    const FitPaths& paths = outline.paths;
    if (paths.internodes.empty())
        return failure(ErrorKind::BadInput, {}, "the skeleton has no segment with a length",
                       "at least two points in different places, one the parent of the other");
    FittedArchetype result;
    FitReport& report = result.report;
    report.size = sizeOf(paths);
    report.tolerance = settings.tolerance.value_or(usualTolerance(paths, report.size));

    outline.needed.reserve(paths.internodes.size());
    for (const Internode& internode : paths.internodes)
        outline.needed.push_back(neededPoints(paths.pointsOf(internode), kPointsShare * report.tolerance));
    outline.stretches = stretchesOf(paths, outline.needed);
    outline.clusters = clusterShapes(paths, outline.needed, outline.stretches, kShapeShare * report.tolerance);
    constexpr std::uint32_t kJoints = 32; // of the limit: there are 24 of them at most
    const TemplateChoice choice(outline, settings.templates, limits.templates - std::min(limits.templates, kJoints));
    const std::vector<Piece> pieces = layPieces(outline, choice);
    FitLibrary library(outline, pieces);
    constexpr double kLastBit = 0x1p-23; // of coordinates, over the size: nearer than that nothing is drawn
    const double drift = std::max(kDriftShare * report.tolerance, kLastBit * report.size);
    const std::vector<InstanceTransform> transforms = placePieces(paths, pieces, library, report.size, drift);

    Archetype& archetype = result.archetype;
    archetype.libraryName = settings.libraryName;
    archetype.library = library.library();
    archetype.instances.reserve(pieces.size());
    for (std::uint32_t i = 0; i < pieces.size(); ++i)
        archetype.instances.push_back({library.templateOf(i), pieces[i].parent, pieces[i].anchor, transforms[i]});
    if (auto done = validate(archetype, limits); !done)
        return tl::make_unexpected(done.error());
    if (auto done = measureDistances(paths, pieces, archetype, limits, report); !done)
        return tl::make_unexpected(done.error());

    report.segments = paths.segments;
    report.internodes = static_cast<std::uint32_t>(paths.internodes.size());
    report.trees = static_cast<std::uint32_t>(paths.trees.size());
    report.templates = static_cast<std::uint32_t>(archetype.library.templates.size());
    report.instances = static_cast<std::uint32_t>(archetype.instances.size());
    report.depth = depthOf(archetype);
    return result;
}

} // namespace espalier
