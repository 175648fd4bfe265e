#include "HandMadeMesh.h"

#include <Espalier/Core/Random.h>
#include <Espalier/Render/ImpostorAtlas.h>
#include <Espalier/Species/Appearance.h>
#include <Espalier/Texture/MaterialTextures.h>
#include <algorithm>
#include <atomic>
#include <gtest/gtest.h>
#include <limits>

namespace espalier {

namespace {

constexpr AtlasSettings kSmall{.size = 256, .samples = 3, .threads = 2};

/// Small squares, turned any way, in a ball over the ground: a crown without wood.
TreeMesh crown(std::uint32_t squares, float size)
{
    TreeMesh mesh;
    for (std::uint32_t i = 0; i < squares; ++i)
    {
        const RandomKey key = RandomKey(Seed{3}).child(i);
        const auto next = [&](std::uint32_t k) {
            return static_cast<float>(key.uniform(Purpose::Sampling, k)) * 2 - 1;
        };
        const auto direction = [&](std::uint32_t k) {
            const float x = next(k);
            const float y = next(k + 1);
            return Vec3(x, y, next(k + 2) + 1e-3f);
        };
        const Vec3 at = direction(0);
        if (glm::length(at) > 1)
            continue;
        const Vec3 normal = glm::normalize(direction(3));
        const Vec3 right = glm::normalize(glm::cross(normal, direction(6)));
        const Vec3 up = glm::cross(normal, right);
        const auto first = static_cast<std::uint32_t>(mesh.positions.size());
        for (const Vec2 corner : {Vec2(-1, -1), Vec2(1, -1), Vec2(1, 1), Vec2(-1, 1)})
        {
            mesh.positions.push_back(Vec3(0, 3, 0) + 2.0f * at + size * (corner.x * right + corner.y * up));
            mesh.normals.push_back(normal);
            mesh.tangents.emplace_back(right, 1);
            mesh.uvs.push_back(0.5f * (corner + Vec2(1)));
        }
        for (const std::uint32_t corner : {0u, 1u, 2u, 0u, 2u, 3u})
            mesh.indices.push_back(first + corner);
    }
    mesh.parts = {{MeshMaterial::Surface, 0, static_cast<std::uint32_t>(mesh.indices.size())}};
    return mesh;
}

/// A round trunk, 4 m high and 1 m in radius, without the relief of bark.
TreeMesh column()
{
    TreeMesh mesh = handMade({.sides = 32, .height = 4, .radius = 1});
    mesh.parts[0].material = MeshMaterial::Surface;
    return mesh;
}

struct Painted
{
    Painted(TreeMesh plant, ImpostorKind kind, const AtlasSettings& settings = kSmall)
        : mesh(std::move(plant)), impostor(makeImpostor(mesh, kind, 6))
    {
        appearance.bark.colour = {0.3f, 0.2f, 0.1f};
        auto made = paintImpostor(subject(), impostor, settings);
        if (made)
            atlas = *std::move(made);
    }
    Painted(Painted&&) = delete;

    [[nodiscard]] RenderSubject subject() const { return {&mesh, &appearance, {}}; }

    /// The farthest that coverage and colour are from those of the plant, over all views.
    [[nodiscard]] Vec2 worst(float turn) const
    {
        const auto views = compareImpostor(subject(), impostor, atlas, turn, 2);
        if (!views)
            return Vec2(1e9f);
        Vec2 worst(0);
        for (const ImpostorDifference& view : *views)
        {
            worst.x = std::max(worst.x, std::abs(view.coverage - 1));
            for (int c = 0; c < 3; ++c)
                worst.y = std::max(worst.y, std::abs(view.colour[c] - 1));
        }
        return worst;
    }

    TreeMesh mesh;
    Appearance appearance;
    Impostor impostor;
    MaterialTextures atlas;
};

constexpr std::array kKinds{ImpostorKind::Cards, ImpostorKind::Octahedral};

} // namespace

TEST(ImpostorAtlas, CoversAndIsColouredAsThePlantFromEightSides)
{
    for (const ImpostorKind kind : kKinds)
    {
        const Painted sparse(crown(500, 0.12f), kind);
        const Painted dense(crown(4000, 0.12f), kind);
        const Painted trunk(column(), kind);
        for (const Painted* painted : {&sparse, &dense, &trunk})
            for (const float turn : {0.0f, 0.2f})
            {
                const Vec2 worst = painted->worst(turn);
                EXPECT_LT(worst.x, 0.1f) << turn << ' ' << painted->mesh.positions.size();
                EXPECT_LT(worst.y, 0.1f) << turn << ' ' << painted->mesh.positions.size();
            }
    }
}

TEST(ImpostorAtlas, TwigsThinnerThanATexelDoNotVanish)
{
    // Half a texel of the octahedral frames, which are 42 texels high.
    TreeMesh fan;
    for (int i = -5; i <= 5; ++i)
    {
        TreeMesh twig = handMade({.sides = 8, .height = 6, .radius = 0.04f});
        const auto first = static_cast<std::uint32_t>(fan.positions.size());
        for (Vec3 p : twig.positions)
        {
            p.x += 0.09f * static_cast<float>(i) * p.y;
            p.z += 0.03f * static_cast<float>(i * i) * p.y - 0.3f * p.y;
            fan.positions.push_back(p);
        }
        fan.normals.insert(fan.normals.end(), twig.normals.begin(), twig.normals.end());
        fan.uvs.insert(fan.uvs.end(), twig.uvs.begin(), twig.uvs.end());
        for (const std::uint32_t index : twig.indices)
            fan.indices.push_back(first + index);
    }
    fan.parts = {{MeshMaterial::Surface, 0, static_cast<std::uint32_t>(fan.indices.size())}};
    const Painted twigs(std::move(fan), ImpostorKind::Octahedral);
    EXPECT_LT(twigs.worst(0).x, 0.25f);
    EXPECT_LT(twigs.worst(0.2f).x, 0.25f);
}

TEST(ImpostorAtlas, DoesNotDependOnThreads)
{
    const Painted one(crown(300, 0.2f), ImpostorKind::Cards, {.size = 64, .samples = 2, .threads = 1});
    const Painted many(crown(300, 0.2f), ImpostorKind::Cards, {.size = 64, .samples = 2, .threads = 5});
    ASSERT_FALSE(one.atlas.colour.texels.empty());
    EXPECT_EQ(one.atlas.colour, many.atlas.colour);
    EXPECT_EQ(one.atlas.normal, many.atlas.normal);
    EXPECT_EQ(one.atlas.roughness, many.atlas.roughness);
}

TEST(ImpostorAtlas, ShowsTheNormalsOfThePlantFromBothSidesOfACard)
{
    const Painted trunk(column(), ImpostorKind::Cards);
    for (const float front : {1.0f, -1.0f})
    {
        const Vec3 toViewer(0, 0, front);
        for (const float x : {-0.6f, 0.6f})
        {
            const auto sight = seeImpostor(trunk.impostor, trunk.atlas, toViewer, {x, 2, 0});
            ASSERT_TRUE(sight);
            // Left of the middle it looks to the left, though a card that crosses may be before the one that faces.
            EXPECT_NEAR(sight->normal.x, x, 0.4f);
            EXPECT_GE(sight->normal.x * x, 0);
            EXPECT_GT(sight->normal.z * front, 0.6f);
        }
        EXPECT_FALSE(seeImpostor(trunk.impostor, trunk.atlas, toViewer, {1.2f, 2, 0}));
        EXPECT_FALSE(seeImpostor(trunk.impostor, trunk.atlas, toViewer, {0, 5, 0}));
    }
}

TEST(ImpostorAtlas, OctahedralFramesKnowHowDeepThePlantIs)
{
    const Painted trunk(column(), ImpostorKind::Octahedral, {.size = 256, .samples = 2, .threads = 2});
    const Image& depths = trunk.atlas.roughness;
    const std::uint32_t side = trunk.impostor.columns;
    const std::uint32_t cell = depths.width / side;
    std::uint32_t level = 0;
    for (std::uint32_t i = 0; i < trunk.impostor.frames.size(); ++i)
    {
        if (std::abs(trunk.impostor.frames[i].toViewer.y) > 1e-3f)
            continue;
        ++level;
        const std::size_t x = i % side * cell + cell / 2;
        const std::size_t y = i / side * cell + cell / 2;
        const float stored = static_cast<float>(depths.texels[(y * depths.width + x) * 3 + 2]) / 127.5f - 1;
        EXPECT_NEAR(stored * trunk.impostor.radius, 1, 0.05f); // the bark before the axis
    }
    EXPECT_EQ(level, 4 * (side - 1));
}

TEST(ImpostorAtlas, CardsBackToBackHaveOneOutline)
{
    const Painted painted(crown(500, 0.12f), ImpostorKind::Cards);
    const Image& colour = painted.atlas.colour;
    const std::uint32_t width = colour.width / 4;
    const std::uint32_t height = colour.height / 2;
    std::size_t shown = 0;
    for (std::uint32_t card = 0; card < 4; ++card)
        for (std::uint32_t y = 0; y < height; ++y)
            for (std::uint32_t x = 0; x < width; ++x)
            {
                const auto alpha = [&](std::uint32_t row, std::uint32_t column) {
                    return colour.texels[4 * ((row * height + y) * colour.width + card * width + column) + 3];
                };
                ASSERT_EQ(alpha(0, x), alpha(1, width - 1 - x));
                shown += alpha(0, x) > 0 ? 1 : 0;
            }
    EXPECT_GT(shown, 100u);
}

TEST(ImpostorAtlas, TheInsideOfACrownIsDarkerThanALoneLeaf)
{
    const auto meanOcclusion = [](const Painted& painted) {
        double sum = 0;
        double count = 0;
        for (std::size_t i = 0; 4 * i < painted.atlas.colour.texels.size(); ++i)
            if (painted.atlas.colour.texels[4 * i + 3] >= 128)
            {
                sum += painted.atlas.roughness.texels[3 * i];
                ++count;
            }
        return sum / std::max(count, 1.0);
    };
    const Painted lone(crown(2, 0.3f), ImpostorKind::Cards);
    const Painted dense(crown(4000, 0.12f), ImpostorKind::Cards);
    EXPECT_GT(meanOcclusion(lone), 220);
    EXPECT_LT(meanOcclusion(dense), 170);
}

TEST(ImpostorAtlas, SaysWhatItCannotPaint)
{
    const TreeMesh mesh = crown(20, 0.2f);
    const Appearance appearance;
    const Impostor impostor = makeImpostor(mesh, ImpostorKind::Cards);
    const auto kindOf = [&](const RenderSubject& subject, const Impostor& which, const AtlasSettings& settings) {
        const auto atlas = paintImpostor(subject, which, settings);
        return atlas ? std::string("none") : atlas.error().what;
    };
    EXPECT_NE(kindOf({&mesh, &appearance, {}}, impostor, {.size = 63}).find("63"), std::string::npos);
    EXPECT_NE(kindOf({&mesh, &appearance, {}}, impostor, {.samples = 0}).find("0 samples"), std::string::npos);
    EXPECT_NE(kindOf({&mesh, &appearance, {}}, {}, kSmall).find("0 frames"), std::string::npos);
    EXPECT_NE(kindOf({nullptr, &appearance, {}}, impostor, kSmall).find("no mesh"), std::string::npos);
    Impostor few = makeImpostor(mesh, ImpostorKind::Octahedral);
    few.frames.pop_back();
    EXPECT_NE(kindOf({&mesh, &appearance, {}}, few, kSmall).find("63 frames"), std::string::npos);
    EXPECT_FALSE(compareImpostor({&mesh, &appearance, {}}, impostor, {}));
    EXPECT_FALSE(compareImpostor({&mesh, &appearance, {}}, impostor, {}, std::numeric_limits<float>::quiet_NaN()));

    const std::atomic<bool> cancelled = true;
    const auto stopped =
        paintImpostor({&mesh, &appearance, {}}, impostor, kSmall, {.report = {}, .cancelled = &cancelled});
    ASSERT_FALSE(stopped);
    EXPECT_EQ(stopped.error().kind, ErrorKind::Cancelled);
}

} // namespace espalier
