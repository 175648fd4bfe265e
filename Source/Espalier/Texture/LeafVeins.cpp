#include <Espalier/Texture/LeafVeins.h>

#include <algorithm>
#include <cmath>

namespace espalier {
namespace {

/// How side veins leave the midrib.
struct Venation
{
    std::uint32_t pairs;
    float rise;   ///< Their way along the midrib for their way out.
    float share;  ///< Of the midrib's thickness.
    float midrib; ///< Half its thickness at the foot.
};

Venation venationOf(LeafShape shape)
{
    switch (shape)
    {
    case LeafShape::Ovate:
        return {8, 0.95f, 0.55f, 0.012f};
    case LeafShape::Lobed:
        return {6, 0.55f, 0.6f, 0.013f};
    case LeafShape::Deltoid:
        return {6, 0.85f, 0.6f, 0.012f};
    case LeafShape::Lanceolate:
        return {12, 1.3f, 0.4f, 0.009f};
    case LeafShape::Linear:
        return {0, 0, 0, 0.007f};
    case LeafShape::Needle:
    case LeafShape::Blossom:
        return {0, 0, 0, 0};
    }
    return {0, 0, 0, 0};
}

/// 1 on a rib, falling to 0 at 1.
float roundRidge(float x)
{
    return x < 1 ? (1 - x * x) * (1 - x * x) : 0.f;
}

} // namespace

LeafVeins::LeafVeins(LeafShape shape, float halfWidth)
{
    const Venation venation = venationOf(shape);
    thickness_ = std::min(venation.midrib, 0.2f * halfWidth);
    sideShare_ = venation.share;
    if (venation.pairs == 0)
        return;
    spacing_ = 0.86f / static_cast<float>(venation.pairs);
    for (std::uint32_t i = 0; i < venation.pairs; ++i)
        for (std::vector<SideVein>* half : {&left_, &right_})
        {
            // Those of the right half leave a little later. All go up until they meet the margin.
            const float from = 0.03f + spacing_ * (static_cast<float>(i) + (half == &right_ ? 0.28f : 0.f));
            constexpr float kStep = 0.004f;
            SideVein vein{from, from, 0};
            while (vein.to < 1 && vein.reach <= halfWidth * halfWidthOf(shape, vein.to))
            {
                vein.to += kStep;
                vein.reach += kStep / venation.rise;
            }
            if (vein.reach > 0)
                half->push_back(vein);
        }
    if (shape == LeafShape::Lobed)
    {
        // Each lobe has its own, which ends in the middle of its edge.
        constexpr float kMiddles[] = {0.21f, 0.375f, 0.55f, 0.725f, 0.9f};
        for (std::vector<SideVein>* half : {&left_, &right_})
        {
            half->clear();
            for (const float middle : kMiddles)
            {
                const float reach = 0.97f * halfWidth * halfWidthOf(shape, middle);
                const float shift = half == &right_ ? 0.02f : 0.f;
                half->push_back({std::max(0.01f, middle - venation.rise * reach + shift), middle + 0.01f, reach});
            }
        }
        spacing_ = 0.17f;
    }
}

LeafVeins::Sample LeafVeins::at(float along, float aside) const noexcept
{
    Sample sample;
    if (thickness_ <= 0)
        return sample;
    const float x = std::abs(aside);
    const float middle = thickness_ * (1 - 0.82f * along);
    sample.rib = std::clamp(1.5f - x / middle, 0.f, 1.f);
    sample.ridge = middle * roundRidge(x / (1.5f * middle));
    float nearest = 0.5f * spacing_;
    for (const SideVein& vein : aside < 0 ? left_ : right_)
    {
        // They bend towards the tip on their way.
        const float s = x / vein.reach;
        const float rise = vein.to - vein.from;
        const float at = vein.from + rise * s * (0.8f + 0.2f * s);
        const float slope = rise / vein.reach;
        const float distance = std::abs(along - at) / std::sqrt(1 + slope * slope);
        nearest = std::min(nearest, std::abs(along - at));
        const float thick = sideShare_ * middle * (1 - 0.65f * std::min(s, 1.f));
        const float fades = std::clamp(10 * (1.02f - s), 0.f, 1.f);
        sample.rib =
            std::max(sample.rib, std::clamp(1.5f - distance / thick, 0.f, 1.f) * fades * (0.55f + 0.45f * sideShare_));
    }
    if (!left_.empty())
        sample.bulge = spacing_ * std::min(1.f, 2 * nearest / spacing_) * std::min(1.f, x / (4 * middle));
    return sample;
}

} // namespace espalier
