#include "schedule/progress.h"

#include <packet/error.h>

#include <algorithm>
#include <chrono>
#include <string>

namespace packet {

// Often enough that a job ends at once for those who watch it, and that a bar moves smoothly.
static constexpr std::chrono::milliseconds kInterval{5};
static constexpr float kStep = 0.01f;

static std::int64_t ticks(std::chrono::steady_clock::duration time) { return time.count(); }

void Progress::start_phase(double share) noexcept {
    base_ += share_;
    share_ = share;
    part_ = 0.0;
}

float Progress::fraction() const noexcept {
    const double part = std::min(part_.load(std::memory_order_relaxed), 1.0);
    return static_cast<float>(std::min(base_ + share_ * part, 1.0));
}

void Progress::check() {
    if (is_stopped_.load(std::memory_order_relaxed)) throw Stopped{};
    const std::int64_t now = ticks(std::chrono::steady_clock::now().time_since_epoch());
    if (now < next_time_.load(std::memory_order_relaxed) &&
        fraction() < next_fraction_.load(std::memory_order_relaxed)) {
        return;
    }
    if (is_telling_.test_and_set(std::memory_order_acquire)) return;
    tell(fraction());
}

void Progress::report(float fraction) {
    if (!is_wanted()) return;
    // The job's threads have joined, and none is telling.
    (void)is_telling_.test_and_set(std::memory_order_acquire);
    tell(fraction);
}

/// is_telling_ is set.
void Progress::tell(float fraction) {
    try {
        if (!report_(fraction))
            throw Error(ErrorCode::kCancelled, std::string(job_) + " was cancelled");
    } catch (...) {
        failure_ = std::current_exception();
        is_stopped_ = true;
        throw Stopped{};  // nobody tells any more
    }
    const auto now = std::chrono::steady_clock::now().time_since_epoch();
    next_time_ = ticks(now + kInterval);
    next_fraction_ = fraction + kStep;
    is_telling_.clear(std::memory_order_release);
}

}  // namespace packet
