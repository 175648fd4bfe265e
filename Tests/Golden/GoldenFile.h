#pragma once

#include <Espalier/Core/Error.h>
#include <Espalier/Core/File.h>
#include <Espalier/Core/Limits.h>
#include <cstdlib>
#include <filesystem>
#include <gtest/gtest.h>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

namespace espalier::golden {

inline const std::filesystem::path kFolder = std::filesystem::path(ESPALIER_SOURCE_ROOT) / "Tests" / "Golden";

/// Lines of a text, comments left out.
inline std::vector<std::string> linesOf(const std::string& text)
{
    std::vector<std::string> lines;
    std::istringstream in(text);
    for (std::string line; std::getline(in, line);)
        if (!line.empty() && line[0] != '#')
            lines.push_back(line);
    return lines;
}

inline bool updating()
{
    const char* const value = std::getenv("ESPALIER_UPDATE_GOLDEN");
    return value != nullptr && std::string_view(value) == "1";
}

/// Expects `lines` in the golden file `name`, or writes them there, below what they are.
inline void expectFile(std::string_view name, const std::string& what, const std::vector<std::string>& lines)
{
    const std::filesystem::path file = kFolder / (std::string(name) + ".golden");
    const std::string advice =
        "\nIf this change is wanted, write the golden files anew with ESPALIER_UPDATE_GOLDEN=1 espalier_golden "
        "and say in the commit why.";
    if (updating())
    {
        std::string text = "# " + what + "\n# Written by espalier_golden with ESPALIER_UPDATE_GOLDEN=1.\n";
        for (const std::string& line : lines)
            text += line + '\n';
        const auto done = writeFileAtomically(file, text);
        ASSERT_TRUE(done) << toString(done.error());
    }
    const auto text = readTextFile(file, Limits{}.fileBytes);
    ASSERT_TRUE(text) << toString(text.error()) << advice;
    const std::vector<std::string> expected = linesOf(*text);
    ASSERT_EQ(lines.size(), expected.size()) << file << " is of another test." << advice;
    for (std::size_t i = 0; i < expected.size(); ++i)
        ASSERT_EQ(lines[i], expected[i]) << "This is the first line of " << file << " that differs." << advice;
}

} // namespace espalier::golden
