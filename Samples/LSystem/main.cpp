// From an L-system's text to its lines. Run it from the repository's root:
// Build/release/bin/espalier_lsystem [grammar.lsys]

#include <Espalier/Core/File.h>
#include <Espalier/Turtle/SegmentTurtle.h>
#include <algorithm>
#include <iostream>

using namespace espalier;

namespace {

template <class T>
T orExit(Expected<T> result)
{
    if (!result)
    {
        std::cerr << toString(result.error()) << '\n';
        std::exit(1);
    }
    if constexpr (!std::is_void_v<T>)
        return std::move(*result);
}

} // namespace

int main(int argc, char** argv)
{
    const std::string path = argc > 1 ? argv[1] : "Content/Grammars/FractalPlant.lsys";
    const Limits limits;

    // 1. Text, document, program. Keep the program: it is immutable, and any number of threads may derive it.
    const std::string text = orExit(readTextFile(path, limits.fileBytes));
    const Grammar grammar = orExit(parseGrammar(text, path, limits));
    const GrammarProgram program = orExit(GrammarProgram::make(grammar));
    const std::uint32_t steps = grammar.iterations.value_or(0);
    const RandomKey key = RandomKey(Seed{1}).child(0); // what `espalier derive --seed 1` starts from

    // 2. The word, in memory. Keep one scratch a thread.
    DerivationScratch scratch;
    Word word;
    orExit(deriveWord(program, key, steps, limits, scratch, word));
    std::cout << path << ": " << word.letters.size() << " modules after " << steps << " steps\n";

    // 3. Its lines, through a buffer of any size; where contexts do not forbid it, without that word.
    const TurtleAlphabet alphabet(program);
    TurtleScratch turtle;
    std::vector<TurtleSegment> buffer(4096);
    std::vector<TurtleSegment> lines;
    const std::size_t count = orExit(drawSegments(program, alphabet, key, steps, SegmentReuse::Never, limits, scratch,
                                                  turtle, buffer, [&](std::span<const TurtleSegment> full) {
                                                      lines.insert(lines.end(), full.begin(), full.end());
                                                      return true; // go on
                                                  }));
    std::cout << count << " segments\n";
    for (const TurtleSegment& line : std::span(lines).first(std::min<std::size_t>(lines.size(), 3)))
        std::cout << "  from " << line.start.x << ' ' << line.start.y << ' ' << line.start.z << " to " << line.end.x
                  << ' ' << line.end.y << ' ' << line.end.z << ", radius " << line.radius << '\n';
    return 0;
}
