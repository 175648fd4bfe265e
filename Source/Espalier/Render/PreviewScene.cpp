#include <Espalier/Render/PreviewScene.h>

#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Mesh/TreeMesh.h>
#include <Espalier/Render/Bark.h>
#include <Espalier/Render/Render.h>
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

// On paper light comes from everywhere, a little more of it from the sun's side so that what is round looks round. A
// sheet that faces the camera looks about as bright as its albedo.
constexpr float kSoft = 0.95f;
constexpr float kSofter = 0.6f; ///< Less than kSoft: nothing is black.
/// Share of the light from behind: all of it, as bright as that in front, would bleach leaves.
constexpr float kPaperThrough = 0.5f;

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

/// What light meets: a point of a plant or of the ground.
struct PreviewScene::Surface
{
    Vec3 start;      ///< Where rays to the lights begin: clear of the surface.
    Vec3 normal;     ///< Of the smooth, furrowed surface; unit.
    Vec3 faceNormal; ///< Of the flat triangle; unit.
    Vec3 albedo;
    Vec3 through{0}; ///< Share of the light from behind that comes out here; 0 if it is opaque.
    Vec3 behind{0};  ///< Where rays to the lights behind it begin.
    Vec3 toViewer{0};
};

PreviewScene::PreviewScene(const TreeMesh& mesh, const Appearance& appearance, const Surroundings& surroundings)
    : mesh_(mesh), toSun_(surroundings.toSun), base_(surroundings.base), size_(static_cast<float>(surroundings.size)),
      sunSlope_(static_cast<float>(math::tan(surroundings.sunRadius))),
      onPaper_(surroundings.backdrop == Backdrop::Paper)
{
    std::uint32_t covered = 0;
    for (const MeshPart& part : mesh.parts)
    {
        if (part.firstIndex != covered)
            break;
        covered += part.indexCount;
        const bool isTwoSided = part.material == MeshMaterial::Surface;
        const Finish finish = isTwoSided ? Finish::TwoSided : part.colour == 0 ? Finish::Bark : Finish::Rind;
        paints_.push_back({covered / 3, colourOf(part, appearance), finish});
    }
    paints_.push_back({std::numeric_limits<std::uint32_t>::max(), appearance.bark.colour, Finish::Bark});
    halfShade_ = meanColour() * kHalfShade;

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

Vec3 PreviewScene::paperLight()
{
    return {0.939f, 0.922f, 0.871f};
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
    const bool meetsGround = !onPaper_ && direction.y < 0 && origin.y > base_.y;
    const float toGround = meetsGround ? (base_.y - origin.y) / direction.y : std::numeric_limits<float>::infinity();
    if (query.hit.geomID != RTC_INVALID_GEOMETRY_ID && query.ray.tfar < toGround)
    {
        const Vec3 faceNormal{query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z};
        return litColour(surfaceAt(query.hit.primID, query.hit.u, query.hit.v, faceNormal, direction), sample);
    }
    if (onPaper_)
        return paperLight();
    if (!meetsGround)
        return skyLight(direction);

    const Vec3 at = origin + toGround * direction;
    const float haze = groundHaze(at);
    constexpr float kNoGroundLeft = 0.999f;
    if (!(haze < kNoGroundLeft))
        return kHorizon;
    constexpr Vec3 kUp{0, 1, 0};
    const Surface surface{
        .start = at + Vec3(0, offset_, 0), .normal = kUp, .faceNormal = kUp, .albedo = groundColour(at)};
    return mix(litColour(surface, sample), kHorizon, haze);
}

PreviewScene::Surface PreviewScene::surfaceAt(unsigned triangle, float u, float v, Vec3 faceNormal,
                                              Vec3 direction) const
{
    const std::uint32_t* corner = mesh_.indices.data() + std::size_t{3} * triangle;
    const Vec3 p0 = mesh_.positions[corner[0]];
    const Vec3 p1 = mesh_.positions[corner[1]];
    const Vec3 p2 = mesh_.positions[corner[2]];
    const Paint& paint = paintOf(triangle);
    const Vec3 n0 = mesh_.normals[corner[0]];
    const Vec3 n1 = mesh_.normals[corner[1]];
    const Vec3 n2 = mesh_.normals[corner[2]];
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

    surface.normal = normal;
    if (paint.finish == Finish::TwoSided)
        colourLeaf(paint, at, surface);
    else
        furrow(paint, triangle, {u, v}, at, surface);

    const float facing = glm::dot(faceNormal, normal) < 0 ? -1.0f : 1.0f; // winding does not matter here
    surface.faceNormal = facing * faceNormal;
    if (glm::dot(surface.faceNormal, direction) > 0) // the inside of an open tube, the other side of a leaf
    {
        surface.faceNormal = -surface.faceNormal;
        surface.normal = -surface.normal;
        surface.start = at;
    }
    surface.behind = at - offset_ * surface.faceNormal;
    surface.start += offset_ * surface.faceNormal;
    surface.toViewer = -direction;
    return surface;
}

const PreviewScene::Paint& PreviewScene::paintOf(std::uint32_t triangle) const
{
    const auto endsBefore = [](std::uint32_t wanted, const Paint& paint) { return wanted < paint.endTriangle; };
    return *std::upper_bound(paints_.begin(), paints_.end() - 1, triangle, endsBefore);
}

/// By area.
Vec3 PreviewScene::meanColour() const
{
    if (std::ranges::all_of(paints_, [](const Paint& paint) { return paint.finish == Finish::Bark; }))
        return paints_.back().colour;
    DVec3 sum(0);
    double whole = std::numeric_limits<double>::min();
    for (std::size_t i = 0; i + 2 < mesh_.indices.size(); i += 3)
    {
        const DVec3 p0(mesh_.positions[mesh_.indices[i]]);
        const DVec3 p1(mesh_.positions[mesh_.indices[i + 1]]);
        const DVec3 p2(mesh_.positions[mesh_.indices[i + 2]]);
        const double area = glm::length(glm::cross(p1 - p0, p2 - p0));
        sum += area * DVec3(paintOf(static_cast<std::uint32_t>(i / 3)).colour);
        whole += area;
    }
    return Vec3(sum / whole);
}

/// Colours wood, and roughens its normal.
void PreviewScene::furrow(const Paint& paint, std::uint32_t triangle, Vec2 hit, Vec3 at, Surface& surface) const
{
    const std::uint32_t* corner = mesh_.indices.data() + std::size_t{3} * triangle;
    const Vec3 p0 = mesh_.positions[corner[0]];
    const Vec3 p1 = mesh_.positions[corner[1]];
    const Vec3 p2 = mesh_.positions[corner[2]];
    const Vec2 t0 = mesh_.uvs[corner[0]];
    const Vec2 t1 = mesh_.uvs[corner[1]] - t0;
    const Vec2 t2 = mesh_.uvs[corner[2]] - t0;

    // How the texture lies on this triangle: metres per repeat, and the directions of u and v.
    float shade = 1;
    Vec3 furrowed = surface.normal;
    const float area = t1.x * t2.y - t2.x * t1.y;
    if (std::abs(area) > std::numeric_limits<float>::min())
    {
        const Vec3 alongU = ((p1 - p0) * t2.y - (p2 - p0) * t1.y) / area;
        const Vec3 alongV = ((p2 - p0) * t1.x - (p1 - p0) * t2.x) / area;
        const Vec2 metresPerRepeat(glm::length(alongU), glm::length(alongV));
        if (metresPerRepeat.x > 0 && metresPerRepeat.y > 0)
        {
            BarkRelief relief = barkRelief(t0 + hit.x * t1 + hit.y * t2, metresPerRepeat);
            if (paint.finish == Finish::Rind)
            {
                constexpr float kHint = 0.12f;
                relief.shade = std::lerp(1.0f, relief.shade, kHint);
                relief.slope = Vec2(0);
            }
            shade = relief.shade;
            furrowed -= relief.slope.x / metresPerRepeat.x * alongU + relief.slope.y / metresPerRepeat.y * alongV;
            furrowed = glm::normalize(furrowed);
        }
    }
    // Patches of weather and lichen, larger than any repeat of the texture, hide that it repeats.
    const float patch = smoothNoise({at.x * 2.3f + at.z * 0.9f, at.y * 1.4f - at.z * 1.1f}, 4096);
    surface.albedo = glm::clamp(paint.colour * shade * (0.86f + 0.28f * patch), Vec3(0), Vec3(0.95f));
    surface.normal = furrowed;
}

void PreviewScene::colourLeaf(const Paint& paint, Vec3 at, Surface& surface) const
{
    // No two leaves are alike: some are lighter and yellower than their neighbours.
    const Vec3 place = at / size_;
    const float near = smoothNoise({(place.x + 0.3f * place.y) * 47 + 7, (place.y - 0.6f * place.z) * 47 + 3}, 4096);
    const float far = smoothNoise({place.x * 9 + place.z * 4 + 5, place.y * 8 - place.z * 3 + 1}, 4096);
    const Vec3 tint = mix({0.86f, 0.90f, 0.88f}, {1.16f, 1.08f, 0.98f}, 0.6f * near + 0.4f * far);
    const Vec3 colour = glm::clamp(paint.colour * tint, Vec3(0), Vec3(0.95f));
    // What comes through has passed more of the leaf, so its colour is purer. Both together never exceed the light.
    const float brightest = std::max({colour.x, colour.y, colour.z, 1e-4f});
    const auto purer = [&](float c) { return c * std::lerp(1.0f, std::sqrt(c / brightest), 0.6f); };
    surface.albedo = colour * (1 - 0.45f * brightest);
    surface.through = Vec3(purer(colour.x), purer(colour.y), purer(colour.z)) * (1.4f * (1 - 0.72f * brightest));
    if (onPaper_)
        surface.through *= kPaperThrough;
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
    const Vec2 disc = sunSlope_ * onDisc(sample.sun);
    const Vec3 toSun = glm::normalize(toSun_ + disc.x * sunRight_ + disc.y * sunUp_);
    if (surface.through != Vec3(0))
        return leafLight(surface, toSun, sample.sky);

    Vec3 light(0); // what the surface reflects of it, per unit of albedo
    const float sunCosine = glm::dot(surface.normal, toSun);
    if (!onPaper_ && sunCosine > 0 && toSun.y > 0 && !isHidden(surface.start, toSun))
        light += kSun * (sunCosine / kPi);

    Vec3 toSky = cosineDirection(surface.normal, sample.sky);
    const float below = glm::dot(toSky, surface.faceNormal);
    if (below < 0) // a furrowed normal leans beyond the facet
        toSky -= 2 * below * surface.faceNormal;
    light += lightFrom(surface.start, toSky);
    return surface.albedo * light;
}

/// Light on a thin layer: from both sides, and a sheen of its wax.
Vec3 PreviewScene::leafLight(const Surface& surface, Vec3 toSun, Vec2 random) const
{
    Vec3 result(0);
    const float sunCosine = glm::dot(surface.normal, toSun);
    const bool isLit = sunCosine > 0;
    if (toSun.y > 0 && !isHidden(isLit ? surface.start : surface.behind, toSun))
    {
        result += (isLit ? surface.albedo : surface.through) * kSun * (std::abs(sunCosine) / kPi);
        if (isLit)
        {
            constexpr float kSheen = 0.05f; // of the light, gathered round the mirror's direction (Blinn 1977)
            const float h = std::max(0.0f, glm::dot(surface.normal, glm::normalize(toSun + surface.toViewer)));
            const float h4 = h * h * h * h;
            result += kSun * (kSheen * sunCosine * h4 * h4 * h4 * h4);
        }
    }
    // One sky ray, to either side as often as that side counts.
    constexpr float kFront = 0.6f;
    const bool isFront = random.x < kFront;
    random.x = isFront ? random.x / kFront : (random.x - kFront) / (1 - kFront);
    Vec3 toSky = cosineDirection(isFront ? surface.normal : -surface.normal, random);
    const float away = isFront ? glm::dot(toSky, surface.faceNormal) : -glm::dot(toSky, surface.faceNormal);
    if (away < 0)
        toSky -= 2 * glm::dot(toSky, surface.faceNormal) * surface.faceNormal;
    const Vec3 sky = lightFrom(isFront ? surface.start : surface.behind, toSky);
    return result + (isFront ? surface.albedo / kFront : surface.through / (1 - kFront)) * sky;
}

/// What comes from the sky, the ground or the plant itself in the half shade.
Vec3 PreviewScene::lightFrom(Vec3 start, Vec3 direction) const
{
    if (isHidden(start, direction))
        return halfShade_;
    if (onPaper_)
        return Vec3(kSoft + kSofter * glm::dot(direction, toSun_));
    if (direction.y >= 0 || start.y <= base_.y)
        return skyLight(direction);
    const Vec3 ground = start + (base_.y - start.y) / direction.y * direction;
    const Vec3 sunAndSky = kSun * (std::max(0.0f, toSun_.y) / kPi) + 0.5f * (kZenith + kHorizon);
    return mix(mix(kEarth, kMeadow, 0.5f) * sunAndSky, kHorizon, groundHaze(ground));
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
