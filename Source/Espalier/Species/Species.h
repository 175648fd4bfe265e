#pragma once

#include <Espalier/Core/Error.h>
#include <Espalier/Core/Limits.h>
#include <Espalier/Grammar/Grammar.h>
#include <Espalier/Species/Appearance.h>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace espalier {

/// Which derivations of the grammar are trees of this kind: neither too small nor too large, nor a copy of the one that
/// was drawn. The first of `attempts` attempts that fits is taken, else the nearest of those that are at most twice too
/// large; so a seed always gives a tree. Attempts end early when they have used up the budget of four trees together.
struct GrowthWindow
{
    std::uint32_t minSegments = 0;
    std::uint32_t maxSegments = 0xffffffffu;
    std::uint32_t minDepth = 0; ///< In nested template instances.
    std::uint32_t maxDepth = 0xffffffffu;
    std::uint32_t attempts = 32; ///< [1, 1024]
    std::vector<std::uint64_t>
        copies; ///< Topology hashes of the drawn trees (GrowthSample::topology), which are not grown again.

    friend bool operator==(const GrowthWindow&, const GrowthWindow&) = default;
};

/// A tenth of the spread leaves the distribution of a parameter recognisably the drawn one.
inline constexpr double kUsualJitter = 0.1;

/// Where a species came from, for people and tools; growing reads only `exemplars`, to give those back.
struct Provenance
{
    std::string method;     ///< The inference preset and its version, such as "kin 1"; empty for hand-written species.
    std::string archetypes; ///< Hash of what was drawn, 16 hex digits.
    // Identities of what was inferred (identityOf), so that edits in the file are noticed. Empty: unknown.
    std::string grammar;
    std::string tables; ///< The window's too.
    std::string pipes;
    double mergeWeight = 0;
    double ruleWeight = 0;
    double jitter = kUsualJitter;       ///< Share of the observed spread by which parameters are moved. [0, 1]
    std::vector<std::uint32_t> weights; ///< How often each drawn tree counts, and mirror image; empty: all alike.
    std::string spatial;                ///< How azimuths were given to what was drawn (printAzimuths); empty: not.
    bool mirror = false;                ///< Mirror images of what was drawn taught it too.
    std::uint32_t exemplarSegments = 0; ///< Mean over the drawn trees.
    std::uint32_t exemplarInstances = 0;
    /// Drawn trees, behind them their mirror images, that the rules give back exactly: where the grammar's constant `w`
    /// is 0 and the tables are not smoothed (Grower::makeExemplar). 0: none.
    std::uint32_t exemplars = 0;
    std::string note; ///< What the designer should know, such as how many relatives the tree allows.

    friend bool operator==(const Provenance&, const Provenance&) = default;
};

/// A node of the drawn trees: both count from 0, nodes depth first as the archetype's file lists them.
struct DrawnNode
{
    std::uint32_t tree = 0; ///< Of all archetypes together.
    std::uint32_t node = 0;

    friend bool operator==(const DrawnNode&, const DrawnNode&) = default;
};

/// What a rule of an inferred grammar stands for in the drawn trees, for people and tools; growing does not read it.
struct RuleOrigin
{
    static constexpr std::size_t kMostNodes = 16; ///< Listed, however many there are.

    /// Identity: a hash of the limb with everything it carries; of several, of what each of them carries. Survives
    /// renumbering.
    std::uint64_t limb = 0;
    std::uint64_t place = 0; ///< Where it first stands in the drawn trees, hashed. Survives what changes further out.
    std::uint32_t count = 0; ///< How often the drawn trees apply the rule.
    std::uint32_t limbs = 1; ///< Limbs that share it: they differ by the row of the table alone.
    std::vector<DrawnNode> nodes; ///< Where, the first kMostNodes of them.
    bool locked = false;          ///< Inferring again leaves the rule as it is.

    friend bool operator==(const RuleOrigin&, const RuleOrigin&) = default;
};

/// An edit that inferring again could not carry over. Kept until somebody has looked at it.
struct EditConflict
{
    std::string inferred; ///< The rule or setting that was edited, as a line; empty: the edit added one.
    std::string edited;   ///< What it was edited to; empty: the edit removed it.
    std::string reason;

    friend bool operator==(const EditConflict&, const EditConflict&) = default;
};

/// The asset that a game ships: rules, what was observed, and a skin. A plain document; Grower makes it ready to grow.
struct Species
{
    std::string name;
    Grammar grammar;
    std::vector<TransformTable> tables; ///< Unique names.
    std::optional<GrowthWindow> window; ///< None: every derivation is taken.
    Appearance appearance;
    Provenance provenance;

    // What authoring remembers of an inferred grammar (Inference/RuleEdits.h); growing does not read it.
    std::vector<RuleOrigin> rules;       ///< Of each production of the grammar as inferred; empty: unknown.
    std::optional<Grammar> inferred;     ///< The grammar as inferred, where people have edited `grammar`.
    std::vector<EditConflict> conflicts; ///< Edits that the last inferences could not carry over.

    friend bool operator==(const Species&, const Species&) = default;
};

/// Reads the text of a `.species` file. Errors give line and column, inside the grammar too.
[[nodiscard]] Expected<Species> parseSpecies(std::string text, std::string_view file, const Limits& limits = {});

/// The text form; parseSpecies(printSpecies(s)) == s.
[[nodiscard]] std::string printSpecies(const Species& species);

[[nodiscard]] Expected<Species> loadSpecies(const std::filesystem::path& path, const Limits& limits = {});

/// Writes atomically; refuses a species that could not be read back within `limits`. A game's are the default; it takes
/// some 80,000 rules, each with a transform of its own, to exceed them.
[[nodiscard]] Expected<void> saveSpecies(const std::filesystem::path& path, const Species& species,
                                         const Limits& limits = {});

/// Identity of a grammar: a hash of its text, 16 hex digits.
[[nodiscard]] std::string identityOf(const Grammar& grammar);

/// Likewise of a species' tables and window.
[[nodiscard]] std::string tablesIdentityOf(const Species& species);

[[nodiscard]] std::string identityOf(const PipeModel& pipes);

/// Identity of a species: a hash of its text.
[[nodiscard]] std::uint64_t hashOf(const Species& species);

} // namespace espalier
