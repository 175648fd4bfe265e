#include <Espalier/Inference/RuleEdits.h>

#include <Espalier/Inference/Inference.h>
#include <Espalier/Inference/RuleMatch.h>
#include <Espalier/Species/Grow.h>
#include <Inference/SampleArchetypes.h>
#include <algorithm>
#include <gtest/gtest.h>
#include <set>
#include <sstream>

namespace espalier {

namespace {

constexpr double kFine = 0; // level of classes: by size and height
constexpr double kAnchors = 2.0 / 3;
constexpr double kCoarse = 0.5; // by template alone

Species inferred(const Archetype& archetype, double mergeWeight = 0.5, double ruleWeight = kCoarse)
{
    auto species = inferSpecies({&archetype, 1}, {.mergeWeight = mergeWeight, .ruleWeight = ruleWeight});
    if (!species)
        ADD_FAILURE() << toString(species.error());
    return species.value();
}

/// Puts back the printed grammar with the first `from` replaced by `to`, as `grammar --set` would.
void edit(Species& species, const std::string& from, const std::string& to)
{
    std::string text = printWithOrigins(species);
    const std::size_t at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from << " does not stand in\n" << text;
    text.replace(at, from.size(), to);
    auto grammar = parseGrammar(text, "edited", {});
    ASSERT_TRUE(grammar) << toString(grammar.error());
    setGrammar(species, std::move(*grammar));
}

std::vector<std::string> rulesOf(const Grammar& grammar)
{
    std::vector<std::string> lines;
    for (const Production& production : grammar.productions)
        lines.push_back(printProduction(grammar, production));
    return lines;
}

bool has(const Species& species, const std::string& rule)
{
    const std::vector<std::string> rules = rulesOf(species.grammar);
    return std::ranges::find(rules, rule) != rules.end();
}

/// Infers anew and merges, as `infer` does over an existing species.
CarriedEdits again(Species& species, const Archetype& archetype, double mergeWeight = 0.5, double ruleWeight = kCoarse)
{
    Species anew = inferred(archetype, mergeWeight, ruleWeight);
    const CarriedEdits carried = carryEdits(species, anew);
    species = std::move(anew);
    EXPECT_TRUE(grow(species, Seed{1}));
    const auto read = parseSpecies(printSpecies(species), "merged");
    EXPECT_TRUE(read) << toString(read.error());
    EXPECT_EQ(read.value(), species);
    return carried;
}

/// The instances that `gone` does not name.
Archetype without(const Archetype& archetype, const std::set<std::uint32_t>& gone)
{
    Archetype rest = archetype;
    rest.instances.clear();
    std::vector<std::uint32_t> now(archetype.instances.size(), kNoInstance);
    for (std::uint32_t i = 0; i < archetype.instances.size(); ++i)
    {
        TemplateInstance instance = archetype.instances[i];
        if (gone.contains(i) || (instance.parent != kNoInstance && now[instance.parent] == kNoInstance))
            continue;
        now[i] = static_cast<std::uint32_t>(rest.instances.size());
        if (instance.parent != kNoInstance)
            instance.parent = now[instance.parent];
        rest.instances.push_back(instance);
    }
    return rest;
}

/// One more instance of a template at the first open anchor of instance `parent`.
Archetype with(const Archetype& archetype, std::uint32_t parent, const std::string& piece)
{
    Archetype more = archetype;
    const AnchorTable anchors = anchorsOf(archetype);
    for (std::uint32_t a = 0; a < anchors.firstChild[parent + 1] - anchors.firstChild[parent]; ++a)
        if (anchors.children[anchors.firstChild[parent] + a] == kNoInstance)
        {
            more.instances.push_back(
                {static_cast<std::uint32_t>(archetype.library.find(piece)), parent, a, {0.77, 5, 40, 0}});
            return more;
        }
    ADD_FAILURE() << "no open anchor";
    return more;
}

// The thesis' tree, by template alone:
// III(2), instance 11, carries VIII(1), instance 12, which ends there.
const std::string kRule = "III(i, turn) -> +(turn+r)F(s)+(b)F(s)VIII(1, 0) : ";
const std::string kWeight = "(i==2)*(1-w)+w/4";
const std::string kDraw = " : ~ III(2)";

} // namespace

TEST(RuleEdits, ReadBackWhatIsPrinted)
{
    for (std::uint32_t seed = 0; seed < 60; ++seed)
    {
        const Archetype archetype = samples::randomArchetype(Seed{seed}, 1 + 7 * seed, 1 + seed % 3);
        const Species species = inferred(archetype, 0.01 * seed, (seed % 7) / 6.0);
        const auto plain = parseGrammar(printGrammar(species.grammar), "plain", {});
        ASSERT_TRUE(plain) << toString(plain.error());
        EXPECT_EQ(*plain, species.grammar) << "seed " << seed;
        const auto commented = parseGrammar(printWithOrigins(species), "commented", {});
        ASSERT_TRUE(commented) << toString(commented.error());
        EXPECT_EQ(*commented, species.grammar) << "seed " << seed;
        EXPECT_EQ(parseSpecies(printSpecies(species), "file").value(), species) << "seed " << seed;
    }
}

/// Five shoots of four sizes in a row, one of which carries a bud if asked, and one more of its own size if asked.
Archetype shoots(bool bud, bool more)
{
    std::string text =
        R"({"template":"stem","children":{"A":{"template":"shoot","scaling":0.5},"B":{"template":"shoot","scaling":0.75},)";
    text += R"("C":{"template":"shoot","scaling":1.25)" +
            std::string(bud ? R"(,"children":{"X":{"template":"tip"}})" : "") +
            R"(},"D":{"template":"shoot","scaling":1.5},"E":{"template":"shoot","scaling":1.5})";
    text += std::string(more ? R"(,"H":{"template":"shoot","scaling":2})" : "") + "}}";
    return samples::read("stem: F[-FA]F[-FB]F[-FC]F[-FD]F[-FE]F[-FH]F\nshoot: F[+FX]F\ntip: F", text);
}

TEST(RuleEdits, SurviveInRulesThatLimbsShare)
{
    // Scalings 0.5, 0.75 and 1.25 share a rule; 1.5 was drawn twice and has its own.
    const Species drawn = inferred(shoots(false, false));
    const std::string text = printWithOrigins(drawn);
    const std::string shared = "((i>=0&&i<3)*(1-w)+w*3/5)";
    ASSERT_NE(text.find("3 limbs, 3 drawn: 0:1 0:2 0:3"), std::string::npos) << text;

    // What is edited survives: the weight of the rule, and which limb a place names.
    Species species = drawn;
    edit(species, "(i>=0&&i<3)*(1-w)+w*3/5", "2*" + shared);
    edit(species, "F(s)Shoot(1)", "F(s)Shoot(2)");
    CarriedEdits carried = again(species, shoots(false, false));
    EXPECT_TRUE(carried.conflicts.empty());
    EXPECT_EQ(carried.edits, 2u);
    EXPECT_NE(printWithOrigins(species).find("2*" + shared), std::string::npos) << printWithOrigins(species);

    // Another limb joins them: the rule is the same one, and the places keep their limbs.
    carried = again(species, shoots(false, true));
    EXPECT_EQ(carried.conflicts.size(), 1u) << "the stem, whose last anchor was drawn at";
    EXPECT_NE(printWithOrigins(species).find("2*((i>=0&&i<4)*(1-w)+w*4/6)"), std::string::npos)
        << printWithOrigins(species);

    // One of them leaves: the place that named it names it where it is now.
    species = drawn;
    edit(species, "F(s)Shoot(0)", "F(s)Shoot(2)");
    carried = again(species, shoots(true, false));
    EXPECT_EQ(carried.conflicts.size(), 1u) << "inference has changed the stem too";
    species = drawn;
    edit(species, "(i>=0&&i<3)*(1-w)+w*3/5", "2*" + shared);
    carried = again(species, shoots(true, false));
    EXPECT_TRUE(carried.conflicts.empty());
    EXPECT_NE(printWithOrigins(species).find("2*((i>=0&&i<2)*(1-w)+w*2/5)"), std::string::npos)
        << printWithOrigins(species);

    // A lock on a limb is one on the rule that it shares.
    species = drawn;
    EXPECT_EQ(lockRules(species, "Shoot(2)", true).value(), 1u);
    EXPECT_NE(printWithOrigins(species).find("3 limbs, 3 drawn: 0:1 0:2 0:3; locked"), std::string::npos);
    carried = again(species, shoots(false, false));
    EXPECT_TRUE(carried.conflicts.empty());
    EXPECT_EQ(carried.locks, 1u);
}

TEST(RuleEdits, OfAFileThatClaimsBillionsOfLimbsTakeNoMemory)
{
    Species species = inferred(samples::thesis());
    for (RuleOrigin& rule : species.rules)
        rule.limbs = 0xffffffffu;
    edit(species, kWeight, "2*(" + kWeight + ")");
    const CarriedEdits carried = again(species, samples::thesis());
    EXPECT_EQ(carried.edits + carried.conflicts.size(), 1u);
}

TEST(RuleEdits, OfWeightsThatAskForMoreThanTheLimbStayAsTheyAre)
{
    for (const std::string& weight :
         {std::string("(i>=2)*(1-w)+w/4"), std::string("(i==2)*(1-w)*(turn>=0)+w/4"),
          std::string("(i==2)*(1-w)+(i!=3)*w/4"), std::string("rand(0, 3)*(i==2)*(1-w)+w/4")})
    {
        Species species = inferred(samples::thesis());
        edit(species, kWeight + kDraw, weight + kDraw);
        const CarriedEdits carried = again(species, samples::thesis());
        EXPECT_TRUE(carried.conflicts.empty()) << weight;
        EXPECT_EQ(carried.edits, 1u) << weight;
        EXPECT_TRUE(has(species, kRule + weight + kDraw)) << weight << '\n' << printWithOrigins(species);
    }
}

TEST(RuleEdits, OfOneLimbDoNotReachOthersThatShareItsRule)
{
    // B carries a tip and has a rule of its own, which is removed; without the tip it shares one with its neighbours.
    const std::string library = "stem: F[-FA]F[-FB]F[-FC]F\nshoot: F[+FX]F\ntip: F";
    const std::string tree = R"({"template":"stem","children":{"A":{"template":"shoot","scaling":0.5},
        "B":{"template":"shoot","scaling":0.75@},"C":{"template":"shoot","scaling":1.25}}})";
    const auto drawn = [&](const std::string& tip) {
        std::string text = tree;
        return samples::read(library, text.replace(text.find('@'), 1, tip));
    };
    Species species = inferred(drawn(R"(,"children":{"X":{"template":"tip"}})"));
    std::string text = printWithOrigins(species);
    const std::size_t line = text.find("Shoot(i) -> F(s)[+(b)F(s)Tip]");
    ASSERT_NE(line, std::string::npos) << text;
    text.erase(line, text.find('\n', line) + 1 - line);
    setGrammar(species, parseGrammar(text, "edited", {}).value());
    ASSERT_EQ(summarizeEdits(species).removed, 1u);
    const CarriedEdits carried = again(species, drawn(""));
    EXPECT_EQ(summarizeEdits(species).removed, 0u) << printWithOrigins(species);
    (void)carried;
}

TEST(RuleEdits, KeepLocksWhenTheEditsWouldNotGrow)
{
    Species species = inferred(samples::thesis());
    EXPECT_EQ(lockRules(species, "IV", true).value(), 4u);
    edit(species, kWeight + kDraw, "w-0.4" + kDraw);
    const CarriedEdits carried = again(species, samples::thesis(), 0.2);
    EXPECT_FALSE(carried.conflicts.empty());
    EXPECT_EQ(carried.locks, 4u);
}

TEST(RuleEdits, OfFilesWithOddRulesAreSafe)
{
    // An inferred grammar that nobody inferred: more parameters than limbs have, in another order, and rows beyond.
    Species species = inferred(samples::thesis());
    const auto odd = parseGrammar("symbols: III\nlet w = 0.5\naxiom: III(0, 1, 2, 3)\n"
                                  "III(i, a, c, d) -> F(s) : (i==0)*(1-w)+w/4 : ~ III(d*0)\n"
                                  "III(turn, i) -> F : i : ~ III(9)",
                                  "odd", {});
    ASSERT_TRUE(odd) << toString(odd.error());
    species.inferred = *odd;
    species.rules.assign(2, RuleOrigin{1, 2, 3, 2, {}, true});
    Species anew = inferred(samples::thesis());
    (void)carryEdits(species, anew);
    EXPECT_TRUE(grow(anew, Seed{1}));
}

TEST(RuleEdits, KeepDirectionsThatWereTurned)
{
    const std::string trunk = "VII -> F(s)[-(b)F(s)III(0, 20)][F(s)VI(0, 20)]+(b)F(s)VI(1, -20) : ~ VII(0)";
    Species species = inferred(samples::thesis());
    edit(species, trunk, "VII -> F(s)[-(b)F(s)III(0, 35)][F(s)VI(0, 20)]+(b)F(s)VI(2-1, -20*2) : ~ VII(0)");
    // VI(2-1, ...) may be any of its class.
    const CarriedEdits same = again(species, samples::thesis());
    EXPECT_TRUE(same.conflicts.empty());
    EXPECT_TRUE(has(species, "VII -> F(s)[-(b)F(s)III(0, 35)][F(s)VI(0, 20)]+(b)F(s)VI(2-1, -20*2) : ~ VII(0)"));

    // On finer classes the limb has no number, and keeps its direction.
    species = inferred(samples::thesis());
    edit(species, trunk, "VII -> F(s)[-(b)F(s)III(0, 35)][F(s)VI(0, 20)]+(b)F(s)VI(1, -20*2) : ~ VII(0)");
    edit(species, kRule, "III(i, t) -> +(2*t+r)F(s)+(b)F(s)VIII(1, t) : ");
    const CarriedEdits finer = again(species, samples::thesis(), 0.5, 0.0);
    EXPECT_TRUE(finer.conflicts.empty());
    EXPECT_TRUE(has(species, "VII -> F(s)[-(b)F(s)III(35)][F(s)VI(20)]+(b)F(s)VI2(-20*2) : ~ VII(0)"))
        << printWithOrigins(species);
    EXPECT_TRUE(has(species, "III2(i, t) -> +(2*t+r)F(s)+(b)F(s)VIII(1, t) : (i==1)*(1-w)+w/3 : ~ III(2)"))
        << printWithOrigins(species);

    // Where a roll is drawn somewhere else in the class, all of its places have one.
    species = inferred(samples::thesis());
    edit(species, trunk, "VII -> F(s)[-(b)F(s)III(0, 35)][F(s)VI(0, 20)]+(b)F(s)VI(1, -20) : ~ VII(0)");
    Archetype rolled = samples::thesis();
    rolled.instances[11].transform.roll = 90;
    const CarriedEdits deep = again(species, rolled);
    EXPECT_TRUE(deep.conflicts.empty());
    EXPECT_TRUE(has(species, "VII -> F(s)[-(b)F(s)III(0, 35, 0)][F(s)VI(0, 20)]+(b)F(s)VI(1, -20) : ~ VII(0)"))
        << printWithOrigins(species);
}

TEST(RuleEdits, TellHowOftenAndWhereRulesWereDrawn)
{
    const Species thesis = inferred(samples::thesis());
    const std::string text = printWithOrigins(thesis);
    EXPECT_NE(text.find(kRule + kWeight + kDraw + "  # 1 drawn: 0:11\n"), std::string::npos) << text;

    for (std::uint32_t seed = 0; seed < 10; ++seed)
    {
        const Archetype archetype = samples::randomArchetype(Seed{seed}, 60, 1 + seed % 3);
        const Species species = inferred(archetype, 0.5, seed % 2 == 0 ? kCoarse : kAnchors);
        // A file lists the nodes depth first; what is read from it has them in this order.
        const Archetype read = parseArchetype(printArchetype(archetype), "file", archetype.library, Limits{}).value();
        std::vector<std::uint32_t> firstOfTree;
        for (std::uint32_t i = 0; i < read.instances.size(); ++i)
            if (read.instances[i].parent == kNoInstance)
                firstOfTree.push_back(i);
        const Species ofFile = inferred(read, 0.5, seed % 2 == 0 ? kCoarse : kAnchors);
        std::uint32_t whole = 0;
        ASSERT_EQ(ofFile.rules.size(), ofFile.grammar.productions.size());
        for (std::size_t r = 0; r < ofFile.rules.size(); ++r)
        {
            const Production& production = ofFile.grammar.productions[r];
            const RuleOrigin& origin = ofFile.rules[r];
            EXPECT_EQ(origin.nodes.size(), std::min<std::size_t>(origin.count, RuleOrigin::kMostNodes));
            if (production.table.empty())
                continue;
            whole += origin.count;
            for (const DrawnNode& node : origin.nodes)
                EXPECT_EQ(read.library.templates[read.instances[firstOfTree[node.tree] + node.node].piece].name,
                          production.table);
        }
        EXPECT_EQ(whole, read.instances.size()); // every instance is an application of one rule
        EXPECT_EQ(species.rules.size(), ofFile.rules.size());
    }
}

TEST(RuleEdits, AreWhatTellsTheGrammarFromTheInferredOne)
{
    Species species = inferred(samples::thesis());
    const Species untouched = species;
    edit(species, kWeight + kDraw, "2*(" + kWeight + ")" + kDraw);
    EXPECT_EQ(summarizeEdits(species).weights, 1u);
    EXPECT_EQ(summarizeEdits(species).edits(), 1u);
    edit(species, "II -> F(s)-(b)F(s)", "II -> F(s)+(b)F(s)");
    EXPECT_EQ(summarizeEdits(species).weights, 1u);
    EXPECT_EQ(summarizeEdits(species).changed, 1u);
    edit(species, "II -> F(s)+(b)F(s)", "II -> F : 3\nII -> F(s)+(b)F(s)");
    EXPECT_EQ(summarizeEdits(species).added, 1u);
    edit(species, kRule + "2*(" + kWeight + ")" + kDraw, "");
    EXPECT_EQ(summarizeEdits(species).removed, 1u);
    edit(species, "let w = 0.5", "let w = 0.25");
    EXPECT_EQ(summarizeEdits(species).settings, 1u);
    EXPECT_EQ(summarizeEdits(species).edits(), 4u);
    EXPECT_EQ(parseSpecies(printSpecies(species), "edited").value(), species);
    EXPECT_TRUE(grow(species, Seed{1}));

    setGrammar(species, parseGrammar(printGrammar(untouched.grammar), "inferred", {}).value());
    EXPECT_EQ(species, untouched);
}

TEST(RuleEdits, OfAHandWrittenSpeciesAreItsGrammar)
{
    Species species;
    species.grammar = parseGrammar("axiom: F", "a", {}).value();
    setGrammar(species, parseGrammar("axiom: F F", "b", {}).value());
    EXPECT_FALSE(species.inferred);
    EXPECT_FALSE(hasEdits(species));
}

TEST(RuleEdits, CarryAWeightByItsFactorHoweverItIsWritten)
{
    struct Case
    {
        std::string edited;
        std::string atOtherDial; ///< The weight with w / 3, as limb 1 of a class of three.
    };
    const std::string other = "(i==1)*(1-w)+w/3";
    const Case cases[] = {
        {"2*(" + kWeight + ")", "2*(" + other + ")"},
        {"(" + kWeight + ")*2", "(" + other + ")*2"},
        {"(" + kWeight + ")/4", "(" + other + ")/4"},
        {"2*(i==2)*(1-w)+2*w/4", "2*(" + other + ")"},
        {"w/2+(2-2*w)*(i==2)", "2*(" + other + ")"},
        {"(i==2)*(1-w)+w/2", "(i==1)*(1-w)+2*(w/3)"},
        {"(i==2)*(1-w)", "(i==1)*(1-w)+0*(w/3)"},
        {"w/4", "0*((i==1)*(1-w))+w/3"},
        {"(i==2)*(1-w)+w/12", "(i==1)*(1-w)+0.333333333333*(w/3)"},
        {"0.125", "0.125"},
    };
    for (const Case& c : cases)
    {
        Species species = inferred(samples::thesis());
        edit(species, kWeight + kDraw, c.edited + kDraw);
        const CarriedEdits same = again(species, samples::thesis());
        EXPECT_EQ(same.edits, 1u) << c.edited;
        EXPECT_TRUE(same.conflicts.empty()) << c.edited;
        const CarriedEdits dial = again(species, samples::thesis(), 0.75, kFine);
        EXPECT_EQ(dial.edits, 1u) << c.edited;
        EXPECT_TRUE(dial.conflicts.empty()) << c.edited;
        EXPECT_TRUE(has(species, "III2(i, turn) -> +(turn+r)F(s)+(b)F(s)VIII(1, 0) : " + c.atOtherDial + kDraw))
            << c.edited << "\n"
            << printWithOrigins(species);
        // And back again, twice, without growing.
        (void)again(species, samples::thesis());
        const Species once = species;
        EXPECT_EQ(again(species, samples::thesis()).edits, 1u) << c.edited;
        EXPECT_EQ(species, once) << c.edited;
    }
}

TEST(RuleEdits, SurviveABranchMore)
{
    Species species = inferred(samples::thesis());
    edit(species, kWeight + kDraw, "2*(" + kWeight + ")" + kDraw);
    edit(species, "(i==1)*(1-w)+w/4 : ~ IV(1)", "3*((i==1)*(1-w)+w/4) : ~ IV(1)");
    // The trunk carries all, so its limb is another one; but it stands where it stood.
    edit(species, "VII -> F(s)[-(b)F(s)III(0, 20)][F(s)VI(0, 20)]+(b)F(s)VI(1, -20) : ~ VII(0)",
         "VII -> F(s)[-(b)F(s)III(0, 20)][F(s)VI(0, 20)]+(b)F(s)VI(1, -20) : 5 : ~ VII(0)");
    // A first III on the way: all that follow are numbered otherwise.
    const CarriedEdits carried = again(species, with(samples::thesis(), 2, "III"));
    EXPECT_EQ(carried.edits, 3u);
    EXPECT_TRUE(carried.conflicts.empty()) << carried.conflicts[0].reason;
    const std::string text = printWithOrigins(species);
    EXPECT_TRUE(has(species, "III(i, turn) -> +(turn+r)F(s)+(b)F(s)VIII(1, 0) : 2*((i==2)*(1-w)+w/5) : ~ III(2)") ||
                has(species, "III(i, turn) -> +(turn+r)F(s)+(b)F(s)VIII(1, 0) : 2*((i==3)*(1-w)+w/5) : ~ III(3)"))
        << text;
    EXPECT_NE(text.find("3*((i=="), std::string::npos) << text;
    EXPECT_NE(text.find(" : 5 : ~ VII(0)"), std::string::npos) << text;
}

TEST(RuleEdits, OfALimbThatIsGoneAreConflicts)
{
    Species species = inferred(samples::thesis());
    edit(species, kWeight + kDraw, "2*(" + kWeight + ")" + kDraw);
    const CarriedEdits carried = again(species, without(samples::thesis(), {11}));
    EXPECT_EQ(carried.edits, 0u);
    ASSERT_EQ(carried.conflicts.size(), 1u);
    EXPECT_EQ(carried.conflicts[0].inferred, kRule + kWeight + kDraw);
    EXPECT_EQ(carried.conflicts[0].edited, kRule + "2*(" + kWeight + ")" + kDraw);
    EXPECT_EQ(carried.conflicts[0].reason, "what it stands for is no longer drawn");
    EXPECT_EQ(species.conflicts, carried.conflicts);
    EXPECT_TRUE(hasEdits(species));
    EXPECT_NE(printWithOrigins(species).find("# conflict: "), std::string::npos);
    // It stays until somebody has looked at it, and does not multiply.
    EXPECT_TRUE(again(species, without(samples::thesis(), {11})).conflicts.empty());
    EXPECT_EQ(species.conflicts.size(), 1u);
}

TEST(RuleEdits, RemovedRulesStayRemoved)
{
    Species species = inferred(samples::thesis());
    edit(species, kRule + kWeight + kDraw, "");
    EXPECT_EQ(again(species, samples::thesis(), 0.75, kFine).edits, 1u);
    for (const std::string& rule : rulesOf(species.grammar))
        EXPECT_EQ(rule.find("~ III(2)"), std::string::npos) << rule;
    EXPECT_EQ(summarizeEdits(species).removed, 1u);
    // What is no longer drawn needs no removing.
    const CarriedEdits gone = again(species, without(samples::thesis(), {11}));
    EXPECT_EQ(gone.edits, 0u);
    EXPECT_TRUE(gone.conflicts.empty());
}

TEST(RuleEdits, AddedRulesStayWhereTheirSymbolsDo)
{
    Species species = inferred(samples::thesis());
    edit(species, "symbols: ", "symbols: Bud ");
    edit(species, kRule, "III(i, turn) -> F(s)Bud(2)VIII(3, 0) : w/8 : ~ III(1)\nBud(x) -> F(x)\n" + kRule);
    EXPECT_EQ(summarizeEdits(species).added, 2u);
    const CarriedEdits carried = again(species, samples::thesis(), 0.75, kFine);
    // In finer classes the four limbs III are no longer kin: to which of them one more look belongs, nobody knows.
    ASSERT_EQ(carried.conflicts.size(), 1u);
    EXPECT_EQ(carried.conflicts[0].inferred, "");
    EXPECT_TRUE(has(species, "Bud(x) -> F(x)"));

    species = inferred(samples::thesis());
    edit(species, "symbols: ", "symbols: Bud ");
    edit(species, kRule, "III(i, turn) -> F(s)Bud(2)VIII(3, 0) : w/8 : ~ III(1)\nBud(x) -> F(x)\n" + kRule);
    EXPECT_TRUE(again(species, with(samples::thesis(), 2, "VIII"), 0.75).conflicts.empty());
    EXPECT_EQ(summarizeEdits(species).added, 2u);
    const std::string text = printWithOrigins(species);
    EXPECT_TRUE(has(species, "III(i, turn) -> F(s)Bud(2)VIII(4, 0) : w/8 : ~ III(1)") ||
                has(species, "III(i, turn) -> F(s)Bud(2)VIII(3, 0) : w/8 : ~ III(1)"))
        << text;
}

TEST(RuleEdits, CarryASuccessorWithTheNumbersItsLimbsHaveNow)
{
    Species species = inferred(samples::thesis());
    edit(species, kRule, "III(i, turn) -> +(turn+r)F(s)F(s)+(b)F(s)VIII(2, 0) : ");
    EXPECT_EQ(summarizeEdits(species).changed, 1u);
    const CarriedEdits carried = again(species, samples::thesis(), 0.75, kFine);
    EXPECT_TRUE(carried.conflicts.empty());
    EXPECT_TRUE(has(species, "III2(i, turn) -> +(turn+r)F(s)F(s)+(b)F(s)VIII(2, 0) : (i==1)*(1-w)+w/3 : ~ III(2)"))
        << printWithOrigins(species);
    // Without what it names, and where inference says something else too, it cannot be carried.
    Species gone = species;
    const CarriedEdits without16 = again(gone, without(samples::thesis(), {16}));
    ASSERT_EQ(without16.conflicts.size(), 1u);
    EXPECT_NE(without16.conflicts[0].reason.find("no longer drawn"), std::string::npos)
        << without16.conflicts[0].reason;
    Species both = species;
    const CarriedEdits without12 = again(both, without(samples::thesis(), {12}));
    ASSERT_EQ(without12.conflicts.size(), 1u);
    EXPECT_EQ(without12.conflicts[0].reason, "inference has changed the same");
}

TEST(RuleEdits, CarrySettingsThatInferenceLeavesAlone)
{
    Species species = inferred(samples::thesis());
    edit(species, "let w = 0.5", "let k = 2\nlet w = 0.25*k/2\nangle: 30");
    edit(species, kWeight + kDraw, "k*(" + kWeight + ")" + kDraw);
    EXPECT_TRUE(again(species, samples::thesis(), 0.5, kFine).conflicts.empty());
    const std::string text = printGrammar(species.grammar);
    EXPECT_NE(text.find("let k = 2\nlet w = 0.25*k/2\nangle: 30\n"), std::string::npos) << text;
    EXPECT_NE(text.find("k*((i==1)*(1-w)+w/3)"), std::string::npos) << text;
    const CarriedEdits dial = again(species, samples::thesis(), 0.75, kFine);
    ASSERT_EQ(dial.conflicts.size(), 1u);
    EXPECT_EQ(dial.conflicts[0].edited, "let w = 0.25*k/2");
    EXPECT_EQ(dial.conflicts[0].reason, "inference now says let w = 0.75");
    EXPECT_NE(printGrammar(species.grammar).find("let w = 0.75\n"), std::string::npos);
}

TEST(RuleEdits, LeaveLockedRulesAsTheyAre)
{
    Species species = inferred(samples::thesis());
    EXPECT_EQ(lockRules(species, "III(2)", true).value(), 1u);
    EXPECT_EQ(lockRules(species, "VI", true).value(), 3u);
    EXPECT_NE(printWithOrigins(species).find(kDraw + "  # 1 drawn: 0:11; locked"), std::string::npos);
    EXPECT_TRUE(hasEdits(species));
    // Its weight and all stay, though the class has five limbs now; that a limb has another number is no change.
    const CarriedEdits carried = again(species, with(samples::thesis(), 2, "III"));
    EXPECT_EQ(carried.locks, 4u);
    EXPECT_TRUE(carried.conflicts.empty());
    EXPECT_TRUE(has(species, kRule + kWeight + kDraw) ||
                has(species, "III(i, turn) -> +(turn+r)F(s)+(b)F(s)VIII(1, 0) : (i==3)*(1-w)+w/4 : ~ III(3)"))
        << printWithOrigins(species);
    EXPECT_EQ(lockRules(species, "VI", false).value(), 3u);
    EXPECT_EQ(summarizeEdits(species).locked, 1u);
    // A locked rule of a limb that is gone is told.
    EXPECT_EQ(again(species, without(samples::thesis(), {11})).conflicts.size(), 1u);
}

TEST(RuleEdits, LockByLineOfThePrintedText)
{
    Species species = inferred(samples::thesis());
    std::istringstream text(printWithOrigins(species));
    std::uint32_t line = 1;
    std::string content;
    while (std::getline(text, content) && !content.starts_with(kRule))
        ++line;
    EXPECT_EQ(lockRules(species, std::to_string(line), true).value(), 1u);
    EXPECT_NE(printWithOrigins(species).find(kDraw + "  # 1 drawn: 0:11; locked"), std::string::npos);
    for (const char* none : {"1", "0", "999", "IX", "III(9)", "III(x)", "III(", "", "99999999999999999999", "F"})
        EXPECT_FALSE(lockRules(species, none, true)) << none;
    edit(species, "II -> F(s)-(b)F(s)", "II -> F : 3\nII -> F(s)-(b)F(s)");
    EXPECT_EQ(lockRules(species, "II", true).value(), 1u); // the inferred one of the two
    Species unknown = species;
    unknown.rules.clear();
    EXPECT_FALSE(lockRules(unknown, "III", true));
}

TEST(RuleEdits, KeepWhatInferenceDoesNotKnow)
{
    Species species = inferred(samples::thesis());
    species.appearance.bark.tile = 2;
    species.appearance.palette = {Vec3(1, 0, 0)};
    Species anew = inferred(samples::thesis(), 0.75);
    (void)carryEdits(species, anew);
    EXPECT_EQ(anew.appearance.bark.tile, 2);
    EXPECT_EQ(anew.appearance.palette, species.appearance.palette);
    EXPECT_FALSE(hasEdits(anew));
    anew.appearance = {};
    Species alone = inferred(samples::thesis(), 0.75);
    alone.appearance = {};
    EXPECT_EQ(anew, alone); // nothing else has changed
}

TEST(RuleEdits, ThatAreHardlyMeantAreDoubted)
{
    Species species = inferred(samples::thesis());
    EXPECT_TRUE(doubtsOf(species).empty());
    const auto doubtsAfter = [&](const std::string& from, const std::string& to) {
        Species edited = species;
        edit(edited, from, to);
        return doubtsOf(edited);
    };
    const std::string rules = printGrammar(species.grammar);
    const std::size_t at = rules.find("III(", rules.find("->")); // some limb that hangs somewhere
    ASSERT_NE(at, std::string::npos);
    const std::string limb = rules.substr(at, rules.find(')', at) + 1 - at);
    const std::string numbers = limb.substr(limb.find('('));
    EXPECT_EQ(doubtsAfter(limb, "iIi" + numbers),
              std::vector<std::string>{"`iIi` draws nothing, and no rule rewrites it"});
    EXPECT_EQ(doubtsAfter(limb, "III(99" + numbers.substr(numbers.find(','))).size(), 1u);
    EXPECT_EQ(doubtsAfter(limb, "III(1, 2, 3)").size(), 1u);
    EXPECT_TRUE(doubtsAfter("let w = 0.5", "let w = 0.25").empty());
    EXPECT_TRUE(doubtsAfter("F(s)", "F(s)~L@(0.1)").empty()) << "organs and balls are drawn";
}

TEST(RuleEdits, KeepPipesThatWereEditedInTheFile)
{
    Species species = inferred(samples::thesis());
    EXPECT_FALSE(hasEditedPipes(species) || hasEditedTables(species));
    species.appearance.pipes.tipRadius *= 2;
    EXPECT_TRUE(hasEditedPipes(species));
    EXPECT_FALSE(hasEditedTables(species));
    const float thick = species.appearance.pipes.tipRadius;
    for (int times = 0; times < 2; ++times)
    {
        (void)again(species, samples::thesis());
        EXPECT_EQ(species.appearance.pipes.tipRadius, thick) << times;
        EXPECT_TRUE(hasEditedPipes(species)) << times;
    }
    // Those that nobody edited follow the drawing.
    Species unedited = inferred(samples::thesis());
    (void)again(unedited, samples::bush());
    EXPECT_EQ(unedited.appearance.pipes, inferred(samples::bush()).appearance.pipes);
    unedited.window->maxSegments += 1;
    EXPECT_TRUE(hasEditedTables(unedited));
}

TEST(RuleEdits, ThatTogetherDoNotGrowAreConflicts)
{
    Species species = inferred(samples::thesis());
    edit(species, "let w = 0.5", "let w = 0.5\nlet z = 0");
    edit(species, "VII -> F(s)", "VII -> F(1/z)");
    const CarriedEdits carried = again(species, samples::thesis());
    EXPECT_EQ(carried.edits, 0u);
    ASSERT_EQ(carried.conflicts.size(), 2u);
    EXPECT_NE(carried.conflicts[0].reason.find("would not grow"), std::string::npos);
}

TEST(RuleEdits, OfHelbergGoByTheirText)
{
    const Archetype archetype = samples::thesis();
    const auto infer = [&] { return inferSpecies({&archetype, 1}, {.preset = "helberg", .mergeWeight = 0.5}).value(); };
    Species species = infer();
    edit(species, "H -> F(s)-(b)F(s)G : ~ II", "H -> F(s)-(b)F(s)F(s)G : ~ II");
    Species anew = infer();
    const CarriedEdits carried = carryEdits(species, anew);
    EXPECT_EQ(carried.edits, 1u);
    EXPECT_TRUE(carried.conflicts.empty());
    EXPECT_EQ(anew.grammar, species.grammar);
}

TEST(RuleEdits, AreUnknownWhereTheFileItselfWasEdited)
{
    Species species = inferred(samples::thesis());
    EXPECT_TRUE(knowsInferred(species));
    edit(species, kWeight + kDraw, "2*(" + kWeight + ")" + kDraw);
    EXPECT_TRUE(knowsInferred(species));
    std::string text = printSpecies(inferred(samples::thesis()));
    text.replace(text.find("let w = 0.5"), 11, "let w = 0.6");
    EXPECT_FALSE(knowsInferred(parseSpecies(text, "edited by hand").value()));
    species.provenance.grammar.clear(); // of an earlier version
    EXPECT_TRUE(knowsInferred(species));
}

TEST(RuleEdits, SurviveWhateverElseIsDrawn)
{
    for (std::uint32_t seed = 0; seed < 80; ++seed)
    {
        const RandomKey key(Seed{seed});
        const Archetype archetype = samples::randomArchetype(Seed{seed}, 20 + seed, 1 + seed % 2);
        const auto level = [&](std::uint32_t which) {
            return static_cast<double>(key.below(Purpose::Sampling, 7, which)) / 6;
        };
        Species species = inferred(archetype, 0.5, level(0));
        const std::vector<RuleOrigin> former = species.rules;

        // Some weights times three.
        Grammar edited = species.grammar;
        std::vector<std::uint32_t> editedRules;
        for (std::uint32_t r = 0; r < edited.productions.size(); ++r)
            if (key.below(Purpose::Sampling, 4, 10 + r) == 0)
            {
                ExpressionId& weight = edited.productions[r].weight;
                const ExpressionId three = edited.expressions.number(3);
                weight =
                    weight == kNoExpression ? three : edited.expressions.binary(ExpressionOp::Multiply, three, weight);
                editedRules.push_back(r);
            }
        setGrammar(species, parseGrammar(printGrammar(edited), "edited", {}).value());
        ASSERT_EQ(summarizeEdits(species).edits(), editedRules.size()) << "seed " << seed;

        // A limb less, a branch more.
        Archetype changed =
            without(archetype,
                    {1 + static_cast<std::uint32_t>(key.below(Purpose::Sampling, archetype.instances.size() - 1, 1))});
        const AnchorTable anchors = anchorsOf(changed);
        for (std::uint32_t i = 0; i < changed.instances.size(); ++i)
            if (std::find(anchors.children.begin() + anchors.firstChild[i],
                          anchors.children.begin() + anchors.firstChild[i + 1],
                          kNoInstance) != anchors.children.begin() + anchors.firstChild[i + 1])
            {
                changed = with(changed, i, "fork");
                break;
            }
        const CarriedEdits carried = again(species, changed, 0.25, level(2));

        std::uint32_t expected = 0;
        for (const std::uint32_t r : editedRules)
        {
            const auto same = [&](const RuleOrigin& rule) {
                return rule.limb == former[r].limb || rule.place == former[r].place;
            };
            const auto found = std::ranges::find_if(species.rules, same);
            expected += found != species.rules.end() ? 1 : 0;
        }
        // An edit of limbs that shared a rule counts once for each rule that they have now.
        EXPECT_GE(carried.edits + carried.conflicts.size(), editedRules.size()) << "seed " << seed;
        // A place can be taken by a limb that is known by itself; that is rare.
        EXPECT_GE(carried.edits + 3, expected) << "seed " << seed;
        for (const EditConflict& conflict : carried.conflicts)
            EXPECT_TRUE(conflict.reason == "what it stands for is no longer drawn" ||
                        conflict.reason == "its limb shares a rule with others now")
                << "seed " << seed << ": " << conflict.reason;

        const RuleMatch match = matchRules(species.inferred.value_or(species.grammar), species.grammar);
        std::uint32_t tripled = 0;
        for (std::uint32_t e = 0; e < species.grammar.productions.size(); ++e)
        {
            const Production& now = species.grammar.productions[e];
            if (!species.inferred)
                break;
            ASSERT_NE(match.inferredOf[e], kNoRule);
            const Production& base = species.inferred->productions[match.inferredOf[e]];
            const std::string weight = keyOf(species.grammar, now.weight);
            const std::string baseWeight = keyOf(*species.inferred, base.weight);
            if (weight == baseWeight)
                continue;
            ++tripled;
            EXPECT_NE(weight.find('3'), std::string::npos);
            EXPECT_NE(weight.find(baseWeight), std::string::npos) << weight << " of " << baseWeight;
        }
        EXPECT_EQ(tripled, carried.edits) << "seed " << seed;
    }
}

} // namespace espalier
