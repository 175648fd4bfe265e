#pragma once

#include <Espalier/Core/Limits.h>
#include <Espalier/Grammar/GrammarProgram.h>
#include <cstdint>
#include <string>
#include <vector>

namespace espalier {

/// Something in a grammar that is allowed and hardly meant.
struct GrammarFinding
{
    enum class Kind : std::uint8_t
    {
        UnreachableSymbol, ///< No derivation of the axiom ever holds it, with this number of parameters.
        UselessProduction, ///< It can never be taken.
        UnmatchedModule,   ///< It has no production, and one of the same symbol with other parameters has.
        NoComment,         ///< What looks like a comment, and is symbols.
    };
    Kind kind = Kind::UselessProduction;
    TextPlace place;
    std::string what; ///< What and why, as a sentence without its full stop.

    friend bool operator==(const GrammarFinding& a, const GrammarFinding& b)
    {
        return a.kind == b.kind && a.what == b.what && a.place.line == b.place.line && a.place.column == b.place.column;
    }
};

/// How the length of words grows with the steps, in the long run.
enum class GrowthKind : std::uint8_t
{
    Bounded,     ///< It ends, or repeats itself.
    Polynomial,  ///< Like a power of the number of steps.
    Exponential, ///< By a constant factor a step.
};

/// What can be said of a grammar without deriving it.
struct GrammarInspection
{
    std::vector<GrammarFinding> findings; ///< In the order of the text.
    GrowthKind growth = GrowthKind::Bounded;
    double factor = 1; ///< Exponential: by which the length grows each step in the long run, averaged over 16 of them.
    double degree = 0; ///< Polynomial: the power.
    /// Growth is that of the expectation; without one, that of the upper bound.
    bool isBound = false;
    bool isGrowthKnown = true;   ///< Large grammars are not followed far enough to tell.
    std::uint32_t safeSteps = 0; ///< So many steps stay within limits.modules, interpreted or not, whatever chance
                                 ///< decides; at most 4096.
    bool isSafeBeyond = false;   ///< And perhaps more: no step that does not was found.
};

/// Linear in the grammar's size, up to some milliseconds for the growth.
[[nodiscard]] GrammarInspection inspect(const GrammarProgram& program, const Limits& limits = {});

} // namespace espalier
