#include <Espalier/Bake/Gltf.h>

#include <Espalier/Core/File.h>
#include <Espalier/Core/Hash.h>
#include <Espalier/Core/Utf8.h>
#include <Espalier/Mesh/TreeMesh.h>
#include <Espalier/Species/Appearance.h>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <new>
#include <span>
#include <sstream>
#include <vector>

#if defined(__GNUC__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wsign-conversion"
#pragma GCC diagnostic ignored "-Wshadow"
#endif
#include <tiny_gltf.h>
#if defined(__GNUC__)
#pragma GCC diagnostic pop
#endif

namespace espalier {

namespace {

static_assert(std::endian::native == std::endian::little,
              "glTF buffers are little-endian; arrays are copied as they lie");

/// The length field of a GLB has 32 bits; the rest is room for the document, whose only long part is the name.
constexpr std::uint64_t kMaxPayload = (std::uint64_t{1} << 32) - (std::uint64_t{1} << 20);
constexpr std::size_t kMaxNameBytes = 4096;

/// 65535 is the primitive restart value, so the highest 16-bit index is 65534.
constexpr std::size_t kMaxShortVertices = 65535;

template <class Vector>
bool isFinite(const Vector& v)
{
    for (int i = 0; i < v.length(); ++i)
        if (!std::isfinite(v[i]))
            return false;
    return true;
}

/// As closely as the Khronos validator asks, with some room.
bool isUnit(Vec3 v)
{
    constexpr float kTolerance = 0.0005f;
    return std::abs(glm::length(v) - 1) <= kTolerance;
}

Expected<void> checkMesh(const TreeMesh& mesh)
{
    const auto bad = [](std::string what) {
        return failure(ErrorKind::BadInput, {}, "the mesh cannot be baked: " + what,
                       "the finite, consistent triangles that meshing a sound skeleton gives");
    };
    const auto badVertex = [&](std::size_t vertex, const char* what) {
        return bad("vertex " + std::to_string(vertex) + " has " + what);
    };
    const std::size_t vertices = mesh.positions.size();
    if (vertices == 0 || mesh.indices.empty())
        return bad("it is empty");
    if (mesh.normals.size() != vertices || mesh.tangents.size() != vertices || mesh.uvs.size() != vertices)
        return bad("its vertex arrays differ in length");
    for (std::size_t i = 0; i < vertices; ++i)
    {
        if (!isFinite(mesh.positions[i]))
            return badVertex(i, "a position that is not finite");
        if (!isFinite(mesh.uvs[i]))
            return badVertex(i, "a texture coordinate that is not finite");
        if (!isUnit(mesh.normals[i]))
            return badVertex(i, "a normal that is not of unit length");
        const Vec4 tangent = mesh.tangents[i];
        if (!isUnit({tangent.x, tangent.y, tangent.z}) || std::abs(tangent.w) != 1)
            return badVertex(i, "a tangent that is not of unit length, or whose w is not +1 or -1");
    }
    for (std::size_t i = 0; i < mesh.indices.size(); ++i)
        if (mesh.indices[i] >= vertices)
            return bad("index " + std::to_string(i) + " is " + std::to_string(mesh.indices[i]) + " of " +
                       std::to_string(vertices) + " vertices");
    std::uint64_t covered = 0;
    for (const MeshPart& part : mesh.parts)
    {
        if (part.firstIndex != covered || part.indexCount % 3 != 0)
            return bad("its parts do not cover its triangles in order");
        covered += part.indexCount;
    }
    if (covered != mesh.indices.size())
        return bad("its parts do not cover its triangles in order");
    return {};
}

/// Builds one glTF model: every array becomes a view of the only buffer.
class GltfWriter
{
public:
    template <class T>
    int addView(std::span<const T> values, int target)
    {
        std::vector<unsigned char>& bytes = model.buffers[0].data;
        tinygltf::BufferView view;
        view.buffer = 0;
        view.byteOffset = bytes.size();
        view.byteLength = values.size_bytes();
        view.target = target;
        bytes.resize((bytes.size() + values.size_bytes() + 3) / 4 * 4);
        std::memcpy(bytes.data() + view.byteOffset, values.data(), values.size_bytes());
        model.bufferViews.push_back(std::move(view));
        return static_cast<int>(model.bufferViews.size() - 1);
    }

    int addAccessor(int view, std::size_t byteOffset, std::size_t count, int componentType, int type)
    {
        tinygltf::Accessor accessor;
        accessor.bufferView = view;
        accessor.byteOffset = byteOffset;
        accessor.count = count;
        accessor.componentType = componentType;
        accessor.type = type;
        model.accessors.push_back(std::move(accessor));
        return static_cast<int>(model.accessors.size() - 1);
    }

    template <class Vector>
    int addAttribute(std::span<const Vector> values)
    {
        const int view = addView(values, TINYGLTF_TARGET_ARRAY_BUFFER);
        return addAccessor(view, 0, values.size(), TINYGLTF_COMPONENT_TYPE_FLOAT, Vector::length());
    }

    tinygltf::Model model;
};

int addPositions(std::span<const Vec3> positions, GltfWriter& writer)
{
    const int result = writer.addAttribute(positions);
    Vec3 low = positions[0];
    Vec3 high = positions[0];
    for (const Vec3 p : positions)
        for (int axis = 0; axis < 3; ++axis)
        {
            low[axis] = std::min(low[axis], p[axis]);
            high[axis] = std::max(high[axis], p[axis]);
        }
    writer.model.accessors[static_cast<std::size_t>(result)].minValues = {low.x, low.y, low.z};
    writer.model.accessors[static_cast<std::size_t>(result)].maxValues = {high.x, high.y, high.z};
    return result;
}

int addTextureCoordinates(std::span<const Vec2> uvs, GltfWriter& writer)
{
    std::vector<Vec2> fromTop(uvs.begin(), uvs.end());
    for (Vec2& uv : fromTop)
        uv.y = 1 - uv.y;
    return writer.addAttribute(std::span<const Vec2>(fromTop));
}

bool looksLike(const MeshPart& a, const MeshPart& b)
{
    return a.material == b.material && a.colour == b.colour;
}

/// The first part of each look, in order: each becomes a material.
std::vector<MeshPart> looksOf(const TreeMesh& mesh)
{
    std::vector<MeshPart> looks;
    for (const MeshPart& part : mesh.parts)
    {
        const auto isSame = [&](const MeshPart& look) { return looksLike(look, part); };
        if (part.indexCount > 0 && std::ranges::none_of(looks, isSame))
            looks.push_back(part);
    }
    return looks;
}

/// One primitive a part, all with the same attributes and one view of indices.
tinygltf::Mesh addMesh(const TreeMesh& mesh, std::span<const MeshPart> looks, GltfWriter& writer)
{
    tinygltf::Primitive primitive;
    primitive.mode = TINYGLTF_MODE_TRIANGLES;
    primitive.attributes["POSITION"] = addPositions(mesh.positions, writer);
    primitive.attributes["NORMAL"] = writer.addAttribute(std::span(mesh.normals));
    primitive.attributes["TANGENT"] = writer.addAttribute(std::span(mesh.tangents));
    primitive.attributes["TEXCOORD_0"] = addTextureCoordinates(mesh.uvs, writer);

    const bool isShort = mesh.positions.size() <= kMaxShortVertices;
    const std::size_t indexSize = isShort ? sizeof(std::uint16_t) : sizeof(std::uint32_t);
    const int componentType = isShort ? TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT : TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT;
    std::vector<std::uint16_t> shorts;
    if (isShort)
        for (const std::uint32_t index : mesh.indices)
            shorts.push_back(static_cast<std::uint16_t>(index));
    const int view = isShort
                         ? writer.addView(std::span<const std::uint16_t>(shorts), TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER)
                         : writer.addView(std::span(mesh.indices), TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER);

    tinygltf::Mesh result;
    for (const MeshPart& part : mesh.parts)
    {
        if (part.indexCount == 0)
            continue;
        primitive.material = static_cast<int>(
            std::ranges::find_if(looks, [&](const MeshPart& look) { return looksLike(look, part); }) - looks.begin());
        primitive.indices =
            writer.addAccessor(view, part.firstIndex * indexSize, part.indexCount, componentType, TINYGLTF_TYPE_SCALAR);
        result.primitives.push_back(primitive);
    }
    return result;
}

/// What is not plain bark is named by its entry of the palette, such as "Oak wood 2" and "Oak surface 1".
tinygltf::Material materialOf(const MeshPart& look, const Appearance& appearance, const std::string& name)
{
    constexpr double kSurfaceRoughness = 0.6; // leaves and berries are waxy
    const bool isSurface = look.material == MeshMaterial::Surface;
    const auto factor = [](float value) { return static_cast<double>(std::clamp(value, 0.0f, 1.0f)); };
    const Vec3 colour = colourOf(look, appearance);
    tinygltf::Material material;
    material.name = name + (isSurface ? " surface " : look.colour == 0 ? " bark" : " wood ");
    if (isSurface || look.colour != 0)
        material.name += std::to_string(look.colour);
    material.doubleSided = isSurface;
    material.pbrMetallicRoughness.baseColorFactor = {factor(colour.x), factor(colour.y), factor(colour.z), 1.0};
    material.pbrMetallicRoughness.metallicFactor = 0;
    material.pbrMetallicRoughness.roughnessFactor = isSurface ? kSurfaceRoughness : factor(appearance.bark.roughness);
    return material;
}

tinygltf::Value extrasOf(const BakeInfo& info)
{
    using Value = tinygltf::Value;
    const Value::Object facts{{"species", Value(info.speciesName)},
                              {"speciesHash", Value(hexDigits(info.speciesHash))},
                              {"seed", Value(info.seed ? std::to_string(info.seed->value) : "exemplar")},
                              {"version", Value(std::string(ESPALIER_VERSION))}};
    return Value(Value::Object{{"espalier", Value(facts)}});
}

Expected<std::string> serialise(const TreeMesh& mesh, const Appearance& appearance, const BakeInfo& info)
{
    const std::string name = info.speciesName.empty() ? "tree" : info.speciesName;
    GltfWriter writer;
    tinygltf::Model& model = writer.model;
    model.asset.version = "2.0";
    model.asset.generator = "Espalier " ESPALIER_VERSION;
    model.buffers.emplace_back();
    const std::vector<MeshPart> looks = looksOf(mesh);
    model.meshes.push_back(addMesh(mesh, looks, writer));
    model.meshes[0].name = name;
    for (const MeshPart& look : looks)
        model.materials.push_back(materialOf(look, appearance, name));
    tinygltf::Node node;
    node.name = name;
    node.mesh = 0;
    node.extras = extrasOf(info);
    model.nodes.push_back(std::move(node));
    tinygltf::Scene scene;
    scene.name = name;
    scene.nodes = {0};
    model.scenes.push_back(std::move(scene));
    model.defaultScene = 0;

    std::ostringstream stream;
    tinygltf::TinyGLTF gltf;
    if (!gltf.WriteGltfSceneToStream(&model, stream, false, true) || !stream)
        return failure(ErrorKind::Limit, {}, "the glTF file does not fit into memory");
    return std::move(stream).str();
}

} // namespace

Expected<std::string> bakeGlb(const TreeMesh& mesh, const Appearance& appearance, const BakeInfo& info)
{
    if (auto checked = checkMesh(mesh); !checked)
        return tl::unexpected(checked.error());
    if (!isFinite(appearance.bark.colour) || !std::isfinite(appearance.bark.roughness))
        return failure(ErrorKind::BadInput, {}, "the bark's colour or roughness is not finite");
    if (!std::ranges::all_of(appearance.palette, [](const Vec3& colour) { return isFinite(colour); }))
        return failure(ErrorKind::BadInput, {}, "a colour of the palette is not finite");
    if (info.speciesName.size() > kMaxNameBytes || findInvalidUtf8(info.speciesName) != std::string_view::npos)
        return failure(ErrorKind::BadInput, {}, "the species' name cannot be written",
                       "UTF-8 of at most " + std::to_string(kMaxNameBytes) + " bytes");
    constexpr std::uint64_t kVertexSize = 2 * sizeof(Vec3) + sizeof(Vec4) + sizeof(Vec2);
    const std::uint64_t payload =
        std::uint64_t{mesh.positions.size()} * kVertexSize + std::uint64_t{mesh.indices.size()} * sizeof(std::uint32_t);
    if (payload > kMaxPayload)
        return failure(ErrorKind::Limit, {}, "the GLB file would have " + std::to_string(payload) + " bytes",
                       "at most 4 GiB, which is all its header can say", "bake a coarser mesh");
    try
    {
        return serialise(mesh, appearance, info);
    }
    catch (const std::bad_alloc&)
    {
        return failure(ErrorKind::Limit, {}, "the glTF file does not fit into memory");
    }
    catch (const std::exception& exception) // of the JSON library
    {
        return failure(ErrorKind::BadInput, {},
                       std::string("the glTF document cannot be written: ") + exception.what());
    }
}

Expected<void> writeGlb(const std::filesystem::path& path, const TreeMesh& mesh, const Appearance& appearance,
                        const BakeInfo& info)
{
    const auto bytes = bakeGlb(mesh, appearance, info);
    if (!bytes)
        return tl::unexpected(bytes.error());
    return writeFileAtomically(path, *bytes);
}

} // namespace espalier
