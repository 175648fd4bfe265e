#pragma once

#include <Espalier/Core/Error.h>
#include <Espalier/Species/Grow.h>
#include <Espalier/Species/Species.h>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

// What people change in an inferred grammar, and how it survives inferring again. An edit is whatever tells the grammar
// of a species from the one that was inferred (Species::inferred), so nothing has to be kept in step.

namespace espalier {

/// How the grammar of a species differs from the one that was inferred.
struct EditSummary
{
    std::uint32_t kept = 0;    ///< Rules as inferred.
    std::uint32_t weights = 0; ///< Rules of which the weight or the condition alone was changed.
    std::uint32_t changed = 0; ///< Rules that were changed otherwise.
    std::uint32_t added = 0;   ///< `interpret:` included.
    std::uint32_t removed = 0;
    std::uint32_t settings = 0; ///< Constants, the axiom and other settings that differ.
    std::uint32_t locked = 0;

    [[nodiscard]] std::uint32_t edits() const noexcept { return weights + changed + added + removed + settings; }
};

[[nodiscard]] EditSummary summarizeEdits(const Species& species);

/// True if inferring anew would lose something that people did: edits, locks, or conflicts not yet settled.
[[nodiscard]] bool hasEdits(const Species& species);

/// False if somebody edited the grammar in the species' file itself: what was inferred is then unknown, and so are the
/// edits.
[[nodiscard]] bool knowsInferred(const Species& species);

/// True if somebody edited the pipes, which say how thick wood is, in the species' file; likewise its tables or window.
[[nodiscard]] bool hasEditedPipes(const Species& species);
[[nodiscard]] bool hasEditedTables(const Species& species);

/// What is allowed in an edited grammar and hardly meant, a sentence each: symbols that nothing rewrites and nothing
/// draws, modules with other numbers of parameters than their rules, limbs that are not there. Of what was inferred
/// nothing is said.
[[nodiscard]] std::vector<std::string> doubtsOf(const Species& species);

/// Puts an edited grammar in the place of the species' own. Tables, and the origins of the rules that it keeps, stay;
/// edits add up, relative to what was inferred, and the inferred text set again removes them all. A lock on a rule that
/// is no more goes with it. A species that nobody inferred simply gets the grammar.
void setGrammar(Species& species, Grammar edited);

/// Locks rules, or unlocks them: all of a symbol (`Bough`), one limb's (`Bough(3)`), or the one in a line of
/// printWithOrigins (`17`). A locked rule is not inferred again. Returns how many rules that names. Fails with BadInput
/// where there is no such rule, or none that was inferred.
[[nodiscard]] Expected<std::uint32_t> lockRules(Species& species, std::string_view which, bool locked);

/// The text of the grammar for people: how to read it, and at the end of each rule how often and where it was drawn,
/// and whether it is edited or locked. All that is comment; parseGrammar gives the species' grammar back.
[[nodiscard]] std::string printWithOrigins(const Species& species);

/// What became of the edits and locks of a species that was inferred again.
struct CarriedEdits
{
    std::uint32_t edits = 0; ///< Of the new species, as summarizeEdits counts them.
    std::uint32_t locks = 0;
    std::vector<EditConflict> conflicts; ///< New ones; the new species holds them behind those of `before`.
};

/// Merges the edits and locks of `before` into `inferred`, which was inferred anew and has none of its own: from the
/// same drawing or a changed one, with the same options or others. A rule is known again by its limb, then by its
/// place, whatever its number; a changed weight is carried as the factor by which it was changed; other changes are
/// carried if inference did not change the same thing, and if what they name is still there. All else becomes a
/// conflict: the rule is then as inferred. Both species must come from the same preset for
/// this to make sense. What comes out grows its seed 1 within `trial`, or all edits are conflicts. Bark and palette,
/// which nobody infers, are those of `before`, and so are pipes that somebody edited; tables and window are the new
/// ones.
[[nodiscard]] CarriedEdits carryEdits(const Species& before, Species& inferred, const GrowOptions& trial = {});

} // namespace espalier
