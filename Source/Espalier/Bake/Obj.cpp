#include <Espalier/Bake/MeshParts.h>
#include <Espalier/Bake/Obj.h>
#include <Espalier/Core/Finite.h>

#include <Espalier/Core/File.h>
#include <Espalier/Core/Hash.h>
#include <Espalier/Core/Utf8.h>
#include <Espalier/Mesh/TreeMesh.h>
#include <Espalier/Species/Appearance.h>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <glm/common.hpp>
#include <new>
#include <vector>

namespace espalier {

namespace {

constexpr std::size_t kMaxNameBytes = 4096;

/// Text that goes to the sink in long runs.
class TextWriter
{
public:
    explicit TextWriter(const ByteSink& sink) : sink_(sink) { text_.reserve(kRun + 1024); }

    TextWriter& operator<<(std::string_view text)
    {
        text_ += text;
        return *this;
    }
    template <class Number>
    TextWriter& number(Number value)
    {
        char digits[32];
        text_.append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
        return *this;
    }
    template <class Vector>
    void line(std::string_view keyword, const Vector& values)
    {
        text_ += keyword;
        for (int i = 0; i < Vector::length(); ++i)
        {
            text_ += ' ';
            number(values[i] == 0 ? 0.0f : values[i]); // no -0
        }
        text_ += '\n';
    }
    /// To be called after some lines.
    Expected<void> passOn(std::size_t atLeast = kRun)
    {
        if (text_.size() < atLeast)
            return {};
        auto written = sink_(text_);
        text_.clear();
        return written;
    }

private:
    static constexpr std::size_t kRun = std::size_t{128} << 10;
    const ByteSink& sink_;
    std::string text_;
};

template <class Vector>
bool areFinite(const RawVector<Vector>& all)
{
    return std::ranges::all_of(all, [](const Vector& v) { return isFinite(v); });
}

bool isOneLine(std::string_view text)
{
    return text.size() <= kMaxNameBytes && findInvalidUtf8(text) == std::string_view::npos &&
           std::ranges::none_of(text, [](char c) { return static_cast<unsigned char>(c) < ' '; });
}

Expected<void> check(const TreeMesh& mesh, const Appearance& appearance, const BakeInfo& info,
                     std::span<const ImageNames> images)
{
    const auto bad = [](const char* what) {
        return failure(ErrorKind::BadInput, {}, std::string("the mesh cannot be written: ") + what,
                       "the finite, consistent triangles that meshing a sound skeleton gives");
    };
    const std::size_t vertices = mesh.positions.size();
    if (vertices == 0 || mesh.indices.empty())
        return bad("it is empty");
    if (mesh.normals.size() != vertices || mesh.uvs.size() != vertices)
        return bad("its vertex arrays differ in length");
    if (!areFinite(mesh.positions) || !areFinite(mesh.normals) || !areFinite(mesh.uvs))
        return bad("a number in it is not finite");
    if (*std::ranges::max_element(mesh.indices) >= vertices)
        return bad("an index names no vertex");
    if (!partsCoverAll(mesh))
        return bad("its parts do not cover its triangles in order");
    for (const MeshPart& part : mesh.parts)
        if (!isFinite(colourOf(part, appearance)))
            return failure(ErrorKind::BadInput, {}, "a colour is not finite");
    if (!isOneLine(info.speciesName))
        return failure(ErrorKind::BadInput, {}, "the species' name cannot be written",
                       "a line of UTF-8 of at most " + std::to_string(kMaxNameBytes) + " bytes");
    for (const ImageNames& names : images)
        for (const std::string* const name : {&names.colour, &names.normal, &names.roughness})
            if (!isOneLine(*name))
                return failure(ErrorKind::BadInput, {}, "the name of an image cannot be written",
                               "a line of UTF-8 of at most " + std::to_string(kMaxNameBytes) + " bytes");
    return {};
}

std::string withoutSpaces(std::string name)
{
    std::ranges::replace(name, ' ', '_');
    return name;
}

std::string materialName(const MeshPart& part, const BakeInfo& info)
{
    const std::string tree = info.speciesName.empty() ? "tree" : withoutSpaces(info.speciesName);
    const std::string number = std::to_string(part.colour);
    switch (part.material)
    {
    case MeshMaterial::Bark:
        return tree + (part.colour == 0 ? "_bark" : "_wood_" + number);
    case MeshMaterial::Surface:
        return tree + "_surface_" + number;
    case MeshMaterial::Leaves:
        return tree + "_leaves_" + number;
    case MeshMaterial::Cards:
        return tree + "_impostor";
    }
    return tree;
}

float roughnessOf(const MeshPart& part, const Appearance& appearance)
{
    constexpr float kSurface = 0.6f; // as in the GLB
    const bool isLeaves = part.material == MeshMaterial::Leaves && part.colour < appearance.leaves.size();
    const float roughness = part.material == MeshMaterial::Bark ? appearance.bark.roughness
                            : isLeaves                          ? appearance.leaves[part.colour].roughness
                                                                : kSurface;
    return std::isfinite(roughness) ? std::clamp(roughness, 0.0f, 1.0f) : kSurface;
}

Expected<void> emitMaterials(const TreeMesh& mesh, const Appearance& appearance, const BakeInfo& info,
                             std::span<const ImageNames> images, const ByteSink& sink)
{
    TextWriter text(sink);
    std::vector<std::string> known;
    for (const MeshPart& part : mesh.parts)
    {
        std::string name = materialName(part, info);
        if (part.indexCount == 0 || std::ranges::find(known, name) != known.end())
            continue;
        const std::size_t set = imagesOf(part, appearance);
        const ImageNames none;
        const ImageNames& names = set < images.size() ? images[set] : none;
        const bool isPainted = part.material == MeshMaterial::Bark && part.colour != 0;
        const bool hasColour = !names.colour.empty() && !isPainted;
        const Vec3 colour = hasColour ? Vec3(1) : glm::clamp(colourOf(part, appearance), 0.0f, 1.0f);
        text << (known.empty() ? "newmtl " : "\nnewmtl ") << name << "\n";
        text.line("Kd", colour);
        text << "Pr ";
        text.number(roughnessOf(part, appearance)) << "\nPm 0\nillum 1\n";
        if (hasColour)
            text << "map_Kd " << names.colour << "\n";
        if (hasColour && isCutOut(part))
            text << "map_d " << names.colour << "\n";
        if (!names.normal.empty())
            text << "norm " << names.normal << "\n";
        if (!names.roughness.empty())
            text << "map_Pr " << names.roughness << "\n";
        known.push_back(std::move(name));
    }
    return text.passOn(0);
}

Expected<void> emitObject(const TreeMesh& mesh, const BakeInfo& info, std::string_view materialFile,
                          const ByteSink& sink)
{
    TextWriter text(sink);
    text << "# Espalier " ESPALIER_VERSION ", species " << info.speciesName << " " << hexDigits(info.speciesHash)
         << ", seed " << (info.seed ? std::to_string(info.seed->value) : "exemplar") << "; metres, Y up\nmtllib "
         << materialFile << "\no " << (info.speciesName.empty() ? "tree" : withoutSpaces(info.speciesName)) << "\n";
    const auto emitLines = [&](std::string_view keyword, const auto& values) -> Expected<void> {
        for (const auto& value : values)
        {
            text.line(keyword, value);
            if (auto passed = text.passOn(); !passed)
                return passed;
        }
        return {};
    };
    if (auto done = emitLines("v", mesh.positions); !done)
        return done;
    if (auto done = emitLines("vt", mesh.uvs); !done)
        return done;
    if (auto done = emitLines("vn", mesh.normals); !done)
        return done;
    for (std::size_t p = 0; p < mesh.parts.size(); ++p)
    {
        const MeshPart& part = mesh.parts[p];
        if (part.indexCount == 0)
            continue;
        const std::string name = materialName(part, info);
        text << "g " << name << "_part_";
        text.number(p) << "\nusemtl " << name << "\n";
        for (std::size_t i = part.firstIndex; i < std::size_t{part.firstIndex} + part.indexCount; i += 3)
        {
            text << "f";
            for (std::size_t k = 0; k < 3; ++k)
            {
                const std::uint64_t index = std::uint64_t{mesh.indices[i + k]} + 1;
                text << " ";
                text.number(index) << "/";
                text.number(index) << "/";
                text.number(index);
            }
            text << "\n";
            if (auto passed = text.passOn(); !passed)
                return passed;
        }
    }
    return text.passOn(0);
}

/// Runs what makes text; lack of memory is an error like others.
template <class Make>
Expected<void> guarded(const Make& make)
{
    try
    {
        return make();
    }
    catch (const std::bad_alloc&)
    {
        return failure(ErrorKind::Limit, {}, "the text does not fit into memory");
    }
}

} // namespace

Expected<ObjText> printObj(const TreeMesh& mesh, const Appearance& appearance, const BakeInfo& info,
                           std::string_view materialFile, std::span<const ImageNames> images)
{
    ObjText result;
    const auto appendTo = [](std::string& text) {
        return ByteSink([&text](std::string_view more) -> Expected<void> {
            text += more;
            return {};
        });
    };
    const auto printed = guarded([&]() -> Expected<void> {
        if (auto checked = check(mesh, appearance, info, images); !checked)
            return checked;
        if (!isOneLine(materialFile))
            return failure(ErrorKind::BadInput, {}, "the name of the material file cannot be written",
                           "a line of UTF-8 of at most " + std::to_string(kMaxNameBytes) + " bytes");
        if (auto done = emitMaterials(mesh, appearance, info, images, appendTo(result.materials)); !done)
            return done;
        return emitObject(mesh, info, materialFile, appendTo(result.object));
    });
    if (!printed)
        return tl::unexpected(printed.error());
    return result;
}

std::filesystem::path materialsPath(const std::filesystem::path& path)
{
    return path.parent_path() / withoutSpaces(path.stem().string() + ".mtl");
}

Expected<void> writeObj(const std::filesystem::path& path, const TreeMesh& mesh, const Appearance& appearance,
                        const BakeInfo& info, std::span<const ImageNames> images)
{
    return guarded([&]() -> Expected<void> {
        if (auto checked = check(mesh, appearance, info, images); !checked)
            return checked;
        const std::filesystem::path materials = materialsPath(path);
        if (materials == path)
            return failure(ErrorKind::BadInput, {path.string(), 0, 0}, "an object cannot end in .mtl", ".obj");
        const std::string materialFile = materials.filename().string();
        if (!isOneLine(materialFile))
            return failure(ErrorKind::BadInput, {path.string(), 0, 0}, "the name of the file cannot be written",
                           "a line of UTF-8");
        const auto produceMaterials = [&](const ByteSink& sink) {
            return emitMaterials(mesh, appearance, info, images, sink);
        };
        if (auto written = writeFileAtomically(materials, produceMaterials); !written)
            return written;
        return writeFileAtomically(path,
                                   [&](const ByteSink& sink) { return emitObject(mesh, info, materialFile, sink); });
    });
}

} // namespace espalier
