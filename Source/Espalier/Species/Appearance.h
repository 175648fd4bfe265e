#pragma once

#include <Espalier/Core/Vector.h>
#include <Espalier/Plant/Axes.h>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace espalier {

/// How the surface of old wood is built.
enum class BarkKind : std::uint8_t
{
    Furrowed, ///< Long ridges between furrows, cracked into plates: oak, willow.
    Papery,   ///< Smooth and pale, with dark lenticels across and black scars: birch.
    Scaly,    ///< Small flakes with raised rims: spruce.
    Ringed,   ///< Scars of fallen leaves, one above the other: palm.
    Smooth,   ///< Hardly any relief: beech.
};

/// The most that a tile of bark may be higher than wide.
inline constexpr std::uint32_t kMaxTileHeight = 4;

inline constexpr std::uint32_t kMaxRootLobes = 6;

/// The skin of a species' wood. Colours are linear RGB in [0, 1].
struct BarkAppearance
{
    Vec3 colour{0.185f, 0.148f, 0.115f}; ///< Mean of the bark.
    float roughness = 0.9f;              ///< Mean. [0, 1], as in glTF; see usualRoughness.
    float tile = 0.6f;            ///< Metres of bark round the wood that one repeat of the texture shows. [0.001, 100]
    std::uint32_t tileHeight = 4; ///< How many times as much it shows along the wood: 1, 2 or 4 (3 is as 2). 1 for
                                  ///< square textures of one's own.
    BarkKind kind = BarkKind::Furrowed;
    float relief = 0.02f; ///< Metres between the deepest furrow and the highest ridge. [0, 0.5]
    /// What young wood is tinted by, on top of the bark's colour. White: twigs look like the trunk. [0, 1] each
    Vec3 youngTint{1};
    float youngRadius = 0; ///< Metres: the tint is whole on wood this thin, gone on wood three times as thick. [0, 10]
    float shade = 0.45f;   ///< How much darker wood is where the crown lets no light through. [0, 1]

    // How a trunk runs out into its roots.
    float rootFlare = 0.5f;      ///< How much wider it is at the ground, in its radii. [0, 4]
    float rootLength = 5;        ///< Over what height that fades, in its radii. [0, 20]
    std::uint32_t rootLobes = 5; ///< Buttresses round it; fewer than 3: it is round. [0, kMaxRootLobes]
    float rootDepth = 1;         ///< How far they stand out and hollows lie back, as a share of the flare. [0, 2]

    friend bool operator==(const BarkAppearance&, const BarkAppearance&) = default;
};

/// BarkAppearance::tileHeight as it is meant: a power of two, whatever is written there.
[[nodiscard]] constexpr std::uint32_t tileHeightOf(const BarkAppearance& bark) noexcept
{
    return bark.tileHeight >= 4 ? 4 : bark.tileHeight >= 2 ? 2 : 1;
}

/// What a file's bark has that does not say it: birches shine like satin, beeches and other young skin a little, cork
/// and scales not at all.
[[nodiscard]] constexpr float usualRoughness(BarkKind kind) noexcept
{
    return kind == BarkKind::Papery ? 0.5f : kind == BarkKind::Smooth ? 0.65f : kind == BarkKind::Ringed ? 0.85f : 0.9f;
}

/// Outlines of leaves; see LeafOutline.h.
enum class LeafShape : std::uint8_t
{
    Ovate,      ///< Widest below the middle, pointed: beech, and what most people draw.
    Lobed,      ///< Round lobes on either side, widest above the middle: oak.
    Lanceolate, ///< Long and narrow: willow.
    Deltoid,    ///< A triangle with a toothed edge: birch.
    Linear,     ///< A strip with a point: leaflets of palms, grasses.
    Needle,     ///< Thin and stiff: conifers.
    Blossom,    ///< Five petals seen from above.
};

/// How leaves stand round a shoot.
enum class LeafArrangement : std::uint8_t
{
    Spiral,    ///< One a node, turned by the golden angle: oak.
    Alternate, ///< One a node, left and right by turns: the two ranks of a frond or a beech twig.
    Opposite,  ///< Two a node, each pair across the one before: maple.
    Whorled,   ///< `perNode` at each node.
};

/// What one leaf is made of.
enum class LeafForm : std::uint8_t
{
    Blade,   ///< One surface, folded along the midrib and arched.
    Crossed, ///< Two flat surfaces that cross along the midrib: sprays that are seen from all sides.
    Ball,    ///< A fruit or bud: a small sphere.
};

/// A kind of leaf, needle, flower or fruit and where it grows. Colours are linear RGB in [0, 1].
struct LeafAppearance
{
    // Where.
    float thickestWood = 0.01f; ///< Metres: it grows on wood of at most this radius. (0, 10]
    float spacing = 0.04f;      ///< Metres between nodes along a shoot. [0.001, 100]
    LeafArrangement arrangement = LeafArrangement::Spiral;
    std::uint32_t perNode = 1; ///< Of a whorl. [1, 16]
    bool atTip = true;         ///< One more ends the shoot.
    float density = 1;         ///< Share of places that bear one. [0, 1]
    float shade = 0.5f;        ///< How much of that is lost where the crown lets no light through. [0, 1]

    // Its bearing.
    float angle = 0.9f;       ///< Radians between shoot and leaf. [0, pi]
    float angleSpread = 0.2f; ///< Radians; largest deviation. [0, pi]
    float droop = 0.2f;       ///< How far its tip sinks: 0 not at all, 1 it hangs. [0, 1]
    float facing = 0.5f;      ///< How far its face turns towards the sky. [0, 1]

    // Its form.
    LeafShape shape = LeafShape::Ovate;
    LeafForm form = LeafForm::Blade;
    float length = 0.1f;        ///< Metres, stalk included. [0.001, 20]
    float lengthSpread = 0.25f; ///< Share by which lengths vary. [0, 1]
    float taper = 0;     ///< How much shorter leaves are at the ends of their shoot: 0 not, 1 down to nothing. [0, 1]
    float width = 0.55f; ///< In lengths. [0.01, 4]
    float stalk = 0.12f; ///< In lengths. [0, 0.9]
    float fold = 0.3f;   ///< Radians by which each half rises along the midrib. [0, 1.2]
    float arch = 0.06f;  ///< How high the midrib rises between its ends, in lengths. [-0.4, 0.4]
    std::uint32_t leaves = 1; ///< Drawn on one surface; more than one make it a spray along its midrib. [1, 64]

    // Its look.
    Vec3 colour{0.150f, 0.245f, 0.062f};
    float colourSpread = 0.2f; ///< Share by which leaves are darker than this. [0, 1]
    float translucency = 0.4f; ///< Share of the light that falls on one side and leaves on the other. [0, 1]
    float roughness = 0.6f;    ///< [0, 1], as in glTF.
    float crownNormals = 0.6f; ///< How far normals are bent outwards from the crown: soft shading. [0, 1]

    friend bool operator==(const LeafAppearance&, const LeafAppearance&) = default;
};

/// Kinds of leaves of one species.
inline constexpr std::size_t kMaxLeafKinds = 8;

/// What a season does to the leaves of one kind.
struct SeasonalLeaves
{
    Vec3 colour{0}; ///< In place of the leaf's.
    float colourSpread = 0.2f;
    float density = 1; ///< Times the leaf's: 0 bare. [0, 1]

    friend bool operator==(const SeasonalLeaves&, const SeasonalLeaves&) = default;
};

/// A time of the year in which the species looks different.
struct Season
{
    std::string name;                   ///< "autumn"; unique, not empty.
    std::vector<SeasonalLeaves> leaves; ///< By kind; kinds beyond look as always.

    friend bool operator==(const Season&, const Season&) = default;
};

inline constexpr std::size_t kMaxSeasons = 16;

/// Entries of a palette; a skeleton's materials beyond share the last.
inline constexpr std::size_t kMaxPalette = 64;

/// The colours of a species that names none: 0 fresh leaf, 1 green, 2 yellow green, 3 blossom, 4 warm yellow, 5 berry
/// red, 6 violet blue, 7 withered leaf.
[[nodiscard]] std::vector<Vec3> defaultPalette();

/// Names of an artist's own pictures of one material, PNG files, in place of generated ones: relative to the folder of
/// the file that names them, and inside it. Without a colour all of the material is generated.
struct ImageNames
{
    std::string colour;    ///< sRGB; of leaves with alpha, which cuts them out.
    std::string normal;    ///< Tangent space, green towards the tip. None: flat.
    std::string roughness; ///< As in glTF: red occlusion, green roughness, blue metal. None: the material's roughness.

    friend bool operator==(const ImageNames&, const ImageNames&) = default;
};

/// How a species answers the wind.
struct WindAppearance
{
    float trunk = 1;   ///< How far the whole tree leans, as a share of what a tree of this height usually does. [0, 10]
    float boughs = 1;  ///< Likewise each bough about its own foot. [0, 10]
    float flutter = 1; ///< Likewise leaves. [0, 10]

    friend bool operator==(const WindAppearance&, const WindAppearance&) = default;
};

/// What a species looks like beyond its skeleton.
struct Appearance
{
    PipeModel pipes;
    BarkAppearance bark;
    std::vector<LeafAppearance> leaves; ///< At most kMaxLeafKinds; none: a winter tree.
    std::vector<Season> seasons;        ///< At most kMaxSeasons.
    WindAppearance wind;
    /// Linear RGB in [0, 1], by the material index of what the skeleton draws (the turtle's '); indices beyond take the
    /// last entry. Wood of index 0 has the bark's colour, so entry 0 is that of leaves. [1, kMaxPalette] entries
    std::vector<Vec3> palette = defaultPalette();
    std::vector<ImageNames> images; ///< Of bark first, then by kind of leaf; those beyond are generated.

    friend bool operator==(const Appearance&, const Appearance&) = default;
};

/// The appearance in one of its seasons; as it is if `season` is empty. Requires: empty, or the name of one of them.
[[nodiscard]] Appearance inSeason(const Appearance& appearance, std::string_view season);

} // namespace espalier
