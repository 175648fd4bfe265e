#pragma once

#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

namespace espalier {

// GLM's plain vectors. Only their arithmetic, dot, cross and length are used: glm::rotate, angleAxis and their like
// call libm, whose bits differ between machines. Rotations come from DeterministicMath.h.
using Vec2 = glm::vec2;
using Vec3 = glm::vec3;
using Vec4 = glm::vec4;
using DVec2 = glm::dvec2;
using DVec3 = glm::dvec3;

} // namespace espalier
