#pragma once

#include <span>
#include <vector>

namespace espalier {

/// How far two distributions over the same categories are apart, [0, 1] bit (Lin, "Divergence measures based on the
/// Shannon entropy", 1991). `a` and `b` are counts or weights >= 0 of equal length; sums need not agree. 1 if only one
/// of them is empty, 0 if both are.
[[nodiscard]] double jensenShannon(std::span<const double> a, std::span<const double> b);

/// The earth mover's distance on the line: how far a unit of probability travels on average from one sample to the
/// other (Vallender 1974: the area between the distribution functions). In the unit of the values, in any order; 0 if
/// either is empty.
[[nodiscard]] double wasserstein(std::vector<double> a, std::vector<double> b);

/// The same on a circle of circumference `period` > 0 (Rabin, Delon & Gousseau, "Transportation distances on the
/// circle", 2011): the way round may be the shorter one.
[[nodiscard]] double circularWasserstein(std::vector<double> a, std::vector<double> b, double period);

/// 0 of no values.
[[nodiscard]] double meanOf(std::span<const double> values);

/// In any order; of an even number of values the mean of the two in the middle, 0 of none.
[[nodiscard]] double medianOf(std::vector<double> values);

/// The standard deviation (over n); 0 of no values.
[[nodiscard]] double deviationOf(std::span<const double> values);

/// Of directions in degrees: the root mean square of the way round from each to their mean direction. Unlike the
/// circular standard deviation it stays finite, at most 180 degrees / sqrt 3 where there is no direction.
[[nodiscard]] double circularDeviationOf(std::span<const double> degrees);

} // namespace espalier
