#include <Espalier/Plant/Skeleton.h>
#include <Plant/SampleSkeletons.h>
#include <gtest/gtest.h>
#include <limits>

namespace espalier {
namespace {

using namespace samples;

struct Change
{
    const char* name;
    void (*apply)(Skeleton&);
};

TEST(Skeleton, EmptyIsSoundAndClearRestoresIt)
{
    const Skeleton empty;
    EXPECT_TRUE(isSound(empty));
    EXPECT_TRUE(empty.empty());
    Skeleton skeleton = fork();
    skeleton.instanceRecords.push_back({});
    skeleton.clear();
    EXPECT_EQ(skeleton, empty);
    EXPECT_EQ(hashOf(skeleton), hashOf(empty));
}

TEST(Skeleton, RandomTreesAreSound)
{
    for (std::uint64_t seed = 0; seed < 50; ++seed)
    {
        EXPECT_TRUE(isSound(randomTree(seed, 60))) << "seed " << seed;
        EXPECT_TRUE(isSound(randomTree(seed, 60, Ailments::All))) << "seed " << seed;
    }
}

TEST(Skeleton, UnsoundNumbersAndIndicesAreFound)
{
    constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    const Change changes[] = {
        {"NaN position", [](Skeleton& s) { s.ends[1].y = kNan; }},
        {"infinite position", [](Skeleton& s) { s.starts[2].z = kInfinity; }},
        {"NaN heading", [](Skeleton& s) { s.headings[0].x = kNan; }},
        {"NaN left", [](Skeleton& s) { s.lefts[0].x = kNan; }},
        {"NaN length", [](Skeleton& s) { s.lengths[3] = kNan; }},
        {"negative length", [](Skeleton& s) { s.lengths[3] = -1; }},
        {"negative radius", [](Skeleton& s) { s.startRadii[0] = -0.1f; }},
        {"infinite radius", [](Skeleton& s) { s.endRadii[0] = kInfinity; }},
        {"parent after child", [](Skeleton& s) { s.parents[1] = 3; }},
        {"own parent", [](Skeleton& s) { s.parents[1] = 1; }},
        {"continuation out of range", [](Skeleton& s) { s.continuations[2] = 99; }},
        {"continuation of another", [](Skeleton& s) { s.continuations[2] = 4; }},
        {"instance out of range", [](Skeleton& s) { s.instances[0] = 0; }},
        {"instance record its own parent", [](Skeleton& s) { s.instanceRecords.push_back({.parent = 0}); }},
        {"array too short", [](Skeleton& s) { s.orders.pop_back(); }},
        {"NaN extent", [](Skeleton& s) { s.maxY = kNan; }},
    };
    for (const Change& change : changes)
    {
        Skeleton skeleton = fork();
        ASSERT_TRUE(isSound(skeleton));
        change.apply(skeleton);
        EXPECT_FALSE(isSound(skeleton)) << change.name;
    }
}

TEST(Skeleton, HashSeesEveryField)
{
    const Change changes[] = {
        {"starts", [](Skeleton& s) { s.starts[1].x += 1; }},
        {"ends", [](Skeleton& s) { s.ends[1].y += 1; }},
        {"headings", [](Skeleton& s) { s.headings[1].z += 1; }},
        {"lefts", [](Skeleton& s) { s.lefts[1].z += 1; }},
        {"lengths", [](Skeleton& s) { s.lengths[1] += 1; }},
        {"startRadii", [](Skeleton& s) { s.startRadii[1] += 1; }},
        {"endRadii", [](Skeleton& s) { s.endRadii[1] += 1; }},
        {"parents", [](Skeleton& s) { s.parents[4] = 0; }},
        {"continuations", [](Skeleton& s) { s.continuations[1] = kNoSegment; }},
        {"orders", [](Skeleton& s) { s.orders[1] = 9; }},
        {"materials", [](Skeleton& s) { s.materials[1] = 9; }},
        {"instances", [](Skeleton& s) { s.instances[1] = 9; }},
        {"instanceRecords", [](Skeleton& s) { s.instanceRecords.push_back({}); }},
        {"widthsGiven", [](Skeleton& s) { s.widthsGiven = true; }},
        {"minY", [](Skeleton& s) { s.minY -= 1; }},
        {"maxY", [](Skeleton& s) { s.maxY += 1; }},
        {"maxRadius", [](Skeleton& s) { s.maxRadius += 1; }},
    };
    const Skeleton original = fork();
    EXPECT_EQ(hashOf(original), hashOf(fork()));
    for (const Change& change : changes)
    {
        Skeleton changed = original;
        change.apply(changed);
        EXPECT_NE(hashOf(changed), hashOf(original)) << change.name;
    }
}

} // namespace
} // namespace espalier
