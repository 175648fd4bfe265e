#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace espalier {

/// A point of a tube's surface, unrolled. Whole numbers, so that which side of a line a point lies on is certain.
struct UnrolledPoint
{
    std::int64_t x = 0; ///< Round the tube, modulo kUnrolledTurn. [0, kUnrolledTurn)
    std::int64_t y = 0; ///< Along it, in the same measure. [0, kUnrolledHeight]
};

inline constexpr std::int64_t kUnrolledTurn = std::int64_t{1} << 20;
inline constexpr std::int64_t kUnrolledHeight = std::int64_t{1} << 28;

/// A triangle of the sheet, counter-clockwise.
struct SheetTriangle
{
    std::array<std::uint32_t, 3> corners{};
    std::array<std::uint32_t, 3> neighbours{}; ///< Beyond the side opposite of each corner.
    std::array<bool, 3> fixed{};               ///< Sides that stay, likewise.
    bool removed = false;
};

/// A band round a tube between two rings, cut into triangles: constrained Delaunay on a cylinder, with holes. Reuse it
/// and nothing is allocated after warm-up.
///
/// A side that spans half of the turn has no shortest way round, so none may: at least three points a ring, and holes
/// narrower than half of the turn.
class SheetTriangulation
{
public:
    /// The empty band: points 0 to sides - 1 on its lower ring (y = 0), as many on the upper one. Requires: sides >= 3,
    /// height > 0.
    void begin(std::uint32_t sides, std::int64_t height);

    /// Adds a point strictly between the rings. Its number, or kNoPoint where there is one already.
    std::uint32_t insert(UnrolledPoint point);

    /// Makes the closed line through `loop`, counter-clockwise, sides of triangles. False where it crosses another
    /// such line, or runs through a point: the band is of no more use then.
    [[nodiscard]] bool fixLoop(std::span<const std::uint32_t> loop);

    /// The same for one line. False leaves the band as good as it was.
    [[nodiscard]] bool fixSide(std::uint32_t a, std::uint32_t b);

    /// Cuts out what a fixed loop encloses. False if that reaches a ring.
    [[nodiscard]] bool cutOut(std::span<const std::uint32_t> loop);

    /// Flips sides that are not fixed until all triangles are Delaunay, or nearly.
    void settle();

    [[nodiscard]] const std::vector<SheetTriangle>& triangles() const noexcept { return triangles_; }
    [[nodiscard]] const std::vector<UnrolledPoint>& points() const noexcept { return points_; }

    static constexpr std::uint32_t kNoPoint = 0xffffffffu;

private:
    struct Side
    {
        std::uint32_t triangle;
        std::uint32_t corner; ///< Opposite of it.
    };

    [[nodiscard]] std::uint32_t locate(UnrolledPoint point) const;
    [[nodiscard]] bool holds(std::uint32_t triangle, UnrolledPoint point, int& outside, int& on) const;
    [[nodiscard]] bool findSide(std::uint32_t a, std::uint32_t b, Side& side) const;
    [[nodiscard]] bool flip(Side side);
    [[nodiscard]] bool isCrossed(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) const;
    [[nodiscard]] bool gatherCrossings(std::uint32_t a, std::uint32_t b);
    void replaceNeighbour(std::uint32_t triangle, std::uint32_t before, std::uint32_t after);
    void insertInside(std::uint32_t triangle, std::uint32_t point);
    void insertOnSide(Side side, std::uint32_t point);
    void legalise();
    [[nodiscard]] bool wantsFlip(Side side) const;

    std::vector<UnrolledPoint> points_;
    std::vector<std::uint32_t> at_; ///< A triangle at each point.
    std::vector<SheetTriangle> triangles_;
    std::vector<Side> doubtful_;
    std::vector<std::array<std::uint32_t, 2>> crossings_;
    bool isSettled_ = true;  ///< Nothing has been flipped but to make triangles Delaunay.
    std::uint32_t last_ = 0; ///< Where the next point is looked for first.
};

} // namespace espalier
