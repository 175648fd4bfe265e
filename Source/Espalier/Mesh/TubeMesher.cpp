#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Core/Simd.h>
#include <Espalier/Mesh/Bounds.h>
#include <Espalier/Mesh/PartCursors.h>
#include <Espalier/Mesh/RingFrames.h>
#include <Espalier/Mesh/TubeCollar.h>
#include <Espalier/Mesh/TubeMesher.h>
#include <Espalier/Mesh/TubePlan.h>
#include <Espalier/Mesh/TubeWeld.h>
#include <Espalier/Plant/Skeleton.h>
#include <Espalier/Species/Appearance.h>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <span>

// Two passes. The first plans every tube down to its rings and counts vertices, so that limits are kept before memory
// is taken; the second writes by index into arrays of exactly the right size.

namespace espalier {
namespace {

using simd::three;

std::uint64_t vertexCountOf(const Tube& tube, const SheetPlan& sheets)
{
    if (tube.sheet == kNoSheet)
        return std::uint64_t{tube.ringCount} * (tube.sides + 1) + tube.baseVertices;
    const TubeSheet& sheet = sheets.sheets[tube.sheet];
    std::uint64_t count = std::uint64_t{sheet.rowCount} * (tube.sides + 1) + tube.baseVertices;
    for (std::uint32_t b = 0; b < sheet.bandCount; ++b)
    {
        const SheetBand& band = sheets.bands[sheet.firstBand + b];
        count += band.pointCount + band.copyCount;
    }
    return count;
}

/// Two triangles a side between rings, one towards the apex. A lid is a fan over its rim, or round its middle if it has
/// one; a root is a fan round its apex.
std::uint64_t indexCountOf(const Tube& tube, const SheetPlan& sheets)
{
    const std::uint32_t base = tube.baseVertices == 0           ? 0
                               : tube.baseVertices > tube.sides ? tube.sides
                                                                : tube.sides - 2;
    if (tube.sheet == kNoSheet)
        return 3 * (std::uint64_t{tube.sides} * (2 * tube.ringCount - 3) + base);
    const TubeSheet& sheet = sheets.sheets[tube.sheet];
    std::uint64_t count = 3 * (std::uint64_t{tube.sides} * (2 * (sheet.rowCount - sheet.bandCount) - 3) + base);
    for (std::uint32_t b = 0; b < sheet.bandCount; ++b)
        count += sheets.bands[sheet.firstBand + b].cornerCount;
    return count;
}

bool isInCollar(const Tube& tube, const TubeRing& ring)
{
    return tube.collar.isLaid && ring.along < tube.collar.end;
}

/// What wood of this radius is tinted by: young wood differs from the bark of boughs.
Tint woodTint(const BarkAppearance& bark, float radius)
{
    constexpr float kOld = 3; // times as thick as young wood: nothing of the tint is left
    const float age = std::clamp((radius / std::max(bark.youngRadius, 1e-6f) - 1) / (kOld - 1), 0.f, 1.f);
    return tintOf(glm::mix(bark.youngTint, Vec3(1), age));
}

/// Writes tubes one after the other: vertices as they come, indices each into the run of its colour.
class TubeWriter
{
public:
    TubeWriter(const TubePlan& plan, const BarkAppearance& bark, TreeMesh& mesh, std::size_t vertex,
               PartCursors& cursors)
        : plan_(plan), scratch_(plan.scratch), streams_(plan.settings.streams), tile_(plan.tile),
          tall_(static_cast<float>(tileHeightOf(bark))), bark_(bark), mesh_(mesh), vertex_(vertex), cursors_(cursors)
    {}

    void write(const Tube& tube)
    {
        index_ = cursors_.next(tube.colour);
        const auto first = static_cast<std::uint32_t>(vertex_);
        const std::span<const Vec2> circle = circleOf(tube.sides, scratch_);
        const std::span<const TubeRing> rings(&scratch_.rings[tube.firstRing], tube.ringCount);
        const bool isSheet = tube.sheet != kNoSheet;
        if (isSheet)
        {
            if (const std::size_t count = rings.size() * circle.size(); count > scratch_.unwelded.positions.size())
                scratch_.unwelded.resizeVertices(count, streams_);
            writeRings(tube, rings, circle, scratch_.unwelded, 0);
            writeSheet(tube);
        }
        else
        {
            writeRings(tube, rings, circle, mesh_, vertex_);
            vertex_ += rings.size() * circle.size();
            writeSides(tube, first);
        }
        if (tube.baseVertices > 0 && tube.collar.isLaid)
            writeRoot(tube, rings[0], first);
        else if (tube.baseVertices > 0)
            writeLid(tube, rings[0], first);
        cursors_.advance(tube.colour, index_);
    }

private:
    void writeRings(const Tube& tube, std::span<const TubeRing> rings, std::span<const Vec2> circle, TreeMesh& mesh,
                    std::size_t first)
    {
        std::size_t vertex = first;
        for (const TubeRing& ring : rings)
        {
            writeRing(tube, ring, circle, mesh, vertex);
            if (tube.roots.isLobedAt(ring.along))
                partIntoLobes(tube, ring, circle, mesh, vertex);
            if (isInCollar(tube, ring))
                placeCollarRing(tube, ring, circle, mesh, vertex);
            vertex += circle.size();
        }
        if (tube.foot != kNoFoot)
            standOnHost(tube, rings, mesh, first);
        if (tube.collar.isLaid)
            shadeCollar(tube, rings, mesh, first);
        if (tube.foot != kNoFoot)
            shareNormals(tube, mesh, first);
    }

    void writeRing(const Tube& tube, const TubeRing& ring, std::span<const Vec2> circle, TreeMesh& mesh,
                   std::size_t first)
    {
        const simd::Four side = three(ring.side);
        const simd::Four up = simd::cross(three(ring.tangent), side);
        const simd::Four centre = three(ring.centre);
        const simd::Four radius = simd::all(ring.radius);
        const simd::Four outwards = simd::all(ring.normal.x);
        const simd::Four lean = three(ring.tangent) * simd::all(ring.normal.y);
        constexpr simd::Four kRightHanded{0, 0, 0, 1};
        const float v = ring.along * tube.repeatsPerMetre;
        const float uStart = tube.lean * v;
        const float uStep = tube.repeats / static_cast<float>(tube.sides);
        // Plain pointers: through the vectors, every store would make the compiler load their addresses again.
        Vec3* const positions = &mesh.positions[first];
        Vec3* const normals = &mesh.normals[first];
        Vec4* const tangents = &mesh.tangents[first];
        Vec2* const uvs = &mesh.uvs[first];
        const Vec2* const points = circle.data();
        const std::size_t seam = circle.size() - 1;
        float column = 0;
        for (std::size_t j = 0; j < seam; ++j)
        {
            const simd::Four x = simd::all(points[j].x);
            const simd::Four y = simd::all(points[j].y);
            const simd::Four outward = side * x + up * y;
            // All four, at once: what goes too far is in the next vertex, which is yet to come.
            simd::store(&positions[j], centre + outward * radius);
            simd::store(&normals[j], outward * outwards + lean);
            simd::store(&tangents[j], simd::withLast(simd::firstThree(up * x - side * y), kRightHanded));
            uvs[j] = {uStart + column * uStep, v};
            column += 1;
        }
        positions[seam] = positions[0];
        normals[seam] = normals[0];
        tangents[seam] = tangents[0];
        uvs[seam] = {uStart + tube.repeats, v};
        writeStreams(ring, circle.size(), mesh, first);
    }

    /// Buttresses: each vertex as far out as the waves round the ring say, with the normal and tangent of that surface.
    static void partIntoLobes(const Tube& tube, const TubeRing& ring, std::span<const Vec2> circle, TreeMesh& mesh,
                              std::size_t first)
    {
        const RootFlare& roots = tube.roots;
        const Vec3 up = glm::cross(ring.tangent, ring.side);
        const float left = std::min(1 - ring.along / roots.length, 1.f);
        const float cube = roots.share * left * left * left;
        const float bare = ring.radius / (1 + cube);
        const float bareSlope = (ring.slope + 3 * bare * roots.share * left * left / roots.length) / (1 + cube);
        const float swell = bare * roots.depth * cube * left;
        const float swellSlope = roots.depth * cube * (bareSlope * left - 4 * bare / roots.length);
        constexpr std::array<float, 3> kStrengths{0.6f, 0.25f, 0.15f};
        const std::array<std::uint32_t, 3> waves{roots.lobes, roots.lobes - 2, 2};
        for (std::size_t j = 0; j < circle.size(); ++j)
        {
            float lobe = 0;
            float lobeTurn = 0; // by which it grows, a radian
            for (std::size_t k = 0; k < waves.size(); ++k)
            {
                const Vec2& at = circle[waves[k] * j % tube.sides];
                const Vec2& turn = roots.turns[k];
                lobe += kStrengths[k] * (at.x * turn.x - at.y * turn.y);
                lobeTurn -= kStrengths[k] * static_cast<float>(waves[k]) * (at.y * turn.x + at.x * turn.y);
            }
            const Vec3 outward = ring.side * circle[j].x + up * circle[j].y;
            const Vec3 round = up * circle[j].x - ring.side * circle[j].y;
            const float radius = ring.radius + swell * lobe;
            const float growth = swell * lobeTurn;
            const float slope = ring.slope + swellSlope * lobe;
            mesh.positions[first + j] = ring.centre + radius * outward;
            mesh.normals[first + j] = directionOr(radius * (outward - slope * ring.tangent) - growth * round, outward);
            mesh.tangents[first + j] = Vec4(directionOr(radius * round + growth * outward, round), 1);
        }
    }

    /// The optional arrays of `count` vertices that belong to `ring`, from `first` on.
    void writeStreams(const TubeRing& ring, std::size_t count, TreeMesh& mesh, std::size_t first)
    {
        if (streams_.tints)
            std::fill_n(&mesh.tints[first], count, woodTint(bark_, ring.radius / plan_.wideningOf(ring.segment)));
        if (streams_.sources)
            std::fill_n(&mesh.sources[first], count, VertexSource{.segment = ring.segment});
    }

    static void placeCollarRing(const Tube& tube, const TubeRing& ring, std::span<const Vec2> circle, TreeMesh& mesh,
                                std::size_t first)
    {
        const simd::Four side = simd::three(ring.side);
        const simd::Four up = simd::cross(simd::three(ring.tangent), side);
        const CollarRing onParent(tube.collar, ring);
        const float footDepth = tube.foot != kNoFoot ? 0 : kFootDepth;
        for (std::size_t j = 0; j < circle.size(); ++j)
        {
            const simd::Four outward = side * simd::all(circle[j].x) + up * simd::all(circle[j].y);
            simd::storeThree(&mesh.positions[first + j], onParent.pointAt(outward, footDepth));
        }
    }

    /// Puts the first ring on the points that its host has for it. The rest of the collar follows, ever less.
    void standOnHost(const Tube& tube, std::span<const TubeRing> rings, TreeMesh& mesh, std::size_t first)
    {
        const std::size_t foot = scratch_.sheets.feet[tube.foot].firstVertex;
        const std::size_t stride = tube.sides + 1;
        const auto placeOf = [&](std::size_t j) { return mesh_.positions[foot + (j == tube.sides ? 0 : j)]; };
        for (std::size_t i = 1; i < rings.size() && isInCollar(tube, rings[i]); ++i)
        {
            const float rest = 1 - CollarRing(tube.collar, rings[i]).level;
            for (std::size_t j = 0; j < stride; ++j)
            {
                const Vec3 move = placeOf(j) - mesh.positions[first + j];
                mesh.positions[first + i * stride + j] += rest * rest * move;
            }
        }
        for (std::size_t j = 0; j < stride; ++j)
        {
            const std::size_t own = j == tube.sides ? 0 : j;
            mesh.positions[first + j] = placeOf(j);
            if (streams_.tints)
                mesh.tints[first + j] = mesh_.tints[foot + own];
            if (streams_.sources)
                mesh.sources[first + j] = mesh_.sources[foot + own];
        }
    }

    /// Normals and tangents of a collar's rings from the vertices around each.
    static void shadeCollar(const Tube& tube, std::span<const TubeRing> rings, TreeMesh& mesh, std::size_t first)
    {
        const std::size_t stride = tube.sides + 1;
        for (std::size_t i = 0; isInCollar(tube, rings[i]); ++i)
        {
            const std::size_t row = first + i * stride;
            const std::size_t below = i == 0 ? row : row - stride;
            const CollarRing onParent(tube.collar, rings[i]);
            for (std::size_t j = 0; j < tube.sides; ++j)
            {
                const std::size_t before = j == 0 ? tube.sides - 1u : j - 1;
                const simd::Four round = three(mesh.positions[row + j + 1]) - three(mesh.positions[row + before]);
                const simd::Four along = three(mesh.positions[row + stride + j]) - three(mesh.positions[below + j]);
                const simd::Four own = simd::directionOr(simd::cross(round, along), three(mesh.normals[row + j]));
                const simd::Four normal = onParent.normalAt(three(mesh.positions[row + j]), own);
                const simd::Four tangent = three(Vec3(mesh.tangents[row + j]));
                simd::storeThree(&mesh.normals[row + j], normal);
                simd::storeThree(&mesh.tangents[row + j],
                                 sideNormalTo(normal, simd::dot(tangent, round) > 0 ? round : tangent));
            }
            mesh.normals[row + tube.sides] = mesh.normals[row];
            mesh.tangents[row + tube.sides] = mesh.tangents[row];
        }
    }

    /// Gives the foot and the host's points under it one normal, between what both have there.
    void shareNormals(const Tube& tube, TreeMesh& mesh, std::size_t first)
    {
        const TubeFoot& foot = scratch_.sheets.feet[tube.foot];
        for (std::size_t j = 0; j < tube.sides; ++j)
        {
            const Vec3 hosts = mesh_.normals[foot.firstVertex + j];
            const Vec3 normal = directionOr(hosts + mesh.normals[first + j], hosts);
            setNormal(normal, mesh, first + j);
            setNormal(normal, mesh_, foot.firstVertex + j);
        }
        setNormal(mesh.normals[first], mesh, first + tube.sides);
        const SheetBand& band = scratch_.sheets.bands[foot.band];
        const std::uint32_t stride = 2 * (scratch_.tubes[foot.host].sides + 1);
        const std::uint32_t own = foot.firstPoint - band.firstPoint;
        for (std::uint32_t c = 0; c < band.copyCount; ++c)
        {
            const std::uint32_t number = scratch_.sheets.copies[band.firstCopy + c];
            if (number < stride + own || number >= stride + own + foot.count)
                continue;
            const std::size_t copy = foot.firstVertex - own + band.pointCount + c;
            setNormal(mesh_.normals[foot.firstVertex + number - stride - own], mesh_, copy);
        }
    }

    static void setNormal(const Vec3& normal, TreeMesh& mesh, std::size_t vertex)
    {
        mesh.normals[vertex] = normal;
        mesh.tangents[vertex] = Vec4(sideNormalTo(normal, Vec3(mesh.tangents[vertex])), mesh.tangents[vertex].w);
    }

    /// Rows, then bands: each its points, its copies beyond the seam and its triangles.
    void writeSheet(const Tube& tube)
    {
        SheetPlan& plan = scratch_.sheets;
        const TubeSheet& sheet = plan.sheets[tube.sheet];
        const std::uint32_t stride = tube.sides + 1;
        const auto first = static_cast<std::uint32_t>(vertex_);
        for (std::uint32_t r = 0; r < sheet.rowCount; ++r)
        {
            const SheetRow& row = plan.rows[sheet.firstRow + r];
            if (row.rise == 0)
            {
                copyRing(row.ring * stride, stride);
                continue;
            }
            for (std::uint32_t j = 0; j < stride; ++j)
                writePoint(tube, {.ring = row.ring, .column = j, .rise = row.rise});
        }

        std::uint32_t row = 0;
        for (std::uint32_t b = 0; b < sheet.bandCount; ++b)
        {
            SheetBand& band = plan.bands[sheet.firstBand + b];
            for (; row < band.lowerRow; ++row)
                writeCells(first + row * stride, tube.sides, row + 2 == sheet.rowCount);
            row = band.lowerRow + 1;
            writeBand(tube, band, first + band.lowerRow * stride);
        }
        for (; row + 1 < sheet.rowCount; ++row)
            writeCells(first + row * stride, tube.sides, row + 2 == sheet.rowCount);

        for (std::uint32_t f = 0; f < sheet.footCount; ++f)
        {
            TubeFoot& foot = plan.feet[sheet.firstFoot + f];
            if (foot.isLost)
                continue;
            const SheetBand& band = plan.bands[foot.band];
            foot.firstVertex = band.firstVertex + foot.firstPoint - band.firstPoint;
        }
    }

    void writeBand(const Tube& tube, SheetBand& band, std::uint32_t lower)
    {
        const SheetPlan& plan = scratch_.sheets;
        const std::uint32_t rows = 2 * (tube.sides + 1);
        const auto points = static_cast<std::uint32_t>(vertex_);
        band.firstVertex = points;
        for (std::uint32_t p = 0; p < band.pointCount; ++p)
            writePoint(tube, plan.points[band.firstPoint + p]);
        for (std::uint32_t c = 0; c < band.copyCount; ++c)
        {
            const std::uint32_t number = plan.copies[band.firstCopy + c];
            copyVertex(number < rows ? lower + number : points + number - rows, tube.repeats);
        }
        for (std::uint32_t c = 0; c < band.cornerCount; ++c)
        {
            const std::uint32_t number = plan.corners[band.firstCorner + c];
            mesh_.indices[index_++] = number < rows ? lower + number : points + number - rows;
        }
    }

    /// `count` vertices of the rings as they are.
    void copyRing(std::size_t from, std::size_t count)
    {
        const TreeMesh& rings = scratch_.unwelded;
        const auto copy = [&](const auto& of, auto& to) {
            std::memcpy(&to[vertex_], &of[from], count * sizeof(of[from]));
        };
        copy(rings.positions, mesh_.positions);
        copy(rings.normals, mesh_.normals);
        copy(rings.tangents, mesh_.tangents);
        copy(rings.uvs, mesh_.uvs);
        if (streams_.tints)
            copy(rings.tints, mesh_.tints);
        if (streams_.sources)
            copy(rings.sources, mesh_.sources);
        vertex_ += count;
    }

    /// A vertex somewhere on the facets between the rings.
    void writePoint(const Tube& tube, const SheetPoint& point)
    {
        const TreeMesh& rings = scratch_.unwelded;
        const std::size_t stride = tube.sides + 1;
        const std::size_t a = point.ring * stride + point.column;
        const std::size_t b = point.share > 0 ? a + 1 : a;
        const std::size_t up = point.rise > 0 ? stride : 0;
        const auto between = [&](const auto& of) {
            return glm::mix(glm::mix(of[a], of[b], point.share), glm::mix(of[a + up], of[b + up], point.share),
                            point.rise);
        };
        const std::size_t nearest = point.rise > 0.5f ? a + up : a;
        mesh_.positions[vertex_] = between(rings.positions);
        mesh_.uvs[vertex_] = between(rings.uvs);
        if (b == a && up == 0)
        {
            mesh_.normals[vertex_] = rings.normals[a];
            mesh_.tangents[vertex_] = rings.tangents[a];
        }
        else
        {
            const Vec3 normal = directionOr(between(rings.normals), rings.normals[a]);
            mesh_.normals[vertex_] = normal;
            mesh_.tangents[vertex_] = Vec4(sideNormalTo(normal, Vec3(between(rings.tangents))), 1);
        }
        if (streams_.tints)
            mesh_.tints[vertex_] = rings.tints[nearest];
        if (streams_.sources)
            mesh_.sources[vertex_] = rings.sources[nearest];
        ++vertex_;
    }

    /// The same vertex a turn further round.
    void copyVertex(std::size_t vertex, float repeats)
    {
        mesh_.positions[vertex_] = mesh_.positions[vertex];
        mesh_.normals[vertex_] = mesh_.normals[vertex];
        mesh_.tangents[vertex_] = mesh_.tangents[vertex];
        mesh_.uvs[vertex_] = mesh_.uvs[vertex] + Vec2(repeats, 0);
        if (streams_.tints)
            mesh_.tints[vertex_] = mesh_.tints[vertex];
        if (streams_.sources)
            mesh_.sources[vertex_] = mesh_.sources[vertex];
        ++vertex_;
    }

    void writeSides(const Tube& tube, std::uint32_t first)
    {
        for (std::uint32_t i = 0; i + 1 < tube.ringCount; ++i)
            writeCells(first + i * (tube.sides + 1), tube.sides, i + 2 == tube.ringCount);
    }

    /// The facets between the row of vertices from `first` on and the next row, or the apex.
    void writeCells(std::uint32_t first, std::uint32_t sides, bool toApex)
    {
        const std::uint32_t stride = sides + 1;
        std::uint32_t* next = &mesh_.indices[index_];
        if (toApex)
        {
            for (std::uint32_t a = first; a < first + sides; ++a, next += 3)
            {
                next[0] = a;
                next[1] = a + 1;
                next[2] = a + stride;
            }
            index_ += 3 * std::size_t{sides};
            return;
        }
        // Two triangles a side, two sides at a time: three registers full.
        const auto at = [first](std::uint32_t corner) { return first + corner; };
        simd::FourCounts a{at(0), at(1), at(stride), at(1)};
        simd::FourCounts b{at(stride + 1), at(stride), at(1), at(2)};
        simd::FourCounts c{at(stride + 1), at(2), at(stride + 2), at(stride + 1)};
        for (std::uint32_t side = 0; side + 1 < sides; side += 2, next += 12)
        {
            simd::store(next, a);
            simd::store(next + 4, b);
            simd::store(next + 8, c);
            a += 2;
            b += 2;
            c += 2;
        }
        if (sides % 2 != 0)
        {
            simd::store(next, a);
            next[4] = first + stride + sides;
            next[5] = next[2];
        }
        index_ += 6 * std::size_t{sides};
    }

    /// A flat lid on the first ring.
    void writeLid(const Tube& tube, const TubeRing& ring, std::uint32_t first)
    {
        const auto rim = static_cast<std::uint32_t>(vertex_);
        for (std::uint32_t j = 0; j < tube.sides; ++j)
            writeBaseVertex(ring, mesh_.positions[first + j], -ring.tangent);
        if (tube.baseVertices > tube.sides)
        {
            writeBaseVertex(ring, ring.centre, -ring.tangent);
            for (std::uint32_t j = 0; j < tube.sides; ++j)
                writeTriangle(rim + tube.sides, rim + (j + 1) % tube.sides, rim + j);
            return;
        }
        for (std::uint32_t j = 1; j + 1 < tube.sides; ++j)
            writeTriangle(rim, rim + j + 1, rim + j);
    }

    /// A cone from the collar's foot down to the parent's axis: whatever shows of it, there is no hole.
    void writeRoot(const Tube& tube, const TubeRing& ring, std::uint32_t first)
    {
        const auto rim = static_cast<std::uint32_t>(vertex_);
        const Vec3 apex = tube.collar.joint;
        for (std::uint32_t j = 0; j < tube.sides; ++j)
        {
            const Vec3 arm = directionOr(mesh_.positions[first + j] - apex, ring.tangent);
            const Vec3 outward = mesh_.positions[first + j] - ring.centre;
            writeBaseVertex(ring, mesh_.positions[first + j], sideNormalTo(arm, outward));
        }
        writeBaseVertex(ring, apex, -ring.tangent);
        for (std::uint32_t j = 0; j < tube.sides; ++j)
            writeTriangle(rim + tube.sides, rim + (j + 1) % tube.sides, rim + j);
        // A cone that leans out over its rim would be mirrored there, unlike its tangents.
        Vec2& tip = mesh_.uvs[rim + tube.sides];
        for (std::uint32_t j = 0; j < tube.sides; ++j)
        {
            const Vec2 a = mesh_.uvs[rim + j] - tip;
            const Vec2 b = mesh_.uvs[rim + (j + 1) % tube.sides] - tip;
            if (a.x * b.y - a.y * b.x < 0)
                tip = Vec2(0);
        }
    }

    void writeBaseVertex(const TubeRing& ring, const Vec3& position, const Vec3& normal)
    {
        const Vec3 up = glm::cross(ring.tangent, ring.side);
        const Vec3 arm = position - ring.centre;
        mesh_.positions[vertex_] = position;
        mesh_.normals[vertex_] = normal;
        mesh_.tangents[vertex_] = Vec4(sideNormalTo(normal, ring.side), -1);
        mesh_.uvs[vertex_] = Vec2(glm::dot(arm, ring.side), glm::dot(arm, up) / tall_) / tile_;
        writeStreams(ring, 1, mesh_, vertex_);
        ++vertex_;
    }

    void writeTriangle(std::uint32_t a, std::uint32_t b, std::uint32_t c)
    {
        mesh_.indices[index_++] = a;
        mesh_.indices[index_++] = b;
        mesh_.indices[index_++] = c;
    }

    const TubePlan& plan_;
    TubeScratch& scratch_;
    MeshStreams streams_;
    float tile_;
    float tall_; ///< Of a tile of bark, in its widths.
    const BarkAppearance& bark_;
    TreeMesh& mesh_;
    std::size_t vertex_;
    std::size_t index_ = 0;
    PartCursors& cursors_;
};

/// Least cosine between a welded surface's normals and the triangles round them.
constexpr float kLeastFacing = 0.1f;

/// Turns normals that stand behind one of their triangles to its front. In the crotch of a steep branch, and where a
/// foot stands on a ridge of a parent with few sides, the normal that parent and branch share does: there they part
/// again. One pass: what a vertex's later triangles undo of its earlier ones is little.
void turnToFront(TreeMesh& mesh, std::size_t firstIndex)
{
    for (std::size_t i = firstIndex; i + 2 < mesh.indices.size(); i += 3)
    {
        const std::uint32_t* const corners = &mesh.indices[i];
        const simd::Four a = three(mesh.positions[corners[0]]);
        const simd::Four across =
            simd::cross(three(mesh.positions[corners[1]]) - a, three(mesh.positions[corners[2]]) - a);
        // Nearly all stand well in front; whoever does needs no unit vector to be told so.
        const float square = simd::dot(across, across);
        const float wellInFront = 1.02f * kLeastFacing * kLeastFacing * square;
        const auto isFine = [&](std::uint32_t corner) {
            const float ahead = simd::dot(three(mesh.normals[corner]), across);
            return ahead > 0 && ahead * ahead > wellInFront;
        };
        const bool isMeasured = square > 1e-24f && square < 1e24f; // far from where floats end
        if (isMeasured && isFine(corners[0]) && isFine(corners[1]) && isFine(corners[2]))
            continue;
        const Vec3 face = simd::vec3(simd::directionOr(across, simd::Four{}));
        for (int k = 0; k < 3; ++k)
        {
            Vec3& normal = mesh.normals[corners[k]];
            const float facing = glm::dot(normal, face);
            if (face == Vec3(0) || facing >= kLeastFacing)
                continue;
            normal = directionOr(normal + (kLeastFacing - facing) * face, face);
            Vec4& tangent = mesh.tangents[corners[k]];
            tangent = Vec4(sideNormalTo(normal, Vec3(tangent)), tangent.w);
        }
    }
}

TubePlan planOf(const Skeleton& skeleton, const BarkAppearance& bark, const TubeSettings& settings,
                TubeScratch& scratch)
{
    TubeSettings kept = clamped(settings);
    if (kept.widening.size() != skeleton.size())
        kept.widening = {}; // of another skeleton
    const AxisRounding rounding{.smoothing = kept.smoothing,
                                .cosMaxTurn = static_cast<float>(math::cos(static_cast<double>(kept.maxRingAngle)))};
    return {skeleton, kept, rounding, bark, std::clamp(bark.tile, 1e-3f, 100.f), scratch};
}

/// Plans all tubes, or as many as need more than `enough` indices, and adds to `counts` and `cursors` what they will
/// take.
MeshResult planTubes(const TubePlan& plan, const Limits& limits, std::uint64_t enough, MeshCounts& counts,
                     PartCursors& cursors)
{
    const Skeleton& skeleton = plan.skeleton;
    TubeScratch& scratch = plan.scratch;
    if (!isSound(skeleton) || !isWoodWithin(skeleton, static_cast<float>(limits.coordinate)))
        return MeshResult::UnsoundSkeleton;

    beginPlan(plan);
    MeshCounts all = counts;
    const auto count = [&](const Tube& tube) {
        all.vertices += vertexCountOf(tube, scratch.sheets);
        const std::uint64_t own = indexCountOf(tube, scratch.sheets);
        all.indices += own;
        cursors.count(tube.colour, own);
        return all.vertices <= limits.vertices && all.indices <= std::numeric_limits<std::uint32_t>::max();
    };
    const bool isWelded = plan.settings.joints == TubeJoints::Weld;
    for (std::uint32_t i = 0; i < skeleton.size(); ++i)
    {
        if (!planTubeAt(plan, i))
            continue;
        if (!isWelded && !count(scratch.tubes.back()))
            return MeshResult::TooManyVertices;
        // Of each ring some vertices stay, whatever is welded to it.
        if (isWelded && scratch.rings.size() > limits.vertices)
            return MeshResult::TooManyVertices;
        if (all.indices > enough)
            break;
    }
    if (scratch.tubes.empty())
        return MeshResult::EmptySkeleton;
    if (isWelded)
    {
        scratch.unwelded.resizeVertices(0, {});
        frameTubes(plan);
        planWelds(plan);
        for (const Tube& tube : scratch.tubes)
        {
            if (!count(tube))
                return MeshResult::TooManyVertices;
        }
    }
    all.parts += cursors.parts();
    all.streams.tints = all.streams.tints || plan.settings.streams.tints;
    all.streams.sources = all.streams.sources || plan.settings.streams.sources;
    counts = all;
    return MeshResult::Ok;
}

} // namespace

MeshResult countTubes(const Skeleton& skeleton, const BarkAppearance& bark, const TubeSettings& settings,
                      const Limits& limits, TubeScratch& scratch, MeshCounts& counts, std::uint64_t enough)
{
    PartCursors cursors;
    return planTubes(planOf(skeleton, bark, settings, scratch), limits, enough, counts, cursors);
}

MeshResult meshTubes(const Skeleton& skeleton, const BarkAppearance& bark, const TubeSettings& settings,
                     const Limits& limits, TubeScratch& scratch, TreeMesh& mesh)
{
    const TubePlan plan = planOf(skeleton, bark, settings, scratch);
    MeshCounts counts = countsOf(mesh);
    PartCursors cursors;
    if (const MeshResult result = planTubes(plan, limits, kCountAll, counts, cursors); result != MeshResult::Ok)
        return result;

    if (plan.settings.joints == TubeJoints::Embed)
        frameTubes(plan);
    const std::size_t firstVertex = mesh.positions.size();
    const std::size_t firstIndex = mesh.indices.size();
    mesh.resizeVertices(counts.vertices, plan.settings.streams);
    cursors.open(MeshMaterial::Bark, mesh);
    TubeWriter writer(plan, bark, mesh, firstVertex, cursors);
    for (const Tube& tube : scratch.tubes)
        writer.write(tube);
    if (plan.settings.joints == TubeJoints::Weld)
        turnToFront(mesh, firstIndex);
    return MeshResult::Ok;
}

} // namespace espalier
