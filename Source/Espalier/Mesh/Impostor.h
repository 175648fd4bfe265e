#pragma once

#include <Espalier/Core/Vector.h>
#include <array>
#include <cstdint>
#include <vector>

namespace espalier {

struct TreeMesh;

/// How the pictures of an impostor stand about the plant.
enum class ImpostorKind : std::uint8_t
{
    /// Four upright cards that cross where the trunk is, a picture for either side of each: a mesh that every reader
    /// shows. From high above it is a star.
    Cards,
    /// The plant from all sides above the horizon, side * side frames: a card that turns to the camera and shows the
    /// nearest of them. IMPOSTOR.md; Content/Shaders/impostor.vert and impostor.frag.
    Octahedral,
};

/// One picture of a plant: a rectangle through it, seen square on from infinitely far.
struct ImpostorFrame
{
    Vec3 middle{0};     ///< Metres, plant space.
    Vec3 toViewer{0};   ///< Unit, from the rectangle to whom the picture is for.
    Vec3 right{0};      ///< Unit.
    Vec3 up{0};         ///< Unit, cross(toViewer, right).
    Vec2 halfExtent{0}; ///< Metres along right and up: what the plant fills, and a margin of 1/32.
};

/// The pictures that stand for a plant from afar, before they are painted (Render/ImpostorAtlas.h).
struct Impostor
{
    ImpostorKind kind = ImpostorKind::Cards;
    std::uint32_t columns = 4; ///< Of frames in the atlas.
    std::uint32_t rows = 2;
    std::vector<ImpostorFrame> frames; ///< columns * rows, row by row from the top; none of an empty mesh.
    Vec3 centre{0};                    ///< Metres: of the ball that the plant fills.
    float radius = 0;                  ///< Metres.
};

/// Frames along one side of an octahedral atlas: with fewer, what is seen between two of them lies outside of both.
inline constexpr std::uint32_t kMinImpostorSide = 6;
inline constexpr std::uint32_t kMaxImpostorSide = 32;

/// The frames of an impostor. `side`, of an octahedral one, is clamped to [kMinImpostorSide, kMaxImpostorSide]. Cards
/// are as large as the plant is from their side, those of frames i and 4 + i back to back; octahedral frames as the
/// ball round it. Requires a sound mesh. Equal input gives equal results; safe to call concurrently.
[[nodiscard]] Impostor makeImpostor(const TreeMesh& full, ImpostorKind kind, std::uint32_t side = 8);

/// Metres: the level of detail that an impostor with an atlas of `texels` a side is. Of octahedral ones a texel. Cards
/// show sides that they were not made for: four texels, and never less than where the plant is 96 pixels high, however
/// fine they are painted.
[[nodiscard]] float impostorError(const Impostor& impostor, std::uint32_t texels) noexcept;

/// Appends the cards of an impostor to `mesh`, a Cards part: a rectangle a frame, one-sided, 16 triangles in all.
/// Sources, if the mesh has any, name no segment. Octahedral ones have no mesh: nothing is appended.
void meshCards(const Impostor& impostor, TreeMesh& mesh);

/// Where a direction lies in the square [0, 1] x [0, 1] of all that do not point down: the hemi-octahedral map (Cigolle
/// et al., "A Survey of Efficient Representations for Independent Unit Vectors", JCGT 3(2), 2014), +Y its middle. One
/// that points down is taken for the level one above it; straight down, and no direction at all, for the middle.
/// `direction` need not be unit.
[[nodiscard]] Vec2 hemiOctahedral(const Vec3& direction) noexcept;

/// The other way: a unit vector.
[[nodiscard]] Vec3 hemiDirection(const Vec2& square) noexcept;

/// The frames nearest to a direction, and how near each is.
struct FrameBlend
{
    std::array<std::uint32_t, 3> frames{};
    std::array<float, 3> shares{}; ///< Sum to 1.
};

/// The three frames round `toViewer`, from a side * side atlas. Requires side >= 2.
[[nodiscard]] FrameBlend framesFor(const Vec3& toViewer, std::uint32_t side) noexcept;

} // namespace espalier
