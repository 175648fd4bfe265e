#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace espalier {

/// An interned symbol: comparing two modules compares two integers; the text survives for messages.
using SymbolId = std::uint32_t;

/// The symbols of one grammar, numbered in the order of their first mention.
class SymbolTable
{
public:
    /// The id of `name`, made if it is new.
    SymbolId intern(std::string_view name);
    /// The id of `name`, or size() if it is unknown.
    [[nodiscard]] SymbolId find(std::string_view name) const;
    /// Requires an id of this table.
    [[nodiscard]] const std::string& name(SymbolId id) const { return names_[id]; }
    [[nodiscard]] SymbolId size() const noexcept { return static_cast<SymbolId>(names_.size()); }

private:
    std::vector<std::string> names_;
    std::unordered_map<std::string, SymbolId> ids_; // looked up, never iterated
};

} // namespace espalier
