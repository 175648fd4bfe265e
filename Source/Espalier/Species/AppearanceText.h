#pragma once

#include <Espalier/Core/Json.h>
#include <Espalier/Species/Appearance.h>
#include <string>
#include <string_view>

namespace espalier {

/// Reads an appearance from an object of a file. With `pipes` the object may have the key "pipes" too, which goes
/// there.
[[nodiscard]] Expected<void> readAppearance(const JsonDocument::Value& value, Appearance& appearance, PipeModel* pipes);

/// The object as text, `indent` before every line but the first; readAppearance gives the same back. What is as usual
/// is not mentioned.
[[nodiscard]] std::string appearanceText(const Appearance& appearance, const PipeModel* pipes, std::string_view indent);

[[nodiscard]] std::string pipesText(const PipeModel& pipes);

} // namespace espalier
