// The four passes of A. Helberg, Template-basierte Synthese von Verzweigungsstrukturen mittels L-Systemen (bachelor
// thesis, HAW Hamburg, 2021), chapter 5, as its text states them. Departures: costs are exact (its program truncates to
// int), D_g is computed (its program had 0 throughout), symbols are unlimited, and transforms stay together as whole
// tuples.

#include <Espalier/Inference/GrammarWriter.h>
#include <Espalier/Inference/InferenceContext.h>

#include <Espalier/Core/Json.h>
#include <algorithm>
#include <map>

namespace espalier {

namespace {

constexpr double kDefaultWeight = 0.5;

DraftTree breadthFirst(const Archetype& exemplars, const AnchorTable& anchors)
{
    DraftTree tree;
    std::vector<std::uint32_t> queue = anchors.roots;
    tree.roots = static_cast<std::uint32_t>(queue.size());
    for (std::size_t i = 0; i < queue.size(); ++i)
    {
        const std::uint32_t instance = queue[i];
        DraftTree::Node node;
        node.firstChild = static_cast<std::uint32_t>(queue.size());
        if (instance != kNoInstance)
        {
            node.piece = exemplars.instances[instance].piece;
            node.transform = exemplars.instances[instance].transform;
            for (std::uint32_t a = anchors.firstChild[instance]; a < anchors.firstChild[instance + 1]; ++a)
                queue.push_back(anchors.children[a]);
        }
        tree.nodes.push_back(node);
    }
    return tree;
}

std::uint32_t anchorCount(const TemplateLibrary& library, const DraftTree::Node& node)
{
    return node.piece == kNoPiece ? 0 : static_cast<std::uint32_t>(library.templates[node.piece].anchors.size());
}

/// A fresh symbol for every node; S stands for the roots.
DraftGrammar grammarOf(const DraftTree& tree, const TemplateLibrary& library)
{
    DraftGrammar draft;
    draft.names = nonterminalNames(tree.nodes.size() + 1, symbolsUsed(library));
    for (std::uint32_t root = 0; root < tree.roots; ++root)
        draft.rules.push_back({0, kNoPiece, {root + 1}, 1});
    for (std::uint32_t i = 0; i < tree.nodes.size(); ++i)
    {
        DraftRule rule{i + 1, tree.nodes[i].piece, {}, 1};
        for (std::uint32_t a = 0; a < anchorCount(library, tree.nodes[i]); ++a)
            rule.children.push_back(tree.nodes[i].firstChild + a + 1);
        draft.rules.push_back(std::move(rule));
    }
    return draft;
}

std::size_t lengthOf(const DraftRule& rule, const TemplateLibrary& library)
{
    return rule.piece == kNoPiece ? rule.children.size() : library.templates[rule.piece].modules.size();
}

/// C_i = sum over rules of w_l * |rhs| + (1 - w_l) * uses, from exact integer sums.
double costOf(const DraftGrammar& draft, const TemplateLibrary& library, double ruleWeight)
{
    std::uint64_t lengths = 0;
    std::uint64_t uses = 0;
    for (const DraftRule& rule : draft.rules)
    {
        lengths += lengthOf(rule, library);
        uses += rule.uses;
    }
    return ruleWeight * static_cast<double>(lengths) + (1 - ruleWeight) * static_cast<double>(uses);
}

/// L = number of distinct symbols, terminal and not, + the lengths of all right-hand sides.
std::size_t grammarLength(const DraftGrammar& draft, const TemplateLibrary& library)
{
    std::vector<std::uint32_t> nonterminals;
    std::string terminals;
    std::size_t lengths = 0;
    for (const DraftRule& rule : draft.rules)
    {
        nonterminals.push_back(rule.symbol);
        lengths += lengthOf(rule, library);
        if (rule.piece == kNoPiece)
            continue;
        for (const TemplateModule& module : library.templates[rule.piece].modules)
            if (module.anchor == kNoAnchor &&
                std::string_view("+-[]&^\\/|").find(module.symbol) == std::string_view::npos &&
                terminals.find(module.symbol) == std::string::npos)
                terminals += module.symbol;
    }
    std::ranges::sort(nonterminals);
    nonterminals.erase(std::unique(nonterminals.begin(), nonterminals.end()), nonterminals.end());
    return nonterminals.size() + terminals.size() + lengths;
}

std::string ruleCount(const DraftGrammar& draft, const TemplateLibrary& library)
{
    return std::to_string(draft.rules.size()) +
           " rules, grammar length L = " + std::to_string(grammarLength(draft, library));
}

void replaceSymbol(DraftGrammar& draft, std::uint32_t from, std::uint32_t to)
{
    for (DraftRule& rule : draft.rules)
        std::ranges::replace(rule.children, from, to);
}

/// Of the rules with equal right-hand sides, the last is merged into the first, once for each such group.
void mergeLastOfEqual(DraftGrammar& draft)
{
    std::map<std::pair<std::uint32_t, std::vector<std::uint32_t>>, std::vector<std::uint32_t>> groups;
    for (std::uint32_t i = 0; i < draft.rules.size(); ++i)
        if (draft.rules[i].symbol != 0)
            groups[{draft.rules[i].piece, draft.rules[i].children}].push_back(i);
    std::vector<std::uint32_t> merged;
    for (const auto& [rhs, rules] : groups)
    {
        if (rules.size() < 2)
            continue;
        draft.rules[rules.front()].uses += draft.rules[rules.back()].uses;
        replaceSymbol(draft, draft.rules[rules.back()].symbol, draft.rules[rules.front()].symbol);
        merged.push_back(rules.back());
    }
    std::ranges::sort(merged, std::greater<>{});
    for (const std::uint32_t rule : merged)
        draft.rules.erase(draft.rules.begin() + rule);
}

/// Ids of the subtrees of a draft tree: equal ids for equal templates in equal places, whatever the transforms.
std::vector<std::uint32_t> subtreeIds(const DraftTree& tree, const TemplateLibrary& library)
{
    std::map<std::vector<std::uint32_t>, std::uint32_t> known;
    std::vector<std::uint32_t> ids(tree.nodes.size());
    for (std::size_t i = tree.nodes.size(); i-- > 0;)
    {
        std::vector<std::uint32_t> key{tree.nodes[i].piece};
        for (std::uint32_t a = 0; a < anchorCount(library, tree.nodes[i]); ++a)
            key.push_back(ids[tree.nodes[i].firstChild + a]);
        ids[i] = known.try_emplace(std::move(key), static_cast<std::uint32_t>(known.size())).first->second;
    }
    return ids;
}

/// The first node in breadth-first order whose subtree has a child and stands elsewhere too.
std::size_t firstRepeated(const DraftTree& tree, const TemplateLibrary& library, const std::vector<std::uint32_t>& ids)
{
    std::vector<std::uint32_t> counts(ids.size() + 1, 0);
    for (const std::uint32_t id : ids)
        ++counts[id];
    for (std::size_t i = 0; i < ids.size(); ++i)
    {
        const std::uint32_t children = anchorCount(library, tree.nodes[i]);
        for (std::uint32_t a = 0; a < children && counts[ids[i]] > 1; ++a)
            if (tree.nodes[tree.nodes[i].firstChild + a].piece != kNoPiece)
                return i;
    }
    return ids.size();
}

/// Appends the word of the subtree at `node`, fully derived, and adds up its transforms.
void deriveSubtree(const DraftTree& tree, const TemplateLibrary& library, std::size_t root,
                   std::vector<TemplateModule>* word, InstanceTransform& sum, std::uint32_t& count)
{
    struct Frame
    {
        std::size_t node;
        std::size_t position;
    };
    std::vector<Frame> frames;
    const auto enter = [&](std::size_t node) {
        const InstanceTransform& t = tree.nodes[node].transform;
        sum.scaling += t.scaling;
        sum.rotation += t.rotation;
        sum.branchingAngle += t.branchingAngle;
        sum.roll += t.roll;
        ++count;
        frames.push_back({node, 0});
    };
    enter(root);
    while (!frames.empty())
    {
        Frame& frame = frames.back();
        const DraftTree::Node& node = tree.nodes[frame.node];
        const std::vector<TemplateModule>& modules = library.templates[node.piece].modules;
        if (frame.position == modules.size())
        {
            frames.pop_back();
            continue;
        }
        const TemplateModule& module = modules[frame.position++];
        if (module.anchor == kNoAnchor)
        {
            if (word)
                word->push_back(module);
        }
        else if (const std::size_t child = node.firstChild + module.anchor; tree.nodes[child].piece != kNoPiece)
            enter(child);
    }
}

/// The tree in which every occurrence of subtree `id` is a leaf: a new template, placed by the mean transform of all
/// instances in all occurrences.
DraftTree foldSubtree(const DraftTree& tree, const std::vector<std::uint32_t>& ids, std::uint32_t id,
                      TemplateLibrary& library)
{
    Template composite;
    composite.name = "composite" + std::to_string(library.templates.size() + 1);
    while (library.find(composite.name) != library.templates.size())
        composite.name += "_";
    InstanceTransform sum{0, 0, 0, 0};
    std::uint32_t count = 0;
    for (std::size_t i = 0; i < ids.size(); ++i)
        if (ids[i] == id)
            deriveSubtree(tree, library, i, composite.modules.empty() ? &composite.modules : nullptr, sum, count);
    const InstanceTransform mean{sum.scaling / count, sum.rotation / count, sum.branchingAngle / count,
                                 sum.roll / count};
    const auto piece = static_cast<std::uint32_t>(library.templates.size());

    DraftTree folded;
    folded.roots = tree.roots;
    std::vector<std::size_t> queue;
    for (std::uint32_t i = 0; i < tree.roots; ++i)
        queue.push_back(i);
    for (std::size_t i = 0; i < queue.size(); ++i)
    {
        DraftTree::Node node = tree.nodes[queue[i]];
        const std::uint32_t oldFirst = node.firstChild;
        node.firstChild = static_cast<std::uint32_t>(queue.size());
        if (ids[queue[i]] == id)
        {
            node.piece = piece;
            node.transform = mean;
        }
        else
            for (std::uint32_t a = 0; a < anchorCount(library, node); ++a)
                queue.push_back(oldFirst + a);
        folded.nodes.push_back(node);
    }
    library.templates.push_back(std::move(composite));
    return folded;
}

/// A right-hand side as numbers: nonterminals by their symbol, terminals counted down from kNoPiece.
using Tokens = std::vector<std::uint32_t>;

/// `terminals` are those met so far.
Tokens tokensOf(const DraftRule& rule, const TemplateLibrary& library, std::vector<TemplateModule>& terminals)
{
    if (rule.piece == kNoPiece)
        return rule.children;
    Tokens tokens;
    for (const TemplateModule& module : library.templates[rule.piece].modules)
    {
        if (module.anchor != kNoAnchor)
        {
            tokens.push_back(rule.children[module.anchor]);
            continue;
        }
        const auto known = static_cast<std::uint32_t>(std::ranges::find(terminals, module) - terminals.begin());
        if (known == terminals.size())
            terminals.push_back(module);
        tokens.push_back(kNoPiece - known);
    }
    return tokens;
}

/// Levenshtein distance: insertions, deletions and replacements of one symbol each; `from` reads as `into`. Where it is
/// more than `most`, something between the two.
double editDistance(const Tokens& a, const Tokens& b, std::uint32_t into, std::uint32_t from, double most,
                    std::vector<std::uint32_t>& row)
{
    const auto renamed = [&](std::uint32_t token) { return token == from ? into : token; };
    row.resize(b.size() + 1);
    for (std::uint32_t j = 0; j < row.size(); ++j)
        row[j] = j;
    for (std::size_t i = 1; i <= a.size(); ++i)
    {
        std::uint32_t diagonal = row[0];
        std::uint32_t least = row[0] = static_cast<std::uint32_t>(i);
        for (std::size_t j = 1; j <= b.size(); ++j)
        {
            const std::uint32_t replaced = diagonal + (renamed(a[i - 1]) == renamed(b[j - 1]) ? 0 : 1);
            diagonal = row[j];
            row[j] = std::min({replaced, row[j] + 1, row[j - 1] + 1});
            least = std::min(least, row[j]);
        }
        if (least > most) // it never falls from one row to the next
            return least;
    }
    return row.back();
}

/// A merge of two symbols, weighed.
struct Merge
{
    std::uint32_t into = 0;
    std::uint32_t from = 0;
    double cost = 0; ///< C_g
};

/// The merge of symbols `into` and `from`: their rules become one symbol's, equal ones one.
DraftGrammar merged(const DraftGrammar& draft, std::uint32_t into, std::uint32_t from)
{
    DraftGrammar result = draft;
    replaceSymbol(result, from, into);
    for (DraftRule& rule : result.rules)
        if (rule.symbol == from)
            rule.symbol = into;
    std::ranges::stable_sort(result.rules, {}, &DraftRule::symbol);
    // Equal rules of one symbol become one, which bears their uses.
    std::vector<DraftRule> kept;
    for (DraftRule& rule : result.rules)
    {
        const auto same = std::find_if(kept.rbegin(), kept.rend(), [&](const DraftRule& other) {
            return other.symbol == rule.symbol && other.piece == rule.piece && other.children == rule.children;
        });
        if (same == kept.rend())
            kept.push_back(std::move(rule));
        else
            same->uses += rule.uses;
    }
    result.rules = std::move(kept);
    return result;
}

/// C_g = w_0 * (L(new) - L(old)) + (1 - w_0) * D_g, D_g the summed edit distance between the right-hand sides of the
/// two symbols once they bear the same name; for every pair of symbols of one draft.
class MergeCosts
{
public:
    MergeCosts(const DraftGrammar& draft, const TemplateLibrary& library, double weight)
        : rules_(draft.rules), weight_(weight), rulesOf_(draft.names.size()), mentions_(draft.names.size())
    {
        std::vector<TemplateModule> terminals;
        for (std::uint32_t i = 0; i < rules_.size(); ++i)
        {
            tokens_.push_back(tokensOf(rules_[i], library, terminals));
            rulesOf_[rules_[i].symbol].push_back(i);
            mention(rules_[i].symbol, i);
            for (const std::uint32_t child : rules_[i].children)
                mention(child, i);
        }
    }

    /// The cost if it is below `bound`, else something not below it.
    double operator()(std::uint32_t into, std::uint32_t from, double bound)
    {
        const double shortened = -weight_ * shorterBy(into, from);
        if (shortened >= bound || weight_ == 1)
            return shortened;
        const double most = (bound - shortened) / (1 - weight_) + 1; // 1 for rounding
        double distance = 0;
        for (const std::uint32_t a : rulesOf_[into])
            for (const std::uint32_t b : rulesOf_[from])
                if ((distance += editDistance(tokens_[a], tokens_[b], into, from, most - distance, row_)) > most)
                    return bound;
        return shortened + (1 - weight_) * distance;
    }

private:
    void mention(std::uint32_t symbol, std::uint32_t rule)
    {
        if (mentions_[symbol].empty() || mentions_[symbol].back() != rule)
            mentions_[symbol].push_back(rule);
    }

    /// By how much L falls: the symbol itself, and the rules that become equal to others. Only those that mention one
    /// of the two symbols can.
    double shorterBy(std::uint32_t into, std::uint32_t from)
    {
        touched_.clear();
        std::ranges::set_union(mentions_[into], mentions_[from], std::back_inserter(touched_));
        const auto same = [&](std::uint32_t a, std::uint32_t b) {
            const auto equal = [&](std::uint32_t x, std::uint32_t y) {
                return (x == from ? into : x) == (y == from ? into : y);
            };
            return rules_[a].piece == rules_[b].piece && equal(rules_[a].symbol, rules_[b].symbol) &&
                   std::ranges::equal(rules_[a].children, rules_[b].children, equal);
        };
        double shorter = 1;
        for (auto rule = touched_.begin(); rule != touched_.end(); ++rule)
            if (std::any_of(touched_.begin(), rule, [&](std::uint32_t earlier) { return same(earlier, *rule); }))
                shorter += static_cast<double>(tokens_[*rule].size());
        return shorter;
    }

    const std::vector<DraftRule>& rules_;
    double weight_;
    std::vector<Tokens> tokens_;                       ///< Of each rule.
    std::vector<std::vector<std::uint32_t>> rulesOf_;  ///< Of each symbol.
    std::vector<std::vector<std::uint32_t>> mentions_; ///< Rules in which a symbol stands, ascending.
    std::vector<std::uint32_t> touched_;               ///< Scratch.
    std::vector<std::uint32_t> row_;                   ///< Scratch.
};

} // namespace

Expected<void> inferBreadthFirst(InferenceContext& context)
{
    context.tree = breadthFirst(context.exemplars, context.anchors);
    context.draft = grammarOf(context.tree, context.exemplars.library);
    context.summary = ruleCount(context.draft, context.exemplars.library) + ", cost C_i = " +
                      formatNumber(costOf(context.draft, context.exemplars.library,
                                          context.options.ruleWeight.value_or(kDefaultWeight)));
    context.grammarText = printDraft(context.draft, context.exemplars.library);
    return {};
}

Expected<void> compressRepeatedSubtrees(InferenceContext& context)
{
    const double weight = context.options.ruleWeight.value_or(kDefaultWeight);
    TemplateLibrary& library = context.exemplars.library;
    double cost = costOf(context.draft, library, weight);
    for (;;)
    {
        if (context.options.progress.wantsStop())
            return failure(ErrorKind::Cancelled, {}, "the inference was cancelled");
        const std::vector<std::uint32_t> ids = subtreeIds(context.tree, library);
        const std::size_t repeated = firstRepeated(context.tree, library, ids);
        if (repeated == ids.size())
            break;
        TemplateLibrary extended = library;
        DraftTree tree = foldSubtree(context.tree, ids, ids[repeated], extended);
        DraftGrammar draft = grammarOf(tree, extended);
        mergeLastOfEqual(draft);
        const double lower = costOf(draft, extended, weight);
        if (lower >= cost)
            break;
        cost = lower;
        context.tree = std::move(tree);
        context.draft = std::move(draft);
        library = std::move(extended);
    }
    context.summary = ruleCount(context.draft, library) + ", cost C_i = " + formatNumber(cost);
    context.grammarText = printDraft(context.draft, library);
    return {};
}

Expected<void> generalizeByMerging(InferenceContext& context)
{
    const double weight = context.options.mergeWeight.value_or(kDefaultWeight);
    const TemplateLibrary& library = context.exemplars.library;
    std::size_t merges = 0;
    for (;;)
    {
        std::vector<std::uint32_t> symbols;
        for (const DraftRule& rule : context.draft.rules)
            if (rule.symbol != 0 && (symbols.empty() || symbols.back() != rule.symbol))
                symbols.push_back(rule.symbol);
        // Ties go to the pair that comes first in symbol order.
        Merge best;
        MergeCosts costOfMerging(context.draft, library, weight);
        for (std::size_t i = 0; i < symbols.size(); ++i)
        {
            if (context.options.progress.wantsStop())
                return failure(ErrorKind::Cancelled, {}, "the inference was cancelled");
            for (std::size_t j = i + 1; j < symbols.size(); ++j)
                if (const double cost = costOfMerging(symbols[i], symbols[j], best.cost); cost < best.cost)
                    best = {symbols[i], symbols[j], cost};
        }
        if (best.from == 0) // no merge has a cost below 0
            break;
        context.draft = merged(context.draft, best.into, best.from);
        ++merges;
    }
    context.summary =
        ruleCount(context.draft, library) + ", after " + std::to_string(merges) + (merges == 1 ? " merge" : " merges");
    context.grammarText = printDraft(context.draft, library);
    return {};
}

Expected<void> estimatePerTemplate(InferenceContext& context)
{
    const TemplateLibrary& library = context.exemplars.library;
    const DraftGrammar& draft = context.draft;
    Species& species = context.species;
    species.tables.clear();
    std::vector<std::uint32_t> tableOf(library.templates.size(), kNoPiece);
    for (const DraftTree::Node& node : context.tree.nodes)
    {
        if (node.piece == kNoPiece)
            continue;
        if (tableOf[node.piece] == kNoPiece)
        {
            tableOf[node.piece] = static_cast<std::uint32_t>(species.tables.size());
            species.tables.push_back({library.templates[node.piece].name, {}});
        }
        const InstanceTransform& t = node.transform;
        species.tables[tableOf[node.piece]].rows.push_back({t.scaling, t.rotation, t.branchingAngle, t.roll});
    }

    Grammar& grammar = species.grammar;
    grammar = grammarFor(library);
    for (const DraftRule& rule : draft.rules)
        if (const std::string& name = draft.names[rule.symbol];
            name.size() > 1 && (grammar.longSymbols.empty() || grammar.longSymbols.back() != name))
            grammar.longSymbols.push_back(name);
    std::map<std::uint32_t, std::uint32_t> rulesOf;
    for (const DraftRule& rule : draft.rules)
        ++rulesOf[rule.symbol];
    const auto symbol = [&](std::uint32_t number) { return grammar.symbols.intern(draft.names[number]); };
    grammar.append(grammar.axiom, symbol(0));
    for (const DraftRule& rule : draft.rules)
    {
        std::vector<Module> children;
        for (const std::uint32_t child : rule.children)
            children.push_back({symbol(child), 0, 0});
        Production production;
        if (rule.piece == kNoPiece)
        {
            production.predecessor = symbol(rule.symbol);
            production.successor = children;
        }
        else
            production =
                placingProduction(grammar, symbol(rule.symbol), library.templates[rule.piece],
                                  directionFrom(species.tables[tableOf[rule.piece]], grammar.expressions), children);
        if (rulesOf[rule.symbol] > 1)
            production.weight = grammar.expressions.number(rule.uses);
        grammar.productions.push_back(std::move(production));
    }
    species.provenance.mergeWeight = context.options.mergeWeight.value_or(kDefaultWeight);
    species.provenance.ruleWeight = context.options.ruleWeight.value_or(kDefaultWeight);
    context.summary = std::to_string(grammar.productions.size()) + " productions over " +
                      std::to_string(species.tables.size()) + " tables of observed transforms";
    context.grammarText = printGrammar(grammar);
    return {};
}

} // namespace espalier
