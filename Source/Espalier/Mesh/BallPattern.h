#pragma once

#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Core/Vector.h>
#include <cstdint>

namespace espalier {

/// How a round ball is cut into triangles: rows of vertices from pole to pole, the seam and the poles once for each
/// texture coordinate, so that all tangents run round.
struct BallPattern
{
    std::uint32_t sides = 12; ///< >= 3
    std::uint32_t stacks = 6; ///< >= 2

    [[nodiscard]] constexpr std::uint32_t vertexCount() const { return (sides + 1) * (stacks + 1); }
    [[nodiscard]] constexpr std::uint32_t indexCount() const { return 6 * sides * (stacks - 1); }

    /// Calls `vertex(outward, along, uv)` for each, in order: unit vectors of a ball whose poles are at -y and +y.
    template <class Vertex>
    void eachVertex(const Vertex& vertex) const
    {
        for (std::uint32_t i = 0; i <= stacks; ++i)
        {
            const math::SinCos polar = math::sinCosDegrees(180.0 * i / stacks);
            for (std::uint32_t j = 0; j <= sides; ++j)
            {
                const math::SinCos round = math::sinCosDegrees(360.0 * (j % sides) / sides);
                const DVec3 outward(polar.sin * round.sin, -polar.cos, polar.sin * round.cos);
                const DVec3 along(round.cos, 0, -round.sin);
                const Vec2 uv(static_cast<float>(j) / static_cast<float>(sides),
                              static_cast<float>(i) / static_cast<float>(stacks));
                vertex(Vec3(outward), Vec3(along), uv);
            }
        }
    }

    /// Calls `triangle(a, b, c)` for each, counter-clockwise from outside, with numbers of vertices.
    template <class Triangle>
    void eachTriangle(const Triangle& triangle) const
    {
        for (std::uint32_t i = 0; i < stacks; ++i)
            for (std::uint32_t j = 0; j < sides; ++j)
            {
                const std::uint32_t low = i * (sides + 1) + j;
                const std::uint32_t high = low + sides + 1;
                if (i > 0)
                    triangle(low, low + 1, high + 1);
                if (i + 1 < stacks)
                    triangle(low, high + 1, high);
            }
    }
};

} // namespace espalier
