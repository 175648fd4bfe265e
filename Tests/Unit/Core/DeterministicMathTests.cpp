#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Core/Hash.h>
#include <Espalier/Core/Random.h>
#include <algorithm>
#include <cfloat>
#include <cmath>
#include <gtest/gtest.h>
#include <limits>

namespace espalier {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kSmallest = std::numeric_limits<double>::denorm_min();
constexpr double kLargest = std::numeric_limits<double>::max();
constexpr std::uint32_t kMany = 20000;

// Where long double has 64 bits of mantissa its libm serves as the truth; elsewhere the golden hash must do.
constexpr bool kHasTruth = LDBL_MANT_DIG >= 64;

// The error of `got` in units in the last place of the double nearest to `truth`.
double ulpsFrom(long double truth, double got)
{
    int exponent = 0;
    static_cast<void>(std::frexp(static_cast<double>(truth), &exponent));
    const long double ulp = std::ldexp(1.0L, std::max(exponent - 53, -1074));
    return static_cast<double>(std::fabs(static_cast<long double>(got) - truth) / ulp);
}

double uniform(std::uint32_t i, double low, double high)
{
    return RandomKey(Seed{2}).uniform(Purpose::Sampling, low, high, i);
}

// +-2^uniform(low, high), to meet every magnitude.
double anyMagnitude(std::uint32_t i, double low, double high)
{
    const double value = std::exp2(uniform(i, low, high));
    return uniform(i + 0x80000000u, -1, 1) < 0 ? -value : value;
}

struct WorstError
{
    double ulps = 0;
    double x = 0;
    double y = 0;

    void meet(long double truth, double got, double atX, double atY = 0)
    {
        const double error = ulpsFrom(truth, got);
        if (!(error <= ulps))
            *this = {error, atX, atY};
    }
};

std::ostream& operator<<(std::ostream& out, const WorstError& worst)
{
    return out << worst.ulps << " ulp at " << std::hexfloat << worst.x << ", " << worst.y << std::defaultfloat;
}

struct UnaryCase
{
    const char* name;
    double (*function)(double) noexcept;
    long double (*truth)(long double);
    double bound; ///< ulp, as the header states it.
    double low;   ///< Range of arguments drawn evenly.
    double high;
    double lowExponent; ///< Range of magnitudes 2^e drawn evenly; positive ones only if low >= 0.
    double highExponent;
};

TEST(DeterministicMath, KeepsItsErrorBounds)
{
    if (!kHasTruth)
        GTEST_SKIP();
    const UnaryCase cases[] = {
        {"sin", math::sin, std::sin, 1, -7, 7, -60, 29.8},
        {"cos", math::cos, std::cos, 1, -7, 7, -60, 29.8},
        {"tan", math::tan, std::tan, 3, -7, 7, -60, 29.8},
        {"atan", math::atan, std::atan, 2, -2, 2, -1074, 1023},
        {"asin", math::asin, std::asin, 3, -1, 1, -1074, 0},
        {"acos", math::acos, std::acos, 3, -1, 1, -60, 0},
        {"exp", math::exp, std::exp, 1, -745.2, 709.78, -60, 9.4},
        {"log", math::log, std::log, 1, 0.5, 2, -1074, 1023},
    };
    for (const UnaryCase& c : cases)
    {
        WorstError worst;
        const auto check = [&](double x) { worst.meet(c.truth(x), c.function(x), x); };
        for (std::uint32_t i = 0; i < kMany; ++i)
        {
            check(uniform(i, c.low, c.high));
            const double x = anyMagnitude(i, c.lowExponent, c.highExponent);
            check(c.low < 0 ? x : std::fabs(x));
        }
        EXPECT_LE(worst.ulps, c.bound) << c.name << ": " << worst;
    }
}

// The doubles nearest to multiples of pi/2: what is left after the reduction is all rounding error if it is not
// careful.
TEST(DeterministicMath, KeepsItsBoundsNextToMultiplesOfAQuarterTurn)
{
    if (!kHasTruth)
        GTEST_SKIP();
    WorstError worst;
    for (std::uint32_t i = 0; i < kMany; ++i)
    {
        const double k = std::floor(i < 1000 ? i : std::exp2(uniform(i, 0, 29.2)));
        const double x = k * (math::kPi / 2);
        for (const double near : {x, std::nextafter(x, 0.0), std::nextafter(x, kLargest)})
        {
            worst.meet(std::sin(static_cast<long double>(near)), math::sin(near), near);
            worst.meet(std::cos(static_cast<long double>(near)), math::cos(near), near);
        }
    }
    EXPECT_LE(worst.ulps, 1) << worst;
}

// The doubles below 1e9 that come nearest to a multiple of pi/2 (from continued fractions), with 120-digit answers.
TEST(DeterministicMath, ReducesTheWorstArgumentsPrecisely)
{
    EXPECT_EQ(math::cos(0x1.6c6cbc45dc8dep+5), -0x1.6d61b58c99c43p-61);
    EXPECT_EQ(math::sin(0x1.6c6cbc45dc8dep+6), -0x1.6d61b58c99c43p-60);
    EXPECT_EQ(math::cos(0x1.b951f1572eba5p+23), -0x1.f54f5227a4e84p-60);
    EXPECT_EQ(math::sin(0x1.b951f1572eba5p+25), -0x1.f54f5227a4e84p-58);
    EXPECT_EQ(math::sin(-0x1.b951f1572eba5p+25), 0x1.f54f5227a4e84p-58);
}

TEST(DeterministicMath, KeepsTheBoundsOfFunctionsOfTwoArguments)
{
    if (!kHasTruth)
        GTEST_SKIP();
    WorstError ofAtan2;
    WorstError ofPow;
    for (std::uint32_t i = 0; i < 2 * kMany; ++i)
    {
        const double y = anyMagnitude(i, -3, 3);
        const double x = anyMagnitude(i + kMany, -3, 3);
        ofAtan2.meet(std::atan2(static_cast<long double>(y), static_cast<long double>(x)), math::atan2(y, x), y, x);
        const double far = anyMagnitude(i, -1000, 1000);
        ofAtan2.meet(std::atan2(static_cast<long double>(y), static_cast<long double>(far)), math::atan2(y, far), y,
                     far);

        // Exponents that give every result from the smallest to the largest number.
        const double base = std::fabs(i % 2 == 0 ? anyMagnitude(i, -1070, 1020) : anyMagnitude(i, -1, 1));
        const double power = uniform(i + 2 * kMany, -744, 709) / std::log(base);
        ofPow.meet(std::pow(static_cast<long double>(base), static_cast<long double>(power)), math::pow(base, power),
                   base, power);
    }
    EXPECT_LE(ofAtan2.ulps, 2) << ofAtan2;
    EXPECT_LE(ofPow.ulps, 2) << ofPow;
}

TEST(DeterministicMath, TurnsByDegreesWithinOneUlp)
{
    if (!kHasTruth)
        GTEST_SKIP();
    WorstError worst;
    for (std::uint32_t i = 0; i < kMany; ++i)
    {
        const double x = uniform(i, -45, 45);
        const long double radians = static_cast<long double>(x) * (3.14159265358979323846264338327950288L / 180);
        const math::SinCos result = math::sinCosDegrees(x);
        worst.meet(std::sin(radians), result.sin, x);
        worst.meet(std::cos(radians), result.cos, x);
    }
    EXPECT_LE(worst.ulps, 1) << worst;
}

TEST(DeterministicMath, MultiplesOfAQuarterTurnInDegreesAreExact)
{
    const math::SinCos expected[] = {{0, 1}, {1, 0}, {0, -1}, {-1, 0}};
    for (const double turns : {0.0, 1.0, 2.0, -1.0, 1000.0, 2777777.0, -2777777.0})
    {
        for (int quarter = 0; quarter < 4; ++quarter)
        {
            const double degrees = 360 * turns + 90 * quarter;
            const math::SinCos result = math::sinCosDegrees(degrees);
            EXPECT_EQ(result.sin, expected[quarter].sin) << degrees;
            EXPECT_EQ(result.cos, expected[quarter].cos) << degrees;
            EXPECT_FALSE(result.sin == 0 && std::signbit(result.sin)) << degrees;
            EXPECT_FALSE(result.cos == 0 && std::signbit(result.cos)) << degrees;
        }
    }
    EXPECT_EQ(math::sinCosDegrees(30).sin, 0.5);
    EXPECT_EQ(math::sinCosDegrees(60).cos, 0.5);
    EXPECT_EQ(math::sinCosDegrees(45).sin, math::sinCosDegrees(45).cos);
}

TEST(DeterministicMath, AngleAndItsWholeTurnsInDegreesAgreeExactly)
{
    for (std::uint32_t i = 0; i < kMany; ++i)
    {
        const double degrees = std::floor(uniform(i, -180, 180) * 1024) / 1024;
        const math::SinCos once = math::sinCosDegrees(degrees);
        const math::SinCos turned = math::sinCosDegrees(degrees + 360.0 * static_cast<double>(i));
        ASSERT_EQ(once.sin, turned.sin) << degrees;
        ASSERT_EQ(once.cos, turned.cos) << degrees;
    }
}

TEST(DeterministicMath, SineAndCosineAreOddAndEvenAndAgreeWithTheirPair)
{
    for (std::uint32_t i = 0; i < kMany; ++i)
    {
        const double x = anyMagnitude(i, -1074, 29.8);
        const math::SinCos both = math::sinCos(x);
        ASSERT_EQ(both.sin, math::sin(x));
        ASSERT_EQ(both.cos, math::cos(x));
        ASSERT_EQ(both.sin, -math::sin(-x));
        ASSERT_EQ(both.cos, math::cos(-x));
        ASSERT_LE(std::fabs(both.sin), 1);
        ASSERT_LE(std::fabs(both.cos), 1);
    }
}

TEST(DeterministicMath, AnglesBeyondTheRangeGiveNaN)
{
    EXPECT_FALSE(std::isnan(math::sin(1e9)));
    EXPECT_FALSE(std::isnan(math::sinCosDegrees(-1e9).cos));
    for (const double x : {std::nextafter(1e9, 2e9), -1e10, kLargest, kInfinity, -kInfinity, kNaN})
    {
        EXPECT_TRUE(std::isnan(math::sin(x)) && std::isnan(math::cos(x)) && std::isnan(math::tan(x))) << x;
        EXPECT_TRUE(std::isnan(math::sinCosDegrees(x).sin) && std::isnan(math::sinCosDegrees(x).cos)) << x;
    }
}

// C's tables of special cases, read off the platform's libm, which must follow them.
TEST(DeterministicMath, SpecialCasesAreThoseOfC)
{
    const auto same = [](double a, double b) {
        return std::isnan(a) ? std::isnan(b) : a == b && std::signbit(a) == std::signbit(b);
    };
    const double specials[] = {0.0,        -0.0,     1.0,       -1.0,      0.5,        -0.5,       2.0,
                               -2.0,       3.0,      -3.0,      2.5,       -2.5,       1e300,      -1e300,
                               1e-300,     -1e-300,  0x1p53,    -0x1p53,   0x1p53 - 1, 1 - 0x1p53, kSmallest,
                               -kSmallest, kLargest, -kLargest, kInfinity, -kInfinity, kNaN};
    struct Function
    {
        const char* name;
        double (*ours)(double) noexcept;
        double (*theirs)(double);
    };
    const Function functions[] = {{"atan", math::atan, std::atan},
                                  {"asin", math::asin, std::asin},
                                  {"acos", math::acos, std::acos},
                                  {"exp", math::exp, std::exp},
                                  {"log", math::log, std::log}};
    const auto isSpecial = [](double x) { return x == 0 || !std::isfinite(x); };
    for (const double x : specials)
    {
        for (const Function& f : functions)
        {
            const double expected = f.theirs(x);
            EXPECT_TRUE(!isSpecial(expected) || same(f.ours(x), expected)) << f.name << ' ' << x << ": " << f.ours(x);
        }
        for (const double y : specials)
        {
            const double power = std::pow(x, y);
            const bool isExact = isSpecial(power) || std::fabs(power) == 1;
            EXPECT_TRUE(isExact ? same(math::pow(x, y), power) : std::fabs(math::pow(x, y) / power - 1) < 1e-15)
                << "pow " << x << ' ' << y << ": " << math::pow(x, y);
            const double angle = std::atan2(x, y);
            EXPECT_TRUE(isSpecial(angle) ? same(math::atan2(x, y), angle) : ulpsFrom(angle, math::atan2(x, y)) <= 2)
                << "atan2 " << x << ' ' << y << ": " << math::atan2(x, y);
        }
    }
    EXPECT_EQ(math::atan2(0, -1), math::kPi);
    EXPECT_EQ(math::atan2(-0.0, -1), -math::kPi);
    EXPECT_EQ(math::acos(-1), math::kPi);
    EXPECT_EQ(math::exp(0), 1);
    EXPECT_EQ(math::log(1), 0);
    EXPECT_TRUE(same(math::sin(-0.0), -0.0));
    EXPECT_TRUE(same(math::tan(-0.0), -0.0));
}

TEST(DeterministicMath, ExpReachesItsLimitsGradually)
{
    EXPECT_EQ(math::exp(709.78), std::exp(709.78));
    EXPECT_EQ(math::exp(709.79), kInfinity);
    EXPECT_EQ(math::exp(-745.1), kSmallest);
    EXPECT_EQ(math::exp(-745.2), 0);
    EXPECT_EQ(math::exp(-kLargest), 0);
    EXPECT_EQ(math::exp(kLargest), kInfinity);
}

TEST(DeterministicMath, PowersThatADoubleHoldsAreExact)
{
    for (int base = -12; base <= 12; ++base)
    {
        double product = 1;
        for (int exponent = 0; exponent < 15; ++exponent, product *= base)
        {
            ASSERT_EQ(math::pow(base, exponent), product) << base << '^' << exponent;
            if (base != 0 && (base & (base - 1)) == 0)
            {
                ASSERT_EQ(math::pow(base, -exponent), 1 / product);
            }
        }
    }
    for (int exponent = -1074; exponent < 1024; ++exponent)
        ASSERT_EQ(math::pow(2, exponent), std::ldexp(1.0, exponent)) << exponent;
    for (std::uint32_t i = 0; i < kMany; ++i)
    {
        const double x = std::floor(uniform(i, 1, 0x1p26));
        ASSERT_EQ(math::pow(x * x, 0.5), x);
        ASSERT_EQ(math::pow(x, 1), x);
    }
}

// Drift between compilers, options or machines shows here, in every build.
TEST(DeterministicMath, GivesTheGoldenBits)
{
    Hash64 hash;
    for (std::uint32_t i = 0; i < 4000; ++i)
    {
        const double x = uniform(i, -10, 10);
        const double y = uniform(i + 4000, -10, 10);
        const math::SinCos radians = math::sinCos(x);
        const math::SinCos far = math::sinCos(x * 1e8);
        const math::SinCos degrees = math::sinCosDegrees(x * 100);
        for (const double value : {radians.sin, radians.cos, far.sin, far.cos, degrees.sin, degrees.cos, math::tan(x),
                                   math::atan2(x, y), math::atan(y), math::asin(x / 10), math::acos(y / 10),
                                   math::exp(x), math::log(x * x), math::pow(x * x, y)})
            hash.value(value);
    }
    EXPECT_EQ(hash.result(), 13672642561018796967u);
}

} // namespace

} // namespace espalier
