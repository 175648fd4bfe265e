#pragma once

#include <Espalier/Core/Random.h>
#include <array>
#include <cstdint>
#include <string>
#include <string_view>

namespace espalier::samples {

/// What a random L-system may have.
struct RandomLSystemOptions
{
    bool contexts = false;
    bool weights = false;
    bool parameters = false;
    bool conditions = false;
    bool interpretations = false;
    bool longSymbols = false;
};

/// Writes the text of small L-systems that derive without errors for some steps: values stay finite, words short.
class RandomLSystem
{
public:
    RandomLSystem(std::uint64_t seed, const RandomLSystemOptions& options) : key_(Seed{seed}), options_(options) {}

    std::string make()
    {
        std::string text = options_.longSymbols ? "symbols: AB Bud BudF\n" : "";
        text += "let c = 0.5\naxiom: " + word(2, 5, false) + "\n";
        if (options_.contexts && chance(0.4))
            text += chance(0.5) ? "ignore: + -\n" : "ignore: + - F\n";
        if (options_.contexts && chance(0.3))
            text += "order: listed\n";
        ignoresF_ = text.find("ignore: + - F") != std::string::npos;
        const std::uint64_t rules = 2 + below(7);
        for (std::uint64_t i = 0; i < rules; ++i)
            text += rule();
        if (options_.interpretations)
            for (std::uint64_t i = below(3); i > 0; --i)
                text += "interpret: " + interpretation();
        if (options_.interpretations && chance(0.3))
            text += chance(0.5) ? "interpret: [ -> [ +\n" : "interpret: ] -> F ]\n";
        return text;
    }

private:
    std::uint64_t below(std::uint64_t count) { return key_.below(Purpose::Sampling, count, counter_++); }
    bool chance(double share) { return key_.uniform(Purpose::Sampling, counter_++) < share; }

    std::string_view symbol()
    {
        if (options_.longSymbols && chance(0.3))
            return chance(0.5) ? "Bud " : "AB";
        constexpr std::array<std::string_view, 8> kSymbols = {"A", "B", "C", "D", "A", "B", "F", "+"};
        return kSymbols[below(kSymbols.size())];
    }

    /// Of a predecessor or a context: never + and, where F is ignored, never F.
    std::string_view contextSymbol()
    {
        if (options_.longSymbols && chance(0.2))
            return "Bud";
        constexpr std::array<std::string_view, 5> kSymbols = {"A", "B", "C", "D", "F"};
        return kSymbols[below(ignoresF_ ? 4 : 5)];
    }

    bool hasParameter() { return options_.parameters && chance(0.5); }

    std::string expression(bool hasX)
    {
        constexpr std::array<std::string_view, 8> kConstant = {"1",   "2.5",         "c",         "n*0.25",
                                                               "1+c", "max(n, 2)-2", "pi - pi/2", "2^-n"};
        constexpr std::array<std::string_view, 8> kOfX = {
            "x", "x*c", "x+1", "min(x, 3)", "x > 1 ? x-1 : x+c", "-x/4", "sqrt(abs(x))", "round(x*3)/4"};
        if (options_.weights && chance(0.15))
            return "rand(0, 2)";
        const std::uint64_t which = below(8);
        return std::string(hasX ? kOfX[which] : kConstant[which]);
    }

    std::string word(std::uint64_t least, std::uint64_t most, bool hasX)
    {
        std::string text;
        std::uint64_t open = 0;
        const std::uint64_t length = least + below(most - least + 1);
        for (std::uint64_t i = 0; i < length; ++i)
        {
            if (chance(0.2))
            {
                text += '[';
                ++open;
            }
            text += symbol();
            if (hasParameter())
                text += "(" + expression(hasX) + ")";
            if (open > 0 && chance(0.4))
            {
                text += ']';
                --open;
            }
        }
        return text + std::string(open, ']');
    }

    std::string contextModule(const char* name)
    {
        std::string text(contextSymbol());
        if (hasParameter())
            text += std::string("(") + name + ")";
        return text;
    }

    /// One branch or two beside each other, or one in another, and perhaps what comes behind.
    std::string branches()
    {
        const std::string inner =
            chance(0.3) ? contextModule("o") + "[" + contextModule("p") + "]" : contextModule("o");
        return "[" + inner + "]" + (chance(0.3) ? "[" + contextModule("q") + "]" : "") +
               (chance(0.5) ? contextModule("z") : "");
    }

    std::string rule()
    {
        std::string text;
        const bool hasContext = options_.contexts && chance(0.6);
        if (hasContext && chance(0.6))
            text += (chance(0.3) ? contextModule("u") : "") + contextModule("v") + " < ";
        text += contextSymbol();
        const bool hasX = hasParameter();
        text += hasX ? "(x)" : "";
        if (hasContext && chance(0.6))
        {
            text += " > ";
            text += chance(0.5) ? branches() : contextModule("y");
        }
        if (options_.conditions && chance(0.4))
            text += hasX ? " : x > 0.7" : chance(0.5) ? " : n > 2" : " : n % 2 == 0";
        text += " -> ";
        text += chance(0.15) ? "_" : word(1, 4, hasX);
        if (options_.weights && chance(0.6))
            text += chance(0.3) && hasX ? " : abs(x)+0.1" : chance(0.1) ? " : 0" : chance(0.5) ? " : 1" : " : 2.5";
        return text + "\n";
    }

    std::string interpretation()
    {
        std::string text(contextSymbol());
        const bool hasX = hasParameter();
        text += hasX ? "(x)" : "";
        if (options_.conditions && hasX && chance(0.3))
            text += " : x > 1";
        text += " -> " + word(1, 3, hasX);
        if (options_.weights && chance(0.4))
            text += " : 1";
        return text + "\n";
    }

    RandomKey key_;
    std::uint32_t counter_ = 0;
    RandomLSystemOptions options_;
    bool ignoresF_ = false;
};

} // namespace espalier::samples
