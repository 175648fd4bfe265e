#include <Espalier/Mesh/FoliageLight.h>

#include <Espalier/Core/Simd.h>
#include <Espalier/Mesh/AxisCurve.h>
#include <Espalier/Mesh/RingFrames.h>
#include <algorithm>
#include <cmath>

// Beer's law in a canopy: M. Monsi, T. Saeki, 1953 (in English: "On the factor light in plant communities and its
// importance for matter production", Annals of Botany 95, 2005). Rays go from cube to cube, straight or along
// diagonals, so that each is one look at a neighbour.

namespace espalier {
namespace {

/// Shadow that a square metre of leaves throws, as a share, over all the ways in which they may be turned.
constexpr float kExtinction = 0.5f;

constexpr float kFewestCubes = 1000;
constexpr float kMostCubes = 27000;
constexpr float kMostAlongEdge = 48;

/// Where light comes from, in cubes, and how much of it.
struct Ray
{
    int x;
    int z;
    float length; // in cubes
    float weight;
};
constexpr float kDiagonal = 1.41421356f;
constexpr float kCorner = 1.73205081f;
constexpr std::array<Ray, 9> kFromAbove{{{0, 0, 1, 1.4f},
                                         {1, 0, kDiagonal, 1},
                                         {-1, 0, kDiagonal, 1},
                                         {0, 1, kDiagonal, 1},
                                         {0, -1, kDiagonal, 1},
                                         {1, 1, kCorner, 0.7f},
                                         {1, -1, kCorner, 0.7f},
                                         {-1, 1, kCorner, 0.7f},
                                         {-1, -1, kCorner, 0.7f}}};
constexpr float kFromASide = 0.45f;
constexpr float kAllLight = 1.4f + 4 + 4 * 0.7f + 4 * kFromASide;

/// About e^-x, without its cost.
float dimmed(float x)
{
    return 1 / (1 + x * (1 + x * (0.5f + x * (1.f / 6))));
}

/// The cubes round a place, and what share each has in it: x runs fastest, then y, then z.
struct Corner
{
    std::array<std::size_t, 8> cubes;
    std::array<float, 8> shares;
};

Corner cornerAt(const FoliageLight& grid, const Vec3& place)
{
    std::array<std::size_t, 3> first{};
    std::array<std::size_t, 3> next{};
    std::array<float, 3> share{};
    for (int axis = 0; axis < 3; ++axis)
    {
        const auto i = static_cast<std::size_t>(axis);
        const std::int32_t last = static_cast<std::int32_t>(grid.count[i]) - 1;
        const float at = std::clamp((place[axis] - grid.low[axis]) / grid.edge - 0.5f, 0.f, static_cast<float>(last));
        const auto whole = static_cast<std::int32_t>(at);
        first[i] = static_cast<std::size_t>(whole);
        next[i] = static_cast<std::size_t>(std::min(whole + 1, last));
        share[i] = at - static_cast<float>(whole);
    }
    const std::size_t row = grid.count[0];
    const std::size_t layer = row * grid.count[2];
    const simd::Four x{1 - share[0], share[0], 1 - share[0], share[0]};
    const simd::Four y{1 - share[1], 1 - share[1], share[1], share[1]};
    Corner corner;
    simd::store(&corner.shares[0], x * y * simd::all(1 - share[2]));
    simd::store(&corner.shares[4], x * y * simd::all(share[2]));
    for (std::size_t k = 0; k < 2; ++k)
    {
        const std::size_t z = row * (k == 0 ? first[2] : next[2]);
        const std::size_t low = z + layer * first[1];
        const std::size_t high = z + layer * next[1];
        corner.cubes[4 * k] = low + first[0];
        corner.cubes[4 * k + 1] = low + next[0];
        corner.cubes[4 * k + 2] = high + first[0];
        corner.cubes[4 * k + 3] = high + next[0];
    }
    return corner;
}

void layCubes(std::span<const Shader> leaves, FoliageLight& grid)
{
    Vec3 low = leaves[0].place;
    Vec3 high = low;
    for (const Shader& leaf : leaves)
    {
        low = glm::min(low, leaf.place);
        high = glm::max(high, leaf.place);
    }
    const Vec3 extent = high - low;
    const float largest = std::max({extent.x, extent.y, extent.z, 1e-3f});
    const float wanted = std::clamp(0.5f * static_cast<float>(leaves.size()), kFewestCubes, kMostCubes);
    // The finest edge that needs no more cubes than wanted, found by halving: no cube root, the same bits everywhere.
    float edge = largest / kMostAlongEdge;
    const auto cubesOf = [&](float e) {
        return (std::floor(extent.x / e) + 1) * (std::floor(extent.y / e) + 1) * (std::floor(extent.z / e) + 1);
    };
    while (cubesOf(edge) > wanted)
        edge *= 1.1f;
    grid.edge = edge;
    for (int axis = 0; axis < 3; ++axis)
    {
        const float cubes = std::floor(extent[axis] / edge) + 1;
        grid.count[static_cast<std::size_t>(axis)] = static_cast<std::uint32_t>(cubes);
        grid.low[axis] = 0.5f * (low[axis] + high[axis] - cubes * edge);
    }
}

void addLeaves(std::span<const Shader> leaves, FoliageLight& grid)
{
    const std::size_t cubes = std::size_t{grid.count[0]} * grid.count[1] * grid.count[2];
    grid.density.assign(cubes, 0);
    const float perVolume = 1 / (grid.edge * grid.edge * grid.edge);
    for (const Shader& leaf : leaves)
    {
        const Corner corner = cornerAt(grid, leaf.place);
        for (std::size_t k = 0; k < 8; ++k)
            grid.density[corner.cubes[k]] += corner.shares[k] * leaf.area * perVolume;
    }
}

/// `smooth`: of each cube a quarter from either neighbour along every edge, none from beyond the last.
void smoothen(FoliageLight& grid)
{
    grid.smooth = grid.density;
    const std::array<std::size_t, 3> steps{1, std::size_t{grid.count[0]} * grid.count[2], grid.count[0]};
    for (std::size_t axis = 0; axis < 3; ++axis)
    {
        const std::size_t step = steps[axis];
        const std::size_t count = grid.count[axis];
        for (std::size_t start = 0; start < grid.smooth.size(); ++start)
        {
            if (start / step % count != 0)
                continue;
            float before = 0;
            for (std::size_t i = 0; i < count; ++i)
            {
                float& value = grid.smooth[start + i * step];
                const float after = i + 1 < count ? grid.smooth[start + (i + 1) * step] : 0;
                const float own = value;
                value = 0.25f * before + 0.5f * own + 0.25f * after;
                before = own;
            }
        }
    }
}

/// Down the slope of `smooth`.
void leadOut(FoliageLight& grid)
{
    grid.outward.assign(grid.smooth.size(), Vec3(0));
    const std::size_t row = grid.count[0];
    const std::size_t layer = row * grid.count[2];
    std::size_t cube = 0;
    for (std::size_t y = 0; y < grid.count[1]; ++y)
        for (std::size_t z = 0; z < grid.count[2]; ++z)
            for (std::size_t x = 0; x < row; ++x, ++cube)
            {
                const auto slope = [&](std::size_t at, std::size_t count, std::size_t step) {
                    const float before = at > 0 ? grid.smooth[cube - step] : 0;
                    const float after = at + 1 < count ? grid.smooth[cube + step] : 0;
                    return before - after;
                };
                const Vec3 fall(slope(x, row, 1), slope(y, grid.count[1], layer), slope(z, grid.count[2], row));
                const float length = glm::length(fall);
                const float own = grid.smooth[cube];
                if (length > 0 && own > 0)
                    grid.outward[cube] = fall * (std::min(length / own, 1.f) / length);
            }
}

/// One row of cubes that rays pass: `entered` is what they have passed before, none beyond the edges of the grid.
void passRow(const float* entered, std::size_t count, float half, float weight, const float* density, float* light,
             float* passed)
{
    for (std::size_t i = 0; i < count; ++i)
    {
        const float before = entered != nullptr ? entered[i] : 0;
        const float own = half * density[i];
        light[i] += weight * dimmed(before + own);
        passed[i] = before + 2 * own;
    }
}

/// Layer by layer from the top, each ray on its own.
void shineFromAbove(FoliageLight& grid)
{
    const std::size_t width = grid.count[0];
    const std::size_t breadth = grid.count[2];
    const std::size_t layer = width * breadth;
    grid.depths.resize(2 * layer);
    for (const Ray& ray : kFromAbove)
    {
        const float half = 0.5f * kExtinction * grid.edge * ray.length;
        // Of a row, those cubes that rays enter from another cube.
        const std::size_t start = ray.x < 0 ? 1 : 0;
        const std::size_t end = std::max(start, ray.x > 0 ? width - 1 : width);
        float* above = grid.depths.data(); // what a ray has passed when it leaves a cube
        float* here = above + layer;
        std::fill_n(above, layer, 0.f);
        for (std::size_t y = grid.count[1]; y-- > 0;)
        {
            for (std::size_t z = 0; z < breadth; ++z)
            {
                const bool isInside = !(ray.z < 0 && z == 0) && !(ray.z > 0 && z + 1 == breadth);
                const float* const density = &grid.density[y * layer + z * width];
                float* const light = &grid.light[y * layer + z * width];
                float* const passed = here + z * width;
                const auto pass = [&](std::size_t from, std::size_t to, const float* entered) {
                    passRow(entered, to - from, half, ray.weight, density + from, light + from, passed + from);
                };
                if (!isInside)
                {
                    pass(0, width, nullptr);
                    continue;
                }
                const float* const entered =
                    above + (static_cast<std::ptrdiff_t>(width) * (static_cast<std::ptrdiff_t>(z) + ray.z) + ray.x);
                pass(0, start, nullptr);
                pass(start, end, entered + start);
                pass(end, width, nullptr);
            }
            std::swap(above, here);
        }
    }
}

void shineFromSides(FoliageLight& grid)
{
    const float half = 0.5f * kExtinction * grid.edge;
    const auto pass = [&](std::size_t first, std::size_t step, std::size_t count) {
        float passed = 0;
        for (std::size_t i = 0; i < count; ++i)
        {
            const float own = half * grid.density[first + i * step];
            grid.light[first + i * step] += kFromASide * dimmed(passed + own);
            passed += 2 * own;
        }
        passed = 0;
        for (std::size_t i = count; i-- > 0;)
        {
            const float own = half * grid.density[first + i * step];
            grid.light[first + i * step] += kFromASide * dimmed(passed + own);
            passed += 2 * own;
        }
    };
    const std::size_t row = grid.count[0];
    const std::size_t layer = row * grid.count[2];
    for (std::size_t y = 0; y < grid.count[1]; ++y)
    {
        for (std::size_t z = 0; z < grid.count[2]; ++z)
            pass(y * layer + z * row, 1, grid.count[0]);
        for (std::size_t x = 0; x < row; ++x)
            pass(y * layer + x, row, grid.count[2]);
    }
}

} // namespace

void FoliageLight::measure(std::span<const Shader> leaves)
{
    count = {0, 0, 0};
    density.clear();
    smooth.clear();
    outward.clear();
    light.clear();
    if (leaves.empty())
        return;
    layCubes(leaves, *this);
    addLeaves(leaves, *this);
    smoothen(*this);
    leadOut(*this);
    light.assign(density.size(), 0);
    shineFromAbove(*this);
    shineFromSides(*this);
    for (float& value : light)
        value = std::min(value / kAllLight, 1.f);
}

FoliageLight::Sample FoliageLight::at(const Vec3& place) const noexcept
{
    if (light.empty())
        return {};
    const Corner corner = cornerAt(*this, place);
    Sample sample{0, Vec3(0)};
    for (std::size_t k = 0; k < 8; ++k)
    {
        sample.light += corner.shares[k] * light[corner.cubes[k]];
        sample.outward += corner.shares[k] * outward[corner.cubes[k]];
    }
    return sample;
}

} // namespace espalier
