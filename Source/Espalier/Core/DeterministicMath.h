#pragma once

namespace espalier::math {

// Elementary functions built from + - * / sqrt and integer arithmetic alone, so that they give the same bits with every
// compiler, CPU and libc (libm does not). Arguments follow IEEE: NaN in, NaN out; poles give infinities.
// Each states its error bound in units in the last place (ulp), as tested against long double over many arguments.

inline constexpr double kPi = 3.14159265358979323846;
inline constexpr double kRadiansPerDegree = kPi / 180.0;

struct SinCos
{
    double sin;
    double cos;
};

/// Sine and cosine of radians. |x| <= 1e9: <= 1 ulp. Larger magnitudes and non-finite arguments give NaN.
[[nodiscard]] SinCos sinCos(double radians) noexcept;
[[nodiscard]] double sin(double radians) noexcept;
[[nodiscard]] double cos(double radians) noexcept;

/// Sine and cosine of degrees: exact at multiples of 90 (so cos 90 is 0), otherwise <= 1 ulp after the reduction to
/// [-45, 45] degrees, which is exact. Zeros are positive. |x| <= 1e9, else NaN.
[[nodiscard]] SinCos sinCosDegrees(double degrees) noexcept;

/// Tangent of radians, <= 3 ulp for |x| <= 1e9.
[[nodiscard]] double tan(double radians) noexcept;

/// Angle of (x, y) in [-pi, pi], <= 2 ulp; signed zeros as in IEEE 754 / C (atan2(0, -1) = pi, atan2(-0.0, -1) = -pi).
[[nodiscard]] double atan2(double y, double x) noexcept;
[[nodiscard]] double atan(double x) noexcept; ///< <= 2 ulp
[[nodiscard]] double asin(double x) noexcept; ///< [-pi/2, pi/2], <= 3 ulp; NaN outside [-1, 1].
[[nodiscard]] double acos(double x) noexcept; ///< [0, pi], <= 3 ulp; NaN outside [-1, 1].

/// e^x, <= 1 ulp; overflow gives infinity, underflow goes through the subnormals to 0.
[[nodiscard]] double exp(double x) noexcept;

/// Natural logarithm, <= 1 ulp; log 0 = -infinity, NaN below 0.
[[nodiscard]] double log(double x) noexcept;

/// x^y, <= 2 ulp. Special cases as in C (pow(x, 0) = 1 even for NaN; negative x with non-integer y gives NaN).
[[nodiscard]] double pow(double x, double y) noexcept;

} // namespace espalier::math
