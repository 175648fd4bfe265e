#include <Espalier/Bake/GltfMaterials.h>

#include <Espalier/Bake/MeshParts.h>
#include <Espalier/Species/Appearance.h>
#include <algorithm>

namespace espalier {

namespace {

constexpr double kSurfaceRoughness = 0.6; // leaves and berries are waxy

bool looksLike(const MeshPart& a, const MeshPart& b)
{
    return a.material == b.material && a.colour == b.colour;
}

double factor(float value)
{
    return static_cast<double>(std::clamp(value, 0.0f, 1.0f));
}

/// What is not plain bark is named by its entry of the palette or its kind: "Oak wood 2", "Oak surface 1",
/// "Oak leaves 0".
std::string nameOf(const MeshPart& look, const std::string& tree)
{
    const std::string number = std::to_string(look.colour);
    switch (look.material)
    {
    case MeshMaterial::Bark:
        return tree + (look.colour == 0 ? " bark" : " wood " + number);
    case MeshMaterial::Surface:
        return tree + " surface " + number;
    case MeshMaterial::Leaves:
        return tree + " leaves " + number;
    case MeshMaterial::Cards:
        return tree + " impostor";
    }
    return tree;
}

/// The colour of light that leaves on the other side.
tinygltf::Value transmissionOf(const LeafAppearance& leaf, const Vec3& colour, int texture)
{
    using Value = tinygltf::Value;
    Value::Object facts{{"diffuseTransmissionFactor", Value(factor(leaf.translucency))}};
    if (texture >= 0)
        facts["diffuseTransmissionColorTexture"] = Value(Value::Object{{"index", Value(texture)}});
    else
        facts["diffuseTransmissionColorFactor"] =
            Value(Value::Array{Value(factor(colour.x)), Value(factor(colour.y)), Value(factor(colour.z))});
    return Value(std::move(facts));
}

} // namespace

int GltfMaterials::of(const MeshPart& part)
{
    const auto found = std::ranges::find_if(looks_, [&](const MeshPart& look) { return looksLike(look, part); });
    if (found != looks_.end())
        return static_cast<int>(found - looks_.begin());
    model_.materials.push_back(make(part));
    looks_.push_back(part);
    return static_cast<int>(looks_.size() - 1);
}

tinygltf::Material GltfMaterials::make(const MeshPart& look)
{
    const bool isBark = look.material == MeshMaterial::Bark;
    const LeafAppearance* const leaf = look.material == MeshMaterial::Leaves && look.colour < appearance_.leaves.size()
                                           ? &appearance_.leaves[look.colour]
                                           : nullptr;
    const Vec3 colour = colourOf(look, appearance_);
    tinygltf::Material material;
    material.name = nameOf(look, name_);
    material.doubleSided = look.material == MeshMaterial::Surface || look.material == MeshMaterial::Leaves;
    if (isCutOut(look))
        material.alphaMode = "MASK"; // at alphaCutoff, 0.5
    tinygltf::PbrMetallicRoughness& surface = material.pbrMetallicRoughness;
    surface.baseColorFactor = {factor(colour.x), factor(colour.y), factor(colour.z), 1.0};
    surface.metallicFactor = 0;
    surface.roughnessFactor = isBark ? factor(appearance_.bark.roughness)
                              : leaf ? factor(leaf->roughness)
                                     : kSurfaceRoughness;
    addTextures(look, material);
    constexpr const char* kTransmission = "KHR_materials_diffuse_transmission";
    if (leaf && options_.translucentLeaves && leaf->translucency > 0)
    {
        material.extensions[kTransmission] = transmissionOf(*leaf, colour, surface.baseColorTexture.index);
        if (std::ranges::find(model_.extensionsUsed, kTransmission) == model_.extensionsUsed.end())
            model_.extensionsUsed.emplace_back(kTransmission);
    }
    return material;
}

void GltfMaterials::addTextures(const MeshPart& look, tinygltf::Material& material)
{
    const std::size_t set = imagesOf(look, appearance_);
    if (set >= images_.size())
        return;
    const bool isBark = look.material == MeshMaterial::Bark;
    const EncodedImages& images = images_[set];
    const std::string name = isBark ? name_ + " bark" : nameOf(look, name_); // all wood shares the bark's
    const int wrap = isBark ? TINYGLTF_TEXTURE_WRAP_REPEAT : TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE;
    tinygltf::PbrMetallicRoughness& surface = material.pbrMetallicRoughness;
    const bool isPainted = isBark && look.colour != 0; // has the bark's relief, and a colour of its own
    if (!images.colour.empty() && !isPainted)
    {
        surface.baseColorTexture.index = textureOf(images.colour, name + " colour", wrap);
        surface.baseColorFactor = {1.0, 1.0, 1.0, 1.0};
    }
    if (!images.normal.empty())
        material.normalTexture.index = textureOf(images.normal, name + " normal", wrap);
    if (!images.roughness.empty())
    {
        surface.metallicRoughnessTexture.index = textureOf(images.roughness, name + " roughness", wrap);
        surface.roughnessFactor = 1;
        material.occlusionTexture.index = surface.metallicRoughnessTexture.index;
    }
}

int GltfMaterials::textureOf(const std::string& png, std::string name, int wrap)
{
    if (const auto known = textures_.find(&png); known != textures_.end())
        return known->second;
    tinygltf::Image image;
    image.name = std::move(name);
    image.bufferView = payload_.add(png);
    image.mimeType = "image/png";
    model_.images.push_back(std::move(image));
    tinygltf::Texture texture;
    texture.source = static_cast<int>(model_.images.size() - 1);
    texture.sampler = samplerOf(wrap);
    model_.textures.push_back(std::move(texture));
    return textures_[&png] = static_cast<int>(model_.textures.size() - 1);
}

int GltfMaterials::samplerOf(int wrap)
{
    const auto found =
        std::ranges::find_if(model_.samplers, [&](const tinygltf::Sampler& sampler) { return sampler.wrapS == wrap; });
    if (found != model_.samplers.end())
        return static_cast<int>(found - model_.samplers.begin());
    tinygltf::Sampler sampler;
    sampler.minFilter = TINYGLTF_TEXTURE_FILTER_LINEAR_MIPMAP_LINEAR;
    sampler.magFilter = TINYGLTF_TEXTURE_FILTER_LINEAR;
    sampler.wrapS = wrap;
    sampler.wrapT = wrap;
    model_.samplers.push_back(std::move(sampler));
    return static_cast<int>(model_.samplers.size() - 1);
}

} // namespace espalier
