#pragma once

#include "Command.h"

#include <Espalier/Mesh/TreeMesher.h>
#include <Espalier/Plant/Skeleton.h>
#include <Espalier/Species/Appearance.h>
#include <Espalier/Species/Grow.h>
#include <functional>

namespace espalier::tool {

/// One plant of an input: a tree of an archetype, or the individual of a seed.
struct Plant
{
    std::string label; ///< "archetype", "seed 7"
    std::optional<std::uint64_t> seed;
    std::optional<std::uint32_t> attempt; ///< That was taken, of a species with a window of accepted sizes.
    std::optional<std::uint32_t> steps;   ///< Of its derivation, if it has a number of them.
    Skeleton skeleton;                    ///< With axes and radii.
};

/// Grows the plants of a species or of a grammar by itself, which is derived by `iterations` steps, else `iterations:`,
/// else none.
class SeededGrower
{
public:
    /// Fails with the reason if the file does not name what can grow. `exemplar`: that drawn tree, whatever the seed;
    /// `attempt`: that one of every seed, whether it fits or not.
    SeededGrower(std::string path, std::optional<std::uint32_t> iterations, std::optional<std::uint32_t> exemplar = {},
                 std::optional<std::uint32_t> attempt = {});

    /// A grammar alone is a species named like its file.
    [[nodiscard]] const Species& species() const { return species_; }
    /// With axes and radii: where neither the grammar nor a species says otherwise, such as suit the plant.
    void grow(Seed seed, Skeleton& skeleton);
    /// That the last tree is, if it was one of several.
    [[nodiscard]] std::optional<std::uint32_t> attempt() const { return attempt_; }
    /// Of the derivation; none: until nothing can be rewritten.
    [[nodiscard]] std::optional<std::uint32_t> steps() const { return grower_->iterations(); }

private:
    std::string path_;
    Species species_;
    std::optional<Grower> grower_;
    bool isExemplar_ = false;
    GrowOptions options_; ///< With the attempt that is pinned, if one is.
    std::optional<std::uint32_t> attempt_;
    GrowScratch scratch_;
};

/// What a verb reads: an archetype, or a species or grammar with seeds.
struct PlantInput
{
    std::string path;
    std::string seeds = "1";
    TemplateFolders templates;
    std::optional<std::uint32_t> iterations = {}; ///< Of a grammar.
    std::optional<std::uint32_t> attempt = {};    ///< Of a species: the one to take.

    void addTo(CLI::App& verb);

    /// Calls `use` for each plant in turn, which it may change; the plant's memory is reused.
    void eachPlant(const std::function<void(Plant&)>& use) const;

    /// True if there is more than one plant to report on, or a range was asked for.
    [[nodiscard]] bool isArray() const;

    /// The species' appearance, or one that suits the archetype.
    [[nodiscard]] Appearance appearance() const;
};

/// Whether there is something to see; fails if a mesh could not be made for any other reason. `label` and `path` tell
/// whose it is.
[[nodiscard]] bool isMeshedOrFail(MeshResult result, const std::string& label, const std::string& path);

/// Says so, and what may help where a plant is derived by so many steps.
[[nodiscard]] std::string nothingDrawn(std::optional<std::uint32_t> steps);

} // namespace espalier::tool
