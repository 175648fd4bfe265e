#include <Espalier/Inference/KinNames.h>

#include <Espalier/Inference/Inference.h>
#include <Espalier/Species/Grow.h>
#include <Inference/SampleArchetypes.h>
#include <gtest/gtest.h>
#include <set>

namespace espalier {

namespace {

TemplateLibrary libraryOf(const std::vector<std::string>& names)
{
    TemplateLibrary library;
    for (const std::string& name : names)
    {
        Template piece = samples::mixedLibrary().templates[0]; // F[-FX]+FY
        piece.name = name;
        library.templates.push_back(std::move(piece));
    }
    return library;
}

std::vector<std::string> classesOf(const std::vector<std::string>& names, const std::vector<std::uint32_t>& pieces)
{
    return kinNames(libraryOf(names), pieces).classes;
}

using Names = std::vector<std::string>;

} // namespace

TEST(KinNames, CallsClassesAfterTheirTemplates)
{
    EXPECT_EQ(classesOf({"bough", "twig"}, {1, 0, 1, 1, 0}), (Names{"Twig", "Bough", "Twig2", "Twig3", "Bough2"}));
    EXPECT_EQ(classesOf({"I", "VII"}, {1, 0, 1, 0}), (Names{"VII", "I", "VII2", "I2"}));
    EXPECT_EQ(classesOf({"leaf_big"}, {0}), (Names{"Leaf_big"}));
    EXPECT_EQ(occupantName("Bough2", 'X'), "Bough2_X");
}

TEST(KinNames, GivesNoNameTwice)
{
    // The second Bough must not be called as the first of the template bough2.
    EXPECT_EQ(classesOf({"bough", "bough2"}, {0, 0, 1, 0}), (Names{"Bough", "Bough3", "Bough2", "Bough4"}));
    EXPECT_EQ(classesOf({"bough", "Bough"}, {0, 1, 0, 1}), (Names{"Bough", "Bough2", "Bough3", "Bough2n2"}));
    // After a digit a number would read as another one.
    EXPECT_EQ(classesOf({"limb1"}, {0, 0}), (Names{"Limb1", "Limb1n2"}));
    // Bough_X is what hangs at the anchor X of Bough.
    EXPECT_EQ(classesOf({"bough", "bough_X"}, {0, 1}), (Names{"Bough", "BoughX"}));
    EXPECT_EQ(kinNames(libraryOf({"tree", "tree2"}), {0, 1}).start, "Tree3");
}

TEST(KinNames, LeavesTheTurtleItsLetters)
{
    EXPECT_EQ(classesOf({"F", "g", "f", "a"}, {0, 1, 2, 3, 0}), (Names{"B", "C", "D", "A", "B2"}));
    EXPECT_EQ(classesOf({std::string(200, 'a')}, {0, 0}), (Names{"A", "A2"}));
}

TEST(KinNames, NamesWhateverTheTemplatesAreCalledSoThatItReadsBack)
{
    const Names adversaries[] = {
        {"F", "f", "G", "g", "s", "r", "b", "o"},
        {"let", "symbols", "axiom", "interpret", "angle", "step", "draw", "ignore"},
        {"I", "II", "III", "IV", "V", "VI", "VII", "VIII"},
        {"A", "a", "A1", "a1", "A1n2", "A2", "B", "b"},
        {"tree", "Tree", "tree2", "tree_X", "tree_Y", "TreeX", "tree_", "tree__X"},
        {"FX", "fF", "FF", "Ff", "X", "Y", "Z", "XY"},
        {"w", "i", "n", "pi", "rand", "sin", "W", "I"},
        {std::string(256, 'q'), std::string(255, 'q') + "_", "q", "Q", "q1", "Q1", "q_1", "q_Q"},
        {"bough", "bough2", "bough3", "bough22", "Bough", "Bough_X", "bough_x", "boughX"},
        {"homomorphism", "Let", "Symbols", "Axiom", "Interpret", "define", "include", "L"},
    };
    for (const Names& names : adversaries)
        for (std::uint32_t seed = 0; seed < 4; ++seed)
        {
            Archetype archetype = samples::randomArchetype(Seed{seed}, 40, 1 + seed % 2);
            ASSERT_EQ(archetype.library.templates.size(), names.size());
            for (std::size_t i = 0; i < names.size(); ++i)
                archetype.library.templates[i].name = names[i];
            for (const double ruleWeight : {0.0, 1.0 / 3, 1.0})
            {
                const auto species = inferSpecies({&archetype, 1}, {.mergeWeight = 0.5, .ruleWeight = ruleWeight});
                ASSERT_TRUE(species) << names[0] << ": " << toString(species.error());
                const auto read = parseGrammar(printGrammar(species->grammar), names[0], {});
                ASSERT_TRUE(read) << toString(read.error());
                EXPECT_EQ(*read, species->grammar);
                const auto whole = parseSpecies(printSpecies(*species), names[0]);
                ASSERT_TRUE(whole) << toString(whole.error());
                EXPECT_EQ(*whole, *species);
                std::set<std::string> symbols;
                for (const Production& production : species->grammar.productions)
                    symbols.insert(species->grammar.symbols.name(production.predecessor));
                for (const char* turtles : {"F", "G", "f", "+", "-", "&", "^", "/", "[", "]"})
                    EXPECT_FALSE(symbols.contains(turtles)) << names[0];
                EXPECT_TRUE(grow(*species, Seed{1}));
            }
        }
}

} // namespace espalier
