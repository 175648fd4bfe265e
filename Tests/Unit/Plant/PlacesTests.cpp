#include <Espalier/Plant/Places.h>

#include <Espalier/Core/DeterministicMath.h>
#include <Plant/SampleSkeletons.h>
#include <algorithm>
#include <gtest/gtest.h>
#include <set>
#include <vector>

namespace espalier {

namespace {

std::vector<std::uint64_t> placesOf(const Skeleton& skeleton)
{
    std::vector<std::uint64_t> places;
    hashPlaces(skeleton, places);
    return places;
}

/// What leaves `node` on the way to `segment`; kNoSegment if no way leads there.
std::uint32_t childOf(const Skeleton& skeleton, std::uint32_t node, std::uint32_t segment)
{
    while (segment != kNoSegment && skeleton.parents[segment] != node)
        segment = skeleton.parents[segment];
    return segment;
}

/// Whether two children of a node may leave it on the same side.
bool areOnOneSide(const Skeleton& skeleton, std::uint32_t a, std::uint32_t b)
{
    const Vec3 axis = skeleton.headings[skeleton.parents[a]];
    const auto aside = [&](std::uint32_t i) {
        return skeleton.headings[i] - glm::dot(skeleton.headings[i], axis) * axis;
    };
    return glm::dot(skeleton.headings[a], axis) > 0.95f || glm::dot(aside(a), aside(b)) > 0;
}

/// A joint of the trunk that carries on, with a branch at each of `degrees` round it.
Skeleton whorl(const std::vector<double>& degrees)
{
    Skeleton skeleton;
    const std::uint32_t trunk = samples::grow(skeleton, kNoSegment, {0, 1, 0});
    for (const double angle : degrees)
    {
        const math::SinCos turn = math::sinCosDegrees(angle);
        samples::grow(skeleton, trunk, {static_cast<float>(turn.cos), 0.5f, static_cast<float>(turn.sin)});
    }
    samples::grow(skeleton, trunk, {0, 1, 0});
    completeAxes(skeleton, {});
    return skeleton;
}

} // namespace

TEST(Places, OfNothingAreNone)
{
    EXPECT_TRUE(placesOf({}).empty());
}

TEST(Places, AllDiffer)
{
    for (std::uint64_t seed = 0; seed < 50; ++seed)
    {
        const std::vector<std::uint64_t> places =
            placesOf(samples::randomTree(seed, 400, seed % 2 == 0 ? samples::Ailments::None : samples::Ailments::All));
        EXPECT_EQ(std::set<std::uint64_t>(places.begin(), places.end()).size(), places.size()) << "seed " << seed;
    }
    const std::vector<std::uint64_t> brush = placesOf(whorl(std::vector<double>(5000, 30.0)));
    EXPECT_EQ(std::set<std::uint64_t>(brush.begin(), brush.end()).size(), brush.size()) << "all to one side";
}

TEST(Places, DoNotFollowNumbersRadiiOrLengths)
{
    for (std::uint64_t seed = 0; seed < 20; ++seed)
    {
        const Skeleton skeleton = samples::randomTree(seed, 200);
        const std::vector<std::uint64_t> places = placesOf(skeleton);
        const std::vector<std::uint32_t> order = samples::byDepth(skeleton);
        const Skeleton other = samples::renumbered(skeleton, order);
        const std::vector<std::uint64_t> others = placesOf(other);
        for (std::uint32_t i = 0; i < other.size(); ++i)
            ASSERT_EQ(others[i], places[order[i]]) << "seed " << seed;

        Skeleton larger = skeleton;
        completeAxes(larger, {.tipRadius = 0.1f, .exponent = 3, .pipesPerMetre = 5});
        for (std::uint32_t i = 0; i < larger.size(); ++i)
        {
            larger.starts[i] *= 3.f;
            larger.ends[i] *= 3.f;
            larger.lengths[i] *= 3.f;
        }
        ASSERT_EQ(placesOf(larger), places) << "seed " << seed;
    }
}

TEST(Places, StayWhenABranchIsCut)
{
    for (std::uint64_t seed = 0; seed < 20; ++seed)
    {
        const Skeleton skeleton = samples::randomTree(seed, 200);
        const std::vector<std::uint64_t> places = placesOf(skeleton);
        for (std::uint32_t branch = 1; branch < skeleton.size(); branch += 3)
        {
            const std::vector<std::uint32_t> kept = samples::allWithout(skeleton, branch);
            const std::vector<std::uint64_t> cut = placesOf(samples::renumbered(skeleton, kept));
            for (std::uint32_t i = 0; i < kept.size(); ++i)
                if (cut[i] != places[kept[i]])
                {
                    // Only what leaves the same node on a side that another takes may have another key, with all that
                    // it bears.
                    const std::uint32_t node = skeleton.parents[branch];
                    const std::uint32_t sibling = childOf(skeleton, node, kept[i]);
                    ASSERT_LT(sibling, branch) << "seed " << seed;
                    bool isShared = false;
                    for (std::uint32_t other = sibling + 1; other < skeleton.size(); ++other)
                        isShared |= skeleton.parents[other] == node && areOnOneSide(skeleton, sibling, other);
                    ASSERT_TRUE(isShared) << "seed " << seed;
                }
        }
    }
}

TEST(Places, OfAWhorlDoNotFollowItsSize)
{
    const std::vector<double> degrees{10, 80, 150, 220, 290};
    const std::vector<std::uint64_t> whole = placesOf(whorl(degrees));
    for (std::size_t gone = 0; gone < degrees.size(); ++gone)
    {
        std::vector<double> fewer = degrees;
        fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(gone));
        std::vector<std::uint64_t> expected = whole;
        expected.erase(expected.begin() + static_cast<std::ptrdiff_t>(gone) + 1);
        EXPECT_EQ(placesOf(whorl(fewer)), expected) << degrees[gone];
    }
    EXPECT_EQ(placesOf(whorl({12, 77, 155, 222, 288})), whole) << "a little turned";
}

TEST(Places, StayWhenAnAxisGrows)
{
    Skeleton skeleton = samples::fork();
    const std::vector<std::uint64_t> before = placesOf(skeleton);
    for (std::uint32_t i = 0; i < before.size(); ++i)
        if (skeleton.continuations[i] == kNoSegment)
            samples::grow(skeleton, i, {0.1f, 0.2f, 0});
    completeAxes(skeleton, {.tipRadius = 0.05f});
    std::vector<std::uint64_t> after = placesOf(skeleton);
    after.resize(before.size());
    EXPECT_EQ(after, before);
}

} // namespace espalier
