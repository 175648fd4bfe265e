#pragma once

#include <Espalier/Core/RawVector.h>
#include <Espalier/Grammar/GrammarProgram.h>
#include <string>

namespace espalier {

/// A word in structure-of-arrays form: the letters of its modules, and all their arguments behind each other. How many
/// arguments a letter has is known to the program that numbered it. A plain value.
struct Word
{
    RawVector<LetterId> letters;
    RawVector<double> arguments;

    void clear() noexcept
    {
        letters.clear();
        arguments.clear();
    }
    friend bool operator==(const Word&, const Word&) = default;
};

/// The word as text, `F(0.5)[+A(1,2)]`: numbers with 6 significant digits as printf's %g writes them, no blanks but
/// where joined symbols would read differently. With `arguments` false, symbols alone.
[[nodiscard]] std::string printWord(const GrammarProgram& program, const Word& word, bool arguments = true);

} // namespace espalier
