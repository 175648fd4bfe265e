#include <Espalier/Mesh/Bounds.h>
#include <Espalier/Mesh/LeafMesher.h>

#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Core/Simd.h>
#include <Espalier/Mesh/AxisCurve.h>
#include <Espalier/Mesh/BallPattern.h>
#include <Espalier/Mesh/RingFrames.h>
#include <Espalier/Species/LeafOutline.h>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

// A kind's triangles are laid out once, in a frame of the leaf's own; every leaf is a copy of them, moved to its place.
// Only normals differ from leaf to leaf, because each lies elsewhere in the crown.

namespace espalier {
namespace {

using simd::all;
using simd::Four;
using simd::three;

/// However far a normal is bent outwards, it keeps this share of how much it agrees with the triangles round it.
constexpr float kAgreement = 0.25f;

/// Where leaves are thinned, those that stay grow to so many errors.
constexpr float kGrown = 2;

/// A margin round what is drawn, in half widths of the surface: textures are filtered.
constexpr float kMargin = 0.04f;

LeafSettings clamped(LeafSettings settings)
{
    settings.bend = clampedTo(settings.bend, 0, 1e9f);
    settings.error = clampedTo(settings.error, 0, 1e9f);
    return settings;
}

const LeafReach& reachOf(const LeafAppearance& kind, std::vector<LeafReach>& known)
{
    for (const LeafReach& reach : known)
        if (reach.kind == kind)
            return reach;
    constexpr std::size_t kMostKnown = 64; // a scratch that has seen all the seasons of a few species
    if (known.size() == kMostKnown)
        known.clear();
    known.reserve(kMostKnown);
    LeafReach reach{.kind = kind};
    const LeafSurface surface(kind);
    constexpr int kFiner = 6; // rows looked at for one, with those on its edges
    constexpr int kColumns = 48;
    for (std::size_t row = 0; row < LeafReach::kRows; ++row)
        for (int part = 0; part <= kFiner; ++part)
        {
            const float v = (static_cast<float>(row) + static_cast<float>(part) / kFiner) / LeafReach::kRows;
            const auto isDrawn = [&](float across) {
                return surface.at({0.5f + 0.5f * across, v}) || surface.at({0.5f - 0.5f * across, v});
            };
            for (int i = kColumns; i > 0 && static_cast<float>(i) / kColumns > reach.halfWidths[row]; --i)
                if (isDrawn((static_cast<float>(i) - 0.5f) / kColumns))
                    reach.halfWidths[row] = static_cast<float>(i) / kColumns;
        }
    known.push_back(reach);
    return known.back();
}

/// A hexagon round the drawing: half widths at the foot, at the widest row and at the tip, as shares.
struct Hexagon
{
    float middle = 0.5f; ///< Where the widest row lies, from foot to tip.
    float foot = 1;
    float widest = 1;
    float tip = 1;

    [[nodiscard]] float area() const { return 0.5f * ((foot + widest) * middle + (widest + tip) * (1 - middle)); }
};

/// The narrowest hexagon that covers all rows when its widest row is at `middle`.
Hexagon hexagonAt(float middle, float widest, const LeafReach& reach)
{
    Hexagon hexagon{.middle = middle, .foot = 0.04f, .widest = widest, .tip = 0.04f};
    for (std::size_t row = 0; row < LeafReach::kRows; ++row)
    {
        const float half = std::min(reach.halfWidths[row] + kMargin, widest);
        // Either end of a row must be inside; the end away from the middle asks for more.
        for (const std::size_t end : {row, row + 1})
        {
            const float y = static_cast<float>(end) / static_cast<float>(LeafReach::kRows);
            const float share = y < middle ? y / middle : (1 - y) / (1 - middle);
            float& corner = y < middle ? hexagon.foot : hexagon.tip;
            if (share < 0.999f)
                corner = std::max(corner, std::min((half - share * widest) / (1 - share), 1.f));
            else
                continue;
        }
    }
    return hexagon;
}

Hexagon hexagonOf(const LeafReach& reach)
{
    const float widest = std::min(*std::ranges::max_element(reach.halfWidths) + kMargin, 1.f);
    Hexagon best{.foot = widest, .widest = widest, .tip = widest};
    for (int i = 3; i <= 13; ++i)
        if (const Hexagon hexagon = hexagonAt(static_cast<float>(i) / 16, widest, reach); hexagon.area() < best.area())
            best = hexagon;
    return best;
}

/// Lays out the vertices and triangles of one flat or folded layer.
class PatternMaker
{
public:
    explicit PatternMaker(LeafPattern& pattern) : pattern_(pattern)
    {
        pattern_.vertices.clear();
        pattern_.indices.clear();
    }

    std::uint32_t add(const Vec3& position, const Vec2& uv, const Vec3& facing, const Vec3& right)
    {
        pattern_.vertices.push_back({.position = position, .right = right, .uv = uv, .facing = facing});
        return static_cast<std::uint32_t>(pattern_.vertices.size() - 1);
    }

    /// Counter-clockwise from the front.
    void addQuad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d)
    {
        for (const std::uint32_t i : {a, b, c, a, c, d})
            pattern_.indices.push_back(i);
    }

    /// Normals from the triangles that meet.
    void finish()
    {
        for (std::uint32_t v = 0; v < pattern_.vertices.size(); ++v)
        {
            LeafVertex& vertex = pattern_.vertices[v];
            std::uint32_t count = 0;
            Vec3 sum(0);
            for (std::size_t i = 0; i < pattern_.indices.size(); i += 3)
            {
                const std::uint32_t* corners = &pattern_.indices[i];
                if (std::find(corners, corners + 3, v) == corners + 3)
                    continue;
                const Vec3 a = pattern_.vertices[corners[0]].position;
                const Vec3 normal = directionOr(
                    glm::cross(pattern_.vertices[corners[1]].position - a, pattern_.vertices[corners[2]].position - a),
                    vertex.facing);
                const auto known = vertex.triangles.begin() + static_cast<std::ptrdiff_t>(count);
                const bool isKnown = std::any_of(vertex.triangles.begin(), known,
                                                 [&](const Vec3& other) { return glm::dot(other, normal) > 0.9999f; });
                if (isKnown || count == vertex.triangles.size())
                    continue;
                vertex.triangles[count++] = normal;
                sum += normal;
            }
            vertex.normal = directionOr(sum, vertex.facing);
            vertex.triangleCount = count;
            for (std::uint32_t i = 0; i < count; ++i)
                vertex.agree[i] = glm::dot(vertex.normal, vertex.triangles[i]);
        }
    }

private:
    LeafPattern& pattern_;
};

constexpr Vec3 kRight{1, 0, 0};
constexpr Vec3 kUp{0, 0, 1};

void layBlade(const LeafAppearance& kind, const Hexagon& hexagon, float bend, float longest, LeafPattern& pattern)
{
    const float arch = kind.arch;
    const math::SinCos rise = math::sinCos(static_cast<double>(kind.fold));
    const float halfWidth = 0.5f * kind.width;
    const bool isFolded = static_cast<float>(rise.sin) * halfWidth * longest > bend;
    const bool isArched = std::abs(arch) * longest > bend;

    struct Row
    {
        float along, half; // half the width as a share
    };
    std::array<Row, 3> rows{{{0, hexagon.foot}, {hexagon.middle, hexagon.widest}, {1, hexagon.tip}}};
    std::size_t count = 3;
    if (!isArched)
    {
        rows = {{{0, hexagon.widest}, {1, hexagon.widest}, {}}};
        count = 2;
    }
    PatternMaker maker(pattern);
    const Vec3 across = isFolded ? Vec3(static_cast<float>(rise.cos), 0, static_cast<float>(rise.sin)) : kRight;
    const std::uint32_t columns = isFolded ? 3 : 2;
    for (std::size_t i = 0; i < count; ++i)
    {
        const float y = rows[i].along;
        const float height = isArched ? 4 * arch * y * (1 - y) : 0;
        for (std::uint32_t column = 0; column < columns; ++column)
        {
            const float side = 2 * static_cast<float>(column) / static_cast<float>(columns - 1) - 1;
            const float x = side * rows[i].half * halfWidth;
            // Along u in the half that it is in, or between both: what bends normals leaves tangents as they would be.
            const Vec3 right = isFolded ? Vec3(across.x, 0, side * across.z) : kRight;
            maker.add({x * across.x, y, height + std::abs(x) * across.z}, {0.5f + 0.5f * side * rows[i].half, y}, kUp,
                      directionOr(right, kRight));
        }
    }
    for (std::uint32_t i = 0; i + 1 < count; ++i)
        for (std::uint32_t column = 0; column + 1 < columns; ++column)
        {
            const std::uint32_t a = i * columns + column;
            // Diagonals mirror each other, so that either half looks like the other.
            if (column == 0)
                maker.addQuad(a, a + 1, a + columns + 1, a + columns);
            else
                maker.addQuad(a + 1, a + columns + 1, a + columns, a);
        }
    maker.finish();
}

void layQuad(const Vec3& across, const Vec3& facing, float halfWidth, float half, PatternMaker& maker)
{
    const Vec3 side = half * halfWidth * across;
    const float u = 0.5f * half;
    const Vec3 tip(0, 1, 0);
    const std::uint32_t first = maker.add(-side, {0.5f - u, 0}, facing, across);
    maker.add(side, {0.5f + u, 0}, facing, across);
    maker.add(side + tip, {0.5f + u, 1}, facing, across);
    maker.add(tip - side, {0.5f - u, 1}, facing, across);
    maker.addQuad(first, first + 1, first + 2, first + 3);
}

void layCrossed(const LeafAppearance& kind, const Hexagon& hexagon, float bend, float longest, LeafPattern& pattern)
{
    const float halfWidth = 0.5f * kind.width;
    PatternMaker maker(pattern);
    layQuad(kRight, kUp, halfWidth, hexagon.widest, maker);
    // One plane does where the other would stand out less than can be seen; it is the wider then.
    if (halfWidth * longest > bend)
        layQuad(-kUp, kRight, halfWidth, hexagon.widest, maker);
    maker.finish();
}

/// A thin triangle from the bark into the fruit.
void addStalk(const Vec3& across, const Vec3& facing, float length, LeafPattern& pattern)
{
    constexpr float kHalfWidth = 0.02f; // in lengths
    const auto first = static_cast<std::uint32_t>(pattern.vertices.size());
    for (const Vec3& corner : {-kHalfWidth * across, kHalfWidth * across, Vec3(0, length, 0)})
        pattern.vertices.push_back(
            {.position = corner, .normal = facing, .right = across, .uv = {0.5f, 0}, .facing = facing});
    for (std::uint32_t i = 0; i < 3; ++i)
        pattern.indices.push_back(first + i);
}

void layBall(const LeafAppearance& kind, float bend, float longest, LeafPattern& pattern)
{
    const float stalk = kind.stalk;
    const float radius = 0.5f * (1 - stalk);
    const float sides =
        std::ceil(static_cast<float>(math::kPi) * std::sqrt(radius * longest / (2 * std::max(bend, 1e-6f))));
    BallPattern ball;
    ball.sides = 2 * static_cast<std::uint32_t>(clampedTo(std::ceil(sides / 2), 2, 6));
    ball.stacks = ball.sides / 2;
    pattern.vertices.clear();
    pattern.indices.clear();
    const Vec3 middle(0, stalk + radius, 0);
    ball.eachVertex([&](const Vec3& outward, const Vec3& along, const Vec2& uv) {
        pattern.vertices.push_back(
            {.position = middle + radius * outward, .normal = outward, .right = along, .uv = uv, .facing = outward});
    });
    ball.eachTriangle([&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        for (const std::uint32_t i : {a, b, c})
            pattern.indices.push_back(i);
    });
    if (stalk * longest > bend)
        for (const auto& [across, facing] : {std::pair(kRight, kUp), std::pair(-kUp, kRight)})
            addStalk(across, facing, stalk + 0.5f * radius, pattern);
}

/// Notes which vertices need no normal of their own: all but the first of a flat quad.
void noteLikes(std::vector<LeafVertex>& vertices)
{
    for (std::size_t i = 1; i < vertices.size(); ++i)
    {
        const LeafVertex& a = vertices[i - 1];
        LeafVertex& b = vertices[i];
        b.isLitAsBefore = a.normal == b.normal && a.right == b.right && a.facing == b.facing &&
                          a.triangleCount == b.triangleCount && a.triangles == b.triangles && a.agree == b.agree;
    }
}

void layKind(const LeafAppearance& wanted, float bend, LeafScratch& scratch, LeafPattern& pattern)
{
    const LeafAppearance kind = withinRanges(wanted);
    const float longest = kind.length * (1 + kind.lengthSpread);
    pattern.bends = kind.form == LeafForm::Ball ? 0 : kind.crownNormals;
    if (kind.form == LeafForm::Ball)
    {
        layBall(kind, bend, longest, pattern);
        return;
    }
    const Hexagon hexagon = hexagonOf(reachOf(kind, scratch.reaches));
    if (kind.form == LeafForm::Crossed)
        layCrossed(kind, hexagon, bend, longest, pattern);
    else
        layBlade(kind, hexagon, bend, longest, pattern);
}

void layPattern(const LeafAppearance& wanted, float bend, LeafScratch& scratch, LeafPattern& pattern)
{
    layKind(wanted, bend, scratch, pattern);
    noteLikes(pattern.vertices);
}

/// Which leaves of a kind stay at some error, and how much longer they are.
class Thinned
{
public:
    Thinned(const LeafAppearance& kind, float error)
    {
        const float width = kind.form == LeafForm::Ball ? 1 : clampedTo(kind.width, 0.01f, 4);
        scale_ = error > 0 ? width / (kGrown * kGrown * error * error) : std::numeric_limits<float>::infinity();
    }

    /// Share of leaves like this one that stay; 1 or more: all.
    [[nodiscard]] float kept(const PlacedLeaf& leaf) const { return leaf.length * leaf.length * scale_; }
    [[nodiscard]] bool keeps(const PlacedLeaf& leaf) const { return leaf.lot < kept(leaf); }
    [[nodiscard]] float lengthOf(const PlacedLeaf& leaf) const
    {
        const float share = kept(leaf);
        return share < 1 ? leaf.length / std::sqrt(share) : leaf.length;
    }

private:
    float scale_;
};

/// Copies patterns to where leaves are.
class LeafWriter
{
public:
    LeafWriter(std::size_t firstVertex, std::size_t firstIndex, TreeMesh& mesh)
        : vertex_(firstVertex), index_(firstIndex), mesh_(mesh)
    {}

    void write(const PlacedLeaf& leaf, float length, const VertexSource& source, const LeafPattern& pattern)
    {
        const Four y = three(leaf.heading);
        const Four z = three(leaf.face);
        const Four x = simd::cross(y, z);
        const Four outward = three(leaf.outward);
        const Four out{simd::dot(outward, x), simd::dot(outward, y), simd::dot(outward, z), 0};
        const Four foot = three(leaf.foot);
        const Four size = simd::all(length);
        const auto toPlant = [&](Four v) {
            return simd::splat<0>(v) * x + simd::splat<1>(v) * y + simd::splat<2>(v) * z;
        };
        constexpr Four kRightHanded{0, 0, 0, 1};
        Four normal{};
        Four along{};
        const auto first = static_cast<std::uint32_t>(vertex_);
        Vec3* position = &mesh_.positions[vertex_];
        Vec3* normalAt = &mesh_.normals[vertex_];
        Vec4* tangent = &mesh_.tangents[vertex_];
        Vec2* uv = &mesh_.uvs[vertex_];
        for (const LeafVertex& vertex : pattern.vertices)
        {
            if (!vertex.isLitAsBefore)
            {
                const Four bent = bentOut(vertex, out, pattern.bends);
                const Four right = three(vertex.right);
                const Four flat = right - all(simd::dot(right, bent)) * bent;
                normal = toPlant(bent);
                along = simd::withLast(simd::firstThree(toPlant(flat * all(1 / simd::length(flat)))), kRightHanded);
            }
            simd::storeThree(position++, foot + size * toPlant(three(vertex.position)));
            simd::storeThree(normalAt++, normal);
            simd::store(tangent++, along);
            *uv++ = vertex.uv;
        }
        vertex_ += pattern.vertices.size();
        const std::size_t count = pattern.vertices.size();
        if (!mesh_.tints.empty())
            std::fill_n(&mesh_.tints[first], count, leaf.tint);
        if (!mesh_.sources.empty())
            std::fill_n(&mesh_.sources[first], count, source);
        std::uint32_t* index = &mesh_.indices[index_];
        for (const std::uint32_t i : pattern.indices)
            *index++ = first + i;
        index_ += pattern.indices.size();
    }

private:
    /// Towards the outside, or away from it where the leaf's back is there, but no farther than leaves the normal in
    /// front of every triangle round it.
    static Four bentOut(const LeafVertex& vertex, Four out, float bends)
    {
        const Four own = three(vertex.normal);
        if (!(bends > 0))
            return own;
        const Four aim = simd::dot(out, three(vertex.facing)) < 0 ? -out : out;
        float share = bends;
        for (std::uint32_t i = 0; i < vertex.triangleCount; ++i)
        {
            const float agree = vertex.agree[i];
            const float aimed = simd::dot(aim, three(vertex.triangles[i]));
            if (agree + share * (aimed - agree) < kAgreement * agree)
                share = (1 - kAgreement) * agree / (agree - aimed);
        }
        const Four bent = own + all(share) * (aim - own);
        return bent * all(1 / simd::length(bent));
    }

    std::size_t vertex_;
    std::size_t index_;
    TreeMesh& mesh_;
};

std::span<const LeafAppearance> known(std::span<const LeafAppearance> kinds)
{
    return kinds.first(std::min(kinds.size(), kMaxLeafKinds));
}

/// Adds so many leaves of kind `k`, whose pattern is laid.
void add(std::uint64_t leaves, std::size_t k, const LeafScratch& scratch, LeafCounts& counts)
{
    counts.leaves += leaves;
    counts.vertices += leaves * scratch.patterns[k].vertices.size();
    counts.indices += leaves * scratch.patterns[k].indices.size();
    counts.parts += leaves > 0 ? 1 : 0;
}

} // namespace

LeafCounts countLeaves(const Foliage& foliage, std::span<const LeafAppearance> kinds, const LeafSettings& settings,
                       LeafScratch& scratch)
{
    const LeafSettings kept = clamped(settings);
    LeafCounts counts;
    kinds = known(kinds);
    for (std::size_t k = 0; k < kinds.size(); ++k)
    {
        const std::span<const PlacedLeaf> leaves = foliage.ofKind(k);
        if (leaves.empty())
            continue;
        layPattern(kinds[k], std::max(kept.bend, kept.error), scratch, scratch.patterns[k]);
        const Thinned thinned(kinds[k], kept.error);
        std::uint64_t count = leaves.size();
        if (kept.error > 0)
            count = static_cast<std::uint64_t>(
                std::ranges::count_if(leaves, [&](const PlacedLeaf& leaf) { return thinned.keeps(leaf); }));
        add(count, k, scratch, counts);
    }
    return counts;
}

LeafCounts countLeaves(const PlaceCounts& places, std::span<const LeafAppearance> kinds, const LeafSettings& settings,
                       LeafScratch& scratch)
{
    const LeafSettings kept = clamped(settings);
    LeafCounts counts;
    kinds = known(kinds);
    for (std::size_t k = 0; k < kinds.size(); ++k)
    {
        layPattern(kinds[k], std::max(kept.bend, kept.error), scratch, scratch.patterns[k]);
        add(places[k], k, scratch, counts);
    }
    return counts;
}

MeshResult addLeaves(const LeafCounts& leaves, const MeshStreams& streams, const Limits& limits,
                     MeshCounts& counts) noexcept
{
    if (leaves.leaves == 0)
        return MeshResult::EmptySkeleton;
    if (leaves.vertices + counts.vertices > limits.vertices ||
        leaves.indices + counts.indices > std::numeric_limits<std::uint32_t>::max())
        return MeshResult::TooManyVertices;
    counts.vertices += leaves.vertices;
    counts.indices += leaves.indices;
    counts.parts += leaves.parts;
    counts.streams.tints = counts.streams.tints || streams.tints;
    counts.streams.sources = counts.streams.sources || streams.sources;
    return MeshResult::Ok;
}

MeshResult meshLeaves(const Foliage& foliage, std::span<const LeafAppearance> kinds, const LeafSettings& settings,
                      const Limits& limits, LeafScratch& scratch, TreeMesh& mesh)
{
    const LeafSettings kept = clamped(settings);
    kinds = known(kinds);
    MeshCounts counts = countsOf(mesh);
    if (const MeshResult result = addLeaves(countLeaves(foliage, kinds, kept, scratch), kept.streams, limits, counts);
        result != MeshResult::Ok)
        return result;
    const std::size_t firstVertex = mesh.positions.size();
    const std::size_t firstIndex = mesh.indices.size();
    mesh.resizeVertices(counts.vertices, kept.streams);
    mesh.indices.resize(counts.indices);
    LeafWriter writer(firstVertex, firstIndex, mesh);
    std::size_t index = firstIndex;
    for (std::size_t k = 0; k < kinds.size(); ++k)
    {
        const std::span<const PlacedLeaf> leaves = foliage.ofKind(k);
        const Thinned thinned(kinds[k], kept.error);
        std::size_t count = 0;
        for (std::size_t i = 0; i < leaves.size(); ++i)
            if (thinned.keeps(leaves[i]))
            {
                const auto organ = static_cast<std::uint32_t>(kept.firstOrgan + foliage.starts[k] + i);
                writer.write(leaves[i], thinned.lengthOf(leaves[i]), {leaves[i].segment, organ, leaves[i].lot},
                             scratch.patterns[k]);
                ++count;
            }
        if (count == 0)
            continue;
        const std::size_t indices = count * scratch.patterns[k].indices.size();
        mesh.parts.push_back({.material = MeshMaterial::Leaves,
                              .firstIndex = static_cast<std::uint32_t>(index),
                              .indexCount = static_cast<std::uint32_t>(indices),
                              .colour = static_cast<std::uint16_t>(k)});
        index += indices;
    }
    return MeshResult::Ok;
}

} // namespace espalier
