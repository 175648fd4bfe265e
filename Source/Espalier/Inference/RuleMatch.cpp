#include <Espalier/Inference/RuleMatch.h>

#include <Espalier/Core/Json.h>
#include <deque>
#include <unordered_map>

namespace espalier {

namespace {

void write(std::string& out, const Grammar& grammar, ExpressionId id)
{
    using enum ExpressionOp;
    const ExpressionNode& node = grammar.expressions[id];
    switch (node.op)
    {
    case Number:
        out += formatNumber(node.value);
        return;
    case Parameter:
        out += 'p' + std::to_string(node.first);
        return;
    case Constant:
        out += '$' + grammar.constants[node.first].name;
        return;
    case Transform:
        out += "srbo"[node.first];
        return;
    default:
        out += '(' + std::to_string(static_cast<int>(node.op));
        for (const ExpressionId child : {node.first, node.second, node.third})
            if (child != kNoExpression)
            {
                out += ' ';
                write(out, grammar, child);
            }
        out += ')';
    }
}

std::string contextKey(const Grammar& grammar, const std::vector<ContextModule>& context)
{
    std::string key;
    for (const ContextModule& module : context)
        key += grammar.symbols.name(module.symbol) + '/' + std::to_string(module.parameters.size()) + ' ';
    return key;
}

std::optional<double> indexIn(const ExpressionPool& pool, ExpressionId id)
{
    if (id == kNoExpression)
        return {};
    const ExpressionNode& node = pool[id];
    using enum ExpressionOp;
    if (node.op == Number || node.op == Parameter || node.op == Constant || node.op == Transform)
        return {};
    if ((node.op == Equal || node.op == GreaterEqual) && pool[node.first].op == Parameter &&
        pool[node.first].first == 0 && pool[node.second].op == Number)
        return pool[node.second].value;
    for (const ExpressionId child : {node.first, node.second, node.third})
        if (const auto found = indexIn(pool, child))
            return found;
    return {};
}

} // namespace

std::string keyOf(const Grammar& grammar, ExpressionId expression)
{
    std::string key;
    if (expression != kNoExpression)
        write(key, grammar, expression);
    return key;
}

std::string keyOf(const Grammar& grammar, const std::vector<Module>& word)
{
    std::string key;
    for (const Module& module : word)
    {
        key += grammar.symbols.name(module.symbol);
        for (std::uint32_t i = 0; i < module.argumentCount; ++i)
        {
            key += '\\';
            write(key, grammar, grammar.arguments[module.firstArgument + i]);
        }
        key += ' ';
    }
    return key;
}

RuleKey keyOf(const Grammar& grammar, const Production& production)
{
    RuleKey key;
    key.head = contextKey(grammar, production.left) + "< " + grammar.symbols.name(production.predecessor) + '/' +
               std::to_string(production.parameters.size()) + " > " + contextKey(grammar, production.right);
    key.condition = keyOf(grammar, production.condition);
    key.weight = keyOf(grammar, production.weight);
    key.successor = keyOf(grammar, production.successor);
    key.draw = production.table + ' ' + keyOf(grammar, production.row);
    key.index = indexIn(grammar.expressions, production.weight);
    return key;
}

std::vector<std::string_view> linesOf(std::string_view text)
{
    std::vector<std::string_view> lines;
    while (!text.empty())
    {
        const std::size_t end = text.find('\n');
        lines.push_back(text.substr(0, end));
        text.remove_prefix(end + 1);
    }
    return lines;
}

RuleMatch matchRules(const Grammar& inferred, const Grammar& edited)
{
    std::vector<RuleKey> base;
    for (const Production& production : inferred.productions)
        base.push_back(keyOf(inferred, production));
    std::vector<RuleKey> ours;
    for (const Production& production : edited.productions)
        ours.push_back(keyOf(edited, production));

    RuleMatch match{std::vector<std::uint32_t>(ours.size(), kNoRule), std::vector<std::uint32_t>(base.size(), kNoRule)};
    // `keyIn` gives the text by which rules are the same in this round; empty: the rule does not take part.
    const auto round = [&](auto&& keyIn) {
        std::unordered_map<std::string, std::deque<std::uint32_t>> open; // looked up, never iterated
        for (std::uint32_t r = 0; r < base.size(); ++r)
            if (match.editedOf[r] == kNoRule)
                open[keyIn(base[r])].push_back(r);
        for (std::uint32_t e = 0; e < ours.size(); ++e)
        {
            if (match.inferredOf[e] != kNoRule)
                continue;
            const std::string key = keyIn(ours[e]);
            const auto found = key.empty() ? open.end() : open.find(key);
            if (found == open.end() || found->second.empty())
                continue;
            match.inferredOf[e] = found->second.front();
            match.editedOf[found->second.front()] = e;
            found->second.pop_front();
        }
    };
    const auto indexText = [](const RuleKey& key) {
        return key.index ? formatNumber(*key.index) : std::string("none");
    };
    round([](const RuleKey& key) { return key.whole(); });
    round([&](const RuleKey& key) { return key.body() + '|' + indexText(key); });
    round([](const RuleKey& key) { return key.body(); });
    round([](const RuleKey& key) { return key.weight.empty() ? "" : key.head + '|' + key.weight; });
    round([&](const RuleKey& key) { return key.index ? key.head + '|' + indexText(key) : ""; });
    round([](const RuleKey& key) { return key.draw == " " ? "" : key.head + '|' + key.draw; });
    // A rule that was rewritten altogether is still that rule if it is the only one left of its symbol.
    std::unordered_map<std::string, std::int64_t> left;
    for (std::uint32_t r = 0; r < base.size(); ++r)
        left[base[r].head] += match.editedOf[r] == kNoRule ? 1 : 0;
    std::unordered_map<std::string, std::int64_t> leftOfOurs;
    for (std::uint32_t e = 0; e < ours.size(); ++e)
        leftOfOurs[ours[e].head] += match.inferredOf[e] == kNoRule ? 1 : 0;
    round([&](const RuleKey& key) { return left[key.head] == 1 && leftOfOurs[key.head] == 1 ? key.head : ""; });
    return match;
}

} // namespace espalier
