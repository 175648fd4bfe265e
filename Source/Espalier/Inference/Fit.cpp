#include <Espalier/Inference/Fit.h>

#include <Espalier/Archetype/Placement.h>
#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Core/Json.h>
#include <Espalier/Inference/FitPaths.h>
#include <Espalier/Inference/FitShapes.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

namespace espalier {

namespace {

// Parts of the tolerance, which add up to less than all of it.
constexpr double kPointsShare = 0.4; ///< What points may be left out for.
constexpr double kShapeShare = 0.6;  ///< How far a shared shape may lie from an internode, its own points included.
constexpr double kDriftShare = 0.25; ///< How far the end of a piece may lie from where it belongs.

constexpr std::string_view kSideLetters = "ABCDEHIJKLMNOPQRSTUVWXY"; ///< F and G draw.
constexpr char kLastLetter = 'Z';
constexpr std::uint32_t kMostAnchors = static_cast<std::uint32_t>(kSideLetters.size()) + 1;

/// Below this a piece goes straight on and its roll is free. Degrees.
constexpr double kStraight = 0.02;

double decimals(double value, double perUnit)
{
    return std::floor(value * perUnit + 0.5) / perUnit + 0.0; // + 0: no -0
}

/// What a piece is drawn with: a kind of template.
struct Piece
{
    enum class Kind : std::uint8_t
    {
        Straight,
        Bent,
        Joint, ///< Without length: several branches at a base, or more than there are letters.
    };
    Kind kind = Kind::Straight;
    std::uint32_t shape = 0;   ///< Bent: which.
    std::uint32_t anchors = 0; ///< Of its template.
    std::uint32_t internode = kNoPath;
    std::uint32_t first = 0; ///< Points of the internode: it leads from this one
    std::uint32_t last = 0;  ///< to this one.
    std::uint32_t parent = kNoInstance;
    std::uint32_t anchor = 0;
    std::uint32_t firstSide = kNoInstance; ///< The piece at its anchor A.
    std::uint32_t tree = 0;
};

/// Which templates there are: straight ones by their number of anchors, bent ones by shape and that number.
class TemplateChoice
{
public:
    TemplateChoice(const FitPaths& paths, const std::vector<std::vector<std::uint32_t>>& needed,
                   const ShapeClusters& clusters, std::uint32_t most)
        : paths_(paths), needed_(needed), clusters_(clusters)
    {
        chooseStraight(most);
        chooseBent(most);
    }

    /// Anchors of the straight template for pieces that `children` start at the end of.
    [[nodiscard]] std::uint32_t straightFor(std::uint32_t children) const { return standIn_[capped(children)]; }
    [[nodiscard]] bool isBent(std::uint32_t internode) const
    {
        const std::uint32_t shape = clusters_.shapeOf[internode];
        return shape != kNoPath && bent_.contains({shape, capped(paths_.internodes[internode].childCount)});
    }
    [[nodiscard]] static std::uint32_t capped(std::uint32_t children) { return std::min(children, kMostAnchors); }

private:
    void chooseStraight(std::uint32_t most)
    {
        std::array<std::size_t, kMostAnchors + 1> uses{};
        for (std::uint32_t i = 0; i < paths_.internodes.size(); ++i)
        {
            ++uses[capped(paths_.internodes[i].childCount)];
            uses[1] += needed_[i].size() - 2;
        }
        std::uint32_t distinct = 0;
        for (std::uint32_t k = 0; k <= kMostAnchors; ++k)
            if (uses[k] > 0)
            {
                standIn_[k] = k;
                ++distinct;
            }
        // The rarest number of anchors gives way to the next larger, whose anchor too many stays open.
        for (; distinct > most; --distinct)
        {
            std::uint32_t rarest = kNoPath;
            std::uint32_t next = kNoPath;
            std::uint32_t larger = kNoPath;
            for (std::uint32_t k = kMostAnchors + 1; k-- > 0;)
            {
                if (standIn_[k] != k || uses[k] == 0)
                    continue;
                if (larger != kNoPath && (rarest == kNoPath || uses[k] <= uses[rarest]))
                {
                    rarest = k;
                    next = larger;
                }
                larger = k;
            }
            uses[next] += uses[rarest];
            uses[rarest] = 0;
            for (std::uint32_t& k : standIn_)
                if (k == rarest)
                    k = next;
        }
        straight_ = distinct;
    }

    /// Shapes that recur, as long as naming them is shorter than their pieces would be.
    void chooseBent(std::uint32_t most)
    {
        struct Gain
        {
            std::size_t uses = 0;
            std::size_t pieces = 0; ///< That are saved.
        };
        std::map<std::pair<std::uint32_t, std::uint32_t>, Gain> gains; // by shape and number of anchors
        for (std::uint32_t i = 0; i < paths_.internodes.size(); ++i)
        {
            const std::uint32_t shape = clusters_.shapeOf[i];
            if (shape == kNoPath)
                continue;
            Gain& gain = gains[{shape, capped(paths_.internodes[i].childCount)}];
            ++gain.uses;
            gain.pieces += needed_[i].size() - 2;
        }
        std::vector<std::pair<std::size_t, std::pair<std::uint32_t, std::uint32_t>>> ranked;
        for (const auto& [key, gain] : gains)
        {
            const std::size_t cost = needed_[clusters_.leaders[key.first]].size();
            if (gain.uses >= 2 && gain.pieces > cost)
                ranked.push_back({gain.pieces - cost, key});
        }
        std::ranges::stable_sort(ranked, std::ranges::greater{}, [](const auto& r) { return r.first; });
        for (std::size_t i = 0; i < ranked.size() && straight_ + i < most; ++i)
            bent_.emplace(ranked[i].second, ranked[i].first);
    }

    const FitPaths& paths_;
    const std::vector<std::vector<std::uint32_t>>& needed_;
    const ShapeClusters& clusters_;
    std::array<std::uint32_t, kMostAnchors + 1> standIn_{}; ///< Anchors of the template used for so many children.
    std::uint32_t straight_ = 0;
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::size_t> bent_;
};

/// Lays out the pieces of all trees, depth first, the children of each in the order of its anchors.
class PieceLayout
{
public:
    PieceLayout(const FitPaths& paths, const std::vector<std::vector<std::uint32_t>>& needed,
                const ShapeClusters& clusters, const TemplateChoice& choice)
        : paths_(paths), needed_(needed), clusters_(clusters), choice_(choice)
    {}

    std::vector<Piece> lay()
    {
        for (std::uint32_t tree = 0; tree < paths_.trees.size(); ++tree)
        {
            tree_ = tree;
            const FitTree& t = paths_.trees[tree];
            pending_.push_back({t.firstChild, t.childCount, kNoInstance, 0});
            while (!pending_.empty())
            {
                const Branches next = pending_.back();
                pending_.pop_back();
                if (next.count == 1)
                    internode(paths_.children[next.first], next.parent, next.anchor);
                else
                    joint(next);
            }
        }
        return std::move(pieces_);
    }

private:
    /// Some children of one branch point, to hang at one anchor: one, or several on a joint.
    struct Branches
    {
        std::uint32_t first; ///< In FitPaths::children.
        std::uint32_t count;
        std::uint32_t parent;
        std::uint32_t anchor;
    };

    std::uint32_t add(Piece piece, std::uint32_t parent, std::uint32_t anchor)
    {
        const auto index = static_cast<std::uint32_t>(pieces_.size());
        piece.parent = parent;
        piece.anchor = anchor;
        piece.tree = tree_;
        if (parent != kNoInstance && anchor == 0 && pieces_[parent].anchors > 1)
            pieces_[parent].firstSide = index;
        pieces_.push_back(piece);
        return index;
    }

    void joint(const Branches& branches)
    {
        Piece piece;
        piece.kind = Piece::Kind::Joint;
        // More than there are letters go on joints of their own, as full as they can be, so that brackets do not nest
        // deeply.
        std::uint32_t share = 1;
        while (std::uint64_t{share} * kMostAnchors < branches.count)
            share *= kMostAnchors;
        piece.anchors = (branches.count + share - 1) / share;
        const std::uint32_t index = add(piece, branches.parent, branches.anchor);
        if (share == 1)
            return hang(index, branches.first, branches.count);
        for (std::uint32_t i = piece.anchors; i-- > 0;)
            pending_.push_back({branches.first + i * share, std::min(share, branches.count - i * share), index, i});
    }

    /// The child that continues at the last anchor, the others from A on. Where there are more than letters, the last
    /// side anchor has a joint with those that are left.
    void hang(std::uint32_t parent, std::uint32_t first, std::uint32_t count)
    {
        if (count == 0)
            return;
        const std::uint32_t last = pieces_[parent].anchors - 1;
        pending_.push_back({first, 1, parent, last});
        const std::uint32_t sides = count - 1;
        const std::uint32_t whole = sides <= last ? sides : last - 1;
        if (whole < sides)
            pending_.push_back({first + 1 + whole, sides - whole, parent, last - 1});
        for (std::uint32_t i = whole; i-- > 0;)
            pending_.push_back({first + 1 + i, 1, parent, i});
    }

    void internode(std::uint32_t index, std::uint32_t parent, std::uint32_t anchor)
    {
        const Internode& internode = paths_.internodes[index];
        const std::vector<std::uint32_t>& points = needed_[index];
        Piece piece;
        piece.internode = index;
        if (choice_.isBent(index))
        {
            piece.kind = Piece::Kind::Bent;
            piece.shape = clusters_.shapeOf[index];
            piece.anchors = TemplateChoice::capped(internode.childCount);
            piece.last = points.back();
            parent = add(piece, parent, anchor);
        }
        else
        {
            for (std::size_t i = 1; i < points.size(); ++i)
            {
                const bool isLast = i + 1 == points.size();
                piece.anchors = choice_.straightFor(isLast ? internode.childCount : 1);
                piece.first = points[i - 1];
                piece.last = points[i];
                parent = add(piece, parent, anchor);
                anchor = piece.anchors - 1;
            }
        }
        hang(parent, internode.firstChild, internode.childCount);
    }

    const FitPaths& paths_;
    const std::vector<std::vector<std::uint32_t>>& needed_;
    const ShapeClusters& clusters_;
    const TemplateChoice& choice_;
    std::vector<Branches> pending_;
    std::vector<Piece> pieces_;
    std::uint32_t tree_ = 0;
};

/// The templates of all pieces, and how each draws.
class Library
{
public:
    Library(const FitPaths& paths, const std::vector<std::vector<std::uint32_t>>& needed, const ShapeClusters& clusters,
            const std::vector<Piece>& pieces)
    {
        struct Uses
        {
            std::vector<double> spans; ///< Metres from start to end.
            std::vector<std::uint32_t> pieces;
        };
        std::map<std::array<std::uint32_t, 3>, Uses> kinds; // kind, anchors, shape: joints last, simple ones first
        templateOf_.resize(pieces.size());
        for (std::uint32_t i = 0; i < pieces.size(); ++i)
        {
            const Piece& piece = pieces[i];
            Uses& uses = kinds[{static_cast<std::uint32_t>(piece.kind), piece.anchors, piece.shape}];
            uses.pieces.push_back(i);
            if (piece.kind != Piece::Kind::Joint)
            {
                const auto line = paths.pointsOf(paths.internodes[piece.internode]);
                uses.spans.push_back(lengthOf(line[piece.last] - line[piece.first]));
            }
        }
        std::map<std::uint32_t, std::uint32_t> bentOf; // numbers of bent templates by anchors
        for (auto& [key, uses] : kinds)
        {
            const auto kind = static_cast<Piece::Kind>(key[0]);
            Entry entry;
            Template piece;
            piece.name = nameOf(kind, key[1], bentOf);
            const double unit = unitOf(uses.spans);
            if (kind == Piece::Kind::Straight)
            {
                entry.span = unit;
                piece.modules.push_back({'F', unit != 1, unit == 1 ? 0 : unit, kNoAnchor});
            }
            else if (kind == Piece::Kind::Bent)
                bentWord(paths, needed, clusters.leaders[key[2]], unit, piece, entry);
            addAnchors(key[1], piece);
            for (const std::uint32_t use : uses.pieces)
                templateOf_[use] = static_cast<std::uint32_t>(library_.templates.size());
            library_.templates.push_back(std::move(piece));
            entries_.push_back(std::move(entry));
        }
    }

    [[nodiscard]] const TemplateLibrary& library() const { return library_; }
    [[nodiscard]] std::uint32_t templateOf(std::uint32_t piece) const { return templateOf_[piece]; }
    /// Of a straight template: its length, metres, at scaling 1.
    [[nodiscard]] double spanOf(std::uint32_t piece) const { return entries_[templateOf_[piece]].span; }
    /// Of a bent template, at scaling 1.
    [[nodiscard]] const DrawnShape& shapeOf(std::uint32_t piece) const { return entries_[templateOf_[piece]].shape; }

private:
    struct Entry
    {
        double span = 0;
        DrawnShape shape;
    };

    static std::string nameOf(Piece::Kind kind, std::uint32_t anchors, std::map<std::uint32_t, std::uint32_t>& bentOf)
    {
        if (kind == Piece::Kind::Joint)
            return "joint" + std::to_string(anchors);
        const std::string name = anchors == 0 ? "tip" : anchors == 1 ? "link" : "fork" + std::to_string(anchors);
        return kind == Piece::Kind::Straight ? name : name + "_bent" + std::to_string(++bentOf[anchors]);
    }

    /// The median, shortened to six digits as scalings are, so that most of these are near 1; small enough for the
    /// lengths of a word, and large enough for the scalings, to be within the limits of a file.
    static double unitOf(std::vector<double>& spans)
    {
        if (spans.empty())
            return 1;
        std::ranges::sort(spans);
        return significant(std::min(std::max(spans[spans.size() / 2], spans.back() * 1e-4), 1e4), 6);
    }

    static void bentWord(const FitPaths& paths, const std::vector<std::vector<std::uint32_t>>& needed,
                         std::uint32_t leader, double unit, Template& piece, Entry& entry)
    {
        const auto line = paths.pointsOf(paths.internodes[leader]);
        std::vector<DVec3> kept;
        for (const std::uint32_t point : needed[leader])
            kept.push_back(line[point]);
        const BentShape shape = espalier::shapeOf(kept, unit / lengthOf(line.back() - line.front()));
        entry.shape = drawn(shape);
        const auto turn = [&](char symbol, double degrees) {
            piece.modules.push_back({symbol, true, degrees, kNoAnchor});
        };
        turn('+', 0);                                        // the rotation
        piece.modules.push_back({'&', false, 0, kNoAnchor}); // the branching angle
        for (const BentShape::Step& step : shape.steps)
        {
            if (step.roll != 0)
                turn(step.roll > 0 ? '/' : '\\', std::abs(step.roll));
            if (step.turn != 0)
                turn(step.turn > 0 ? '+' : '-', std::abs(step.turn));
            turn('F', step.length);
        }
    }

    static void addAnchors(std::uint32_t anchors, Template& piece)
    {
        for (std::uint32_t i = 0; i < anchors; ++i)
        {
            const bool isLast = i + 1 == anchors;
            const char letter = isLast ? kLastLetter : kSideLetters[i];
            if (!isLast)
                piece.modules.push_back({'[', false, 0, kNoAnchor});
            piece.modules.push_back({letter, false, 0, i});
            if (!isLast)
                piece.modules.push_back({']', false, 0, kNoAnchor});
            piece.anchors += letter;
        }
    }

    TemplateLibrary library_;
    std::vector<Entry> entries_;
    std::vector<std::uint32_t> templateOf_;
};

/// Values that differ in their last digits only, brought together: equal branches shall get equal numbers.
class Snapper
{
public:
    /// Neighbours up to `gap` apart belong together, relative to the value if `isRelative`.
    Snapper(double gap, bool isRelative) : gap_(gap), isRelative_(isRelative) {}

    void add(double value) { values_.push_back(value); }

    void finish()
    {
        // Longer chains of neighbours are not one value with noise, but many: they are left as they are.
        constexpr double kMostWidth = 5;
        std::ranges::sort(values_);
        for (std::size_t i = 0; i < values_.size();)
        {
            const double gap = gap_ * unit(values_[i]);
            std::size_t end = i + 1;
            while (end < values_.size() && values_[end] - values_[end - 1] <= gap)
                ++end;
            if (values_[end - 1] - values_[i] <= kMostWidth * gap)
                groups_.push_back(
                    {values_[i], values_[end - 1], simplest(values_[i], values_[i + (end - i) / 2], values_[end - 1])});
            i = end;
        }
        values_.clear();
    }

    [[nodiscard]] double operator()(double value) const
    {
        const double margin = 0.5 * gap_ * unit(value);
        auto group = std::ranges::lower_bound(groups_, value - margin, {}, &Group::high);
        if (group != groups_.end() && group->low <= value + margin)
            return group->value;
        return shortened(value);
    }

private:
    struct Group
    {
        double low, high, value;
    };
    [[nodiscard]] double unit(double value) const { return isRelative_ ? std::abs(value) : 1.0; }
    /// Near `middle`, with as few digits as there are numbers of between `low` and `high`.
    [[nodiscard]] double simplest(double low, double middle, double high) const
    {
        const double slack = isRelative_ ? 1e-7 * middle : 1e-5;
        for (int digits = 0; digits < kDigits; ++digits)
        {
            const double value = rounded(middle, digits);
            if (value >= low - slack && value <= high + slack)
                return value;
        }
        return shortened(middle);
    }
    /// To ten-thousandths of a degree, or six digits.
    [[nodiscard]] double shortened(double value) const { return rounded(value, kDigits); }
    [[nodiscard]] double rounded(double value, int digits) const
    {
        constexpr std::array<double, kDigits + 1> kPowers = {1, 10, 100, 1000, 10000};
        return isRelative_ ? significant(value, digits + 2)
                           : decimals(value, kPowers[static_cast<std::size_t>(digits)]);
    }

    static constexpr int kDigits = 4;
    double gap_;
    bool isRelative_;
    std::vector<double> values_;
    std::vector<Group> groups_;
};

/// Finds the transform of every piece.
class Placer
{
public:
    Placer(const FitPaths& paths, const std::vector<Piece>& pieces, const Library& library, double size, double drift)
        : paths_(paths), pieces_(pieces), library_(library), drift_(drift), placed_(pieces.size()),
          planes_(paths.trees.size()), noise_(noiseOf(size)),
          angles_(std::clamp(2 * degreesOf(noise_), 0.002, 0.02), false),
          scalings_(std::clamp(noise_, 1e-5, 1e-3), true)
    {
        for (std::uint32_t tree = 0; tree < paths.trees.size(); ++tree)
            planes_[tree] = planeRoll(tree);
    }

    std::vector<InstanceTransform> place()
    {
        for (std::uint32_t i = 0; i < pieces_.size(); ++i)
            observe(i);
        angles_.finish();
        scalings_.finish();
        std::vector<InstanceTransform> transforms(pieces_.size());
        for (std::uint32_t i = 0; i < pieces_.size(); ++i)
            transforms[i] = decide(i);
        return transforms;
    }

private:
    /// Where the turtle is after a piece.
    struct Placed
    {
        FitFrame ideal; ///< Without rounding.
        FitFrame frame; ///< As it will be drawn.
        DVec3 position{0};
    };

    [[nodiscard]] DVec3 origin(const Piece& piece) const { return paths_.trees[piece.tree].origin; }
    [[nodiscard]] std::span<const DVec3> lineOf(const Piece& piece) const
    {
        return paths_.pointsOf(paths_.internodes[piece.internode]).subspan(piece.first, piece.last - piece.first + 1);
    }
    [[nodiscard]] Placed startOf(const Piece& piece) const
    {
        if (piece.parent != kNoInstance)
            return placed_[piece.parent];
        return {{}, {}, origin(piece)};
    }

    /// Pass one: what numbers there would be.
    void observe(std::uint32_t index)
    {
        const Piece& piece = pieces_[index];
        const Placed start = startOf(piece);
        Placed& end = placed_[index];
        end = start;
        const InstanceTransform transform = idealTransform(index, start.ideal);
        end.ideal = draw(index, transform, start.ideal, DVec3(0)).ideal;
        if (piece.kind == Piece::Kind::Joint)
            return;
        angles_.add(transform.roll);
        angles_.add(transform.rotation);
        if (piece.kind == Piece::Kind::Bent)
            angles_.add(transform.branchingAngle);
        scalings_.add(transform.scaling);
    }

    /// Pass two: the drawing, with rounded numbers as long as it stays near.
    InstanceTransform decide(std::uint32_t index)
    {
        const Piece& piece = pieces_[index];
        const Placed start = startOf(piece);
        InstanceTransform transform = idealTransform(index, start.ideal);
        const FitFrame ideal = draw(index, transform, start.ideal, DVec3(0)).ideal;
        transform.roll = snapped(transform.roll);
        transform.rotation = snapped(transform.rotation);
        if (piece.kind == Piece::Kind::Bent)
            transform.branchingAngle = snapped(transform.branchingAngle);
        transform.scaling = piece.kind == Piece::Kind::Joint ? 1 : scalings_(transform.scaling);
        Placed end = draw(index, transform, start.frame, start.position);
        end.ideal = ideal;
        if (piece.kind == Piece::Kind::Joint || isNear(piece, end, ideal))
        {
            placed_[index] = end;
            return transform;
        }
        // From where the drawing has come to, back to the skeleton.
        const InstanceTransform exact = transformTowards(index, start);
        transform = {significant(exact.scaling, 8), decimals(exact.rotation, 1e5),
                     piece.kind == Piece::Kind::Bent ? decimals(exact.branchingAngle, 1e5) : exact.branchingAngle,
                     decimals(exact.roll, 1e5)};
        end = draw(index, transform, start.frame, start.position);
        if (lengthOf(end.position - lineOf(piece).back()) > 0.25 * drift_)
        {
            transform = exact;
            end = draw(index, transform, start.frame, start.position);
        }
        end.ideal = end.frame; // its children go on from here, so that they can be equal to each other again
        placed_[index] = end;
        return transform;
    }

    /// Whether the drawing may go on like this: a long piece corrects it early, for a short one would turn aside.
    [[nodiscard]] bool isNear(const Piece& piece, const Placed& end, const FitFrame& ideal) const
    {
        const std::span<const DVec3> line = lineOf(piece);
        const double span = lengthOf(line.back() - line.front());
        double off = lengthOf(end.position - line.back());
        if (piece.kind == Piece::Kind::Bent)
            off += span * lengthOf(end.frame.left - ideal.left);
        return off <= 0.25 * drift_ || (off <= drift_ && span < 20 * off);
    }

    [[nodiscard]] double snapped(double degrees) const
    {
        const double value = angles_(degrees);
        return value <= -180 + 1e-9 ? value + 360 : value;
    }

    [[nodiscard]] InstanceTransform idealTransform(std::uint32_t index, const FitFrame& frame) const
    {
        const Piece& piece = pieces_[index];
        if (piece.kind == Piece::Kind::Joint)
        {
            InstanceTransform transform;
            if (piece.parent == kNoInstance)
                transform.roll = planes_[piece.tree].value_or(0);
            return transform;
        }
        const std::span<const DVec3> line = lineOf(piece);
        if (piece.kind == Piece::Kind::Bent)
            return bentTransform(index, frame, line.front());
        return straightTransform(index, frame, line.back() - line.front());
    }

    [[nodiscard]] InstanceTransform transformTowards(std::uint32_t index, const Placed& start) const
    {
        const Piece& piece = pieces_[index];
        if (piece.kind == Piece::Kind::Bent)
            return bentTransform(index, start.frame, start.position);
        return straightTransform(index, start.frame, lineOf(piece).back() - start.position);
    }

    [[nodiscard]] InstanceTransform straightTransform(std::uint32_t index, const FitFrame& from,
                                                      const DVec3& step) const
    {
        const Piece& piece = pieces_[index];
        InstanceTransform transform;
        transform.scaling = std::max(lengthOf(step), 1e-6 * drift_) / library_.spanOf(index);
        const std::optional<double>& plane = planes_[piece.tree];
        FitFrame frame = from;
        const double before = piece.parent == kNoInstance ? plane.value_or(0) : 0;
        frame.rollRight(before);
        transform.roll = before;
        const double h = glm::dot(step, frame.heading);
        const double l = glm::dot(step, frame.left);
        const double u = glm::dot(step, frame.up);
        if (plane)
        {
            transform.rotation = degreesOf(math::atan2(l, h));
            return transform;
        }
        const double aside = std::sqrt(l * l + u * u);
        transform.rotation = degreesOf(math::atan2(aside, h));
        const bool isStraight = std::min(transform.rotation, 180 - transform.rotation) < kStraight;
        if (!isStraight || aside > 0.25 * drift_)
            transform.roll = degreesOf(math::atan2(u, l));
        else
        {
            transform.rotation = transform.rotation < 90 ? 0 : 180;
            transform.roll = transform.rotation == 0 ? rollOfFirstSide(piece, frame) : 0;
        }
        return transform;
    }

    /// The roll that brings the first side branch to the left.
    [[nodiscard]] double rollOfFirstSide(const Piece& piece, const FitFrame& frame) const
    {
        if (piece.firstSide == kNoInstance || pieces_[piece.firstSide].kind == Piece::Kind::Joint)
            return 0;
        const std::span<const DVec3> line = lineOf(pieces_[piece.firstSide]);
        const DVec3 step = line.back() - line.front();
        const double l = glm::dot(step, frame.left);
        const double u = glm::dot(step, frame.up);
        const double aside = degreesOf(math::atan2(std::sqrt(l * l + u * u), std::abs(glm::dot(step, frame.heading))));
        return aside < kStraight ? 0 : degreesOf(math::atan2(u, l));
    }

    /// From `start` to where the piece ends, turned about the way between as fits best.
    [[nodiscard]] InstanceTransform bentTransform(std::uint32_t index, const FitFrame& from, const DVec3& start) const
    {
        const std::span<const DVec3> line = lineOf(pieces_[index]);
        std::vector<DVec3> moved(line.begin(), line.end());
        moved.front() = start;
        const ShapePlacement placement = placeAlong(moved, library_.shapeOf(index));
        InstanceTransform transform;
        transform.scaling = placement.scaling;
        // frame = from, rolled, turned left, pitched down; so its left lies where roll and turn have brought it.
        const DVec3& left = placement.frame.left;
        const double h = glm::dot(left, from.heading);
        const double l = glm::dot(left, from.left);
        const double u = glm::dot(left, from.up);
        const double across = std::sqrt(l * l + u * u);
        transform.roll = across > 1e-9 ? degreesOf(math::atan2(u, l)) : 0;
        transform.rotation = degreesOf(math::atan2(-h, across));
        FitFrame frame = from;
        frame.rollRight(transform.roll);
        frame.turnLeft(transform.rotation);
        transform.branchingAngle = degreesOf(math::atan2(-glm::dot(placement.frame.heading, frame.up),
                                                         glm::dot(placement.frame.heading, frame.heading)));
        return transform;
    }

    /// What the turtle does.
    [[nodiscard]] Placed draw(std::uint32_t index, const InstanceTransform& transform, const FitFrame& from,
                              const DVec3& start) const
    {
        const Piece& piece = pieces_[index];
        FitFrame frame = from;
        frame.rollRight(transform.roll);
        frame.turnLeft(transform.rotation);
        DVec3 position = start;
        if (piece.kind == Piece::Kind::Straight)
            position += frame.heading * (library_.spanOf(index) * transform.scaling);
        else if (piece.kind == Piece::Kind::Bent)
        {
            frame.pitchDown(transform.branchingAngle);
            const DrawnShape& shape = library_.shapeOf(index);
            const auto turned = [&](const DVec3& v) { return frame.heading * v.x + frame.left * v.y + frame.up * v.z; };
            position += turned(shape.points.back()) * transform.scaling;
            frame = {turned(shape.end.heading), turned(shape.end.left), turned(shape.end.up)};
        }
        return {frame, frame, position};
    }

    /// How much the last bits of coordinates in a plant of `size` change the directions of its short pieces: radians.
    [[nodiscard]] double noiseOf(double size) const
    {
        std::vector<double> spans;
        for (const Piece& piece : pieces_)
        {
            if (piece.kind == Piece::Kind::Joint)
                continue;
            const std::span<const DVec3> line = lineOf(piece);
            spans.push_back(lengthOf(line.back() - line.front()));
        }
        const auto decile = spans.begin() + static_cast<std::ptrdiff_t>(spans.size() / 10);
        std::nth_element(spans.begin(), decile, spans.end());
        constexpr double kLastBits = 4 * 0x1p-23;
        return kLastBits * size / *decile;
    }

    /// If a tree lies in an upright plane, the roll at its base that turns left into the plane.
    [[nodiscard]] std::optional<double> planeRoll(std::uint32_t tree) const;

    const FitPaths& paths_;
    const std::vector<Piece>& pieces_;
    const Library& library_;
    double drift_;
    std::vector<Placed> placed_;
    std::vector<std::optional<double>> planes_;
    double noise_;
    Snapper angles_;
    Snapper scalings_;
};

std::optional<double> Placer::planeRoll(std::uint32_t tree) const
{
    const DVec3& base = paths_.trees[tree].origin;
    const std::span<const DVec3> points = paths_.pointsOf(paths_.trees[tree]);
    DVec3 farthest(0);
    double most = 0;
    double size = 0;
    for (const DVec3& point : points)
    {
        const DVec3 p = point - base;
        size = std::max(size, glm::dot(p, p));
        const double square = p.x * p.x + p.z * p.z;
        if (square > most)
        {
            most = square;
            farthest = p;
        }
    }
    constexpr double kFlat = 1e-5; // of the size: the last bits of floats
    if (most <= kFlat * kFlat * size)
        return 0.0; // a pole
    const DVec3 normal = DVec3(farthest.z, 0, -farthest.x) / std::sqrt(most);
    const double thickness = std::min(kFlat * std::sqrt(size), 0.25 * drift_);
    const auto isInPlane = [&](const DVec3& p) { return std::abs(glm::dot(p - base, normal)) <= thickness; };
    if (!std::ranges::all_of(points, isInPlane))
        return {};
    // Left is -X, up +Z; of the two ways into the plane the one that takes the smaller roll.
    double roll = degreesOf(math::atan2(farthest.z, -farthest.x));
    roll = roll > 90 ? roll - 180 : roll <= -90 ? roll + 180 : roll;
    const double shortened = decimals(roll, 1e3);
    return std::abs(shortened - roll) * math::kRadiansPerDegree * std::sqrt(most) <= 0.25 * drift_ ? shortened : roll;
}

/// Draws the archetype and measures how far it is from the skeleton.
Expected<void> measureDistances(const FitPaths& paths, const std::vector<Piece>& pieces, const Archetype& archetype,
                                const Limits& limits, FitReport& report)
{
    Limits drawing = limits;
    drawing.nodes = std::max(limits.nodes, limits.inferredNodes);
    const ArchetypeDrawer drawer(archetype);
    Skeleton skeleton;
    double sum = 0;
    std::size_t count = 0;
    const auto compare = [&](double distance) {
        report.largestDistance = std::max(report.largestDistance, distance);
        sum += distance;
        ++count;
    };
    std::vector<DVec3> line;
    for (std::uint32_t tree = 0; tree < paths.trees.size(); ++tree)
    {
        if (auto done = drawer.draw(tree, drawing, skeleton); !done)
            return done;
        for (std::uint32_t i = 0; i < skeleton.size();)
        {
            const std::uint32_t instance = skeleton.instances[i];
            line.assign(1, DVec3(skeleton.starts[i]) + paths.trees[tree].origin);
            for (; i < skeleton.size() && skeleton.instances[i] == instance; ++i)
                line.push_back(DVec3(skeleton.ends[i]) + paths.trees[tree].origin);
            const Piece& piece = pieces[skeleton.instanceRecords[instance].row];
            const auto original =
                paths.pointsOf(paths.internodes[piece.internode]).subspan(piece.first, piece.last - piece.first + 1);
            compare(lengthOf(line.back() - original.back()));
            for (std::size_t p = 0; p + 1 < original.size(); ++p)
                compare(distanceTo(original[p], line));
            for (std::size_t p = 0; p + 1 < line.size(); ++p)
                compare(distanceTo(line[p], original));
        }
    }
    report.meanDistance = count > 0 ? sum / static_cast<double>(count) : 0;
    return {};
}

double sizeOf(const FitPaths& paths)
{
    double size = 0;
    for (const FitTree& tree : paths.trees)
    {
        DVec3 low = tree.origin;
        DVec3 high = low;
        for (const DVec3& p : paths.pointsOf(tree))
        {
            low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
            high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
        }
        size = std::max(size, lengthOf(high - low));
    }
    return size;
}

double usualTolerance(const FitPaths& paths, double size)
{
    double total = 0;
    for (const Internode& internode : paths.internodes)
        total += internode.length;
    const double internode = total / static_cast<double>(paths.internodes.size());
    const double segment = total / static_cast<double>(paths.segments);
    return significant(std::min({0.02 * internode, 0.5 * segment, 0.002 * size}), 3);
}

std::uint32_t depthOf(const Archetype& archetype)
{
    std::uint32_t most = 0;
    std::vector<std::uint32_t> depths;
    depths.reserve(archetype.instances.size());
    for (const TemplateInstance& instance : archetype.instances)
    {
        depths.push_back(instance.parent == kNoInstance ? 1 : depths[instance.parent] + 1);
        most = std::max(most, depths.back());
    }
    return most;
}

Expected<void> checkSettings(const Skeleton& skeleton, const FitSettings& settings, const Limits& limits)
{
    if (settings.tolerance && !(*settings.tolerance >= 0 && std::isfinite(*settings.tolerance)))
        return failure(ErrorKind::BadInput, {}, "the tolerance is no length", "a number of metres, 0 or more");
    if (settings.templates < 1 || settings.templates > 1024)
        return failure(ErrorKind::BadInput, {}, "templates is " + std::to_string(settings.templates),
                       "a number from 1 to 1024");
    if (!isSound(skeleton))
        return failure(ErrorKind::BadInput, {}, "the skeleton is not sound",
                       "finite numbers, and parents before their children");
    if (skeleton.size() > limits.inferredNodes)
        return failure(ErrorKind::Limit, {}, "the skeleton has " + std::to_string(skeleton.size()) + " segments",
                       "at most " + std::to_string(limits.inferredNodes) + " (the limit inferredNodes)");
    return {};
}

} // namespace

Expected<FittedArchetype> fitArchetype(const Skeleton& skeleton, const FitSettings& settings, const Limits& limits)
{
    if (auto done = checkSettings(skeleton, settings, limits); !done)
        return tl::make_unexpected(done.error());
    const FitPaths paths = pathsOf(skeleton);
    if (paths.internodes.empty())
        return failure(ErrorKind::BadInput, {}, "the skeleton has no segment with a length",
                       "at least two points in different places, one the parent of the other");
    FittedArchetype result;
    FitReport& report = result.report;
    report.size = sizeOf(paths);
    report.tolerance = settings.tolerance.value_or(usualTolerance(paths, report.size));

    std::vector<std::vector<std::uint32_t>> needed;
    needed.reserve(paths.internodes.size());
    for (const Internode& internode : paths.internodes)
        needed.push_back(neededPoints(paths.pointsOf(internode), kPointsShare * report.tolerance));
    const ShapeClusters clusters = clusterShapes(paths, needed, kShapeShare * report.tolerance);
    const TemplateChoice choice(paths, needed, clusters, settings.templates);
    const std::vector<Piece> pieces = PieceLayout(paths, needed, clusters, choice).lay();
    const Library library(paths, needed, clusters, pieces);
    constexpr double kLastBit = 0x1p-23; // of coordinates, over the size: nearer than that nothing is drawn
    const double drift = std::max(kDriftShare * report.tolerance, kLastBit * report.size);
    const std::vector<InstanceTransform> transforms = Placer(paths, pieces, library, report.size, drift).place();

    Archetype& archetype = result.archetype;
    archetype.libraryName = settings.libraryName;
    archetype.library = library.library();
    archetype.instances.reserve(pieces.size());
    for (std::uint32_t i = 0; i < pieces.size(); ++i)
        archetype.instances.push_back({library.templateOf(i), pieces[i].parent, pieces[i].anchor, transforms[i]});
    if (auto done = validate(archetype, limits); !done)
        return tl::make_unexpected(done.error());
    if (auto done = measureDistances(paths, pieces, archetype, limits, report); !done)
        return tl::make_unexpected(done.error());

    report.segments = paths.segments;
    report.internodes = static_cast<std::uint32_t>(paths.internodes.size());
    report.trees = static_cast<std::uint32_t>(paths.trees.size());
    report.templates = static_cast<std::uint32_t>(archetype.library.templates.size());
    report.instances = static_cast<std::uint32_t>(archetype.instances.size());
    report.depth = depthOf(archetype);
    return result;
}

} // namespace espalier
