#pragma once

#include "Command.h"

#include <Espalier/Species/Appearance.h>
#include <string>

namespace espalier::tool {

/// The appearance of an `.appearance` file or of a species.
[[nodiscard]] Appearance loadLook(const std::string& path);

/// Gives an appearance everything of another but its pipes, which belong to the rules.
void dress(Appearance& appearance, Appearance look);

/// Options of verbs that show plants: how they are to look.
struct LookOptions
{
    std::string file;
    std::string season;
    bool bare = false;

    void addTo(CLI::App& verb);
    /// Fails where the season is none of the appearance.
    void applyTo(Appearance& appearance) const;
};

} // namespace espalier::tool
