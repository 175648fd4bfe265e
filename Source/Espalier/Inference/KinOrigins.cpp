// Where the rules of kin come from. A rule is known again by what it stands for, since numbers and names change when
// something is drawn anew: by a hash of its limb with everything that it carries, or, where something further out has
// changed, by its place in the tree.

#include <Espalier/Inference/KinGrammar.h>

#include <Espalier/Core/Hash.h>
#include <algorithm>
#include <numeric>

namespace espalier {

namespace {

/// Of each limb: its template's word, its scaling and branching angle, and what it carries with its directions.
std::vector<std::uint64_t> hashesOf(const LimbTable& limbs, const TemplateLibrary& library)
{
    std::vector<std::uint32_t> order(limbs.limbs.size());
    std::iota(order.begin(), order.end(), 0u);
    std::ranges::stable_sort(order, {}, [&](std::uint32_t limb) { return limbs.limbs[limb].height; });
    std::vector<std::uint64_t> words;
    for (const Template& piece : library.templates)
    {
        Hash64 hash;
        hash.bytes(printWord(piece));
        words.push_back(hash.result());
    }
    std::vector<std::uint64_t> hashes(limbs.limbs.size());
    for (const std::uint32_t index : order) // what a limb carries is lower than it
    {
        const Limb& limb = limbs.limbs[index];
        Hash64 hash;
        hash.value(words[limb.piece]);
        hash.value(limb.scaling);
        hash.value(limb.branchingAngle);
        for (std::size_t a = 0; a < library.templates[limb.piece].anchors.size(); ++a)
        {
            const LimbUse& child = limbs.children[limb.firstChild + a];
            hash.value(child.limb == kNoInstance ? std::uint64_t{0} : hashes[child.limb]);
            hash.value(child.direction.rotation);
            hash.value(child.direction.roll);
        }
        hashes[index] = hash.result();
    }
    return hashes;
}

/// Of each instance, its tree and its number in it, and a hash of its place: the tree and the anchors on the way.
struct Places
{
    std::vector<DrawnNode> nodes;
    std::vector<std::uint64_t> hashes;
    std::vector<std::uint32_t> depthFirst; ///< The instances in this order.
};

Places placesOf(const Archetype& exemplars)
{
    const auto count = static_cast<std::uint32_t>(exemplars.instances.size());
    // Children in the order of the instances, not of the anchors: what a file lists first has the lower number.
    std::vector<std::uint32_t> firstChild(count, kNoInstance);
    std::vector<std::uint32_t> nextSibling(count, kNoInstance);
    for (std::uint32_t i = count; i-- > 0;)
        if (const std::uint32_t parent = exemplars.instances[i].parent; parent != kNoInstance)
        {
            nextSibling[i] = firstChild[parent];
            firstChild[parent] = i;
        }

    Places places{std::vector<DrawnNode>(count), std::vector<std::uint64_t>(count), {}};
    std::uint32_t tree = 0;
    std::vector<std::uint32_t> stack;
    for (std::uint32_t root = 0; root < count; ++root)
    {
        if (exemplars.instances[root].parent != kNoInstance)
            continue;
        stack.push_back(root);
        for (std::uint32_t node = 0; !stack.empty(); ++node)
        {
            const std::uint32_t i = stack.back();
            stack.pop_back();
            if (i != root && nextSibling[i] != kNoInstance)
                stack.push_back(nextSibling[i]);
            if (firstChild[i] != kNoInstance)
                stack.push_back(firstChild[i]);
            const TemplateInstance& instance = exemplars.instances[i];
            Hash64 hash;
            if (instance.parent == kNoInstance)
                hash.value(tree);
            else
            {
                hash.value(places.hashes[instance.parent]);
                hash.value(
                    exemplars.library.templates[exemplars.instances[instance.parent].piece].anchors[instance.anchor]);
            }
            places.hashes[i] = hash.result();
            places.nodes[i] = {tree, node};
            places.depthFirst.push_back(i);
        }
        ++tree;
    }
    return places;
}

} // namespace

std::vector<RuleOrigin> originsOf(const std::vector<KinRule>& rules, const LimbTable& limbs, const Archetype& exemplars,
                                  const AnchorTable& anchors)
{
    const TemplateLibrary& library = exemplars.library;
    const Places places = placesOf(exemplars);
    const std::vector<std::uint64_t> hashes = hashesOf(limbs, library);
    std::vector<std::uint32_t> first(limbs.limbs.size(), kNoInstance);
    std::vector<std::vector<DrawnNode>> nodes(limbs.limbs.size());
    for (const std::uint32_t i : places.depthFirst)
    {
        const std::uint32_t limb = limbs.limbOf[i];
        if (first[limb] == kNoInstance)
            first[limb] = i;
        if (nodes[limb].size() < RuleOrigin::kMostNodes)
            nodes[limb].push_back(places.nodes[i]);
    }

    std::vector<RuleOrigin> origins;
    std::uint32_t tree = 0;
    for (const KinRule& rule : rules)
    {
        const Limb& limb = limbs.limbs[rule.limb];
        const bool isStart = rule.part == KinRule::kStart;
        const std::uint32_t instance = isStart ? anchors.roots[tree++] : first[rule.limb];
        // An anchor goes by its letter, which says the same in another version of the template.
        const std::uint32_t part = rule.part < KinRule::kStart
                                       ? static_cast<std::uint32_t>(library.templates[limb.piece].anchors[rule.part])
                                       : rule.part;
        Hash64 identity;
        identity.value(hashes[rule.limb]);
        identity.value(part);
        Hash64 place;
        place.value(places.hashes[instance]);
        place.bytes(library.templates[limb.piece].name);
        place.value(part);
        RuleOrigin origin{identity.result(), place.result(), isStart ? 1 : limb.drawn, {}};
        origin.nodes = isStart ? std::vector{places.nodes[instance]} : nodes[rule.limb];
        origins.push_back(std::move(origin));
    }
    return origins;
}

} // namespace espalier
