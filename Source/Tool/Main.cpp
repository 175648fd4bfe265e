#include "Command.h"

#include <algorithm>
#include <iostream>

int main(int argc, char** argv)
{
    using namespace espalier::tool;
    CLI::App app{"Espalier: draw one tree, grow any number of relatives.\n"
                 "  espalier infer Content/Oak.archetype -o oak.species\n"
                 "  espalier grow oak.species --seed 1..8 -o oak.glb\n"
                 "  espalier render Content/Oak.archetype oak.species --seed 1..7 --sheet -o oak.png\n"
                 "Exit codes: 0 good, 1 something else, 2 wrong usage, 3 bad input."};
    app.name("espalier");
    app.require_subcommand(1);
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
    try
    {
        const auto verbs = app.get_subcommands([](CLI::App*) { return true; });
        const auto isNamed = [&](const CLI::App* verb) { return verb->get_name() == argv[1]; };
        if (argc > 1 && argv[1][0] != '-' && std::ranges::none_of(verbs, isNamed))
        {
            std::string names;
            for (const CLI::App* verb : verbs)
                names += (names.empty() ? "" : verb == verbs.back() ? " or " : ", ") + verb->get_name();
            failUsage("espalier: there is no verb " + std::string(argv[1]) + "; expected " + names);
        }
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
