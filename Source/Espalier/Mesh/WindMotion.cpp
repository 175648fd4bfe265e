#include <Espalier/Mesh/WindMotion.h>

#include <algorithm>
#include <cmath>

// Content/Shaders/wind.vert is this file in GLSL, line by line. What is changed here is changed there.
//
// Smoothed triangle waves in place of sines after T. Sousa, GPU Gems 3, chapter 16: cheap, and the same everywhere.
// Departure: that chapter shears the tree and then corrects the distance of each vertex from the root. Here branches
// turn, which keeps distances; as they bow besides, what lies beyond is drawn in a little (`bowed`).

namespace espalier {
namespace {

constexpr float kTrunkAngle = 0.28f; ///< Of a tree kSlender times as high as thick; stouter ones lean less.
constexpr float kSlender = 30;
constexpr float kBoughAngle = 0.3f;
constexpr float kTwigShare = 1.25f; ///< Of the boughs' angle.
constexpr float kTwigHaste = 1.9f;  ///< Of the boughs' rate.
constexpr float kBow = 0.4f; ///< How far a bent branch's ends come nearer, in squares of the half angle's tangent.
constexpr float kFlutter = 0.18f;

constexpr float kHalfLoadSpeed = 15; ///< Metres a second at which half of the most is reached: crowns streamline.

float fraction(float x)
{
    return x - std::floor(x);
}

/// Period 1, [-1, 1], 1 at 0.
float wave(float x)
{
    const float t = std::abs(2 * fraction(x) - 1);
    return 2 * (t * t * (3 - 2 * t)) - 1;
}

/// The load of the wind at a place, [0, 1): gusts travel with it.
float loadAt(const Vec3& place, const WindWeather& weather)
{
    const float clock = weather.time - glm::dot(place, weather.direction) / std::max(weather.speed, 1.f);
    const float gust = 0.65f * wave(clock / 7.3f) + 0.35f * wave(clock / 2.9f + 0.4f);
    const float speed = weather.speed * std::max(1 + weather.gust * gust, 0.f);
    return speed * speed / (speed * speed + kHalfLoadSpeed * kHalfLoadSpeed);
}

/// Neighbours of one mesh do not sway in unison.
float lagAt(const Vec3& place)
{
    return fraction(0.137f * place.x + 0.219f * place.z);
}

/// Half the turn of a branch that bends by `bend` and leads where `facing` says: the wind pushes it to leeward, so what
/// hangs is lifted and what stands across is swept back, as its drag would turn it at rest: what leads to leeward there
/// already is not pushed. How far it has turned since does not count; about there it nods, sways across the wind and
/// swings round.
Vec3 branchTurn(float bend, std::uint32_t facing, float phase, float angle, float rate, const Vec3& pivot,
                const WindWeather& weather)
{
    const Vec3 along = weather.direction;
    const Vec3 push = glm::cross(windDirection(facing), along);
    const Vec3 lean(along.z, 0, -along.x);
    const float beat = rate * (1.2f + 0.8f * fraction(7 * phase)) * weather.time + phase + lagAt(weather.place);
    const float yield = 0.65f + 0.25f * wave(beat);
    const float nod = 0.2f * wave(beat + 0.2f);
    const float sway = 0.25f * wave(0.77f * beat + fraction(13 * phase));
    const float swing = 0.2f * wave(1.13f * beat + fraction(29 * phase));
    const float size = 0.5f * angle * bend * loadAt(weather.place + pivot, weather);
    return size * (yield * push + nod * lean + sway * along + Vec3(0, swing, 0));
}

/// Half the turn of the whole tree.
Vec3 trunkTurn(float bend, const WindWeather& weather, const WindResponse& response)
{
    const Vec3 along = weather.direction;
    const Vec3 lean(along.z, 0, -along.x);
    const float beat = response.rate * weather.time + lagAt(weather.place);
    const float nod = 0.7f + 0.3f * wave(beat);
    const float sway = 0.2f * wave(0.83f * beat + 0.3f);
    return (0.5f * response.trunkAngle * bend * loadAt(weather.place, weather)) * (nod * lean + sway * along);
}

Vec3 leafBeat(const WindVertex& vertex, const WindWeather& weather, const WindResponse& response)
{
    if (!(vertex.flutter > 0))
        return Vec3(0);
    const float phase = static_cast<float>(vertex.leaf & 255) * (1.f / 256);
    const float load = loadAt(weather.place + vertex.boughPivot, weather);
    const float beat = (2.1f + 1.7f * fraction(5 * phase)) * weather.time + phase;
    const float flap = 0.6f * wave(beat) + 0.4f * wave(1.7f * beat + fraction(11 * phase));
    return (vertex.flutter * response.flutter * flap * load / (load + 0.1f)) * leafFacing(vertex.leaf);
}

/// Turned by a Gibbs vector: no trigonometry, and the length is kept.
Vec3 turned(const Vec3& arm, const Vec3& turn)
{
    const Vec3 aside = glm::cross(turn, arm);
    return arm + (2 / (1 + glm::dot(turn, turn))) * (aside + glm::cross(turn, aside));
}

/// The same of a branch, whose turn grows along it. A bow is longer than the chord that turns: without drawing the
/// chord in, what bends far would be stretched.
Vec3 bowed(const Vec3& arm, const Vec3& turn)
{
    return turned(arm, turn) / (1 + kBow * glm::dot(turn, turn));
}

Vec3 placed(const WindVertex& vertex, const WindTurns& turns, Vec3 position)
{
    position += turns.leaf;
    position = vertex.twigPivot + bowed(position - vertex.twigPivot, turns.twig);
    position = vertex.boughPivot + bowed(position - vertex.boughPivot, turns.bough);
    return bowed(position, turns.trunk);
}

Vec3 faced(const WindTurns& turns, const Vec3& direction)
{
    return turned(turned(turned(direction, turns.twig), turns.bough), turns.trunk);
}

} // namespace

WindResponse windResponse(const Skeleton& full, const WindAppearance& wind) noexcept
{
    float radius = 0;
    for (std::uint32_t i = 0; i < full.size(); ++i)
        if (full.parents[i] == kNoSegment)
            radius = std::max(radius, full.startRadii[i]);
    const float height = std::max(full.maxY - full.minY, 0.1f);
    const float rate = 0.0766f + 3.1219f * (200 * radius) / (height * height);
    const float slenderness = height / (kSlender * std::max(2 * radius, 1e-3f));
    return {.trunkAngle = kTrunkAngle * wind.trunk * std::clamp(std::sqrt(slenderness), 0.5f, 1.25f),
            .boughAngle = kBoughAngle * wind.boughs,
            .flutter = kFlutter * wind.flutter,
            .rate = std::clamp(rate, 0.12f, 0.5f)};
}

WindTurns windTurns(const WindVertex& vertex, const WindWeather& weather, const WindResponse& response) noexcept
{
    const float angle = response.boughAngle;
    return {.leaf = leafBeat(vertex, weather, response),
            .twig = branchTurn(vertex.twigBend, vertex.twigFacing, vertex.twigPhase, kTwigShare * angle,
                               kTwigHaste * response.rate, vertex.twigPivot, weather),
            .bough = branchTurn(vertex.boughBend, vertex.boughFacing, vertex.boughPhase, angle, response.rate,
                                vertex.boughPivot, weather),
            .trunk = trunkTurn(vertex.trunkBend, weather, response)};
}

Vec3 windDisplaced(const WindVertex& vertex, const Vec3& position, const WindWeather& weather,
                   const WindResponse& response) noexcept
{
    return placed(vertex, windTurns(vertex, weather, response), position);
}

TreeMesh blownBy(const TreeMesh& mesh, const WindVertices& wind, const WindWeather& weather,
                 const WindResponse& response)
{
    TreeMesh blown = mesh;
    const std::size_t count = std::min(mesh.positions.size(), wind.vertices.size());
    for (std::size_t i = 0; i < count; ++i)
    {
        const WindVertex& vertex = wind.vertices[i];
        const WindTurns turns = windTurns(vertex, weather, response);
        blown.positions[i] = placed(vertex, turns, mesh.positions[i]);
        blown.normals[i] = faced(turns, mesh.normals[i]);
        blown.tangents[i] = Vec4(faced(turns, Vec3(mesh.tangents[i])), mesh.tangents[i].w);
    }
    return blown;
}

} // namespace espalier
