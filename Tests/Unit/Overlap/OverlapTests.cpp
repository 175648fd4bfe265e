#include <Espalier/Overlap/Overlap.h>

#include <Espalier/Archetype/Archetype.h>
#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Core/Random.h>
#include <Espalier/Inference/Inference.h>
#include <Espalier/Overlap/BroadPhase.h>
#include <Espalier/Plant/Skeleton.h>
#include <Espalier/Species/Grow.h>
#include <algorithm>
#include <atomic>
#include <filesystem>
#include <functional>
#include <gtest/gtest.h>
#include <limits>
#include <thread>

namespace espalier {

namespace {

constexpr OverlapSettings kExact{.tolerance = 0, .neighbourhood = 0};

struct Segment
{
    Vec3 start;
    Vec3 end;
    float startRadius = 0.1f;
    float endRadius = 0.1f;
};

void append(const Segment& segment, std::uint32_t parent, Skeleton& skeleton)
{
    skeleton.starts.push_back(segment.start);
    skeleton.ends.push_back(segment.end);
    skeleton.headings.emplace_back(0, 1, 0);
    skeleton.lefts.emplace_back(-1, 0, 0);
    skeleton.lengths.push_back(glm::length(segment.end - segment.start));
    skeleton.startRadii.push_back(segment.startRadius);
    skeleton.endRadii.push_back(segment.endRadius);
    skeleton.parents.push_back(parent);
    skeleton.continuations.push_back(kNoSegment);
    skeleton.orders.push_back(0);
    skeleton.materials.push_back(0);
    skeleton.instances.push_back(kNoSegment);
}

/// The two as segments 0 and 2 of a skeleton, with a far detour between them so that they are not neighbours.
Skeleton strangers(const Segment& a, const Segment& b)
{
    Skeleton skeleton;
    append(a, kNoSegment, skeleton);
    append({Vec3(1e4f, 0, 0), Vec3(1e4f, 1, 0), 0, 0}, 0, skeleton);
    append(b, 1, skeleton);
    return skeleton;
}

float depthOf(const Segment& a, const Segment& b)
{
    const auto report = findOverlaps(strangers(a, b), kExact);
    EXPECT_TRUE(report);
    if (report->overlaps.empty())
        return 0;
    EXPECT_EQ(report->overlaps.size(), 1u);
    EXPECT_EQ(report->overlaps[0].first, 0u);
    EXPECT_EQ(report->overlaps[0].second, 2u);
    EXPECT_EQ(report->overlaps[0].depth, report->deepest);
    return report->deepest;
}

/// The definition, word by word: the deepest of many pairs of spheres.
double sampledDepth(const Segment& a, const Segment& b, int steps)
{
    double deepest = -1e30;
    for (int i = 0; i <= steps; ++i)
        for (int j = 0; j <= steps; ++j)
        {
            const double s = static_cast<double>(i) / steps;
            const double t = static_cast<double>(j) / steps;
            const DVec3 pa = DVec3(a.start) * (1 - s) + DVec3(a.end) * s;
            const DVec3 pb = DVec3(b.start) * (1 - t) + DVec3(b.end) * t;
            const double ra = a.startRadius * (1 - s) + a.endRadius * s;
            const double rb = b.startRadius * (1 - t) + b.endRadius * t;
            deepest = std::max(deepest, ra + rb - glm::length(pa - pb));
        }
    return deepest;
}

class Draws
{
public:
    explicit Draws(std::uint64_t seed) : key_(Seed{seed}) {}
    float operator()(double low, double high)
    {
        return static_cast<float>(key_.uniform(Purpose::Sampling, low, high, count_++));
    }
    Vec3 point(double size)
    {
        const float x = (*this)(-size, size);
        const float y = (*this)(-size, size);
        const float z = (*this)(-size, size);
        return {x, y, z};
    }

private:
    RandomKey key_;
    std::uint32_t count_ = 0;
};

Segment randomSegment(Draws& draw)
{
    Segment segment;
    segment.start = draw.point(1);
    const float kind = draw(0, 1);
    segment.end = kind < 0.1f ? segment.start : segment.start + draw.point(kind < 0.2f ? 0.01 : 1);
    if (kind > 0.8f) // often parallel to others
        segment.end = segment.start + Vec3(0, draw(-1, 1), 0);
    segment.startRadius = draw(0, 0.4);
    segment.endRadius = kind > 0.5f ? segment.startRadius : draw(0, 0.4);
    return segment;
}

/// A tangle: branches that wander, fork, jump and stand still.
Skeleton randomSkeleton(std::uint64_t seed)
{
    Draws draw(seed);
    Skeleton skeleton;
    const auto count = static_cast<std::uint32_t>(draw(0, 160));
    const double scale = seed % 9 == 0 ? 1e10 : (seed % 9 == 1 ? 1e-8 : 1);
    for (std::uint32_t i = 0; i < count; ++i)
    {
        const float kind = draw(0, 1);
        std::uint32_t parent = i == 0 || kind < 0.02f ? kNoSegment : i - 1;
        if (parent != kNoSegment && kind < 0.3f)
            parent = static_cast<std::uint32_t>(draw(0, i));
        Segment segment;
        segment.start = parent == kNoSegment ? Vec3(0) : skeleton.ends[parent];
        if (kind > 0.97f)
            segment.start += draw.point(scale);
        segment.end = segment.start + (kind > 0.9f ? Vec3(0) : draw.point(0.3 * scale));
        segment.startRadius = draw(0, 0.08 * scale);
        segment.endRadius = draw(0, 0.08 * scale);
        append(segment, parent, skeleton);
    }
    return skeleton;
}

/// The neighbour rule by walking: all ancestors of one, then upwards from the other until one of them is met.
double walkedLength(const Skeleton& skeleton, std::uint32_t a, std::uint32_t b)
{
    std::vector<std::uint32_t> up{a};
    while (skeleton.parents[up.back()] != kNoSegment)
        up.push_back(skeleton.parents[up.back()]);
    double length = 0;
    std::uint32_t at = b;
    while (at != kNoSegment && std::find(up.begin(), up.end(), at) == up.end())
    {
        length += at == b ? 0 : skeleton.lengths[at];
        at = skeleton.parents[at];
    }
    for (const std::uint32_t segment : up)
    {
        if (segment == at)
            break;
        length += segment == a ? 0 : skeleton.lengths[segment];
    }
    return length;
}

} // namespace

TEST(Overlap, AnEmptySkeletonHasNone)
{
    EXPECT_EQ(*findOverlaps({}), OverlapReport{});
    EXPECT_EQ(*findOverlapsBruteForce({}), OverlapReport{});
}

TEST(Overlap, RefusesUnsoundSkeletonsAndSettings)
{
    constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
    constexpr float kInfinity = std::numeric_limits<float>::infinity();
    struct Case
    {
        const char* name;
        std::function<void(Skeleton&, OverlapSettings&)> spoil;
    };
    const Case cases[] = {
        {"NaN start", [](auto& skeleton, auto&) { skeleton.starts[1].y = kNaN; }},
        {"infinite end", [](auto& skeleton, auto&) { skeleton.ends[1].y = kInfinity; }},
        {"NaN radius", [](auto& skeleton, auto&) { skeleton.endRadii[2] = kNaN; }},
        {"negative radius", [](auto& skeleton, auto&) { skeleton.startRadii[2] = -1; }},
        {"far start", [](auto& skeleton, auto&) { skeleton.starts[1].z = -2e15f; }},
        {"vast radius", [](auto& skeleton, auto&) { skeleton.endRadii[1] = 2e15f; }},
        {"parent after child", [](auto& skeleton, auto&) { skeleton.parents[1] = 2; }},
        {"parent out of range", [](auto& skeleton, auto&) { skeleton.parents[1] = 77; }},
        {"missing radius", [](auto& skeleton, auto&) { skeleton.endRadii.pop_back(); }},
        {"NaN tolerance", [](auto&, auto& settings) { settings.tolerance = kNaN; }},
        {"negative tolerance", [](auto&, auto& settings) { settings.tolerance = -1; }},
        {"infinite tolerance", [](auto&, auto& settings) { settings.tolerance = kInfinity; }},
        {"NaN neighbourhood", [](auto&, auto& settings) { settings.neighbourhood = kNaN; }},
        {"wide neighbourhood", [](auto&, auto& settings) { settings.neighbourhood = 101; }},
    };
    for (const Case& spoilt : cases)
    {
        Skeleton skeleton = strangers({Vec3(0), Vec3(0, 1, 0)}, {Vec3(0), Vec3(0, 1, 0)});
        OverlapSettings settings;
        spoilt.spoil(skeleton, settings);
        for (const auto& result : {findOverlaps(skeleton, settings), findOverlapsBruteForce(skeleton, settings)})
        {
            ASSERT_FALSE(result) << spoilt.name;
            EXPECT_EQ(result.error().kind, ErrorKind::BadInput) << spoilt.name;
        }
    }
}

TEST(Overlap, KnowsTheDepthOfSimplePairs)
{
    const Segment upright{Vec3(0, -1, 0), Vec3(0, 1, 0), 0.25f, 0.25f};
    struct Case
    {
        const char* name;
        Segment other;
        double depth;
    };
    const Case cases[] = {
        {"crosses through the middle", {Vec3(-1, 0, 0), Vec3(1, 0, 0), 0.25f, 0.25f}, 0.5},
        {"crosses at a distance", {Vec3(-1, 0, 0.375f), Vec3(1, 0, 0.375f), 0.25f, 0.25f}, 0.125},
        {"crosses and only touches", {Vec3(-1, 0, 0.5f), Vec3(1, 0, 0.5f), 0.25f, 0.25f}, 0},
        {"passes by", {Vec3(-1, 0, 2), Vec3(1, 0, 2), 0.25f, 0.25f}, 0},
        {"parallel", {Vec3(0.25f, -1, 0), Vec3(0.25f, 1, 0), 0.25f, 0.25f}, 0.25},
        {"the same", upright, 0.5},
        {"carries on in line", {Vec3(0, 1.375f, 0), Vec3(0, 3, 0), 0.25f, 0.25f}, 0.125},
        {"ends short of it", {Vec3(2, 0, 0), Vec3(0.375f, 0, 0), 0.25f, 0.25f}, 0.125},
        {"a sphere beside it", {Vec3(0.5f, 0, 0), Vec3(0.5f, 0, 0), 0.5f, 0.5f}, 0.25},
        {"a sphere told by its end", {Vec3(0.5f, 0, 0), Vec3(0.5f, 0, 0), 0.0f, 0.5f}, 0.25},
        {"a point inside", {Vec3(0), Vec3(0), 0, 0}, 0.25},
        {"a line that pierces", {Vec3(-1, 0, 0), Vec3(1, 0, 0), 0, 0}, 0.25},
        {"held in a great sphere", {Vec3(0, 0, 0), Vec3(0.5f, 0, 0), 4, 1}, 4.25},
        // Deepest 1/sqrt 3 beyond the upright's end: there the cone's flank is square to the way to it.
        {"a cone along it", {Vec3(1, -2, 0), Vec3(1, 2, 0), 0, 2}, 1.75 - std::sqrt(3.0) / 2},
    };
    for (const Case& c : cases)
    {
        EXPECT_NEAR(depthOf(upright, c.other), c.depth, 1e-6) << c.name;
        EXPECT_EQ(depthOf(upright, c.other), depthOf(c.other, upright)) << c.name;
    }
}

TEST(Overlap, DepthIsThatOfTheDeepestSpheres)
{
    constexpr int kSteps = 60;
    for (std::uint64_t seed = 0; seed < 400; ++seed)
    {
        Draws draw(seed);
        const Segment a = randomSegment(draw);
        const Segment b = randomSegment(draw);
        const double sampled = sampledDepth(a, b, kSteps);
        const double depth = depthOf(a, b);
        // Sampling finds at most the depth, and misses at most half a step of position and radius on each axis.
        const auto reach = [](const Segment& s) {
            return glm::length(s.end - s.start) + std::abs(s.endRadius - s.startRadius);
        };
        const double missed = (reach(a) + reach(b)) / (2 * kSteps);
        EXPECT_GE(depth, sampled - 1e-6) << "seed " << seed;
        EXPECT_LE(depth, std::max(0.0, sampled + missed) + 1e-6) << "seed " << seed;
    }
}

TEST(Overlap, DepthOfLeaningConesIsExact)
{
    // A finer search than above, where the closed form has its one interior case.
    for (std::uint64_t seed = 0; seed < 40; ++seed)
    {
        Draws draw(seed);
        const Vec3 lean = draw.point(0.3);
        const Segment a{Vec3(0, -1, 0) - lean, Vec3(0, 1, 0) + lean, draw(0, 0.5), draw(0, 0.5)};
        const Segment b{Vec3(-1, 0, 0.1f) + lean, Vec3(1, 0, 0.2f) - lean, draw(0, 0.5), draw(0, 0.5)};
        EXPECT_NEAR(depthOf(a, b), std::max(0.0, sampledDepth(a, b, 700)), 2e-5) << "seed " << seed;
    }
}

TEST(Overlap, NeighboursAreNeverReported)
{
    Skeleton fork; // a trunk, two limbs from its end, and the second segment of one of them
    append({Vec3(0), Vec3(0, 1, 0)}, kNoSegment, fork);
    append({Vec3(0, 1, 0), Vec3(0.1f, 2, 0)}, 0, fork);
    append({Vec3(0, 1, 0), Vec3(-0.1f, 2, 0)}, 0, fork);
    append({Vec3(0, 1, 0), Vec3(-0.1f, 2, 0)}, kNoSegment, fork); // from the base, drawn where the limb is
    EXPECT_TRUE(findOverlaps(fork, {.tolerance = 0, .neighbourhood = 100})->overlaps.empty());

    // With no neighbourhood only those with a segment between them are strangers: limb and second stem, and so on.
    const auto strict = findOverlaps(fork, kExact);
    ASSERT_EQ(strict->overlaps.size(), 2u);
    EXPECT_EQ(strict->overlaps[0].first, 1u);
    EXPECT_EQ(strict->overlaps[0].second, 3u);
    EXPECT_EQ(strict->overlaps[1].first, 2u);
    EXPECT_EQ(strict->overlaps[1].second, 3u);
}

TEST(Overlap, NeighbourhoodIsThePathBetweenOverTheLargestRadius)
{
    for (std::uint64_t seed = 0; seed < 60; ++seed)
    {
        const Skeleton skeleton = randomSkeleton(seed);
        const auto strict = findOverlapsBruteForce(skeleton, kExact);
        const auto loose = findOverlapsBruteForce(skeleton, {.tolerance = 0, .neighbourhood = 5});
        ASSERT_TRUE(strict && loose);
        std::vector<Overlap> expected;
        for (const Overlap& overlap : strict->overlaps)
        {
            const auto [a, b, depth] = overlap;
            const double radius =
                std::max({skeleton.startRadii[a], skeleton.endRadii[a], skeleton.startRadii[b], skeleton.endRadii[b]});
            EXPECT_GT(walkedLength(skeleton, a, b), 0);
            if (walkedLength(skeleton, a, b) > 5 * radius)
                expected.push_back(overlap);
        }
        EXPECT_EQ(loose->overlaps, expected) << "seed " << seed;
    }
}

TEST(Overlap, AgreesWithAllPairs)
{
    for (std::uint64_t seed = 0; seed < 150; ++seed)
    {
        const Skeleton skeleton = randomSkeleton(seed);
        for (const OverlapSettings& settings : {kExact, OverlapSettings{}})
        {
            const auto fast = findOverlaps(skeleton, settings);
            ASSERT_TRUE(fast) << toString(fast.error());
            EXPECT_EQ(*fast, *findOverlapsBruteForce(skeleton, settings)) << "seed " << seed;
        }
    }
}

TEST(Overlap, AgreesWithAllPairsOnGrownTrees)
{
    struct Case
    {
        const char* archetype;
        std::uint64_t seeds;
        std::uint64_t least; ///< So many of them have overlaps, or the test says little.
    };
    const std::filesystem::path root = ESPALIER_SOURCE_ROOT;
    for (const Case& c : {Case{"Content/Thesis.archetype", 200, 100}, Case{"Tests/Golden/Data/Bush.archetype", 20, 1}})
    {
        const auto archetype = loadArchetype(root / c.archetype, {{root / "Templates"}});
        ASSERT_TRUE(archetype) << toString(archetype.error());
        const auto species = inferSpecies({&*archetype, 1});
        ASSERT_TRUE(species) << toString(species.error());
        const auto grower = Grower::make(*species);
        ASSERT_TRUE(grower) << toString(grower.error());
        GrowScratch scratch;
        Skeleton skeleton;
        std::uint64_t overlapping = 0;
        for (std::uint64_t seed = 1; seed <= c.seeds; ++seed)
        {
            ASSERT_TRUE(grower->grow(Seed{seed}, {}, scratch, skeleton));
            const auto fast = findOverlaps(skeleton);
            ASSERT_TRUE(fast) << toString(fast.error());
            EXPECT_EQ(*fast, *findOverlapsBruteForce(skeleton)) << c.archetype << ", seed " << seed;
            overlapping += fast->overlaps.empty() ? 0 : 1;
        }
        EXPECT_GE(overlapping, c.least) << c.archetype;
    }
}

TEST(Overlap, IgnoresWhatIsWithinTheTolerance)
{
    const Segment upright{Vec3(0, -1, 0), Vec3(0, 1, 0), 0.25f, 0.25f};
    const Segment across{Vec3(-1, 0, 0.375f), Vec3(1, 0, 0.375f), 0.25f, 0.25f}; // 0.125 deep
    EXPECT_EQ(findOverlaps(strangers(upright, across), {.tolerance = 0.124f})->overlaps.size(), 1u);
    EXPECT_EQ(findOverlaps(strangers(upright, across), {.tolerance = 0.125f})->overlaps.size(), 0u);
}

TEST(Overlap, SaysWhenThereAreTooMany)
{
    Skeleton knot; // 40 stems, each a hair's length away along the path, all in one place
    for (std::uint32_t i = 0; i < 40; ++i)
        append({Vec3(0), Vec3(0, 1, 0)}, i == 0 ? kNoSegment : i - 1, knot);
    const auto count = static_cast<std::uint32_t>(findOverlaps(knot, kExact)->overlaps.size());
    EXPECT_EQ(count, 40u * 39 / 2 - 39);
    for (const auto find : {findOverlaps, findOverlapsBruteForce})
    {
        EXPECT_TRUE(find(knot, {.neighbourhood = 0, .maxOverlaps = count}));
        const auto refused = find(knot, {.neighbourhood = 0, .maxOverlaps = count - 1});
        ASSERT_FALSE(refused);
        EXPECT_EQ(refused.error().kind, ErrorKind::Limit);
    }
}

TEST(Overlap, LongChainsAreQuick)
{
    // A helix of 50,000 segments whose turns touch: walking paths pair by pair would take minutes.
    constexpr float kRadius = 0.005f;
    Skeleton helix;
    std::vector<Box> boxes;
    Vec3 at(1, 0, 0);
    for (std::uint32_t i = 0; i < 50000; ++i)
    {
        const auto [sin, cos] = math::sinCos(0.02 * (i + 1));
        const Vec3 next(static_cast<float>(cos), 2e-5f * static_cast<float>(i), static_cast<float>(sin));
        append({at, next, kRadius, kRadius}, i == 0 ? kNoSegment : i - 1, helix);
        boxes.push_back({glm::min(at, next) - kRadius, glm::max(at, next) + kRadius});
        at = next;
    }
    const auto report = findOverlaps(helix);
    ASSERT_TRUE(report) << toString(report.error());
    EXPECT_GT(report->overlaps.size(), 50000u);
    EXPECT_NEAR(report->deepest, 0.0075f, 0.004f);

    // Of the 1.25 billion pairs only those that are near each other are looked at, about eight a segment.
    std::atomic<std::size_t> candidates = 0;
    ASSERT_TRUE(visitTouchingPairs(boxes, [&](std::span<const BoxPair> pairs) { candidates += pairs.size(); }));
    EXPECT_GE(candidates, report->overlaps.size());
    EXPECT_LT(candidates, 20 * boxes.size());
}

TEST(Overlap, AnswersAreTheSameFromManyThreads)
{
    const Skeleton skeleton = randomSkeleton(5);
    const auto alone = findOverlaps(skeleton, kExact);
    std::vector<OverlapReport> reports(4);
    std::vector<std::thread> callers;
    for (OverlapReport& report : reports)
        callers.emplace_back([&] { report = *findOverlaps(skeleton, kExact); });
    for (std::thread& caller : callers)
        caller.join();
    for (const OverlapReport& report : reports)
        EXPECT_EQ(report, *alone);
}

} // namespace espalier
