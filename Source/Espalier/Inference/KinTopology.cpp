#include <Espalier/Inference/KinGrammar.h>

#include <Espalier/Species/Grow.h>

namespace espalier {

std::uint64_t drawnTopology(const Species& species, std::uint32_t tree)
{
    const Grammar& grammar = species.grammar;
    constexpr std::uint32_t kNone = 0xffffffffu;
    std::vector<std::uint32_t> firstRule(grammar.symbols.size(), kNone); // of each symbol
    for (std::uint32_t i = static_cast<std::uint32_t>(grammar.productions.size()); i-- > 0;)
        firstRule[grammar.productions[i].predecessor] = i;
    std::vector<std::uint64_t> hashes;
    for (SymbolId symbol = 0; symbol < grammar.symbols.size(); ++symbol)
        hashes.push_back(TopologyHash::ofName(grammar.symbols.name(symbol)));

    // In the drawn tree `C(i)` becomes what rule i of C says.
    struct Step
    {
        const std::vector<Module>* word;
        std::size_t next;
    };
    const bool several = species.provenance.exemplars > 1;
    std::vector<Step> steps{
        {several ? &grammar.productions[firstRule[grammar.axiom[0].symbol] + tree].successor : &grammar.axiom, 0}};
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
        std::uint32_t rule = firstRule[module.symbol];
        if (rule == kNone)
        {
            topology.add(hashes[module.symbol]);
            continue;
        }
        if (module.argumentCount > 0)
            rule += static_cast<std::uint32_t>(grammar.expressions[grammar.arguments[module.firstArgument]].value);
        steps.push_back({&grammar.productions[rule].successor, 0});
    }
    return topology.value();
}

} // namespace espalier
