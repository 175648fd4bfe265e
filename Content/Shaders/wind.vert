#version 300 es
// How a plant of Espalier moves in the wind: GLSL ES 3.00 for the attributes of the preset "generic", table by table in
// Source/Espalier/Mesh/WIND.md. Source/Espalier/Mesh/WindMotion.cpp is the same computation in C++, line by line; what
// is changed here is changed there.
//
// Copy everything down to the line of dashes into your shader and call windDisplaced with the position as the file has
// it (plant space: metres, Y up, the trunk's foot at the origin), before the model matrix. Without WIND_TWIGS only
// TEXCOORD_1 to TEXCOORD_4 are needed; twigs then move with their boughs.

precision highp float;
precision highp int;

#define WIND_TWIGS 1

// The air, the same for all plants; it is turned into plant space by the inverse of the model's rotation.
struct WindWeather
{
    vec3 direction; // unit, horizontal: where it blows to
    float speed;    // metres a second, the mean: 2 a light breeze, 12 a strong one, 20 a gale
    float gust;     // [0, 1]: how far gusts and lulls depart from the mean
    float time;     // seconds; begin again before a day is over
    vec3 place;     // metres: where this plant stands, so that gusts travel
};

// How this plant answers.
struct WindResponse
{
    float trunkAngle; // radians: 0.14 (stout trees) to 0.35 (slender ones)
    float boughAngle; // radians: usually 0.3
    float flutter;    // lengths of a leaf: usually 0.18
    float rate;       // sways a second: 0.12 (large trees) to 0.5 (small ones)
};

// Period 1, from -1 to 1, 1 at 0.
float windWave(float x)
{
    float t = abs(2.0 * fract(x) - 1.0);
    return 2.0 * (t * t * (3.0 - 2.0 * t)) - 1.0;
}

// The load of the wind at a place, from 0 to 1.
float windLoad(vec3 place, WindWeather weather)
{
    float clock = weather.time - dot(place, weather.direction) / max(weather.speed, 1.0);
    float gust = 0.65 * windWave(clock / 7.3) + 0.35 * windWave(clock / 2.9 + 0.4);
    float speed = weather.speed * max(1.0 + weather.gust * gust, 0.0);
    return speed * speed / (speed * speed + 15.0 * 15.0);
}

// Neighbours of one mesh do not sway in unison.
float windLag(vec3 place)
{
    return fract(0.137 * place.x + 0.219 * place.z);
}

// A direction out of 12 bits (Cigolle et al. 2014).
vec3 windDirection(uint packedDirection)
{
    float u = float(packedDirection & 63u) * (2.0 / 63.0) - 1.0;
    float v = float((packedDirection >> 6u) & 63u) * (2.0 / 63.0) - 1.0;
    float y = 1.0 - abs(u) - abs(v);
    float under = max(-y, 0.0);
    vec3 direction = vec3(u - (u >= 0.0 ? under : -under), y, v - (v >= 0.0 ? under : -under));
    return direction / sqrt(dot(direction, direction));
}

// A Gibbs vector: an axis times the tangent of half the angle. `element`: where the branch leads and its phase, whole
// part and fraction.
vec3 windBranchTurn(float bend, float element, float angle, float rate, vec3 pivot, WindWeather weather)
{
    float phase = fract(element);
    vec3 along = weather.direction;
    vec3 push = cross(windDirection(uint(element)), along);
    vec3 lean = vec3(along.z, 0.0, -along.x);
    float beat = rate * (1.2 + 0.8 * fract(7.0 * phase)) * weather.time + phase + windLag(weather.place);
    float yield = 0.65 + 0.25 * windWave(beat);
    float nod = 0.2 * windWave(beat + 0.2);
    float sway = 0.25 * windWave(0.77 * beat + fract(13.0 * phase));
    float swing = 0.2 * windWave(1.13 * beat + fract(29.0 * phase));
    float size = 0.5 * angle * bend * windLoad(weather.place + pivot, weather);
    return size * (yield * push + nod * lean + sway * along + vec3(0.0, swing, 0.0));
}

vec3 windTrunkTurn(float bend, WindWeather weather, WindResponse response)
{
    vec3 along = weather.direction;
    vec3 lean = vec3(along.z, 0.0, -along.x);
    float beat = response.rate * weather.time + windLag(weather.place);
    float nod = 0.7 + 0.3 * windWave(beat);
    float sway = 0.2 * windWave(0.83 * beat + 0.3);
    return (0.5 * response.trunkAngle * bend * windLoad(weather.place, weather)) * (nod * lean + sway * along);
}

// Metres.
vec3 windLeafBeat(float flutter, uint leaf, vec3 boughPivot, WindWeather weather, WindResponse response)
{
    if (!(flutter > 0.0))
        return vec3(0.0);
    float phase = float(leaf & 255u) * (1.0 / 256.0);
    float load = windLoad(weather.place + boughPivot, weather);
    float beat = (2.1 + 1.7 * fract(5.0 * phase)) * weather.time + phase;
    float flap = 0.6 * windWave(beat) + 0.4 * windWave(1.7 * beat + fract(11.0 * phase));
    return (flutter * response.flutter * flap * load / (load + 0.1)) * windDirection(leaf >> 8u);
}

vec3 windTurned(vec3 arm, vec3 turn)
{
    vec3 aside = cross(turn, arm);
    return arm + (2.0 / (1.0 + dot(turn, turn))) * (aside + cross(turn, aside));
}

// The same of a branch, whose turn grows along it: a bow is longer than its chord.
vec3 windBowed(vec3 arm, vec3 turn)
{
    return windTurned(arm, turn) / (1.0 + 0.4 * dot(turn, turn));
}

// Where a vertex is in the wind, plant space, metres; `normal` is turned with it.
vec3 windDisplaced(vec3 position, inout vec3 normal, vec2 texcoord1, vec2 texcoord2, vec2 texcoord3, vec2 texcoord4,
#if WIND_TWIGS
                   vec2 texcoord5, vec2 texcoord6, vec2 texcoord7,
#endif
                   WindWeather weather, WindResponse response)
{
    vec3 boughPivot = vec3(texcoord3, texcoord4.x);
    uint leaf = uint(fract(texcoord4.y) * 1048576.0 + 0.5);
    position += windLeafBeat(texcoord2.y, leaf, boughPivot, weather, response);
#if WIND_TWIGS
    vec3 twigPivot = vec3(texcoord6, texcoord7.x);
    vec3 twig = windBranchTurn(texcoord5.x, texcoord5.y, 1.25 * response.boughAngle, 1.9 * response.rate, twigPivot,
                               weather);
    position = twigPivot + windBowed(position - twigPivot, twig);
    normal = windTurned(normal, twig);
#endif
    vec3 bough = windBranchTurn(texcoord2.x, texcoord1.y, response.boughAngle, response.rate, boughPivot, weather);
    vec3 trunk = windTrunkTurn(texcoord1.x, weather, response);
    position = boughPivot + windBowed(position - boughPivot, bough);
    normal = windTurned(windTurned(normal, bough), trunk);
    return windBowed(position, trunk);
}

// ---------------------------------------------------------------------------------------------------------------------

layout(location = 0) in vec3 inPosition;
layout(location = 1) in vec3 inNormal;
layout(location = 2) in vec2 inTexcoord0;
layout(location = 3) in vec2 inTexcoord1;
layout(location = 4) in vec2 inTexcoord2;
layout(location = 5) in vec2 inTexcoord3;
layout(location = 6) in vec2 inTexcoord4;
#if WIND_TWIGS
layout(location = 7) in vec2 inTexcoord5;
layout(location = 8) in vec2 inTexcoord6;
layout(location = 9) in vec2 inTexcoord7;
#endif

uniform mat4 worldFromPlant; // rotation, uniform scale and translation
uniform mat4 clipFromWorld;
uniform WindWeather weather; // in plant space
uniform WindResponse response;

out vec3 worldNormal;
out vec2 texcoord;

void main()
{
    vec3 normal = inNormal;
    vec3 position = windDisplaced(inPosition, normal, inTexcoord1, inTexcoord2, inTexcoord3, inTexcoord4,
#if WIND_TWIGS
                                  inTexcoord5, inTexcoord6, inTexcoord7,
#endif
                                  weather, response);
    worldNormal = normalize(mat3(worldFromPlant) * normal);
    texcoord = inTexcoord0;
    gl_Position = clipFromWorld * (worldFromPlant * vec4(position, 1.0));
}
