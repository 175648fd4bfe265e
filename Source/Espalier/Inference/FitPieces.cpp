#include <Espalier/Inference/FitPieces.h>

#include <algorithm>

namespace espalier {

std::span<const DVec3> lineOf(const FitPaths& paths, const Piece& piece)
{
    return paths.pointsOf(paths.internodes[piece.internode]).subspan(piece.first, piece.last - piece.first + 1);
}

TemplateChoice::TemplateChoice(const FitOutline& outline, std::optional<std::uint32_t> most, std::uint32_t limit)
    : outline_(outline)
{
    chooseStraight(most.value_or(kMostAnchors + 1));
    chooseBent(most.has_value(), most.value_or(limit));
}

std::uint32_t TemplateChoice::anchorsOf(std::uint32_t stretch) const
{
    const std::uint32_t internode = outline_.stretches.all[stretch].internode;
    const bool isLast = stretch + 1 == outline_.stretches.firstOf[internode + 1];
    return isLast ? capped(outline_.paths.internodes[internode].childCount) : 1;
}

bool TemplateChoice::isBent(std::uint32_t stretch) const
{
    const std::uint32_t shape = outline_.clusters.shapeOf[stretch];
    return shape != kNoPath && bent_.contains({shape, anchorsOf(stretch)});
}

void TemplateChoice::chooseStraight(std::uint32_t most)
{
    std::array<std::size_t, kMostAnchors + 1> uses{};
    for (std::uint32_t i = 0; i < outline_.paths.internodes.size(); ++i)
    {
        ++uses[capped(outline_.paths.internodes[i].childCount)];
        uses[1] += outline_.needed[i].size() - 2;
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

void TemplateChoice::chooseBent(bool recurringOnly, std::uint32_t most)
{
    struct Gain
    {
        std::size_t uses = 0;
        std::size_t pieces = 0; ///< That are saved.
    };
    std::map<Bent, Gain> gains;
    const std::vector<Stretch>& stretches = outline_.stretches.all;
    for (std::uint32_t i = 0; i < stretches.size(); ++i)
    {
        const std::uint32_t shape = outline_.clusters.shapeOf[i];
        if (shape == kNoPath)
            continue;
        Gain& gain = gains[{shape, anchorsOf(i)}];
        ++gain.uses;
        gain.pieces += stretches[i].last - stretches[i].first - 1;
    }
    std::vector<std::pair<std::size_t, Bent>> ranked;
    for (const auto& [key, gain] : gains)
    {
        const Stretch& leader = stretches[outline_.clusters.leaders[key.first]];
        const std::size_t cost = recurringOnly ? leader.last - leader.first + 1 : 0;
        if (!recurringOnly || (gain.uses >= 2 && gain.pieces > cost))
            ranked.push_back({gain.pieces - cost, key});
    }
    std::ranges::stable_sort(ranked, std::ranges::greater{}, [](const auto& r) { return r.first; });
    for (std::size_t i = 0; i < ranked.size() && straight_ + i < most; ++i)
        bent_.emplace(ranked[i].second, ranked[i].first);
}

namespace {

class PieceLayout
{
public:
    PieceLayout(const FitOutline& outline, const TemplateChoice& choice)
        : outline_(outline), paths_(outline.paths), choice_(choice)
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
        const std::vector<std::uint32_t>& points = outline_.needed[index];
        Piece piece;
        piece.internode = index;
        const auto lead = [&](std::uint32_t first, std::uint32_t last) {
            piece.first = points[first];
            piece.last = points[last];
            parent = add(piece, parent, anchor);
            anchor = piece.anchors - 1;
        };
        for (std::uint32_t s = outline_.stretches.firstOf[index]; s < outline_.stretches.firstOf[index + 1]; ++s)
        {
            const Stretch& stretch = outline_.stretches.all[s];
            if (choice_.isBent(s))
            {
                piece.kind = Piece::Kind::Bent;
                piece.shape = outline_.clusters.shapeOf[s];
                piece.stretch = s;
                piece.anchors = choice_.anchorsOf(s);
                lead(stretch.first, stretch.last);
                continue;
            }
            piece.kind = Piece::Kind::Straight;
            piece.shape = 0;
            for (std::uint32_t i = stretch.first; i < stretch.last; ++i)
            {
                piece.anchors = choice_.straightFor(i + 2 == points.size() ? internode.childCount : 1);
                lead(i, i + 1);
            }
        }
        hang(parent, internode.firstChild, internode.childCount);
    }

    const FitOutline& outline_;
    const FitPaths& paths_;
    const TemplateChoice& choice_;
    std::vector<Branches> pending_;
    std::vector<Piece> pieces_;
    std::uint32_t tree_ = 0;
};

} // namespace

std::vector<Piece> layPieces(const FitOutline& outline, const TemplateChoice& choice)
{
    return PieceLayout(outline, choice).lay();
}

} // namespace espalier
