#include <Espalier/Grammar/Word.h>

#include <Espalier/Grammar/SymbolWriter.h>
#include <array>
#include <charconv>

namespace espalier {

namespace {

/// As printf's %.6g, whatever the locale.
void appendNumber(std::string& out, double value)
{
    std::array<char, 32> buffer;
    const auto end =
        std::to_chars(buffer.data(), buffer.data() + buffer.size(), value, std::chars_format::general, 6).ptr;
    out.append(buffer.data(), end);
}

} // namespace

std::string printWord(const GrammarProgram& program, const Word& word, bool arguments)
{
    const Grammar& grammar = program.grammar();
    SymbolWriter writer(grammar.longSymbols);
    std::string out;
    out.reserve(word.letters.size());
    const double* argument = word.arguments.data();
    for (const LetterId letter : word.letters)
    {
        writer.write(out, grammar.symbols.name(program.symbolOf(letter)));
        const std::uint32_t arity = program.arityOf(letter);
        if (arity > 0 && arguments)
        {
            for (std::uint32_t a = 0; a < arity; ++a)
            {
                out += a == 0 ? '(' : ',';
                appendNumber(out, argument[a]);
            }
            out += ')';
        }
        argument += arity;
    }
    return out;
}

} // namespace espalier
