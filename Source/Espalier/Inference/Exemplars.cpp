#include <Espalier/Inference/Exemplars.h>

#include <map>
#include <set>
#include <string>

namespace espalier {

Archetype mergeArchetypes(std::span<const Archetype> archetypes)
{
    constexpr std::uint32_t kUnused = 0xffffffffu;
    Archetype all;
    std::map<std::string, std::uint32_t> byWord;
    std::set<std::string> names;
    const auto merge = [&](Template piece) {
        const auto [entry, isNew] =
            byWord.try_emplace(printWord(piece), static_cast<std::uint32_t>(all.library.templates.size()));
        if (isNew)
        {
            const std::string wanted = piece.name;
            for (std::uint32_t number = 2; !names.insert(piece.name).second; ++number)
                piece.name = wanted + "_" + std::to_string(number);
            all.library.templates.push_back(std::move(piece));
        }
        return entry->second;
    };
    for (const Archetype& archetype : archetypes)
    {
        std::vector<std::uint32_t> newIndex(archetype.library.templates.size(), kUnused);
        const auto offset = static_cast<std::uint32_t>(all.instances.size());
        for (TemplateInstance instance : archetype.instances)
        {
            std::uint32_t& piece = newIndex[instance.piece];
            if (piece == kUnused)
                piece = merge(archetype.library.templates[instance.piece]);
            instance.piece = piece;
            if (instance.parent != kNoInstance)
                instance.parent += offset;
            all.instances.push_back(instance);
        }
    }
    return all;
}

} // namespace espalier
