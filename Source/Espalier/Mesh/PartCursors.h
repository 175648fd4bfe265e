#pragma once

#include <Espalier/Mesh/TreeMesh.h>
#include <Espalier/Species/Appearance.h>
#include <algorithm>
#include <array>
#include <cstdint>

namespace espalier {

/// Sorts the indices of one kind of material into a part a colour while they are written: count what each colour will
/// take, open the parts, then write each piece where its colour's cursor stands.
class PartCursors
{
public:
    /// Requires: colour < kMaxPalette.
    void count(std::uint32_t colour, std::uint64_t indices) { runs_[colour] += indices; }

    [[nodiscard]] std::uint32_t parts() const
    {
        return static_cast<std::uint32_t>(
            std::count_if(runs_.begin(), runs_.end(), [](std::uint64_t run) { return run > 0; }));
    }

    /// Appends the parts to `mesh`, by ascending colour, and their indices for `next` to be filled in.
    void open(MeshMaterial material, TreeMesh& mesh)
    {
        std::uint64_t end = mesh.indices.size();
        for (std::size_t colour = 0; colour < runs_.size(); ++colour)
        {
            const std::uint64_t count = runs_[colour];
            runs_[colour] = end;
            if (count == 0)
                continue;
            mesh.parts.push_back({.material = material,
                                  .firstIndex = static_cast<std::uint32_t>(end),
                                  .indexCount = static_cast<std::uint32_t>(count),
                                  .colour = static_cast<std::uint16_t>(colour)});
            end += count;
        }
        mesh.indices.resize(end);
    }

    /// Where the next index of this colour goes.
    [[nodiscard]] std::size_t next(std::uint32_t colour) const { return runs_[colour]; }
    void advance(std::uint32_t colour, std::size_t next) { runs_[colour] = next; }

private:
    std::array<std::uint64_t, kMaxPalette> runs_{}; ///< Numbers of indices; after `open` the cursors.
};

} // namespace espalier
