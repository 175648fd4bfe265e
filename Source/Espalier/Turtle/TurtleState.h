#pragma once

#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Core/Simd.h>
#include <Espalier/Core/Vector.h>
#include <array>
#include <bit>
#include <cstdint>
#include <limits>
#include <vector>

namespace espalier {

/// Three doubles, and a fourth that rides along, in two registers.
struct TurtleVector
{
    simd::Two low{0, 0};  ///< x, y
    simd::Two high{0, 0}; ///< z; the radius where this is a position, otherwise 0.

    TurtleVector() = default;
    TurtleVector(double x, double y, double z, double fourth = 0) : low{x, y}, high{z, fourth} {}
    explicit TurtleVector(const DVec3& v) : TurtleVector(v.x, v.y, v.z) {}
    TurtleVector(simd::Two givenLow, simd::Two givenHigh) : low(givenLow), high(givenHigh) {}
    explicit operator DVec3() const { return {low[0], low[1], high[0]}; }
    explicit operator Vec3() const
    {
        return {static_cast<float>(low[0]), static_cast<float>(low[1]), static_cast<float>(high[0])};
    }
    explicit operator simd::Four() const { return simd::toFloats(low, high); }

    friend TurtleVector operator+(const TurtleVector& a, const TurtleVector& b)
    {
        return {a.low + b.low, a.high + b.high};
    }
    friend TurtleVector operator-(const TurtleVector& a, const TurtleVector& b)
    {
        return {a.low - b.low, a.high - b.high};
    }
    friend TurtleVector operator*(const TurtleVector& a, simd::Two factor) { return {a.low * factor, a.high * factor}; }
};

/// Which way a turtle is turned: three unit vectors at right angles to each other.
struct TurtleAxes
{
    TurtleVector heading{0, 1, 0};
    TurtleVector left{-1, 0, 0};
    TurtleVector up{0, 0, 1};
};

/// What [ remembers and ] brings back.
///
/// Turns to the left or right without a number are only counted, and carried out anew from the same axes whenever
/// something is drawn; so in a grammar of + and - alone the axes never change. They stand apart (TurtleScratch::axes),
/// for most brackets share those of the bracket around them.
struct TurtlePlace
{
    TurtleVector position;               ///< Metres; with the radius, half the diameter.
    std::uint32_t yaw = 0;               ///< Turns to the left since the axes were set, modulo 2^32.
    std::uint32_t axes = 0;              ///< Which of TurtleScratch::axes.
    std::uint32_t segment = 0xffffffffu; ///< Drawn last on the way here.
    std::uint16_t material = 0;

    [[nodiscard]] double radius() const { return position.high[1]; }
};

/// What a turtle knows between two symbols.
struct TurtleState
{
    std::size_t depth = 0; ///< Of brackets.
    bool organ = false;    ///< The last symbol was ~.
    bool cut = false;      ///< Until fewer than `cutDepth` brackets are open.
    std::size_t cutDepth = 0;
    std::uint32_t cutPolygons = 0; ///< Opened where it is cut, in the innermost polygon that is drawn, and still open.
};

/// Sine and cosine, each twice, as vectors want them.
struct TurtleTurn
{
    simd::Two sine{0, 0};
    simd::Two cosine{1, 1};

    TurtleTurn() = default;
    explicit TurtleTurn(const math::SinCos& values) : sine{values.sin, values.sin}, cosine{values.cos, values.cos} {}
    TurtleTurn(simd::Two givenSine, simd::Two givenCosine) : sine(givenSine), cosine(givenCosine) {}

    [[nodiscard]] TurtleTurn back() const { return {-sine, cosine}; }
    /// Where `a` comes to when it turns towards `b`.
    [[nodiscard]] TurtleVector towards(const TurtleVector& a, const TurtleVector& b) const
    {
        return a * cosine + b * sine;
    }
    /// Turns a towards b, and b away from a.
    void apply(TurtleVector& a, TurtleVector& b) const
    {
        const TurtleVector from = a;
        a = towards(a, b);
        b = b * cosine - from * sine;
    }
};

/// The turns by -kMost .. kMost times one angle.
class TurtleTurns
{
public:
    static constexpr std::uint32_t kMost = 16;

    TurtleTurns() : TurtleTurns(0) {}
    explicit TurtleTurns(double angleDegrees);
    [[nodiscard]] double angleDegrees() const noexcept { return angleDegrees_; }
    [[nodiscard]] static bool has(std::uint32_t yaw) { return yaw + kMost <= 2 * kMost; }
    /// By `yaw` times the angle, of which it has that.
    [[nodiscard]] const TurtleTurn& operator[](std::uint32_t yaw) const { return turns_[yaw + kMost]; }
    /// By `yaw` times the angle, -2^31 <= yaw < 2^31 (modulo 2^32).
    [[nodiscard]] TurtleTurn by(std::uint32_t yaw) const;

private:
    double angleDegrees_;
    std::array<TurtleTurn, 2 * kMost + 1> turns_;
};

/// The turns of the angles seen last.
class TurnCache
{
public:
    /// Null if it has to be added first.
    [[nodiscard]] const TurtleTurn* find(double degrees) const noexcept
    {
        const Entry* const pair = &entries_[pairOf(degrees)];
        if (pair[0].degrees == degrees)
            return &pair[0].turn;
        return pair[1].degrees == degrees ? &pair[1].turn : nullptr;
    }
    void add(double degrees) noexcept;

private:
    struct Entry
    {
        double degrees = std::numeric_limits<double>::quiet_NaN();
        TurtleTurn turn;
    };
    static std::size_t pairOf(double degrees) noexcept
    {
        return ((std::bit_cast<std::uint64_t>(degrees) * 0x9e3779b97f4a7c15u) >> 60) * 2;
    }
    std::array<Entry, 32> entries_;
};

/// Memory of a turtle; reuse it and nothing is allocated after warm-up. One per thread.
struct TurtleScratch
{
    std::vector<TurtlePlace> places; ///< One for each open bracket, that of now, and room for more.
    std::vector<TurtleAxes> axes;    ///< Where places point to: never more different ones than brackets, and one.
    std::vector<std::uint32_t> instances;
    std::vector<Vec3> corners;              ///< Of the polygons that are open, the outer ones first.
    std::vector<std::uint32_t> polygons;    ///< Where in `corners` each open polygon begins.
    std::vector<std::uint32_t> cutPolygons; ///< For each open polygon TurtleState::cutPolygons around it.
    TurtleTurns unitTurns;                  ///< By the angle of the grammar.
    TurnCache turns;                        ///< By other numbers.

    /// For a new turtle, at the origin.
    void begin(double angleDegrees);
    /// For so many places.
    void makeRoom(std::size_t places);
};

} // namespace espalier
