#include <Espalier/Inference/InstanceTree.h>

#include <Espalier/Archetype/Placement.h>
#include <Espalier/Core/Hash.h>

namespace espalier {

namespace {

/// Of each anchor of a template: the turtle symbols behind it. They are counted from the end because what a transform
/// puts before a word is not always written.
std::vector<std::uint32_t> anchorPlaces(const Template& piece)
{
    std::vector<std::uint32_t> places(piece.anchors.size());
    std::uint32_t behind = 0;
    for (std::size_t i = piece.modules.size(); i-- > 0;)
    {
        if (piece.modules[i].anchor == kNoAnchor)
            ++behind;
        else
            places[piece.modules[i].anchor] = behind;
    }
    return places;
}

} // namespace

std::vector<std::uint32_t> depthsOf(const InstanceTree& tree)
{
    std::vector<std::uint32_t> depths(tree.size(), 1);
    for (std::uint32_t i = 1; i < tree.size(); ++i)
        depths[i] = depths[tree.shape.parents[i]] + 1;
    return depths;
}

std::uint64_t topologyOf(const InstanceTree& tree) noexcept
{
    Hash64 hash;
    for (std::uint32_t i = 0; i < tree.size(); ++i)
    {
        hash.value(tree.shape.labels[i]);
        hash.value(tree.shape.parents[i]);
        hash.value(tree.places[i]);
    }
    return hash.result();
}

InstanceTree instanceTreeOf(const Archetype& archetype, const AnchorTable& anchors, std::size_t tree)
{
    std::vector<std::vector<std::uint32_t>> places;
    for (const Template& piece : archetype.library.templates)
        places.push_back(anchorPlaces(piece));

    struct Visit
    {
        std::uint32_t instance;
        std::uint32_t parent;
        std::uint32_t place;
    };
    InstanceTree result;
    std::vector<Visit> pending{{anchors.roots[tree], 0, 0}};
    while (!pending.empty())
    {
        const Visit visit = pending.back();
        pending.pop_back();
        const std::uint32_t node = result.size();
        const std::uint32_t piece = archetype.instances[visit.instance].piece;
        result.shape.labels.push_back(piece);
        result.shape.parents.push_back(visit.parent);
        result.places.push_back(visit.place);
        const std::uint32_t first = anchors.firstChild[visit.instance];
        for (std::uint32_t a = anchors.firstChild[visit.instance + 1] - first; a-- > 0;)
            if (anchors.children[first + a] != kNoInstance)
                pending.push_back({anchors.children[first + a], node, places[piece][a]});
    }
    return result;
}

InstanceTreeSink::InstanceTreeSink(std::span<const std::uint32_t> labelOfProduction,
                                   std::span<const std::uint8_t> rewritable)
    : labelOfProduction_(labelOfProduction), rewritable_(rewritable)
{}

InstanceTree InstanceTreeSink::take()
{
    // A child's place was noted as the symbols before it.
    for (std::uint32_t i = 1; i < tree_.size(); ++i)
        tree_.places[i] = symbols_[tree_.shape.parents[i]] - tree_.places[i];
    InstanceTree taken = std::move(tree_);
    tree_ = {};
    symbols_.clear();
    open_.clear();
    return taken;
}

bool InstanceTreeSink::modules(std::span<const LetterId> letters, std::span<const double>)
{
    if (!rewritable_.empty())
        for (const LetterId letter : letters)
            tree_.unfinished += rewritable_[letter];
    if (!open_.empty())
        symbols_[open_.back()] += static_cast<std::uint32_t>(letters.size());
    return true;
}

void InstanceTreeSink::beginInstance(std::uint32_t production, std::uint32_t)
{
    const bool isRoot = open_.empty();
    tree_.shape.labels.push_back(labelOfProduction_[production]);
    tree_.shape.parents.push_back(isRoot ? 0 : open_.back());
    tree_.places.push_back(isRoot ? 0 : symbols_[open_.back()]);
    symbols_.push_back(0);
    open_.push_back(tree_.size() - 1);
}

void InstanceTreeSink::endInstance()
{
    open_.pop_back();
}

} // namespace espalier
