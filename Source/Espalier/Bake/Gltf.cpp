#include <Espalier/Bake/Gltf.h>

#include <Espalier/Bake/GltfMaterials.h>
#include <Espalier/Bake/GltfPayload.h>
#include <Espalier/Bake/MeshParts.h>
#include <Espalier/Bake/TinyGltf.h>
#include <Espalier/Core/Finite.h>
#include <Espalier/Core/Hash.h>
#include <Espalier/Core/Utf8.h>
#include <Espalier/Mesh/TreeMesh.h>
#include <Espalier/Mesh/WindPresets.h>
#include <Espalier/Species/Appearance.h>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <glm/common.hpp>
#include <new>
#include <nlohmann/json.hpp>
#include <sstream>
#include <utility>

namespace espalier {

namespace {

/// The length field of a GLB has 32 bits; the rest is room for the document, whose only long part is the name.
constexpr std::uint64_t kMaxPayload = (std::uint64_t{1} << 32) - (std::uint64_t{1} << 20);
constexpr std::size_t kMaxNameBytes = 4096;
constexpr std::size_t kMaxJoints = 65536;

tl::unexpected<Error> refuse(std::string what, std::string expected = {})
{
    return failure(ErrorKind::BadInput, {}, std::move(what), std::move(expected));
}

/// All but the numbers in the arrays, which are checked on their way.
Expected<void> checkLevel(const BakedLevel& level, std::size_t joints)
{
    const auto bad = [](std::string what) {
        return refuse("the mesh cannot be baked: " + what,
                      "the finite, consistent triangles that meshing a sound skeleton gives");
    };
    if (level.mesh == nullptr)
        return bad("there is none");
    const TreeMesh& mesh = *level.mesh;
    const std::size_t vertices = mesh.positions.size();
    if (vertices == 0 || mesh.indices.empty())
        return bad("it is empty");
    const auto isOptional = [&](std::size_t length) { return length == 0 || length == vertices; };
    if (mesh.normals.size() != vertices || mesh.tangents.size() != vertices || mesh.uvs.size() != vertices ||
        !isOptional(mesh.tints.size()))
        return bad("its vertex arrays differ in length");
    if (!isOptional(level.colours.size()) || !isOptional(level.influences.size()) ||
        std::ranges::any_of(level.furtherUvs, [&](const auto& uvs) { return uvs.size() != vertices; }))
        return bad("what goes with it is not as long as its vertices");
    if (level.furtherUvs.size() > kMostFurtherUvs)
        return bad("it has " + std::to_string(level.furtherUvs.size()) + " further texture coordinates of at most " +
                   std::to_string(kMostFurtherUvs));
    if ((joints > 0) == level.influences.empty())
        return bad("it is to have joints, and its vertices none, or the other way round");
    if (!std::isfinite(level.error) || level.error < 0)
        return bad("its error is negative or not finite");
    if (!partsCoverAll(mesh))
        return bad("its parts do not cover its triangles in order");
    return {};
}

Expected<void> checkTree(const BakedTree& tree)
{
    if (tree.levels.empty())
        return refuse("there is no mesh to bake");
    if (tree.joints.size() > kMaxJoints)
        return refuse("the tree has " + std::to_string(tree.joints.size()) + " joints",
                      "at most " + std::to_string(kMaxJoints));
    for (std::size_t i = 0; i < tree.joints.size(); ++i)
    {
        const WindJoint& joint = tree.joints[i];
        if (joint.parent != kNoElement && joint.parent >= i)
            return refuse("joint " + std::to_string(i) + " hangs on joint " + std::to_string(joint.parent),
                          "parents before children");
        if (!isFinite(joint.position))
            return refuse("joint " + std::to_string(i) + " is at a position that is not finite");
    }
    for (const BakedLevel& level : tree.levels)
        if (auto checked = checkLevel(level, tree.joints.size()); !checked)
            return checked;
    for (const EncodedImages& images : tree.images)
        for (const std::string* const image : {&images.colour, &images.normal, &images.roughness})
            if (!image->empty() && !image->starts_with("\x89PNG\r\n\x1a\n"))
                return refuse("an image of the material cannot be baked", "the bytes of a PNG file");
    return {};
}

Expected<void> checkLook(const Appearance& appearance)
{
    if (!isFinite(appearance.bark.colour) || !std::isfinite(appearance.bark.roughness))
        return refuse("the bark's colour or roughness is not finite");
    if (!std::ranges::all_of(appearance.palette, [](const Vec3& colour) { return isFinite(colour); }))
        return refuse("a colour of the palette is not finite");
    for (const LeafAppearance& leaf : appearance.leaves)
        if (!isFinite(leaf.colour) || !std::isfinite(leaf.roughness) || !std::isfinite(leaf.translucency))
            return refuse("the colour, roughness or translucency of leaves is not finite");
    return {};
}

/// The double that prints as the float does: 0.013, not 0.013000000268220901.
double asPrinted(float value)
{
    std::array<char, 32> digits{};
    const char* const end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
    double printed = 0;
    std::from_chars(digits.data(), end, printed);
    return printed;
}

/// The share of a screen of 1080 lines, 16:9, that a tree covers where `error` is one of its pixels; of its area, as
/// MSFT_lod's readers have it.
double coverageAt(double error, const Bounds& bounds)
{
    constexpr double kLines = 1080;
    constexpr double kAspect = 16.0 / 9;
    constexpr double kDiskOfSquare = 0.7853981633974483;
    const double diameter = static_cast<double>(glm::length(bounds.high - bounds.low));
    const double lines = error > 0 ? diameter / error / kLines : 1e9;
    return std::min(1.0, kDiskOfSquare * lines * lines / kAspect);
}

/// Builds the document and the payload of one file.
class TreeWriter
{
public:
    TreeWriter(const BakedTree& tree, const Appearance& appearance, const BakeInfo& info, const BakeOptions& options)
        : tree_(tree), info_(info), options_(options), name_(info.speciesName.empty() ? "tree" : info.speciesName),
          payload_(options.encoding), materials_(appearance, tree.images, name_, options, model_, payload_)
    {}

    Expected<void> build()
    {
        model_.asset.version = "2.0";
        model_.asset.generator = "Espalier " ESPALIER_VERSION;
        std::vector<Bounds> bounds;
        for (const BakedLevel& level : tree_.levels)
        {
            auto found = boundsOf(level.mesh->positions);
            if (!found)
                return tl::unexpected(found.error());
            bounds.push_back(*found);
        }
        whole_ = bounds[0];
        for (const Bounds& level : bounds)
        {
            whole_.low = glm::min(whole_.low, level.low);
            whole_.high = glm::max(whole_.high, level.high);
        }
        if (isQuantized())
            grid_ = gridOf(whole_);
        for (std::size_t i = 0; i < tree_.levels.size(); ++i)
            if (auto added = addMesh(tree_.levels[i], bounds[i]); !added)
                return added;
        addNodes();
        if (auto added = addSkin(); !added)
            return added;
        nameExtensions();
        return {};
    }

    [[nodiscard]] const GltfPayload& payload() const { return payload_; }

    /// tinygltf writes no extensions of buffer views and wants the payload in a buffer of its own, so these two parts
    /// are ours. Empty if it fails.
    std::string document()
    {
        std::ostringstream stream;
        tinygltf::TinyGLTF gltf;
        if (!gltf.WriteGltfSceneToStream(&model_, stream, false, false) || !stream)
            return {};
        nlohmann::json document = nlohmann::json::parse(stream.str());
        payload_.describe(document);
        return document.dump();
    }

private:
    [[nodiscard]] bool isQuantized() const { return options_.encoding != GltfEncoding::Portable; }
    [[nodiscard]] bool hasSkin() const { return !tree_.joints.empty(); }

    int addAccessor(const GltfArray& array, int view, std::size_t byteOffset, std::size_t count)
    {
        tinygltf::Accessor accessor;
        accessor.bufferView = view;
        accessor.byteOffset = byteOffset;
        accessor.count = count;
        accessor.componentType = array.componentType;
        accessor.type = array.type;
        accessor.normalized = array.isNormalized;
        accessor.minValues = array.lowest;
        accessor.maxValues = array.highest;
        model_.accessors.push_back(std::move(accessor));
        return static_cast<int>(model_.accessors.size() - 1);
    }

    Expected<int> addArray(const GltfArray& array)
    {
        const auto view = payload_.add(array);
        return view ? Expected<int>(addAccessor(array, *view, 0, array.count)) : view;
    }

    /// One primitive a part, all with the same attributes and one view of indices.
    Expected<void> addMesh(const BakedLevel& level, const Bounds& bounds)
    {
        const TreeMesh& mesh = *level.mesh;
        const GltfEncoding encoding = options_.encoding;
        std::vector<std::pair<std::string, GltfArray>> attributes{
            {"POSITION", isQuantized() ? quantizedPositionArray(mesh.positions, bounds, grid_)
                                       : positionArray(mesh.positions, bounds)},
            {"NORMAL", normalArray(mesh.normals, encoding)},
            {"TANGENT", tangentArray(mesh.tangents, encoding)},
            {"TEXCOORD_0", textureArray(mesh.uvs, encoding)}};
        for (std::size_t i = 0; i < level.furtherUvs.size(); ++i)
            attributes.emplace_back("TEXCOORD_" + std::to_string(i + 1), furtherTextureArray(level.furtherUvs[i]));
        if (const std::span<const Tint> colours = level.colours.empty() ? mesh.tints : level.colours; !colours.empty())
            attributes.emplace_back("COLOR_0", colourArray(colours));
        if (hasSkin())
        {
            attributes.emplace_back("JOINTS_0", jointArray(level.influences, tree_.joints.size()));
            attributes.emplace_back("WEIGHTS_0", weightArray(level.influences));
        }
        tinygltf::Primitive primitive;
        primitive.mode = TINYGLTF_MODE_TRIANGLES;
        for (const auto& [semantic, array] : attributes)
        {
            const auto accessor = addArray(array);
            if (!accessor)
                return tl::unexpected(accessor.error());
            primitive.attributes[semantic] = *accessor;
        }

        const GltfArray indices = indexArray(mesh.indices, mesh.positions.size());
        const auto view = payload_.add(indices);
        if (!view)
            return tl::unexpected(view.error());
        tinygltf::Mesh result;
        for (const MeshPart& part : mesh.parts)
        {
            if (part.indexCount == 0)
                continue;
            primitive.material = materials_.of(part);
            primitive.indices = addAccessor(indices, *view, part.firstIndex * indices.stride, part.indexCount);
            result.primitives.push_back(primitive);
        }
        result.name = nameOf(model_.meshes.size());
        model_.meshes.push_back(std::move(result));
        return {};
    }

    /// Of a level.
    [[nodiscard]] std::string nameOf(std::size_t level) const
    {
        return tree_.levels.size() == 1 ? name_ : name_ + " LOD " + std::to_string(tree_.levels[level].lod);
    }

    [[nodiscard]] tinygltf::Value::Object levelFacts(const BakedLevel& level) const
    {
        using Value = tinygltf::Value;
        if (tree_.levels.size() == 1 && level.lod == 0)
            return {};
        return {{"lod", Value(static_cast<int>(level.lod))}, {"error", Value(asPrinted(level.error))}};
    }

    [[nodiscard]] tinygltf::Value treeFacts() const
    {
        using Value = tinygltf::Value;
        Value::Object facts = levelFacts(tree_.levels[0]);
        facts["species"] = Value(info_.speciesName);
        facts["speciesHash"] = Value(hexDigits(info_.speciesHash));
        facts["seed"] = Value(info_.seed ? std::to_string(info_.seed->value) : "exemplar");
        facts["version"] = Value(std::string(ESPALIER_VERSION));
        if (info_.wind)
            facts["wind"] = Value(Value::Object{{"trunkAngle", Value(asPrinted(info_.wind->trunkAngle))},
                                                {"boughAngle", Value(asPrinted(info_.wind->boughAngle))},
                                                {"flutter", Value(asPrinted(info_.wind->flutter))},
                                                {"rate", Value(asPrinted(info_.wind->rate))}});
        return Value(std::move(facts));
    }

    void addNodes()
    {
        using Value = tinygltf::Value;
        const bool isScaled = isQuantized() && !hasSkin();
        const bool isChain = tree_.levels.size() > 1;
        Value::Object extras{{"espalier", treeFacts()}};
        tinygltf::Scene scene;
        scene.name = name_;
        scene.nodes = {0};
        model_.scenes.push_back(std::move(scene));
        model_.defaultScene = 0;
        if (isScaled) // Whoever places the tree must not lose the scale of its grid, so this has a node of its own.
        {
            tinygltf::Node root;
            root.name = name_;
            root.children = {1};
            root.extras = Value(std::exchange(extras, {}));
            model_.nodes.push_back(std::move(root));
        }
        const std::size_t first = model_.nodes.size();
        for (std::size_t i = 0; i < tree_.levels.size(); ++i)
        {
            tinygltf::Node node;
            node.name = isScaled && !isChain ? name_ + " mesh" : nameOf(i);
            node.mesh = static_cast<int>(i);
            if (hasSkin())
                node.skin = 0;
            if (isScaled)
            {
                const double scale{grid_.halfExtent};
                node.scale = {scale, scale, scale};
                node.translation = {grid_.centre.x, grid_.centre.y, grid_.centre.z};
            }
            if (i > 0)
                node.extras = Value(Value::Object{{"espalier", Value(levelFacts(tree_.levels[i]))}});
            model_.nodes.push_back(std::move(node));
        }
        if (isChain)
            chainLevels(model_.nodes[first], static_cast<int>(first), extras);
        if (!extras.empty())
            model_.nodes[first].extras = Value(std::move(extras));
    }

    void chainLevels(tinygltf::Node& finest, int first, tinygltf::Value::Object& extras) const
    {
        using Value = tinygltf::Value;
        Value::Array ids;
        Value::Array coverage;
        for (std::size_t i = 1; i < tree_.levels.size(); ++i)
        {
            ids.emplace_back(first + static_cast<int>(i));
            coverage.emplace_back(coverageAt(double{tree_.levels[i].error}, whole_));
        }
        coverage.emplace_back(0.0); // the coarsest is never left out
        finest.extensions["MSFT_lod"] = Value(Value::Object{{"ids", Value(std::move(ids))}});
        extras["MSFT_screencoverage"] = Value(std::move(coverage));
    }

    /// The joints below a node of their own, which is their common root.
    Expected<void> addSkin()
    {
        if (!hasSkin())
            return {};
        const auto matrices = addArray(bindMatrixArray(tree_.joints, grid_));
        if (!matrices)
            return tl::unexpected(matrices.error());
        const int armature = static_cast<int>(model_.nodes.size());
        const int first = armature + 1;
        tinygltf::Skin skin;
        skin.name = name_ + " skin";
        skin.inverseBindMatrices = *matrices;
        skin.skeleton = armature;
        tinygltf::Node root;
        root.name = name_ + " joints";
        model_.nodes.push_back(std::move(root));
        model_.scenes[0].nodes.push_back(armature);
        for (std::size_t i = 0; i < tree_.joints.size(); ++i)
        {
            const WindJoint& joint = tree_.joints[i];
            const bool isRoot = joint.parent == kNoElement;
            const Vec3 moved = isRoot ? joint.position : joint.position - tree_.joints[joint.parent].position;
            const int index = first + static_cast<int>(i);
            tinygltf::Node node;
            node.name = name_ + " joint " + std::to_string(i);
            node.translation = {moved.x, moved.y, moved.z};
            model_.nodes[static_cast<std::size_t>(isRoot ? armature : first + static_cast<int>(joint.parent))]
                .children.push_back(index);
            model_.nodes.push_back(std::move(node));
            skin.joints.push_back(index);
        }
        model_.skins.push_back(std::move(skin));
        return {};
    }

    void nameExtensions()
    {
        const auto use = [&](const char* name, bool isRequired) {
            model_.extensionsUsed.emplace_back(name);
            if (isRequired)
                model_.extensionsRequired.emplace_back(name);
        };
        if (tree_.levels.size() > 1)
            use("MSFT_lod", false);
        if (isQuantized())
            use("KHR_mesh_quantization", true);
        if (options_.encoding == GltfEncoding::Compressed)
            use("EXT_meshopt_compression", true);
    }

    const BakedTree& tree_;
    const BakeInfo& info_;
    const BakeOptions& options_;
    std::string name_;
    tinygltf::Model model_;
    GltfPayload payload_;
    GltfMaterials materials_;
    Bounds whole_; ///< Of all levels.
    PositionGrid grid_;
};

std::string_view wordBytes(const std::uint32_t& word)
{
    return {reinterpret_cast<const char*>(&word), sizeof(word)};
}

/// A GLB: a header, the document, the payload. `reserve` hears its size before its first byte.
Expected<void> write(TreeWriter& writer, const std::function<void(std::size_t)>& reserve, const ByteSink& sink)
{
    std::string document = writer.document();
    if (document.empty())
        return failure(ErrorKind::Limit, {}, "the glTF file does not fit into memory");
    document.resize((document.size() + 3) / 4 * 4, ' ');
    const std::uint64_t payload = writer.payload().size();
    constexpr std::size_t kHeaders = 12 + 8 + 8;
    const std::uint64_t total = kHeaders + document.size() + payload;
    if (payload > kMaxPayload || total > 0xffffffffu)
        return failure(ErrorKind::Limit, {}, "the GLB file would have " + std::to_string(total) + " bytes",
                       "at most 4 GiB, which is all its header can say", "bake a coarser mesh");
    reserve(static_cast<std::size_t>(total));
    std::string head("glTF");
    for (const std::uint32_t word : {std::uint32_t{2}, static_cast<std::uint32_t>(total),
                                     static_cast<std::uint32_t>(document.size()), std::uint32_t{0x4e4f534a}})
        head += wordBytes(word);
    head += document;
    for (const std::uint32_t word : {static_cast<std::uint32_t>(payload), std::uint32_t{0x004e4942}})
        head += wordBytes(word);
    if (auto written = sink(head); !written)
        return written;
    return writer.payload().write(sink);
}

/// Everything up to the bytes, which then go where `deliver` says; exceptions of libraries end here.
Expected<void> bake(const BakedTree& tree, const Appearance& appearance, const BakeInfo& info,
                    const BakeOptions& options, const std::function<Expected<void>(TreeWriter&)>& deliver)
{
    if (auto checked = checkTree(tree); !checked)
        return checked;
    if (auto checked = checkLook(appearance); !checked)
        return checked;
    if (info.speciesName.size() > kMaxNameBytes || findInvalidUtf8(info.speciesName) != std::string_view::npos)
        return refuse("the species' name cannot be written",
                      "UTF-8 of at most " + std::to_string(kMaxNameBytes) + " bytes");
    try
    {
        TreeWriter writer(tree, appearance, info, options);
        if (auto built = writer.build(); !built)
            return built;
        return deliver(writer);
    }
    catch (const std::bad_alloc&)
    {
        return failure(ErrorKind::Limit, {}, "the glTF file does not fit into memory");
    }
    catch (const std::exception& exception) // of the JSON library
    {
        return refuse(std::string("the glTF document cannot be written: ") + exception.what());
    }
}

} // namespace

Expected<std::string> bakeGlb(const BakedTree& tree, const Appearance& appearance, const BakeInfo& info,
                              const BakeOptions& options)
{
    std::string bytes;
    const auto deliver = [&](TreeWriter& writer) {
        const auto reserve = [&](std::size_t size) { bytes.reserve(size); };
        const ByteSink append = [&](std::string_view more) -> Expected<void> {
            bytes += more;
            return {};
        };
        return write(writer, reserve, append);
    };
    if (auto baked = bake(tree, appearance, info, options, deliver); !baked)
        return tl::unexpected(baked.error());
    return bytes;
}

Expected<std::string> bakeGlb(const TreeMesh& mesh, const Appearance& appearance, const BakeInfo& info,
                              const BakeOptions& options)
{
    BakedLevel level;
    level.mesh = &mesh;
    return bakeGlb(BakedTree{{&level, 1}, {}, {}}, appearance, info, options);
}

Expected<void> writeGlb(const std::filesystem::path& path, const BakedTree& tree, const Appearance& appearance,
                        const BakeInfo& info, const BakeOptions& options)
{
    return bake(tree, appearance, info, options, [&](TreeWriter& writer) {
        return writeFileAtomically(path, [&](const ByteSink& sink) {
            return write(
                writer, [](std::size_t) {}, sink);
        });
    });
}

Expected<void> writeGlb(const std::filesystem::path& path, const TreeMesh& mesh, const Appearance& appearance,
                        const BakeInfo& info, const BakeOptions& options)
{
    BakedLevel level;
    level.mesh = &mesh;
    return writeGlb(path, BakedTree{{&level, 1}, {}, {}}, appearance, info, options);
}

} // namespace espalier
