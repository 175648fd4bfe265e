#pragma once

#include <Espalier/Core/Error.h>
#include <Espalier/Core/Limits.h>
#include <Espalier/Species/Appearance.h>
#include <filesystem>
#include <string>
#include <string_view>

namespace espalier {

/// Reads the text of an `.appearance` file: what a species looks like, to be given to any number of them. It says
/// nothing of pipes, which are those of a species' rules. Errors give line and column.
[[nodiscard]] Expected<Appearance> parseAppearance(std::string text, std::string_view file, const Limits& limits = {});

/// The text form, without the pipes; parseAppearance gives the rest back.
[[nodiscard]] std::string printAppearance(const Appearance& appearance);

[[nodiscard]] Expected<Appearance> loadAppearance(const std::filesystem::path& path, const Limits& limits = {});

} // namespace espalier
