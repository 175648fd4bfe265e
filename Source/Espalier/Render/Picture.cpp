#include <Espalier/Render/Picture.h>

#include <Espalier/Texture/Image.h>
#include <algorithm>
#include <array>
#include <limits>

namespace espalier {

namespace {

constexpr std::uint32_t kCellWidth = 6;
constexpr std::uint32_t kCellHeight = 8;
constexpr std::uint32_t kGlyphsPerBand = 16;

// Space to ~, sixteen glyphs a band. Seven rows stand on the base line, the eighth holds descenders.
// clang-format off
constexpr std::array<std::string_view, 6 * kCellHeight> kGlyphs{
    "........#....#.#..........#...##..#..##.....#......#...#......................................#.",
    "........#....#.#...#.#...####.##..#.#..#....#.....#.....#.....#.....#.........................#.",
    "........#....#.#..#####.#.#......#..#.#.....#....#.......#..#.#.#...#........................#..",
    "........#..........#.#...###....#....#...........#.......#...###..#####........###..........#...",
    "........#..........#.#....#.#..#....#.#.#........#.......#..#.#.#...#......................#....",
    "..................#####.####..#..##.#..#..........#.....#.....#.....#.....#...............#.....",
    "........#..........#.#....#...#..##..##.#..........#...#..................#...........#...#.....",
    ".........................................................................#......................",

    ".###....#....###...###.....#..#####..###..#####..###...###.................................###..",
    "#...#..##...#...#.#...#...##..#.....#.........#.#...#.#...#................#.........#....#...#.",
    "#...#...#.......#.....#..#.#..####..#........#..#...#.#...#...#.....#.....#...#####...#.......#.",
    "#.#.#...#......#....##..#..#......#.####.....#...###...####..............#.............#.....#..",
    "#...#...#.....#.......#.#####.....#.#...#...#...#...#.....#...............#...#####...#.....#...",
    "#...#...#....#....#...#....#..#...#.#...#...#...#...#.....#...#.....#......#.........#..........",
    ".###...###..#####..###.....#...###...###....#....###...###..........#.......................#...",
    "...................................................................#............................",

    ".###....#...####...###..####..#####.#####..###..#...#..###....###.#...#.#.....#...#.#...#..###..",
    "#...#..#.#..#...#.#...#.#...#.#.....#.....#...#.#...#...#......#..#..#..#.....##.##.#...#.#...#.",
    "#.###.#...#.#...#.#.....#...#.#.....#.....#.....#...#...#......#..#.#...#.....#.#.#.##..#.#...#.",
    "#.#.#.#...#.####..#.....#...#.####..####..#.###.#####...#......#..##....#.....#.#.#.#.#.#.#...#.",
    "#.###.#####.#...#.#.....#...#.#.....#.....#...#.#...#...#......#..#.#...#.....#...#.#..##.#...#.",
    "#.....#...#.#...#.#...#.#...#.#.....#.....#...#.#...#...#...#..#..#..#..#.....#...#.#...#.#...#.",
    ".###..#...#.####...###..####..#####.#......###..#...#..###...##...#...#.#####.#...#.#...#..###..",
    "................................................................................................",

    "####...###..####...###..#####.#...#.#...#.#...#.#...#.#...#.#####..###..#......###....#.........",
    "#...#.#...#.#...#.#...#...#...#...#.#...#.#...#.#...#.#...#.....#..#....#........#...#.#........",
    "#...#.#...#.#...#.#.......#...#...#.#...#.#...#..#.#...#.#.....#...#.....#.......#..#...#.......",
    "####..#...#.####...###....#...#...#.#...#.#.#.#...#.....#.....#....#......#......#..............",
    "#.....#.#.#.#.#.......#...#...#...#..#.#..#.#.#..#.#....#....#.....#.......#.....#..............",
    "#.....#..#..#..#..#...#...#...#...#..#.#..##.##.#...#...#...#......#........#....#..............",
    "#......##.#.#...#..###....#....###....#...#...#.#...#...#...#####..###......#..###..............",
    "..........................................................................................#####.",

    ".#..........#...............#.........##........#.......#......#..#......##.....................",
    "..#.........#...............#........#..........#.................#.......#.....................",
    ".......###..####...###...####..###..####...####.####...##.....##..#..#....#...####..####...###..",
    "..........#.#...#.#...#.#...#.#...#..#....#...#.#...#...#......#..#.#.....#...#.#.#.#...#.#...#.",
    ".......####.#...#.#.....#...#.#####..#....#...#.#...#...#......#..##......#...#.#.#.#...#.#...#.",
    "......#...#.#...#.#...#.#...#.#......#.....####.#...#...#......#..#.#.....#...#.#.#.#...#.#...#.",
    ".......####.####...###...####..###...#........#.#...#..###.....#..#..#...###..#.#.#.#...#..###..",
    "...........................................###...............##.................................",

    ".........................#...........................................#....#....#................",
    ".........................#..........................................#.....#.....#...............",
    "####...####.#.##...####.####..#...#.#...#.#...#.#...#.#...#.#####...#.....#.....#....#..#.......",
    "#...#.#...#.##..#.#......#....#...#.#...#.#.#.#..#.#..#...#....#...#......#......#..#.##........",
    "#...#.#...#.#......###...#....#...#.#...#.#.#.#...#...#...#...#.....#.....#.....#...............",
    "####...####.#.........#..#....#...#..#.#..#.#.#..#.#...####..#......#.....#.....#...............",
    "#.........#.#.....####....##...####...#....#.#..#...#.....#.#####....#....#....#................",
    "#.........#............................................###......................................",
};
// clang-format on

bool isLit(char character, int column, int row)
{
    if (column < 0 || row < 0 || column >= static_cast<int>(kCellWidth) || row >= static_cast<int>(kCellHeight))
        return false;
    const auto glyph = static_cast<std::size_t>(character - ' ');
    const std::size_t line = glyph / kGlyphsPerBand * kCellHeight + static_cast<std::size_t>(row);
    return kGlyphs[line][glyph % kGlyphsPerBand * kCellWidth + static_cast<std::size_t>(column)] == '#';
}

struct Stroke
{
    Vec2 from;
    Vec2 to;
};

/// The dots of a glyph joined to lines, in cells: large text is round and smooth, at scale 1 it is the dots themselves.
std::vector<Stroke> strokesOf(char character)
{
    std::vector<Stroke> strokes;
    for (int row = 0; row < static_cast<int>(kCellHeight); ++row)
        for (int column = 0; column < static_cast<int>(kCellWidth); ++column)
        {
            if (!isLit(character, column, row))
                continue;
            const Vec2 here(static_cast<float>(column) + 0.5f, static_cast<float>(row) + 0.5f);
            const auto join = [&](int right, int down) {
                if (isLit(character, column + right, row + down))
                    strokes.push_back({here, here + Vec2(static_cast<float>(right), static_cast<float>(down))});
            };
            strokes.push_back({here, here});
            join(1, 0);
            join(0, 1);
            // A diagonal inside a corner would fill it.
            const bool below = isLit(character, column, row + 1);
            if (!below && !isLit(character, column + 1, row))
                join(1, 1);
            if (!below && !isLit(character, column - 1, row))
                join(-1, 1);
        }
    return strokes;
}

float distanceTo(const Stroke& stroke, Vec2 point)
{
    const Vec2 along = stroke.to - stroke.from;
    const float lengthSquared = glm::dot(along, along);
    const float t = lengthSquared > 0 ? glm::dot(point - stroke.from, along) / lengthSquared : 0.0f;
    return glm::length(point - stroke.from - std::clamp(t, 0.0f, 1.0f) * along);
}

} // namespace

void paste(const Picture& source, std::uint32_t x, std::uint32_t y, Picture& target)
{
    if (x >= target.width || y >= target.height)
        return;
    const std::size_t width = std::min(source.width, target.width - x);
    const std::uint32_t height = std::min(source.height, target.height - y);
    for (std::uint32_t row = 0; row < height; ++row)
        std::copy_n(source.rgb.begin() + std::ptrdiff_t{3} * row * source.width, 3 * width,
                    target.rgb.begin() + std::ptrdiff_t{3} * (std::ptrdiff_t{y + row} * target.width + x));
}

void drawText(std::string_view text, std::uint32_t x, std::uint32_t y, std::uint32_t scale, Vec3 srgb, Picture& target)
{
    const auto size = static_cast<float>(scale);
    std::uint64_t left = x;
    for (std::size_t i = 0; i < text.size() && left < target.width; ++i, left += std::uint64_t{kCellWidth} * scale)
    {
        const std::vector<Stroke> strokes = strokesOf(text[i] >= ' ' && text[i] <= '~' ? text[i] : '?');
        const auto right = std::min<std::uint64_t>(target.width, left + std::uint64_t{kCellWidth} * scale);
        const auto bottom = std::min<std::uint64_t>(target.height, y + std::uint64_t{kCellHeight} * scale);
        for (std::uint64_t row = y; row < bottom; ++row)
            for (std::uint64_t column = left; column < right; ++column)
            {
                const Vec2 point((static_cast<float>(column - left) + 0.5f) / size,
                                 (static_cast<float>(row - y) + 0.5f) / size);
                float distance = std::numeric_limits<float>::max();
                for (const Stroke& stroke : strokes)
                    distance = std::min(distance, distanceTo(stroke, point));
                const float cover = std::clamp(0.5f + (0.5f - distance) * size, 0.0f, 1.0f);
                std::uint8_t* pixel = target.rgb.data() + 3 * (row * target.width + column);
                for (int channel = 0; channel < 3; ++channel)
                {
                    const float ink = std::clamp(srgb[channel], 0.0f, 1.0f) * 255.0f;
                    const float paper = pixel[channel];
                    pixel[channel] = static_cast<std::uint8_t>(paper + (ink - paper) * cover + 0.5f);
                }
            }
    }
}

std::string encodePng(const Picture& picture)
{
    return encodePng(Image{picture.width, picture.height, 3, picture.rgb});
}

} // namespace espalier
