#pragma once

#include <Espalier/Core/Vector.h>
#include <Espalier/Species/LeafOutline.h>
#include <vector>

namespace espalier {

/// The ribs of one leaf. Lengths are those of its blade: t from foot to tip, x from the midrib to the margin.
class LeafVeins
{
public:
    /// `halfWidth`: the leaf's greatest, in lengths of the blade.
    LeafVeins(LeafShape shape, float halfWidth);

    struct Sample
    {
        float rib = 0;   ///< How much of this point is midrib or side vein: [0, 1].
        float ridge = 0; ///< How far it is raised for that, in lengths of the blade.
        float bulge = 0; ///< The blade between two side veins: 0 at a vein, and half way as much as they are apart.
    };

    /// At `along` the blade and `aside` of its midrib, whose sign says on which half.
    [[nodiscard]] Sample at(float along, float aside) const noexcept;

private:
    struct SideVein
    {
        float from;  ///< Along the midrib, where it leaves it.
        float to;    ///< Along, where it meets the margin.
        float reach; ///< From the midrib to there.
    };

    float thickness_ = 0; ///< Half the midrib's at its foot.
    float sideShare_ = 0; ///< How thick and strong side veins are, of the midrib.
    float spacing_ = 1;   ///< Between side veins along the midrib.
    std::vector<SideVein> left_;
    std::vector<SideVein> right_;
};

} // namespace espalier
