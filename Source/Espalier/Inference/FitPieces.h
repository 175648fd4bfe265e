#pragma once

#include <Espalier/Archetype/Archetype.h>
#include <Espalier/Inference/FitPaths.h>
#include <Espalier/Inference/FitShapes.h>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

namespace espalier {

/// A skeleton as fit sees it: paths, the points of them that count, and the shapes of what lies between.
struct FitOutline
{
    FitPaths paths;
    NeededPoints needed;
    Stretches stretches;
    ShapeClusters clusters;
};

/// What becomes an instance, and which kind of template draws it.
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
    std::uint32_t stretch = 0; ///< Bent: the one that it draws.
    std::uint32_t anchors = 0; ///< Of its template.
    std::uint32_t internode = kNoPath;
    std::uint32_t first = 0; ///< Points of the internode: it leads from this one
    std::uint32_t last = 0;  ///< to this one.
    std::uint32_t parent = kNoInstance;
    std::uint32_t anchor = 0;
    std::uint32_t firstSide = kNoInstance; ///< The piece at its anchor A.
    std::uint32_t tree = 0;
};

/// The letters of side anchors, in order, and that of the one which goes on.
inline constexpr std::string_view kSideLetters = "ABCDEHIJKLMNOPQRSTUVWXY"; // F and G draw
inline constexpr char kLastLetter = 'Z';
inline constexpr std::uint32_t kMostAnchors = static_cast<std::uint32_t>(kSideLetters.size()) + 1;

/// The points that a piece leads along. Not of a joint.
[[nodiscard]] std::span<const DVec3> lineOf(const FitPaths& paths, const Piece& piece);

/// Which templates there are: straight ones by their number of anchors, bent ones by shape and that number.
class TemplateChoice
{
public:
    /// At most `most` templates if it is given: then the straight ones, and bent ones of shapes that recur, as long as
    /// naming them is shorter than their pieces would be. Else all shapes, up to `limit` templates: those first that
    /// save the most pieces.
    TemplateChoice(const FitOutline& outline, std::optional<std::uint32_t> most, std::uint32_t limit);

    /// Anchors of the straight template for pieces that `children` start at the end of.
    [[nodiscard]] std::uint32_t straightFor(std::uint32_t children) const { return standIn_[capped(children)]; }
    /// Whether a template draws the whole of a bent stretch.
    [[nodiscard]] bool isBent(std::uint32_t stretch) const;
    /// Of what starts at the end of a stretch, as many as a template has anchors for.
    [[nodiscard]] std::uint32_t anchorsOf(std::uint32_t stretch) const;

private:
    using Bent = std::pair<std::uint32_t, std::uint32_t>; ///< Shape and number of anchors.

    [[nodiscard]] static std::uint32_t capped(std::uint32_t children) { return std::min(children, kMostAnchors); }
    void chooseStraight(std::uint32_t most);
    void chooseBent(bool recurringOnly, std::uint32_t most);

    const FitOutline& outline_;
    std::array<std::uint32_t, kMostAnchors + 1> standIn_{}; ///< Anchors of the template used for so many children.
    std::uint32_t straight_ = 0;
    std::map<Bent, std::size_t> bent_;
};

/// The pieces of all trees, depth first, the children of each in the order of its anchors.
[[nodiscard]] std::vector<Piece> layPieces(const FitOutline& outline, const TemplateChoice& choice);

} // namespace espalier
