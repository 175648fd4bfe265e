#include <Espalier/Bake/Gltf.h>
#include <Espalier/Mesh/TreeMesh.h>
#include <Espalier/Render/Picture.h>
#include <Espalier/Species/Appearance.h>

int main()
{
    // Baking brings tinygltf along, pictures stb. An empty mesh is refused, so the error's text is seen too.
    const auto baked = espalier::bakeGlb(espalier::TreeMesh{}, espalier::Appearance{}, espalier::BakeInfo{});
    const std::string png = espalier::encodePng(espalier::Picture(16, 16));
    return !baked && !baked.error().what.empty() && png.starts_with("\x89PNG") ? 0 : 1;
}
