#include <Espalier/Mesh/Silhouette.h>

#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Species/LeafOutline.h>
#include <algorithm>
#include <cmath>
#include <limits>

namespace espalier {
namespace {

constexpr std::uint32_t kSamples = 4; // along each side of a pixel
constexpr std::uint32_t kMostPixels = 2048;

using Mask = SilhouetteScratch::Mask;

/// A picture's place: `right` and up (Y) lead along its sides.
struct View
{
    Vec3 right{1, 0, 0};
    Vec2 origin{0};   ///< Metres, its lower left corner.
    float sample = 1; ///< Metres between samples.
    std::uint32_t columns = 0;
    std::uint32_t rows = 0; ///< Of samples; multiples of kSamples.

    [[nodiscard]] Vec2 place(const Vec3& p) const { return (Vec2(glm::dot(p, right), p.y) - origin) / sample; }
};

View viewFrom(std::uint32_t side, const TreeMesh& full, const TreeMesh& coarse, float pixel)
{
    const math::SinCos turn = math::sinCosDegrees(360.0 * side / kSilhouetteViews);
    View view;
    view.right = {static_cast<float>(turn.cos), 0, -static_cast<float>(turn.sin)};
    Vec2 low(std::numeric_limits<float>::max());
    Vec2 high(std::numeric_limits<float>::lowest());
    for (const TreeMesh* mesh : {&full, &coarse})
        for (const Vec3& p : mesh->positions)
        {
            const Vec2 place(glm::dot(p, view.right), p.y);
            low = glm::min(low, place);
            high = glm::max(high, place);
        }
    const Vec2 size = glm::max(high - low, Vec2(0));
    pixel = std::max({pixel, size.x / kMostPixels, size.y / kMostPixels, 1e-6f});
    const auto pixels = [&](float length) { return static_cast<std::uint32_t>(length / pixel) + 1; };
    view.origin = low;
    view.sample = pixel / kSamples;
    view.columns = pixels(size.x) * kSamples;
    view.rows = pixels(size.y) * kSamples;
    return view;
}

bool isCovered(const Mask& mask, Vec2 uv)
{
    const auto cell = [](float c) {
        return static_cast<std::uint32_t>(std::clamp(c, 0.f, 0.9999f) * static_cast<float>(Mask::kSide));
    };
    return mask.cells[cell(uv.y) * Mask::kSide + cell(uv.x)] != 0;
}

/// Covers the samples in one triangle, where `mask` (if there is one) does not cut it out.
void drawTriangle(const TreeMesh& mesh, const std::uint32_t* corner, const View& view, const Mask* mask,
                  std::vector<std::uint8_t>& samples)
{
    const Vec2 a = view.place(mesh.positions[corner[0]]);
    const Vec2 b = view.place(mesh.positions[corner[1]]);
    const Vec2 c = view.place(mesh.positions[corner[2]]);
    const Vec2 ab = b - a;
    const Vec2 ac = c - a;
    const float area = ab.x * ac.y - ab.y * ac.x;
    if (area == 0)
        return;
    // Samples lie in the middle of their cells.
    const auto first = [](float low) { return static_cast<std::uint32_t>(std::max(std::ceil(low - 0.5f), 0.f)); };
    const auto end = [](float high, std::uint32_t count) {
        return static_cast<std::uint32_t>(std::clamp(std::ceil(high - 0.5f), 0.f, static_cast<float>(count)));
    };
    const std::uint32_t right = end(std::max({a.x, b.x, c.x}), view.columns);
    const std::uint32_t top = end(std::max({a.y, b.y, c.y}), view.rows);
    for (std::uint32_t row = first(std::min({a.y, b.y, c.y})); row < top; ++row)
        for (std::uint32_t column = first(std::min({a.x, b.x, c.x})); column < right; ++column)
        {
            const Vec2 arm = Vec2(static_cast<float>(column) + 0.5f, static_cast<float>(row) + 0.5f) - a;
            const float v = (arm.x * ac.y - arm.y * ac.x) / area;
            const float w = (ab.x * arm.y - ab.y * arm.x) / area;
            if (v < 0 || w < 0 || v + w > 1)
                continue;
            std::uint8_t& sample = samples[std::size_t{row} * view.columns + column];
            if (sample != 0)
                continue;
            const Vec2 uv = (1 - v - w) * mesh.uvs[corner[0]] + v * mesh.uvs[corner[1]] + w * mesh.uvs[corner[2]];
            sample = !mask || isCovered(*mask, uv) ? 1 : 0;
        }
}

/// How many samples of each pixel a mesh covers.
void draw(const TreeMesh& mesh, const View& view, SilhouetteScratch& scratch, std::vector<std::uint8_t>& pixels)
{
    scratch.samples.assign(std::size_t{view.columns} * view.rows, 0);
    for (const MeshPart& part : mesh.parts)
    {
        const bool isCut = part.material == MeshMaterial::Leaves && part.colour < scratch.masks.size();
        const Mask* mask = isCut ? &scratch.masks[part.colour] : nullptr;
        for (std::uint32_t i = 0; i + 2 < part.indexCount; i += 3)
            drawTriangle(mesh, &mesh.indices[part.firstIndex + i], view, mask, scratch.samples);
    }
    const std::uint32_t columns = view.columns / kSamples;
    pixels.assign(std::size_t{columns} * (view.rows / kSamples), 0);
    for (std::uint32_t row = 0; row < view.rows; ++row)
        for (std::uint32_t column = 0; column < view.columns; ++column)
            pixels[std::size_t{row / kSamples} * columns + column / kSamples] =
                static_cast<std::uint8_t>(pixels[std::size_t{row / kSamples} * columns + column / kSamples] +
                                          scratch.samples[std::size_t{row} * view.columns + column]);
}

void makeMasks(std::span<const LeafAppearance> kinds, std::vector<Mask>& masks)
{
    masks.resize(kinds.size());
    for (std::size_t kind = 0; kind < kinds.size(); ++kind)
    {
        const LeafSurface surface(kinds[kind]);
        masks[kind].cells.assign(std::size_t{Mask::kSide} * Mask::kSide, 0);
        for (std::uint32_t y = 0; y < Mask::kSide; ++y)
            for (std::uint32_t x = 0; x < Mask::kSide; ++x)
            {
                const Vec2 uv =
                    Vec2(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f) / static_cast<float>(Mask::kSide);
                masks[kind].cells[y * Mask::kSide + x] = surface.at(uv) ? 1 : 0;
            }
    }
}

} // namespace

SilhouetteDifference compareSilhouettes(const TreeMesh& full, const TreeMesh& coarse,
                                        std::span<const LeafAppearance> kinds, float pixel, SilhouetteScratch& scratch)
{
    makeMasks(kinds, scratch.masks);
    std::uint64_t covered = 0;
    std::uint64_t coveredByCoarse = 0;
    std::uint64_t different = 0;
    for (std::uint32_t side = 0; side < kSilhouetteViews && !full.positions.empty(); ++side)
    {
        const View view = viewFrom(side, full, coarse, pixel);
        draw(full, view, scratch, scratch.full);
        draw(coarse, view, scratch, scratch.coarse);
        for (std::size_t i = 0; i < scratch.full.size(); ++i)
        {
            covered += scratch.full[i];
            coveredByCoarse += scratch.coarse[i];
            different += static_cast<std::uint64_t>(std::abs(int{scratch.full[i]} - int{scratch.coarse[i]}));
        }
    }
    if (covered == 0)
        return {};
    const auto share = [&](std::uint64_t part) {
        return static_cast<float>(static_cast<double>(part) / static_cast<double>(covered));
    };
    return {.coverage = share(coveredByCoarse), .outline = share(different)};
}

} // namespace espalier
