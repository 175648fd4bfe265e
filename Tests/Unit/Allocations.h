#pragma once

#include <atomic>
#include <cstdint>

#if defined(__SANITIZE_ADDRESS__)
#define ESPALIER_COUNTS_ALLOCATIONS 0 // the sanitizer has an operator new of its own
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define ESPALIER_COUNTS_ALLOCATIONS 0
#endif
#endif
#ifndef ESPALIER_COUNTS_ALLOCATIONS
#define ESPALIER_COUNTS_ALLOCATIONS 1
#endif

namespace espalier::allocations {

// What `new` has been asked for so far, by all threads; what was given back is not taken off. The operators are in
// Species/GrowTests.cpp.
extern std::atomic<std::uint64_t> count;
extern std::atomic<std::uint64_t> bytes;

} // namespace espalier::allocations
