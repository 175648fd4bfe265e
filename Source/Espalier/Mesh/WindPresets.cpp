#include <Espalier/Mesh/WindPresets.h>

#include <algorithm>
#include <cmath>

namespace espalier {
namespace {

/// The joint of an axis takes over within this share of it, but within no less than so many radii of its foot.
constexpr float kTakeover = 1.f / 6;
constexpr float kTakeoverRadii = 2;

/// Influences smaller than half of the smallest weight that can be written.
constexpr float kUnnoticed = 1.f / 512;

void fillGeneric(const WindVertices& wind, WindChannels& channels)
{
    for (std::vector<Vec2>& texcoord : channels.texcoords)
        texcoord.reserve(wind.vertices.size());
    for (const WindVertex& vertex : wind.vertices)
    {
        const auto level = static_cast<float>(std::min<std::uint16_t>(vertex.level, 15));
        channels.texcoords[0].emplace_back(vertex.trunkBend,
                                           static_cast<float>(vertex.boughFacing) + vertex.boughPhase);
        channels.texcoords[1].emplace_back(vertex.boughBend, vertex.flutter);
        channels.texcoords[2].emplace_back(vertex.boughPivot.x, vertex.boughPivot.y);
        channels.texcoords[3].emplace_back(vertex.boughPivot.z, level + static_cast<float>(vertex.leaf) * 0x1p-20f);
        channels.texcoords[4].emplace_back(vertex.twigBend, static_cast<float>(vertex.twigFacing) + vertex.twigPhase);
        channels.texcoords[5].emplace_back(vertex.twigPivot.x, vertex.twigPivot.y);
        channels.texcoords[6].emplace_back(vertex.twigPivot.z, vertex.edge);
    }
}

std::uint8_t byteOf(float share)
{
    return static_cast<std::uint8_t>(std::clamp(share, 0.f, 1.f) * 255 + 0.5f);
}

void fillCrytek(const WindVertices& wind, WindChannels& channels)
{
    channels.colours.reserve(wind.vertices.size());
    for (const WindVertex& vertex : wind.vertices)
    {
        const float still = (1 - vertex.boughBend) * (1 - 0.5f * vertex.twigBend);
        channels.colours.push_back({byteOf(vertex.edge), byteOf(vertex.boughPhase), byteOf(still), 255});
    }
}

std::uint32_t sideFor(std::size_t elements)
{
    std::uint32_t side = 1;
    while (std::size_t{side} * side < elements)
        side *= 2;
    return side;
}

void fillPivotPainter(const WindVertices& wind, WindChannels& channels)
{
    const std::uint32_t side = sideFor(wind.elements.size());
    const float texel = 1 / static_cast<float>(side);
    channels.texcoords[0].reserve(wind.vertices.size());
    for (const WindVertex& vertex : wind.vertices)
    {
        const std::uint32_t element = vertex.element == kNoElement ? 0 : vertex.element;
        channels.texcoords[0].emplace_back((static_cast<float>(element % side) + 0.5f) * texel,
                                           (static_cast<float>(element / side) + 0.5f) * texel);
    }
}

/// Joints for the elements of `wind`, and which joint each element has.
class Rigger
{
public:
    Rigger(const WindVertices& wind, std::uint32_t mostJoints, WindSkin& skin)
        : wind_(wind), most_(std::clamp<std::uint32_t>(mostJoints, 1, 65535)), skin_(skin)
    {}

    void rig()
    {
        choose();
        link();
        skin_.influences.reserve(wind_.vertices.size());
        for (const WindVertex& vertex : wind_.vertices)
            skin_.influences.push_back(influenceOf(vertex));
    }

private:
    void choose()
    {
        std::vector<std::uint32_t> order;
        std::uint32_t trunk = kNoElement;
        for (std::uint32_t i = 0; i < wind_.elements.size(); ++i)
        {
            if (wind_.elements[i].level == 0)
                trunk = i;
            else
                order.push_back(i);
        }
        const auto size = [&](std::uint32_t i) { return wind_.elements[i].extent * wind_.elements[i].radius; };
        std::sort(order.begin(), order.end(),
                  [&](std::uint32_t a, std::uint32_t b) { return size(a) != size(b) ? size(a) > size(b) : a < b; });
        order.resize(std::min<std::size_t>(order.size(), most_ - 1));
        std::sort(order.begin(), order.end()); // elements have parents before children
        jointOf_.assign(wind_.elements.size(), kNoElement);
        skin_.joints.push_back({.element = trunk});
        if (trunk != kNoElement)
            jointOf_[trunk] = 0;
        for (const std::uint32_t element : order)
        {
            jointOf_[element] = static_cast<std::uint32_t>(skin_.joints.size());
            skin_.joints.push_back({.element = element});
        }
    }

    void link()
    {
        for (WindJoint& joint : skin_.joints)
        {
            if (joint.element == kNoElement)
                continue; // a plant without axes
            joint.position = wind_.elements[joint.element].pivot;
            joint.translation = joint.position;
            if (&joint == &skin_.joints[0])
                continue;
            std::uint32_t ancestor = wind_.elements[joint.element].parent;
            while (ancestor != kNoElement && jointOf_[ancestor] == kNoElement)
                ancestor = wind_.elements[ancestor].parent;
            joint.parent = ancestor == kNoElement ? 0 : jointOf_[ancestor];
            joint.translation = joint.position - skin_.joints[joint.parent].position;
        }
    }

    /// How far the joint of an element has taken over, so far along it. [0, 1]
    [[nodiscard]] static float takeover(const WindElement& element, float along)
    {
        if (element.level == 0)
            return 1;
        const float length =
            std::min(std::max(kTakeover * element.extent, kTakeoverRadii * element.radius), 0.5f * element.extent);
        const float t = length > 0 ? std::clamp(along / length, 0.f, 1.f) : 0.f;
        return t * t * (3 - 2 * t);
    }

    [[nodiscard]] WindInfluence influenceOf(const WindVertex& vertex) const
    {
        std::array<std::uint32_t, 4> joints{};
        std::array<float, 4> shares{};
        std::size_t count = 0;
        float rest = 1;
        float along = vertex.along;
        for (std::uint32_t i = vertex.element; i != kNoElement && rest > kUnnoticed && count < 3;)
        {
            const WindElement& element = wind_.elements[i];
            if (jointOf_[i] != kNoElement)
            {
                const float share = rest * takeover(element, along);
                if (share > kUnnoticed)
                {
                    joints[count] = jointOf_[i];
                    shares[count++] = share;
                    rest -= share;
                }
            }
            along = element.parentAlong;
            i = element.parent;
        }
        if (rest > 0)
            addRest(rest, joints, shares, count);
        return quantized(joints, shares);
    }

    /// What no joint has taken goes to the nearest one whose axis carries those that have.
    void addRest(float rest, std::array<std::uint32_t, 4>& joints, std::array<float, 4>& shares,
                 std::size_t count) const
    {
        std::uint32_t heir = 0;
        if (count > 0)
            heir = rest > kUnnoticed ? skin_.joints[joints[count - 1]].parent : joints[count - 1];
        if (heir == kNoElement)
            heir = 0;
        for (std::size_t i = 0; i < count; ++i)
            if (joints[i] == heir)
            {
                shares[i] += rest;
                return;
            }
        joints[count] = heir;
        shares[count] = rest;
    }

    /// The largest remainders are rounded up until the sum is 255.
    [[nodiscard]] static WindInfluence quantized(std::array<std::uint32_t, 4> joints, std::array<float, 4> shares)
    {
        std::array<std::uint32_t, 4> bytes{};
        std::array<float, 4> remainders{};
        std::uint32_t sum = 0;
        for (std::size_t i = 0; i < 4; ++i)
        {
            bytes[i] = static_cast<std::uint32_t>(std::clamp(shares[i], 0.f, 1.f) * 255);
            remainders[i] = shares[i] * 255 - static_cast<float>(bytes[i]);
            sum += bytes[i];
        }
        for (; sum < 255; ++sum)
        {
            const auto largest =
                static_cast<std::size_t>(std::max_element(remainders.begin(), remainders.end()) - remainders.begin());
            ++bytes[largest];
            remainders[largest] -= 1;
        }
        WindInfluence influence;
        for (std::size_t slot = 0; slot < 4; ++slot)
        {
            const auto largest = static_cast<std::size_t>(std::max_element(bytes.begin(), bytes.end()) - bytes.begin());
            if (bytes[largest] == 0)
                break;
            influence.joints[slot] = static_cast<std::uint16_t>(joints[largest]);
            influence.weights[slot] = static_cast<std::uint8_t>(bytes[largest]);
            bytes[largest] = 0;
        }
        return influence;
    }

    const WindVertices& wind_;
    std::uint32_t most_;
    WindSkin& skin_;
    std::vector<std::uint32_t> jointOf_; ///< Of each element.
};

} // namespace

void fillWindChannels(WindPreset preset, const WindVertices& wind, WindChannels& channels)
{
    for (std::vector<Vec2>& texcoord : channels.texcoords)
        texcoord.clear();
    channels.colours.clear();
    switch (preset)
    {
    case WindPreset::Generic:
        return fillGeneric(wind, channels);
    case WindPreset::Crytek:
        return fillCrytek(wind, channels);
    case WindPreset::PivotPainter:
        return fillPivotPainter(wind, channels);
    case WindPreset::Bones:
        return;
    }
}

PivotTable pivotTable(const WindVertices& wind)
{
    PivotTable table;
    table.side = sideFor(wind.elements.size());
    const std::size_t texels = std::size_t{table.side} * table.side;
    table.pivots.assign(texels, Vec4(0));
    table.directions.assign(texels, Vec4(0));
    table.levels.assign(texels, Vec4(0));
    for (std::size_t i = 0; i < wind.elements.size(); ++i)
    {
        const WindElement& element = wind.elements[i];
        const auto parent = element.parent == kNoElement ? static_cast<float>(i) : static_cast<float>(element.parent);
        table.pivots[i] = Vec4(element.pivot, parent);
        table.directions[i] = Vec4(element.direction, element.extent);
        table.levels[i] = Vec4(static_cast<float>(element.level), element.phase, element.radius, 0);
    }
    return table;
}

WindSkin windSkin(const WindVertices& wind, std::uint32_t mostJoints)
{
    WindSkin skin;
    Rigger(wind, mostJoints, skin).rig();
    return skin;
}

} // namespace espalier
