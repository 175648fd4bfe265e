#pragma once

#include <Espalier/Core/Error.h>
#include <Espalier/Core/Limits.h>
#include <Espalier/Grammar/GrammarProgram.h>
#include <cstdint>
#include <vector>

namespace espalier {

/// How many modules a word will have. Counts beyond 2^53 are rounded, beyond the largest double infinite.
struct WordForecast
{
    double least = 0;
    double most = 0;
    double expected = 0; ///< Over all seeds; NaN where a choice depends on parameters, neighbours or the step.
};

/// What a derivation will cost, found without deriving: with M(l, m) the number of letters m that a step makes of a
/// letter l, the counts after a step are those before times M (the growth matrix of a D0L system; Rozenberg & Salomaa,
/// The Mathematical Theory of L Systems, 1980). Where several rules may apply, bounds come from the fewest and the
/// most that any of them leads to, and the expectation from their weights.
struct Forecast
{
    bool isExact = false;            ///< least == most == expected: one rule a letter at most, no context.
    bool hasExpectation = false;     ///< `expected` are numbers.
    bool isComplete = false;         ///< All steps asked for were worked out.
    std::vector<WordForecast> steps; ///< Of the axiom and after each step, as far as it was worked out.
    std::vector<WordForecast> drawn; ///< Likewise, with `interpret:` applied.
    std::vector<double> letters;     ///< Expected number of each letter in the last of them; empty without expectation.
};

/// The forecast of so many steps; it ends early at the first step whose least size exceeds `mostModules`, and after
/// so many steps that working it out would take longer than some milliseconds.
[[nodiscard]] Forecast forecast(const GrammarProgram& program, std::uint32_t steps, double mostModules);

/// Refuses what is certain to become too large: Limit at the axiom, naming the step and the size. Takes well below ten
/// milliseconds for any grammar of reasonable size, whatever the number of steps.
[[nodiscard]] Expected<void> checkPrice(const GrammarProgram& program, std::uint32_t steps, const Limits& limits);

} // namespace espalier
