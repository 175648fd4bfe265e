#include <Espalier/Overlap/Overlap.h>
#include <Espalier/Plant/Skeleton.h>

int main()
{
    const espalier::Skeleton nothing;
    const auto overlaps = espalier::findOverlaps(nothing); // Brings Embree along, if the library was built with it.
    return overlaps && overlaps->overlaps.empty() && espalier::isSound(nothing) ? 0 : 1;
}
