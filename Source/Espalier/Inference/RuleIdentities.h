#pragma once

#include <Espalier/Inference/RuleMatch.h>
#include <Espalier/Species/Species.h>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

// What the rules and limbs of a grammar that was inferred before are called in one that is inferred anew.

namespace espalier {

/// A part of an edit that cannot be carried, and why. Thrown and caught inside the merge of edits.
struct Uncarried
{
    std::string reason;
};

/// What the parameters of a class of limbs mean, as kin calls them: a limb's number, and the direction of its place.
/// What others call otherwise is none of these.
struct ClassLayout
{
    bool index = false;
    bool turn = false;
    bool roll = false;

    /// None of them where they stand in another order, or among others: then they are somebody's own.
    [[nodiscard]] static ClassLayout of(const std::vector<std::string>& parameters);
    [[nodiscard]] std::vector<std::string> names() const;
    [[nodiscard]] std::uint32_t size() const { return std::uint32_t{index} + turn + roll; }

    /// Where a parameter of this layout stands in `other`; none: it is missing there.
    [[nodiscard]] std::optional<std::uint32_t> positionIn(const ClassLayout& other, std::uint32_t parameter) const;

    friend bool operator==(const ClassLayout&, const ClassLayout&) = default;
};

/// A limb of a class: the rule that it has, alone or with others, and its number in the class.
struct RuleLimb
{
    std::uint32_t rule = 0;
    std::uint32_t number = 0;
    std::uint64_t identity = 0; ///< Meaningless where origins are unknown.
    bool alone = true;          ///< It shares the rule with no other.
};

/// Rules and limbs of a former grammar and of a new one that stand for the same: by their identities and places
/// (RuleOrigin), or, where these are unknown, by what the rules say.
class RuleIdentities
{
public:
    /// `base` is the grammar as it was inferred for `before`, `theirs` that of `inferred`.
    RuleIdentities(const Grammar& base, const Species& before, const Grammar& theirs, const Species& inferred);

    [[nodiscard]] bool wasClass(const std::string& symbol) const { return former_.contains(symbol); }
    [[nodiscard]] bool isClass(const std::string& symbol) const { return newClasses_.contains(symbol); }
    /// Of a former class.
    [[nodiscard]] const ClassLayout& formerLayout(const std::string& symbol) const { return layoutOf_.at(symbol); }
    /// Of a former rule; kNoRule: it is gone.
    [[nodiscard]] std::uint32_t newOf(std::uint32_t rule) const { return newOf_[rule]; }

    /// What a limb is called now: `index` counts where there is only one too.
    struct NewModule
    {
        std::string symbol;
        std::uint32_t index = 0;
        ClassLayout layout;
    };
    /// Throws Uncarried if the limb is gone.
    [[nodiscard]] const NewModule& moduleOf(const std::string& symbol, std::uint32_t index) const;

    /// The class into which all that is left of a former class has gone; `sameNumbers` demands that its limbs kept
    /// theirs. Throws Uncarried if there is none.
    [[nodiscard]] NewModule classOf(const std::string& symbol, bool sameNumbers) const;

    /// The rules that the limbs of a former rule have now, in order; `newOf` among them, unless that is none.
    [[nodiscard]] std::set<std::uint32_t> rulesNow(const std::string& symbol, std::uint32_t rule) const;

private:
    [[nodiscard]] std::optional<std::size_t> find(const RuleLimb& limb) const;
    void matchFormer(const Grammar& base, const std::vector<RuleOrigin>& former, const Grammar& theirs,
                     const std::vector<RuleOrigin>& now, bool known);

    std::vector<std::uint32_t> newOf_; ///< Of each former rule.
    std::map<std::string, std::vector<RuleLimb>> former_;
    std::map<std::string, ClassLayout> layoutOf_;               ///< Of each former class.
    std::vector<std::pair<NewModule, std::uint32_t>> newLimbs_; ///< With their rules.
    std::vector<std::size_t> firstOf_;                          ///< Of each new rule, into `newLimbs_`.
    std::multimap<std::uint64_t, std::size_t> byIdentity_;
    std::set<std::string> newClasses_;
};

} // namespace espalier
