#pragma once

#include <Espalier/Render/Picture.h>
#include <cstdint>
#include <string>
#include <vector>

namespace espalier {

/// A small chart of how values are distributed: those of what was drawn by hand as a dark outline, those of what grew
/// as a coloured area.
struct Histogram
{
    std::string title;
    std::string unit;
    std::vector<double> drawn; ///< In any order; one value is shown as a line.
    std::vector<double> grown;
};

/// A curve over bins of equal width from 0 to `high`.
struct Profile
{
    std::string title;
    std::string unit;
    double high = 1;
    std::vector<double> drawn; ///< Of each bin, >= 0.
    std::vector<double> grown; ///< As many.
};

inline constexpr std::uint32_t kChartWidth = 400;  ///< Pixels.
inline constexpr std::uint32_t kChartHeight = 250; ///< Pixels.

/// Bins cover the middle 99 % of all values, whole numbers one each where they are few. Values must be finite.
[[nodiscard]] Picture drawChart(const Histogram& histogram);
[[nodiscard]] Picture drawChart(const Profile& profile);

/// Charts side by side under a title, with the legend.
[[nodiscard]] Picture chartSheet(const std::string& title, const std::vector<Picture>& charts, std::uint32_t columns);

} // namespace espalier
