#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Mesh/AxisCurve.h>
#include <Espalier/Mesh/BallPattern.h>
#include <Espalier/Mesh/Bounds.h>
#include <Espalier/Mesh/PartCursors.h>
#include <Espalier/Mesh/RingFrames.h>
#include <Espalier/Mesh/ShapeMesher.h>
#include <Espalier/Plant/Skeleton.h>
#include <Espalier/Species/Appearance.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

// Two passes like the tubes': polygons are planned down to their triangles and everything is counted, then written by
// index into arrays of exactly the right size.

namespace espalier {
namespace {

/// Metres. Smaller shapes are no shapes: their area is lost in rounding.
constexpr double kSmallestExtent = 1e-6;

/// A polygon with less area than this share of its extent squared is a line.
constexpr double kThinnest = 1e-7;

/// Corners that all polygons of one plant may have looked at: about a second's worth. It is enough for a million
/// leaves.
constexpr std::uint64_t kTriangulationWork = std::uint64_t{1} << 26;

/// Where along an ovate leaf the outline has corners, and its half width there as a share of the greatest.
struct LeafStation
{
    float along;
    float halfWidth;
};
constexpr std::array<LeafStation, 7> kOvate{
    {{0, 0}, {0.05f, 0.32f}, {0.17f, 0.74f}, {0.34f, 1}, {0.55f, 0.88f}, {0.78f, 0.44f}, {1, 0}}};
constexpr std::uint32_t kInnerStations = kOvate.size() - 2;
constexpr std::uint32_t kLeafVertices = 2 * (kOvate.size() + kInnerStations); ///< Each half has its own midrib.
constexpr std::uint32_t kLeafIndices = 2 * 3 * (2 + 2 * (kInnerStations - 1));

ShapeSettings clamped(ShapeSettings settings)
{
    settings.sphereSides = std::clamp<std::uint16_t>(settings.sphereSides, 4, 64);
    settings.leafWidth = clampedTo(settings.leafWidth, 0.01f, 4);
    settings.leafFold = clampedTo(settings.leafFold, 0, 1.5f);
    settings.leafArch = clampedTo(settings.leafArch, -0.5f, 0.5f);
    return settings;
}

bool areShapesWithin(const Skeleton& skeleton, float limit)
{
    const auto inside = [&](const Vec3& v) { return isWithin(v, limit); };
    return std::ranges::all_of(skeleton.corners, inside) &&
           std::ranges::all_of(skeleton.spheres,
                               [&](const SkeletonSphere& s) { return inside(s.centre) && s.radius <= limit; }) &&
           std::ranges::all_of(skeleton.organs,
                               [&](const SkeletonOrgan& o) { return inside(o.position) && o.size <= limit; });
}

bool isSeen(const SkeletonSphere& sphere)
{
    return static_cast<double>(sphere.radius) > 0.5 * kSmallestExtent;
}

bool isSeen(const SkeletonOrgan& organ)
{
    return static_cast<double>(organ.size) > kSmallestExtent;
}

BallPattern ballOf(const ShapeSettings& settings)
{
    return {.sides = settings.sphereSides, .stacks = settings.sphereSides / 2u};
}

/// The most that can be needed, known before anything is planned.
MeshCounts boundsOf(const Skeleton& skeleton, const ShapeSettings& settings)
{
    MeshCounts most;
    for (const SkeletonPolygon& polygon : skeleton.polygons)
        most.vertices += polygon.cornerCount;
    most.indices = 3 * most.vertices;
    const auto spheres = static_cast<std::uint64_t>(
        std::ranges::count_if(skeleton.spheres, [](const SkeletonSphere& sphere) { return isSeen(sphere); }));
    const auto organs = static_cast<std::uint64_t>(
        std::ranges::count_if(skeleton.organs, [](const SkeletonOrgan& organ) { return isSeen(organ); }));
    most.vertices += spheres * ballOf(settings).vertexCount() + organs * kLeafVertices;
    most.indices += spheres * ballOf(settings).indexCount() + organs * kLeafIndices;
    return most;
}

/// Copies the corners of a polygon without those that repeat the one before; returns how far they reach.
double gatherCorners(std::span<const Vec3> corners, std::vector<Vec3>& kept)
{
    const std::size_t first = kept.size();
    for (const Vec3& corner : corners)
    {
        if (kept.size() == first || corner != kept.back())
            kept.push_back(corner);
    }
    while (kept.size() > first + 1 && kept.back() == kept[first])
        kept.pop_back();
    Vec3 low = kept[first];
    Vec3 high = kept[first];
    for (std::size_t i = first; i < kept.size(); ++i)
    {
        low = glm::min(low, kept[i]);
        high = glm::max(high, kept[i]);
    }
    const DVec3 extent = DVec3(high) - DVec3(low);
    return std::max({extent.x, extent.y, extent.z});
}

/// Twice the area along the normal, by M. E. Newell's sum: the mean plane of corners that need not lie in one. Where an
/// outline crosses itself so that its parts cancel, the plane of the largest triangle at the first corner.
DVec3 areaVector(std::span<const Vec3> corners, double least)
{
    const DVec3 origin(corners[0]);
    DVec3 sum(0);
    DVec3 largest(0);
    for (std::size_t i = 1; i + 1 < corners.size(); ++i)
    {
        const DVec3 area = glm::cross(DVec3(corners[i]) - origin, DVec3(corners[i + 1]) - origin);
        sum += area;
        if (glm::dot(area, area) > glm::dot(largest, largest))
            largest = area;
    }
    return glm::length(sum) > least ? sum : largest;
}

/// The direction from the first corner to the one farthest from it, in the plane.
Vec3 upOf(std::span<const Vec3> corners, const Vec3& normal)
{
    Vec3 farthest(0);
    for (const Vec3& corner : corners)
    {
        const Vec3 arm = corner - corners[0];
        if (glm::dot(arm, arm) > glm::dot(farthest, farthest))
            farthest = arm;
    }
    return sideNormalTo(normal, farthest);
}

/// Plans one polygon, or leaves the scratch as it was if there is nothing to see.
void planPolygon(std::span<const Vec3> outline, std::uint32_t polygon, std::uint32_t colour, std::uint64_t& work,
                 ShapeScratch& scratch)
{
    const std::size_t firstCorner = scratch.corners.size();
    const std::size_t firstIndex = scratch.triangles.size();
    const double extent = gatherCorners(outline, scratch.corners);
    const std::span<const Vec3> corners = std::span(scratch.corners).subspan(firstCorner);
    const double least = kThinnest * extent * extent;
    const DVec3 area = corners.size() >= 3 && extent > kSmallestExtent ? areaVector(corners, least) : DVec3(0);
    if (glm::length(area) > least)
    {
        FlatShape shape{.firstCorner = static_cast<std::uint32_t>(firstCorner),
                        .cornerCount = static_cast<std::uint32_t>(corners.size()),
                        .firstIndex = static_cast<std::uint32_t>(firstIndex),
                        .colour = colour,
                        .polygon = polygon};
        shape.normal = directionOr(Vec3(area / glm::length(area)), Vec3(0, 1, 0));
        shape.up = upOf(corners, shape.normal);
        const DVec3 up(shape.up);
        const DVec3 right = glm::cross(up, DVec3(shape.normal));
        scratch.flattened.clear();
        for (const Vec3& corner : corners)
        {
            const DVec3 arm = DVec3(corner) - DVec3(corners[0]);
            scratch.flattened.emplace_back(glm::dot(arm, right), glm::dot(arm, up));
        }
        triangulate(scratch.flattened, work, scratch.triangulation, scratch.triangles);
        shape.indexCount = static_cast<std::uint32_t>(scratch.triangles.size() - firstIndex);
        if (shape.indexCount > 0)
        {
            scratch.shapes.push_back(shape);
            return;
        }
    }
    scratch.corners.resize(firstCorner);
}

/// Writes shapes one after the other: vertices as they come, indices each into the run of its colour.
class ShapeWriter
{
public:
    ShapeWriter(const ShapeSettings& settings, std::size_t firstVertex, PartCursors& cursors, TreeMesh& mesh)
        : settings_(settings), vertex_(static_cast<std::uint32_t>(firstVertex)), cursors_(cursors), mesh_(mesh),
          cosFold_(static_cast<float>(math::cos(static_cast<double>(settings.leafFold)))),
          sinFold_(static_cast<float>(math::sin(static_cast<double>(settings.leafFold))))
    {}

    /// The source of the vertices from here on.
    void belongTo(const VertexSource& source) { source_ = source; }

    void writePolygon(const FlatShape& shape, const ShapeScratch& scratch)
    {
        const std::span<const Vec3> corners = std::span(scratch.corners).subspan(shape.firstCorner, shape.cornerCount);
        const Vec3 right = glm::cross(shape.up, shape.normal);
        const auto onPlane = [&](const Vec3& corner) {
            const Vec3 arm = corner - corners[0];
            return Vec2(glm::dot(arm, right), glm::dot(arm, shape.up));
        };
        Vec2 low(0);
        Vec2 high(0);
        for (const Vec3& corner : corners)
        {
            low = glm::min(low, onPlane(corner));
            high = glm::max(high, onPlane(corner));
        }
        const Vec2 size = high - low;
        const std::uint32_t first = vertex_;
        for (const Vec3& corner : corners)
        {
            const Vec2 at = onPlane(corner) - low;
            addVertex(corner, shape.normal, right, {size.x > 0 ? at.x / size.x : 0, size.y > 0 ? at.y / size.y : 0});
        }
        std::size_t index = cursors_.next(shape.colour);
        for (std::uint32_t i = 0; i < shape.indexCount; ++i)
            mesh_.indices[index++] = first + scratch.triangles[shape.firstIndex + i];
        cursors_.advance(shape.colour, index);
    }

    void writeSphere(const SkeletonSphere& sphere, std::uint32_t colour)
    {
        const BallPattern ball = ballOf(settings_);
        const std::uint32_t first = vertex_;
        ball.eachVertex([&](const Vec3& outward, const Vec3& along, const Vec2& uv) {
            addVertex(sphere.centre + sphere.radius * outward, outward, along, uv);
        });
        open(colour);
        ball.eachTriangle(
            [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) { addTriangle(first + a, first + b, first + c); });
        close(colour);
    }

    void writeLeaf(const SkeletonOrgan& organ, std::uint32_t colour)
    {
        const Vec3 heading = directionOr(organ.heading, Vec3(0, 1, 0));
        const Vec3 left = sideNormalTo(heading, organ.left);
        const Vec3 up = glm::cross(heading, left);
        open(colour);
        for (const float side : {1.f, -1.f})
            writeHalf(organ, heading, side * left, up, side);
        close(colour);
    }

private:
    /// Midrib and edge of one half: the midrib's vertices first.
    void writeHalf(const SkeletonOrgan& organ, const Vec3& heading, const Vec3& aside, const Vec3& up, float side)
    {
        const Vec3 across = aside * cosFold_ + up * sinFold_;
        const float halfWidth = 0.5f * settings_.leafWidth;
        const std::uint32_t midrib = vertex_;
        const auto last = static_cast<std::uint32_t>(kOvate.size() - 1);
        const auto place = [&](const LeafStation& station, float share) {
            const float t = station.along;
            const Vec3 rib = heading * t + up * (4 * settings_.leafArch * t * (1 - t));
            const Vec3 forward = heading + up * (4 * settings_.leafArch * (1 - 2 * t));
            const Vec3 normal = directionOr(side * glm::cross(forward, across), up);
            const float width = share * halfWidth * station.halfWidth;
            // u runs to the right, which is from edge to midrib on the left half.
            const Vec3 right = sideNormalTo(normal, -side * across);
            const Vec2 uv(0.5f - 0.5f * side * share * station.halfWidth, t);
            addVertex(organ.position + organ.size * (rib + width * across), normal, right, uv);
        };
        for (const LeafStation& station : kOvate)
            place(station, 0);
        const std::uint32_t edge = vertex_;
        for (std::uint32_t i = 1; i < last; ++i)
            place(kOvate[i], 1);

        const auto triangle = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
            if (side > 0)
                addTriangle(a, b, c);
            else
                addTriangle(a, c, b);
        };
        triangle(midrib, midrib + 1, edge);
        for (std::uint32_t i = 1; i + 1 < last; ++i)
        {
            triangle(midrib + i, midrib + i + 1, edge + i - 1);
            triangle(midrib + i + 1, edge + i, edge + i - 1);
        }
        triangle(midrib + last - 1, midrib + last, edge + last - 2);
    }

    void addVertex(const Vec3& position, const Vec3& normal, const Vec3& tangent, const Vec2& uv)
    {
        mesh_.positions[vertex_] = position;
        mesh_.normals[vertex_] = normal;
        mesh_.tangents[vertex_] = Vec4(tangent, 1);
        mesh_.uvs[vertex_] = uv;
        if (settings_.streams.sources)
            mesh_.sources[vertex_] = source_;
        ++vertex_;
    }

    void open(std::uint32_t colour) { index_ = cursors_.next(colour); }
    void close(std::uint32_t colour) { cursors_.advance(colour, index_); }
    void addTriangle(std::uint32_t a, std::uint32_t b, std::uint32_t c)
    {
        mesh_.indices[index_++] = a;
        mesh_.indices[index_++] = b;
        mesh_.indices[index_++] = c;
    }

    ShapeSettings settings_;
    VertexSource source_;
    std::uint32_t vertex_;
    std::size_t index_ = 0;
    PartCursors& cursors_;
    TreeMesh& mesh_;
    float cosFold_;
    float sinFold_;
};

/// Which entry of the palette a material has.
class Colours
{
public:
    explicit Colours(const Appearance& appearance)
        : last_(std::clamp<std::size_t>(appearance.palette.size(), 1, kMaxPalette) - 1)
    {}

    std::uint32_t operator()(std::uint16_t material) const
    {
        return static_cast<std::uint32_t>(std::min<std::size_t>(material, last_));
    }

private:
    std::size_t last_;
};

/// Plans all polygons and adds to `counts` and `cursors` what all shapes will take.
MeshResult planShapes(const Skeleton& skeleton, const Colours& colourFor, const ShapeSettings& settings,
                      const Limits& limits, ShapeScratch& scratch, MeshCounts& counts, PartCursors& cursors)
{
    if (!isSound(skeleton) || !areShapesWithin(skeleton, static_cast<float>(limits.coordinate)))
        return MeshResult::UnsoundSkeleton;
    // What turns out to have no area counts too: a limit must hold before anything is looked at.
    const MeshCounts most = boundsOf(skeleton, settings);
    if (most.vertices + counts.vertices > limits.vertices ||
        most.indices + counts.indices > std::numeric_limits<std::uint32_t>::max())
        return MeshResult::TooManyVertices;

    scratch.shapes.clear();
    scratch.corners.clear();
    scratch.triangles.clear();
    std::uint64_t work = kTriangulationWork;
    for (std::uint32_t i = 0; i < skeleton.polygons.size(); ++i)
    {
        const SkeletonPolygon& polygon = skeleton.polygons[i];
        planPolygon(std::span(skeleton.corners).subspan(polygon.firstCorner, polygon.cornerCount), i,
                    colourFor(polygon.material), work, scratch);
    }

    MeshCounts own{.vertices = scratch.corners.size()};
    const auto count = [&](std::uint32_t colour, std::uint64_t vertices, std::uint64_t indices) {
        own.vertices += vertices;
        own.indices += indices;
        cursors.count(colour, indices);
    };
    for (const FlatShape& shape : scratch.shapes)
        count(shape.colour, 0, shape.indexCount);
    for (const SkeletonSphere& sphere : skeleton.spheres)
        if (isSeen(sphere))
            count(colourFor(sphere.material), ballOf(settings).vertexCount(), ballOf(settings).indexCount());
    for (const SkeletonOrgan& organ : skeleton.organs)
        if (isSeen(organ))
            count(colourFor(organ.material), kLeafVertices, kLeafIndices);
    if (own.vertices == 0)
        return MeshResult::EmptySkeleton;
    counts.vertices += own.vertices;
    counts.indices += own.indices;
    counts.parts += cursors.parts();
    counts.streams.tints = counts.streams.tints || settings.streams.tints;
    counts.streams.sources = counts.streams.sources || settings.streams.sources;
    return MeshResult::Ok;
}

} // namespace

MeshResult countShapes(const Skeleton& skeleton, const Appearance& appearance, const ShapeSettings& settings,
                       const Limits& limits, ShapeScratch& scratch, MeshCounts& counts)
{
    PartCursors cursors;
    return planShapes(skeleton, Colours(appearance), clamped(settings), limits, scratch, counts, cursors);
}

MeshResult meshShapes(const Skeleton& skeleton, const Appearance& appearance, const ShapeSettings& settings,
                      const Limits& limits, ShapeScratch& scratch, TreeMesh& mesh)
{
    const ShapeSettings kept = clamped(settings);
    const Colours colourFor(appearance);
    MeshCounts counts = countsOf(mesh);
    PartCursors cursors;
    if (const MeshResult result = planShapes(skeleton, colourFor, kept, limits, scratch, counts, cursors);
        result != MeshResult::Ok)
        return result;

    const std::size_t firstVertex = mesh.positions.size();
    mesh.resizeVertices(counts.vertices, kept.streams);
    cursors.open(MeshMaterial::Surface, mesh);
    ShapeWriter writer(kept, firstVertex, cursors, mesh);
    // Numbers of organs: polygons, then spheres, then organs proper.
    for (const FlatShape& shape : scratch.shapes)
    {
        writer.belongTo({skeleton.polygons[shape.polygon].segment, shape.polygon});
        writer.writePolygon(shape, scratch);
    }
    auto number = static_cast<std::uint32_t>(skeleton.polygons.size());
    for (const SkeletonSphere& sphere : skeleton.spheres)
    {
        writer.belongTo({sphere.segment, number++});
        if (isSeen(sphere))
            writer.writeSphere(sphere, colourFor(sphere.material));
    }
    for (const SkeletonOrgan& organ : skeleton.organs)
    {
        writer.belongTo({organ.segment, number++});
        if (isSeen(organ))
            writer.writeLeaf(organ, colourFor(organ.material));
    }
    return MeshResult::Ok;
}

} // namespace espalier
