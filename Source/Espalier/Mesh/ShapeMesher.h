#pragma once

#include <Espalier/Core/Limits.h>
#include <Espalier/Mesh/TreeMesh.h>
#include <Espalier/Mesh/Triangulation.h>
#include <cstdint>
#include <vector>

namespace espalier {

struct Skeleton;
struct Appearance;

/// How leaves, petals, berries and buds become triangles. Settings outside their ranges are clamped.
struct ShapeSettings
{
    std::uint16_t sphereSides = 12; ///< Round a sphere; half as many from pole to pole: 120 triangles. [4, 64]
    float leafWidth = 0.52f;        ///< Of an organ's leaf, in its lengths. [0.01, 4]
    float leafFold = 0.35f;         ///< Radians by which each half rises along the midrib. [0, 1.5]
    float leafArch = 0.06f;         ///< How high the midrib rises between stalk and tip, in lengths. [-0.5, 0.5]
    MeshStreams streams{};          ///< Tints stay white.
};

/// One planned polygon.
struct FlatShape
{
    std::uint32_t firstCorner = 0; ///< Into ShapeScratch::corners.
    std::uint32_t cornerCount = 0;
    std::uint32_t firstIndex = 0; ///< Into ShapeScratch::triangles.
    std::uint32_t indexCount = 0;
    std::uint32_t colour = 0;
    std::uint32_t polygon = 0; ///< Of the skeleton.
    Vec3 normal{0};            ///< Unit.
    Vec3 up{0};                ///< Unit, normal to it: from the first corner towards the one farthest away.
};

/// Memory that meshing needs in between; reuse it and nothing is allocated after warm-up. One per thread.
struct ShapeScratch
{
    std::vector<FlatShape> shapes;
    std::vector<Vec3> corners; ///< Those of the shapes, repeated ones left out.
    std::vector<DVec2> flattened;
    std::vector<std::uint32_t> triangles; ///< Three numbers each of their shape's corners.
    TriangulationScratch triangulation;
};

/// Appends what `skeleton` draws beyond its segments to `mesh`, as Surface parts: one a colour, in ascending order.
///
/// Polygons: one layer of triangles in the corners given, however they bend inwards, touch or leave their plane a
/// little, with the plane's normal, towards which their corners run counter-clockwise. Spheres: round balls. Organs,
/// whatever their number: an ovate leaf along the heading, `size` long, its halves folded up (cross(heading, left))
/// along the midrib. Shapes without area are skipped. Materials beyond the palette of `appearance` take its last entry.
///
/// Equal input gives equal bytes. Safe to call concurrently on different meshes and scratches.
[[nodiscard]] MeshResult meshShapes(const Skeleton& skeleton, const Appearance& appearance,
                                    const ShapeSettings& settings, const Limits& limits, ShapeScratch& scratch,
                                    TreeMesh& mesh);

/// Adds to `counts` exactly what meshShapes will append, and gives its result: the first of its two passes. Counts are
/// those of the mesh so far, and stay what they are unless the result is Ok.
[[nodiscard]] MeshResult countShapes(const Skeleton& skeleton, const Appearance& appearance,
                                     const ShapeSettings& settings, const Limits& limits, ShapeScratch& scratch,
                                     MeshCounts& counts);

} // namespace espalier
