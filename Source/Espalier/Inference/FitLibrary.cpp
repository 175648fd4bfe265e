#include <Espalier/Inference/FitLibrary.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

namespace espalier {

namespace {

/// The median, shortened to six digits as scalings are, so that most of these are near 1; small enough for the
/// lengths of a word, and large enough for the scalings, to be within the limits of a file.
double unitOf(std::vector<double>& spans)
{
    if (spans.empty())
        return 1;
    std::ranges::sort(spans);
    return significant(std::min(std::max(spans[spans.size() / 2], spans.back() * 1e-4), 1e4), 6);
}

void addAnchors(std::uint32_t anchors, Template& piece)
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

std::string stemOf(Piece::Kind kind, std::uint32_t anchors)
{
    if (kind == Piece::Kind::Joint)
        return "joint" + std::to_string(anchors);
    return anchors == 0 ? "tip" : anchors == 1 ? "link" : "fork" + std::to_string(anchors);
}

} // namespace

FitLibrary::FitLibrary(const FitOutline& outline, const std::vector<Piece>& pieces) : outline_(outline)
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
        if (piece.kind == Piece::Kind::Joint)
            continue;
        const auto line = lineOf(outline.paths, piece);
        uses.spans.push_back(lengthOf(line.back() - line.front()));
    }
    std::map<std::uint32_t, double> usualSpans; // of bent pieces, by their number of anchors
    {
        std::map<std::uint32_t, std::vector<double>> spans;
        for (const auto& [key, uses] : kinds)
            if (static_cast<Piece::Kind>(key[0]) == Piece::Kind::Bent)
                spans[key[1]].insert(spans[key[1]].end(), uses.spans.begin(), uses.spans.end());
        for (auto& [anchors, values] : spans)
            usualSpans.emplace(anchors, unitOf(values));
    }
    std::map<std::string, std::uint32_t> named; // how many templates each kind has so far
    for (auto& [key, uses] : kinds)
    {
        const auto kind = static_cast<Piece::Kind>(key[0]);
        Template piece;
        piece.name = stemOf(kind, key[1]);
        Entry entry;
        entry.unit = unitOf(uses.spans);
        if (kind == Piece::Kind::Bent && entry.unit > usualSpans[key[1]])
            piece.name += "_long";
        if (kind != Piece::Kind::Joint)
            if (const std::uint32_t number = named[piece.name]++; number > 0)
                piece.name += "_bent" + std::to_string(number);
        entry.isShared = uses.pieces.size() > 1;
        if (kind == Piece::Kind::Straight)
            piece.modules.push_back({'F', entry.unit != 1, entry.unit == 1 ? 0 : entry.unit, kNoAnchor});
        else if (kind == Piece::Kind::Bent)
            piece.modules = {{'+', true, 90, kNoAnchor}, {'&', false, 0, kNoAnchor}, {'-', true, 90, kNoAnchor}};
        addAnchors(key[1], piece);
        for (const std::uint32_t use : uses.pieces)
            templateOf_[use] = static_cast<std::uint32_t>(library_.templates.size());
        library_.templates.push_back(std::move(piece));
        entries_.push_back(std::move(entry));
    }
}

DVec3 FitLibrary::firstStep(const Piece& piece) const
{
    const std::vector<DVec3> kept =
        keptPointsOf(outline_.paths, outline_.needed, outline_.stretches.all[piece.stretch]);
    return kept[1] - kept[0];
}

void FitLibrary::define(std::uint32_t index, const Piece& piece, const FitFrame& frame)
{
    Entry& entry = entries_[templateOf_[index]];
    const std::uint32_t stretch = entry.isShared ? outline_.clusters.leaders[piece.shape] : piece.stretch;
    const std::vector<DVec3> kept = keptPointsOf(outline_.paths, outline_.needed, outline_.stretches.all[stretch]);
    const BentShape bent = espalier::shapeOf(kept, entry.unit / lengthOf(kept.back() - kept.front()),
                                             entry.isShared ? alongFirstStep(kept) : frame);
    entry.shape = drawn(bent);
    std::vector<TemplateModule> steps;
    const auto turn = [&](char symbol, double degrees) { steps.push_back({symbol, true, degrees, kNoAnchor}); };
    for (const BentShape::Step& step : bent.steps)
    {
        if (step.roll != 0)
            turn(step.roll > 0 ? '/' : '\\', std::abs(step.roll));
        if (step.turn != 0)
            turn(step.turn > 0 ? '+' : '-', std::abs(step.turn));
        turn('F', step.length);
    }
    std::vector<TemplateModule>& word = library_.templates[templateOf_[index]].modules;
    constexpr std::ptrdiff_t kTwist = 3; // what the constructor has begun it with
    word.insert(word.begin() + kTwist, steps.begin(), steps.end());
}

} // namespace espalier
