#include <Espalier/Core/DeterministicMath.h>

#include <array>
#include <bit>
#include <cfloat>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

// Each function reduces its argument to a small interval, where a Taylor polynomial converges quickly, and puts the
// result together from a table. What must be more precise than a double is carried as an unevaluated sum of two
// (T. J. Dekker, "A floating-point technique for extending the available precision", 1971). The tables are computed by
// the compiler in that arithmetic, so there are few constants to mistrust: those below are leading bits of pi and ln 2.

namespace espalier::math {

static_assert(FLT_EVAL_METHOD == 0, "intermediate results must be doubles; on x86-32 compile with -msse2 -mfpmath=sse");

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// The number high + low, with |low| <= ulp(high) / 2 where it matters.
struct Pair
{
    double high = 0;
    double low = 0;
};

// a + b, exactly.
constexpr Pair exactSum(double a, double b)
{
    const double sum = a + b;
    const double bRounded = sum - a;
    return {sum, (a - (sum - bRounded)) + (b - bRounded)};
}

// a + b, exactly, if |a| >= |b|.
constexpr Pair exactSumOrdered(double a, double b)
{
    const double sum = a + b;
    return {sum, b - (sum - a)};
}

// The upper 26 bits; what is left of x fits in 26 bits too. |x| < 2^996.
constexpr double upperBits(double x)
{
    const double shifted = x * 0x1.0000002p27;
    return shifted - (shifted - x);
}

// a * b, exactly, unless a part of it underflows.
constexpr Pair exactProduct(double a, double b)
{
    const double product = a * b;
    const double aHigh = upperBits(a);
    const double aLow = a - aHigh;
    const double bHigh = upperBits(b);
    const double bLow = b - bHigh;
    return {product, ((aHigh * bHigh - product) + aHigh * bLow + aLow * bHigh) + aLow * bLow};
}

constexpr Pair operator+(Pair a, Pair b)
{
    const Pair sum = exactSum(a.high, b.high);
    return exactSumOrdered(sum.high, sum.low + (a.low + b.low));
}

constexpr Pair operator-(Pair a, Pair b)
{
    return a + Pair{-b.high, -b.low};
}

constexpr Pair operator*(Pair a, Pair b)
{
    const Pair product = exactProduct(a.high, b.high);
    return exactSumOrdered(product.high, product.low + (a.high * b.low + a.low * b.high));
}

constexpr Pair operator/(double a, Pair b)
{
    const double quotient = a / b.high;
    const Pair product = exactProduct(quotient, b.high);
    const double rest = ((a - product.high) - product.low) - quotient * b.low;
    return {quotient, rest / b.high};
}

constexpr Pair kPiPair = {0x1.921fb54442d18p+1, 0x1.1a62633145c07p-53};
constexpr Pair kHalfPi = {0x1.921fb54442d18p+0, 0x1.1a62633145c07p-54};
constexpr Pair kRadiansPerDegreePair = {0x1.1df46a2529d39p-6, 0x1.5c1d8becdd291p-62};
constexpr double kTwoOverPi = 0x1.45f306dc9c883p-1;

// c0 + c1 x + c2 x^2 + ...
template <class... Rest>
constexpr double polynomial(double x, double c0, Rest... rest)
{
    if constexpr (sizeof...(rest) == 0)
        return c0;
    else
        return c0 + x * polynomial(x, rest...);
}

std::int64_t nearestInteger(double x)
{
    return static_cast<std::int64_t>(x < 0 ? x - 0.5 : x + 0.5);
}

double absolute(double x)
{
    return x < 0 ? -x : x;
}

// ---- Sine, cosine, tangent -----------------------------------------------------------------------------------------

constexpr double kLargestAngle = 1e9;

// The largest angle whose sine is itself and whose cosine is 1, in doubles. Also keeps the sign of zero.
constexpr double kTinyAngle = 0x1p-27;

// |x| <= pi/4 and a bit. The halves of the polynomials run side by side, in x^4.
SinCos sinCosSmall(Pair x)
{
    const double x2 = x.high * x.high;
    const double x4 = x2 * x2;
    const double sinTail =
        polynomial(x4, -1.0 / 6.0, -1.0 / 5040.0, -1.0 / 39916800.0, -1.0 / 1307674368000.0) +
        x2 * polynomial(x4, 1.0 / 120.0, 1.0 / 362880.0, 1.0 / 6227020800.0, 1.0 / 355687428096000.0);
    const double cosTail = polynomial(x4, 1.0 / 24.0, 1.0 / 40320.0, 1.0 / 479001600.0, 1.0 / 20922789888000.0) -
                           x2 * polynomial(x4, 1.0 / 720.0, 1.0 / 3628800.0, 1.0 / 87178291200.0);
    const double halfX2 = 0.5 * x2;
    const Pair oneMinusHalfX2 = exactSumOrdered(1.0, -halfX2);
    return {x.high + (x.high * x2 * sinTail + x.low * (1.0 - halfX2)),
            oneMinusHalfX2.high + (oneMinusHalfX2.low + (x4 * cosTail - x.high * x.low))};
}

// Sine and cosine of x + quarterTurns * 90 degrees from those of x.
SinCos turned(SinCos x, std::int64_t quarterTurns)
{
    switch (quarterTurns & 3)
    {
    case 0:
        return x;
    case 1:
        return {x.cos, -x.sin};
    case 2:
        return {-x.sin, -x.cos};
    default:
        return {-x.cos, x.sin};
    }
}

// x - k pi/2, good to 2^-113: no double up to kLargestAngle is nearer to a multiple of pi/2 than 2^-60.5.
Pair withoutQuarterTurns(double x, double k)
{
    // pi/2 in pieces of 23 bits, so that their products with k < 2^30 are exact.
    const double rest = x - k * 0x1.921fb4p+0;
    const Pair second = exactSum(rest, -k * 0x1.4442dp-24);
    const Pair third = exactSum(second.high, -k * 0x1.846988p-48);
    const Pair fourth = exactSum(third.high, -k * 0x1.8cc514p-72);
    const Pair fifth = exactSum(fourth.high, -k * 0x1.80dc1cd129025p-95);
    return exactSum(fifth.high, ((second.low + third.low) + fourth.low) + fifth.low);
}

} // namespace

SinCos sinCos(double radians) noexcept
{
    if (!(absolute(radians) <= kLargestAngle))
        return {kNaN, kNaN};
    if (absolute(radians) < kTinyAngle)
        return {radians, 1.0};
    if (absolute(radians) <= kPi / 4)
        return sinCosSmall({radians, 0.0});
    const std::int64_t k = nearestInteger(radians * kTwoOverPi);
    return turned(sinCosSmall(withoutQuarterTurns(radians, static_cast<double>(k))), k);
}

double sin(double radians) noexcept
{
    return sinCos(radians).sin;
}

double cos(double radians) noexcept
{
    return sinCos(radians).cos;
}

SinCos sinCosDegrees(double degrees) noexcept
{
    if (!(absolute(degrees) <= kLargestAngle))
        return {kNaN, kNaN};
    const std::int64_t k = nearestInteger(degrees * (1.0 / 90.0));
    const double rest = degrees - 90.0 * static_cast<double>(k); // Exact: both are multiples of ulp(degrees).
    const SinCos result = turned(sinCosSmall(Pair{rest, 0.0} * kRadiansPerDegreePair), k);
    return {result.sin + 0.0, result.cos + 0.0}; // -0 becomes 0.
}

double tan(double radians) noexcept
{
    const SinCos result = sinCos(radians);
    return result.sin / result.cos;
}

// ---- Inverse functions ---------------------------------------------------------------------------------------------

namespace {

// atan(c/16) by Euler's series, sum of (2n)!! / (2n+1)!! y^n x / (1 + x^2) with y = x^2 / (1 + x^2).
constexpr Pair atanOfSixteenths(int c)
{
    const Pair denominator = {256.0 + c * c, 0};
    const Pair y = (1.0 * c * c) / denominator;
    Pair sum = {1, 0};
    for (int n = 110; n >= 1; --n)
        sum = Pair{1, 0} + sum * y * ((2.0 * n) / Pair{2.0 * n + 1.0, 0});
    return sum * ((16.0 * c) / denominator);
}

// atan of the middles 3/16, 5/16, ... 15/16 of the eighths from 1/8 to 1.
constexpr auto kAtanTable = [] {
    std::array<Pair, 7> table;
    for (int i = 0; i < 7; ++i)
        table[static_cast<std::size_t>(i)] = atanOfSixteenths(2 * i + 3);
    return table;
}();

// atan(a/b) for 0 <= a <= b, b finite and positive.
Pair atanOfQuotient(double a, double b)
{
    const double quotient = a / b;
    if (quotient < 0x1p-30)
        return {quotient, 0}; // From here on the two are of similar size, so scaling loses nothing.
    if (b > 0x1p500)
    {
        a *= 0x1p-600;
        b *= 0x1p-600;
    }
    else if (b < 0x1p-400)
    {
        a *= 0x1p600;
        b *= 0x1p600;
    }

    Pair base;
    Pair t;
    if (quotient < 0.125)
    {
        t = a / Pair{b, 0};
    }
    else
    {
        // atan(a/b) = atan(c) + atan((a - c b) / (b + c a))
        const int eighth = quotient < 1 ? static_cast<int>(quotient * 8) : 7;
        const double c = (2 * eighth + 1) / 16.0;
        const Pair cb = exactProduct(c, b);
        base = kAtanTable[static_cast<std::size_t>(eighth - 1)];
        t.high = ((a - cb.high) - cb.low) / (b + c * a);
    }
    const double t2 = t.high * t.high;
    const double t4 = t2 * t2;
    const double tail = t2 * polynomial(t4, 1.0 / 5.0, 1.0 / 9.0, 1.0 / 13.0, 1.0 / 17.0) -
                        polynomial(t4, 1.0 / 3.0, 1.0 / 7.0, 1.0 / 11.0, 1.0 / 15.0);
    const Pair sum = exactSum(base.high, t.high);
    return exactSumOrdered(sum.high, sum.low + (base.low + (t.low + t.high * t2 * tail)));
}

} // namespace

double atan2(double y, double x) noexcept
{
    if (x != x || y != y)
        return kNaN;
    const double width = absolute(x);
    const double height = absolute(y);
    const double smaller = height < width ? height : width;
    const double larger = height < width ? width : height;

    Pair angle;
    if (smaller == kInfinity)
        angle = atanOfQuotient(1, 1);
    else if (larger > 0 && larger < kInfinity)
        angle = atanOfQuotient(smaller, larger);
    if (height > width)
        angle = kHalfPi - angle;
    if (std::signbit(x))
        angle = kPiPair - angle;
    return std::copysign(angle.high, y);
}

double atan(double x) noexcept
{
    return atan2(x, 1.0);
}

double asin(double x) noexcept
{
    return absolute(x) <= 1 ? atan2(x, std::sqrt((1 - x) * (1 + x))) : kNaN;
}

double acos(double x) noexcept
{
    return absolute(x) <= 1 ? atan2(std::sqrt((1 - x) * (1 + x)), x) : kNaN;
}

// ---- Exponential, logarithm, power ---------------------------------------------------------------------------------

namespace {

// 2^(i/32)
constexpr auto kPowersTable = [] {
    constexpr Pair kRoot = {0x1.059b0d3158574p+0, 0x1.d73e2a475b465p-55};
    std::array<Pair, 32> table;
    table[0] = {1, 0};
    for (std::size_t i = 1; i < table.size(); ++i)
        table[i] = table[i - 1] * kRoot;
    return table;
}();

// log(F) = 2 atanh((F - 1) / (F + 1)) for F = k/32.
constexpr Pair logOf32nds(int k)
{
    const Pair s = (k - 32.0) / Pair{k + 32.0, 0};
    const Pair s2 = s * s;
    Pair sum;
    for (int n = 51; n >= 1; n -= 2)
        sum = sum * s2 + 2.0 / Pair{1.0 * n, 0};
    return sum * s;
}

// The 32nds nearest to the numbers from sqrt(1/2) to sqrt(2).
constexpr int kFirst32nd = 23;
constexpr int kLast32nd = 45;
constexpr auto kLogTable = [] {
    std::array<Pair, kLast32nd - kFirst32nd + 1> table;
    for (int k = kFirst32nd; k <= kLast32nd; ++k)
        table[static_cast<std::size_t>(k - kFirst32nd)] = logOf32nds(k);
    return table;
}();

double powerOfTwo(int exponent)
{
    return std::bit_cast<double>(static_cast<std::uint64_t>(exponent + 1023) << 52);
}

// e^x for |x| < 1000: x = (32 k + j) ln2/32 + r, so e^x = 2^k 2^(j/32) e^r.
double expOfPair(Pair x)
{
    const auto n = static_cast<int>(nearestInteger(x.high * 0x1.71547652b82fep+5));
    // The upper part of ln2/32 has 36 bits, so that its product with n < 2^17 is exact.
    const double r = ((x.high - n * 0x1.62e42fefap-6) - n * 0x1.cf79abc9e3b3ap-45) + x.low;
    const double expMinusOne = r + r * r * polynomial(r, 1.0 / 2.0, 1.0 / 6.0, 1.0 / 24.0, 1.0 / 120.0, 1.0 / 720.0);
    const Pair power = kPowersTable[static_cast<std::size_t>(n & 31)];
    const double mantissa = power.high + (power.low + power.high * expMinusOne);

    // In two steps, because 2^k alone can overflow or underflow where the product does not. Only the last one rounds.
    const int k = n >> 5;
    const int half = k >> 1;
    return mantissa * powerOfTwo(half) * powerOfTwo(k - half);
}

// log(x) for positive finite x, good to about 2^-65 of itself: x = 2^e m, log x = e ln2 + log F + 2 atanh(s) with
// F the 32nd nearest to m and s = (m - F) / (m + F). Near 1 only the last term is left, so nothing cancels.
Pair logToPair(double x)
{
    int e = -1023;
    if (x < std::numeric_limits<double>::min())
    {
        x *= 0x1p54;
        e -= 54;
    }
    const auto bits = std::bit_cast<std::uint64_t>(x);
    e += static_cast<int>(bits >> 52);
    double m = std::bit_cast<double>((bits & 0x000fffffffffffffu) | 0x3ff0000000000000u);
    if (m > 1.4142135623730951)
    {
        m *= 0.5;
        ++e;
    }

    const int k = static_cast<int>(m * 32 + 0.5);
    const double f = k / 32.0;
    const Pair logF = kLogTable[static_cast<std::size_t>(k - kFirst32nd)];
    const Pair s = (m - f) / exactSum(m, f);
    const double s2 = s.high * s.high;
    const double tail = s.high * s2 * polynomial(s2, 2.0 / 3.0, 2.0 / 5.0, 2.0 / 7.0, 2.0 / 9.0, 2.0 / 11.0);

    // The upper part of ln 2 has 42 bits, so that its product with e is exact.
    const Pair coarse = exactSum(e * 0x1.62e42fefa38p-1, logF.high);
    const Pair sum = exactSum(coarse.high, 2 * s.high);
    const double low = e * 0x1.ef35793c7673p-45 + logF.low + coarse.low;
    return exactSumOrdered(sum.high, sum.low + (low + (2 * s.low + tail)));
}

// The largest double below which not every number is an integer is 2^53; all from there on are even.
bool isInteger(double y)
{
    return absolute(y) >= 0x1p53 || y == static_cast<double>(static_cast<std::int64_t>(y));
}

bool isOddInteger(double y)
{
    return absolute(y) < 0x1p53 && isInteger(y) && (static_cast<std::int64_t>(y) & 1) != 0;
}

} // namespace

double exp(double x) noexcept
{
    if (x != x)
        return kNaN;
    if (x > 710)
        return kInfinity;
    if (x < -746)
        return 0;
    return expOfPair({x, 0});
}

double log(double x) noexcept
{
    if (!(x >= 0))
        return kNaN;
    if (x == 0)
        return -kInfinity;
    return x < kInfinity ? logToPair(x).high : kInfinity;
}

double pow(double x, double y) noexcept
{
    if (y == 0 || x == 1)
        return 1;
    if (x != x || y != y)
        return kNaN;
    const double base = absolute(x);
    if (absolute(y) == kInfinity)
        return base == 1 ? 1 : (base > 1) == (y > 0) ? kInfinity : 0;

    const double sign = std::signbit(x) && isOddInteger(y) ? -1 : 1;
    if (base == 0 || base == kInfinity)
        return sign * ((base == 0) == (y < 0) ? kInfinity : 0);
    if (x < 0 && !isInteger(y))
        return kNaN;
    if (base == 1)
        return sign;

    const Pair logBase = logToPair(base);
    const double rough = y * logBase.high;
    if (rough > 710)
        return sign * kInfinity;
    if (rough < -746)
        return sign * 0.0;
    return sign * expOfPair(logBase * Pair{y, 0});
}

} // namespace espalier::math
