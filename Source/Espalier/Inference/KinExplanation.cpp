#include <Espalier/Inference/InferenceContext.h>
#include <Espalier/Inference/KinGrammar.h>
#include <Espalier/Inference/KinNames.h>

#include <Espalier/Core/Json.h>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <tuple>

namespace espalier {

namespace {

/// `0.5 to 1.5`, or the one value.
std::string range(double low, double high)
{
    const auto text = [](double value) { return formatNumber(std::round(value * 1e4) / 1e4); };
    return low == high ? text(low) : text(low) + " to " + text(high);
}

/// Finds the merges of a finished choice of classes.
class KinExplainer
{
public:
    explicit KinExplainer(const InferenceContext& context)
        : limbs_(context.limbs), classes_(context.classes), library_(context.exemplars.library),
          lengths_(DescriptionLength::of(limbs_, classes_)), nodesOf_(limbs_.limbs.size())
    {
        std::vector<std::uint32_t> pieces;
        for (const std::vector<std::uint32_t>& kin : classes_.kin)
            pieces.push_back(limbs_.limbs[kin[0]].kind);
        names_ = kinNames(library_, pieces).classes;
        mentions_.resize(classes_.kin.size());
        for (const LimbUse& use : limbs_.children)
            if (use.limb != kNoInstance)
                ++mentions_[classes_.classOf[use.limb]];
        const std::vector<DrawnNode> nodes = drawnNodesOf(context.exemplars);
        for (std::size_t i = 0; i < limbs_.drawnInstances; ++i)
            nodesOf_[limbs_.limbOf[i]].push_back(nodes[i]);
    }

    void explain(Explanation& explanation) const
    {
        for (std::uint32_t c = 0; c < classes_.kin.size(); ++c)
        {
            forEachRun(classes_, c, [&](std::uint32_t first, std::uint32_t length) {
                for (std::uint32_t i = first; i < first + length; ++i)
                    equalLimbs(c, i, explanation);
                if (length > 1)
                    alikeLimbs(c, first, length, explanation);
            });
            wholeClass(c, explanation);
        }
        std::ranges::stable_sort(explanation.merges, [](const auto& a, const auto& b) {
            return std::tuple(a.kind, -a.gain) < std::tuple(b.kind, -b.gain);
        });
        for (std::uint32_t limb = 0; limb < limbs_.limbs.size(); ++limb)
            explanation.drawnBits += limbs_.limbs[limb].drawn * ownBits(limb);
        explanation.ruleBits = explanation.drawnBits;
        for (const Explanation::Merge& merge : explanation.merges)
            explanation.ruleBits -= merge.gain;
    }

private:
    /// Of one limb by itself, told from all others without classes.
    [[nodiscard]] double ownBits(std::uint32_t limb) const
    {
        const double name = bitsOf(static_cast<double>(limbs_.limbs.size()));
        double bits = name;
        for (const LimbUse& use : loadOf(limbs_, limb))
            bits += lengths_.open + (use.limb == kNoInstance ? 0 : name + lengths_.direction);
        return bits;
    }

    void equalLimbs(std::uint32_t c, std::uint32_t number, Explanation& explanation) const
    {
        const std::uint32_t limb = classes_.kin[c][number];
        const std::uint32_t times = limbs_.limbs[limb].drawn;
        if (times < 2)
            return;
        explanation.merges.push_back({Explanation::Kind::Equal, numbered(c, number, 1), (times - 1) * ownBits(limb),
                                      "drawn " + counted(times, "time") + ", with all it carries equal to the bit",
                                      nodesOf_[limb]});
    }

    void alikeLimbs(std::uint32_t c, std::uint32_t first, std::uint32_t length, Explanation& explanation) const
    {
        const auto kin = std::span(classes_.kin[c]).subspan(first, length);
        const auto spread = [&](double Limb::*part) {
            const auto [low, high] =
                std::ranges::minmax(kin, {}, [&](std::uint32_t limb) { return limbs_.limbs[limb].*part; });
            return range(limbs_.limbs[low].*part, limbs_.limbs[high].*part);
        };
        const auto loaded =
            std::ranges::count_if(loadOf(limbs_, kin[0]), [](const LimbUse& use) { return use.limb != kNoInstance; });
        explanation.merges.push_back(
            {Explanation::Kind::Alike, numbered(c, first, length),
             lengths_.gainOfRun(limbs_, classes_, c, first, length),
             std::to_string(length) + " limbs that carry " +
                 (loaded == 0 ? std::string("nothing")
                              : "the same " + counted(static_cast<std::size_t>(loaded), "limb")) +
                 " share a rule: scaling " + spread(&Limb::scaling) + ", branching angle " +
                 spread(&Limb::branchingAngle),
             nodesOf(kin)});
    }

    /// Of the names of its limbs, which now begin with that of their class.
    void wholeClass(std::uint32_t c, Explanation& explanation) const
    {
        const std::vector<std::uint32_t>& kin = classes_.kin[c];
        const auto size = static_cast<double>(kin.size());
        const double mentions = size + mentions_[c]; // at the head of their own rules too
        const double saved = bitsOf(static_cast<double>(limbs_.limbs.size())) - lengths_.classes - bitsOf(size);
        double choice = 0;
        std::size_t drawn = 0;
        for (const std::uint32_t limb : kin)
        {
            drawn += limbs_.limbs[limb].drawn;
            const double share = static_cast<double>(limbs_.limbs[limb].count) / classes_.occurrences[c];
            choice += share * bitsOf(1 / share);
        }
        const auto [small, large] =
            std::ranges::minmax(kin, {}, [&](std::uint32_t limb) { return limbs_.limbs[limb].segments; });
        const auto [low, high] =
            std::ranges::minmax(kin, {}, [&](std::uint32_t limb) { return limbs_.limbs[limb].height; });
        explanation.merges.push_back(
            {Explanation::Kind::Class, names_[c], mentions * saved,
             counted(kin.size(), "limb") + " of the template " + library_.templates[limbs_.limbs[kin[0]].kind].name +
                 ", " + range(limbs_.limbs[small].segments, limbs_.limbs[large].segments) + " segments large, " +
                 range(limbs_.limbs[low].height, limbs_.limbs[high].height) + " instances high, " +
                 (drawn == 0 ? "mirror images" : "drawn " + counted(drawn, "time")) +
                 (kin.size() == 1 ? std::string(": nothing else is of its kind")
                                  : ": where one was drawn, any may grow with chance " + formatNumber(classes_.weight) +
                                        ", a choice of " + formatNumber(std::round(choice * 100) / 100) + " bits"),
             nodesOf(kin)});
    }

    [[nodiscard]] std::vector<DrawnNode> nodesOf(std::span<const std::uint32_t> kin) const
    {
        std::vector<DrawnNode> nodes;
        for (const std::uint32_t limb : kin)
            nodes.insert(nodes.end(), nodesOf_[limb].begin(), nodesOf_[limb].end());
        std::ranges::sort(nodes, {}, [](const DrawnNode& node) { return std::pair(node.tree, node.node); });
        return nodes;
    }

    [[nodiscard]] std::string numbered(std::uint32_t c, std::uint32_t first, std::uint32_t length) const
    {
        if (classes_.kin[c].size() == 1)
            return names_[c];
        return names_[c] + '(' + std::to_string(first) + (length > 1 ? ".." + std::to_string(first + length - 1) : "") +
               ')';
    }

    const LimbTable& limbs_;
    const KinClasses& classes_;
    const TemplateLibrary& library_;
    DescriptionLength lengths_;
    std::vector<std::vector<DrawnNode>> nodesOf_; ///< Of each limb.
    std::vector<std::string> names_;              ///< Of each class.
    std::vector<double> mentions_;                ///< Likewise: places where its limbs hang.
};

std::string fixed(double value, int digits)
{
    char text[64];
    std::snprintf(text, sizeof text, "%.*f", digits, value);
    const bool isZero = std::string_view(text).find_first_not_of("-0.") == std::string_view::npos;
    return text[0] == '-' && isZero ? text + 1 : text;
}

/// Padded in front.
std::string right(std::string text, std::size_t width)
{
    return text.size() < width ? std::string(width - text.size(), ' ') + text : text;
}

std::string left(std::string text, std::size_t width)
{
    text.resize(std::max(width, text.size()), ' ');
    return text;
}

void printLevels(std::string& out, const std::vector<Explanation::Level>& levels)
{
    std::size_t width = 0;
    for (const Explanation::Level& level : levels)
        width = std::max(width, level.name.size());
    out += "Of trial trees: w, how often kin stand for each other; how far two differ (0.3 is wanted); how many are of "
           "a fitting "
           "size;\nhow many pairs are equal; the score, of which the first to reach 1 is chosen, else the best.\n";
    out += left("classes tried, from the finest", width) + "     w  differ     fit    equal  score\n";
    for (const Explanation::Level& level : levels)
    {
        out += left(level.name, width) + right(fixed(level.weight, 2), 6) + right(fixed(level.difference, 3), 8) +
               right(fixed(100 * level.accepted, 0) + " %", 8) + right(fixed(100 * level.equal, 3) + " %", 9) +
               right(fixed(level.score, 2), 7) + (level.chosen ? "  chosen" : "");
        if (!level.compared)
            out += "  not compared";
        for (std::size_t i = 0; i < level.missed.size(); ++i)
            out += (i == 0 ? "  misses: " : "; ") + level.missed[i];
        out += '\n';
    }
    out += '\n';
}

} // namespace

Explanation explainKin(const InferenceContext& context)
{
    Explanation explanation;
    explanation.levels = context.levels;
    KinExplainer(context).explain(explanation);
    return explanation;
}

std::string printExplanation(const Explanation& explanation)
{
    std::string out;
    if (!explanation.levels.empty())
        printLevels(out, explanation.levels);
    std::size_t width = 4;
    for (const Explanation::Merge& merge : explanation.merges)
        width = std::max(width, merge.name.size());
    out += "What becomes one by being equal or alike shortens the description; a class is the price of relatives.\n";
    out += "gain, bits  " + left("what", width) + "  why\n";
    constexpr std::size_t kMostNodes = 8;
    for (const Explanation::Merge& merge : explanation.merges)
    {
        out += right(fixed(merge.gain, 1), 10) + "  " + left(merge.name, width) + "  " + merge.reason + ';';
        for (std::size_t i = 0; i < std::min(merge.nodes.size(), kMostNodes); ++i)
            out += ' ' + std::to_string(merge.nodes[i].tree) + ':' + std::to_string(merge.nodes[i].node);
        out += merge.nodes.size() > kMostNodes ? " ...\n" : "\n";
    }
    out += right(fixed(explanation.drawnBits - explanation.ruleBits, 1), 10) +
           "  together: " + fixed(explanation.drawnBits, 0) + " bits as drawn, " + fixed(explanation.ruleBits, 0) +
           " as rules\n";
    return out;
}

} // namespace espalier
