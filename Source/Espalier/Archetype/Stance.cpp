#include <Espalier/Archetype/Stance.h>

#include <vector>

namespace espalier {

void findStances(const Skeleton& drawn, std::span<Stance> stances)
{
    constexpr float kTilted = 0.25f;  // sine: below it neither side is up
    constexpr float kUpright = 0.94f; // cosine
    std::vector<bool> known(drawn.instanceRecords.size());
    for (std::uint32_t segment = 0; segment < drawn.size(); ++segment)
    {
        const std::uint32_t record = drawn.instances[segment];
        if (record == kNoSegment || known[record])
            continue;
        known[record] = true;
        const float left = drawn.lefts[segment].y;
        stances[drawn.instanceRecords[record].row] = {left > kTilted    ? SkySide::Left
                                                      : left < -kTilted ? SkySide::Right
                                                                        : SkySide::Neither,
                                                      drawn.headings[segment].y > kUpright};
    }
}

} // namespace espalier
