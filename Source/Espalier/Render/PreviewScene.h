#pragma once

#include <Espalier/Core/Vector.h>

struct RTCDeviceTy;
struct RTCSceneTy;

namespace espalier {

struct BarkAppearance;
struct TreeMesh;

/// Where the sun stands, which air and which ground lie about a tree.
struct Surroundings
{
    DVec3 toSun{0, 1, 0};    ///< Unit.
    double sunRadius = 0.03; ///< Angular, radians.
    DVec3 base{0};           ///< Where the tree stands on the ground; the ground is y = base.y.
    double size = 1;         ///< About the height of the tree, metres: how far away the ground melts into the haze.
};

/// Random numbers of one light path, each in [0, 1).
struct LightSample
{
    Vec2 sun;
    Vec2 sky;
};

/// One tree on open ground under a clear sky, ready to be looked at. Immutable; `radiance` may be called from any
/// number of threads. Mesh and bark must outlive it.
class PreviewScene
{
public:
    /// Requires a sound mesh with at least one triangle.
    PreviewScene(const TreeMesh& mesh, const BarkAppearance& bark, const Surroundings& surroundings);
    ~PreviewScene();
    PreviewScene(PreviewScene&&) = delete;

    /// False if Embree refused, for want of memory.
    [[nodiscard]] bool isReady() const noexcept { return ready_; }

    /// Linear light that arrives at `origin` from `direction` (unit).
    [[nodiscard]] Vec3 radiance(Vec3 origin, Vec3 direction, const LightSample& sample) const;

private:
    struct Surface;
    [[nodiscard]] Surface surfaceAt(unsigned triangle, float u, float v, Vec3 faceNormal, Vec3 direction) const;
    [[nodiscard]] bool isHidden(Vec3 origin, Vec3 direction) const;
    [[nodiscard]] Vec3 litColour(const Surface& surface, const LightSample& sample) const;
    [[nodiscard]] Vec3 skyLight(Vec3 direction) const;
    [[nodiscard]] Vec3 groundColour(Vec3 at) const;
    [[nodiscard]] float groundHaze(Vec3 at) const;

    const TreeMesh& mesh_;
    const BarkAppearance& bark_;
    Vec3 toSun_;
    Vec3 sunRight_;
    Vec3 sunUp_;
    Vec3 base_;
    float size_;
    float sunSlope_; ///< Tangent of the sun's angular radius.
    float offset_;   ///< Metres by which rays leave a surface.
    RTCDeviceTy* device_ = nullptr;
    RTCSceneTy* scene_ = nullptr;
    bool ready_ = false;
};

} // namespace espalier
