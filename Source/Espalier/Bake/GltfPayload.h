#pragma once

#include <Espalier/Bake/Gltf.h>
#include <Espalier/Core/File.h>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string_view>
#include <vector>

namespace espalier {

/// Values a GLB may hold as they are or compressed: elements of `stride` bytes, made when they are asked for. They are
/// checked on their way, while they lie in the cache, so that a bake reads its arrays once.
struct GltfArray
{
    /// What EXT_meshopt_compression makes of it.
    enum class Codec : std::uint8_t
    {
        None,
        Attributes,
        FixedPoint, ///< Attributes whose elements are words of the exponential filter.
        Triangles,
    };

    std::size_t count = 0;
    std::size_t stride = 0;     ///< Bytes from one element to the next.
    int componentType = 0;      ///< glTF's.
    int type = 0;               ///< tinygltf's.
    bool isNormalized = false;  ///< Integers stand for [0, 1] or [-1, 1].
    bool isPadded = false;      ///< Elements are shorter than the stride.
    Codec codec = Codec::None;  ///< None: it is never compressed.
    std::vector<double> lowest; ///< Empty where glTF does not ask for them.
    std::vector<double> highest;
    std::function<Expected<void>(const ByteSink&)> write; ///< All of it, count * stride bytes.
};

/// The cube that quantized positions fill: p = centre + halfExtent * q, q in [-1, 1].
struct PositionGrid
{
    Vec3 centre{0};
    float halfExtent = 1;
};

struct Bounds
{
    Vec3 low{0};
    Vec3 high{0};
};

/// Bounds of finite positions; fails if one is not. Requires: there are some.
[[nodiscard]] Expected<Bounds> boundsOf(std::span<const Vec3> positions);
[[nodiscard]] PositionGrid gridOf(const Bounds& bounds) noexcept;

// Arrays of a mesh. They refer to what they are made of.
[[nodiscard]] GltfArray positionArray(std::span<const Vec3> positions, const Bounds& bounds);
[[nodiscard]] GltfArray quantizedPositionArray(std::span<const Vec3> positions, const Bounds& bounds,
                                               const PositionGrid& grid);
[[nodiscard]] GltfArray normalArray(std::span<const Vec3> normals, GltfEncoding encoding);
[[nodiscard]] GltfArray tangentArray(std::span<const Vec4> tangents, GltfEncoding encoding);
/// glTF's, from the top of the image.
[[nodiscard]] GltfArray textureArray(std::span<const Vec2> uvs, GltfEncoding encoding);
[[nodiscard]] GltfArray furtherTextureArray(std::span<const Vec2> uvs);
[[nodiscard]] GltfArray colourArray(std::span<const Tint> colours);
/// Joints of a skin with so many, and their weights.
[[nodiscard]] GltfArray jointArray(std::span<const WindInfluence> vertices, std::size_t joints);
[[nodiscard]] GltfArray weightArray(std::span<const WindInfluence> vertices);
[[nodiscard]] GltfArray bindMatrixArray(std::span<const WindJoint> joints, const PositionGrid& grid);
/// 16 bits each if they suffice.
[[nodiscard]] GltfArray indexArray(std::span<const std::uint32_t> indices, std::size_t vertices);

/// The binary chunk of a GLB and the buffer views into it.
class GltfPayload
{
public:
    explicit GltfPayload(GltfEncoding encoding) : isCompressed_(encoding == GltfEncoding::Compressed) {}

    /// The number of its view. Only what is compressed is looked at now.
    [[nodiscard]] Expected<int> add(const GltfArray& array);
    /// Bytes that stay where they are until the payload is written.
    [[nodiscard]] int add(std::string_view bytes);

    [[nodiscard]] std::uint64_t size() const noexcept { return size_; } ///< Bytes, a multiple of 4.
    /// "buffers" and "bufferViews" of the document.
    void describe(nlohmann::json& document) const;
    [[nodiscard]] Expected<void> write(const ByteSink& sink) const;

private:
    struct View
    {
        std::uint64_t offset = 0; ///< In the binary chunk.
        std::uint64_t bytes = 0;  ///< There.
        std::uint64_t count = 0;
        std::uint64_t stride = 0;
        std::uint64_t decodedOffset = 0; ///< In the buffer that stands for what is decoded.
        GltfArray::Codec codec = GltfArray::Codec::None;
        bool showsStride = false;
        int target = 0; ///< glTF's; 0 none.
        std::function<Expected<void>(const ByteSink&)> write;
    };

    int append(View view);

    bool isCompressed_;
    std::vector<View> views_;
    std::uint64_t size_ = 0;
    std::uint64_t decodedSize_ = 0;
};

} // namespace espalier
