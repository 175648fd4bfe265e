#include <Espalier/Bake/GltfPayload.h>
#include <Espalier/Core/Finite.h>

#include <Espalier/Bake/TinyGltf.h>
#include <Espalier/Core/Simd.h>
#include <Espalier/Mesh/TreeMesh.h>
#include <Espalier/Mesh/VertexLayout.h>
#include <Espalier/Mesh/WindPresets.h>
#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <memory>
#include <meshoptimizer.h>
#include <nlohmann/json.hpp>

namespace espalier {

namespace {

static_assert(std::endian::native == std::endian::little,
              "glTF buffers are little-endian; arrays are copied as they lie");

/// Bytes that are checked, converted and handed on together: they stay in the second cache, and a system call for each
/// costs little.
constexpr std::size_t kBlockBytes = std::size_t{256} << 10;
template <class Element>
constexpr std::size_t kBlock = kBlockBytes / sizeof(Element);

/// 1/4096 repeat: a quarter of a texel of 1024.
constexpr int kTextureExponent = -12;

constexpr std::size_t kAllGood = std::numeric_limits<std::size_t>::max();

tl::unexpected<Error> bad(std::string what)
{
    return failure(ErrorKind::BadInput, {}, "the mesh cannot be baked: " + std::move(what),
                   "the finite, consistent triangles that meshing a sound skeleton gives");
}

tl::unexpected<Error> badVertex(std::size_t vertex, const char* what)
{
    return bad("vertex " + std::to_string(vertex) + " has " + what);
}

template <class T>
std::string_view bytesOf(std::span<const T> values)
{
    return {reinterpret_cast<const char*>(values.data()), values.size_bytes()};
}

/// The first element that `isGood` refuses. `areAllGood` is the same for many, quickly.
template <class T, class AreAllGood, class IsGood>
std::size_t firstBad(std::span<const T> values, const AreAllGood& areAllGood, const IsGood& isGood)
{
    if (areAllGood(values))
        return kAllGood;
    return static_cast<std::size_t>(std::ranges::find_if_not(values, isGood) - values.begin());
}

template <class Vector>
std::size_t firstInfinite(std::span<const Vector> values)
{
    // Branch-free over bits, which compilers turn into vector instructions.
    const auto areFinite = [](std::span<const Vector> all) {
        std::int32_t worst = 0;
        for (const Vector& v : all)
            for (int i = 0; i < Vector::length(); ++i)
                worst = std::max(worst, std::bit_cast<std::int32_t>(v[i]) & 0x7fffffff);
        return worst < 0x7f800000;
    };
    return firstBad(values, areFinite, isFinite<Vector>);
}

/// As closely as the Khronos validator asks, with some room.
template <class Vector>
bool isUnit(const Vector& v)
{
    constexpr float kTolerance = 0.0005f;
    const float squared = v.x * v.x + v.y * v.y + v.z * v.z;
    return (squared >= (1 - kTolerance) * (1 - kTolerance)) & (squared <= (1 + kTolerance) * (1 + kTolerance));
}

template <class Vector, class IsGood>
std::size_t firstRefused(std::span<const Vector> values, const IsGood& isGood)
{
    const auto areAllGood = [&](std::span<const Vector> all) {
        unsigned refused = 0;
        for (const Vector& v : all)
            refused |= static_cast<unsigned>(!isGood(v));
        return refused == 0;
    };
    return firstBad(values, areAllGood, isGood);
}

std::size_t firstNotUnit(std::span<const Vec3> normals)
{
    return firstRefused(normals, [](const Vec3& v) { return isUnit(v); });
}

std::size_t firstNoTangent(std::span<const Vec4> tangents)
{
    return firstRefused(tangents, [](const Vec4& v) { return std::abs(v.w) == 1 && isUnit(v); });
}

/// An array of `values`, block by block: `check` says the first bad element of a block, `complaint` what it has.
template <class T, class Check>
auto asTheyLie(std::span<const T> values, const Check& check, const char* complaint)
{
    return [=](const ByteSink& sink) -> Expected<void> {
        for (std::size_t first = 0; first < values.size(); first += kBlock<T>)
        {
            const auto block = values.subspan(first, std::min(kBlock<T>, values.size() - first));
            if (const std::size_t worst = check(block); worst != kAllGood)
                return badVertex(first + worst, complaint);
            if (auto written = sink(bytesOf(block)); !written)
                return written;
        }
        return {};
    };
}

template <class To, class T, class Check, class Convert>
auto converted(std::span<const T> values, const Check& check, const char* complaint, const Convert& convert)
{
    return [=](const ByteSink& sink) -> Expected<void> {
        std::vector<To> made(std::min(kBlock<To>, values.size()));
        for (std::size_t first = 0; first < values.size(); first += kBlock<To>)
        {
            const auto block = values.subspan(first, std::min(kBlock<To>, values.size() - first));
            if (const std::size_t worst = check(block); worst != kAllGood)
                return badVertex(first + worst, complaint);
            std::ranges::transform(block, made.begin(), convert);
            if (auto written = sink(bytesOf(std::span<const To>(made).first(block.size()))); !written)
                return written;
        }
        return {};
    };
}

template <class T>
std::size_t nothingToCheck(std::span<const T>)
{
    return kAllGood;
}

struct Bytes4
{
    std::int8_t x, y, z, w;
};

struct Shorts4
{
    std::int16_t x, y, z, w;
};

std::int8_t signedByte(float value)
{
    return static_cast<std::int8_t>(std::floor(value * 127 + 0.5f));
}

std::int16_t onGrid(float position, float centre, float halfExtent)
{
    const double share = (double{position} - double{centre}) / double{halfExtent};
    return static_cast<std::int16_t>(std::clamp(std::floor(share * 32767 + 0.5), -32767.0, 32767.0));
}

Shorts4 onGrid(const Vec3& position, const PositionGrid& grid)
{
    return {onGrid(position.x, grid.centre.x, grid.halfExtent), onGrid(position.y, grid.centre.y, grid.halfExtent),
            onGrid(position.z, grid.centre.z, grid.halfExtent), 0};
}

Vec2 fromTop(const Vec2& uv)
{
    return {uv.x, 1 - uv.y};
}

constexpr const char* kInfiniteUv = "a texture coordinate that is not finite";

/// uvs, with v from the top. Four numbers at a time: one by one it would cost as much as writing them.
auto flipped(std::span<const Vec2> uvs)
{
    return [uvs](const ByteSink& sink) -> Expected<void> {
        std::vector<Vec2> made(std::min(kBlock<Vec2>, uvs.size()));
        for (std::size_t first = 0; first < uvs.size(); first += kBlock<Vec2>)
        {
            const auto block = uvs.subspan(first, std::min(kBlock<Vec2>, uvs.size() - first));
            constexpr simd::FourInts kIsU{-1, 0, -1, 0};
            constexpr simd::Four kOne{1, 1, 1, 1};
            simd::Four unsound{};
            std::size_t i = 0;
            for (; i + 2 <= block.size(); i += 2)
            {
                const simd::Four uv = simd::load(&block[i]);
                unsound += uv * 0.0f;
                simd::store(&made[i],
                            (simd::Four)(((simd::FourInts)uv & kIsU) | ((simd::FourInts)(kOne - uv) & ~kIsU)));
            }
            for (; i < block.size(); ++i)
                made[i] = fromTop(block[i]);
            const float sum = unsound[0] + unsound[1] + unsound[2] + unsound[3];
            if (!(sum == 0) || !isFinite(block.back())) // of zeros, but not of infinities and NaN times 0
                if (const std::size_t worst = firstInfinite(block); worst != kAllGood)
                    return badVertex(first + worst, kInfiniteUv);
            if (auto written = sink(bytesOf(std::span<const Vec2>(made).first(block.size()))); !written)
                return written;
        }
        return {};
    };
}

/// Texture coordinates in words of the exponential filter, all with one exponent: 24 bits of mantissa below 8 of
/// exponent. The filter's own encoder gives each value the exponent that it needs, which compresses worse.
auto onTextureGrid(std::span<const Vec2> uvs)
{
    return [uvs](const ByteSink& sink) -> Expected<void> {
        float largest = 0;
        for (const Vec2& uv : uvs)
        {
            const Vec2 there = fromTop(uv);
            if (!std::isfinite(there.x) || !std::isfinite(there.y))
                return badVertex(static_cast<std::size_t>(&uv - uvs.data()), kInfiniteUv);
            largest = std::max({largest, std::abs(there.x), std::abs(there.y)});
        }
        constexpr double kMostMantissa = (1 << 23) - 1;
        int exponent = kTextureExponent;
        double steps = 4096;
        for (; double{largest} * steps > kMostMantissa - 1; ++exponent)
            steps /= 2;
        const auto word = [=](float value) {
            const auto mantissa = static_cast<std::int32_t>(std::floor(double{value} * steps + 0.5));
            return (static_cast<std::uint32_t>(mantissa) & 0xffffffu) | static_cast<std::uint32_t>(exponent) << 24;
        };
        const auto convert = [&](const Vec2& uv) {
            const Vec2 there = fromTop(uv);
            return std::array<std::uint32_t, 2>{word(there.x), word(there.y)};
        };
        return converted<std::array<std::uint32_t, 2>>(uvs, nothingToCheck<Vec2>, kInfiniteUv, convert)(sink);
    };
}

GltfArray floatArray(std::size_t count, int components, GltfArray::Codec codec)
{
    GltfArray array;
    array.count = count;
    array.stride = static_cast<std::size_t>(components) * sizeof(float);
    array.componentType = TINYGLTF_COMPONENT_TYPE_FLOAT;
    array.type = components;
    array.codec = codec;
    return array;
}

GltfArray byteArray(std::size_t count, int componentType, int components)
{
    GltfArray array;
    array.count = count;
    array.stride = 4;
    array.componentType = componentType;
    array.type = components;
    array.isNormalized = true;
    array.isPadded = components < 4;
    array.codec = GltfArray::Codec::Attributes;
    return array;
}

Expected<void> checkJoints(std::span<const WindInfluence> vertices, std::size_t joints)
{
    for (std::size_t i = 0; i < vertices.size(); ++i)
    {
        const WindInfluence& vertex = vertices[i];
        unsigned sum = 0;
        for (std::size_t k = 0; k < 4; ++k)
        {
            if (vertex.weights[k] == 0)
                continue;
            sum += vertex.weights[k];
            if (vertex.joints[k] >= joints)
                return badVertex(i, "a joint that the tree does not have");
            for (std::size_t other = 0; other < k; ++other)
                if (vertex.weights[other] != 0 && vertex.joints[other] == vertex.joints[k])
                    return badVertex(i, "the same joint twice");
        }
        if (sum != 255)
            return badVertex(i, "weights whose sum is not 255");
    }
    return {};
}

/// glTF wants joint 0 where the weight is 0.
template <class Index>
std::array<Index, 4> jointsOf(const WindInfluence& vertex)
{
    std::array<Index, 4> joints{};
    for (std::size_t k = 0; k < 4; ++k)
        joints[k] = vertex.weights[k] == 0 ? Index{0} : static_cast<Index>(vertex.joints[k]);
    return joints;
}

Expected<void> checkIndices(std::span<const std::uint32_t> block, std::size_t first, std::size_t vertices)
{
    // Numbers below 2^31 are below `vertices` where the difference has its sign: two operations each, where a maximum
    // of unsigned numbers has none in SSE2.
    std::uint32_t all = 0;
    std::uint32_t differences = 0x80000000u;
    for (const std::uint32_t index : block)
    {
        all |= index;
        differences &= index - static_cast<std::uint32_t>(vertices);
    }
    if (vertices < 0x80000000u && (differences & ~all & 0x80000000u) != 0)
        return {};
    const auto worst = std::ranges::find_if(block, [&](std::uint32_t index) { return index >= vertices; });
    if (worst == block.end())
        return {};
    return bad("index " + std::to_string(first + static_cast<std::size_t>(worst - block.begin())) + " is " +
               std::to_string(*worst) + " of " + std::to_string(vertices) + " vertices");
}

template <class Index>
auto indicesAs(std::span<const std::uint32_t> indices, std::size_t vertices)
{
    return [=](const ByteSink& sink) -> Expected<void> {
        constexpr bool kIsNarrower = sizeof(Index) < sizeof(std::uint32_t);
        std::vector<Index> made(kIsNarrower ? std::min(kBlock<Index>, indices.size()) : 0);
        for (std::size_t first = 0; first < indices.size(); first += kBlock<Index>)
        {
            const auto block = indices.subspan(first, std::min(kBlock<Index>, indices.size() - first));
            if (auto checked = checkIndices(block, first, vertices); !checked)
                return checked;
            std::string_view bytes = bytesOf(block);
            if constexpr (kIsNarrower)
            {
                std::ranges::transform(block, made.begin(), [](std::uint32_t i) { return static_cast<Index>(i); });
                bytes = bytesOf(std::span<const Index>(made).first(block.size()));
            }
            if (auto written = sink(bytes); !written)
                return written;
        }
        return {};
    };
}

/// The versions of the codecs that EXT_meshopt_compression knows; later releases of the library write others unless
/// told. The settings are the process's, so they are made once.
void chooseCodecVersions()
{
    static const bool areChosen = [] {
        meshopt_encodeIndexVersion(1);
        meshopt_encodeVertexVersion(0);
        return true;
    }();
    static_cast<void>(areChosen);
}

/// What the array holds, compressed.
Expected<std::string> compress(const GltfArray& array)
{
    chooseCodecVersions();
    std::vector<std::uint32_t> aligned((array.count * array.stride + 3) / 4);
    char* end = reinterpret_cast<char*>(aligned.data());
    const auto written = array.write([&](std::string_view bytes) -> Expected<void> {
        end = std::copy(bytes.begin(), bytes.end(), end);
        return {};
    });
    if (!written)
        return tl::unexpected(written.error());
    std::string encoded;
    const auto into = [&] { return reinterpret_cast<unsigned char*>(encoded.data()); };
    if (array.codec == GltfArray::Codec::Triangles)
    {
        if (array.stride == sizeof(std::uint16_t))
        {
            const std::vector<std::uint32_t> shorts = aligned;
            aligned.resize(array.count);
            for (std::size_t i = 0; i < array.count; ++i)
                aligned[i] = shorts[i / 2] >> (i % 2 * 16) & 0xffffu;
        }
        encoded.resize(meshopt_encodeIndexBufferBound(array.count, std::numeric_limits<std::uint32_t>::max()));
        encoded.resize(meshopt_encodeIndexBuffer(into(), encoded.size(), aligned.data(), array.count));
    }
    else
    {
        encoded.resize(meshopt_encodeVertexBufferBound(array.count, array.stride));
        encoded.resize(meshopt_encodeVertexBuffer(into(), encoded.size(), aligned.data(), array.count, array.stride));
    }
    if (encoded.empty())
        return failure(ErrorKind::Limit, {}, "the mesh cannot be compressed");
    encoded.shrink_to_fit();
    return encoded;
}

std::uint64_t padded(std::uint64_t bytes)
{
    return (bytes + 3) / 4 * 4;
}

} // namespace

// Twelve numbers at a time, whose axes are x y z x, y z x y and z x y z: this pass is the only one that reads an array
// before it is written.
Expected<Bounds> boundsOf(std::span<const Vec3> positions)
{
    using simd::Four;
    using simd::FourInts;
    constexpr std::size_t kRegisters = 3;
    const auto chosen = [](FourInts mask, Four yes, Four no) {
        return (Four)(((FourInts)yes & mask) | ((FourInts)no & ~mask));
    };
    std::array<Four, kRegisters> lows;
    const Vec3 p = positions[0];
    lows = {Four{p.x, p.y, p.z, p.x}, Four{p.y, p.z, p.x, p.y}, Four{p.z, p.x, p.y, p.z}};
    std::array<Four, kRegisters> highs = lows;
    Four unsound{};
    std::size_t i = 0;
    for (; i + 4 <= positions.size(); i += 4)
    {
        const float* const numbers = &positions[i].x;
        for (std::size_t r = 0; r < kRegisters; ++r)
        {
            const Four four = simd::load(numbers + 4 * r);
            lows[r] = chosen(four < lows[r], four, lows[r]);
            highs[r] = chosen(four > highs[r], four, highs[r]);
            unsound += four * 0.0f;
        }
    }
    Bounds bounds{p, p};
    const auto widen = [&](int axis, float low, float high) {
        bounds.low[axis] = std::min(bounds.low[axis], low);
        bounds.high[axis] = std::max(bounds.high[axis], high);
    };
    for (std::size_t k = 0; k < 4 * kRegisters; ++k)
        widen(static_cast<int>(k % 3), lows[k / 4][k % 4], highs[k / 4][k % 4]);
    for (; i < positions.size(); ++i)
        for (int axis = 0; axis < 3; ++axis)
            widen(axis, positions[i][axis], positions[i][axis]);
    const float sum = unsound[0] + unsound[1] + unsound[2] + unsound[3];
    const auto tail = positions.last(std::min<std::size_t>(4, positions.size()));
    if (!(sum == 0) ||
        !std::ranges::all_of(tail, isFinite<Vec3>)) // zeros add up to 0, infinities and NaN times 0 do not
        return badVertex(firstInfinite(positions), "a position that is not finite");
    const Vec3 noSign(0); // of zeros, which depends on how they stand in the registers
    return Bounds{bounds.low + noSign, bounds.high + noSign};
}

PositionGrid gridOf(const Bounds& bounds) noexcept
{
    PositionGrid grid;
    grid.centre = bounds.low * 0.5f + bounds.high * 0.5f;
    grid.halfExtent = 0;
    for (int axis = 0; axis < 3; ++axis)
        grid.halfExtent =
            std::max({grid.halfExtent, bounds.high[axis] - grid.centre[axis], grid.centre[axis] - bounds.low[axis]});
    if (!(grid.halfExtent > 0) || !std::isfinite(grid.halfExtent))
        grid.halfExtent = 1;
    return grid;
}

GltfArray positionArray(std::span<const Vec3> positions, const Bounds& bounds)
{
    GltfArray array = floatArray(positions.size(), 3, GltfArray::Codec::Attributes);
    array.lowest = {bounds.low.x, bounds.low.y, bounds.low.z};
    array.highest = {bounds.high.x, bounds.high.y, bounds.high.z};
    array.write = asTheyLie(positions, nothingToCheck<Vec3>, "");
    return array;
}

GltfArray quantizedPositionArray(std::span<const Vec3> positions, const Bounds& bounds, const PositionGrid& grid)
{
    GltfArray array;
    array.count = positions.size();
    array.stride = sizeof(Shorts4);
    array.componentType = TINYGLTF_COMPONENT_TYPE_SHORT;
    array.type = TINYGLTF_TYPE_VEC3;
    array.isNormalized = true;
    array.isPadded = true;
    array.codec = GltfArray::Codec::Attributes;
    const Shorts4 low = onGrid(bounds.low, grid);
    const Shorts4 high = onGrid(bounds.high, grid);
    array.lowest = {double(low.x), double(low.y), double(low.z)};
    array.highest = {double(high.x), double(high.y), double(high.z)};
    array.write = converted<Shorts4>(positions, nothingToCheck<Vec3>, "",
                                     [grid](const Vec3& position) { return onGrid(position, grid); });
    return array;
}

GltfArray normalArray(std::span<const Vec3> normals, GltfEncoding encoding)
{
    constexpr const char* kComplaint = "a normal that is not of unit length";
    if (encoding == GltfEncoding::Portable)
    {
        GltfArray array = floatArray(normals.size(), 3, GltfArray::Codec::Attributes);
        array.write = asTheyLie(normals, firstNotUnit, kComplaint);
        return array;
    }
    GltfArray array = byteArray(normals.size(), TINYGLTF_COMPONENT_TYPE_BYTE, 3);
    array.write = converted<Bytes4>(normals, firstNotUnit, kComplaint, [](const Vec3& normal) {
        return Bytes4{signedByte(normal.x), signedByte(normal.y), signedByte(normal.z), 0};
    });
    return array;
}

GltfArray tangentArray(std::span<const Vec4> tangents, GltfEncoding encoding)
{
    constexpr const char* kComplaint = "a tangent that is not of unit length, or whose w is not +1 or -1";
    if (encoding == GltfEncoding::Portable)
    {
        GltfArray array = floatArray(tangents.size(), 4, GltfArray::Codec::Attributes);
        array.write = asTheyLie(tangents, firstNoTangent, kComplaint);
        return array;
    }
    GltfArray array = byteArray(tangents.size(), TINYGLTF_COMPONENT_TYPE_BYTE, 4);
    array.write = converted<Bytes4>(tangents, firstNoTangent, kComplaint, [](const Vec4& tangent) {
        return Bytes4{signedByte(tangent.x), signedByte(tangent.y), signedByte(tangent.z), signedByte(tangent.w)};
    });
    return array;
}

GltfArray textureArray(std::span<const Vec2> uvs, GltfEncoding encoding)
{
    const bool isOnGrid = encoding == GltfEncoding::Compressed;
    GltfArray array = floatArray(uvs.size(), 2, isOnGrid ? GltfArray::Codec::FixedPoint : GltfArray::Codec::Attributes);
    if (isOnGrid)
        array.write = onTextureGrid(uvs);
    else
        array.write = flipped(uvs);
    return array;
}

GltfArray furtherTextureArray(std::span<const Vec2> uvs)
{
    GltfArray array = floatArray(uvs.size(), 2, GltfArray::Codec::Attributes);
    array.write = asTheyLie(uvs, firstInfinite<Vec2>, kInfiniteUv);
    return array;
}

GltfArray colourArray(std::span<const Tint> colours)
{
    GltfArray array = byteArray(colours.size(), TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE, 4);
    array.write = asTheyLie(colours, nothingToCheck<Tint>, "");
    return array;
}

GltfArray jointArray(std::span<const WindInfluence> vertices, std::size_t joints)
{
    GltfArray array = byteArray(vertices.size(), TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE, 4);
    array.isNormalized = false;
    const auto writeAs = [&](auto zero) {
        using Index = decltype(zero);
        array.write = [=](const ByteSink& sink) -> Expected<void> {
            if (auto checked = checkJoints(vertices, joints); !checked)
                return checked;
            return converted<std::array<Index, 4>>(vertices, nothingToCheck<WindInfluence>, "", jointsOf<Index>)(sink);
        };
    };
    if (joints <= 256)
    {
        writeAs(std::uint8_t{0});
        return array;
    }
    array.componentType = TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT;
    array.stride = 4 * sizeof(std::uint16_t);
    writeAs(std::uint16_t{0});
    return array;
}

GltfArray weightArray(std::span<const WindInfluence> vertices)
{
    GltfArray array = byteArray(vertices.size(), TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE, 4);
    array.write = converted<std::array<std::uint8_t, 4>>(vertices, nothingToCheck<WindInfluence>, "",
                                                         [](const WindInfluence& vertex) { return vertex.weights; });
    return array;
}

GltfArray bindMatrixArray(std::span<const WindJoint> joints, const PositionGrid& grid)
{
    GltfArray array;
    array.count = joints.size();
    array.stride = 16 * sizeof(float);
    array.componentType = TINYGLTF_COMPONENT_TYPE_FLOAT;
    array.type = TINYGLTF_TYPE_MAT4;
    array.write =
        converted<std::array<float, 16>>(joints, nothingToCheck<WindJoint>, "", [grid](const WindJoint& joint) {
            const Vec3 moved = grid.centre - joint.position;
            const float scale = grid.halfExtent;
            return std::array<float, 16>{scale, 0, 0, 0, 0, scale, 0, 0, 0, 0, scale, 0, moved.x, moved.y, moved.z, 1};
        });
    return array;
}

GltfArray indexArray(std::span<const std::uint32_t> indices, std::size_t vertices)
{
    const bool isShort = indexWidthFor(vertices) == IndexWidth::Bits16;
    GltfArray array;
    array.count = indices.size();
    array.stride = isShort ? sizeof(std::uint16_t) : sizeof(std::uint32_t);
    array.componentType = isShort ? TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT : TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
    array.type = TINYGLTF_TYPE_SCALAR;
    array.codec = GltfArray::Codec::Triangles;
    if (isShort)
        array.write = indicesAs<std::uint16_t>(indices, vertices);
    else
        array.write = indicesAs<std::uint32_t>(indices, vertices);
    return array;
}

Expected<int> GltfPayload::add(const GltfArray& array)
{
    View view;
    view.count = array.count;
    view.stride = array.stride;
    view.bytes = std::uint64_t{array.count} * array.stride;
    view.write = array.write;
    const bool isIndex = array.codec == GltfArray::Codec::Triangles;
    if (array.codec != GltfArray::Codec::None)
        view.target = isIndex ? TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER : TINYGLTF_TARGET_ARRAY_BUFFER;
    view.showsStride = array.isPadded;
    if (isCompressed_ && array.codec != GltfArray::Codec::None)
    {
        auto encoded = compress(array);
        if (!encoded)
            return tl::unexpected(encoded.error());
        const auto kept = std::make_shared<const std::string>(std::move(*encoded));
        view.codec = array.codec;
        view.showsStride = !isIndex;
        view.decodedOffset = decodedSize_;
        decodedSize_ += padded(view.bytes);
        view.bytes = kept->size();
        view.write = [kept](const ByteSink& sink) { return sink(*kept); };
    }
    return append(std::move(view));
}

int GltfPayload::add(std::string_view bytes)
{
    View view;
    view.bytes = bytes.size();
    view.write = [bytes](const ByteSink& sink) { return sink(bytes); };
    return append(std::move(view));
}

int GltfPayload::append(View view)
{
    view.offset = size_;
    size_ += padded(view.bytes);
    views_.push_back(std::move(view));
    return static_cast<int>(views_.size() - 1);
}

void GltfPayload::describe(nlohmann::json& document) const
{
    using nlohmann::json;
    json& views = document["bufferViews"] = json::array();
    for (const View& view : views_)
    {
        const bool isCompressed = view.codec != GltfArray::Codec::None;
        json entry{{"buffer", isCompressed ? 1 : 0},
                   {"byteLength", isCompressed ? view.count * view.stride : view.bytes}};
        if (const std::uint64_t offset = isCompressed ? view.decodedOffset : view.offset; offset > 0)
            entry["byteOffset"] = offset;
        if (view.showsStride)
            entry["byteStride"] = view.stride;
        if (view.target != 0)
            entry["target"] = view.target;
        if (isCompressed)
        {
            json& compressed = entry["extensions"]["EXT_meshopt_compression"] = {
                {"buffer", 0},
                {"byteOffset", view.offset},
                {"byteLength", view.bytes},
                {"byteStride", view.stride},
                {"count", view.count},
                {"mode", view.codec == GltfArray::Codec::Triangles ? "TRIANGLES" : "ATTRIBUTES"}};
            if (view.codec == GltfArray::Codec::FixedPoint)
                compressed["filter"] = "EXPONENTIAL";
        }
        views.push_back(std::move(entry));
    }
    json& buffers = document["buffers"] = json::array();
    buffers.push_back({{"byteLength", size_}});
    if (decodedSize_ > 0)
        buffers.push_back(
            {{"byteLength", decodedSize_}, {"extensions", {{"EXT_meshopt_compression", {{"fallback", true}}}}}});
}

Expected<void> GltfPayload::write(const ByteSink& sink) const
{
    for (const View& view : views_)
    {
        if (auto written = view.write(sink); !written)
            return written;
        constexpr std::string_view kZeros("\0\0\0", 3);
        if (const std::uint64_t padding = padded(view.bytes) - view.bytes; padding > 0)
            if (auto written = sink(kZeros.substr(0, padding)); !written)
                return written;
    }
    return {};
}

} // namespace espalier
