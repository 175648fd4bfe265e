#include <Espalier/Inference/Exemplars.h>

#include <Espalier/Archetype/Mirror.h>
#include <Espalier/Core/Hash.h>
#include <array>
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

std::string identityOf(std::span<const Archetype> archetypes)
{
    Hash64 hash;
    for (const Archetype& archetype : archetypes)
    {
        hash.bytes(printTemplates(archetype.library));
        hash.bytes(printArchetype(archetype));
    }
    return hexDigits(hash.result());
}

Limits exemplarLimits()
{
    Limits limits;
    limits.nodes = 16u << 20;
    return limits;
}

Archetype exemplarsOf(std::span<const Archetype> archetypes, std::span<const Azimuths> spatial, bool mirror)
{
    Archetype drawn = giveDepth(mergeArchetypes(archetypes), spatial);
    if (!mirror)
        return drawn;
    Archetype image = mirrorImage(drawn);
    return mergeArchetypes(std::array{std::move(drawn), std::move(image)});
}

Expected<Archetype> exemplarsOf(std::span<const Archetype> archetypes, const Provenance& provenance)
{
    std::vector<Azimuths> azimuths;
    if (!provenance.spatial.empty())
    {
        auto read = parseAzimuths(provenance.spatial);
        if (!read)
            return tl::make_unexpected(read.error());
        azimuths = std::move(*read);
    }
    return exemplarsOf(archetypes, azimuths, provenance.mirror);
}

} // namespace espalier
