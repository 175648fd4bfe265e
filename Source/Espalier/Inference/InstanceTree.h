#pragma once

#include <Espalier/Archetype/Archetype.h>
#include <Espalier/Grammar/Derivation.h>
#include <Espalier/Inference/TreeDistance.h>
#include <cstdint>
#include <span>
#include <vector>

namespace espalier {

/// A tree as its template instances stand in it, without geometry: what similarity is measured on.
struct InstanceTree
{
    /// A node for each instance, labelled by its template; depth first, in the order of the word.
    LabelledTree shape;
    /// Of each node: where in its parent's template it hangs, as the number of turtle symbols that follow there.
    /// Anchors with no symbol between them are one place. 0 for the root.
    std::vector<std::uint32_t> places;
    std::uint32_t unfinished = 0; ///< Symbols left in the word that a rule could still rewrite.

    [[nodiscard]] std::uint32_t size() const noexcept { return shape.size(); }
};

/// Instances from the root to each node, itself included.
[[nodiscard]] std::vector<std::uint32_t> depthsOf(const InstanceTree& tree);

/// Equal for trees of equal templates at equal places, whatever their transforms.
[[nodiscard]] std::uint64_t topologyOf(const InstanceTree& tree) noexcept;

/// Tree number `tree` of a valid archetype; labels are indices into its library.
[[nodiscard]] InstanceTree instanceTreeOf(const Archetype& archetype, const AnchorTable& anchors, std::size_t tree);

/// Collects the instance tree of a derivation.
class InstanceTreeSink final : public DerivationSink
{
public:
    /// The label of each production's instances, and which letters a rule could rewrite (none: nothing is said about
    /// unfinished ones). Both must outlive it.
    explicit InstanceTreeSink(std::span<const std::uint32_t> labelOfProduction,
                              std::span<const std::uint8_t> rewritable = {});

    /// What was collected since the last call; it is then ready for another derivation.
    [[nodiscard]] InstanceTree take();

    bool modules(std::span<const LetterId> letters, std::span<const double> arguments) override;
    void beginInstance(std::uint32_t production, std::uint32_t row) override;
    void endInstance() override;
    [[nodiscard]] bool wantsArguments() const override { return false; }

private:
    std::span<const std::uint32_t> labelOfProduction_;
    std::span<const std::uint8_t> rewritable_;
    InstanceTree tree_;
    std::vector<std::uint32_t> symbols_; ///< Of each node: its own, so far.
    std::vector<std::uint32_t> open_;    ///< The instances that enclose what comes next.
};

} // namespace espalier
