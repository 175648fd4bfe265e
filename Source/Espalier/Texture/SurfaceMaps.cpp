#include <Espalier/Texture/SurfaceMaps.h>

#include <algorithm>
#include <cmath>

namespace espalier {

Field blurred(const Field& field, std::uint32_t radius)
{
    const float share = 1.f / static_cast<float>(2 * radius + 1);
    Field across(field.width, field.height);
    for (std::uint32_t y = 0; y < field.height; ++y)
    {
        // Sums in double: what enters a running sum leaves it again to the bit, almost.
        const float* const from = field.row(y);
        float* const to = across.row(y);
        double sum = 0;
        for (std::uint32_t i = 0; i <= 2 * radius; ++i)
            sum += static_cast<double>(from[(i + field.width - radius) % field.width]);
        for (std::uint32_t x = 0; x < field.width; ++x)
        {
            to[x] = static_cast<float>(sum) * share;
            const std::uint32_t entering = x + radius + 1;
            const std::uint32_t leaving = x + field.width - radius;
            sum += static_cast<double>(from[entering >= field.width ? entering - field.width : entering]) -
                   static_cast<double>(from[leaving >= field.width ? leaving - field.width : leaving]);
        }
    }
    Field both(field.width, field.height);
    std::vector<double> sums(field.width, 0);
    for (std::uint32_t i = 0; i <= 2 * radius; ++i)
    {
        const float* const from = across.row((i + field.height - radius) % field.height);
        for (std::uint32_t x = 0; x < field.width; ++x)
            sums[x] += static_cast<double>(from[x]);
    }
    for (std::uint32_t y = 0; y < field.height; ++y)
    {
        float* const to = both.row(y);
        const float* const entering = across.row((y + radius + 1) % field.height);
        const float* const leaving = across.row((y + field.height - radius) % field.height);
        for (std::uint32_t x = 0; x < field.width; ++x)
        {
            to[x] = static_cast<float>(sums[x]) * share;
            sums[x] += static_cast<double>(entering[x]) - static_cast<double>(leaving[x]);
        }
    }
    return both;
}

std::vector<std::uint32_t> nearestDrawn(const std::vector<std::uint8_t>& isDrawn, std::uint32_t wide)
{
    const auto width = static_cast<std::int32_t>(wide);
    const auto height = static_cast<std::int32_t>(isDrawn.size() / wide);
    constexpr std::uint32_t kNone = 0xffffffffu;
    std::vector<std::uint32_t> nearest(isDrawn.size(), kNone);
    for (std::uint32_t i = 0; i < nearest.size(); ++i)
        if (isDrawn[i] != 0)
            nearest[i] = i;
    const auto distance = [&](std::int32_t x, std::int32_t y, std::uint32_t to) {
        const std::int64_t dx = x - static_cast<std::int32_t>(to % wide);
        const std::int64_t dy = y - static_cast<std::int32_t>(to / wide);
        return dx * dx + dy * dy;
    };
    const auto offer = [&](std::int32_t x, std::int32_t y, std::int32_t fromX, std::int32_t fromY) {
        if (fromX < 0 || fromY < 0 || fromX >= width || fromY >= height)
            return;
        const std::uint32_t theirs = nearest[static_cast<std::size_t>(fromY) * wide + static_cast<std::size_t>(fromX)];
        std::uint32_t& own = nearest[static_cast<std::size_t>(y) * wide + static_cast<std::size_t>(x)];
        if (theirs != kNone && (own == kNone || distance(x, y, theirs) < distance(x, y, own)))
            own = theirs;
    };
    for (std::int32_t y = 0; y < height; ++y)
    {
        for (std::int32_t x = 0; x < width; ++x)
            for (const std::int32_t dx : {-1, 0, 1})
                offer(x, y, x + dx, y - 1);
        for (std::int32_t x = 1; x < width; ++x)
            offer(x, y, x - 1, y);
        for (std::int32_t x = width - 2; x >= 0; --x)
            offer(x, y, x + 1, y);
    }
    for (std::int32_t y = height - 1; y >= 0; --y)
    {
        for (std::int32_t x = 0; x < width; ++x)
            for (const std::int32_t dx : {-1, 0, 1})
                offer(x, y, x + dx, y + 1);
        for (std::int32_t x = 1; x < width; ++x)
            offer(x, y, x - 1, y);
        for (std::int32_t x = width - 2; x >= 0; --x)
            offer(x, y, x + 1, y);
    }
    for (std::uint32_t i = 0; i < nearest.size(); ++i)
        if (nearest[i] == kNone)
            nearest[i] = i; // nothing is drawn at all
    return nearest;
}

void adjustMean(std::vector<float>& values, const std::vector<std::uint8_t>& weights, float mean)
{
    double sum = 0;
    double count = 0;
    float greatest = 0;
    for (std::size_t i = 0; i < values.size(); ++i)
        if (weights.empty() || weights[i] != 0)
        {
            sum += static_cast<double>(values[i]);
            count += 1;
            greatest = std::max(greatest, values[i]);
        }
    if (!(sum > 0))
    {
        std::fill(values.begin(), values.end(), mean);
        return;
    }
    const auto current = static_cast<float>(sum / count);
    if (greatest * mean <= current)
    {
        const float factor = mean / current;
        for (float& value : values)
            value *= factor;
        return;
    }
    const float factor = current < greatest ? (1 - mean) / (1 - current / greatest) : 0.f;
    for (float& value : values)
        value = current < greatest ? std::clamp(1 - (1 - value / greatest) * factor, 0.f, 1.f) : mean;
}

void storeNormal(Vec2 slope, std::uint8_t* texel) noexcept
{
    const float scale = 0.5f / std::sqrt(slope.x * slope.x + slope.y * slope.y + 1);
    texel[0] = byteOf(0.5f - slope.x * scale);
    texel[1] = byteOf(0.5f - slope.y * scale);
    texel[2] = byteOf(0.5f + scale);
}

Image normalsOf(const Field& height, float steepness, std::uint32_t threads)
{
    Image image{height.width, height.height, 3, std::vector<std::uint8_t>(3 * height.values.size())};
    const float scale = 0.5f * steepness;
    forEachRow(height.height, threads, [&](std::uint32_t y) {
        const float* const here = height.row(y);
        const float* const above = height.row(y == 0 ? height.height - 1 : y - 1);
        const float* const below = height.row(y + 1 == height.height ? 0 : y + 1);
        std::uint8_t* texel = image.texels.data() + std::size_t{3} * y * height.width;
        for (std::uint32_t x = 0; x < height.width; ++x, texel += 3)
        {
            const std::uint32_t left = x == 0 ? height.width - 1 : x - 1;
            const std::uint32_t right = x + 1 == height.width ? 0 : x + 1;
            storeNormal({scale * (here[right] - here[left]), scale * (above[x] - below[x])}, texel);
        }
    });
    return image;
}

} // namespace espalier
