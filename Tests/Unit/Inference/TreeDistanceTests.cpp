#include <Espalier/Inference/TreeDistance.h>

#include <Espalier/Core/Random.h>
#include <algorithm>
#include <gtest/gtest.h>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace espalier {
namespace {

/// `f(d(a c(b)) e)`: a letter and, in brackets, its children.
LabelledTree treeOf(std::string_view text)
{
    LabelledTree tree;
    std::vector<std::uint32_t> open;
    for (const char c : text)
        if (c == '(')
            open.push_back(tree.size() - 1);
        else if (c == ')')
            open.pop_back();
        else if (c != ' ')
        {
            tree.labels.push_back(static_cast<std::uint32_t>(c));
            tree.parents.push_back(open.empty() ? 0 : open.back());
        }
    return tree;
}

LabelledTree randomTree(RandomKey key, std::uint32_t size, std::uint32_t labels)
{
    LabelledTree tree;
    for (std::uint32_t node = 0; node < size; ++node)
    {
        tree.labels.push_back(static_cast<std::uint32_t>(key.below(Purpose::Sampling, labels, 2 * node)));
        tree.parents.push_back(
            node == 0 ? 0 : static_cast<std::uint32_t>(key.below(Purpose::Sampling, node, 2 * node + 1)));
    }
    return tree;
}

/// The definition, forest by forest: the last root is deleted, inserted, or matched with the other last root.
class PlainEditDistance
{
public:
    PlainEditDistance(const LabelledTree& a, const LabelledTree& b) : a_(a), b_(b) {}

    std::uint32_t operator()() { return distance({0}, {0}); }

private:
    using Forest = std::vector<std::uint32_t>; ///< Roots, from left to right.

    static Forest childrenOf(const LabelledTree& tree, std::uint32_t node)
    {
        Forest children;
        for (std::uint32_t child = node + 1; child < tree.size(); ++child)
            if (tree.parents[child] == node)
                children.push_back(child);
        return children;
    }

    static std::uint32_t sizeOf(const LabelledTree& tree, const Forest& forest)
    {
        std::uint32_t size = 0;
        for (const std::uint32_t root : forest)
            size += 1 + sizeOf(tree, childrenOf(tree, root));
        return size;
    }

    std::uint32_t distance(const Forest& x, const Forest& y)
    {
        if (x.empty() || y.empty())
            return sizeOf(a_, x) + sizeOf(b_, y);
        const auto known = known_.find({x, y});
        if (known != known_.end())
            return known->second;
        const auto withoutLast = [](const LabelledTree& tree, Forest forest) {
            const Forest children = childrenOf(tree, forest.back());
            forest.pop_back();
            forest.insert(forest.end(), children.begin(), children.end());
            return forest;
        };
        const Forest restX(x.begin(), x.end() - 1);
        const Forest restY(y.begin(), y.end() - 1);
        const std::uint32_t result =
            std::min({distance(withoutLast(a_, x), y) + 1, distance(x, withoutLast(b_, y)) + 1,
                      distance(restX, restY) + distance(childrenOf(a_, x.back()), childrenOf(b_, y.back())) +
                          (a_.labels[x.back()] != b_.labels[y.back()] ? 1 : 0)});
        known_[{x, y}] = result;
        return result;
    }

    const LabelledTree& a_;
    const LabelledTree& b_;
    std::map<std::pair<Forest, Forest>, std::uint32_t> known_;
};

TEST(TreeDistance, KnownEdits)
{
    struct Case
    {
        const char* a;
        const char* b;
        std::uint32_t distance;
    };
    const Case cases[] = {
        {"a", "a", 0},
        {"a", "b", 1},
        {"", "a(bc)", 3},
        {"f(d(ac(b))e)", "f(c(d(ab))e)", 2}, // the example of Zhang and Shasha, figure 4
        {"a(bc)", "a(cb)", 2},               // children are ordered
        {"a(b(c(d)))", "a(d)", 2},
        {"a(bcd)", "a(e(bcd))", 1}, // one node between
        {"a(aaaa)", "a(a(a(a(a))))", 6},
    };
    for (const Case& c : cases)
    {
        EXPECT_EQ(editDistance(treeOf(c.a), treeOf(c.b)), c.distance) << c.a << " " << c.b;
        EXPECT_EQ(editDistance(treeOf(c.b), treeOf(c.a)), c.distance) << c.b << " " << c.a;
    }
}

TEST(TreeDistance, ChainsDifferByTheirLength)
{
    const auto chain = [](std::uint32_t length) {
        LabelledTree tree;
        for (std::uint32_t node = 0; node < length; ++node)
        {
            tree.labels.push_back(7);
            tree.parents.push_back(node == 0 ? 0 : node - 1);
        }
        return tree;
    };
    EXPECT_EQ(editDistance(chain(2000), chain(1500)), 500u);
}

TEST(TreeDistance, EqualsItsDefinitionOnSmallTrees)
{
    for (std::uint64_t seed = 0; seed < 400; ++seed)
    {
        const RandomKey key = RandomKey(Seed{seed}).child(0);
        const auto size = [&](std::uint32_t i) {
            return 1 + static_cast<std::uint32_t>(key.below(Purpose::ChooseProduction, 9, i));
        };
        const LabelledTree a = randomTree(key.child(1), size(1), 3);
        const LabelledTree b = randomTree(key.child(2), size(2), 3);
        ASSERT_EQ(editDistance(a, b), PlainEditDistance(a, b)()) << seed;
    }
}

/// A trunk with another root's children at its end: `length` nodes that only one of two trees has.
LabelledTree lifted(const LabelledTree& tree, std::uint32_t length)
{
    LabelledTree result;
    for (std::uint32_t node = 0; node <= length; ++node)
    {
        result.labels.push_back(node == 0 ? tree.labels[0] : 99);
        result.parents.push_back(node == 0 ? 0 : node - 1);
    }
    for (std::uint32_t node = 1; node < tree.size(); ++node)
    {
        result.labels.push_back(tree.labels[node]);
        result.parents.push_back(tree.parents[node] + length);
    }
    return result;
}

/// The children of every node in opposite order.
LabelledTree mirrored(const LabelledTree& tree)
{
    LabelledTree result;
    struct Visit
    {
        std::uint32_t node;
        std::uint32_t parent;
    };
    std::vector<Visit> pending{{0, 0}};
    while (!pending.empty())
    {
        const Visit visit = pending.back();
        pending.pop_back();
        const std::uint32_t place = result.size();
        result.labels.push_back(tree.labels[visit.node]);
        result.parents.push_back(visit.parent);
        for (std::uint32_t child = visit.node + 1; child < tree.size(); ++child)
            if (tree.parents[child] == visit.node)
                pending.push_back({child, place});
    }
    return result;
}

/// A trunk of `length` nodes, each with the twig of `twigAt(its number)` beside what goes on.
LabelledTree trunkWith(std::uint32_t length, const auto& twigAt)
{
    std::string text = "t";
    for (std::uint32_t i = 0; i < length; ++i)
        text += "(" + std::string(twigAt(i)) + "t";
    return treeOf(text + std::string(length, ')'));
}

TEST(TreeDistance, EqualsItsDefinitionWhereRowsFillRegisters)
{
    for (std::uint64_t seed = 0; seed < 60; ++seed)
    {
        const RandomKey key = RandomKey(Seed{seed}).child(0);
        // Few labels: many subtrees are equal. Of two trees one may be deep.
        const LabelledTree a = randomTree(key.child(1), 14, 1 + static_cast<std::uint32_t>(seed % 3));
        const LabelledTree b =
            seed % 2 == 0 ? randomTree(key.child(2), 13, 2) : lifted(randomTree(key.child(2), 9, 2), 6);
        ASSERT_EQ(editDistance(a, b), PlainEditDistance(a, b)()) << seed;
    }
}

TEST(TreeDistance, MirroredTreesAreAsFarApart)
{
    for (std::uint64_t seed = 0; seed < 20; ++seed)
    {
        const RandomKey key = RandomKey(Seed{seed}).child(0);
        const LabelledTree a = randomTree(key.child(1), 100, 3);
        const LabelledTree b = randomTree(key.child(2), 140, 3);
        EXPECT_EQ(editDistance(mirrored(a), mirrored(b)), editDistance(a, b)) << seed;
        EXPECT_EQ(editSteps(mirrored(a), mirrored(b)), editSteps(a, b)) << seed;
    }
}

TEST(TreeDistance, CountsBeyondSixteenBits)
{
    const LabelledTree tree = randomTree(RandomKey(Seed{3}), 60, 3);
    EXPECT_EQ(editDistance(lifted(tree, 33000), tree), 33000u);
    EXPECT_EQ(editDistance(tree, lifted(tree, 33000)), 33000u);
}

TEST(TreeDistance, EqualTwigsAreComparedOnce)
{
    const LabelledTree plain = trunkWith(200, [](std::uint32_t) { return "a(bc)"; });
    const LabelledTree varied =
        trunkWith(200, [](std::uint32_t i) { return std::string("a(b") + static_cast<char>('A' + i % 26) + ")"; });
    EXPECT_EQ(plain.size(), 801u);
    // The trunk with all it carries, a twig of three, and the one of its leaves that does not go on what it stands on.
    EXPECT_EQ(editSteps(plain, plain), 805.0 * 805.0);
    EXPECT_GT(editSteps(varied, varied), editSteps(plain, plain));
    EXPECT_EQ(editDistance(plain, varied), 200u);
    EXPECT_EQ(editSteps({}, plain), 0);
}

TEST(TreeDistance, IsAMetric)
{
    for (std::uint64_t seed = 0; seed < 100; ++seed)
    {
        const RandomKey key = RandomKey(Seed{seed}).child(0);
        const LabelledTree a = randomTree(key.child(1), 20, 3);
        const LabelledTree b = randomTree(key.child(2), 25, 3);
        const LabelledTree c = randomTree(key.child(3), 30, 3);
        EXPECT_EQ(editDistance(a, a), 0u);
        EXPECT_EQ(editDistance(a, b), editDistance(b, a));
        EXPECT_LE(editDistance(a, c), editDistance(a, b) + editDistance(b, c));
    }
}

TEST(TreeDistance, PqGramsCountWhatIsCommon)
{
    // a(bc): (null a | null b) (null a | b c) (null a | c null) and two leaves.
    EXPECT_EQ(pqGramsOf(treeOf("a(bc)")).total, 5u);
    EXPECT_EQ(pqGramDistance(pqGramsOf(treeOf("a(bc)")), pqGramsOf(treeOf("a(bc)"))), 0);
    EXPECT_EQ(pqGramDistance(pqGramsOf(treeOf("a(bc)")), pqGramsOf(treeOf("d(ef)"))), 1);
    // a(bd) has (null a | null b) and the leaf b in common with it.
    EXPECT_DOUBLE_EQ(pqGramDistance(pqGramsOf(treeOf("a(bc)")), pqGramsOf(treeOf("a(bd)"))), 1 - 2 * 2.0 / 10);
}

TEST(TreeDistance, PqGramsOfOtherLabelsAreCountedAlike)
{
    LabelledTree a = randomTree(RandomKey(Seed{1}), 50001, 5);
    LabelledTree b = randomTree(RandomKey(Seed{2}), 50001, 5);
    const double counted = pqGramDistance(pqGramsOf(a), pqGramsOf(b));
    EXPECT_GT(counted, 0);
    for (LabelledTree* tree : {&a, &b})
        for (std::uint32_t& label : tree->labels)
            label += 40;
    EXPECT_EQ(pqGramDistance(pqGramsOf(a), pqGramsOf(b)), counted);
}

TEST(TreeDistance, ManyDifferentPqGramsComeInAscendingOrder)
{
    PqGramCounter counter;
    for (int round = 1; round <= 2; ++round) // the second finds the counter as it was left
    {
        for (std::uint32_t i = 0; i < 6000; ++i)
            counter.add(i % 7, i % 1000, PqGramCounter::kNone, i % 3);
        const PqGrams grams = counter.take();
        EXPECT_EQ(grams.total, 6000u);
        EXPECT_EQ(grams.counts.size(), 6000u); // 7, 1000 and 3 have nothing in common
        EXPECT_TRUE(std::ranges::is_sorted(grams.counts, {}, &PqGrams::Count::gram));
    }
    counter.add(1, 2, 3, 4);
    counter.clear();
    EXPECT_EQ(counter.take().total, 0u);
}

TEST(TreeDistance, TreesLaidOverEachOtherBoundIt)
{
    EXPECT_EQ(overlaidDistance(treeOf("a(bc)"), treeOf("a(bc)")), 0);
    EXPECT_DOUBLE_EQ(overlaidDistance(treeOf("a(bc)"), treeOf("a(c)")), 1.0 / 5);       // b goes
    EXPECT_DOUBLE_EQ(overlaidDistance(treeOf("a(b(xyz)c)"), treeOf("a(cb)")), 5.0 / 9); // c stays; b(xyz) and b go
    EXPECT_DOUBLE_EQ(overlaidDistance(treeOf("a(bcd)"), treeOf("a(e(bcd))")), 6.0 / 9); // e over b; the others go
    EXPECT_EQ(overlaidDistance({}, treeOf("a")), 1);
    for (std::uint64_t seed = 0; seed < 200; ++seed)
    {
        const RandomKey key = RandomKey(Seed{seed});
        const LabelledTree a = randomTree(key.child(1), 30, 3);
        const LabelledTree b = randomTree(key.child(2), 40, 3);
        EXPECT_GE(overlaidDistance(a, b), normalisedEditDistance(a, b)) << seed;
        EXPECT_LE(overlaidDistance(a, b), 1) << seed;
        EXPECT_EQ(overlaidDistance(a, a), 0) << seed;
    }
}

} // namespace
} // namespace espalier
