#pragma once

#include <atomic>
#include <functional>
#include <string_view>

namespace espalier {

/// How long work tells its caller where it is, and how the caller stops it. Both parts are optional.
struct Progress
{
    /// Called on the working thread, now and then, with the stage's name and how much of it is done, in [0, 1].
    std::function<void(std::string_view stage, double done)> report;

    /// Set it from any thread: the work returns ErrorKind::Cancelled soon and publishes nothing.
    const std::atomic<bool>* cancelled = nullptr;

    void operator()(std::string_view stage, double done) const
    {
        if (report)
            report(stage, done);
    }
    [[nodiscard]] bool wantsStop() const noexcept { return cancelled && cancelled->load(std::memory_order_relaxed); }
};

} // namespace espalier
