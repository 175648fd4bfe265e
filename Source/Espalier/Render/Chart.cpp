#include <Espalier/Render/Chart.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace espalier {

namespace {

// sRGB, as drawText takes it.
constexpr Vec3 kPaper{0.984f, 0.976f, 0.957f};
constexpr Vec3 kInk{0.16f, 0.15f, 0.14f};
constexpr Vec3 kFaint{0.62f, 0.60f, 0.56f};
constexpr Vec3 kGrown{0.56f, 0.72f, 0.45f};

constexpr std::uint32_t kMargin = 14;
constexpr std::uint32_t kPlotTop = 44;
constexpr std::uint32_t kPlotBottom = kChartHeight - 34;
constexpr std::uint32_t kPlotWidth = kChartWidth - 2 * kMargin;
constexpr std::uint32_t kGlyph = 6; ///< Width of a character at scale 1.

void fill(std::uint32_t x0, std::uint32_t y0, std::uint32_t x1, std::uint32_t y1, Vec3 srgb, Picture& picture)
{
    for (std::uint32_t y = y0; y < std::min(y1, picture.height); ++y)
        for (std::uint32_t x = x0; x < std::min(x1, picture.width); ++x)
            for (std::uint32_t c = 0; c < 3; ++c)
                picture.rgb[3 * (std::size_t{y} * picture.width + x) + c] =
                    static_cast<std::uint8_t>(std::lround(255.0f * srgb[static_cast<int>(c)]));
}

std::string label(double value)
{
    std::array<char, 32> text{};
    std::snprintf(text.data(), text.size(), "%.3g", value);
    return text.data();
}

/// Heights of bins from `low` to `high`, both series with the same area.
struct Bins
{
    double low = 0;
    double high = 1;
    std::string unit;
    std::vector<double> drawn;
    std::vector<double> grown;
    bool drawnIsOne = false; ///< One value: a line instead of an outline.
};

void normalise(std::vector<double>& bins)
{
    double sum = 0;
    for (const double bin : bins)
        sum += bin;
    for (double& bin : bins)
        bin = sum > 0 ? bin / sum : 0;
}

std::vector<double> count(const std::vector<double>& values, const Bins& bins, std::size_t size)
{
    std::vector<double> result(size);
    for (const double value : values)
    {
        const double place = (value - bins.low) / (bins.high - bins.low) * static_cast<double>(size);
        if (place >= 0 && place < static_cast<double>(size))
            ++result[static_cast<std::size_t>(place)];
    }
    return result;
}

Bins binsOf(const Histogram& histogram)
{
    Bins bins;
    bins.unit = histogram.unit;
    bins.drawnIsOne = histogram.drawn.size() == 1;
    std::vector<double> all = histogram.drawn;
    all.insert(all.end(), histogram.grown.begin(), histogram.grown.end());
    if (all.empty())
        return bins;
    std::ranges::sort(all);
    const std::size_t cut = all.size() / 200;
    bins.low = all[cut];
    bins.high = all[all.size() - 1 - cut];
    for (const double value : histogram.drawn.size() <= 8 ? histogram.drawn : std::vector<double>{})
    {
        bins.low = std::min(bins.low, value);
        bins.high = std::max(bins.high, value);
    }
    constexpr std::size_t kBins = 48;
    std::size_t size = kBins;
    const bool whole = std::ranges::all_of(all, [](double value) { return value == std::floor(value); });
    if (whole && bins.high - bins.low < static_cast<double>(kBins))
    {
        bins.high += 1;
        size = static_cast<std::size_t>(bins.high - bins.low);
    }
    else
        bins.high = bins.high > bins.low ? bins.high + 1e-6 * (bins.high - bins.low) : bins.low + 1;
    bins.drawn = count(histogram.drawn, bins, size);
    bins.grown = count(histogram.grown, bins, size);
    return bins;
}

Picture draw(const std::string& title, Bins bins)
{
    Picture picture(kChartWidth, kChartHeight);
    fill(0, 0, kChartWidth, kChartHeight, kPaper, picture);
    drawText(title, kMargin, 12, 2, kInk, picture);
    fill(kMargin, kPlotBottom, kChartWidth - kMargin, kPlotBottom + 1, kFaint, picture);
    const std::string high = label(bins.high) + " " + bins.unit;
    drawText(label(bins.low), kMargin, kPlotBottom + 8, 2, kFaint, picture);
    const auto width = static_cast<std::uint32_t>(2 * kGlyph * high.size());
    drawText(high, kChartWidth - kMargin - std::min(width, kPlotWidth), kPlotBottom + 8, 2, kFaint, picture);

    normalise(bins.grown);
    normalise(bins.drawn);
    double most = 1e-12;
    for (const double share : bins.grown)
        most = std::max(most, share);
    for (const double share : bins.drawnIsOne ? std::vector<double>{} : bins.drawn)
        most = std::max(most, share);
    const auto left = [&](std::size_t bin) {
        return kMargin + static_cast<std::uint32_t>(bin * kPlotWidth / std::max<std::size_t>(1, bins.grown.size()));
    };
    const auto top = [&](double share) {
        return kPlotBottom - static_cast<std::uint32_t>(std::lround(share / most * (kPlotBottom - kPlotTop)));
    };
    for (std::size_t i = 0; i < bins.grown.size(); ++i)
        fill(left(i), top(bins.grown[i]), left(i + 1), kPlotBottom, kGrown, picture);

    constexpr std::uint32_t kStroke = 2;
    double before = 0;
    for (std::size_t i = 0; i <= bins.drawn.size(); ++i)
    {
        const double here = i < bins.drawn.size() ? bins.drawn[i] : 0;
        if (bins.drawnIsOne && here > 0)
        {
            const std::uint32_t middle = (left(i) + left(i + 1)) / 2;
            fill(middle, kPlotTop, middle + kStroke, kPlotBottom, kInk, picture);
        }
        if (!bins.drawnIsOne)
        {
            fill(left(i), std::min(top(here), top(before)), left(i) + kStroke,
                 std::max(top(here), top(before)) + kStroke, kInk, picture);
            if (i < bins.drawn.size() && here > 0)
                fill(left(i), top(here), left(i + 1) + kStroke, top(here) + kStroke, kInk, picture);
        }
        before = here;
    }
    return picture;
}

} // namespace

Picture drawChart(const Histogram& histogram)
{
    return draw(histogram.title, binsOf(histogram));
}

Picture drawChart(const Profile& profile)
{
    return draw(profile.title, {0, profile.high, profile.unit, profile.drawn, profile.grown, false});
}

Picture chartSheet(const std::string& title, const std::vector<Picture>& charts, std::uint32_t columns)
{
    constexpr std::uint32_t kHeader = 64;
    const auto count = static_cast<std::uint32_t>(charts.size());
    const std::uint32_t rows = (count + columns - 1) / columns;
    Picture sheet(columns * kChartWidth, kHeader + rows * kChartHeight);
    fill(0, 0, sheet.width, sheet.height, kPaper, sheet);
    drawText(title, kMargin, 12, 3, kInk, sheet);

    constexpr std::uint32_t kLegendTop = 44;
    fill(kMargin, kLegendTop + 2, kMargin + 24, kLegendTop + 4, kInk, sheet);
    fill(kMargin, kLegendTop + 2, kMargin + 2, kLegendTop + 14, kInk, sheet);
    fill(kMargin + 22, kLegendTop + 2, kMargin + 24, kLegendTop + 14, kInk, sheet);
    drawText("drawn", kMargin + 34, kLegendTop, 2, kInk, sheet);
    fill(kMargin + 120, kLegendTop + 2, kMargin + 144, kLegendTop + 14, kGrown, sheet);
    drawText("grown", kMargin + 154, kLegendTop, 2, kInk, sheet);
    for (std::uint32_t i = 0; i < count; ++i)
        paste(charts[i], i % columns * kChartWidth, kHeader + i / columns * kChartHeight, sheet);
    return sheet;
}

} // namespace espalier
