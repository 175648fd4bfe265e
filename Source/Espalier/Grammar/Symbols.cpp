#include <Espalier/Grammar/Symbols.h>

namespace espalier {

SymbolId SymbolTable::intern(std::string_view name)
{
    const auto [entry, isNew] = ids_.try_emplace(std::string(name), size());
    if (isNew)
        names_.emplace_back(name);
    return entry->second;
}

SymbolId SymbolTable::find(std::string_view name) const
{
    const auto entry = ids_.find(std::string(name));
    return entry == ids_.end() ? size() : entry->second;
}

} // namespace espalier
