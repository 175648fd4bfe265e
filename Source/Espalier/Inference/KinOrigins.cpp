// Where the rules of kin come from. A rule is known again by what it stands for, since numbers and names change when
// something is drawn anew: by a hash of its limb with everything that it carries (of limbs that share a rule, by what
// all of them carry), or, where something further out has changed, by its place in the tree.

#include <Espalier/Inference/KinGrammar.h>

#include <Espalier/Core/Hash.h>
#include <algorithm>
#include <numeric>
#include <span>

namespace espalier {

std::uint64_t limbIdentity(std::uint64_t load, double scaling, double branchingAngle)
{
    Hash64 hash;
    hash.value(load);
    hash.value(scaling);
    hash.value(branchingAngle);
    return hash.result();
}

namespace {

/// Of each limb: its template's word, and what it carries with its directions.
std::vector<std::uint64_t> loadsOf(const LimbTable& limbs, const TemplateLibrary& library)
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
    std::vector<std::uint64_t> loads(limbs.limbs.size());
    for (const std::uint32_t index : order) // what a limb carries is lower than it
    {
        const Limb& limb = limbs.limbs[index];
        Hash64 hash;
        hash.value(words[limb.piece]);
        for (const LimbUse& child : loadOf(limbs, index))
        {
            if (child.limb == kNoInstance)
                hash.value(std::uint64_t{0});
            else
                hash.value(limbIdentity(loads[child.limb], limbs.limbs[child.limb].scaling,
                                        limbs.limbs[child.limb].branchingAngle));
            hash.value(child.direction.rotation);
            hash.value(child.direction.roll);
        }
        loads[index] = hash.result();
    }
    return loads;
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

std::vector<DrawnNode> drawnNodesOf(const Archetype& exemplars)
{
    return placesOf(exemplars).nodes;
}

std::vector<RuleOrigin> originsOf(const std::vector<KinRule>& rules, const LimbTable& limbs, const KinClasses& classes,
                                  const Archetype& exemplars, const AnchorTable& anchors)
{
    const TemplateLibrary& library = exemplars.library;
    const Places places = placesOf(exemplars);
    const std::vector<std::uint64_t> loads = loadsOf(limbs, library);
    std::vector<std::uint32_t> first(limbs.limbs.size(), kNoInstance);
    std::vector<std::vector<DrawnNode>> nodes(limbs.limbs.size());
    for (const std::uint32_t i : places.depthFirst)
    {
        const std::uint32_t limb = limbs.limbOf[i];
        if (first[limb] == kNoInstance)
            first[limb] = i;
        if (i < limbs.drawnInstances && nodes[limb].size() < RuleOrigin::kMostNodes)
            nodes[limb].push_back(places.nodes[i]);
    }

    std::vector<RuleOrigin> origins;
    std::uint32_t tree = 0;
    for (const KinRule& rule : rules)
    {
        const Limb& limb = limbs.limbs[rule.limb];
        const bool isStart = rule.part == KinRule::kStart;
        const std::uint32_t instance = isStart ? anchors.roots[tree++] : first[rule.limb];
        RuleOrigin origin;
        origin.limbs = rule.limbs;
        origin.limb =
            rule.limbs > 1 ? loads[rule.limb] : limbIdentity(loads[rule.limb], limb.scaling, limb.branchingAngle);
        Hash64 place;
        place.value(places.hashes[instance]);
        place.bytes(library.templates[limb.piece].name);
        if (rule.part != KinRule::kWhole)
        {
            // An anchor goes by its letter, which says the same in another version of the template.
            const std::uint32_t part =
                isStart ? rule.part : static_cast<std::uint32_t>(library.templates[limb.piece].anchors[rule.part]);
            Hash64 identity;
            identity.value(origin.limb);
            identity.value(part);
            origin.limb = identity.result();
            place.value(part);
        }
        origin.place = place.result();
        if (isStart)
        {
            origin.count = instance < limbs.drawnInstances;
            origin.nodes.assign(origin.count, places.nodes[instance]);
        }
        else
        {
            const std::vector<std::uint32_t>& kin = classes.kin[classes.classOf[rule.limb]];
            for (const std::uint32_t member : std::span(kin).subspan(rule.number, rule.limbs))
            {
                origin.count += limbs.limbs[member].drawn;
                origin.nodes.insert(origin.nodes.end(), nodes[member].begin(), nodes[member].end());
            }
            std::ranges::sort(origin.nodes, {}, [](const DrawnNode& node) { return std::pair(node.tree, node.node); });
            origin.nodes.resize(std::min(origin.nodes.size(), RuleOrigin::kMostNodes));
        }
        origins.push_back(std::move(origin));
    }
    return origins;
}

} // namespace espalier
