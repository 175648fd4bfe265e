#include <Espalier/Mesh/Impostor.h>

#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Mesh/TreeMesh.h>
#include <Espalier/Plant/Skeleton.h>
#include <algorithm>
#include <cmath>
#include <limits>

namespace espalier {

namespace {

/// Keeps the plant off the rim of its frames, so that neither filters nor the first mip maps mix it with the next.
constexpr float kMargin = 1.0f / 32;

/// What of `mesh` lies where along `axis`, from `centre`.
struct Reach
{
    float low = std::numeric_limits<float>::max();
    float high = std::numeric_limits<float>::lowest();
};

Reach reachAlong(const TreeMesh& mesh, const Vec3& centre, const Vec3& axis)
{
    Reach reach;
    for (const Vec3& p : mesh.positions)
    {
        const float at = glm::dot(p - centre, axis);
        reach.low = std::min(reach.low, at);
        reach.high = std::max(reach.high, at);
    }
    return reach;
}

/// Where cards cross: through the wood of the plant's lowest third. A trunk beside that line would be seen once for
/// each card.
Vec3 trunkOf(const TreeMesh& mesh, const Vec3& centre, const Reach& height)
{
    constexpr double kLow = 1.0 / 3;
    const double top = glm::mix(static_cast<double>(height.low), static_cast<double>(height.high), kLow);
    DVec3 sum(0);
    double whole = 0;
    for (const MeshPart& part : mesh.parts)
    {
        if (part.material != MeshMaterial::Bark)
            continue;
        for (std::uint32_t i = part.firstIndex; i + 2 < part.firstIndex + part.indexCount; i += 3)
        {
            const DVec3 a(mesh.positions[mesh.indices[i]]);
            const DVec3 b(mesh.positions[mesh.indices[i + 1]]);
            const DVec3 c(mesh.positions[mesh.indices[i + 2]]);
            const DVec3 middle = (a + b + c) / 3.0;
            if (middle.y > top)
                continue;
            const double area = glm::length(glm::cross(b - a, c - a));
            sum += area * middle;
            whole += area;
        }
    }
    const auto at = [&](double part) { return static_cast<float>(part / whole); };
    return whole > 0 ? Vec3(at(sum.x), centre.y, at(sum.z)) : centre;
}

ImpostorFrame cardOf(const TreeMesh& mesh, const Vec3& through, float radius, const Vec3& toViewer, const Vec3& right)
{
    ImpostorFrame frame{.toViewer = toViewer, .right = right, .up = glm::cross(toViewer, right)};
    const Reach across = reachAlong(mesh, through, frame.right);
    const Reach along = reachAlong(mesh, through, frame.up);
    frame.middle =
        through + 0.5f * (across.low + across.high) * frame.right + 0.5f * (along.low + along.high) * frame.up;
    // A flat plant seen edge-on has no width.
    const Vec2 extent = glm::max(Vec2(across.high - across.low, along.high - along.low), Vec2(1e-3f * radius));
    frame.halfExtent = (0.5f + kMargin) * extent;
    // Cards lie back to back, off their plane by as little as never shows: readers that draw both sides of all see the
    // right one.
    frame.middle += 1e-3f * radius * toViewer;
    return frame;
}

} // namespace

Vec2 hemiOctahedral(const Vec3& direction) noexcept
{
    const float y = std::max(direction.y, 0.0f);
    const float sum = std::abs(direction.x) + y + std::abs(direction.z);
    if (!(sum > 0))
        return Vec2(0.5f);
    const float x = direction.x / sum;
    const float z = direction.z / sum;
    return 0.5f * Vec2(x + z, x - z) + Vec2(0.5f);
}

Vec3 hemiDirection(const Vec2& square) noexcept
{
    const Vec2 e = 2.0f * square - Vec2(1);
    const float x = 0.5f * (e.x + e.y);
    const float z = 0.5f * (e.x - e.y);
    return glm::normalize(Vec3(x, 1 - std::abs(x) - std::abs(z), z));
}

FrameBlend framesFor(const Vec3& toViewer, std::uint32_t side) noexcept
{
    const auto cells = static_cast<float>(side - 1);
    const Vec2 at = hemiOctahedral(toViewer) * cells;
    const float left = std::clamp(std::floor(at.x), 0.0f, cells - 1);
    const float top = std::clamp(std::floor(at.y), 0.0f, cells - 1);
    const Vec2 in = at - Vec2(left, top);
    const std::uint32_t first = static_cast<std::uint32_t>(top) * side + static_cast<std::uint32_t>(left);
    if (in.x + in.y < 1)
        return {{first, first + 1, first + side}, {1 - in.x - in.y, in.x, in.y}};
    return {{first + side + 1, first + 1, first + side}, {in.x + in.y - 1, 1 - in.y, 1 - in.x}};
}

Impostor makeImpostor(const TreeMesh& full, ImpostorKind kind, std::uint32_t side)
{
    Impostor impostor;
    impostor.kind = kind;
    if (full.positions.empty())
        return impostor;
    const Reach x = reachAlong(full, Vec3(0), {1, 0, 0});
    const Reach y = reachAlong(full, Vec3(0), {0, 1, 0});
    const Reach z = reachAlong(full, Vec3(0), {0, 0, 1});
    impostor.centre = 0.5f * Vec3(x.low + x.high, y.low + y.high, z.low + z.high);
    for (const Vec3& p : full.positions)
        impostor.radius = std::max(impostor.radius, glm::length(p - impostor.centre));

    if (kind == ImpostorKind::Cards)
    {
        const Vec3 trunk = trunkOf(full, impostor.centre, y);
        for (int i = 0; i < 8; ++i)
        {
            const auto [sin, cos] = math::sinCosDegrees(45.0 * i);
            const auto s = static_cast<float>(sin);
            const auto c = static_cast<float>(cos);
            impostor.frames.push_back(cardOf(full, trunk, impostor.radius, {s, 0, c}, {c, 0, -s}));
        }
        return impostor;
    }

    impostor.columns = std::clamp(side, kMinImpostorSide, kMaxImpostorSide);
    impostor.rows = impostor.columns;
    const auto cells = static_cast<float>(impostor.columns - 1);
    for (std::uint32_t row = 0; row < impostor.rows; ++row)
        for (std::uint32_t column = 0; column < impostor.columns; ++column)
        {
            ImpostorFrame frame;
            frame.middle = impostor.centre;
            frame.toViewer = hemiDirection(Vec2(static_cast<float>(column), static_cast<float>(row)) / cells);
            const Vec3 level(frame.toViewer.z, 0, -frame.toViewer.x);
            const float length = glm::length(level);
            frame.right = length > 1e-4f ? level / length : Vec3(1, 0, 0); // from straight above any will do
            frame.up = glm::cross(frame.toViewer, frame.right);
            frame.halfExtent = Vec2((1 + 2 * kMargin) * impostor.radius);
            impostor.frames.push_back(frame);
        }
    return impostor;
}

float impostorError(const Impostor& impostor, std::uint32_t texels) noexcept
{
    const auto cell = [&](std::uint32_t count) {
        return std::max(static_cast<float>(texels) / static_cast<float>(count), 1.0f);
    };
    float texel = 0;
    float height = 0;
    for (const ImpostorFrame& frame : impostor.frames)
    {
        texel = std::max(
            {texel, 2 * frame.halfExtent.x / cell(impostor.columns), 2 * frame.halfExtent.y / cell(impostor.rows)});
        height = std::max(height, 2 * frame.halfExtent.y);
    }
    constexpr float kTexels = 4;
    constexpr float kPixels = 96;
    return impostor.kind == ImpostorKind::Cards ? std::max(kTexels * texel, height / kPixels) : texel;
}

void meshCards(const Impostor& impostor, TreeMesh& mesh)
{
    if (impostor.kind != ImpostorKind::Cards || impostor.frames.empty())
        return;
    const auto firstIndex = static_cast<std::uint32_t>(mesh.indices.size());
    auto vertex = static_cast<std::uint32_t>(mesh.positions.size());
    mesh.resizeVertices(vertex + 4 * impostor.frames.size(), {!mesh.tints.empty(), !mesh.sources.empty()});
    const Vec2 cell = Vec2(1) / Vec2(static_cast<float>(impostor.columns), static_cast<float>(impostor.rows));
    for (std::uint32_t i = 0; i < impostor.frames.size(); ++i)
    {
        const ImpostorFrame& frame = impostor.frames[i];
        const Vec2 corner(static_cast<float>(i % impostor.columns) * cell.x,
                          1 - static_cast<float>(i / impostor.columns + 1) * cell.y);
        for (const std::uint32_t offset : {0u, 1u, 2u, 0u, 2u, 3u})
            mesh.indices.push_back(vertex + offset);
        for (const Vec2 at : {Vec2(0, 0), Vec2(1, 0), Vec2(1, 1), Vec2(0, 1)})
        {
            const Vec2 from = (2.0f * at - Vec2(1)) * frame.halfExtent;
            mesh.positions[vertex] = frame.middle + from.x * frame.right + from.y * frame.up;
            mesh.normals[vertex] = frame.toViewer;
            mesh.tangents[vertex] = Vec4(frame.right, 1);
            mesh.uvs[vertex] = corner + cell * at;
            if (!mesh.sources.empty())
                mesh.sources[vertex] = {.segment = kNoSegment};
            ++vertex;
        }
    }
    const auto count = static_cast<std::uint32_t>(mesh.indices.size()) - firstIndex;
    mesh.parts.push_back({.material = MeshMaterial::Cards, .firstIndex = firstIndex, .indexCount = count});
}

} // namespace espalier
