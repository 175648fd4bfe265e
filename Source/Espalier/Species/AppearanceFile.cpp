#include <Espalier/Species/AppearanceFile.h>

#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Core/File.h>
#include <Espalier/Species/AppearanceText.h>
#include <Espalier/Species/JsonFields.h>
#include <algorithm>
#include <array>
#include <span>
#include <variant>

// Each object of the file is described once, as a table of its keys; reading and printing both follow the tables.

namespace espalier {
namespace {

constexpr std::uint64_t kVersion = 1;
using Value = JsonDocument::Value;

constexpr std::array<std::string_view, 5> kBarkKinds{"furrowed", "papery", "scaly", "ringed", "smooth"};
constexpr std::array<std::string_view, 7> kLeafShapes{"ovate",  "lobed",  "lanceolate", "deltoid",
                                                      "linear", "needle", "blossom"};
constexpr std::array<std::string_view, 4> kLeafArrangements{"spiral", "alternate", "opposite", "whorled"};
constexpr std::array<std::string_view, 3> kLeafForms{"blade", "crossed", "ball"};

std::span<const std::string_view> namesOf(BarkKind)
{
    return kBarkKinds;
}
std::span<const std::string_view> namesOf(LeafShape)
{
    return kLeafShapes;
}
std::span<const std::string_view> namesOf(LeafArrangement)
{
    return kLeafArrangements;
}
std::span<const std::string_view> namesOf(LeafForm)
{
    return kLeafForms;
}

enum class Unit : std::uint8_t
{
    Plain,
    Degrees, ///< In the file; radians in memory.
};

/// Whether a key is printed where its value is the usual one.
enum class Mention : std::uint8_t
{
    WhenUnusual,
    Always,
};

/// One key of an object of the file, and the member that it fills.
template <class Object>
struct Key
{
    std::string_view name;
    std::variant<float Object::*, Vec3 Object::*, std::uint32_t Object::*, bool Object::*, std::string Object::*,
                 BarkKind Object::*, LeafShape Object::*, LeafArrangement Object::*, LeafForm Object::*>
        member;
    double low = 0; ///< Of numbers, in the file's unit.
    double high = 1;
    Unit unit = Unit::Plain;
    Mention mention = Mention::WhenUnusual;
};

const std::array kBarkKeys{
    Key<BarkAppearance>{"colour", &BarkAppearance::colour, 0, 1, Unit::Plain, Mention::Always},
    Key<BarkAppearance>{"roughness", &BarkAppearance::roughness, 0, 1, Unit::Plain, Mention::Always},
    Key<BarkAppearance>{"tile", &BarkAppearance::tile, 1e-3, 100, Unit::Plain, Mention::Always},
    Key<BarkAppearance>{"tileHeight", &BarkAppearance::tileHeight, 1, kMaxTileHeight},
    Key<BarkAppearance>{"kind", &BarkAppearance::kind},
    Key<BarkAppearance>{"relief", &BarkAppearance::relief, 0, 0.5},
    Key<BarkAppearance>{"youngTint", &BarkAppearance::youngTint},
    Key<BarkAppearance>{"youngRadius", &BarkAppearance::youngRadius, 0, 10},
    Key<BarkAppearance>{"shade", &BarkAppearance::shade},
    Key<BarkAppearance>{"rootFlare", &BarkAppearance::rootFlare, 0, 4},
    Key<BarkAppearance>{"rootLength", &BarkAppearance::rootLength, 0, 20},
    Key<BarkAppearance>{"rootLobes", &BarkAppearance::rootLobes, 0, kMaxRootLobes},
    Key<BarkAppearance>{"rootDepth", &BarkAppearance::rootDepth, 0, 2},
};

const std::array kLeafKeys{
    Key<LeafAppearance>{"shape", &LeafAppearance::shape, 0, 0, Unit::Plain, Mention::Always},
    Key<LeafAppearance>{"form", &LeafAppearance::form},
    Key<LeafAppearance>{"leaves", &LeafAppearance::leaves, 1, 64},
    Key<LeafAppearance>{"length", &LeafAppearance::length, 0.001, 20, Unit::Plain, Mention::Always},
    Key<LeafAppearance>{"lengthSpread", &LeafAppearance::lengthSpread},
    Key<LeafAppearance>{"width", &LeafAppearance::width, 0.01, 4},
    Key<LeafAppearance>{"taper", &LeafAppearance::taper},
    Key<LeafAppearance>{"stalk", &LeafAppearance::stalk, 0, 0.9},
    Key<LeafAppearance>{"fold", &LeafAppearance::fold, 0, 68, Unit::Degrees},
    Key<LeafAppearance>{"arch", &LeafAppearance::arch, -0.4, 0.4},
    Key<LeafAppearance>{"thickestWood", &LeafAppearance::thickestWood, 1e-6, 10, Unit::Plain, Mention::Always},
    Key<LeafAppearance>{"spacing", &LeafAppearance::spacing, 0.001, 100, Unit::Plain, Mention::Always},
    Key<LeafAppearance>{"arrangement", &LeafAppearance::arrangement},
    Key<LeafAppearance>{"perNode", &LeafAppearance::perNode, 1, 16},
    Key<LeafAppearance>{"atTip", &LeafAppearance::atTip},
    Key<LeafAppearance>{"density", &LeafAppearance::density},
    Key<LeafAppearance>{"shade", &LeafAppearance::shade},
    Key<LeafAppearance>{"angle", &LeafAppearance::angle, 0, 180, Unit::Degrees},
    Key<LeafAppearance>{"angleSpread", &LeafAppearance::angleSpread, 0, 180, Unit::Degrees},
    Key<LeafAppearance>{"droop", &LeafAppearance::droop},
    Key<LeafAppearance>{"facing", &LeafAppearance::facing},
    Key<LeafAppearance>{"colour", &LeafAppearance::colour, 0, 1, Unit::Plain, Mention::Always},
    Key<LeafAppearance>{"colourSpread", &LeafAppearance::colourSpread},
    Key<LeafAppearance>{"translucency", &LeafAppearance::translucency},
    Key<LeafAppearance>{"roughness", &LeafAppearance::roughness},
    Key<LeafAppearance>{"crownNormals", &LeafAppearance::crownNormals},
};

const std::array kSeasonalKeys{
    Key<SeasonalLeaves>{"colour", &SeasonalLeaves::colour, 0, 1, Unit::Plain, Mention::Always},
    Key<SeasonalLeaves>{"colourSpread", &SeasonalLeaves::colourSpread},
    Key<SeasonalLeaves>{"density", &SeasonalLeaves::density},
};

const std::array kWindKeys{
    Key<WindAppearance>{"trunk", &WindAppearance::trunk, 0, 10},
    Key<WindAppearance>{"boughs", &WindAppearance::boughs, 0, 10},
    Key<WindAppearance>{"flutter", &WindAppearance::flutter, 0, 10},
};

const std::array kImageKeys{
    Key<ImageNames>{"colour", &ImageNames::colour},
    Key<ImageNames>{"normal", &ImageNames::normal},
    Key<ImageNames>{"roughness", &ImageNames::roughness},
};

const std::array kPipeKeys{
    Key<PipeModel>{"tipRadius", &PipeModel::tipRadius, 1e-5, 1, Unit::Plain, Mention::Always},
    Key<PipeModel>{"exponent", &PipeModel::exponent, 1, 4, Unit::Plain, Mention::Always},
    Key<PipeModel>{"pipesPerMetre", &PipeModel::pipesPerMetre, 0, 1000, Unit::Plain, Mention::Always},
};

Expected<void> readColour(const Value& value, Vec3& colour)
{
    if (auto done = value.requireArray("colour"); !done)
        return done;
    const std::vector<Value> items = value.items();
    if (items.size() != 3)
        return value.fail("the colour has " + std::to_string(items.size()) + " components",
                          "red, green and blue, linear, from 0 to 1");
    for (int i = 0; i < 3; ++i)
    {
        const auto component = items[static_cast<std::size_t>(i)].number("a colour component", 0, 1);
        if (!component)
            return tl::make_unexpected(component.error());
        colour[i] = static_cast<float>(*component);
    }
    return {};
}

/// Whether a name means a picture in the folder, or in one below it, on every system.
bool isPictureInside(std::string_view name)
{
    const std::filesystem::path path(name);
    const auto isOdd = [](char c) { return static_cast<unsigned char>(c) < ' ' || c == ':' || c == '\\'; };
    return path.extension() == ".png" && !path.has_root_path() && std::ranges::none_of(name, isOdd) &&
           std::ranges::find(path, "..") == path.end();
}

/// Reads the value of a key into whatever the key fills.
template <class Object>
struct KeyReader
{
    const Value& value;
    const Key<Object>& key;
    Object& object;

    Expected<void> operator()(float Object::*member) const
    {
        const double scale = key.unit == Unit::Degrees ? math::kRadiansPerDegree : 1;
        return value.number(key.name, key.low, key.high).map([&](double number) {
            object.*member = static_cast<float>(number * scale);
        });
    }
    Expected<void> operator()(Vec3 Object::*member) const { return readColour(value, object.*member); }
    Expected<void> operator()(std::uint32_t Object::*member) const
    {
        return value.count(key.name, static_cast<std::uint64_t>(key.low), static_cast<std::uint64_t>(key.high))
            .map([&](std::uint64_t count) { object.*member = static_cast<std::uint32_t>(count); });
    }
    Expected<void> operator()(bool Object::*member) const
    {
        return value.boolean(key.name).map([&](bool is) { object.*member = is; });
    }
    /// The only texts are names of pictures.
    Expected<void> operator()(std::string Object::*member) const
    {
        const auto name = value.string(key.name);
        if (!name)
            return tl::make_unexpected(name.error());
        if (!isPictureInside(*name))
            return value.fail("the picture is " + quoteJson(shortened(*name)),
                              "a .png file in the folder of this file or below it, such as \"bark/colour.png\"");
        object.*member = *name;
        return {};
    }
    template <class Choice>
    Expected<void> operator()(Choice Object::*member) const
    {
        const auto text = value.string(key.name);
        if (!text)
            return tl::make_unexpected(text.error());
        const std::span<const std::string_view> names = namesOf(Choice{});
        const auto found = std::ranges::find(names, *text);
        if (found == names.end())
        {
            std::string known;
            for (const std::string_view name : names)
                known.append(known.empty() ? "" : ", ").append(name);
            return value.fail(std::string(key.name) + " is " + quoteJson(shortened(*text)), "one of " + known);
        }
        object.*member = static_cast<Choice>(found - names.begin());
        return {};
    }
};

template <class Object, std::size_t N>
Expected<void> readObject(const Value& value, std::string_view role, const std::array<Key<Object>, N>& keys,
                          Object& object)
{
    std::array<std::string_view, N> names;
    std::ranges::transform(keys, names.begin(), &Key<Object>::name);
    if (auto done = value.requireObject(role, names); !done)
        return done;
    for (const Key<Object>& key : keys)
        if (const Value given = value[key.name]; given.exists())
            if (auto done = std::visit(KeyReader<Object>{given, key, object}, key.member); !done)
                return done;
    return {};
}

/// An array of at most `most` entries, each read by `reader(value, entry)`.
template <class Entry, class Reader>
Expected<void> readList(const Value& value, std::string_view role, std::size_t least, std::size_t most,
                        std::vector<Entry>& entries, Reader&& reader)
{
    if (auto done = value.requireArray(role); !done)
        return done;
    const std::vector<Value> items = value.items();
    if (items.size() < least || items.size() > most)
        return value.fail(std::string(role) + " has " + std::to_string(items.size()) + " entries",
                          (least > 0 ? "from " + std::to_string(least) + " to " : "at most ") + std::to_string(most));
    entries.assign(items.size(), Entry{});
    for (std::size_t i = 0; i < items.size(); ++i)
        if (auto done = reader(items[i], entries[i]); !done)
            return done;
    return {};
}

Expected<void> readBark(const Value& value, BarkAppearance& bark)
{
    return readObject(value, "bark", kBarkKeys, bark).map([&] {
        if (!value["roughness"].exists())
            bark.roughness = usualRoughness(bark.kind);
    });
}

Expected<void> readSeason(const Value& value, std::string_view name, Season& season)
{
    season.name = name;
    return readList(value, "a season", 0, kMaxLeafKinds, season.leaves, [](const Value& v, SeasonalLeaves& leaves) {
        return readObject(v, "leaves of a season", kSeasonalKeys, leaves);
    });
}

Expected<void> readSeasons(const Value& value, std::vector<Season>& seasons)
{
    if (auto done = value.requireObject("seasons"); !done)
        return done;
    if (value.size() > kMaxSeasons)
        return value.fail("there are " + std::to_string(value.size()) + " seasons",
                          "at most " + std::to_string(kMaxSeasons));
    for (const Value& item : value.items())
    {
        if (item.key().empty())
            return item.fail("the season has no name", "a name, such as \"autumn\"");
        if (auto done = readSeason(item, item.key(), seasons.emplace_back()); !done)
            return done;
    }
    return {};
}

Expected<void> readImageNames(const Value& value, std::string_view role, ImageNames& images)
{
    if (auto done = readObject(value, role, kImageKeys, images); !done)
        return done;
    if (images.colour.empty() && images != ImageNames{})
        return value.fail(std::string(role) + " have no colour", "\"colour\" beside \"normal\" and \"roughness\"");
    return {};
}

/// Bark's come first, then those of leaves by kind.
Expected<void> readImages(const Value& value, std::vector<ImageNames>& images)
{
    if (auto done = value.requireObject("images", {"bark", "leaves"}); !done)
        return done;
    images.assign(1, {});
    if (const Value bark = value["bark"]; bark.exists())
        if (auto done = readImageNames(bark, "images of bark", images[0]); !done)
            return done;
    std::vector<ImageNames> leaves;
    if (const Value given = value["leaves"]; given.exists())
        if (auto done = readList(
                given, "images of leaves", 0, kMaxLeafKinds, leaves,
                [](const Value& item, ImageNames& of) { return readImageNames(item, "images of a leaf", of); });
            !done)
            return done;
    images.insert(images.end(), leaves.begin(), leaves.end());
    while (!images.empty() && images.back() == ImageNames{})
        images.pop_back();
    return {};
}

/// A degree's shortest text that reads back as this angle.
std::string degreesText(float radians)
{
    const double degrees = static_cast<double>(radians) / math::kRadiansPerDegree;
    std::array<char, 40> buffer;
    for (int digits = 1; digits <= 17; ++digits)
    {
        const auto end =
            std::to_chars(buffer.data(), buffer.data() + buffer.size(), degrees, std::chars_format::general, digits)
                .ptr;
        double back = 0;
        std::from_chars(buffer.data(), end, back);
        if (static_cast<float>(back * math::kRadiansPerDegree) == radians)
            return formatNumber(back);
    }
    return formatNumber(degrees);
}

std::string colourText(const Vec3& colour)
{
    return "[" + shortest(colour.x) + ", " + shortest(colour.y) + ", " + shortest(colour.z) + "]";
}

template <class Object>
struct KeyPrinter
{
    const Key<Object>& key;
    const Object& object;

    std::string operator()(float Object::*member) const
    {
        return key.unit == Unit::Degrees ? degreesText(object.*member) : shortest(object.*member);
    }
    std::string operator()(Vec3 Object::*member) const { return colourText(object.*member); }
    std::string operator()(std::uint32_t Object::*member) const { return std::to_string(object.*member); }
    std::string operator()(bool Object::*member) const { return object.*member ? "true" : "false"; }
    std::string operator()(std::string Object::*member) const { return quoteJson(object.*member); }
    template <class Choice>
    std::string operator()(Choice Object::*member) const
    {
        return quoteJson(namesOf(Choice{})[static_cast<std::size_t>(object.*member)]);
    }
};

template <class Object, std::size_t N>
std::string objectText(const std::array<Key<Object>, N>& keys, const Object& object)
{
    static const Object usual{};
    std::string text;
    for (const Key<Object>& key : keys)
    {
        const bool isUsual = std::visit([&](auto member) { return object.*member == usual.*member; }, key.member);
        if (!isUsual || key.mention == Mention::Always)
            text += (text.empty() ? "\"" : ", \"") + std::string(key.name) +
                    "\": " + std::visit(KeyPrinter<Object>{key, object}, key.member);
    }
    return "{" + text + "}";
}

/// An array with an entry a line.
template <class Entry, std::size_t N>
std::string listText(const std::array<Key<Entry>, N>& keys, const std::vector<Entry>& entries,
                     const std::string& indent)
{
    std::string text = "[";
    for (std::size_t i = 0; i < entries.size(); ++i)
        text += (i == 0 ? "\n" : ",\n") + indent + "  " + objectText(keys, entries[i]);
    return text + (entries.empty() ? "]" : "\n" + indent + "]");
}

std::string imagesText(const std::vector<ImageNames>& images, const std::string& indent)
{
    const std::string inner = indent + "  ";
    std::string text = images[0] == ImageNames{} ? "" : inner + "\"bark\": " + objectText(kImageKeys, images[0]);
    if (images.size() > 1)
        text += (text.empty() ? "" : ",\n") + inner +
                "\"leaves\": " + listText(kImageKeys, {images.begin() + 1, images.end()}, inner);
    return "{\n" + text + "\n" + indent + "}";
}

} // namespace

Expected<void> readAppearance(const Value& value, Appearance& appearance, PipeModel* pipes)
{
    constexpr std::array<std::string_view, 7> kKeys{"bark", "leaves", "seasons", "wind", "palette", "images", "pipes"};
    // Files of an appearance alone begin with their head.
    constexpr std::array<std::string_view, 8> kFileKeys{"espalier", "version", "bark",    "leaves",
                                                        "seasons",  "wind",    "palette", "images"};
    const std::span<const std::string_view> keys = pipes ? std::span<const std::string_view>(kKeys) : kFileKeys;
    if (auto done = value.requireObject("appearance", keys); !done)
        return done;
    Fields fields(value);
    if (pipes)
        fields.read("pipes", [&](const Value& v) { return readObject(v, "pipes", kPipeKeys, *pipes); });
    return fields.read("bark", [&](const Value& v) { return readBark(v, appearance.bark); })
        .read("leaves",
              [&](const Value& v) {
                  return readList(v, "leaves", 0, kMaxLeafKinds, appearance.leaves,
                                  [](const Value& item, LeafAppearance& leaf) {
                                      return readObject(item, "a kind of leaf", kLeafKeys, leaf);
                                  });
              })
        .read("seasons", [&](const Value& v) { return readSeasons(v, appearance.seasons); })
        .read("wind", [&](const Value& v) { return readObject(v, "wind", kWindKeys, appearance.wind); })
        .read("palette",
              [&](const Value& v) { return readList(v, "palette", 1, kMaxPalette, appearance.palette, readColour); })
        .read("images", [&](const Value& v) { return readImages(v, appearance.images); })
        .result();
}

std::string appearanceText(const Appearance& appearance, const PipeModel* pipes, std::string_view indent)
{
    const std::string inner = std::string(indent) + "  ";
    std::string text = pipes ? "{\n" + inner + "\"pipes\": " + pipesText(*pipes) + ",\n" : "{\n";
    text += inner + "\"bark\": " + objectText(kBarkKeys, appearance.bark);
    if (!appearance.leaves.empty())
        text += ",\n" + inner + "\"leaves\": " + listText(kLeafKeys, appearance.leaves, inner);
    for (std::size_t i = 0; i < appearance.seasons.size(); ++i)
    {
        const Season& season = appearance.seasons[i];
        text += i == 0 ? ",\n" + inner + "\"seasons\": {\n" : ",\n";
        text += inner + "  " + quoteJson(season.name) + ": " + listText(kSeasonalKeys, season.leaves, inner + "  ");
    }
    if (!appearance.seasons.empty())
        text += "\n" + inner + "}";
    if (appearance.wind != WindAppearance{})
        text += ",\n" + inner + "\"wind\": " + objectText(kWindKeys, appearance.wind);
    if (appearance.palette != defaultPalette())
    {
        text += ",\n" + inner + "\"palette\": [";
        for (std::size_t i = 0; i < appearance.palette.size(); ++i)
            text += (i == 0 ? "" : ", ") + colourText(appearance.palette[i]);
        text += "]";
    }
    if (!appearance.images.empty())
        text += ",\n" + inner + "\"images\": " + imagesText(appearance.images, inner);
    return text + "\n" + std::string(indent) + "}";
}

std::string pipesText(const PipeModel& pipes)
{
    return objectText(kPipeKeys, pipes);
}

Expected<Appearance> parseAppearance(std::string text, std::string_view file, const Limits& limits)
{
    const auto document = JsonDocument::parse(std::move(text), std::string(file), limits);
    if (!document)
        return tl::make_unexpected(document.error());
    const Value root = document->root();
    if (auto done = root.requireFormat("appearance", kVersion); !done)
        return tl::make_unexpected(done.error());
    Appearance appearance;
    if (auto done = readAppearance(root, appearance, nullptr); !done)
        return tl::make_unexpected(done.error());
    return appearance;
}

std::string printAppearance(const Appearance& appearance)
{
    const std::string object = appearanceText(appearance, nullptr, "");
    return "{\n  \"espalier\": \"appearance\",\n  \"version\": " + std::to_string(kVersion) + "," + object.substr(1) +
           "\n";
}

Expected<Appearance> loadAppearance(const std::filesystem::path& path, const Limits& limits)
{
    auto text = readTextFile(path, limits.fileBytes);
    if (!text)
        return tl::make_unexpected(text.error());
    return parseAppearance(std::move(*text), path.string(), limits);
}

} // namespace espalier
