#pragma once

#include <cmath>

namespace espalier {

/// True if no component of a vector, of any length and precision, is NaN or infinite.
template <class Vector>
[[nodiscard]] bool isFinite(const Vector& v) noexcept
{
    for (int i = 0; i < Vector::length(); ++i)
        if (!std::isfinite(v[i]))
            return false;
    return true;
}

} // namespace espalier
