#include "Command.h"

#include <Espalier/Grammar/Forecast.h>
#include <Espalier/Grammar/Inspection.h>
#include <Espalier/Species/Grow.h>
#include <Espalier/Turtle/Turtle.h>
#include <algorithm>
#include <cmath>
#include <iomanip>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <sstream>

namespace espalier::tool {

namespace {

struct CheckCommand
{
    std::string grammar;
    std::optional<std::uint32_t> iterations;
    bool json = false;
};

/// `exactly 403751`, `12 to 900, 340 expected`.
std::string spell(const WordForecast& size, bool hasExpectation)
{
    const auto number = [](double value) {
        std::ostringstream text;
        text << std::setprecision(value < 1e15 ? 15 : 3) << value;
        return text.str();
    };
    if (size.least == size.most)
        return number(size.least);
    const auto rounded = [&](double value) { return number(value < 1e15 ? std::round(value) : value); };
    return number(size.least) + " to " + number(size.most) +
           (hasExpectation ? ", " + rounded(size.expected) + " expected" : "");
}

std::string spellGrowth(const GrammarInspection& inspection)
{
    std::ostringstream text;
    text << std::setprecision(4);
    if (!inspection.isGrowthKnown)
        return "not known: the grammar is too large to be followed for many steps";
    const std::string_view most = inspection.isBound ? "at most " : "";
    switch (inspection.growth)
    {
    case GrowthKind::Bounded:
        return "none in the long run";
    case GrowthKind::Polynomial:
        text << most << "like the number of steps to the power of " << inspection.degree;
        break;
    case GrowthKind::Exponential:
        text << most << "by a factor of " << inspection.factor << " a step";
        break;
    }
    return text.str();
}

std::string kindOfGrammar(const GrammarProgram& program)
{
    std::string kind = program.isRandom() ? "stochastic, " : "deterministic, ";
    kind += program.isContextFree() ? "context-free" : "context-sensitive";
    // What `interpret:` adds is drawing, not derivation.
    const auto words = std::span(program.code().words).first(program.grammar().productions.size() + 1);
    if (std::ranges::any_of(words, [](const GrammarProgram::Word& word) { return word.argumentCount > 0; }))
        kind += ", parametric";
    return kind;
}

/// Segments that the turtle would draw.
struct SegmentForecast
{
    double expected = 0;
    bool isBound = false; ///< It may be fewer: a cut or the name after ~ draws nothing.
};

std::optional<SegmentForecast> forecastSegments(const GrammarProgram& program, const Forecast& price)
{
    if (!price.hasExpectation || program.hasInterpretations())
        return {};
    const TurtleAlphabet alphabet(program);
    SegmentForecast segments;
    for (std::size_t letter = 0; letter < price.letters.size(); ++letter)
    {
        const TurtleCommand command = alphabet.commands[letter];
        if (command == TurtleCommand::Draw)
            segments.expected += price.letters[letter];
        segments.isBound |=
            (command == TurtleCommand::Cut || command == TurtleCommand::Organ) && price.letters[letter] > 0;
    }
    return segments;
}

std::string_view nameOf(GrammarFinding::Kind kind)
{
    switch (kind)
    {
    case GrammarFinding::Kind::UnreachableSymbol:
        return "unreachable";
    case GrammarFinding::Kind::UselessProduction:
        return "useless";
    case GrammarFinding::Kind::UnmatchedModule:
        return "unmatched";
    case GrammarFinding::Kind::NoComment:
        return "noComment";
    }
    return {};
}

/// The segments of the plant of seed 1, or why it cannot be drawn: what no look at the rules can tell, such as a
/// division by zero on the way or a brace that is never closed.
Expected<std::uint32_t> drawOnTrial(const Grammar& grammar, std::uint32_t steps, const Limits& limits)
{
    const auto grower = Grower::make(grammar, steps, limits);
    if (!grower)
        return tl::make_unexpected(grower.error());
    GrowScratch scratch;
    Skeleton skeleton;
    GrowOptions options;
    options.limits = limits;
    if (auto grown = grower->grow(Seed{1}, options, scratch, skeleton); !grown)
        return tl::make_unexpected(grown.error());
    return skeleton.size();
}

void checkGrammar(const CheckCommand& command)
{
    const Limits limits;
    const Grammar grammar = loadGrammarFile(command.grammar);
    const GrammarProgram program = orFailIn(command.grammar, GrammarProgram::make(grammar));
    const std::uint32_t steps = command.iterations.value_or(grammar.iterations.value_or(0));
    const GrammarInspection inspection = inspect(program, limits);
    const Forecast price = forecast(program, steps, 1e300);
    const WordForecast& word = price.steps.back();
    const auto reached = static_cast<std::uint32_t>(price.steps.size() - 1);
    const std::optional<SegmentForecast> segments = forecastSegments(program, price);
    const Expected<std::uint32_t> trial = drawOnTrial(grammar, steps, limits);
    if (command.json)
    {
        nlohmann::ordered_json json;
        json["kind"] = kindOfGrammar(program);
        json["findings"] = nlohmann::ordered_json::array();
        for (const GrammarFinding& finding : inspection.findings)
            json["findings"].push_back({{"kind", nameOf(finding.kind)},
                                        {"line", finding.place.line},
                                        {"column", finding.place.column},
                                        {"what", finding.what}});
        if (trial)
            json["segmentsOfSeed1"] = *trial;
        else
            json["trialError"] = {{"line", trial.error().where.line},
                                  {"column", trial.error().where.column},
                                  {"what", trial.error().what}};
        json["isGrowthKnown"] = inspection.isGrowthKnown;
        json["growth"] = inspection.growth == GrowthKind::Bounded      ? "bounded"
                         : inspection.growth == GrowthKind::Polynomial ? "polynomial"
                                                                       : "exponential";
        json["factor"] = inspection.factor;
        json["degree"] = inspection.degree;
        json["isBound"] = inspection.isBound;
        json["safeIterations"] = inspection.safeSteps;
        json["isSafeBeyond"] = inspection.isSafeBeyond;
        json["iterations"] = reached; // may be fewer than asked for
        json["isComplete"] = price.isComplete;
        json["length"] = {{"least", word.least}, {"most", word.most}};
        if (price.hasExpectation)
            json["length"]["expected"] = word.expected;
        if (segments)
        {
            json["segments"] = segments->expected;
            json["areSegmentsBound"] = segments->isBound;
        }
        std::cout << json.dump(2) << '\n';
        return;
    }
    for (const GrammarFinding& finding : inspection.findings)
        std::cout << command.grammar << ':' << finding.place.line << ':' << finding.place.column
                  << ": note: " << finding.what << '\n';
    if (!trial)
    {
        Error error = trial.error();
        error.where.file = command.grammar;
        error.what = "at -n " + std::to_string(steps) + ", seed 1: " + error.what;
        std::cout << toString(error) << '\n';
    }
    if (!command.iterations && !grammar.iterations && !grammar.productions.empty())
        std::cout << command.grammar
                  << ": note: no line `iterations:` tells how many steps; none are taken without -n\n";
    std::cout << command.grammar << ": " << kindOfGrammar(program) << "; " << grammar.productions.size()
              << (grammar.productions.size() == 1 ? " production" : " productions") << '\n'
              << "  growth: " << spellGrowth(inspection) << '\n'
              << "  modules after " << reached << (reached == 1 ? " step: " : " steps: ")
              << spell(word, price.hasExpectation) << '\n';
    if (segments)
        std::cout << "  segments: " << (segments->isBound ? "at most " : "") << std::setprecision(15)
                  << std::round(segments->expected) << (price.isExact ? "" : " expected") << '\n';
    if (trial)
        std::cout << "  segments of seed 1: " << *trial << '\n';
    if (reached < steps)
        std::cout << "  modules after " << steps << " steps: not worked out\n";
    std::cout << "  modules are sure to stay within the limit of " << limits.modules << " up to -n "
              << inspection.safeSteps << (inspection.isSafeBeyond ? " or more" : "") << '\n';
}

} // namespace

void addCheck(CLI::App& app)
{
    const auto command = std::make_shared<CheckCommand>();
    CLI::App* verb = app.add_subcommand("check", "Report a grammar's errors, what in it is useless, and how it grows");
    verb->add_option("grammar", command->grammar, "G.lsys")->required();
    addIterations(*verb, command->iterations);
    verb->add_flag("--json", command->json, "One JSON document");
    verb->callback([command] { checkGrammar(*command); });
}

} // namespace espalier::tool
