#include <Espalier/Inference/KinNames.h>

#include <Espalier/Inference/Draft.h>
#include <algorithm>
#include <unordered_set>

namespace espalier {

namespace {

/// F, G and f stay the turtle's even where the library does not use them: a class called F is a riddle.
constexpr std::string_view kTurtles = "FGf";
constexpr std::size_t kLongestName = 64; // beyond it a rule is no easier to read than with a letter

bool isCapital(char c)
{
    return c >= 'A' && c <= 'Z';
}
bool isDigit(char c)
{
    return c >= '0' && c <= '9';
}

/// `leaf_big` is Leaf_big. One that would read as an occupant, `leaf_X`, is LeafX.
std::string stemOf(std::string name)
{
    if (name[0] >= 'a' && name[0] <= 'z')
        name[0] = static_cast<char>(name[0] - 'a' + 'A');
    if (name.size() > 2 && name[name.size() - 2] == '_' && isCapital(name.back()))
        std::erase(name, '_');
    return name;
}

/// Counts on until a name is free. VII2 is the second VII; after a digit, as in Limb1n2, the number stands apart.
std::string numbered(const std::string& stem, std::uint32_t& number, std::unordered_set<std::string>& taken)
{
    const std::string start = stem + (isDigit(stem.back()) ? "n" : "");
    std::string name;
    do
        name = start + std::to_string(++number);
    while (!taken.insert(name).second);
    return name;
}

} // namespace

KinNames kinNames(const TemplateLibrary& library, const std::vector<std::uint32_t>& pieces)
{
    std::unordered_set<std::string> taken; // looked up, never iterated
    std::string letters = symbolsUsed(library) + std::string(kTurtles);
    for (const char letter : letters)
        taken.emplace(1, letter);

    // Every template's first name comes before any second: if there is a template bough2, the second Bough is Bough3.
    constexpr std::uint32_t kUnmet = 0;
    std::vector<std::uint32_t> met(library.templates.size(), kUnmet);
    std::vector<std::string> stems(library.templates.size());
    std::vector<std::uint32_t> nameless;
    std::vector<std::uint32_t> clashing;
    for (const std::uint32_t piece : pieces)
    {
        if (met[piece]++ != kUnmet)
            continue;
        stems[piece] = stemOf(library.templates[piece].name);
        const bool isTurtles = stems[piece].size() == 1 && taken.contains(stems[piece]);
        if (stems[piece].size() > kLongestName || isTurtles)
            nameless.push_back(piece);
        else if (!taken.insert(stems[piece]).second)
            clashing.push_back(piece);
        else if (stems[piece].size() == 1)
            letters += stems[piece];
    }
    std::vector<std::uint32_t> numbers(library.templates.size(), 1);
    for (const std::uint32_t piece : clashing) // `bough` and `Bough`
    {
        std::uint32_t number = 1;
        stems[piece] = numbered(stems[piece], number, taken);
    }
    // Letters in their order, without those that a template's own name has taken.
    const std::vector<std::string> spare = nonterminalNames(nameless.size() + 1 + taken.size(), letters);
    std::size_t next = 1;
    for (const std::uint32_t piece : nameless)
    {
        while (!taken.insert(spare[next]).second)
            ++next;
        stems[piece] = spare[next];
    }

    KinNames names;
    names.start = "Tree";
    if (std::uint32_t number = 1; !taken.insert(names.start).second)
        names.start = numbered(names.start, number, taken);
    std::fill(met.begin(), met.end(), kUnmet);
    for (const std::uint32_t piece : pieces)
        names.classes.push_back(met[piece]++ == kUnmet ? stems[piece] : numbered(stems[piece], numbers[piece], taken));
    return names;
}

std::string occupantName(const std::string& className, char anchor)
{
    return className + '_' + anchor;
}

} // namespace espalier
