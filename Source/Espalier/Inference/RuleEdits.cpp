#include <Espalier/Inference/RuleEdits.h>

#include <Espalier/Core/Json.h>
#include <Espalier/Inference/RuleMatch.h>
#include <Espalier/Turtle/Turtle.h>
#include <algorithm>
#include <charconv>
#include <map>
#include <set>
#include <span>
#include <utility>

namespace espalier {

namespace {

const Grammar& inferredOf(const Species& species)
{
    return species.inferred ? *species.inferred : species.grammar;
}

/// Of each rule of the species' grammar; that of one that nobody edited matches itself.
RuleMatch matchOf(const Species& species)
{
    if (species.inferred)
        return matchRules(*species.inferred, species.grammar);
    RuleMatch match;
    for (std::uint32_t r = 0; r < species.grammar.productions.size(); ++r)
        match.inferredOf.push_back(r);
    match.editedOf = match.inferredOf;
    return match;
}

/// The lines of a printed grammar that are neither productions nor `interpret:` ones.
std::span<const std::string_view> settingLines(const Grammar& grammar, const std::vector<std::string_view>& lines)
{
    return std::span(lines).first(lines.size() - grammar.productions.size() - grammar.interpretations.size());
}

std::uint32_t countSettings(const Grammar& inferred, const Grammar& edited)
{
    const std::string inferredText = printGrammar(inferred);
    const std::string editedText = printGrammar(edited);
    const std::vector<std::string_view> inferredLines = linesOf(inferredText);
    const std::vector<std::string_view> editedLines = linesOf(editedText);
    // One that was changed has a line on either side, and counts once.
    std::map<std::string_view, std::int64_t> balance;
    std::uint32_t onlyInferred = 0;
    std::uint32_t onlyEdited = 0;
    for (const std::string_view line : settingLines(inferred, inferredLines))
        ++balance[line];
    for (const std::string_view line : settingLines(edited, editedLines))
        onlyEdited += balance[line]-- > 0 ? 0 : 1;
    for (const auto& [line, count] : balance)
        onlyInferred += count > 0 ? static_cast<std::uint32_t>(count) : 0;
    return std::max(onlyInferred, onlyEdited);
}

std::string drawnText(const RuleOrigin& origin)
{
    std::string text = origin.limbs > 1 ? std::to_string(origin.limbs) + " limbs, " : "";
    if (origin.count == 0)
        return text + "mirrored";
    text += std::to_string(origin.count) + " drawn:";
    for (const DrawnNode& node : origin.nodes)
        text += ' ' + std::to_string(node.tree) + ':' + std::to_string(node.node);
    return text + (origin.count > origin.nodes.size() ? " ..." : "");
}

/// What comes from files may hold anything, and is shown on terminals.
void blankControls(std::string& text)
{
    std::ranges::replace_if(
        text, [](char c) { return static_cast<unsigned char>(c) < ' '; }, ' ');
}

/// What stands above the grammar for people.
std::vector<std::string> headOf(const Species& species)
{
    const Provenance& p = species.provenance;
    std::vector<std::string> head;
    if (p.method.empty())
        return head;
    head.push_back(species.name + ", inferred by " + p.method + " from trees of " +
                   std::to_string(p.exemplarInstances) + " template instances and " +
                   std::to_string(p.exemplarSegments) + " segments");
    // Explained by what stands below: the first class that has several limbs.
    const Grammar& grammar = species.grammar;
    const auto rule = std::ranges::find_if(grammar.productions, [](const Production& production) {
        return !production.parameters.empty() && production.parameters[0] == "i" && !production.table.empty();
    });
    if (p.method.starts_with("kin ") && rule != grammar.productions.end())
    {
        const std::string& symbol = grammar.symbols.name(rule->predecessor);
        const auto occupant = std::ranges::find_if(
            grammar.longSymbols, [&](const std::string& name) { return name.starts_with(symbol + "_"); });
        std::string module = symbol + "(1";
        for (std::size_t i = 1; i < rule->parameters.size(); ++i)
            module += ", " + rule->parameters[i];
        head.push_back(module + ") is limb 1 of the class " + symbol + ": limbs of the template " + rule->table +
                       " that may stand for each other" +
                       (rule->parameters.size() > 1 ? ", in the direction of the place where it hangs" : "") +
                       (occupant == grammar.longSymbols.end()
                            ? std::string()
                            : "; " + *occupant + "(1) is what hangs at its anchor " + occupant->back()));
        head.push_back("The rules of " + symbol +
                       " say what its limbs look like. A weight (i==k)*(1-w)+w*c/n: where limb i was drawn, it grows "
                       "with");
        head.push_back("chance 1-w, and any of the n drawn ones with chance w. `~ " + rule->table +
                       "(0)` takes s (scaling) and b (branching angle) from row 0 of");
        head.push_back("the species' table " + rule->table +
                       "; r and o are small deviations of the direction, in degrees.");
        if (std::ranges::any_of(species.rules, [](const RuleOrigin& origin) { return origin.limbs > 1; }))
            head.emplace_back("Limbs that carry the same share a rule: it takes the row of limb i, or with chance w "
                              "that of any of them.");
    }
    if (!species.rules.empty())
        head.emplace_back(
            "Drawn: how often, then tree:node, both from 0, the nodes as the archetype's file lists them.");
    head.emplace_back(
        "Put an edited text back with `espalier grammar S.species --set THIS.lsys`; what was changed survives "
        "inferring again.");
    for (std::string& line : head)
        blankControls(line);
    return head;
}

std::string conflictText(const EditConflict& conflict)
{
    std::string text = "conflict: ";
    text += conflict.inferred.empty() ? "added `" + conflict.edited + "`"
            : conflict.edited.empty() ? "removed `" + conflict.inferred + "`"
                                      : "`" + conflict.inferred + "` was edited to `" + conflict.edited + "`";
    text += ", but " + conflict.reason;
    blankControls(text);
    return text;
}

/// The text of printWithOrigins, and which production stands in which of its lines.
struct CommentedText
{
    std::string text;
    std::vector<std::uint32_t> productionOf; ///< Of each line; kNoRule: it holds none.
};

CommentedText commented(const Species& species)
{
    CommentedText result;
    const auto append = [&](std::string_view line, std::string_view comment, std::uint32_t production) {
        result.text += line;
        if (!comment.empty())
            result.text.append(line.empty() ? "# " : "  # ").append(comment);
        result.text += '\n';
        result.productionOf.push_back(production);
    };
    for (const std::string& line : headOf(species))
        append("", line, kNoRule);

    const Grammar& grammar = species.grammar;
    const RuleMatch match = matchOf(species);
    const Grammar& inferred = inferredOf(species);
    const std::string text = printGrammar(grammar);
    const std::vector<std::string_view> lines = linesOf(text);
    const std::size_t first = settingLines(grammar, lines).size();
    for (std::size_t i = 0; i < lines.size(); ++i)
    {
        if (i < first || i >= first + grammar.productions.size())
        {
            append(lines[i], "", kNoRule);
            continue;
        }
        const auto e = static_cast<std::uint32_t>(i - first);
        const std::uint32_t r = match.inferredOf[e];
        std::string comment;
        if (r == kNoRule)
            comment = "added";
        else
        {
            if (r < species.rules.size())
                comment = drawnText(species.rules[r]);
            if (species.inferred && keyOf(inferred, inferred.productions[r]) != keyOf(grammar, grammar.productions[e]))
                comment += comment.empty() ? "edited" : "; edited";
            if (r < species.rules.size() && species.rules[r].locked)
                comment += "; locked";
        }
        append(lines[i], comment, e);
    }
    for (std::uint32_t r = 0; r < inferred.productions.size(); ++r)
        if (match.editedOf[r] == kNoRule)
            append("", "removed: " + printProduction(inferred, inferred.productions[r]), kNoRule);
    for (const EditConflict& conflict : species.conflicts)
        append("", conflictText(conflict), kNoRule);
    return result;
}

/// The productions of the species' grammar that `which` names.
std::vector<std::uint32_t> rulesNamed(const Species& species, std::string_view which)
{
    const auto number = [](std::string_view digits) -> std::optional<std::uint32_t> {
        std::uint32_t value = 0;
        const auto read = std::from_chars(digits.data(), digits.data() + digits.size(), value);
        const bool isNumber = read.ec == std::errc{} && read.ptr == digits.data() + digits.size();
        return isNumber ? std::optional(value) : std::nullopt;
    };
    std::vector<std::uint32_t> named;
    if (const auto line = number(which))
    {
        const CommentedText text = commented(species);
        if (*line >= 1 && *line <= text.productionOf.size() && text.productionOf[*line - 1] != kNoRule)
            named.push_back(text.productionOf[*line - 1]);
        return named;
    }
    std::optional<std::uint32_t> index;
    std::string_view symbol = which;
    if (const std::size_t open = which.find('('); open != std::string_view::npos && which.back() == ')')
    {
        index = number(which.substr(open + 1, which.size() - open - 2));
        if (!index)
            return named;
        symbol = which.substr(0, open);
    }
    // The rules of a class stand in the order of its limbs, as inferred; an edited weight need not tell.
    const RuleMatch match = matchOf(species);
    const Grammar& inferred = inferredOf(species);
    std::uint64_t first = 0;
    for (std::uint32_t r = 0; r < inferred.productions.size(); ++r)
        if (inferred.symbols.name(inferred.productions[r].predecessor) == symbol)
        {
            const std::uint64_t next = first + (r < species.rules.size() ? species.rules[r].limbs : 1);
            if (match.editedOf[r] != kNoRule && (!index || (*index >= first && *index < next)))
                named.push_back(match.editedOf[r]);
            first = next;
        }
    return named;
}

} // namespace

EditSummary summarizeEdits(const Species& species)
{
    EditSummary summary;
    for (const RuleOrigin& rule : species.rules)
        summary.locked += rule.locked ? 1 : 0;
    if (!species.inferred)
    {
        summary.kept = static_cast<std::uint32_t>(species.grammar.productions.size());
        return summary;
    }
    const Grammar& inferred = *species.inferred;
    const Grammar& edited = species.grammar;
    const RuleMatch match = matchRules(inferred, edited);
    for (std::uint32_t e = 0; e < edited.productions.size(); ++e)
    {
        const std::uint32_t r = match.inferredOf[e];
        if (r == kNoRule)
        {
            ++summary.added;
            continue;
        }
        const RuleKey base = keyOf(inferred, inferred.productions[r]);
        const RuleKey ours = keyOf(edited, edited.productions[e]);
        ++(base == ours ? summary.kept : base.body() == ours.body() ? summary.weights : summary.changed);
    }
    summary.removed = static_cast<std::uint32_t>(std::ranges::count(match.editedOf, kNoRule));
    summary.added += static_cast<std::uint32_t>(edited.interpretations.size()); // inference writes none
    summary.settings = countSettings(inferred, edited);
    return summary;
}

bool hasEdits(const Species& species)
{
    return species.inferred || !species.conflicts.empty() || std::ranges::any_of(species.rules, &RuleOrigin::locked);
}

bool knowsInferred(const Species& species)
{
    return species.provenance.grammar.empty() || species.provenance.grammar == identityOf(inferredOf(species));
}

bool hasEditedPipes(const Species& species)
{
    const std::string& inferred = species.provenance.pipes;
    return !inferred.empty() && inferred != identityOf(species.appearance.pipes);
}

bool hasEditedTables(const Species& species)
{
    const std::string& inferred = species.provenance.tables;
    return !inferred.empty() && inferred != tablesIdentityOf(species);
}

void setGrammar(Species& species, Grammar edited)
{
    if (species.provenance.method.empty())
    {
        species.grammar = std::move(edited);
        return;
    }
    Grammar inferred = inferredOf(species);
    species.grammar = std::move(edited);
    if (species.grammar == inferred)
    {
        species.inferred.reset();
        return;
    }
    species.inferred = std::move(inferred);
    const RuleMatch match = matchOf(species);
    for (std::size_t r = 0; r < species.rules.size(); ++r)
        species.rules[r].locked = species.rules[r].locked && match.editedOf[r] != kNoRule;
}

namespace {

/// What the rules of a grammar rewrite.
struct Rewritten
{
    std::set<std::uint32_t> parameters; ///< Numbers of them.
    double limbs = 0;                   ///< Numbered 0, 1, ..., where rules ask for a number.
    bool isNumbered = false;
};

std::map<std::string, Rewritten> rewrittenBy(const Grammar& grammar, const std::vector<RuleOrigin>& origins)
{
    std::map<std::string, Rewritten> result;
    for (std::size_t r = 0; r < grammar.productions.size(); ++r)
    {
        const Production& production = grammar.productions[r];
        Rewritten& rewritten = result[std::string(grammar.symbols.name(production.predecessor))];
        rewritten.parameters.insert(static_cast<std::uint32_t>(production.parameters.size()));
        const std::optional<double> index = keyOf(grammar, production).index;
        rewritten.isNumbered |= index.has_value();
        const double limbs = r < origins.size() ? origins[r].limbs : 1;
        rewritten.limbs = std::max(rewritten.limbs, index.value_or(0) + limbs);
    }
    return result;
}

/// Calls function(word) for the axiom and the successors.
template <class Function>
void forEachWord(const Grammar& grammar, Function&& function)
{
    function(grammar.axiom);
    for (const Production& production : grammar.productions)
        function(production.successor);
}

} // namespace

std::vector<std::string> doubtsOf(const Species& species)
{
    std::vector<std::string> doubts;
    if (!species.inferred)
        return doubts;
    const Grammar& grammar = species.grammar;
    const Grammar& inferred = *species.inferred;
    const std::map<std::string, Rewritten> rules = rewrittenBy(grammar, {});
    const std::map<std::string, Rewritten> limbs = rewrittenBy(inferred, species.rules);
    std::set<std::string> known; // symbols of what was inferred
    forEachWord(inferred, [&](const std::vector<Module>& word) {
        for (const Module& module : word)
            known.insert(std::string(inferred.symbols.name(module.symbol)));
    });
    std::set<std::string> told;
    const auto doubt = [&](std::string text) {
        if (told.insert(text).second)
            doubts.push_back(std::move(text));
    };
    forEachWord(grammar, [&](const std::vector<Module>& word) {
        std::string idle; // a run of symbols that nothing reads: what is left of a name that was written wrongly
        const auto tellIdle = [&] {
            if (!idle.empty())
                doubt("`" + idle + "` draws nothing, and no rule rewrites it");
            idle.clear();
        };
        bool namesOrgan = false;
        for (const Module& module : word)
        {
            const std::string& name = grammar.symbols.name(module.symbol);
            if (std::exchange(namesOrgan, name == "~"))
                continue;
            const auto rule = rules.find(name);
            if (rule == rules.end())
            {
                const bool draws = turtleCommand(name) != TurtleCommand::Nothing ||
                                   std::ranges::find(grammar.draw, module.symbol) != grammar.draw.end() ||
                                   std::ranges::find(grammar.move, module.symbol) != grammar.move.end();
                if (!known.contains(name) && !draws)
                    idle += name;
                else
                    tellIdle();
                continue;
            }
            tellIdle();
            if (!rule->second.parameters.contains(module.argumentCount))
            {
                doubt("`" + name + "` with " + counted(module.argumentCount, "number") +
                      " has no rule; its rules have " + std::to_string(*rule->second.parameters.begin()));
                continue;
            }
            const auto limb = limbs.find(name);
            if (module.argumentCount == 0 || limb == limbs.end() || !limb->second.isNumbered)
                continue;
            const ExpressionNode& first = grammar.expressions[grammar.arguments[module.firstArgument]];
            const double most = std::max(limb->second.limbs, rule->second.limbs);
            if (first.op == ExpressionOp::Number && !(first.value >= 0 && first.value < most))
                doubt("there is no limb " + formatNumber(first.value) + " of " + name + "; it has 0 to " +
                      formatNumber(most - 1));
        }
        tellIdle();
    });
    return doubts;
}

Expected<std::uint32_t> lockRules(Species& species, std::string_view which, bool locked)
{
    if (species.rules.empty() || species.rules.size() != inferredOf(species).productions.size())
        return failure(ErrorKind::BadInput, {}, "the species does not know where its rules come from",
                       "one that `espalier infer` made by the preset kin");
    const std::vector<std::uint32_t> named = rulesNamed(species, which);
    if (named.empty())
        return failure(
            ErrorKind::BadInput, {}, "no inferred rule is called \"" + shortened(which) + "\"",
            "a symbol such as Bough, a limb such as Bough(3), or the number of a line of `espalier grammar`");
    const RuleMatch match = matchOf(species);
    for (const std::uint32_t e : named)
        if (match.inferredOf[e] == kNoRule)
            return failure(ErrorKind::BadInput, {}, "the rule was added by hand", "one that was inferred",
                           "inferring again keeps it anyway");
    for (const std::uint32_t e : named)
        species.rules[match.inferredOf[e]].locked = locked;
    return static_cast<std::uint32_t>(named.size());
}

std::string printWithOrigins(const Species& species)
{
    return commented(species).text;
}

} // namespace espalier
