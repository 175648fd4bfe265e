#include <Espalier/Inference/Draft.h>

#include <Espalier/Core/Json.h>
#include <algorithm>

namespace espalier {

std::vector<std::string> nonterminalNames(std::size_t count, std::string_view taken)
{
    std::string all;
    std::string letters;
    for (const std::string_view alphabet : {"ABCDEFGHIJKLMNOPQRSTUVWXYZ", "abcdefghijklmnopqrstuvwxyz"})
        for (const char letter : alphabet)
        {
            all += letter;
            if (letter != 'S' && taken.find(letter) == std::string_view::npos)
                letters += letter;
        }
    std::vector<std::string> names{taken.find('S') == std::string_view::npos ? "S" : "S0"};
    const std::string& stems = letters.empty() ? all : letters; // a name with a number is nobody else's
    for (std::size_t i = 0; names.size() < count; ++i)
    {
        const std::size_t round = i / stems.size() + (letters.empty() ? 1 : 0);
        names.push_back(stems[i % stems.size()] + (round == 0 ? "" : std::to_string(round)));
    }
    return names;
}

std::string symbolsUsed(const TemplateLibrary& library)
{
    std::string used;
    for (const Template& piece : library.templates)
        for (const TemplateModule& module : piece.modules)
            if (module.anchor == kNoAnchor && used.find(module.symbol) == std::string::npos)
                used += module.symbol;
    return used;
}

std::string printRule(const DraftGrammar& draft, const DraftRule& rule, const TemplateLibrary& library)
{
    std::string text = draft.names[rule.symbol] + " -> ";
    if (rule.piece == kNoPiece)
        return text + (rule.children.empty() ? "_" : draft.names[rule.children[0]]);
    for (const TemplateModule& module : library.templates[rule.piece].modules)
    {
        if (module.anchor == kNoAnchor)
        {
            text += module.symbol;
            if (module.hasNumber)
                text += '(' + formatNumber(module.number) + ')';
            continue;
        }
        // A long name after a letter would read as other symbols.
        const std::string& name = draft.names[rule.children[module.anchor]];
        text += (name.size() > 1 && text.back() != '[' ? " " : "") + name;
    }
    return text;
}

std::string printDraft(const DraftGrammar& draft, const TemplateLibrary& library)
{
    std::string text;
    for (const DraftRule& rule : draft.rules)
        text += printRule(draft, rule, library) + '\n';
    return text;
}

} // namespace espalier
