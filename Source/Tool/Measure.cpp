#include "Input.h"

#include <Espalier/Plant/Measure.h>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

namespace espalier::tool {

namespace {

struct MeasureOptions
{
    PlantInput input;
    bool json = false;
};

nlohmann::ordered_json toJson(const SkeletonFacts& facts, const Plant& plant)
{
    nlohmann::ordered_json json;
    if (plant.seed)
        json["seed"] = *plant.seed;
    if (plant.attempt)
        json["attempt"] = *plant.attempt;
    json["segments"] = facts.segments;
    json["totalLength"] = facts.totalLength;
    json["tips"] = facts.tips;
    json["forks"] = facts.forks;
    json["maxDepth"] = facts.maxDepth;
    json["minY"] = facts.minY;
    json["maxY"] = facts.maxY;
    json["maxRadius"] = facts.maxRadius;
    json["strahler"] = facts.strahler;
    json["instances"] = facts.instances;
    return json;
}

void measurePlants(const MeasureOptions& options)
{
    nlohmann::ordered_json all = nlohmann::ordered_json::array();
    options.input.eachPlant([&](const Plant& plant) {
        nlohmann::ordered_json facts = toJson(measure(plant.skeleton), plant);
        if (options.json)
        {
            all.push_back(std::move(facts));
            return;
        }
        std::cout << plant.label << ":";
        for (const auto& [key, value] : facts.items())
            if (key != "seed")
                std::cout << ' ' << key << ' ' << value;
        std::cout << '\n';
    });
    if (options.json)
        std::cout << (all.size() > 1 || options.input.isArray() ? all : all[0]).dump(all.size() > 1 ? -1 : 2) << '\n';
}

} // namespace

void addMeasure(CLI::App& app)
{
    const auto options = std::make_shared<MeasureOptions>();
    CLI::App* verb = app.add_subcommand(
        "measure", "Report the facts of a plant: segments, lengths, tips, forks, depth, reach, order");
    options->input.addTo(*verb);
    verb->add_flag("--json", options->json, "One JSON document; an array for a range of seeds");
    verb->callback([options] { measurePlants(*options); });
}

} // namespace espalier::tool
