#include <Espalier/Archetype/Archetype.h>

#include <Espalier/Core/File.h>
#include <Espalier/Core/Json.h>
#include <algorithm>
#include <map>

namespace espalier {

namespace {

constexpr std::uint64_t kVersion = 1;

/// Copies the value of an Expected into `target`, or returns its error from the enclosing function.
#define ESPALIER_READ(target, expression)                                                                              \
    do                                                                                                                 \
    {                                                                                                                  \
        auto read_ = (expression);                                                                                     \
        if (!read_)                                                                                                    \
            return tl::make_unexpected(read_.error());                                                                 \
        target = *read_;                                                                                               \
    } while (false)

Expected<void> readHeader(const JsonDocument::Value& root)
{
    if (auto done = root.requireFormat("archetype", kVersion); !done)
        return done;
    return root.requireObject("an archetype", {"espalier", "version", "library", "trees"});
}

/// Reads NODEs depth first with a stack of its own, so that nesting costs no call stack.
class TreeReader
{
public:
    TreeReader(Archetype& archetype, const Limits& limits) : archetype_(archetype), limits_(limits)
    {
        for (std::uint32_t i = 0; i < archetype.library.templates.size(); ++i)
            pieces_.emplace(archetype.library.templates[i].name, i);
    }

    Expected<void> read(const JsonDocument::Value& root)
    {
        pending_.push_back({root, kNoInstance, 0});
        while (!pending_.empty())
        {
            const Pending next = pending_.back();
            pending_.pop_back();
            if (auto done = node(next); !done)
                return done;
        }
        return {};
    }

private:
    struct Pending
    {
        JsonDocument::Value value;
        std::uint32_t parent;
        std::uint32_t anchor;
    };

    Expected<void> node(const Pending& next)
    {
        const JsonDocument::Value& value = next.value;
        if (auto done = value.requireObject("a template instance",
                                            {"template", "scaling", "rotation", "branchingAngle", "roll", "children"});
            !done)
            return done;
        if (archetype_.instances.size() >= limits_.nodes)
            return failure(ErrorKind::Limit, value.where(),
                           "the archetype has more than " + std::to_string(limits_.nodes) + " instances",
                           "at most the limit nodes");
        const auto name = value.required("template", "the name of a template");
        if (!name)
            return tl::make_unexpected(name.error());
        std::string_view text;
        ESPALIER_READ(text, name->string("template"));
        TemplateInstance instance;
        instance.parent = next.parent;
        instance.anchor = next.anchor;
        const auto found = pieces_.find(text);
        if (found == pieces_.end())
            return name->fail("the library " + quoteJson(shortened(archetype_.libraryName)) + " has no template " +
                                  quoteJson(shortened(text)),
                              "one of " + templateNames());
        instance.piece = found->second;

        InstanceTransform& transform = instance.transform;
        if (const auto scaling = value["scaling"]; scaling.exists())
        {
            ESPALIER_READ(transform.scaling, scaling.number("scaling", 0, limits_.coordinate));
            if (!(transform.scaling > 0))
                return scaling.fail("the scaling is " + formatNumber(transform.scaling), "a number above 0");
        }
        if (const auto rotation = value["rotation"]; rotation.exists())
            ESPALIER_READ(transform.rotation, rotation.number("rotation", -limits_.angleDegrees, limits_.angleDegrees));
        if (const auto angle = value["branchingAngle"]; angle.exists())
            ESPALIER_READ(transform.branchingAngle,
                          angle.number("branchingAngle", -limits_.angleDegrees, limits_.angleDegrees));
        if (const auto roll = value["roll"]; roll.exists())
            ESPALIER_READ(transform.roll, roll.number("roll", -limits_.angleDegrees, limits_.angleDegrees));

        const auto index = static_cast<std::uint32_t>(archetype_.instances.size());
        archetype_.instances.push_back(instance);
        return children(value["children"], index, archetype_.library.templates[instance.piece]);
    }

    Expected<void> children(const JsonDocument::Value& value, std::uint32_t parent, const Template& piece)
    {
        if (!value.exists())
            return {};
        if (auto done = value.requireObject("children"); !done)
            return done;
        const std::size_t first = pending_.size();
        for (const JsonDocument::Value& child : value.items())
        {
            const std::size_t anchor = child.key().size() == 1 ? piece.anchors.find(child.key()[0]) : std::string::npos;
            if (anchor == std::string::npos)
            {
                return failure(ErrorKind::BadInput, child.whereKey(),
                               "the template " + piece.name + " has no anchor " + quoteJson(shortened(child.key())),
                               piece.anchors.empty() ? "no children, for it has no anchors"
                                                     : "one of its anchors: " + spaced(piece.anchors));
            }
            if (!child.isNull())
                pending_.push_back({child, parent, static_cast<std::uint32_t>(anchor)});
        }
        std::reverse(pending_.begin() + static_cast<std::ptrdiff_t>(first), pending_.end());
        return {};
    }

    static std::string spaced(std::string_view letters)
    {
        std::string text;
        for (const char letter : letters)
            text += (text.empty() ? "" : " ") + std::string(1, letter);
        return text;
    }

    std::string templateNames() const
    {
        constexpr std::size_t kMost = 12;
        std::string text;
        const auto& templates = archetype_.library.templates;
        for (std::size_t i = 0; i < std::min(templates.size(), kMost); ++i)
            text += (i == 0 ? "" : ", ") + templates[i].name;
        return templates.size() > kMost ? text + ", ..." : text;
    }

    Archetype& archetype_;
    const Limits& limits_;
    std::map<std::string, std::uint32_t, std::less<>> pieces_; ///< Templates by name.
    std::vector<Pending> pending_;
};

/// An instance nests two levels of JSON, so the depth that generations allow must be readable.
Limits jsonLimits(const Limits& limits)
{
    Limits result = limits;
    result.jsonDepth = std::max(limits.jsonDepth, 2 * limits.generations + 2);
    return result;
}

Expected<Archetype> readTrees(const JsonDocument& document, const TemplateLibrary& library, const Limits& limits)
{
    Archetype archetype;
    archetype.library = library;
    const auto name = document.root().required("library", "\"name.templates\"");
    if (!name)
        return tl::make_unexpected(name.error());
    ESPALIER_READ(archetype.libraryName, name->string("library"));
    const auto trees = document.root().required("trees", "an array of template instances");
    if (!trees)
        return tl::make_unexpected(trees.error());
    if (auto done = trees->requireArray("trees"); !done)
        return tl::make_unexpected(done.error());
    if (trees->size() == 0)
        return trees->fail("the archetype has no tree", "at least one template instance in \"trees\"");
    TreeReader reader(archetype, limits);
    for (const JsonDocument::Value& tree : trees->items())
        if (auto done = reader.read(tree); !done)
            return tl::make_unexpected(done.error());
    return archetype;
}

/// The library's file, looked up beside the archetype and in the folders.
Expected<std::filesystem::path> findLibrary(const JsonDocument::Value& value,
                                            const std::filesystem::path& archetypePath, const ArchetypeFolders& folders)
{
    std::string_view name;
    ESPALIER_READ(name, value.string("library"));
    const std::filesystem::path relative{std::string(name)};
    const bool leaves = name.empty() || relative.is_absolute() || name.find('\\') != std::string_view::npos ||
                        name.find('\0') != std::string_view::npos ||
                        std::ranges::find(relative, std::filesystem::path("..")) != relative.end();
    if (leaves)
        return value.fail("the library path " + quoteJson(shortened(name)) + " leaves the folders it is looked up in",
                          "a file name such as \"broadleaf.templates\", beside the archetype or in a template folder");
    std::vector<std::filesystem::path> candidates{archetypePath.parent_path()};
    candidates.insert(candidates.end(), folders.templates.begin(), folders.templates.end());
    std::string searched;
    for (const std::filesystem::path& folder : candidates)
    {
        std::error_code ignored;
        if (std::filesystem::path path = folder / relative; std::filesystem::is_regular_file(path, ignored))
            return path;
        searched += (searched.empty() ? "" : ", ") + (folder.empty() ? "." : folder.string());
    }
    return value.fail("the library " + quoteJson(shortened(name)) + " is not found in " + searched,
                      "an existing template library", "name further folders with --templates");
}

} // namespace

Expected<Archetype> parseArchetype(std::string text, std::string_view file, const TemplateLibrary& library,
                                   const Limits& limits)
{
    auto document = JsonDocument::parse(std::move(text), std::string(file), jsonLimits(limits));
    if (!document)
        return tl::make_unexpected(document.error());
    if (auto done = readHeader(document->root()); !done)
        return tl::make_unexpected(done.error());
    return readTrees(*document, library, limits);
}

Expected<Archetype> loadArchetype(const std::filesystem::path& path, const ArchetypeFolders& folders,
                                  const Limits& limits)
{
    auto text = readTextFile(path, limits.fileBytes);
    if (!text)
        return tl::make_unexpected(text.error());
    auto document = JsonDocument::parse(std::move(*text), path.string(), jsonLimits(limits));
    if (!document)
        return tl::make_unexpected(document.error());
    if (auto done = readHeader(document->root()); !done)
        return tl::make_unexpected(done.error());
    const auto name = document->root().required("library", "\"name.templates\"");
    if (!name)
        return tl::make_unexpected(name.error());
    const auto libraryPath = findLibrary(*name, path, folders);
    if (!libraryPath)
        return tl::make_unexpected(libraryPath.error());
    const auto library = loadTemplates(*libraryPath, limits);
    if (!library)
        return tl::make_unexpected(library.error());
    return readTrees(*document, *library, limits);
}

std::string printArchetype(const Archetype& archetype)
{
    const AnchorTable anchors = anchorsOf(archetype);
    std::string out = "{\n  \"espalier\": \"archetype\",\n  \"version\": " + std::to_string(kVersion) +
                      ",\n  \"library\": " + quoteJson(archetype.libraryName) + ",\n  \"trees\": [\n";

    // Deeper down the text stops moving right: a chain of thousands would otherwise be a file of blanks.
    constexpr std::size_t kMostIndent = 80;

    // A node, then its children behind it: a stack of instances, each with the next anchor to look at.
    struct Step
    {
        std::uint32_t instance;
        std::uint32_t anchor;
        std::size_t indent;
    };
    const InstanceTransform defaults;
    const auto open = [&](std::uint32_t index, std::string& text) {
        const InstanceTransform& t = archetype.instances[index].transform;
        text += "{\"template\": " + quoteJson(archetype.library.templates[archetype.instances[index].piece].name);
        const auto number = [&](std::string_view key, double value, double usual) {
            if (value != usual)
                text += ", \"" + std::string(key) + "\": " + formatNumber(value);
        };
        number("scaling", t.scaling, defaults.scaling);
        number("rotation", t.rotation, defaults.rotation);
        number("branchingAngle", t.branchingAngle, defaults.branchingAngle);
        number("roll", t.roll, defaults.roll);
    };
    for (std::size_t tree = 0; tree < anchors.roots.size(); ++tree)
    {
        std::vector<Step> steps{{anchors.roots[tree], 0, 4}};
        std::vector<bool> hasChild{false};
        out.append(4, ' ');
        open(anchors.roots[tree], out);
        while (!steps.empty())
        {
            Step& step = steps.back();
            const std::string& letters = archetype.library.templates[archetype.instances[step.instance].piece].anchors;
            while (step.anchor < letters.size() &&
                   anchors.children[anchors.firstChild[step.instance] + step.anchor] == kNoInstance)
                ++step.anchor;
            if (step.anchor == letters.size())
            {
                out += hasChild.back() ? "}}" : "}";
                steps.pop_back();
                hasChild.pop_back();
                continue;
            }
            const std::uint32_t child = anchors.children[anchors.firstChild[step.instance] + step.anchor];
            out += hasChild.back() ? ",\n" : ", \"children\": {\n";
            hasChild.back() = true;
            const std::size_t indent = std::min(step.indent + 2, kMostIndent);
            out.append(indent, ' ');
            out += "\"" + std::string(1, letters[step.anchor]) + "\": ";
            ++step.anchor;
            open(child, out);
            steps.push_back({child, 0, indent});
            hasChild.push_back(false);
        }
        out += tree + 1 < anchors.roots.size() ? ",\n" : "\n";
    }
    return out + "  ]\n}\n";
}

Expected<void> saveArchetype(const std::filesystem::path& path, const Archetype& archetype, const Limits& limits)
{
    if (auto done = validate(archetype, limits); !done)
        return done;
    // What is written must be readable.
    std::vector<std::uint32_t> depths;
    for (const TemplateInstance& instance : archetype.instances)
    {
        depths.push_back(instance.parent == kNoInstance ? 1 : depths[instance.parent] + 1);
        if (depths.back() > limits.generations)
            return failure(ErrorKind::Limit, {path.string(), 0, 0},
                           "the archetype is more than " + std::to_string(limits.generations) + " instances deep",
                           "at most the limit generations");
    }
    return writeFileAtomically(path, printArchetype(archetype));
}

} // namespace espalier
