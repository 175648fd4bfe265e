#include <Espalier/Core/Random.h>
#include <Espalier/Core/Simd.h>
#include <Espalier/Mesh/AxisCurve.h>
#include <Espalier/Mesh/RingFrames.h>
#include <array>
#include <cstring>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>
#include <gtest/gtest.h>
#include <limits>
#include <vector>

namespace espalier {
namespace {

bool haveSameBits(float a, float b)
{
    return std::memcmp(&a, &b, sizeof(a)) == 0;
}

bool haveSameBits(const Vec3& a, const Vec3& b)
{
    return haveSameBits(a.x, b.x) && haveSameBits(a.y, b.y) && haveSameBits(a.z, b.z);
}

/// Of all sizes, and some with zeros of either sign and numbers at the ends of the range.
std::vector<Vec3> vectors()
{
    constexpr std::array<float, 6> kOdd{0.f, -0.f, 1e-40f, -3e38f, 1.f, 1e-20f};
    std::vector<Vec3> made;
    for (const float x : kOdd)
        for (const float y : kOdd)
            for (const float z : kOdd)
                made.emplace_back(x, y, z);
    const RandomKey key(Seed{1});
    for (std::uint32_t i = 0; i < 1000; ++i)
    {
        const auto draw = [&](std::uint32_t axis) {
            return static_cast<float>(key.child(i).uniform(Purpose::Sampling, -1, 1, axis));
        };
        const float x = draw(0);
        const float y = draw(1);
        const float z = draw(2);
        const float size = i % 3 == 0 ? 1e-6f : i % 3 == 1 ? 1.f : 1e5f;
        made.push_back(size * Vec3(x, y, z));
    }
    return made;
}

/// As it reads in three numbers.
Vec3 plainDirectionOr(const Vec3& v, const Vec3& otherwise)
{
    const float largest = std::max(std::max(std::abs(v.x), std::abs(v.y)), std::abs(v.z));
    if (!(largest > 0) || !std::isfinite(largest))
        return otherwise;
    const Vec3 scaled = v / largest;
    return scaled / std::sqrt(glm::dot(scaled, scaled));
}

TEST(Simd, VectorsOfThreeHaveTheBitsOfPlainOnes)
{
    const std::vector<Vec3> all = vectors();
    for (std::size_t i = 0; i < all.size(); ++i)
    {
        const Vec3& a = all[i];
        const Vec3& b = all[(i * 7 + 3) % all.size()];
        const simd::Four x = simd::three(a);
        const simd::Four y = simd::three(b);
        EXPECT_TRUE(haveSameBits(simd::vec3(x), a)) << i;
        EXPECT_EQ(x[3], 0) << i;
        EXPECT_TRUE(haveSameBits(simd::vec3(simd::directionOr(x, y)), plainDirectionOr(a, b))) << i;
        EXPECT_TRUE(haveSameBits(simd::vec3(simd::mix(x, y, 0.3f)), glm::mix(a, b, 0.3f))) << i;
        const float dot = glm::dot(a, b);
        if (std::isnan(dot) || glm::any(glm::isnan(glm::cross(a, b)))) // whose signs are the processor's affair
            continue;
        EXPECT_TRUE(haveSameBits(simd::dot(x, y), dot)) << i;
        EXPECT_TRUE(haveSameBits(simd::length(x), glm::length(a))) << i;
        EXPECT_TRUE(haveSameBits(simd::vec3(simd::cross(x, y)), glm::cross(a, b))) << i;
    }
}

TEST(Simd, DirectionOfNothingIsTheOther)
{
    const float inf = std::numeric_limits<float>::infinity();
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const Vec3 other(0, 1, 0);
    for (const Vec3& v : {Vec3(0), Vec3(inf, 0, 0), Vec3(0, -inf, 1), Vec3(nan, 1, 1)})
        EXPECT_EQ(directionOr(v, other), other);
}

TEST(Simd, StoresThreeNumbersAndNoMore)
{
    std::array<float, 5> memory{9, 9, 9, 9, 9};
    simd::storeThree(&memory[1], simd::Four{1, 2, 3, 4});
    EXPECT_EQ(memory, (std::array<float, 5>{9, 1, 2, 3, 9}));
}

TEST(Simd, TransportedSidesHaveTheBitsOfPlainOnes)
{
    const auto reflect = [](const Vec3& v, const Vec3& axis) {
        const float square = glm::dot(axis, axis);
        return square > 1e-24f ? v - (2.f * glm::dot(axis, v) / square) * axis : v;
    };
    const auto normalTo = [](const Vec3& tangent, const Vec3& wish) {
        const Vec3 side = wish - tangent * glm::dot(tangent, wish);
        const float square = glm::dot(side, side);
        return square > 1e-6f ? side / std::sqrt(square) : anySideNormalTo(tangent);
    };
    const std::vector<Vec3> all = vectors();
    for (std::size_t i = 216; i + 4 < all.size(); ++i)
    {
        const Vec3 tangent = plainDirectionOr(all[i], Vec3(0, 1, 0));
        const Vec3 next = plainDirectionOr(all[i + 1], Vec3(0, 1, 0));
        const Vec3 side = normalTo(tangent, all[i + 2]);
        const Vec3 step = all[i + 4] - all[i + 3];
        const Vec3 mirrored = reflect(side, step);
        const Vec3 wanted = normalTo(next, reflect(mirrored, next - reflect(tangent, step)));
        EXPECT_TRUE(haveSameBits(transportSide(side, all[i + 3], tangent, all[i + 4], next), wanted)) << i;
    }
}

} // namespace
} // namespace espalier
