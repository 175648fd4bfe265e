#include <Espalier/Core/Tasks.h>

#include <gtest/gtest.h>

namespace espalier {

TEST(Tasks, AreEachDoneOnceByAnyNumberOfThreads)
{
    for (const std::uint32_t count : {0u, 1u, 3u, 1000u})
        for (const std::uint32_t threads : {1u, 2u, 5u})
        {
            std::vector<std::atomic<int>> done(count);
            std::uint32_t told = 0;
            forEachTask(
                count, threads, {}, [&](std::uint32_t i) { ++done[i]; },
                [&](std::uint32_t taken) {
                    EXPECT_LE(taken, count);
                    told = std::max(told, taken);
                });
            for (const std::atomic<int>& times : done)
                EXPECT_EQ(times.load(), 1) << count << " tasks, " << threads << " threads";
            EXPECT_TRUE(threads > 1 || told == count);
        }
}

TEST(Tasks, StopWhenTheyAreCancelled)
{
    std::atomic<bool> cancelled = false;
    Progress progress;
    progress.cancelled = &cancelled;
    std::atomic<int> done = 0;
    forEachTask(
        1000, 1, progress, [&](std::uint32_t i) { done += i == 9 ? (cancelled = true, 1) : 1; }, [](std::uint32_t) {});
    EXPECT_EQ(done.load(), 10);
}

} // namespace espalier
