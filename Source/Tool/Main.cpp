#include "Command.h"
#include "Usage.h"

#include <iostream>
#include <span>

namespace {

/// "grow: --output is required; `espalier help grow` tells more".
std::string failureMessage(const CLI::App* app, const CLI::Error& error)
{
    const auto verbs = app->get_subcommands();
    const std::string verb = verbs.empty() ? "" : verbs.front()->get_name();
    return (verb.empty() ? "espalier" : verb) + ": " + error.what() + "; `espalier help" +
           (verb.empty() ? "" : " " + verb) + "` tells more\n";
}

} // namespace

int main(int argc, char** argv)
{
    using namespace espalier::tool;
    CLI::App app{"Espalier: draw one tree, grow any number of relatives.\n"
                 "  espalier infer Content/Oak.archetype -o oak.species\n"
                 "  espalier grow oak.species --seed 1..8 -o oak.glb\n"
                 "  espalier render Content/Oak.archetype oak.species --seed 1..7 --sheet -o oak.png\n"
                 "`espalier help VERB` tells what a verb does and what its options are.\n"
                 "Exit codes: 0 good, 1 something else, 2 wrong usage, 3 bad input."};
    app.name("espalier");
    app.require_subcommand(1);
    app.failure_message(failureMessage);
    app.set_version_flag("--version", "espalier " ESPALIER_VERSION);
    addDerive(app);
    addCheck(app);
    addFit(app);
    addInfer(app);
    addCompare(app);
    addGrammar(app);
    addAppearance(app);
    addGrow(app);
    addMeasure(app);
    addOverlap(app);
    addRender(app);
    const std::span<const char* const> words(argv + 1, static_cast<std::size_t>(argc > 0 ? argc - 1 : 0));
    try
    {
        if (words.empty())
        {
            std::cerr << app.help();
            return kUsage;
        }
        if (const std::string help = helpFor(app, words); !help.empty())
        {
            std::cout << help;
            return kGood;
        }
        checkWords(app, words);
        app.parse(argc, argv);
    }
    catch (const CLI::ParseError& error)
    {
        return app.exit(error) == 0 ? kGood : kUsage;
    }
    catch (const Failure& failure)
    {
        std::cerr << failure.message << '\n';
        return failure.code;
    }
    catch (const std::exception& error) // memory, or a mistake of ours: never a silent crash
    {
        std::cerr << "espalier: " << error.what() << '\n';
        return kOther;
    }
    std::cout.flush();
    if (!std::cout)
    {
        std::cerr << "espalier: the output could not be written completely\n";
        return kOther;
    }
    return kGood;
}
