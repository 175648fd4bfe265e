#pragma once

#include "Command.h"

#include <Espalier/Mesh/TubeMesher.h>
#include <Espalier/Plant/Skeleton.h>
#include <Espalier/Species/Appearance.h>
#include <functional>

namespace espalier::tool {

/// One plant of an input: a tree of an archetype, or the individual of a seed.
struct Plant
{
    std::string label; ///< "archetype", "seed 7"
    std::optional<std::uint64_t> seed;
    Skeleton skeleton; ///< With axes and radii.
};

/// What a verb reads: an archetype or a species with seeds.
struct PlantInput
{
    std::string path;
    std::string seeds = "1";
    TemplateFolders templates;

    void addTo(CLI::App& verb);

    /// Calls `use` for each plant in turn; the plant's memory is reused.
    void eachPlant(const std::function<void(const Plant&)>& use) const;

    /// True if there is more than one plant to report on, or a range was asked for.
    [[nodiscard]] bool isArray() const;

    /// The species' appearance, or one that suits the archetype.
    [[nodiscard]] Appearance appearance() const;
};

/// Replaces `mesh` by the tubes of `skeleton`, or fails with the reason. `label` and `path` tell whose they are.
void meshOrFail(const Skeleton& skeleton, const BarkAppearance& bark, const std::string& label, const std::string& path,
                TubeScratch& scratch, TreeMesh& mesh);

} // namespace espalier::tool
