#include <Espalier/Species/LeafOutline.h>

#include <Espalier/Core/DeterministicMath.h>
#include <Espalier/Core/Random.h>
#include <algorithm>
#include <cmath>

namespace espalier {
namespace {

constexpr float kStalkHalfWidth = 0.012f; // in lengths of the leaf
constexpr float kHeartRadius = 0.11f;     // of a blossom, in shares of the way to either edge

/// x^a (1 - x)^b, divided by its greatest value: a leaf that is widest at a / (a + b), round where an exponent is below
/// one and pointed where it is above.
float arc(float x, double a, double b)
{
    const double t = static_cast<double>(x);
    const double widest = a / (a + b);
    return static_cast<float>(math::pow(t / widest, a) * math::pow((1 - t) / (1 - widest), b));
}

/// A lobe of an oak's leaf: where it ends, foot to tip, and half widths at its middle and in the bay behind it.
struct Lobe
{
    float end;
    float reach;
    float bay;
};
constexpr Lobe kLobes[] = {{0.13f, 0.19f, 0.15f}, {0.29f, 0.52f, 0.29f}, {0.46f, 0.82f, 0.42f},
                           {0.64f, 1.00f, 0.52f}, {0.81f, 0.86f, 0.46f}, {1.00f, 0.52f, 0.00f}};

/// Broad round lobes with rounded bays between them, and a round tip.
float lobed(float x)
{
    float start = 0;
    float bay = 0;
    for (const Lobe& lobe : kLobes)
    {
        if (x < lobe.end)
        {
            const float t = (x - start) / (lobe.end - start);
            const float middle = 4 * t * (1 - t); // 1 there, 0 in the bays
            const float round = std::sqrt(middle);
            const bool isTip = lobe.bay == 0 && t > 0.5f;
            const float bulge = isTip ? round : 0.7f * middle * middle * (3 - 2 * middle) + 0.3f * round;
            const float between = isTip ? 0.f : lobe.bay > 0 ? bay + t * (lobe.bay - bay) : bay;
            return between + (lobe.reach - between) * bulge;
        }
        start = lobe.end;
        bay = lobe.bay;
    }
    return 0;
}

/// 0 at whole numbers, rising to 1 and falling back at once: teeth that point to the tip.
float tooth(float x)
{
    const float t = x - std::floor(x);
    return t < 0.82f ? t / 0.82f : (1 - t) / 0.18f;
}

/// A rounded triangle with a point; large teeth carry small ones.
float deltoid(float x)
{
    constexpr float kWidest = 0.28f;
    if (x < kWidest)
        return arc(x / (2 * kWidest), 0.7, 0.7);
    const float t = (x - kWidest) / (1 - kWidest);
    const float outline = (1 - t) * (1 + 0.9f * t * (1 - t) * (1 - 1.6f * t));
    return outline * (1 - (0.10f * tooth(9 * t) + 0.05f * tooth(27 * t)) * std::min(1.f, 8 * t));
}

/// How wide a leaf of a spray is, in its own lengths.
float usualWidth(LeafShape shape)
{
    switch (shape)
    {
    case LeafShape::Ovate:
    case LeafShape::Lobed:
        return 0.58f;
    case LeafShape::Lanceolate:
        return 0.2f;
    case LeafShape::Deltoid:
        return 0.75f;
    case LeafShape::Linear:
        return 0.08f;
    case LeafShape::Needle:
        return 0.07f;
    case LeafShape::Blossom:
        return 0.7f;
    }
    return 0.5f;
}

float lengthOf(Vec2 v)
{
    return std::sqrt(v.x * v.x + v.y * v.y);
}

std::vector<LeafOnSurface> petals(float halfWidth, float usual)
{
    std::vector<LeafOnSurface> leaves;
    const Vec2 middle(0, 0.5f);
    for (int i = 0; i < 5; ++i)
    {
        const math::SinCos turn = math::sinCosDegrees(72.0 * i);
        const Vec2 reach(halfWidth * static_cast<float>(turn.sin), 0.5f * static_cast<float>(turn.cos));
        leaves.push_back({middle, middle + reach, 0.5f * usual * lengthOf(reach), 0});
    }
    return leaves;
}

/// Leaves of a spray turn from outwards, at its foot, to forwards. Radians from the shoot.
struct Spread
{
    double lowest;
    double highest;
};

Spread spreadOf(LeafShape shape)
{
    switch (shape)
    {
    case LeafShape::Needle:
        return {1.0, 0.65};
    case LeafShape::Linear:
        return {1.15, 0.55};
    default:
        return {1.22, 0.6};
    }
}

/// Two ranks along the midline; lower leaves lie over upper ones, as on a shoot seen from above. No two are quite
/// alike.
std::vector<LeafOnSurface> spray(const LeafAppearance& leaf, float length, float shootEnd, float usual)
{
    const Spread spread = spreadOf(leaf.shape);
    const float halfWidth = 0.5f * leaf.width;
    const RandomKey key(Seed{1});
    std::vector<LeafOnSurface> leaves;
    const std::uint32_t ranked = leaf.leaves - 1;
    for (std::uint32_t i = 0; i < ranked; ++i)
    {
        const double turn = key.child(i).uniform(Purpose::Sampling, -0.09, 0.09, 0);
        const auto shorter = static_cast<float>(key.child(i).uniform(Purpose::Sampling, 0, 0.14, 1));
        const float share = (static_cast<float>(i) + 0.5f) / static_cast<float>(ranked);
        const Vec2 foot(0, 0.05f + (shootEnd - 0.05f) * share);
        const math::SinCos way =
            math::sinCos(spread.lowest + (spread.highest - spread.lowest) * static_cast<double>(share) + turn);
        const auto out = static_cast<float>(way.sin);
        const auto up = static_cast<float>(way.cos);
        // The longest just reach the surface's edges; those at the end are shorter, which rounds the spray.
        const float reach =
            std::min({length * (1 - 0.25f * share) * (1 - shorter), halfWidth / out, (1 - foot.y) / up});
        const float side = i % 2 == 0 ? 1.f : -1.f;
        leaves.push_back({foot, foot + reach * Vec2(side * out, up), 0.5f * usual * reach, leaf.stalk});
    }
    const float terminal = 1 - shootEnd;
    leaves.push_back({{0, shootEnd}, {0, 1}, std::min(0.5f * usual * terminal, halfWidth), leaf.stalk});
    return leaves;
}

} // namespace

float halfWidthOf(LeafShape shape, float along) noexcept
{
    if (!(along > 0 && along < 1))
        return 0;
    switch (shape)
    {
    case LeafShape::Ovate:
        return arc(along, 0.75, 1.15);
    case LeafShape::Lobed:
        return lobed(along);
    case LeafShape::Lanceolate:
        return arc(along, 0.6, 0.95);
    case LeafShape::Deltoid:
        return deltoid(along);
    case LeafShape::Linear:
        return std::min({1.f, along / 0.06f, (1 - along) / 0.55f});
    case LeafShape::Needle:
        return std::min({1.f, 0.5f + along / 0.1f, std::sqrt((1 - along) / 0.3f)});
    case LeafShape::Blossom:
        return arc(along, 0.9, 0.4);
    }
    return 0;
}

LeafSurface::LeafSurface(const LeafAppearance& leaf)
    : shape_(leaf.shape), isBall_(leaf.form == LeafForm::Ball), width_(leaf.width)
{
    const float halfWidth = 0.5f * leaf.width;
    const float usual = usualWidth(leaf.shape);
    if (leaf.shape == LeafShape::Blossom)
        leaves_ = petals(halfWidth, usual);
    else if (leaf.leaves <= 1)
        leaves_ = {{{0, 0}, {0, 1}, halfWidth, leaf.stalk}};
    else
    {
        const float length = halfWidth / static_cast<float>(math::sin(spreadOf(leaf.shape).lowest));
        shootEnd_ = std::clamp(1 - 0.85f * length, 0.4f, 0.95f);
        shootWidth_ = kStalkHalfWidth;
        leaves_ = spray(leaf, length, shootEnd_, usual);
    }
}

std::optional<SurfacePoint> LeafSurface::at(Vec2 uv) const noexcept
{
    const Vec2 point((uv.x - 0.5f) * width_, uv.y);
    if (isBall_)
        return SurfacePoint{0, uv.y, 2 * uv.x - 1};
    if (shape_ == LeafShape::Blossom)
    {
        const Vec2 heart(2 * uv.x - 1, 2 * uv.y - 1);
        const float away = lengthOf(heart) / kHeartRadius;
        if (away <= 1)
            return SurfacePoint{SurfacePoint::kShoot, away, heart.x / kHeartRadius};
    }
    for (std::uint32_t i = 0; i < leaves_.size(); ++i)
    {
        const LeafOnSurface& leaf = leaves_[i];
        const Vec2 way = leaf.tip - leaf.foot;
        const float length = lengthOf(way);
        const Vec2 arm = point - leaf.foot;
        const float share = (arm.x * way.x + arm.y * way.y) / (length * length);
        const float aside = (arm.x * way.y - arm.y * way.x) / length; // to the right of the way up
        const float along = (share - leaf.stalk) / (1 - leaf.stalk);
        if (share < 0 || share > 1 || std::abs(aside) > leaf.halfWidth)
            continue;
        const float half = leaf.halfWidth * halfWidthOf(shape_, along);
        if (half > 0 && std::abs(aside) <= half)
            return SurfacePoint{i, along, aside / half};
        const float stalk = std::min(kStalkHalfWidth * length, leaf.halfWidth);
        if (leaf.stalk > 0 && share >= 0 && along <= 0 && std::abs(aside) <= stalk)
            return SurfacePoint{i, along, aside / stalk};
    }
    if (shootWidth_ > 0 && point.y <= shootEnd_)
    {
        const float along = point.y / shootEnd_;
        const float half = shootWidth_ * (1 - 0.65f * along);
        if (std::abs(point.x) <= half)
            return SurfacePoint{SurfacePoint::kShoot, along, point.x / half};
    }
    return std::nullopt;
}

float LeafSurface::coverage() const noexcept
{
    constexpr int kSteps = 64;
    int covered = 0;
    for (int y = 0; y < kSteps; ++y)
        for (int x = 0; x < kSteps; ++x)
            covered += at({(static_cast<float>(x) + 0.5f) / kSteps, (static_cast<float>(y) + 0.5f) / kSteps}) ? 1 : 0;
    return static_cast<float>(covered) / (kSteps * kSteps);
}

} // namespace espalier
