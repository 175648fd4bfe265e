#include <Espalier/Grammar/Word.h>

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

bool isNamePart(char c)
{
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_';
}

} // namespace

std::string printWord(const GrammarProgram& program, const Word& word, bool arguments)
{
    const Grammar& grammar = program.grammar();
    std::string out;
    out.reserve(word.letters.size());
    const double* argument = word.arguments.data();
    for (const LetterId letter : word.letters)
    {
        const std::string& name = grammar.symbols.name(program.symbolOf(letter));
        // Declared symbols are matched longest first, so letters that stand together might read as one of them.
        if (!grammar.longSymbols.empty() && !out.empty() && isNamePart(out.back()) && isNamePart(name.front()))
            out += ' ';
        out += name;
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
