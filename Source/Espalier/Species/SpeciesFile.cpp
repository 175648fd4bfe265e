#include <Espalier/Species/Species.h>

#include <Espalier/Core/File.h>
#include <Espalier/Core/Hash.h>
#include <Espalier/Core/Json.h>
#include <Espalier/Core/Utf8.h>
#include <Espalier/Grammar/GrammarProgram.h>
#include <Espalier/Species/AppearanceText.h>
#include <Espalier/Species/JsonFields.h>
#include <algorithm>
#include <charconv>

namespace espalier {

namespace {

constexpr std::uint64_t kVersion = 1;
using Value = JsonDocument::Value;

Expected<void> readPair(const Value& value, std::string_view role, std::uint32_t& low, std::uint32_t& high)
{
    if (auto done = value.requireArray(role); !done)
        return done;
    const std::vector<Value> items = value.items();
    if (items.size() != 2)
        return value.fail(std::string(role) + " has " + std::to_string(items.size()) + " elements",
                          "the least and the most: [low, high]");
    const auto least = items[0].count(role, 0, 0xffffffffu);
    if (!least)
        return tl::make_unexpected(least.error());
    const auto most = items[1].count(role, *least, 0xffffffffu);
    if (!most)
        return tl::make_unexpected(most.error());
    low = static_cast<std::uint32_t>(*least);
    high = static_cast<std::uint32_t>(*most);
    return {};
}

/// 16 lower-case hexadecimal digits.
Expected<std::uint64_t> readHash(const Value& value, std::string_view role)
{
    const auto text = value.string(role);
    if (!text)
        return tl::make_unexpected(text.error());
    std::uint64_t hash = 0;
    for (const char c : *text)
        hash = hash << 4 | static_cast<std::uint64_t>(c >= 'a' ? c - 'a' + 10 : c - '0');
    if (hexDigits(hash) != *text)
        return value.fail("this is no hash", "16 lower-case hexadecimal digits");
    return hash;
}

Expected<void> readWindow(const Value& value, GrowthWindow& window)
{
    if (auto done = value.requireObject("window", {"segments", "depth", "attempts", "copies"}); !done)
        return done;
    return Fields(value)
        .read("segments",
              [&](const Value& v) { return readPair(v, "segments", window.minSegments, window.maxSegments); })
        .read("depth", [&](const Value& v) { return readPair(v, "depth", window.minDepth, window.maxDepth); })
        .count("attempts", window.attempts, 1, 1024)
        .read("copies",
              [&](const Value& v) -> Expected<void> {
                  if (auto done = v.requireArray("copies"); !done)
                      return done;
                  for (const Value& item : v.items())
                  {
                      const auto hash = readHash(item, "a topology hash");
                      if (!hash)
                          return tl::make_unexpected(hash.error());
                      window.copies.push_back(*hash);
                  }
                  return {};
              })
        .result();
}

Expected<void> readWeights(const Value& value, std::vector<std::uint32_t>& weights)
{
    if (auto done = value.requireArray("weights"); !done)
        return done;
    for (const Value& item : value.items())
    {
        const auto weight = item.count("a weight", 1, 1000);
        if (!weight)
            return tl::make_unexpected(weight.error());
        weights.push_back(static_cast<std::uint32_t>(*weight));
    }
    return {};
}

Expected<void> readProvenance(const Value& value, Provenance& provenance)
{
    if (auto done =
            value.requireObject("provenance", {"method", "archetypes", "grammar", "tables", "pipes", "mergeWeight",
                                               "ruleWeight", "jitter", "weights", "spatial", "mirror",
                                               "exemplarSegments", "exemplarInstances", "exemplars", "note"});
        !done)
        return done;
    return Fields(value)
        .string("method", provenance.method)
        .string("archetypes", provenance.archetypes)
        .string("grammar", provenance.grammar)
        .string("tables", provenance.tables)
        .string("pipes", provenance.pipes)
        .number("mergeWeight", provenance.mergeWeight, 0, 1)
        .number("ruleWeight", provenance.ruleWeight, 0, 1)
        .number("jitter", provenance.jitter, 0, 1)
        .read("weights", [&](const Value& v) { return readWeights(v, provenance.weights); })
        .string("spatial", provenance.spatial)
        .read("mirror",
              [&](const Value& v) { return v.boolean("mirror").map([&](bool mirror) { provenance.mirror = mirror; }); })
        .count("exemplarSegments", provenance.exemplarSegments, 0, 0xffffffffu)
        .count("exemplarInstances", provenance.exemplarInstances, 0, 0xffffffffu)
        .count("exemplars", provenance.exemplars, 0, 0xffffffffu)
        .string("note", provenance.note)
        .result();
}

/// Four numbers: a scaling, then three angles.
Expected<std::array<double, 4>> readTransform(const Value& value, std::string_view role, double mostScaling,
                                              const Limits& limits)
{
    if (auto done = value.requireArray(role); !done)
        return tl::make_unexpected(done.error());
    const std::vector<Value> items = value.items();
    if (items.size() != 4)
        return value.fail(std::string(role) + " has " + std::to_string(items.size()) + " numbers",
                          "[scaling, rotation, branching angle, roll]");
    std::array<double, 4> values{};
    for (std::size_t i = 0; i < 4; ++i)
    {
        const double most = i == 0 ? mostScaling : limits.angleDegrees;
        const auto number = items[i].number(i == 0 ? "a scaling" : "an angle", i == 0 ? 0 : -most, most);
        if (!number)
            return tl::make_unexpected(number.error());
        values[i] = *number;
    }
    return values;
}

Expected<void> readTable(const Value& value, const Limits& limits, TransformTable& table)
{
    constexpr double kMostSpread = 0.4; // sqrt(6) of these stay below 1: no scaling becomes negative
    if (auto done = value.requireObject("a table", {"spread", "rows"}); !done)
        return done;
    return Fields(value)
        .read("spread",
              [&](const Value& v) {
                  return readTransform(v, "the spread", kMostSpread, limits).map([&](const auto& spread) {
                      table.spread = spread;
                  });
              })
        .read("rows",
              [&](const Value& v) -> Expected<void> {
                  if (auto done = v.requireArray("rows"); !done)
                      return done;
                  for (const Value& item : v.items())
                  {
                      const auto row = readTransform(item, "a row", limits.coordinate, limits);
                      if (!row)
                          return tl::make_unexpected(row.error());
                      table.rows.push_back(*row);
                  }
                  return {};
              })
        .result();
}

Expected<void> readTables(const Value& value, const Limits& limits, std::vector<TransformTable>& tables)
{
    if (auto done = value.requireObject("tables"); !done)
        return done;
    for (const Value& item : value.items())
    {
        TransformTable table;
        table.name = item.key();
        if (auto done = readTable(item, limits, table); !done)
            return done;
        if (table.rows.empty())
            return item.fail("the table " + table.name + " has no row", "at least one row");
        tables.push_back(std::move(table));
    }
    return {};
}

Expected<void> readGrammar(const Value& value, std::string_view file, const Limits& limits, Grammar& grammar)
{
    if (auto done = value.requireArray("grammar (one string a line)"); !done)
        return done;
    const std::vector<Value> lines = value.items();
    std::string text;
    for (const Value& line : lines)
    {
        const auto content = line.string("a line of the grammar");
        if (!content)
            return tl::make_unexpected(content.error());
        if (content->find('\n') != std::string_view::npos)
            return line.fail("a line of the grammar holds a line break", "one string for each line");
        text += *content;
        text += '\n';
    }
    // A place in the grammar is a place in the string that holds its line; escapes make the string longer than the
    // line.
    const GrammarPlace place = [&](std::uint32_t line, std::uint32_t column) {
        if (line == 0 || line > lines.size())
            return value.where();
        const std::u32string content = fromUtf8(*lines[line - 1].string("a line"));
        const std::string before = quoteJson(toUtf8(content.substr(0, column - 1)));
        Location where = lines[line - 1].where();
        where.column += static_cast<std::uint32_t>(fromUtf8(before).size()) - 1; // the closing quote is not before it
        return where;
    };
    auto parsed = parseGrammar(text, file, limits.ofInferredGrammars(), place);
    if (!parsed)
        return tl::make_unexpected(parsed.error());
    grammar = std::move(*parsed);
    return {};
}

/// `0:12 0:40`: tree and node.
Expected<void> readNodes(const Value& value, std::vector<DrawnNode>& nodes)
{
    const auto text = value.string("nodes");
    if (!text)
        return tl::make_unexpected(text.error());
    const char* at = text->data();
    const char* const end = at + text->size();
    const auto number = [&](std::uint32_t& field, char before) {
        if (before != '\0' && (at == end || *at++ != before))
            return false;
        const auto read = std::from_chars(at, end, field);
        at = read.ptr;
        return read.ec == std::errc{};
    };
    while (at != end)
    {
        DrawnNode node;
        if (nodes.size() == RuleOrigin::kMostNodes || !number(node.tree, nodes.empty() ? '\0' : ' ') ||
            !number(node.node, ':'))
            return value.fail("these are no nodes",
                              "at most " + std::to_string(RuleOrigin::kMostNodes) +
                                  " of the form tree:node with a blank between, such as \"0:3 0:7\"");
        nodes.push_back(node);
    }
    return {};
}

Expected<void> readRules(const Value& value, std::vector<RuleOrigin>& rules)
{
    if (auto done = value.requireArray("rules"); !done)
        return done;
    for (const Value& item : value.items())
    {
        if (auto done = item.requireObject("a rule", {"count", "limbs", "nodes", "limb", "place", "locked"}); !done)
            return done;
        RuleOrigin rule;
        const auto hash = [](std::string_view role, std::uint64_t& field) {
            return
                [role, &field](const Value& v) { return readHash(v, role).map([&](std::uint64_t h) { field = h; }); };
        };
        const auto done = Fields(item)
                              .count("count", rule.count, 0, 0xffffffffu)
                              .count("limbs", rule.limbs, 1, 0xffffffffu)
                              .read("nodes", [&](const Value& v) { return readNodes(v, rule.nodes); })
                              .read("limb", hash("limb", rule.limb))
                              .read("place", hash("place", rule.place))
                              .read("locked",
                                    [&](const Value& v) {
                                        return v.boolean("locked").map([&](bool locked) { rule.locked = locked; });
                                    })
                              .result();
        if (!done)
            return done;
        rules.push_back(std::move(rule));
    }
    return {};
}

Expected<void> readConflicts(const Value& value, std::vector<EditConflict>& conflicts)
{
    if (auto done = value.requireArray("conflicts"); !done)
        return done;
    for (const Value& item : value.items())
    {
        if (auto done = item.requireObject("a conflict", {"inferred", "edited", "reason"}); !done)
            return done;
        EditConflict conflict;
        const auto done = Fields(item)
                              .string("inferred", conflict.inferred)
                              .string("edited", conflict.edited)
                              .string("reason", conflict.reason)
                              .result();
        if (!done)
            return done;
        // They are shown as comments, one a line.
        for (const std::string* line : {&conflict.inferred, &conflict.edited, &conflict.reason})
            if (line->find('\n') != std::string::npos)
                return item.fail("a line of the conflict holds a line break", "one line each");
        conflicts.push_back(std::move(conflict));
    }
    return {};
}

/// Each rule as inferred has its origin, or none has.
Expected<void> checkRules(const Value& root, const Species& species)
{
    const Grammar& inferred = species.inferred ? *species.inferred : species.grammar;
    const std::size_t productions = inferred.productions.size();
    if (species.rules.empty() || species.rules.size() == productions)
        return {};
    return root["rules"].fail("it tells of " + std::to_string(species.rules.size()) + " rules, but the grammar " +
                                  (species.inferred ? "as inferred has " : "has ") + std::to_string(productions),
                              "one entry for each production, in order",
                              "to add or take away productions use `espalier grammar --set`, which keeps account; or "
                              "remove the key \"rules\", and inferring again will know nothing of your edits");
}

void printLines(std::string& out, const Grammar& grammar)
{
    const std::string text = printGrammar(grammar);
    for (std::size_t start = 0; start < text.size();)
    {
        const std::size_t end = text.find('\n', start);
        out += "    " + quoteJson(std::string_view(text).substr(start, end - start));
        start = end + 1;
        out += start < text.size() ? ",\n" : "\n";
    }
}

std::string ruleText(const RuleOrigin& rule)
{
    std::string text = "{\"count\": " + std::to_string(rule.count);
    if (rule.limbs != 1)
        text += ", \"limbs\": " + std::to_string(rule.limbs);
    text += ", \"nodes\": \"";
    for (std::size_t i = 0; i < rule.nodes.size(); ++i)
        text += (i == 0 ? "" : " ") + std::to_string(rule.nodes[i].tree) + ':' + std::to_string(rule.nodes[i].node);
    return text + "\", \"limb\": \"" + hexDigits(rule.limb) + "\", \"place\": \"" + hexDigits(rule.place) + '"' +
           (rule.locked ? ", \"locked\": true}" : "}");
}

/// What authoring remembers, where there is something.
void printMemory(std::string& out, const Species& species)
{
    if (!species.rules.empty())
    {
        out += ",\n  \"rules\": [";
        for (std::size_t i = 0; i < species.rules.size(); ++i)
            out += (i == 0 ? "\n    " : ",\n    ") + ruleText(species.rules[i]);
        out += "\n  ]";
    }
    if (species.inferred)
    {
        out += ",\n  \"inferred\": [\n";
        printLines(out, *species.inferred);
        out += "  ]";
    }
    if (species.conflicts.empty())
        return;
    out += ",\n  \"conflicts\": [";
    for (std::size_t i = 0; i < species.conflicts.size(); ++i)
    {
        const EditConflict& conflict = species.conflicts[i];
        out += (i == 0 ? "\n    " : ",\n    ") + std::string("{\"inferred\": ") + quoteJson(conflict.inferred) +
               ", \"edited\": " + quoteJson(conflict.edited) + ", \"reason\": " + quoteJson(conflict.reason) + "}";
    }
    out += "\n  ]";
}

std::string transformText(const std::array<double, 4>& values)
{
    std::string text = "[";
    for (std::size_t i = 0; i < values.size(); ++i)
        text += (i == 0 ? "" : ", ") + formatNumber(values[i]);
    return text + "]";
}

std::string pair(std::uint32_t a, std::uint32_t b)
{
    return "[" + std::to_string(a) + ", " + std::to_string(b) + "]";
}

} // namespace

Expected<Species> parseSpecies(std::string text, std::string_view file, const Limits& limits)
{
    Limits jsonLimits = limits;
    jsonLimits.stringBytes = std::max(limits.stringBytes, limits.fileBytes); // a rule is a string, however long
    const auto document = JsonDocument::parse(std::move(text), std::string(file), jsonLimits);
    if (!document)
        return tl::make_unexpected(document.error());
    const Value root = document->root();
    if (auto done = root.requireFormat("species", kVersion); !done)
        return tl::make_unexpected(done.error());
    if (auto done = root.requireObject("a species", {"espalier", "version", "name", "grammar", "tables", "window",
                                                     "appearance", "provenance", "rules", "inferred", "conflicts"});
        !done)
        return tl::make_unexpected(done.error());
    if (const auto grammar = root.required("grammar", "the lines of a grammar"); !grammar)
        return tl::make_unexpected(grammar.error());

    Species species;
    const auto done =
        Fields(root)
            .string("name", species.name)
            .read("tables", [&](const Value& v) { return readTables(v, limits, species.tables); })
            .read("grammar", [&](const Value& v) { return readGrammar(v, file, limits, species.grammar); })
            .read("window", [&](const Value& v) { return readWindow(v, species.window.emplace()); })
            .read("appearance",
                  [&](const Value& v) { return readAppearance(v, species.appearance, &species.appearance.pipes); })
            .read("provenance", [&](const Value& v) { return readProvenance(v, species.provenance); })
            .read("rules", [&](const Value& v) { return readRules(v, species.rules); })
            .read("inferred", [&](const Value& v) { return readGrammar(v, file, limits, species.inferred.emplace()); })
            .read("conflicts", [&](const Value& v) { return readConflicts(v, species.conflicts); })
            .result();
    if (!done)
        return tl::make_unexpected(done.error());

    if (auto counted = checkRules(root, species); !counted)
        return tl::make_unexpected(counted.error());

    // Rules and tables must fit each other before anybody grows from them.
    if (const auto program = GrammarProgram::make(species.grammar, species.tables); !program)
    {
        Error error = program.error();
        const std::vector<Value> lines = root["grammar"].items();
        error.where = error.where.line > 0 && error.where.line <= lines.size() ? lines[error.where.line - 1].where()
                                                                               : root["grammar"].where();
        return tl::make_unexpected(error);
    }
    if (species.inferred)
        if (const auto program = GrammarProgram::make(*species.inferred, species.tables); !program)
            return root["inferred"].fail("it does not fit the tables: " + program.error().what,
                                         program.error().expected);
    return species;
}

namespace {

std::string tablesText(const Species& species)
{
    std::string out = "  \"tables\": {";
    for (std::size_t t = 0; t < species.tables.size(); ++t)
    {
        const TransformTable& table = species.tables[t];
        out += (t == 0 ? "\n    " : ",\n    ") + quoteJson(table.name) +
               ": {\"spread\": " + transformText(table.spread) + ", \"rows\": [";
        for (std::size_t i = 0; i < table.rows.size(); ++i)
            out += (i == 0 ? "" : ", ") + transformText(table.rows[i]);
        out += "]}";
    }
    return out + (species.tables.empty() ? "},\n" : "\n  },\n");
}

std::string windowText(const Species& species)
{
    if (!species.window)
        return {};
    const GrowthWindow& window = *species.window;
    std::string out = "  \"window\": {\"segments\": " + pair(window.minSegments, window.maxSegments) +
                      ", \"depth\": " + pair(window.minDepth, window.maxDepth) +
                      ", \"attempts\": " + std::to_string(window.attempts) + ", \"copies\": [";
    for (std::size_t i = 0; i < window.copies.size(); ++i)
        out += (i == 0 ? "\"" : ", \"") + hexDigits(window.copies[i]) + '"';
    return out + "]},\n";
}

/// What is as usual, or unknown, is not mentioned.
std::string provenanceText(const Provenance& p)
{
    const auto identity = [](const char* key, const std::string& value) {
        return value.empty() ? std::string() : std::string(", \"") + key + "\": " + quoteJson(value);
    };
    std::string weights;
    for (const std::uint32_t weight : p.weights)
        weights += (weights.empty() ? ", \"weights\": [" : ", ") + std::to_string(weight);
    weights += weights.empty() ? "" : "]";
    return "  \"provenance\": {\"method\": " + quoteJson(p.method) + ", \"archetypes\": " + quoteJson(p.archetypes) +
           identity("grammar", p.grammar) + identity("tables", p.tables) + identity("pipes", p.pipes) +
           ", \"mergeWeight\": " + formatNumber(p.mergeWeight) + ", \"ruleWeight\": " + formatNumber(p.ruleWeight) +
           (p.jitter == kUsualJitter ? std::string() : ", \"jitter\": " + formatNumber(p.jitter)) + weights +
           (p.spatial.empty() ? std::string() : ", \"spatial\": " + quoteJson(p.spatial)) +
           (p.mirror ? ", \"mirror\": true" : "") + ", \"exemplarSegments\": " + std::to_string(p.exemplarSegments) +
           ", \"exemplarInstances\": " + std::to_string(p.exemplarInstances) +
           ", \"exemplars\": " + std::to_string(p.exemplars) + ", \"note\": " + quoteJson(p.note) + "}";
}

std::string identityOfText(std::string_view text)
{
    Hash64 hash;
    hash.bytes(text);
    return hexDigits(hash.result());
}

} // namespace

std::string printSpecies(const Species& species)
{
    std::string out = "{\n  \"espalier\": \"species\",\n  \"version\": " + std::to_string(kVersion) +
                      ",\n  \"name\": " + quoteJson(species.name) + ",\n  \"grammar\": [\n";
    printLines(out, species.grammar);
    out += "  ],\n" + tablesText(species) + windowText(species);
    out += "  \"appearance\": " + appearanceText(species.appearance, &species.appearance.pipes, "  ") + ",\n";
    out += provenanceText(species.provenance);
    printMemory(out, species);
    return out + "\n}\n";
}

Expected<Species> loadSpecies(const std::filesystem::path& path, const Limits& limits)
{
    auto text = readTextFile(path, limits.fileBytes);
    if (!text)
        return tl::make_unexpected(text.error());
    return parseSpecies(std::move(*text), path.string(), limits);
}

Expected<void> saveSpecies(const std::filesystem::path& path, const Species& species, const Limits& limits)
{
    const std::string text = printSpecies(species);
    const auto back = parseSpecies(text, path.string(), limits);
    if (!back)
        return tl::make_unexpected(back.error());
    if (printSpecies(*back) != text) // comparing the two would print both grammars
        return failure(ErrorKind::BadInput, {path.string(), 0, 0}, "the species would not read back as it is",
                       "names that its grammar's text can tell apart");
    return writeFileAtomically(path, text);
}

std::string identityOf(const Grammar& grammar)
{
    return identityOfText(printGrammar(grammar));
}

std::string tablesIdentityOf(const Species& species)
{
    return identityOfText(tablesText(species) + windowText(species));
}

std::string identityOf(const PipeModel& pipes)
{
    return identityOfText(pipesText(pipes));
}

std::uint64_t hashOf(const Species& species)
{
    Hash64 hash;
    hash.bytes(printSpecies(species));
    return hash.result();
}

} // namespace espalier
