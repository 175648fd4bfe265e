#include <Espalier/Inference/KinGrammar.h>

#include <Espalier/Species/Grow.h>

namespace espalier {

std::uint64_t drawnTopology(const Species& species, const std::vector<KinRule>& rules, std::uint32_t tree)
{
    const Grammar& grammar = species.grammar;
    std::vector<std::vector<std::uint32_t>> rulesOf(
        grammar.symbols.size()); // of each symbol, by the number of the limb
    for (std::uint32_t i = 0; i < rules.size(); ++i)
    {
        std::vector<std::uint32_t>& ofSymbol = rulesOf[grammar.productions[i].predecessor];
        ofSymbol.insert(ofSymbol.end(), rules[i].limbs, i);
    }
    std::vector<std::uint64_t> hashes;
    for (SymbolId symbol = 0; symbol < grammar.symbols.size(); ++symbol)
        hashes.push_back(TopologyHash::ofName(grammar.symbols.name(symbol)));

    // In the drawn tree `C(i, ...)` becomes what the rule of limb i of C says; where C has one limb there is no i.
    struct Step
    {
        const std::vector<Module>* word;
        std::size_t next;
    };
    const bool several = species.provenance.exemplars > 1;
    std::vector<Step> steps{
        {several ? &grammar.productions[rulesOf[grammar.axiom[0].symbol][tree]].successor : &grammar.axiom, 0}};
    TopologyHash topology;
    while (!steps.empty())
    {
        Step& step = steps.back();
        if (step.next == step.word->size())
        {
            steps.pop_back();
            continue;
        }
        const Module& module = (*step.word)[step.next++];
        const std::vector<std::uint32_t>& ofSymbol = rulesOf[module.symbol];
        if (ofSymbol.empty())
        {
            topology.add(hashes[module.symbol]);
            continue;
        }
        std::uint32_t number = 0;
        if (ofSymbol.size() > 1)
            number = static_cast<std::uint32_t>(grammar.expressions[grammar.arguments[module.firstArgument]].value);
        steps.push_back({&grammar.productions[ofSymbol[number]].successor, 0});
    }
    return topology.value();
}

} // namespace espalier
