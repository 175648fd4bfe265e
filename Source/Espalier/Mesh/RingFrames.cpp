#include <Espalier/Mesh/RingFrames.h>
#include <cmath>

namespace espalier {

Vec3 anySideNormalTo(const Vec3& tangent) noexcept
{
    const Vec3 aside = std::abs(tangent.x) < 0.6f ? Vec3(1, 0, 0) : Vec3(0, 0, 1);
    return glm::normalize(glm::cross(tangent, aside));
}

} // namespace espalier
