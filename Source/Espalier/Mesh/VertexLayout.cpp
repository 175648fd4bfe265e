#include <Espalier/Mesh/TreeMesh.h>
#include <Espalier/Mesh/VertexLayout.h>

#include <Espalier/Core/Half.h>
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

namespace espalier {

namespace {

/// Vertices that are written together, attribute by attribute: their lines stay in the first cache.
constexpr std::size_t kBlock = 256;

using Block = std::array<Vec4, kBlock>;

struct FormatFacts
{
    std::uint8_t bytes;
    std::uint8_t components;
};

FormatFacts factsOf(VertexFormat format)
{
    switch (format)
    {
    case VertexFormat::Float32x2:
        return {8, 2};
    case VertexFormat::Float32x3:
        return {12, 3};
    case VertexFormat::Float32x4:
        return {16, 4};
    case VertexFormat::Float16x2:
        return {4, 2};
    case VertexFormat::Float16x4:
    case VertexFormat::Snorm16x4:
        return {8, 4};
    case VertexFormat::Snorm8x4:
    case VertexFormat::Unorm8x4:
        return {4, 4};
    case VertexFormat::Unorm16x2:
        return {4, 2};
    case VertexFormat::OctahedralSnorm16x2:
        return {4, 3};
    }
    return {0, 0};
}

bool fits(VertexSemantic semantic, VertexFormat format)
{
    using enum VertexFormat;
    const auto isOneOf = [format](std::initializer_list<VertexFormat> formats) {
        return std::find(formats.begin(), formats.end(), format) != formats.end();
    };
    switch (semantic)
    {
    case VertexSemantic::Position:
        return isOneOf({Float32x3, Float32x4, Float16x4, Snorm16x4});
    case VertexSemantic::Normal:
        return isOneOf({Float32x3, Float32x4, Float16x4, Snorm16x4, Snorm8x4, Unorm8x4, OctahedralSnorm16x2});
    case VertexSemantic::Tangent:
        return isOneOf({Float32x4, Float16x4, Snorm16x4, Snorm8x4, Unorm8x4});
    case VertexSemantic::TextureCoordinate:
        return isOneOf({Float32x2, Float16x2, Unorm16x2});
    case VertexSemantic::Colour:
        return isOneOf({Float32x3, Float32x4, Float16x4, Unorm8x4});
    }
    return false;
}

VertexResult checkLayout(const VertexLayout& layout)
{
    const auto attributes = layout.attributes;
    if (!(layout.positionScale > 0) || !std::isfinite(layout.positionScale))
        return VertexResult::BadLayout;
    for (std::size_t i = 0; i < attributes.size(); ++i)
    {
        if (!fits(attributes[i].semantic, attributes[i].format))
            return VertexResult::UnfitFormat;
        const std::size_t begin = attributes[i].offset;
        const std::size_t end = begin + sizeOf(attributes[i].format);
        if (end > layout.stride)
            return VertexResult::BadLayout;
        for (std::size_t k = 0; k < i; ++k)
        {
            const std::size_t otherBegin = attributes[k].offset;
            const std::size_t otherEnd = otherBegin + sizeOf(attributes[k].format);
            if (attributes[k].semantic == attributes[i].semantic || (begin < otherEnd && otherBegin < end))
                return VertexResult::BadLayout;
        }
    }
    return VertexResult::Ok;
}

bool isConsistent(const TreeMesh& mesh)
{
    const std::size_t count = mesh.positions.size();
    return mesh.normals.size() == count && mesh.tangents.size() == count && mesh.uvs.size() == count &&
           (mesh.tints.empty() || mesh.tints.size() == count);
}

/// The numbers of some vertices before they are narrowed.
void gather(const TreeMesh& mesh, const VertexLayout& layout, const VertexAttributeFormat& attribute, std::size_t first,
            std::size_t count, Block& block)
{
    const bool isBiased = attribute.format == VertexFormat::Unorm8x4;
    switch (attribute.semantic)
    {
    case VertexSemantic::Position:
        for (std::size_t i = 0; i < count; ++i)
            block[i] = Vec4((mesh.positions[first + i] - layout.positionCentre) / layout.positionScale, 1);
        break;
    case VertexSemantic::Normal:
        for (std::size_t i = 0; i < count; ++i)
            block[i] = Vec4(mesh.normals[first + i], 0);
        break;
    case VertexSemantic::Tangent:
        std::copy_n(mesh.tangents.begin() + static_cast<std::ptrdiff_t>(first), count, block.begin());
        break;
    case VertexSemantic::TextureCoordinate:
        for (std::size_t i = 0; i < count; ++i)
        {
            const Vec2 uv = mesh.uvs[first + i];
            block[i] = Vec4(uv.x, layout.textureOrigin == TextureOrigin::TopLeft ? 1 - uv.y : uv.y, 0, 0);
        }
        break;
    case VertexSemantic::Colour:
        for (std::size_t i = 0; i < count; ++i)
        {
            const Tint tint = mesh.tints.empty() ? Tint{} : mesh.tints[first + i];
            block[i] = Vec4(tint.red, tint.green, tint.blue, tint.alpha) / 255.0f;
        }
        return;
    }
    if (isBiased)
        for (std::size_t i = 0; i < count; ++i)
            block[i] = block[i] * 0.5f + 0.5f;
}

bool isLimited(VertexFormat format)
{
    return format != VertexFormat::Float32x2 && format != VertexFormat::Float32x3 && format != VertexFormat::Float32x4;
}

/// Whether numbers can be held: rounding errors of unit vectors and of a fit are forgiven.
bool isInRange(const Block& block, std::size_t count, VertexFormat format)
{
    constexpr float kSlack = 1e-3f;
    constexpr float kLargestHalf = 65519.99f; // what is less rounds down to the largest, 65504
    float low = -1 - kSlack;
    float high = 1 + kSlack;
    switch (format)
    {
    case VertexFormat::Float32x2:
    case VertexFormat::Float32x3:
    case VertexFormat::Float32x4:
        return true;
    case VertexFormat::Float16x2:
    case VertexFormat::Float16x4:
        low = -kLargestHalf;
        high = kLargestHalf;
        break;
    case VertexFormat::Unorm16x2: // half a step, so that nothing is clamped that would show
        low = -0.5f / 65535;
        high = 1 + 0.5f / 65535;
        break;
    case VertexFormat::Unorm8x4:
        low = -kSlack;
        break;
    case VertexFormat::Snorm16x4:
    case VertexFormat::Snorm8x4:
    case VertexFormat::OctahedralSnorm16x2:
        break;
    }
    const int components = factsOf(format).components;
    for (std::size_t i = 0; i < count; ++i)
        for (int k = 0; k < components; ++k)
            if (!(block[i][k] >= low && block[i][k] <= high))
                return false;
    return true;
}

template <class T>
T normalized(float value, float lowest, float steps)
{
    return static_cast<T>(std::floor(std::clamp(value, lowest, 1.0f) * steps + 0.5f));
}

std::int16_t snorm16(float value)
{
    return normalized<std::int16_t>(value, -1, 32767);
}

std::array<std::int16_t, 2> octahedral(const Vec4& direction)
{
    const float sum = std::abs(direction.x) + std::abs(direction.y) + std::abs(direction.z);
    const float scale = sum > 0 ? 1 / sum : 0;
    float x = direction.x * scale;
    float y = direction.y * scale;
    if (direction.z < 0)
    {
        const float foldedX = (1 - std::abs(y)) * (x >= 0 ? 1.0f : -1.0f);
        y = (1 - std::abs(x)) * (y >= 0 ? 1.0f : -1.0f);
        x = foldedX;
    }
    return {snorm16(x), snorm16(y)};
}

/// Writes `convert` of each vertex, whose size is the format's.
template <class Convert>
void scatter(const Block& block, std::size_t count, std::byte* out, std::size_t stride, const Convert& convert)
{
    for (std::size_t i = 0; i < count; ++i)
    {
        const auto value = convert(block[i]);
        std::memcpy(out + i * stride, &value, sizeof value);
    }
}

void put(const Block& block, std::size_t count, VertexFormat format, std::byte* out, std::size_t stride)
{
    const auto scatterAs = [&](const auto& convert) { scatter(block, count, out, stride, convert); };
    switch (format)
    {
    case VertexFormat::Float32x2:
        scatterAs([](const Vec4& v) { return std::array{v.x, v.y}; });
        break;
    case VertexFormat::Float32x3:
        scatterAs([](const Vec4& v) { return std::array{v.x, v.y, v.z}; });
        break;
    case VertexFormat::Float32x4:
        scatterAs([](const Vec4& v) { return std::array{v.x, v.y, v.z, v.w}; });
        break;
    case VertexFormat::Float16x2:
        scatterAs([](const Vec4& v) { return std::array{halfOf(v.x), halfOf(v.y)}; });
        break;
    case VertexFormat::Float16x4:
        scatterAs([](const Vec4& v) { return std::array{halfOf(v.x), halfOf(v.y), halfOf(v.z), halfOf(v.w)}; });
        break;
    case VertexFormat::Snorm16x4:
        scatterAs([](const Vec4& v) { return std::array{snorm16(v.x), snorm16(v.y), snorm16(v.z), snorm16(v.w)}; });
        break;
    case VertexFormat::Snorm8x4:
        scatterAs([](const Vec4& v) {
            return std::array{normalized<std::int8_t>(v.x, -1, 127), normalized<std::int8_t>(v.y, -1, 127),
                              normalized<std::int8_t>(v.z, -1, 127), normalized<std::int8_t>(v.w, -1, 127)};
        });
        break;
    case VertexFormat::Unorm8x4:
        scatterAs([](const Vec4& v) {
            return std::array{normalized<std::uint8_t>(v.x, 0, 255), normalized<std::uint8_t>(v.y, 0, 255),
                              normalized<std::uint8_t>(v.z, 0, 255), normalized<std::uint8_t>(v.w, 0, 255)};
        });
        break;
    case VertexFormat::Unorm16x2:
        scatterAs([](const Vec4& v) {
            return std::array{normalized<std::uint16_t>(v.x, 0, 65535), normalized<std::uint16_t>(v.y, 0, 65535)};
        });
        break;
    case VertexFormat::OctahedralSnorm16x2:
        scatterAs(octahedral);
        break;
    }
}

template <class Visit>
void forEachBlock(std::size_t vertices, const Visit& visit)
{
    for (std::size_t first = 0; first < vertices; first += kBlock)
        visit(first, std::min(kBlock, vertices - first));
}

template <class Index>
VertexResult copyIndices(const TreeMesh& mesh, std::span<Index> out)
{
    if (out.size() < mesh.indices.size())
        return VertexResult::BufferTooSmall;
    std::uint32_t highest = 0;
    for (const std::uint32_t index : mesh.indices)
        highest = std::max(highest, index);
    if (!mesh.indices.empty() && highest >= mesh.positions.size())
        return VertexResult::InconsistentMesh;
    std::transform(mesh.indices.begin(), mesh.indices.end(), out.begin(),
                   [](std::uint32_t index) { return static_cast<Index>(index); });
    return VertexResult::Ok;
}

} // namespace

std::size_t sizeOf(VertexFormat format) noexcept
{
    return factsOf(format).bytes;
}

PositionFit fitPositions(const TreeMesh& mesh) noexcept
{
    PositionFit fit;
    if (mesh.positions.empty())
        return fit;
    Vec3 low = mesh.positions[0];
    Vec3 high = low;
    for (const Vec3& p : mesh.positions)
    {
        low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
        high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
    fit.centre = low * 0.5f + high * 0.5f;
    float scale = 0;
    for (int axis = 0; axis < 3; ++axis)
        scale = std::max({scale, high[axis] - fit.centre[axis], fit.centre[axis] - low[axis]});
    if (scale > 0 && std::isfinite(scale))
        fit.scale = scale;
    return fit;
}

std::string_view reasonOf(VertexResult result) noexcept
{
    switch (result)
    {
    case VertexResult::Ok:
        return {};
    case VertexResult::BadLayout:
        return "attributes of the vertex layout overlap, repeat or reach beyond its stride";
    case VertexResult::UnfitFormat:
        return "a format of the vertex layout does not suit what it is to hold";
    case VertexResult::InconsistentMesh:
        return "the mesh's vertex arrays differ in length, or an index names no vertex";
    case VertexResult::OutOfRange:
        return "a number of the mesh does not fit the format that is to hold it";
    case VertexResult::BufferTooSmall:
        return "the buffer is too small for the mesh";
    case VertexResult::IndexTooWide:
        return "the mesh has more vertices than 16-bit indices can name";
    }
    return {};
}

std::size_t bytesOf(const TreeMesh& mesh, const VertexLayout& layout) noexcept
{
    return mesh.positions.size() * layout.stride;
}

std::size_t vertexBytesOf(const MeshCounts& counts, const VertexLayout& layout) noexcept
{
    return static_cast<std::size_t>(counts.vertices) * layout.stride;
}

VertexResult writeVertices(const TreeMesh& mesh, const VertexLayout& layout, std::span<std::byte> out) noexcept
{
    if (const VertexResult checked = checkLayout(layout); checked != VertexResult::Ok)
        return checked;
    if (!isConsistent(mesh))
        return VertexResult::InconsistentMesh;
    if (out.size() < bytesOf(mesh, layout))
        return VertexResult::BufferTooSmall;
    const std::size_t vertices = mesh.positions.size();
    Block block;
    bool isGood = true;
    for (const VertexAttributeFormat& attribute : layout.attributes)
        if (attribute.semantic != VertexSemantic::Colour && isLimited(attribute.format))
            forEachBlock(vertices, [&](std::size_t first, std::size_t count) {
                gather(mesh, layout, attribute, first, count, block);
                isGood = isGood && isInRange(block, count, attribute.format);
            });
    if (!isGood)
        return VertexResult::OutOfRange;
    forEachBlock(vertices, [&](std::size_t first, std::size_t count) {
        for (const VertexAttributeFormat& attribute : layout.attributes)
        {
            gather(mesh, layout, attribute, first, count, block);
            put(block, count, attribute.format, out.data() + first * layout.stride + attribute.offset, layout.stride);
        }
    });
    return VertexResult::Ok;
}

VertexResult writeIndices(const TreeMesh& mesh, std::span<std::uint16_t> out) noexcept
{
    if (indexWidthFor(mesh.positions.size()) != IndexWidth::Bits16)
        return VertexResult::IndexTooWide;
    return copyIndices(mesh, out);
}

VertexResult writeIndices(const TreeMesh& mesh, std::span<std::uint32_t> out) noexcept
{
    return copyIndices(mesh, out);
}

} // namespace espalier
