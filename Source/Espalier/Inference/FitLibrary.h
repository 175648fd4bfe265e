#pragma once

#include <Espalier/Archetype/Template.h>
#include <Espalier/Inference/FitPieces.h>
#include <Espalier/Inference/FitShapes.h>
#include <cstdint>
#include <string>
#include <vector>

namespace espalier {

/// The templates of all pieces, and how each draws. A bent template is `+(90) & -(90)`, which turns it about the way it
/// starts by the branching angle, and then its steps. So rotation and roll say how it leaves what it hangs on, like
/// those of a straight one, and may belong to the place; how it is bent from there on belongs to the branch. (Were they
/// to say where it ends, crowns would be nearer to the drawn ones', but branches would leave at other angles.)
///
/// Bent pieces with the same anchors are one kind (kindsOf), or two: those longer than usual are `_long`. Of one kind
/// only, forks of two and tips, trees hardly differ.
class FitLibrary
{
public:
    FitLibrary(const FitOutline& outline, const std::vector<Piece>& pieces);

    [[nodiscard]] const TemplateLibrary& library() const { return library_; }
    [[nodiscard]] std::uint32_t templateOf(std::uint32_t piece) const { return templateOf_[piece]; }
    /// Of a straight template: its length, metres, at scaling 1.
    [[nodiscard]] double spanOf(std::uint32_t piece) const { return entries_[templateOf_[piece]].unit; }
    /// Of a bent template that is defined, at scaling 1.
    [[nodiscard]] const DrawnShape& shapeOf(std::uint32_t piece) const { return entries_[templateOf_[piece]].shape; }
    [[nodiscard]] bool isDefined(std::uint32_t piece) const
    {
        return !entries_[templateOf_[piece]].shape.points.empty();
    }
    /// Whether several pieces have this one's template.
    [[nodiscard]] bool isShared(std::uint32_t piece) const { return entries_[templateOf_[piece]].isShared; }

    /// The first step of a bent piece that is not shared: the way its template starts.
    [[nodiscard]] DVec3 firstStep(const Piece& piece) const;
    /// Gives the bent template of a piece its steps. Of one that is not shared they are drawn from `frame`, which looks
    /// along its first step: so it needs no branching angle of its own.
    void define(std::uint32_t index, const Piece& piece, const FitFrame& frame);

private:
    struct Entry
    {
        double unit = 1; ///< Metres from its start to its end, at scaling 1.
        bool isShared = false;
        DrawnShape shape;
    };

    const FitOutline& outline_;
    TemplateLibrary library_;
    std::vector<Entry> entries_;
    std::vector<std::uint32_t> templateOf_;
};

} // namespace espalier
