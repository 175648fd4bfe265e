#pragma once

#include <Espalier/Core/Progress.h>
#include <algorithm>
#include <atomic>
#include <cstdint>
#include <system_error>
#include <thread>
#include <vector>

namespace espalier {

/// Threads that work is spread over: `wanted`, or one per processor if that is 0.
[[nodiscard]] inline std::uint32_t threadsFor(std::uint32_t wanted) noexcept
{
    return wanted > 0 ? wanted : std::max(1u, std::thread::hardware_concurrency());
}

/// Calls `task(0 .. count - 1)`, each once, on `threads` threads of which the calling one is the first;
/// `onCaller(taken)` runs between tasks there. Stops early when `progress` asks for it. What a task writes must be its
/// own, and then nothing depends on the threads; it must not throw.
template <class Task, class OnCaller>
void forEachTask(std::uint32_t count, std::uint32_t threads, const Progress& progress, const Task& task,
                 const OnCaller& onCaller)
{
    std::atomic<std::uint32_t> next = 0;
    const auto takeTask = [&] {
        const std::uint32_t mine = next.fetch_add(1, std::memory_order_relaxed);
        if (mine >= count || progress.wantsStop())
            return false;
        task(mine);
        return true;
    };
    std::vector<std::jthread> workers; // which join, whatever happens
    try
    {
        while (workers.size() + 1 < std::min(threads, count))
            workers.emplace_back([&] {
                while (takeTask())
                    ;
            });
    }
    catch (const std::system_error&)
    {
        // The system grants no more threads: the ones there are do the work.
    }
    while (takeTask())
        onCaller(std::min(next.load(std::memory_order_relaxed), count));
    workers.clear();
}

} // namespace espalier
