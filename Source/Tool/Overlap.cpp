#include "Input.h"

#include <Espalier/Overlap/Overlap.h>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

namespace espalier::tool {

namespace {

struct OverlapCommand
{
    PlantInput input;
    OverlapSettings settings;
    bool json = false;
};

void reportOverlaps(const OverlapCommand& command)
{
    nlohmann::ordered_json all = nlohmann::ordered_json::array();
    command.input.eachPlant([&](const Plant& plant) {
        const OverlapReport report = orFail(findOverlaps(plant.skeleton, command.settings));
        if (!command.json)
        {
            std::cout << plant.label << ": " << report.overlaps.size() << " overlaps among " << plant.skeleton.size()
                      << " segments";
            if (!report.overlaps.empty())
                std::cout << ", the deepest " << report.deepest * 1000 << " mm";
            std::cout << '\n';
            return;
        }
        nlohmann::ordered_json json;
        if (plant.seed)
            json["seed"] = *plant.seed;
        if (plant.attempt)
            json["attempt"] = *plant.attempt;
        json["segments"] = plant.skeleton.size();
        json["count"] = report.overlaps.size();
        json["deepest"] = report.deepest;
        json["overlaps"] = nlohmann::ordered_json::array();
        for (const Overlap& overlap : report.overlaps)
            json["overlaps"].push_back(
                {{"first", overlap.first}, {"second", overlap.second}, {"depth", overlap.depth}});
        all.push_back(std::move(json));
    });
    if (command.json)
        std::cout << (all.size() > 1 || command.input.isArray() ? all : all[0]).dump(2) << '\n';
}

} // namespace

void addOverlap(CLI::App& app)
{
    const auto command = std::make_shared<OverlapCommand>();
    CLI::App* verb =
        app.add_subcommand("overlap", "Report branches that cut into each other although they are not neighbours");
    command->input.addTo(*verb);
    verb->add_option("--tolerance", command->settings.tolerance, "Metres of depth that are ignored")
        ->check(CLI::Range(0.f, 1e5f))
        ->capture_default_str();
    verb->add_flag("--json", command->json, "One JSON document; an array for a range of seeds");
    verb->callback([command] { reportOverlaps(*command); });
}

} // namespace espalier::tool
