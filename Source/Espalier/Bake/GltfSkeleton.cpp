#include <Espalier/Bake/GltfSkeleton.h>
#include <Espalier/Core/Finite.h>

#include <Espalier/Core/File.h>
#include <Espalier/Core/Json.h>
#include <algorithm>
#include <array>
#include <cmath>

namespace espalier {

namespace {

constexpr std::string_view kMagic = "glTF";
constexpr std::uint32_t kJsonChunk = 0x4e4f534a;
constexpr std::size_t kHeaderBytes = 12;
constexpr std::size_t kChunkHeaderBytes = 8;

std::uint32_t littleEndian(std::string_view bytes, std::size_t at)
{
    std::uint32_t value = 0;
    for (std::size_t i = 4; i-- > 0;)
        value = value << 8 | static_cast<unsigned char>(bytes[at + i]);
    return value;
}

/// The JSON part of a file, which is all of it unless it is binary.
Expected<std::string> jsonOf(std::string bytes, const Location& where)
{
    const auto fail = [&](std::string what, std::string expected) {
        return failure(ErrorKind::BadInput, where, std::move(what), std::move(expected));
    };
    if (!bytes.starts_with(kMagic))
    {
        constexpr std::string_view kByteOrderMark = "\xef\xbb\xbf";
        if (bytes.starts_with(kByteOrderMark))
            bytes.erase(0, kByteOrderMark.size());
        return bytes;
    }
    if (bytes.size() < kHeaderBytes + kChunkHeaderBytes)
        return fail("the binary glTF ends within its head", "a head of 12 bytes and a JSON chunk");
    if (const std::uint32_t version = littleEndian(bytes, 4); version != 2)
        return fail("this is version " + std::to_string(version) + " of binary glTF", "version 2");
    const std::size_t total = littleEndian(bytes, 8);
    const std::size_t length = littleEndian(bytes, kHeaderBytes);
    if (littleEndian(bytes, kHeaderBytes + 4) != kJsonChunk)
        return fail("the first chunk is not JSON", "a chunk of the type JSON");
    if (total > bytes.size())
        return fail("the head tells of " + std::to_string(total) + " bytes, the file has " +
                        std::to_string(bytes.size()),
                    "a whole file");
    const std::size_t room = std::max(total, kHeaderBytes + kChunkHeaderBytes) - kHeaderBytes - kChunkHeaderBytes;
    if (length > room)
        return fail("the JSON chunk has " + std::to_string(length) + " bytes, the file has room for " +
                        std::to_string(room),
                    "a chunk inside the file");
    return bytes.substr(kHeaderBytes + kChunkHeaderBytes, length);
}

/// p -> axes * p + origin.
struct Transform
{
    std::array<DVec3, 3> axes{DVec3(1, 0, 0), DVec3(0, 1, 0), DVec3(0, 0, 1)};
    DVec3 origin{0};

    [[nodiscard]] DVec3 turned(const DVec3& v) const { return axes[0] * v.x + axes[1] * v.y + axes[2] * v.z; }
    friend Transform operator*(const Transform& outer, const Transform& inner)
    {
        Transform result;
        for (std::size_t i = 0; i < 3; ++i)
            result.axes[i] = outer.turned(inner.axes[i]);
        result.origin = outer.turned(inner.origin) + outer.origin;
        return result;
    }
};

class GltfReader
{
public:
    GltfReader(const JsonDocument& document, const Limits& limits) : root_(document.root()), limits_(limits) {}

    Expected<PointTree> read()
    {
        for (const auto step : {&GltfReader::readNodes, &GltfReader::readHierarchy, &GltfReader::readRoots,
                                &GltfReader::readSkins, &GltfReader::placeNodes})
            if (auto done = (this->*step)(); !done)
                return tl::make_unexpected(done.error());
        return joints();
    }

private:
    Expected<void> readNodes()
    {
        if (auto done = root_.requireObject("glTF"); !done)
            return done;
        const auto asset = root_.required("asset", "an object with the version of glTF");
        if (!asset)
            return tl::make_unexpected(asset.error());
        if (auto done = asset->requireObject("asset"); !done)
            return done;
        const auto version = asset->required("version", "\"2.0\"");
        if (!version)
            return tl::make_unexpected(version.error());
        const auto text = version->string("version");
        if (!text)
            return tl::make_unexpected(text.error());
        if (!text->starts_with("2."))
            return version->fail("the file is glTF " + shortened(*text), "glTF 2.0");
        const auto nodes = root_.required("nodes", "an array of nodes");
        if (!nodes)
            return tl::make_unexpected(nodes.error());
        if (auto done = nodes->requireArray("nodes"); !done)
            return done;
        if (nodes->size() == 0)
            return nodes->fail("the file has no node", "a hierarchy of nodes, such as bones");
        if (nodes->size() > limits_.nodes)
            return failure(ErrorKind::Limit, nodes->where(), "the file has " + std::to_string(nodes->size()) + " nodes",
                           "at most " + std::to_string(limits_.nodes) + " (the limit nodes)");
        nodes_ = nodes->items();
        transforms_.resize(nodes_.size());
        for (std::size_t i = 0; i < nodes_.size(); ++i)
        {
            if (auto done = nodes_[i].requireObject("a node"); !done)
                return done;
            if (auto done = readTransform(nodes_[i], transforms_[i]); !done)
                return done;
        }
        return {};
    }

    template <std::size_t kSize>
    static Expected<void> readNumbers(const JsonDocument::Value& value, std::string_view role,
                                      std::array<double, kSize>& numbers)
    {
        if (auto done = value.requireArray(role); !done)
            return done;
        if (value.size() != kSize)
            return value.fail(std::string(role) + " has " + std::to_string(value.size()) + " numbers",
                              std::to_string(kSize));
        const std::vector<JsonDocument::Value> items = value.items();
        for (std::size_t i = 0; i < kSize; ++i)
        {
            const auto number = items[i].number(role);
            if (!number)
                return tl::make_unexpected(number.error());
            numbers[i] = *number;
        }
        return {};
    }

    static Expected<void> readTransform(const JsonDocument::Value& node, Transform& transform)
    {
        const auto matrix = node["matrix"];
        if (matrix.exists())
        {
            for (const std::string_view key : {"translation", "rotation", "scale"})
                if (node[key].exists())
                    return node[key].fail("the node has a matrix and a " + std::string(key), "one or the other");
            std::array<double, 16> m{};
            if (auto done = readNumbers(matrix, "matrix", m); !done)
                return done;
            if (m[3] != 0 || m[7] != 0 || m[11] != 0 || m[15] != 1)
                return matrix.fail("the matrix has perspective", "0 0 0 1 in its last row");
            for (std::size_t i = 0; i < 3; ++i)
                transform.axes[i] = {m[4 * i], m[4 * i + 1], m[4 * i + 2]};
            transform.origin = {m[12], m[13], m[14]};
            return {};
        }
        if (const auto translation = node["translation"]; translation.exists())
        {
            std::array<double, 3> t{};
            if (auto done = readNumbers(translation, "translation", t); !done)
                return done;
            transform.origin = {t[0], t[1], t[2]};
        }
        if (const auto rotation = node["rotation"]; rotation.exists())
        {
            std::array<double, 4> q{};
            if (auto done = readNumbers(rotation, "rotation", q); !done)
                return done;
            const double norm = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
            if (!(norm > 0.25 && norm < 4))
                return rotation.fail("the rotation is no unit quaternion", "four numbers x y z w of length 1");
            setRotation(q, 2 / norm, transform);
        }
        if (const auto scale = node["scale"]; scale.exists())
        {
            std::array<double, 3> s{};
            if (auto done = readNumbers(scale, "scale", s); !done)
                return done;
            for (std::size_t i = 0; i < 3; ++i)
                transform.axes[i] *= s[i];
        }
        return {};
    }

    static void setRotation(const std::array<double, 4>& q, double twice, Transform& transform)
    {
        const auto [x, y, z, w] = q;
        transform.axes[0] = {1 - twice * (y * y + z * z), twice * (x * y + z * w), twice * (x * z - y * w)};
        transform.axes[1] = {twice * (x * y - z * w), 1 - twice * (x * x + z * z), twice * (y * z + x * w)};
        transform.axes[2] = {twice * (x * z + y * w), twice * (y * z - x * w), 1 - twice * (x * x + y * y)};
    }

    Expected<std::uint32_t> nodeIndex(const JsonDocument::Value& value, std::string_view role) const
    {
        const auto index = value.count(role, 0, nodes_.size() - 1);
        if (!index)
            return tl::make_unexpected(index.error());
        return static_cast<std::uint32_t>(*index);
    }

    Expected<void> readHierarchy()
    {
        parents_.assign(nodes_.size(), kNoPoint);
        for (std::uint32_t i = 0; i < nodes_.size(); ++i)
        {
            const auto children = nodes_[i]["children"];
            if (!children.exists())
                continue;
            if (auto done = children.requireArray("children"); !done)
                return done;
            for (const JsonDocument::Value& child : children.items())
            {
                const auto index = nodeIndex(child, "a child");
                if (!index)
                    return tl::make_unexpected(index.error());
                if (parents_[*index] != kNoPoint)
                    return child.fail("node " + std::to_string(*index) + " is a child of node " +
                                          std::to_string(parents_[*index]) + " already",
                                      "one parent for each node");
                parents_[*index] = i;
            }
        }
        PointTree hierarchy;
        hierarchy.parents = parents_;
        if (const auto cycle = findCycle(hierarchy))
            return nodes_[*cycle].fail("node " + std::to_string(*cycle) + " hangs on itself, through its parents",
                                       "a hierarchy without cycles");
        return {};
    }

    /// Nodes that stand in the scene without a parent.
    Expected<void> readRoots()
    {
        isRoot_.assign(nodes_.size(), false);
        const auto scenes = root_["scenes"];
        if (scenes.exists())
            if (auto done = scenes.requireArray("scenes"); !done)
                return done;
        if (!scenes.exists() || scenes.size() == 0)
        {
            for (std::size_t i = 0; i < nodes_.size(); ++i)
                isRoot_[i] = parents_[i] == kNoPoint;
            return {};
        }
        std::size_t scene = 0;
        if (const auto chosen = root_["scene"]; chosen.exists())
        {
            const auto index = chosen.count("scene", 0, scenes.size() - 1);
            if (!index)
                return tl::make_unexpected(index.error());
            scene = *index;
        }
        const auto value = scenes.items()[scene];
        if (auto done = value.requireObject("a scene"); !done)
            return done;
        const auto nodes = value["nodes"];
        if (!nodes.exists())
            return value.fail("the scene has no nodes", "an array \"nodes\" of its roots");
        if (auto done = nodes.requireArray("nodes"); !done)
            return done;
        for (const JsonDocument::Value& node : nodes.items())
        {
            const auto index = nodeIndex(node, "a root of the scene");
            if (!index)
                return tl::make_unexpected(index.error());
            if (parents_[*index] != kNoPoint)
                return node.fail("node " + std::to_string(*index) + " is a child of node " +
                                     std::to_string(parents_[*index]),
                                 "nodes without a parent as the roots of a scene");
            isRoot_[*index] = true;
        }
        return {};
    }

    Expected<void> readSkins()
    {
        isJoint_.assign(nodes_.size(), false);
        const auto skins = root_["skins"];
        if (!skins.exists())
            return {};
        if (auto done = skins.requireArray("skins"); !done)
            return done;
        std::size_t total = 0;
        for (const JsonDocument::Value& skin : skins.items())
        {
            if (auto done = skin.requireObject("a skin"); !done)
                return done;
            const auto joints = skin.required("joints", "an array of nodes");
            if (!joints)
                return tl::make_unexpected(joints.error());
            if (auto done = joints->requireArray("joints"); !done)
                return done;
            total += joints->size();
            for (const JsonDocument::Value& joint : joints->items())
            {
                const auto index = nodeIndex(joint, "a joint");
                if (!index)
                    return tl::make_unexpected(index.error());
                isJoint_[*index] = true;
            }
        }
        hasJoints_ = total > 0;
        return {};
    }

    /// From the scene's roots up; what is not in the scene stays where its own roots are.
    Expected<void> placeNodes()
    {
        PointTree hierarchy;
        hierarchy.parents = parents_;
        order_ = depthFirstOrder(hierarchy);
        inScene_.assign(nodes_.size(), false);
        for (const std::uint32_t node : order_)
        {
            const std::uint32_t parent = parents_[node];
            inScene_[node] = parent == kNoPoint ? isRoot_[node] : inScene_[parent];
            if (parent != kNoPoint)
                transforms_[node] = transforms_[parent] * transforms_[node];
            const Transform& world = transforms_[node];
            if (!(isFinite(world.origin) && isFinite(world.axes[0]) && isFinite(world.axes[1]) &&
                  isFinite(world.axes[2])))
                return nodes_[node].fail("the transforms down to node " + std::to_string(node) + " overflow",
                                         "translations, rotations and scales of finite numbers");
        }
        return {};
    }

    Expected<PointTree> joints() const
    {
        PointTree tree;
        std::vector<std::uint32_t> pointOf(nodes_.size(), kNoPoint); // of the joint itself or the one it hangs on
        for (const std::uint32_t node : order_)
        {
            const std::uint32_t above = parents_[node] == kNoPoint ? kNoPoint : pointOf[parents_[node]];
            pointOf[node] = above;
            if (!(hasJoints_ ? isJoint_[node] : inScene_[node]))
                continue;
            pointOf[node] = static_cast<std::uint32_t>(tree.positions.size());
            tree.positions.push_back(transforms_[node].origin);
            tree.parents.push_back(above);
        }
        if (tree.positions.empty())
            return root_.fail("the scene has no node", "a scene with a hierarchy of nodes, or a skin with joints");
        return tree;
    }

    JsonDocument::Value root_;
    const Limits& limits_;
    std::vector<JsonDocument::Value> nodes_;
    std::vector<Transform> transforms_; ///< Of each node; first in its parent, then in the scene.
    std::vector<std::uint32_t> parents_;
    std::vector<std::uint32_t> order_; ///< Parents before children.
    std::vector<bool> isRoot_;         ///< Of the scene.
    std::vector<bool> inScene_;
    std::vector<bool> isJoint_;
    bool hasJoints_ = false;
};

} // namespace

Expected<ImportedSkeleton> parseGltfSkeleton(std::string bytes, std::string_view file, const ImportSettings& settings,
                                             const Limits& limits)
{
    if (bytes.size() > limits.fileBytes)
        return failure(ErrorKind::Limit, {std::string(file), 0, 0},
                       "the file has " + std::to_string(bytes.size()) + " bytes",
                       "at most " + std::to_string(limits.fileBytes) + " (the limit fileBytes)");
    auto json = jsonOf(std::move(bytes), {std::string(file), 0, 0});
    if (!json)
        return tl::make_unexpected(json.error());
    Limits jsonLimits = limits;
    jsonLimits.stringBytes = limits.fileBytes; // buffers may stand in the file as base64
    const auto document = JsonDocument::parse(std::move(*json), std::string(file), jsonLimits);
    if (!document)
        return tl::make_unexpected(document.error());
    const auto tree = GltfReader(*document, limits).read();
    if (!tree)
        return tl::make_unexpected(tree.error());
    return skeletonOf(*tree, settings, file, limits);
}

Expected<ImportedSkeleton> loadGltfSkeleton(const std::filesystem::path& path, const ImportSettings& settings,
                                            const Limits& limits)
{
    auto bytes = readFile(path, limits.fileBytes);
    if (!bytes)
        return tl::make_unexpected(bytes.error());
    return parseGltfSkeleton(std::move(*bytes), path.string(), settings, limits);
}

} // namespace espalier
