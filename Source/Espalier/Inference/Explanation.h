#pragma once

#include <Espalier/Species/Species.h>
#include <cstdint>
#include <string>
#include <vector>

namespace espalier {

/// Why an inference of the preset kin found the rules it did: the levels of classes that were tried, and all that
/// became one, with what each saves. Gains are in bits of a description of the drawn trees in which every name, number,
/// direction and row takes the bits that tell it from all others of its kind (Rissanen, "Modeling by shortest data
/// description", 1978); what saves nothing has a negative one. Which limbs share a rule is decided by them; classes are
/// chosen for the trees that they grow, and may cost bits. Rules that exchange the occupants of anchors are not
/// counted.
struct Explanation
{
    /// A coarseness of the classes, with the weight that suits it best.
    struct Level
    {
        std::string name;
        double weight = 0;
        double difference = 0; ///< Between two trial trees, as a share of both; wanted is 0.3.
        double accepted = 0;   ///< Share of trial trees that fit the window.
        double equal = 0;      ///< Share of equal pairs of them.
        double score = 0;      ///< [0, 1]; the best is chosen.
        bool compared = false; ///< Its trees were held to the bars of `compare`: where it could still be the best.
        std::vector<std::string> missed; ///< Those that they do not hold.
        bool chosen = false;
    };

    enum class Kind : std::uint8_t
    {
        Equal, ///< One limb that was drawn several times.
        Alike, ///< Limbs that carry the same and share a rule.
        Class, ///< Limbs that may stand for each other.
    };

    struct Merge
    {
        Kind kind = Kind::Equal;
        std::string name; ///< Bough(3), Bough(3..7), Bough.
        double gain = 0;  ///< Bits.
        std::string reason;
        std::vector<DrawnNode> nodes; ///< Where they were drawn.
    };

    std::vector<Level> levels; ///< From the finest; empty if both weights were given.
    std::vector<Merge> merges; ///< By kind, then by gain, the largest first.
    double drawnBits = 0;      ///< Of the drawn trees, instance by instance.
    double ruleBits = 0;       ///< Of the rules. drawnBits less the gains.
};

/// For people: a table of the levels, and a line for each merge.
[[nodiscard]] std::string printExplanation(const Explanation& explanation);

} // namespace espalier
