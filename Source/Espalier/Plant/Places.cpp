#include <Espalier/Core/Random.h>
#include <Espalier/Plant/Places.h>
#include <Espalier/Plant/Skeleton.h>
#include <cmath>

// Rejected: to count the children of a node, whose cut would give another number, and all its crown other keys, to each
// that is counted after it; to give the continuation a number of its own, since a cut far up may make another child the
// thicker one; to hash directions bit for bit, since a branch that is turned by a degree would bear other leaves.

namespace espalier {
namespace {

/// Where the hashes of places begin.
constexpr Seed kPlaces{0x706c61636573206fu};

/// Cosine of the largest angle that is straight on: 17.5 degrees. It lies between those that people draw, and so do the
/// sides' edges, 7.5 degrees from the left.
constexpr float kStraightOn = 0.95371695f;
constexpr float kEdgeCosine = 0.99144486f;
constexpr float kEdgeSine = 0.13052619f;

/// Straight on and eight sides.
constexpr std::uint32_t kWays = 9;

/// The way on which `child` leaves one who looks along `heading`.
std::uint32_t wayOf(const Vec3& child, const Vec3& heading, const Vec3& left)
{
    if (glm::dot(child, heading) > kStraightOn)
        return 0;
    const float leftwards = glm::dot(child, left);
    const float upwards = glm::dot(child, glm::cross(heading, left));
    const float x = kEdgeCosine * leftwards + kEdgeSine * upwards;
    const float y = kEdgeCosine * upwards - kEdgeSine * leftwards;
    return 1 + (x < 0 ? 1 : 0) + (y < 0 ? 2 : 0) + (std::abs(x) < std::abs(y) ? 4 : 0);
}

/// Takes a way from a node, which is a bit for every way that is taken, and above them how many found theirs taken.
/// Returns what no other child of the node has.
std::uint64_t take(std::uint64_t& node, std::uint32_t way)
{
    const std::uint64_t bit = std::uint64_t{1} << way;
    if ((node & bit) == 0)
    {
        node |= bit;
        return way;
    }
    node += std::uint64_t{1} << kWays;
    return kWays + (node >> kWays);
}

} // namespace

void hashPlaces(const Skeleton& skeleton, std::vector<std::uint64_t>& places)
{
    // Backwards: `places` holds each segment's end as a node until all its children have gone from there, then the way
    // on which it leaves its own parent.
    places.assign(skeleton.size(), 0);
    std::uint64_t base = 0;
    for (std::uint32_t i = skeleton.size(); i-- > 0;)
    {
        const std::uint32_t parent = skeleton.parents[i];
        const Vec3& heading = skeleton.headings[i];
        places[i] = parent == kNoSegment
                        ? take(base, wayOf(heading, Vec3(0, 1, 0), Vec3(-1, 0, 0)))
                        : take(places[parent], wayOf(heading, skeleton.headings[parent], skeleton.lefts[parent]));
    }
    for (std::uint32_t i = 0; i < skeleton.size(); ++i)
    {
        const std::uint32_t parent = skeleton.parents[i];
        const RandomKey below(parent == kNoSegment ? kPlaces : Seed{places[parent]});
        places[i] = below.child(places[i]).value();
    }
}

} // namespace espalier
