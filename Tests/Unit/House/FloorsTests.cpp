// The floor plan of the house, kept: a file includes only its own folder and lower floors, what a game links knows
// nothing of what tools link, and every foreign library has the few folders that may know it.

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

namespace {

namespace fs = std::filesystem;

const fs::path kSourceFolder = fs::path(ESPALIER_SOURCE_ROOT) / "Source";

/// Which library a folder belongs to. Authoring links runtime, never the other way.
enum class Library
{
    Runtime,
    Authoring,
};

struct Floor
{
    int height;
    Library library;
};

/// Every folder that Source/Espalier may have. One that is not built yet has its place already.
const std::map<std::string, Floor, std::less<>> kFloors = {
    {"Core", {1, Library::Runtime}},        {"Grammar", {2, Library::Runtime}}, {"Plant", {2, Library::Runtime}},
    {"Layout", {2, Library::Authoring}},    {"Turtle", {3, Library::Runtime}},  {"Colonization", {3, Library::Runtime}},
    {"Overlap", {3, Library::Runtime}},     {"Species", {4, Library::Runtime}}, {"Archetype", {4, Library::Authoring}},
    {"Inference", {5, Library::Authoring}}, {"Mesh", {5, Library::Runtime}},    {"Texture", {5, Library::Authoring}},
    {"Forest", {6, Library::Runtime}},      {"Bake", {6, Library::Authoring}},  {"Render", {6, Library::Authoring}},
    {"Plugin", {7, Library::Runtime}},
};

/// A foreign header by how its path begins, and the folders that may include it; none listed means all may.
struct ForeignHeader
{
    std::string_view prefix;
    std::set<std::string_view> folders;
};

const std::vector<ForeignHeader> kForeignHeaders = {
    {"glm/", {}},
    {"tl/expected.hpp", {}},
    {"nlohmann/", {"Core", "Bake"}},
    {"embree3/", {"Overlap", "Render"}},
    {"tiny_gltf.h", {"Bake"}},
    {"meshoptimizer.h", {"Bake"}},
    {"png.h", {"Texture"}},
    {"stb_", {"Texture", "Bake"}},
    // The processor.
    {"emmintrin.h", {"Core"}},
    // The operating system.
    {"fcntl.h", {"Core"}},
    {"unistd.h", {"Core"}},
    {"sys/", {"Core"}},
    {"windows.h", {"Core"}},
    {"io.h", {"Core"}},
};

/// Standard headers whose results differ between standard libraries.
const std::set<std::string_view> kUnreproducibleHeaders = {"random"};

bool isStandardHeader(std::string_view header)
{
    return header.find_first_of("./") == std::string_view::npos;
}

/// Why a file in Source/Espalier/`folder` must not include `header`; empty if it may.
std::string objection(const std::string& folder, const std::string& header)
{
    const Floor& own = kFloors.at(folder);
    if (header.find("..") != std::string::npos)
        return "climbs out of its folder; write <Espalier/Folder/File.h>";
    if (header.starts_with("Tool/") || header.starts_with("Editor/"))
        return "nobody includes the programs";
    if (header.starts_with("Espalier/"))
    {
        const std::string other = fs::path(header).parent_path().filename().string();
        const auto floor = kFloors.find(other);
        if (floor == kFloors.end())
            return "no such folder in the floor plan";
        if (other == folder)
            return {};
        if (floor->second.height >= own.height)
            return "points up or sideways: " + folder + " is on floor " + std::to_string(own.height) + ", " + other +
                   " on floor " + std::to_string(floor->second.height);
        if (own.library == Library::Runtime && floor->second.library == Library::Authoring)
            return "a game links " + folder + ", and only tools link " + other;
        return {};
    }
    if (kUnreproducibleHeaders.contains(header))
        return "its results differ between standard libraries";
    if (isStandardHeader(header))
        return {};
    for (const ForeignHeader& foreign : kForeignHeaders)
        if (header.starts_with(foreign.prefix))
            return foreign.folders.empty() || foreign.folders.contains(folder) ? "" : "is not for " + folder;
    return "a foreign header without a place in the floor plan";
}

/// The header that `line` includes, as written between <> or "".
std::optional<std::string> includedHeader(std::string_view line)
{
    const auto skipBlanks = [&line] { line.remove_prefix(std::min(line.find_first_not_of(" \t"), line.size())); };
    for (const std::string_view word : {"#", "include"})
    {
        skipBlanks();
        if (!line.starts_with(word))
            return {};
        line.remove_prefix(word.size());
    }
    skipBlanks();
    if (!line.starts_with('<') && !line.starts_with('"'))
        return {};
    const std::size_t end = line.find(line.front() == '<' ? '>' : '"', 1);
    return std::string(line.substr(1, end - 1));
}

/// One line `file:line: header: objection` for each include of `text` that must not be there.
std::vector<std::string> violations(const std::string& file, const std::string& folder, const std::string& text)
{
    std::vector<std::string> found;
    std::istringstream lines(text);
    std::string line;
    for (int number = 1; std::getline(lines, line); ++number)
    {
        const std::optional<std::string> header = includedHeader(line);
        const std::string why = header ? objection(folder, *header) : std::string();
        if (!why.empty())
            found.push_back(file + ":" + std::to_string(number) + ": " + *header + ": " + why);
    }
    return found;
}

std::string textOf(const fs::path& path)
{
    std::ifstream stream(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
}

std::vector<fs::path> sourcesIn(const fs::path& folder)
{
    std::vector<fs::path> files;
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder))
        if (entry.path().extension() == ".h" || entry.path().extension() == ".cpp")
            files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    return files;
}

std::string joined(const std::vector<std::string>& lines)
{
    std::string text;
    for (const std::string& line : lines)
        text += line + '\n';
    return text;
}

TEST(Floors, EveryFolderHasItsPlace)
{
    for (const fs::directory_entry& entry : fs::directory_iterator(kSourceFolder / "Espalier"))
    {
        ASSERT_TRUE(entry.is_directory()) << entry.path() << " lies outside the folders";
        const std::string folder = entry.path().filename().string();
        EXPECT_TRUE(kFloors.contains(folder)) << folder << " is not in the floor plan";
        EXPECT_FALSE(sourcesIn(entry.path()).empty()) << folder << " is empty";
    }
}

TEST(Floors, NoFolderIsALumberRoom)
{
    const std::set<std::string> lumberRooms = {"Utils", "Utilities", "Common", "Helpers", "Managers", "Misc"};
    for (const char* part : {"Source", "Tests/Unit"})
        for (const fs::directory_entry& entry : fs::recursive_directory_iterator(fs::path(ESPALIER_SOURCE_ROOT) / part))
        {
            EXPECT_FALSE(lumberRooms.contains(entry.path().filename().string())) << entry.path();
        }
}

TEST(Floors, NoIncludePointsUp)
{
    std::vector<std::string> found;
    std::size_t includes = 0;
    for (const fs::path& file : sourcesIn(kSourceFolder / "Espalier"))
    {
        const fs::path relative = file.lexically_relative(kSourceFolder);
        const std::string folder = std::next(relative.begin())->string();
        ASSERT_TRUE(kFloors.contains(folder)) << relative;
        const std::string text = textOf(file);
        for (std::string& line : violations(relative.string(), folder, text))
            found.push_back(std::move(line));
        includes += text.find("#include <Espalier/") != std::string::npos;
    }
    EXPECT_EQ(joined(found), "");
    EXPECT_GT(includes, 20u) << "the scan saw too little to mean anything";
}

TEST(Floors, TheBuildPutsEachFolderIntoItsLibrary)
{
    const std::string build = textOf(kSourceFolder / "CMakeLists.txt");
    const auto listed = [&build](const std::string& variable) {
        const std::string opening = "set(" + variable + " ";
        const std::size_t start = build.find(opening);
        EXPECT_NE(start, std::string::npos) << variable;
        const std::size_t names = start + opening.size();
        std::istringstream words(build.substr(names, build.find(')', names) - names));
        return std::set<std::string>(std::istream_iterator<std::string>(words), {});
    };
    const std::set<std::string> runtime = listed("runtime_folders");
    const std::set<std::string> authoring = listed("authoring_folders");
    for (const auto& [folder, floor] : kFloors)
    {
        const bool exists = fs::exists(kSourceFolder / "Espalier" / folder);
        EXPECT_EQ(runtime.contains(folder), exists && floor.library == Library::Runtime) << folder;
        EXPECT_EQ(authoring.contains(folder), exists && floor.library == Library::Authoring) << folder;
    }
}

TEST(Floors, APlantedViolationIsFound)
{
    const struct
    {
        const char* folder;
        const char* line;
        const char* objection;
    } planted[] = {
        {"Core", "#include <Espalier/Grammar/Grammar.h>", "points up"},
        {"Core", "#include \"Espalier/Grammar/Grammar.h\"", "points up"},
        {"Core", "  #  include <Espalier/Grammar/Grammar.h> // why", "points up"},
        {"Plant", "#include <Espalier/Grammar/Grammar.h>", "sideways"},
        {"Species", "#include <Espalier/Archetype/Archetype.h>", "sideways"},
        {"Mesh", "#include <Espalier/Archetype/Archetype.h>", "only tools link"},
        {"Plugin", "#include <Espalier/Bake/Gltf.h>", "only tools link"},
        {"Plugin", "#include <Espalier/Layout/Layout.h>", "only tools link"},
        {"Render", "#include <Tool/Verbs.h>", "programs"},
        {"Render", "#include \"../../Tool/Verbs.h\"", "climbs"},
        {"Core", "#include \"../Grammar/Grammar.h\"", "climbs"},
        {"Core", "#include \"Error.h\"", "without a place"},
        {"Core", "#include <Espalier/Helpers/Strings.h>", "no such folder"},
        {"Core", "#include <Espalier/Error.h>", "no such folder"},
        {"Mesh", "#include <embree3/rtcore.h>", "not for Mesh"},
        {"Render", "#include <tiny_gltf.h>", "not for Render"},
        {"Species", "#include <nlohmann/json.hpp>", "not for Species"},
        {"Species", "#include <random>", "standard libraries"},
        {"Grammar", "#include <boost/graph.hpp>", "without a place"},
        {"Render", "#include <unistd.h>", "not for Render"},
    };
    for (const auto& [folder, line, objection] : planted)
    {
        const std::string text = std::string("#pragma once\n\n#include <vector>\n") + line + "\nint x;\n";
        const std::vector<std::string> found = violations("Planted.h", folder, text);
        ASSERT_EQ(found.size(), 1u) << folder << ": " << line;
        EXPECT_TRUE(found[0].starts_with("Planted.h:4: ")) << found[0];
        EXPECT_NE(found[0].find(objection), std::string::npos) << found[0];
    }
}

TEST(Floors, WhatMayBeIncludedIsNotReported)
{
    const struct
    {
        const char* folder;
        const char* line;
    } allowed[] = {
        {"Core", "#include <vector>"},
        {"Core", "#include <Espalier/Core/Error.h>"},
        {"Core", "// #include <Espalier/Grammar/Grammar.h>"},
        {"Core", "#include MACRO"},
        {"Turtle", "#include <Espalier/Grammar/Grammar.h>"},
        {"Turtle", "#include <glm/vec3.hpp>"},
        {"Overlap", "#include <embree3/rtcore.h>"},
        {"Inference", "#include <Espalier/Species/Species.h>"},
        {"Bake", "#include <Espalier/Mesh/TreeMesh.h>"},
        {"Bake", "#include <tiny_gltf.h>"},
        {"Plugin", "#include <Espalier/Forest/Forest.h>"},
    };
    for (const auto& [folder, line] : allowed)
        EXPECT_EQ(joined(violations("Allowed.h", folder, line)), "") << folder << ": " << line;
}

} // namespace
