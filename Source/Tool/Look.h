#pragma once

#include "Command.h"

#include <Espalier/Species/Appearance.h>
#include <Espalier/Texture/OwnTextures.h>
#include <string>

namespace espalier::tool {

/// The appearance of an `.appearance` file or of a species.
[[nodiscard]] Appearance loadLook(const std::string& path);

/// Gives an appearance everything of another but its pipes, which belong to the rules.
void dress(Appearance& appearance, Appearance look);

/// "1 kind of leaves, 3 seasons (spring, autumn, winter)".
[[nodiscard]] std::string summaryOf(const Appearance& appearance);

/// Says on stderr which pictures the look of the file at `path`, which was just written, lacks beside it.
void tellMissingPictures(const Appearance& look, const std::string& path);

/// Options of verbs that show plants: how they are to look.
struct LookOptions
{
    std::string file;
    std::string season;
    bool bare = false;

    void addTo(CLI::App& verb);
    /// The file that the look is from, of a plant from `input`.
    [[nodiscard]] const std::string& source(const std::string& input) const { return file.empty() ? input : file; }
    /// `input` is the plant's file, which is named in errors unless another one gives the look. Fails where the season
    /// is none of the appearance. Summer is the plain look, unless a season has that name.
    void applyTo(Appearance& appearance, const std::string& input) const;
    /// The artist's own pictures that the appearance names. `input` as for applyTo.
    [[nodiscard]] OwnTextures pictures(const Appearance& appearance, const std::string& input) const;
};

} // namespace espalier::tool
