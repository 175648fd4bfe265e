#include "Command.h"

#include <Espalier/Core/File.h>
#include <Espalier/Inference/Comparison.h>
#include <Espalier/Inference/Exemplars.h>
#include <Espalier/Render/Chart.h>
#include <algorithm>
#include <cmath>
#include <iomanip>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

namespace espalier::tool {

namespace {

struct CompareOptions
{
    std::vector<std::string> inputs;
    std::string seeds = "1..2000";
    std::string charts;
    bool json = false;
    TemplateFolders templates;
};

/// JSON has no infinity: what cannot be told is null.
nlohmann::ordered_json number(double value)
{
    return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
}

nlohmann::ordered_json toJson(const MeanComparison& m)
{
    return {{"exemplar", m.exemplar}, {"mean", m.mean}};
}

nlohmann::ordered_json toJson(const Comparison& c, std::uint64_t first)
{
    nlohmann::ordered_json json;
    json["seeds"] = c.seeds;
    json["firstSeed"] = first;
    json["exemplars"] = c.exemplars;
    json["instances"] = c.exemplarInstances;
    json["size"] = {{"exemplar", c.size.exemplar}, {"mean", c.size.mean}, {"median", c.size.median},
                    {"within", c.size.within},     {"tiny", c.size.tiny}, {"unfinished", c.size.unfinished}};
    json["anchorDivergence"] = c.anchorDivergence;
    json["parameters"] = {{"angle", number(c.parameters.angle.distance)},
                          {"length", number(c.parameters.length.distance)},
                          {"width", number(c.parameters.width.distance)},
                          {"azimuth", number(c.parameters.azimuth.distance)}};
    json["spreads"] = {{"angle", c.parameters.angle.spread},
                       {"length", c.parameters.length.spread},
                       {"width", c.parameters.width.spread},
                       {"azimuth", c.parameters.azimuth.spread}};
    json["depth"] = toJson(c.depth);
    json["depth"]["histogram"] = c.depthHistogram;
    json["strahler"] = toJson(c.strahler);
    json["strahler"]["within1"] = c.strahlerWithin1;
    json["bifurcation"] = toJson(c.bifurcation);
    json["editDistance"] = {{"exemplarMedian", c.editDistance.exemplarMedian},
                            {"pairMedian", c.editDistance.pairMedian},
                            {"compared", c.editDistance.pairs},
                            {"method", c.editDistance.estimated ? "pq-grams and overlay" : "Zhang-Shasha"}};
    json["distinct"] = c.distinct;
    json["copies"] = c.copies;
    json["crown"] = {
        {"height", toJson(c.crown.height)}, {"width", toJson(c.crown.width)}, {"profile", c.crown.profile}};
    nlohmann::ordered_json bars = nlohmann::ordered_json::array();
    for (const Bar& bar : barsOf(c))
        bars.push_back({{"measure", bar.measure},
                        {"value", number(bar.value)},
                        {"low", number(bar.low)},
                        {"high", number(bar.high)},
                        {"holds", bar.holds()}});
    json["bars"] = std::move(bars);
    return json;
}

std::string threeDigits(double value)
{
    std::ostringstream text;
    text << std::fixed << std::setprecision(value != 0 && std::abs(value) < 0.1 ? 4 : 3) << value;
    return text.str();
}

std::string boundOf(const Bar& bar)
{
    const auto plain = [](double value) {
        std::ostringstream text;
        text << value;
        return text.str();
    };
    if (!std::isfinite(bar.low))
        return bar.high == 0 ? "0" : "<= " + plain(bar.high);
    return std::isfinite(bar.high) ? plain(bar.low) + " to " + plain(bar.high) : ">= " + plain(bar.low);
}

std::size_t barsHeld(const std::vector<Bar>& bars)
{
    return static_cast<std::size_t>(std::ranges::count_if(bars, [](const Bar& bar) { return bar.holds(); }));
}

void printReport(const Comparison& c, const Species& species)
{
    std::cout << species.name << ": " << c.seeds << " seeds against " << c.exemplars
              << (c.exemplars == 1 ? " drawn tree of " : " drawn trees of ") << std::round(c.exemplarInstances)
              << " template instances and " << std::round(c.size.exemplar) << " segments"
              << (c.exemplars == 1 ? "" : " in the mean") << "\n\n"
              << std::left << std::setw(52) << "measure" << std::setw(12) << "value" << std::setw(14) << "bar"
              << "holds\n";
    const std::vector<Bar> bars = barsOf(c);
    for (const Bar& bar : bars)
        std::cout << std::setw(52) << bar.measure << std::setw(12) << threeDigits(bar.value) << std::setw(14)
                  << boundOf(bar) << (bar.holds() ? "yes" : "NO") << '\n';
    std::cout << '\n' << barsHeld(bars) << " of " << bars.size() << " bars hold.\n";
    std::set<std::string> told;
    for (const Bar& bar : bars)
        if (!bar.holds() && told.insert(bar.advice).second)
            std::cout << "what may help: " << bar.advice << '\n';
    std::cout << "segments: drawn " << threeDigits(c.size.exemplar) << ", grown mean " << threeDigits(c.size.mean)
              << ", median " << threeDigits(c.size.median) << '\n'
              << "depth in instances: drawn " << threeDigits(c.depth.exemplar) << ", grown mean "
              << threeDigits(c.depth.mean) << "; instances lie " << threeDigits(c.depthHistogram)
              << " deeper or higher\n"
              << "Strahler order: drawn " << threeDigits(c.strahler.exemplar) << ", grown mean "
              << threeDigits(c.strahler.mean) << "; bifurcation ratio " << threeDigits(c.bifurcation.exemplar)
              << " and " << threeDigits(c.bifurcation.mean) << '\n'
              << "crown: " << threeDigits(c.crown.height.exemplar) << " m high and "
              << threeDigits(c.crown.width.exemplar) << " m wide as drawn, " << threeDigits(c.crown.height.mean)
              << " m and " << threeDigits(c.crown.width.mean) << " m grown\n"
              << "spreads of the drawn trees: angles " << threeDigits(c.parameters.angle.spread) << " and azimuths "
              << threeDigits(c.parameters.azimuth.spread) << " degrees, lengths "
              << threeDigits(c.parameters.length.spread) << " m, widths " << threeDigits(c.parameters.width.spread)
              << " m\n"
              << "edit distances: "
              << (c.editDistance.estimated ? "estimated by pq-grams and by laying trees over each other"
                                           : "Zhang-Shasha")
              << ", of " << c.editDistance.pairs << " trees\n";
}

void writeCharts(const std::string& path, const Comparison& c, const Species& species)
{
    const std::vector<Bar> bars = barsOf(c);
    const BranchMeasures& drawn = c.drawn.branches;
    const BranchMeasures& grown = c.grown.branches;
    const std::vector<Picture> charts = {
        drawChart(Histogram{"segments of a tree", "", c.drawn.segments, c.grown.segments}),
        drawChart(Histogram{"depth of instances", "", c.drawn.depths, c.grown.depths}),
        drawChart(Profile{"branch length by height", "m", 2 * c.crown.height.exemplar, c.drawn.lengthByShare,
                          c.grown.lengthByShare}),
        drawChart(Histogram{"branching angles", "deg", drawn.angles, grown.angles}),
        drawChart(Histogram{"azimuths", "deg", drawn.azimuths, grown.azimuths}),
        drawChart(Histogram{"lengths", "m", drawn.lengths, grown.lengths}),
        drawChart(Histogram{"widths", "m", drawn.widths, grown.widths}),
        drawChart(Histogram{"edits to the exemplar", "", {0.0}, c.exemplarDistances}),
        drawChart(Histogram{"edits between trees", "", {0.0}, c.pairDistances}),
    };
    const std::string title = species.name + ": " + std::to_string(c.seeds) + " seeds, " +
                              std::to_string(barsHeld(bars)) + " of " + std::to_string(bars.size()) + " bars hold";
    orFail(writeFileAtomically(path, encodePng(chartSheet(title, charts, 3))));
}

void compareTrees(const CompareOptions& options)
{
    std::vector<Archetype> archetypes;
    std::optional<Species> species;
    std::string speciesPath;
    for (const std::string& path : options.inputs)
    {
        if (kindOf(path) == InputKind::Archetype)
            archetypes.push_back(options.templates.load(path));
        else if (species)
            failUsage("compare: " + path + ": expected one species, after " + speciesPath);
        else
        {
            species = loadSpeciesFile(path);
            speciesPath = path;
        }
    }
    if (archetypes.empty() || !species)
        failUsage("compare: expected A.archetype ... and the S.species that was inferred from them");
    if (!options.charts.empty() && std::filesystem::path(options.charts).extension() != ".png")
        failUsage("compare: " + options.charts + ": expected charts in a file that ends in .png");
    if (!species->provenance.archetypes.empty() && species->provenance.archetypes != identityOf(archetypes))
        std::cerr << speciesPath << ": was inferred from other drawings than these, or before they were changed\n";
    const Archetype exemplars = orFailIn(speciesPath, exemplarsOf(archetypes, species->provenance));
    const SeedRange range = parseSeeds(options.seeds);
    if (range.exemplar || range.count() < 2)
        failUsage("--seeds " + options.seeds + ": expected at least 2 seeds, such as 1..2000");
    ComparisonOptions comparison;
    comparison.first = Seed{range.first};
    comparison.seeds = static_cast<std::uint32_t>(range.count());
    comparison.progress = terminalProgress();
    const Comparison result = orFailIn(speciesPath, compare({&exemplars, 1}, *species, comparison));
    if (!options.charts.empty())
        writeCharts(options.charts, result, *species);
    if (options.json)
        std::cout << toJson(result, range.first).dump(2) << '\n';
    else
        printReport(result, *species);
}

} // namespace

void addCompare(CLI::App& app)
{
    const auto options = std::make_shared<CompareOptions>();
    CLI::App* verb = app.add_subcommand(
        "compare", "How like the drawn trees a species' trees are, and how different from each other");
    verb->add_option("inputs", options->inputs, "A.archetype ... S.species")->required();
    verb->add_option("--seeds,--seed", options->seeds, "A range A..B of seeds to grow")->capture_default_str();
    verb->add_option("-o,--charts", options->charts, "Small charts of the distributions, charts.png");
    verb->add_flag("--json", options->json, "One JSON document with every measure and bar");
    options->templates.addTo(*verb);
    verb->callback([options] { compareTrees(*options); });
}

} // namespace espalier::tool
