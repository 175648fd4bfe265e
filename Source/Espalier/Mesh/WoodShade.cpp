#include <Espalier/Mesh/WoodShade.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

// Most rings are thin: all their vertices lie in one small part of a cube, whose light is looked up but once.

namespace espalier {
namespace {

/// Parts of a cube's edge in which the light is taken for one: the steps between them are too small to be seen.
constexpr float kParts = 4;

/// Below the crown all of the light is back this far down, in half widths of the crown: it comes in from the sides.
constexpr float kUnderCrown = 0.75f;

std::uint8_t dimmed(std::uint8_t component, float factor)
{
    return static_cast<std::uint8_t>(static_cast<float>(component) * factor + 0.5f);
}

} // namespace

void shadeWood(const FoliageLight& light, float shade, std::size_t first, std::size_t end, TreeMesh& mesh)
{
    if (light.light.empty() || !(shade > 0) || mesh.tints.size() < mesh.positions.size())
        return;
    const float part = light.edge / kParts;
    const auto width = static_cast<float>(std::max(light.count[0], light.count[2]));
    const float under = kUnderCrown * 0.5f * width * light.edge;
    constexpr float kFarthest = 1e6f; // parts: far out of any crown
    std::array<std::int32_t, 3> last{};
    float factor = 1;
    bool isFirst = true;
    for (std::size_t i = first; i < end; ++i)
    {
        const Vec3 at = (mesh.positions[i] - light.low) / part;
        std::array<std::int32_t, 3> here{};
        for (int axis = 0; axis < 3; ++axis)
            here[static_cast<std::size_t>(axis)] =
                static_cast<std::int32_t>(std::floor(std::clamp(at[axis], -kFarthest, kFarthest)));
        if (isFirst || here != last)
        {
            const Vec3 middle(static_cast<float>(here[0]) + 0.5f, static_cast<float>(here[1]) + 0.5f,
                              static_cast<float>(here[2]) + 0.5f);
            const float inside = light.at(light.low + part * middle).light;
            const float down = under > 0 ? std::clamp(-middle.y * part / under, 0.f, 1.f) : 1;
            factor = 1 - std::min(shade, 1.f) * (1 - inside) * (1 - down);
            last = here;
            isFirst = false;
        }
        Tint& tint = mesh.tints[i];
        tint = {dimmed(tint.red, factor), dimmed(tint.green, factor), dimmed(tint.blue, factor), tint.alpha};
    }
}

} // namespace espalier
