#include <Espalier/Render/Render.h>

#include <Espalier/Species/Appearance.h>
#include <Render/HandMadeMesh.h>
#include <algorithm>
#include <atomic>
#include <functional>
#include <gtest/gtest.h>
#include <limits>
#include <numeric>
#include <thread>

namespace espalier {

namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
const Appearance kBark;

RenderSettings small()
{
    RenderSettings settings;
    settings.width = 48;
    settings.height = 60;
    settings.samplesPerPixel = 4;
    return settings;
}

RenderSubject subjectOf(const TreeMesh& mesh, std::string label = {})
{
    return {&mesh, &kBark, std::move(label)};
}

int luminance(const Picture& picture, std::uint32_t x, std::uint32_t y)
{
    const std::uint8_t* pixel = picture.rgb.data() + 3 * (std::size_t{y} * picture.width + x);
    return pixel[0] + pixel[1] + pixel[2];
}

/// Rows of `column` that are much darker than the sky above: the trunk against the sky.
std::uint32_t darkRows(const Picture& picture, std::uint32_t column, std::uint32_t firstRow, std::uint32_t rows)
{
    std::uint32_t dark = 0;
    const int sky = luminance(picture, column, firstRow);
    for (std::uint32_t y = firstRow; y < firstRow + rows; ++y)
        dark += luminance(picture, column, y) < sky - 150;
    return dark;
}

/// Columns, from `left` on, of what differs from the sky in rows [firstRow, endRow) of a picture of small() size; the
/// sky looks in each row as it does at the picture's edge.
std::vector<std::uint32_t> barkIn(const Picture& page, std::uint32_t left, std::uint32_t firstRow, std::uint32_t endRow)
{
    std::vector<std::uint32_t> columns;
    for (std::uint32_t y = firstRow; y < endRow; ++y)
        for (std::uint32_t x = 0; x < small().width; ++x)
            if (std::abs(luminance(page, left + x, y) - luminance(page, left, y)) > 60)
                columns.push_back(x);
    return columns;
}

double meanOf(const std::vector<std::uint32_t>& values)
{
    return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

void append(const TreeMesh& part, TreeMesh& mesh)
{
    const auto first = static_cast<std::uint32_t>(mesh.positions.size());
    for (const std::uint32_t index : part.indices)
        mesh.indices.push_back(first + index);
    mesh.positions.insert(mesh.positions.end(), part.positions.begin(), part.positions.end());
    mesh.normals.insert(mesh.normals.end(), part.normals.begin(), part.normals.end());
    mesh.tangents.insert(mesh.tangents.end(), part.tangents.begin(), part.tangents.end());
    mesh.uvs.insert(mesh.uvs.end(), part.uvs.begin(), part.uvs.end());
    mesh.parts.front().indexCount += part.parts.front().indexCount;
}

/// An upright square that faces the camera, of one material and colour.
TreeMesh square(MeshMaterial material, std::uint16_t colour)
{
    TreeMesh mesh;
    for (const Vec2 at : {Vec2(0, 0), Vec2(1, 0), Vec2(1, 1), Vec2(0, 1)})
    {
        mesh.positions.emplace_back(2 * at.x - 1, 2 * at.y, 0);
        mesh.normals.emplace_back(0, 0, 1);
        mesh.tangents.emplace_back(1, 0, 0, 1);
        mesh.uvs.push_back(at);
    }
    mesh.indices = {0, 1, 2, 0, 2, 3};
    mesh.parts = {{material, 0, 6, colour}};
    return mesh;
}

/// Mean colour of the middle of the picture.
DVec3 middleOf(const TreeMesh& mesh, const Appearance& appearance, float sunAzimuth)
{
    RenderSettings settings = small();
    settings.sunAzimuth = sunAzimuth;
    const Picture picture = renderPicture({&mesh, &appearance, ""}, settings).value();
    DVec3 sum(0);
    for (std::uint32_t y = 25; y < 35; ++y)
        for (std::uint32_t x = 19; x < 29; ++x)
        {
            const std::uint8_t* pixel = picture.rgb.data() + 3 * (std::size_t{y} * picture.width + x);
            sum += DVec3(pixel[0], pixel[1], pixel[2]);
        }
    return sum / 100.0;
}

constexpr float kSunInFront = 0.2f;
constexpr float kSunBehind = 3.3f;

} // namespace

TEST(Render, RefusesWhatCannotBeDrawn)
{
    struct Case
    {
        const char* name;
        std::function<void(TreeMesh&, RenderSettings&)> spoil;
    };
    const Case cases[] = {
        {"empty mesh", [](auto& mesh, auto&) { mesh.clear(); }},
        {"no triangles", [](auto& mesh, auto&) { mesh.indices.clear(); }},
        {"half a triangle", [](auto& mesh, auto&) { mesh.indices.pop_back(); }},
        {"index out of range", [](auto& mesh, auto&) { mesh.indices[0] = 12345; }},
        {"NaN position", [](auto& mesh, auto&) { mesh.positions[0].x = kNaN; }},
        {"far position", [](auto& mesh, auto&) { mesh.positions[0].x = 1e30f; }},
        {"NaN normal", [](auto& mesh, auto&) { mesh.normals[0].x = kNaN; }},
        {"NaN uv", [](auto& mesh, auto&) { mesh.uvs[0].x = kNaN; }},
        {"missing normals", [](auto& mesh, auto&) { mesh.normals.clear(); }},
        {"missing uvs", [](auto& mesh, auto&) { mesh.uvs.clear(); }},
        {"no width", [](auto&, auto& settings) { settings.width = 0; }},
        {"huge height", [](auto&, auto& settings) { settings.height = 100000; }},
        {"no samples", [](auto&, auto& settings) { settings.samplesPerPixel = 0; }},
        {"NaN sun", [](auto&, auto& settings) { settings.sunAzimuth = kNaN; }},
        {"sun below the horizon", [](auto&, auto& settings) { settings.sunElevation = -0.1f; }},
        {"wide sun", [](auto&, auto& settings) { settings.sunRadius = 1; }},
        {"NaN camera", [](auto&, auto& settings) { settings.cameraAzimuth = kNaN; }},
        {"camera overhead", [](auto&, auto& settings) { settings.cameraElevation = 2; }},
        {"no field of view", [](auto&, auto& settings) { settings.fieldOfView = 0; }},
        {"NaN field of view", [](auto&, auto& settings) { settings.fieldOfView = kNaN; }},
        {"too many threads", [](auto&, auto& settings) { settings.threads = 100000; }},
    };
    for (const Case& spoilt : cases)
    {
        TreeMesh mesh = handMade({});
        RenderSettings settings = small();
        spoilt.spoil(mesh, settings);
        const RenderSubject subject = subjectOf(mesh);
        const Expected<Picture> results[] = {renderPicture(subject, settings), renderTurntable(subject, 2, settings),
                                             renderContactSheet({&subject, 1}, 1, settings)};
        for (const Expected<Picture>& result : results)
        {
            ASSERT_FALSE(result) << spoilt.name;
            EXPECT_EQ(result.error().kind, ErrorKind::BadInput) << spoilt.name;
        }
    }
}

TEST(Render, RefusesSubjectsAndPagesThatCannotBe)
{
    const TreeMesh mesh = handMade({});
    const RenderSubject subject = subjectOf(mesh);
    EXPECT_FALSE(renderPicture({nullptr, &kBark, ""}, small()));
    EXPECT_FALSE(renderPicture({&mesh, nullptr, ""}, small()));
    EXPECT_FALSE(renderTurntable(subject, 0, small()));
    EXPECT_FALSE(renderTurntable(subject, 100000, small()));
    EXPECT_FALSE(renderContactSheet({}, 1, small()));
    EXPECT_FALSE(renderContactSheet({&subject, 1}, 0, small()));

    RenderSettings vast = small();
    vast.width = vast.height = 8192;
    const auto page = renderTurntable(subject, 64, vast);
    ASSERT_FALSE(page);
    EXPECT_EQ(page.error().kind, ErrorKind::Limit);
}

TEST(Render, DrawsSurvivingMeshesOfAnyShape)
{
    TreeMesh point = handMade({});
    std::fill(point.positions.begin(), point.positions.end(), Vec3(0));
    TreeMesh flat = handMade({.height = 0});
    TreeMesh speck = handMade({.height = 1e-6f, .radius = 1e-7f});
    TreeMesh vast = handMade({.height = 1e6f, .radius = 1e5f});
    TreeMesh aloft = handMade({.base = {0, 50, 0}});
    TreeMesh buried = handMade({.base = {3, -20, 5}});
    TreeMesh plain = handMade({});
    std::fill(plain.uvs.begin(), plain.uvs.end(), Vec2(0));
    std::fill(plain.normals.begin(), plain.normals.end(), Vec3(0));
    TreeMesh farTexture = handMade({});
    for (Vec2& uv : farTexture.uvs)
        uv *= 1e30f;
    struct Case
    {
        const char* name;
        const TreeMesh& mesh;
        bool isSeen; ///< Not what has no surface, nor what is less than a pixel from a millimetre away.
    };
    for (const Case& c : {Case{"point", point, false}, Case{"flat", flat, false}, Case{"speck", speck, false},
                          Case{"vast", vast, true}, Case{"aloft", aloft, true}, Case{"buried", buried, true},
                          Case{"plain", plain, true}, Case{"far texture", farTexture, true}})
        for (const float elevation : {-1.5f, 0.0f, 1.5f})
        {
            RenderSettings settings = small();
            settings.cameraElevation = elevation;
            const auto picture = renderPicture(subjectOf(c.mesh), settings);
            ASSERT_TRUE(picture) << c.name << ": " << toString(picture.error());
            // Light that is not a number would be black; even shadows are not.
            for (std::uint32_t y = 0; y < picture->height; ++y)
                for (std::uint32_t x = 0; x < picture->width; ++x)
                    ASSERT_GT(luminance(*picture, x, y), 0) << c.name << " at " << x << ", " << y;
            if (elevation == 0) // then there is sky behind
            {
                EXPECT_EQ(!barkIn(*picture, 0, 20, 30).empty(), c.isSeen) << c.name;
            }
        }
}

TEST(Render, FramesTheTrunkWholeUnderABrightSky)
{
    const TreeMesh mesh = handMade({.sides = 24, .height = 3.0f, .radius = 0.2f});
    RenderSettings settings = small();
    settings.width = 120;
    settings.height = 150;
    Appearance smooth; // ridges of furrowed bark are as bright as the ground
    smooth.bark.kind = BarkKind::Smooth;
    const auto picture = renderPicture({&mesh, &smooth, ""}, settings);
    ASSERT_TRUE(picture) << toString(picture.error());
    const std::uint32_t dark = darkRows(*picture, 60, 0, 150);
    EXPECT_GT(dark, 100u); // nine tenths of the height, but the foot stands before bright ground
    EXPECT_LT(dark, 140u);
    EXPECT_LT(darkRows(*picture, 5, 0, 150), 60u); // beside it there is ground, and no trunk
    EXPECT_GT(luminance(*picture, 5, 0), 450);
}

TEST(Render, PaperIsBlankRoundTheTree)
{
    const TreeMesh mesh = handMade({.sides = 24, .height = 3.0f, .radius = 0.2f});
    RenderSettings settings = small();
    settings.backdrop = Backdrop::Paper;
    settings.cameraElevation = 0;
    const Picture picture = renderPicture(subjectOf(mesh), settings).value();
    const int paper = luminance(picture, 0, 0);
    EXPECT_GT(paper, 700);
    std::uint32_t first = settings.height;
    std::uint32_t last = 0;
    for (std::uint32_t y = 0; y < settings.height; ++y)
        for (std::uint32_t x = 0; x < settings.width; ++x)
        {
            const bool isBeside = x < 16 || x >= 32; // no ground, no horizon, no shadow
            if (isBeside)
            {
                ASSERT_EQ(luminance(picture, x, y), paper) << x << ", " << y;
            }
            if (luminance(picture, x, y) < paper - 200)
            {
                first = std::min(first, y);
                last = std::max(last, y);
            }
        }
    // Nine tenths of the height, with as much room above as below.
    EXPECT_NEAR(first, settings.height - 1 - last, 1);
    EXPECT_GT(last - first, 50u);
}

TEST(Render, OnPaperTheCameraGoesWhereItIsPut)
{
    const TreeMesh mesh = handMade({});
    RenderSettings settings = small();
    settings.backdrop = Backdrop::Paper;
    for (const float elevation : {-1.2f, 0.0f, 1.2f})
    {
        settings.cameraElevation = elevation;
        const auto picture = renderPicture(subjectOf(mesh), settings);
        ASSERT_TRUE(picture);
        EXPECT_FALSE(barkIn(*picture, 0, 10, 50).empty()) << elevation;
    }
}

TEST(Render, PictureDoesNotDependOnThreads)
{
    const TreeMesh mesh = handMade({.sides = 24, .rings = 9});
    RenderSettings settings = small();
    settings.threads = 1;
    const auto alone = renderPicture(subjectOf(mesh), settings);
    for (const std::uint32_t threads : {0u, 2u, 3u, 7u})
    {
        settings.threads = threads;
        EXPECT_EQ(renderPicture(subjectOf(mesh), settings)->rgb, alone->rgb) << threads;
    }
}

TEST(Render, ConcurrentCallsDoNotDisturbEachOther)
{
    const TreeMesh mesh = handMade({});
    const auto alone = renderPicture(subjectOf(mesh), small());
    std::vector<Picture> pictures(3);
    std::vector<std::thread> callers;
    for (Picture& picture : pictures)
        callers.emplace_back([&] { picture = *renderPicture(subjectOf(mesh), small()); });
    for (std::thread& caller : callers)
        caller.join();
    for (const Picture& picture : pictures)
        EXPECT_EQ(picture.rgb, alone->rgb);
}

TEST(Render, SheetShowsAllTreesAtOneScaleOnOneLine)
{
    const TreeMesh high = handMade({.sides = 24, .height = 4.0f, .radius = 0.4f});
    const TreeMesh low = handMade({.sides = 24, .height = 2.0f, .radius = 0.4f, .base = {7, 0, 0}});
    const RenderSubject subjects[] = {subjectOf(high), subjectOf(low)};
    RenderSettings settings = small();
    settings.width = 100;
    settings.height = 125;
    const auto sheet = renderContactSheet(subjects, 2, settings);
    ASSERT_TRUE(sheet) << toString(sheet.error());
    const std::uint32_t gutter = (sheet->width - 200) / 3;
    EXPECT_EQ(sheet->width, 3 * gutter + 200);
    EXPECT_EQ(sheet->height, 2 * gutter + 125);
    const std::uint32_t highRows = darkRows(*sheet, gutter + 50, gutter, 125);
    const std::uint32_t lowRows = darkRows(*sheet, 2 * gutter + 150, gutter, 125);
    EXPECT_NEAR(static_cast<double>(lowRows) / highRows, 0.5, 0.08);
}

TEST(Render, LabelsStandUnderTheirTrees)
{
    const TreeMesh mesh = handMade({});
    const RenderSubject bare[] = {subjectOf(mesh), subjectOf(mesh), subjectOf(mesh)};
    const RenderSubject named[] = {subjectOf(mesh, "Oak"), subjectOf(mesh, std::string(1000, 'W')), subjectOf(mesh)};
    const auto without = renderContactSheet(bare, 2, small());
    const auto with = renderContactSheet(named, 2, small());
    ASSERT_TRUE(without && with);
    EXPECT_EQ(with->width, without->width);
    EXPECT_GE(with->height, without->height + 2 * 8);
    // The trees themselves are untouched.
    const std::size_t firstRows = std::size_t{3} * with->width * 50;
    EXPECT_TRUE(std::equal(with->rgb.begin(), with->rgb.begin() + static_cast<std::ptrdiff_t>(firstRows),
                           without->rgb.begin()));

    // Two rows of cells, each with room for a line under the picture.
    const std::uint32_t gutter = (with->width - 2 * small().width) / 3;
    const std::uint32_t caption = (with->height - without->height) / 2;
    const auto inkUnder = [&](std::uint32_t column, std::uint32_t row) {
        const std::uint32_t left = gutter + column * (small().width + gutter);
        const std::uint32_t top = gutter + row * (small().height + caption + gutter) + small().height;
        const int paper = luminance(*with, 0, 0);
        std::vector<std::uint32_t> columns;
        for (std::uint32_t y = top; y < top + caption; ++y)
            for (std::uint32_t x = 0; x < small().width; ++x)
                if (luminance(*with, left + x, y) < paper - 200)
                    columns.push_back(x);
        return columns;
    };
    const std::vector<std::uint32_t> oak = inkUnder(0, 0);
    EXPECT_GT(oak.size(), 20u); // three letters of 5 x 7, in the middle
    EXPECT_LT(oak.size(), 3u * 5 * 7);
    EXPECT_NEAR(meanOf(oak), small().width / 2.0, 2);
    EXPECT_GT(inkUnder(1, 0).size(), 2 * oak.size()); // as many letters as there is room for
    EXPECT_TRUE(inkUnder(0, 1).empty());
}

TEST(Render, TurntableTurnsTheTreeUnderStandingLight)
{
    // A trunk with a bump on +X, halfway up.
    TreeMesh mesh = handMade({.sides = 64});
    append(handMade({.sides = 32, .height = 0.4f, .radius = 0.15f, .base = {0.6f, 0.8f, 0}}), mesh);
    std::fill(mesh.uvs.begin(), mesh.uvs.end(), Vec2(0));
    RenderSettings settings = small();
    settings.samplesPerPixel = 64;
    const auto strip = renderTurntable(subjectOf(mesh), 4, settings);
    ASSERT_TRUE(strip);

    const std::uint32_t gutter = (strip->width - 4 * settings.width) / 5;
    const double sides[] = {1, 0, -1, 0}; // of the trunk on which the bump shows: right, behind or before, left
    for (std::uint32_t view = 0; view < 4; ++view)
    {
        const std::uint32_t left = gutter + view * (settings.width + gutter);
        const double trunk = meanOf(barkIn(*strip, left, gutter + 10, gutter + 18));
        const double withBump = meanOf(barkIn(*strip, left, gutter + 24, gutter + 30));
        EXPECT_NEAR(withBump - trunk, 5 * sides[view], sides[view] == 0 ? 1 : 3) << "view " << view;

        // The sun stands on the right, whichever side of the tree that is.
        const auto middle = static_cast<std::uint32_t>(trunk + 0.5);
        for (std::uint32_t y = gutter + 10; y < gutter + 18; ++y)
            EXPECT_GT(luminance(*strip, left + middle + 3, y), luminance(*strip, left + middle - 3, y) + 50)
                << "view " << view << ", row " << y;
    }
}

TEST(Render, CancelsAndReportsOnTheCallingThread)
{
    const TreeMesh mesh = handMade({});
    std::atomic<bool> cancelled = false;
    const auto caller = std::this_thread::get_id();
    double last = 0;
    Progress progress;
    progress.cancelled = &cancelled;
    progress.report = [&](std::string_view, double done) {
        EXPECT_EQ(std::this_thread::get_id(), caller);
        EXPECT_GE(done, last);
        last = done;
    };
    RenderSettings settings = small();
    settings.threads = 2;
    ASSERT_TRUE(renderTurntable(subjectOf(mesh), 3, settings, progress));
    EXPECT_EQ(last, 1);

    cancelled = true;
    const auto stopped = renderPicture(subjectOf(mesh), settings, progress);
    ASSERT_FALSE(stopped);
    EXPECT_EQ(stopped.error().kind, ErrorKind::Cancelled);
}

TEST(Render, RefusesAPaletteThatIsNotFinite)
{
    const TreeMesh mesh = handMade({});
    Appearance appearance;
    appearance.palette[2].y = kNaN;
    const auto picture = renderPicture({&mesh, &appearance, ""}, small());
    ASSERT_FALSE(picture);
    EXPECT_EQ(picture.error().kind, ErrorKind::BadInput);
}

TEST(Render, PartsHaveTheirColours)
{
    Appearance appearance;
    appearance.palette = {{0.05f, 0.4f, 0.05f}, {0.5f, 0.05f, 0.05f}};
    appearance.bark.colour = {0.05f, 0.05f, 0.5f};
    for (const float sun : {kSunInFront, kSunBehind})
    {
        const DVec3 leaf = middleOf(square(MeshMaterial::Surface, 0), appearance, sun);
        const DVec3 petal = middleOf(square(MeshMaterial::Surface, 1), appearance, sun);
        const DVec3 beyond = middleOf(square(MeshMaterial::Surface, 9), appearance, sun);
        const DVec3 stem = middleOf(square(MeshMaterial::Bark, 1), appearance, sun);
        const DVec3 bark = middleOf(square(MeshMaterial::Bark, 0), appearance, sun);
        EXPECT_GT(leaf.y, leaf.x + 30);
        EXPECT_GT(petal.x, petal.y + 30);
        EXPECT_EQ(beyond, petal);
        EXPECT_GT(stem.x, stem.y + 30);
        EXPECT_GT(bark.z, bark.y + 30);
    }
}

TEST(Render, LeavesGlowAgainstTheSunAndWoodDoesNot)
{
    const Appearance appearance;
    const double leaf = middleOf(square(MeshMaterial::Surface, 1), appearance, kSunBehind).y;
    const double wood = middleOf(square(MeshMaterial::Bark, 1), appearance, kSunBehind).y;
    const double lit = middleOf(square(MeshMaterial::Surface, 1), appearance, kSunInFront).y;
    EXPECT_GT(leaf, wood + 20);
    EXPECT_GT(leaf, 0.7 * lit);
}

TEST(Render, LeavesLookAlikeFromBothSides)
{
    const TreeMesh front = square(MeshMaterial::Surface, 0);
    TreeMesh back = front;
    std::swap(back.indices[1], back.indices[2]);
    std::swap(back.indices[4], back.indices[5]);
    for (Vec3& normal : back.normals)
        normal = -normal;
    for (const float sun : {kSunInFront, kSunBehind})
    {
        const DVec3 difference = middleOf(front, kBark, sun) - middleOf(back, kBark, sun);
        EXPECT_LT(glm::length(difference), 3);
    }
}

} // namespace espalier
