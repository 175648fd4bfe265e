#include <Espalier/Inference/Limbs.h>

#include <Inference/SampleArchetypes.h>
#include <gtest/gtest.h>
#include <numeric>
#include <tuple>

namespace espalier {

namespace {

bool sameDirection(const InstanceTransform& a, const InstanceTransform& b)
{
    return a.rotation == b.rotation && a.roll == b.roll;
}

/// Whether two branches of an archetype are equal, whichever way they point, compared all the way up.
bool equalBranches(const Archetype& archetype, const AnchorTable& anchors, std::uint32_t a, std::uint32_t b)
{
    if (a == kNoInstance || b == kNoInstance)
        return a == b;
    const TemplateInstance& first = archetype.instances[a];
    const TemplateInstance& second = archetype.instances[b];
    if (first.piece != second.piece || first.transform.scaling != second.transform.scaling ||
        first.transform.branchingAngle != second.transform.branchingAngle)
        return false;
    for (std::uint32_t i = 0; i < archetype.library.templates[first.piece].anchors.size(); ++i)
    {
        const std::uint32_t one = anchors.children[anchors.firstChild[a] + i];
        const std::uint32_t other = anchors.children[anchors.firstChild[b] + i];
        if (!equalBranches(archetype, anchors, one, other))
            return false;
        if (one != kNoInstance &&
            !sameDirection(archetype.instances[one].transform, archetype.instances[other].transform))
            return false;
    }
    return true;
}

/// Whether a limb describes a branch.
bool describes(const LimbTable& table, const LimbUse& use, const Archetype& archetype, const AnchorTable& anchors,
               std::uint32_t instance)
{
    if (use.limb == kNoInstance || instance == kNoInstance)
        return use.limb == instance;
    const Limb& found = table.limbs[use.limb];
    const InstanceTransform& transform = archetype.instances[instance].transform;
    if (found.piece != archetype.instances[instance].piece || found.scaling != transform.scaling ||
        found.branchingAngle != transform.branchingAngle ||
        !(use.direction == LimbDirection{transform.rotation, transform.roll}))
        return false;
    for (std::uint32_t i = 0; i < archetype.library.templates[found.piece].anchors.size(); ++i)
        if (!describes(table, table.children[found.firstChild + i], archetype, anchors,
                       anchors.children[anchors.firstChild[instance] + i]))
            return false;
    return true;
}

/// floor(log_base(value)) without logarithms.
int bandOf(double value, double base)
{
    if (base == 0)
        return 0;
    int band = 0;
    for (; value >= base; value /= base)
        ++band;
    for (; value < 1; value *= base)
        --band;
    return band;
}

} // namespace

TEST(Limbs, AreTheDistinctBranches)
{
    for (std::uint32_t seed = 0; seed < 40; ++seed)
    {
        const Archetype archetype = samples::randomArchetype(Seed{seed}, 1 + 3 * seed, 1 + seed % 3);
        const AnchorTable anchors = anchorsOf(archetype);
        const LimbTable table = shareLimbs(archetype, anchors, segmentsDrawn(archetype.library));

        const auto directionOf = [&](std::uint32_t instance) {
            const InstanceTransform& transform = archetype.instances[instance].transform;
            return LimbDirection{transform.rotation, transform.roll};
        };
        std::vector<std::uint32_t>
            firsts; // one instance of each distinct branch, in the order of their first occurrence
        std::vector<std::uint32_t> counts;
        for (std::uint32_t i = 0; i < archetype.instances.size(); ++i)
        {
            std::size_t same = 0;
            while (same < firsts.size() && !equalBranches(archetype, anchors, firsts[same], i))
                ++same;
            if (same == firsts.size())
            {
                firsts.push_back(i);
                counts.push_back(0);
            }
            ++counts[same];
        }
        ASSERT_EQ(table.limbs.size(), firsts.size()) << "seed " << seed;
        for (std::uint32_t limb = 0; limb < firsts.size(); ++limb)
        {
            EXPECT_EQ(table.limbs[limb].count, counts[limb]) << "seed " << seed << " limb " << limb;
            EXPECT_TRUE(describes(table, {limb, directionOf(firsts[limb])}, archetype, anchors, firsts[limb]))
                << "seed " << seed << " limb " << limb;
        }
        ASSERT_EQ(table.roots.size(), anchors.roots.size());
        for (std::size_t tree = 0; tree < table.roots.size(); ++tree)
            EXPECT_TRUE(describes(table, table.roots[tree], archetype, anchors, anchors.roots[tree]));
    }
}

TEST(Limbs, KnowTheirSizeAndHeight)
{
    const Archetype archetype = samples::thesis();
    const LimbTable table = shareLimbs(archetype, anchorsOf(archetype), segmentsDrawn(archetype.library));
    EXPECT_EQ(table.limbs[table.roots[0].limb].segments, 55u);
    EXPECT_EQ(table.limbs[table.roots[0].limb].height, 6u);
    EXPECT_EQ(std::accumulate(table.limbs.begin(), table.limbs.end(), 0u,
                              [](std::uint32_t sum, const Limb& limb) { return sum + limb.count; }),
              17u);

    const Archetype chain = samples::chain(5000);
    const LimbTable links = shareLimbs(chain, anchorsOf(chain), segmentsDrawn(chain.library));
    EXPECT_EQ(links.limbs.size(), 5000u);
    EXPECT_EQ(links.limbs[0].segments, 10000u);
    EXPECT_EQ(links.limbs[0].height, 5000u);
}

TEST(Limbs, ClassByTemplateSizeAndHeight)
{
    for (std::uint32_t seed = 0; seed < 20; ++seed)
    {
        const Archetype archetype = seed == 0 ? samples::chain(600) : samples::randomArchetype(Seed{seed}, 10 * seed);
        const LimbTable table = shareLimbs(archetype, anchorsOf(archetype), segmentsDrawn(archetype.library));
        const double total = table.limbs[table.roots[0].limb].segments;
        for (const KinLevel& level : kinLevels())
        {
            const KinClasses classes = classify(table, level, total);
            const auto keyOf = [&](std::uint32_t i) {
                const Limb& limb = table.limbs[i];
                return std::tuple(
                    limb.piece,
                    bandOf(0.999 * std::max(0.5, static_cast<double>(limb.segments)) / total, level.sizeBase),
                    bandOf(limb.height, level.heightBase));
            };
            std::uint32_t members = 0;
            for (std::uint32_t c = 0; c < classes.kin.size(); ++c)
            {
                std::uint32_t occurrences = 0;
                for (const std::uint32_t limb : classes.kin[c])
                {
                    EXPECT_EQ(classes.classOf[limb], c);
                    EXPECT_EQ(keyOf(limb), keyOf(classes.kin[c][0])) << "seed " << seed << " limb " << limb;
                    occurrences += table.limbs[limb].count;
                    ++members;
                }
                EXPECT_EQ(classes.occurrences[c], occurrences);
                for (std::uint32_t other = 0; other < c; ++other)
                    EXPECT_NE(keyOf(classes.kin[c][0]), keyOf(classes.kin[other][0])) << "seed " << seed;
            }
            EXPECT_EQ(members, table.limbs.size());
        }
    }
}

TEST(Limbs, ShareARuleIfAlikeAndOftenEnough)
{
    // Three tips that differ by their scaling, one that is drawn twice, and two forks that carry different ones.
    const Archetype archetype = samples::read("trunk: F[-FA]F[-FB]F[-FC]F[-FD]F[-FE]FX\nfork: F[+FX]FY\ntip: F",
                                              R"({"template":"trunk","children":{
            "A":{"template":"tip","scaling":1.5}, "B":{"template":"tip","scaling":0.5},
            "C":{"template":"tip","scaling":0.75}, "D":{"template":"tip","rotation":70}, "E":{"template":"tip","rotation":-70},
            "X":{"template":"fork","children":{"X":{"template":"fork"},"Y":{"template":"fork","branchingAngle":30}}}}})");
    const LimbTable table = shareLimbs(archetype, anchorsOf(archetype), segmentsDrawn(archetype.library));
    KinClasses classes = classify(table, {4, 1.5, false}, table.limbs[table.roots[0].limb].segments);
    runAlikeLimbs(table, classes);
    std::uint32_t met = 0;
    for (std::size_t c = 0; c < classes.kin.size(); ++c)
    {
        const std::string& name = archetype.library.templates[table.limbs[classes.kin[c][0]].piece].name;
        if (name == "tip")
        {
            EXPECT_EQ(classes.runs[c], (std::vector<std::uint32_t>{3, 1}))
                << "the one that is drawn twice stands alone";
            ++met;
        }
        else if (name == "fork" && classes.kin[c].size() == 2)
        {
            EXPECT_EQ(classes.runs[c], std::vector<std::uint32_t>{2});
            ++met;
        }
        EXPECT_EQ(std::accumulate(classes.runs[c].begin(), classes.runs[c].end(), 0u), classes.kin[c].size());
    }
    EXPECT_EQ(met, 2u);

    // By hand: 4 classes, 5 directions. Of the tips three rules become one: two names of a class (2 bits) and two
    // numbers among 4 (2 bits) are saved, and the range takes one number more.
    const DescriptionLength lengths = DescriptionLength::of(table, classes);
    EXPECT_NEAR(lengths.classes, 2, 1e-12);
    for (std::uint32_t c = 0; c < classes.kin.size(); ++c)
        if (classes.kin[c].size() == 4)
        {
            EXPECT_NEAR(lengths.gainOfRun(table, classes, c, 0, 3), 2 * (2 + 2) - 2, 1e-12);
        }
    // What nothing tells apart from its description is not worth a run.
    for (std::uint32_t c = 0; c < classes.kin.size(); ++c)
        EXPECT_LE(lengths.gainOfRun(table, classes, c, 0, 1), 0);
}

} // namespace espalier
