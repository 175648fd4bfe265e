#pragma once

#include <Espalier/Core/Vector.h>
#include <Espalier/Mesh/Wind.h>
#include <array>
#include <cstdint>
#include <vector>

namespace espalier {

// Wind data as engines read it. WIND.md says what each number means; all are functions of WindVertices.

/// Who reads the wind data of a file.
enum class WindPreset : std::uint8_t
{
    Generic,      ///< Content/Shaders/wind.vert: TEXCOORD_1 to TEXCOORD_7, or to TEXCOORD_4 without twigs.
    Crytek,       ///< Vertex colours: edge stiffness, phase, stiffness.
    PivotPainter, ///< TEXCOORD_1 looks up the vertex' element in a table (pivotTable).
    Bones,        ///< A skin (windSkin); no attribute beyond its joints and weights.
};

/// What a preset adds to the vertices of a mesh; each array is empty or one entry a vertex.
struct WindChannels
{
    std::array<std::vector<Vec2>, 7> texcoords; ///< [k] is TEXCOORD_(k + 1).
    std::vector<Tint> colours;                  ///< COLOR_0, not a tint: only for engines that read it as wind.

    friend bool operator==(const WindChannels&, const WindChannels&) = default;
};

void fillWindChannels(WindPreset preset, const WindVertices& wind, WindChannels& channels);

/// The elements of a plant as square textures, row by row from the top: element i is texel (i % side, i / side).
struct PivotTable
{
    std::uint32_t side = 1;       ///< A power of two, at most 8192.
    std::vector<Vec4> pivots;     ///< xyz where it begins, metres; w the number of its parent, a root's own.
    std::vector<Vec4> directions; ///< xyz unit, from there to its farthest place; w how far that is, metres.
    std::vector<Vec4> levels;     ///< Level, phase in [0, 1), radius in metres, 0.

    friend bool operator==(const PivotTable&, const PivotTable&) = default;
};

/// Texels beyond the elements are 0. A plant without axes has one that stands still.
[[nodiscard]] PivotTable pivotTable(const WindVertices& wind);

/// A joint of a plant's skin: it turns an axis about its foot.
struct WindJoint
{
    std::uint32_t parent = kNoElement;  ///< Lower than the own number; kNoElement of the first only.
    std::uint32_t element = kNoElement; ///< Of WindVertices::elements.
    Vec3 position{0};                   ///< Of its bind pose, metres, in plant space: not turned, not scaled.
    Vec3 translation{0};                ///< From its parent's position to its own: the node's translation in glTF.
};

/// Weights of a vertex, in 255ths: they sum to 255.
struct WindInfluence
{
    std::array<std::uint16_t, 4> joints{}; ///< Those without weight are 0.
    std::array<std::uint8_t, 4> weights{}; ///< Descending.

    friend bool operator==(const WindInfluence&, const WindInfluence&) = default;
};

/// Bones for a plant. Bind poses only translate, so the inverse bind matrix of a joint is the translation by its
/// negative position.
struct WindSkin
{
    std::vector<WindJoint> joints;         ///< Parents before children; the first is the trunk's.
    std::vector<WindInfluence> influences; ///< One a vertex.
};

/// A skin of at most `mostJoints` joints, at least one: the trunk's, then those of the largest axes (extent times
/// radius). Thinner axes follow their nearest ancestor that has a joint. At its foot a branch hangs on the joints of
/// its parent; its own takes over along the first sixth of it, so nothing cracks. mostJoints: [1, 65535]
[[nodiscard]] WindSkin windSkin(const WindVertices& wind, std::uint32_t mostJoints = 64);

} // namespace espalier
