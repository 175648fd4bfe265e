#pragma once

#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

namespace espalier {

/// An allocator whose vectors leave new elements as the memory is: for arrays of numbers that are resized once and then
/// written whole, where filling them with zeros first would cost as much as the work itself.
template <class T>
struct RawAllocator : std::allocator<T>
{
    static_assert(std::is_trivially_copyable_v<T>);
    template <class U>
    struct rebind
    {
        using other = RawAllocator<U>;
    };
    template <class U>
    void construct(U* at) noexcept
    {
        ::new (static_cast<void*>(at)) U;
    }
    template <class U, class... Arguments>
    void construct(U* at, Arguments&&... arguments)
    {
        ::new (static_cast<void*>(at)) U(std::forward<Arguments>(arguments)...);
    }
};

/// `resize` does not initialise: whoever grows one writes what it holds.
template <class T>
using RawVector = std::vector<T, RawAllocator<T>>;

} // namespace espalier
