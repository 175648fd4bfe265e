#include <Espalier/Render/PreviewScene.h>

#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Mesh/TreeMesh.h>
#include <Espalier/Render/Bark.h>
#include <Espalier/Species/Appearance.h>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <embree3/rtcore.h>
#include <limits>

namespace espalier {

namespace {

constexpr float kPi = 3.14159265f;

// Linear light. The sun gives a level white sheet about four times what the sky gives: a clear day with thin haze.
constexpr Vec3 kSun{5.6f, 4.95f, 4.05f};        ///< Irradiance on a sheet that faces it.
constexpr Vec3 kZenith{0.16f, 0.34f, 0.68f};    ///< Radiance overhead.
constexpr Vec3 kHorizon{0.76f, 0.85f, 0.93f};   ///< Radiance of the haze.
constexpr Vec3 kGlow{0.30f, 0.22f, 0.12f};      ///< Radiance added in the sun's direction.
constexpr Vec3 kMeadow{0.115f, 0.150f, 0.062f}; ///< Albedo.
constexpr Vec3 kEarth{0.205f, 0.182f, 0.122f};

/// Radiance of what a blocked sky ray meets, per unit of its albedo: mostly wood in half shade.
constexpr Vec3 kHalfShade{0.50f, 0.50f, 0.48f};

Vec3 mix(Vec3 a, Vec3 b, float t)
{
    return a + (b - a) * t;
}

/// Two unit vectors that complete `axis` to an orthonormal frame (Duff et al. 2017).
void completeFrame(Vec3 axis, Vec3& first, Vec3& second)
{
    const float sign = std::copysign(1.0f, axis.z);
    const float a = -1.0f / (sign + axis.z);
    const float b = axis.x * axis.y * a;
    first = {1.0f + sign * axis.x * axis.x * a, sign * b, -sign * axis.x};
    second = {b, sign + axis.y * axis.y * a, -axis.y};
}

/// A point of the unit disc, area-preserving.
Vec2 onDisc(Vec2 random)
{
    const float radius = std::sqrt(random.x);
    const auto [sin, cos] = math::sinCos(2 * math::kPi * static_cast<double>(random.y));
    return {radius * static_cast<float>(cos), radius * static_cast<float>(sin)};
}

Vec3 cosineDirection(Vec3 normal, Vec2 random)
{
    Vec3 right;
    Vec3 up;
    completeFrame(normal, right, up);
    const Vec2 disc = onDisc(random);
    return disc.x * right + disc.y * up + std::sqrt(std::max(0.0f, 1 - random.x)) * normal;
}

RTCRay makeRay(Vec3 origin, Vec3 direction)
{
    RTCRay ray{};
    ray.org_x = origin.x;
    ray.org_y = origin.y;
    ray.org_z = origin.z;
    ray.dir_x = direction.x;
    ray.dir_y = direction.y;
    ray.dir_z = direction.z;
    ray.tfar = std::numeric_limits<float>::infinity();
    ray.mask = 0xffffffffu;
    return ray;
}

} // namespace

/// What light meets: a point of bark or ground.
struct PreviewScene::Surface
{
    Vec3 start;      ///< Where rays to the lights begin: clear of the surface.
    Vec3 normal;     ///< Of the smooth, furrowed surface; unit.
    Vec3 faceNormal; ///< Of the flat triangle; unit.
    Vec3 albedo;
};

PreviewScene::PreviewScene(const TreeMesh& mesh, const BarkAppearance& bark, const Surroundings& surroundings)
    : mesh_(mesh), bark_(bark), toSun_(surroundings.toSun), base_(surroundings.base),
      size_(static_cast<float>(surroundings.size)), sunSlope_(static_cast<float>(math::tan(surroundings.sunRadius)))
{
    completeFrame(toSun_, sunRight_, sunUp_);
    float largest = size_;
    for (const Vec3 p : mesh.positions)
        largest = std::max({largest, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
    offset_ = 1e-5f * largest;

    // One building thread: Embree's parallel builder orders triangles by the number of threads, and with them which of
    // two that touch answers first.
    device_ = rtcNewDevice("threads=1");
    if (!device_)
        return;
    scene_ = rtcNewScene(device_);
    rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_ROBUST); // no light between neighbouring triangles
    const RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    void* vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Vec3),
                                             mesh.positions.size());
    void* indices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                            3 * sizeof(std::uint32_t), mesh.indices.size() / 3);
    if (vertices && indices)
    {
        std::memcpy(vertices, mesh.positions.data(), mesh.positions.size() * sizeof(Vec3));
        std::memcpy(indices, mesh.indices.data(), mesh.indices.size() * sizeof(std::uint32_t));
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(scene_, geometry);
        rtcCommitScene(scene_);
        ready_ = rtcGetDeviceError(device_) == RTC_ERROR_NONE;
    }
    rtcReleaseGeometry(geometry);
}

PreviewScene::~PreviewScene()
{
    if (scene_)
        rtcReleaseScene(scene_);
    if (device_)
        rtcReleaseDevice(device_);
}

Vec3 PreviewScene::radiance(Vec3 origin, Vec3 direction, const LightSample& sample) const
{
    RTCRayHit query{};
    query.ray = makeRay(origin, direction);
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    rtcIntersect1(scene_, &context, &query);

    // The ground is seen from above only: from below it would hide the tree.
    const bool meetsGround = direction.y < 0 && origin.y > base_.y;
    const float toGround = meetsGround ? (base_.y - origin.y) / direction.y : std::numeric_limits<float>::infinity();
    if (query.hit.geomID != RTC_INVALID_GEOMETRY_ID && query.ray.tfar < toGround)
    {
        const Vec3 faceNormal{query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z};
        return litColour(surfaceAt(query.hit.primID, query.hit.u, query.hit.v, faceNormal, direction), sample);
    }
    if (!meetsGround)
        return skyLight(direction);

    const Vec3 at = origin + toGround * direction;
    const float haze = groundHaze(at);
    constexpr float kNoGroundLeft = 0.999f;
    if (!(haze < kNoGroundLeft))
        return kHorizon;
    constexpr Vec3 kUp{0, 1, 0};
    const Surface surface{at + Vec3(0, offset_, 0), kUp, kUp, groundColour(at)};
    return mix(litColour(surface, sample), kHorizon, haze);
}

PreviewScene::Surface PreviewScene::surfaceAt(unsigned triangle, float u, float v, Vec3 faceNormal,
                                              Vec3 direction) const
{
    const std::uint32_t* corner = mesh_.indices.data() + std::size_t{3} * triangle;
    const Vec3 p0 = mesh_.positions[corner[0]];
    const Vec3 p1 = mesh_.positions[corner[1]];
    const Vec3 p2 = mesh_.positions[corner[2]];
    const Vec3 n0 = mesh_.normals[corner[0]];
    const Vec3 n1 = mesh_.normals[corner[1]];
    const Vec3 n2 = mesh_.normals[corner[2]];
    const Vec2 t0 = mesh_.uvs[corner[0]];
    const Vec2 t1 = mesh_.uvs[corner[1]] - t0;
    const Vec2 t2 = mesh_.uvs[corner[2]] - t0;
    const float w = 1 - u - v;
    const Vec3 at = w * p0 + u * p1 + v * p2;
    Vec3 normal = w * n0 + u * n1 + v * n2;
    const float normalLength = glm::length(normal);
    faceNormal = glm::normalize(faceNormal);
    normal = normalLength > 0 ? normal / normalLength : faceNormal;

    Surface surface;
    // Facets of a tube that is really round would shadow themselves in steps where the light grazes. So rays begin on
    // the curved surface that the normals promise (Hanika, "Hacking the Shadow Terminator", 2021).
    const auto bulge = [&](Vec3 p, Vec3 n) { return -std::min(0.0f, glm::dot(at - p, n)) * n; };
    surface.start = at + w * bulge(p0, n0) + u * bulge(p1, n1) + v * bulge(p2, n2);

    // How the texture lies on this triangle: metres per repeat, and the directions of u and v.
    float shade = 1;
    Vec3 furrowed = normal;
    const float area = t1.x * t2.y - t2.x * t1.y;
    if (std::abs(area) > std::numeric_limits<float>::min())
    {
        const Vec3 alongU = ((p1 - p0) * t2.y - (p2 - p0) * t1.y) / area;
        const Vec3 alongV = ((p2 - p0) * t1.x - (p1 - p0) * t2.x) / area;
        const Vec2 metresPerRepeat(glm::length(alongU), glm::length(alongV));
        if (metresPerRepeat.x > 0 && metresPerRepeat.y > 0)
        {
            const BarkRelief relief = barkRelief(t0 + u * t1 + v * t2, metresPerRepeat);
            shade = relief.shade;
            furrowed -= relief.slope.x / metresPerRepeat.x * alongU + relief.slope.y / metresPerRepeat.y * alongV;
            furrowed = glm::normalize(furrowed);
        }
    }
    // Patches of weather and lichen, larger than any repeat of the texture, hide that it repeats.
    const float patch = smoothNoise({at.x * 2.3f + at.z * 0.9f, at.y * 1.4f - at.z * 1.1f}, 4096);
    surface.albedo = glm::clamp(bark_.colour * shade * (0.86f + 0.28f * patch), Vec3(0), Vec3(0.95f));

    const float facing = glm::dot(faceNormal, normal) < 0 ? -1.0f : 1.0f; // winding does not matter here
    surface.faceNormal = facing * faceNormal;
    surface.normal = furrowed;
    if (glm::dot(surface.faceNormal, direction) > 0) // the inside of an open tube
    {
        surface.faceNormal = -surface.faceNormal;
        surface.normal = -surface.normal;
        surface.start = at;
    }
    surface.start += offset_ * surface.faceNormal;
    return surface;
}

bool PreviewScene::isHidden(Vec3 origin, Vec3 direction) const
{
    RTCRay ray = makeRay(origin, direction);
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcOccluded1(scene_, &context, &ray);
    return ray.tfar < 0;
}

Vec3 PreviewScene::litColour(const Surface& surface, const LightSample& sample) const
{
    Vec3 light(0); // what the surface reflects of it, per unit of albedo

    const Vec2 disc = sunSlope_ * onDisc(sample.sun);
    const Vec3 toSun = glm::normalize(toSun_ + disc.x * sunRight_ + disc.y * sunUp_);
    const float sunCosine = glm::dot(surface.normal, toSun);
    if (sunCosine > 0 && toSun.y > 0 && !isHidden(surface.start, toSun))
        light += kSun * (sunCosine / kPi);

    Vec3 toSky = cosineDirection(surface.normal, sample.sky);
    const float below = glm::dot(toSky, surface.faceNormal);
    if (below < 0) // a furrowed normal leans beyond the facet
        toSky -= 2 * below * surface.faceNormal;
    if (isHidden(surface.start, toSky))
        light += bark_.colour * kHalfShade;
    else if (toSky.y >= 0 || surface.start.y <= base_.y)
        light += skyLight(toSky);
    else
    {
        const Vec3 ground = surface.start + (base_.y - surface.start.y) / toSky.y * toSky;
        const Vec3 sunAndSky = kSun * (std::max(0.0f, toSun_.y) / kPi) + 0.5f * (kZenith + kHorizon);
        light += mix(mix(kEarth, kMeadow, 0.5f) * sunAndSky, kHorizon, groundHaze(ground));
    }
    return surface.albedo * light;
}

Vec3 PreviewScene::skyLight(Vec3 direction) const
{
    const float down = 1 - std::clamp(direction.y, 0.0f, 1.0f);
    const float haze = down * down * down * down;
    const float towardsSun = std::max(0.0f, glm::dot(direction, toSun_));
    const float squared = towardsSun * towardsSun;
    const float glow = squared * squared * squared;
    // Haze, glow included, is the same all round at the horizon, where it meets the ground's.
    return mix(kZenith, kHorizon, haze) + kGlow * (glow * (1 - haze * down));
}

Vec3 PreviewScene::groundColour(Vec3 at) const
{
    const Vec2 place = Vec2(at.x - base_.x, at.z - base_.z) / size_;
    const float broad = smoothNoise(place * 3.0f + Vec2(11.3f, 5.1f), 4096);
    const float middle = smoothNoise(place * 13.0f + Vec2(3.7f, 8.9f), 4096);
    const float fine = smoothNoise(place * 71.0f + Vec2(9.1f, 2.3f), 4096);
    const float grass = std::clamp(0.5f * broad + 0.3f * middle + 0.2f * fine, 0.0f, 1.0f);
    return mix(kEarth, kMeadow, std::clamp(1.6f * grass - 0.3f, 0.0f, 1.0f)) * (0.9f + 0.2f * fine);
}

float PreviewScene::groundHaze(Vec3 at) const
{
    const float x = (at.x - base_.x) / size_;
    const float z = (at.z - base_.z) / size_;
    const float squared = x * x + z * z;
    constexpr float kReach = 7.0f; // times the size of the tree, to where half of the ground is left
    return squared / (squared + kReach * kReach);
}

} // namespace espalier
