#include "Pictures.h"

#include "Command.h"

#include <Espalier/Core/File.h>

namespace espalier::tool {

ImageNames pictureNames(const std::string& stem)
{
    return {stem + "-colour.png", stem + "-normal.png", stem + "-roughness.png"};
}

std::vector<std::string> namesIn(const ImageNames& names)
{
    std::vector<std::string> all;
    for (const std::string* name : {&names.colour, &names.normal, &names.roughness})
        if (!name->empty())
            all.push_back(*name);
    return all;
}

EncodedImages encode(const MaterialTextures& material)
{
    return {encodePng(material.colour), encodePng(material.normal), encodePng(material.roughness)};
}

void writePictures(const std::filesystem::path& folder, const ImageNames& names, const EncodedImages& pictures)
{
    orFail(writeFileAtomically(folder / names.colour, pictures.colour));
    orFail(writeFileAtomically(folder / names.normal, pictures.normal));
    orFail(writeFileAtomically(folder / names.roughness, pictures.roughness));
}

} // namespace espalier::tool
