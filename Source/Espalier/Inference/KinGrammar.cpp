#include <Espalier/Inference/KinGrammar.h>

#include <Espalier/Inference/Draft.h>
#include <Espalier/Inference/GrammarWriter.h>
#include <Espalier/Inference/KinNames.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace espalier {

namespace {

/// The tables of transforms, one a template, each distinct transform once; and the row of each limb.
struct LimbTransforms
{
    std::vector<TransformTable> tables;
    std::vector<std::uint32_t> tableOf; ///< Of each template; kNoPiece if it does not occur.
    std::vector<std::uint32_t> rowOf;   ///< Of each limb.
};

LimbTransforms transformsOf(const LimbTable& limbs, const TemplateLibrary& library)
{
    LimbTransforms result;
    result.tableOf.assign(library.templates.size(), kNoPiece);
    std::vector<std::map<std::array<double, 4>, std::uint32_t>> known;
    for (const Limb& limb : limbs.limbs)
    {
        if (result.tableOf[limb.piece] == kNoPiece)
        {
            result.tableOf[limb.piece] = static_cast<std::uint32_t>(result.tables.size());
            result.tables.push_back({library.templates[limb.piece].name, {}});
            known.emplace_back();
        }
        const std::uint32_t table = result.tableOf[limb.piece];
        const std::array<double, 4> row{limb.transform.scaling, limb.transform.rotation, limb.transform.branchingAngle,
                                        limb.transform.roll};
        auto& rows = result.tables[table].rows;
        const auto [entry, isNew] = known[table].try_emplace(row, static_cast<std::uint32_t>(rows.size()));
        if (isNew)
            rows.push_back(row);
        result.rowOf.push_back(entry->second);
    }
    return result;
}

/// Smooths each table by a share of what it was seen to vary, so that two trees with the same branches still differ. At
/// weight 0 nothing moves; at 1 the share is a tenth, which leaves the distribution of each parameter recognisably the
/// drawn one.
void smoothTables(std::vector<TransformTable>& tables, double weight)
{
    constexpr double kShare = 0.1;
    constexpr double kMostScaling = 0.1;
    for (TransformTable& table : tables)
        for (std::size_t component = 0; component < 4; ++component)
        {
            double sum = 0;
            double squares = 0;
            for (const auto& row : table.rows)
            {
                sum += row[component];
                squares += row[component] * row[component];
            }
            const double count = static_cast<double>(table.rows.size());
            const double mean = sum / count;
            double spread = kShare * weight * std::sqrt(std::max(0.0, squares / count - mean * mean));
            if (component == 0)
                spread = std::min(kMostScaling, spread / mean);
            table.spread[component] = std::round(spread * 1e4) / 1e4;
        }
}

/// Writes the grammar of one choice of classes and weight.
class KinGrammarWriter
{
public:
    KinGrammarWriter(const TemplateLibrary& library, const LimbTable& limbs, const KinClasses& classes)
        : library_(library), limbs_(limbs), classes_(classes), transforms_(transformsOf(limbs, library)),
          grammar_(grammarFor(library)), indexInClass_(limbs.limbs.size())
    {
        smoothTables(transforms_.tables, classes.weight);
        for (const std::vector<std::uint32_t>& kin : classes.kin)
            for (std::uint32_t i = 0; i < kin.size(); ++i)
                indexInClass_[kin[i]] = i;
    }

    /// What each production stands for.
    std::vector<KinRule> write(Species& species)
    {
        std::vector<std::uint32_t> pieces;
        for (const std::vector<std::uint32_t>& kin : classes_.kin)
            pieces.push_back(limbs_.limbs[kin[0]].piece);
        KinNames names = kinNames(library_, pieces);
        start_ = std::move(names.start);
        names_ = std::move(names.classes);
        for (const std::string& name : names_)
            if (name.size() > 1)
                grammar_.longSymbols.push_back(name);
        weight_ = 0;
        grammar_.constants.push_back({"w", grammar_.expressions.number(classes_.weight)});
        axiom();
        for (std::uint32_t c = 0; c < classes_.kin.size(); ++c)
            classProductions(c);
        species.grammar = std::move(grammar_);
        species.tables = std::move(transforms_.tables);
        return std::move(rules_);
    }

private:
    [[nodiscard]] bool alone(std::uint32_t limb) const { return classes_.kin[classes_.classOf[limb]].size() == 1; }

    /// `C(i)`: limb i of class C or one of its kin; `C` where there is only one.
    Module moduleOf(std::uint32_t limb) { return indexed(names_[classes_.classOf[limb]], limb); }

    Module indexed(const std::string& name, std::uint32_t limb)
    {
        const SymbolId symbol = grammar_.symbols.intern(name);
        const auto first = static_cast<std::uint32_t>(grammar_.arguments.size());
        if (alone(limb))
            return {symbol, first, 0};
        grammar_.arguments.push_back(grammar_.expressions.number(indexInClass_[limb]));
        return {symbol, first, 1};
    }

    void axiom()
    {
        if (limbs_.roots.size() == 1)
        {
            grammar_.axiom.push_back(moduleOf(limbs_.roots[0]));
            return;
        }
        grammar_.longSymbols.push_back(start_);
        const SymbolId start = grammar_.symbols.intern(start_);
        grammar_.append(grammar_.axiom, start);
        for (const std::uint32_t root : limbs_.roots)
        {
            Production production;
            production.predecessor = start;
            production.successor.push_back(moduleOf(root));
            production.weight = grammar_.expressions.number(1);
            add(std::move(production), {root, KinRule::kStart});
        }
    }

    /// `(i == limb) * (1 - w) + w * count / occurrences`: the drawn limb, or with chance w any kin. None where it is
    /// alone.
    void weigh(Production& production, std::uint32_t limb)
    {
        if (alone(limb))
            return;
        production.parameters = {"i"};
        ExpressionPool& pool = grammar_.expressions;
        using enum ExpressionOp;
        const ExpressionId i = pool.reference(Parameter, 0);
        const ExpressionId index = pool.number(indexInClass_[limb]);
        const ExpressionId isDrawn = pool.binary(Equal, i, index);
        const ExpressionId one = pool.number(1);
        const ExpressionId stay = pool.binary(Subtract, one, pool.reference(Constant, weight_));
        const ExpressionId drawn = pool.binary(Multiply, isDrawn, stay);
        const ExpressionId w = pool.reference(Constant, weight_);
        const std::uint32_t count = limbs_.limbs[limb].count;
        const ExpressionId share = count == 1 ? w : pool.binary(Multiply, w, pool.number(count));
        const ExpressionId kin = pool.binary(Divide, share, pool.number(classes_.occurrences[classes_.classOf[limb]]));
        production.weight = pool.binary(Add, drawn, kin);
    }

    void classProductions(std::uint32_t c)
    {
        const std::vector<std::uint32_t>& kin = classes_.kin[c];
        const std::uint32_t piece = limbs_.limbs[kin[0]].piece;
        const Template& shape = library_.templates[piece];
        const bool exchangesAnchors = classes_.level.anchors && kin.size() > 1;
        for (const std::uint32_t limb : kin)
        {
            std::vector<Module> children;
            for (std::uint32_t a = 0; a < shape.anchors.size(); ++a)
            {
                const std::uint32_t child = occupant(limb, a);
                if (exchangesAnchors && everOccupied(kin, a))
                    children.push_back(indexed(anchorName(c, a), limb));
                else
                    children.push_back(child == kNoInstance ? Module{kOpenAnchor, 0, 0} : moduleOf(child));
            }
            Production production =
                placingProduction(grammar_, grammar_.symbols.intern(names_[c]), shape,
                                  transformUse(transforms_.tables[transforms_.tableOf[piece]]), children);
            weigh(production, limb);
            production.row = grammar_.expressions.number(transforms_.rowOf[limb]);
            add(std::move(production), {limb, KinRule::kWhole});
        }
        for (std::uint32_t a = 0; exchangesAnchors && a < shape.anchors.size(); ++a)
            if (everOccupied(kin, a))
                anchorProductions(c, a);
    }

    /// What hangs at one anchor of the limbs of a class: the drawn occupant, or with chance w that of a kin; open
    /// anchors too.
    void anchorProductions(std::uint32_t c, std::uint32_t anchor)
    {
        grammar_.longSymbols.push_back(anchorName(c, anchor));
        for (const std::uint32_t limb : classes_.kin[c])
        {
            Production production;
            production.predecessor = grammar_.symbols.intern(anchorName(c, anchor));
            if (const std::uint32_t child = occupant(limb, anchor); child != kNoInstance)
                production.successor.push_back(moduleOf(child));
            weigh(production, limb);
            add(std::move(production), {limb, anchor});
        }
    }

    [[nodiscard]] std::uint32_t occupant(std::uint32_t limb, std::uint32_t anchor) const
    {
        return limbs_.children[limbs_.limbs[limb].firstChild + anchor];
    }
    [[nodiscard]] bool everOccupied(const std::vector<std::uint32_t>& kin, std::uint32_t anchor) const
    {
        return std::ranges::any_of(kin, [&](std::uint32_t limb) { return occupant(limb, anchor) != kNoInstance; });
    }
    [[nodiscard]] std::string anchorName(std::uint32_t c, std::uint32_t anchor) const
    {
        return occupantName(names_[c], library_.templates[limbs_.limbs[classes_.kin[c][0]].piece].anchors[anchor]);
    }
    void add(Production production, KinRule rule)
    {
        grammar_.productions.push_back(std::move(production));
        rules_.push_back(rule);
    }

    const TemplateLibrary& library_;
    const LimbTable& limbs_;
    const KinClasses& classes_;
    LimbTransforms transforms_;
    Grammar grammar_;
    std::vector<std::uint32_t> indexInClass_; ///< Of each limb.
    std::vector<std::string> names_;          ///< Of each class.
    std::string start_;
    std::vector<KinRule> rules_; ///< Of each production.
    std::uint32_t weight_ = 0;   ///< Index of the constant w.
};

} // namespace

std::vector<KinRule> writeKinGrammar(const TemplateLibrary& library, const LimbTable& limbs, const KinClasses& classes,
                                     Species& species)
{
    return KinGrammarWriter(library, limbs, classes).write(species);
}

} // namespace espalier
