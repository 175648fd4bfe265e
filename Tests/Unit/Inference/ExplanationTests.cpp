#include <Espalier/Inference/Inference.h>

#include <Inference/SampleArchetypes.h>
#include <cmath>
#include <gtest/gtest.h>
#include <numeric>

namespace espalier {

namespace {

Explanation explain(const Archetype& archetype, InferenceOptions options = {})
{
    Explanation explanation;
    options.explain = [&](const Explanation& found) { explanation = found; };
    EXPECT_TRUE(inferSpecies({&archetype, 1}, options));
    return explanation;
}

} // namespace

TEST(Explanation, TellsWhatBecameOneAndWhatThatSaves)
{
    // One shoot drawn twice, and two more that differ from each other by their scaling.
    const Archetype archetype = samples::read("stem: F[-FA]F[-FB]F[-FC]F[-FD]F\nshoot: F[+F]F",
                                              R"({"template":"stem","children":{
                          "A":{"template":"shoot","scaling":0.5}, "B":{"template":"shoot"},
                          "C":{"template":"shoot","scaling":2}, "D":{"template":"shoot"}}})");
    const Explanation found = explain(archetype, {.mergeWeight = 0.5, .ruleWeight = 0.0});
    EXPECT_TRUE(found.levels.empty()) << "both weights were given";
    ASSERT_EQ(found.merges.size(), 4u);

    // Four limbs: a name takes 2 bits. There is one direction, which takes none.
    EXPECT_EQ(found.merges[0].kind, Explanation::Kind::Equal);
    EXPECT_EQ(found.merges[0].name, "Shoot(2)");
    EXPECT_NEAR(found.merges[0].gain, 2, 1e-12) << "one shoot less, which is a name";
    EXPECT_EQ(found.merges[0].nodes, (std::vector<DrawnNode>{{0, 2}, {0, 4}}));

    // Two classes, a name 1 bit; a number of three shoots log2(3). One rule less, and a range for a number.
    EXPECT_EQ(found.merges[1].kind, Explanation::Kind::Alike);
    EXPECT_EQ(found.merges[1].name, "Shoot(0..1)");
    EXPECT_NEAR(found.merges[1].gain, (1 + std::log2(3)) - std::log2(3), 1e-12);
    EXPECT_EQ(found.merges[1].nodes, (std::vector<DrawnNode>{{0, 1}, {0, 3}}));

    // The stem is one of two classes instead of one of four limbs; each shoot takes 1 + log2(3) bits instead of 2, at
    // the head of its rule and where it hangs.
    EXPECT_EQ(found.merges[2].name, "Stem");
    EXPECT_NEAR(found.merges[2].gain, 1, 1e-12);
    EXPECT_EQ(found.merges[3].name, "Shoot");
    EXPECT_NEAR(found.merges[3].gain, (3 + 4) * (2 - 1 - std::log2(3)), 1e-12);
    EXPECT_NE(found.merges[3].reason.find("drawn 4 times"), std::string::npos);
    EXPECT_NE(found.merges[3].reason.find("a choice of 1.5 bits"), std::string::npos) << "1/4, 1/4 and 1/2";

    // As drawn: a name and four times an occupied anchor for the stem, a name for each shoot.
    EXPECT_NEAR(found.drawnBits, 2 + 4 * (1 + 2) + 4 * 2, 1e-12);
    const double gains = std::accumulate(found.merges.begin(), found.merges.end(), 0.0,
                                         [](double sum, const Explanation::Merge& merge) { return sum + merge.gain; });
    EXPECT_NEAR(found.ruleBits, found.drawnBits - gains, 1e-9);
}

TEST(Explanation, TellsWhichLevelsWereTriedAndWhatTheyMiss)
{
    const Archetype thesis = samples::thesis();
    const Explanation found = explain(thesis);
    ASSERT_FALSE(found.levels.empty());
    std::size_t chosen = 0;
    double best = 0;
    for (const Explanation::Level& level : found.levels)
    {
        chosen += level.chosen ? 1 : 0;
        best = std::max(best, level.score);
        EXPECT_TRUE(level.score < 1 || level.missed.empty()) << level.name;
    }
    EXPECT_EQ(chosen, 1u);
    for (const Explanation::Level& level : found.levels)
        if (level.chosen)
        {
            EXPECT_EQ(level.score, best);
        }
    const std::string text = printExplanation(found);
    EXPECT_NE(text.find("chosen"), std::string::npos);
    EXPECT_NE(text.find("bits as drawn"), std::string::npos);

    // The reasons do not change the result, and helberg gives none.
    EXPECT_EQ(inferSpecies({&thesis, 1}, {.explain = [](const Explanation&) {}}).value(),
              inferSpecies({&thesis, 1}).value());
    EXPECT_TRUE(explain(thesis, {.preset = "helberg"}).merges.empty());
}

} // namespace espalier
