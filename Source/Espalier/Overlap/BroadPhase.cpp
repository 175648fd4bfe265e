#include <Espalier/Overlap/BroadPhase.h>

#include <algorithm>
#include <array>
#include <new>
#include <numeric>
#include <vector>
#if ESPALIER_WITH_EMBREE
#include <embree3/rtcore.h>
#include <memory>
#endif

namespace espalier {

namespace {

constexpr std::size_t kBatch = 256;
constexpr std::uint32_t kLeafSize = 4;

bool touch(const Box& a, const Box& b)
{
    return a.low.x <= b.high.x && b.low.x <= a.high.x && a.low.y <= b.high.y && b.low.y <= a.high.y &&
           a.low.z <= b.high.z && b.low.z <= a.high.z;
}

Box join(const Box& a, const Box& b)
{
    return {glm::min(a.low, b.low), glm::max(a.high, b.high)};
}

/// Boxes in an order in which every node of the tree is a range, and its children the two halves of that range. Nodes
/// lie parents first, the left child next to its parent.
class BoxTree
{
public:
    explicit BoxTree(std::span<const Box> boxes) : boxes_(boxes), order_(boxes.size())
    {
        std::iota(order_.begin(), order_.end(), 0u);
        if (!boxes.empty())
            build(0, static_cast<std::uint32_t>(boxes.size()));
    }

    /// Calls `found` with every box of a later place than `place` that touches the box there.
    template <class Found>
    void visitLater(std::uint32_t place, const Found& found) const
    {
        const Box& box = boxes_[order_[place]];
        std::uint32_t node = 0;
        while (node < nodes_.size())
        {
            const Node& here = nodes_[node];
            const bool isLeaf = here.end - here.begin <= kLeafSize;
            if (here.end <= place + 1 || !touch(here.box, box))
            {
                node = here.next;
                continue;
            }
            if (isLeaf)
                for (std::uint32_t other = std::max(here.begin, place + 1); other < here.end; ++other)
                    if (touch(boxes_[order_[other]], box))
                        found(order_[place], order_[other]);
            ++node; // of a leaf, that is `next`
        }
    }

private:
    struct Node
    {
        Box box;
        std::uint32_t begin = 0;
        std::uint32_t end = 0;
        std::uint32_t next = 0; ///< The node after this one's descendants.
    };

    Box build(std::uint32_t begin, std::uint32_t end)
    {
        const std::size_t node = nodes_.size();
        nodes_.push_back({boxes_[order_[begin]], begin, end, 0});
        Box box = boxes_[order_[begin]];
        if (end - begin <= kLeafSize)
        {
            for (std::uint32_t i = begin + 1; i < end; ++i)
                box = join(box, boxes_[order_[i]]);
        }
        else
        {
            const std::uint32_t middle = splitAtMedian(begin, end);
            box = build(begin, middle);
            box = join(box, build(middle, end));
        }
        nodes_[node].box = box;
        nodes_[node].next = static_cast<std::uint32_t>(nodes_.size());
        return box;
    }

    /// Halves the range along the axis on which the centres spread most. How ties fall changes the tree, not the pairs.
    std::uint32_t splitAtMedian(std::uint32_t begin, std::uint32_t end)
    {
        const auto centre = [this](std::uint32_t i) { return 0.5f * boxes_[i].low + 0.5f * boxes_[i].high; };
        Box spread{centre(order_[begin]), centre(order_[begin])};
        for (std::uint32_t i = begin + 1; i < end; ++i)
            spread = join(spread, {centre(order_[i]), centre(order_[i])});
        const Vec3 size = spread.high - spread.low;
        const int axis = size.x >= size.y && size.x >= size.z ? 0 : (size.y >= size.z ? 1 : 2);
        const std::uint32_t middle = begin + (end - begin) / 2;
        std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                         [&](std::uint32_t a, std::uint32_t b) { return centre(a)[axis] < centre(b)[axis]; });
        return middle;
    }

    std::span<const Box> boxes_;
    std::vector<std::uint32_t> order_;
    std::vector<Node> nodes_;
};

} // namespace

bool visitTouchingPairsByTree(std::span<const Box> boxes, const PairVisitor& visit)
{
    try
    {
        const BoxTree tree(boxes);
        std::array<BoxPair, kBatch> batch;
        std::size_t size = 0;
        for (std::uint32_t place = 0; place < boxes.size(); ++place)
            tree.visitLater(place, [&](std::uint32_t first, std::uint32_t second) {
                batch[size++] = {first, second};
                if (size == kBatch)
                {
                    visit(batch);
                    size = 0;
                }
            });
        visit(std::span(batch).first(size));
        return true;
    }
    catch (const std::bad_alloc&)
    {
        return false;
    }
}

#if ESPALIER_WITH_EMBREE

namespace {

struct ReleaseDevice
{
    void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
};

struct ReleaseScene
{
    void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};

using Device = std::unique_ptr<RTCDeviceTy, ReleaseDevice>;
using Scene = std::unique_ptr<RTCSceneTy, ReleaseScene>;

void writeBounds(const RTCBoundsFunctionArguments* arguments)
{
    const Box& box = static_cast<const Box*>(arguments->geometryUserPtr)[arguments->primID];
    *arguments->bounds_o = {box.low.x, box.low.y, box.low.z, 0, box.high.x, box.high.y, box.high.z, 0};
}

void passCollisions(void* visitor, RTCCollision* collisions, unsigned count)
{
    const auto& visit = *static_cast<const PairVisitor*>(visitor);
    std::array<BoxPair, kBatch> batch;
    std::size_t size = 0;
    for (unsigned i = 0; i < count; ++i)
    {
        batch[size++] = {collisions[i].primID0, collisions[i].primID1};
        if (size == kBatch || i + 1 == count)
        {
            visit(std::span<const BoxPair>(batch).first(size));
            size = 0;
        }
    }
}

} // namespace

bool visitTouchingPairs(std::span<const Box> boxes, const PairVisitor& visit)
{
    if (boxes.size() < 2)
        return true;
    const Device device(rtcNewDevice(nullptr));
    if (!device)
        return false;
    const Scene scene(rtcNewScene(device.get()));
    const RTCGeometry geometry = rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(boxes.size()));
    rtcSetGeometryUserData(geometry, const_cast<Box*>(boxes.data())); // read only
    rtcSetGeometryBoundsFunction(
        geometry, [](const RTCBoundsFunctionArguments* a) { writeBounds(a); }, nullptr);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene.get(), geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene.get());
    if (rtcGetDeviceError(device.get()) != RTC_ERROR_NONE)
        return false;
    rtcCollide(scene.get(), scene.get(), passCollisions, const_cast<PairVisitor*>(&visit));
    return rtcGetDeviceError(device.get()) == RTC_ERROR_NONE;
}

#else

bool visitTouchingPairs(std::span<const Box> boxes, const PairVisitor& visit)
{
    return visitTouchingPairsByTree(boxes, visit);
}

#endif

} // namespace espalier
