#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace espalier {

/// Writes symbols one after another, with a blank where they might read differently without: declared symbols are
/// matched longest first, so `T` and `r` are kept apart where a `Trunk` is declared. For one text, from its beginning.
class SymbolWriter
{
public:
    /// The symbols of more than one character, in any order.
    explicit SymbolWriter(std::span<const std::string> longSymbols);

    /// Appends `symbol` to `out`; what else was appended since the last one stands between them.
    void write(std::string& out, std::string_view symbol);

private:
    /// A declared symbol could begin with `begun` and go on with `next`.
    [[nodiscard]] bool mayReadOn(std::string_view begun, std::string_view next);

    std::vector<std::string_view> longSymbols_; ///< Sorted.
    std::array<bool, 256> continues_{};         ///< Bytes that one of them has after its first.
    std::size_t longest_ = 0;                   ///< Bytes.
    std::vector<std::size_t> starts_;           ///< Of the symbols at the end of `out` that nothing parts.
    std::size_t end_ = 0;                       ///< Of the last of them.
    std::string joined_;
};

} // namespace espalier
