#include <Espalier/Mesh/VertexLayout.h>

#include <Espalier/Mesh/TreeMesh.h>
#include <Render/HandMadeMesh.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <gtest/gtest.h>
#include <limits>
#include <vector>

namespace espalier {

namespace {

using enum VertexFormat;
using enum VertexSemantic;

TreeMesh sample()
{
    TreeMesh mesh = handMade({.sides = 37, .rings = 11, .height = 7, .radius = 0.3f, .base = {2, -1, 3}});
    for (std::size_t i = 0; i < mesh.positions.size(); ++i)
        mesh.tints.push_back({static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(3 * i), 7, 255});
    return mesh;
}

std::vector<std::byte> written(const TreeMesh& mesh, const VertexLayout& layout)
{
    std::vector<std::byte> bytes(bytesOf(mesh, layout));
    EXPECT_EQ(writeVertices(mesh, layout, bytes), VertexResult::Ok);
    return bytes;
}

template <class T>
T at(const std::vector<std::byte>& bytes, std::size_t offset)
{
    T value{};
    std::memcpy(&value, bytes.data() + offset, sizeof value);
    return value;
}

double halfAt(const std::vector<std::byte>& bytes, std::size_t offset)
{
    const auto bits = at<std::uint16_t>(bytes, offset);
    const int exponent = bits >> 10 & 31;
    const double mantissa = bits & 1023;
    const double magnitude = exponent == 0 ? std::ldexp(mantissa, -24) : std::ldexp(1024 + mantissa, exponent - 25);
    return bits & 0x8000 ? -magnitude : magnitude;
}

/// Component `k` as a shader reads it.
double component(const std::vector<std::byte>& bytes, std::size_t offset, VertexFormat format, std::size_t k)
{
    switch (format)
    {
    case Float32x2:
    case Float32x3:
    case Float32x4:
        return double{at<float>(bytes, offset + 4 * k)};
    case Float16x2:
    case Float16x4:
        return halfAt(bytes, offset + 2 * k);
    case Snorm16x4:
    case OctahedralSnorm16x2:
        return std::max(at<std::int16_t>(bytes, offset + 2 * k) / 32767.0, -1.0);
    case Snorm8x4:
        return std::max(at<std::int8_t>(bytes, offset + k) / 127.0, -1.0);
    case Unorm8x4:
        return at<std::uint8_t>(bytes, offset + k) / 255.0;
    case Unorm16x2:
        return at<std::uint16_t>(bytes, offset + 2 * k) / 65535.0;
    }
    return 0;
}

/// One attribute alone, decoded.
std::vector<std::array<double, 4>> decoded(const TreeMesh& mesh, VertexSemantic semantic, VertexFormat format,
                                           VertexLayout layout = {})
{
    const VertexAttributeFormat attribute{semantic, format, 1};
    layout.stride = static_cast<std::uint32_t>(sizeOf(format)) + 3; // nothing is aligned
    layout.attributes = {&attribute, 1};
    const auto bytes = written(mesh, layout);
    const std::size_t components =
        format == OctahedralSnorm16x2 || format == Float32x2 || format == Float16x2 || format == Unorm16x2 ? 2
        : format == Float32x3                                                                              ? 3
                                                                                                           : 4;
    std::vector<std::array<double, 4>> result(mesh.positions.size());
    for (std::size_t i = 0; i < result.size(); ++i)
    {
        auto& values = result[i];
        for (std::size_t k = 0; k < components; ++k)
            values[k] = component(bytes, i * layout.stride + attribute.offset, format, k);
        if (format == OctahedralSnorm16x2)
        {
            values[2] = 1 - std::abs(values[0]) - std::abs(values[1]);
            if (const double fold = std::max(-values[2], 0.0); fold > 0)
                for (const std::size_t k : {0u, 1u})
                    values[k] += values[k] >= 0 ? -fold : fold;
            const double length = std::hypot(values[0], values[1], values[2]);
            for (std::size_t k = 0; k < 3; ++k)
                values[k] /= length;
        }
        if (format == Unorm8x4 && (semantic == Normal || semantic == Tangent))
            for (double& value : values)
                value = 2 * value - 1;
    }
    return result;
}

} // namespace

TEST(VertexLayout, IndicesOf65535VerticesFitInto16Bits)
{
    EXPECT_EQ(indexWidthFor(0), IndexWidth::Bits16);
    EXPECT_EQ(indexWidthFor(65534), IndexWidth::Bits16);
    EXPECT_EQ(indexWidthFor(65535), IndexWidth::Bits16);
    EXPECT_EQ(indexWidthFor(65536), IndexWidth::Bits32);
    for (const HandMadeTube& tube : {HandMadeTube{.sides = 13, .rings = 4681}, HandMadeTube{.sides = 4, .rings = 13107},
                                     HandMadeTube{.sides = 3, .rings = 16384}})
    {
        const TreeMesh mesh = handMade(tube);
        const bool isShort = mesh.positions.size() <= 65535;
        std::vector<std::uint16_t> shorts(mesh.indices.size(), 9);
        RawVector<std::uint32_t> longs(mesh.indices.size());
        EXPECT_EQ(writeIndices(mesh, shorts), isShort ? VertexResult::Ok : VertexResult::IndexTooWide);
        EXPECT_EQ(writeIndices(mesh, longs), VertexResult::Ok);
        EXPECT_EQ(longs, mesh.indices);
        if (isShort)
            EXPECT_TRUE(std::equal(shorts.begin(), shorts.end(), longs.begin()));
        else
            EXPECT_EQ(shorts, std::vector<std::uint16_t>(shorts.size(), 9)) << "untouched";
        EXPECT_EQ(std::ranges::count(shorts, 65535), 0);
    }
}

TEST(VertexLayout, IndicesAreAllOrNothing)
{
    TreeMesh mesh = handMade({});
    std::vector<std::uint16_t> shorts(mesh.indices.size() - 1, 9);
    EXPECT_EQ(writeIndices(mesh, shorts), VertexResult::BufferTooSmall);
    shorts.resize(mesh.indices.size() + 1, 9);
    mesh.indices.back() = static_cast<std::uint32_t>(mesh.positions.size());
    EXPECT_EQ(writeIndices(mesh, shorts), VertexResult::InconsistentMesh);
    EXPECT_EQ(shorts, std::vector<std::uint16_t>(shorts.size(), 9));
    EXPECT_EQ(writeIndices(TreeMesh{}, std::span<std::uint32_t>{}), VertexResult::Ok);
}

TEST(VertexLayout, FloatsComeBackToTheBit)
{
    const TreeMesh mesh = sample();
    const VertexAttributeFormat attributes[] = {{Position, Float32x3, 0},
                                                {Normal, Float32x3, 12},
                                                {Tangent, Float32x4, 24},
                                                {TextureCoordinate, Float32x2, 40}};
    VertexLayout layout{48, attributes};
    layout.textureOrigin = TextureOrigin::BottomLeft;
    const auto bytes = written(mesh, layout);
    ASSERT_EQ(bytes.size(), 48 * mesh.positions.size());
    for (std::size_t i = 0; i < mesh.positions.size(); ++i)
    {
        EXPECT_EQ(at<Vec3>(bytes, 48 * i), mesh.positions[i]);
        EXPECT_EQ(at<Vec3>(bytes, 48 * i + 12), mesh.normals[i]);
        EXPECT_EQ(at<Vec4>(bytes, 48 * i + 24), mesh.tangents[i]);
        EXPECT_EQ(at<Vec2>(bytes, 48 * i + 40), mesh.uvs[i]);
    }
    layout.textureOrigin = TextureOrigin::TopLeft;
    EXPECT_EQ(at<float>(written(mesh, layout), 48 * 50 + 44), 1 - mesh.uvs[50].y);
}

TEST(VertexLayout, DirectionsKeepTheirPrecision)
{
    TreeMesh mesh = sample();
    // Normals all over the sphere, poles and edges of the octahedron among them.
    for (std::size_t i = 0; i < mesh.normals.size(); ++i)
    {
        const double up = 1 - 2.0 * static_cast<double>(i) / static_cast<double>(mesh.normals.size() - 1);
        const auto [sin, cos] = math::sinCosDegrees(137.5 * static_cast<double>(i));
        const double flat = std::sqrt(1 - up * up);
        mesh.normals[i] = Vec3(DVec3(flat * sin, flat * cos, up));
    }
    mesh.normals[1] = {1, 0, 0};
    mesh.normals[2] = {0, -1, 0};
    mesh.normals[3] = {0, 0, -1};
    struct Case
    {
        VertexFormat format;
        double degrees;
    };
    for (const Case& c : {Case{Float32x3, 1e-5}, Case{Float32x4, 1e-5}, Case{Float16x4, 0.03}, Case{Snorm16x4, 0.002},
                          Case{Snorm8x4, 0.4}, Case{Unorm8x4, 0.4}, Case{OctahedralSnorm16x2, 0.004}})
    {
        const auto normals = decoded(mesh, Normal, c.format);
        double worst = 0;
        for (std::size_t i = 0; i < normals.size(); ++i)
        {
            const auto& n = normals[i];
            const DVec3 truth(mesh.normals[i]);
            const DVec3 cross = glm::cross(DVec3(n[0], n[1], n[2]), truth);
            worst = std::max(worst, std::atan2(glm::length(cross), glm::dot(DVec3(n[0], n[1], n[2]), truth)));
        }
        EXPECT_LT(worst / math::kRadiansPerDegree, c.degrees) << int(c.format);
    }
    for (const VertexFormat format : {Float32x4, Float16x4, Snorm16x4, Snorm8x4, Unorm8x4})
        EXPECT_EQ(decoded(mesh, Tangent, format)[7][3], 1) << "the side of the bitangent is exact";
    mesh.tangents[7].w = -1;
    for (const VertexFormat format : {Float32x4, Float16x4, Snorm16x4, Snorm8x4, Unorm8x4})
        EXPECT_EQ(decoded(mesh, Tangent, format)[7][3], -1);
}

TEST(VertexLayout, PositionsFitIntoIntegers)
{
    const TreeMesh mesh = sample();
    const PositionFit fit = fitPositions(mesh);
    EXPECT_FLOAT_EQ(fit.scale, 3.5f);
    VertexLayout layout;
    layout.positionCentre = fit.centre;
    layout.positionScale = fit.scale;
    for (const auto& [format, error] : {std::pair{Snorm16x4, 3.5 / 65534 * 1.05}, std::pair{Float16x4, 3.5 / 2048}})
    {
        const auto positions = decoded(mesh, Position, format, layout);
        for (std::size_t i = 0; i < positions.size(); ++i)
        {
            EXPECT_EQ(positions[i][3], 1);
            for (int k = 0; k < 3; ++k)
                EXPECT_NEAR(double{fit.centre[k]} + double{fit.scale} * positions[i][static_cast<std::size_t>(k)],
                            double{mesh.positions[i][k]}, error);
        }
    }
}

TEST(VertexLayout, ColoursAndTextureCoordinatesKeepTheirPrecision)
{
    TreeMesh mesh = sample();
    for (Vec2& uv : mesh.uvs)
        uv.y /= 7;
    VertexLayout layout;
    layout.textureOrigin = TextureOrigin::BottomLeft;
    const auto bytes = decoded(mesh, Colour, Unorm8x4);
    const auto floats = decoded(mesh, Colour, Float32x3);
    const auto fine = decoded(mesh, TextureCoordinate, Unorm16x2, layout);
    const auto halves = decoded(mesh, TextureCoordinate, Float16x2, layout);
    for (std::size_t i = 0; i < mesh.tints.size(); ++i)
    {
        EXPECT_EQ(bytes[i],
                  (std::array<double, 4>{mesh.tints[i].red / 255.0, mesh.tints[i].green / 255.0, 7 / 255.0, 1}));
        EXPECT_NEAR(floats[i][1], mesh.tints[i].green / 255.0, 1e-7);
        EXPECT_NEAR(fine[i][0], double{mesh.uvs[i].x}, 0.5 / 65535 + 1e-7);
        EXPECT_NEAR(fine[i][1], double{mesh.uvs[i].y}, 0.5 / 65535 + 1e-7);
        EXPECT_NEAR(halves[i][1], double{mesh.uvs[i].y}, 1.0 / 4096);
    }
    mesh.tints.clear();
    EXPECT_EQ(decoded(mesh, Colour, Unorm8x4)[5], (std::array<double, 4>{1, 1, 1, 1}));
}

TEST(VertexLayout, HalvesRoundToTheNearestEven)
{
    TreeMesh mesh = handMade({});
    const std::pair<float, double> kCases[] = {{0, 0},
                                               {1, 1},
                                               {-2.5f, -2.5},
                                               {65504, 65504},
                                               {65519, 65504},
                                               {2049, 2048},        // halfway, to even
                                               {2051, 2052},        // likewise
                                               {0x1p-14f, 0x1p-14}, // the smallest normal
                                               {0x1p-24f, 0x1p-24}, // the smallest there is
                                               {0x1p-25f, 0},
                                               {0x1.8p-25f, 0x1p-24},
                                               {0x1.ff8p-15f, 0x1.ff8p-15}};
    VertexLayout layout;
    layout.textureOrigin = TextureOrigin::BottomLeft;
    for (const auto& [given, expected] : kCases)
    {
        mesh.uvs[0] = {given, -given};
        const auto read = decoded(mesh, TextureCoordinate, Float16x2, layout);
        EXPECT_EQ(read[0][0], expected) << given;
        EXPECT_EQ(read[0][1], -expected) << given;
    }
}

TEST(VertexLayout, WritesNothingWhenItFails)
{
    constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
    struct Case
    {
        const char* name;
        std::vector<VertexAttributeFormat> attributes;
        std::uint32_t stride;
        VertexResult expected;
    };
    const Case kCases[] = {
        {"beyond the stride", {{Position, Float32x3, 0}}, 11, VertexResult::BadLayout},
        {"offset at the end of numbers", {{Position, Float32x3, 0xffffffffu}}, 16, VertexResult::BadLayout},
        {"overlap", {{Position, Float32x3, 0}, {Normal, Snorm8x4, 11}}, 16, VertexResult::BadLayout},
        {"twice", {{Normal, Float32x3, 0}, {Normal, Snorm8x4, 12}}, 16, VertexResult::BadLayout},
        {"no format of normals", {{Normal, Float32x2, 0}}, 8, VertexResult::UnfitFormat},
        {"tangent without side", {{Tangent, OctahedralSnorm16x2, 0}}, 8, VertexResult::UnfitFormat},
        {"metres as snorm", {{Position, Snorm16x4, 0}}, 8, VertexResult::OutOfRange},
        {"repeats as unorm", {{TextureCoordinate, Unorm16x2, 0}}, 8, VertexResult::OutOfRange},
    };
    const TreeMesh mesh = sample();
    const std::vector<std::byte> untouched(100000, std::byte{7});
    for (const Case& c : kCases)
    {
        std::vector<std::byte> bytes = untouched;
        EXPECT_EQ(writeVertices(mesh, {c.stride, c.attributes}, bytes), c.expected) << c.name;
        EXPECT_EQ(bytes, untouched) << c.name;
        EXPECT_FALSE(reasonOf(c.expected).empty());
    }
    const VertexAttributeFormat half{TextureCoordinate, Float16x2, 0};
    for (const float wrong : {kNaN, 65520.0f, -std::numeric_limits<float>::infinity()})
    {
        TreeMesh spoilt = mesh;
        spoilt.uvs.back().x = wrong;
        std::vector<std::byte> bytes = untouched;
        EXPECT_EQ(writeVertices(spoilt, {4, {&half, 1}}, bytes), VertexResult::OutOfRange);
        EXPECT_EQ(bytes, untouched);
    }
    TreeMesh uneven = mesh;
    uneven.tints.pop_back();
    std::vector<std::byte> bytes = untouched;
    EXPECT_EQ(writeVertices(uneven, {4, {&half, 1}}, bytes), VertexResult::InconsistentMesh);
    VertexLayout flat{4, {&half, 1}};
    flat.positionScale = 0;
    EXPECT_EQ(writeVertices(mesh, flat, bytes), VertexResult::BadLayout);
    EXPECT_EQ(bytes, untouched);
}

TEST(VertexLayout, ABufferOneByteTooSmallIsRefused)
{
    const TreeMesh mesh = sample();
    const VertexAttributeFormat attributes[] = {{Position, Float32x3, 1}, {Colour, Unorm8x4, 13}};
    const VertexLayout layout{19, attributes};
    std::vector<std::byte> bytes(bytesOf(mesh, layout) - 1, std::byte{7});
    const auto untouched = bytes;
    EXPECT_EQ(writeVertices(mesh, layout, bytes), VertexResult::BufferTooSmall);
    EXPECT_EQ(bytes, untouched);
    bytes.resize(bytes.size() + 2, std::byte{7});
    EXPECT_EQ(writeVertices(mesh, layout, bytes), VertexResult::Ok);
    for (std::size_t i = 0; i < mesh.positions.size(); ++i)
    {
        EXPECT_EQ(at<Vec3>(bytes, 19 * i + 1), mesh.positions[i]);
        for (const std::size_t gap : {0u, 17u, 18u})
            EXPECT_EQ(bytes[19 * i + gap], std::byte{7}) << "between attributes nothing is written";
    }
    EXPECT_EQ(bytes.back(), std::byte{7}) << "nor behind the last vertex";
}

TEST(VertexLayout, AnEmptyMeshNeedsNoMemory)
{
    const VertexAttributeFormat attribute{Position, Float32x3, 0};
    EXPECT_EQ(writeVertices({}, {12, {&attribute, 1}}, {}), VertexResult::Ok);
    EXPECT_EQ(bytesOf({}, {12, {&attribute, 1}}), 0u);
    EXPECT_EQ(fitPositions({}).scale, 1);
}

} // namespace espalier
