#pragma once

#include <Espalier/Bake/Gltf.h>
#include <Espalier/Bake/GltfPayload.h>
#include <Espalier/Bake/TinyGltf.h>
#include <Espalier/Mesh/TreeMesh.h>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace espalier {

/// Gives each look of parts, that is each kind and colour, one material of a document, in the order in which they are
/// asked for; their images go into the payload, each once.
class GltfMaterials
{
public:
    GltfMaterials(const Appearance& appearance, std::span<const EncodedImages> images, const std::string& name,
                  const BakeOptions& options, tinygltf::Model& model, GltfPayload& payload)
        : appearance_(appearance), images_(images), name_(name), options_(options), model_(model), payload_(payload)
    {}

    /// The number of the part's material.
    int of(const MeshPart& part);

private:
    tinygltf::Material make(const MeshPart& look);
    void addTextures(const MeshPart& look, tinygltf::Material& material);
    int textureOf(const std::string& png, std::string name, int wrap);
    int samplerOf(int wrap);

    const Appearance& appearance_;
    std::span<const EncodedImages> images_;
    const std::string& name_;
    const BakeOptions& options_;
    tinygltf::Model& model_;
    GltfPayload& payload_;
    std::vector<MeshPart> looks_;
    std::map<const std::string*, int> textures_; ///< By where their image lies; looked up, never walked.
};

} // namespace espalier
