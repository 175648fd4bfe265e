#include <Espalier/Inference/Limbs.h>

#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Core/Hash.h>
#include <algorithm>
#include <cmath>
#include <map>
#include <span>
#include <tuple>
#include <unordered_map>

namespace espalier {

std::vector<std::uint32_t> segmentsDrawn(const TemplateLibrary& library)
{
    std::vector<std::uint32_t> draws;
    for (const Template& piece : library.templates)
    {
        TurtleFilter filter;
        draws.push_back(0);
        for (const TemplateModule& module : piece.modules)
        {
            const TurtleCommand command = turtleCommand(std::string_view(&module.symbol, 1));
            if (module.anchor == kNoAnchor && filter.carriesOut(command) && command == TurtleCommand::Draw)
                ++draws.back();
        }
    }
    return draws;
}

namespace {

/// How often each instance counts: as often as its tree.
std::vector<std::uint32_t> weightsOfInstances(const Archetype& exemplars, std::span<const std::uint32_t> weights)
{
    std::vector<std::uint32_t> result;
    result.reserve(exemplars.instances.size());
    std::size_t tree = 0;
    for (const TemplateInstance& instance : exemplars.instances)
        result.push_back(instance.parent != kNoInstance ? result[instance.parent]
                         : weights.empty()              ? 1
                                                        : weights[tree++]);
    return result;
}

} // namespace

LimbTable shareLimbs(const Archetype& exemplars, const AnchorTable& anchors, const std::vector<std::uint32_t>& draws,
                     std::span<const std::uint32_t> weights, std::span<const Stance> stances, bool mirrored)
{
    const std::vector<std::uint32_t> weightOf = weightsOfInstances(exemplars, weights);
    const auto count = static_cast<std::uint32_t>(exemplars.instances.size());
    const std::uint32_t drawnInstances = mirrored ? count / 2 : count;
    const std::vector<std::uint32_t> kinds = kindsOf(exemplars.library);
    std::vector<std::uint32_t> limbOf(count);
    std::unordered_map<std::uint64_t, std::uint32_t> firstWithHash; // looked up, never iterated
    std::vector<std::uint32_t> nextWithHash;
    LimbTable found; // numbered from the tips
    std::vector<LimbUse> children;
    const auto useOf = [&](std::uint32_t instance) {
        if (instance == kNoInstance)
            return LimbUse{kNoInstance, {}};
        const InstanceTransform& transform = exemplars.instances[instance].transform;
        return LimbUse{limbOf[instance], {transform.rotation, transform.roll}};
    };

    // Parents come before children, so going backwards meets every child before its parent.
    for (std::uint32_t i = count; i-- > 0;)
    {
        const TemplateInstance& instance = exemplars.instances[i];
        const auto anchorCount = anchors.firstChild[i + 1] - anchors.firstChild[i];
        Limb limb{instance.piece,
                  kinds[instance.piece],
                  static_cast<std::uint32_t>(found.children.size()),
                  0,
                  draws[instance.piece],
                  1,
                  instance.transform.scaling,
                  instance.transform.branchingAngle};
        const Template& piece = exemplars.library.templates[instance.piece];
        if (mirrored && beginsWithTurn(piece) && !piece.modules[0].hasNumber)
            limb.firstTurn = limb.branchingAngle;
        if (mirrored)
            limb.side = i < drawnInstances ? stances[i].skySide : mirrorImage(stances[i - drawnInstances].skySide);
        Hash64 hash;
        hash.value(instance.piece);
        hash.value(limb.side);
        hash.value(limb.scaling);
        hash.value(limb.branchingAngle);
        children.clear();
        for (std::uint32_t a = 0; a < anchorCount; ++a)
        {
            const LimbUse& child = children.emplace_back(useOf(anchors.children[anchors.firstChild[i] + a]));
            hash.value(child.limb);
            hash.value(child.direction.rotation);
            hash.value(child.direction.roll);
            if (child.limb == kNoInstance)
                continue;
            limb.segments += found.limbs[child.limb].segments;
            limb.height = std::max(limb.height, found.limbs[child.limb].height + 1);
        }
        const auto [entry, isNew] = firstWithHash.try_emplace(hash.result(), kNoInstance);
        std::uint32_t same = entry->second;
        while (same != kNoInstance &&
               !(found.limbs[same].piece == limb.piece && found.limbs[same].side == limb.side &&
                 found.limbs[same].scaling == limb.scaling && found.limbs[same].branchingAngle == limb.branchingAngle &&
                 std::equal(children.begin(), children.end(), found.children.begin() + found.limbs[same].firstChild)))
            same = nextWithHash[same];
        if (same == kNoInstance)
        {
            same = static_cast<std::uint32_t>(found.limbs.size());
            nextWithHash.push_back(entry->second);
            entry->second = same;
            found.limbs.push_back(limb);
            found.children.insert(found.children.end(), children.begin(), children.end());
        }
        found.limbs[same].count += weightOf[i];
        if (i < drawnInstances)
        {
            ++found.limbs[same].drawn;
            found.limbs[same].observations += weightOf[i];
            found.limbs[same].isUpright &= !stances.empty() && stances[i].isUpright;
        }
        limbOf[i] = same;
    }

    // Renumber by first occurrence, so that the grammar reads from the trunk to the twigs.
    constexpr std::uint32_t kUnnumbered = 0xffffffffu;
    std::vector<std::uint32_t> newNumber(found.limbs.size(), kUnnumbered);
    LimbTable table;
    std::vector<std::uint32_t> order;
    for (std::uint32_t i = 0; i < count; ++i)
        if (newNumber[limbOf[i]] == kUnnumbered)
        {
            newNumber[limbOf[i]] = static_cast<std::uint32_t>(order.size());
            order.push_back(limbOf[i]);
        }
    for (const std::uint32_t old : order)
    {
        Limb limb = found.limbs[old];
        const std::uint32_t first = limb.firstChild;
        limb.firstChild = static_cast<std::uint32_t>(table.children.size());
        const std::size_t anchorCount = exemplars.library.templates[limb.piece].anchors.size();
        for (std::size_t a = 0; a < anchorCount; ++a)
        {
            LimbUse child = found.children[first + a];
            if (child.limb != kNoInstance)
                child.limb = newNumber[child.limb];
            table.children.push_back(child);
        }
        table.limbs.push_back(limb);
    }
    for (const std::uint32_t root : anchors.roots)
    {
        table.roots.push_back(useOf(root));
        table.roots.back().limb = newNumber[limbOf[root]];
        table.rootWeights.push_back(weightOf[root]);
    }
    for (std::uint32_t& limb : limbOf)
        limb = newNumber[limb];
    table.limbOf = std::move(limbOf);
    table.drawnInstances = drawnInstances;
    return table;
}

const std::vector<KinLevel>& kinLevels()
{
    static const std::vector<KinLevel> kLevels = {{4, 1.5, false}, {4, 2, false}, {4, 2, true}, {16, 4, false},
                                                  {16, 4, true},   {0, 0, false}, {0, 0, true}};
    return kLevels;
}

std::vector<KinLevel> kinLevelsByFreedom()
{
    std::vector<KinLevel> levels = kinLevels();
    std::stable_partition(levels.begin(), levels.end(), [](const KinLevel& level) { return !level.anchors; });
    return levels;
}

KinClasses classify(const LimbTable& limbs, const KinLevel& level, double totalSegments)
{
    const auto band = [](double value, double base) {
        return base == 0 ? 0.0 : std::floor(math::log(value) / math::log(base));
    };
    KinClasses classes;
    classes.level = level;
    const bool mirrored = limbs.drawnInstances < limbs.limbOf.size();
    std::map<std::tuple<std::uint32_t, int, double, double, double>, std::uint32_t> numbers;
    for (std::uint32_t i = 0; i < limbs.limbs.size(); ++i)
    {
        const Limb& limb = limbs.limbs[i];
        // 0.999: a whole tree, and what is just a band's width smaller, lie inside a band, not on its edge. Half a
        // segment stands for a limb that draws nothing.
        const double share = 0.999 * std::max(0.5, static_cast<double>(limb.segments)) / totalSegments;
        // What hangs to one side of an upright limb is upside down on the other: where such occupants are exchanged, an
        // image is kin to images alone.
        constexpr int kImage = 2;
        const bool isImage = mirrored && level.anchors && limb.side == SkySide::Neither && limb.drawn == 0;
        const int side = isImage ? kImage : static_cast<int>(limb.side);
        const auto key = std::tuple(limb.kind, side, limb.firstTurn, band(share, level.sizeBase),
                                    band(limb.height, level.heightBase));
        const auto [entry, isNew] = numbers.try_emplace(key, static_cast<std::uint32_t>(classes.kin.size()));
        if (isNew)
        {
            classes.kin.emplace_back();
            classes.occurrences.push_back(0);
        }
        classes.classOf.push_back(entry->second);
        classes.kin[entry->second].push_back(i);
        classes.occurrences[entry->second] += limb.count;
    }
    return classes;
}

std::span<const LimbUse> loadOf(const LimbTable& limbs, std::uint32_t limb)
{
    // The next limb's children follow; behind the last there are none.
    const std::size_t first = limbs.limbs[limb].firstChild;
    const std::size_t end = limb + 1 < limbs.limbs.size() ? limbs.limbs[limb + 1].firstChild : limbs.children.size();
    return std::span(limbs.children).subspan(first, end - first);
}

namespace {

/// Whether nothing ever hangs at any of these limbs.
bool isBare(const LimbTable& limbs, const std::vector<std::uint32_t>& kin)
{
    return std::ranges::all_of(kin, [&](std::uint32_t limb) {
        return std::ranges::all_of(loadOf(limbs, limb), [](const LimbUse& use) { return use.limb == kNoInstance; });
    });
}

} // namespace

double bitsOf(double choices)
{
    return math::log(choices) / math::log(2);
}

DescriptionLength DescriptionLength::of(const LimbTable& limbs, const KinClasses& classes)
{
    std::vector<LimbDirection> directions;
    for (const auto* uses : {&limbs.roots, &limbs.children})
        for (const LimbUse& use : *uses)
            if (use.limb != kNoInstance && (directions.empty() || directions.back() != use.direction))
                directions.push_back(use.direction);
    std::ranges::sort(directions, [](const LimbDirection& a, const LimbDirection& b) { return a < b; });
    directions.erase(std::unique(directions.begin(), directions.end()), directions.end());
    DescriptionLength lengths;
    lengths.classes = bitsOf(static_cast<double>(classes.kin.size()));
    lengths.direction = bitsOf(static_cast<double>(directions.size()));
    return lengths;
}

double DescriptionLength::load(const LimbTable& limbs, const KinClasses& kinClasses, std::uint32_t limb) const
{
    double bits = 0;
    for (const LimbUse& use : loadOf(limbs, limb))
    {
        bits += open;
        if (use.limb != kNoInstance)
            bits +=
                classes + direction + bitsOf(static_cast<double>(kinClasses.kin[kinClasses.classOf[use.limb]].size()));
    }
    return bits;
}

double DescriptionLength::gainOfRun(const LimbTable& limbs, const KinClasses& kinClasses, std::uint32_t c,
                                    std::uint32_t first, std::uint32_t length) const
{
    const std::vector<std::uint32_t>& kin = kinClasses.kin[c];
    const double number = bitsOf(static_cast<double>(kin.size()));
    return (length - 1.0) * (classes + load(limbs, kinClasses, kin[first]) + number) - number;
}

void runAlikeLimbs(const LimbTable& limbs, KinClasses& classes)
{
    const DescriptionLength lengths = DescriptionLength::of(limbs, classes);
    const auto alikeBefore = [&](std::uint32_t a, std::uint32_t b) {
        if (limbs.limbs[a].count != limbs.limbs[b].count)
            return limbs.limbs[a].count < limbs.limbs[b].count;
        return std::ranges::lexicographical_compare(loadOf(limbs, a), loadOf(limbs, b));
    };
    classes.runs.assign(classes.kin.size(), {});
    for (std::uint32_t c = 0; c < classes.kin.size(); ++c)
    {
        std::vector<std::uint32_t>& kin = classes.kin[c];
        // A range of numbers takes a look at every rule of the class, which is quick only where they are few. Where
        // every limb is bent in its own way they are many, whatever runs there are.
        if (std::ranges::any_of(
                kin, [&](std::uint32_t limb) { return limbs.limbs[limb].piece != limbs.limbs[kin[0]].piece; }))
        {
            classes.runs[c].assign(kin.size(), 1);
            continue;
        }
        std::map<std::uint32_t, std::vector<std::uint32_t>, decltype(alikeBefore)> groups(alikeBefore);
        for (const std::uint32_t limb : kin)
            groups[limb].push_back(limb); // the key stays the first of its group
        std::vector<const std::vector<std::uint32_t>*> inOrder;
        for (const auto& [first, group] : groups)
            inOrder.push_back(&group);
        std::ranges::sort(inOrder, {}, [](const auto* group) { return group->front(); });
        kin.clear();
        for (const auto* group : inOrder)
            kin.insert(kin.end(), group->begin(), group->end());
        // Where occupants are exchanged, the rules of limbs that ever carry something name each limb's own.
        const bool exchanged = classes.level.anchors && !isBare(limbs, kin);
        std::uint32_t first = 0;
        for (const auto* group : inOrder)
        {
            const auto length = static_cast<std::uint32_t>(group->size());
            if (!exchanged && length > 1 && lengths.gainOfRun(limbs, classes, c, first, length) > 0)
                classes.runs[c].push_back(length);
            else
                classes.runs[c].insert(classes.runs[c].end(), length, 1);
            first += length;
        }
    }
}

} // namespace espalier
