#version 300 es
// The card of an octahedral impostor of Espalier, turned to the camera: GLSL ES 3.00, to go with impostor.frag. What the
// numbers mean: Source/Espalier/Mesh/IMPOSTOR.md.
//
// For cameras outside of the ball round the plant; within it, draw the plant. Draw two triangles whose corners are (-1, -1), (1, -1), (1, 1) and (-1, 1), any number of instances.

precision highp float;

in vec2 corner;

uniform mat4 worldFromPlant; // rotation, one scale for all axes, translation
uniform mat4 plantFromWorld; // its inverse
uniform mat4 clipFromWorld;
uniform vec3 cameraInWorld;
uniform vec3 impostorCentre; // of the .json, likewise below
uniform float impostorRadius;

out vec3 placeInPlant;
flat out vec3 cameraInPlant;

void main()
{
    cameraInPlant = (plantFromWorld * vec4(cameraInWorld, 1.0)).xyz;
    vec3 away = cameraInPlant - impostorCentre;
    float distance = length(away);
    vec3 toCamera = away / max(distance, 1e-6);
    vec3 level = vec3(toCamera.z, 0.0, -toCamera.x);
    vec3 right = length(level) > 1e-4 ? normalize(level) : vec3(1.0, 0.0, 0.0);
    vec3 up = cross(toCamera, right);
    // From near, a ball looks larger than the disc through its middle.
    float squared = distance * distance - impostorRadius * impostorRadius;
    float grown = impostorRadius * distance / sqrt(max(squared, 0.01 * impostorRadius * impostorRadius));
    placeInPlant = impostorCentre + grown * (corner.x * right + corner.y * up);
    gl_Position = clipFromWorld * worldFromPlant * vec4(placeInPlant, 1.0);
}
