#include <Espalier/Render/PreviewScene.h>

#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Core/Finite.h>
#include <Espalier/Mesh/TreeMesh.h>
#include <Espalier/Render/Render.h>
#include <Espalier/Render/SmoothNoise.h>
#include <Espalier/Species/Appearance.h>
#include <Espalier/Texture/AppearanceTextures.h>
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

constexpr float kCoordinateLimit = 1e7f; // metres; beyond it floats are too coarse to trace

bool isPlace(Vec3 v)
{
    const auto near = [](float c) { return std::abs(c) <= kCoordinateLimit; };
    return near(v.x) && near(v.y) && near(v.z);
}

bool isEmpty(const Image& image)
{
    return image.texels.empty() || image.texels.size() != std::size_t{image.width} * image.height * image.channels;
}

RTCRayHit firstHit(RTCScene scene, Vec3 origin, Vec3 direction, float nearest)
{
    RTCRayHit query{};
    query.ray = makeRay(origin, direction);
    query.ray.tnear = nearest;
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    rtcIntersect1(scene, &context, &query);
    return query;
}

} // namespace

/// What light meets: a point of a plant or of the ground.
struct PreviewScene::Surface
{
    Vec3 start;      ///< Where rays to the lights begin: clear of the surface.
    Vec3 normal;     ///< Of the smooth, furrowed surface; unit.
    Vec3 faceNormal; ///< Of the flat triangle; unit.
    Vec3 colour{0};  ///< As glTF's material has it.
    Vec3 albedo;
    float open = 1;  ///< Share of the light of sky, and from behind, that what is only in a picture lets pass.
    Vec3 through{0}; ///< Share of the light from behind that comes out here; 0 if it is opaque.
    Vec3 behind{0};  ///< Where rays to the lights behind it begin.
    Vec3 toViewer{0};
    bool isThin = false; ///< Light comes to both sides.
};

/// One point of a triangle and how its texture lies on it.
struct PreviewScene::Facet
{
    Vec3 at;
    Vec3 normal; ///< Interpolated, unit.
    Vec2 uv;
    Vec3 tint{1};
    Vec3 alongU{0}; ///< Metres per repeat of the texture; 0 where it has no extent.
    Vec3 alongV{0};

    /// `own` in the tangent space of the texture, as a direction.
    [[nodiscard]] Vec3 bent(Vec3 own) const
    {
        const Vec3 level = alongU - normal * glm::dot(normal, alongU);
        const float length = glm::length(level);
        if (!(length > 0))
            return normal;
        const Vec3 tangent = level / length;
        const Vec3 across = glm::cross(normal, tangent);
        const Vec3 bitangent = glm::dot(across, alongV) < 0 ? -across : across;
        return glm::normalize(own.x * tangent + own.y * bitangent + std::max(own.z, 0.05f) * normal);
    }
};

Expected<void> checkSubject(const RenderSubject& subject)
{
    const auto bad = [](std::string what) {
        return failure(ErrorKind::BadInput, {}, "a tree cannot be drawn: " + what, "a mesh with at least one triangle");
    };
    if (!subject.mesh || !subject.appearance)
        return bad("it has no mesh or no appearance");
    if (!(subject.distance >= 1 && subject.distance <= 1e4))
        return failure(ErrorKind::BadInput, {}, "a tree's distance is " + std::to_string(subject.distance),
                       "a number from 1 to 10000");
    if (const MaterialTextures* cards = subject.cards; cards && (isEmpty(cards->colour) || isEmpty(cards->normal)))
        return bad("the pictures of its cards are empty");
    const TreeMesh& mesh = *subject.mesh;
    if (mesh.indices.empty() || mesh.indices.size() % 3 != 0)
        return bad("its mesh has " + std::to_string(mesh.indices.size()) + " indices");
    if (mesh.normals.size() != mesh.positions.size() || mesh.uvs.size() != mesh.positions.size() ||
        (!mesh.tints.empty() && mesh.tints.size() != mesh.positions.size()))
        return bad("its vertex arrays differ in length");
    const auto isInside = [&](std::uint32_t index) { return index < mesh.positions.size(); };
    if (!std::all_of(mesh.indices.begin(), mesh.indices.end(), isInside))
        return bad("an index is out of range");
    if (!std::all_of(mesh.positions.begin(), mesh.positions.end(), isPlace) ||
        !std::all_of(mesh.normals.begin(), mesh.normals.end(), [](Vec3 n) { return isFinite(n); }) ||
        !std::all_of(mesh.uvs.begin(), mesh.uvs.end(), [](Vec2 uv) { return isFinite(uv); }))
        return bad("a number in its mesh is not finite or beyond 10,000 km");
    const auto& leaves = subject.appearance->leaves;
    if (!std::all_of(leaves.begin(), leaves.end(), [](const LeafAppearance& leaf) {
            return isFinite(leaf.colour) && isFinite(Vec2(leaf.width, leaf.stalk)) && std::isfinite(leaf.translucency);
        }))
        return bad("its leaves have a number that is not finite");
    if (!isFinite(subject.appearance->bark.colour) || !std::isfinite(subject.appearance->bark.tile) ||
        !std::isfinite(subject.appearance->bark.relief))
        return bad("its bark has a number that is not finite");
    const auto& palette = subject.appearance->palette;
    if (!std::all_of(palette.begin(), palette.end(), [](Vec3 colour) { return isFinite(colour); }))
        return bad("its palette has a colour that is not finite");
    return {};
}

PaintBox::PaintBox(AppearanceTextures textures) : bark(std::move(textures.bark), TextureWrap::Repeat)
{
    for (MaterialTextures& leaf : textures.leaves)
        leaves.emplace_back(std::move(leaf), TextureWrap::Clamp);
}

PreviewScene::PreviewScene(const TreeMesh& mesh, const Appearance& appearance, const PaintBox& paintBox,
                           const Surroundings& surroundings)
    : mesh_(mesh), toSun_(surroundings.toSun), base_(surroundings.base), size_(static_cast<float>(surroundings.size)),
      sunSlope_(static_cast<float>(math::tan(surroundings.sunRadius))),
      onPaper_(surroundings.backdrop == Backdrop::Paper)
{
    const auto triangles = static_cast<std::uint32_t>(mesh.indices.size() / 3);
    firstLeafTriangle_ = triangles;
    std::uint32_t covered = 0;
    for (const MeshPart& part : mesh.parts)
    {
        if (part.firstIndex != covered)
            break;
        covered += part.indexCount;
        const Vec3 colour = colourOf(part, appearance);
        if (part.material == MeshMaterial::Leaves && part.colour < paintBox.leaves.size())
        {
            firstLeafTriangle_ = std::min(firstLeafTriangle_, part.firstIndex / 3);
            paints_.push_back({covered / 3, colour, Finish::Leaf, &paintBox.leaves[part.colour],
                               appearance.leaves[part.colour].translucency});
        }
        else if (part.material == MeshMaterial::Cards && !paintBox.cards.empty())
        {
            firstLeafTriangle_ = std::min(firstLeafTriangle_, part.firstIndex / 3);
            const float translucency = appearance.leaves.empty() ? 0 : appearance.leaves[0].translucency;
            paints_.push_back({covered / 3, colour, Finish::Leaf, &paintBox.cards[0], translucency, true});
        }
        else if (part.material == MeshMaterial::Bark)
            paints_.push_back({covered / 3, colour, part.colour == 0 ? Finish::Bark : Finish::Rind, &paintBox.bark, 0});
        else
            paints_.push_back({covered / 3, colour, Finish::TwoSided, nullptr, LeafAppearance{}.translucency});
    }
    paints_.push_back(
        {std::numeric_limits<std::uint32_t>::max(), appearance.bark.colour, Finish::Bark, &paintBox.bark, 0});
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
    // Apart, for only leaves need to be asked whether a ray passes through a hole in them.
    addGeometry(0, firstLeafTriangle_);
    addGeometry(firstLeafTriangle_, triangles);
    rtcCommitScene(scene_);
    ready_ = rtcGetDeviceError(device_) == RTC_ERROR_NONE;
}

/// Geometry 0 is what is opaque, geometry 1 leaves.
void PreviewScene::addGeometry(std::uint32_t firstTriangle, std::uint32_t endTriangle)
{
    const RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    void* vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, sizeof(Vec3),
                                             mesh_.positions.size());
    const std::size_t count = endTriangle - firstTriangle;
    void* indices = count == 0 ? nullptr
                               : rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                                         3 * sizeof(std::uint32_t), count);
    if (vertices && indices)
    {
        std::memcpy(vertices, mesh_.positions.data(), mesh_.positions.size() * sizeof(Vec3));
        std::memcpy(indices, mesh_.indices.data() + std::size_t{3} * firstTriangle, count * 3 * sizeof(std::uint32_t));
        const bool isLeaves = firstTriangle >= firstLeafTriangle_;
        if (isLeaves)
        {
            rtcSetGeometryUserData(geometry, this);
            rtcSetGeometryIntersectFilterFunction(geometry, cutLeaves);
            rtcSetGeometryOccludedFilterFunction(geometry, cutLeaves);
        }
        rtcCommitGeometry(geometry);
        rtcAttachGeometryByID(scene_, geometry, isLeaves ? 1 : 0);
    }
    rtcReleaseGeometry(geometry);
}

/// Lets rays through where the texture is transparent. Embree's rays come one at a time here.
void PreviewScene::cutLeaves(const RTCFilterFunctionNArguments* arguments)
{
    if (arguments->valid[0] != -1)
        return;
    const auto* scene = static_cast<const PreviewScene*>(arguments->geometryUserPtr);
    const auto triangle = scene->firstLeafTriangle_ + RTCHitN_primID(arguments->hit, 1, 0);
    const float u = RTCHitN_u(arguments->hit, 1, 0);
    const float v = RTCHitN_v(arguments->hit, 1, 0);
    const std::uint32_t* corner = scene->mesh_.indices.data() + std::size_t{3} * triangle;
    const RawVector<Vec2>& uvs = scene->mesh_.uvs;
    const Vec2 uv = (1 - u - v) * uvs[corner[0]] + u * uvs[corner[1]] + v * uvs[corner[2]];
    constexpr float kCutoff = 0.5f; // as in glTF
    const Paint& paint = scene->paintOf(triangle);
    const bool isCut = paint.material && paint.material->alpha(uv) < kCutoff;
    const Vec3 direction(RTCRayN_dir_x(arguments->ray, 1, 0), RTCRayN_dir_y(arguments->ray, 1, 0),
                         RTCRayN_dir_z(arguments->ray, 1, 0));
    const Vec3 normal(RTCHitN_Ng_x(arguments->hit, 1, 0), RTCHitN_Ng_y(arguments->hit, 1, 0),
                      RTCHitN_Ng_z(arguments->hit, 1, 0));
    if (isCut || (paint.isOneSided && glm::dot(direction, normal) > 0))
        arguments->valid[0] = 0;
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

Vec3 PreviewScene::radiance(Vec3 origin, Vec3 direction, float nearest, const LightSample& sample) const
{
    const RTCRayHit query = firstHit(scene_, origin, direction, nearest);

    // The ground is seen from above only: from below it would hide the tree.
    const bool meetsGround = !onPaper_ && direction.y < 0 && origin.y > base_.y;
    const float toGround = meetsGround ? (base_.y - origin.y) / direction.y : std::numeric_limits<float>::infinity();
    if (query.hit.geomID != RTC_INVALID_GEOMETRY_ID && query.ray.tfar < toGround)
    {
        return litColour(surfaceAt(query.hit, direction), sample);
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

std::optional<Sight> PreviewScene::sight(Vec3 origin, Vec3 direction, Vec2 sky) const
{
    const RTCRayHit query = firstHit(scene_, origin, direction, 0);
    if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID)
        return std::nullopt;
    const Surface surface = surfaceAt(query.hit, direction);
    Vec3 toSky = cosineDirection(surface.normal, sky);
    toSky -= 2 * std::min(glm::dot(toSky, surface.faceNormal), 0.0f) * surface.faceNormal;
    return Sight{surface.colour, surface.normal, query.ray.tfar, !isHidden(surface.start, toSky)};
}

PreviewScene::Surface PreviewScene::surfaceAt(const RTCHit& hit, Vec3 direction) const
{
    const unsigned triangle = hit.primID + (hit.geomID == 1 ? firstLeafTriangle_ : 0);
    const float u = hit.u;
    const float v = hit.v;
    const std::uint32_t* corner = mesh_.indices.data() + std::size_t{3} * triangle;
    const Vec3 n0 = mesh_.normals[corner[0]];
    const Vec3 n1 = mesh_.normals[corner[1]];
    const Vec3 n2 = mesh_.normals[corner[2]];
    const Paint& paint = paintOf(triangle);
    const Vec3 faceNormal = glm::normalize(Vec3(hit.Ng_x, hit.Ng_y, hit.Ng_z));
    Facet facet = facetAt(triangle, {u, v});
    const Vec3 at = facet.at;
    const float length = glm::length(facet.normal);
    facet.normal = length > 0 ? facet.normal / length : faceNormal;
    const Vec3 normal = facet.normal;

    Surface surface;
    const bool isThin = paint.finish == Finish::TwoSided || paint.finish == Finish::Leaf;
    // Facets of a tube that is really round would shadow themselves in steps where the light grazes. So rays begin on
    // the curved surface that the normals promise (Hanika, "Hacking the Shadow Terminator", 2021).
    const auto bulge = [&](std::uint32_t i, Vec3 n) {
        // Normals of leaves are bent to the crown and promise no surface.
        return paint.finish == Finish::Leaf ? Vec3(0) : -std::min(0.0f, glm::dot(at - mesh_.positions[i], n)) * n;
    };
    surface.start = at + (1 - u - v) * bulge(corner[0], n0) + u * bulge(corner[1], n1) + v * bulge(corner[2], n2);

    surface.normal = normal;
    surface.isThin = isThin;
    if (isThin)
        paintLeaf(paint, facet, surface);
    else
        paintWood(paint, facet, surface);

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

PreviewScene::Facet PreviewScene::facetAt(unsigned triangle, Vec2 hit) const
{
    const std::uint32_t* corner = mesh_.indices.data() + std::size_t{3} * triangle;
    const auto between = [&](const auto& all) {
        return (1 - hit.x - hit.y) * all[corner[0]] + hit.x * all[corner[1]] + hit.y * all[corner[2]];
    };
    Facet facet;
    facet.at = between(mesh_.positions);
    facet.normal = between(mesh_.normals);
    facet.uv = between(mesh_.uvs);
    if (!mesh_.tints.empty())
    {
        const auto tint = [&](int i) {
            const Tint& t = mesh_.tints[corner[i]];
            return Vec3(t.red, t.green, t.blue) / 255.0f;
        };
        facet.tint = (1 - hit.x - hit.y) * tint(0) + hit.x * tint(1) + hit.y * tint(2);
    }
    const Vec3 p1 = mesh_.positions[corner[1]] - mesh_.positions[corner[0]];
    const Vec3 p2 = mesh_.positions[corner[2]] - mesh_.positions[corner[0]];
    const Vec2 t1 = mesh_.uvs[corner[1]] - mesh_.uvs[corner[0]];
    const Vec2 t2 = mesh_.uvs[corner[2]] - mesh_.uvs[corner[0]];
    const float area = t1.x * t2.y - t2.x * t1.y;
    if (std::abs(area) > std::numeric_limits<float>::min())
    {
        facet.alongU = (p1 * t2.y - p2 * t1.y) / area;
        facet.alongV = (p2 * t1.x - p1 * t2.x) / area;
    }
    return facet;
}

void PreviewScene::paintWood(const Paint& paint, const Facet& facet, Surface& surface) const
{
    Vec3 colour = paint.material->colour(facet.uv);
    if (paint.finish == Finish::Rind)
    {
        constexpr float kHint = 0.12f;
        const Vec3 bark = paints_.back().colour;
        const float shade = (colour.x + colour.y + colour.z) / std::max(bark.x + bark.y + bark.z, 1e-4f);
        colour = paint.colour * std::lerp(1.0f, shade, kHint);
    }
    else
    {
        surface.normal = facet.bent(paint.material->normal(facet.uv));
    }
    surface.colour = colour * facet.tint;
    // Patches of weather and lichen, larger than any repeat of the texture, hide that it repeats.
    const Vec3 at = facet.at;
    const float patch = smoothNoise({at.x * 2.3f + at.z * 0.9f, at.y * 1.4f - at.z * 1.1f}, 4096);
    surface.albedo = glm::clamp(colour * facet.tint * (0.86f + 0.28f * patch), Vec3(0), Vec3(0.95f));
}

void PreviewScene::paintLeaf(const Paint& paint, const Facet& facet, Surface& surface) const
{
    Vec3 colour = paint.colour * facet.tint;
    if (paint.material)
    {
        colour = paint.material->colour(facet.uv) * facet.tint;
        if (paint.isOneSided)
            surface.open = paint.material->occlusion(facet.uv);
        surface.normal = facet.bent(paint.material->normal(facet.uv));
    }
    else
    {
        // No two petals are alike: some are lighter and yellower than their neighbours.
        const Vec3 place = facet.at / size_;
        const float near =
            smoothNoise({(place.x + 0.3f * place.y) * 47 + 7, (place.y - 0.6f * place.z) * 47 + 3}, 4096);
        const float far = smoothNoise({place.x * 9 + place.z * 4 + 5, place.y * 8 - place.z * 3 + 1}, 4096);
        colour *= mix({0.86f, 0.90f, 0.88f}, {1.16f, 1.08f, 0.98f}, 0.6f * near + 0.4f * far);
    }
    surface.colour = colour;
    colour = glm::clamp(colour, Vec3(0), Vec3(0.95f));
    // What comes through has passed more of the leaf, so its colour is purer. Both together never exceed the light.
    const float brightest = std::max({colour.x, colour.y, colour.z, 1e-4f});
    const auto purer = [&](float c) { return c * std::lerp(1.0f, std::sqrt(c / brightest), 0.6f); };
    surface.albedo = colour * (1 - 0.45f * brightest);
    const Vec3 pure(purer(colour.x), purer(colour.y), purer(colour.z));
    const float wanted = 1.4f * (1 - 0.72f * brightest) * paint.translucency / LeafAppearance{}.translucency;
    const float most = (1 - std::max({surface.albedo.x, surface.albedo.y, surface.albedo.z})) /
                       std::max({pure.x, pure.y, pure.z, 1e-4f});
    surface.through = pure * std::min(wanted, most);
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
    if (surface.isThin)
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
    if (!onPaper_ && toSun.y > 0 && !isHidden(isLit ? surface.start : surface.behind, toSun))
    {
        result += (isLit ? surface.albedo : surface.open * surface.through) * kSun * (std::abs(sunCosine) / kPi);
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
    return result + surface.open * (isFront ? surface.albedo / kFront : surface.through / (1 - kFront)) * sky;
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
