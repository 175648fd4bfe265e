#pragma once

#include <Espalier/Core/Error.h>
#include <Espalier/Core/Vector.h>
#include <Espalier/Render/PaintedMaterial.h>
#include <cstdint>
#include <optional>
#include <vector>

struct RTCDeviceTy;
struct RTCFilterFunctionNArguments;
struct RTCHit;
struct RTCSceneTy;

namespace espalier {

struct Appearance;
struct RenderSubject;
struct AppearanceTextures;
struct TextureSizes;
struct TreeMesh;
enum class Backdrop : std::uint8_t;

/// Where the sun stands, which air and which ground lie about a tree.
struct Surroundings
{
    DVec3 toSun{0, 1, 0};    ///< Unit.
    double sunRadius = 0.03; ///< Angular, radians.
    DVec3 base{0};           ///< Where the tree stands on the ground; the ground is y = base.y.
    double size = 1;         ///< About the height of the tree, metres: how far away the ground melts into the haze.
    Backdrop backdrop{};     ///< On paper there is neither ground nor sun; the side towards the sun is the lighter one.
};

/// Random numbers of one light path, each in [0, 1).
struct LightSample
{
    Vec2 sun;
    Vec2 sky;
};

/// What a ray meets of a plant, unlit: as glTF's material has it.
struct Sight
{
    Vec3 colour{0};     ///< Linear: base colour times tint.
    Vec3 normal{0};     ///< Unit, to the side from which the ray comes.
    float distance = 0; ///< Metres from the origin.
    bool isOpen = true; ///< Whether the light that `sky` asks for reaches it.
};

/// Fails with BadInput if a tree cannot be drawn: its mesh is empty, not finite or inconsistent.
[[nodiscard]] Expected<void> checkSubject(const RenderSubject& subject);

/// The materials of a species, painted. Immutable; use for any number of scenes.
struct PaintBox
{
    explicit PaintBox(AppearanceTextures textures);

    PaintedMaterial bark;
    std::vector<PaintedMaterial> leaves; ///< By kind.
    std::vector<PaintedMaterial> cards;  ///< Pictures of the whole plant: one or none.
};

/// One tree before its backdrop, ready to be looked at. Immutable; `radiance` may be called from any
/// number of threads. The mesh and the paints must outlive it.
class PreviewScene
{
public:
    /// Requires a sound mesh with at least one triangle.
    PreviewScene(const TreeMesh& mesh, const Appearance& appearance, const PaintBox& paintBox,
                 const Surroundings& surroundings);
    ~PreviewScene();
    PreviewScene(PreviewScene&&) = delete;

    /// Linear light of blank paper.
    static Vec3 paperLight();

    /// False if Embree refused, for want of memory.
    [[nodiscard]] bool isReady() const noexcept { return ready_; }

    /// Linear light that arrives at `origin` from `direction` (unit). What of the plant is nearer than `nearest` metres
    /// is looked through.
    [[nodiscard]] Vec3 radiance(Vec3 origin, Vec3 direction, float nearest, const LightSample& sample) const;

    /// What `direction` (unit) meets of the plant, seen from `origin`; the ground is left out. `sky`, random in [0, 1),
    /// picks where light is to come from, by how much each direction counts.
    [[nodiscard]] std::optional<Sight> sight(Vec3 origin, Vec3 direction, Vec2 sky) const;

private:
    /// How a run of triangles is painted.
    enum class Finish : std::uint8_t
    {
        Bark,     ///< As its textures have it.
        Rind,     ///< The smooth skin of coloured wood: furrows are hinted at.
        TwoSided, ///< Petals and berries: no texture; light that comes from behind shines through.
        Leaf,     ///< Likewise, painted and cut out by textures.
    };
    struct Paint
    {
        std::uint32_t endTriangle;
        Vec3 colour;
        Finish finish;
        const PaintedMaterial* material; ///< None for what has no texture.
        float translucency;
        bool isOneSided = false; ///< From behind it is not there.
    };
    struct Surface;
    struct Facet;
    static void cutLeaves(const RTCFilterFunctionNArguments* arguments);
    void addGeometry(std::uint32_t firstTriangle, std::uint32_t endTriangle);
    [[nodiscard]] Facet facetAt(unsigned triangle, Vec2 hit) const;
    [[nodiscard]] const Paint& paintOf(std::uint32_t triangle) const;
    [[nodiscard]] Vec3 meanColour() const;
    void paintWood(const Paint& paint, const Facet& facet, Surface& surface) const;
    void paintLeaf(const Paint& paint, const Facet& facet, Surface& surface) const;
    [[nodiscard]] Vec3 leafLight(const Surface& surface, Vec3 toSun, Vec2 random) const;
    [[nodiscard]] Vec3 lightFrom(Vec3 start, Vec3 direction) const;
    [[nodiscard]] Surface surfaceAt(const RTCHit& hit, Vec3 direction) const;
    [[nodiscard]] bool isHidden(Vec3 origin, Vec3 direction) const;
    [[nodiscard]] Vec3 litColour(const Surface& surface, const LightSample& sample) const;
    [[nodiscard]] Vec3 skyLight(Vec3 direction) const;
    [[nodiscard]] Vec3 groundColour(Vec3 at) const;
    [[nodiscard]] float groundHaze(Vec3 at) const;

    const TreeMesh& mesh_;
    std::uint32_t firstLeafTriangle_ = 0; ///< From here on triangles are cut out by alpha.
    std::vector<Paint> paints_;           ///< In the order of their triangles; the last is for all that are left.
    Vec3 halfShade_;                      ///< Radiance of what a blocked sky ray meets.
    Vec3 toSun_;
    Vec3 sunRight_;
    Vec3 sunUp_;
    Vec3 base_;
    float size_;
    float sunSlope_; ///< Tangent of the sun's angular radius.
    float offset_;   ///< Metres by which rays leave a surface.
    RTCDeviceTy* device_ = nullptr;
    RTCSceneTy* scene_ = nullptr;
    bool onPaper_;
    bool ready_ = false;
};

} // namespace espalier
