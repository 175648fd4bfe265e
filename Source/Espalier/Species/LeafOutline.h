#pragma once

#include <Espalier/Core/Vector.h>
#include <Espalier/Species/Appearance.h>
#include <cstdint>
#include <optional>
#include <vector>

namespace espalier {

/// Half the width of a leaf without its stalk at `along` its midrib, 0 at the foot and 1 at the tip: as a share of the
/// greatest, so in [0, 1]; 0 outside. Of a blossom: one petal. Textures, cut meshes and measured silhouettes all follow
/// this one description.
[[nodiscard]] float halfWidthOf(LeafShape shape, float along) noexcept;

/// One leaf on the surface that bears it. Lengths in the surface's length: x from the midline to the right, y from the
/// foot of the surface, 0, to its tip, 1.
struct LeafOnSurface
{
    Vec2 foot{0};
    Vec2 tip{0, 1};
    float halfWidth = 0.5f; ///< Greatest.
    float stalk = 0;        ///< Share of the way from foot to tip.
};

/// What a surface shows at one point.
struct SurfacePoint
{
    static constexpr std::uint32_t kShoot = 0xffffffffu;
    std::uint32_t leaf = 0; ///< Which one, the topmost; kShoot: the shoot of a spray, or the heart of a blossom.
    float along = 0;  ///< From the foot of its blade, 0, to its tip, 1; negative on its stalk. Outwards in a heart.
    float across = 0; ///< From the midrib to the right, in half widths there: [-1, 1].
};

/// The drawing on the surface of one kind of leaf. Of a ball it covers all; else: one that fills it, a spray of several
/// in two ranks with one at the end, or the five petals of a blossom. Immutable; use from any thread.
class LeafSurface
{
public:
    explicit LeafSurface(const LeafAppearance& leaf);

    /// What is seen at (u, v), both in [0, 1], u from left to right, v from foot to tip; nothing where it is cut out.
    [[nodiscard]] std::optional<SurfacePoint> at(Vec2 uv) const noexcept;

    /// Share of the surface that is not cut out, to about a percent.
    [[nodiscard]] float coverage() const noexcept;

    [[nodiscard]] const std::vector<LeafOnSurface>& leaves() const noexcept { return leaves_; }

private:
    LeafShape shape_;
    bool isBall_;
    float width_;
    float shootEnd_ = 0;   ///< Of a spray: where its last leaf begins.
    float shootWidth_ = 0; ///< Half of it, at its foot.
    std::vector<LeafOnSurface> leaves_;
};

} // namespace espalier
