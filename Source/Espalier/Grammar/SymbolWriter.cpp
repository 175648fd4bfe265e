#include <Espalier/Grammar/SymbolWriter.h>

#include <algorithm>

namespace espalier {

SymbolWriter::SymbolWriter(std::span<const std::string> longSymbols)
    : longSymbols_(longSymbols.begin(), longSymbols.end())
{
    std::ranges::sort(longSymbols_);
    for (const std::string_view symbol : longSymbols_)
    {
        longest_ = std::max(longest_, symbol.size());
        for (const char c : symbol.substr(1))
            continues_[static_cast<unsigned char>(c)] = true;
    }
}

void SymbolWriter::write(std::string& out, std::string_view symbol)
{
    if (out.size() != end_)
        starts_.clear();
    std::erase_if(starts_, [&](std::size_t start) { return out.size() - start >= longest_; });
    const std::string_view written = out;
    const bool isApart =
        !continues_[static_cast<unsigned char>(symbol[0])] ||
        std::ranges::none_of(starts_, [&](std::size_t start) { return mayReadOn(written.substr(start), symbol); });
    if (!isApart)
    {
        out += ' ';
        starts_.clear();
    }
    if (longest_ > 0)
        starts_.push_back(out.size());
    out += symbol;
    end_ = out.size();
}

bool SymbolWriter::mayReadOn(std::string_view begun, std::string_view next)
{
    joined_.assign(begun).append(next);
    const std::string_view joined = joined_;
    const auto longer = std::ranges::lower_bound(longSymbols_, joined);
    if (longer != longSymbols_.end() && longer->starts_with(joined))
        return true;
    for (std::size_t length = begun.size() + 1; length < joined.size(); ++length)
        if (std::ranges::binary_search(longSymbols_, joined.substr(0, length)))
            return true;
    return false;
}

} // namespace espalier
