#include <Espalier/Species/Appearance.h>
#include <algorithm>

namespace espalier {

std::vector<Vec3> defaultPalette()
{
    return {
        {0.150f, 0.245f, 0.062f}, // fresh leaf
        {0.082f, 0.160f, 0.045f}, // green
        {0.300f, 0.370f, 0.090f}, // yellow green
        {0.860f, 0.600f, 0.660f}, // blossom
        {0.850f, 0.560f, 0.070f}, // warm yellow
        {0.600f, 0.045f, 0.035f}, // berry red
        {0.200f, 0.130f, 0.560f}, // violet blue
        {0.270f, 0.165f, 0.075f}, // withered leaf
    };
}

Appearance inSeason(const Appearance& appearance, std::string_view season)
{
    Appearance changed = appearance;
    const auto found = std::ranges::find(appearance.seasons, season, &Season::name);
    if (found == appearance.seasons.end())
        return changed;
    for (std::size_t i = 0; i < std::min(changed.leaves.size(), found->leaves.size()); ++i)
    {
        const SeasonalLeaves& then = found->leaves[i];
        changed.leaves[i].colour = then.colour;
        changed.leaves[i].colourSpread = then.colourSpread;
        changed.leaves[i].density *= then.density;
    }
    return changed;
}

} // namespace espalier
