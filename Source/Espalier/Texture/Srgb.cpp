#include <Espalier/Texture/Srgb.h>

#include <Espalier/Core/DeterministicMath.h>
#include <array>

namespace espalier {
namespace {

double linearOf(double srgb)
{
    return srgb <= 0.04045 ? srgb / 12.92 : math::pow((srgb + 0.055) / 1.055, 2.4);
}

constexpr std::size_t kSteps = 1u << 16; // the darkest bytes are 20 of them apart

struct Tables
{
    std::array<float, 256> linear;
    std::array<std::uint8_t, kSteps + 1> srgb;

    Tables()
    {
        for (std::size_t i = 0; i < linear.size(); ++i)
            linear[i] = static_cast<float>(linearOf(static_cast<double>(i) / 255));
        std::size_t step = 0;
        for (std::size_t i = 0; i < linear.size(); ++i)
        {
            const double above = i == 255 ? 2 : linearOf((static_cast<double>(i) + 0.5) / 255);
            for (; step <= kSteps && static_cast<double>(step) < above * kSteps; ++step)
                srgb[step] = static_cast<std::uint8_t>(i);
        }
    }
};

const Tables& tables() noexcept
{
    static const Tables made;
    return made;
}

} // namespace

std::uint8_t srgbFromLinear(float linear) noexcept
{
    const float bounded = linear > 0 ? (linear < 1 ? linear : 1.f) : 0.f;
    return tables().srgb[static_cast<std::size_t>(bounded * static_cast<float>(kSteps) + 0.5f)];
}

float linearFromSrgb(std::uint8_t srgb) noexcept
{
    return tables().linear[srgb];
}

} // namespace espalier
