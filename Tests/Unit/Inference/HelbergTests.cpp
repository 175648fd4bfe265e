#include <Espalier/Inference/InferenceContext.h>

#include <Espalier/Core/Json.h>
#include <Espalier/Species/Grow.h>
#include <Inference/SampleArchetypes.h>
#include <algorithm>
#include <gtest/gtest.h>
#include <set>
#include <sstream>

namespace espalier {

namespace {

/// What the trace of an inference shows.
struct Traced
{
    std::string pass;
    std::string summary;
    std::vector<std::string> rules;
};

std::vector<std::string> linesOf(const std::string& text)
{
    std::vector<std::string> lines;
    std::istringstream in(text);
    for (std::string line; std::getline(in, line);)
        lines.push_back(line);
    return lines;
}

std::vector<Traced> traceOf(const Archetype& archetype, InferenceOptions options, Species* species = nullptr)
{
    std::vector<Traced> passes;
    options.preset = "helberg";
    options.trace = [&](std::string_view pass, const std::string& summary, const std::string& grammar) {
        passes.push_back({std::string(pass), summary, linesOf(grammar)});
    };
    auto inferred = inferSpecies({&archetype, 1}, options);
    EXPECT_TRUE(inferred) << toString(inferred.error());
    if (species)
        *species = std::move(*inferred);
    return passes;
}

bool contains(const std::string& text, const std::string& part)
{
    return text.find(part) != std::string::npos;
}

/// A grammar as plain strings, to merge symbols the long way round.
struct PlainGrammar
{
    using Rule = std::pair<std::uint32_t, std::vector<std::string>>;
    std::vector<Rule> rules;

    static std::string name(std::uint32_t symbol) { return "N" + std::to_string(symbol); }

    [[nodiscard]] std::size_t length() const
    {
        std::set<std::string> symbols;
        std::size_t sum = 0;
        for (const Rule& rule : rules)
        {
            symbols.insert(name(rule.first));
            symbols.insert(rule.second.begin(), rule.second.end());
            sum += rule.second.size();
        }
        return symbols.size() + sum;
    }

    [[nodiscard]] PlainGrammar renamed(std::uint32_t from, std::uint32_t into) const
    {
        PlainGrammar result = *this;
        for (Rule& rule : result.rules)
        {
            rule.first = rule.first == from ? into : rule.first;
            std::ranges::replace(rule.second, name(from), name(into));
        }
        return result;
    }

    [[nodiscard]] PlainGrammar unrepeated() const
    {
        PlainGrammar result;
        for (const Rule& rule : rules)
            if (std::ranges::find(result.rules, rule) == result.rules.end())
                result.rules.push_back(rule);
        return result;
    }
};

std::size_t editDistance(const std::vector<std::string>& a, const std::vector<std::string>& b)
{
    std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
    for (std::size_t i = 0; i <= a.size(); ++i)
        for (std::size_t j = 0; j <= b.size(); ++j)
            d[i][j] =
                i == 0 ? j
                : j == 0
                    ? i
                    : std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1)});
    return d[a.size()][b.size()];
}

PlainGrammar plain(const DraftGrammar& draft, const TemplateLibrary& library)
{
    PlainGrammar result;
    for (const DraftRule& rule : draft.rules)
    {
        std::vector<std::string> rhs;
        if (rule.piece == kNoPiece)
            for (const std::uint32_t child : rule.children)
                rhs.push_back(PlainGrammar::name(child));
        else
            for (const TemplateModule& module : library.templates[rule.piece].modules)
                rhs.push_back(module.anchor != kNoAnchor
                                  ? PlainGrammar::name(rule.children[module.anchor])
                                  : module.symbol + (module.hasNumber ? formatNumber(module.number) : std::string()));
        result.rules.emplace_back(rule.symbol, rhs);
    }
    return result;
}

/// Merges greedily as chapter 5 says, every cost from scratch.
PlainGrammar generalized(PlainGrammar grammar, double weight)
{
    for (;;)
    {
        std::set<std::uint32_t> symbols;
        for (const auto& rule : grammar.rules)
            if (rule.first != 0)
                symbols.insert(rule.first);
        double least = 0;
        PlainGrammar best;
        for (const std::uint32_t into : symbols)
            for (const std::uint32_t from : symbols)
            {
                if (from <= into)
                    continue;
                const PlainGrammar renamed = grammar.renamed(from, into);
                std::size_t distance = 0;
                for (std::size_t a = 0; a < grammar.rules.size(); ++a)
                    for (std::size_t b = 0; b < grammar.rules.size(); ++b)
                        if (grammar.rules[a].first == into && grammar.rules[b].first == from)
                            distance += editDistance(renamed.rules[a].second, renamed.rules[b].second);
                PlainGrammar merged = renamed.unrepeated();
                const double shorter = static_cast<double>(merged.length()) - static_cast<double>(grammar.length());
                const double cost = weight * shorter + (1 - weight) * static_cast<double>(distance);
                if (cost < least)
                {
                    least = cost;
                    best = std::move(merged);
                }
            }
        if (best.rules.empty())
            return grammar;
        grammar = std::move(best);
    }
}

InferenceContext compressed(const Archetype& archetype, const InferenceOptions& options)
{
    InferenceContext context{options, archetype, anchorsOf(archetype), {}, {}, {}, {}, {}, {}, {}, {}, {}, {}};
    EXPECT_TRUE(inferBreadthFirst(context));
    EXPECT_TRUE(compressRepeatedSubtrees(context));
    return context;
}

} // namespace

TEST(Helberg, InfersTheRulesOfTheThesis)
{
    const std::vector<std::string> rules = {"S -> A",
                                            "A -> F[-FB][FC]+FD",
                                            "B -> F+FE",
                                            "C -> F[FG]+FH",
                                            "D -> F[FI]+FJ",
                                            "E -> F[-FK]+FL",
                                            "G -> _",
                                            "H -> F-FM",
                                            "I -> F[+FN]F[-FO]FP",
                                            "J -> F[FQ]+FR",
                                            "K -> _",
                                            "L -> F[-FT]+FU",
                                            "M -> _",
                                            "N -> _",
                                            "O -> _",
                                            "P -> F[-FV]+FW",
                                            "Q -> F[-FX]+FY",
                                            "R -> _",
                                            "T -> F+FZ",
                                            "U -> _",
                                            "V -> F+Fa",
                                            "W -> _",
                                            "X -> F+Fb",
                                            "Y -> _",
                                            "Z -> F[+Fc]F[-Fd]Fe",
                                            "a -> F[+Ff]F[-Fg]Fh",
                                            "b -> F[+Fi]F[-Fj]Fk",
                                            "c -> _",
                                            "d -> _",
                                            "e -> _",
                                            "f -> _",
                                            "g -> _",
                                            "h -> _",
                                            "i -> _",
                                            "j -> _",
                                            "k -> _"};
    const std::vector<Traced> passes = traceOf(samples::thesis(), {.mergeWeight = 0.5, .ruleWeight = 0.5});
    ASSERT_EQ(passes.size(), 4u);
    EXPECT_EQ(passes[0].pass, "infer");
    EXPECT_EQ(passes[0].rules, rules);
    EXPECT_TRUE(contains(passes[0].summary, "36 rules")) << passes[0].summary;
    EXPECT_TRUE(contains(passes[0].summary, "L = 187")) << passes[0].summary;
    EXPECT_TRUE(contains(passes[0].summary, "C_i = 93")) << passes[0].summary;
}

TEST(Helberg, CompressesAsTheThesisDoes)
{
    const std::vector<std::string> rules = {"S -> A",
                                            "A -> F[-FB][FC]+FD",
                                            "B -> F+FE",
                                            "C -> F[FG]+FH",
                                            "D -> F[FI]+FJ",
                                            "E -> F[-FK]+FL",
                                            "G -> _",
                                            "H -> F-FM",
                                            "I -> F[+FN]F[-FO]FP",
                                            "J -> F[FL]+FG",
                                            "K -> _",
                                            "L -> F[-FF+FF[+F]F[-F]F]+F",
                                            "M -> _",
                                            "N -> _",
                                            "O -> _",
                                            "P -> F[-FF+FF[+F]F[-F]F]+F"};
    Species species;
    const std::vector<Traced> passes = traceOf(samples::thesis(), {.mergeWeight = 0.0, .ruleWeight = 0.5}, &species);
    EXPECT_EQ(passes[1].pass, "compress");
    EXPECT_EQ(passes[1].rules, rules);
    EXPECT_TRUE(contains(passes[1].summary, "16 rules")) << passes[1].summary;
    EXPECT_TRUE(contains(passes[1].summary, "C_i = 64.5")) << passes[1].summary;

    const auto composite = std::ranges::find_if(
        species.tables, [](const TransformTable& table) { return table.name.starts_with("composite"); });
    ASSERT_NE(composite, species.tables.end());
    ASSERT_EQ(composite->rows.size(), 3u);
    for (const auto& row : composite->rows)
    {
        EXPECT_NEAR(row[0], 1, 1e-12);
        EXPECT_NEAR(row[1], -40.0 / 9, 1e-12);
        EXPECT_NEAR(row[2], 390.0 / 9, 1e-12);
        EXPECT_EQ(row[3], 0);
    }
}

TEST(Helberg, MergesWhatIsCheapestByItsFormula)
{
    for (std::uint32_t seed = 0; seed < 12; ++seed)
        for (const double weight : {0.3, 0.5, 0.8, 1.0})
        {
            const Archetype archetype = samples::randomArchetype(Seed{seed}, 2 + seed % 8);
            const InferenceOptions options{.preset = "helberg", .mergeWeight = weight};
            InferenceContext context = compressed(archetype, options);
            const PlainGrammar before = plain(context.draft, context.exemplars.library);
            ASSERT_TRUE(generalizeByMerging(context));
            PlainGrammar merged = plain(context.draft, context.exemplars.library);
            PlainGrammar expected = generalized(before, weight);
            std::ranges::sort(merged.rules);
            std::ranges::sort(expected.rules);
            EXPECT_EQ(merged.rules, expected.rules) << "seed " << seed << " weight " << weight;
        }
}

TEST(Helberg, GoesFromTheArchetypeToOneSymbolByItsMergeWeight)
{
    const std::vector<Traced> none = traceOf(samples::thesis(), {.mergeWeight = 0.0});
    EXPECT_EQ(none[2].rules, none[1].rules);
    const std::vector<Traced> all = traceOf(samples::thesis(), {.mergeWeight = 1.0});
    for (const std::string& rule : all[2].rules)
        EXPECT_TRUE(rule.starts_with("S -> ") || rule.starts_with("A -> ")) << rule;
}

TEST(Helberg, HasNamesForMoreThanSixtySymbols)
{
    const Archetype archetype = samples::randomArchetype(Seed{5}, 90);
    Species species;
    const std::vector<Traced> passes = traceOf(archetype, {.mergeWeight = 0.0, .ruleWeight = 0.0}, &species);
    EXPECT_GT(passes[0].rules.size(), 60u);
    std::set<std::string> names;
    for (const std::string& rule : passes[0].rules)
        EXPECT_TRUE(names.insert(rule.substr(0, rule.find(' '))).second) << rule;
    EXPECT_TRUE(grow(species, Seed{1}));
}

} // namespace espalier
