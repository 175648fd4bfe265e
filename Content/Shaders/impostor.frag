#version 300 es
// What an octahedral impostor of Espalier shows: GLSL ES 3.00, to go with impostor.vert. seeImpostor in
// Source/Espalier/Render/ImpostorAtlas.cpp is the same computation in C++; what is changed here is changed there.
//
// Copy everything down to the line of dashes into your shader. impostorSeen says what a pixel shows; light it as you
// light the rest.

precision highp float;
precision highp int;

// All three filtered linearly and clamped to their edge, the first row of the file at v = 0, alpha not multiplied in.
uniform sampler2D impostorColour;    // sRGB (SRGB8_ALPHA8), with alpha
uniform sampler2D impostorNormal;    // linear: the normal in plant space
uniform sampler2D impostorRoughness; // linear: red occlusion, green roughness, blue depth
uniform int impostorSide;            // of the .json, likewise below
uniform vec3 impostorCentre;
uniform float impostorRadius;
uniform float impostorHalfExtent;

struct ImpostorSeen
{
    vec3 colour;     // linear, unlit
    vec3 normal;     // plant space, unit
    vec3 place;      // plant space: where the plant is, for depth and shadows
    float occlusion; // share of the light of the sky
    float roughness;
};

// The square of all directions that do not point down, and back (Cigolle et al. 2014).
vec2 impostorSquare(vec3 direction)
{
    direction.y = max(direction.y, 0.0);
    float sum = abs(direction.x) + direction.y + abs(direction.z);
    if (sum <= 0.0)
        return vec2(0.5);
    direction /= sum;
    return 0.5 * vec2(direction.x + direction.z, direction.x - direction.z) + 0.5;
}

vec3 impostorDirection(vec2 square)
{
    vec2 e = 2.0 * square - 1.0;
    float x = 0.5 * (e.x + e.y);
    float z = 0.5 * (e.x - e.y);
    return normalize(vec3(x, 1.0 - abs(x) - abs(z), z));
}

// Interleaved gradient noise (Jimenez 2014). With temporal antialiasing, add 5.588238 times the frame's number to both.
float impostorDither(vec2 pixel)
{
    return fract(52.9829189 * fract(dot(pixel, vec2(0.06711056, 0.00583715))));
}

// One of the three frames round a direction, picked by its share.
ivec2 impostorFrame(vec3 toCamera, float dither)
{
    vec2 at = impostorSquare(toCamera) * float(impostorSide - 1);
    vec2 corner = clamp(floor(at), 0.0, float(impostorSide - 2));
    vec2 within = at - corner;
    bool isLow = within.x + within.y < 1.0;
    float first = isLow ? 1.0 - within.x - within.y : within.x + within.y - 1.0;
    float second = isLow ? within.x : 1.0 - within.y;
    ivec2 offset = dither < first ? (isLow ? ivec2(0, 0) : ivec2(1, 1)) : dither < first + second ? ivec2(1, 0) : ivec2(0, 1);
    return ivec2(corner) + offset;
}

// What the ray from the camera through `place` (plant space, like the camera) shows; false where it shows nothing.
bool impostorSeen(vec3 camera, vec3 place, vec2 pixel, out ImpostorSeen seen)
{
    seen = ImpostorSeen(vec3(0.0), vec3(0.0), vec3(0.0), 0.0, 0.0);
    vec3 toViewer = normalize(camera - place);
    ivec2 frame = impostorFrame(camera - impostorCentre, impostorDither(pixel));
    vec3 facing = impostorDirection(vec2(frame) / float(impostorSide - 1));
    vec3 level = vec3(facing.z, 0.0, -facing.x);
    vec3 right = length(level) > 1e-4 ? normalize(level) : vec3(1.0, 0.0, 0.0);
    vec3 up = cross(facing, right);
    float slope = dot(facing, toViewer);
    if (abs(slope) < 1e-3)
        return false;
    // Where the ray meets the frame's plane, and once more where it is as deep as the picture says.
    vec2 uv = vec2(0.0);
    vec3 material = vec3(0.0, 0.0, 0.5);
    for (int i = 0; i < 2; ++i)
    {
        float depth = impostorRadius * (2.0 * material.b - 1.0);
        seen.place = place + (dot(impostorCentre - place, facing) + depth) / slope * toViewer;
        vec3 from = (seen.place - impostorCentre) / impostorHalfExtent;
        vec2 at = vec2(dot(from, right), dot(from, up));
        if (abs(at.x) > 1.0 || abs(at.y) > 1.0)
            return false;
        uv = (vec2(frame) + 0.5 * vec2(1.0 + at.x, 1.0 - at.y)) / float(impostorSide);
        material = textureLod(impostorRoughness, uv, 0.0).rgb;
    }
    vec4 colour = textureLod(impostorColour, uv, 0.0);
    if (colour.a < 0.5)
        return false;
    vec3 normal = 2.0 * textureLod(impostorNormal, uv, 0.0).rgb - 1.0;
    seen.colour = colour.rgb;
    seen.normal = dot(normal, normal) > 0.0 ? normalize(normal) : toViewer;
    seen.occlusion = material.r;
    seen.roughness = material.g;
    return true;
}

// ---------------------------------------------------------------------------------------------------------------------
// An example: sun and sky.

in vec3 placeInPlant;
flat in vec3 cameraInPlant;

uniform vec3 toSunInPlant; // unit

out vec4 fragment;

void main()
{
    ImpostorSeen seen;
    if (!impostorSeen(cameraInPlant, placeInPlant, gl_FragCoord.xy, seen))
        discard;
    float sun = max(dot(seen.normal, toSunInPlant), 0.0);
    float sky = (0.5 + 0.5 * seen.normal.y) * seen.occlusion;
    fragment = vec4(seen.colour * (1.2 * sun + 0.6 * sky), 1.0);
}
